//! Ends of segments, refusals, and what holds for any stamps at all.

use super::{START, STEP, causal, conditioned, lines, normal, offline, through};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;
use strapd_attitude::condition::regularise::{Regulariser, Survey, Value};
use strapd_attitude::record::{Join, Nanos, RateSample, RawSample, SampleKind};

/// Samples with these stamps (after [`START`]), none like another.
fn stamped(stamps: impl IntoIterator<Item = i64>) -> Vec<RawSample> {
    stamps
        .into_iter()
        .enumerate()
        .map(|(k, stamp)| RawSample {
            header: Some(Nanos(START + stamp)),
            log: Nanos(START + k as i64 * STEP),
            gyro: Some([0.1, k as f64 * 1e-6, -0.3]),
            ..RawSample::default()
        })
        .collect()
}

fn rates(stamps: impl IntoIterator<Item = i64>) -> Vec<RateSample> {
    conditioned(&stamped(stamps), SampleKind::Rate)
}

/// Even instants with normal noise, parts of a step.
fn noisy(seed: u64, n: i64, step: f64, sigma: f64) -> impl Iterator<Item = i64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(move |k| (step * (k as f64 + sigma * normal(&mut rng))).round() as i64)
}

#[test]
fn an_even_clock_is_one_segment_whatever_its_jitter() {
    for seed in 0..4 {
        for sigma in [0.0, 1e-6, 1e-3, 0.02, 0.1, 0.12] {
            let samples = rates(noisy(seed, 20_000, STEP as f64, sigma));
            let lines = lines(&samples);
            assert_eq!(lines.len(), 1, "seed {seed}, sigma {sigma}");
            assert!((lines.rate_hz().unwrap() - 200.0).abs() < 1e-4);
        }
    }
}

#[test]
fn a_rate_that_changes_begins_a_segment() {
    // To half the rate, to twice it, by a part in a thousand, and by 20 ppm after a longer while.
    for (before, after, n) in [
        (5e6, 1e7, 3000),
        (1e7, 5e6, 3000),
        (5e6, 5.005e6, 3000),
        (5e6, 5.0001e6, 60_000),
    ] {
        let first: Vec<i64> = noisy(1, n, before, 0.01).collect();
        let from = (n as f64 * before) as i64;
        let second = noisy(2, n, after, 0.01).map(|t| from + t);
        let samples = rates(first.into_iter().chain(second));
        let (even, report) = offline(&samples, SampleKind::Rate);
        assert!(
            (2..=4).contains(&report.segments),
            "{before} -> {after}: {:?}",
            report.kept
        );
        let hz = |i: usize| report.kept[i].rate_hz.unwrap();
        let last = report.kept.len() - 1;
        // The first may bend a little before the change is seen: by less than the change.
        let tolerance = 0.2 * (after / before - 1.0).abs().min(1e-4);
        assert!((hz(0) * before * 1e-9 - 1.0).abs() < tolerance, "{}", hz(0));
        assert!(
            (hz(last) * after * 1e-9 - 1.0).abs() < tolerance,
            "{report:?}"
        );
        // No stamp is moved by more than what jitter explains: six sigma, and the bend. But for the
        // one at the border: half a step off it may belong to either side.
        let limit = (0.07 * after) as i64;
        let moved = even
            .iter()
            .zip(&samples)
            .filter(|(new, old)| new.stamp.since(old.stamp).abs() > limit)
            .count();
        assert!(moved <= 1, "{before} -> {after}: {moved}");
    }
}

#[test]
fn gaps_and_clock_jumps_end_segments_and_time_stays_where_it_was() {
    let first: Vec<i64> = noisy(1, 2000, STEP as f64, 0.02).collect();
    // A gap of 7.3 s beyond --max-gap, and then a clock set back by an hour.
    let gap = 2000 * STEP + 7_300_000_000;
    let back = -3_600_000_000_000;
    let second = noisy(2, 2000, STEP as f64, 0.02).map(|t| t + gap);
    let third = noisy(3, 2000, STEP as f64, 0.02).map(|t| t + back);
    let samples = rates(first.into_iter().chain(second).chain(third));
    for (what, (even, report)) in [
        ("lines", offline(&samples, SampleKind::Rate)),
        ("tracker", causal(&samples, SampleKind::Rate)),
    ] {
        assert_eq!(report.segments, 3, "{what}");
        for (k, begin) in [(0, 0), (2000, gap), (4000, back)] {
            // The line's end is known to 2 sigma / sqrt(n); live, the first stamp is the recorded one.
            let off = even[k].stamp.0 - START - begin;
            assert!(off.abs() < STEP / 10, "{what} {k}: {off}");
            assert_eq!(even[k].join, samples[k].join);
        }
        assert_eq!(even[2000].join, Join::Hold);
    }
}

#[test]
fn stamps_without_a_rate_are_refused_with_what_helps() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut now = 0;
    let at_random: Vec<i64> = (0..5000)
        .map(|_| {
            now += (STEP as f64 * rng.random_range(0.2..1.8)) as i64;
            now
        })
        .collect();
    // Batches of ten stamped on arrival, a microsecond apart.
    let batches = (0..5000).map(|k| (k / 10) * 10 * STEP + (k % 10) * 1000);
    // A rate that falls from 500 Hz to 55 in 20 s.
    let falling = (0..2000_i64).map(|k| 2_000_000 * k + 4000 * k * k);
    for (what, samples, expected) in [
        ("random walk", rates(at_random), "cannot be counted"),
        ("batches", rates(batches), "batches"),
        ("falling", rates(falling), "it changes"),
    ] {
        let mut survey = Survey::new();
        samples.iter().for_each(|s| survey.push(s));
        let why = survey.finish().expect_err(what);
        let said = why.to_string();
        assert!(said.contains(expected), "{what}: {said}");
        assert!(said.contains("time index rate_hz HZ"), "{said}");
    }
}

