//! Settings and declarations of the format -> the meaning of a sample. Pure.
//!
//! Apart from the preparation because it needs no sample: what is asked for wins over what is declared.

use super::plan::EstimationSettings;
use super::sample_kind::{AHEAD, KindChoice, KindReason, OrdinaryStep};
use super::sensor_calibration::SensorCalibration;
use crate::condition::{Clock, GyroUnit, Settings, StampRepair};
use crate::frames::{AxisMap, Body, BodyAxes, Dcm, In, Nav, Sensor};
use crate::quaternion::{BodyRate, DeltaAngle, Quaternion};
use crate::record::{AccelUnit, Declared, RawSample, SampleKind, TimeUnit};
use crate::worlds::{Convention, World};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// Standard gravity, m/s^2.
pub(super) const STANDARD_GRAVITY: f64 = 9.806_65;

/// The flags and what the format states, put together: a flag wins.
#[derive(Clone, Debug)]
pub struct Meaning {
    /// Kind of a sample.
    pub kind: SampleKind,
    /// Reason for that kind.
    pub kind_reason: KindReason,
    /// Unit of the rates.
    pub unit: GyroUnit,
    /// Axes of the input.
    pub body: BodyAxes,
    /// Multiplies the recorded acceleration.
    pub accel_scale: f64,
    /// Unit, if the format states it.
    pub accel_unit_stated: Option<AccelUnit>,
    /// The convention of recorded orientations.
    pub recorded: Convention,
    /// Path of the samples' own interval, and its unit.
    pub interval: Option<(String, TimeUnit)>,
    /// Whether the user stated that unit.
    pub interval_unit_given: bool,
    /// Calibration of the sensor that is known beforehand.
    pub calibration: Option<Arc<SensorCalibration>>,
    /// Recorded columns of each sensor to those of the board.
    maps: SensorMaps,
    gyro_scale: [f64; 3],
    /// Columns of the input to the sensor's axes.
    axes: AxisMap,
    mount: Dcm<Body, Sensor>,
    /// Columns of the magnetometer to body axes. Not a rotation by its type: a relabelling may mirror.
    mag_axes: Matrix3<f64>,
}

/// Maps of single sensors, factors included. No rotations by their type: they may mirror.
#[derive(Clone, Copy, PartialEq, Debug)]
struct SensorMaps {
    gyro: Matrix3<f64>,
    accel: Matrix3<f64>,
    mag: Matrix3<f64>,
}

impl SensorMaps {
    fn of(plan: &EstimationSettings) -> SensorMaps {
        let map = |axes: AxisMap, scale: [f64; 3]| {
            axes.matrix() * Matrix3::from_diagonal(&Vector3::from(scale))
        };
        SensorMaps {
            gyro: map(plan.gyro_axes, plan.gyro_scale),
            accel: map(plan.accel_axes, plan.accel_scale),
            mag: map(plan.mag_axes, [1.0; 3]),
        }
    }
}

impl Meaning {
    /// Puts `plan` and what the channel's format states together.
    #[must_use]
    pub fn new(plan: &EstimationSettings, declared: &Declared) -> Meaning {
        let body = plan.body.or(declared.body).unwrap_or(BodyAxes::Flu);
        let unit = plan.unit.or(declared.gyro_unit).unwrap_or_default();
        let mount = plan.mount.unwrap_or_else(Quaternion::identity).to_dcm();
        let axes = body.map();
        let choice = stated_kind(plan, declared);
        Meaning {
            mag_axes: plan
                .mag_mount
                .map_or(mount.as_matrix() * axes.matrix(), |q| {
                    *q.to_dcm().as_matrix()
                }),
            kind: choice.kind,
            kind_reason: choice.reason,
            unit,
            accel_scale: scale_of(declared.accel_unit)
                * if plan.is_accel_kinematic { -1.0 } else { 1.0 },
            accel_unit_stated: declared.accel_unit,
            recorded: orientation_convention(declared),
            interval: declared.interval.clone(),
            interval_unit_given: declared.interval_unit_given,
            calibration: plan.calibration.clone(),
            maps: SensorMaps::of(plan),
            gyro_scale: plan.gyro_scale,
            axes,
            mount,
            body,
        }
    }

    /// Kind of the samples, and why.
    #[must_use]
    pub fn kind_choice(&self) -> KindChoice {
        KindChoice {
            kind: self.kind,
            reason: self.kind_reason,
        }
    }

    /// The same with samples of this kind.
    #[must_use]
    pub fn with_kind(&self, choice: &KindChoice) -> Meaning {
        Meaning {
            kind: choice.kind,
            kind_reason: choice.reason,
            ..self.clone()
        }
    }

