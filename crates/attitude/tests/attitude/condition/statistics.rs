//! Figures that `info` prints, from streams whose properties are known.

use super::{STEP, T0, at, sample};
use strapd_attitude::condition::Clock;
use strapd_attitude::condition::quality::{Advice, GravityAxis, Quality, QualitySummary};
use strapd_attitude::record::{Nanos, RawSample};

fn summary(raw: &[RawSample]) -> QualitySummary {
    let mut quality = Quality::new(Clock::Header);
    raw.iter().for_each(|r| quality.push(r));
    quality.summary()
}

/// Still, with a little noise that never repeats, for `secs` at 200 Hz.
fn still(secs: i64, accel: [f64; 3]) -> Vec<RawSample> {
    (0..secs * 200)
        .map(|n| {
            let noise = |k: i64| ((n * k) % 1009 - 504) as f64 * 1e-6;
            RawSample {
                gyro: Some([noise(7919), noise(104_729), noise(1_299_709)]),
                accel: Some(accel),
                ..sample(n)
            }
        })
        .collect()
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
    assert!(
        !summary(&raw)
            .advice
            .iter()
            .any(|a| matches!(a, Advice::ClocksDrift { .. }))
    );
}

#[test]
fn gravity_tells_axis_sign_and_unit() {
    for (accel, axis, positive, advice) in [
        ([0.1, 0.2, 9.8], 2, true, None),
        ([0.1, 0.2, -9.8], 2, false, Some(Advice::LooksLikeFrd)),
        (
            [9.8, 0.0, 0.3],
            0,
            true,
            Some(Advice::MountedOnSide {
                gravity: GravityAxis {
                    axis: 0,
                    positive: true,
                },
            }),
        ),
        (
            [0.0, 0.0, 1.0],
            2,
            true,
            Some(Advice::AccelNotInMetres {
                magnitude: 1.0,
                unit: "g",
            }),
        ),
        (
            [0.0, 0.0, 1000.0],
            2,
            true,
            Some(Advice::AccelNotInMetres {
                magnitude: 1000.0,
                unit: "mg",
            }),
        ),
    ] {
        let found = summary(&still(10, accel));
        assert_eq!(found.gravity, Some(GravityAxis { axis, positive }));
        assert_eq!(found.advice.first().copied(), advice, "{accel:?}");
        assert!(found.advice.len() <= 1, "{:?}", found.advice);
    }
    let tilted = summary(&still(10, [5.7, 5.6, 5.7]));
    assert_eq!(tilted.gravity, None);
}

#[test]
fn most_forces_of_one_g_tell_the_unit_where_nothing_is_still_and_motion_alone_does_not() {
    // Turned and shaken about: gravity and 0.3 of it, in every direction, at a rate that is never even.
    let shaken = |gravity: f64, shake: f64| -> Vec<RawSample> {
        let at = |n: i64| {
            let t = n as f64 * 0.01;
            let (a, b) = ((2.0 * t).sin(), (1.3 * t).cos());
            let up = nalgebra::Vector3::new(a, b, 0.5 - a * b).normalize();
            let other =
                nalgebra::Vector3::new((31.0 * t).sin(), (37.0 * t).cos(), (41.0 * t).sin());
            RawSample {
                gyro: Some([(9.0 * t).sin(), (7.0 * t).cos(), 1.0]),
                accel: Some((up * gravity + other * shake).into()),
                ..sample(n)
            }
        };
        (0..2000).map(at).collect()
    };
    let unit = |raw: &[RawSample]| {
        let advice = summary(raw).advice;
        assert!(advice.contains(&Advice::NeverStill), "{advice:?}");
        advice.iter().find_map(|a| match a {
            Advice::AccelMostlyOneG { unit, share } if (0.5..=1.0).contains(share) => Some(*unit),
            _ => None,
        })
    };
    assert_eq!(unit(&shaken(1.0, 0.1)), Some("g"));
    assert_eq!(unit(&shaken(1000.0, 100.0)), Some("mg"));
    assert_eq!(unit(&shaken(9.81, 3.0)), None);
    // Without gravity, of any size.
    for size in [0.3, 0.6, 0.8, 1.0, 1.3, 2.0] {
        let mut raw = shaken(0.0, 1.0);
        // Three numbers that are spread normally, or nearly: the sum of twelve that are even.
        let mut state = 1_u64;
        let mut normal = || {
            let mut even = || {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 11) as f64 / (1_u64 << 53) as f64
            };
            (0..12).map(|_| even()).sum::<f64>() - 6.0
        };
        for one in &mut raw {
            one.accel = Some([size * normal(), size * normal(), size * normal()]);
        }
        assert_eq!(unit(&raw), None, "{size}");
    }
    // Of a few samples nothing is said.
    let few = shaken(1.0, 0.1).into_iter().take(19).collect::<Vec<_>>();
    assert!(
        !summary(&few)
            .advice
            .iter()
            .any(|a| matches!(a, Advice::AccelMostlyOneG { .. }))
    );
}

