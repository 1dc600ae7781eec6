//! The same numbers as an independent reference (numpy), on motions that both make.
#![allow(clippy::unwrap_used)]

mod simulation;

use self::simulation::{Sample, roll_only, simulate};
use super::bank::WANDERS;
use super::*;
use crate::propagate::shared_data;
use crate::quaternion::BodyRate;
use serde_json::Value;
use std::fs;

/// Printed with nine digits.
const ROUNDED: f64 = 1e-6;

fn golden() -> Value {
    let path = shared_data::shared("oracle/consistency/golden.json").unwrap();
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

fn numbers(value: &Value, out: &mut Vec<f64>) {
    match value {
        Value::Array(all) => all.iter().for_each(|one| numbers(one, out)),
        other => out.push(other.as_f64().unwrap()),
    }
}

fn close<'a>(name: &str, value: &Value, ours: impl IntoIterator<Item = &'a f64>) {
    let mut theirs = Vec::new();
    numbers(value, &mut theirs);
    let ours: Vec<f64> = ours.into_iter().copied().collect();
    assert_eq!(theirs.len(), ours.len(), "{name}");
    for (their, our) in theirs.iter().zip(&ours) {
        let is_near = (their - our).abs() <= ROUNDED * (1.0 + their.abs());
        assert!(is_near, "{name}: {their} and {our}");
    }
}

fn watch(samples: &[Sample], map: &Matrix3<f64>, watch: &mut Consistency) {
    for (n, sample) in samples.iter().enumerate() {
        watch.push(&Reading {
            stamp: Nanos(n as i64 * 20_000_000),
            gyro: Measured::Rate(BodyRate(map * sample.rate)),
            force: sample.force,
        });
    }
}

fn watched(samples: &[Sample], map: &Matrix3<f64>) -> Consistency {
    let mut consistency = Consistency::default();
    watch(samples, map, &mut consistency);
    consistency
}

/// All segments that move.
fn segments(samples: &[Sample], map: &Matrix3<f64>) -> Vec<Segment> {
    let mut consistency = Consistency {
        bank: Some(Evidence::new()),
        ..Consistency::default()
    };
    watch(samples, map, &mut consistency);
    consistency.kept.into_iter().collect()
}

fn diagonal(x: f64, y: f64, z: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(x, y, z))
}

