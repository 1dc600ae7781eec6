//! Paths as JSON -> joints, poses and IMU readings in time; also `simulate youbot --trajectory`. Pure.

use super::{
    Answer, Convention, Preset, Refusal, Setting, Unit, Wxyz, dynamics, orientation, refusal,
};
use nalgebra::Vector3;
use serde::Deserialize;
use serde_json::{Value, json};
use strapd_attitude::frames::{Dcm, In};
use strapd_bodies::dh::Transform;
use strapd_bodies::youbot::{
    ArmError, Gripper, ImuMount, JointPath, Sinusoid, TableJoints, ToolPath, ToolTrack,
};

/// Most samples in one answer.
const MOST: f64 = 1e5;

#[derive(Clone, Copy, Deserialize, Debug)]
#[serde(deny_unknown_fields)]
struct Swing {
    #[serde(default)]
    centre: f64,
    #[serde(default)]
    amplitude: f64,
    #[serde(default)]
    angular_frequency: f64,
    #[serde(default)]
    phase: f64,
}

#[derive(Clone, Copy, Deserialize, Debug)]
#[serde(deny_unknown_fields)]
struct Line {
    from: [f64; 5],
    to: [f64; 5],
    duration: f64,
}

#[derive(Clone, Copy, Deserialize, Debug)]
#[serde(deny_unknown_fields)]
struct Mount {
    #[serde(default)]
    r: [f64; 3],
    quat: Option<Wxyz>,
}

/// A path, and how it is run.
#[derive(Clone, Default, Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub(super) struct Request {
    points: Option<Vec<[f64; 5]>>,
    sinusoids: Option<[Swing; 5]>,
    line: Option<Line>,
    waves: Option<[Swing; 5]>,
    q_start: Option<[f64; 5]>,
    duration: Option<f64>,
    rate_hz: Option<f64>,
    #[serde(default)]
    slow_down: bool,
    gravity: Option<[f64; 3]>,
    mount: Option<Mount>,
    #[serde(default)]
    preset: Preset,
    #[serde(default)]
    joints: Convention,
}

/// A path ready to be run.
pub(crate) struct Prepared {
    /// The IMU on the gripper along it.
    pub(crate) gripper: Gripper,
    /// Factor by which it was slowed.
    pub(crate) factor: f64,
    /// Duration, s.
    pub(crate) duration: f64,
    /// m/s^2, base axes.
    pub(crate) gravity: [f64; 3],
}

/// A path from the text of a file; `duration` (s) where it says none itself.
///
/// # Errors
/// In words: what is no path, or one the arm cannot drive.
pub(crate) fn from_json(text: &str, unit: Unit, duration: f64) -> Result<Prepared, String> {
    let request: Request = serde_json::from_str(text).map_err(|e| e.to_string())?;
    prepare(&request, unit, Some(duration)).map_err(|refusal| refusal.error)
}

/// Refuses what cannot be driven.
fn prepare(request: &Request, unit: Unit, duration: Option<f64>) -> Result<Prepared, Refusal> {
    let setting = Setting::new(request.preset, request.joints, unit);
    let gravity = request.gravity.unwrap_or(dynamics::GRAVITY);
    let g_b = In::assume(Vector3::from(gravity));
    let mount = mount(request)?;
    let wanted = request.duration.or(duration);
    let (path, factor) = path(request, &setting, wanted)?;
    // Time runs longer where the path was slowed; a path with an end has its own length.
    let stretched = wanted.map(|secs| secs * factor);
    let duration = path
        .duration()
        .or(stretched)
        .ok_or_else(|| Refusal::from("this path has no end: duration (s) is needed".to_owned()))?;
    if !(duration > 0.0 && duration <= 1e9) {
        return Err(format!("duration {duration} s: above 0 and at most 1e9 is needed").into());
    }
    let gripper = Gripper::along_joints(setting.arm, path, mount, g_b).map_err(|e| refusal(&e))?;
    Ok(Prepared {
        gripper,
        factor,
        duration,
        gravity,
    })
}

fn mount(request: &Request) -> Result<ImuMount, Refusal> {
    let Some(mount) = request.mount else {
        return Ok(ImuMount::at_tool());
    };
    let c = mount.quat.map_or(Ok(Dcm::identity()), Wxyz::dcm)?;
    ImuMount::new(Transform::new(c, In::assume(Vector3::from(mount.r)))).map_err(|e| refusal(&e))
}

