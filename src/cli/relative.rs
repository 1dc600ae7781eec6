//! `strapd relative A B`: the angle of the joint between two sensors. I/O.

mod table;
mod words;

use super::compare::{attitudes, no_match};
use super::tables::Tables;
use super::{Global, Outcome, print};
use crate::error::{Error, Result};
use crate::pipeline::attitude_track::{self, Side, Track};
use crate::pipeline::opening;
use crate::report::page::STRETCHES;
use crate::report::plot::{Axis, Chart, Series, SeriesStyle};
use crate::report::trace::Traces;
use crate::sink::Document;
use clap::Args;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::joint::{Joint, RelativeHeading, Segment, joint};
use strapd_recording::decode::Options;
use strapd_recording::pool::Pool;

/// Attitude of one body relative to another: the angle of the joint between them.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd relative thigh.mcap shank.mcap --plot knee.svg          a knee, from the attitudes of two replays
  strapd relative thigh.mcap shank.mcap -o knee.csv              angle, sigma and quaternion at each instant
  strapd relative a.mcap b.mcap -o knee.sto                      for OpenSim
  strapd relative body.mcap body.mcap --topic /a --second-topic /b --heading recorded

Without a magnetometer each sensor has a heading of its own, which drifts. A joint with one axis closes that
gap: the axis and the offset of the headings are estimated from the motion (--heading).")]
pub struct Relative {
    #[arg(value_name = "A", help = super::recordings("Attitudes of the first body", ""))]
    pub first: PathBuf,
    /// Attitudes of the second body: the same
    #[arg(value_name = "B")]
    pub second: PathBuf,
    /// Topic (MCAP) or id (NDJSON) of the first; needed only when there are several
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Topic or id of the second
    #[arg(long, value_name = "NAME")]
    pub second_topic: Option<String>,
    /// Source of the heading of one relative to the other: hinge (the joint has one axis), recorded (both know north),
    /// start (both point the same way at the first common instant), auto (hinge where the motion shows one, else recorded)
    #[arg(long, default_value = "auto", value_parser = RelativeHeading::ALL.map(RelativeHeading::name))]
    pub heading: String,
    /// Write the joint's angle over time: .csv, or .sto for OpenSim; - is CSV on standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Write the angle over time as a chart
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Replace a file that exists
    #[arg(long)]
    pub force: bool,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
}

/// Runs it.
///
/// # Errors
/// A file cannot be read, holds no attitude or several, the two share no instant, or `--heading hinge` and no hinge.
pub fn run(global: &Global, args: &Relative) -> Result<Outcome> {
    let heading: RelativeHeading = args
        .heading
        .parse()
        .map_err(|e: Diagnostic| Error::usage(e.at(format_args!("--heading {}", args.heading))))?;
    args.plot
        .iter()
        .try_for_each(|p| super::outputs::check_chart(p))?;
    let form = args.output.as_deref().map(table::Form::of).transpose()?;
    if args.first == args.second && args.first.as_os_str() == "-" {
        return Err(Error::usage(
            Diagnostic::new("relative - -: standard input comes once")
                .help("give one of the two a file"),
        ));
    }
    let inputs = [args.first.clone(), args.second.clone()];
    let create = |path: &PathBuf| Document::create(path, &inputs, args.force);
    let output = args.output.as_ref().map(create).transpose()?;
    let plot = args.plot.as_ref().map(create).transpose()?;
    let pool = Pool::new(global.threads)?;
    let mut options = Options::default();
    args.tables.put(&mut options)?;
    let read = |path: &Path, side: Side, topic: &Option<String>| {
        let input = opening::open(path)?;
        attitude_track::read(&input, side, topic.as_deref(), &options, &pool)
    };
    let first = read(&args.first, Side::Estimate, &args.topic)?;
    let second = read(&args.second, Side::Second, &args.second_topic)?;
    for problem in first.problems.iter().chain(&second.problems) {
        tracing::warn!("{problem}");
    }
    let found = between(&first, &second, heading)?;
    if let Some((document, form)) = output.zip(form) {
        document.write(&form.text(&found))?;
    }
    if let Some(document) = plot {
        let chart = chart(&found).svg();
        document.write(&chart.map_err(|e| unsupported(&first, e.to_string()))?)?;
    }
    if global.json {
        print(&format!("{}\n", words::as_json(&found)))?;
    } else if !global.quiet && args.output.as_deref() != Some(Path::new("-")) {
        print(&words::as_text(&found, &first.name, &second.name))?;
    }
    Ok(Outcome::Done)
}

fn between(first: &Track, second: &Track, heading: RelativeHeading) -> Result<Joint> {
    let (a, b) = (attitudes(first), attitudes(second));
    let found = joint(
        Segment {
            rows: &a,
            covariances: &first.covariances,
        },
        Segment {
            rows: &b,
            covariances: &second.covariances,
        },
        heading,
    )
    .map_err(|why| unsupported(first, &why))?;
    if found.rows.is_empty() {
        return Err(no_match(first, second));
    }
    Ok(found)
}

fn unsupported(track: &Track, why: impl Into<Diagnostic>) -> Error {
    strapd_recording::Error::unsupported(Path::new(&track.name), why).into()
}

/// The angle over time with three sigma on both sides.
fn chart(found: &Joint) -> Chart {
    let mut traces = Traces::<4>::new(STRETCHES);
    let first = found.rows.first().map(|row| row.stamp);
    for row in &found.rows {
        let bound = row.sigma.map_or(f64::NAN, |sigma| 3.0 * sigma);
        let degrees = [
            row.angle,
            row.off_axis,
            row.angle - bound,
            row.angle + bound,
        ];
        let time = first.map_or(0, |first| row.stamp.since(first));
        traces.push(time, degrees.map(f64::to_degrees));
    }
    let series = |index: usize, name: &str, look, color| Series {
        name: name.to_owned(),
        points: traces.points(index, 1e9),
        look,
        color: Some(color),
    };
    let mut all = Vec::new();
    if found.rows.iter().any(|row| row.sigma.is_some()) {
        let mut band = series(2, "3 sigma", SeriesStyle::Band, 1);
        let above = traces.points(3, 1e9).into_iter().rev();
        band.points.extend(above);
        band.points.retain(|[_, y]| y.is_finite());
        all.push(band);
    }
    all.push(series(0, "angle", SeriesStyle::Line, 1));
    if found.heading == RelativeHeading::Hinge {
        all.push(series(1, "off the axis", SeriesStyle::Thin, 2));
    }
    Chart {
        title: "Angle from the first instant".to_owned(),
        x: Axis::linear("time since the first common instant, s"),
        y: Axis::linear("deg"),
        series: all,
        size: (1040, 420),
        ..Chart::default()
    }
}
