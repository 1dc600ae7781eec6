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

/// Words that the generated script of bash offers behind a flag of a command.
fn offered(script: &str, command: &str, flag: &str) -> String {
    let case = script
        .split_once(&format!("\n        strapd__subcmd__{command})\n"))
        .unwrap_or_else(|| panic!("{command} is not in the script"))
        .1;
    let case = case.split_once("\n            ;;\n").map_or(case, |c| c.0);
    let behind = case
        .split_once(&format!("\n                --{flag})\n"))
        .unwrap_or_else(|| panic!("{command} has no --{flag}"))
        .1;
    behind
        .split_once("compgen -")
        .and_then(|(_, offer)| offer.lines().next())
        .unwrap_or_default()
        .to_owned()
}

#[test]
fn a_flag_that_knows_words_and_takes_others_is_completed_with_the_words() {
    let dir = tempfile::tempdir().unwrap();
    let script = strapd(dir.path(), "completions bash").done().out.clone();
    for (command, flag, words) in [
        (
            "replay",
            "init",
            "identity gravity first-orientation q= rpy=",
        ),
        ("replay", "bias", "none auto"),
        ("replay", "body", "flu frd"),
        (
            "serve",
            "init",
            "identity gravity first-orientation q= rpy=",
        ),
        ("report", "undo-truncation", "auto on off"),
        (
            "replay",
            "noise",
            "auto consumer uncalibrated industrial tactical navigation",
        ),
        ("simulate__subcmd__random", "noise", "none consumer_mems "),
        (
            "simulate__subcmd__top",
            "case",
            "cusped wavy looping steady-slow steady-fast sleeping falling",
        ),
        ("model__subcmd__top", "case", "cusped wavy looping"),
        ("send", "speed", "max 1"),
    ] {
        let offer = offered(&script, command, flag);
        assert!(
            offer.starts_with(&format!("W \"{words}")),
            "{command} --{flag}: {offer}"
        );
    }
    // What is not among them is read as before, and refused in the same words; the help names them once.
    for taken in [
        "simulate random --duration 0.1 --noise arw=0.2,rrw=1 -o null:",
        "simulate top --duration 0.1 --case wavy -o log.mcap",
        "replay log.mcap --init rpy=0,10,20 --noise arw=0.15 --bias -0.1,0,0 --body YxZ --speed 90 -o null:",
    ] {
        strapd(dir.path(), taken).done();
    }
    strapd(dir.path(), "simulate top --case tumbling -o null:")
        .refused(2, &["tumbling", "steady-slow"]);
    strapd(dir.path(), "replay log.mcap --init level -o null:")
        .refused(2, &["--init level", "first-orientation", "rpy="]);
    let help = strapd(dir.path(), "replay --help");
    assert!(
        !help.out.contains("possible values: identity"),
        "{}",
        help.out
    );
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

#[test]
fn the_help_of_every_command_that_reads_recordings_names_every_format() {
    use strapd_recording::format::Format;
    let dir = tempfile::tempdir().unwrap();
    for command in [
        "allan",
        "calibrate",
        "cat",
        "check",
        "compare",
        "info",
        "replay",
        "report",
        "send",
    ] {
        let ran = strapd(dir.path(), &format!("{command} --help"));
        ran.done();
        let help = ran.out.split_whitespace().collect::<Vec<_>>().join(" ");
        for format in Format::ALL {
            assert!(
                help.contains(format.name()),
                "{command} --help does not name {}",
                format.name()
            );
        }
    }
}
