//! Arguments -> a run -> its summary on stdout. I/O.
//!
//! One file per command. Data goes to stdout, everything else to stderr.

pub mod admission;
pub mod allan;
pub mod borrowed;
pub mod calibrate;
mod calibration_files;
pub mod cat;
pub mod check;
pub mod compare;
pub mod config;
mod continued;
pub mod estimation;
pub mod frames;
pub mod info;
mod invitation;
mod known_words;
pub mod manual;
pub mod model;
pub mod outputs;
mod own_output;
#[cfg(feature = "object-store")]
mod patterns;
pub mod progress;
pub mod recover;
pub mod relative;
pub mod replay;
pub mod report;
pub mod send;
mod serial;
pub mod serve;
mod service_manager;
pub mod serving;
pub mod setting_args;
pub mod shell;
pub mod simulate;
pub mod tables;
pub mod watch;

use crate::error::{Error, Result};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::io::{IsTerminal, Write};
use std::process::ExitCode;

/// Help of an argument that takes recordings: the subject, the formats that are read, what else it takes.
fn recordings(subject: &str, besides: &str) -> String {
    let formats = strapd_recording::format::Format::names();
    format!("{subject}: {formats}{besides}; - is standard input")
}

/// Help of an argument that takes outputs: the subject with the formats that are written, what else it takes, and the
/// rest of what is said of it.
fn sinks(subject: &str, besides: &str, rest: &str) -> String {
    format!(
        "{subject}{besides}, - (NDJSON on stdout), null: (nowhere); tcp-listen://HOST:PORT, unix-listen:///PATH, \
         ws-listen://HOST:PORT (whoever connects); tcp://HOST:PORT, udp://HOST:PORT[?profile=plotjuggler] (somebody who \
         listens); opentrack://, osc://, vmc://, slimevr://, mavlink://HOST:PORT[?id=NAME&rate=HZ] (another program, in \
         its protocol). {rest}May be given several times"
    )
}

/// Gyro samples in, attitude you can trust out.
#[derive(Parser, Debug)]
#[command(
    name = "strapd",
    version,
    about,
    max_term_width = 100,
    after_help = "Examples:
  strapd info flight.mcap                      what is in it, and how good it is
  strapd replay flight.mcap -o attitude.mcap   gyro samples to attitude
  strapd compare attitude.mcap flight.mcap     how far from a recorded orientation
  strapd relative thigh.mcap shank.mcap        the angle of the joint between two sensors
  strapd simulate top -o top.mcap              a gyro whose truth is known, to try it all on
  strapd report flight.mcap -o flight.html     all that can be said about it, on one page
  strapd cat flight.mcap --topic /imu | head   decoded samples as NDJSON
  strapd calibrate a.mcap b.mcap -o imu.toml   what recordings tell of their sensor
  strapd serve                                 samples in over sockets, attitude out
  strapd send flight.mcap                      a recording into that daemon, in real time
  strapd watch                                 what that daemon makes, live in the terminal

Exit codes: 0 done; 1 failed; 2 bad arguments; 3 done, but samples were lost (check: something was found);
4 compare: a limit was exceeded."
)]
pub struct Cli {
    /// Flags every command takes.
    #[command(flatten)]
    pub global: Global,
    /// Command.
    #[command(subcommand)]
    pub command: Command,
}

/// Flags every command takes.
#[derive(Args, Debug, Clone)]
pub struct Global {
    /// Less on stderr: warnings and errors only; no summary
    #[arg(short, long, global = true, help_heading = "Global")]
    pub quiet: bool,
    /// More on stderr, and the whole summary of a replay; twice for still more
    #[arg(short, long, global = true, help_heading = "Global", action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Colour on stderr
    #[arg(
        long,
        global = true,
        help_heading = "Global",
        value_enum,
        default_value = "auto"
    )]
    pub color: When,
    /// Form of the diagnostics on stderr
    #[arg(
        long,
        global = true,
        help_heading = "Global",
        value_enum,
        default_value = "text",
        env = "STRAPD_LOG_FORMAT"
    )]
    pub log_format: LogFormat,
    /// Progress on stderr: a bar on a terminal, nothing, or one JSON object a second
    #[arg(
        long,
        global = true,
        help_heading = "Global",
        value_enum,
        default_value = "auto"
    )]
    pub progress: Progress,
    /// The command's summary as one JSON object on stdout
    #[arg(long, global = true, help_heading = "Global")]
    pub json: bool,
    /// Worker threads; 0 = one per core. The output does not depend on it
    #[arg(
        long,
        global = true,
        help_heading = "Global",
        default_value_t = 0,
        env = "STRAPD_THREADS"
    )]
    pub threads: usize,
}

