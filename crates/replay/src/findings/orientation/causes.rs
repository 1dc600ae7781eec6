//! A recorded orientation that contradicts the gyro, or gravity -> the one cause that explains it. Pure.
//!
//! Apart from the findings about sigma and bias because these are only looked for where none of these causes is there: what a
//! late clock or a wrong unit does to them is no bias.

use super::{SHIFTED, best_meaning, used};
use crate::findings::{Finding, Severity, sensors};
use crate::summary::against::shift_words;
use crate::summary::{Recorded, TopicSummary, significant};
use strapd_attitude::compare::{BodyAxesFit, Consistency, TimeShift, TurnRatio};
use strapd_attitude::frames::AxisMap;
use strapd_attitude::record::GyroUnit;
use strapd_attitude::setting::ACCEL_AXES;

/// A meaning explains what a unit might when its median error is below this share of the other's.
const FOLLOWS: f64 = 0.5;
/// Share by which a ratio of turns may be off that of two units: noise of the reference, and what goes to and fro.
const SAME_UNIT: f64 = 0.15;
/// A unit explains better what a meaning would as well when it is off by less than this share of what that leaves.
const CLOSER: f64 = 0.3;
/// Share by which the gyro may turn farther than an orientation that its scale agrees with.
const SAME_SCALE: f64 = 0.1;
/// Error over 19 of 20 seconds, as a share of the median rotation, of an orientation that follows the gyro.
const FOLLOWED: f64 = 0.2;
/// Angles between two verticals, rad, that are worth a word, and beyond which one is upside down: 20 and 150 degrees.
pub(super) const LEANS: f64 = 20.0 * std::f64::consts::PI / 180.0;
const UPSIDE_DOWN: f64 = 150.0 * std::f64::consts::PI / 180.0;
/// Median distance from a ratio of turns that is one factor, as a share.
const ONE_FACTOR: f64 = 0.05;

/// Testimony of a recorded orientation about the gyro, where another sensor contradicts it.
#[derive(Clone, Copy, Default, Debug)]
pub(in crate::findings) struct Witness {
    /// Whether it rotates as the gyro does, about the same axes.
    pub(in crate::findings) follows: bool,
    /// Whether it rotates as far, to a tenth.
    pub(in crate::findings) agrees_in_scale: bool,
    /// Whether its vertical is the one that gyro and accelerometer find together.
    pub(in crate::findings) agrees_in_tilt: bool,
}

/// Testimony of the orientation of a run about its gyro; none where there is no orientation.
pub(in crate::findings) fn witness(summary: &TopicSummary) -> Witness {
    let Some(recorded) = &summary.recorded else {
        return Witness::default();
    };
    // By nearly all seconds: of an axis that is seldom turned about, the median knows nothing.
    let p95 = used(summary).map_or(f64::INFINITY, |used| used.p95_deg.to_radians());
    let is_followed = |fit: BodyAxesFit| p95 < FOLLOWED * fit.median_turn;
    let is_level = |found: Consistency| {
        found.leaning.is_none_or(|lean| lean < LEANS)
            && found.tilt.rms < 0.5 * LEANS
            && !found.is_beyond_in_tilt()
    };
    let is_as_far = |found: TurnRatio| (found.ratio - 1.0).abs() < SAME_SCALE;
    Witness {
        follows: recorded.axes.is_some_and(is_followed),
        agrees_in_scale: recorded.turn_ratio.is_some_and(is_as_far),
        agrees_in_tilt: summary.aided.is_some() && recorded.consistency.is_some_and(is_level),
    }
}

/// Finding that gravity is elsewhere in the world of the orientation.
pub(super) fn leaning(lean: f64, accel_axes: AxisMap) -> Finding {
    let angle = significant(lean.to_degrees(), 2);
    let what =
        format!("the vertical of the recorded orientation leans by {angle} deg against gravity's");
    let finding = Finding::new(Severity::Warning, "orientation-leans", what)
        .with("lean_deg", lean.to_degrees());
    match lean > UPSIDE_DOWN {
        true => finding
            .advise("its world has z down, or the accelerometer reads -1 g upwards: a sign turns all its axes")
            .help([ACCEL_AXES.to(accel_axes.reversed())]),
        false => finding.advise("its world is not level, or an axis of the accelerometer is wrong"),
    }
}

/// Finding that the orientation shows each motion at another time.
pub(super) fn shifted(shift: &TimeShift) -> Finding {
    let what = shift_words(shift, "the recorded orientation");
    Finding::new(Severity::Warning, SHIFTED, what)
        .with("late_s", shift.late_secs)
        .with("over_1s_deg", shift.over_1s.map(f64::to_degrees).to_vec())
        .advise("its clock is another, or a filter delays it: nothing else is concluded from it")
}

/// Finding that the orientation turns farther or less far than the gyro by one factor, which is no unit's and which no
/// meaning of a sample explains.
pub(in crate::findings) fn other_scale(summary: &TopicSummary) -> Option<Finding> {
    let recorded = summary.recorded?;
    let found = recorded.turn_ratio?;
    let is_one = unit_by(&recorded).is_none() && found.spread < ONE_FACTOR;
    let is_other = is_one && !witness(summary).agrees_in_scale && !is_of_meaning(summary)?;
    is_other.then(|| sensors::of_ratio(found.ratio, recorded.gyro_scale))
}

/// Whether the orientation follows the gyro better by another meaning of a sample.
fn is_of_meaning(summary: &TopicSummary) -> Option<bool> {
    let best = best_meaning(&summary.against)?;
    Some(best.median_deg < FOLLOWS * used(summary)?.median_deg)
}

/// Unit by which the rates turn as far as the orientation, to a share that is left, where it is not the one they were taken
/// in. Rates that were scaled as well are of no unit.
fn unit_by(recorded: &Recorded) -> Option<(GyroUnit, f64)> {
    let found = recorded.turn_ratio?;
    let taken = recorded.gyro_unit;
    let off = |unit: GyroUnit| (found.ratio * unit.to_rad() / taken.to_rad() - 1.0).abs();
    let unit = GyroUnit::ALL
        .into_iter()
        .find(|unit| off(*unit) < SAME_UNIT)?;
    (unit != taken && recorded.gyro_scale == [1.0; 3]).then(|| (unit, off(unit)))
}

/// Finding that the rates are of another unit, where a recorded orientation shows it and no meaning of a sample would as
/// well: at 57 Hz an angle a sample is about a rate in degrees.
pub(in crate::findings) fn other_unit(summary: &TopicSummary) -> Option<Finding> {
    let recorded = summary.recorded.as_ref()?;
    let (unit, off) = unit_by(recorded)?;
    let is_closer = || {
        let best = best_meaning(&summary.against)?;
        let left = best.median_deg.to_radians() / recorded.bias?.turn;
        Some(off < CLOSER * left)
    };
    let is_told = !is_of_meaning(summary)? || is_closer() == Some(true);
    is_told.then(|| sensors::of_unit(unit, recorded.gyro_unit))
}
