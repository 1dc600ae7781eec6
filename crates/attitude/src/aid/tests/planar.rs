//! Bodies whose vertical axis hardly leans, rests that are none, and rests that are short.

use crate::aid::covariance::{BIAS, Correction, Covariance, HEADING, TILT, Transition, WIDTH};
use crate::aid::{AidedPropagator, Settings, Start};
use crate::frames::In;
use crate::propagate;
use crate::quaternion::BodyRate;
use crate::record::{Join, Measured, Nanos, RateSample, SampleKind, Status};
use nalgebra::{Rotation3, Vector3};

const HZ: f64 = 100.0;
const G: f64 = 9.81;

/// White noise from a seed (Numerical Recipes' generator, twelve at a time): no stream of the library's own.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }

    pub(super) fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.next())
    }
}

/// Yaw, pitch, roll (rad) and the acceleration (m/s^2, world) at a time (s).
type Pose<'a> = &'a dyn Fn(f64) -> (Vector3<f64>, Vector3<f64>);

/// A filter that has had the mean rates and the forces of a motion, a gyro with a bias and white noise of `noise`
/// rad/s/sqrt(Hz).
fn fed(secs: f64, bias: Vector3<f64>, noise: f64, seed: u64, pose: Pose<'_>) -> AidedPropagator {
    let propagation = propagate::Settings {
        kind: SampleKind::Average,
        ..propagate::Settings::default()
    };
    let mut aided = AidedPropagator::new(propagation, Settings::default(), Start::Level).unwrap();
    let mut random = Noise(seed);
    let at = |t: f64| {
        let (angles, acceleration) = pose(t);
        let r = Rotation3::from_euler_angles(angles.z, angles.y, angles.x);
        (r, r.inverse() * (acceleration + Vector3::z() * G))
    };
    let mut last = at(-1.0 / HZ).0;
    let mut out = Vec::new();
    for k in 0..(secs * HZ) as i64 {
        let (r, force) = at(k as f64 / HZ);
        let turn = (last.inverse() * r).scaled_axis();
        last = r;
        let stamp = Nanos(k * 10_000_000);
        let rate = turn * HZ + bias + random.vector() * (noise * HZ.sqrt());
        let sample = RateSample {
            stamp,
            start: Nanos(stamp.0 - 10_000_000),
            gyro: Measured::Increment(BodyRate(rate).held_for(1.0 / HZ)),
            accel: Some(In::assume(force + random.vector() * 0.02)),
            join: if k == 0 {
                Join::Start
            } else {
                Join::Continuous
            },
            status: Status::OK,
            log: stamp,
        };
        aided.push(&[sample], &mut out);
        out.clear();
    }
    aided
}

/// Turns as it likes at 1 m/s, and rocks by `degrees` to each side, once in five or seven seconds.
fn wheels(degrees: f64, seed: u64) -> impl Fn(f64) -> (Vector3<f64>, Vector3<f64>) {
    let mut random = Noise(seed);
    let waves: Vec<(f64, f64, f64)> = (0..8)
        .map(|i| {
            let frequency = 0.25 + 0.3 * f64::from(i);
            (0.25 * (1.0 + 0.3 * random.next()), frequency, random.next())
        })
        .collect();
    move |t| {
        let (mut yaw, mut rate) = (0.0, 0.0);
        for (size, w, phase) in &waves {
            yaw += size / w * (phase.cos() - (w * t + phase).cos());
            rate += size * (w * t + phase).sin();
        }
        let rock = degrees.to_radians();
        let angles = Vector3::new(yaw, rock * (1.26 * t).sin(), rock * (0.9 * t).sin());
        let to_the_middle = Vector3::new(-yaw.sin(), yaw.cos(), 0.0) * rate;
        (angles, to_the_middle)
    }
}

/// Error of the bias about the body's z, and its sigma, deg/s.
fn about_z(aided: &AidedPropagator, bias: Vector3<f64>) -> (f64, f64) {
    let error = aided.filter().calibration().bias.z - bias.z;
    let sigma = aided.filter().calibration_sigma().bias.z;
    (error.to_degrees(), sigma.to_degrees())
}

#[test]
fn an_upright_body_says_nothing_of_the_bias_about_the_vertical() {
    for (seed, about) in [(1, 0.0), (2, 0.0), (3, 1.0)] {
        let bias = Vector3::z() * f64::to_radians(about);
        let aided = fed(200.0, bias, 1.75e-4, seed, &wheels(0.0, seed));
        let (error, sigma) = about_z(&aided, bias);
        assert!(sigma >= 0.9, "{seed}: {error} +- {sigma}");
        assert!(error.abs() <= 3.0 * sigma, "{seed}: {error} +- {sigma}");
        assert!(aided.filter().is_bias_unobserved());
        // Not moved from where it was by more than a tenth: what is not seen stays.
        assert!((error + about).abs() <= 0.1, "{seed}: {error} +- {sigma}");
    }
}

