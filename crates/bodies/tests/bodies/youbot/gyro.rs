//! An IMU on the gripper: its readings against derivatives, and the propagator against the arm's forward
//! kinematics, which no integrator had a hand in.

use super::golden::cartesian_path;
use super::level;
use nalgebra::{Matrix3, Vector3};
use strapd_attitude::frames::{Dcm, In, Sensor};
use strapd_attitude::propagate::{Method, Noise, Propagator, Sequential, Settings};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{Join, Measured, Nanos, RateSample, SampleKind, Status};
use strapd_bodies::dh::Transform;
use strapd_bodies::youbot::*;

/// Mount on a bracket: turned about three axes, 5 cm out.
fn bracket() -> ImuMount {
    let q = Quaternion::<Tool, Sensor>::assume_unit([0.5, -0.5, 0.1, 0.7]).normalised();
    ImuMount::new(Transform::new(
        q.to_dcm(),
        In::assume(Vector3::new(0.02, -0.04, 0.03)),
    ))
    .unwrap()
}

fn on_bracket() -> Gripper {
    let path = JointPath::demonstration();
    Gripper::along_joints(Arm::urdf(), path, bracket(), level()).unwrap()
}

fn along_the_table() -> Gripper {
    let start = TableJoints::new([0.0, 0.106, -1.767, 1.24, 0.0]).unwrap();
    let track = ToolTrack::new(Arm::published(), cartesian_path(), &start).unwrap();
    Gripper::along_track(&track, 20.0, ImuMount::at_tool(), level()).unwrap()
}

/// Worst angle between propagated and true attitude over 20 s, rad.
fn propagated(imu: &Gripper, rate_hz: u64, kind: SampleKind) -> f64 {
    let step = 1_000_000_000 / rate_hz;
    let samples: Vec<RateSample> = (0..=20 * rate_hz)
        .map(|i| {
            let (nanos, before) = (i * step, i.saturating_sub(1) * step);
            let (gyro, start) = if kind == SampleKind::Rate {
                (Measured::Rate(imu.read(nanos).rate), nanos)
            } else {
                (Measured::Increment(imu.delta_angle(before, nanos)), before)
            };
            RateSample {
                stamp: Nanos(nanos as i64),
                start: Nanos(start as i64),
                gyro,
                accel: None,
                join: if i == 0 {
                    Join::Start
                } else {
                    Join::Continuous
                },
                status: Status::OK,
                log: Nanos(nanos as i64),
            }
        })
        .collect();
    let truth = |nanos| Quaternion::assume_unit(imu.read(nanos).attitude().wxyz());
    let mut propagator = Propagator::new(Settings {
        method: Method::Auto,
        kind,
        initial: truth(0),
        noise: Noise::default(),
        ..Settings::default()
    })
    .unwrap();
    let mut out = Vec::new();
    propagator.push(&samples, &Sequential, &mut out);
    propagator.finish(&Sequential, &mut out);
    assert_eq!(out.len(), samples.len());
    out.iter()
        .zip(&samples)
        .map(|(a, s)| a.q_nb.angle_to(&truth(s.stamp.0 as u64)))
        .fold(0.0, f64::max)
}

#[test]
fn integrated_at_100_hz_the_gyro_leads_to_the_forward_kinematics() {
    for (name, imu) in [("joints", on_bracket()), ("table", along_the_table())] {
        let error = propagated(&imu, 100, SampleKind::Rate);
        println!("{name}: {error:.1e} rad after 20 s at 100 Hz");
        assert!(error <= 1e-9, "{name}: {error:e} rad");
    }
}

#[test]
fn integrated_at_1_khz_the_gyro_leads_to_the_forward_kinematics() {
    for (name, imu) in [("joints", on_bracket()), ("table", along_the_table())] {
        let error = propagated(&imu, 1000, SampleKind::Rate);
        println!("{name}: {error:.1e} rad after 20 s at 1 kHz");
        assert!(error <= 1e-12, "{name}: {error:e} rad");
    }
}

#[test]
fn so_do_its_delta_angles() {
    let error = propagated(&on_bracket(), 100, SampleKind::DeltaAngle);
    println!("delta angles: {error:.1e} rad after 20 s at 100 Hz");
    assert!(error <= 1e-9, "{error:e} rad");
}