    /// Whether nothing has told the kind yet.
    pub(super) fn is_kind_open(&self) -> bool {
        self.kind_reason == KindReason::Unknown
    }

    /// The same with the kind by the ordinary step of the first samples, on their clock, where nothing states it.
    #[must_use]
    pub fn settled(&self, first: &[RawSample], clock: Clock) -> Meaning {
        self.settled_by(first, clock, AHEAD)
    }

    /// The same by so many steps at most.
    pub(super) fn settled_by(&self, first: &[RawSample], clock: Clock, most: usize) -> Meaning {
        if !self.is_kind_open() {
            return self.clone();
        }
        let mut step = OrdinaryStep::of(clock, most);
        first.iter().take(AHEAD).for_each(|raw| step.take(raw));
        self.with_kind(&step.choice())
    }

    /// A recorded rate in rad/s, body axes.
    pub(super) fn body_rate(&self, recorded: [f64; 3]) -> Vector3<f64> {
        self.to_body() * self.maps.gyro * Vector3::from(recorded) * self.unit.to_rad()
    }

    /// Columns of the input to body axes; a relabelling may mirror.
    pub(super) fn to_body(&self) -> Matrix3<f64> {
        self.mount.as_matrix() * self.axes.matrix()
    }

    /// Magnetometer to body axes.
    pub(super) fn field_to_body(&self) -> Matrix3<f64> {
        self.mag_axes
    }

    /// The settings of the conditioning stage: `bias` is what is taken out of calibrated rates.
    #[must_use]
    pub fn conditioning(
        &self,
        plan: &EstimationSettings,
        clock: Clock,
        bias: BodyRate,
    ) -> Settings {
        let known = self.calibration.as_deref();
        let matrix =
            |of: fn(&SensorCalibration) -> Matrix3<f64>| known.map_or_else(Matrix3::identity, of);
        let accel_matrix = matrix(SensorCalibration::force_matrix);
        Settings {
            kind: self.kind,
            unit: self.unit,
            accel_scale: self.accel_scale,
            gyro_matrix: matrix(SensorCalibration::gyro_matrix) * plan.gyro_axes.matrix(),
            gyro_scale: self.gyro_scale,
            accel_matrix: accel_matrix * self.maps.accel,
            accel_bias: known.map_or_else(Vector3::zeros, |k| accel_matrix * k.force_bias_vector()),
            axes: self.axes,
            mount: self.mount,
            clock,
            max_gap_secs: plan.max_gap_secs,
            on_gap: plan.on_gap,
            bias,
            gyro_range: plan.gyro_range,
            spikes: plan.spikes,
            start: plan.start,
            until: plan.until,
            repair: match plan.regularise_stamps {
                // Lines through the stamps find where a clock was set.
                true => StampRepair::AsRecorded,
                false => plan.stamps,
            },
            ..Settings::default()
        }
    }

    /// Recorded rates in rad/s, axes as recorded.
    #[must_use]
    pub fn rates(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let ([a, b, c], unit) = (self.gyro_scale, self.unit.to_rad());
        [x * unit * a, y * unit * b, z * unit * c]
    }

    /// The sample as if each sensor had been recorded with the axes and factors that its settings say.
    #[must_use]
    pub fn remapped(&self, raw: &RawSample) -> RawSample {
        let by = |map: &Matrix3<f64>, vector: Option<[f64; 3]>| match *map == Matrix3::identity() {
            true => vector,
            false => vector.map(|v| (map * Vector3::from(v)).into()),
        };
        RawSample {
            gyro: by(&self.maps.gyro, raw.gyro),
            accel: by(&self.maps.accel, raw.accel),
            mag: by(&self.maps.mag, raw.mag),
            ..*raw
        }
    }

    /// Angle that a recorded sample turned in `secs`.
    pub(super) fn turned(&self, recorded: [f64; 3], secs: f64) -> DeltaAngle {
        let vector = self.body_rate(recorded);
        match self.kind {
            SampleKind::Rate | SampleKind::Average => BodyRate(vector).held_for(secs),
            SampleKind::DeltaAngle | SampleKind::Rotation => DeltaAngle(vector),
        }
    }

    /// A recorded specific force in m/s^2, as far as the format states its unit.
    #[must_use]
    pub fn force(&self, recorded: [f64; 3]) -> In<Body> {
        In::assume(self.to_body() * self.maps.accel * Vector3::from(recorded) * self.accel_scale)
    }

