//! Sensors held against each other -> findings, with the setting that cures what they disagree about. Pure.
//!
//! Apart from the rules about samples because it needs the samples integrated; what is measured is in
//! `strapd_attitude::consistency`. A cure is advised where the recording, integrated with it, agrees.

use super::orientation::{BEYOND_SIGMA, MEANING, Witness};
use super::samples::COUNTS;
use super::{Finding, Severity, axes};
use crate::finding::{GYRO_DEAD, GYRO_EULER_RATES};
use crate::summary::significant;
use nalgebra::Matrix3;
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::consistency::{CHIPS, Cause, Consistency, Disagreement};
use strapd_attitude::estimate::{EstimationSettings, Meaning, SensorCalibration};
use strapd_attitude::frames::AxisMap;
use strapd_attitude::setting::{ACCEL_AXES, Choice, GYRO_AXES, GYRO_SCALE, GYRO_UNIT};

/// Codes of the findings here that name a cause.
pub(super) const AXES: &str = "gyro-axes";
const SCALE: &str = "gyro-scale";
const TURNED: &str = "gyro-turned";
const ACCELEROMETER: &str = "accel-axes";
/// Findings that have only a guess where a cause is named.
const GUESSES: [&str; 3] = ["unit-against-gravity", "unit-degrees", "unit-unknown"];
/// Findings that rates in a wrong unit bring with them.
const BY_UNIT: [&str; 2] = ["under-sampled", "large-turn-per-step"];
/// Largest sigma of a factor that is more than an order of size.
const KNOWN: f64 = 0.05;
/// A known factor is as far as this from the measured one, in sigmas and as a share; a sigma holds to a factor of four.
const SIGMAS: f64 = 3.0;
const NEAR: std::ops::Range<f64> = 0.02..0.06;
/// Scatter of gravity under scales of single axes that are certain, by that as recorded, and least of that, g.
const CLEAR: f64 = 0.3;
const CLEARLY: f64 = 0.05;
/// A factor of a single axis that is told.
const SINGLE: f64 = 0.12;
/// A factor below this, or above its inverse, is another unit.
const UNIT: f64 = 0.1;
/// Scatter of gravity of a cure, by that as recorded.
const CURED: f64 = 0.6;
/// A factor of the rates by its name.
struct Named {
    /// True rates by those as they were taken.
    factor: f64,
    words: String,
    cure: Choice,
}

/// Finding that gyro and accelerometer speak of different bodies, with what a recorded orientation says of the gyro.
pub(super) fn disagreement(
    (consistency, plan, resolved): (&Consistency, &EstimationSettings, &Meaning),
    witness: Witness,
) -> Option<Finding> {
    let found = consistency.disagreement()?;
    let finding = match found.cause {
        // The motion's own accelerations look like other axes, too: wrong ones would show in the tilt.
        Cause::Axes { .. } if witness.follows && witness.agrees_in_tilt => return None,
        Cause::Axes {
            map,
            decided: [true, true, true],
            scale: None,
        } if witness.follows => of_accelerometer(&found, map, plan),
        Cause::Axes {
            map,
            decided,
            scale,
        } => of_axes(
            (&found, consistency),
            (map, decided, scale),
            (plan, resolved.unit),
        ),
        Cause::Scales { factors, sigma } => of_scales(&found, (factors, sigma), plan),
        Cause::Turned { by, angle, sigma } => of_turn(&found, (&by, angle, sigma), plan),
        // And like a scale.
        Cause::Scale { .. } if witness.agrees_in_scale => return None,
        Cause::Scale { factor, sigma } => of_scale(
            (&found, consistency),
            (factor, sigma),
            (plan, resolved.unit),
        ),
        Cause::EulerRates => Finding::new(
            Severity::Error,
            GYRO_EULER_RATES,
            "gyro and accelerometer disagree: the rates are the derivatives of roll, pitch and yaw, not rates about the body's axes".to_owned(),
        )
        .with("scatter_cured_g", found.cured)
        .advise(format!(
            "{}; record the gyro itself, or make body rates of them first",
            tried(found.recorded, found.cured, "the rates taken so")
        )),
        Cause::Unturned => Finding::new(
            Severity::Error,
            GYRO_DEAD,
            format!(
                "gravity wanders by {} g, and the gyro reads next to nothing all the while",
                significant(found.recorded, 2)
            ),
        )
        .advise("the gyro is not there or does not answer, or its columns are others: the attitude is the accelerometer's"),
        Cause::Unknown => Finding::new(
            Severity::Warning,
            "gyro-against-gravity",
            format!(
                "gravity wanders by {} g as the gyro turns, and no map of its axes explains it",
                significant(found.recorded, 2)
            ),
        )
        .advise("the rates are wrong, or gravity stays with the body (aircraft, pendulum)"),
    };
    Some(
        finding
            .with("scatter_g", found.recorded)
            .with("segments", found.segments),
    )
}

