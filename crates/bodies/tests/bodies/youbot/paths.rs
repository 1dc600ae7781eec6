//! Paths in joint space and in space: derivatives, limits of rate, and what happens at the edge.

use super::golden::cartesian_path;
use super::{apart, degrees, level};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;
use strapd_attitude::frames::In;
use strapd_bodies::youbot::*;

/// Sixth-order first derivative.
fn slope<const N: usize>(f: impl Fn(f64) -> [f64; N], t: f64, h: f64) -> [f64; N] {
    let mut out = [0.0; N];
    for (k, c) in [(1.0, 0.75), (2.0, -0.15), (3.0, 1.0 / 60.0)] {
        let (a, b) = (f(t + k * h), f(t - k * h));
        for ((o, a), b) in out.iter_mut().zip(a).zip(b) {
            *o += c * (a - b) / h;
        }
    }
    out
}

#[track_caller]
fn near(ours: &[f64], theirs: &[f64], tolerance: f64) {
    for (a, b) in ours.iter().zip(theirs) {
        assert!((a - b).abs() <= tolerance, "{ours:?} against {theirs:?}");
    }
}

#[test]
fn joints_rates_and_accelerations_are_derivatives_of_each_other() {
    let legs = JointPath::through(
        &Arm::published(),
        &[
            TableJoints::ZERO,
            degrees([90.0, -20.0, 60.0, 45.0, -100.0]),
            degrees([-30.0, 10.0, -60.0, 100.0, 0.0]),
        ],
    )
    .unwrap();
    for path in [JointPath::demonstration(), legs] {
        for i in 1..40 {
            let t = 0.071 * f64::from(i);
            let q = |t| path.at(t).unwrap().q().angles();
            let qd = |t| path.at(t).unwrap().qd();
            near(&slope(q, t, 1e-3), &qd(t), 1e-11);
            near(&slope(qd, t, 1e-3), &path.at(t).unwrap().qdd(), 1e-10);
        }
    }
}

#[test]
fn legs_start_and_end_at_rest_and_use_the_whole_rate() {
    let (arm, to) = (Arm::published(), degrees([90.0, -20.0, 60.0, 45.0, -100.0]));
    let path = JointPath::through(&arm, &[TableJoints::ZERO, to]).unwrap();
    let duration = path.duration().unwrap();
    // The longest way, 100 degrees, at 90 degrees a second and 15/8 of the mean.
    near(&[duration], &[100.0 / 90.0 * 15.0 / 8.0], 1e-14);
    assert_eq!(path.at(0.0).unwrap(), TableJoints::ZERO.at_rest());
    assert_eq!(path.at(duration + 3.0).unwrap(), to.at_rest());
    assert_eq!(path.at(-1.0).unwrap(), TableJoints::ZERO.at_rest());
    near(&path.peak_rates()[4..], &[FRAC_PI_2], 1e-15);
    let middle = path.at(0.5 * duration).unwrap();
    near(&[middle.qd()[4].abs()], &[FRAC_PI_2], 1e-14);
}

#[test]
fn a_fast_path_is_slowed_uniformly_to_the_fastest_rate() {
    let arm = Arm::published();
    let fast = JointPath::demonstration().slowed(0.25).unwrap();
    let peak = fast.peak_rates();
    near(&peak, &[3.08, 1.54, 2.6, 2.16, 5.12], 1e-12);
    let (slow, factor) = fast.within_rates(&arm).unwrap();
    near(&[factor], &[5.12 / FRAC_PI_2], 1e-14);
    near(&slow.peak_rates()[4..], &[FRAC_PI_2], 1e-15);
    // The same way, later; rates by 1/k, accelerations by 1/k^2.
    let (a, b) = (fast.at(1.3).unwrap(), slow.at(1.3 * factor).unwrap());
    near(&a.q().angles(), &b.q().angles(), 1e-13);
    near(&a.qd(), &b.qd().map(|w| w * factor), 1e-12);
    near(&a.qdd(), &b.qdd().map(|w| w * factor * factor), 1e-11);
    // Sampled, it can be no more.
    let shown: Vec<TableMotion> = (0..2000)
        .map(|i| fast.at(0.01 * f64::from(i)).unwrap())
        .collect();
    let sampled = slow_down_factor(&arm, &shown);
    assert!(sampled <= factor && sampled > 0.999 * factor);
    // A slow path is left alone.
    let (same, one) = JointPath::demonstration().within_rates(&arm).unwrap();
    assert_eq!((same, one), (JointPath::demonstration(), 1.0));
    assert_eq!(slow_down_factor(&arm, &[]), 1.0);
}

