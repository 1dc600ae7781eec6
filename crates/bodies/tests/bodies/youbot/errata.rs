//! The source document's errors Y1 to Y21, each refuted by name, or the right statement shown beside it.
//! Y7 (one pose proves nothing) is the reason for `random.rs`; Y19 repeats an equation.

use super::{apart, degrees, in_limits, level, pose};
use nalgebra::{Matrix3, Matrix4, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use strapd_attitude::quaternion::Quaternion;
use strapd_bodies::youbot::*;

const MANY: usize = 10_000;

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(5)
}

/// (2.4), and (2.7), which repeats it (Y19).
fn a(theta: f64, d: f64, a: f64, alpha: f64) -> Matrix4<f64> {
    let ((s, c), (sa, ca)) = (theta.sin_cos(), alpha.sin_cos());
    Matrix4::new(
        c,
        -ca * s,
        sa * s,
        a * c,
        s,
        ca * c,
        -sa * c,
        a * s,
        0.0,
        sa,
        ca,
        d,
        0.0,
        0.0,
        0.0,
        1.0,
    )
}

/// The document's six matrices below (2.7), with its symbols.
struct Six {
    d1: f64,
    a2: f64,
    a3: f64,
    d2: f64,
    a4: f64,
    d6: f64,
}
impl Six {
    const SHIFTED: Six = Six {
        d1: 0.147,
        a2: 0.033,
        a3: 0.155,
        d2: 0.0,
        a4: 0.135,
        d6: 0.218,
    };
    fn product(&self, theta: [f64; 5]) -> Matrix4<f64> {
        a(0.0, self.d1, 0.0, 0.0)
            * a(theta[0], 0.0, self.a2, FRAC_PI_2)
            * a(theta[1], self.d2, self.a3, 0.0)
            * a(theta[2], 0.0, self.a4, 0.0)
            * a(theta[3], 0.0, 0.0, FRAC_PI_2)
            * a(theta[4], self.d6, 0.0, 0.0)
    }
}

fn theta(q: &TableJoints) -> [f64; 5] {
    let mut theta = q.angles();
    theta[1] += FRAC_PI_2;
    theta
}

fn place(m: &Matrix4<f64>) -> [f64; 3] {
    [m[(0, 3)], m[(1, 3)], m[(2, 3)]]
}

#[track_caller]
fn near(ours: &[f64], theirs: &[f64], tolerance: f64) {
    assert_eq!(ours.len(), theirs.len());
    for (a, b) in ours.iter().zip(theirs) {
        assert!((a - b).abs() <= tolerance, "{ours:?} against {theirs:?}");
    }
}

#[test]
fn y1_six_matrices_need_the_table_shifted_by_one() {
    let (arm, mut rng) = (Arm::published(), rng());
    for _ in 0..100 {
        let q = in_limits(&arm, &mut rng);
        let ours = arm.forward(&q).to_homogeneous();
        let six = Six::SHIFTED.product(theta(&q));
        assert!((ours - six).amax() < 1e-15, "{:e}", (ours - six).amax());
    }
    let literal = Six {
        d1: 0.147,
        a2: 0.155,
        a3: 0.135,
        d2: 0.0,
        a4: 0.0,
        d6: 0.0,
    };
    let check = degrees([0.0, 0.0, 0.0, 90.0, 0.0]);
    near(
        &place(&literal.product(theta(&check))),
        &[0.155, 0.0, 0.282],
        1e-15,
    );
}

#[test]
fn y2_the_stray_d2_would_move_the_tool_sideways() {
    let q = degrees([0.0, 10.0, -30.0, 70.0, 20.0]);
    let stray = Six {
        d2: 0.02,
        ..Six::SHIFTED
    };
    let difference = stray.product(theta(&q)) - Arm::published().forward(&q).to_homogeneous();
    near(&place(&difference), &[0.0, -0.02, 0.0], 1e-15);
}

#[test]
fn y3_the_check_pose_is_in_q_and_not_in_theta() {
    let arm = Arm::published();
    // (2.8), (2.9) as joint angles q: exact.
    let ours = arm.forward(&degrees([0.0, 0.0, 0.0, 90.0, 0.0]));
    let r = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
    let (p, angle) = apart(&ours, &pose(Vector3::new(0.033, 0.0, 0.655), r));
    assert!(p < 2e-16 && angle < 2e-16, "{p:e} m, {angle:e} rad");
    // As theta, as printed: the arm lies flat.
    let printed = arm.forward(&degrees([0.0, -90.0, 0.0, 90.0, 0.0]));
    let flat = Matrix3::new(0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0);
    let (p, angle) = apart(&printed, &pose(Vector3::new(0.541, 0.0, 0.147), flat));
    assert!(p < 2e-16 && angle < 2e-16, "{p:e} m, {angle:e} rad");
}

