//! Every vector of the golden file. Tolerances are the file's own: 1e-12, IK joints 1e-9, poses 1e-13.

use super::{apart, level, pose};
use crate::shared_data;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use std::sync::OnceLock;
use strapd_attitude::frames::{Dcm, In};
use strapd_bodies::dh::Transform;
use strapd_bodies::youbot::*;

const EXACT: f64 = 1e-12;
const JOINT: f64 = 1e-9;
const POSE: f64 = 1e-13;

fn file() -> Option<&'static Value> {
    static FILE: OnceLock<Option<Value>> = OnceLock::new();
    FILE.get_or_init(|| {
        let path = shared_data::shared("golden/youbot_golden.json")?;
        Some(serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap())
    })
    .as_ref()
}

fn list(v: &Value) -> &[Value] {
    v.as_array().unwrap()
}
fn numbers(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}
fn five(v: &Value) -> [f64; 5] {
    numbers(v).try_into().unwrap()
}
fn joints(v: &Value) -> TableJoints {
    TableJoints::new(five(v)).unwrap()
}
fn vector(v: &Value) -> Vector3<f64> {
    Vector3::from_row_slice(&numbers(v))
}
fn target(v: &Value) -> Transform<Base, Tool> {
    let m = nalgebra::Matrix4::from_row_slice(&numbers(v));
    Transform::try_from_homogeneous(&m).unwrap()
}
fn motion(v: &Value) -> TableMotion {
    TableMotion::new(joints(&v["q"]), five(&v["qd"]), five(&v["qdd"])).unwrap()
}

#[track_caller]
fn close(what: &str, ours: &[f64], theirs: &Value, tolerance: f64) -> f64 {
    let theirs = numbers(theirs);
    assert_eq!(ours.len(), theirs.len(), "{what}");
    let mut worst = 0.0_f64;
    for (i, (a, b)) in ours.iter().zip(&theirs).enumerate() {
        let difference = (a - b).abs();
        assert!(
            difference <= tolerance,
            "{what}[{i}]: {a} against {b}, off by {difference:e}"
        );
        worst = worst.max(difference);
    }
    worst
}

/// Row by row, as the file has it.
fn rows<const R: usize, const C: usize>(m: &nalgebra::SMatrix<f64, R, C>) -> Vec<f64> {
    m.transpose().iter().copied().collect()
}

#[track_caller]
fn same_solutions(what: &str, arm: &Arm, found: &Solutions, golden: &Value) {
    let golden = list(golden);
    let ours = found.as_slice();
    assert_eq!(ours.len(), golden.len(), "{what}: number of solutions");
    for (s, g) in ours.iter().zip(golden) {
        close(&format!("{what}: joints"), &s.q.angles(), &g["q"], JOINT);
        assert_eq!(
            s.within_limits,
            g["in_limits"].as_bool().unwrap(),
            "{what}: limits of {:?}",
            s.q
        );
        let sine = (s.q.angles()[2] + arm.parameters().theta_offset[2]).sin();
        match g["elbow"].as_i64().unwrap() {
            0 => assert_eq!(s.elbow, Elbow::Straight, "{what}"),
            sign => {
                assert!(sine * sign as f64 > 0.0, "{what}: elbow");
                let up = (sign < 0) == (s.base == BaseTurn::Front);
                let label = if up { Elbow::Up } else { Elbow::Down };
                assert_eq!(s.elbow, label, "{what}");
            }
        }
    }
}

