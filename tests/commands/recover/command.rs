//! The command: exit codes, what it says, and what it refuses.

use super::{furnished, walked};
use crate::program::ended;
use std::path::Path;
use std::process::{Command, Output};

fn strapd(dir: &Path, arguments: &str, stdin: Vec<u8>) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_strapd"));
    command
        .current_dir(dir)
        .env_remove("STRAPD_LOG")
        .args(arguments.split_whitespace());
    ended(&command, stdin)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A folder with a whole log and one cut in the middle.
fn folder() -> (tempfile::TempDir, Vec<u8>) {
    let dir = tempfile::tempdir().unwrap();
    let bytes = furnished(Some(Some(mcap::Compression::Zstd)), 60);
    std::fs::write(dir.path().join("whole.mcap"), &bytes).unwrap();
    std::fs::write(dir.path().join("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    (dir, bytes)
}

#[test]
fn nothing_damaged_is_exit_0_and_something_damaged_is_exit_3_with_the_place() {
    let (dir, bytes) = folder();
    let ran = strapd(dir.path(), "recover whole.mcap -o a.mcap", Vec::new());
    assert_eq!(ran.status.code(), Some(0), "{ran:?}");
    let said = text(&ran.stdout);
    assert!(said.contains("nothing was damaged"), "{said}");
    assert!(said.contains("/imu  pkg/Type [cdr]  40 messages"), "{said}");
    assert!(
        said.contains("2 attachments") && said.contains("2 metadata records"),
        "{said}"
    );

    let ran = strapd(dir.path(), "recover cut.mcap -o b.mcap", Vec::new());
    assert_eq!(ran.status.code(), Some(3), "{ran:?}");
    let said = text(&ran.stdout);
    assert!(said.contains("cut.mcap: damaged in 1 place"), "{said}");
    assert!(said.contains("the file is cut"), "{said}");

    // From a pipe the same file comes out.
    let piped = strapd(
        dir.path(),
        "recover - -o c.mcap -q",
        bytes[..bytes.len() / 2].to_vec(),
    );
    assert_eq!(piped.status.code(), Some(3), "{piped:?}");
    assert_eq!(text(&piped.stdout), "");
    assert!(text(&piped.stderr).contains(" B not used"), "{piped:?}");
    let [b, c] = ["b.mcap", "c.mcap"].map(|name| std::fs::read(dir.path().join(name)).unwrap());
    assert!(b == c);
}

#[test]
fn the_json_says_what_was_salvaged_and_what_was_not() {
    let (dir, _) = folder();
    let ran = strapd(dir.path(), "recover cut.mcap -o b.mcap --json", Vec::new());
    assert_eq!(ran.status.code(), Some(3), "{ran:?}");
    let said: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    let (messages, survey) = walked(&dir.path().join("cut.mcap"));
    assert_eq!(said["messages"], messages.len());
    assert_eq!(said["damaged"], true);
    assert_eq!(said["input_bytes"], survey.file_size.unwrap());
    let imu = messages.iter().filter(|m| m.0 == "/imu").count();
    assert_eq!(said["topics"][0]["topic"], "/imu");
    assert_eq!(said["topics"][0]["messages"], imu);
    let problem = &survey.problems.first()[0];
    assert_eq!(said["problems"][0]["offset"], problem.offset);
    // Everything behind the last whole record is skipped, and nothing else.
    let skipped = survey.file_size.unwrap() - problem.offset;
    assert_eq!(said["bytes_skipped"], skipped, "{said}");
}

#[test]
fn an_existing_output_and_the_input_itself_are_not_overwritten() {
    let (dir, bytes) = folder();
    let at = |name: &str| dir.path().join(name);
    std::fs::write(at("there.mcap"), b"precious").unwrap();
    let refused = |arguments: &str, code: i32, word: &str| {
        let ran = strapd(dir.path(), arguments, Vec::new());
        let said = text(&ran.stderr);
        assert_eq!(ran.status.code(), Some(code), "{arguments}: {said}");
        assert!(said.contains(word), "{arguments}: {said}");
    };
    refused("recover cut.mcap -o there.mcap", 1, "--force");
    assert_eq!(std::fs::read(at("there.mcap")).unwrap(), b"precious");
    refused("recover whole.mcap -o whole.mcap", 1, "is the input");
    refused(
        "recover whole.mcap -o ./whole.mcap --force",
        1,
        "is the input",
    );
    std::fs::hard_link(at("whole.mcap"), at("link.mcap")).unwrap();
    refused("recover whole.mcap -o link.mcap --force", 1, "is the input");
    assert!(std::fs::read(at("whole.mcap")).unwrap() == bytes);
    refused("recover whole.mcap -o x.csv", 2, ".mcap");
    refused("recover whole.mcap -o -", 2, ".mcap");
    refused("recover whole.mcap", 2, "--output");
    refused("recover absent.mcap -o x.mcap", 1, "absent.mcap");
    std::fs::write(at("no.mcap"), b"not an MCAP").unwrap();
    refused("recover no.mcap -o x.mcap", 1, "no format that is read");
    refused("recover whole.mcap -o absent/x.mcap", 1, "does not exist");
    assert!(!at("x.mcap").exists() && !at(".x.mcap.part").exists());

    let ran = strapd(
        dir.path(),
        "recover cut.mcap -o there.mcap --force",
        Vec::new(),
    );
    assert_eq!(ran.status.code(), Some(3), "{ran:?}");
    assert!(!walked(&at("there.mcap")).0.is_empty());
}
