//! Relative attitudes -> their summary, as text and as JSON. Pure.

use crate::report::summary::significant;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use strapd_attitude::joint::{Joint, JointAttitude, RelativeHeading};

/// Figures of the angle over all instants, deg.
struct AngleFigures {
    least: f64,
    largest: f64,
    off_axis_rms: f64,
    off_axis_largest: f64,
    /// Root of the mean square; `None` where an instant has none.
    sigma: Option<f64>,
}

impl AngleFigures {
    fn of(rows: &[JointAttitude]) -> AngleFigures {
        let over = |start: f64, take: fn(f64, f64) -> f64, of: fn(&JointAttitude) -> f64| {
            rows.iter().map(of).fold(start, take).to_degrees()
        };
        let rms = |squares: f64| (squares / rows.len().max(1) as f64).sqrt().to_degrees();
        let sigma: Option<f64> = rows.iter().map(|row| row.sigma.map(|s| s * s)).sum();
        AngleFigures {
            least: over(f64::INFINITY, f64::min, |row| row.angle),
            largest: over(f64::NEG_INFINITY, f64::max, |row| row.angle),
            off_axis_rms: rms(rows.iter().map(|row| row.off_axis * row.off_axis).sum()),
            off_axis_largest: over(0.0, f64::max, |row| row.off_axis),
            sigma: sigma.map(rms),
        }
    }
}

/// Seconds from the first common instant to the last.
fn seconds(found: &Joint) -> f64 {
    let ends = found.rows.first().zip(found.rows.last());
    ends.map_or(0.0, |(first, last)| last.stamp.secs_since(first.stamp))
}

/// Text for people.
pub(super) fn as_text(found: &Joint, first: &str, second: &str) -> String {
    let figures = AngleFigures::of(&found.rows);
    let three = |value: f64| significant(value, 3);
    let mut out = format!("{second}\n  relative to {first}\n");
    let mut line = |name: &str, text: String| _ = writeln!(out, "  {name:<9}{text}");
    line(
        "matched",
        format!("{} instants over {:.3} s", found.rows.len(), seconds(found)),
    );
    if found.unmatched > 0 || found.bad > 0 {
        let (unmatched, bad) = (found.unmatched, found.bad);
        line(
            "",
            format!(
                "{unmatched} instants of the first without a partner, {bad} rows are no attitude"
            ),
        );
    }
    match (&found.hinge, found.heading) {
        (Ok(hinge), RelativeHeading::Hinge) => {
            let axis = |v: [f64; 3]| v.map(|c| format!("{c:.3}")).join(", ");
            line(
                "hinge",
                format!(
                    "axis ({}) of the first, ({}) of the second; off by {} deg rms",
                    axis(hinge.axis_first.into()),
                    axis(hinge.axis_second.into()),
                    three(hinge.misfit.to_degrees())
                ),
            );
            let (from, to) = hinge.heading_offsets();
            // The angle nearest to none, and the end by its drift from there.
            let turns = TAU * (from / TAU).round();
            let (from, to) = (from - turns, to - turns);
            line(
                "heading",
                format!(
                    "of the second offset by {:.1} deg at first, {:.1} at the end, so that the axis agrees; sigma {} deg",
                    from.to_degrees(),
                    to.to_degrees(),
                    three(hinge.heading_sigma().to_degrees())
                ),
            );
        }
        (Err(why), RelativeHeading::Recorded) => {
            let what = strapd_attitude::diagnostic::Diagnostic::from(why);
            line("heading", format!("as recorded; {}", what.what()));
            line(
                "",
                "without a magnetometer the headings drift apart, and this angle with them"
                    .to_owned(),
            );
        }
        (_, RelativeHeading::Start) => {
            line("heading", "equal at the first instant".to_owned());
        }
        _ => line("heading", "as recorded".to_owned()),
    }
    line(
        "angle",
        format!(
            "{:.1} to {:.1} deg from the first instant",
            figures.least, figures.largest
        ),
    );
    if found.heading == RelativeHeading::Hinge {
        line(
            "off axis",
            format!(
                "{} deg rms, {} at most: rotation about other axes",
                three(figures.off_axis_rms),
                three(figures.off_axis_largest)
            ),
        );
    }
    if let Some(sigma) = figures.sigma {
        line("sigma", format!("{} deg rms, of the angle", three(sigma)));
    }
    out
}

/// The summary as one object.
pub(super) fn as_json(found: &Joint) -> Value {
    let figures = AngleFigures::of(&found.rows);
    let hinge = found.hinge.as_ref().ok().map(|hinge| {
        let (from, to) = hinge.heading_offsets();
        json!({
            "axis_first": <[f64; 3]>::from(hinge.axis_first),
            "axis_second": <[f64; 3]>::from(hinge.axis_second),
            "misfit_deg": hinge.misfit.to_degrees(),
            "heading_offset_deg": [from.to_degrees(), to.to_degrees()],
            "heading_sigma_deg": hinge.heading_sigma().to_degrees(),
        })
    });
    json!({
        "matched": found.rows.len(),
        "seconds": seconds(found),
        "unmatched": found.unmatched,
        "bad": found.bad,
        "heading": found.heading.name(),
        "hinge": hinge,
        "no_hinge": found.hinge.as_ref().err().map(ToString::to_string),
        "angle_deg": [figures.least, figures.largest],
        "off_axis_rms_deg": figures.off_axis_rms,
        "off_axis_most_deg": figures.off_axis_largest,
        "sigma_rms_deg": figures.sigma,
    })
}
