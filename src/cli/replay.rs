//! `strapd replay SOURCE... -o SINK...`: recorded samples -> attitude. I/O.

mod calibration;
mod request;
mod words;

use super::continued;
use super::estimation::Estimation;
use super::frames::{BaseFrame, Frames};
use super::known_words;
use super::own_output;
use super::progress::Reporter;
use super::serving::Serving;
use super::setting_args::{Given, Smoothing};
use super::tables::Tables;
use super::{Global, Outcome, outputs};
use crate::config::Shard;
use crate::error::{Error, Result};
use crate::pipeline::replay;
use crate::report::summary::RunSummary;
use crate::sink::{Compression, Format};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::setting::SMOOTH;
use strapd_recording::Selection;
use strapd_recording::pool::Pool;

/// Turn recorded gyro samples into attitude.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd replay flight.mcap -o attitude.mcap
  strapd replay flight.mcap -o - | jq .q                    NDJSON on stdout
  strapd replay flight.mcap -o a.mcap --init gravity --bias auto --world enu
  strapd replay flight.mcap --against-recorded              which --sample-kind fits this log
  strapd replay *.mcap -o out/{stem}.csv --shard 0/4        one share of many logs
  strapd replay --join flight_*.mcap -o attitude.mcap       one recording in several files
  strapd replay flight.mcap --page                          in a browser, with play, pause and seek
  strapd replay flight.mcap --speed 1 -o udp://127.0.0.1:9870?profile=plotjuggler")]
pub struct Replay {
    #[arg(required = true, value_name = "SOURCE", help = super::recordings("Recordings", ", or folders of one"))]
    pub sources: Vec<String>,
    #[arg(short, long = "output", value_name = "SINK", help = sinks())]
    pub outputs: Vec<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub estimation: Estimation,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub smoothing: Given<Smoothing>,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
    /// Each SOURCE is a part of one recording: read in the order of their times, the attitude carried across
    #[arg(long)]
    pub join: bool,
    /// Replace outputs that exist
    #[arg(long, help_heading = "Output")]
    pub force: bool,
    /// Keep in outputs where the input and the files of this command lie, not their names alone
    #[arg(long, help_heading = "Output")]
    pub record_paths: bool,
    /// Save what was learned of the sensor in this TOML file, for --calibration; {stem} stands for the log's name
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub save_calibration: Option<String>,
    /// Copy every message of the input into MCAP outputs too
    #[arg(long, help_heading = "Output")]
    pub copy_input: bool,
    /// Messages in MCAP outputs: ROS 2 CDR, or foxglove.FrameTransform as JSON
    #[arg(long, value_enum, default_value = "cdr", help_heading = "Output")]
    pub encoding: EncodingArg,
    /// Compression of MCAP outputs
    #[arg(long, value_enum, default_value = "zstd", help_heading = "Output")]
    pub compression: CompressionArg,
    /// Keep numbers of Parquet outputs to 24 bits: attitudes to 1e-7 rad, in half the size
    #[cfg(feature = "parquet")]
    #[arg(long, help_heading = "Output")]
    pub parquet_f32: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub frames: Frames,
    /// Name of the frame whose attitude is given [default: as the messages say]
    #[arg(
        long,
        value_name = "NAME",
        conflicts_with = "base_frame",
        help_heading = "Output"
    )]
    pub frame_id: Option<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub base: BaseFrame,
    /// Write at most this many attitudes a second; the integration always uses every sample
    #[arg(
        long,
        value_name = "HZ",
        allow_negative_numbers = true,
        help_heading = "Output"
    )]
    pub out_rate: Option<f64>,
    /// Write attitudes at these instants, not at the samples: of the video's `frames`, of the messages of a topic, or of
    /// a table with a column of stamps
    #[arg(
        long,
        value_name = "FILE|TOPIC|frames",
        conflicts_with = "out_rate",
        help_heading = "Output"
    )]
    pub at: Option<String>,
    /// Speed: max, or a factor of data time such as 1 or 0.5 [default: max; with --page or --paused 1]
    #[arg(
        long,
        value_name = "FACTOR",
        help_heading = "Output",
        value_parser = known_words::speed(),
        hide_possible_values = true
    )]
    pub speed: Option<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub serving: Serving,
    /// Print the error against the orientation recorded in the log (on TOPIC, or found) for each
    /// meaning a sample can have
    #[arg(long, value_name = "TOPIC", num_args = 0..=1, default_missing_value = "", require_equals = true, help_heading = "Estimation")]
    pub against_recorded: Option<String>,
    /// Hold the attitude against the one in this file (.mcap, .ndjson, .csv), on the page and as --against-recorded does
    #[arg(long, value_name = "FILE", help_heading = "Estimation")]
    pub reference: Option<PathBuf>,
    /// Take only logs i, i+n, i+2n, ... of the list (i from 0)
    #[arg(long, value_name = "I/N", help_heading = "Output")]
    pub shard: Option<String>,
}

