//! Forward and inverse kinematics on random joints and random poses in space. Ten thousand each time,
//! a million on request (`--ignored`).

use super::{apart, in_limits, odd_arm, pose};
use nalgebra::{Matrix3, SVector, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use strapd_attitude::frames::Dcm;
use strapd_attitude::quaternion::Quaternion;
use strapd_bodies::dh::Transform;
use strapd_bodies::youbot::*;

fn random_rotation(rng: &mut impl Rng) -> Matrix3<f64> {
    loop {
        let mut axis = || rng.random_range(-1.0..1.0_f64);
        let q = [axis(), axis(), axis(), axis()];
        let square: f64 = q.iter().map(|c| c * c).sum();
        if (0.01..1.0).contains(&square) {
            let q = Quaternion::<Base, Tool>::assume_unit(q).normalised();
            return *q.to_dcm().as_matrix();
        }
    }
}

/// Every reachable pose is reached, by every solution, and the joints it came from are among them.
fn there_and_back(arm: &Arm, count: usize, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut position, mut angle, mut scaled, mut away) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    for _ in 0..count {
        let q = in_limits(arm, &mut rng);
        let t = arm.forward(&q);
        let found = arm
            .inverse(&t, Policy::default(), None)
            .unwrap_or_else(|e| panic!("{q:?} missed: {e}"));
        for s in found.as_slice() {
            let (p, a) = apart(&arm.forward(&s.q), &t);
            (position, angle) = (position.max(p), angle.max(a));
        }
        let off = |s: &Solution| {
            let pairs = s.q.angles().into_iter().zip(q.angles());
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let nearest = found
            .as_slice()
            .iter()
            .map(off)
            .fold(f64::INFINITY, f64::min);
        let [sine, base] = arm.singularity_measures(&q);
        let measure = sine.min(base);
        scaled = scaled.max(nearest * measure);
        if measure > 1e-3 {
            away = away.max(nearest);
            assert!(
                found.nearest(&q).is_ok(),
                "{q:?} within limits, but no solution is"
            );
        }
    }
    println!(
        "{count} joint vectors: {position:.1e} m, {angle:.1e} rad; joints off by {away:.1e} rad away \
         from singularities, {scaled:.1e} rad over the distance from them"
    );
    assert!(position <= 1e-14, "position {position:e} m");
    assert!(angle <= 1e-14, "angle {angle:e} rad");
    // eps / |sin th3|, with the few roundings in front.
    assert!(scaled <= 1e-14, "joints {scaled:e}");
}

#[test]
fn ten_thousand_joint_vectors_are_found_again() {
    there_and_back(&Arm::published(), 10_000, 1);
    there_and_back(&Arm::urdf(), 10_000, 2);
    there_and_back(&odd_arm(), 10_000, 3);
}

#[test]
#[ignore = "a million: minutes in the debug profile"]
fn a_million_joint_vectors_are_found_again() {
    there_and_back(&Arm::published(), 1_000_000, 11);
    there_and_back(&Arm::urdf(), 1_000_000, 12);
}

/// Distance of the wrist from the shoulder for both turns of the base, the long way round: the target
/// projected with a rotation matrix, the points of the arm in space. For a4 = 0.
fn wrist_distances(arm: &Arm, p: &Vector3<f64>, r: &Matrix3<f64>, policy: Policy) -> [f64; 2] {
    let g = arm.parameters();
    let approach = Vector3::from(r.column(2));
    let th1 = match policy {
        Policy::KeepPosition => p.y.atan2(p.x),
        Policy::KeepApproach => approach.y.atan2(approach.x),
        // Half of one degree steps, then bisection by Newton's rule on the derivative.
        _ => {
            let cost = |th: f64| {
                let n = Vector3::new(th.sin(), -th.cos(), 0.0);
                n.dot(p).powi(2) + n.dot(&approach).powi(2)
            };
            let best = (0..360)
                .map(|i| f64::from(i) * PI / 360.0)
                .min_by(|a, b| cost(*a).total_cmp(&cost(*b)))
                .unwrap();
            let (mut lo, mut hi) = (best - 0.01, best + 0.01);
            for _ in 0..100 {
                let (a, b) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
                if cost(a) < cost(b) { hi = b } else { lo = a }
            }
            lo
        }
    };
    let n = Vector3::new(th1.sin(), -th1.cos(), 0.0);
    let p = p - n * n.dot(p);
    let approach = (approach - n * n.dot(&approach)).normalize();
    let wrist = p - approach * g.d5;
    [1.0, -1.0].map(|side| {
        let shoulder = Vector3::new(th1.cos() * g.a1 * side, th1.sin() * g.a1 * side, g.d1);
        (wrist - shoulder).norm()
    })
}

/// Any pose in space under every policy: finite numbers, the residuals it says, the right verdict.
fn anywhere(count: usize, seed: u64) {
    let arm = Arm::published();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let policies = [
        Policy::default(),
        Policy::KeepPosition,
        Policy::KeepApproach,
        Policy::Weighted { length: 1.0 },
    ];
    let (mut reached, mut refused, mut worst) = (0, 0, 0.0_f64);
    for _ in 0..count {
        let mut side = || rng.random_range(-0.7..0.7);
        let p = Vector3::new(side(), side(), side());
        let r = random_rotation(&mut rng);
        let target = pose(p, r);
        for policy in policies {
            match arm.inverse(&target, policy, None) {
                Ok(found) => {
                    reached += 1;
                    for s in found.as_slice() {
                        let (p, a) = apart(&arm.forward(&s.q), &target);
                        let off = (p - s.position_residual)
                            .abs()
                            .max((a - found.angle_residual()).abs());
                        worst = worst.max(off);
                        assert!(s.q.angles().iter().all(|x| x.is_finite()));
                    }
                }
                Err(ArmError::OutOfReach(reach)) => {
                    refused += 1;
                    let theirs = wrist_distances(&arm, &p, &r, policy);
                    let mut ours = reach.wanted;
                    let swap = (ours[0] - theirs[0]).abs() > (ours[0] - theirs[1]).abs();
                    if swap {
                        ours.swap(0, 1);
                    }
                    for (a, b) in ours.into_iter().zip(theirs) {
                        // The comparison's own search for the plane is good to the root of eps.
                        assert!((a - b).abs() < 1e-6, "{policy:?}: {a} against {b}");
                        assert!(!(0.02..=0.29).contains(&b), "{policy:?}: {b} m is in reach");
                    }
                }
                Err(ArmError::OutOfPlane {
                    position, angle, ..
                }) => {
                    assert!(matches!(policy, Policy::Reject { .. }));
                    assert!(position.abs() > 1e-9 || angle.abs() > 1e-9);
                }
                Err(other) => panic!("{policy:?}: {other}"),
            }
        }
    }
    println!("{count} poses: {reached} taken, {refused} out of reach, residuals to {worst:.1e}");
    assert!(reached > count / 10 && refused > count / 10);
    assert!(worst <= 1e-13, "{worst:e}");
}

#[test]
fn ten_thousand_poses_in_space_get_the_right_verdict() {
    anywhere(2_500, 4);
}

#[test]
#[ignore = "a million: minutes in the debug profile"]
fn a_million_poses_in_space_get_the_right_verdict() {
    anywhere(250_000, 14);
}

#[test]
fn the_closed_form_is_the_product_of_the_links() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    for arm in [Arm::published(), Arm::urdf(), odd_arm()] {
        for _ in 0..2_000 {
            let q = in_limits(&arm, &mut rng);
            let [.., last] = arm.link_poses(&q);
            let ours = arm.forward(&q).to_homogeneous();
            assert!((ours - last.to_homogeneous()).amax() <= 2e-15);
        }
    }
}

