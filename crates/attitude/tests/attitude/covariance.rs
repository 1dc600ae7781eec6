//! The uncertainty that goes with an attitude: against the plain 6x6 recursion, and against the errors that
//! noise really makes.

mod consistency;
mod plain;

use nalgebra::{Matrix3, Matrix6, Vector3};
use plain::Plain;
use strapd_attitude::propagate::covariance::{Covariance, Noise};
use strapd_attitude::propagate::{Method, Propagator, Sequential, Settings};
use strapd_attitude::quaternion::{BodyRate, Quaternion, RotationVector};
use strapd_attitude::record::{
    AttitudeSample, Join, Measured, Nanos, RateSample, SampleKind, Status,
};
use strapd_attitude::worlds::Convention;

/// A body that tumbles: rotation vector of step k, at most `angle` rad or so, never twice the same.
fn tumble(k: usize, angle: f64) -> Vector3<f64> {
    let t = k as f64;
    Vector3::new(
        (0.037 * t).sin(),
        (0.023 * t + 1.0).cos(),
        (0.011 * t).sin(),
    ) * (0.6 * angle)
}

/// Largest difference of two covariances, in units of the standard deviations of the second.
fn difference(a: &Matrix6<f64>, b: &Matrix6<f64>) -> f64 {
    let mut worst: f64 = 0.0;
    for i in 0..6 {
        for j in 0..6 {
            let scale = (b[(i, i)] * b[(j, j)]).sqrt();
            if scale > 0.0 {
                worst = worst.max((a[(i, j)] - b[(i, j)]).abs() / scale);
            }
        }
    }
    worst
}

/// `count` steps of 10 ms, by strapd and by the plain recursion with each step cut into `parts`.
fn compare(noise: Noise, angle: f64, count: usize, parts: usize) -> f64 {
    let mut ours = Covariance::new(noise);
    let mut plain = Plain::new(&noise);
    for k in 0..count {
        let phi = tumble(k, angle);
        ours.step(RotationVector(phi), 0.01);
        for _ in 0..parts {
            plain.step(phi / parts as f64, 0.01 / parts as f64);
        }
    }
    difference(&ours.matrix(), &plain.p)
}

#[test]
fn equal_white_noise_and_a_constant_bias_are_the_plain_recursion_to_rounding() {
    let noise = Noise {
        initial: [0.01; 3],
        arw: [3e-3; 3],
        bias: [1e-3, 4e-3, 2e-4],
        ..Noise::default()
    };
    for angle in [0.0, 1e-6, 0.05, 0.19, 0.21, 1.0, 3.0] {
        let found = compare(noise, angle, 4000, 1);
        // 4000 steps, each rounded a dozen times; the sums for small angles end at 1e-12.
        assert!(found < 1e-11, "{angle} rad a step: {found:e}");
    }
}

#[test]
fn a_wandering_bias_and_unequal_axes_are_the_finely_cut_recursion_within_what_is_stated() {
    let rrw = Noise {
        arw: [1e-3; 3],
        bias: [1e-3, 0.0, 2e-3],
        rrw: [2e-3; 3],
        ..Noise::default()
    };
    let unequal = Noise {
        initial: [0.01, 0.0, 0.03],
        arw: [1e-3, 5e-3, 0.0],
        rrw: [0.0, 2e-3, 1e-3],
        ..Noise::default()
    };
    let decaying = Noise {
        bias_tau: Some(3.0),
        ..rrw
    };
    for (name, noise) in [("rrw", rrw), ("unequal", unequal), ("decaying", decaying)] {
        for (angle, allowed) in [(0.01, 1e-5), (0.1, 1e-4), (1.0, 1e-3)] {
            let found = compare(noise, angle, 400, 40);
            // A share of what the steps add, up to a^2/3 each; over many it is less.
            assert!(found < allowed, "{name}, {angle} rad a step: {found:e}");
        }
    }
}