#[test]
fn a_gripper_path_is_slowed_by_its_joints() {
    let start = TableJoints::new([0.0, 0.106, -1.767, 1.24, 0.0]).unwrap();
    let fast = cartesian_path().slowed(0.2).unwrap();
    let track = ToolTrack::new(Arm::published(), fast, &start).unwrap();
    let factor = track.slow_down_factor(0.0, 8.0, 4000).unwrap();
    assert!(factor > 1.5, "{factor}");
    let slow = ToolTrack::new(Arm::published(), fast.slowed(factor).unwrap(), &start).unwrap();
    let after = slow.slow_down_factor(0.0, 8.0 * factor, 4000).unwrap();
    near(&[after], &[1.0], 1e-12);
}

fn line() -> ToolPath {
    ToolPath::line(
        [0.25, -0.15, 0.15, 1.7, 0.0],
        [0.3, 0.2, 0.3, 2.2, 1.0],
        3.0,
    )
    .unwrap()
}

#[test]
fn velocity_and_acceleration_of_gripper_paths_are_derivatives() {
    for path in [cartesian_path(), line()] {
        for i in 1..28 {
            let t = 0.1 * f64::from(i);
            let at = |t| path.at(t).unwrap();
            let p = |t| <[f64; 3]>::from(*at(t).t_base_tool.translation().as_vector());
            let v = |t| <[f64; 3]>::from(*at(t).twist.v.as_vector());
            let w = |t| <[f64; 3]>::from(*at(t).twist.w.as_vector());
            near(&slope(p, t, 1e-3), &v(t), 1e-12);
            near(
                &slope(v, t, 1e-3),
                at(t).acceleration.v.as_vector().as_slice(),
                1e-11,
            );
            near(
                &slope(w, t, 1e-3),
                at(t).acceleration.w.as_vector().as_slice(),
                1e-10,
            );
            // R' = w x R, column by column.
            for axis in 0..3 {
                let column = |t| {
                    let c = at(t).t_base_tool.rotation();
                    <[f64; 3]>::from(Vector3::from(c.as_matrix().column(axis)))
                };
                let turned = at(t).twist.w.as_vector().cross(&Vector3::from(column(t)));
                near(&slope(column, t, 1e-3), turned.as_slice(), 1e-11);
            }
        }
    }
}

#[test]
fn a_straight_line_is_followed_by_both_followers_alike() {
    let (arm, path) = (Arm::urdf(), line());
    let start = degrees([-30.0, -20.0, -60.0, 100.0, 0.0]);
    let track = ToolTrack::new(arm, path, &start).unwrap();
    let mut follower = Follower::new(arm, start, Policy::default(), 1e-9).unwrap();
    for i in 0..=300 {
        let secs = 0.01 * f64::from(i);
        let wanted = path.at(secs).unwrap();
        let (a, b) = (
            track.at(secs).unwrap(),
            follower.step(secs, &wanted).unwrap(),
        );
        near(&a.q().angles(), &b.q().angles(), 1e-12);
        near(&a.qd(), &b.qd(), 1e-11);
        let (p, angle) = apart(&arm.forward(a.q()), &wanted.t_base_tool);
        assert!(p < 1e-15 && angle < 3e-15, "{p:e} {angle:e}");
        // J qd is the velocity, and a moving IMU feels the acceleration.
        let tool = arm.link_motions(&a)[4];
        let c = wanted.t_base_tool.rotation();
        let acceleration = c.as_matrix() * tool.acceleration.as_vector();
        near(
            acceleration.as_slice(),
            wanted.acceleration.v.as_vector().as_slice(),
            1e-13,
        );
        let velocity = c.as_matrix() * tool.velocity.as_vector();
        near(
            velocity.as_slice(),
            wanted.twist.v.as_vector().as_slice(),
            1e-14,
        );
    }
}

