//! A gyro whose range a swing passes: the rotation beyond it is unknown about one axis, and about that alone.

use super::planar::Noise;
use crate::aid::{AidedPropagator, Settings, Start};
use crate::frames::In;
use crate::propagate;
use crate::quaternion::BodyRate;
use crate::record::{AttitudeSample, Join, Measured, Nanos, RateSample, SampleKind, Status};
use nalgebra::Vector3;

const HZ: f64 = 100.0;
/// End of the range, rad/s.
const RANGE: f64 = 2.5;

/// Attitudes of a level body that swings about the vertical by `size` rad in 2 s, with the true heading of each.
fn swung(size: f64, is_flagged: bool) -> Vec<(AttitudeSample, f64)> {
    let propagation = propagate::Settings {
        kind: SampleKind::Average,
        ..propagate::Settings::default()
    };
    let mut aided = AidedPropagator::new(propagation, Settings::default(), Start::Level).unwrap();
    let mut random = Noise(7);
    // One way fast, and slowly back: what is lost does not come back.
    let heading = |t: f64| {
        let phase = std::f64::consts::PI * t;
        size * (phase.sin() + 0.5 * (2.0 * phase).sin())
    };
    let mut out = Vec::new();
    for k in 0..3000_i64 {
        let (before, t) = ((k - 1) as f64 / HZ, k as f64 / HZ);
        let turn = (heading(t) - heading(before)) * HZ;
        let noise = random.vector() * (0.01_f64.to_radians() * HZ.sqrt());
        let mut rate = Vector3::new(0.0, 0.0, turn) + noise;
        let is_clipped = rate.z.abs() >= RANGE;
        rate.z = rate.z.clamp(-RANGE, RANGE);
        let stamp = Nanos(k * 10_000_000);
        let sample = RateSample {
            stamp,
            start: Nanos(stamp.0 - 10_000_000),
            gyro: Measured::Rate(BodyRate(rate)),
            accel: Some(In::assume(Vector3::z() * 9.81 + random.vector() * 0.02)),
            join: match k {
                0 => Join::Start,
                _ => Join::Continuous,
            },
            status: match is_clipped && is_flagged {
                true => Status::SATURATED,
                false => Status::OK,
            },
            log: stamp,
        };
        aided.push(&[sample], &mut out);
    }
    aided.finish(&mut out);
    let truth = |sample: &AttitudeSample| heading(sample.stamp.secs_since(Nanos(0)));
    let first = truth(out.first().unwrap());
    out.into_iter()
        .map(|sample| (sample, truth(&sample) - first))
        .collect()
}

/// Share of headings within three sigma; the largest error of one, and the largest sigma of a tilt after 2 s, degrees.
fn seen(swung: &[(AttitudeSample, f64)]) -> (f64, f64, f64) {
    let (mut inside, mut worst, mut tilt) = (0, 0.0_f64, 0.0_f64);
    for (sample, truth) in swung {
        let yaw = sample.q_nb.yaw_pitch_roll().yaw;
        let off = (yaw - truth).sin().atan2((yaw - truth).cos()).abs();
        let variance = sample
            .covariance
            .in_navigation_axes(&sample.q_nb)
            .diagonal();
        inside += usize::from(off <= 3.0 * variance.z.sqrt());
        worst = worst.max(off.to_degrees());
        if sample.stamp.0 > 2_000_000_000 {
            tilt = tilt.max(variance.x.max(variance.y).sqrt().to_degrees());
        }
    }
    (inside as f64 / swung.len() as f64, worst, tilt)
}

#[test]
fn a_clipped_swing_is_unknown_about_its_own_axis_alone() {
    let (inside, worst, tilt) = seen(&swung(0.6, true));
    assert!(worst > 20.0, "{worst} deg are lost");
    assert!(inside >= 0.97, "{inside}");
    assert!(tilt < 1.0, "{tilt} deg of tilt, which gravity shows");
    // As the samples are, without a word of their range, the sigma cannot know.
    let (inside, _, quiet) = seen(&swung(0.6, false));
    assert!(inside < 0.6, "{inside}");
    assert!((tilt - quiet).abs() < 0.5, "{tilt} {quiet}");
}

#[test]
fn a_swing_within_the_range_is_as_sure_as_before() {
    let [flagged, plain] = [true, false].map(|flagged| swung(0.3, flagged));
    assert!(flagged == plain);
    assert!(seen(&plain).1 < 2.0);
}

#[test]
fn a_flip_far_beyond_the_range_is_levelled_as_soon_as_it_is_over() {
    // 600 degrees about x in 0.2 s, by a gyro of 2000 deg/s, and then a rest.
    let (range, turn, secs) = (2000_f64.to_radians(), 600_f64.to_radians(), 0.2);
    let angle = |t: f64| {
        let part = ((t - 3.0) / secs).clamp(0.0, 1.0);
        let whole = std::f64::consts::TAU;
        turn * (part - (whole * part).sin() / whole)
    };
    let propagation = propagate::Settings {
        kind: SampleKind::Average,
        ..propagate::Settings::default()
    };
    let mut aided = AidedPropagator::new(propagation, Settings::default(), Start::Level).unwrap();
    let mut out = Vec::new();
    for k in 0..5000_i64 {
        let t = k as f64 * 1e-3;
        let rate = (angle(t) - angle(t - 1e-3)) * 1e3;
        let stamp = Nanos(k * 1_000_000);
        let sample = RateSample {
            stamp,
            start: Nanos(stamp.0 - 1_000_000),
            gyro: Measured::Rate(BodyRate(Vector3::new(rate.min(range), 0.0, 0.0))),
            accel: Some(In::assume(
                Vector3::new(0.0, angle(t).sin(), angle(t).cos()) * 9.81,
            )),
            join: match k {
                0 => Join::Start,
                _ => Join::Continuous,
            },
            status: match rate >= range {
                true => Status::SATURATED,
                false => Status::OK,
            },
            log: stamp,
        };
        aided.push(&[sample], &mut out);
    }
    aided.finish(&mut out);
    let (mut worst, mut after) = (0.0_f64, 0.0_f64);
    for sample in &out {
        let t = sample.stamp.secs_since(Nanos(0));
        let tilt = sample.q_nb.yaw_pitch_roll().roll - angle(t);
        let tilt = tilt.sin().atan2(tilt.cos()).abs();
        let sigma = sample.covariance.in_navigation_axes(&sample.q_nb).trace();
        assert!(tilt <= 3.0 * sigma.sqrt(), "{t} s: {tilt} rad, {sigma}");
        worst = worst.max(tilt.to_degrees());
        if t > 3.5 {
            after = after.max(tilt.to_degrees());
        }
    }
    assert!(worst > 150.0, "{worst} deg are lost");
    assert!(after < 2.0, "{after} deg are left");
}
