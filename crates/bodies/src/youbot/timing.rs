//! A motion faster than the joints -> by how much to stretch time. Pure.

use super::error::bounded;
use super::joints::TableMotion;
use super::{Arm, ArmError};

/// A factor to slow a path by, when it is above zero and finite.
pub(super) fn slow_down(factor: f64) -> Result<f64, ArmError> {
    bounded("slow-down factor", [factor], 1e9)?;
    if factor <= 0.0 {
        return Err(ArmError::Impossible {
            what: "a slow-down factor must be above zero",
            value: factor,
        });
    }
    Ok(factor)
}

/// The factor k >= 1 by which a path must be slowed so that no joint exceeds its fastest rate: time
/// runs k times as long, rates fall by k, accelerations by k^2, the path stays.
///
/// Knows only the instants it is shown: sample finely, or use [`super::JointPath::peak_rates`].
#[must_use]
pub fn slow_down_factor<'a>(arm: &Arm, motions: impl IntoIterator<Item = &'a TableMotion>) -> f64 {
    let fastest = arm.parameters().fastest;
    let mut factor = 1.0_f64;
    for motion in motions {
        for (qd, limit) in motion.qd().iter().zip(fastest) {
            factor = factor.max(qd.abs() / limit);
        }
    }
    factor
}
