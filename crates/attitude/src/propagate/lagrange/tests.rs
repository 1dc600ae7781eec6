#![allow(clippy::unwrap_used)]

use super::*;
use crate::propagate::shared_data;
use crate::propagate::uniform::{Centred, Skewed};

/// Range of all points, of the one lane.
fn whole(points: usize) -> [Range<usize>; 1] {
    std::array::from_fn(|_| 0..points)
}

fn vectors(value: &serde_json::Value) -> Vec<Triple<1>> {
    let rows = value.as_array().unwrap();
    rows.iter()
        .map(|row| {
            let number = |i: usize| row[i].as_f64().unwrap();
            Triple::new(number(0), number(1), number(2))
        })
        .collect()
}

fn assert_equal(found: &Moments<1>, golden: &[Triple<1>], h: f64) {
    assert_eq!(found.live, golden.len());
    for (j, golden) in golden.iter().enumerate() {
        let error = (found.b[j] - *golden).norm();
        // Rates of 5 rad/s are rounded to 4e-16, and moments of high index are small differences of
        // them: ten roundings of what an interval turns.
        assert!(error < 5e-15 * h, "b_{j}: {error:e}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn moments_equal_the_golden_ones() {
    let Some(path) = shared_data::shared("golden/attitude.json") else {
        return;
    };
    let golden: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let golden = &golden["moments"];
    let t = golden["t"].as_array().unwrap();
    let t: Vec<f64> = t.iter().map(|t| t.as_f64().unwrap()).collect();
    // Interval 3 -> 4 throughout.
    let h = t[4] - t[3];
    let x: Vec<Lanes<1>> = t
        .iter()
        .map(|t_i| Lanes([((t_i - t[3]) + (t_i - t[4])) / h]))
        .collect();

    let mut rates = vectors(&golden["w"])[..8].to_vec();
    let reference = (rates[3] + rates[4]) * 0.5;
    let (found, _) = from_rates::<1, POINTS>(
        &x[..8],
        &mut rates,
        reference,
        Lanes([h]),
        &whole(8),
        &Quadrature::new(8),
    );
    let expected = vectors(&golden["rates_p8_window_0_7_interval_3_4"]);
    assert_equal(&found, &expected, h);

    let increments = &vectors(&golden["dtheta"])[..7];
    let (found, _) =
        from_increments::<1, POINTS>(&x[..8], increments, 3, &whole(8), &Quadrature::new(8));
    // Seven increments make a rate of degree six: what is left of b_7 is rounding.
    assert!(found.b[7].norm() < 1e-17, "b_7: {:e}", found.b[7].norm());
    let expected = vectors(&golden["incs_p7_window_0_6_interval_3_4"]);
    assert_equal(&found, &expected, h);
}

/// A polynomial of degree `n` in x, and its Legendre moments over -1..1 for h = 1, by construction.
fn polynomial(n: usize, x: f64) -> Triple<1> {
    let (p, _) = legendre(x);
    let sum = |f: fn(usize) -> f64| (0..=n).map(|j| f(j) * p[j]).sum();
    Triple::new(
        sum(|_| 1.0),
        sum(|j| j as f64),
        sum(|j| 1.0 / (j + 1) as f64),
    )
}

#[test]
fn a_polynomial_rate_gives_its_own_coefficients_from_any_stamps() {
    for points in 2..=9 {
        let x: Vec<Lanes<1>> = (0..points)
            .map(|i| Lanes([2.3 * i as f64 - points as f64 + (i * i % 3) as f64 * 0.4]))
            .collect();
        let mut rates: Vec<Triple<1>> = x.iter().map(|x| polynomial(points - 1, x.0[0])).collect();
        let size = rates.iter().map(|r| r.norm()).fold(0.0, f64::max);
        let quadrature = Quadrature::new(points);
        let (m, _) = from_rates::<1, POINTS>(
            &x,
            &mut rates,
            Triple::ZERO,
            Lanes([1.0]),
            &whole(x.len()),
            &quadrature,
        );
        for j in 0..points {
            let expected = Triple::new(1.0, j as f64, 1.0 / (j + 1) as f64);
            let error = (m.b[j] - expected).norm();
            // Roundings of the largest sample, which lies far outside the interval.
            assert!(error < 1e-14 * size, "{points} points, b_{j}: {error:e}");
        }
    }
}

#[test]
fn a_constant_rate_has_no_other_moment_whatever_the_stamps() {
    let x: Vec<Lanes<1>> = (0..16)
        .map(|i| Lanes([1.7 * i as f64 - 13.0 + f64::from(i % 3)]))
        .collect();
    let rate = Triple::new(125.66, -0.1, 3.3);
    let mut rates = vec![rate; 16];
    let (m, _) = from_rates::<1, POINTS>(
        &x,
        &mut rates,
        rate,
        Lanes([0.25]),
        &whole(x.len()),
        &Quadrature::new(16),
    );
    assert_eq!(m.b[0], rate * 0.25);
    assert!(m.b[1..].iter().all(|b| b.norm() == 0.0));
}

#[test]
fn tables_for_equal_spacings_equal_the_general_path() {
    let samples: Vec<f64> = (0..24)
        .map(|i| (0.9 * f64::from(i)).sin() + 0.1 * f64::from(i % 5))
        .collect();
    let all = |n: usize| -> Vec<Triple<1>> {
        (0..n)
            .map(|i| Triple::new(samples[i], samples[23 - i], 0.3))
            .collect()
    };
    for window in 2..=24 {
        let axis = |f: fn(Triple<1>) -> f64| all(window).into_iter().map(f).collect::<Vec<f64>>();
        let (ax, ay, az) = (axis(|v| v.x.0[0]), axis(|v| v.y.0[0]), axis(|v| v.z.0[0]));
        for place in 1..window {
            let x: Vec<Lanes<1>> = (0..window)
                .map(|i| Lanes([2.0 * i as f64 - 2.0 * place as f64 + 1.0]))
                .collect();
            let mut rates = all(window);
            let reference = (rates[place - 1] + rates[place]) * 0.5;
            let h = Lanes([0.01]);
            let quadrature = Quadrature::new(window);
            let (general, gain) = from_rates::<1, POINTS>(
                &x,
                &mut rates,
                reference,
                h,
                &[inner(window, place, false)],
                &quadrature,
            );
            let skewed = Skewed::for_rates(window, place);
            let mut tables = vec![skewed.moments([&ax, &ay, &az], h)];
            assert_eq!(skewed.gain, gain.0[0]);
            if 2 * place == window {
                tables.push(Centred::for_rates(window).moments([&ax, &ay, &az], h));
            }
            for table in tables {
                assert_eq!(table.live, general.live);
                for j in 0..table.live {
                    let error = (table.b[j] - general.b[j]).norm();
                    // Rounding of samples of size one, times what the window amplifies them by.
                    let amplified = 1e-15 * 0.01 * (1.0 + gain.0[0].sqrt());
                    assert!(
                        error < 4.0 * amplified,
                        "{window}, {place}, b_{j}: {error:e}"
                    );
                }
            }
        }
        for own in 0..window {
            let x: Vec<Lanes<1>> = (0..=window)
                .map(|i| Lanes([2.0 * i as f64 - 2.0 * own as f64 - 1.0]))
                .collect();
            let (general, gain) = from_increments::<1, POINTS>(
                &x,
                &all(window),
                own,
                &[inner(window, own, true)],
                &Quadrature::new(window + 1),
            );
            let one = Lanes([1.0]);
            let skewed = Skewed::for_increments(window, own);
            let mut tables = vec![skewed.moments([&ax, &ay, &az], one)];
            if 2 * own + 1 == window {
                tables.push(Centred::for_increments(window).moments([&ax, &ay, &az], one));
            }
            for table in tables {
                for j in 0..table.live {
                    let error = (table.b[j] - general.b[j]).norm();
                    // Sums of two dozen increments of size one.
                    let amplified = 1e-14 * (1.0 + gain.0[0].sqrt());
                    assert!(error < 4.0 * amplified, "{window}, {own}, b_{j}: {error:e}");
                }
            }
        }
    }
}
