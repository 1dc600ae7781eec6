//! The kind of live samples that nothing states: decided on the way, and then as if it had been stated.

use strapd_attitude::estimate::{
    Aid, EstimationSettings, Estimator, KindReason, Meaning, Memory, at_once,
};
use strapd_attitude::propagate::{Method, Sequential};
use strapd_attitude::record::{AttitudeSample, Declared, Nanos, RawSample, SampleKind};

const MS: i64 = 1_000_000;

fn plan(kind: Option<SampleKind>, aid: Aid) -> EstimationSettings {
    EstimationSettings {
        method: Method::COMMIT,
        kind,
        aid,
        ..EstimationSettings::default()
    }
}

fn sample(stamp: i64) -> RawSample {
    let secs = stamp as f64 * 1e-9;
    RawSample {
        header: Some(Nanos(1_700_000_000_000_000_000 + stamp)),
        log: Nanos(1_700_000_000_000_000_000 + stamp),
        gyro: Some([(3.0 * secs).sin(), 1.5 * (2.0 * secs).cos(), 0.7]),
        accel: Some([0.1 * secs.sin(), 0.2, 9.8]),
        ..RawSample::default()
    }
}

fn begun(plan: &EstimationSettings, first: &RawSample) -> Estimator {
    let meaning = Meaning::new(plan, &Declared::default());
    let prepared = at_once(plan, &meaning, std::slice::from_ref(first)).unwrap();
    Estimator::live(plan, &meaning, &prepared).unwrap()
}

/// Attitudes of a stream that is asked after every so many samples.
fn run(
    plan: &EstimationSettings,
    raw: &[RawSample],
    cut: usize,
) -> (Vec<AttitudeSample>, Estimator) {
    let mut estimator = begun(plan, &raw[0]);
    let mut all = Vec::new();
    for block in raw.chunks(cut) {
        block.iter().for_each(|raw| estimator.take(raw));
        all.extend_from_slice(estimator.attitudes(&Sequential));
    }
    all.extend(estimator.finish(&Sequential));
    (all, estimator)
}

fn even(step: i64) -> Vec<RawSample> {
    (0..200).map(|n| sample(n * step)).collect()
}

#[test]
fn after_three_steps_attitudes_are_those_of_a_stream_that_stated_its_kind() {
    let gap_first = |step: i64| {
        let stamps = std::iter::once(-300 * MS).chain((0..200).map(|n| n * step));
        stamps.map(sample).collect::<Vec<RawSample>>()
    };
    let (rate, average) = (SampleKind::Rate, SampleKind::Average);
    for aid in [Aid::None, Aid::Gravity] {
        for (raw, kind) in [
            (even(10 * MS), average),
            (even(40 * MS), rate),
            (gap_first(10 * MS), average),
            (gap_first(40 * MS), rate),
        ] {
            let (found, estimator) = run(&plan(None, aid), &raw, 1);
            let (stated, _) = run(&plan(Some(kind), aid), &raw, 1);
            assert_eq!(found.len(), stated.len());
            assert_eq!(found[4..], stated[4..], "{kind:?} {aid:?}");
            assert_eq!(estimator.sample_kind().kind, kind);
            assert!(matches!(
                estimator.sample_kind().reason,
                KindReason::Step(_)
            ));
            for cut in [2, 3, 7, 200] {
                assert_eq!(run(&plan(None, aid), &raw, cut).0, found, "{kind:?} {cut}");
            }
        }
    }
}

#[test]
fn the_first_attitude_leaves_with_the_first_sample() {
    let raw = even(10 * MS);
    let plan = plan(None, Aid::Gravity);
    let mut estimator = begun(&plan, &raw[0]);
    for raw in &raw[..20] {
        estimator.take(raw);
        assert_eq!(estimator.attitudes(&Sequential).len(), 1);
    }
}

#[test]
fn what_is_remembered_keeps_the_kind_however_soon() {
    let plan = plan(None, Aid::Gravity);
    // The ordinary step shows after the third.
    let stamps = std::iter::once(-300 * MS).chain((0..200).map(|n| n * 10 * MS));
    let raw: Vec<RawSample> = stamps.map(sample).collect();
    for first in [2, 3, 30] {
        let mut whole = begun(&plan, &raw[0]);
        raw[..first].iter().for_each(|raw| whole.take(raw));
        whole.attitudes(&Sequential);
        let memory: Memory = whole.memory().unwrap();
        let kind = whole.sample_kind().kind;
        assert_eq!(memory.sample_kind().unwrap().kind, kind);
        let mut second = begun(&plan, &raw[first]);
        assert!(second.recall(&memory), "{first}");
        raw[first..].iter().for_each(|raw| second.take(raw));
        assert_eq!(second.sample_kind().kind, kind, "{first}");
        if first == 30 {
            raw[first..].iter().for_each(|raw| whole.take(raw));
            assert_eq!(second.attitudes(&Sequential), whole.attitudes(&Sequential));
        }
    }
    let mut one = begun(&plan, &raw[0]);
    one.take(&raw[0]);
    one.attitudes(&Sequential);
    assert!(one.memory().is_none(), "no step tells a kind yet");
}

#[test]
fn a_heading_that_is_set_before_the_kind_is_known_stays_set() {
    let raw = even(10 * MS);
    let headings = |kind| {
        let plan = plan(kind, Aid::Gravity);
        let mut estimator = begun(&plan, &raw[0]);
        let mut all = Vec::new();
        for (n, raw) in raw.iter().enumerate() {
            if n == 1 {
                assert!(estimator.turn_heading(1.0));
            }
            estimator.take(raw);
            all.extend_from_slice(estimator.attitudes(&Sequential));
        }
        all
    };
    let (open, stated) = (headings(None), headings(Some(SampleKind::Average)));
    let yaw = |all: &[AttitudeSample]| all[10].q_nb.yaw_pitch_roll().yaw;
    assert!(
        (yaw(&open) - yaw(&stated)).abs() < 0.01,
        "{} {}",
        yaw(&open),
        yaw(&stated)
    );
    assert!((yaw(&open) - 1.0).abs() < 0.2);
}

#[test]
fn what_another_estimator_remembers_under_other_settings_decides_no_kind() {
    let raw = even(10 * MS);
    let mut before = begun(&plan(None, Aid::Gravity), &raw[0]);
    raw.iter().for_each(|raw| before.take(raw));
    before.attitudes(&Sequential);
    let memory = before.memory().unwrap();
    let other = EstimationSettings {
        gyro_range: Some(20.0),
        ..plan(None, Aid::Gravity)
    };
    let mut fresh = begun(&other, &raw[0]);
    let mut refusing = begun(&other, &raw[0]);
    assert!(!refusing.recall(&memory));
    for sample in &raw {
        fresh.take(sample);
        refusing.take(sample);
        // No sample waits for the next one, the first neither.
        let expected = fresh.attitudes(&Sequential);
        assert_eq!(expected.len(), 1);
        assert_eq!(refusing.attitudes(&Sequential), expected);
    }
}
