//! A clock that counts in coarser steps than the sensor samples.

use super::rules::{KINDS, kind};
use super::{STEP, T0, at, run, sample};
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
