//! A gyro that feels acceleration: what it is found to be, and what becomes of the heading where nobody looks for it.

use super::logs::{Motion, errors, log};
use crate::quaternion::BodyRate;
use crate::smooth::{PriorScale, Settings};
use nalgebra::Matrix3;

/// 0.1 deg/s per g, as a data sheet has it, in rad/s per m/s^2.
const TYPICAL: f64 = 1.78e-4;

/// Sensitivity of each axis to the force along each.
fn felt() -> Matrix3<f64> {
    Matrix3::new(1.0, -0.5, 0.3, 0.7, -1.0, 0.6, -0.4, 0.8, 1.2) * TYPICAL
}

fn settings(sensitivity: f64) -> Settings {
    Settings {
        looseness: PriorScale {
            sensitivity,
            ..PriorScale::default()
        },
        ..Settings::default()
    }
}

#[test]
fn a_sensitivity_to_acceleration_is_found_and_taken_out() {
    let mut hand = log(Motion::Hand).plain();
    for sample in &mut hand.samples {
        let force = sample.force.unwrap();
        sample.rate = BodyRate(sample.rate.0 + felt() * force.as_vector());
    }
    let (found, estimates) = hand.smoothed(&settings(16.7));
    let learned = found.calibration().gyro_sensitivity;
    for i in 0..9 {
        let off = (learned.value[i] - felt()[(i / 3, i % 3)]).abs();
        assert!(off < 3.0 * learned.sigma[i], "{i}: {learned:?}");
    }
    // A minute shows those of the axes that it leans about most.
    let observed = (0..9).filter(|i| learned.is_observed(*i)).count();
    assert!(observed >= 5, "{learned:?}");
    let [_, _, tilt, heading] = errors(&estimates, &hand.truth, true);
    assert!(tilt < 0.3 && heading < 1.0, "{tilt} {heading}");
    // Where nobody looks for it, it is worse.
    let (_, estimates) = hand.smoothed(&settings(1e-3));
    let [_, _, _, without] = errors(&estimates, &hand.truth, true);
    assert!(without > 3.0 * heading, "{without} {heading}");
}

#[test]
fn a_gyro_that_feels_nothing_is_found_to_feel_nothing() {
    let hand = log(Motion::Hand).plain();
    let (found, _) = hand.smoothed(&settings(16.7));
    let learned = found.calibration().gyro_sensitivity;
    for i in 0..9 {
        assert!(
            learned.value[i].abs() < 3.0 * learned.sigma[i],
            "{i}: {learned:?}"
        );
    }
}
