//! Every bad input gets a reason: what, where, by how much. And no number comes out that is not one.

use super::{degrees, in_limits, pose};
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use strapd_attitude::frames::{In, NotARotation};
use strapd_bodies::youbot::*;

fn ask(p: [f64; 3], r: Matrix3<f64>, policy: Policy) -> Result<Solutions, ArmError> {
    Arm::published().inverse(&pose(p.into(), r), policy, None)
}

fn upright() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0))
}

const AT: [f64; 3] = [0.2, 0.05, 0.3];

#[test]
fn a_rotation_that_is_none_is_refused_with_its_defect() {
    let mut r = upright();
    r[(0, 0)] = -1.001;
    let Err(ArmError::NotARotation(NotARotation::NotOrthonormal { defect })) =
        ask(AT, r, Policy::KeepPosition)
    else {
        panic!("taken")
    };
    assert!((defect - 2.001e-3).abs() < 1e-12);
    let said = ask(AT, r, Policy::KeepPosition).unwrap_err().to_string();
    assert!(said.contains("2.001e-3"), "{said}");
    r[(0, 0)] = f64::NAN;
    assert!(matches!(
        ask(AT, r, Policy::KeepPosition),
        Err(ArmError::NotARotation(_))
    ));
    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
    assert!(matches!(
        ask(AT, mirror, Policy::KeepPosition),
        Err(ArmError::NotARotation(NotARotation::Mirrors { .. }))
    ));
}

#[test]
fn positions_that_are_none_are_refused() {
    for bad in [f64::NAN, f64::INFINITY] {
        let refused = ask([0.1, bad, 0.2], upright(), Policy::default()).unwrap_err();
        assert_eq!(
            refused.to_string(),
            "target position (m) is not a finite number"
        );
    }
    let refused = ask([0.1, 1e300, 0.2], upright(), Policy::KeepApproach).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "target position (m) is 1e300, at most 1e9 is taken"
    );
    // Large but taken: out of reach by what it is.
    let Err(ArmError::OutOfReach(reach)) = ask([1e9, 0.0, 0.0], upright(), Policy::default())
    else {
        panic!("taken")
    };
    assert!(reach.excess().iter().all(|e| (e - 1e9).abs() < 1.0));
}

#[test]
fn out_of_plane_states_both_residuals() {
    let r = Matrix3::new(-0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0);
    let refused = ask([0.3, 0.1, 0.3], r, Policy::default()).unwrap_err();
    let ArmError::OutOfPlane {
        position, angle, ..
    } = refused
    else {
        panic!("{refused}")
    };
    assert!(position.abs() > 0.05 && angle.abs() > 0.01);
    let said = refused.to_string();
    assert!(said.contains(&format!("{position:.3e} m")), "{said}");
    assert!(said.contains(&format!("{angle:.3e} rad")), "{said}");
    assert!(said.contains("keep-position"), "{said}");
    // With tolerances of that size it is taken, and the residuals are returned.
    let policy = Policy::Reject {
        position: 0.11,
        angle: 0.11,
    };
    let found = ask([0.3, 0.1, 0.3], r, policy).unwrap();
    assert_eq!((found.plane_position, found.plane_angle), (position, angle));
}

#[test]
fn out_of_reach_says_by_how_much() {
    let said = ask([0.033, 0.0, 0.675], upright(), Policy::default())
        .unwrap_err()
        .to_string();
    assert_eq!(
        said,
        "out of reach: too far by 0.020000 m (wrist 0.3100 m from the shoulder, reach 0.020 to 0.290 m)"
    );
}

#[test]
fn past_a_stop_names_joint_value_and_range() {
    let arm = Arm::published();
    let q = degrees([0.0, 0.0, 0.0, 200.0, 0.0]);
    let refused = arm.limits().check(&q).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "joint 4 would be at 200.000 deg, its range is -12.5 to 192.5 deg (seed convention)"
    );
    // The worst joint is named.
    let q = degrees([0.0, 70.0, 0.0, 200.0, 170.0]);
    assert!(matches!(
        arm.limits().check(&q),
        Err(ArmError::Limit { joint: 4, .. })
    ));
    // A pose the joints reach only past a stop.
    let beyond = degrees([0.0, 80.0, 20.0, 90.0, 0.0]);
    let found = arm
        .inverse(&arm.forward(&beyond), Policy::default(), None)
        .unwrap();
    match found.nearest(&beyond) {
        Ok(s) => assert!(arm.limits().contain(&s.q)),
        Err(e) => assert!(matches!(e, ArmError::Limit { .. })),
    }
    let upright_back = degrees([0.0, 65.5, 0.0, 90.0, 0.0]);
    let found = arm
        .inverse(&arm.forward(&upright_back), Policy::default(), None)
        .unwrap();
    let of_front = found
        .as_slice()
        .iter()
        .find(|s| s.q.angles()[1] > 1.0)
        .unwrap();
    assert!(!of_front.within_limits);
}

#[test]
fn singular_says_which() {
    let arm = Arm::published();
    let up = Twist {
        v: In::assume(Vector3::new(0.0, 0.0, 0.1)),
        w: In::assume(Vector3::zeros()),
    };
    let refused = arm.joint_rates(&TableJoints::ZERO, &up, 1.0).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "singular: the elbow is straight or folded (sine 0.0e0)"
    );
    // On the axis, looking down: theta1 and theta5 are one.
    let target = pose(
        Vector3::new(0.0, 0.0, 0.11),
        Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)),
    );
    let found = arm.inverse(&target, Policy::default(), None).unwrap();
    assert!(found.theta1_free);
    let refused = arm
        .joint_rates(&found.as_slice()[0].q, &up, 1.0)
        .unwrap_err();
    assert!(
        matches!(refused, ArmError::Singular(Singularity::Base { .. })),
        "{refused}"
    );
    let nan = Twist {
        v: In::assume(Vector3::new(0.0, f64::NAN, 0.1)),
        w: In::assume(Vector3::zeros()),
    };
    let refused = arm.joint_rates(&degrees([0.0, 10.0, 50.0, 60.0, 0.0]), &nan, 1.0);
    assert_eq!(
        refused,
        Err(ArmError::NotFinite {
            what: "velocity of the gripper"
        })
    );
}

