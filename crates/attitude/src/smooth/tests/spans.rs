//! Work that grows with the samples and not with the time between them, counted in nodes and in samples to be swept.

use super::super::prepare::Preparer;
use super::super::survey::Survey;
use super::logs::{Motion, log, smoothed};
use crate::record::Nanos;
use crate::smooth::{Outcome, Sample, SampleModel, Settings};

const SECOND: i64 = 1_000_000_000;
const HOUR: i64 = 3600 * SECOND;
const YEAR: i64 = 365 * 24 * HOUR;
/// Half a second each.
const MOST_NODES: u64 = 20;

fn instant() -> Settings {
    Settings {
        sample_model: SampleModel::Instant,
        ..Settings::default()
    }
}

/// The first samples of a hand's motion at these instants.
fn stamped(stamps: impl Iterator<Item = i64>) -> Vec<Sample> {
    let hand = log(Motion::Hand).plain();
    let at = |(sample, stamp): (&Sample, i64)| Sample {
        stamp: Nanos(stamp),
        ..*sample
    };
    hand.samples.iter().zip(stamps).map(at).collect()
}

/// Samples that are swept for these, in one pass.
fn swept(samples: &[Sample], settings: &Settings) -> usize {
    let survey = Survey::of(&mut { samples }, settings).unwrap();
    let mut preparer = Preparer::new(&survey, settings);
    let mut out = Vec::new();
    preparer.push(samples, &mut out);
    preparer.finish(&mut out);
    out.len()
}

#[test]
fn steps_of_hours_are_breaks_however_many() {
    for (count, step) in [(2, YEAR), (40, 6 * HOUR), (40, 11 * SECOND)] {
        let samples = stamped((0..count).map(|i| i * step));
        let (smoothed, estimates) = smoothed(&samples, &instant());
        let (steps, counts) = (count as u64 - 1, smoothed.counts());
        assert_eq!((counts.segments, counts.breaks), (steps, steps), "{step}");
        assert_eq!(swept(&samples, &instant()), samples.len(), "{step}");
        for estimate in estimates {
            assert!(estimate.q_nb.wxyz().iter().all(|c| c.is_finite()));
        }
    }
}

#[test]
fn slow_samples_are_joined_by_twenty_nodes_at_most() {
    for secs in [1, 5, 10] {
        let samples = stamped((0..40).map(|i| i * secs * SECOND));
        let (smoothed, _) = smoothed(&samples, &instant());
        assert_eq!(smoothed.counts().breaks, 0, "{secs} s");
        assert!(smoothed.counts().segments <= 39 * MOST_NODES, "{secs} s");
    }
}

#[test]
fn a_year_in_the_middle_costs_a_node() {
    let whole = log(Motion::Hand).plain();
    let mut torn = whole.clone();
    for sample in &mut torn.samples[3000..] {
        sample.stamp.0 += YEAR;
    }
    for settings in [Settings::default(), instant()] {
        let (of_whole, _) = whole.smoothed(&settings);
        let (of_torn, _) = torn.smoothed(&settings);
        assert_eq!(of_torn.outcome(), Outcome::Converged);
        assert_eq!(of_torn.counts().breaks, 1);
        assert!(of_torn.counts().segments <= of_whole.counts().segments + 1);
    }
}

/// Stamps in bursts: the ordinary step is a microsecond, and nothing is a quarter of a million of them.
#[test]
fn bursts_are_filled_by_no_more_than_there_are_samples() {
    let bursts = |i: i64| (i / 10) * SECOND / 5 + (i % 10) * 1000;
    let samples = stamped((0..2000).map(bursts));
    let made = swept(&samples, &Settings::default());
    assert!(made < 25 * samples.len() + 10_000, "{made}");
    // Holes of an ordinary recording have all their samples: 8 kHz, two thirds of it lost in tenths of a second.
    let holed = |i: i64| (i + (i / 400) * 800) * 125_000;
    let samples = stamped((0..4000).map(holed));
    assert_eq!(swept(&samples, &Settings::default()), 4000 + 9 * 800);
}