#[test]
fn rates_no_gyro_has_are_taken_for_degrees_but_a_spike_is_not() {
    let turning = |n: i64, peak: f64| RawSample {
        gyro: Some([peak * (n as f64 * 0.01).sin(), 0.0, 1.0]),
        ..sample(n)
    };
    let raw: Vec<RawSample> = (0..2000).map(|n| turning(n, 500.0)).collect();
    let degrees = |found: QualitySummary| {
        let is = |a: &Advice| matches!(a, Advice::RatesLookLikeDegrees { .. });
        found.advice.iter().any(is)
    };
    assert!(degrees(summary(&raw)));
    let mut raw: Vec<RawSample> = (0..2000).map(|n| turning(n, 5.0)).collect();
    raw[1000].gyro = Some([700.0, 0.0, 0.0]);
    raw[1001].gyro = Some([6e302, 0.0, 0.0]);
    assert!(!degrees(summary(&raw)));
}

#[test]
fn a_clipped_and_a_stuck_axis_are_found() {
    let raw: Vec<RawSample> = (0..4000)
        .map(|n| {
            let x = 50.0 * (n as f64 * 0.013).sin();
            // Dies after a thousand samples.
            let z = 0.001 * n.min(1000) as f64;
            RawSample {
                gyro: Some([x.clamp(-34.9, 34.9), (n as f64 * 0.007).cos(), z]),
                ..sample(n)
            }
        })
        .collect();
    let found = summary(&raw);
    let saturated = found.advice.iter().find_map(|a| match a {
        Advice::Saturated { axis, at, .. } => Some((*axis, *at)),
        _ => None,
    });
    assert_eq!(saturated, Some((0, 34.9)));
    let stuck = found.advice.iter().find_map(|a| match a {
        Advice::Stuck { axis, samples } => Some((*axis, *samples)),
        _ => None,
    });
    assert_eq!(stuck, Some((2, 3000)));
}

#[test]
fn exact_data_is_neither_clipped_nor_stuck_nor_short_of_samples() {
    // A coning body: two axes swing to the same largest value again and again, the third is constant;
    // stamps that jitter by a third of a step without one missing.
    let found = summary(
        &(0..2000)
            .map(|n| {
                let phase = std::f64::consts::TAU * (n % 40) as f64 / 40.0;
                let jitter = [0, 0, 0, -1_700_000, 1_700_000, 0, 0, 0][n as usize % 8];
                let stamp = sample(n).header.map(|Nanos(t)| Nanos(t + jitter));
                RawSample {
                    gyro: Some([3.0 * phase.cos(), 3.0 * phase.sin(), -0.25]),
                    header: stamp,
                    ..sample(n)
                }
            })
            .collect::<Vec<_>>(),
    );
    assert!(
        found.missing > 0,
        "steps of 8.4 ms instead of 5 look like gaps: {found:?}"
    );
    let wrong = |a: &&Advice| {
        matches!(
            a,
            Advice::Saturated { .. } | Advice::Stuck { .. } | Advice::SamplesMissing { .. }
        )
    };
    assert_eq!(found.advice.iter().find(wrong), None);
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
