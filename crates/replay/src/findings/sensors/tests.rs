//! Faults of one sensor put into a clean motion: each is found, its cure cures it, and the clean motion has none.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::finding::{GRAVITY_LEAP, GYRO_BIAS_CHANGE};
use crate::pipeline::samples::estimate;
use nalgebra::{Matrix3, Vector3};
use strapd_attitude::estimate::settings::{Value, defaults, row};
use strapd_attitude::record::{Nanos, RawSample};
use strapd_attitude::setting::{BODY, MEND};
use strapd_bodies::motion::BandLimited;

const RATE_HZ: i64 = 50;

/// Half a minute of a body that rotates about every axis after 2 s of rest, and gravity's reaction alone.
fn clean() -> Vec<RawSample> {
    moved(0.8, 1.5)
}

/// The same with larger turns, by which single axes are told.
fn widely() -> Vec<RawSample> {
    moved(1.5, 0.5)
}

fn moved(rms: f64, band: f64) -> Vec<RawSample> {
    lasting(32, (rms, band))
}

fn lasting(secs: i64, (rms, band): (f64, f64)) -> Vec<RawSample> {
    let mut motion = BandLimited::random(3, rms, band, 6).unwrap();
    let step = 1_000_000_000 / RATE_HZ;
    let sample = |k: i64| {
        let moving = (k - 2 * RATE_HZ).max(0);
        let spin = motion.at_nanos((moving * step) as u64);
        let up = spin.q_nb.to_dcm().as_matrix().transpose() * Vector3::z();
        RawSample {
            header: Some(Nanos(1_700_000_000_000_000_000 + k * step)),
            log: Nanos(1_700_000_000_000_000_000 + k * step),
            gyro: Some(match moving {
                0 => [0.0; 3],
                _ => spin.w_nb_b.into(),
            }),
            accel: Some((up * 9.80665).into()),
            ..RawSample::default()
        }
    };
    (0..secs * RATE_HZ).map(sample).collect()
}

fn by_gyro(samples: &[RawSample], map: &Matrix3<f64>) -> Vec<RawSample> {
    let mapped = |raw: &RawSample| RawSample {
        gyro: raw.gyro.map(|v| (map * Vector3::from(v)).into()),
        ..*raw
    };
    samples.iter().map(mapped).collect()
}

fn found(samples: &[RawSample], given: &[Choice]) -> Vec<Finding> {
    let mut plan = defaults();
    for choice in given {
        let row = row(choice.setting.name()).unwrap();
        row.apply(&mut plan, &Value::Text(&choice.value)).unwrap();
    }
    let summary = estimate(&plan, samples.iter().copied(), |_| Ok::<(), ()>(()));
    let codes = [
        AXES,
        SCALE,
        TURNED,
        GYRO_EULER_RATES,
        GRAVITY_LEAP,
        GYRO_BIAS_CHANGE,
        "gyro-against-gravity",
        "unit-degrees",
        "under-sampled",
    ];
    let mut all = summary.unwrap().findings;
    all.retain(|finding| codes.contains(&finding.code));
    all
}