#[test]
fn the_determinant_of_the_jacobian_knows_both_singularities() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for arm in [Arm::published(), odd_arm()] {
        let p = *arm.parameters();
        for _ in 0..2_000 {
            let q = in_limits(&arm, &mut rng);
            let j = arm.jacobian(&q);
            let [sine, base] = arm.singularity_measures(&q);
            let theirs = (p.a2 * p.a3 * sine * base).powi(2);
            assert!(((j.transpose() * j).determinant() - theirs).abs() <= 1e-16);
            let lost = arm.lost_direction(&q).unwrap();
            let (v, w) = (lost.v.as_vector(), lost.w.as_vector());
            let c = SVector::<f64, 6>::from_column_slice(&[v.x, v.y, v.z, w.x, w.y, w.z]);
            assert!((c.norm() - 1.0).abs() < 1e-14);
            assert!((c.transpose() * j).amax() < 1e-15);
        }
    }
}

#[test]
fn rates_are_those_of_the_pseudo_inverse() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for arm in [Arm::published(), Arm::urdf(), odd_arm()] {
        for _ in 0..500 {
            let q = in_limits(&arm, &mut rng);
            let [sine, base] = arm.singularity_measures(&q);
            if sine.min(base) < 0.05 {
                continue;
            }
            let j = arm.jacobian(&q);
            // Any twist, also what the arm cannot do: least squares.
            let t = SVector::<f64, 6>::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let twist = Twist {
                v: strapd_attitude::frames::In::assume(Vector3::new(t[0], t[1], t[2])),
                w: strapd_attitude::frames::In::assume(Vector3::new(t[3], t[4], t[5])),
            };
            let ours = SVector::from(arm.joint_rates(&q, &twist, 10.0).unwrap());
            let normal = j.transpose() * (j * ours - t);
            assert!(normal.amax() < 1e-12, "{:e}", normal.amax());
            // Its feasible part is met exactly.
            let (kept, defect) = arm.feasible_twist(&q, &twist).unwrap();
            let k = [kept.v.as_vector(), kept.w.as_vector()];
            let kept6 = SVector::<f64, 6>::from_fn(|i, _| k[i / 3][i % 3]);
            assert!((j * ours - kept6).amax() < 1e-13);
            assert!(((t - kept6).norm() - defect.abs()).abs() < 1e-14);
            let refused = arm.joint_rates(&q, &twist, 0.5 * defect.abs());
            assert!(matches!(refused, Err(ArmError::InfeasibleTwist { .. })));
        }
    }
}