/// Use of colour.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// Colour on a terminal, unless `NO_COLOR` is set.
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

/// Form of the diagnostics.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogFormat {
    /// Lines for people.
    Text,
    /// One JSON object per line.
    Json,
}

/// Form of the progress report.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// A bar when stderr is a terminal, nothing otherwise.
    Auto,
    /// Nothing.
    None,
    /// One JSON object per second on stderr.
    Json,
}

/// The commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Turn recorded gyro samples into attitude
    Replay(Box<replay::Replay>),
    /// Samples in over sockets, attitude out to whoever watches
    Serve(Box<serve::Serve>),
    /// Look at a configuration file of `serve`
    Config(config::Config),
    /// Calibrate a sensor from recordings of it: bias, scale, axes, as a file
    Calibrate(Box<calibrate::Calibrate>),
    /// Topics, rates, clocks and frames of a log, and what to do next
    Info(info::Info),
    /// Everything that may spoil the attitude from a log, with the flag that helps
    Check(Box<check::Check>),
    /// One self-contained HTML page about a log: quality, attitude, errors, noise
    Report(Box<report::Report>),
    /// Time-aligned angle error between two attitudes
    Compare(compare::Compare),
    /// Attitude of one body relative to another: the angle of the joint between them
    Relative(relative::Relative),
    /// Decoded samples of a file, or attitudes of a daemon, as NDJSON, CSV or a table
    Cat(cat::Cat),
    /// A recording's samples to a daemon, as fast as they were measured
    Send(send::Send),
    /// Every sensor of a daemon, live in the terminal
    Watch(watch::Watch),
    /// Samples of a synthetic gyro whose true attitude is known exactly
    Simulate(Box<simulate::Simulate>),
    /// The model library: requests as NDJSON on stdin, answers on stdout
    Model(model::Model),
    /// Allan deviation of a recording at rest: noise terms, and the flags for them
    Allan(allan::Allan),
    /// Salvage every intact message of a damaged recording, as an MCAP
    Recover(recover::Recover),
    /// Shell completions on stdout
    Completions(manual::Completions),
    /// The manual page (roff) on stdout, or all of them into a directory
    Man(manual::Man),
}

/// Outcome of a run that was carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything asked for was done.
    Done,
    /// One of several inputs failed; it was said on stderr.
    Failed,
    /// Done, but samples were lost.
    Lossy,
    /// `compare`: a limit was exceeded.
    LimitExceeded,
}

impl Outcome {
    /// Outcome of several: one that failed comes before what was lost.
    fn and(self, other: Outcome) -> Outcome {
        match (self, other) {
            (Outcome::Failed, _) | (_, Outcome::Failed) => Outcome::Failed,
            (Outcome::Done, other) => other,
            (own, _) => own,
        }
    }
}

