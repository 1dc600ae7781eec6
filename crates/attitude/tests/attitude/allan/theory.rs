//! Each term's measured curve lies on its theory.

use super::{at_rest, curve};
use strapd_attitude::noise::allan::variance;
use strapd_attitude::noise::sensor_error::ImuError;
use strapd_attitude::record::SampleKind::{self, Average, DeltaAngle, Rate};

const STEP: i64 = 10_000_000;

/// Mean over the axes of measured / theoretical variance within `taus`, and the standard error of one
/// point's mean as `Point::error` states it.
fn ratios(
    error: &ImuError,
    kind: SampleKind,
    n: usize,
    taus: [f64; 2],
    rate: f64,
) -> Vec<(f64, f64, f64)> {
    let record = at_rest(error, kind, STEP, n, 7, rate);
    let curves = [0, 1, 2].map(|axis| curve(&record, axis, STEP));
    (0..curves[0].len())
        .map(|k| {
            let tau = curves[0][k].tau;
            let mean = curves.iter().map(|c| c[k].sigma.powi(2)).sum::<f64>() / 3.0;
            (
                tau,
                mean / variance(error, tau),
                2.0 * curves[0][k].error / 3f64.sqrt(),
            )
        })
        .filter(|(tau, ..)| *tau >= taus[0] && *tau <= taus[1])
        .collect()
}

/// Every point within four of its standard errors of the theory, and `slack` beside them.
fn holds(text: &str, kind: SampleKind, n: usize, taus: [f64; 2], rate: f64, slack: f64) {
    let error = ImuError::parse(text).unwrap();
    let points = ratios(&error, kind, n, taus, rate);
    assert!(points.len() > 10, "{text}: {} points", points.len());
    for (tau, ratio, sigma) in points {
        assert!(
            (ratio - 1.0).abs() < 4.0 * sigma + slack,
            "{text} {}: at {tau} s the variance is {ratio} of the theory's, +- {sigma}",
            kind.name()
        );
    }
}

#[test]
fn white_noise_falls_with_the_root_of_tau_for_every_sample_kind() {
    for kind in [Rate, Average, DeltaAngle] {
        holds("arw=0.3", kind, 40_000, [0.0, 1e9], 0.0, 0.0);
    }
}

#[test]
fn a_random_walk_of_the_rate_rises_with_the_root_of_tau() {
    // From ten samples on: below, the steps of the walk show.
    for kind in [Rate, DeltaAngle] {
        holds("rrw=2", kind, 40_000, [0.1, 1e9], 0.0, 0.01);
    }
}

#[test]
fn a_ramp_rises_with_tau() {
    holds("rate-ramp=1000", Rate, 20_000, [0.1, 1e9], 0.0, 0.0);
    holds("rate-ramp=1000", DeltaAngle, 20_000, [0.0, 1e9], 0.0, 1e-6);
}

#[test]
fn quantisation_falls_with_tau() {
    // Noise of half a step a sample makes the remainders independent, as the theory has them.
    for kind in [Rate, Average, DeltaAngle] {
        holds(
            "arw=0.5,quantization=2",
            kind,
            40_000,
            [0.0, 1e9],
            0.012_345,
            0.01,
        );
    }
}

#[test]
fn a_gauss_markov_bias_has_its_hump() {
    holds("gm-sigma=10,gm-tau=2", Rate, 60_000, [0.2, 1e9], 0.0, 0.02);
}

#[test]
fn flicker_has_a_floor() {
    // Away from the shortest correlation time, where the floor is being reached.
    holds("bias-instability=5", Rate, 60_000, [0.3, 60.0], 0.0, 0.05);
    // Slow parts drawn at knots and fast ones at each sample give the same floor.
    holds(
        "bias-instability=5,flicker-tau-min=0.01,flicker-tau-max=1000",
        Average,
        60_000,
        [0.3, 60.0],
        0.0,
        0.05,
    );
}

#[test]
fn a_slow_part_of_the_flicker_is_a_continuous_gauss_markov_process() {
    // One correlation time, 10 s: drawn at knots a third of a second apart.
    let text = "bias-instability=5,flicker-tau-min=10,flicker-tau-max=11";
    let error = ImuError::parse(text).unwrap();
    // Its variance: (B^2 / pi) ln sqrt(10).
    let sigma = error.bias_instability * (10f64.ln() / 2.0 / std::f64::consts::PI).sqrt();
    let alike = ImuError {
        gm_sigma: sigma,
        gm_tau: 10.0,
        ..ImuError::default()
    };
    let record = at_rest(&error, Rate, STEP, 200_000, 2, 0.0);
    for axis in 0..3 {
        let angles = record.pieces(axis)[0];
        // Between knots the bias moves by a thirtieth part of sigma sqrt(2 / 30), and never jumps.
        let most = angles
            .windows(3)
            .map(|w| ((w[2] - 2.0 * w[1] + w[0]) / 0.01).abs())
            .fold(0.0, f64::max);
        assert!(most < 6.0 * 0.26 / 33.0 * sigma, "{}", most / sigma);
        for p in curve(&record, axis, STEP).iter().filter(|p| p.tau > 1.0) {
            let ratio = p.sigma.powi(2) / variance(&alike, p.tau);
            assert!(
                (ratio - 1.0).abs() < 8.0 * p.error + 0.02,
                "at {} s: {ratio} +- {}",
                p.tau,
                2.0 * p.error
            );
        }
    }
}

#[test]
fn terms_add_up() {
    holds(
        "arw=0.05,bias-instability=40,rrw=300",
        Rate,
        60_000,
        [0.1, 1e9],
        0.0,
        0.03,
    );
}
