//! Requests for torques -> answers. Pure.

use super::{Answer, Convention, Preset, Refusal, Setting, Unit, refusal};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use serde_json::json;
use strapd_attitude::frames::In;
use strapd_bodies::inertia::RigidBody;
use strapd_bodies::youbot::{ArmError, Dynamics, ImuMount, Wrench, gripper, published_links};

/// Standard gravity on a level floor.
pub(super) const GRAVITY: [f64; 3] = [0.0, 0.0, -9.80665];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Tip {
    #[serde(default)]
    force: [f64; 3],
    #[serde(default)]
    moment: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Payload {
    mass: f64,
    #[serde(default)]
    r_og_b: [f64; 3],
    inertia_cg: Option<[[f64; 3]; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Request {
    q: [f64; 5],
    #[serde(default)]
    qd: [f64; 5],
    #[serde(default)]
    qdd: [f64; 5],
    gravity: Option<[f64; 3]>,
    tip: Option<Tip>,
    payload: Option<Payload>,
    #[serde(default)]
    gripper: bool,
    #[serde(default)]
    preset: Preset,
    #[serde(default)]
    joints: Convention,
}

pub(super) fn answer(request: &Request, unit: Unit) -> Answer {
    let setting = Setting::new(request.preset, request.joints, unit);
    let motion = setting.read_motion(request.q, request.qd, request.qdd)?;
    let g_b = In::assume(Vector3::from(request.gravity.unwrap_or(GRAVITY)));
    let dynamics =
        Dynamics::new(setting.arm, links(request, &setting)?, g_b).map_err(|e| refusal(&e))?;
    let tau = match &request.tip {
        None => dynamics.torques(&motion),
        Some(tip) => {
            let [force, moment] = [tip.force, tip.moment].map(|v| In::assume(Vector3::from(v)));
            let tip = Wrench::new(force, moment).map_err(|e| refusal(&e))?;
            dynamics.torques_with_tip(&motion, &tip)
        }
    };
    // Both angles change sign: what couples them does not.
    let matrix = dynamics.mass_matrix(motion.q());
    let matrix: Vec<[f64; 5]> = matrix
        .row_iter()
        .map(|r| [r[0], r[1], r[2], r[3], r[4]])
        .collect();
    let energy = dynamics.energy(&motion);
    let reading = ImuMount::at_tool().read(&setting.arm, &motion, &g_b);
    Ok(json!({
        "tau": setting.turned(tau.0),
        "gravity_torques": setting.turned(dynamics.gravity_torques(motion.q()).0),
        "mass_matrix": matrix,
        "energy": { "kinetic": energy.kinetic, "potential": energy.potential },
        "gyro": reading.rate.0.map(|w| unit.say(w)).as_slice(),
        "accel": reading.specific_force.as_vector().as_slice(),
    }))
}

/// The published links, with what is welded to the last.
fn links(request: &Request, setting: &Setting) -> Result<[RigidBody; 5], Refusal> {
    let wrong = |e| refusal(&ArmError::Inertia(e));
    let mut links = published_links(&setting.arm).map_err(wrong)?;
    if request.gripper {
        let gripper = gripper(&setting.arm).map_err(wrong)?;
        links[4] = links[4].with_payload(&gripper).map_err(wrong)?;
    }
    if let Some(payload) = &request.payload {
        let r = Vector3::from(payload.r_og_b);
        links[4] = match payload.inertia_cg {
            None => links[4].with_point_mass(payload.mass, r),
            Some(i) => {
                let tensor = Matrix3::from_fn(|row, column| i[row][column]);
                RigidBody::new(payload.mass, r, tensor).and_then(|p| links[4].with_payload(&p))
            }
        }
        .map_err(wrong)?;
    }
    Ok(links)
}
