//! Comparison of a recorded orientation with sigma and with the gyro's bias -> words, JSON. Pure.
//!
//! Apart from the summary because `compare`, `check` and the page say the same.

use super::significant;
use serde_json::{Value, json};
use strapd_attitude::compare::{
    Align, BiasFit, BodyAxesFit, Consistency, TimeShift, TurnRatio, WithinSigma,
};
use strapd_attitude::frames::AxisMap;
use strapd_attitude::record::GyroUnit;
use strapd_attitude::setting::{BIAS, Choice};

/// Error against a recorded orientation for one meaning of a sample.
#[derive(Clone, Debug)]
pub struct Against {
    /// `rate`, `average` or `held`.
    pub kind: &'static str,
    /// Meaning of the kind.
    pub meaning: &'static str,
    /// Median of the error of the rotation over 1 s, deg.
    pub median_deg: f64,
    /// 95th percentile of it, deg.
    pub p95_deg: f64,
    /// Pairs compared.
    pub pairs: usize,
}

/// A recorded orientation that was compared with.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Recorded {
    /// Recorded attitudes that are rotations (a long log's are thinned).
    pub usable: usize,
    /// Recorded quadruples that are none: norm far from 1, zero, NaN.
    pub unusable: u64,
    /// All of them are one and the same.
    pub constant: bool,
    /// Unit in which the rates were taken.
    pub gyro_unit: GyroUnit,
    /// Scale of the recorded rates that was asked for.
    pub gyro_scale: [f64; 3],
    /// Map of the accelerometer's axes that was asked for.
    pub accel_axes: AxisMap,
    /// Turn of the gyro by that of the orientation; `None` where too few turn, or they do not agree.
    pub turn_ratio: Option<TurnRatio>,
    /// Shift of its clock against that of the samples, where one explains most of the error over a second.
    pub shift: Option<TimeShift>,
    /// Axes of its body relative to the gyro's; `None` = the motion does not tell.
    pub axes: Option<BodyAxesFit>,
    /// Whether the run's errors lie within what it said of them; `None` = no instant in common, or no sigma.
    pub consistency: Option<Consistency>,
    /// The bias by which the gyro alone leaves it.
    pub bias: Option<BiasFit>,
    /// The bias that was removed before, rad/s.
    pub removed: [f64; 3],
    /// Resets by its source: errors are those of the parts between, each aligned by itself.
    pub resets: usize,
}

/// Shift of the clock of `what`, in words.
#[must_use]
pub fn shift_words(shift: &TimeShift, what: &str) -> String {
    let [before, after] = shift.over_1s.map(deg);
    let side = match shift.late_secs < 0.0 {
        true => "early",
        false => "late",
    };
    format!(
        "{what} is {} s {side}: with that taken off, the error over 1 s is {after} deg instead of {before}",
        significant(shift.late_secs.abs(), 2)
    )
}

/// A share in percent: never 100 where one is outside.
fn percent(share: f64) -> String {
    let floor = (share * 1000.0).floor() / 10.0;
    format!("{floor}")
}

fn deg(radians: f64) -> String {
    significant(radians.to_degrees(), 2)
}

/// Share that lies within three sigma, in one line.
#[must_use]
pub fn within_sigma(found: &Consistency) -> String {
    let part = |name: &str, part: &WithinSigma| {
        format!(
            "{name} {} % (rms {} deg, sigma {})",
            percent(part.inside),
            deg(part.rms),
            deg(part.sigma)
        )
    };
    let leaning = found.leaning.map_or_else(String::new, |lean| {
        format!(
            "; its vertical leans by {} deg, which was taken out",
            deg(lean)
        )
    });
    format!(
        "within 3 sigma: {}, {}; world aligned: {}{leaning}; {} deg noise of the reference counted",
        part("tilt", &found.tilt),
        part("heading", &found.heading),
        found.align,
        deg(found.reference_noise)
    )
}

/// The same where less lies there than sigma promises; `None` where it holds.
#[must_use]
pub fn beyond_sigma(found: &Consistency) -> Option<String> {
    found.is_beyond().then(|| {
        let part = |name: &str, part: &WithinSigma| {
            format!(
                "{} % of the errors of {name} (rms {} deg under a sigma of {}, at worst {} sigma)",
                percent(part.inside),
                deg(part.rms),
                deg(part.sigma),
                significant(part.worst, 2)
            )
        };
        format!(
            "the error is beyond 3 sigma: within are {} and {}",
            part("tilt", &found.tilt),
            part("heading", &found.heading)
        )
    })
}

/// Text of the bias: "the gyro" (`who`) leaves "the recorded orientation" (`whom`).
#[must_use]
pub fn bias_words(fit: &BiasFit, who: &str, whom: &str) -> String {
    let per_hour = |v: f64| significant(v.to_degrees() * 3600.0, 3);
    let [before, after] = fit.over_long.map(deg);
    format!(
        "{who} leaves {whom} by a constant bias of {} deg/h (+- {}): {before} deg over {} s, {after} without it",
        per_hour(fit.bias.norm()),
        per_hour(fit.sigma.norm()),
        significant(fit.long_secs, 2)
    )
}

