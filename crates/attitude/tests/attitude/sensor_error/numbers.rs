//! The generator: normal, independent, and the same everywhere.

use super::{read, rest, sensor};
use nalgebra::Vector3;
use strapd_attitude::noise::sensor_error::{GyroModel, ImuError};
use strapd_attitude::record::SampleKind::{self, Average, DeltaAngle, Rate};

/// Every term at once.
const ALL: &str = "arw=0.3,bias-instability=20,rrw=60,rate-ramp=100,gm-sigma=10,gm-tau=3,turn-on-bias=50,\
temperature-coefficient=5,scale-ppm=2000,misalignment=0.5,nonlinearity-ppm=300,nonlinearity3-ppm=200,\
g-sensitivity=30,range=200,bandwidth-hz=60,quantization=0.5,accel-noise=100,accel-bias=3";
/// Further constant errors.
const MORE: &str = "accel-scale-ppm=4000,accel-misalignment=0.3";

/// FNV-1a of the bits of all readings.
fn digest(text: &str, kind: SampleKind, seed: u64) -> u64 {
    let mut gyro = GyroModel::new(&ImuError::parse(text).unwrap(), kind, seed).unwrap();
    // Arithmetic alone: the motion must be the same everywhere too.
    let rate = |t: f64| Vector3::new(0.3 + t, -t * t, 2.0);
    let angle = |t: f64| Vector3::new(0.3 * t + 0.5 * t * t, -t * t * t / 3.0, 2.0 * t);
    let mut sum = 0xcbf2_9ce4_8422_2325u64;
    for reading in read(&mut gyro, 5_000_000, 4000, rate, angle) {
        for value in reading.gyro.iter().chain(reading.specific_force.iter()) {
            for byte in value.to_bits().to_le_bytes() {
                sum = (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        }
    }
    sum
}

#[test]
fn a_seed_means_the_same_bits_on_every_platform() {
    // The same in debug and release builds; found on x86-64.
    for (kind, seed, expected) in [
        (Rate, 0, 0x26a5_fe05_6080_18f5),
        (Average, 1, 0x410f_a4bc_b8d2_a948),
        (DeltaAngle, u64::MAX, 0x2267_c99e_e32d_030f),
    ] {
        let found = digest(ALL, kind, seed);
        assert_eq!(found, expected, "{} {seed}: {found:#018x}", kind.name());
        assert_eq!(found, digest(ALL, kind, seed));
        assert_ne!(found, digest(ALL, kind, seed ^ 1));
    }
}

#[test]
fn white_noise_is_normal_to_its_tails() {
    // N = 1 rad/sqrt(s) at 1 s: standard normal.
    let n = 400_000;
    let text = format!("arw={}", 60.0 * 180.0 / std::f64::consts::PI);
    let all: Vec<f64> = rest(&mut sensor(&text, Rate, 3), 1_000_000_000, n)
        .iter()
        .flat_map(|v| [v.x, v.y, v.z])
        .collect();
    let count = all.len() as f64;
    let moment = |k: i32| all.iter().map(|v| v.powi(k)).sum::<f64>() / count;
    // Within five of their standard errors: 1, sqrt 2, sqrt 6 (skew: 15 - 9), sqrt 96.
    for (k, mean, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)] {
        let off = (moment(k) - mean).abs() / f64::sqrt(variance / count);
        assert!(off < 5.0, "moment {k}: {} is {off} sigma off", moment(k));
    }
    // Beyond every bound from the middle of the layers to the tail (3.65 on).
    for (bound, share) in [
        (0.5, 0.617_075_077_4),
        (1.0, 0.317_310_507_9),
        (2.0, 0.045_500_263_9),
        (3.0, 0.002_699_796_1),
        (3.654_152_9, 2.580_3e-4),
        (4.0, 6.334_248e-5),
    ] {
        let beyond = all.iter().filter(|v| v.abs() > bound).count() as f64;
        let off = (beyond - share * count).abs() / (share * (1.0 - share) * count).sqrt();
        assert!(
            off < 5.0,
            "{beyond} beyond {bound}, {} expected",
            share * count
        );
    }
}

#[test]
fn axes_are_independent() {
    let n = 100_000;
    let all = rest(
        &mut sensor("arw=1,rrw=10,bias-instability=5", Rate, 5),
        10_000_000,
        n,
    );
    let deviation = |i: usize| (all.iter().map(|v| v[i] * v[i]).sum::<f64>() / n as f64).sqrt();
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let mean = all.iter().map(|v| v[i] * v[j]).sum::<f64>() / n as f64;
        let correlation = mean / (deviation(i) * deviation(j));
        assert!(
            correlation.abs() < 5.0 / f64::sqrt(n as f64),
            "{i}{j}: {correlation}"
        );
    }
}

