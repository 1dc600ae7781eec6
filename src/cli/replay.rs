//! `strapd replay SOURCE... -o SINK...`: recorded samples -> attitude. I/O.

use super::calibration_files;
use super::continued;
use super::estimation::Estimation;
use super::frames::{BaseFrame, Frames};
use super::known_words;
use super::own_output;
use super::progress::Reporter;
use super::serving::{Served, Serving};
use super::setting_args::{Given, Smoothing};
use super::tables::Tables;
use super::{Global, Outcome, outputs, print};
use crate::config::Shard;
use crate::error::{Error, Result};
use crate::pipeline::attitude_track::{self, Side, Track};
use crate::pipeline::opening;
use crate::pipeline::replay;
use crate::pipeline::request::ReplayRequest;
use crate::report::summary::RunSummary;
use crate::sink::{Compression, Encoding, Format, Options, Precision, Target};
use clap::{Args, ValueEnum};
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::record::Nanos;
use strapd_attitude::setting::{BIAS, SMOOTH};
use strapd_recording::Selection;
use strapd_recording::Source;
use strapd_recording::decode::Options as DecodeOptions;
use strapd_recording::pool::Pool;
use strapd_recording::recording::instants::Instants;

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
    fn from(named: CompressionArg) -> Compression {
        match named {
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
    let args = &args;
    let shard = args.shard.as_deref().map(Shard::parse).transpose()?;
    if args.join && shard.is_some() {
        return Err(Error::usage(
            Diagnostic::new("--join: one recording, of which --shard has no share")
                .help("leave one of the two out"),
        ));
    }
    let recordings = args.recordings();
    let logs: Vec<&String> = recordings
        .iter()
        .enumerate()
        .filter(|(i, _)| shard.is_none_or(|s| s.takes(*i)))
        .map(|(_, log)| log)
        .collect();
    if global.json && writes_stdout(args) {
        return Err(Error::usage(
            Diagnostic::new("--json and -o - would both write to stdout")
                .help("give the attitude a file name"),
        ));
    }
    if let (Some(path), [_, _, ..]) = (&args.reference, recordings) {
        let what = format!("--reference {} is of one log", path.display());
        return Err(Error::usage(Diagnostic::new(what).help("give one SOURCE")));
    }
    if recordings.len() > 1 && args.serving.page.is_some() {
        return Err(Error::usage(
            Diagnostic::new("--page: one log at a time").help("give one SOURCE"),
        ));
    }
    outputs::check_distinct(&args.outputs, recordings)?;
    args.check_calibrations(&logs)?;
    let plan = args
        .estimation
        .plan_of_a_recording(args.smoothing.is(SMOOTH, "true"))?;
    let mut selection = args.estimation.selection()?;
    args.tables.put(&mut selection.decode)?;
    let pool = Pool::new(global.threads)?;
    let mut outcome = Outcome::Done;
    let mut summaries = Vec::new();
    for log in &logs {
        let result = outputs::resolve(&args.outputs, log, recordings.len())
            .and_then(|names| {
                let run = args.run(log, &names, (selection.clone(), plan.clone()), &pool)?;
                outputs::make_folders(&args.outputs, &names)?;
                Ok(run)
            })
            .and_then(|(mut run, mut served)| {
                served.look_through(&run, global.threads);
                served.run(|again| {
                    if again {
                        run.targets.retain(|target| target.listens().is_some());
                    }
                    let mut reporter = Reporter::new(global, &outputs::shown(log));
                    let result =
                        replay::run(&run, &pool, &mut |position| reporter.update(position));
                    reporter.finish();
                    result
                })
            });
        match result {
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
                say(global, args, &summary)?;
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
        say_json(is_of_one, &summaries)?;
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

    /// Path for the calibration of a log.
    fn calibration_file(&self, log: &str) -> Option<String> {
        let name = self.save_calibration.as_ref()?;
        Some(name.replace("{stem}", &outputs::stem(log)))
    }

    /// Checks that each log has a file for its calibration, and each calibration is of one sensor.
    fn check_calibrations(&self, logs: &[&String]) -> Result<()> {
        let Some(name) = &self.save_calibration else {
            return Ok(());
        };
        let wrong = |what: &str, help: &str| {
            let what = format!("--save-calibration {name}: {what}");
            Err(Error::usage(Diagnostic::new(what).help(help)))
        };
        if self.recordings().len() > 1 && !name.contains("{stem}") {
            return wrong(
                "each log would be saved there",
                "a name with {stem}, for example {stem}.calibration.toml",
            );
        }
        if self.estimation.topic.as_deref() == Some("all") {
            return wrong("a calibration is of one sensor", "--topic NAME");
        }
        if self.estimation.is_unaided() && !self.estimation.settings.is(BIAS, "auto") {
            return wrong(
                "the gyro alone learns nothing",
                "--aid gravity, or --bias auto for the bias of a rest",
            );
        }
        let files = logs.iter().filter_map(|log| self.calibration_file(log));
        files.map(PathBuf::from).try_for_each(|file| {
            if outputs::is_pattern(name) {
                outputs::make_folder(&file)?;
            }
            calibration_files::check_target(&file, self.force)
        })
    }

    fn save_calibration(&self, log: &str, summary: &mut RunSummary) -> Result<()> {
        let Some(file) = self.calibration_file(log) else {
            return Ok(());
        };
        let [topic] = summary.topics.as_slice() else {
            return Err(Error::usage(
                Diagnostic::new(format!(
                    "--save-calibration {file}: {} sensors, and a calibration is of one",
                    summary.topics.len()
                ))
                .help("--topic NAME"),
            ));
        };
        calibration_files::write(Path::new(&file), &topic.calibration)?;
        summary.calibration = Some(file);
        Ok(())
    }

    /// The reference from another file, if one is given: attitudes as `compare` reads them.
    fn read_reference(&self, pool: &Pool) -> Result<Option<Arc<Track>>> {
        let Some(path) = &self.reference else {
            return Ok(None);
        };
        let input = opening::open(path)?;
        let track = attitude_track::read(
            &input,
            Side::Reference,
            None,
            &DecodeOptions::default(),
            pool,
        )?;
        for problem in &track.problems {
            tracing::warn!("{problem}");
        }
        Ok(Some(Arc::new(track)))
    }

    /// The file of a recording that is read beforehand, too.
    fn file_read_twice<'s>(source: &'s Source, asked: &str) -> Result<&'s Path> {
        match source {
            Source::File(path) => Ok(path),
            _ => {
                let what = format!("{asked}: the recording is to be one file, which is read twice");
                Err(Error::usage(Diagnostic::new(what).help("keep it as one")))
            }
        }
    }

    /// The instants at which attitudes are wanted, if somebody says any.
    fn read_instants(
        &self,
        source: &Source,
        options: &DecodeOptions,
        pool: &Pool,
    ) -> Result<Option<Arc<[Nanos]>>> {
        let Some(asked) = &self.at else {
            return Ok(None);
        };
        let instants = Instants::named(asked);
        let path = match &instants {
            Instants::Table(path) => path,
            Instants::Frames | Instants::Topic(_) => {
                Self::file_read_twice(source, &format!("--at {asked}"))?
            }
        };
        let (read, note) = instants.read(path, options, pool)?;
        if let Some(note) = note {
            tracing::warn!("{note}");
        }
        Ok(Some(read.into()))
    }

    /// The run for one log.
    ///
    /// # Errors
    /// [`Error::Usage`] for a flag that cannot be.
    fn run(
        &self,
        log: &str,
        outputs: &[String],
        (selection, mut plan): (Selection, EstimationSettings),
        pool: &Pool,
    ) -> Result<(ReplayRequest, Served)> {
        if self
            .out_rate
            .is_some_and(|hz| !(hz.is_finite() && hz > 0.0))
        {
            return Err(Error::usage("--out-rate: a rate above 0 Hz".to_owned()));
        }
        let targets = outputs
            .iter()
            .map(|o| Target::parse(o))
            .collect::<Result<_>>()?;
        let source = match self.sources.as_slice() {
            several @ [_, _, ..] if self.join => {
                Source::Parts(several.iter().map(PathBuf::from).collect())
            }
            _ => Source::parse(log),
        };
        if let Some(base) = &self.base.base_frame {
            let path = Self::file_read_twice(&source, &format!("--base-frame {base}"))?;
            let input = opening::open(path)?;
            self.base.put(&mut plan, (&input, &selection), pool)?;
        }
        let reference = self.read_reference(pool)?;
        let instants = self.read_instants(&source, &selection.decode, pool)?;
        let can_rewind = match &source {
            Source::File(path) => path.is_file(),
            Source::Parts(_) => true,
            Source::Stdin => false,
            Source::Elsewhere(_) => true,
        };
        let body = self.base.base_frame.as_ref().or(self.frame_id.as_ref());
        let frames = self.frames.names(body.cloned());
        let served = self.serving.start(
            targets,
            self.speed.as_deref(),
            (&outputs::shown(log), can_rewind, false),
            &frames,
        )?;
        let run = ReplayRequest {
            source,
            targets: served.targets.clone(),
            audience: served.audience(),
            selection,
            plan,
            options: Options {
                force: self.force,
                encoding: match self.encoding {
                    EncodingArg::Cdr => Encoding::Cdr,
                    EncodingArg::Json => Encoding::Json,
                },
                compression: self.compression.into(),
                precision: self.precision(),
            },
            copy_input: self.copy_input,
            out_rate: self.out_rate,
            instants,
            frames,
            speed: served.speed,
            against: match (&self.against_recorded, &reference) {
                (None, Some(_)) => Some(String::new()),
                (asked, _) => asked.clone(),
            },
            reference,
            command: super::shell::recorded_command(self.record_paths),
            record_paths: self.record_paths,
        };
        Ok((run, served))
    }
}

impl Replay {
    #[cfg(feature = "parquet")]
    fn precision(&self) -> Precision {
        match self.parquet_f32 {
            true => Precision::Single,
            false => Precision::Double,
        }
    }

    #[cfg(not(feature = "parquet"))]
    fn precision(&self) -> Precision {
        Precision::default()
    }
}

/// The text summary: on stdout, or on stderr when the data or JSON is there.
fn say(global: &Global, args: &Replay, summary: &RunSummary) -> Result<()> {
    if global.quiet {
        say_warnings(summary);
        return Ok(());
    }
    let text = match global.verbose {
        0 => format!("{}{}", summary.brief(), next(summary, args.join)),
        _ => summary.text(),
    };
    if global.json || writes_stdout(args) {
        // A stderr that is gone leaves nobody to tell.
        let _ = std::io::stderr().write_all(text.as_bytes());
        return Ok(());
    }
    print(&text)
}

const NOTHING_NEXT: &str = "  next     -v prints all of this summary\n";

/// Line about what to do next.
fn next(summary: &RunSummary, is_joined: bool) -> String {
    if Path::new(&summary.source) == Source::Stdin.name() {
        // It is gone: there is nothing that a command could read again.
        return NOTHING_NEXT.to_owned();
    }
    // No other command takes several files as one recording.
    if is_joined {
        return NOTHING_NEXT.to_owned();
    }
    let log = strapd_replay::shell::quoted(OsString::from(&summary.source));
    let has_more = summary.is_lossy() || summary.topics.iter().any(|t| !t.warnings().is_empty());
    match has_more {
        true => format!(
            "  next     strapd check {log}  (what is wrong and what helps; -v prints all of this summary)\n"
        ),
        false => format!(
            "  next     strapd report {log} -o report.html  (pictures; -v prints all of this summary)\n"
        ),
    }
}

/// Prints what `--quiet` leaves: why the exit code is 3, and the warnings.
fn say_warnings(summary: &RunSummary) {
    let source = &summary.source;
    for topic in &summary.topics {
        let lost = topic.counts.lost();
        if lost > 0 {
            let total = topic.counts.total();
            tracing::warn!("{source}: {}: lost {lost} of {total} samples", topic.topic);
        }
        let breaks = topic.gaps.held + topic.gaps.resets;
        if breaks > 0 {
            tracing::warn!(
                "{source}: {}: {breaks} gaps were not integrated over, {:.3} s in all",
                topic.topic,
                topic.gaps.held_secs
            );
        }
        for warning in topic.warnings() {
            tracing::warn!("{source}: {}: {warning}", topic.topic);
        }
    }
    for problem in &summary.file_problems {
        tracing::warn!("{source}: {problem}");
    }
}

/// One object for one log, an array for several.
fn say_json(is_of_one: bool, summaries: &[RunSummary]) -> Result<()> {
    let value = match summaries {
        [one] if is_of_one => one.json(),
        many => many.iter().map(RunSummary::json).collect(),
    };
    print(&format!("{value}\n"))
}

fn writes_stdout(args: &Replay) -> bool {
    args.outputs.iter().any(|o| o == "-")
}
