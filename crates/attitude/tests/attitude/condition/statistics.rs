//! Figures that `info` prints, from streams whose properties are known.

use super::{STEP, T0, at, sample};
use strapd_attitude::condition::Clock;
use strapd_attitude::condition::quality::{Quality, QualitySummary};
use strapd_attitude::record::{Nanos, RawSample};

fn summary(raw: &[RawSample]) -> QualitySummary {
    let mut quality = Quality::new(Clock::Header);
    raw.iter().for_each(|r| quality.push(r));
    quality.summary()
}

#[test]
fn rate_jitter_and_gaps_are_measured() {
    let jitter = |n: i64| (n * 7919) % 20_001 - 10_000;
    let raw: Vec<RawSample> = (0..5000)
        .filter(|n| n % 500 != 250)
        .map(|n| at(T0 + n * STEP + jitter(n), n))
        .collect();
    let found = summary(&raw);
    let spacing = found.spacing.unwrap();
    // Bins are 3 % wide, but return the mean of what is in them.
    assert!((spacing.rate_hz - 200.0).abs() < 0.5, "{spacing:?}");
    assert_eq!((found.gaps, found.missing), (10, 10));
    assert!((found.longest_gap_secs - 0.010).abs() < 2.1e-5);
    // Differences of two stamps within +-10 us are within +-20 us.
    assert!(spacing.jitter_max_secs <= 20.1e-6 && spacing.jitter_max_secs > 10e-6);
    assert!(spacing.jitter_p50_secs < spacing.jitter_p99_secs);
    assert!(spacing.jitter_p99_secs <= spacing.jitter_max_secs);
}

#[test]
fn a_short_recording_has_statistics_too() {
    let raw: Vec<RawSample> = (0..5).map(sample).collect();
    let found = summary(&raw);
    assert!((found.spacing.unwrap().rate_hz - 200.0).abs() < 1e-9);
    assert_eq!(found.count, 5);
    assert_eq!(summary(&[]).spacing, None);
    assert_eq!(summary(&raw[..1]).duration_secs, 0.0);
}

#[test]
fn repeats_collisions_and_disorder_are_told_apart() {
    let mut raw: Vec<RawSample> = (0..300).map(sample).collect();
    raw[200].header = raw[199].header;
    raw.swap(150, 151);
    raw.insert(100, raw[99]);
    let found = summary(&raw);
    assert_eq!((found.duplicates, found.collisions), (2, 1));
    assert_eq!(found.disorder, 1);
    assert_eq!(found.missing, 0);
    assert_eq!(found.repeated_rows, 1);
}

#[test]
fn offset_and_drift_between_the_clocks_are_fitted() {
    // The header clock is 2 ms behind and runs 50 ppm fast.
    let raw: Vec<RawSample> = (0..20_000)
        .map(|n| RawSample {
            header: Some(Nanos(T0 + n * STEP - 2_000_000 + n * 250)),
            log: Nanos(T0 + n * STEP),
            ..sample(n)
        })
        .collect();
    let offset = summary(&raw).offset.unwrap();
    // Exact in integers but for the rounding of sums over 20,000 samples.
    assert!((offset.drift_ppm - 50.0).abs() < 1e-6, "{offset:?}");
    assert!((offset.min_secs + 0.002).abs() < 1e-12);
    assert!((offset.max_secs - (-0.002 + 19_999.0 * 250e-9)).abs() < 1e-12);
    assert!((offset.mean_secs - (-0.002 + 9_999.5 * 250e-9)).abs() < 1e-9);
}

#[test]
fn bad_rows_are_counted_and_kept_out_of_the_statistics() {
    let mut raw: Vec<RawSample> = (0..100).map(sample).collect();
    raw[10].gyro = Some([f64::NAN, 1e9, 0.0]);
    raw[11].gyro = None;
    raw[12].gyro = Some([0.0; 3]);
    raw[13].header = None;
    raw[14].accel = Some([f64::INFINITY, 0.0, 0.0]);
    let found = summary(&raw);
    assert_eq!(found.not_finite, 1);
    assert_eq!(found.no_gyro, 1);
    assert_eq!(found.zero_rows, 1);
    assert_eq!(found.no_stamp, 1);
    assert_eq!((found.with_accel, found.accel_not_finite), (100, 1));
    assert_eq!(found.axes[0].max, 0.099);
    assert_eq!(found.axes[1].max, 0.5);
    assert_eq!(found.axes[2].min, -0.25);
}
