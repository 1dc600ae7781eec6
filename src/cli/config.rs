//! A TOML file -> arguments of `strapd serve`; `strapd config check|show`. I/O.
//!
//! The file's keys are the long flags, so there is one list of settings and one parser of their
//! values. Flag before environment before file before default; `[sensor.ID]` holds the estimation
//! flags of one sensor. Sources stand in `source = [...]`, or in `[source.ID]` with their `uri`; those on
//! the command line replace them.

use super::estimation::Estimation;
use super::serve::Serve;
use super::{Cli, Command, Outcome, print};
use crate::client::remote;
use crate::error::{Error, Result};
use crate::serve::Settings;
use clap::parser::ValueSource;
use clap::{ArgAction, ArgMatches, Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::text::nearest;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

/// A larger file is no configuration.
const MAX_BYTES: u64 = 1 << 20;

/// Look at a configuration file of `serve`.
#[derive(Args, Debug)]
pub struct Config {
    /// Action.
    #[command(subcommand)]
    pub action: Action,
}

/// `strapd config ...`.
#[derive(Subcommand, Debug)]
pub enum Action {
    /// Say whether `strapd serve --config FILE` would start (addresses are not tried)
    Check {
        /// The file
        file: PathBuf,
    },
    /// The settings that would hold, as TOML, each with where it comes from
    Show {
        /// The file
        file: PathBuf,
    },
}

/// Estimation flags alone, for one sensor.
#[derive(Parser, Debug)]
#[command(name = "sensor")]
struct Sensor {
    #[command(flatten)]
    estimation: Estimation,
}

/// The arguments of a run with what a file adds.
#[derive(Debug)]
pub struct Layered {
    serve: Box<Serve>,
    matches: ArgMatches,
    from_file: Vec<String>,
    sources_from_file: bool,
    sensors: Vec<SensorArgs>,
}

/// Id of a sensor, its settings, and the arguments they were told by.
type SensorArgs = (String, Estimation, Vec<OsString>);

/// Runs it.
///
/// # Errors
/// The file cannot be read, or does not fit.
pub fn run(args: &Config) -> Result<Outcome> {
    let argv = |file: &Path| {
        ["strapd", "serve", "--config"]
            .iter()
            .map(OsString::from)
            .chain([file.into()])
            .collect()
    };
    match &args.action {
        Action::Check { file } => {
            let layered = layered(file, argv(file))?;
            layered.serve.recording()?;
            layered.settings()?.check()?;
            print(&format!("{}: OK\n", file.display()))?;
        }
        Action::Show { file } => print(&layered(file, argv(file))?.show())?,
    }
    Ok(Outcome::Done)
}

/// Reads `file` into what `argv` (of `strapd serve`) leaves open.
///
/// # Errors
/// [`strapd_recording::Error::Open`], [`Error::Usage`] naming file and key.
pub fn layered(file: &Path, argv: Vec<OsString>) -> Result<Layered> {
    let file = &ConfigFile::read(file)?;
    let mut table = file.table()?;
    let sensors = match table.remove("sensor") {
        None => Table::new(),
        Some(Value::Table(sensors)) => sensors,
        Some(_) => return Err(file.bad("`sensor` is no table; expected [sensor.ID]")),
    };
    let sources = sources(file, table.remove("source"))?;
    let command = Cli::command();
    let parse = |argv: &[OsString]| command.clone().try_get_matches_from(argv);
    let first = parse(&argv).map_err(|e| file.bad(e.to_string().trim_end()))?;
    let first = subcommand(file, &first)?;
    let serve = Serve::augment_args(clap::Command::new("serve"));
    let mut whole = argv;
    let from_file = extend(&mut whole, file, &[], &serve, &table, Some(&first))?;
    let sources_from_file = !is_given(&first, "sources") && !sources.is_empty();
    if sources_from_file {
        whole.push("--".into());
        whole.extend(sources.into_iter().map(OsString::from));
    }
    let matches = parse(&whole).map_err(|e| file.bad(e.to_string().trim_end()))?;
    let Ok(Cli {
        command: Command::Serve(args),
        ..
    }) = Cli::from_arg_matches(&matches)
    else {
        return Err(file.bad("is for strapd serve"));
    };
    let matches = subcommand(file, &matches)?;
    let sensors = sensors
        .into_iter()
        .map(|(id, value)| sensor(file, id, value, (&first, &matches)))
        .collect::<Result<_>>()?;
    Ok(Layered {
        serve: args,
        matches,
        from_file,
        sources_from_file,
        sensors,
    })
}

/// Estimation settings of one sensor of the file, and the arguments they were told by. `first` is what the command line
/// says, `whole` what it says with the file.
fn sensor(
    file: &ConfigFile<'_>,
    id: String,
    value: Value,
    (first, whole): (&ArgMatches, &ArgMatches),
) -> Result<SensorArgs> {
    let name = format!("[sensor.{id}]");
    let Value::Table(own) = value else {
        return Err(file.bad(format!("{name} is no table")));
    };
    let known = Sensor::command();
    let mut argv = vec![OsString::from("sensor")];
    extend(&mut argv, file, &["sensor", &id], &known, &own, Some(first))?;
    let added = argv.len();
    // What holds for all holds for this one where it says nothing else.
    for arg in known.get_arguments() {
        let key = arg.get_long().unwrap_or_default();
        if !own.contains_key(key) || is_given(first, arg.get_id().as_str()) {
            inherit(&mut argv, whole, arg);
        }
    }
    let parsed = Sensor::try_parse_from(&argv).map_err(|e| file.bad(format!("{name}: {e}")))?;
    argv.truncate(added);
    Ok((id, parsed.estimation, argv.split_off(1)))
}

/// A configuration file, and its text.
struct ConfigFile<'a> {
    path: &'a Path,
    text: String,
}