#[test]
fn a_term_does_not_change_what_another_draws() {
    let terms = [
        "arw=0.3",
        "bias-instability=20",
        "rrw=60",
        "gm-sigma=10,gm-tau=3",
    ];
    let run = |text: &str| rest(&mut sensor(text, Rate, 11), 10_000_000, 500);
    let whole = run(&terms.join(","));
    let parts = terms.map(run);
    for (i, sum) in whole.iter().enumerate() {
        let of_parts: Vector3<f64> = parts.iter().map(|p| p[i]).sum();
        assert!((sum - of_parts).amax() < 1e-15, "sample {i}");
    }
    // Nor do constant errors, drawn or not.
    let error = ImuError::parse("arw=0.3,turn-on-bias=100").unwrap();
    let mut drawn = GyroModel::new(&error, Rate, 11).unwrap();
    let bias = drawn.constants().bias;
    assert!(bias.amin() > 0.0);
    for (with, without) in rest(&mut drawn, 10_000_000, 500).iter().zip(&parts[0]) {
        assert!((with - bias - without).amax() < 1e-15);
    }
}

/// Correlation of two series of the same length, about zero.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
}

#[test]
fn terms_do_not_share_their_draws() {
    let n = 20_000;
    let x = |text: &str| -> Vec<f64> {
        rest(&mut sensor(text, Rate, 11), 10_000_000, n)
            .iter()
            .map(|v| v.x)
            .collect()
    };
    let steps = |v: Vec<f64>| -> Vec<f64> { v.windows(2).map(|w| w[1] - w[0]).collect() };
    let white = x("arw=0.3");
    // What a random walk and a fast Gauss-Markov bias add at each sample.
    let walk = steps(x("rrw=60"));
    let markov = steps(x("gm-sigma=10,gm-tau=1"));
    let later = white.get(1..).unwrap_or_default();
    for (name, a, b) in [
        ("white and walk", later, &walk[..]),
        ("white and markov", later, &markov),
        ("walk and markov", &walk, &markov),
    ] {
        let found = correlation(a, b);
        assert!(found.abs() < 5.0 / f64::sqrt(n as f64), "{name}: {found}");
    }
}

#[test]
fn constant_errors_have_the_spread_of_their_sizes() {
    let error = ImuError::parse(&format!("{ALL},{MORE}")).unwrap();
    let units: Vec<_> = (0..2000)
        .map(|seed| *GyroModel::new(&error, Rate, seed).unwrap().constants())
        .collect();
    let range = error.range.unwrap();
    type Drawn = strapd_attitude::noise::sensor_error::ConstantErrors;
    type Value = fn(&Drawn) -> f64;
    let values: [(&str, f64, Value); 10] = [
        ("bias", error.turn_on_bias, |u| u.bias.y),
        ("scale", error.scale, |u| u.sensitivity[(2, 2)] - 1.0),
        ("misalignment", error.misalignment, |u| {
            u.sensitivity[(0, 1)]
        }),
        ("g", error.g_sensitivity, |u| u.g_sensitivity[(1, 2)]),
        ("temperature", error.temperature_coefficient, |u| {
            u.temperature_coefficient.x
        }),
        ("w |w|", error.nonlinearity / range, |u| u.nonlinear2.z),
        ("w^3", error.nonlinearity3 / range.powi(2), |u| {
            u.nonlinear3.x
        }),
        ("accelerometer", error.accel_bias, |u| u.accel_bias.x),
        ("its scale", error.accel_scale, |u| {
            u.accel_sensitivity[(1, 1)] - 1.0
        }),
        ("its axes", error.accel_misalignment, |u| {
            u.accel_sensitivity[(2, 0)]
        }),
    ];
    for (name, size, of) in values {
        let rms = (units.iter().map(|u| of(u).powi(2)).sum::<f64>() / 2000.0).sqrt();
        // Five standard errors of a deviation from 2000 draws.
        assert!(
            (rms / size - 1.0).abs() < 5.0 / f64::sqrt(4000.0),
            "{name}: {rms} {size}"
        );
    }
}
