//! `strapd calibrate LOG... -o FILE.toml`: recordings of one sensor -> its calibration. I/O.

use super::calibration_files::{check_target, write};
use super::estimation::Estimation;
use super::outputs::shown;
use super::progress::Reporter;
use super::tables::Tables;
use super::{Global, Outcome, own_output, print};
use crate::error::{Error, Result};
use crate::pipeline::replay;
use crate::pipeline::request::ReplayRequest;
use crate::report::calibrating::{Calibrating, Recorded};
use crate::report::calibration;
use crate::report::summary::TopicSummary;
use crate::sink::Target;
use clap::Args;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Aid, EstimationSettings, Pooled, SensorCalibration};
use strapd_recording::Selection;
use strapd_recording::Source;
use strapd_recording::pool::Pool;

/// Calibrate a sensor: what recordings of it tell of its bias, scale and misalignment, of all of them together.
///
/// Each recording is smoothed by itself, and what they tell is pooled: what one of them does not show another may, and
/// where they differ, sigma says so. For magnetometers: --aid gravity+mag.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd calibrate monday.mcap tuesday.mcap -o imu.toml     one sensor, two recordings
  strapd calibrate new.mcap --calibration imu.toml -o imu.toml --force      one more
  strapd calibrate turns.mcap --aid gravity+mag -o imu.toml magnetometer too
  strapd serve --calibration imu.toml                       good from the first sample

What it could not tell is listed with the motion that would show it.")]
pub struct Calibrate {
    #[arg(required = true, value_name = "LOG", help = super::recordings("Recordings of one sensor", ", or folders of one"))]
    pub logs: Vec<String>,
    /// The calibration, for --calibration
    #[arg(short, long, value_name = "FILE.toml")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub estimation: Estimation,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
    /// Replace a file that exists
    #[arg(long, help_heading = "Output")]
    pub force: bool,
}

/// Runs it.
///
/// # Errors
/// [`Error::Usage`]; with one log whatever ended it. With several the rest still run, and each failure is said; none is
/// left: the last one.
pub fn run(global: &Global, mut args: Calibrate) -> Result<Outcome> {
    args.logs = own_output::without(args.logs, args.estimation.topic.as_deref())?;
    let args = &args;
    args.check(global)?;
    let plan = args.estimation.plan_of_a_recording(true)?;
    let mut selection = args.estimation.selection()?;
    args.tables.put(&mut selection.decode)?;
    let pool = Pool::new(global.threads)?;
    // What was known before is one recording more, but for the bias of another day.
    let before = plan.calibration.as_deref().map(|known| SensorCalibration {
        bias: None,
        ..known.clone()
    });
    let plan = EstimationSettings {
        calibration: None,
        ..plan
    };
    let mut told: Vec<SensorCalibration> = before.into_iter().collect();
    let mut sources: Vec<String> = told.iter().flat_map(|t| t.sources.clone()).collect();
    let mut outcome = Outcome::Done;
    let mut recorded = Vec::new();
    for (n, log) in args.logs.iter().enumerate() {
        match learned(global, log, (selection.clone(), plan.clone()), &pool) {
            Ok((topic, is_lossy)) => {
                let other = told.last().and_then(|t| t.mismatch(&topic.topic));
                if other.is_some() {
                    tracing::warn!(
                        "{}: its sensor is called {}, and that before another name: taken for the same one",
                        shown(log),
                        topic.topic
                    );
                }
                if is_lossy && outcome == Outcome::Done {
                    outcome = Outcome::Lossy;
                }
                recorded.push(Recorded::of(&shown(log), &topic));
                sources.extend(topic.calibration.sources.iter().cloned());
                told.push(topic.calibration);
            }
            Err(error) => {
                let is_last = n + 1 == args.logs.len() && recorded.is_empty();
                if is_last || error.exit_code() == 2 || error.is_broken_pipe() {
                    return Err(error);
                }
                super::say_error(&error);
                outcome = Outcome::Failed;
            }
        }
    }
    let mut pooled = Pooled::of(&told);
    pooled.calibration.sources = calibration::latest(sources);
    if let Some(path) = &args.output {
        write(path, &pooled.calibration)?;
    }
    let calibrating = Calibrating {
        recorded,
        pooled,
        has_magnetometer: plan.aid == Aid::GravityAndField,
        file: args.output.as_ref().map(|path| path.display().to_string()),
    };
    if global.json {
        print(&format!("{}\n", calibrating.json()))?;
    } else if !global.quiet {
        print(&calibrating.text())?;
    }
    Ok(outcome)
}

impl Calibrate {
    fn check(&self, global: &Global) -> Result<()> {
        match &self.output {
            // Its own calibration may be replaced by a better one.
            Some(path) => check_target(path, self.force)?,
            None if global.json || !global.quiet => {}
            None => {
                return Err(Error::usage(
                    Diagnostic::new("calibrate: nothing would come of it")
                        .help("-o imu.toml writes the calibration"),
                ));
            }
        }
        if self.estimation.is_unaided() {
            return Err(Error::usage(
                Diagnostic::new(
                    "calibrate: --aid none: the gyro alone tells nothing of its errors",
                )
                .help("--aid gravity, or gravity+mag"),
            ));
        }
        if self.estimation.topic.as_deref() == Some("all") {
            return Err(Error::usage(
                Diagnostic::new("calibrate: a calibration is of one sensor").help("--topic NAME"),
            ));
        }
        let mut names: Vec<&Path> = self.logs.iter().map(Path::new).collect();
        names.sort_unstable();
        if let Some([twice, _]) = names.windows(2).find_map(|pair| match pair {
            [a, b] if a == b => Some([a, b]),
            _ => None,
        }) {
            return Err(Error::usage(format!(
                "calibrate: {} is named twice, and would count for two recordings",
                twice.display()
            )));
        }
        Ok(())
    }
}

/// Results of one recording, and whether samples of it were lost.
fn learned(
    global: &Global,
    log: &str,
    (selection, plan): (Selection, EstimationSettings),
    pool: &Pool,
) -> Result<(TopicSummary, bool)> {
    let run = ReplayRequest {
        targets: vec![Target::Null],
        selection,
        plan,
        command: super::shell::recorded_command(false),
        ..ReplayRequest::new(Source::parse(log))
    };
    let mut reporter = Reporter::new(global, &shown(log));
    let summary = replay::run(&run, pool, &mut |position| reporter.update(position));
    reporter.finish();
    let mut summary = summary?;
    let is_lossy = summary.is_lossy();
    match (summary.topics.pop(), summary.topics.len()) {
        (Some(topic), 0) => Ok((topic, is_lossy)),
        (_, others) => Err(Error::usage(
            Diagnostic::new(format!(
                "calibrate: {}: {} sensors, and a calibration is of one",
                shown(log),
                others + 1
            ))
            .help("--topic NAME"),
        )),
    }
}