fn check_pose(arm: &Arm, case: &Value, what: &str) {
    let q = joints(&case["q"]);
    let ours = arm.forward(&q);
    close(what, &rows(&ours.to_homogeneous()), &case["T"], EXACT);
    close(what, &rows(&arm.jacobian(&q)), &case["J"], EXACT);
    let [.., last] = arm.link_poses(&q);
    close(what, &rows(&last.to_homogeneous()), &case["T"], EXACT);
    if let Some(quat) = case.get("quat_wxyz") {
        let attitude = strapd_attitude::quaternion::Quaternion::from_dcm(&ours.rotation()).wxyz();
        let theirs = numbers(quat);
        // At half a turn w is zero to rounding, and both signs are the same attitude.
        let dot: f64 = attitude.iter().zip(&theirs).map(|(a, b)| a * b).sum();
        let aligned = attitude.map(|c| c * dot.signum());
        close(what, &aligned, quat, EXACT);
    }
    let hint = case
        .get("q1_hint")
        .map(|h| TableJoints::new([h.as_f64().unwrap(), 0.0, 0.0, 0.0, 0.0]).unwrap());
    let wanted = target(&case["T"]);
    let found = arm
        .inverse(&wanted, Policy::default(), hint.as_ref())
        .unwrap();
    same_solutions(what, arm, &found, &case["solutions"]);
    assert_eq!(
        found.theta1_free,
        case["theta1_free"].as_bool().unwrap(),
        "{what}"
    );
    for s in found.as_slice() {
        let (p, a) = apart(&arm.forward(&s.q), &wanted);
        assert!(p <= POSE && a <= POSE, "{what}: {p:e} m, {a:e} rad");
    }
    let [sine, base] = arm.singularity_measures(&q);
    close(
        what,
        &[sine],
        &Value::from(case["sin_theta3"].as_f64().unwrap().abs()),
        EXACT,
    );
    close(what, &[base], &case["base_measure"], EXACT);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_pose_jacobian_and_solution_of_the_seed_preset() {
    let Some(g) = file() else { return };
    for (i, case) in list(&g["fk_ik"]).iter().enumerate() {
        check_pose(&Arm::published(), case, &format!("fk_ik[{i}]"));
    }
    assert_eq!(list(&g["fk_ik"]).len(), 200);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_pose_jacobian_and_solution_of_the_urdf_preset() {
    let Some(g) = file() else { return };
    for (i, case) in list(&g["fk_ik_urdf_preset"]).iter().enumerate() {
        check_pose(&Arm::urdf(), case, &format!("urdf[{i}]"));
    }
    assert_eq!(list(&g["fk_ik_urdf_preset"]).len(), 50);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_special_pose() {
    let Some(g) = file() else { return };
    let special = g["special"].as_object().unwrap();
    for (name, case) in special {
        check_pose(&Arm::published(), case, name);
    }
    assert_eq!(special.len(), 9);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_presets_hold_the_files_numbers() {
    let Some(g) = file() else { return };
    let meta = &g["meta"];
    for (arm, key) in [(Arm::published(), "dh"), (Arm::urdf(), "urdf_preset")] {
        close(key, &arm.links().map(|l| l.a()), &meta[key]["a"], 0.0);
        close(key, &arm.links().map(|l| l.d()), &meta[key]["d"], 0.0);
        let limits = arm.limits();
        close(key, &limits.min(), &meta["q_min"], 1e-15);
        close(key, &limits.max(), &meta["q_max"], 1e-15);
        let p = arm.parameters();
        close(key, &p.driver_zero, &meta["driver_offset"], 1e-15);
        close(key, &p.fastest, &meta["qd_max"], 0.0);
        close(key, &p.theta_offset, &meta["dh"]["theta_offset"], 0.0);
    }
    for (arm, key) in [
        (Arm::published(), "links_seed"),
        (Arm::urdf(), "links_urdf"),
    ] {
        let links = published_links(&arm).unwrap();
        for (link, theirs) in links.iter().zip(list(&meta[key])) {
            close(key, &[link.mass()], &theirs["m"], 0.0);
            close(key, link.r_og_b().as_slice(), &theirs["com"], 1e-15);
            close(
                key,
                &rows(&link.inertia_cg()),
                &theirs["inertia_com"],
                1e-17,
            );
        }
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn unreachable_targets_under_the_four_policies() {
    let Some(g) = file() else { return };
    let arm = Arm::published();
    let length = g["unreachable"]["lp"].as_f64().unwrap();
    let policies = [
        // The file's plane weighs 0.3 m as much as a radian for every policy.
        (
            "reject",
            Policy::Reject {
                position: length * 1e-9,
                angle: 1e-9,
            },
        ),
        ("keep_position", Policy::KeepPosition),
        ("keep_approach", Policy::KeepApproach),
        ("weighted", Policy::Weighted { length }),
    ];
    let cases = list(&g["unreachable"]["cases"]);
    assert_eq!(cases.len(), 40);
    for (i, case) in cases.iter().enumerate() {
        let wanted = target(&case["T"]);
        for (name, policy) in policies {
            let theirs = &case[name];
            let what = format!("unreachable[{i}].{name}");
            match (
                theirs["status"].as_str().unwrap(),
                arm.inverse(&wanted, policy, None),
            ) {
                ("ok", Ok(found)) => {
                    same_solutions(&what, &arm, &found, &theirs["solutions"]);
                    close(&what, &[found.plane_position], &theirs["plane_pos"], EXACT);
                    close(&what, &[found.plane_angle], &theirs["plane_ang"], EXACT);
                    close(&what, &found.reach_excess, &theirs["reach_excess"], EXACT);
                    for (s, g) in found.as_slice().iter().zip(list(&theirs["solutions"])) {
                        let (p, a) = apart(&arm.forward(&s.q), &wanted);
                        close(&what, &[p], &g["pos_residual"], EXACT);
                        close(&what, &[a], &g["ang_residual"], EXACT);
                        // And what the solution says of itself is what it is.
                        assert!((s.position_residual - p).abs() <= POSE, "{what}");
                        assert!((found.angle_residual() - a).abs() <= POSE, "{what}");
                    }
                }
                (
                    "out_of_plane",
                    Err(ArmError::OutOfPlane {
                        position, angle, ..
                    }),
                ) => {
                    close(&what, &[position], &theirs["plane_pos"], EXACT);
                    close(&what, &[angle], &theirs["plane_ang"], EXACT);
                }
                ("out_of_reach", Err(ArmError::OutOfReach(reach))) => {
                    close(&what, &reach.excess(), &theirs["reach_excess"], EXACT);
                }
                (status, ours) => panic!("{what}: {status} there, {ours:?} here"),
            }
        }
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn velocities_accelerations_torques_and_energies() {
    let Some(g) = file() else { return };
    let cases = list(&g["dynamics"]);
    assert_eq!(cases.len(), 100);
    let (seed, urdf) = (Arm::published(), Arm::urdf());
    let with_links =
        |arm: Arm| Dynamics::new(arm, published_links(&arm).unwrap(), level()).unwrap();
    let (heavy_seed, heavy_urdf) = (with_links(seed), with_links(urdf));
    let mut worst = 0.0_f64;
    for (i, case) in cases.iter().enumerate() {
        let what = format!("dynamics[{i}]");
        let m = motion(case);
        for (j, link) in seed.link_motions(&m).iter().enumerate() {
            close(
                &what,
                link.rate.as_vector().as_slice(),
                &case["omega"][j],
                EXACT,
            );
            let change = link.rate_change.as_vector();
            close(&what, change.as_slice(), &case["omega_dot"][j], EXACT);
            close(
                &what,
                link.velocity.as_vector().as_slice(),
                &case["v"][j],
                EXACT,
            );
            let a = link.acceleration.as_vector();
            close(&what, a.as_slice(), &case["a"][j], EXACT);
        }
        let mut torque = |ours: SeedTorques, theirs: &str| {
            worst = worst.max(close(&what, &ours.0, &case[theirs], EXACT));
        };
        torque(heavy_seed.torques(&m), "tau_seed");
        torque(heavy_urdf.torques(&m), "tau_urdf");
        torque(heavy_urdf.torques(&m), "tau_urdf_pinocchio");
        torque(heavy_seed.gravity_torques(m.q()), "gravity_seed");
        let tip = Wrench::new(
            In::assume(vector(&case["tip_force"])),
            In::assume(vector(&case["tip_moment"])),
        )
        .unwrap();
        torque(heavy_seed.torques_with_tip(&m, &tip), "tau_seed_with_tip");
        close(
            &what,
            &rows(&heavy_seed.mass_matrix(m.q())),
            &case["M_seed"],
            EXACT,
        );
        let energy = heavy_seed.energy(&m);
        close(&what, &[energy.kinetic], &case["kinetic"], EXACT);
        close(&what, &[energy.potential], &case["potential"], EXACT);
    }
    println!("worst torque difference {worst:e} N m");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn an_imu_on_the_joint_trajectory() {
    let Some(g) = file() else { return };
    let golden = &g["gyro_joint_trajectory"];
    let [c, a, w, p] = ["c", "A", "w", "p"].map(|k| five(&golden[k]));
    let path = JointPath::sinusoids(std::array::from_fn(|i| Sinusoid {
        centre: c[i],
        amplitude: a[i],
        angular_frequency: w[i],
        phase: p[i],
    }))
    .unwrap();
    assert_eq!(path, JointPath::demonstration());
    let imu = Gripper::along_joints(Arm::published(), path, ImuMount::at_tool(), level()).unwrap();
    let samples = list(&golden["samples"]);
    assert_eq!(samples.len(), 201);
    for sample in samples {
        let secs = sample["t"].as_f64().unwrap();
        let what = format!("t = {secs}");
        let nanos = (secs * 1e9).round() as u64;
        let m = imu.joints(nanos);
        close(&what, &m.q().angles(), &sample["q"], EXACT);
        close(&what, &m.qd(), &sample["qd"], EXACT);
        close(&what, &m.qdd(), &sample["qdd"], EXACT);
        let reading = imu.read(nanos);
        close(&what, reading.rate.0.as_slice(), &sample["gyro"], EXACT);
        let f = reading.specific_force.as_vector();
        close(&what, f.as_slice(), &sample["accel"], EXACT);
        let q = reading.attitude().wxyz();
        let theirs = numbers(&sample["quat_wxyz"]);
        let dot: f64 = q.iter().zip(&theirs).map(|(a, b)| a * b).sum();
        close(
            &what,
            &q.map(|c| c * dot.signum()),
            &sample["quat_wxyz"],
            EXACT,
        );
        let place = reading.t_base_imu.translation();
        close(&what, place.as_vector().as_slice(), &sample["p"], EXACT);
    }
}

/// The file's formula: x, y, z, pitch, roll.
pub(crate) fn cartesian_path() -> ToolPath {
    let wave = |centre, amplitude, angular_frequency, phase| Sinusoid {
        centre,
        amplitude,
        angular_frequency,
        phase,
    };
    ToolPath::waves([
        wave(0.31, 0.04, 0.8, std::f64::consts::FRAC_PI_2),
        wave(0.0, 0.1, 0.8, 0.0),
        wave(0.2, 0.03, 1.6, 0.0),
        wave(1.15, 0.15, 0.8, 0.0),
        wave(0.0, 0.9, 0.6, 0.0),
    ])
    .unwrap()
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_gripper_along_the_cartesian_trajectory() {
    let Some(g) = file() else { return };
    let arm = Arm::published();
    let path = cartesian_path();
    let samples = list(&g["cartesian_trajectory"]["samples"]);
    assert_eq!(samples.len(), 401);
    let start = joints(&samples[0]["q"]);
    let track = ToolTrack::new(arm, path, &start).unwrap();
    let mut follower = Follower::new(arm, start, Policy::default(), 1e-9).unwrap();
    for sample in samples {
        let secs = sample["t"].as_f64().unwrap();
        let what = format!("t = {secs}");
        let wanted = path.at(secs).unwrap();
        close(
            &what,
            &rows(&wanted.t_base_tool.to_homogeneous()),
            &sample["T"],
            EXACT,
        );
        let (v, w) = (wanted.twist.v.as_vector(), wanted.twist.w.as_vector());
        let twist: Vec<f64> = v.iter().chain(w.iter()).copied().collect();
        close(&what, &twist, &sample["twist"], EXACT);
        for m in [
            track.at(secs).unwrap(),
            follower.step(secs, &wanted).unwrap(),
        ] {
            close(&what, &m.q().angles(), &sample["q"], JOINT);
            close(&what, &m.qd(), &sample["qd"], JOINT);
            close(&what, &m.qdd(), &sample["qdd"], JOINT);
            let (p, a) = apart(&arm.forward(m.q()), &wanted.t_base_tool);
            assert!(p <= POSE && a <= POSE, "{what}: {p:e} m, {a:e} rad");
            let reading = ImuMount::at_tool().read(&arm, &m, &level());
            close(&what, reading.rate.0.as_slice(), &sample["gyro"], JOINT);
            let f = reading.specific_force.as_vector();
            close(&what, f.as_slice(), &sample["accel"], JOINT);
        }
    }
}

#[test]
fn the_external_candle_vector() {
    // From the tests of svenschneider/youbot-manipulation 445c872 (numbers only): the arm without the
    // 2 mm between its last axes, upright, in arm_link_0 and arm_link_5.
    let arm = Arm::new(Parameters {
        a4: 0.0,
        ..Parameters::urdf()
    })
    .unwrap();
    let wanted = Transform::<ArmLink0, ArmLink5>::new(
        Dcm::identity(),
        In::assume(Vector3::new(0.057, 0.0, 0.535)),
    );
    let t_base_tool = arm.t_armlink0_base().inverse() * wanted * arm.t_armlink5_tool();
    let found = arm.inverse(&t_base_tool, Policy::default(), None).unwrap();
    assert_eq!(found.as_slice().len(), 1);
    let u = arm.driver_joints(&found.as_slice()[0].q).angles();
    for (ours, theirs) in u.iter().zip([2.9496, 1.1344, -2.5482, 1.7890, 2.9234]) {
        // Four digits, of which 1.1344(6) was cut and not rounded.
        assert!((ours - theirs).abs() < 1e-4, "{u:?}");
    }
    let upright = pose(
        Vector3::new(0.033, 0.0, 0.535),
        Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0)),
    );
    let (p, a) = apart(&t_base_tool, &upright);
    assert!(p < 1e-15 && a < 1e-15, "{p:e} {a:e}");
}
