//! Samples at the end of the gyro's range, stated or found.

use super::rules::kind;
use super::{run, sample};
use strapd_attitude::condition::{GyroUnit, Settings, SpikePolicy};
use strapd_attitude::record::{RawSample, SampleKind, Status};

#[test]
fn components_at_the_range_are_flagged() {
    // As a float32 this and its 200th part are a little less than they are.
    const RANGE: f64 = 1.8;
    assert!(f64::from(RANGE as f32) < RANGE && f64::from((RANGE * 0.005) as f32) < RANGE * 0.005);
    for (k, full) in [
        (SampleKind::Rate, RANGE),
        (SampleKind::DeltaAngle, RANGE * 0.005),
    ] {
        let settings = Settings {
            gyro_range: Some(RANGE),
            // Alone at the range it is a spike as well.
            spikes: SpikePolicy::Keep,
            ..kind(k)
        };
        let mut raw: Vec<RawSample> = (0..200)
            .map(|n| RawSample {
                gyro: Some([1e-4 * (n % 7) as f64, 0.0, 0.0]),
                ..sample(n)
            })
            .collect();
        // Full scale as a float32 would hold it.
        raw[150].gyro = Some([0.0, -f64::from(full as f32), 0.0]);
        raw[151].gyro = Some([0.0, -0.99 * full, 0.0]);
        let (out, report) = run(&settings, &raw);
        assert_eq!(report.saturated, 1);
        assert!(out[150].status.has(Status::SATURATED), "{k:?}");
    }
}

#[test]
fn a_live_stream_finds_the_end_of_the_range_by_itself() {
    // A swing of 3.5 rad/s that a sensor of 2.5 cuts, in rad/s and in deg/s, and one that is whole but coarse.
    let swing = |n: i64, read: &dyn Fn(f64) -> f64| {
        // It begins at rest, where the noise shows how fine it reads.
        let t = (n - 100).max(0) as f64 * 0.005;
        let shaken = 1e-3 * (n * 7919 % 1009) as f64 / 1009.0;
        let rates = [
            3.5 * (2.0 * t).sin() + shaken,
            (1.3 * t).cos(),
            0.2 * (0.7 * t).sin(),
        ];
        RawSample {
            gyro: Some(rates.map(read)),
            ..sample(n)
        }
    };
    let flagged = |settings: &Settings, read: &dyn Fn(f64) -> f64| {
        let settings = Settings {
            reorder_window: 0,
            ..settings.clone()
        };
        let raw: Vec<RawSample> = (0..2000).map(|n| swing(n, read)).collect();
        let (out, report) = run(&settings, &raw);
        let at: Vec<usize> = (0..out.len())
            .filter(|n| out[*n].status.has(Status::SATURATED))
            .collect();
        assert_eq!(at.len() as u64, report.saturated);
        (at, raw)
    };
    let (at, raw) = flagged(&kind(SampleKind::Rate), &|rate| rate.clamp(-2.5, 2.5));
    let clipped: Vec<usize> = (0..raw.len())
        .filter(|n| raw[*n].gyro.is_some_and(|gyro| gyro[0].abs() == 2.5))
        .collect();
    assert!(clipped.len() > 500);
    // All but the first few of each end, by which it was found.
    assert!(
        at.len() + 8 >= clipped.len(),
        "{} {}",
        at.len(),
        clipped.len()
    );
    let near = |n: &usize| {
        raw[*n]
            .gyro
            .is_some_and(|gyro| gyro[0].abs() >= 0.999 * 2.5)
    };
    assert!(at.iter().all(near));
    let degrees = Settings {
        unit: GyroUnit::Deg,
        ..kind(SampleKind::Rate)
    };
    let (same, _) = flagged(&degrees, &|rate| rate.clamp(-2.5, 2.5).to_degrees());
    assert_eq!(same, at);
    for whole in [
        flagged(&degrees, &|rate| rate.to_degrees().round()),
        flagged(&kind(SampleKind::Rate), &|rate| rate),
        // Where somebody states it, that counts.
        flagged(
            &Settings {
                gyro_range: Some(4.0),
                ..kind(SampleKind::Rate)
            },
            &|rate| rate.clamp(-2.5, 2.5),
        ),
    ] {
        assert!(whole.0.is_empty(), "{:?}", whole.0);
    }
}
