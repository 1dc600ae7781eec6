#![allow(clippy::unwrap_used)]

use super::*;
use crate::propagate::shared_data;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn direction(rng: &mut ChaCha8Rng) -> Triple<1> {
    loop {
        let v = Triple::new(
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0),
        );
        let n = v.norm();
        if (0.1..1.0).contains(&n) {
            return v * (1.0 / n);
        }
    }
}

/// Moments of sizes spread over decades, some absent: now one shape of bracket counts, now another.
fn moments(rng: &mut ChaCha8Rng, largest: f64) -> Moments<1> {
    let mut m = Moments {
        live: MOMENTS,
        ..Moments::ZERO
    };
    let top = rng.random_range(1..MOMENTS);
    for j in 0..=top {
        if j == 0 || rng.random_range(0..3) > 0 {
            m.b[j] = direction(rng) * (largest * 10f64.powf(rng.random_range(-3.0..0.0)));
        }
    }
    m
}

/// The angle between two turns.
fn between(a: Turn<1>, b: Turn<1>) -> f64 {
    a.inverse().then(b).angle()
}

fn golden() -> Option<serde_json::Value> {
    let path = shared_data::shared("golden/attitude.json")?;
    Some(serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap())
}

fn number(value: &serde_json::Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| value.as_str().unwrap().parse().unwrap())
}

fn vector(value: &serde_json::Value) -> Triple<1> {
    Triple::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_order_equals_the_golden_vectors() {
    let Some(golden) = golden() else { return };
    let cases = golden["magnus"].as_array().unwrap();
    assert_eq!(cases.len(), 6);
    for case in cases {
        let mut m = Moments {
            live: 6,
            ..Moments::ZERO
        };
        let b = case["b_rowmajor_6x3"].as_array().unwrap();
        for j in 0..6 {
            m.b[j] = Triple::new(
                number(&b[3 * j]),
                number(&b[3 * j + 1]),
                number(&b[3 * j + 2]),
            );
        }
        let compressed = m.b[0] + coning_sum(&m);
        for (name, phi) in [
            ("M4", order4(&m)),
            ("M4C", compressed),
            ("M6", order6(&m)),
            ("M8", order8(&m)),
        ] {
            // The file is long double; one rounding of the inputs and some thirty sums of terms of
            // half a radian at most leave 2e-16.
            let error = (phi - vector(&case[name])).norm();
            assert!(error < 2e-16, "{name}: {error:e}");
        }
        let q = &case["q_exact_wxyz"];
        let golden = Turn::from_parts(
            number(&q[0]),
            Triple::new(number(&q[1]), number(&q[2]), number(&q[3])),
        );
        // Two roundings of a unit quaternion.
        let error = between(series::turn(&m), golden);
        assert!(error < 4e-16, "series: {error:e}");
        let error = between(turn(&m, Order::Exact), golden);
        assert!(error < 5e-16, "exact: {error:e}");
    }
}

#[test]
fn the_bound_on_what_order_8_leaves_out_holds() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut tightest = 0.0_f64;
    for _ in 0..100_000 {
        let m = moments(&mut rng, 0.3);
        let error = between(Turn::exp(order8(&m)), series::turn(&m));
        let bound = left_out(&m).0[0];
        // Both sides of the comparison are rounded to a few 1e-16 of at most 3 rad.
        assert!(error <= bound + 3e-15, "{error:e} > {bound:e}: {m:?}");
        if error > 1e-12 {
            tightest = tightest.max(error / bound);
        }
    }
    // A bound a thousand times too large would hold as well, and cost speed.
    assert!(tightest > 0.05, "the bound has become slack: {tightest}");
}

#[test]
fn exact_is_as_exact_as_it_says() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut branches = [0; 3];
    for _ in 0..50_000 {
        let largest = 10f64.powf(rng.random_range(-3.5..0.3));
        let m = moments(&mut rng, largest);
        let error = between(turn(&m, Order::Exact), series::turn(&m));
        let allowed = allowed(&m).0[0];
        let branch = if left_out(&m).0[0] <= allowed {
            0
        } else if divided(&m, allowed, 3).is_some() {
            1
        } else {
            2
        };
        branches[branch] += 1;
        // Beyond the promise: rounding, of terms up to the size of the turn.
        let promised = allowed + 1e-15 * largest;
        assert!(
            error <= promised,
            "{error:e} > {promised:e}, branch {branch}"
        );
    }
    // Whole intervals, divided ones and the series have all been swept.
    assert!(branches.iter().all(|&n| n > 3_000), "{branches:?}");
}

#[test]
fn halves_of_an_interval_turn_as_far_as_the_whole() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for _ in 0..2_000 {
        let m = moments(&mut rng, 0.5);
        let (left, right) = halves(&m);
        let error = between(
            series::turn(&left).then(series::turn(&right)),
            series::turn(&m),
        );
        // Sums of a few dozen terms of up to a radian.
        assert!(error < 1e-15, "{error:e}");
        let sum = left.b[0] + right.b[0] - m.b[0];
        assert!(sum.norm() < 1e-16, "the delta angles do not add up");
    }
}

#[test]
fn local_errors_fall_with_the_third_fifth_seventh_and_ninth_power() {
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    for (order, expected) in [
        (Order::M2, 3.0),
        (Order::M4, 5.0),
        (Order::M6, 7.0),
        (Order::M8, 9.0),
    ] {
        let (mut coarse, mut fine) = (0.0_f64, 0.0_f64);
        for _ in 0..200 {
            let shape: [Triple<1>; MOMENTS] = std::array::from_fn(|_| direction(&mut rng));
            for (h, worst) in [(0.2_f64, &mut coarse), (0.1, &mut fine)] {
                let mut m = Moments {
                    b: shape,
                    live: MOMENTS,
                    ..Moments::ZERO
                };
                for j in 0..MOMENTS {
                    m.b[j] = shape[j] * h.powi(j as i32 + 1);
                }
                *worst = worst.max(between(turn(&m, order), series::turn(&m)));
            }
        }
        let found = (coarse / fine).log2();
        // Three tenths: the next order still shows at a fifth of a radian per interval.
        assert!((found - expected).abs() < 0.3, "{order:?}: {found}");
    }
}

#[test]
fn a_constant_rate_turns_by_its_angle_whatever_the_order() {
    for order in [Order::M2, Order::M4, Order::M6, Order::M8, Order::Exact] {
        for angle in [0.0, 1e-12, 0.1, 0.7, 3.0, 6.0, 50.0] {
            let mut m = Moments {
                live: MOMENTS,
                ..Moments::ZERO
            };
            m.b[0] = Triple::new(0.6 * angle, 0.0, -0.8 * angle);
            let [c, x, y, z] = turn(&m, order).parts();
            let half = 0.5 * angle;
            // 0.6^2 + 0.8^2 rounds, and the sine of 25 magnifies that by 25.
            let tolerance = 3e-16 * (1.0 + angle);
            assert!(
                (1.0 + c - half.cos()).abs() < tolerance,
                "{order:?} {angle}"
            );
            assert!((x - 0.6 * half.sin()).abs() < tolerance && y == 0.0);
            assert!((z + 0.8 * half.sin()).abs() < tolerance);
        }
    }
}
