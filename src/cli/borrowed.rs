//! An option that other programs have, and this one calls otherwise -> the error with the option that does it. Pure.
//!
//! Apart from the commands because clap knows only names that are spelled alike.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Command, names elsewhere, and the options that do it here.
const BORROWED: [(&str, &[&str], &str); 8] = [
    (
        "serve",
        &["--port", "--host", "--bind", "--address"],
        "--listen tcp-listen://127.0.0.1:PORT takes samples, --listen ws-listen://127.0.0.1:PORT shows the page",
    ),
    (
        "replay",
        &["--format", "--output-format"],
        "--output NAME.csv: the ending says the format",
    ),
    (
        "replay",
        &["--mag", "--use-mag", "--magnetometer"],
        "--aid gravity+mag takes the magnetometer",
    ),
    (
        "replay",
        &["--no-mag"],
        "--aid gravity leaves the magnetometer out",
    ),
    (
        "replay",
        &["--gain", "--beta", "--kp", "--ki", "--zeta"],
        "--noise CLASS says how good the sensor is; the gains follow from it",
    ),
    (
        "replay",
        &["--fs", "--freq", "--frequency"],
        "--rate-hz RATE, where the input has no times",
    ),
    ("replay", &["--fixed-frame"], "--world-frame NAME"),
    (
        "replay",
        &["--publish-tf", "--reverse-tf"],
        "--tf forward|reverse|none",
    ),
];

/// Adds what helps to an error about an option that there is elsewhere, or about a recording in the place of a command.
pub fn explained(mut error: clap::Error) -> clap::Error {
    if error.kind() == ErrorKind::InvalidSubcommand {
        return with_commands(error);
    }
    if error.kind() != ErrorKind::UnknownArgument {
        return error;
    }
    let text = |kind| error.get(kind).map(ToString::to_string).unwrap_or_default();
    let (name, usage) = (text(ContextKind::InvalidArg), text(ContextKind::Usage));
    let is_it = |(command, names, _): &&(&str, &[&str], &str)| {
        names.contains(&name.as_str()) && usage.contains(&format!("strapd {command} "))
    };
    if let Some((_, _, instead)) = BORROWED.iter().find(is_it) {
        error.remove(ContextKind::SuggestedArg);
        let instead = ContextValue::StyledStrs(vec![(*instead).into()]);
        error.insert(ContextKind::Suggested, instead);
    }
    error
}

/// Adds the commands for a file to an error about one that stands where a command is expected.
fn with_commands(mut error: clap::Error) -> clap::Error {
    let named = error.get(ContextKind::InvalidSubcommand);
    let file = named.map(ToString::to_string).unwrap_or_default();
    if !file.contains(['.', '/']) {
        return error;
    }
    let file = strapd_recording::text::printable(&file);
    let instead = ["info", "report", "replay"].map(|command| format!("strapd {command} {file}"));
    error.remove(ContextKind::SuggestedSubcommand);
    let instead = ContextValue::StyledStrs(vec![instead.join(", or ").into()]);
    error.insert(ContextKind::Suggested, instead);
    error
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::Cli;
    use super::*;
    use clap::{CommandFactory, Parser};

    #[test]
    fn an_option_of_other_programs_is_answered_with_the_one_that_does_it() {
        let cli = Cli::command();
        for (command, names, instead) in BORROWED {
            let known = cli.find_subcommand(command).unwrap();
            let option = instead
                .split(' ')
                .find(|word| word.starts_with("--"))
                .unwrap();
            let has = |name: &str| {
                known
                    .get_arguments()
                    .any(|arg| arg.get_long() == Some(&name[2..]))
            };
            assert!(has(option), "{command} has no {option}");
            for name in names {
                assert!(!has(name), "{command} has {name} itself");
                let argv = ["strapd", command, name, "1", "a"];
                let said = explained(Cli::try_parse_from(argv).err().unwrap()).to_string();
                assert!(said.contains(instead), "{said}");
                assert!(!said.contains("as a value"), "{said}");
            }
        }
        let of_another = explained(
            Cli::try_parse_from(["strapd", "info", "--port", "1"])
                .err()
                .unwrap(),
        );
        assert!(!of_another.to_string().contains("listen"));
    }

    #[test]
    fn a_recording_in_the_place_of_a_command_is_answered_with_commands() {
        let said = |word: &str| {
            explained(Cli::try_parse_from(["strapd", word]).err().unwrap()).to_string()
        };
        for file in ["a.mcap", "logs/b", "./c"] {
            let said = said(file);
            assert!(said.contains(&format!("strapd report {file}")), "{said}");
        }
        assert!(!said("replays").contains("strapd info replays"));
    }
}
