//! Faults of a magnetometer put into a clean motion: each is found, its cure cures it, and the clean motion has none.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::pipeline::samples::estimate;
use nalgebra::Vector3;
use strapd_attitude::estimate::settings::{Value, defaults, row};
use strapd_attitude::record::{Nanos, RawSample};
use strapd_attitude::setting::{Choice, MEND};
use strapd_bodies::motion::BandLimited;

const RATE_HZ: i64 = 50;
/// East, north, up, in tesla.
const FIELD: Vector3<f64> = Vector3::new(0.0, 20e-6, -45e-6);

/// A minute of a body that rotates about every axis, whose magnetometer reads `matrix field + iron`.
fn samples(matrix: &Matrix3<f64>, iron: &Vector3<f64>) -> Vec<RawSample> {
    let mut motion = BandLimited::random(3, 0.8, 1.5, 6).unwrap();
    let step = 1_000_000_000 / RATE_HZ;
    let sample = |k: i64| {
        let spin = motion.at_nanos((k * step) as u64);
        let to_body = spin.q_nb.to_dcm().as_matrix().transpose();
        RawSample {
            header: Some(Nanos(1_700_000_000_000_000_000 + k * step)),
            log: Nanos(1_700_000_000_000_000_000 + k * step),
            gyro: Some(spin.w_nb_b.into()),
            accel: Some((to_body * Vector3::z() * 9.80665).into()),
            mag: Some((matrix * to_body * FIELD + iron).into()),
            ..RawSample::default()
        }
    };
    (0..60 * RATE_HZ).map(sample).collect()
}

fn found(samples: &[RawSample], given: &[Choice]) -> Vec<Finding> {
    let mut plan = defaults();
    for choice in given {
        let row = row(choice.setting.name()).unwrap();
        row.apply(&mut plan, &Value::Text(&choice.value)).unwrap();
    }
    let summary = estimate(&plan, samples.iter().copied(), |_| Ok::<(), ()>(()));
    let mut all = summary.unwrap().findings;
    all.retain(|finding| ["mag-axes", "mag-iron", "gyro-axes"].contains(&finding.code));
    all
}

fn aided() -> Choice {
    AID.to("gravity+mag")
}

#[test]
fn exchanged_axes_are_an_error_whose_map_cures_them_whatever_the_iron() {
    let exchanged = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    for iron in [Vector3::zeros(), Vector3::new(4e-5, -3e-5, 1e-5)] {
        let read = samples(&exchanged, &iron);
        let all = found(&read, &[aided()]);
        let [said] = all.as_slice() else {
            panic!("{all:?}")
        };
        assert_eq!((said.code, said.severity), ("mag-axes", Severity::Error));
        assert_eq!(said.help, [vec![MAG_AXES.to("YXz")], vec![MEND.into()]]);
        let cured = found(&read, &[aided(), MAG_AXES.to("YXz")]);
        assert!(cured.iter().all(|f| f.code == "mag-iron"), "{cured:?}");
        // A map that is given already is mapped on.
        let again = found(&read, &[aided(), MAG_AXES.to("Xyz")]);
        assert_eq!(again[0].help, [vec![MAG_AXES.to("YXz")], vec![MEND.into()]]);
    }
}

#[test]
fn a_mirror_is_named_with_the_hemisphere_that_it_is_of() {
    let read = samples(
        &Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)),
        &Vector3::zeros(),
    );
    let all = found(&read, &[aided()]);
    assert_eq!(
        all[0].help,
        [vec![MAG_AXES.to("XYz")], vec![MAG_AXES.to("xyZ")]]
    );
}

#[test]
fn a_clean_magnetometer_has_no_finding_and_a_wrong_gyro_is_cured_first() {
    let one = Matrix3::identity();
    let mut read = samples(&one, &Vector3::new(1e-6, -1e-6, 2e-6));
    assert_eq!(found(&read, &[aided()]), []);
    for raw in &mut read {
        raw.gyro = raw.gyro.map(|[x, y, z]| [-x, y, z]);
    }
    let codes: Vec<&str> = found(&read, &[aided()]).iter().map(|f| f.code).collect();
    assert_eq!(codes, ["gyro-axes"]);
}

#[test]
fn iron_that_turns_the_heading_is_a_warning() {
    let board = Matrix3::new(1.12, 0.05, -0.03, 0.05, 0.93, 0.04, -0.03, 0.04, 0.98);
    for (matrix, iron) in [
        (board, Vector3::zeros()),
        (Matrix3::identity(), Vector3::new(3e-5, -1.8e-5, 1.2e-5)),
    ] {
        let all = found(&samples(&matrix, &iron), &[aided()]);
        let codes: Vec<&str> = all.iter().map(|f| f.code).collect();
        assert_eq!(codes, ["mag-iron"], "{all:?}");
        assert_eq!(all[0].severity, Severity::Warning);
    }
}