#[test]
fn y4_its_90_is_in_degrees() {
    let radians = TableJoints::new([0.0, 0.0, 0.0, 90.0, 0.0]).unwrap();
    let p = Arm::published().forward(&radians).translation();
    near(p.as_vector().as_slice(), &[-0.065, 0.0, 0.632], 5e-4);
}

#[test]
fn y5_the_180_degrees_are_yaw() {
    let ours = Arm::published().forward(&degrees([0.0, 0.0, 0.0, 90.0, 0.0]));
    let ypr = Quaternion::from_dcm(&ours.rotation()).yaw_pitch_roll();
    near(
        &[ypr.yaw.abs(), ypr.pitch, ypr.roll],
        &[PI, 0.0, 0.0],
        1e-15,
    );
    // Read as "(roll, yaw, pitch)", the last would be the pitch.
    let pitched = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, -1.0));
    assert!((ours.rotation().as_matrix() - pitched).amax() > 1.9);
}

#[test]
fn y6_lengths_are_in_metres() {
    let p = Arm::published().parameters().to_owned();
    near(&[p.d1 + p.a2 + p.a3 + p.d5], &[0.655], 1e-15);
}

#[test]
fn y7_a_wrong_table_passes_the_seeds_only_check() {
    let swapped = Arm::new(Parameters {
        a2: 0.135,
        a3: 0.155,
        ..Parameters::published()
    })
    .unwrap();
    let check = degrees([0.0, 0.0, 0.0, 90.0, 0.0]);
    let (p, angle) = apart(&swapped.forward(&check), &Arm::published().forward(&check));
    assert!(p < 2e-16 && angle == 0.0);
    let other = degrees([0.0, 40.0, 0.0, 90.0, 0.0]);
    let bent = degrees([0.0, 0.0, 60.0, 90.0, 0.0]);
    let (straight, _) = apart(&swapped.forward(&other), &Arm::published().forward(&other));
    let (p, _) = apart(&swapped.forward(&bent), &Arm::published().forward(&bent));
    assert!(straight < 2e-16 && p > 0.015, "{straight:e} {p}");
}

#[test]
fn y8_the_lost_page_2_11_equals_2_12() {
    let (arm, mut rng) = (Arm::published(), rng());
    for _ in 0..200 {
        let q = in_limits(&arm, &mut rng);
        let (th, t) = (theta(&q), arm.forward(&q).to_homogeneous());
        let (s1, c1) = th[0].sin_cos();
        let g = arm.parameters();
        let r = |row: usize, column: usize| t[(row - 1, column - 1)];
        let (px, py, pz) = (r(1, 4), r(2, 4), r(3, 4));
        let along = |k| r(1, k) * c1 + r(2, k) * s1;
        let across = |k| r(1, k) * s1 - r(2, k) * c1;
        let left = [
            along(1),
            along(2),
            along(3),
            px * c1 + py * s1 - g.a1,
            r(3, 1),
            r(3, 2),
            r(3, 3),
            pz - g.d1,
            across(1),
            across(2),
            across(3),
            px * s1 - py * c1,
        ];
        let (s2, c2) = th[1].sin_cos();
        let (s23, c23) = (th[1] + th[2]).sin_cos();
        let (s234, c234) = (th[1] + th[2] + th[3]).sin_cos();
        let (s5, c5) = th[4].sin_cos();
        let right = [
            c5 * c234,
            -s5 * c234,
            s234,
            g.a2 * c2 + g.a3 * c23 + g.d5 * s234,
            c5 * s234,
            -s5 * s234,
            -c234,
            g.a2 * s2 + g.a3 * s23 - g.d5 * c234,
            s5,
            c5,
            0.0,
            0.0,
        ];
        near(&left, &right, 2e-15);
    }
}