#[test]
fn a_bias_that_forgets_ends_where_a_gauss_markov_process_does() {
    let (k, tau) = (2e-3, 0.5);
    for h in [1e-4_f64, 0.01, 0.3, 5.0, 1e9] {
        let mut covariance = Covariance::new(Noise {
            bias: [0.1; 3],
            rrw: [k; 3],
            bias_tau: Some(tau),
            ..Noise::default()
        });
        let steps = (20.0 / h).ceil() as usize;
        for _ in 0..steps {
            covariance.step(RotationVector(Vector3::zeros()), h);
        }
        let m = covariance.matrix();
        let t = steps as f64 * h;
        // 40 time constants: e^-80 of the start is left in the variance.
        assert!((m[(3, 3)] / (0.5 * k * k * tau) - 1.0).abs() < 1e-12, "{h}");
        // Integral of the process (Gelb 1974, shaping filters): the initial bias, and the driven part.
        let (x, decay) = (t / tau, -(-t / tau).exp_m1());
        let driven = k * k * tau.powi(3) * (x - 2.0 * decay - 0.5 * (-2.0 * x).exp_m1());
        let expected = (0.1 * tau * decay).powi(2) + driven;
        let expected = expected.min(std::f64::consts::PI.powi(2));
        let found = covariance.attitude().xx;
        assert!(
            (found / expected - 1.0).abs() < 1e-9,
            "{h}: {found:e} {expected:e}"
        );
    }
}

#[test]
fn the_matrix_is_symmetric_and_has_no_negative_variance_in_any_direction() {
    let noise = Noise {
        initial: [0.02, 0.0, 0.01],
        arw: [1e-3, 0.0, 4e-3],
        bias: [0.0, 3e-3, 1e-3],
        rrw: [1e-3, 0.0, 0.0],
        bias_tau: None,
        ..Noise::default()
    };
    let mut covariance = Covariance::new(noise);
    for k in 0..20_000 {
        covariance.step(RotationVector(tumble(k, 0.3)), 0.01);
        if k % 500 == 0 {
            let m = covariance.matrix();
            assert_eq!(m, m.transpose());
            let smallest = m.symmetric_eigenvalues().min();
            // Rounding of the largest.
            assert!(smallest > -1e-14 * m.norm(), "step {k}: {smallest:e}");
        }
    }
}

#[test]
fn what_is_unknown_ends_at_half_a_turn_and_keeps_its_correlations() {
    let mut covariance = Covariance::new(Noise {
        bias: [3.0, 0.0, 4.0],
        ..Noise::default()
    });
    covariance.step(RotationVector(Vector3::zeros()), 1e6);
    // Turned by an eighth about y after the bias has done its worst: x and z are correlated.
    covariance.step(RotationVector(Vector3::new(0.0, 0.8, 0.0)), 1e-9);
    let p = covariance.attitude();
    let pi = std::f64::consts::PI;
    assert!(
        (p.sigma() - Vector3::new(pi, 0.0, pi)).norm() < 1e-6,
        "{p:?}"
    );
    let smallest = p.matrix().symmetric_eigenvalues().min();
    assert!(smallest > -1e-12 && p.xz.abs() > 1.0, "{p:?}");
}

#[test]
fn a_reset_forgets_the_attitudes_error_and_not_what_is_unknown_of_the_bias() {
    let noise = Noise {
        initial: [0.1, 0.2, 0.3],
        bias: [1e-3; 3],
        rrw: [1e-2; 3],
        ..Noise::default()
    };
    let mut propagator = Propagator::new(Settings {
        method: Method::DcmRight,
        kind: SampleKind::Rate,
        initial: Quaternion::identity(),
        noise,
        ..Settings::default()
    })
    .unwrap();
    let at = |secs: i64, join| RateSample {
        stamp: Nanos(secs * 1_000_000_000),
        start: Nanos(secs * 1_000_000_000),
        gyro: Measured::Rate(BodyRate::ZERO),
        accel: None,
        join,
        status: Status::OK,
        log: Nanos(0),
    };
    let mut out = Vec::new();
    let joins = [Join::Start, Join::Continuous, Join::Reset, Join::Continuous];
    let samples: Vec<RateSample> = (0..).zip(joins).map(|(k, join)| at(k, join)).collect();
    propagator.push(&samples, &Sequential, &mut out);
    propagator.finish(&Sequential, &mut out);
    let initial = Vector3::new(0.1, 0.2, 0.3);
    assert!((out[0].covariance.sigma() - initial).norm() < 1e-15);
    assert!((out[2].covariance.sigma() - initial).norm() < 1e-15);
    // After one second from the start: b^2 + K^2/3. After one from the reset, which came two after: the
    // bias had wandered for two seconds by then.
    let grown = |k: usize| out[k].covariance.xx - 0.01;
    assert!((grown(1) - (1e-6 + 1e-4 / 3.0)).abs() < 1e-15);
    assert!((grown(3) - (1e-6 + 2e-4 + 1e-4 / 3.0)).abs() < 1e-15);
}