#[test]
fn near_singularities_the_pose_keeps_its_digits() {
    let arm = Arm::published();
    let mut worst = (0.0_f64, 0.0_f64);
    for exponent in 0..40 {
        let tiny = 10.0_f64.powf(-0.5 * f64::from(exponent));
        for elbow in [tiny, -tiny, PI - tiny, tiny - PI] {
            let q = TableJoints::new([0.3, 0.2, elbow, 1.0, 0.4]).unwrap();
            let t = arm.forward(&q);
            let found = arm.inverse(&t, Policy::default(), None).unwrap();
            for s in found.as_slice() {
                let (p, a) = apart(&arm.forward(&s.q), &t);
                worst = (worst.0.max(p), worst.1.max(a));
            }
        }
    }
    println!(
        "near straight and folded: {:.1e} m, {:.1e} rad",
        worst.0, worst.1
    );
    // Merging two elbows 1e-7 rad from straight costs a2 a3 / (a2 + a3) (1e-7)^2 / 2 = 4e-16 m.
    assert!(worst.0 <= 3e-15 && worst.1 <= 3e-15, "{worst:?}");
}

#[test]
fn a_free_joint_1_stays_with_the_current_joints_unless_joint_5_would_hit_its_stop() {
    let arm = Arm::published();
    // Tool point on the base axis, approach straight down.
    for hint in [-2.5, -0.4, 0.0, 1.0, 2.9] {
        for spin in [-3.0, -1.0, 0.2, 2.0, 3.1] {
            let (s, c) = f64::sin_cos(spin);
            let r = Matrix3::new(c, s, 0.0, s, -c, 0.0, 0.0, 0.0, -1.0);
            let target = pose(Vector3::new(0.0, 0.0, 0.11), r);
            let current = TableJoints::new([hint, 0.0, 0.0, 0.0, 0.0]).unwrap();
            let found = arm
                .inverse(&target, Policy::default(), Some(&current))
                .unwrap();
            assert!(found.theta1_free);
            let first = found.as_slice()[0].q.angles();
            for s in found.as_slice() {
                let (p, a) = apart(&arm.forward(&s.q), &target);
                assert!(p < 1e-15 && a < 3e-15, "{p:e} {a:e}");
            }
            let turned = (first[0] - hint).abs();
            let stop = 167.5_f64.to_radians();
            assert!(first[4].abs() <= stop + 1e-12, "joint 5 at {}", first[4]);
            // 12.5 degrees lie between the stop and half a turn.
            assert!(turned < 1e-12 || (first[4].abs() - stop).abs() < 1e-12);
            assert!(turned <= 12.5_f64.to_radians() + 1e-12, "{turned}");
        }
    }
}

#[test]
fn the_nearest_solution_is_between_the_stops_and_weighs_joints() {
    let arm = Arm::published();
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for _ in 0..500 {
        let t = arm.forward(&in_limits(&arm, &mut rng));
        let found = arm.inverse(&t, Policy::default(), None).unwrap();
        let current = in_limits(&arm, &mut rng);
        let weights: [f64; 5] = std::array::from_fn(|_| rng.random_range(0.1..3.0));
        let chosen = found.nearest_weighted(&current, &weights).unwrap();
        assert!(arm.limits().contain(&chosen.q));
        let cost = |s: &Solution| {
            let pairs = s.q.angles().into_iter().zip(current.angles()).zip(weights);
            pairs
                .map(|((a, b), w)| w * (a - b).abs())
                .fold(0.0, f64::max)
        };
        for s in found.as_slice().iter().filter(|s| s.within_limits) {
            assert!(cost(chosen) <= cost(s));
        }
    }
}

#[test]
fn frames_of_the_urdf_meet_those_of_the_model() {
    // The same arm, once from arm_link_0 to arm_link_5 by either preset (a4 aside).
    let flat = Arm::new(Parameters {
        a4: 0.0,
        ..Parameters::urdf()
    })
    .unwrap();
    let (seed, mut rng) = (Arm::published(), ChaCha8Rng::seed_from_u64(10));
    for _ in 0..100 {
        let q = in_limits(&seed, &mut rng);
        let by = |arm: &Arm| -> Transform<ArmLink0, ArmLink5> {
            arm.t_armlink0_base() * arm.forward(&q) * arm.t_armlink5_tool().inverse()
        };
        let (a, b) = (by(&seed).to_homogeneous(), by(&flat).to_homogeneous());
        assert!((a - b).amax() < 1e-15);
    }
    let _: Dcm<ArmLink0, Base> = seed.t_armlink0_base().rotation();
}