#[test]
fn y9_theta1_from_the_position_alone_loses_poses_and_digits() {
    let (arm, mut rng) = (Arm::published(), rng());
    let (mut front, mut both) = (0, 0);
    let (mut theirs, mut ours) = (0.0, 0.0);
    for _ in 0..MANY {
        let q = in_limits(&arm, &mut rng);
        let [q1, ..] = q.angles();
        let t = arm.forward(&q);
        let p = *t.translation().as_vector();
        let by_position = p.y.atan2(p.x);
        front += usize::from((by_position - q1).abs() < 1e-6);
        let found = arm.inverse(&t, Policy::default(), None).unwrap();
        let hit = |s: &&Solution| (s.q.angles()[0] - q1).abs() < 1e-6;
        both += usize::from(found.as_slice().iter().any(|s| hit(&s)));
        // A pose off by a micrometre and a microradian.
        let mut noise = || 1e-6 * (rng.random::<f64>() - 0.5);
        let n = Vector3::new(noise(), noise(), noise());
        let turn = Quaternion::<Tool, Tool>::assume_unit([1.0, noise(), noise(), noise()]);
        let r = t.rotation().as_matrix() * turn.normalised().to_dcm().as_matrix();
        let noisy = pose(p + n, r);
        let Ok(found) = arm.inverse(&noisy, Policy::Weighted { length: 1.0 }, None) else {
            continue; // stretched, and pushed outwards
        };
        let off = |x: f64| {
            let d = (x - q1).rem_euclid(PI);
            d.min(PI - d)
        };
        let noisy = noisy.translation();
        let (x, y) = (noisy.as_vector().x, noisy.as_vector().y);
        theirs += off(y.atan2(x)).powi(2);
        ours += off(found.as_slice()[0].q.angles()[0]).powi(2);
    }
    let share = front as f64 / MANY as f64;
    assert!((share - 0.575).abs() < 0.015, "front branch alone: {share}");
    assert_eq!(both, MANY);
    let ratio = (theirs / ours).sqrt();
    println!("theta1 under noise: {ratio:.0} times better than atan2(py, px)");
    assert!(ratio > 5.0, "{ratio}");
}

#[test]
fn y10_theta5_and_theta234_take_the_branch_of_theta1() {
    let arm = Arm::published();
    let q = degrees([30.0, 40.0, 50.0, 60.0, 70.0]);
    let r = *arm.forward(&q).rotation().as_matrix();
    let fifth = |th1: f64| {
        let (s1, c1) = th1.sin_cos();
        let s5 = r[(0, 0)] * s1 - r[(1, 0)] * c1;
        let c5 = r[(0, 1)] * s1 - r[(1, 1)] * c1;
        s5.atan2(c5)
    };
    let pitch = |th1: f64| {
        let (s1, c1) = th1.sin_cos();
        (r[(0, 2)] * c1 + r[(1, 2)] * s1).atan2(-r[(2, 2)])
    };
    let th1 = 30.0_f64.to_radians();
    // (2.15), (2.16) on the right branch, and flipped on the other.
    near(&[fifth(th1)], &[70.0_f64.to_radians()], 1e-15);
    near(&[fifth(th1 + PI)], &[-110.0_f64.to_radians()], 1e-15);
    let p = pitch(th1);
    near(&[p.rem_euclid(TAU)], &[240.0_f64.to_radians()], 1e-15);
    near(&[pitch(th1 + PI)], &[-p], 1e-15);
}

/// Wrist from the shoulder in the arm's plane.
fn wrist(q: &TableJoints) -> (f64, f64) {
    let th = theta(q);
    let (s, c) = (th[1] + th[2]).sin_cos();
    (
        0.155 * th[1].cos() + 0.135 * c,
        0.155 * th[1].sin() + 0.135 * s,
    )
}

#[test]
fn y11_the_law_of_cosines_subtracts_both_squares() {
    let q = degrees([0.0, 20.0, 70.0, 0.0, 0.0]);
    let (u, w) = wrist(&q);
    let (square, a2, a3) = (u * u + w * w, 0.155_f64, 0.135_f64);
    let right = (square - a2 * a2 - a3 * a3) / (2.0 * a2 * a3);
    near(&[right], &[70.0_f64.to_radians().cos()], 1e-15);
    // As printed in (2.17), with the six-matrix names a_3 = 155 and a_4 = 135 mm.
    let printed = (square - a2 * a2 - a2 * a2) / (2.0 * a2 * a3);
    assert!((printed - right).abs() > 0.1);
}

#[test]
fn y12_the_wrists_elevation_is_signed_and_from_the_level() {
    let arm = Arm::published();
    let q = degrees([25.0, 60.0, -20.0, 30.0, 0.0]);
    // 2p4 in frame 2 has no z: the printed Atan2 is a quarter turn for every pose.
    let poses = arm.link_poses(&q);
    let (second, fourth) = (poses[1], poses[3]);
    let p = second.inverse().point(fourth.translation());
    let [x, y, z] = [p.as_vector().x, p.as_vector().y, p.as_vector().z];
    assert!(z.abs() < 1e-16);
    near(&[x.hypot(y).atan2(z)], &[FRAC_PI_2], 1e-14);
    // Reaching backwards, the unsigned root puts the wrist in front.
    let (u, w) = wrist(&q);
    assert!(u < -0.1);
    let (th2, th3) = (theta(&q)[1], theta(&q)[2]);
    let beta = (0.135 * th3.sin()).atan2(0.155 + 0.135 * th3.cos());
    near(&[w.atan2(u) - beta], &[th2], 1e-15);
    assert!((w.atan2(u.abs()) - beta - th2).abs() > 0.5);
}

