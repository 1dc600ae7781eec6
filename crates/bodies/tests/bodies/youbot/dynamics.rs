//! Forces and torques against what mechanics says without a recursion: work, energy, momentum.

use super::{degrees, in_limits, level, odd_arm};
use nalgebra::{Matrix3, SVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use strapd_attitude::frames::In;
use strapd_bodies::inertia::{InertiaError, RigidBody, TensorEntries};
use strapd_bodies::youbot::*;

fn heavy(arm: Arm) -> Dynamics {
    Dynamics::new(arm, published_links(&arm).unwrap(), level()).unwrap()
}

fn random_motion(arm: &Arm, rng: &mut ChaCha8Rng) -> TableMotion {
    let q = in_limits(arm, rng);
    let mut five = || std::array::from_fn(|_| rng.random_range(-2.0..2.0));
    TableMotion::new(q, five(), five()).unwrap()
}

#[test]
fn a_force_at_the_tool_is_felt_through_the_jacobian() {
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    for arm in [Arm::published(), Arm::urdf(), odd_arm()] {
        let dynamics = heavy(arm);
        for _ in 0..200 {
            let m = random_motion(&arm, &mut rng);
            let mut three = || Vector3::from_fn(|_, _| rng.random_range(-10.0..10.0));
            let (f, n) = (three(), three());
            let tip = Wrench::new(In::assume(f), In::assume(n)).unwrap();
            let c = arm.forward(m.q()).rotation();
            let (f, n) = (c.as_matrix() * f, c.as_matrix() * n);
            let wrench = SVector::<f64, 6>::from_column_slice(&[f.x, f.y, f.z, n.x, n.y, n.z]);
            let theirs = arm.jacobian(m.q()).transpose() * wrench;
            let with = SVector::from(dynamics.torques_with_tip(&m, &tip).0);
            let ours = with - SVector::from(dynamics.torques(&m).0);
            assert!(
                (ours - theirs).amax() < 1e-13,
                "{:e}",
                (ours - theirs).amax()
            );
        }
    }
}

#[test]
fn work_becomes_energy() {
    // Along a moving path: d(kinetic + potential)/dt = tau . qd, the left side by an eight-point difference.
    let path = JointPath::demonstration();
    let dynamics = heavy(Arm::urdf());
    let energy = |secs: f64| {
        let e = dynamics.energy(&path.at(secs).unwrap());
        e.kinetic + e.potential
    };
    let h = 0.01;
    let mut worst = 0.0_f64;
    for i in 1..200 {
        let t = 0.1 * f64::from(i);
        let slope = |k: f64| energy(t + k * h) - energy(t - k * h);
        let rate = (0.8 * slope(1.0) - 0.2 * slope(2.0) + 4.0 / 105.0 * slope(3.0)
            - slope(4.0) / 280.0)
            / h;
        let m = path.at(t).unwrap();
        let power: f64 = dynamics
            .torques(&m)
            .0
            .iter()
            .zip(m.qd())
            .map(|(t, w)| t * w)
            .sum();
        worst = worst.max((rate - power).abs());
    }
    println!("power balance: {worst:.1e} W");
    // eps * 10 J / 0.01 s, and the ninth derivative times h^8.
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn the_mass_matrix_is_symmetric_positive_and_gives_the_kinetic_energy() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    for arm in [Arm::published(), Arm::urdf(), odd_arm()] {
        let dynamics = heavy(arm);
        for _ in 0..200 {
            let m = random_motion(&arm, &mut rng);
            let matrix = dynamics.mass_matrix(m.q());
            assert_eq!(matrix, matrix.transpose());
            assert!(matrix.cholesky().is_some());
            let qd = SVector::from(m.qd());
            let kinetic = 0.5 * qd.dot(&(matrix * qd));
            assert!((kinetic - dynamics.energy(&m).kinetic).abs() < 1e-14);
            // The torque is linear in the acceleration, with this matrix.
            let coasting = TableMotion::new(*m.q(), m.qd(), [0.0; 5]).unwrap();
            let inertia = SVector::from(dynamics.torques(&m).0)
                - SVector::from(dynamics.torques(&coasting).0);
            assert!((inertia - matrix * SVector::from(m.qdd())).amax() < 1e-13);
        }
    }
}

#[test]
fn gravity_never_asks_for_more_than_the_motors_have() {
    let arm = Arm::published();
    let dynamics = heavy(arm);
    let mut most = [0.0_f64; 5];
    // Every five degrees between the stops; joint 1 does not matter.
    let every = |from: i32, to: i32| (from..=to).step_by(5).map(f64::from);
    for (q2, q5) in every(-90, 65).flat_map(|q2| [(q2, 0.0), (q2, 90.0)]) {
        for (q3, q4) in every(-146, 151).flat_map(|q3| every(-12, 192).map(move |q4| (q3, q4))) {
            let tau = dynamics.gravity_torques(&degrees([0.0, q2, q3, q4, q5]));
            for (m, t) in most.iter_mut().zip(tau.0) {
                *m = m.max(t.abs());
            }
        }
    }
    println!("most gravity torque {most:.2?} N m");
    for (most, rated) in most.into_iter().zip([9.5, 9.5, 6.0, 2.0, 1.0]) {
        assert!(most < rated);
    }
    // Joint 4 by hand: links 4 and 5 level, their centres of mass 50.19 and 113.17 mm out.
    let level_wrist = 9.81 * (0.769 * 0.050_19 + 0.687 * 0.113_17);
    assert!(
        (most[3] - level_wrist).abs() < 0.01 * level_wrist,
        "{most:?}"
    );
    assert!(
        (most[1] - 8.2).abs() < 0.05 && (most[2] - 3.64).abs() < 0.05,
        "{most:?}"
    );
    // The base axis is vertical.
    assert!(most[0] < 1e-15);
}

#[test]
fn the_published_placeholders_are_refused_and_the_gripper_is_physical() {
    // A 10 g finger with 0.01 kg m^2 about each axis: lawful as a tensor, but a ring of 1 m radius.
    let placeholder = TensorEntries {
        ixx: 0.01,
        iyy: 0.01,
        izz: 0.01,
        ..TensorEntries::default()
    };
    let finger = RigidBody::from_tensor_entries(0.01, Vector3::zeros(), placeholder).unwrap();
    let radius = |b: &RigidBody| (b.principal_moments()[2] / b.mass()).sqrt();
    assert!((radius(&finger) - 1.0).abs() < 1e-12);
    // Ours is no larger than the gripper.
    let arm = Arm::published();
    let ours = gripper(&arm).unwrap();
    assert!((ours.mass() - 0.12).abs() < 1e-15);
    assert!(radius(&ours) < 0.04, "{}", radius(&ours));
    // It sits between flange and finger tips, by either preset at the same place of the robot.
    let z = ours.r_og_b().z;
    assert!((-0.088..0.0).contains(&z), "{z}");
    let urdf = gripper(&Arm::urdf()).unwrap().r_og_b().z;
    assert!((urdf - z - 0.088).abs() < 1e-15);
    // All links: every radius of gyration within the arm's build.
    for link in published_links(&arm).unwrap() {
        assert!((0.010..0.067).contains(&radius(&link)), "{}", radius(&link));
    }
}

#[test]
fn a_payload_is_the_same_welded_on_or_pressing_at_the_tool() {
    // A point-like payload at rest: its weight as a force of the tool on the world.
    let (arm, mut rng) = (Arm::published(), ChaCha8Rng::seed_from_u64(23));
    let mut links = published_links(&arm).unwrap();
    let r = Vector3::new(0.01, -0.02, 0.03);
    links[4] = links[4].with_point_mass(0.5, r).unwrap();
    let loaded = Dynamics::new(arm, links, level()).unwrap();
    let bare = heavy(arm);
    for _ in 0..100 {
        let q = in_limits(&arm, &mut rng);
        let weight = arm.forward(&q).rotation().transpose() * level();
        let force = weight.as_vector() * 0.5;
        // The tool pulls the payload up: the tool exerts minus its weight on it.
        let tip = Wrench::new(In::assume(-force), In::assume(-r.cross(&force))).unwrap();
        let held = bare.torques_with_tip(&q.at_rest(), &tip);
        let welded = loaded.gravity_torques(&q);
        for (a, b) in held.0.iter().zip(welded.0) {
            assert!((a - b).abs() < 1e-14, "{a} against {b}");
        }
    }
}

#[test]
fn motors_add_their_rotor_and_friction() {
    let motor = Actuator {
        inertia: 0.3,
        viscous: 0.2,
        coulomb: 0.5,
        offset: 0.01,
    };
    assert!((motor.torque(1.0, -2.0, 3.0) - (0.9 + 1.0 - 0.4 - 0.5 + 0.01)).abs() < 1e-15);
    assert_eq!(motor.torque(1.0, 0.0, 0.0), 1.01);
    assert_eq!(Actuator::default().torque(1.5, -2.0, 3.0), 1.5);
}

#[test]
fn impossible_links_stop_at_the_door() {
    let wrong = RigidBody::new(
        1.0,
        Vector3::zeros(),
        Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 3.0)),
    );
    assert!(matches!(
        wrong,
        Err(InertiaError::TriangleInequality { .. })
    ));
    let arm = Arm::published();
    let mut links = published_links(&arm).unwrap();
    let huge = RigidBody::new(1e7, Vector3::zeros(), Matrix3::identity()).unwrap();
    links[2] = huge;
    let refused = Dynamics::new(arm, links, level()).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "mass of a link (kg) is 1e7, at most 1e6 is taken"
    );
    let nan = In::assume(Vector3::new(0.0, f64::NAN, 0.0));
    let refused = Dynamics::new(arm, published_links(&arm).unwrap(), nan).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "gravity (m/s^2) is not a finite number"
    );
}