#[test]
fn axes_of_the_gyro_are_named_and_the_map_that_is_advised_cures_them() {
    let clean = clean();
    assert_eq!(found(&clean, &[]), []);
    let exchanged = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let cyclic = Matrix3::new(0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let reversed = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
    for (recorded, words) in [
        (
            exchanged,
            "the true rate about x is the recorded y, about y is the recorded x",
        ),
        (reversed, "the true rate about z is the recorded -z"),
        (
            cyclic,
            "about x is the recorded y, about y is the recorded -z, about z is the recorded -x",
        ),
    ] {
        let bad = by_gyro(&clean, &recorded);
        // However the body is mounted, and whatever map is given already.
        for given in [
            vec![],
            vec![BODY.to("frd")],
            vec![BODY.to("YxZ"), GYRO_AXES.to("zXY")],
        ] {
            let is_mapped = given.len() > 1;
            let all = found(&bad, &given);
            let [finding] = all.as_slice() else {
                panic!("{given:?}: {all:?}")
            };
            assert_eq!((finding.code, finding.severity), (AXES, Severity::Error));
            assert!(is_mapped || finding.what.contains(words), "{finding:?}");
            let mut cured = given;
            cured.retain(|choice| choice.setting != GYRO_AXES);
            cured.push(finding.help[0][0].clone());
            assert_eq!(found(&bad, &cured), [], "{cured:?}");
        }
    }
}

#[test]
fn axes_in_another_unit_are_named_and_both_are_cured() {
    let clean = clean();
    let exchanged = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    for (factor, words) in [
        (1_f64.to_degrees(), "; they look like deg/s"),
        (131_f64.to_degrees(), "; counts of a range of 250 deg/s"),
        (2.0, "; read with twice of its range"),
    ] {
        let bad = by_gyro(&clean, &(exchanged * factor));
        for given in [vec![], vec![BODY.to("YxZ"), GYRO_AXES.to("zXY")]] {
            let all = found(&bad, &given);
            let finding = all.iter().find(|finding| finding.code == AXES);
            let finding = finding.unwrap_or_else(|| panic!("{factor} {given:?}: {all:?}"));
            assert!(finding.what.contains(words), "{finding:?}");
            let mut cured = given;
            cured.retain(|choice| choice.setting != GYRO_AXES);
            cured.extend(finding.help[0].clone());
            assert_eq!(found(&bad, &cured), [], "{cured:?}");
        }
    }
}

#[test]
fn the_scale_of_single_axes_is_named_by_the_recorded_columns() {
    let good = widely();
    for scales in [[1.0, 2.0, 1.0], [1.0, 1.0, 0.6], [0.5, 1.0, 2.0]] {
        let bad = by_gyro(&good, &Matrix3::from_diagonal(&scales.into()));
        for given in [vec![], vec![BODY.to("frd")]] {
            let all = found(&bad, &given);
            let [finding] = all.as_slice() else {
                panic!("{scales:?} {given:?}: {all:?}")
            };
            assert_eq!((finding.code, finding.severity), (SCALE, Severity::Error));
            let mut cured = given;
            cured.push(finding.help[0][0].clone());
            let factors = cured.last().unwrap().value.split(',');
            let left = factors
                .zip(scales)
                .map(|(f, s)| f.parse::<f64>().unwrap() * s - 1.0);
            assert!(left.clone().all(|left| left.abs() < 0.03), "{finding:?}");
            assert_eq!(found(&bad, &cured), [], "{cured:?}");
        }
    }
    // Columns that are mapped: a factor belongs to what was recorded.
    let exchanged = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let doubled = Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, 1.0));
    let all = found(
        &by_gyro(&good, &(doubled * exchanged)),
        &[GYRO_AXES.to("YXZ")],
    );
    let cure = &all[0].help[0][0];
    assert!(
        cure.value.starts_with("0.5") || cure.value.starts_with("0.49"),
        "{all:?}"
    );
    assert!(all[0].what.contains("about y"), "{all:?}");
}

#[test]
fn a_gyro_that_is_turned_is_said_with_the_matrix_that_turns_it_back() {
    let axis = nalgebra::Unit::new_normalize(Vector3::new(1.0, 2.0, -2.0));
    let turned = nalgebra::Rotation3::from_axis_angle(&axis, 0.2);
    let all = found(&by_gyro(&widely(), turned.matrix()), &[]);
    let [finding] = all.as_slice() else {
        panic!("{all:?}")
    };
    assert_eq!(
        (finding.code, finding.severity),
        (TURNED, Severity::Warning)
    );
    let (_, matrix) = finding.advice.split_once("`G = ").unwrap();
    let rows: Vec<Vec<f64>> = serde_json::from_str(matrix.split_once('`').unwrap().0).unwrap();
    let by = Matrix3::from_fn(|row, column| rows[row][column]) + Matrix3::identity();
    let left = (by * turned.matrix() - Matrix3::identity()).abs().max();
    let sigma = finding.evidence["sigma_deg"].as_f64().unwrap().to_radians();
    assert!(left < 2.0 * sigma, "{left} {finding:?}");
    assert!(sigma < 0.025, "{finding:?}");
    let far = nalgebra::Rotation3::from_axis_angle(&axis, 0.7);
    let all = found(&by_gyro(&widely(), far.matrix()), &[]);
    assert!(all[0].advice.contains("no setting turns"), "{all:?}");
}