#[test]
fn y13_the_elbows_sign_counts_once() {
    let arm = Arm::published();
    for third in [70.0, -70.0] {
        let q = degrees([0.0, 20.0, third, 0.0, 0.0]);
        let (u, w) = wrist(&q);
        let beta = |th3: f64| (0.135 * th3.sin()).atan2(0.155 + 0.135 * th3.cos());
        let right = w.atan2(u) - beta(third.to_radians());
        near(&[right], &[theta(&q)[1]], 1e-15);
        // (2.19) has +, with theta3 negative; (2.20) has -, with theta3 positive: twice the same.
        let size = third.abs().to_radians();
        let (first, second) = (w.atan2(u) + beta(-size), w.atan2(u) - beta(size));
        near(&[first], &[second], 1e-15);
    }
    // Ours finds both elbows.
    let q = degrees([0.0, 20.0, 70.0, 30.0, 0.0]);
    let found = arm
        .inverse(&arm.forward(&q), Policy::default(), None)
        .unwrap();
    let thirds: Vec<f64> = found.as_slice().iter().map(|s| s.q.angles()[2]).collect();
    near(
        &thirds[..2],
        &[70.0_f64.to_radians(), -70.0_f64.to_radians()],
        1e-13,
    );
}

#[test]
fn y14_without_the_right_turn_of_theta4_poses_are_lost() {
    let (arm, mut rng) = (Arm::published(), rng());
    let limits = arm.limits();
    let mut lost = 0;
    for _ in 0..MANY {
        let q = in_limits(&arm, &mut rng);
        let found = arm
            .inverse(&arm.forward(&q), Policy::default(), None)
            .unwrap();
        assert!(found.first_within_limits().is_some(), "{q:?}");
        let reached_unwrapped = found.as_slice().iter().any(|s| {
            let th = theta(&s.q);
            let principal = |x: f64| x.sin().atan2(x.cos());
            let (th2, th3) = (principal(th[1]), principal(th[2]));
            let fourth = principal(th[1] + th[2] + th[3]) - th2 - th3;
            let mut unwrapped = s.q.angles();
            unwrapped[1] = th2 - FRAC_PI_2;
            unwrapped[3] = fourth;
            limits.contain(&TableJoints::new(unwrapped).unwrap())
        });
        lost += usize::from(!reached_unwrapped);
    }
    let share = lost as f64 / MANY as f64;
    println!(
        "without wrapping {:.1} % of reachable poses are lost",
        100.0 * share
    );
    assert!(share > 0.05, "{share}");
}

#[test]
fn y15_there_are_up_to_four_solutions_and_not_two() {
    let (arm, mut rng) = (Arm::published(), rng());
    let (mut all, mut inside) = ([0; 5], [0; 5]);
    for _ in 0..MANY {
        let q = in_limits(&arm, &mut rng);
        let found = arm
            .inverse(&arm.forward(&q), Policy::default(), None)
            .unwrap();
        all[found.as_slice().len()] += 1;
        inside[found.as_slice().iter().filter(|s| s.within_limits).count()] += 1;
    }
    let percent = |counts: [i32; 5]| counts.map(|n| 100.0 * f64::from(n) / MANY as f64);
    // Four standard deviations of ten thousand draws.
    near(&percent(all), &[0.0, 0.0, 26.0, 0.0, 74.0], 2.0);
    near(&percent(inside), &[0.0, 31.2, 46.5, 8.7, 13.5], 2.0);
}

#[test]
fn y16_unreachable_poses_are_told_apart() {
    let arm = Arm::published();
    let upright = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
    let far = arm.inverse(
        &pose(Vector3::new(0.033, 0.0, 0.675), upright),
        Policy::default(),
        None,
    );
    let Err(ArmError::OutOfReach(reach)) = far else {
        panic!("{far:?}")
    };
    near(&reach.excess()[..1], &[0.02], 1e-15);
    let near_by = arm.inverse(
        &pose(Vector3::new(0.033, 0.0, 0.380), upright),
        Policy::default(),
        None,
    );
    // Forwards the wrist is 15 mm above the shoulder and must be 20 away; over the back it gets there.
    let found = near_by.unwrap();
    near(&found.reach_excess, &[0.005, 0.0], 1e-15);
    assert!(found.as_slice().iter().all(|s| s.base == BaseTurn::Back));
}

