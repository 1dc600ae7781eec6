//! Upright bodies whose accelerations repeat: what they must not be taken for.

use super::golden::Run;
use super::planar::Noise;
use crate::aid::Settings;
use nalgebra::{Rotation3, Vector3};

const STEP: f64 = 0.01;
const G: f64 = 9.81;
const SECS: usize = 60;

/// Priors of a unit that nobody calibrated, with the sensors of which these bodies are measured without an error.
fn loose() -> Settings {
    Settings {
        scale_prior: 0.01,
        cross_prior: 0.0175,
        force_bias_prior: 0.2,
        ..Settings::default()
    }
}

/// Root mean square of the tilt error, degrees, of a body that moves after 3 s: yaw, pitch and roll (rad), acceleration
/// (m/s^2, earth axes) by the time since then.
fn tilt(settings: Settings, motion: impl Fn(f64) -> (Vector3<f64>, Vector3<f64>)) -> f64 {
    let (mut run, mut random) = (Run::new(settings), Noise(7));
    let pose = |t: f64| {
        let (angles, acceleration) = motion((t - 3.0).max(0.0));
        let r = Rotation3::from_euler_angles(angles.z, angles.y, angles.x);
        (r, acceleration)
    };
    let mut last = pose(0.0).0;
    let mut squares = 0.0;
    for k in 0..SECS * 100 {
        let t = k as f64 * STEP;
        let (r, acceleration) = pose(t);
        let turn = (last.inverse() * r).scaled_axis();
        last = r;
        let rate = turn / STEP + random.vector() * 9e-4;
        let force = r.inverse() * (acceleration + Vector3::z() * G) + random.vector() * 0.03;
        run.take(t, rate, Some(force), None);
        let up = run.attitude().to_dcm().as_matrix() * r.inverse().matrix() * Vector3::z();
        squares += up.angle(&Vector3::z()).to_degrees().powi(2);
    }
    (squares / (SECS * 100) as f64).sqrt()
}

/// A runner's waist: at each step it goes up and ahead at once, and it yaws and rolls with the stride.
fn runs(t: f64) -> (Vector3<f64>, Vector3<f64>) {
    let (step, stride) = (17.6 * t, 8.8 * t);
    let begun = t.min(1.0);
    let angles = Vector3::new(
        0.14 * stride.sin(),
        0.05 * (step + 0.4).sin(),
        0.08 * (stride + 1.0).sin(),
    );
    let acceleration = Vector3::new(0.6, 0.1, 1.0) * (10.0 * step.sin());
    (angles * begun, acceleration * begun)
}

#[test]
fn a_step_up_and_ahead_is_no_tilt() {
    let now = tilt(loose(), runs);
    let before = tilt(
        Settings {
            tilt_by_gravity: false,
            ..loose()
        },
        runs,
    );
    assert!(now < 3.0 && before > 4.0 * now, "{now} {before}");
}
