//! A clock that counts in coarser steps than the sensor samples.

use super::rules::{KINDS, kind};
use super::{STEP, T0, at, run, sample};
use strapd_attitude::condition::{CoarseClock, Settings};
use strapd_attitude::record::{Nanos, RawSample};

/// Samples of 200 Hz whose clock counts whole seconds, from the middle of one on.
fn in_whole_seconds(first: i64, n: i64) -> Vec<RawSample> {
    (first..first + n)
        .map(|k| at(T0 + k * STEP / 1_000_000_000 * 1_000_000_000, k))
        .collect()
}

#[test]
fn a_clock_that_counts_whole_seconds_loses_no_sample_wherever_the_recording_begins() {
    const SECOND: i64 = 1_000_000_000;
    for k in KINDS {
        // A full first second, a half one, a few samples of it, one, and all but one.
        for first in [0, 100, 196, 199, 1] {
            let raw = in_whole_seconds(first, 1111);
            let (out, report) = run(&kind(k), &raw);
            let what = format!("{k:?} from sample {first}");
            assert_eq!(report.counts.used(), 1111, "{what}: {report:?}");
            assert_eq!(report.counts.lost(), 0, "{what}");
            assert_eq!(report.gaps.count, 0, "{what}");
            assert_eq!(report.coarse_nanos, Some(SECOND), "{what}");
            // Every sample at its own instant, to the nanosecond: 200 of them fill a second.
            for (n, sample) in out.iter().enumerate() {
                assert_eq!(
                    sample.stamp,
                    Nanos(T0 + (first + n as i64) * STEP),
                    "{what}"
                );
            }
        }
    }
}

#[test]
fn lost_samples_of_a_coarse_clock_leave_a_gap_and_move_nothing_else() {
    for k in KINDS {
        let mut raw = in_whole_seconds(100, 2000);
        // Half of the sixth second is lost, and all of the eighth.
        raw.retain(|s| {
            !(1300..1400).contains(&index_of(s)) && !(1600..1800).contains(&index_of(s))
        });
        let (out, report) = run(&kind(k), &raw);
        assert_eq!(report.counts.lost(), 0, "{k:?}");
        assert_eq!(report.gaps.count, 2, "{k:?}: {:?}", report.gaps);
        assert!(out.windows(2).all(|w| w[0].stamp < w[1].stamp));
        for (raw, sample) in raw.iter().zip(&out) {
            assert_eq!(sample.stamp, Nanos(T0 + index_of(raw) * STEP), "{k:?}");
        }
    }
}

/// Index of a sample: `sample(n)` writes n into the rate about x.
fn index_of(raw: &RawSample) -> i64 {
    (raw.gyro.unwrap()[0] / sample(1).gyro.unwrap()[0]).round() as i64
}

/// Samples at `rate` Hz, all alike, on a clock that counts in steps of `tick` ns.
fn at_rest(rate: i64, tick: i64, n: i64) -> (Vec<RawSample>, CoarseClock) {
    let stamp = |k: i64| (T0 + k * 1_000_000_000 / rate) / tick * tick;
    let raw = (0..n).map(|k| at(stamp(k), 0)).collect();
    let step = 1e9 / rate as f64;
    (raw, CoarseClock { tick, step })
}

#[test]
fn rows_that_are_alike_at_rest_are_no_repeats_where_the_clock_is_known_to_be_coarse() {
    // Samples a second, step of the clock in ms.
    for (rate, ms) in [
        (50, 200),
        (50, 1000),
        (200, 100),
        (100, 20),
        (150, 10),
        (50, 50),
    ] {
        let (raw, coarse) = at_rest(rate, ms * 1_000_000, 1500);
        let settings = Settings {
            coarse: Some(coarse),
            ..Settings::default()
        };
        let (out, report) = run(&settings, &raw);
        assert_eq!(report.counts.used(), 1500, "{rate} Hz, {ms} ms");
        assert_eq!(
            (report.counts.lost(), report.gaps.count),
            (0, 0),
            "{rate} Hz"
        );
        assert_eq!(report.coarse_nanos, Some(coarse.tick));
        for (k, (sample, raw)) in out.iter().zip(&raw).enumerate() {
            let off = sample
                .stamp
                .since(Nanos(T0 + k as i64 * 1_000_000_000 / rate));
            // Each within the step of the clock that its stamp names: to a step of the sensor nothing else is known.
            assert!(off.abs() as f64 <= coarse.step, "{rate} Hz, {k}: {off}");
            let in_tick = sample.stamp.since(raw.header.unwrap());
            assert!(
                (0..coarse.tick).contains(&in_tick),
                "{rate} Hz, {k}: {in_tick}"
            );
        }
        // Even from the second step of the clock on.
        let even = out.windows(2).skip(2 * rate as usize);
        let jitter = even.map(|w| w[1].stamp.since(w[0].stamp) as f64 - coarse.step);
        let worst = jitter.fold(0.0, |worst: f64, off| worst.max(off.abs()));
        assert!(worst < 10.0, "{rate} Hz, {ms} ms: {worst} ns");
    }
}
