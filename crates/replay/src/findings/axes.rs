//! Faults of single axes of a gyro -> findings. Pure.
//!
//! Apart from the rules about a recording's samples because a run and a live sensor are watched for the same.

use super::{Finding, Severity};
use crate::summary::significant;
use strapd_attitude::condition::quality::AxisFault;

/// Code of an axis that reads but one value, and of one of which that may be right.
pub(super) const DEAD: &str = "axis-dead";
pub(super) const SILENT: &str = "axis-silent";

/// Name of an axis.
pub(super) fn name(axis: usize) -> &'static str {
    ["x", "y", "z"].get(axis).copied().unwrap_or_default()
}

/// Finding of an axis that repeats one value for long.
pub(super) fn stuck(axis: usize, samples: u64) -> Finding {
    let name = name(axis);
    Finding::new(
        Severity::Error,
        "stuck",
        format!(
            "gyro {name} repeats one value {samples} times in a row while the others move: stuck?"
        ),
    )
    .with("axis", name)
    .with("samples", samples)
    .advise("one axis repeats itself while the others move: the sensor or its driver is broken")
}

/// Findings of axes that hung in a run, but for those at the end of their range.
pub(super) fn hung(faults: &[AxisFault; 3]) -> impl Iterator<Item = Finding> {
    let hung = faults.iter().enumerate();
    let hung = hung.filter(|(_, fault)| !fault.is_at_end && fault.wrapped.is_none());
    hung.filter_map(|(axis, fault)| Some(stuck(axis, fault.frozen?.samples)))
}

/// Findings of axes whose numbers wrap, in rad/s, and of dead ones where gravity shows that the body turned about them.
pub(super) fn broken(faults: &[AxisFault; 3], gravity_wanders: bool) -> Vec<Finding> {
    let mut out = Vec::new();
    for (axis, fault) in faults.iter().enumerate() {
        let name = name(axis);
        if let Some(wrapped) = fault.wrapped {
            let level = significant(wrapped.level, 3);
            let found = Finding::new(
                Severity::Error,
                "wrapped",
                format!(
                    "gyro {name} leaps {} times from one end of its range to the other, at {level} rad/s, and goes on from there: its numbers wrap",
                    wrapped.leaps
                ),
            );
            out.push(
                found
                    .with("axis", name)
                    .with("level_rad_s", wrapped.level)
                    .with("leaps", wrapped.leaps)
                    .advise("it turned faster than its range, or its counts overflow where they are converted: what lies beyond is wrong by the whole range; record with a wider one"),
            );
        }
        if let Some(reading) = fault.dead.filter(|_| gravity_wanders) {
            let found = Finding::new(
                Severity::Error,
                DEAD,
                format!(
                    "gyro {name} reads {} in every sample, and gravity does not stand still by the other axes: dead?",
                    significant(reading, 4)
                ),
            );
            out.push(
                found
                    .with("axis", name)
                    .with("reading", reading)
                    .advise("the sensor or its driver is broken, or its column is not the rate: nothing replaces it"),
            );
        }
    }
    out
}