fn of_axes(
    (found, consistency): (&Disagreement, &Consistency),
    (map, decided, scale): (AxisMap, [bool; 3], Option<(f64, f64)>),
    (plan, unit): (&EstimationSettings, GyroUnit),
) -> Finding {
    let axes = GYRO_AXES.to(map.after(plan.gyro_axes));
    let finding = |words: &str| {
        let axes = in_words(&map, decided);
        let words = format!("gyro and accelerometer disagree: the true rate {axes}{words}");
        Finding::new(Severity::Error, AXES, words)
            .with("map", map.to_string())
            .with("scatter_cured_g", found.cured)
            .advise(tried(found.recorded, found.cured, "the gyro's axes mapped"))
    };
    let Some((factor, sigma)) = scale else {
        return finding("").help([axes]);
    };
    let near = near((found, consistency), (map, factor, sigma), (plan, unit));
    if near.is_empty() {
        let times = format!(", times {}", significant(factor, 3));
        let all = finding(&times).with("factor", factor);
        return all.help([axes, scaled(plan.gyro_scale, factor)]);
    }
    let words: Vec<&str> = near.iter().map(|named| named.words.as_str()).collect();
    let all = finding(&format!("; {}", words.join(", or "))).with("factor", factor);
    near.into_iter()
        .fold(all, |all, named| all.help([axes.clone(), named.cure]))
}

/// Finding that the accelerometer's axes are others, where gyro and recorded orientation agree: `map` would cure the gyro.
/// Gravity stands still under both directions of all its axes.
fn of_accelerometer(found: &Disagreement, map: AxisMap, plan: &EstimationSettings) -> Finding {
    let either = [map.inverse(), map.inverse().reversed()];
    let [one, other] = either.map(|map| map.after(plan.accel_axes));
    Finding::new(
        Severity::Error,
        ACCELEROMETER,
        format!(
            "the accelerometer disagrees with gyro and recorded orientation, which agree: its axes are {one} or {other}"
        ),
    )
    .with("scatter_cured_g", found.cured)
    .advise(tried(found.recorded, found.cured, "its axes mapped"))
    .help([ACCEL_AXES.to(one)])
    .help([ACCEL_AXES.to(other)])
}

/// Finding that single axes of the gyro have a scale of their own.
fn of_scales(
    found: &Disagreement,
    (factors, sigma): ([f64; 3], f64),
    plan: &EstimationSettings,
) -> Finding {
    let axes = ["x", "y", "z"].into_iter().zip(factors);
    let off = axes.filter(|(_, factor)| (factor - 1.0).abs() > (SIGMAS * sigma).max(SINGLE));
    let words: Vec<String> = off
        .map(|(axis, factor)| format!("{} times the recorded about {axis}", significant(factor, 3)))
        .collect();
    // The settings scale the columns as recorded, before their axes are mapped.
    let axes = plan.gyro_axes.matrix();
    let of_column = |column: usize| -> f64 {
        let share = (0..3).map(|axis| axes[(axis, column)].abs() * factors[axis]);
        share.sum()
    };
    let own = plan.gyro_scale;
    let scales: Vec<String> = (0..3)
        .map(|column| significant(own[column] * of_column(column), 4))
        .collect();
    let is_clear = found.cured <= CLEAR * found.recorded && found.recorded >= CLEARLY;
    let severity = if is_clear {
        Severity::Error
    } else {
        Severity::Warning
    };
    Finding::new(
        severity,
        SCALE,
        format!(
            "gyro and accelerometer disagree: true rates are {} (+- {})",
            words.join(", "),
            significant(sigma.max(1e-3), 1)
        ),
    )
    .with("factors", factors.to_vec())
    .with("sigma", sigma)
    .with("scatter_cured_g", found.cured)
    .advise(tried(found.recorded, found.cured, "the rates scaled"))
    .help([GYRO_SCALE.to(scales.join(","))])
}