#[test]
fn y17_the_published_masses_do_not_sum_to_the_data_sheet() {
    let links = published_links(&Arm::published()).unwrap();
    let sum: f64 = links.iter().map(|l| l.mass()).sum();
    near(&[sum], &[4.985], 1e-12);
    assert!((sum - 5.3).abs() > 0.3);
}

#[test]
fn y18_the_tool_length_is_a_parameter() {
    let arm = Arm::new(Parameters {
        d5: 0.2175,
        ..Parameters::published()
    })
    .unwrap();
    let p = arm
        .forward(&degrees([0.0, 0.0, 0.0, 90.0, 0.0]))
        .translation();
    near(p.as_vector().as_slice(), &[0.033, 0.0, 0.6545], 1e-15);
}

#[test]
fn y20_the_table_is_standard_and_not_modified() {
    let (arm, q) = (Arm::published(), degrees([10.0, 20.0, 30.0, 40.0, 50.0]));
    let g = arm.parameters();
    let rows = [
        (g.a1, FRAC_PI_2, g.d1),
        (g.a2, 0.0, 0.0),
        (g.a3, 0.0, 0.0),
        (0.0, FRAC_PI_2, 0.0),
        (0.0, 0.0, g.d5),
    ];
    let (mut standard, mut modified) = (Matrix4::identity(), Matrix4::identity());
    for (th, (length, alpha, d)) in theta(&q).into_iter().zip(rows) {
        standard *= a(th, d, length, alpha);
        // Twist and length first, about the axis before.
        modified *= a(0.0, 0.0, length, alpha) * a(th, d, 0.0, 0.0);
    }
    let ours = arm.forward(&q).to_homogeneous();
    assert!((ours - standard).amax() < 1e-15);
    assert!((ours - modified).amax() > 0.1);
}

#[test]
fn y21_the_encoders_count_the_other_way_from_the_folded_pose() {
    let arm = Arm::published();
    let zero = &arm.parameters().driver_zero;
    let u = DriverJoints::from_degrees([10.0, 20.0, -30.0, 40.0, 50.0]).unwrap();
    let q = arm.seed_joints(&u);
    near(
        &q.angles().map(f64::to_degrees),
        &[159.0, 45.0, -116.0, 152.5, 117.5],
        1e-13,
    );
    near(&arm.driver_joints(&q).angles(), &u.angles(), 1e-15);
    // Folded home, against the stops, is inside the limits; and the zero of the driver is not q = 0.
    let home = arm.seed_joints(&DriverJoints::new([0.0; 5]).unwrap());
    assert!(arm.limits().contain(&home));
    let (p, _) = apart(&arm.forward(&home), &arm.forward(&TableJoints::ZERO));
    assert!(p > 0.1);
    // Driver soft limits in seed angles (docs/youbot.md).
    let soft = Limits::driver(zero);
    near(
        &soft.min().map(f64::to_degrees),
        &[-165.6, -85.0, -145.1, -4.0, -155.7],
        0.051,
    );
    near(
        &soft.max().map(f64::to_degrees),
        &[168.4, 64.4, 142.0, 191.2, 161.2],
        0.051,
    );
    // Rates and torques turn with the angles: the power is the same.
    let ud = [0.1, -0.2, 0.3, -0.4, 0.5];
    let m = DriverMotion::new(u, ud, [1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
    let seed = m.to_seed(zero);
    let heavy = Dynamics::new(arm, published_links(&arm).unwrap(), level()).unwrap();
    let tau = heavy.torques(&seed);
    let power: f64 = tau.0.iter().zip(seed.qd()).map(|(t, w)| t * w).sum();
    let theirs: f64 = DriverTorques::from(tau)
        .0
        .iter()
        .zip(ud)
        .map(|(t, w)| t * w)
        .sum();
    assert_eq!(power, theirs);
    assert_eq!(seed.to_driver(zero).ud(), ud);
    assert_eq!(seed.to_driver(zero).udd(), m.udd());
    // The gripper really moves as the encoders say: backwards along +u1 is along -q1.
    let twist = arm.jacobian(&q) * nalgebra::SVector::from(seed.qd());
    let step = 1e-6;
    let moved = DriverJoints::new(std::array::from_fn(|i| u.angles()[i] + step * ud[i])).unwrap();
    let p = |u: &DriverJoints| *arm.forward(&arm.seed_joints(u)).translation().as_vector();
    let v = (p(&moved) - p(&u)) / step;
    near(v.as_slice(), &twist.as_slice()[..3], 1e-6);
}