#[test]
fn a_covariance_turns_with_its_axes() {
    let covariance = strapd_attitude::record::AttitudeCovariance {
        xx: 4.0,
        xy: 0.5,
        xz: -0.25,
        yy: 2.0,
        yz: 0.125,
        zz: 1.0,
    };
    // FRD from FLU: y and z change sign, so xy and xz do, and yz does not.
    let frd = covariance.relabelled(|v| Convention::EnuFlu.convert_body(Convention::NedFrd, v));
    assert_eq!((frd.xy, frd.xz, frd.yz), (-0.5, 0.25, 0.125));
    assert_eq!((frd.xx, frd.yy, frd.zz), (4.0, 2.0, 1.0));
    // In world axes it is the same, whichever of the two the body is labelled with: turned as one.
    let q = Quaternion::assume_unit([0.5, -0.5, 0.5, 0.5]);
    let enu = covariance.in_navigation_axes(&q);
    let ned = frd.in_navigation_axes(&Convention::EnuFlu.convert(Convention::NedFrd, q));
    let ned_from_enu = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let turned = ned_from_enu * enu * ned_from_enu.transpose();
    assert!((turned - ned).norm() < 1e-14, "{turned} {ned}");
}

/// Outputs of `method` for `samples`, pushed in pieces of `piece`.
fn pushed(
    method: Method,
    noise: Noise,
    samples: &[RateSample],
    piece: usize,
) -> Vec<AttitudeSample> {
    let mut propagator = Propagator::new(Settings {
        method,
        kind: SampleKind::Rate,
        initial: Quaternion::identity(),
        noise,
        ..Settings::default()
    })
    .unwrap();
    let mut out = Vec::new();
    for piece in samples.chunks(piece) {
        propagator.push(piece, &Sequential, &mut out);
    }
    propagator.finish(&Sequential, &mut out);
    out
}

fn tumbling(count: usize) -> Vec<RateSample> {
    (0..count)
        .map(|k| {
            let stamp = Nanos(k as i64 * 10_000_000);
            RateSample {
                stamp,
                start: stamp,
                gyro: Measured::Rate(BodyRate(tumble(k, 5.0))),
                accel: None,
                join: if k == 0 {
                    Join::Start
                } else {
                    Join::Continuous
                },
                status: Status::OK,
                log: stamp,
            }
        })
        .collect()
}

const LIVE: Method = Method::CommitProvisional {
    window: 6,
    order: strapd_attitude::propagate::Order::M8,
    finals: false,
};

#[test]
fn the_propagator_carries_the_covariance_of_its_own_turns() {
    let noise = Noise {
        initial: [0.01, 0.02, 0.03],
        arw: [1e-3, 2e-3, 3e-3],
        bias: [1e-3, 2e-3, 0.0],
        rrw: [1e-3, 0.0, 2e-3],
        bias_tau: None,
        ..Noise::default()
    };
    let samples = tumbling(3000);
    let log = pushed(Method::Auto, noise, &samples, 3000);
    let mut alone = Covariance::new(noise);
    for pair in log.windows(2) {
        let turn = pair[0].q_nb.inverse() * pair[1].q_nb;
        alone.step(turn.rotation_vector(), 0.01);
        let (a, b) = (alone.attitude().matrix(), pair[1].covariance.matrix());
        assert!((a - b).norm() < 1e-12 * b.norm(), "{a} {b}");
    }
    // A provisional part is uncertain like any other: live, the last attitude has what the log has.
    let streamed = pushed(LIVE, noise, &samples, 7);
    let (a, b) = (streamed.last().unwrap(), log.last().unwrap());
    let (a, b) = (a.covariance.matrix(), b.covariance.matrix());
    assert!((a - b).norm() < 1e-6 * b.norm(), "{a} {b}");
}

#[test]
fn what_scale_and_axes_leave_unknown_is_live_what_it_is_in_the_log() {
    let noise = Noise {
        bias: [1e-3; 3],
        scale: 0.01,
        misalignment: 0.01,
        ..Noise::default()
    };
    let samples = tumbling(3000);
    let log = pushed(Method::Auto, noise, &samples, 3000);
    let streamed = pushed(LIVE, noise, &samples, 7);
    let worst = log
        .iter()
        .zip(&streamed)
        .map(|(a, b)| {
            let (a, b) = (a.covariance.matrix(), b.covariance.matrix());
            (a - b).norm() / a.norm().max(1e-9)
        })
        .fold(0.0, f64::max);
    // In one turn over the samples that are not final yet; sigma is told in two digits.
    assert!(worst < 1e-3, "{worst}");
}