#[test]
fn the_accelerometer_reads_the_second_derivative_of_its_place_minus_gravity() {
    let imu = on_bracket();
    let h = 4_000_000_u64;
    let place = |nanos| *imu.read(nanos).t_base_imu.translation().as_vector();
    let mut worst = 0.0_f64;
    for i in 1..100_u64 {
        let t = 200_000_000 * i;
        let pair = |k: u64| place(t + k * h) + place(t - k * h);
        // Second derivative by seven points, sixth order.
        let sum = pair(1) * 1.5 - pair(2) * 0.15 + pair(3) / 90.0 - place(t) * (49.0 / 18.0);
        let a = sum / (h as f64 * 1e-9).powi(2);
        let reading = imu.read(t);
        let c = reading.t_base_imu.rotation();
        let f = c.transpose() * In::<Base>::assume(a - level().as_vector());
        worst = worst.max((f.as_vector() - reading.specific_force.as_vector()).norm());
    }
    println!("accelerometer against differences: {worst:.1e} m/s^2");
    // eps * 0.7 m / (4 ms)^2, a few roundings of it.
    assert!(worst < 1e-9, "{worst:e}");
}

#[test]
fn the_closed_form_of_the_rate_is_that_of_the_recursion() {
    let (arm, mount) = (Arm::urdf(), bracket());
    let path = JointPath::demonstration();
    for i in 0..500 {
        let m = path.at(0.05 * f64::from(i)).unwrap();
        let difference = mount.rate(&arm, &m).0 - mount.read(&arm, &m, &level()).rate.0;
        assert!(difference.norm() < 2e-15, "{difference}");
    }
}

#[test]
fn delta_angles_are_the_integral_whatever_the_cut() {
    let imu = on_bracket();
    // In one go, and in 3000 pieces by the midpoint rule of a million... by Simpson's rule.
    let (from, to, n) = (1_000_000_000_u64, 2_000_000_000_u64, 2_000_u64);
    let whole = imu.delta_angle(from, to).0;
    let h = (to - from) / n;
    let mut sum = Vector3::zeros();
    for i in 0..=n {
        let weight = match i {
            0 => 1.0,
            i if i == n => 1.0,
            i if i % 2 == 1 => 4.0,
            _ => 2.0,
        };
        sum += imu.read(from + i * h).rate.0 * weight;
    }
    let simpson = sum * (h as f64 * 1e-9 / 3.0);
    assert!(
        (whole - simpson).norm() < 1e-13,
        "{:e}",
        (whole - simpson).norm()
    );
    // Pieces add up, and backwards is minus.
    let middle = 1_234_567_891;
    let parts = imu.delta_angle(from, middle).0 + imu.delta_angle(middle, to).0;
    assert!((whole - parts).norm() < 1e-15);
    assert_eq!(imu.delta_angle(to, from).0, -whole);
    assert_eq!(imu.delta_angle(to, to).0, Vector3::zeros());
}

#[test]
fn an_arm_at_rest_reads_gravity_upwards() {
    let path = JointPath::legs(TableJoints::ZERO, vec![]).unwrap();
    let imu = Gripper::along_joints(Arm::published(), path, ImuMount::at_tool(), level()).unwrap();
    let reading = imu.read(5_000_000_000);
    assert_eq!(reading.rate.0, Vector3::zeros());
    let up = reading.t_base_imu.rotation() * reading.specific_force;
    assert!((up.as_vector() - Vector3::new(0.0, 0.0, 9.81)).norm() < 1e-14);
}

#[test]
fn a_mount_that_is_no_rotation_is_refused() {
    let stretched: Dcm<Tool, Sensor> = Dcm::assume(Matrix3::identity() * (1.0 + 1e-7));
    let refused = ImuMount::new(Transform::new(stretched, In::assume(Vector3::zeros())));
    assert!(matches!(refused, Err(ArmError::NotARotation(_))));
    let nowhere = In::assume(Vector3::new(f64::NAN, 0.0, 0.0));
    let refused = ImuMount::new(Transform::new(Dcm::identity(), nowhere));
    assert_eq!(
        refused,
        Err(ArmError::NotFinite {
            what: "place of the IMU (m)"
        })
    );
}