/// Finding that the gyro is turned against the accelerometer.
fn of_turn(
    found: &Disagreement,
    (by, angle, sigma): (&Matrix3<f64>, f64, f64),
    plan: &EstimationSettings,
) -> Finding {
    // What a calibration file multiplies by comes before the axes are mapped.
    let axes = plan.gyro_axes.matrix();
    let errors = axes.transpose() * by * axes - Matrix3::identity();
    let rows: Vec<String> = errors
        .row_iter()
        .map(|row| format!("[{:.4}, {:.4}, {:.4}]", row[0], row[1], row[2]))
        .collect();
    let cure = match plan.calibration.is_none()
        && errors.abs().max() <= SensorCalibration::LARGEST_SHARE
    {
        true => format!(
            "a calibration file with `G = [{}]` turns it back",
            rows.join(", ")
        ),
        false => "no setting turns the gyro alone by such an angle".to_owned(),
    };
    let tried = tried(found.recorded, found.cured, "the gyro turned back");
    Finding::new(
        Severity::Warning,
        TURNED,
        format!(
            "gyro and accelerometer disagree: one is turned by {} degrees (+- {}) against the other",
            significant(angle.to_degrees(), 2),
            significant(sigma.to_degrees().max(0.1), 1)
        ),
    )
    .with("angle_deg", angle.to_degrees())
    .with("sigma_deg", sigma.to_degrees())
    .with("scatter_cured_g", found.cured)
    .advise(format!("{tried}; {cure}"))
}

/// Axes whose place is decided, in words.
pub(super) fn in_words(map: &AxisMap, decided: [bool; 3]) -> String {
    let names = map.to_string();
    let turned: Vec<String> = ["x", "y", "z"]
        .into_iter()
        .zip(names.chars())
        .filter(|(axis, letter)| {
            let place = "xyz".find(letter.to_ascii_lowercase());
            let is_decided = place.and_then(|at| decided.get(at)).copied() == Some(true);
            is_decided && *letter != axis.chars().next().unwrap_or_default().to_ascii_uppercase()
        })
        .map(|(axis, letter)| {
            let sign = if letter.is_ascii_lowercase() { "-" } else { "" };
            format!(
                "about {axis} is the recorded {sign}{}",
                letter.to_ascii_lowercase()
            )
        })
        .collect();
    turned.join(", ")
}

fn of_scale(
    (found, consistency): (&Disagreement, &Consistency),
    (factor, sigma): (f64, f64),
    (plan, unit): (&EstimationSettings, GyroUnit),
) -> Finding {
    let is_known = sigma < KNOWN;
    // An order of size that is no unit's may be the accelerations of a run: nothing was tried that cures it.
    let severity = match is_known || !(UNIT..=1.0 / UNIT).contains(&factor) {
        true => Severity::Error,
        false => Severity::Warning,
    };
    let times = match is_known {
        true => format!(
            "{} (+- {})",
            significant(factor, 3),
            significant(factor * sigma.max(1e-3), 1)
        ),
        false => format!("about {}", significant(factor, 1)),
    };
    let finding = |words: &str| {
        Finding::new(
            severity,
            SCALE,
            format!(
                "gyro and accelerometer disagree: true rates are {times} of the recorded{words}"
            ),
        )
        .with("factor", factor)
        .with("sigma", factor * sigma)
    };
    let mut near = near(
        (found, consistency),
        (AxisMap::IDENTITY, factor, sigma),
        (plan, unit),
    );
    if !is_known {
        // An order of size tells units apart, and no ranges.
        near.retain(|named| named.cure.setting == GYRO_UNIT);
        let finding = |words: &str| finding(words).advise("give the gyro's unit, or its scale");
        return match near.pop() {
            Some(named) => finding(&format!(": {}", named.words)).help([named.cure]),
            None => finding(""),
        };
    }
    if near.is_empty() {
        let scaled = scaled(plan.gyro_scale, factor);
        return finding("")
            .with("scatter_cured_g", found.cured)
            .advise(tried(found.recorded, found.cured, "the rates scaled"))
            .help([scaled]);
    }
    let words: Vec<&str> = near.iter().map(|named| named.words.as_str()).collect();
    let all = finding(&format!(": {}", words.join(", or ")))
        .with("scatter_cured_g", found.cured)
        .advise(tried(found.recorded, found.cured, "the rates scaled"));
    near.into_iter()
        .fold(all, |all, named| all.help([named.cure]))
}

/// Factors with a name that are near the measured one, by which the recording was integrated and agrees.
fn near(
    (found, consistency): (&Disagreement, &Consistency),
    (axes, factor, sigma): (AxisMap, f64, f64),
    (plan, unit): (&EstimationSettings, GyroUnit),
) -> Vec<Named> {
    let is_near = |named: &Named| {
        let off = (named.factor / factor - 1.0).abs();
        let cured = || consistency.scatter_by(axes, named.factor);
        off <= (SIGMAS * sigma).clamp(NEAR.start, NEAR.end)
            && cured().is_some_and(|cured| cured <= CURED * found.recorded)
    };
    named(plan, unit).into_iter().filter(is_near).collect()
}

/// Unit of the rates, in words.
fn like(unit: GyroUnit) -> String {
    format!("they look like {}/s", unit.name())
}

