//! Completions, manual pages, help: made by the binary itself.

use super::{names, strapd};
use std::process::Command;

const COMMANDS: [&str; 9] = [
    "replay",
    "info",
    "compare",
    "cat",
    "serve",
    "watch",
    "model",
    "completions",
    "man",
];

#[test]
fn completions_for_every_shell_know_every_command() {
    let dir = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let ran = strapd(dir.path(), &format!("completions {shell}"));
        ran.done();
        for command in COMMANDS {
            assert!(ran.out.contains(command), "{shell}: {command} is missing");
        }
        assert!(ran.out.contains("sample-kind"), "{shell}");
        // Where the shell is there, it must be able to read it.
        if ["bash", "zsh", "fish"].contains(&shell) {
            let script = dir.path().join("script");
            std::fs::write(&script, &ran.out).unwrap();
            match Command::new(shell).arg("-n").arg(&script).output() {
                Ok(read) => assert!(read.status.success(), "{shell}: {read:?}"),
                Err(_) => eprintln!("{shell} is not installed: its syntax was not checked"),
            }
        }
    }
    strapd(dir.path(), "completions csh").refused(2, &["csh", "bash"]);
}

#[test]
fn the_manual_is_one_page_on_stdout_or_one_per_command_in_a_directory() {
    let dir = tempfile::tempdir().unwrap();
    let page = strapd(dir.path(), "man");
    assert!(page.done().out.contains(".TH strapd"), "{}", page.out);
    strapd(dir.path(), "man --out-dir .").done();
    let pages = names(dir.path());
    for command in COMMANDS {
        let name = format!("strapd-{command}.1");
        assert!(pages.contains(&name), "{name} is missing: {pages:?}");
    }
    std::fs::write(dir.path().join("taken"), "").unwrap();
    strapd(dir.path(), "man --out-dir taken").refused(1, &["taken"]);
}

#[test]
fn help_of_every_command_has_an_example_that_the_parser_knows() {
    let dir = tempfile::tempdir().unwrap();
    for command in COMMANDS {
        let help = strapd(dir.path(), &format!("{command} --help"));
        assert!(
            help.done().out.contains("Example"),
            "{command}: {}",
            help.out
        );
    }
    let version = strapd(dir.path(), "--version");
    assert_eq!(
        version.done().out,
        format!("strapd {}\n", env!("CARGO_PKG_VERSION"))
    );
}
