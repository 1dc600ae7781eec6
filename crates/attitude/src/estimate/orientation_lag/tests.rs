#![allow(clippy::unwrap_used)]
use super::*;
use crate::estimate::plan::EstimationSettings;
use crate::quaternion::YawPitchRoll;
use crate::record::{Declared, SampleKind};

/// Rz(2 sin 0.6 t) Ry(0.7 sin 1.1 t) Rx(0.9 sin 1.7 t), as in the golden numbers.
fn attitude(secs: f64) -> Quaternion<Nav, Body> {
    Quaternion::from_yaw_pitch_roll(&YawPitchRoll {
        yaw: 2.0 * (0.6 * secs).sin(),
        pitch: 0.7 * (1.1 * secs).sin(),
        roll: 0.9 * (1.7 * secs).sin(),
    })
}

/// Mean rate from one instant to another.
fn mean(from: f64, to: f64) -> [f64; 3] {
    let turn = (attitude(from).inverse() * attitude(to)).rotation_vector();
    (turn.0 / (to - from)).into()
}

const STEP: f64 = 0.01;

/// The fit of 15 s at 100 Hz of these readings.
fn lag(gyro: impl Fn(f64) -> [f64; 3], seen: impl Fn(f64) -> Quaternion<Nav, Body>) -> LagPass {
    let meaning = Meaning::new(&EstimationSettings::default(), &Declared::default());
    let mut pass = LagPass::default();
    for n in 0..1500_i64 {
        let secs = n as f64 * STEP;
        let raw = RawSample {
            header: Some(Nanos(n * 10_000_000)),
            gyro: Some(gyro(secs)),
            orientation: Some(seen(secs).wxyz()),
            ..RawSample::default()
        };
        pass.take(&raw, &meaning, Clock::Header);
    }
    pass
}

#[test]
fn means_are_half_a_step_late_and_rates_are_not() {
    let share = |pass: &LagPass| {
        let found = pass.fit().unwrap();
        found.delay_secs / found.step_secs
    };
    let means = lag(|t| mean(t - STEP, t), attitude);
    assert!(
        (share(&means) - 0.499_932_661).abs() < 1e-3,
        "{}",
        share(&means)
    );
    assert_eq!(means.choice().unwrap().kind, SampleKind::Average);
    let rates = lag(|t| mean(t - 1e-4, t + 1e-4), attitude);
    assert!(
        (share(&rates) + 9.448_7e-5).abs() < 1e-3,
        "{}",
        share(&rates)
    );
    assert_eq!(rates.choice().unwrap().kind, SampleKind::Rate);
    assert_eq!(rates.fit().unwrap().of_filter(), None);
}

#[test]
fn a_filter_of_the_sensor_is_what_the_kind_does_not_explain() {
    let late = lag(|t| mean(t - STEP - 0.008, t - 0.008), attitude);
    let found = late.fit().unwrap();
    assert_eq!(found.kind(), Some(SampleKind::Average));
    let filter = found.of_filter().unwrap();
    assert!((filter - 0.008).abs() < 2e-4, "{filter}");
}

#[test]
fn what_is_between_or_of_another_body_decides_nothing() {
    let between = lag(|t| mean(t - 0.0075, t + 0.0025), attitude);
    assert_eq!(between.choice(), None);
    // The inverse follows the rates as no orientation of this body does.
    let other = lag(
        |t| mean(t - STEP, t),
        |t| Quaternion::assume_unit(attitude(t).inverse().wxyz()),
    );
    assert_eq!(other.choice(), None);
    let at_rest = lag(|_| [0.0; 3], |_| attitude(1.0));
    assert_eq!(at_rest.choice(), None);
}
