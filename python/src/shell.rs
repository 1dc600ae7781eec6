//! Words of a command -> what a shell takes for them. Pure.
//!
//! A command is printed to be pasted, and files and topics are called whatever somebody chose: no name may end a word or start
//! another command.

use std::fmt::Write as _;
use std::path::Path;
use strapd_recording::text::is_printable;

/// `word` as one word of a POSIX shell: as it is where that is safe, else in quotes; what no terminal should be sent, as what
/// `printf` makes of it.
pub fn quoted(word: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"_@%+=:,./-".contains(&b);
    if !word.is_empty() && !word.starts_with('=') && word.bytes().all(plain) {
        return word.to_owned();
    }
    if is_printable(word) {
        return format!("'{}'", word.replace('\'', r"'\''"));
    }
    let mut octal = String::new();
    for byte in word.bytes() {
        let _ = write!(octal, "\\{byte:03o}");
    }
    format!("\"$(printf -- '{octal}')\"")
}

/// A file's name where a command takes it: one that begins with a dash is no flag.
pub fn quoted_file(path: &Path) -> String {
    let name = path.to_string_lossy();
    match name.starts_with('-') {
        true => quoted(&format!("./{name}")),
        false => quoted(&name),
    }
}

/// `--flag VALUE`, or `--flag=VALUE` where the value begins with a dash.
pub fn flag(name: &str, value: &str) -> String {
    let joint = if value.starts_with('-') { '=' } else { ' ' };
    format!("{name}{joint}{}", quoted(value))
}
