//! Maps of single sensors against samples that were recorded as the maps make them.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::estimate::settings::{Value, defaults, row};
use crate::estimate::{Estimator, Patience, Preparation};
use crate::propagate::Sequential;
use crate::record::{AttitudeSample, Nanos};

/// A body that rolls and pitches under gravity; two seconds of rest before.
fn recorded() -> Vec<RawSample> {
    let sample = |k: i32| {
        let t = (f64::from(k) * 0.01 - 2.0).max(0.0);
        let (sin, cos) = (0.8 * t).sin_cos();
        RawSample {
            header: Some(Nanos(1_000_000_000 + i64::from(k) * 10_000_000)),
            gyro: Some([
                0.8 * f64::from(k > 200),
                0.1 * cos * f64::from(k > 200),
                0.02,
            ]),
            accel: Some([0.3, STANDARD_GRAVITY * sin, STANDARD_GRAVITY * cos]),
            mag: Some([20.0, 3.0, -40.0]),
            ..RawSample::default()
        }
    };
    (0..800).map(sample).collect()
}

fn plan(given: &[(&str, &str)]) -> EstimationSettings {
    let mut plan = defaults();
    for (name, text) in given {
        row(name)
            .unwrap()
            .apply(&mut plan, &Value::Text(text))
            .unwrap();
    }
    plan.check().unwrap();
    plan
}

fn attitudes(plan: &EstimationSettings, samples: &[RawSample]) -> Vec<AttitudeSample> {
    let meaning = Meaning::new(plan, &Declared::default());
    let mut preparation = Preparation::new(plan, &meaning, Patience::WholeLog);
    for sample in samples {
        preparation.take(sample).unwrap();
    }
    let prepared = preparation.decide().unwrap();
    let mut estimator = Estimator::new(plan, &meaning, &prepared).unwrap();
    samples.iter().for_each(|sample| estimator.take(sample));
    estimator.finish(&Sequential)
}

/// Largest angle between two runs, rad.
fn farthest(some: &[AttitudeSample], others: &[AttitudeSample]) -> f64 {
    assert_eq!(some.len(), others.len());
    let angle = |(a, b): (&AttitudeSample, &AttitudeSample)| {
        let [w, x, y, z] = (a.q_nb.inverse() * b.q_nb).wxyz();
        2.0 * x.hypot(y).hypot(z).atan2(w.abs())
    };
    some.iter().zip(others).map(angle).fold(0.0, f64::max)
}

#[test]
fn a_map_of_one_sensor_is_as_if_it_had_been_recorded_so() {
    let good = recorded();
    for body in ["flu", "frd", "YxZ"] {
        let common = ("body", body);
        let expected = attitudes(&plan(&[common]), &good);
        // Recorded as x' = -y, y' = z, z' = -x: to be undone by x = -z', y = -x', z = y'.
        let bad: Vec<RawSample> = good
            .iter()
            .map(|raw| RawSample {
                gyro: raw.gyro.map(|[x, y, z]| [-y, z, -x]),
                ..*raw
            })
            .collect();
        let cured = attitudes(&plan(&[common, ("gyro_axes", "zxY")]), &bad);
        assert!(farthest(&expected, &cured) < 1e-12, "{body}");
        assert!(farthest(&expected, &attitudes(&plan(&[common]), &bad)) > 0.5);
    }
}

#[test]
fn factors_and_maps_of_all_sensors_are_as_if_recorded_so() {
    let good = recorded();
    // Counts of a sensor whose driver exchanges the axes of each of its parts.
    let bad: Vec<RawSample> = good
        .iter()
        .map(|raw| RawSample {
            gyro: raw
                .gyro
                .map(|[x, y, z]| [-y * 1000.0, x * 2000.0, z * 500.0]),
            accel: raw
                .accel
                .map(|[x, y, z]| [z * 200.0, x * 200.0, -y * 200.0]),
            mag: raw.mag.map(|[x, y, z]| [y, x, -z]),
            ..*raw
        })
        .collect();
    let common = [("aid", "gravity+mag"), ("body", "frd"), ("gyro_range", "8")];
    let maps = [
        ("gyro_axes", "YxZ"),
        ("gyro_scale", "0.001,0.0005,0.002"),
        ("accel_axes", "YzX"),
        ("accel_scale", "0.005"),
        ("mag_axes", "YXz"),
    ];
    let expected = attitudes(&plan(&common), &good);
    let cured = attitudes(&plan(&[&common[..], &maps[..]].concat()), &bad);
    assert!(farthest(&expected, &cured) < 1e-9);
    // Ranges are those of the sensor, not of its counts: nothing is flagged.
    assert_eq!(expected[400].status, cured[400].status);
    let uncured = plan(&[&common[..], &maps[2..4]].concat());
    assert!(farthest(&expected, &attitudes(&uncured, &bad)) > 0.5);
}

#[test]
fn a_map_may_mirror_and_is_in_what_others_are_sent() {
    let plan = plan(&[("gyro_axes", "xYZ")]);
    let meaning = Meaning::new(&plan, &Declared::default());
    let sent = meaning.in_flu(&recorded()[300]);
    assert_eq!(sent.gyro.unwrap()[0], -0.8);
    assert_eq!(sent.accel, recorded()[300].accel);
    assert_eq!(
        meaning.turned([1.0, 2.0, 3.0], 1.0).0,
        Vector3::new(-1.0, 2.0, 3.0)
    );
}
