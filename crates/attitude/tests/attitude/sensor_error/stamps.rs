//! Instants at which samples are taken, their stamps, and which are lost.

use strapd_attitude::noise::sensor_error::{StampError, StampModel, Tick};
use strapd_attitude::record::Nanos;

const START: i64 = 1_700_000_000_000_000_000;

fn ticks(error: &StampError, n: usize) -> Vec<Tick> {
    let mut model = StampModel::new(error, Nanos(START), 200.0, 4).unwrap();
    (0..n).map(|_| model.tick()).collect()
}

#[test]
fn without_errors_the_grid_is_exact() {
    let third = StampModel::new(&StampError::default(), Nanos(0), 3.0, 0).unwrap();
    let mut third = third;
    let found: Vec<i64> = (0..4).map(|_| third.tick().instant.0).collect();
    assert_eq!(found, [0, 333_333_333, 666_666_667, 1_000_000_000]);
    for (i, tick) in ticks(&StampError::default(), 1000).iter().enumerate() {
        assert_eq!(tick.instant, Nanos(START + 5_000_000 * i as i64));
        assert_eq!(tick.stamp, tick.instant);
        assert!(!tick.dropped);
    }
}

#[test]
fn sampling_jitter_moves_instants_and_stamp_jitter_only_stamps() {
    let sampled = ticks(
        &StampError {
            sampling_jitter: 0.4,
            ..StampError::default()
        },
        20_000,
    );
    let off: Vec<f64> = sampled
        .iter()
        .enumerate()
        .map(|(i, t)| (t.instant.0 - START - 5_000_000 * i as i64) as f64 / 5e6)
        .collect();
    assert!(off.iter().all(|v| v.abs() <= 0.4 + 1e-6));
    // Uniform: variance 0.4^2 / 3.
    let variance = off.iter().map(|v| v * v).sum::<f64>() / 20_000.0;
    assert!((variance / (0.16 / 3.0) - 1.0).abs() < 0.04, "{variance}");
    assert!(sampled.iter().all(|t| t.stamp == t.instant));
    assert!(sampled.windows(2).all(|w| w[0].instant < w[1].instant));

    let wrong = ticks(
        &StampError {
            stamp_jitter: 0.05,
            ..StampError::default()
        },
        20_000,
    );
    let off = |t: &Tick| (t.stamp.0 - t.instant.0) as f64 / 5e6;
    let variance = wrong.iter().map(|t| off(t).powi(2)).sum::<f64>() / 20_000.0;
    assert!((variance.sqrt() / 0.05 - 1.0).abs() < 0.03, "{variance}");
    assert!(
        wrong
            .iter()
            .enumerate()
            .all(|(i, t)| t.instant.0 == START + 5_000_000 * i as i64)
    );
}

#[test]
fn a_fast_clock_gains_and_an_offset_stays() {
    let error = StampError {
        offset_nanos: -7_000,
        drift_ppm: 20.0,
        ..StampError::default()
    };
    let last = ticks(&error, 200_001).pop().unwrap();
    // 1000 s at 20 ppm are 20 ms.
    assert_eq!(last.stamp.0 - last.instant.0, 20_000_000 - 7_000);
}

#[test]
fn losses_have_their_share_and_their_length() {
    for (share, length) in [(0.01, 1.0), (0.05, 4.0), (0.3, 10.0)] {
        let error = StampError {
            drop_probability: share,
            burst_length: length,
            ..StampError::default()
        };
        let lost: Vec<bool> = ticks(&error, 400_000).iter().map(|t| t.dropped).collect();
        let count = lost.iter().filter(|d| **d).count() as f64;
        let bursts = lost.windows(2).filter(|w| !w[0] && w[1]).count() as f64;
        assert!(
            (count / 400_000.0 / share - 1.0).abs() < 0.06,
            "{share}: {count}"
        );
        assert!(
            (count / bursts / length - 1.0).abs() < 0.06,
            "{length}: {}",
            count / bursts
        );
    }
}

#[test]
fn impossible_rates_are_refused() {
    for rate in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
        assert!(
            StampModel::new(&StampError::default(), Nanos(0), rate, 0).is_err(),
            "{rate}"
        );
    }
}
