//! Words of a command -> what a shell takes for them. Pure.
//!
//! Commands are printed to be pasted, and files and logs are called whatever somebody chose: no name may end
//! a word, start another command, or reach the terminal as anything but text.

use crate::sink::address::printable_address;
use std::ffi::{OsStr, OsString};
use std::fmt::Write as _;
use std::path::Path;

/// `word` as one word of a POSIX shell, fit for a terminal: as it is where that is safe, else in single quotes,
/// and where it has what no terminal should be sent, as what `printf` makes of it.
#[must_use]
pub fn quoted(word: impl AsRef<OsStr>) -> String {
    let word = word.as_ref();
    let plain = |b: &u8| b.is_ascii_alphanumeric() || b"_@%+=:,./-".contains(b);
    match word.to_str() {
        // An assignment of zsh: =command.
        Some(text)
            if !text.is_empty() && !text.starts_with('=') && text.bytes().all(|b| plain(&b)) =>
        {
            text.to_owned()
        }
        Some(text) if strapd_recording::text::is_printable(text) => {
            format!("'{}'", text.replace('\'', r"'\''"))
        }
        _ => made_by_printf(word.as_encoded_bytes()),
    }
}

/// `"$(printf '...')"`, and behind it the line feeds at its end, which a substitution takes away.
fn made_by_printf(bytes: &[u8]) -> String {
    let ends = bytes.iter().rev().take_while(|b| **b == b'\n').count();
    let (rest, ends) = bytes.split_at(bytes.len() - ends);
    let mut out = String::new();
    if !rest.is_empty() {
        // A format that begins with a dash would be an option.
        out.push_str("\"$(printf -- '");
        for byte in rest {
            match byte {
                b'%' => out.push_str("%%"),
                b'\\' => out.push_str(r"\\"),
                b'\'' => out.push_str(r"\047"),
                b' '..=b'~' => out.push(char::from(*byte)),
                _ => {
                    let _ = write!(out, "\\{byte:03o}");
                }
            }
        }
        out.push_str("')\"");
    }
    if !ends.is_empty() {
        let _ = write!(out, "'{}'", "\n".repeat(ends.len()));
    }
    out
}

/// A file's name where a command takes it: one that begins with a dash is no flag, and not standard input.
#[must_use]
pub fn quoted_file(path: &Path) -> String {
    if path.as_os_str().as_encoded_bytes().starts_with(b"-") {
        quoted(Path::new(".").join(path))
    } else {
        quoted(path)
    }
}

/// `--flag VALUE`, or `--flag=VALUE` where the value begins with a dash.
#[must_use]
pub fn flag(name: &str, value: &str) -> String {
    let joint = if value.starts_with('-') { '=' } else { ' ' };
    format!("{name}{joint}{}", quoted(value))
}

/// This process's own command as outputs keep it: files by their names, without folders, unless `with_paths`; addresses as they
/// are printed, without passwords and keys.
#[must_use]
pub fn recorded_command(with_paths: bool) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut before = std::ffi::OsString::new();
    for word in std::env::args_os() {
        words.push(quoted(kept(&word, &before, with_paths)));
        before = word;
    }
    words.join(" ")
}

/// Flags whose values have slashes and are no files.
const TOPICS: [&str; 5] = [
    "--topic",
    "--accel-topic",
    "--mag-topic",
    "--ref-topic",
    "--against-recorded",
];

/// A word of a command as it is kept; `before` is the word before it.
fn kept(word: &OsStr, before: &OsStr, with_paths: bool) -> OsString {
    let Some(text) = word.to_str() else {
        let name = Path::new(word).file_name();
        return name.filter(|_| !with_paths).unwrap_or(word).to_owned();
    };
    let (flag, value) = match text.split_once('=') {
        Some((flag, _)) if flag.starts_with("--") => (flag, text.get(flag.len() + 1..)),
        _ if text.starts_with("-o") => ("-o", text.get(2..)),
        _ => ("", Some(text)),
    };
    let value = value.unwrap_or_default();
    let head = text.strip_suffix(value).unwrap_or_default();
    if value.contains("://") {
        return format!("{head}{}", printable_address(value)).into();
    }
    let of = |flags: &[&str]| flags.iter().any(|f| *f == flag || OsStr::new(f) == before);
    if with_paths || of(&TOPICS) || !is_path(value, of(&["-o"])) {
        return word.to_owned();
    }
    let mut out = OsString::from(head);
    out.push(Path::new(value).file_name().unwrap_or_default());
    out
}

/// Whether a word is a path with folders: it says so, or there is such a folder.
fn is_path(value: &str, is_output: bool) -> bool {
    let path = Path::new(value);
    let has_folder = path.parent().is_some_and(|p| !p.as_os_str().is_empty());
    let says_so = path.is_absolute() || ["./", "../", "~/"].iter().any(|p| value.starts_with(p));
    has_folder && (is_output || says_so || path.exists() || path.parent().is_some_and(Path::exists))
}

#[cfg(test)]
mod kept_words {
    use super::*;

    #[test]
    fn folders_are_left_out_and_topics_are_not_folders() {
        for (before, word, without) in [
            ("", "/usr/bin/strapd", "strapd"),
            ("replay", "/home/ada/secret/a.mcap", "a.mcap"),
            ("replay", "../secret/a.mcap", "a.mcap"),
            ("replay", "src/lib.rs", "lib.rs"),
            ("-o", "no/such/folder/x.csv", "x.csv"),
            ("a", "-o/home/ada/x.csv", "-ox.csv"),
            ("a", "--state=/home/ada/s.json", "--state=s.json"),
            ("--topic", "/imu/data", "/imu/data"),
            ("a", "--topic=/imu/data", "--topic=/imu/data"),
            ("--noise", "arw=0.1/0.2/0.3", "arw=0.1/0.2/0.3"),
            ("--shard", "0/4", "0/4"),
            ("--init", "q=1,0,0,0", "q=1,0,0,0"),
            ("a", "-", "-"),
            (
                "serve",
                "ws://u:p@h:1/x?k=v&id=l",
                "ws://...@h:1/x?k=...&id=...",
            ),
            ("a", "--listen=tcp-listen://:1", "--listen=tcp-listen://:1"),
        ] {
            let kept = |with| kept(OsStr::new(word), OsStr::new(before), with);
            assert_eq!(kept(false).to_str(), Some(without), "{word}");
            let is_address = word.contains("://");
            assert_eq!(kept(true) == word, !is_address || without == word, "{word}");
        }
    }
}
