//! Recordings in memory and in a file, smoothed and not -> the same attitudes.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::aid::{self, Start};
use crate::propagate::{self, Sequential};
use crate::record::Measured;
use crate::smooth::BIAS_SIGMA;
use std::io::Cursor;

const SAMPLES: i64 = 24_000;

/// A hand that rests, turns and rests: rates, and forces and fields at rates and stamps of their own.
fn taken(smoothing: &mut Smoothing, is_smooth: bool) {
    taken_by(smoothing, is_smooth, Vector3::zeros());
}

/// Accounts for an accelerometer that is off by `bias`.
fn taken_by(smoothing: &mut Smoothing, is_smooth: bool, bias: Vector3<f64>) {
    let mut q = Quaternion::<Nav, Body>::identity();
    for i in 0..SAMPLES {
        let stamp = Nanos(i * 2_500_000);
        let t = i as f64 * 0.0025;
        let share = if (20.0..40.0).contains(&t) { 1.0 } else { 0.0 };
        let rate = Vector3::new((1.1 * t).sin(), (0.7 * t).cos(), (1.7 * t).sin()) * share;
        q = q.advanced(&RotationVector(rate * 0.0025));
        let to_body = q.to_dcm().as_matrix().transpose();
        // What never rests and goes far is not smoothed.
        let push = if is_smooth {
            0.0
        } else {
            9.0 * (0.2 * t).sin()
        };
        if i % 8 == 0 {
            let force = to_body * Vector3::new(push, 0.0, 9.81);
            smoothing.take_force(Nanos(stamp.0 - 1_000_000), In::assume(force + bias));
        }
        if i % 40 == 0 {
            smoothing.take_field(
                Nanos(stamp.0 - 3_000_000),
                In::assume(to_body * Vector3::new(0.0, 20.0, -40.0)),
            );
        }
        let wobble = Vector3::new(1.0, -2.0, 1.5) * (1e-3 * (31.0 * t).sin());
        let shaken = if is_smooth { wobble } else { wobble * 200.0 };
        let sample = RateSample {
            stamp,
            start: stamp,
            gyro: Measured::Rate(BodyRate(rate + Vector3::repeat(0.01) + shaken)),
            accel: None,
            join: if i == 0 {
                Join::Start
            } else {
                Join::Continuous
            },
            status: Status::OK,
            log: Nanos(stamp.0 + 5),
        };
        smoothing.push(&[sample], &mut Vec::new());
    }
}

fn aided() -> AidedPropagator {
    let settings = aid::Settings {
        has_field: true,
        ..aid::Settings::default()
    };
    let aided = AidedPropagator::new(propagate::Settings::default(), settings, Start::Level);
    aided.unwrap().with_forces_beside()
}

fn attitudes(mut smoothing: Smoothing) -> (Vec<AttitudeSample>, Option<String>) {
    let mut all = Vec::new();
    let given = smoothing.finish(&Sequential, &mut Vec::new(), &mut |some| {
        all.extend_from_slice(some)
    });
    given.unwrap();
    (
        all,
        smoothing
            .result()
            .and_then(Result::err)
            .map(ToString::to_string),
    )
}

fn new() -> Smoothing {
    Smoothing::new(
        aided(),
        SmoothingInputs {
            kind: SampleKind::Rate,
            heading: None,
            bias_sigma: BIAS_SIGMA,
            looseness: PriorScale::default(),
            other: None,
            is_class_found: false,
            known: PriorSigmas::default(),
        },
    )
}

#[test]
fn a_recording_kept_in_a_file_gives_the_bits_of_one_in_memory() {
    for is_smooth in [true, false] {
        let (mut held, mut spooled) = (new(), new());
        spooled.kept = SampleStore::of_at_most(0);
        spooled.spool_to(Box::new(Cursor::new(Vec::new())));
        taken(&mut held, is_smooth);
        taken(&mut spooled, is_smooth);
        let (held, why) = attitudes(held);
        assert_eq!(why.is_none(), is_smooth, "{why:?}");
        assert_eq!(held.len() as i64, SAMPLES);
        assert!(spooled.kept.spooled_bytes() > 0);
        assert_eq!(attitudes(spooled), (held, why));
    }
}

#[test]
fn an_accelerometer_far_off_its_class_is_smoothed_as_one_nobody_calibrated() {
    for (off, is_beyond) in [(0.05, false), (0.4, true)] {
        let bias = Vector3::new(off, -off, 0.5 * off);
        let mut smoothing = new();
        taken_by(&mut smoothing, true, bias);
        let given = smoothing.finish(&Sequential, &mut Vec::new(), &mut |_| {});
        given.unwrap();
        let recording = smoothing.result().unwrap().unwrap();
        assert_eq!(recording.is_beyond_class, is_beyond, "{off}");
        let found = recording.smoothed.calibration().force_bias;
        for axis in 0..3 {
            let error = (found.value[axis] - bias[axis]).abs();
            assert!(error < 3.0 * found.sigma[axis], "{off}: {found:?}");
        }
    }
}

#[test]
fn where_nothing_is_smoothed_the_attitudes_are_the_filters_with_what_came_beside() {
    let mut smoothing = new();
    taken(&mut smoothing, false);
    // The same events to a filter alone.
    let (mut alone, mut filtered) = (aided(), Vec::new());
    let events = smoothing.kept.give(|event| match event {
        Event::Rate(rate) => alone.push(&[rate], &mut filtered),
        Event::Force(stamp, force) => alone.take_force(stamp, force),
        Event::Field(stamp, field) => alone.take_field(stamp, field),
        Event::ForcesBeside => alone.expect_forces_beside(),
    });
    events.unwrap();
    alone.finish(&mut filtered);
    let running = format!("{:?}", smoothing.aided().filter().report());
    let (given, why) = attitudes(smoothing);
    assert!(why.is_some());
    assert_eq!(given, filtered);
    assert_eq!(running, format!("{:?}", alone.filter().report()));
}
