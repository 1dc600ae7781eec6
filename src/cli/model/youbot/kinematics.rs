//! Requests for poses, joints and velocities -> answers. Pure.

use super::{Answer, Convention, Preset, Setting, Unit, Wxyz, orientation, refusal};
use nalgebra::{Matrix3, SVector, Vector3};
use serde::Deserialize;
use serde_json::{Value, json};
use strapd_attitude::frames::{Dcm, In};
use strapd_bodies::dh::Transform;
use strapd_bodies::youbot::{BaseTurn, Elbow, Policy, Solution, Twist};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Forward {
    q: [f64; 5],
    #[serde(default)]
    preset: Preset,
    #[serde(default)]
    joints: Convention,
}

pub(super) fn forward(request: &Forward, unit: Unit) -> Answer {
    let setting = Setting::new(request.preset, request.joints, unit);
    let q = setting.read(request.q)?;
    let t_base_tool = setting.arm.forward(&q);
    let (quat, rows) = orientation(&t_base_tool.rotation());
    Ok(json!({
        "p": t_base_tool.translation().as_vector().as_slice(),
        "r": rows,
        "quat": quat,
        "within_limits": setting.arm.limits().contain(&q),
    }))
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum PolicyName {
    #[default]
    Reject,
    KeepPosition,
    KeepApproach,
    Weighted,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Tolerance {
    position: f64,
    angle: f64,
}

/// Most by which two orientations of one pose may differ, entry by entry: what six decimals keep.
const SAME: f64 = 2e-6;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Inverse {
    p: [f64; 3],
    r: Option<[[f64; 3]; 3]>,
    quat: Option<Wxyz>,
    /// Part of an answer of `fk`, which may be a request as it is; changes nothing.
    #[serde(rename = "within_limits")]
    _within_limits: Option<bool>,
    #[serde(default)]
    policy: PolicyName,
    tolerance: Option<Tolerance>,
    length: Option<f64>,
    q_current: Option<[f64; 5]>,
    weights: Option<[f64; 5]>,
    #[serde(default)]
    preset: Preset,
    #[serde(default)]
    joints: Convention,
}

pub(super) fn inverse(request: &Inverse, unit: Unit) -> Answer {
    let setting = Setting::new(request.preset, request.joints, unit);
    let rows = request.r.map(|r| Matrix3::from_fn(|i, j| r[i][j]));
    let quat = request.quat.map(|quat| quat.dcm()).transpose()?;
    let rotation = match (rows, quat) {
        (Some(rows), Some(quat)) if (rows - quat.as_matrix()).amax() <= SAME => Dcm::assume(rows),
        (Some(_), Some(_)) => return Err("r and quat are two orientations".to_owned().into()),
        (Some(rows), None) => Dcm::assume(rows),
        (None, Some(quat)) => quat,
        (None, None) => return Err("one of these is needed: r, quat".to_owned().into()),
    };
    let policy = policy(request, unit)?;
    let current = request.q_current.map(|q| setting.read(q)).transpose()?;
    if request.weights.is_some() && current.is_none() {
        return Err("weights need q_current".to_owned().into());
    }
    let target = Transform::new(rotation, In::assume(Vector3::from(request.p)));
    let found = setting
        .arm
        .inverse(&target, policy, current.as_ref())
        .map_err(|e| refusal(&e))?;
    let chosen = match &current {
        Some(current) => {
            let weights = request.weights.unwrap_or([1.0; 5]);
            match found.nearest_weighted(current, &weights) {
                Ok(s) => found.as_slice().iter().position(|x| x == s),
                Err(_) if found.first_within_limits().is_none() => None,
                Err(e) => return Err(refusal(&e)),
            }
        }
        None => found.first_within_limits(),
    };
    let of = chosen.unwrap_or(0);
    let position = found.as_slice().get(of).map(|s| s.position_residual);
    let mut singular = Vec::new();
    if found.as_slice().iter().any(|s| s.elbow == Elbow::Straight) {
        singular.push("elbow");
    }
    if found.theta1_free {
        singular.push("theta1-free");
    }
    if found.approach_free {
        singular.push("approach-free");
    }
    let solutions: Vec<Value> = found.as_slice().iter().map(|s| said(&setting, s)).collect();
    let mut answer = json!({
        "solutions": solutions,
        "residual": {
            "position": position,
            "angle": unit.say(found.angle_residual()),
        },
        "reach_excess": found.reach_excess,
        "singular": singular,
    });
    if let Some(chosen) = chosen {
        answer["chosen"] = chosen.into();
    }
    Ok(answer)
}

fn policy(request: &Inverse, unit: Unit) -> Result<Policy, super::Refusal> {
    let stray = match request.policy {
        PolicyName::Reject => request.length.is_some().then_some("length"),
        PolicyName::Weighted => request.tolerance.is_some().then_some("tolerance"),
        _ if request.length.is_some() => Some("length"),
        _ => request.tolerance.is_some().then_some("tolerance"),
    };
    if let Some(stray) = stray {
        return Err(format!("{stray} belongs to another policy").into());
    }
    Ok(match request.policy {
        PolicyName::Reject => match &request.tolerance {
            None => Policy::default(),
            Some(tolerance) => Policy::Reject {
                position: tolerance.position,
                angle: unit.read(tolerance.angle),
            },
        },
        PolicyName::KeepPosition => Policy::KeepPosition,
        PolicyName::KeepApproach => Policy::KeepApproach,
        PolicyName::Weighted => Policy::Weighted {
            length: request.length.unwrap_or(0.3),
        },
    })
}

fn said(setting: &Setting, s: &Solution) -> Value {
    json!({
        "q": setting.say(&s.q),
        "within_limits": s.within_limits,
        "base": match s.base {
            BaseTurn::Front => "front",
            BaseTurn::Back => "back",
        },
        "elbow": match s.elbow {
            Elbow::Up => "up",
            Elbow::Down => "down",
            Elbow::Straight => "straight",
        },
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Velocity {
    q: [f64; 5],
    qd: Option<[f64; 5]>,
    twist: Option<[f64; 6]>,
    allowed: Option<f64>,
    #[serde(default)]
    preset: Preset,
    #[serde(default)]
    joints: Convention,
}

pub(super) fn jacobian(request: &Velocity, unit: Unit) -> Answer {
    let setting = Setting::new(request.preset, request.joints, unit);
    let q = setting.read(request.q)?;
    let j = setting.arm.jacobian(&q);
    let rows: Vec<[f64; 5]> = j
        .row_iter()
        .map(|r| setting.turned([r[0], r[1], r[2], r[3], r[4]]))
        .collect();
    let [elbow, base] = setting.arm.singularity_measures(&q);
    let mut answer = json!({
        "jacobian": rows,
        "singularity": { "elbow": elbow, "base": base },
    });
    if let Some(qd) = request.qd {
        let motion = setting.read_motion(request.q, qd, [0.0; 5])?;
        let twist = j * SVector::from(motion.qd());
        let said = |i: usize| {
            if i < 3 { twist[i] } else { unit.say(twist[i]) }
        };
        answer["twist"] = (0..6).map(said).collect();
    }
    match (request.twist, request.allowed) {
        (Some(t), allowed) => {
            let [x, y, z, a, b, c] = t;
            let twist = Twist {
                v: In::assume(Vector3::new(x, y, z)),
                w: In::assume(Vector3::new(a, b, c).map(|w| unit.read(w))),
            };
            let rates = setting
                .arm
                .joint_rates(&q, &twist, allowed.unwrap_or(1e-9))
                .map_err(|e| refusal(&e))?;
            answer["qd"] = json!(setting.say_rates(rates));
        }
        (None, Some(_)) => return Err("allowed needs twist".to_owned().into()),
        (None, None) => {}
    }
    Ok(answer)
}