/// Finding that the gyro, scaled by `own`, turns by so many times what a recorded orientation does.
pub(super) fn of_ratio(ratio: f64, own: [f64; 3]) -> Finding {
    let factor = ratio.recip();
    Finding::new(
        Severity::Error,
        SCALE,
        format!(
            "gyro and recorded orientation disagree: true rates are {} of the recorded, or the samples' clock runs at {} of its speed",
            significant(factor, 3),
            significant(ratio, 3)
        ),
    )
    .with("factor", factor)
    .advise("the two rotate by that factor at all speeds")
    .help([scaled(own, factor)])
}

/// Finding that the gyro turns as far as a recorded orientation does in this unit, and not in the one `taken`.
pub(super) fn of_unit(unit: GyroUnit, taken: GyroUnit) -> Finding {
    let factor = unit.to_rad() / taken.to_rad();
    Finding::new(
        Severity::Error,
        SCALE,
        format!(
            "gyro and recorded orientation disagree: true rates are about {} of the recorded: {}",
            significant(factor, 2),
            like(unit)
        ),
    )
    .with("factor", factor)
    .advise("in that unit the gyro rotates as far as the orientation")
    .help([GYRO_UNIT.to(unit.name())])
}

/// Factors that rates are off by, other than by accident.
fn named(plan: &EstimationSettings, taken: GyroUnit) -> Vec<Named> {
    let mut all = Vec::new();
    if plan.gyro_scale == [1.0; 3] {
        let others = GyroUnit::ALL.into_iter().filter(|unit| *unit != taken);
        all.extend(others.map(|unit| Named {
            factor: unit.to_rad() / taken.to_rad(),
            words: like(unit),
            cure: GYRO_UNIT.to(unit.name()),
        }));
    }
    for (per_degree, range) in CHIPS {
        let factor = 1_f64.to_radians() / per_degree / taken.to_rad();
        all.push(Named {
            factor,
            words: format!("counts of a range of {range} deg/s"),
            cure: scaled(plan.gyro_scale, factor),
        });
    }
    for (factor, words) in [(2.0, "half"), (0.5, "twice")] {
        all.push(Named {
            factor,
            words: format!("read with {words} of its range"),
            cure: scaled(plan.gyro_scale, factor),
        });
    }
    all
}

/// Scale that is so many times `own`, the plan's.
fn scaled(own: [f64; 3], factor: f64) -> Choice {
    let factors = own.map(|own| significant(own * factor, 4));
    let [x, y, z] = &factors;
    GYRO_SCALE.to(match x == y && y == z {
        true => x.clone(),
        false => factors.join(","),
    })
}

/// Outcome of integrating the recording with a cure.
fn tried(recorded: f64, cured: f64, what: &str) -> String {
    format!(
        "gravity wanders by {} g as recorded, by {} g with {what}",
        significant(recorded, 2),
        significant(cured, 1)
    )
}

/// Whether a finding of this code guesses at what a comparison with gravity finds out.
pub(super) fn is_guess(code: &str) -> bool {
    GUESSES.contains(&code)
}

/// Leaves of several findings about one cause the one that knows it best.
pub(super) fn settle(found: &mut Vec<Finding>) {
    if found.iter().any(|f| f.code == axes::DEAD) {
        found.retain(|f| f.code != axes::SILENT);
    }
    if found.iter().any(|f| f.code == ACCELEROMETER) {
        found.retain(|f| f.code != BEYOND_SIGMA);
    }
    let is_meaning = |f: &Finding| f.code == MEANING && f.severity == Severity::Error;
    if found.iter().any(is_meaning) {
        found.retain(|f| !GUESSES.contains(&f.code) && !BY_UNIT.contains(&f.code));
    }
    let Some(cause) = found
        .iter()
        .find(|f| [AXES, SCALE, GYRO_EULER_RATES].contains(&f.code))
    else {
        if found.iter().any(|f| f.evidence.contains_key(COUNTS)) {
            let others = ["unit-unknown", "gyro-against-gravity"];
            found.retain(|f| !others.contains(&f.code) && !BY_UNIT.contains(&f.code));
        }
        return;
    };
    let (is_scale, cures) = (cause.code == SCALE, cause.help.clone());
    let says_the_same = |f: &Finding| GUESSES.contains(&f.code) && f.help == cures;
    if is_scale && found.iter().any(says_the_same) {
        // The words that were there before.
        found.retain(|f| f.code != SCALE && (!GUESSES.contains(&f.code) || f.help == cures));
        return;
    }
    let factor = cause
        .evidence
        .get("factor")
        .and_then(serde_json::Value::as_f64);
    let is_unit = factor.is_some_and(|factor| !(UNIT..1.0 / UNIT).contains(&factor));
    let is_explained = |code| GUESSES.contains(&code) || (is_unit && BY_UNIT.contains(&code));
    found.retain(|f| !is_explained(f.code));
}

#[cfg(test)]
mod tests;