#[test]
fn the_scale_of_the_gyro_is_named_and_what_is_advised_cures_it() {
    let clean = clean();
    let deg = 1_f64.to_degrees();
    for (factor, words, cure) in [
        (0.5, "read with half of its range", GYRO_SCALE.to("2.000")),
        (2.0, "read with twice of its range", GYRO_SCALE.to("0.5000")),
        (deg, "they look like deg/s", GYRO_UNIT.to("deg")),
        (1000.0, "they look like mrad/s", GYRO_UNIT.to("mrad")),
        (
            16.4 * deg,
            "counts of a range of 2000 deg/s",
            GYRO_SCALE.to("0.001064"),
        ),
        (
            65.5 * deg,
            "counts of a range of 500 deg/s",
            GYRO_SCALE.to("0.0002665"),
        ),
        (
            131.0 * deg,
            "counts of a range of 250 deg/s",
            GYRO_SCALE.to("0.0001332"),
        ),
    ] {
        let bad = by_gyro(&clean, &Matrix3::from_diagonal_element(factor));
        let all = found(&bad, &[]);
        let cause = all.iter().find(|finding| finding.code == SCALE);
        let cause = cause.unwrap_or_else(|| panic!("{factor}: {all:?}"));
        assert!(cause.what.contains(words), "{cause:?}");
        assert_eq!(
            cause.help,
            [vec![cure.clone()], vec![MEND.into()]],
            "{cause:?}"
        );
        assert_eq!(found(&bad, &[cure]), []);
    }
    // Rad/s that are taken for deg/s, in motions that tell the factor and that tell its order of size.
    for moved in [&clean, &lasting(32, (2.5, 3.0))] {
        let all = found(moved, &[GYRO_UNIT.to("deg")]);
        let cause = all.iter().find(|finding| finding.code == SCALE);
        let cause = cause.unwrap_or_else(|| panic!("{all:?}"));
        assert!(cause.what.contains("they look like rad/s"), "{cause:?}");
        assert_eq!(cause.help[0], [GYRO_UNIT.to("rad")], "{cause:?}");
    }
    let bad = by_gyro(&clean, &Matrix3::from_diagonal_element(0.6));
    let all = found(&bad, &[]);
    let [finding] = all.as_slice() else {
        panic!("{all:?}")
    };
    let [[cure], [mend]] = finding.help.iter().map(Vec::as_slice).collect::<Vec<_>>()[..] else {
        panic!("{finding:?}")
    };
    assert_eq!(*mend, MEND.into());
    let advised: f64 = cure.value.parse().unwrap();
    assert!((advised * 0.6 - 1.0).abs() < 0.02, "{finding:?}");
}

#[test]
fn a_guess_gives_way_to_a_cause_and_words_that_agree_stay() {
    let guess = |unit: &str| {
        Finding::new(Severity::Error, "unit-against-gravity", "").help([GYRO_UNIT.to(unit)])
    };
    let cause = |cure: Choice| {
        Finding::new(Severity::Error, SCALE, "")
            .with("factor", 1e-3)
            .help([cure])
    };
    let codes = |mut all: Vec<Finding>| {
        settle(&mut all);
        all.iter().map(|finding| finding.code).collect::<Vec<_>>()
    };
    let steps = || Finding::new(Severity::Error, "under-sampled", "");
    assert_eq!(
        codes(vec![guess("deg"), steps()]),
        ["unit-against-gravity", "under-sampled"]
    );
    let same = vec![guess("deg"), steps(), cause(GYRO_UNIT.to("deg"))];
    assert_eq!(codes(same), ["unit-against-gravity", "under-sampled"]);
    let other = vec![
        guess("mrad"),
        guess("deg"),
        steps(),
        cause(GYRO_SCALE.to("0.001064")),
    ];
    assert_eq!(codes(other), [SCALE]);
}