/// The joints' way, slowed where that is asked for.
fn path(
    request: &Request,
    setting: &Setting,
    duration: Option<f64>,
) -> Result<(JointPath, f64), Refusal> {
    let given = [
        request.points.is_some(),
        request.sinusoids.is_some(),
        request.line.is_some(),
        request.waves.is_some(),
    ];
    if given.iter().filter(|given| **given).count() > 1 {
        return Err("at most one of these: points, sinusoids, line, waves"
            .to_owned()
            .into());
    }
    let arm = &setting.arm;
    let joints = if let Some(points) = &request.points {
        let points: Result<Vec<_>, _> = points.iter().map(|q| setting.read(*q)).collect();
        JointPath::through(arm, &points?)
    } else if let Some(swings) = request.sinusoids {
        joint_sinusoids(swings, setting)
    } else if let Some(line) = request.line {
        let [from, to] = [line.from, line.to].map(|[x, y, z, pitch, roll]| {
            [x, y, z, setting.unit.read(pitch), setting.unit.read(roll)]
        });
        let path = ToolPath::line(from, to, line.duration).map_err(|e| refusal(&e))?;
        return tool(request, setting, path, line.duration);
    } else if let Some(swings) = request.waves {
        let unit = setting.unit;
        let mut coordinates = swings.map(|s| sinusoid(s, unit));
        for (coordinate, swing) in coordinates.iter_mut().zip(swings).take(3) {
            (coordinate.centre, coordinate.amplitude) = (swing.centre, swing.amplitude);
        }
        let duration = duration.ok_or_else(|| {
            Refusal::from("this path has no end: duration (s) is needed".to_owned())
        })?;
        let path = ToolPath::waves(coordinates).map_err(|e| refusal(&e))?;
        return tool(request, setting, path, duration);
    } else {
        Ok(JointPath::demonstration())
    }
    .map_err(|e| refusal(&e))?;
    slowed(request, setting, joints)
}

fn sinusoid(swing: Swing, unit: Unit) -> Sinusoid {
    Sinusoid {
        centre: unit.read(swing.centre),
        amplitude: unit.read(swing.amplitude),
        angular_frequency: unit.read(swing.angular_frequency),
        phase: unit.read(swing.phase),
    }
}

fn joint_sinusoids(swings: [Swing; 5], setting: &Setting) -> Result<JointPath, ArmError> {
    let mut joints = swings.map(|s| sinusoid(s, setting.unit));
    if matches!(setting.joints, Convention::Driver) {
        let zero = setting.arm.parameters().driver_zero;
        for (joint, zero) in joints.iter_mut().zip(zero) {
            (joint.centre, joint.amplitude) = (zero - joint.centre, -joint.amplitude);
        }
    }
    JointPath::sinusoids(joints)
}

/// A path of the gripper on the branch nearest to `q_start`.
fn tool(
    request: &Request,
    setting: &Setting,
    path: ToolPath,
    duration: f64,
) -> Result<(JointPath, f64), Refusal> {
    let start = match request.q_start {
        Some(q) => setting.read(q)?,
        None => TableJoints::ZERO,
    };
    let refused = |e: ArmError| refusal(&e);
    let track = ToolTrack::new(setting.arm, path, &start).map_err(refused)?;
    let joints = track.joint_path(duration).map_err(refused)?;
    slowed(request, setting, joints)
}

/// Slows it as much as was asked for; returns by how much.
fn slowed(
    request: &Request,
    setting: &Setting,
    joints: JointPath,
) -> Result<(JointPath, f64), Refusal> {
    if !request.slow_down {
        return Ok((joints, 1.0));
    }
    joints.within_rates(&setting.arm).map_err(|e| refusal(&e))
}

pub(super) fn answer(request: &Request, unit: Unit) -> Answer {
    let setting = Setting::new(request.preset, request.joints, unit);
    let prepared = prepare(request, unit, None)?;
    let rate_hz = request.rate_hz.unwrap_or(10.0);
    let intervals = (prepared.duration * rate_hz * (1.0 + 4.0 * f64::EPSILON)).floor();
    // So that NaN is refused.
    if !(rate_hz > 0.0 && intervals < MOST) {
        return Err(format!(
            "rate_hz {rate_hz} over {} s: at most {MOST} samples are answered",
            prepared.duration
        )
        .into());
    }
    let samples: Vec<Value> = (0..=intervals as u64)
        .map(|i| sample(&setting, &prepared.gripper, i as f64 / rate_hz))
        .collect();
    Ok(json!({
        "slow_down": prepared.factor,
        "duration": prepared.duration,
        "samples": samples,
    }))
}

fn sample(setting: &Setting, gripper: &Gripper, secs: f64) -> Value {
    let nanos = (secs * 1e9).round() as u64;
    let m = gripper.joints(nanos);
    let reading = gripper.read(nanos);
    let pose = setting.arm.forward(m.q());
    let (quat, _) = orientation(&pose.rotation());
    json!({
        "t": secs,
        "q": setting.say(m.q()),
        "qd": setting.say_rates(m.qd()),
        "qdd": setting.say_rates(m.qdd()),
        "p": pose.translation().as_vector().as_slice(),
        "quat": quat,
        "gyro": reading.rate.0.map(|w| setting.unit.say(w)).as_slice(),
        "accel": reading.specific_force.as_vector().as_slice(),
    })
}
