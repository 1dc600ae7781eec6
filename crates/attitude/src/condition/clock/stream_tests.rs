//! Whole streams through a conditioner: what counters and clocks do to stamps leaves no trace in time.

use super::batches::tests::{H, batched, even, gyro};
use crate::condition::{Batches, Conditioner, Settings, StampRepair, batches};
use crate::record::{Join, Nanos, RateSample, RawSample};

const STEP: i64 = 5_000_000;
const ARRIVED: i64 = 1_650_000_000_000_000_000;

/// Samples with these stamps, which arrived evenly.
fn samples(stamp: impl Fn(i64) -> i64, n: i64) -> Vec<RawSample> {
    (0..n)
        .map(|i| RawSample {
            header: Some(Nanos(stamp(i))),
            log: Nanos(ARRIVED + i * STEP + i % 5 * 700_000),
            gyro: Some([(i as f64 * 0.01).sin(), 0.1, -0.2]),
            ..RawSample::default()
        })
        .collect()
}

fn conditioned(raw: &[RawSample], settings: &Settings) -> (Vec<RateSample>, Conditioner) {
    let Ok(mut conditioner) = Conditioner::new(settings) else {
        panic!("settings that can be");
    };
    let mut out = Vec::new();
    // Cut anywhere.
    for part in raw.chunks(37) {
        conditioner.push(part, &mut out);
    }
    conditioner.finish(&mut out);
    (out, conditioner)
}

fn with(window: usize, repair: StampRepair) -> Settings {
    Settings {
        reorder_window: window,
        repair,
        ..Settings::default()
    }
}

fn is_even(out: &[RateSample], step: i64) -> bool {
    let joined = out.iter().skip(1).all(|s| s.join == Join::Continuous);
    joined
        && out
            .windows(2)
            .all(|w| (w[1].stamp.since(w[0].stamp) - step).abs() <= 1)
}

#[test]
fn a_counter_goes_on_in_files_and_live_and_stays_as_recorded_where_that_is_asked() {
    let raw = samples(
        |i| (i * STEP + (1 << 32) * 1_000 - 1_000_000_000) % ((1 << 32) * 1_000),
        600,
    );
    for window in [Settings::REPLAY_WINDOW, Settings::LIVE_WINDOW] {
        let (out, conditioner) = conditioned(&raw, &with(window, StampRepair::Auto));
        assert_eq!(out.len(), 600);
        assert!(is_even(&out, STEP));
        let wraps = conditioner.report().wraps;
        let wraps = wraps.map(|w| (w.count, w.period.to_string()));
        assert_eq!(wraps, Some((1, "a counter of 32 bits of us".to_owned())));
        assert_eq!(conditioner.report().gaps.count, 0);

        let (_, conditioner) = conditioned(&raw, &with(window, StampRepair::AsRecorded));
        assert_eq!(conditioner.report().wraps, None);
        assert_eq!(conditioner.report().gaps.jumps_back, 1);
    }
}

#[test]
fn a_clock_that_was_set_leaves_no_gap_and_nothing_held() {
    let set = |i: i64| {
        if (800..1400).contains(&i) {
            300_000_000
        } else {
            0
        }
    };
    let raw = samples(|i| ARRIVED - 7_000_000 + i * STEP + set(i), 2000);
    for window in [Settings::REPLAY_WINDOW, Settings::LIVE_WINDOW] {
        let (out, conditioner) = conditioned(&raw, &with(window, StampRepair::Auto));
        assert_eq!(out.len(), 2000, "{window}");
        assert!(is_even(&out, STEP), "{window}");
        let set = conditioner.report().clock_set;
        assert_eq!(
            set.map(|s| (s.count, s.largest_nanos)),
            Some((2, 300_000_000))
        );
        assert_eq!(conditioner.report().gaps.count, 0);
        let (_, conditioner) = conditioned(&raw, &with(window, StampRepair::AsRecorded));
        assert_eq!(conditioner.report().clock_set, None);
        assert!(conditioner.report().gaps.count > 0);
    }
}

#[test]
fn missing_samples_stay_missing() {
    let mut raw = samples(|i| ARRIVED - 7_000_000 + i * STEP, 2000);
    raw.drain(800..860);
    let auto = conditioned(&raw, &with(Settings::REPLAY_WINDOW, StampRepair::Auto));
    let before = conditioned(
        &raw,
        &with(Settings::REPLAY_WINDOW, StampRepair::AsRecorded),
    );
    assert_eq!(auto.0, before.0);
    assert_eq!(auto.1.report(), before.1.report());
    assert_eq!(auto.1.report().gaps.missing, 60);
}

#[test]
fn batches_become_even_samples_and_one_that_was_lost_is_missing() {
    let stamps = even(700, H);
    let mut came = batched(&stamps, 7, 300_000, 0);
    let mut rates = gyro(&stamps);
    for lost in [None, Some(350..357)] {
        if let Some(lost) = lost.clone() {
            came.drain(lost.clone());
            rates.drain(lost);
        }
        let Batches::Even(rate) = batches(&came, &rates) else {
            panic!("no batches");
        };
        let raw: Vec<RawSample> = came
            .iter()
            .zip(&rates)
            .map(|(stamp, gyro)| RawSample {
                header: Some(Nanos(*stamp)),
                log: Nanos(*stamp),
                gyro: Some(*gyro),
                ..RawSample::default()
            })
            .collect();
        let settings = Settings {
            batches: Some(rate),
            ..Settings::default()
        };
        let (out, conditioner) = conditioned(&raw, &settings);
        assert_eq!(out.len(), raw.len());
        let report = conditioner.report();
        assert_eq!(report.gaps.count, u64::from(lost.is_some()));
        assert_eq!(
            report.gaps.missing,
            lost.map_or(0, |lost| lost.len() as u64)
        );
        if report.gaps.count == 0 {
            assert!(is_even(&out, H));
        }
    }
}