/// Other body axes in one line: those of `who` against those `whose` they should be.
#[must_use]
pub fn axes_words(fit: &BodyAxesFit, who: &str, whose: &str) -> String {
    let [w, x, y, z] = fit.turn.wxyz();
    let deg = |radians: f64| significant(radians.to_degrees(), 3);
    format!(
        "{who} is that of other body axes, turned by {:.1} deg (q w {w:.4} x {x:.4} y {y:.4} z {z:.4}) from {whose}: {} deg over 1 s as recorded, {} deg with the turn",
        fit.angle().to_degrees(),
        deg(fit.as_recorded),
        deg(fit.turned)
    )
}

/// Setting that removes it, beside what was removed already.
#[must_use]
pub fn removing(fit: &BiasFit, removed: [f64; 3]) -> Choice {
    let all = nalgebra::Vector3::from(removed) + fit.bias;
    // A millionth of a rad/s is 0.2 deg/h; none is minus nothing.
    let [x, y, z]: [f64; 3] = all.map(|v| (v * 1e6).round() / 1e6 + 0.0).into();
    BIAS.to(format!("{x:.6},{y:.6},{z:.6}"))
}

/// JSON for machines.
#[must_use]
pub fn consistency_json(found: &Consistency) -> Value {
    let part = |part: &WithinSigma| {
        json!({
            "within_3_sigma": part.inside,
            "rms_deg": part.rms.to_degrees(),
            "sigma_rms_deg": part.sigma.to_degrees(),
            "worst_in_sigma": part.worst,
        })
    };
    json!({
        "samples": found.samples,
        "tilt": part(&found.tilt),
        "heading": part(&found.heading),
        "beyond_3_sigma": found.is_beyond(),
        "align": found.align.name(),
        "leaning_deg": found.leaning.map(f64::to_degrees),
        "reference_noise_deg": found.reference_noise.to_degrees(),
    })
}

/// JSON for machines.
#[must_use]
pub fn bias_json(fit: &BiasFit) -> Value {
    let vector = |v: &nalgebra::Vector3<f64>| json!({ "x": v.x, "y": v.y, "z": v.z });
    json!({
        "bias_rad_s": vector(&fit.bias),
        "sigma_rad_s": vector(&fit.sigma),
        "windows": fit.windows,
        "over_1s_deg": fit.over_1s.map(f64::to_degrees),
        "long_s": fit.long_secs,
        "over_long_deg": fit.over_long.map(f64::to_degrees),
        "worth_removing": fit.is_worth_removing(),
    })
}

/// JSON for machines.
#[must_use]
pub fn axes_json(fit: &BodyAxesFit) -> Value {
    json!({
        "pairs": fit.pairs,
        "median_turn_deg": fit.median_turn.to_degrees(),
        "as_recorded_deg": fit.as_recorded.to_degrees(),
        "turned_deg": fit.turned.to_degrees(),
        "turn_wxyz": fit.turn.wxyz(),
        "angle_deg": fit.angle().to_degrees(),
    })
}

impl Against {
    /// JSON for machines: one object a row.
    pub(super) fn json(rows: &[Against]) -> Value {
        let row = |a: &Against| {
            json!({
                "kind": a.kind, "median_deg": a.median_deg, "p95_deg": a.p95_deg, "pairs": a.pairs,
            })
        };
        rows.iter().map(row).collect()
    }

    fn text(&self, best: f64) -> String {
        let mark = match self.median_deg == best {
            true => "  <- best",
            false => "",
        };
        format!(
            "{:<8} {:>8.3} / {:<8.3} {}{mark}",
            self.kind, self.median_deg, self.p95_deg, self.meaning
        )
    }
}

/// Lines for people about the orientation that was compared with; none where none was.
pub(super) fn against_text(rows: &[Against], recorded: Option<&Recorded>) -> Vec<String> {
    if rows.is_empty() {
        return Vec::new();
    }
    let medians = rows.iter().map(|a| a.median_deg);
    let best = medians.fold(f64::INFINITY, f64::min);
    let head = "the recorded orientation: error of the rotation over 1 s, median / 95 %, deg";
    std::iter::once(head.to_owned())
        .chain(rows.iter().map(|row| row.text(best)))
        .chain(recorded.into_iter().flat_map(Recorded::words))
        .collect()
}

impl Recorded {
    /// Lines for people: its resets, and the share of the errors within sigma.
    fn words(&self) -> impl Iterator<Item = String> {
        let sigma = self.consistency.as_ref().map(within_sigma);
        resets(self.resets).into_iter().chain(sigma)
    }

    /// JSON for machines.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({
            "usable": self.usable,
            "unusable": self.unusable,
            "constant": self.constant,
            "resets": self.resets,
            "sigma": self.consistency.as_ref().map(consistency_json),
            "bias_left": self.bias.as_ref().map(bias_json),
        })
    }
}

/// Describes how a reference with so many resets is compared; `None` without any.
#[must_use]
pub fn resets(times: usize) -> Option<String> {
    let times = match times {
        0 => return None,
        1 => "once".to_owned(),
        n => format!("{n} times"),
    };
    Some(format!(
        "the recorded orientation was reset {times} by its estimator: cut there, each part aligned by itself"
    ))
}

/// Text of how the worlds are aligned.
#[must_use]
pub fn alignment(align: Align) -> &'static str {
    match align {
        Align::None => "both worlds taken as they are",
        Align::First => "made equal at the first common instant",
        Align::FirstHeading => "the heading made equal at the first common instant",
        Align::Heading => "the heading made equal on the whole",
        Align::Best => "the worlds made equal on the whole",
    }
}