    /// The same, calibrated, where `scale` makes it m/s^2.
    pub(super) fn calibrated_force(&self, recorded: [f64; 3], scale: f64) -> In<Body> {
        In::assume(match &self.calibration {
            None => self.force(recorded).as_vector() * scale,
            Some(known) => {
                let force = self.maps.accel * Vector3::from(recorded) * (self.accel_scale * scale);
                self.to_body() * (known.force_matrix() * (force - known.force_bias_vector()))
            }
        })
    }

    /// A recorded magnetic field, calibrated, and for how long after its stamp it is that, s.
    pub(super) fn field(&self, recorded: [f64; 3]) -> (In<Body>, f64) {
        let field = self.maps.mag * Vector3::from(recorded);
        let (field, lead) = match &self.calibration {
            None => (self.mag_axes * field, 0.0),
            Some(known) => (
                self.mag_axes * (known.field_matrix() * (field - known.hard_iron_vector())),
                known.field_lead.map_or(0.0, |lead| lead.value[0]),
            ),
        };
        (In::assume(field), lead)
    }

    /// World and body of the output as labels. NED comes with FRD, everything else with FLU.
    #[must_use]
    pub fn labels(&self, world: World) -> (String, String) {
        let body = if world == World::Ned { "frd" } else { "flu" };
        (world.to_string(), body.to_owned())
    }

    /// The sample in rad/s, m/s^2 and FLU, its orientation from FLU to ENU: what a `RATE` line
    /// promises. The same products as in conditioning, so that no bit is lost on the way through one.
    #[must_use]
    pub fn in_flu(&self, raw: &RawSample) -> RawSample {
        let (axes, raw) = (self.axes.matrix(), &self.remapped(raw));
        let by = |m: Matrix3<f64>, v: [f64; 3]| {
            if m == Matrix3::identity() {
                v
            } else {
                (m * Vector3::from(v)).into()
            }
        };
        RawSample {
            gyro: raw.gyro.map(|v| by(axes * self.unit.to_rad(), v)),
            accel: raw.accel.map(|v| by(axes * self.accel_scale, v)),
            mag: raw.mag.map(|v| by(axes, v)),
            orientation: raw.orientation.map(|wxyz| {
                match (self.recorded, Quaternion::<Nav, Body>::try_from_wxyz(wxyz)) {
                    (Convention::EnuFlu, _) | (_, Err(_)) => wxyz,
                    (other, Ok(q)) => other.convert(Convention::EnuFlu, q).wxyz(),
                }
            }),
            ..*raw
        }
    }

    /// Whether the output's body axes are other than the sensor's own.
    #[must_use]
    pub fn is_remapped(&self, plan: &EstimationSettings, world: World) -> bool {
        let own = match self.body {
            BodyAxes::Flu => "flu",
            BodyAxes::Frd => "frd",
            BodyAxes::Map(_) => "",
        };
        plan.mount.is_some() || self.labels(world).1 != own
    }

    /// A recorded orientation (sensor to its world) as the attitude of our body: convention and
    /// mounting undone. `None` when it is no rotation.
    #[must_use]
    pub fn recorded_attitude(&self, wxyz: [f64; 4]) -> Option<Quaternion<Nav, Body>> {
        let q: Quaternion<Nav, Body> = Quaternion::try_from_wxyz(wxyz).ok()?;
        let flu = self.recorded.convert(Convention::EnuFlu, q);
        // What is labelled body here is the sensor: as long as it is not mounted otherwise, they are the same.
        let q_ns: Quaternion<Nav, Sensor> = Quaternion::assume_unit(flu.wxyz());
        let q_bs = Quaternion::from_dcm(&self.mount);
        Some((q_ns * q_bs.inverse()).normalised())
    }
}

/// The kind that is stated: by the user, in the recording, by its format; open where none does.
fn stated_kind(plan: &EstimationSettings, declared: &Declared) -> KindChoice {
    let stated = [
        (plan.kind, KindReason::Setting),
        (declared.sample_kind, KindReason::Recording),
        (declared.usual_kind, KindReason::Format),
    ];
    let mut told = stated
        .into_iter()
        .filter_map(|(kind, reason)| kind.map(|kind| KindChoice { kind, reason }));
    told.next().unwrap_or(KindChoice::OPEN)
}

/// The convention of the orientations a format carries.
#[must_use]
pub fn orientation_convention(declared: &Declared) -> Convention {
    declared.world.unwrap_or(Convention::EnuFlu)
}

/// Multiplies a recorded force into m/s^2, as far as its format states the unit.
fn scale_of(unit: Option<AccelUnit>) -> f64 {
    match unit {
        Some(AccelUnit::StandardGravity) => STANDARD_GRAVITY,
        Some(AccelUnit::MetresPerSecondSquared) | None => 1.0,
    }
}

#[cfg(test)]
mod tests;