fn every_entry() -> [Matrix3<f64>; 9] {
    std::array::from_fn(|i| {
        let mut direction = Matrix3::zeros();
        direction[(i / 3, i % 3)] = 1.0;
        direction
    })
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_scatter_of_a_segment_is_that_of_the_reference() {
    let golden = golden();
    let samples = simulate(2000, 0.0);
    let sample = &samples[200];
    close("rate", &golden["sample_200"]["w"], sample.rate.as_slice());
    close("force", &golden["sample_200"]["f"], sample.force.as_slice());
    let segment = &segments(&samples, &Matrix3::identity())[2];
    let one = |map: &Matrix3<f64>| segment.scatter::<3>(map, &[], &Vector3::zeros());
    let found = [
        one(&Matrix3::identity()),
        one(&diagonal(1.0, 1.0, -1.0)),
        one(&diagonal(1.25, 1.25, 1.25)),
    ];
    let golden = &golden["segment"];
    close("s", &golden["s"], &found.map(|found| found.s));
    close("b", &golden["b"], found.iter().flat_map(|found| &found.b));
    close(
        "A",
        &golden["A_identity"],
        found[0].a.transpose().as_slice(),
    );
    let full = segment.scatter::<12>(&Matrix3::identity(), &every_entry(), &Vector3::zeros());
    close("s of all", &golden["s_full"], &[full.s]);
    close("b of all", &golden["b_full"], full.b.as_slice());
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_bank_says_what_the_reference_says() {
    let golden = golden();
    let (still, walking) = (simulate(2000, 0.0), simulate(2000, 2.0));
    let reversed = diagonal(-1.0, 1.0, 1.0);
    let all = |factor: f64| Matrix3::from_diagonal_element(factor);
    for (name, samples, map) in [
        ("as it is", &still, all(1.0)),
        ("walking", &walking, all(1.0)),
        ("-x", &still, reversed),
        (
            "y,x,z",
            &still,
            Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        ),
        ("-x walking", &walking, reversed),
        ("half", &still, all(0.5)),
        ("twice", &still, all(2.0)),
        ("degrees", &still, all(57.29578)),
        ("roll only, -x", &roll_only(), reversed),
    ] {
        let theirs = &golden["verdict"][name];
        let ours = watched(samples, &map);
        assert_eq!(theirs["bank"], ours.bank.is_some(), "{name}");
        assert_eq!(theirs["held"], ours.held, "{name}");
        let Some(verdict) = ours.bank.as_ref().and_then(Evidence::verdict) else {
            assert_eq!(theirs["kind"], "none", "{name}");
            continue;
        };
        let (kind, seen) = match verdict.answer {
            Answer::Map(decided) => ("map", decided),
            Answer::Factor | Answer::Degrees => ("factor", [false; 3]),
            Answer::Unturned => ("none", [false; 3]),
            Answer::EulerRates => ("euler", [false; 3]),
            Answer::Contradiction => ("contradict", [false; 3]),
        };
        let seen = ["x", "y", "z"].into_iter().zip(seen).filter(|(_, is)| *is);
        let seen: String = seen.map(|(axis, _)| axis).collect();
        assert_eq!(theirs["kind"], kind, "{name}");
        assert_eq!(theirs["seen"], seen.as_str(), "{name}");
        if verdict.answer == Answer::Factor {
            // The reference knows powers of 1.25 alone; what units make lies between them.
            let found = BANK[verdict.hypothesis].factor.unwrap();
            let wanted = 1.0 / map[(0, 0)];
            assert!((found / wanted - 1.0).abs() < 1e-6, "{name}: {found}");
            let their_scatter = theirs["r_found"].as_f64().unwrap();
            assert!(verdict.found < their_scatter, "{name}");
            continue;
        }
        assert_eq!(theirs["h"], verdict.hypothesis, "{name}");
        assert_eq!(theirs["segments"], verdict.segments, "{name}");
        for (key, value) in [
            ("E", verdict.evidence),
            ("r_identity", verdict.identity),
            ("r_found", verdict.found),
            ("share", verdict.share),
        ] {
            close(&format!("{name} {key}"), &theirs[key], &[value]);
        }
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_refined_map_is_that_of_the_reference() {
    fn holds<const P: usize>(name: &str, recorded: &Matrix3<f64>, directions: &[Matrix3<f64>]) {
        let theirs = &golden()["refine"][name];
        let segments = segments(&simulate(2000, 0.0), recorded);
        let found = refine::<P>(segments.iter(), &Matrix3::identity(), directions).unwrap();
        close(name, &theirs["M"], found.map.transpose().as_slice());
        close(name, &theirs["sigma"], found.sigma.iter().skip(3));
    }
    let axes = [0, 1, 2].map(|axis| Vector3::ith(axis, 1.0));
    holds::<4>("0.8", &diagonal(0.8, 0.8, 0.8), &[Matrix3::identity()]);
    let axis = nalgebra::Unit::new_normalize(Vector3::new(1.0, 2.0, -2.0));
    let turned = nalgebra::Rotation3::from_axis_angle(&axis, 15_f64.to_radians());
    let turns = axes.map(|axis| axis.cross_matrix());
    holds::<6>("turned by 15 deg", turned.matrix(), &turns);
    let single = axes.map(|axis| Matrix3::from_diagonal(&axis));
    holds::<6>("z times 1.3", &diagonal(1.0, 1.0, 1.3), &single);
}

#[test]
fn a_disagreement_names_what_cures_it() {
    let samples = simulate(2000, 2.0);
    assert_eq!(watched(&samples, &Matrix3::identity()).disagreement(), None);
    // Recorded x is true -y, and so on.
    let recorded = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0);
    let found = watched(&samples, &recorded).disagreement().unwrap();
    let Cause::Axes {
        map,
        decided,
        scale: None,
    } = found.cause
    else {
        panic!("{found:?}")
    };
    assert_eq!((map.to_string().as_str(), decided), ("ZxY", [true; 3]));
    assert!(found.recorded > 0.1 && found.cured < 0.01, "{found:?}");
    for factor in [0.5, 1.7, 16.4 * 57.29578, 0.2] {
        let found = watched(&samples, &Matrix3::from_diagonal_element(factor));
        let found = found.disagreement().unwrap_or_else(|| panic!("{factor}"));
        let Cause::Scale { factor: by, sigma } = found.cause else {
            panic!("{factor}: {found:?}")
        };
        assert!((by * factor - 1.0).abs() < 0.02, "{factor}: {found:?}");
        assert!(sigma < 0.05 && found.cured < 0.01, "{found:?}");
    }
}

#[test]
fn what_no_map_of_the_bank_explains_is_named_all_the_same() {
    let samples = simulate(3000, 2.0);
    let swapped = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    for recorded in [57.29578, 2.0, 0.5, 16.4 * 57.29578, 1e3] {
        let found = watched(&samples, &(swapped * recorded));
        let found = found.disagreement().unwrap_or_else(|| panic!("{recorded}"));
        let Cause::Axes {
            map,
            decided,
            scale: Some((factor, sigma)),
        } = found.cause
        else {
            panic!("{recorded}: {found:?}")
        };
        assert_eq!((map.to_string().as_str(), decided), ("YxZ", [true; 3]));
        assert!((factor * recorded - 1.0).abs() < 0.02, "{found:?}");
        assert!(sigma < 0.05 && found.cured < 0.01 && found.recorded > 0.05);
    }
    for (x, y, z) in [(1.0, 1.0, 0.6), (1.0, 2.0, 1.0), (0.5, 1.0, 2.0)] {
        let found = watched(&samples, &diagonal(x, y, z)).disagreement();
        let found = found.unwrap_or_else(|| panic!("{x} {y} {z}"));
        let Cause::Scales { factors, sigma } = found.cause else {
            panic!("{found:?}")
        };
        let back = [factors[0] * x, factors[1] * y, factors[2] * z];
        assert!(back.iter().all(|f| (f - 1.0).abs() < 0.03), "{found:?}");
        assert!(sigma < 0.08 && found.cured < 0.01, "{found:?}");
    }
    for degrees in [20.0, -45.0] {
        let axis = nalgebra::Unit::new_normalize(Vector3::new(1.0, 2.0, -2.0));
        let by = nalgebra::Rotation3::from_axis_angle(&axis, f64::to_radians(degrees));
        let found = watched(&samples, by.matrix()).disagreement();
        let found = found.unwrap_or_else(|| panic!("{degrees}"));
        let Cause::Turned {
            by: back, angle, ..
        } = found.cause
        else {
            panic!("{found:?}")
        };
        assert!(
            (angle.to_degrees() - degrees.abs()).abs() < 1.0,
            "{found:?}"
        );
        let left = (back * by.matrix() - Matrix3::identity()).abs().max();
        assert!(left < 0.02 && found.cured < 0.01, "{found:?}");
    }
}

#[test]
fn hostile_readings_are_passed_over_and_memory_stays_bounded() {
    let samples = simulate(2000, 0.0);
    let mut consistency = Consistency::default();
    for round in 0..5 {
        watch(&samples, &diagonal(-1.0, 1.0, 1.0), &mut consistency);
        for number in [f64::NAN, f64::INFINITY, 1e300, 0.0] {
            consistency.push(&Reading {
                stamp: Nanos(i64::MAX - round),
                gyro: Measured::Rate(BodyRate(Vector3::repeat(number))),
                force: Vector3::repeat(number),
            });
        }
    }
    assert!(consistency.run.len() <= 202 && consistency.kept.len() <= REFINED_BY);
    assert!(consistency.disagreement().is_some());
    let mut dead = Consistency::default();
    let none = vec![Sample::default(); 2000];
    watch(&none, &Matrix3::identity(), &mut dead);
    assert_eq!(dead.disagreement(), None);
}

/// A stream whose maps change at a reading.
fn changed(samples: &[Sample], from: &Matrix3<f64>, at: usize, to: &Matrix3<f64>) -> Consistency {
    let mut consistency = Consistency::default();
    for (n, sample) in samples.iter().enumerate() {
        let map = if n < at { from } else { to };
        consistency.push(&Reading {
            stamp: Nanos(n as i64 * 20_000_000),
            gyro: Measured::Rate(BodyRate(map * sample.rate)),
            force: sample.force,
        });
    }
    consistency
}

#[test]
fn axes_that_change_half_way_are_named_with_the_moment_and_those_of_a_whole_stream_are_not() {
    let identity = Matrix3::identity();
    let swapped = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let circled = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let reversed = diagonal(-1.0, 1.0, 1.0);
    for walk in [0.0, 2.0] {
        let samples = simulate(3000, walk);
        for (map, name) in [(swapped, "YXZ"), (circled, "YZX"), (reversed, "xYZ")] {
            for (from, to) in [(identity, map), (map, identity)] {
                let change = changed(&samples, &from, 1500, &to).axes_change();
                let change =
                    change.unwrap_or_else(|| panic!("{name} {walk}: {}", from == identity));
                assert_eq!(change.map.to_string(), name);
                assert_eq!(change.is_first_right, from == identity);
                let off = change.at().secs_since(Nanos(30_000_000_000));
                assert!(off.abs() < 2.5, "{name} {walk}: {off}");
            }
            let whole = watched(&samples, &map);
            assert!(whole.disagreement().is_some() && whole.axes_change().is_none());
        }
        let sound = watched(&samples, &identity);
        assert!(sound.agrees() && sound.axes_change().is_none());
    }
}

#[test]
fn a_gyro_that_reads_nothing_where_gravity_turns_is_named_and_one_of_a_body_at_rest_is_not() {
    let samples = simulate(3000, 2.0);
    let absent = watched(&samples, &Matrix3::zeros()).disagreement().unwrap();
    assert_eq!(absent.cause, Cause::Unturned);
    assert!(absent.recorded > WANDERS, "{absent:?}");
    let mut rest = Consistency::default();
    for n in 0..3000 {
        rest.push(&Reading {
            stamp: Nanos(n * 20_000_000),
            gyro: Measured::Rate(BodyRate(Vector3::zeros())),
            force: Vector3::new(0.0, 0.0, 9.81),
        });
    }
    assert_eq!(rest.disagreement(), None);
}

/// A leg that swings to and fro by 20 degrees, its rates times `factor`.
fn swing(factor: f64) -> Consistency {
    let mut consistency = Consistency::default();
    for n in 0..6000 {
        let t = n as f64 * 0.01;
        let at = 2.0 * std::f64::consts::PI * 0.9;
        let (pitch, rate) = (0.35 * (at * t).sin(), 0.35 * at * (at * t).cos());
        consistency.push(&Reading {
            stamp: Nanos(n * 10_000_000),
            gyro: Measured::Rate(BodyRate(Vector3::new(0.0, rate * factor, 0.0))),
            force: Vector3::new(-pitch.sin(), 0.0, pitch.cos()) * 9.81,
        });
    }
    consistency
}

#[test]
fn a_swing_in_degrees_is_told_by_rates_that_no_gyro_has() {
    let found = swing(1.0 / DEGREE).disagreement().unwrap();
    assert!(
        matches!(found.cause, Cause::Scale { factor, .. } if factor == DEGREE),
        "{found:?}"
    );
    assert_eq!(swing(1.0).disagreement(), None);
}

#[test]
fn gravity_that_leaps_where_both_sensors_change_axes_is_named_with_the_moment_and_motion_is_no_leap()
 {
    let quarter = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    for walk in [0.0, 1.5] {
        let samples = simulate(2000, walk);
        assert_eq!(watched(&samples, &Matrix3::identity()).gravity_leap(), None);
        let mounted_anew: Vec<Sample> = samples
            .iter()
            .enumerate()
            .map(|(n, sample)| match n {
                ..1003 => *sample,
                _ => Sample {
                    rate: quarter * sample.rate,
                    force: quarter * sample.force,
                    ..*sample
                },
            })
            .collect();
        let found = watched(&mounted_anew, &Matrix3::identity());
        let leap = found.gravity_leap().unwrap();
        let secs = leap.at.0 as f64 * 1e-9;
        assert!((secs - 20.06).abs() < 0.05, "{leap:?}");
        assert!((60.0..120.0).contains(&leap.angle.to_degrees()), "{leap:?}");
        assert_eq!(leap.count, 1);
        assert_eq!(found.disagreement(), None);
    }
}

#[test]
fn derivatives_of_roll_pitch_and_yaw_are_told_from_rates_of_the_body_whichever_side_is_up() {
    let samples = simulate(2000, 0.5);
    for up in [1.0, -1.0] {
        let map = diagonal(1.0, up, up);
        let angles: Vec<Sample> = samples
            .iter()
            .map(|sample| Sample {
                rate: map * sample.angles,
                force: map * sample.force,
                ..*sample
            })
            .collect();
        let found = watched(&angles, &Matrix3::identity())
            .disagreement()
            .unwrap();
        assert_eq!(found.cause, Cause::EulerRates, "{found:?}");
        assert!(found.cured < 0.3 * found.recorded, "{found:?}");
    }
    // About one axis they are the same.
    assert_eq!(
        watched(&roll_only(), &Matrix3::identity()).disagreement(),
        None
    );
}

#[test]
fn a_bias_that_changes_is_named_with_its_size_and_a_constant_one_is_not() {
    let by = Vector3::new(0.05, -0.04, 0.03);
    for walk in [0.0, 1.0] {
        let samples = simulate(4000, walk);
        let biased = |from: usize| -> Vec<Sample> {
            let all = samples.iter().enumerate();
            all.map(|(n, sample)| Sample {
                rate: sample.rate + if n < from { Vector3::zeros() } else { by },
                ..*sample
            })
            .collect()
        };
        let of = |samples: &[Sample]| watched(samples, &Matrix3::identity()).bias_change();
        assert_eq!(of(&samples), None);
        assert_eq!(of(&biased(0)), None);
        let change = of(&biased(2000)).unwrap();
        let secs = change.at.0 as f64 * 1e-9;
        assert!((secs - 40.0).abs() <= 4.0, "{change:?}");
        assert!((change.by - by).norm() < 0.4 * by.norm(), "{change:?}");
        assert!(change.cured < 0.7 * change.recorded, "{change:?}");
    }
}