impl<'a> ConfigFile<'a> {
    fn read(path: &'a Path) -> Result<ConfigFile<'a>> {
        let open = |source| strapd_recording::Error::Open {
            path: path.to_owned(),
            source,
        };
        let metadata = std::fs::metadata(path).map_err(open)?;
        let mut file = ConfigFile {
            path,
            text: String::new(),
        };
        if !metadata.is_file() || metadata.len() > MAX_BYTES {
            return Err(file.bad("is no text file of a sensible size"));
        }
        file.text = std::fs::read_to_string(path).map_err(open)?;
        Ok(file)
    }

    fn table(&self) -> Result<Table> {
        let table = self.text.parse::<Table>();
        table.map_err(|e| self.bad(e.to_string().trim_end()))
    }

    fn bad(&self, what: impl Into<Diagnostic>) -> Error {
        let place = format!("--config {}", self.path.display());
        Error::usage(what.into().at(place))
    }

    /// Line of a key of a table of tables, from 1.
    fn line(&self, tables: &[&str], key: &str) -> Option<usize> {
        let whole = DeTable::parse(&self.text).ok()?;
        let mut table = whole.get_ref();
        for name in tables {
            table = match table
                .iter()
                .find(|(key, _)| key.get_ref() == name)?
                .1
                .get_ref()
            {
                DeValue::Table(table) => table,
                _ => return None,
            };
        }
        let (key, _) = table.iter().find(|(known, _)| known.get_ref() == key)?;
        let before = self.text.get(..key.span().start)?;
        Some(before.matches('\n').count() + 1)
    }

    /// Line and table of a key, before what is said of it.
    fn place(&self, tables: &[&str], key: &str) -> String {
        let line = self.line(tables, key);
        let line = line.map_or_else(String::new, |line| format!("line {line}: "));
        match tables {
            [] => line,
            tables => format!("{line}[{}] ", tables.join(".")),
        }
    }

    /// The error of a key that is not among the `known` ones of a table of tables.
    fn unknown_key(&self, tables: &[&str], key: &str, known: &[&str]) -> Error {
        let is_of_the_daemon = || {
            let serve = Serve::augment_args(clap::Command::new("serve"));
            !tables.is_empty() && serve.get_arguments().any(|arg| arg.get_long() == Some(key))
        };
        let help = match (known, nearest(key, known.iter().copied())) {
            ([one], _) => format!("there is {one}"),
            (_, Some(near)) => format!("there is {near}"),
            _ if is_of_the_daemon() => {
                format!("{key} is one for all sensors: above the first table of the file")
            }
            _ => "the keys are the long flags of strapd serve, those of [sensor.ID] its settings (docs/settings.md)".to_owned(),
        };
        let place = self.place(tables, key);
        self.bad(Diagnostic::new(format!("{place}unknown key `{key}`")).help(help))
    }
}

fn subcommand(file: &ConfigFile<'_>, matches: &ArgMatches) -> Result<ArgMatches> {
    matches
        .subcommand_matches("serve")
        .cloned()
        .ok_or_else(|| file.bad("is for strapd serve"))
}

/// Whether a value was given as a flag or in the environment.
fn is_given(matches: &ArgMatches, id: &str) -> bool {
    matches!(
        matches.value_source(id),
        Some(ValueSource::CommandLine | ValueSource::EnvVariable)
    )
}

/// The sources a file names: a list of addresses, or tables whose names name the sensors.
fn sources(file: &ConfigFile<'_>, value: Option<Value>) -> Result<Vec<String>> {
    const EXPECTED: &str =
        "expected source = [\"tcp://HOST:PORT\", ...], or [source.ID] with uri = \"...\"";
    let text = |value: Value| match value {
        Value::String(text) => Ok(text),
        _ => Err(file.bad(format!("`source`: {EXPECTED}"))),
    };
    match value {
        None => Ok(Vec::new()),
        Some(Value::Array(all)) => all.into_iter().map(text).collect(),
        Some(Value::Table(named)) => named
            .into_iter()
            .map(|(id, value)| {
                let Value::Table(mut own) = value else {
                    return Err(file.bad(format!("[source.{id}]: {EXPECTED}")));
                };
                let uri = own
                    .remove("uri")
                    .ok_or_else(|| file.bad(format!("[source.{id}]: uri is missing")))?;
                if let Some(other) = own.keys().next() {
                    return Err(file.unknown_key(&["source", &id], other, &["uri"]));
                }
                let uri = text(uri)?;
                let joint = if uri.contains('?') { '&' } else { '?' };
                Ok(format!("{uri}{joint}id={}", remote::encoded(&id, b"")))
            })
            .collect(),
        Some(one) => text(one).map(|one| vec![one]),
    }
}

/// Adds the keys of `table` to the arguments, but for those `given` already; returns those added.
fn extend(
    argv: &mut Vec<OsString>,
    file: &ConfigFile<'_>,
    tables: &[&str],
    known: &clap::Command,
    table: &Table,
    given: Option<&ArgMatches>,
) -> Result<Vec<String>> {
    let mut added = Vec::new();
    for (key, value) in table {
        let flags = || {
            known
                .get_arguments()
                .filter(|a| a.get_long() != Some("config"))
        };
        let Some(arg) = flags().find(|a| a.get_long() == Some(key)) else {
            let keys: Vec<&str> = flags().filter_map(clap::Arg::get_long).collect();
            return Err(file.unknown_key(tables, key, &keys));
        };
        if given.is_some_and(|m| is_given(m, arg.get_id().as_str())) {
            continue;
        }
        let values = match value {
            Value::Array(all) => all.iter().collect(),
            one => vec![one],
        };
        for value in values {
            let text = match value {
                Value::Boolean(set) if matches!(arg.get_action(), ArgAction::SetTrue) => {
                    if *set {
                        argv.push(format!("--{key}").into());
                    }
                    continue;
                }
                Value::String(text) => text.clone(),
                Value::Integer(n) => n.to_string(),
                Value::Float(x) => x.to_string(),
                other => {
                    let (place, kind) = (file.place(tables, key), other.type_str());
                    return Err(
                        file.bad(format!("{place}`{key}` is a {kind}, which no flag takes"))
                    );
                }
            };
            argv.push(format!("--{key}={text}").into());
        }
        added.push(arg.get_id().to_string());
    }
    Ok(added)
}

/// Adds an argument as it holds for all sensors, unless that is the default.
fn inherit(argv: &mut Vec<OsString>, matches: &ArgMatches, arg: &clap::Arg) {
    let (Some(key), id) = (arg.get_long(), arg.get_id().as_str()) else {
        return;
    };
    if !is_given(matches, id) {
        return;
    }
    if matches!(arg.get_action(), ArgAction::SetTrue) {
        if matches.get_flag(id) {
            argv.push(format!("--{key}").into());
        }
        return;
    }
    for value in matches.get_raw(id).into_iter().flatten() {
        let mut whole = OsString::from(format!("--{key}="));
        whole.push(value);
        argv.push(whole);
    }
}

impl Layered {
    /// The command line with the file under it.
    pub(super) fn serve(&self) -> &Serve {
        &self.serve
    }

