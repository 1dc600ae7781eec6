//! The name of a body, errors of a sensor and a seed -> samples with their truth.

use super::{Failure, poses};
use nalgebra::Vector3;
use strapd_attitude::noise::sensor_error::{GyroModel, ImuError, StampError, Truth};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{Nanos, RawSample, SampleKind};
use strapd_bodies::field::Field;
use strapd_bodies::motion::{Carrier, Motion, Worn};
use strapd_bodies::synthetic::{ForceSampling, Magnetometer, Sampling, Stretch, Synthetic};

const HZ: f64 = 100.0;
const SECS: f64 = 120.0;
const GRAVITY: f64 = 9.80665;

pub(crate) const BODIES: [&str; 22] = [
    "hand",
    "waist",
    "worn_hand",
    "foot",
    "running",
    "circling",
    "arm",
    "drone",
    "vibration",
    "boat",
    "town",
    "straight",
    "curves",
    "parking",
    "turntable",
    "slope",
    "robot",
    "pendulum",
    "pocket",
    "soft",
    "stick",
    "camera",
];

/// Samples, and the attitude at each where it is scored.
pub(crate) struct Log {
    pub(crate) samples: Vec<RawSample>,
    pub(crate) truth: Vec<Option<[f64; 4]>>,
    /// The acceleration without gravity that each sample's force shows, m/s^2, axes of the body at its stamp; none of a
    /// recording.
    pub(crate) acceleration: Vec<Vector3<f64>>,
    /// Only part of it is scored, from here on.
    pub(crate) begins_at: Option<usize>,
}

pub(crate) fn simulated(body: &str, noise: &str, seed: u64) -> Result<Log, Failure> {
    let error = ImuError::parse(noise).map_err(|e| e.to_string())?;
    let carrier = match body {
        "hand" | "stick" => Carrier::Hand,
        "waist" => Carrier::Walking(Worn::Waist),
        "worn_hand" => Carrier::Walking(Worn::Hand),
        "foot" => Carrier::Walking(Worn::Foot),
        "running" => Carrier::Running(Worn::Waist),
        "circling" => Carrier::Circling,
        "arm" => Carrier::Arm,
        "drone" => Carrier::Drone,
        "vibration" => Carrier::Vibration,
        "boat" => Carrier::Boat,
        "town" => Carrier::Car,
        _ => return posed(body, &error, seed),
    };
    let lever = if body == "stick" { 0.4 } else { 0.0 };
    let sampling = Sampling {
        rate_hz: HZ,
        duration_secs: SECS,
        kind: SampleKind::Average,
        start: Nanos(0),
        gravity: GRAVITY,
        lever_b: Vector3::x() * lever,
        force: ForceSampling::AsGyro,
        magnetometer: Some(Magnetometer {
            rate_hz: HZ,
            field: Field::new(50e-6, 1.1, 0.0, Vec::new()),
        }),
        error,
        stamps: StampError::default(),
        seed,
    };
    let motion = Motion::Carried(Box::new(carrier.motion(seed, GRAVITY)));
    let exact = Sampling {
        error: ImuError::default(),
        ..sampling.clone()
    };
    let sampled = |sampling| -> Result<Vec<RawSample>, Failure> {
        let mut synthetic = Synthetic::new(motion.clone(), sampling).map_err(|e| e.to_string())?;
        let mut stretch = Stretch::default();
        synthetic
            .next_stretch(usize::MAX, &mut stretch)
            .map_err(|e| format!("{e:?}"))?;
        Ok(stretch.samples)
    };
    let samples = sampled(sampling)?;
    let exact = sampled(exact)?;
    let acceleration = exact.iter().map(|sample| {
        let [rate, force] = [sample.gyro, sample.accel].map(|v| v.unwrap_or_default().into());
        of_mean(&sample.orientation.unwrap_or_default(), rate, force)
    });
    Ok(Log {
        truth: samples.iter().map(|sample| sample.orientation).collect(),
        acceleration: acceleration.collect(),
        samples,
        begins_at: None,
    })
}

