//! `strapd allan FILE`: a recording at rest -> Allan deviation, noise terms, the flags for them. I/O.

mod gather;
mod outputs;
mod words;

use super::setting_args::{Given, Reading};
use super::tables::Tables;
use super::{Global, Outcome, print};
use crate::config::selection;
use crate::error::{Error, Result};
use crate::pipeline::opening;
use crate::report::page::Noise;
use crate::sink::Document;
use clap::Args;
use gather::AngleSeries;
use std::path::PathBuf;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::noise::allan::{AllanFit, Point, cluster_sizes, deviation, fit};
use strapd_attitude::record::SampleKind;
use strapd_recording::Input;
use strapd_recording::Selection;
use strapd_recording::pool::Pool;

/// Help of the longest gap, which is filled here.
const MAX_GAP_HELP: &str = "Longest run of missing samples that is filled with a straight line, in seconds; at longer ones the record is split";

/// Allan deviation of a recording at rest: angle random walk, bias instability, rate random walk,
/// quantisation, ramp
#[derive(Args, Debug)]
#[command(mut_arg("max_gap", |gap| gap.help(MAX_GAP_HELP).long_help(None::<&str>)), after_help = "Examples:
  strapd allan rest.mcap                          a table, and the --noise flags for it
  strapd allan rest.mcap --plot allan.svg         the three axes and what was fitted
  strapd allan rest.mcap --start 600 --json       after ten minutes of warming up

Record for at least nine times the longest time that matters, the sensor fixed and warm.
At most 8 million angles are held (200 MB); a longer record is thinned, which is said.")]
pub struct Allan {
    #[arg(value_name = "FILE", help = super::recordings("Recording", ""))]
    pub file: PathBuf,
    /// IMU topic; needed only when a log has several
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Path of a value in the message: ROLE=PATH, as in replay
    #[arg(long = "field", value_name = "ROLE=PATH")]
    pub fields: Vec<String>,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
    /// Use a gyro whose covariance is marked -1 (absent) all the same
    #[arg(long)]
    pub ignore_covariance_flag: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub settings: Given<Reading>,
    /// Write the curves and the fits as a chart
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Write the curves and the fits as a table, rad/s
    #[arg(long, value_name = "FILE.csv")]
    pub csv: Option<PathBuf>,
    /// Replace output files that exist
    #[arg(long)]
    pub force: bool,
}

/// Cluster sizes a decade.
const PER_DECADE: u32 = 12;

/// One axis's curve and fit; rad/s.
struct Axis {
    name: &'static str,
    points: Vec<Point>,
    /// `None` = the axis is stuck.
    fit: Option<AllanFit>,
}

/// Runs it.
///
/// # Errors
/// The log cannot be read, holds no rate, or too few samples; an output exists.
pub fn run(global: &Global, args: &Allan) -> Result<Outcome> {
    let plan = args.plan()?;
    let mut selection = selection(
        args.topic.as_ref(),
        &args.fields,
        args.ignore_covariance_flag,
        [None, None],
    )?;
    args.tables.put(&mut selection.decode)?;
    args.plot
        .iter()
        .try_for_each(|p| super::outputs::check_chart(p))?;
    let open = |path: &Option<PathBuf>| {
        path.as_deref()
            .map(|p| Document::create(p, std::slice::from_ref(&args.file), args.force))
            .transpose()
    };
    let (plot, csv) = (open(&args.plot)?, open(&args.csv)?);
    let pool = Pool::new(global.threads)?;
    let input = opening::open(&args.file)?;
    let gathered = gather::gather(&input, (&selection, &plan), gather::CAPACITY, &pool)?;
    let axes = analyse(&gathered).map_err(|what| strapd_recording::Error::Topic {
        path: input.name().to_owned(),
        topic: gathered.topic.clone(),
        what,
    })?;
    for warning in gathered.warnings().iter().chain(&words::doubts(&axes)) {
        tracing::warn!("{warning}");
    }
    if let Some(document) = plot {
        let chart = outputs::chart(&gathered.topic, &axes);
        let svg = chart.svg().map_err(|e| strapd_recording::Error::Topic {
            path: input.name().to_owned(),
            topic: gathered.topic.clone(),
            what: e.to_string().into(),
        })?;
        document.write(&svg)?;
    }
    if let Some(document) = csv {
        document.write(&outputs::table(&axes))?;
    }
    if global.json {
        print(&format!("{}\n", words::json(&gathered, &axes)))?;
    } else if !global.quiet {
        print(&words::text(input.name(), &gathered, &axes))?;
    }
    Ok(if gathered.is_lossy() {
        Outcome::Lossy
    } else {
        Outcome::Done
    })
}

/// Angles held for a report: 25 MB.
const FOR_REPORT: usize = 1 << 20;

/// The same for a report.
///
/// # Errors
/// As [`run`], but for outputs.
pub(super) fn examined(
    input: &Input,
    asked: (&Selection, &EstimationSettings),
    pool: &Pool,
) -> Result<Noise> {
    let gathered = gather::gather(input, asked, FOR_REPORT, pool)?;
    let fails = |what| strapd_recording::Error::Topic {
        path: input.name().to_owned(),
        topic: gathered.topic.clone(),
        what,
    };
    let axes = analyse(&gathered).map_err(fails)?;
    let svg = outputs::chart(&gathered.topic, &axes)
        .svg()
        .map_err(|e| fails(e.to_string().into()))?;
    let mut text = words::text(input.name(), &gathered, &axes);
    for warning in gathered.warnings().iter().chain(&words::doubts(&axes)) {
        text.push_str(&format!("  warning  {warning}\n"));
    }
    Ok(Noise::Measured {
        svg,
        text,
        json: words::json(&gathered, &axes),
    })
}

/// The curves and fits of the three axes.
fn analyse(gathered: &AngleSeries) -> std::result::Result<Vec<Axis>, Diagnostic> {
    let record = &gathered.record;
    let interval = gathered.interval;
    // Rates were summed in units of the sampling interval.
    let unit = match gathered.resolved.kind {
        SampleKind::DeltaAngle | SampleKind::Rotation => 1.0,
        SampleKind::Rate | SampleKind::Average => interval,
    };
    let spread = record.spread();
    ["x", "y", "z"]
        .into_iter()
        .enumerate()
        .map(|(axis, name)| {
            let pieces = record.pieces(axis);
            let longest = pieces.iter().map(|p| p.len()).max().unwrap_or(0);
            let mut points = deviation(
                &pieces,
                interval * record.stride() as f64,
                &cluster_sizes(longest, PER_DECADE),
            )
            .map_err(|e| {
                Diagnostic::new(e.to_string())
                    .help("a longer record; --max-gap SECS fills longer gaps")
            })?;
            points.iter_mut().for_each(|p| p.sigma *= unit);
            let stuck = spread[axis] <= 0.0;
            Ok(Axis {
                name,
                fit: if stuck { None } else { fit(&points) },
                points,
            })
        })
        .collect()
}

impl Allan {
    /// The flags as a plan: what replay's of the same names mean.
    fn plan(&self) -> Result<EstimationSettings> {
        let mut plan = EstimationSettings::default();
        self.settings.put(&mut plan, None).map_err(Error::usage)?;
        plan.check().map_err(Error::usage)?;
        Ok(plan)
    }
}