/// Help of `-o`.
fn sinks() -> String {
    super::sinks(
        &format!("Output for the attitude: a {} file", Format::endings()),
        ", a directory",
        "{stem} stands for the log's name, and its folder is made, as that of DIR/ is. ",
    )
}

/// `--encoding`.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum EncodingArg {
    /// `sensor_msgs/msg/Imu` and `tf2_msgs/msg/TFMessage`.
    Cdr,
    /// `foxglove.FrameTransform`.
    Json,
}

/// `--compression`.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum CompressionArg {
    /// zstd, level 1.
    Zstd,
    /// lz4.
    Lz4,
    /// Uncompressed.
    None,
}

impl From<CompressionArg> for Compression {
    fn from(arg: CompressionArg) -> Compression {
        match arg {
            CompressionArg::Zstd => Compression::Zstd,
            CompressionArg::Lz4 => Compression::Lz4,
            CompressionArg::None => Compression::None,
        }
    }
}

/// `--speed`: `None` = as fast as possible.
pub(super) fn speed(text: &str) -> Result<Option<f64>> {
    if text == "max" {
        return Ok(None);
    }
    text.parse::<f64>()
        .ok()
        .filter(|factor| factor.is_finite() && *factor > 0.0)
        .map(Some)
        .ok_or_else(|| {
            Error::usage(format!(
                "--speed {text}: expected max, or a factor above 0 such as 1 or 0.5"
            ))
        })
}

/// Runs it.
///
/// # Errors
/// With one log, whatever ended it. With several, the rest still run; each failure is said.
pub fn run(global: &Global, mut args: Replay) -> Result<Outcome> {
    let is_of_one = args.sources.len() == 1;
    args.check_values()?;
    args.sources = own_output::without(args.sources, args.estimation.topic.as_deref())?;
    let logs = args.logs()?;
    args.check(global, &logs)?;
    let plan = args
        .estimation
        .plan_of_a_recording(args.smoothing.is(SMOOTH, "true"))?;
    let mut selection = args.estimation.selection()?;
    args.tables.put(&mut selection.decode)?;
    let pool = Pool::new(global.threads)?;
    let mut outcome = Outcome::Done;
    let mut summaries = Vec::new();
    for log in &logs {
        match args.run_one(global, log, (&selection, &plan), &pool) {
            Ok((summary, _)) if !summary.broken.is_empty() && summary.reader_gone => {
                return Ok(Outcome::Lossy);
            }
            // Whoever read the output has enough: nothing more to say or do.
            Ok((summary, _)) if summary.reader_gone => return Ok(outcome),
            Ok((mut summary, ended)) => {
                args.save_calibration(log, &mut summary)?;
                if ended == Outcome::Failed {
                    outcome = ended;
                }
                if summary.is_lossy() && outcome == Outcome::Done {
                    outcome = Outcome::Lossy;
                }
                args.say(global, &summary)?;
                summaries.push(summary);
            }
            Err(error) if logs.len() > 1 && !error.is_broken_pipe() && error.exit_code() != 2 => {
                super::say_error(&error);
                outcome = Outcome::Failed;
            }
            Err(error) => return Err(error),
        }
    }
    if let Some(said) = continued::said(&summaries) {
        tracing::warn!("{said}");
    }
    if global.json {
        words::say_json(is_of_one, &summaries)?;
    }
    Ok(outcome)
}