#[test]
fn an_approach_square_to_the_plane_is_flagged_and_its_residual_exact() {
    // Position in the x-z plane, approach along y, keep the position: any turn into the plane is 90 degrees.
    let r = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    let found = ask([0.35, 0.0, 0.2], r, Policy::KeepPosition).unwrap();
    assert!(found.approach_free);
    assert!((found.angle_residual() - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    assert!(
        found
            .as_slice()
            .iter()
            .all(|s| s.q.angles().iter().all(|q| q.is_finite()))
    );
}

#[test]
fn joints_and_motions_that_are_no_numbers_are_refused() {
    assert_eq!(
        TableJoints::new([0.0, 0.0, f64::NAN, 0.0, 0.0]),
        Err(ArmError::NotFinite {
            what: "joint angle (rad)"
        })
    );
    assert!(DriverJoints::new([f64::INFINITY; 5]).is_err());
    assert!(matches!(
        TableJoints::new([1e7; 5]),
        Err(ArmError::TooLarge { .. })
    ));
    let fast = TableMotion::new(TableJoints::ZERO, [1e6; 5], [0.0; 5]).unwrap_err();
    assert_eq!(
        fast.to_string(),
        "joint rate (rad/s) is 1e6, at most 1e5 is taken"
    );
    let nan = DriverMotion::new(
        DriverJoints::new([0.0; 5]).unwrap(),
        [0.0; 5],
        [f64::NAN; 5],
    );
    assert_eq!(
        nan.unwrap_err().to_string(),
        "joint acceleration (rad/s^2) is not a finite number"
    );
    assert!(JointPath::demonstration().at(f64::NAN).is_err());
    assert!(JointPath::demonstration().slowed(0.0).is_err());
    assert!(
        JointPath::legs(
            TableJoints::ZERO,
            vec![Leg {
                to: TableJoints::ZERO,
                duration: 0.0
            }]
        )
        .is_err()
    );
    assert!(JointPath::through(&Arm::published(), &[]).is_err());
    assert!(ToolPath::line([0.0; 5], [f64::NAN; 5], 1.0).is_err());
    assert!(
        Wrench::new(
            In::assume(Vector3::repeat(f64::NAN)),
            In::assume(Vector3::zeros())
        )
        .is_err()
    );
}

#[test]
fn the_largest_motions_taken_give_numbers() {
    let arm = Arm::urdf();
    let links = published_links(&arm).unwrap();
    let g = In::assume(Vector3::repeat(1e6));
    let dynamics = Dynamics::new(arm, links, g).unwrap();
    let m = TableMotion::new(TableJoints::new([1e6; 5]).unwrap(), [1e5; 5], [-1e9; 5]).unwrap();
    let tip = Wrench::new(
        In::assume(Vector3::repeat(1e9)),
        In::assume(Vector3::repeat(-1e9)),
    )
    .unwrap();
    assert!(
        dynamics
            .torques_with_tip(&m, &tip)
            .0
            .iter()
            .all(|t| t.is_finite())
    );
    let e = dynamics.energy(&m);
    assert!(e.kinetic.is_finite() && e.potential.is_finite());
    assert!(
        arm.forward(m.q())
            .to_homogeneous()
            .iter()
            .all(|x| x.is_finite())
    );
}

#[test]
fn arms_that_can_not_be_are_refused() {
    let refuse = |p: Parameters| Arm::new(p).unwrap_err().to_string();
    let seed = Parameters::published();
    assert_eq!(
        refuse(Parameters { a2: 0.0, ..seed }),
        "a2 and a3 must be lengths above a micrometre, not 0"
    );
    assert_eq!(
        refuse(Parameters {
            d1: f64::NAN,
            ..seed
        }),
        "length of a link (m) is not a finite number"
    );
    assert_eq!(
        refuse(Parameters {
            fastest: [0.0; 5],
            ..seed
        }),
        "the fastest rate of a joint must be above zero, not 0"
    );
    let backwards = Limits::new([1.0; 5], [-1.0; 5]).unwrap_err().to_string();
    assert_eq!(
        backwards,
        "a joint's range must be above zero and below a full turn (rad), not -2"
    );
    assert!(Limits::new([-3.2; 5], [3.2; 5]).is_err());
    // Weights and tolerances too.
    for policy in [
        Policy::Weighted { length: 0.0 },
        Policy::Weighted { length: f64::NAN },
        Policy::Reject {
            position: -1.0,
            angle: 1.0,
        },
        Policy::Reject {
            position: 1.0,
            angle: f64::NAN,
        },
    ] {
        assert!(ask(AT, upright(), policy).is_err(), "{policy:?}");
    }
    let arm = Arm::published();
    let mut rng = ChaCha8Rng::seed_from_u64(30);
    let q = in_limits(&arm, &mut rng);
    let found = arm
        .inverse(&arm.forward(&q), Policy::default(), None)
        .unwrap();
    assert!(found.nearest_weighted(&q, &[0.0; 5]).is_err());
    assert!(found.nearest_weighted(&q, &[f64::NAN; 5]).is_err());
}
