//! Help says of each flag what it is about, and what it is where nobody gives it.

use crate::program::strapd;
use std::path::Path;

/// The flags below each heading.
fn headings(command: &str) -> Vec<(String, Vec<String>)> {
    let help = strapd(Path::new("."), &format!("{command} --help")).out;
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    for line in help.lines() {
        if !line.starts_with(' ') && line.ends_with(':') {
            found.push((line.trim_end_matches(':').to_owned(), Vec::new()));
        } else if let (Some((_, flags)), Some((_, flag))) =
            (found.last_mut(), line.split_once("--"))
            && line.trim_start().starts_with('-')
        {
            let name = flag.split([' ', '[', '=', '.']).next().unwrap_or_default();
            flags.push(name.to_owned());
        }
    }
    found
}

#[test]
fn each_flag_stands_under_what_it_is_about() {
    for (command, flag, heading) in [
        ("simulate random", "rate-hz", "Sampling"),
        ("simulate random", "seed", "Sampling"),
        ("simulate random", "frame-id", "Sampling"),
        ("simulate top", "start-stamp", "Sampling"),
        ("simulate top", "drop", "Errors"),
        ("replay", "against-recorded", "Estimation"),
        ("replay", "shard", "Output"),
        ("replay", "token-file", "Admission"),
    ] {
        let found = headings(command);
        let of = found
            .iter()
            .find(|(_, flags)| flags.iter().any(|name| name == flag));
        let of = of.map(|(heading, _)| heading.as_str());
        assert_eq!(of, Some(heading), "{command} --{flag}: {found:#?}");
    }
    // What every command takes is apart from what is its own, and behind it.
    for command in [
        "replay",
        "serve",
        "recover",
        "info",
        "simulate top",
        "model top",
    ] {
        let found = headings(command);
        let global = found.iter().find(|(heading, _)| heading == "Global");
        let (_, flags) = global.unwrap_or_else(|| unreachable!("{command}: {found:#?}"));
        for flag in ["quiet", "verbose", "color", "json", "threads"] {
            assert!(flags.iter().any(|name| name == flag), "{command} --{flag}");
        }
    }
}

#[test]
fn serve_shows_its_own_default_and_no_flag_that_it_refuses() {
    let help = strapd(Path::new("."), "serve --help").out;
    let method = help.split("--method <METHOD>").nth(1).unwrap_or_default();
    let method = method.split("--window").next().unwrap_or_default();
    assert!(method.contains("[default: commit]"), "{method}");
    for flag in ["topic", "accel-topic", "mag-topic"] {
        assert!(!help.contains(&format!("--{flag} ")), "--{flag}");
    }
    let refused = strapd(Path::new("."), "serve --topic /imu");
    assert!(
        refused.code == Some(2) && refused.err.contains("named by `id`"),
        "{refused:?}"
    );
}

#[test]
fn choices_are_listed_whole_completed_and_taken() {
    let completions = strapd(Path::new("."), "completions bash").out;
    let methods = "auto magnus causal commit dcm-left dcm-right dcm-mean rotvec-sum coning2 coning3 coning4 rk4";
    for choices in [
        methods,
        "start level enu ned nwu",
        "none first first-heading heading best",
    ] {
        assert!(completions.contains(choices), "{choices}");
    }
    let wrong = strapd(Path::new("."), "replay x.mcap -o null: --method magic");
    assert_eq!(wrong.code, Some(2));
    assert!(
        wrong.err.contains(&methods.replace(' ', ", ")),
        "{}",
        wrong.err
    );
    let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/constant_rate.mcap");
    for method in methods.split(' ') {
        let ran = strapd(
            Path::new("."),
            &format!(
                "replay {} -o null: -q --aid none --method {method}",
                log.display()
            ),
        );
        assert_eq!(ran.code, Some(0), "{method}: {ran:?}");
    }
}

#[test]
fn manual_pages_make_their_folder() {
    let dir = tempfile::tempdir().unwrap();
    let ran = strapd(dir.path(), "man --out-dir share/man/man1");
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(dir.path().join("share/man/man1/strapd-replay.1").is_file());
}
