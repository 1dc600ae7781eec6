//! Streams whose units change, and that only move -> whether a change is found.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::record::Status;
use nalgebra::Vector3;

const STEP: i64 = 10_000_000;
const G: f64 = 9.806_65;

fn entry(n: i64, value: Vector3<f64>, accel: Vector3<f64>) -> Entry {
    Entry {
        stamp: Nanos(n * STEP),
        log: Nanos(n * STEP),
        value,
        accel,
        interval: 0,
        index: 0,
        epoch: 0,
        status: Status::OK,
    }
}

/// A body that swings about x, with a little else.
fn swing(n: i64) -> Entry {
    let t = n as f64 * 0.01;
    let roll = 0.8 * (1.7 * t).sin();
    let shake = Vector3::new((11.0 * t).sin(), (13.0 * t).cos(), 0.0) * 0.5;
    entry(
        n,
        Vector3::new(0.8 * 1.7 * (1.7 * t).cos(), 0.0, 0.0),
        Vector3::new(0.0, roll.sin(), roll.cos()) * G + shake,
    )
}

fn found(entries: impl IntoIterator<Item = Entry>) -> UnitChanges {
    let mut watch = UnitWatch::default();
    let mut found = UnitChanges::default();
    for entry in entries {
        watch.take(&entry, true, &mut found);
    }
    found
}

#[test]
fn an_accelerometer_that_goes_from_one_unit_to_another_is_found_at_its_sample() {
    for factor in [1.0 / G, G, 1000.0, 1.0 / 1000.0, 1000.0 / G, G / 1000.0] {
        let changed = |n| {
            let mut entry = swing(n);
            entry.accel *= if n >= 1200 { factor } else { 1.0 };
            entry
        };
        let change = found((0..3000).map(changed)).accel.unwrap();
        assert_eq!(change.at, Nanos(1200 * STEP), "{factor}");
        assert!((change.factor / factor - 1.0).abs() < 0.05, "{change:?}");
    }
}

#[test]
fn half_a_range_is_found_at_rest_alone() {
    let halved = |entry: Entry, n: i64| Entry {
        accel: entry.accel * if n >= 1200 { 0.5 } else { 1.0 },
        ..entry
    };
    let still = |n: i64| {
        let noise = Vector3::new(n as f64 * 1.3, n as f64 * 2.7, n as f64).map(f64::sin) * 0.03;
        entry(n, Vector3::zeros(), Vector3::new(1.0, 2.0, 9.5) + noise)
    };
    let change = found((0..2000).map(|n| halved(still(n), n))).accel.unwrap();
    assert_eq!(change.at, Nanos(1200 * STEP));
    assert!((change.factor - 0.5).abs() < 0.01, "{change:?}");
    // Accelerations of a walk.
    let walk = |n: i64| {
        let mut entry = swing(n);
        entry.accel.z += 2.0 * (n as f64 * 0.12).sin();
        entry
    };
    assert_eq!(found((0..3000).map(|n| halved(walk(n), n))).accel, None);
}

#[test]
fn a_gyro_that_goes_from_one_unit_to_another_is_found_where_it_does() {
    for (before, after) in [
        (1.0, 57.3),
        (57.3, 1.0),
        (1.0, 1.0 / 57.3),
        (1.0, 1000.0),
        (1000.0, 1.0),
    ] {
        let changed = |n: i64| {
            let mut entry = swing(n);
            entry.value *= if n >= 1230 { after } else { before };
            entry
        };
        let change = found((0..4000).map(changed)).gyro.unwrap();
        let late = change.at.since(Nanos(1230 * STEP)) as f64 * 1e-9;
        assert!(
            (-0.25..0.5).contains(&late),
            "{before} {after}: {late} s late"
        );
        assert!(
            (change.factor / (after / before) - 1.0).abs() < 0.01,
            "{change:?}"
        );
        assert_eq!(
            change.is_first_right,
            Some(before == 1.0),
            "{before} {after}"
        );
    }
}

#[test]
fn motion_of_any_kind_changes_no_unit() {
    let none = UnitChanges::default();
    assert_eq!(found((0..6000).map(swing)), none);
    // Falls of half a second and of four, a second of 3 g, a minute of 2 g that begins slowly.
    let with_length = |length: fn(f64) -> f64| {
        let one = |n: i64| {
            let mut entry = swing(n);
            let noise = Vector3::new(n as f64 * 1.3, n as f64 * 2.7, n as f64).map(f64::sin) * 0.05;
            entry.accel = entry.accel * length(n as f64 * 0.01) + noise;
            entry
        };
        found((0..6000).map(one))
    };
    assert_eq!(
        with_length(|t| if t % 10.0 < 0.5 { 0.0 } else { 1.0 }),
        none
    );
    assert_eq!(
        with_length(|t| if t % 20.0 > 16.0 { 0.01 } else { 1.0 }),
        none
    );
    assert_eq!(
        with_length(|t| if t % 10.0 < 1.0 { 3.0 } else { 1.0 }),
        none
    );
    assert_eq!(
        with_length(|t| 1.0 + ((t - 10.0) * 0.3).clamp(0.0, 1.0)),
        none
    );
    // Rest, then motion, then rest.
    let still = |n: i64| match n % 2000 {
        0..700 => entry(n, Vector3::new(1e-3, -2e-3, 0.0), Vector3::new(0.0, 0.0, G)),
        _ => swing(n),
    };
    assert_eq!(found((0..8000).map(still)), none);
}

#[test]
fn an_accelerometer_that_changes_its_sign_is_found_at_its_sample_and_no_motion_is() {
    let changed = |n| {
        let mut entry = swing(n);
        entry.accel *= if n >= 1200 { -1.0 } else { 1.0 };
        entry
    };
    let change = found((0..3000).map(changed)).accel.unwrap();
    assert_eq!((change.at, change.factor), (Nanos(1200 * STEP), -1.0));
    // A glitch comes back, a body that is thrown over turns, and a machine shakes by more than gravity.
    let glitch = |n| {
        let mut entry = swing(n);
        entry.accel *= if n % 400 < 3 { -1.0 } else { 1.0 };
        entry
    };
    assert_eq!(found((0..3000).map(glitch)), UnitChanges::default());
    let thrown = |n: i64| {
        let roll = std::f64::consts::PI * ((n % 300) as f64 * 0.2 - 20.0).clamp(0.0, 1.0);
        let rate = if (100..105).contains(&(n % 300)) {
            63.0
        } else {
            0.0
        };
        entry(
            n,
            Vector3::new(rate, 0.0, 0.0),
            Vector3::new(0.0, roll.sin(), roll.cos()) * G,
        )
    };
    assert_eq!(found((0..290).map(thrown)).accel, None);
    let shaken = |n: i64| {
        let force = G + 3.0 * G * (40.0 * n as f64 * 0.01).sin();
        entry(n, Vector3::zeros(), Vector3::new(0.0, 0.0, force))
    };
    assert_eq!(found((0..3000).map(shaken)).accel, None);
}
