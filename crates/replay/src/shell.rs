//! Words of a command -> what a shell takes for them. Pure.
//!
//! Commands are printed to be pasted, and files and logs are called whatever somebody chose: no name may end
//! a word, start another command, or reach the terminal as anything but text.

use std::ffi::OsStr;
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