/// The acceleration without gravity by the mean force of an interval, in axes of its end.
fn of_mean(end: &[f64; 4], rate: Vector3<f64>, force: Vector3<f64>) -> Vector3<f64> {
    let end = Quaternion::<(), ()>::assume_unit(*end).to_dcm();
    let up = end.as_matrix().row(2).transpose() * GRAVITY;
    force - rate.cross(&force) * (0.5 / HZ) - up
}

/// Parts of an interval over which rate and force are added up.
const FINE: usize = 8;

fn posed(body: &str, error: &ImuError, seed: u64) -> Result<Log, Failure> {
    let mut pose = poses::pose(body, seed).ok_or_else(|| format!("{body}: one of {BODIES:?}"))?;
    let mut gyro =
        GyroModel::new(error, SampleKind::Average, seed).map_err(|e| format!("{e:?}"))?;
    let (step, fine) = (1.0 / HZ, 1.0 / HZ / FINE as f64);
    let force_of = |q: &Quaternion<(), ()>, acceleration: Vector3<f64>| {
        q.to_dcm().as_matrix().transpose() * (acceleration + Vector3::z() * GRAVITY)
    };
    let (mut last, mut acceleration) = pose(0.0);
    let mut log = Log {
        samples: Vec::new(),
        truth: Vec::new(),
        acceleration: Vec::new(),
        begins_at: None,
    };
    for k in 1..=(SECS * HZ) as usize {
        let (mut turned, mut force) = (Vector3::zeros(), Vector3::zeros());
        let mut turn = Vector3::zeros();
        for part in 1..=FINE {
            let before = force_of(&last, acceleration);
            let (q, next) = pose(((k - 1) * FINE + part) as f64 * fine);
            turn = (last.inverse() * q).rotation_vector().0;
            turned += turn;
            (last, acceleration) = (q, next);
            force += (before + force_of(&q, next)) * (0.5 / FINE as f64);
        }
        let at = |k: usize| Nanos((k as f64 * step * 1e9).round() as i64);
        let truth = Truth {
            rate: turn / fine,
            delta_angle: turned,
            specific_force: force_of(&last, acceleration),
            sampled_force: force,
            temperature: 0.0,
        };
        let read = gyro
            .measure(at(k - 1), at(k), &truth)
            .map_err(|e| format!("{e:?}"))?;
        log.samples.push(RawSample {
            header: Some(at(k)),
            log: at(k),
            publish: at(k),
            gyro: Some(read.gyro.into()),
            accel: Some(read.specific_force.into()),
            ..RawSample::default()
        });
        log.truth.push(Some(last.wxyz()));
        log.acceleration
            .push(of_mean(&last.wxyz(), turned / step, force));
    }
    Ok(log)
}

/// A recording as CSV: t_ns, gyro, force, field, reference (w, x, y, z), scored.
pub(crate) fn read(path: &str) -> Result<Log, Failure> {
    let text = std::fs::read_to_string(path)?;
    let mut log = Log {
        samples: Vec::new(),
        truth: Vec::new(),
        acceleration: Vec::new(),
        begins_at: Some(0),
    };
    for line in text.lines().skip(1) {
        let columns: Vec<&str> = line.split(',').collect();
        let stamp = Nanos(columns.first().ok_or("a line is empty")?.parse()?);
        let values = columns[1..].iter().map(|c| c.parse());
        let values: Vec<f64> = values.collect::<Result<_, _>>()?;
        let [g0, g1, g2, a0, a1, a2, m0, m1, m2, w, x, y, z, scored] = values[..] else {
            return Err("15 columns are wanted".into());
        };
        let mag = [m0, m1, m2];
        log.samples.push(RawSample {
            header: Some(stamp),
            log: stamp,
            publish: stamp,
            gyro: Some([g0, g1, g2]),
            accel: Some([a0, a1, a2]),
            mag: mag.iter().all(|m| m.is_finite()).then_some(mag),
            ..RawSample::default()
        });
        log.truth.push((scored > 0.5).then_some([w, x, y, z]));
    }
    Ok(log)
}
