//! The words of this process -> its command as outputs keep it. Reads the arguments and whether folders exist.
//!
//! How a word is quoted is [`strapd_replay::shell`]'s.

use crate::address::Address;
use std::ffi::{OsStr, OsString};
use std::path::Path;
use strapd_replay::shell::quoted;

/// Command of this process as outputs keep it: files by their names, without folders, unless `with_paths`; addresses
/// as they are printed, without passwords and keys.
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
        return format!("{head}{}", Address::from(value)).into();
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