#[test]
fn a_few_stamps_far_off_do_not_bend_the_line() {
    let mut stamps: Vec<i64> = noisy(1, 4000, STEP as f64, 0.002).collect();
    // Late by two to three steps: overtaken by their successors' stamps, or nearly.
    for (i, k) in [5_usize, 700, 701, 1900, 3000].into_iter().enumerate() {
        stamps[k] += STEP * 7 / 10 + i as i64 * 1000;
    }
    let samples = rates(stamps);
    let (even, report) = offline(&samples, SampleKind::Rate);
    assert_eq!(report.segments, 1);
    assert_eq!(report.ambiguous, 5, "{report:?}");
    for (k, new) in even.iter().enumerate() {
        let off = new.stamp.0 - START - k as i64 * STEP;
        // Line: 2 * 0.002 / sqrt(4000) of a step, and five of it.
        assert!(off.abs() < STEP / 3000, "{k}: {off} ns");
    }
    let (live, report) = causal(&samples, SampleKind::Rate);
    assert!(report.ambiguous >= 4);
    for (k, new) in live.iter().enumerate().skip(500) {
        let off = new.stamp.0 - START - k as i64 * STEP;
        assert!(off.abs() < STEP / 200, "{k}: {off} ns");
    }
}

#[test]
fn a_late_burst_at_the_start_does_not_tilt_the_first_line() {
    let mut stamps: Vec<i64> = noisy(1, 4000, STEP as f64, 0.002).collect();
    // Four delivered together, at the end of the samples a segment is opened with.
    for (k, late) in [(27, 3.7), (28, 2.75), (29, 1.8), (30, 0.85)] {
        stamps[k] += (late * STEP as f64) as i64;
    }
    let samples = rates(stamps);
    let (even, report) = offline(&samples, SampleKind::Rate);
    assert_eq!((report.segments, report.ambiguous), (1, 4), "{report:?}");
    for (k, new) in even.iter().enumerate() {
        let off = new.stamp.0 - START - k as i64 * STEP;
        assert!(off.abs() < STEP / 3000, "{k}: {off} ns");
    }
}

#[test]
fn few_samples_keep_their_stamps() {
    for n in 0..3 {
        let samples = rates((0..n).map(|k| k * STEP));
        let (even, _) = offline(&samples, SampleKind::Rate);
        assert_eq!(even, samples);
    }
    let samples = rates([0, STEP + 1000, 2 * STEP]);
    let (even, _) = offline(&samples, SampleKind::Rate);
    assert_ne!(even[1].stamp, samples[1].stamp);
}

#[test]
fn live_nothing_waits_and_nothing_to_come_matters() {
    let samples = rates(noisy(5, 3000, STEP as f64, 0.05));
    let (whole, _) = causal(&samples, SampleKind::Rate);
    for n in [1, 2, 3, 40, 1111] {
        let (part, _) = causal(&samples[..n], SampleKind::Rate);
        assert_eq!(part, whole[..n]);
    }
    let mut live = Regulariser::causal(Value::Rate);
    let mut out = Vec::new();
    for (k, sample) in samples.iter().enumerate() {
        live.push(std::slice::from_ref(sample), &mut out);
        assert_eq!(out.len(), k + 1);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn whatever_the_stamps_time_goes_on_and_every_sample_comes_out(
        steps in prop::collection::vec(
            prop_oneof![
                8 => 3_000_000_i64..7_000_000,
                1 => -20_000_000_i64..40_000_000,
                1 => prop::sample::select(vec![0, 1, -1, 600_000_000, -3_000_000_000, i64::MAX / 8]),
            ],
            1..400,
        ),
        kind in prop::sample::select(vec![SampleKind::Rate, SampleKind::Average, SampleKind::DeltaAngle]),
        cut in 1_usize..64,
    ) {
        let mut now = 0_i64;
        let stamps: Vec<i64> = steps.iter().map(|step| { now = now.saturating_add(*step).min(i64::MAX / 4); now }).collect();
        let samples = conditioned(&stamped(stamps), kind);
        let mut survey = Survey::new();
        samples.iter().for_each(|s| survey.push(s));
        // Refused or not, the lines must do no harm: a recording under 64 samples is never refused.
        let Ok(found) = survey.finish() else { return Ok(()) };
        let found = Arc::new(found);
        let value = Value::of(kind, false);
        for make in [Regulariser::by_lines(found, value), Regulariser::causal(value)] {
            let (even, _) = through(make.clone(), &samples);
            // Cut otherwise: the same.
            let mut again = Vec::new();
            let mut other = make;
            for part in samples.chunks(cut) {
                other.push(part, &mut again);
            }
            other.finish(&mut again);
            prop_assert_eq!(&even, &again);
            for (old, new) in samples.windows(2).zip(even.windows(2)) {
                if old[1].stamp > old[0].stamp {
                    prop_assert!(new[1].stamp > new[0].stamp, "{:?} -> {:?}", old, new);
                }
                prop_assert!(new[1].start <= new[1].stamp);
                prop_assert!(new[1].gyro.as_vector().iter().all(|v| v.is_finite()));
            }
        }
    }
}
