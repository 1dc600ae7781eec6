//! Promise: every command in `README.md` and `docs/` does what its page says.
//!
//! What stands in a fence marked `sh` is run by `bash`, block by block, page by page, in a folder of its own that holds
//! `fixtures/` and recordings of the names that pages use (`flight.mcap`, ...). Every line ends with code 0, or with
//! the one its
//! comment names (`exit code 3`), and leaves the files that it names. In `docs/` a line takes the place of one before
//! it that wrote the same files. Before the fence, where no reader sees it, stands which of its commands are not run, and
//! why: `<!-- untested 2, 3: needs a board -->`; they are held against the parser all the same, and counted here.
//!
//! Two things are not as printed: `cargo run --release --` is the command under test, and every address of this
//! machine has a free port.

mod fences;
mod quoted;
mod run;

use clap::Parser;
use fences::{Command, blocks, commands};
use run::{Place, finish, run};
use std::path::{Path, PathBuf};

/// Lines that other tests run, or that measure for minutes and are run by hand.
const ELSEWHERE: [(&str, &str); 3] = [
    ("| nc ", "tests/service/serve/documentation.rs plays nc"),
    ("benches/", "measures for minutes"),
    ("cargo bench", "measures for minutes"),
];

/// Number of lines of a page that are not run here. A line more is to be looked at.
const UNTESTED: [(&str, usize); 17] = [
    ("README.md", 5),
    ("docs/connect.md", 9),
    ("docs/estimation.md", 1),
    ("docs/frames.md", 1),
    ("docs/inputs.md", 3),
    ("docs/install.md", 1),
    ("docs/joint.md", 4),
    ("docs/operations.md", 5),
    ("docs/performance.md", 10),
    ("docs/phone.md", 4),
    ("docs/protocol.md", 8),
    ("docs/python.md", 6),
    ("docs/ros.md", 3),
    ("docs/scale.md", 8),
    ("docs/start.md", 1),
    ("docs/usage.md", 5),
    ("docs/versions.md", 4),
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// `README.md` and `docs/*.md`: name and text.
fn pages() -> Vec<(String, String)> {
    let mut names: Vec<String> = std::fs::read_dir(root().join("docs"))
        .unwrap()
        .map(|entry| format!("docs/{}", entry.unwrap().file_name().to_str().unwrap()))
        .filter(|name| name.ends_with(".md"))
        .collect();
    names.push("README.md".to_owned());
    names.sort();
    let read = |name: String| {
        let text = std::fs::read_to_string(root().join(&name)).unwrap();
        (name, text)
    };
    names.into_iter().map(read).collect()
}

/// Why this line is not run.
fn untested(command: &Command) -> Option<&str> {
    let elsewhere = ELSEWHERE
        .iter()
        .find(|(part, _)| command.text.contains(part));
    command
        .untested
        .as_deref()
        .or(elsewhere.map(|(_, why)| *why))
}

/// Runs a page's blocks in one place, and says what of it is not as its page says.
fn faults(name: &str, page: &str, place: &Place) -> Vec<String> {
    let mut faults = Vec::new();
    for block in blocks(page).iter().filter(|b| b.language == "sh") {
        let commands = commands(block);
        let can_run = |command: &&Command| match run::missing(&command.text) {
            Some(program) => {
                println!(
                    "{name}:{}: not run, {program} is not installed",
                    command.line
                );
                false
            }
            None => untested(command).is_none(),
        };
        let tested: Vec<&Command> = commands.iter().filter(can_run).collect();
        let ran = run(place, &tested, name != "README.md");
        assert_eq!(
            ran.len(),
            tested.len(),
            "{name}:{}: the shell ended early: {ran:?}",
            block.line
        );
        for (command, ran) in tested.iter().zip(&ran) {
            if ran.code != command.code {
                faults.push(format!(
                    "{name}:{}: exit code {}, not {}: {}\n{}{}",
                    command.line, ran.code, command.code, command.text, ran.out, ran.err
                ));
            }
            if ran.err.contains("panicked") {
                faults.push(format!(
                    "{name}:{}: {}\n{}",
                    command.line, command.text, ran.err
                ));
            }
            for output in command.outputs() {
                if !place.has(&output) {
                    faults.push(format!(
                        "{name}:{}: left no {output}: {}\n{}",
                        command.line, command.text, ran.err
                    ));
                }
            }
        }
    }
    faults
}

#[test]
fn the_tour_of_the_readme_runs_whole_in_a_folder_with_the_fixtures() {
    let place = Place::with_fixtures();
    let page = std::fs::read_to_string(root().join("README.md")).unwrap();
    assert_eq!(faults("README.md", &page, &place), Vec::<String>::new());
    // What it says of the last comparison: 3e-12 degrees. Another platform's sine may cost some.
    let compared =
        crate::program::strapd(place.path(), "compare alone.mcap truth.mcap --json").json();
    let rms = compared["total"]["rms_deg"].as_f64().unwrap();
    assert!(rms < 1e-11, "{compared}");
    let live = std::fs::read_to_string(place.path().join("live.csv")).unwrap();
    assert_eq!(live.lines().count(), 301, "a header and what was asked for");
}

#[test]
fn every_command_of_the_pages_runs() {
    let runs: Vec<_> = pages()
        .into_iter()
        .filter(|(name, _)| name != "README.md")
        .map(|(name, page)| {
            std::thread::spawn(move || {
                let place = Place::with_recordings();
                faults(&name, &page, &place)
            })
        })
        .collect();
    let faults: Vec<String> = runs.into_iter().flat_map(finish).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Also those that are not run: a flag that is gone is seen.
#[test]
fn every_command_of_the_pages_is_one_the_parser_takes() {
    let mut parsed = 0;
    for (name, page) in pages() {
        for block in blocks(&page).iter().filter(|b| b.language == "sh") {
            for command in commands(block) {
                for words in run::words(&command.text) {
                    parsed += 1;
                    if let Err(why) = strapd::cli::Cli::try_parse_from(&words) {
                        panic!("{name}:{}: {words:?}\n{why}", command.line);
                    }
                }
            }
        }
    }
    assert!(parsed > 80, "{parsed} commands");
}

#[test]
fn what_is_not_run_is_counted_and_says_why() {
    let counted: Vec<(String, usize)> = pages()
        .into_iter()
        .map(|(name, page)| {
            let all = blocks(&page);
            let of_shell = all.iter().filter(|b| b.language == "sh").flat_map(commands);
            let count = of_shell
                .filter(|command| untested(command).is_some())
                .inspect(|command| {
                    let why = untested(command).unwrap_or_default();
                    println!("{name}:{}: {} ({why})", command.line, command.text);
                    assert!(
                        why.len() > 8,
                        "{name}:{}: no reason: {}",
                        command.line,
                        command.text
                    );
                })
                .count();
            (name, count)
        })
        .filter(|(_, count)| *count > 0)
        .collect();
    let meant: Vec<_> = UNTESTED.map(|(name, n)| (name.to_owned(), n)).into();
    let mut counted = counted;
    counted.sort();
    assert_eq!(counted, meant);
}

#[test]
fn no_command_stands_in_a_fence_that_is_not_run() {
    for (name, page) in pages() {
        for block in blocks(&page).iter().filter(|b| b.language != "sh") {
            for (n, line) in block.text.lines().enumerate() {
                assert!(
                    !line.starts_with("strapd ") && !line.starts_with("$ "),
                    "{name}:{}: {line}\n  help: mark the fence `sh`",
                    block.line + n + 1
                );
            }
        }
    }
}

#[test]
fn the_readme_is_short_and_its_links_lead_somewhere() {
    for (name, page) in pages() {
        if name == "README.md" {
            let seen = page.lines().filter(|line| !line.starts_with("<!--"));
            let count = seen.count();
            assert!(count < 120, "{count} lines");
        }
        let folder = root().join(Path::new(&name).parent().unwrap());
        for link in page
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split(')').next())
        {
            let file = link.split('#').next().unwrap();
            assert!(
                file.is_empty() || file.contains("://") || folder.join(file).exists(),
                "{name}: {link} leads nowhere"
            );
        }
    }
}
