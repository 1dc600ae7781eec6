//! The magnetic field and the magnetometer in it.

use nalgebra::Vector3;
use strapd_attitude::noise::sensor_error::{ImuError, StampError};
use strapd_attitude::quaternion::kernel as quat;
use strapd_attitude::record::{Nanos, SampleKind};
use strapd_bodies::field::{Disturbance, Field};
use strapd_bodies::motion::{Carrier, Motion};
use strapd_bodies::synthetic::*;

#[test]
fn the_field_points_north_and_down_and_declination_turns_it_east() {
    let field = Field::new(48e-6, 60_f64.to_radians(), 0.0, Vec::new()).at(3.0);
    let expected = Vector3::new(0.0, 24e-6, -48e-6 * 0.75_f64.sqrt());
    assert!((field - expected).amax() < 1e-20, "{field}");
    let east = Field::new(48e-6, 0.0, 90_f64.to_radians(), Vec::new()).at(3.0);
    assert!(
        (east - Vector3::new(48e-6, 0.0, 0.0)).amax() < 1e-20,
        "{east}"
    );
}

#[test]
fn a_disturbance_comes_stays_and_goes() {
    let added_n = Vector3::new(10e-6, 0.0, -5e-6);
    let disturbance = Disturbance {
        from: 10.0,
        to: 20.0,
        added_n,
    };
    let field = Field::new(48e-6, 1.0, 0.2, vec![disturbance]);
    let part = |secs: f64| (field.at(secs) - field.at(0.0)).dot(&added_n) / added_n.norm_squared();
    for (secs, expected) in [
        (9.9, 0.0),
        (10.5, 0.5),
        (11.0, 1.0),
        (19.0, 1.0),
        (19.5, 0.5),
        (20.1, 0.0),
    ] {
        // Roundings of 48 uT in 11.
        assert!(
            (part(secs) - expected).abs() < 1e-14,
            "{secs}: {}",
            part(secs)
        );
    }
}

#[test]
fn the_magnetometer_reads_the_field_in_the_bodys_axes_at_its_own_rate() {
    let field = Field::new(48e-6, 1.0, 0.2, Vec::new());
    let sampling = Sampling {
        rate_hz: 100.0,
        duration_secs: 10.0,
        kind: SampleKind::Rate,
        start: Nanos(0),
        gravity: 9.80665,
        lever_b: Vector3::zeros(),
        force: ForceSampling::Instant,
        magnetometer: Some(Magnetometer {
            rate_hz: 30.0,
            field: field.clone(),
        }),
        error: ImuError::default(),
        stamps: StampError::default(),
        seed: 1,
    };
    let motion = Motion::Carried(Box::new(Carrier::Hand.motion(1, 9.80665)));
    let mut source = Synthetic::new(motion, sampling).unwrap();
    let mut stretch = Stretch::default();
    source.next_stretch(10_000, &mut stretch).unwrap();
    let mut stamps = Vec::new();
    for (sample, truth) in stretch.samples.iter().zip(&stretch.truth) {
        let Some(mag) = sample.mag else { continue };
        stamps.push(truth.stamp.0);
        let turned = quat::matrix(&truth.spin.q_nb.wxyz()) * Vector3::from(mag);
        // Roundings of 48 uT.
        assert!((turned - field.at(0.0)).amax() < 1e-19);
    }
    assert_eq!(stamps.len(), 301);
    assert_eq!(source.noticed().fields, 301);
    // 30 a second among 100: three or four samples apart.
    let apart: Vec<i64> = stamps
        .windows(2)
        .map(|w| (w[1] - w[0]) / 10_000_000)
        .collect();
    assert!(apart.iter().all(|n| (3..=4).contains(n)), "{apart:?}");
}
