//! `strapd compare EST REF`: time-aligned angle error between two attitudes. I/O.

use super::{Global, Outcome, print};
use crate::compare::{Align, Comparison, ErrorStats, Stamped, compare};
use crate::error::{Error, Result};
use crate::pipeline::pool::Pool;
use crate::pipeline::track::{self, Side};
use crate::report::summary::significant;
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Time-aligned angle error between two attitudes.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd compare attitude.mcap flight.mcap                      against the orientation in the log
  strapd compare a.csv truth.ndjson --align none --max-angle 0.5 && echo good
  strapd compare est.mcap top.mcap                              against /truth, of strapd simulate
  strapd compare out.mcap out.mcap --ref-topic /truth           two topics of one file

Exit code 4 when --max-angle is exceeded.")]
pub struct Compare {
    /// The attitude under test: .mcap, .ndjson or .csv
    #[arg(value_name = "EST")]
    pub estimate: PathBuf,
    /// The attitude it is held against: .mcap, .ndjson or .csv
    #[arg(value_name = "REF")]
    pub reference: PathBuf,
    /// Topic (MCAP) or id (NDJSON) of the estimate; needed only when there are several
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Topic or id of the reference
    #[arg(long, value_name = "NAME")]
    pub ref_topic: Option<String>,
    /// Constant rotation of the world to remove first: none, first (equal at the first common
    /// instant), heading (about the vertical only), best (least squares)
    #[arg(long, default_value = "first")]
    pub align: String,
    /// Fail (exit 4) when the largest total error exceeds this, in degrees
    #[arg(long, value_name = "DEG")]
    pub max_angle: Option<f64>,
}

/// Runs it.
///
/// # Errors
/// A file can not be read, holds no attitude or several, or the two share no instant.
pub fn run(global: &Global, args: &Compare) -> Result<Outcome> {
    let align: Align = args
        .align
        .parse()
        .map_err(|e| Error::Usage(format!("--align {}: {e}", args.align)))?;
    if args
        .max_angle
        .is_some_and(|limit| limit.is_nan() || limit < 0.0)
    {
        return Err(Error::Usage(
            "--max-angle: an angle of 0 degrees or more".to_owned(),
        ));
    }
    let pool = Pool::new(global.threads)?;
    let estimate = track::read(&args.estimate, Side::Estimate, args.topic.as_deref(), &pool)?;
    let reference = track::read(
        &args.reference,
        Side::Reference,
        args.ref_topic.as_deref(),
        &pool,
    )?;
    for problem in estimate.problems.iter().chain(&reference.problems) {
        tracing::warn!("{problem}");
    }
    let result = compare(&attitudes(&estimate), &attitudes(&reference), align);
    let Some(errors) = &result.errors else {
        return Err(no_match(args, &estimate, &reference));
    };
    let exceeded = args
        .max_angle
        .is_some_and(|limit| errors.total.max.to_degrees() > limit);
    if global.json {
        print(&format!(
            "{}\n",
            as_json(&result, align, args.max_angle, exceeded)
        ))?;
    } else if !global.quiet {
        print(&as_text(&result, align, &estimate.name, &reference.name))?;
    }
    if exceeded {
        tracing::error!(
            "the largest error, {} deg, exceeds --max-angle {} deg",
            significant(errors.total.max.to_degrees(), 4),
            args.max_angle.unwrap_or(0.0)
        );
        return Ok(Outcome::LimitExceeded);
    }
    Ok(Outcome::Done)
}

/// What is no rotation becomes one with NaN, so that the comparison counts it.
fn attitudes(track: &track::Track) -> Vec<Stamped> {
    track
        .entries
        .iter()
        .map(|(stamp, wxyz)| {
            (
                *stamp,
                crate::model::attitude::Quaternion::assume_unit(*wxyz),
            )
        })
        .collect()
}

fn no_match(args: &Compare, estimate: &track::Track, reference: &track::Track) -> Error {
    let span = |t: &track::Track| match (t.entries.first(), t.entries.last()) {
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
    Error::Unsupported {
        path: args.estimate.clone(),
        what: format!(
            "no instant in common with the reference\n  {}\n  {}\n  help: are both on the same clock (replay --time)?",
            span(estimate),
            span(reference)
        ),
    }
}

fn as_text(result: &Comparison, align: Align, estimate: &str, reference: &str) -> String {
    let mut out = format!("{estimate}\n  against {reference}, world aligned: {align}\n");
    let secs = result.span.map_or(0.0, |(a, b)| b.secs_since(a));
    let _ = writeln!(
        out,
        "  matched  {} reference samples over {secs:.3} s",
        result.samples
    );
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
            ("inclination", &errors.inclination),
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

fn as_json(result: &Comparison, align: Align, limit: Option<f64>, exceeded: bool) -> Value {
    let stats = |s: &ErrorStats| {
        json!({ "rms_deg": s.rms.to_degrees(), "p95_deg": s.p95.to_degrees(),
                "max_deg": s.max.to_degrees(), "mean_deg": s.mean.to_degrees() })
    };
    json!({
        "align": align.name(),
        "samples": result.samples,
        "span_s": result.span.map(|(a, b)| b.secs_since(a)),
        "left_out": {
            "bad_estimates": result.left_out.bad_estimates,
            "bad_references": result.left_out.bad_references,
            "outside": result.left_out.outside,
            "in_gap": result.left_out.in_gap,
        },
        "total": result.errors.as_ref().map(|e| stats(&e.total)),
        "heading": result.errors.as_ref().map(|e| stats(&e.heading)),
        "inclination": result.errors.as_ref().map(|e| stats(&e.inclination)),
        "drift_deg_per_h": result.drift.as_ref().map(|d| json!({
            "total": d.total_deg_per_hour(), "heading": d.heading_deg_per_hour() })),
        "relative_1s": result.relative_1s.as_ref().map(|r| json!({
            "median_deg": r.median.to_degrees(), "p95_deg": r.p95.to_degrees(), "pairs": r.count })),
        "max_angle_deg": limit,
        "exceeded": exceeded,
    })
}
