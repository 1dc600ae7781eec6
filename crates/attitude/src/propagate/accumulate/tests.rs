use super::*;
use crate::lanes::Triple;
use crate::propagate::turn::Turn;

#[path = "double.rs"]
#[allow(dead_code, unreachable_pub, reason = "shared with the accuracy tests")]
mod double;

/// Worst component after `n` turns of 0.01 rad about random axes, against the double-double product of
/// the same turns.
fn drift(n: u32) -> f64 {
    use double::Double;
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut accumulator = Accumulator::new([1.0, 0.0, 0.0, 0.0]);
    let mut truth = [1.0, 0.0, 0.0, 0.0].map(Double::from);
    for _ in 0..n {
        let axis: [f64; 3] = std::array::from_fn(|_| rng.random_range(-0.01..0.01));
        let turn = Turn::exp(Triple::new(axis[0], axis[1], axis[2])).parts();
        accumulator.turn(turn);
        let [w, x, y, z] = truth;
        let [c, i, j, k] = turn.map(Double::from);
        let c = c + Double::from(1.0);
        truth = [
            w * c - x * i - y * j - z * k,
            w * i + x * c + y * k - z * j,
            w * j - x * k + y * c + z * i,
            w * k + x * j - y * i + z * c,
        ];
    }
    let norm = truth
        .iter()
        .fold(Double::ZERO, |sum, c| sum + *c * *c)
        .sqrt();
    let found = accumulator.attitude();
    (0..4)
        .map(|i| (Double::from(found[i]) - truth[i] / norm).value().abs())
        .fold(0.0, f64::max)
}

#[test]
fn a_million_random_turns_stay_within_the_rounding_of_the_output() {
    // docs/theory/attitude.md 5: 5.5e-16 rad after 1e6, where a plain quaternion has 6e-14.
    let error = 2.0 * drift(1_000_000);
    assert!(error < 2e-15, "{error:e} rad");
}

#[test]
#[ignore = "ten seconds; the gate of docs/theory/attitude.md 7"]
fn a_hundred_million_random_turns_stay_below_5e_14_rad() {
    let error = 2.0 * drift(100_000_000);
    assert!(error < 5e-14, "{error:e} rad");
    assert!(error > 0.0);
}

/// Sine and cosine of half the angle of `n` turns of `step` about x.
fn turned(n: u32, step: f64) -> [f64; 4] {
    let mut accumulator = Accumulator::new([1.0, 0.0, 0.0, 0.0]);
    let turn = Turn::exp(Triple::new(step, 0.0, 0.0)).parts();
    for _ in 0..n {
        accumulator.turn(turn);
    }
    accumulator.attitude()
}

#[test]
fn a_million_tiny_turns_keep_every_digit() {
    // The Earth's rotation in a millisecond. Without compensation the same loop is off by 1e-12;
    // with it, by the rounding of one step, n |phi| 1e-16 = 7e-18 rad, and of the output, 1e-16.
    let step = 7.29e-8;
    let [w, x, y, z] = turned(1_000_000, step);
    let half = 0.5 * step * 1e6;
    assert!((x - half.sin()).abs() < 2e-17, "{:e}", x - half.sin());
    assert!((w - half.cos()).abs() < 2e-16 && y == 0.0 && z == 0.0);
}

#[test]
fn increments_turn_about_body_axes() {
    // A quarter about x, then a quarter about the body's new z: nav's -y.
    let quarter = |v: [f64; 3]| Turn::exp(Triple::new(v[0], v[1], v[2])).parts();
    let right = std::f64::consts::FRAC_PI_2;
    let mut accumulator = Accumulator::new([1.0, 0.0, 0.0, 0.0]);
    accumulator.turn(quarter([right, 0.0, 0.0]));
    accumulator.turn(quarter([0.0, 0.0, right]));
    let q = accumulator.attitude();
    for (found, expected) in q.into_iter().zip([0.5, 0.5, -0.5, 0.5]) {
        // One rounding.
        assert!((found - expected).abs() < 2e-16, "{q:?}");
    }
}

#[test]
fn a_restart_keeps_to_its_side_of_the_sphere() {
    let mut accumulator = Accumulator::new([-0.6, 0.0, 0.8, 0.0]);
    accumulator.restart([1.0, 0.0, 0.0, 0.0]);
    assert_eq!(accumulator.attitude(), [-1.0, 0.0, 0.0, 0.0]);
}