#[test]
fn a_body_that_leans_tells_the_bias_about_its_vertical() {
    let prior = Settings::default().bias_prior.to_degrees();
    for seed in [1, 2] {
        let bias = Vector3::z() * 1_f64.to_radians();
        let aided = fed(200.0, bias, 1.75e-4, seed, &wheels(25.0, seed));
        let (error, sigma) = about_z(&aided, bias);
        // A third of what it is without: 0.27 and 0.31 were found.
        assert!(sigma < prior / 3.0, "{seed}: {error} +- {sigma}");
        assert!(!aided.filter().is_bias_unobserved());
        assert!(error.abs() <= 3.0 * sigma, "{seed}: {error} +- {sigma}");
    }
}

#[test]
fn a_short_rest_tells_the_bias_as_well_as_it_was_measured() {
    // 2.3 s of rest, then in motion.
    let rest = |t: f64| {
        let turned = (t - 2.3).max(0.0).powi(3).min(0.5 * (t - 2.3).max(0.0));
        (Vector3::new(turned, 0.0, 0.0), Vector3::zeros())
    };
    let mut within = 0;
    for seed in 1..=20 {
        let bias = Vector3::new(0.01, -0.004, 0.006);
        // 0.03 deg/s/sqrt(Hz): a tenth of a second is known to 0.1 deg/s.
        let aided = fed(2.6, bias, 5.2e-4, seed, &rest);
        let (error, sigma) = about_z(&aided, bias);
        assert!(sigma < 0.06, "{sigma}");
        assert!(!aided.filter().is_bias_unobserved());
        assert!(error.abs() < 4.5 * sigma, "{seed}: {error} +- {sigma}");
        within += u32::from(error.abs() <= 2.0 * sigma);
    }
    assert!(within >= 16, "{within}");
}

#[test]
fn a_slow_turn_and_a_swell_are_no_rest() {
    // A turn of 1 deg/s that grows by 0.25 a second; a ship that heels by a degree every ten seconds.
    let turn = |t: f64| {
        let yaw = t + 0.125 * t * t;
        (Vector3::x() * yaw.to_radians(), Vector3::zeros())
    };
    let swell = |t: f64| {
        let heel = 1.5_f64.to_radians() * (0.63 * t).sin();
        (Vector3::new(0.0, 0.0, heel), Vector3::zeros())
    };
    let poses: [(f64, Pose<'_>); 2] = [(6.0, &turn), (60.0, &swell)];
    for (secs, pose) in poses {
        let aided = fed(secs, Vector3::zeros(), 1e-4, 1, pose);
        let sigma = aided.filter().calibration_sigma().bias.z.to_degrees();
        assert!(sigma > 0.5, "{secs}: {sigma}");
    }
}

#[test]
fn a_turn_about_the_vertical_of_a_second_at_both_ends_is_no_rest() {
    let robot = |t: f64| {
        let steady = 2.5 * t.min(1.0) + 2.2 * (t - 29.0).max(0.0);
        let between = 40.0 * (0.8 * (t - 1.0).clamp(0.0, 28.0)).sin();
        let yaw = (steady + between).to_radians();
        (Vector3::x() * yaw, Vector3::zeros())
    };
    let aided = fed(30.0, Vector3::zeros(), 1e-4, 1, &robot);
    let (error, sigma) = about_z(&aided, Vector3::zeros());
    assert!(error.abs() < 0.2 && sigma > 0.8, "{error} +- {sigma}");
}

/// Smallest pivot after so many updates that withhold all they say of heading and of the bias about z.
fn smallest_pivot(updates: u32) -> f64 {
    let mut covariance = Covariance::zero(false);
    for state in 0..20 {
        covariance.restart(state, 1e-2);
    }
    let mut random = Noise(7);
    let mut smallest = f64::INFINITY;
    let main = Vector3::z();
    for n in 0..updates {
        let mut transition = Transition::none();
        let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.01 * f64::from(n));
        for axis in 0..3 {
            for j in 0..3 {
                transition.0[axis][BIAS + j] = -0.1 * turned[(axis, j)];
            }
        }
        covariance.step(&transition);
        covariance.add_to_attitude(1e-9);
        for axis in 0..3 {
            covariance.add(BIAS + axis, 2e-9);
        }
        let mut correction: Correction = [0.0; WIDTH];
        for tilt in [TILT, TILT + 1] {
            let noise = 10_f64.powf(-3.0 + random.next());
            covariance.measure_withholding(
                &[(tilt, 9.81), (BIAS + 2, 0.01)],
                0.01 * random.next(),
                noise,
                (&main, 1.0),
                &mut correction,
            );
        }
        // But for rounding.
        assert!(correction[HEADING].abs() < 1e-18);
        if n % 100 == 0 || n + 1 == updates {
            smallest = smallest.min(covariance.smallest_pivot());
            assert!(covariance.asymmetry() < 1e-12);
        }
    }
    smallest
}

#[test]
fn a_covariance_that_withholds_stays_one() {
    let pivot = smallest_pivot(20_000);
    assert!(pivot > 1e-9, "{pivot}");
}

#[test]
#[ignore = "takes minutes"]
fn a_covariance_that_withholds_stays_one_for_a_million_updates() {
    let pivot = smallest_pivot(1_000_000);
    assert!(pivot > 1e-9, "{pivot}");
}