#[test]
fn a_path_that_leaves_the_workspace_says_when_and_by_how_much() {
    // Straight out at shoulder height, approach forward: the wrist is 0.29 m from the shoulder when the
    // tool is at 0.033 + 0.29 + 0.218 = 0.541 m.
    let out = ToolPath::line(
        [0.4, 0.0, 0.147, FRAC_PI_2, 0.0],
        [0.7, 0.0, 0.147, FRAC_PI_2, 0.0],
        2.0,
    )
    .unwrap();
    let start = degrees([0.0, -20.0, -100.0, 120.0, 0.0]);
    let track = ToolTrack::new(Arm::published(), out, &start).unwrap();
    // Sooner or later a stop or the reach ends it, and it says which.
    let mut follower = Follower::new(Arm::published(), start, Policy::default(), 1e-9).unwrap();
    let mut last = 0.0;
    let (by_track, by_follower) = loop {
        let a = track.at(last);
        let b = follower.step(last, &out.at(last).unwrap());
        match (a, b) {
            (Ok(_), Ok(_)) => last += 0.001,
            (Err(a), Err(b)) => break (a, b),
            other => panic!("{other:?}"),
        }
        assert!(last < 2.0);
    };
    assert_eq!(by_track, by_follower);
    let ArmError::Path { secs, why } = &by_track else {
        panic!("{by_track}")
    };
    assert_eq!(*secs, last);
    let ArmError::OutOfReach(reach) = **why else {
        panic!("{why}")
    };
    let x = out
        .at(last)
        .unwrap()
        .t_base_tool
        .translation()
        .as_vector()
        .x;
    near(&[reach.excess()[0]], &[x - 0.541], 1e-14);
    assert!(x - 0.541 < 1e-3, "noticed at once");
    let said = by_track.to_string();
    assert!(
        said.starts_with(&format!(
            "at {secs:.6} s of the path: out of reach: too far by 0.00"
        )),
        "{said}"
    );
}

#[test]
fn a_jump_to_another_branch_is_refused() {
    let arm = Arm::published();
    let start = degrees([10.0, 20.0, 60.0, 80.0, 0.0]);
    let other = degrees([80.0, 20.0, 60.0, 80.0, 0.0]);
    let still = |q: &TableJoints| ToolMotion {
        t_base_tool: arm.forward(q),
        twist: Twist {
            v: In::assume(Vector3::zeros()),
            w: In::assume(Vector3::zeros()),
        },
        acceleration: Twist {
            v: In::assume(Vector3::zeros()),
            w: In::assume(Vector3::zeros()),
        },
    };
    let mut follower = Follower::new(arm, start, Policy::default(), 1e-9).unwrap();
    follower.step(0.0, &still(&start)).unwrap();
    let refused = follower.step(0.01, &still(&other)).unwrap_err();
    let ArmError::Path { secs, why } = refused else {
        panic!("{refused}")
    };
    let ArmError::BranchChange {
        joint,
        jump,
        expected,
    } = *why
    else {
        panic!("{why}")
    };
    assert_eq!((secs, joint, expected), (0.01, 1, 0.0));
    near(&[jump], &[70.0_f64.to_radians()], 1e-12);
    // It stays where it was and goes on from there.
    assert!(follower.step(0.02, &still(&start)).is_ok());
}