/// Does it with each of several inputs; what is wrong with one is said, and the others are done.
pub(crate) fn with_each<T>(
    inputs: &[T],
    mut act: impl FnMut(&T) -> Result<Outcome>,
) -> Result<Outcome> {
    let mut all = Outcome::Done;
    for input in inputs {
        match act(input) {
            Ok(outcome) => all = all.and(outcome),
            Err(error) if inputs.len() > 1 && !error.is_broken_pipe() && error.exit_code() != 2 => {
                say_error(&error);
                all = Outcome::Failed;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(all)
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> ExitCode {
        ExitCode::from(match outcome {
            Outcome::Done => 0,
            Outcome::Failed => 1,
            Outcome::Lossy => 3,
            Outcome::LimitExceeded => 4,
        })
    }
}

#[cfg(feature = "object-store")]
impl Cli {
    /// Replaces patterns in addresses by the recordings that they mean, in the commands that take several.
    fn with_patterns(mut self) -> Result<Cli> {
        use std::mem::take;
        match &mut self.command {
            Command::Replay(of) => of.sources = patterns::filled(take(&mut of.sources))?,
            Command::Calibrate(of) => of.logs = patterns::filled(take(&mut of.logs))?,
            Command::Info(of) => of.files = patterns::filled(take(&mut of.files))?,
            Command::Check(of) => of.files = patterns::filled(take(&mut of.files))?,
            Command::Report(of) => of.files = patterns::filled(take(&mut of.files))?,
            _ => {}
        }
        Ok(self)
    }
}

/// Runs the command.
///
/// # Errors
/// Whatever ended it; see [`Error`].
pub fn run(cli: Cli) -> Result<Outcome> {
    #[cfg(feature = "object-store")]
    let cli = cli.with_patterns()?;
    match cli.command {
        Command::Replay(command) => replay::run(&cli.global, *command),
        Command::Serve(command) => serve::run(&cli.global, &command),
        Command::Config(command) => config::run(&command),
        Command::Calibrate(command) => calibrate::run(&cli.global, *command),
        Command::Info(command) => info::run(&cli.global, &command),
        Command::Check(command) => check::run(&cli.global, &command),
        Command::Report(command) => report::run(&cli.global, *command),
        Command::Compare(command) => compare::run(&cli.global, &command),
        Command::Relative(command) => relative::run(&cli.global, &command),
        Command::Cat(command) => cat::run(&cli.global, &command),
        Command::Send(command) => send::run(&cli.global, &command),
        Command::Watch(command) => watch::run(&cli.global, &command),
        Command::Simulate(command) => simulate::run(&cli.global, &command),
        Command::Model(command) => model::run(&cli.global, &command),
        Command::Allan(command) => allan::run(&cli.global, &command),
        Command::Recover(command) => recover::run(&cli.global, &command),
        Command::Completions(command) => manual::completions(&command),
        Command::Man(command) => manual::man(&command),
    }
}

/// Starts the diagnostics on stderr.
pub fn start_diagnostics(global: &Global) {
    use tracing_subscriber::filter::{LevelFilter, Targets};
    use tracing_subscriber::prelude::*;
    let level = match (global.quiet, global.verbose) {
        (true, _) => LevelFilter::WARN,
        (false, 0) => LevelFilter::INFO,
        (false, 1) => LevelFilter::DEBUG,
        (false, _) => LevelFilter::TRACE,
    };
    let asked = std::env::var("STRAPD_LOG").unwrap_or_default();
    let targets = match asked.parse::<Targets>() {
        Ok(targets) if !asked.is_empty() => targets,
        _ => Targets::new().with_default(level),
    };
    // Below that it says each request as it goes out, with tokens and keys.
    let most = targets.default_level().unwrap_or(LevelFilter::OFF);
    let targets = targets.with_target("tungstenite", most.min(LevelFilter::DEBUG));
    // What it says of its connection we say in our own words.
    #[cfg(feature = "nats")]
    let targets = targets.with_target("async_nats", most.min(LevelFilter::WARN));
    // Likewise; and below that it says its configuration, with the password in it.
    #[cfg(feature = "zenoh")]
    let targets = targets.with_target("zenoh", LevelFilter::OFF);
    // These say whole addresses, with the signatures in them.
    let says_addresses = ["hyper_util", "object_store", "reqwest"];
    let targets = says_addresses.iter().fold(targets, |targets, name| {
        targets.with_target(*name, most.min(LevelFilter::ERROR))
    });
    let layer = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_target(false)
        .with_ansi(use_colour(global.color));
    let layer = match global.log_format {
        LogFormat::Json => layer.json().boxed(),
        LogFormat::Text => layer.without_time().boxed(),
    };
    // A second start (tests in one process) is harmless.
    let _ = tracing_subscriber::registry()
        .with(layer.with_filter(targets))
        .try_init();
}

/// Whether stderr takes colour.
#[must_use]
pub fn use_colour(when: When) -> bool {
    match when {
        When::Always => true,
        When::Never => false,
        When::Auto => std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none(),
    }
}

/// Says what ended the run: one `error:` line, then its details and help.
pub fn say_error(error: &Error) {
    // A stderr that is gone leaves nobody to tell.
    let _ = writeln!(std::io::stderr(), "error: {error}");
}

/// Writes data to stdout; a reader that has gone is [`Error::BrokenPipe`], which ends quietly.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(|e| Error::writing("stdout", e))
}

#[cfg(test)]
mod tests {
    use super::Cli;
    use clap::CommandFactory;
    use std::collections::BTreeSet;
    use strapd_attitude::setting;

    #[test]
    fn every_setting_that_a_library_names_is_a_flag_of_a_command() {
        let mut flags = BTreeSet::new();
        let mut left = vec![Cli::command()];
        while let Some(command) = left.pop() {
            flags.extend(
                command
                    .get_arguments()
                    .filter_map(|a| a.get_long().map(str::to_owned)),
            );
            left.extend(command.get_subcommands().cloned());
        }
        for setting in setting::ALL {
            let flag = setting.name().replace('_', "-");
            assert!(flags.contains(&flag), "no command has --{flag}");
        }
    }
}