#[test]
fn a_factor_of_which_only_the_order_of_size_is_known_is_no_error_unless_it_is_a_units() {
    let severity = |factor: f64, sigma: f64| {
        let found = Disagreement {
            cause: Cause::Scale { factor, sigma },
            recorded: 0.085,
            cured: 0.04,
            segments: 7,
        };
        let plan = EstimationSettings::default();
        let consistency = Consistency::default();
        of_scale(
            (&found, &consistency),
            (factor, sigma),
            (&plan, GyroUnit::Rad),
        )
        .severity
    };
    // As a run, simulated without any error of its sensor, looked like.
    assert_eq!(severity(3.0, 0.07), Severity::Warning);
    assert_eq!(severity(0.02, 0.3), Severity::Error);
    assert_eq!(severity(2.0, 0.01), Severity::Error);
}

#[test]
fn both_sensors_in_other_axes_are_a_leap_of_gravity_and_each_part_by_itself_is_none() {
    let clean = clean();
    let quarter = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    let (before, behind) = clean.split_at(903);
    let turned = |v: [f64; 3]| (quarter * Vector3::from(v)).into();
    let behind: Vec<RawSample> = behind
        .iter()
        .map(|raw| RawSample {
            gyro: raw.gyro.map(turned),
            accel: raw.accel.map(turned),
            ..*raw
        })
        .collect();
    let all = found(&[before, &behind].concat(), &[]);
    let [leap] = all.as_slice() else {
        unreachable!("{all:?}")
    };
    assert_eq!((leap.code, leap.severity), (GRAVITY_LEAP, Severity::Error));
    assert!(leap.what.contains("18.1 s after the start"), "{leap:?}");
    let help: Vec<String> = leap.help.iter().flatten().map(Choice::to_string).collect();
    assert!(
        help[0].ends_with("17.9") && help[1].ends_with("18.2"),
        "{help:?}"
    );
    assert_eq!(found(before, &[]), []);
    assert_eq!(found(&behind, &[]), []);
}

#[test]
fn derivatives_of_angles_are_named_and_the_body_rates_of_the_same_motion_are_not() {
    let step = 1_000_000_000 / RATE_HZ;
    let of = |is_body: bool| -> Vec<RawSample> {
        let sample = |k: i64| {
            let t = k as f64 / RATE_HZ as f64;
            let swing = |size: f64, w: f64| (size * (w * t).sin(), size * w * (w * t).cos());
            let [(r, dr), (p, dp), (_, dy)] = [swing(0.8, 1.7), swing(0.7, 1.1), swing(2.0, 0.6)];
            let ((sr, cr), (sp, cp)) = (r.sin_cos(), p.sin_cos());
            let body = [dr - dy * sp, dp * cr + dy * cp * sr, dy * cp * cr - dp * sr];
            RawSample {
                header: Some(Nanos(k * step)),
                log: Nanos(k * step),
                gyro: Some(if is_body { body } else { [dr, dp, dy] }),
                accel: Some([-sp, sr * cp, cr * cp].map(|share| share * 9.80665)),
                ..RawSample::default()
            }
        };
        (1..32 * RATE_HZ).map(sample).collect()
    };
    assert_eq!(found(&of(true), &[]), []);
    let all = found(&of(false), &[]);
    let [one] = all.as_slice() else {
        unreachable!("{all:?}")
    };
    assert_eq!(
        (one.code, one.severity),
        (GYRO_EULER_RATES, Severity::Error)
    );
    assert!(one.advice.contains("g with the rates taken so"), "{one:?}");
}

#[test]
fn a_bias_that_changes_is_named_and_each_part_by_itself_has_none() {
    let clean = lasting(72, (0.8, 1.5));
    assert_eq!(found(&clean, &[]), []);
    let (before, behind) = clean.split_at(36 * RATE_HZ as usize);
    let behind: Vec<RawSample> = behind
        .iter()
        .map(|raw| RawSample {
            gyro: raw.gyro.map(|[x, y, z]| [x + 0.06, y - 0.05, z + 0.04]),
            ..*raw
        })
        .collect();
    let all = found(&[before, &behind].concat(), &[]);
    let [one] = all.as_slice() else {
        unreachable!("{all:?}")
    };
    assert_eq!(
        (one.code, one.severity),
        (GYRO_BIAS_CHANGE, Severity::Warning)
    );
    assert!(one.advice.contains("g under two"), "{one:?}");
    assert_eq!(one.help.len(), 2, "{one:?}");
    assert_eq!(found(before, &[]), []);
    assert_eq!(found(&behind, &[]), []);
}