#[test]
fn paths_meet_the_base_axis_and_the_stops_with_a_reason() {
    let through =
        ToolPath::line([0.2, 0.0, 0.4, 2.0, 0.0], [-0.2, 0.0, 0.4, 2.0, 0.0], 2.0).unwrap();
    assert!(matches!(
        through.at(1.0),
        Err(ArmError::Singular(Singularity::Path { .. }))
    ));
    let swing = JointPath::sinusoids(
        [Sinusoid {
            amplitude: 3.0,
            angular_frequency: 0.5,
            ..Sinusoid::default()
        }; 5],
    )
    .unwrap();
    let refused = Gripper::along_joints(Arm::published(), swing, ImuMount::at_tool(), level());
    assert_eq!(
        refused.unwrap_err().to_string(),
        "joint 2 would be at 171.887 deg, its range is -90.0 to 65.0 deg (seed convention)"
    );
    // One that stands still is where it is, not where it might swing to.
    let still = JointPath::sinusoids(
        [Sinusoid {
            amplitude: 3.0,
            ..Sinusoid::default()
        }; 5],
    )
    .unwrap();
    assert!(still.check(Arm::published().limits()).is_ok());
    let arm = Arm::published();
    let beyond = degrees([0.0, 0.0, 0.0, 200.0, 0.0]);
    let legs = JointPath::through(&arm, &[TableJoints::ZERO, beyond]).unwrap();
    assert!(matches!(
        legs.check(arm.limits()),
        Err(ArmError::Limit { joint: 4, .. })
    ));
    let knots = JointPath::knots(0.5, vec![TableJoints::ZERO.at_rest(), beyond.at_rest()]).unwrap();
    let said = knots.check(arm.limits()).unwrap_err().to_string();
    assert!(
        said.starts_with("at 0.500000 s of the path: joint 4 would be at 200.000"),
        "{said}"
    );
}

#[test]
fn knots_meet_the_path_they_were_taken_from() {
    let start = TableJoints::new([0.0, 0.106, -1.767, 1.24, 0.0]).unwrap();
    let track = ToolTrack::new(Arm::published(), cartesian_path(), &start).unwrap();
    let path = track.joint_path(7.0).unwrap();
    near(&[path.duration().unwrap()], &[7.0], 1e-12);
    let mut worst = [0.0_f64; 3];
    for i in 0..1000 {
        let secs = 0.006_99 * f64::from(i);
        let (a, b) = (track.at(secs).unwrap(), path.at(secs).unwrap());
        let off = |x: [f64; 5], y: [f64; 5]| {
            x.iter()
                .zip(y)
                .map(|(x, y)| (x - y).abs())
                .fold(0.0, f64::max)
        };
        worst[0] = worst[0].max(off(a.q().angles(), b.q().angles()));
        worst[1] = worst[1].max(off(a.qd(), b.qd()));
        worst[2] = worst[2].max(off(a.qdd(), b.qdd()));
    }
    println!(
        "knots every 10 ms: {:.1e} rad, {:.1e} rad/s, {:.1e} rad/s^2",
        worst[0], worst[1], worst[2]
    );
    assert!(
        worst[0] < 1e-13 && worst[1] < 1e-11 && worst[2] < 1e-8,
        "{worst:?}"
    );
    // Its fastest rates are those between the knots too.
    let (fast, factor) = path.slowed(0.1).unwrap().within_rates(track.arm()).unwrap();
    let dense = (0..20_000).map(|i| fast.at(0.7e-4 * factor * f64::from(i)).unwrap());
    let most = dense
        .flat_map(|m| m.qd())
        .fold(0.0_f64, |m, w| m.max(w.abs()));
    assert!((most / FRAC_PI_2 - 1.0).abs() < 1e-5, "{most}");
    // Slow, it is the same path later; outside it stands.
    let slow = path.slowed(2.0).unwrap();
    let (a, b) = (path.at(1.234).unwrap(), slow.at(2.468).unwrap());
    near(&a.q().angles(), &b.q().angles(), 1e-14);
    near(&a.qd(), &b.qd().map(|w| 2.0 * w), 1e-13);
    near(&a.qdd(), &b.qdd().map(|w| 4.0 * w), 1e-11);
    assert_eq!(path.at(8.0).unwrap().qd(), [0.0; 5]);
    assert_eq!(path.at(-1.0).unwrap().q(), path.at(0.0).unwrap().q());
}
