//! Increments of roll, pitch and yaw -> those about the axes of the body. Pure.
//!
//! A stage of its own because what makes rates of the derivatives of angles is no map: it depends on roll and pitch,
//! which gravity tells.

use nalgebra::Vector3;

/// Side of the body that is up where roll and pitch are zero, by the sign of its z.
pub(super) const UPS: [f64; 2] = [1.0, -1.0];

/// Increments about the axes of the body, where the recorded ones are those of roll, pitch and yaw (yaw first, about the
/// vertical); with each step, the force, and `up` of [`UPS`].
pub(super) fn body_angles(steps: &[(Vector3<f64>, Vector3<f64>)], up: f64) -> Vec<Vector3<f64>> {
    let mut sum = Vector3::zeros();
    let since: Vec<Vector3<f64>> = steps
        .iter()
        .map(|(step, _)| {
            let middle = sum + step * 0.5;
            sum += step;
            middle
        })
        .collect();
    let all = || steps.iter().zip(&since);
    // Roll is told by what of gravity is across the axis of roll.
    let roll = mean_angle(all().map(|((_, force), since)| {
        let across = force.y.hypot(force.z);
        ((up * force.y).atan2(up * force.z) - since.x, across)
    }));
    let pitch = mean_angle(all().map(|((_, force), since)| {
        let (sin, cos) = (roll + since.x).sin_cos();
        let level = force.y * sin + force.z * cos;
        ((-up * force.x).atan2(up * level) - since.y, force.norm())
    }));
    all()
        .map(|((step, _), since)| {
            let ((sr, cr), (sp, cp)) = ((roll + since.x).sin_cos(), (pitch + since.y).sin_cos());
            Vector3::new(
                step.x - step.z * sp,
                step.y * cr + step.z * sr * cp,
                step.z * cr * cp - step.y * sr,
            )
        })
        .collect()
}

/// Mean of angles with their weights, wherever they are cut.
fn mean_angle(all: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (sin, cos) = all.fold((0.0, 0.0), |(sin, cos), (angle, weight)| {
        (sin + weight * angle.sin(), cos + weight * angle.cos())
    });
    f64::atan2(sin, cos)
}
