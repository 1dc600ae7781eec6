//! `strapd compare EST REF`: time-aligned angle error between two attitudes. I/O.

use super::tables::Tables;
use super::{Global, Outcome, print};
use crate::error::{Error, Result};
use crate::pipeline::attitude_track::{self, Side, Track};
use crate::pipeline::opening;
use crate::report::against;
use crate::report::page::{STRETCHES, comparison_json};
use crate::report::plot::{Axis, Chart, Series, SeriesStyle};
use crate::report::summary::significant;
use crate::report::trace::Traces;
use crate::sink::Document;
use clap::Args;
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use strapd_attitude::compare::{
    Align, BiasFit, BodyAxesFit, Comparison, Consistency, ErrorStats, Errors, Reference, Stamped,
    TimeShift, UncertainAttitude, compare, consistency, fit_body_axes, fit_constant_bias,
    fit_time_shift, for_each_error,
};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::Nanos;
use strapd_recording::decode::Options;
use strapd_recording::pool::Pool;

/// Time-aligned angle error between two attitudes.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd compare attitude.mcap flight.mcap                      against the orientation in the log
  strapd compare a.csv truth.ndjson --align none --max-angle 0.5 && echo good
  strapd compare est.mcap top.mcap                              against /truth, of strapd simulate
  strapd compare out.mcap out.mcap --ref-topic /truth           two topics of one file
  strapd compare att.mcap flight.mcap --plot error.svg          the errors over time

Exit code 4 when --max-angle is exceeded.")]
pub struct Compare {
    #[arg(value_name = "EST", help = super::recordings("The attitude under test", ""))]
    pub estimate: PathBuf,
    /// The attitude it is held against: the same
    #[arg(value_name = "REF")]
    pub reference: PathBuf,
    /// Topic (MCAP) or id (NDJSON) of the estimate; needed only when there are several
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Topic or id of the reference
    #[arg(long, value_name = "NAME")]
    pub ref_topic: Option<String>,
    /// Constant rotation of the world to remove first: none, first (equal at the first common
    /// instant), first-heading (the same, about the vertical only), heading (about the vertical, least
    /// squares), best (least squares)
    #[arg(long, default_value = "first", value_parser = ["none", "first", "first-heading", "heading", "best"])]
    pub align: String,
    /// Fail (exit 4) when the largest total error exceeds this, in degrees
    #[arg(long, value_name = "DEG")]
    pub max_angle: Option<f64>,
    /// Write the errors over time as a chart
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Replace a chart that exists
    #[arg(long)]
    pub force: bool,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
}

/// Runs it.
///
/// # Errors
/// A file cannot be read, holds no attitude or several, or the two share no instant.
pub fn run(global: &Global, args: &Compare) -> Result<Outcome> {
    let align: Align = args.align.parse().map_err(|e| {
        Error::usage(Diagnostic::from(&e).at(format_args!("--align {}", args.align)))
    })?;
    args.check()?;
    let inputs = [args.estimate.clone(), args.reference.clone()];
    let plot = args
        .plot
        .as_deref()
        .map(|p| Document::create(p, &inputs, args.force))
        .transpose()?;
    let pool = Pool::new(global.threads)?;
    let (estimate, reference) = args.read(&pool)?;
    let (estimated, referred) = (attitudes(&estimate), attitudes(&reference));
    // Whichever of the two was set anew: another world begins.
    let cuts: Vec<Nanos> = estimate
        .cuts
        .iter()
        .chain(&reference.cuts)
        .copied()
        .collect();
    let referred = Reference {
        rows: &referred,
        cuts: &cuts,
    };
    let result = compare(&estimated, referred, align);
    let Some(errors) = &result.errors else {
        return Err(no_match(&estimate, &reference));
    };
    let told = ErrorExplanation::of(&estimate, (&estimated, referred), align);
    if let Some(document) = plot {
        let chart = chart(&estimated, referred, align, errors);
        document.write(&chart.svg().map_err(|e| {
            strapd_recording::Error::unsupported(Path::new(&estimate.name), e.to_string())
        })?)?;
    }
    let largest = errors.total.max.to_degrees();
    let exceeded = args.max_angle.filter(|limit| largest > *limit);
    if global.json {
        let value = as_json((&result, &told), align, args.max_angle, exceeded.is_some());
        print(&format!("{value}\n"))?;
    } else if !global.quiet {
        let text = as_text(&result, align, &estimate.name, &reference.name);
        print(&(text + &told.text()))?;
    }
    if let Some(limit) = exceeded {
        tracing::error!(
            "the largest error, {} deg, exceeds --max-angle {limit} deg",
            significant(largest, 4)
        );
        return Ok(Outcome::LimitExceeded);
    }
    Ok(Outcome::Done)
}

