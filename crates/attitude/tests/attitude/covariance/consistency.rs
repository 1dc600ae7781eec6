//! Do the errors that noise makes have the covariance that is reported? Normalised errors over many seeds
//! against their chi-square interval.

use nalgebra::{Matrix3, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::propagate::covariance::{Covariance, Noise};
use strapd_attitude::propagate::{Method, Propagator, Sequential, Settings};
use strapd_attitude::quaternion::{DeltaAngle, Quaternion, RotationVector};
use strapd_attitude::record::{
    AttitudeSample, Join, Measured, Nanos, RateSample, SampleKind, Status,
};

const STEP: f64 = 0.01;

const NOISE: Noise = Noise {
    initial: [0.002, 0.004, 0.001],
    arw: [1e-3, 3e-3, 5e-4],
    bias: [2e-3, 5e-4, 1e-3],
    rrw: [3e-4, 1e-4, 5e-4],
    scale: 0.0,
    misalignment: 0.0,
    bias_tau: None,
};

/// Normal numbers (Box and Muller 1958).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let u: f64 = rng.random_range(f64::MIN_POSITIVE..1.0);
    let v: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    (-2.0 * u.ln()).sqrt() * v.cos()
}

fn normals(rng: &mut ChaCha8Rng, sigma: [f64; 3]) -> Vector3<f64> {
    Vector3::from(sigma.map(|s| s * normal(rng)))
}

/// Mean rate over step k, rad/s: a body that tumbles at some 2 rad/s.
fn rate(k: f64) -> Vector3<f64> {
    let t = k * STEP;
    Vector3::new(
        (1.3 * t).sin(),
        1.0 + (0.7 * t).cos(),
        1.5 * (0.9 * t + 1.0).sin(),
    )
}

/// The error, rad, body axes, with which `estimate` misses `truth`: `truth = estimate exp(error)`.
fn error(estimate: &Quaternion<Nav, Body>, truth: &Quaternion<Nav, Body>) -> Vector3<f64> {
    (estimate.inverse() * *truth).rotation_vector().0
}

/// Readings of one gyro in each of `steps` steps (delta angles, noise and all), the true attitude at the end
/// and the true bias there, when the true initial attitude is none.
struct Flight {
    initial: Quaternion<Nav, Body>,
    angles: Vec<Vector3<f64>>,
    truth: Quaternion<Nav, Body>,
    bias: Vector3<f64>,
}

fn fly(seed: u64, steps: usize, noise: &Noise) -> Flight {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut truth = Quaternion::identity();
    let mut bias = normals(&mut rng, noise.bias);
    // The estimate starts off by the initial error: truth = initial exp(error).
    let initial = truth.advanced(&RotationVector(-normals(&mut rng, noise.initial)));
    let decay = noise.bias_tau.map_or(0.0, |tau| STEP / tau);
    let angles = (0..steps)
        .map(|k| {
            let phi = rate(k as f64) * STEP;
            truth = truth.advanced(&RotationVector(phi));
            // The bias walks in ten pieces a step, so that its path within the step counts too.
            let mut angle = phi + normals(&mut rng, noise.arw) * STEP.sqrt();
            for _ in 0..10 {
                let before = bias;
                bias += normals(&mut rng, noise.rrw) * (STEP / 10.0).sqrt() - bias * (decay / 10.0);
                angle += (before + bias) * (0.5 * STEP / 10.0);
            }
            angle
        })
        .collect();
    Flight {
        initial,
        angles,
        truth,
        bias,
    }
}

/// Normalised error squared of attitude and bias, 6 degrees of freedom.
fn normalised_6(seed: u64, steps: usize, noise: &Noise) -> f64 {
    let flight = fly(seed, steps, noise);
    let mut covariance = Covariance::new(*noise);
    let mut estimate = flight.initial;
    for angle in &flight.angles {
        estimate = estimate.advanced(&RotationVector(*angle));
        covariance.step(RotationVector(*angle), STEP);
    }
    let e = error(&estimate, &flight.truth);
    let b = flight.bias;
    let x = Vector6::new(e.x, e.y, e.z, b.x, b.y, b.z);
    let p = covariance.matrix().cholesky().unwrap();
    x.dot(&p.solve(&x))
}

/// Attitudes that the propagator makes of it, through its own door.
fn propagated(flight: &Flight, method: Method, noise: &Noise) -> Vec<AttitudeSample> {
    let step = (STEP * 1e9) as i64;
    let mut propagator = Propagator::new(Settings {
        method,
        kind: SampleKind::DeltaAngle,
        initial: flight.initial,
        noise: *noise,
        ..Settings::default()
    })
    .unwrap();
    let none = Vector3::zeros();
    let first = std::iter::once(&none).chain(&flight.angles);
    let samples: Vec<RateSample> = (0..)
        .zip(first)
        .map(|(k, angle)| RateSample {
            stamp: Nanos(k * step),
            start: Nanos((k - i64::from(k > 0)) * step),
            gyro: Measured::Increment(DeltaAngle(*angle)),
            accel: None,
            join: if k == 0 {
                Join::Start
            } else {
                Join::Continuous
            },
            status: Status::OK,
            log: Nanos(0),
        })
        .collect();
    let mut out = Vec::new();
    propagator.push(&samples, &Sequential, &mut out);
    propagator.finish(&Sequential, &mut out);
    out
}

