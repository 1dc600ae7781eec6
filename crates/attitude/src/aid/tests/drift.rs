//! Gyros whose bias drifts by degrees a second while the body never rests.

use super::golden::Run;
use super::planar::Noise;
use crate::aid::Settings;
use nalgebra::{Rotation3, Vector3};

const STEP: f64 = 0.01;
const G: f64 = 9.81;
const SECS: usize = 300;

/// Mean tilt error, degrees, and what the filter says of its bias, of a thing in the hand whose bias goes by `drift`
/// deg/s a minute from 30 s on.
fn drifting(settings: Settings, drift: Vector3<f64>, seed: u64) -> (f64, Run) {
    let mut run = Run::new(settings);
    let mut random = Noise(seed);
    let pose = |t: f64| {
        let sway = |degrees: f64, w: f64| {
            let begun = (t - 3.0).clamp(0.0, 1.0);
            degrees.to_radians() * (w * (t - 3.0)).sin() * begun * begun
        };
        Rotation3::from_euler_angles(sway(50.0, 1.7), sway(40.0, 1.1), sway(120.0, 0.6))
    };
    let mut last = pose(0.0);
    let mut tilt = 0.0;
    for k in 0..SECS * 100 {
        let t = k as f64 * STEP;
        let r = pose(t);
        let turn = (last.inverse() * r).scaled_axis();
        last = r;
        let bias = drift.map(f64::to_radians) * ((t - 30.0) / 60.0).max(0.0);
        let rate = turn / STEP + bias + random.vector() * 9e-4;
        let force = r.inverse() * (Vector3::z() * G) + random.vector() * 0.03;
        run.take(t, rate, Some(force), None);
        let up = run.attitude().to_dcm().as_matrix() * r.inverse().matrix() * Vector3::z();
        tilt += up.angle(&Vector3::z()).to_degrees();
    }
    (tilt / (SECS * 100) as f64, run)
}

#[test]
fn a_bias_that_drifts_is_followed_and_no_acceleration_is_made_of_it() {
    let seen = [
        (Vector3::new(-0.24, 0.48, -0.24), 1),
        (Vector3::new(0.6, -0.6, 0.5), 2),
        (Vector3::new(-0.25, 0.75, 0.75), 3),
    ];
    for (drift, seed) in seen {
        let (tilt, run) = drifting(Settings::default(), drift, seed);
        assert!(tilt < 1.0, "{drift} {tilt}");
        assert_eq!(run.filter.report().restarts, 0, "{drift}");
        let from = run.filter.bias_moved_from().unwrap();
        assert!(from.amax().to_degrees() < 0.3, "{from}");
        let off = run.filter.calibration().bias.map(f64::to_degrees) - drift * 4.5;
        assert!(off.amax() < 0.3, "{drift} {off}");
    }
}

#[test]
fn without_what_follows_a_drift_gravity_is_disbelieved() {
    let before = Settings {
        bias_drift: 0.0,
        force_carried: f64::INFINITY,
        ..Settings::default()
    };
    let (tilt, run) = drifting(before, Vector3::new(-0.25, 0.75, 0.75), 3);
    assert!(tilt > 3.0 && run.filter.report().restarts > 0, "{tilt}");
}

#[test]
fn a_bias_that_stays_has_not_moved() {
    let (tilt, run) = drifting(Settings::default(), Vector3::zeros(), 4);
    assert!(tilt < 0.1, "{tilt}");
    assert_eq!(run.filter.bias_moved_from(), None);
}