impl Compare {
    /// Checks that the limit is an angle, and that the chart can be one.
    fn check(&self) -> Result<()> {
        if self
            .max_angle
            .is_some_and(|limit| limit.is_nan() || limit < 0.0)
        {
            return Err(Error::usage(
                "--max-angle: an angle of 0 degrees or more".to_owned(),
            ));
        }
        self.plot
            .iter()
            .try_for_each(|p| super::outputs::check_chart(p))
    }

    /// Reads the estimate and the reference, and says what is wrong with the two.
    fn read(&self, pool: &Pool) -> Result<(Track, Track)> {
        if self.estimate == self.reference && self.estimate.as_os_str() == "-" {
            return Err(Error::usage(
                Diagnostic::new("compare - -: standard input comes once")
                    .help("give one of the two a file"),
            ));
        }
        let mut options = Options::default();
        self.tables.put(&mut options)?;
        let read = |path: &Path, side, topic: &Option<String>| {
            attitude_track::read(
                &opening::open(path)?,
                side,
                topic.as_deref(),
                &options,
                pool,
            )
        };
        let estimate = read(&self.estimate, Side::Estimate, &self.topic)?;
        let reference = read(&self.reference, Side::Reference, &self.ref_topic)?;
        for problem in estimate.problems.iter().chain(&reference.problems) {
            tracing::warn!("{problem}");
        }
        Ok((estimate, reference))
    }
}

/// Text about the errors beside their size.
struct ErrorExplanation {
    /// Whether they lie within what the estimate says of them; `None` where it says nothing.
    sigma: Option<Consistency>,
    /// The constant bias that explains them.
    bias: Option<BiasFit>,
    /// The body axes that do.
    axes: Option<BodyAxesFit>,
    /// The shift of the reference's clock that does, and of which the two above would be effects.
    shift: Option<TimeShift>,
}

/// Errors over a second that other axes explain to this share are no bias.
const OTHER_AXES: f64 = 0.7;

