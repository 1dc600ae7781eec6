//! The estimator itself: its formula, gaps, bounds, refusals.

use super::{at_rest, curve};
use nalgebra::Vector3;
use strapd_attitude::noise::allan::{AllanError, AngleRecord, cluster_sizes, deviation, fit};
use strapd_attitude::noise::sensor_error::ImuError;
use strapd_attitude::record::SampleKind::Rate;

/// Uneven numbers without a generator.
fn wiggle(n: usize) -> Vec<f64> {
    (0..n).map(|i| ((i * i) as f64 * 0.37).sin()).collect()
}

/// The definition, term by term: IEEE Std 952-1997, C.4, from averages of the rate.
fn by_definition(rates: &[f64], steps: usize) -> f64 {
    let n = rates.len();
    let mean = |from: usize| rates[from..from + steps].iter().sum::<f64>() / steps as f64;
    let places = n + 1 - 2 * steps;
    let sum: f64 = (0..places)
        .map(|k| (mean(k + steps) - mean(k)).powi(2))
        .sum();
    (sum / (2.0 * places as f64)).sqrt()
}

fn record(rates: &[f64]) -> AngleRecord {
    let mut record = AngleRecord::new(usize::MAX);
    for r in rates {
        record.push(&Vector3::new(*r, 2.0 * r + 1e3, 0.0));
    }
    record
}

#[test]
fn angles_give_what_averages_of_rates_give() {
    let rates = wiggle(200);
    let record = record(&rates);
    let points = deviation(&record.pieces(0), 1.0, &cluster_sizes(200, 8)).unwrap();
    assert_eq!(points.last().unwrap().steps, 18);
    for p in &points {
        let expected = by_definition(&rates, p.steps);
        assert!((p.sigma / expected - 1.0).abs() < 1e-12, "{}", p.steps);
    }
    // A constant rate is not seen, its scale is.
    let scaled = deviation(&record.pieces(1), 1.0, &cluster_sizes(200, 8)).unwrap();
    for (p, q) in points.iter().zip(&scaled) {
        assert!((q.sigma / p.sigma - 2.0).abs() < 1e-9);
    }
    assert!(deviation(&record.pieces(2), 1.0, &[1]).unwrap()[0].sigma == 0.0);
}

#[test]
fn no_cluster_reaches_across_a_gap() {
    let (a, b) = (wiggle(300), wiggle(120));
    let mut both = AngleRecord::new(usize::MAX);
    a.iter().for_each(|r| both.push(&Vector3::repeat(*r)));
    both.split();
    both.split();
    // A jump of the angle, and of the rate, that would show.
    b.iter()
        .for_each(|r| both.push(&Vector3::repeat(*r + 50.0)));
    assert_eq!(both.pieces(0).len(), 2);
    for p in deviation(&both.pieces(0), 1.0, &cluster_sizes(300, 6)).unwrap() {
        let (wa, wb) = (
            (301 - 2 * p.steps) as f64,
            121usize.saturating_sub(2 * p.steps) as f64,
        );
        let part = |rates: &[f64], w: f64| {
            if w > 0.0 {
                w * by_definition(rates, p.steps).powi(2)
            } else {
                0.0
            }
        };
        let expected = ((part(&a, wa) + part(&b, wb)) / (wa + wb)).sqrt();
        assert!((p.sigma / expected - 1.0).abs() < 1e-9, "{}", p.steps);
    }
}

#[test]
fn a_record_beyond_its_capacity_keeps_its_long_clusters() {
    let rates = wiggle(10_000);
    let whole = record(&rates);
    let mut thin = AngleRecord::new(1000);
    rates.iter().for_each(|r| thin.push(&Vector3::repeat(*r)));
    let stride = thin.stride();
    assert!(stride == 16, "{stride}");
    assert!(thin.pieces(0)[0].len() <= 1000);
    assert_eq!(thin.count(), 10_000);
    let sizes: Vec<usize> = cluster_sizes(60, 6);
    let exact: Vec<usize> = sizes.iter().map(|m| m * stride).collect();
    let a = deviation(&thin.pieces(0), stride as f64, &sizes).unwrap();
    let b = deviation(&whole.pieces(0), 1.0, &exact).unwrap();
    for (a, b) in a.iter().zip(&b) {
        assert_eq!(a.tau, b.tau);
        // Fewer places, the same clusters.
        assert!(
            (a.sigma / b.sigma - 1.0).abs() < 0.3,
            "{} {}",
            a.sigma,
            b.sigma
        );
    }
}

#[test]
fn nothing_but_gaps_stays_small_and_ends() {
    let mut record = AngleRecord::new(100);
    for i in 0..100_000 {
        record.push(&Vector3::repeat(f64::from(i % 7)));
        record.split();
    }
    assert!(record.pieces(0).iter().map(|p| p.len()).sum::<usize>() <= 100);
    let refused = deviation(&record.pieces(0), 1.0, &[1]);
    assert!(matches!(refused, Err(AllanError::TooShort { .. })));
}

#[test]
fn too_short_a_record_and_no_interval_are_refused() {
    let angles = wiggle(9);
    assert_eq!(
        deviation(&[&angles], 1.0, &[1]),
        Err(AllanError::TooShort { intervals: 8 })
    );
    assert_eq!(
        deviation(&[], 1.0, &[1]),
        Err(AllanError::TooShort { intervals: 0 })
    );
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            deviation(&[&wiggle(99)], bad, &[1]),
            Err(AllanError::Interval { .. })
        ));
    }
    assert!(deviation(&[&wiggle(99)], 1.0, &[0, 50]).unwrap().is_empty());
}

#[test]
fn cluster_sizes_rise_and_are_each_there_once() {
    let sizes = cluster_sizes(1000, 12);
    assert_eq!(sizes[..5], [1, 2, 3, 4, 5]);
    assert!(sizes.windows(2).all(|w| w[0] < w[1]));
    assert_eq!(sizes.last(), Some(&1000));
    assert!(cluster_sizes(0, 12).is_empty());
}

#[test]
fn a_stuck_axis_has_no_fit() {
    let still = vec![0.0; 1000];
    assert!(fit(&deviation(&[&still], 1.0, &cluster_sizes(100, 12)).unwrap()).is_none());
}

#[test]
fn what_a_short_record_does_not_show_is_not_seen_but_bounded() {
    // A minute of a tactical gyro: the floor is reached after ten minutes.
    let error = ImuError::parse("arw=0.15,bias-instability=0.5").unwrap();
    let record = at_rest(&error, Rate, 10_000_000, 6000, 1, 0.0);
    let got = fit(&curve(&record, 0, 10_000_000)).unwrap();
    assert!(got.bias_instability.value.is_none());
    assert!(got.bias_instability.at_most > error.bias_instability);
    assert!(got.rrw.value.is_none() && got.rate_ramp.value.is_none());
    let n = got.arw.value.unwrap();
    assert!((n / error.arw - 1.0).abs() < 0.05, "{n}");
    assert!((n - error.arw).abs() < 4.0 * got.arw.error);
}
