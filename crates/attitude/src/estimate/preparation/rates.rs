//! Rates of a file -> the end of the sensor's range, and the step in which its driver cut them. Pure.
//!
//! Apart from the rest of the preparation because both are told by the readings alone, whatever they mean.

use crate::condition::rails::{AT_RANGE, Clipped, Rails};
use crate::condition::truncation::Grid;
use crate::diagnostic::Diagnostic;
use crate::estimate::plan::{Aid, EstimationSettings, Truncation};
use crate::setting::{CALIBRATION, GYRO_RANGE, UNDO_TRUNCATION};

/// The range, rad/s, that the samples were clipped at, if they were, and the warning of it.
pub(super) fn clipped_at(rails: Option<Rails>, warnings: &mut Vec<Diagnostic>) -> Option<f64> {
    let (axis, clipped) = rails?.range(1.0)?;
    let name = ["x", "y", "z"].get(axis).copied().unwrap_or("?");
    let Clipped { level, samples } = clipped;
    warnings.push(format!(
        "gyro {name} stays at exactly {level:.4} rad/s, {samples} samples in all: that is taken for the end of its range, beyond which the rate is unknown; {GYRO_RANGE} RAD_S states another"
    ).into());
    Some(level.abs() * AT_RANGE)
}

/// Whether it is to be seen from the data if their driver has cut them.
pub(super) fn looks_for_truncation(plan: &EstimationSettings) -> bool {
    match plan.truncation {
        Truncation::Unsaid => plan.aid != Aid::None,
        Truncation::Auto | Truncation::On => true,
        Truncation::Steps(_) | Truncation::Off => false,
    }
}

/// `rates` are those of a file that can be read twice, where they are looked at. What they do not tell, a calibration
/// may.
pub(super) fn decide_truncation(
    plan: &EstimationSettings,
    rates: Option<&[[f64; 3]]>,
    warnings: &mut Vec<Diagnostic>,
) -> Result<Option<f64>, Diagnostic> {
    let known = plan.calibration.as_ref().and_then(|known| known.step());
    let is_asked = plan.truncation == Truncation::On;
    match plan.truncation {
        Truncation::Steps(step) => return Ok(Some(step)),
        Truncation::Off => return Ok(None),
        Truncation::On | Truncation::Auto | Truncation::Unsaid => {}
    }
    let grid = rates.and_then(Grid::of);
    match (grid, known) {
        (Some(grid), _) if is_asked || grid.is_truncated() => {
            let degrees = grid.step.to_degrees();
            let why = grid.zero_bin.map_or_else(String::new, |ratio| {
                format!(" (the one about zero is {ratio:.1} times as wide)")
            });
            warnings.push(format!(
                "the driver cut the rates towards zero in steps of {degrees:.4} deg/s{why}: half a step was put back; {UNDO_TRUNCATION} off leaves them, on={:.6e} does it to a stream",
                grid.step
            ).into());
            Ok(Some(grid.step))
        }
        (
            Some(Grid {
                zero_bin: Some(ratio),
                ..
            }),
            Some(_),
        ) => {
            warnings.push(format!(
                "{CALIBRATION}: its truncation_step was not used: these rates were not cut (the bin about zero is {ratio:.1} times as wide as the others); {UNDO_TRUNCATION} on=STEP insists"
            ).into());
            Ok(None)
        }
        (_, Some(step)) => {
            warnings.push(format!(
                "the driver cuts the rates towards zero in steps of {:.4} deg/s, says the calibration: half a step was put back; {UNDO_TRUNCATION} off leaves them",
                step.to_degrees()
            ).into());
            Ok(Some(step))
        }
        (_, None) if !is_asked => Ok(None),
        (_, None) => Err(match rates {
            None => {
                Diagnostic::new(format!(
                    "{UNDO_TRUNCATION} on: what cannot be read twice does not show its step in time"
                ))
                .help(format!(
                    "on=STEP in rad/s, as `strapd replay` of a file says it, or a {CALIBRATION} with its truncation_step"
                ))
            }
            Some(_) => {
                Diagnostic::new(format!(
                    "{UNDO_TRUNCATION} on: these rates count in no steps"
                ))
                .help(
                    "on=STEP in rad/s states them, off leaves the rates alone",
                )
            }
        }),
    }
}
