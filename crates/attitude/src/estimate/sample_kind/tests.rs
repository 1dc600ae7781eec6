use super::*;
use crate::estimate::plan::EstimationSettings;
use crate::estimate::{FEW, Meaning};
use crate::record::Declared;

const MS: i64 = 1_000_000;

fn sample(stamp: i64, n: usize) -> RawSample {
    RawSample {
        header: Some(Nanos(stamp)),
        gyro: Some([n as f64, 0.0, 0.0]),
        ..RawSample::default()
    }
}

fn at(stamps: impl IntoIterator<Item = i64>) -> Vec<RawSample> {
    let stamps = stamps.into_iter().enumerate();
    stamps.map(|(n, stamp)| sample(stamp, n)).collect()
}

fn chosen(raw: &[RawSample], most: usize) -> KindChoice {
    let meaning = Meaning::new(&EstimationSettings::default(), &Declared::default());
    meaning.settled_by(raw, Clock::Header, most).kind_choice()
}

/// Kinds by the first steps, as a daemon decides, and by all.
fn kinds(stamps: impl IntoIterator<Item = i64>) -> [SampleKind; 2] {
    let raw = at(stamps);
    [STEPS_LIVE, FEW].map(|most| chosen(&raw, most).kind)
}

const MEANS: [SampleKind; 2] = [SampleKind::Average; 2];
const RATES: [SampleKind; 2] = [SampleKind::Rate; 2];

#[test]
fn steps_of_up_to_20_ms_are_of_means_and_longer_ones_of_rates() {
    for (step, kinds_of) in [
        (125_000, MEANS),
        (5 * MS, MEANS),
        (20 * MS, MEANS),
        // 50 Hz by a clock that is slow.
        (20_400_000, MEANS),
        (25 * MS, RATES),
        (33 * MS, RATES),
        (1_000 * MS, RATES),
    ] {
        assert_eq!(kinds((0..600).map(|n| n * step)), kinds_of, "{step}");
    }
    let said = chosen(&at((0..600).map(|n| n * 5 * MS)), FEW).reason;
    assert_eq!(said.to_string(), "nothing states it; ordinary step 5.00 ms");
}

#[test]
fn jitter_gaps_and_strays_change_nothing() {
    // Up to a third of the step, from a sequence that looks random.
    let jitter = |n: i64| (n * 7919 % 13 - 6) * MS;
    assert_eq!(kinds((0..600).map(|n| n * 20 * MS + jitter(n) / 6)), MEANS);
    assert_eq!(kinds((0..600).map(|n| n * 20 * MS + jitter(n))), MEANS);
    // A sixth is lost; the first step is a gap; a stamp is none.
    assert_eq!(
        kinds((0..600).filter(|n| n % 6 != 1).map(|n| n * 20 * MS)),
        MEANS
    );
    assert_eq!(
        kinds([0].into_iter().chain((30..600).map(|n| n * 10 * MS))),
        MEANS
    );
    let stray = [1_700_000_000_000 * MS, 0].into_iter();
    assert_eq!(kinds(stray.chain((0..600).map(|n| n * 33 * MS))), RATES);
    assert_eq!(
        kinds((0..600).filter(|n| n % 5 != 3).map(|n| n * 33 * MS)),
        RATES
    );
}

#[test]
fn a_coarse_clock_is_of_a_faster_sensor_and_repeats_are_no_samples() {
    assert_eq!(kinds((0..600).map(|n| n / 10 * 100 * MS)), MEANS);
    // Each row four times, at 10 Hz.
    let repeated: Vec<RawSample> = (0..600)
        .map(|n| sample(n / 4 * 100 * MS, n as usize / 4))
        .collect();
    for most in [STEPS_LIVE, FEW] {
        assert_eq!(chosen(&repeated, most).kind, SampleKind::Rate);
    }
    // Batches of eight, 20 us apart, of a sensor of 25 Hz: only who looks ahead can know.
    let batches = (0..600).map(|n| n / 8 * 320 * MS + n % 8 * 20_000);
    assert_eq!(kinds(batches), [SampleKind::Average, SampleKind::Rate]);
}

#[test]
fn too_few_samples_are_open_and_a_stated_kind_is_never_looked_into() {
    assert_eq!(chosen(&[], FEW), KindChoice::OPEN);
    assert_eq!(chosen(&at([5]), FEW), KindChoice::OPEN);
    assert_eq!(kinds([0, 10 * MS, 20 * MS]), MEANS);
    let no_stamps = vec![RawSample::default(); 5];
    assert_eq!(chosen(&no_stamps, FEW), KindChoice::OPEN);
    let counted = Clock::Index { rate_hz: 40.0 };
    let meaning = Meaning::new(&EstimationSettings::default(), &Declared::default());
    assert_eq!(meaning.settled(&[], counted).kind, SampleKind::Rate);
    let (rate, average) = (Some(SampleKind::Rate), Some(SampleKind::Average));
    let by = |setting, recording, format| {
        let plan = EstimationSettings {
            kind: setting,
            ..EstimationSettings::default()
        };
        let declared = Declared {
            sample_kind: recording,
            usual_kind: format,
            ..Declared::default()
        };
        let meaning = Meaning::new(&plan, &declared);
        let settled = meaning.settled(&at((0..600).map(|n| n * 5 * MS)), Clock::Header);
        (settled.kind, settled.kind_reason)
    };
    assert_eq!(
        by(rate, average, average),
        (SampleKind::Rate, KindReason::Setting)
    );
    assert_eq!(
        by(None, rate, average),
        (SampleKind::Rate, KindReason::Recording)
    );
    assert_eq!(by(None, None, rate), (SampleKind::Rate, KindReason::Format));
    assert_eq!(
        by(None, None, None),
        (SampleKind::Average, KindReason::Step(5 * MS))
    );
}