/// Normalised error squared of the last attitude, 3 degrees of freedom.
fn normalised_3(seed: u64, steps: usize, method: Method, noise: &Noise) -> f64 {
    let flight = fly(seed, steps, noise);
    let out = propagated(&flight, method, noise);
    let last = out.last().unwrap();
    let e = error(&last.q_nb, &flight.truth);
    let p: Matrix3<f64> = last.covariance.matrix();
    e.dot(&p.cholesky().unwrap().solve(&e))
}

/// The mean of `count` chi-square numbers of `freedom` degrees lies within this of `freedom` but for one
/// time in two thousand (3.5 standard deviations).
fn assert_consistent(mean: f64, freedom: f64, count: u64) {
    let allowed = 3.5 * (2.0 * freedom / count as f64).sqrt();
    assert!(
        (mean - freedom).abs() < allowed,
        "{mean} of {freedom} +- {allowed}"
    );
}

fn mean(count: u64, of: impl Fn(u64) -> f64) -> f64 {
    (0..count).map(of).sum::<f64>() / count as f64
}

#[test]
fn attitude_and_bias_are_off_by_as_much_as_the_covariance_says() {
    let found = mean(200, |seed| normalised_6(seed, 2000, &NOISE));
    assert_consistent(found, 6.0, 200);
}

#[test]
fn a_bias_that_forgets_is_too() {
    let noise = Noise {
        bias_tau: Some(4.0),
        ..NOISE
    };
    let found = mean(200, |seed| normalised_6(seed, 2000, &noise));
    assert_consistent(found, 6.0, 200);
}

#[test]
fn what_the_propagator_puts_out_is_off_by_as_much_as_it_says() {
    let found = mean(200, |seed| {
        normalised_3(seed, 1000, Method::DcmRight, &NOISE)
    });
    assert_consistent(found, 3.0, 200);
    let constant_bias = Noise {
        initial: [0.002; 3],
        arw: [1e-3; 3],
        rrw: [0.0; 3],
        ..NOISE
    };
    // The rate of this body is constant over each step, which a wide window rounds off at the steps'
    // edges: 1e-7 rad a step, far below the noise.
    let found = mean(100, |seed| {
        normalised_3(seed, 500, Method::Auto, &constant_bias)
    });
    assert_consistent(found, 3.0, 100);
}

#[test]
#[ignore = "3000 runs of 60 s: a minute"]
fn so_it_is_over_thousands_of_runs_of_a_minute() {
    for steps in [600, 2000, 6000] {
        let found = mean(3000, |seed| normalised_6(seed, steps, &NOISE));
        assert_consistent(found, 6.0, 3000);
    }
}

#[test]
fn with_known_white_noise_the_errors_lie_within_three_sigma() {
    let noise = Noise {
        arw: [2e-3; 3],
        ..Noise::default()
    };
    let (mut inside, mut all) = (0, 0);
    for seed in 0..40 {
        let flight = fly(seed, 500, &noise);
        let out = propagated(&flight, Method::Auto, &noise);
        let mut truth: Quaternion<Nav, Body> = Quaternion::identity();
        for (k, sample) in out.iter().enumerate().skip(1) {
            truth = truth.advanced(&RotationVector(rate((k - 1) as f64) * STEP));
            let e = error(&sample.q_nb, &truth);
            let sigma = sample.covariance.sigma();
            for axis in 0..3 {
                all += 1;
                inside += usize::from(e[axis].abs() <= 3.0 * sigma[axis]);
            }
        }
    }
    let part = inside as f64 / all as f64;
    // 99.7 % of normal numbers; errors along one run go together, so 40 runs scatter. And not all: that
    // would be a sigma too large.
    assert!((0.95..0.99999).contains(&part), "{part}");
}

/// Checks 400 gyros, each with errors of scale and axes of its own, on a body that tumbles for 15 s.
#[test]
fn errors_of_scale_and_axes_have_the_covariance_that_is_reported() {
    let noise = Noise {
        scale: 2e-3,
        misalignment: 7e-4,
        ..Noise::default()
    };
    const GYROS: u64 = 400;
    let mut sum = 0.0;
    for seed in 0..GYROS {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let g = Matrix3::from_fn(|i, j| {
            normal(&mut rng)
                * if i == j {
                    noise.scale
                } else {
                    noise.misalignment
                }
        });
        let mut truth: Quaternion<Nav, Body> = Quaternion::identity();
        let mut estimate = truth;
        let mut covariance = Covariance::new(noise);
        for k in 0..1500 {
            let phi = rate(f64::from(k) + 0.5) * STEP;
            let measured = RotationVector(phi + g * phi);
            truth = truth.advanced(&RotationVector(phi));
            estimate = estimate.advanced(&measured);
            covariance.step(measured, STEP);
        }
        let e = error(&estimate, &truth);
        let p: Matrix3<f64> = covariance.matrix().fixed_view::<3, 3>(0, 0).into();
        sum += e.dot(&(p.try_inverse().unwrap() * e));
    }
    // Chi-square of 1200 degrees of freedom: 0.041 about one.
    let mean = sum / (3.0 * GYROS as f64);
    assert!((mean - 1.0).abs() < 0.13, "{mean}");
}
