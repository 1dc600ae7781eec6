//! Promise: text that is printed to be pasted works, whatever a log calls its topics and whoever named the file.

use crate::made_logs::{bytes, logged, motion};
use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;
use strapd_replay::shell::{flag, quoted, quoted_file};

/// Names that somebody could give a file, a topic or a frame, to be pasted into a shell.
const HOSTILE: [&str; 22] = [
    "/imu/data_raw",
    "",
    " ",
    "a b",
    "it's",
    "\"q\"",
    "$(touch x)",
    "`touch x`",
    "a;touch x",
    "a\ntouch x",
    "a\n",
    "\n\n",
    "-x",
    "--topic",
    "~root",
    "=ls",
    "*?[a]{b,c}",
    "a\\b%s%n",
    "\u{1b}]0;owned\u{7}",
    "a\u{202e}b\r",
    "!! #c & | > x < y",
    "Stra\u{df}e \u{1f600}",
];

/// The words a shell makes of `text`, in an empty directory that stays empty.
fn words(shell: &str, text: &str, path: Option<&Path>) -> Vec<Vec<u8>> {
    let dir = tempfile::tempdir().unwrap();
    let mut command = Command::new(shell);
    if let Some(path) = path {
        command.env("PATH", format!("{}:/usr/bin:/bin", path.display()));
    }
    let ran = command
        .current_dir(dir.path())
        .arg("-c")
        .arg(text)
        .output()
        .unwrap();
    assert!(
        ran.stderr.is_empty(),
        "{text}: {}",
        String::from_utf8_lossy(&ran.stderr)
    );
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "{text}");
    let mut words: Vec<Vec<u8>> = ran.stdout.split(|b| *b == 0).map(<[u8]>::to_vec).collect();
    assert_eq!(words.pop(), Some(Vec::new()), "{text}");
    words
}

#[cfg(unix)]
#[test]
fn a_shell_takes_what_is_pasted_for_the_one_word_it_was() {
    use std::os::unix::ffi::OsStrExt;
    let mut hostile: Vec<&OsStr> = HOSTILE.iter().map(OsStr::new).collect();
    hostile.push(OsStr::from_bytes(b"not UTF-8 \xff'\xfe\n"));
    for shell in ["sh", "bash"] {
        if Command::new(shell).arg("-c").arg(":").status().is_err() {
            eprintln!("{shell} is absent");
            continue;
        }
        for word in &hostile {
            let pasted = quoted(word);
            assert!(
                !pasted.chars().any(|c| c.is_control() && c != '\n'),
                "{pasted:?}"
            );
            let found = words(shell, &format!("printf '%s\\0' {pasted} end"), None);
            assert_eq!(found, [word.as_bytes(), b"end"], "{shell}: {pasted}");
        }
    }
}

#[test]
fn what_is_harmless_stays_as_it_is() {
    for word in ["/imu/data_raw", "flight.mcap", "a-b_c@d%+=:,.", "rpy=0,0,3"] {
        assert_eq!(quoted(word), word);
    }
    assert_eq!(flag("--topic", "-x"), "--topic=-x");
    assert_eq!(flag("--topic", "/a b"), "--topic '/a b'");
    assert_eq!(quoted_file(Path::new("-")), "./-");
}

/// `strapd info` of a log with two topics, the first of this name: the command it proposes, as a shell that has
/// a `strapd` which prints its arguments takes it.
#[cfg(unix)]
#[test]
fn the_next_command_names_file_and_topic_whatever_they_are_called() {
    use std::os::unix::fs::PermissionsExt;
    let bin = tempfile::tempdir().unwrap();
    let script = bin.path().join("strapd");
    std::fs::write(&script, "#!/bin/sh\nprintf '%s\\0' \"$@\"\n").unwrap();
    std::fs::set_permissions(&script, std::fs::Permissions::from_mode(0o755)).unwrap();
    for (n, topic) in HOSTILE.iter().enumerate() {
        let dir = tempfile::tempdir().unwrap();
        let file = ["log.mcap", "-l.mcap", "a 'log'$(touch x).mcap"][n % 3];
        let mut messages = logged(topic, &motion(30));
        messages.extend(logged("/other", &motion(30)));
        std::fs::write(dir.path().join(file), bytes(None, 0, &messages)).unwrap();
        let info = |more: &[&str]| {
            let ran = assert_cmd::Command::cargo_bin("strapd")
                .unwrap()
                .current_dir(dir.path())
                .args(["info", "--", file])
                .args(more)
                .output()
                .unwrap();
            String::from_utf8(ran.stdout).unwrap()
        };
        let text = info(&[]);
        let at = text.rfind("next      ").unwrap();
        let pasted = text[at..].trim_start_matches("next").trim_start();
        let found = words("sh", pasted, Some(bin.path()));
        let mut found = found.iter().map(|w| String::from_utf8(w.clone()).unwrap());
        assert_eq!(found.next().unwrap(), "replay", "{pasted}");
        let named = found.next().unwrap();
        assert_eq!(named.trim_start_matches("./"), file, "{pasted}");
        assert!(!named.starts_with('-'), "{pasted}");
        let flag = found.next().unwrap();
        let value = match flag.strip_prefix("--topic=") {
            Some(value) => value.to_owned(),
            None => {
                assert_eq!(flag, "--topic", "{pasted}");
                found.next().unwrap()
            }
        };
        assert_eq!(value, *topic, "{pasted}");
        assert_eq!(
            found.collect::<Vec<_>>(),
            ["-o", "attitude.mcap"],
            "{pasted}"
        );
    }
}
