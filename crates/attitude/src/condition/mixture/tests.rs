//! Streams of one sensor and of two -> whether a mixture is found.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::condition::gate::NO_ACCEL;
use crate::record::Status;

const STEP: i64 = 10_000_000;
const G: f64 = 9.806_65;

/// Sample of a body that swings about x and y about a lean of `lean` rad, `t` s after the start.
fn swing(lean: f64, t: f64, stamp: i64, seed: u64) -> Entry {
    let noise = |k: u64| {
        let mut bits = seed
            .wrapping_mul(2_654_435_761)
            .wrapping_add(k)
            .wrapping_mul(0x9e37_79b9_7f4a_7c15);
        bits ^= bits >> 31;
        bits = bits.wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let roll = lean + 0.5 * (1.7 * t).sin();
    let force = Vector3::new(0.1 * (2.3 * t).sin(), roll.sin(), roll.cos()) * G;
    Entry {
        stamp: Nanos(stamp),
        log: Nanos(stamp),
        value: Vector3::new(0.85 * (1.7 * t).cos(), 0.2 * t.sin(), 0.0)
            + Vector3::new(noise(1), noise(2), noise(3)) * 0.003,
        accel: force + Vector3::new(noise(4), noise(5), noise(6)) * 0.05,
        interval: 0,
        index: 0,
        epoch: 0,
        status: Status::OK,
    }
}

fn found(entries: impl IntoIterator<Item = Entry>) -> Option<Mixture> {
    let mut watch = MixtureWatch::new(true);
    let mut found = None;
    for entry in entries {
        watch.take_stamp(entry.stamp, &mut found);
        watch.take(&entry, &mut found);
    }
    found
}

/// Twenty seconds of two bodies, the second `late` ns after the first of each step.
fn two(lean: f64, late: i64) -> Vec<Entry> {
    let pair = |n: i64| {
        let t = n as f64 * 0.01;
        [
            swing(0.0, t, n * STEP, n as u64),
            swing(lean, t, n * STEP + late, (n as u64) << 32),
        ]
    };
    (0..2000).flat_map(pair).collect()
}

#[test]
fn two_bodies_that_take_turns_are_found_with_the_angle_between_them() {
    for (lean, late) in [
        (1.0, 5_000_000),
        (0.6, 0),
        (0.1, 3_000_000),
        (2.5, 1_000_000),
    ] {
        let found = found(two(lean, late)).unwrap();
        let Apart::Forces(angle) = found.apart else {
            panic!("{found:?}");
        };
        assert!((angle - lean).abs() < 0.1, "{lean}: {angle}");
        assert!(found.samples > 2000, "{lean}: {found:?}");
    }
}

#[test]
fn two_bodies_in_any_order_are_found() {
    let mut entries = two(1.0, 4_000_000);
    // Every third pair came the other way round, and some of a sensor came together.
    for (n, four) in entries.chunks_exact_mut(4).enumerate() {
        match n % 3 {
            0 => four.swap(0, 1),
            1 => four.swap(1, 2),
            _ => {}
        }
    }
    assert!(found(entries).is_some());
}

#[test]
fn one_that_rests_level_and_one_that_turns_level_are_told_apart_by_rates_and_stamps() {
    let pair = |n: i64| {
        let at = |late, rate| {
            let mut entry = swing(0.0, 0.0, n * STEP + late, n as u64 * 2 + late as u64);
            entry.accel = Vector3::new(0.0, 0.0, G);
            entry.value.x -= 0.85;
            entry.value.z += rate;
            entry
        };
        [at(0, 0.0), at(3_000_000, 0.4)]
    };
    let found = found((0..1000).flat_map(pair)).unwrap();
    let Apart::Rates(apart) = found.apart else {
        panic!("{found:?}");
    };
    assert!((apart - 0.4).abs() < 0.02, "{apart}");
}

#[test]
fn stamps_of_two_clocks_are_found_at_rest() {
    let pair = |n: i64| {
        let at = |stamp, seed| swing(0.0, 0.0, stamp, seed);
        [at(n * STEP, n as u64), at(n * STEP - 77_000_000_000, 7)]
    };
    let found = found((0..100).flat_map(pair)).unwrap();
    assert!(
        matches!(found.apart, Apart::Clocks(apart) if (apart - 77_000_000_000).abs() <= STEP),
        "{found:?}"
    );
}

#[test]
fn one_sensor_is_no_mixture_whatever_it_does() {
    let one = |n: i64| swing(0.3, n as f64 * 0.01, n * STEP, n as u64);
    assert_eq!(found((0..4000).map(one)), None);
    // Recorded twice, and stamped by a coarse clock.
    let twice = (0..4000).flat_map(|n| [one(n), one(n)]);
    assert_eq!(found(twice), None);
    let coarse = |n: i64| Entry {
        stamp: Nanos(n / 2 * 2 * STEP),
        ..one(n)
    };
    assert_eq!(found((0..4000).map(coarse)), None);
    // A jittering clock and a noisy sensor at rest.
    let rest = |n: i64| {
        let mut entry = swing(0.3, 0.0, n * STEP + n % 7 * 1_000_000, n as u64);
        entry.accel += (entry.value - Vector3::new(0.85, 0.0, 0.0)) * 400.0;
        entry
    };
    assert_eq!(found((0..4000).map(rest)), None);
}

#[test]
fn a_vibration_near_half_the_rate_is_no_mixture() {
    for (frequency, size) in [
        (50.0, 3.0),
        (49.9, 6.0),
        (49.0, 4.0),
        (33.3, 8.0),
        (25.0, 5.0),
    ] {
        for axis in 0..3 {
            let shaken = |n: i64| {
                let t = n as f64 * 0.01;
                let mut entry = swing(0.3, t, n * STEP, n as u64);
                let phase = (std::f64::consts::TAU * frequency * t + 0.8).sin();
                entry.accel[axis] += size * phase;
                entry.value[axis] += 0.5 * phase;
                entry
            };
            assert_eq!(
                found((0..6000).map(shaken)),
                None,
                "{frequency} Hz, axis {axis}"
            );
        }
    }
}

#[test]
fn without_forces_nothing_is_claimed_of_an_even_clock() {
    let dithered = |n: i64| Entry {
        value: Vector3::new(if n % 2 == 0 { 0.4 } else { -0.4 }, 0.0, 0.0),
        accel: NO_ACCEL,
        ..swing(0.0, 0.0, n * STEP, n as u64)
    };
    assert_eq!(found((0..4000).map(dithered)), None);
}
