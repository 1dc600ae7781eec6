//! NaN, infinity and numbers no gyro can have, anywhere: the state stays finite, and under policy
//! `bridge` the attitude is that of the log without the sample.

use crate::made_logs::{ImuSample, TOPIC, motion, written};
use crate::replays::{Bits, assert_rotations, attitudes, only, replay_with};
use proptest::prelude::*;
use std::path::Path;
use strapd_attitude::condition::OnGap;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::propagate::Method;
use strapd_attitude::record::{SampleKind, Verdict};

const SAMPLES: usize = 60;

fn plan(kind: SampleKind, method: Method) -> EstimationSettings {
    EstimationSettings {
        kind: Some(kind),
        method,
        on_gap: OnGap::Bridge,
        ..EstimationSettings::default()
    }
}

fn replayed(dir: &Path, samples: &[ImuSample], plan: &EstimationSettings) -> (u64, u64, Vec<Bits>) {
    let path = written(dir, "log.mcap", samples);
    let (summary, attitudes) = attitudes(&replay_with(&path, plan.clone()), dir);
    let counts = only(&summary).counts;
    let bad = counts.get(Verdict::NotFinite) + counts.get(Verdict::Huge);
    (counts.used(), bad, attitudes)
}

/// Bad in a way that is not a measurement: NaN, infinities, and finite numbers above 4e4 rad/s.
fn not_a_rate() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(1e300),
        Just(-f64::MAX),
        Just(4.000_001e4),
    ]
}

/// Anything 64 bits can be.
fn any_bits() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        not_a_rate(),
        Just(5e-324),
        Just(-0.0)
    ]
}

fn kinds() -> impl Strategy<Value = (SampleKind, Method)> {
    prop_oneof![
        Just((SampleKind::Rate, Method::Auto)),
        Just((SampleKind::Average, Method::Auto)),
        Just((SampleKind::DeltaAngle, Method::Auto)),
        Just((SampleKind::Rate, Method::DcmLeft)),
        Just((SampleKind::Rate, Method::DcmRight)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_sample_that_is_no_measurement_is_as_if_it_were_not_there(
        at in 0..SAMPLES,
        axis in 0..3usize,
        value in not_a_rate(),
        (kind, method) in kinds(),
    ) {
        let dir = tempfile::tempdir().unwrap();
        let plan = plan(kind, method);
        let good = motion(SAMPLES);
        let mut bad = good.clone();
        bad[at].gyro[axis] = value;
        let mut without = good;
        without.remove(at);
        let (used, counted, found) = replayed(dir.path(), &bad, &plan);
        let (_, _, expected) = replayed(dir.path(), &without, &plan);
        // A delta angle may be up to 1e3 rad: 4.000001e4 is above that, too.
        prop_assert_eq!((used, counted), (SAMPLES as u64 - 1, 1));
        prop_assert_eq!(found, expected);
    }

    #[test]
    fn whatever_stands_in_any_field_every_attitude_is_a_rotation(
        at in prop::collection::vec((0..SAMPLES, 0..6usize, any_bits()), 1..8),
        (kind, method) in kinds(),
    ) {
        let dir = tempfile::tempdir().unwrap();
        let mut samples = motion(SAMPLES);
        for (at, field, value) in at {
            match field {
                0..3 => samples[at].gyro[field] = value,
                _ => samples[at].accel[field - 3] = value,
            }
        }
        let (used, _, attitudes) = replayed(dir.path(), &samples, &plan(kind, method));
        prop_assert_eq!(attitudes.len() as u64, used);
        assert_rotations(&attitudes, "any bits");
    }

    #[test]
    fn whatever_a_stamp_says_every_attitude_is_a_rotation_and_no_sample_goes_uncounted(
        at in prop::collection::vec((0..SAMPLES, any::<i32>(), any::<u32>()), 1..6),
        (kind, method) in kinds(),
    ) {
        let dir = tempfile::tempdir().unwrap();
        let mut samples = motion(SAMPLES);
        for (at, sec, nanosec) in at {
            samples[at].stamp = i64::from(sec) * 1_000_000_000 + i64::from(nanosec % 1_000_000_000);
        }
        let path = dir.path().join("log.mcap");
        let mut messages = crate::made_logs::logged(TOPIC, &samples);
        // Received in order, whatever the stamps say.
        for (k, message) in messages.iter_mut().enumerate() {
            message.log_time = 1_700_000_000_000_000_000 + k as u64 * 10_000_000;
        }
        let bytes = crate::made_logs::bytes(Some(None), 4096, &messages);
        std::fs::write(&path, bytes).unwrap();
        let (summary, attitudes) = attitudes(&replay_with(&path, plan(kind, method)), dir.path());
        let counts = only(&summary).counts;
        prop_assert_eq!(counts.total(), SAMPLES as u64);
        prop_assert_eq!(attitudes.len() as u64, counts.used());
        assert_rotations(&attitudes, "any stamp");
    }
}

#[test]
fn a_log_of_nothing_but_nan_ends_with_a_count_and_without_an_attitude() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = motion(50);
    for sample in &mut samples {
        sample.gyro = [f64::NAN; 3];
    }
    let path = written(dir.path(), "nan.mcap", &samples);
    let (summary, attitudes) = attitudes(
        &replay_with(&path, EstimationSettings::default()),
        dir.path(),
    );
    assert!(attitudes.is_empty());
    assert_eq!(only(&summary).counts.get(Verdict::NotFinite), 50);
    assert!(summary.is_lossy());
    let said = only(&summary).warnings().join("; ");
    assert!(said.contains("no sample was used"), "{said}");
}

#[test]
fn rates_in_degrees_are_integrated_and_the_flag_is_named() {
    // 0.9 + 1.3 rad/s in deg/s is well above 200 "rad/s" once the motion is four times as fast.
    let dir = tempfile::tempdir().unwrap();
    let mut samples = motion(100);
    for sample in &mut samples {
        sample.gyro = sample.gyro.map(|w| 4.0 * w.to_degrees());
    }
    let path = written(dir.path(), "deg.mcap", &samples);
    let (summary, _) = attitudes(
        &replay_with(&path, EstimationSettings::default()),
        dir.path(),
    );
    let said = only(&summary).warnings().join("; ");
    assert!(said.contains("gyro_unit deg"), "{said}");
    let plan = EstimationSettings {
        unit: Some(strapd_attitude::condition::GyroUnit::Deg),
        ..EstimationSettings::default()
    };
    let (summary, _) = attitudes(&replay_with(&path, plan), dir.path());
    assert!(only(&summary).warnings().is_empty(), "{summary:?}");
}