impl ErrorExplanation {
    fn of(
        estimate: &Track,
        (estimated, referred): (&[Stamped], Reference<'_>),
        align: Align,
    ) -> ErrorExplanation {
        let known: Vec<UncertainAttitude> = estimated
            .iter()
            .zip(&estimate.covariances)
            .map(|((stamp, q_nb), covariance)| UncertainAttitude {
                stamp: *stamp,
                q_nb: *q_nb,
                covariance: *covariance,
            })
            .collect();
        let shift = fit_time_shift(estimated, referred);
        let is_one_clock = shift.is_none();
        let axes = fit_body_axes(estimated, referred.rows).filter(|_| is_one_clock);
        // About one axis alone a bias and other axes cannot be told apart.
        let is_bias = |fit: &BiasFit| {
            fit.is_worth_removing()
                && axes.is_some_and(|axes| {
                    !axes.inverse && axes.turned > OTHER_AXES * axes.as_recorded
                })
        };
        ErrorExplanation {
            sigma: consistency(&known, referred, align, |_| {}),
            bias: fit_constant_bias(estimated, referred).filter(|fit| is_one_clock && is_bias(fit)),
            axes: axes.filter(BodyAxesFit::are_others),
            shift,
        }
    }

    fn text(&self) -> String {
        let mut out = String::new();
        if let Some(found) = &self.sigma {
            let _ = writeln!(out, "  sigma    {}", against::within_sigma(found));
            if let Some(beyond) = against::beyond_sigma(found) {
                let _ = writeln!(out, "  verdict  {beyond}");
            }
        }
        if let Some(shift) = &self.shift {
            let words = against::shift_words(shift, "the reference");
            let _ = writeln!(out, "  clock    {words}; compare does not move it");
        }
        if let Some(fit) = &self.axes {
            let _ = writeln!(
                out,
                "  axes     {}; compare does not turn them: strapd replay LOG with --base-frame NAME or --mount q=W,X,Y,Z, and --against-recorded",
                against::axes_words(fit, "the reference", "the estimate's")
            );
        }
        if let Some(fit) = &self.bias {
            let _ = writeln!(
                out,
                "  bias     {}: where this is the gyro alone, add ({:.6}, {:.6}, {:.6}) rad/s to its --bias",
                against::bias_words(fit, "the estimate", "the reference"),
                fit.bias.x,
                fit.bias.y,
                fit.bias.z
            );
        }
        out
    }
}

/// The errors over time, with their statistics in the legend.
fn chart(estimate: &[Stamped], reference: Reference<'_>, align: Align, errors: &Errors) -> Chart {
    let mut traces = Traces::<3>::new(STRETCHES);
    let mut first = None;
    for_each_error(estimate, reference, align, |at| {
        let first = *first.get_or_insert(at.stamp);
        let degrees = [at.total, at.heading, at.inclination].map(f64::to_degrees);
        traces.push(at.stamp.since(first), degrees);
    });
    let named = [
        ("total", &errors.total),
        ("heading", &errors.heading),
        ("tilt", &errors.inclination),
    ];
    let [rms, p95, max] = degrees(&errors.total);
    Chart {
        title: format!("Error, world aligned: {align}; total rms {rms}, 95 % {p95}, max {max} deg"),
        x: Axis::linear("time since the first common instant, s"),
        y: Axis::linear("deg"),
        series: named
            .iter()
            .enumerate()
            .map(|(index, (name, stats))| Series {
                name: format!("{name}, rms {}", significant(stats.rms.to_degrees(), 3)),
                points: traces.points(index, 1e9),
                look: SeriesStyle::Thin,
                color: Some(index + 1),
            })
            .collect(),
        size: (1040, 420),
        ..Chart::default()
    }
}

/// Attitudes of a track. A row that is no rotation becomes one with NaN, so that the comparison counts it.
pub(super) fn attitudes(track: &Track) -> Vec<Stamped> {
    track
        .entries
        .iter()
        .map(|(stamp, wxyz)| {
            (
                *stamp,
                strapd_attitude::quaternion::Quaternion::assume_unit(*wxyz),
            )
        })
        .collect()
}

/// Error of two tracks without an instant in common.
pub(super) fn no_match(estimate: &Track, reference: &Track) -> Error {
    let span = |t: &Track| match (t.entries.first(), t.entries.last()) {
        (Some((a, _)), Some((b, _))) => {
            format!(
                "{}: {} attitudes, {} to {} ns",
                t.name,
                t.entries.len(),
                a.0,
                b.0
            )
        }
        _ => format!("{}: no attitudes", t.name),
    };
    let what = Diagnostic::new(format!(
        "no instant in common with the reference\n  {}\n  {}",
        span(estimate),
        span(reference)
    ))
    .help("are both on the same clock (replay --time)?");
    strapd_recording::Error::unsupported(Path::new(&estimate.name), what).into()
}

fn as_text(result: &Comparison, align: Align, estimate: &str, reference: &str) -> String {
    let mut out = format!("{estimate}\n  against {reference}, world aligned: {align}\n");
    let secs = result.span.map_or(0.0, |(a, b)| b.secs_since(a));
    let _ = writeln!(
        out,
        "  matched  {} reference samples over {secs:.3} s",
        result.samples
    );
    if let Some(words) = against::resets(result.parts.saturating_sub(1)) {
        let _ = writeln!(out, "           {words}");
    }
    let left = &result.left_out;
    for (count, what) in [
        (
            left.bad_references,
            "reference rows are no attitude (NaN, wrong norm)",
        ),
        (left.bad_estimates, "estimates are no attitude"),
        (left.outside, "reference rows outside the estimate's time"),
        (left.in_gap, "reference rows in gaps of the estimate"),
    ] {
        if count > 0 {
            let _ = writeln!(out, "           {count} {what}");
        }
    }
    if let Some(errors) = &result.errors {
        let _ = writeln!(out, "  error, deg         rms        95 %         max");
        for (name, stats) in [
            ("total", &errors.total),
            ("heading", &errors.heading),
            ("tilt", &errors.inclination),
        ] {
            let [rms, p95, max] = degrees(stats);
            let _ = writeln!(out, "  {name:<12} {rms:>10}  {p95:>10}  {max:>10}");
        }
    }
    if let Some(drift) = &result.drift {
        let _ = writeln!(
            out,
            "  drift    {} deg/h in all, {} deg/h in heading",
            significant(drift.total_deg_per_hour(), 4),
            significant(drift.heading_deg_per_hour(), 4)
        );
    }
    if let Some(relative) = &result.relative_1s {
        let _ = writeln!(
            out,
            "  over 1 s median {} deg, 95 % {} deg ({} pairs)",
            significant(relative.median.to_degrees(), 4),
            significant(relative.p95.to_degrees(), 4),
            relative.count
        );
    }
    out
}

fn degrees(stats: &ErrorStats) -> [String; 3] {
    [stats.rms, stats.p95, stats.max].map(|v| significant(v.to_degrees(), 4))
}

fn as_json(
    (result, told): (&Comparison, &ErrorExplanation),
    align: Align,
    limit: Option<f64>,
    exceeded: bool,
) -> Value {
    let mut value = comparison_json(result);
    if let Some(object) = value.as_object_mut() {
        object.insert("align".to_owned(), align.name().into());
        object.insert("max_angle_deg".to_owned(), limit.into());
        object.insert("exceeded".to_owned(), exceeded.into());
        object.insert(
            "sigma".to_owned(),
            told.sigma.as_ref().map(against::consistency_json).into(),
        );
        object.insert(
            "bias_left".to_owned(),
            told.bias.as_ref().map(against::bias_json).into(),
        );
        object.insert(
            "other_axes".to_owned(),
            told.axes.as_ref().map(against::axes_json).into(),
        );
        object.insert(
            "late_s".to_owned(),
            told.shift.map(|shift| shift.late_secs).into(),
        );
    }
    value
}