impl Replay {
    /// Sources that are read by themselves: each of them, of joined ones the first, which stands for all.
    fn recordings(&self) -> &[String] {
        match self.join {
            true => self.sources.get(..1).unwrap_or_default(),
            false => &self.sources,
        }
    }

    /// Checks that no source is the value of a flag whose value stands behind `=`.
    fn check_values(&self) -> Result<()> {
        let is_address = |text: &str| {
            let port = text.rsplit(':').next().unwrap_or(text);
            port.parse::<u16>().is_ok()
        };
        let is_topic = |text: &str| text.starts_with('/');
        for source in self.sources.iter().filter(|name| !Path::new(name).exists()) {
            let flag = match (&self.serving.page, &self.against_recorded) {
                (Some(_), _) if is_address(source) => "--page",
                (_, Some(_)) if is_topic(source) => "--against-recorded",
                _ => continue,
            };
            let what = format!("{source}: no such file");
            return Err(Error::usage(
                Diagnostic::new(what).help(format!("{flag}={source}, if it is meant for {flag}")),
            ));
        }
        Ok(())
    }

    /// Logs of this share of the recordings.
    fn logs(&self) -> Result<Vec<&String>> {
        let shard = self.shard.as_deref().map(Shard::parse).transpose()?;
        if self.join && shard.is_some() {
            return Err(Error::usage(
                Diagnostic::new("--join: one recording, of which --shard has no share")
                    .help("leave one of the two out"),
            ));
        }
        Ok(self
            .recordings()
            .iter()
            .enumerate()
            .filter(|(i, _)| shard.is_none_or(|s| s.takes(*i)))
            .map(|(_, log)| log)
            .collect())
    }

    /// Checks that no two outputs share a place, and that what is of one log alone is asked for one.
    fn check(&self, global: &Global, logs: &[&String]) -> Result<()> {
        let recordings = self.recordings();
        if global.json && self.writes_stdout() {
            return Err(Error::usage(
                Diagnostic::new("--json and -o - would both write to stdout")
                    .help("give the attitude a file name"),
            ));
        }
        if let (Some(path), [_, _, ..]) = (&self.reference, recordings) {
            let what = format!("--reference {} is of one log", path.display());
            return Err(Error::usage(Diagnostic::new(what).help("give one SOURCE")));
        }
        if recordings.len() > 1 && self.serving.page.is_some() {
            return Err(Error::usage(
                Diagnostic::new("--page: one log at a time").help("give one SOURCE"),
            ));
        }
        outputs::check_distinct(&self.outputs, recordings)?;
        self.check_calibrations(logs)
    }

    fn writes_stdout(&self) -> bool {
        self.outputs.iter().any(|output| output == "-")
    }

    /// Replays one log: once, and again as often as whoever is served asks for it.
    fn run_one(
        &self,
        global: &Global,
        log: &str,
        (selection, plan): (&Selection, &EstimationSettings),
        pool: &Pool,
    ) -> Result<(RunSummary, Outcome)> {
        let names = outputs::resolve(&self.outputs, log, self.recordings().len())?;
        let (mut request, mut served) = self.request(log, &names, (selection, plan), pool)?;
        outputs::make_folders(&self.outputs, &names)?;
        served.look_through(&request, global.threads);
        served.run(|again| {
            if again {
                request.targets.retain(|target| target.listens().is_some());
            }
            let mut reporter = Reporter::new(global, &outputs::shown(log));
            let result = replay::run(&request, pool, &mut |position| reporter.update(position));
            reporter.finish();
            result
        })
    }
}