    /// The settings of the daemon.
    ///
    /// # Errors
    /// As for flags.
    pub fn settings(&self) -> Result<Settings> {
        let mut settings = self.serve.settings()?;
        for (id, estimation, _) in &self.sensors {
            let plan = estimation.selection().and_then(|_| estimation.live_plans());
            let (plan, mut each) = plan.map_err(|why| {
                let id = strapd_recording::text::printable(id);
                Error::usage(Diagnostic::from(&why).at(format_args!("sensor {id}")))
            })?;
            settings
                .hub
                .plans
                .insert(id.clone(), each.remove(id).unwrap_or(plan));
        }
        Ok(settings)
    }

    /// The settings as TOML with their origins.
    fn show(&self) -> String {
        let mut out = String::new();
        let origin = match (self.serve.sources.is_empty(), self.sources_from_file) {
            (true, _) => "default",
            (false, true) => "file",
            (false, false) => "flag",
        };
        let sources = format!("source = {}", Value::from(self.serve.sources.clone()));
        out.push_str(&format!("{sources:<48} # {origin}\n"));
        let known = Serve::augment_args(clap::Command::new("serve"));
        for arg in known.get_arguments() {
            let (Some(key), id) = (arg.get_long(), arg.get_id().as_str()) else {
                continue;
            };
            let origin = match self.matches.value_source(id) {
                _ if key == "config" => continue,
                _ if self.from_file.iter().any(|k| k == id) => "file",
                Some(ValueSource::CommandLine) => "flag",
                Some(ValueSource::EnvVariable) => "environment",
                _ => "default",
            };
            let is_switch = matches!(arg.get_action(), ArgAction::SetTrue);
            let values: Vec<String> = self
                .matches
                .get_raw(id)
                .into_iter()
                .flatten()
                .map(|v| v.to_string_lossy().into_owned())
                .collect();
            let line = match values.as_slice() {
                _ if is_switch => format!("{key} = {}", self.matches.get_flag(id)),
                [] => format!("# {key} is not set"),
                [one] if !matches!(arg.get_action(), ArgAction::Append) => {
                    format!("{key} = {}", Value::from(one.as_str()))
                }
                several => format!("{key} = {}", Value::from(several.to_vec())),
            };
            out.push_str(&format!("{line:<48} # {origin}\n"));
        }
        for (id, _, own) in &self.sensors {
            out.push_str(&format!("\n[sensor.{}]\n", Value::from(id.as_str())));
            for flag in own {
                let flag = flag.to_string_lossy();
                let (key, value) = flag.trim_start_matches('-').split_once('=').map_or_else(
                    || (flag.trim_start_matches('-'), Value::Boolean(true)),
                    |(key, value)| (key, Value::from(value)),
                );
                out.push_str(&format!("{:<48} # file\n", format!("{key} = {value}")));
            }
        }
        out
    }
}
