//! Settings by which the samples of a run are understood and integrated. Pure.
//!
//! Apart from the stages because each of them takes its part of it, and because what cannot be is refused
//! here, before the data are looked at.

mod check;
mod noise;

pub(super) use self::noise::NO_NOISE;
pub use self::noise::{CLASS_BY_DATA, Noise};
use super::sensor_calibration::SensorCalibration;
use crate::condition::{Clock, GyroUnit, OnGap, SpikePolicy, StampRepair};
use crate::frames::{AxisMap, Body, BodyAxes, Nav, Sensor};
use crate::propagate::Method;
use crate::quaternion::{BodyRate, Quaternion};
use crate::record::SampleKind;
use crate::setting::Choice;
use crate::worlds::World;
use std::sync::Arc;

/// Bias left in a gyro whose bias was given, rad/s: what it may have become since.
const BIAS_LEFT: f64 = 1e-3;
/// Bias left in a gyro whose bias was found at rest, rad/s (0.15 deg/s): in motion it is another.
const BIAS_LEFT_BY_REST: f64 = 2.6e-3;

/// Settings by which the samples of a run are understood and integrated, as a person gives them by the rows of
/// [`ROWS`](super::settings::ROWS), or a program by its fields. [`EstimationSettings::check`] refuses what cannot be.
#[derive(Clone, Debug)]
pub struct EstimationSettings {
    /// Method by which rates become rotations, with its window and order. A centred one is the most accurate, a causal
    /// one and `commit` need no later sample. Default: [`Method::Auto`]. Settings `method`, `window`, `order`.
    pub method: Method,
    /// Meaning of a sample in time. Taken wrongly, the attitude is half an interval early or late. Default: `None`, as the
    /// recording states it, else as [`KindReason`](super::KindReason) lists.
    pub kind: Option<SampleKind>,
    /// Unit of the recorded rates. Default: `None`, as the format states it, else rad/s.
    pub unit: Option<GyroUnit>,
    /// Axes of the gyro's recorded vectors alone, relabelled before `body`; a map may mirror. Default: the identity.
    pub gyro_axes: AxisMap,
    /// Factors of the gyro's recorded columns, before `gyro_axes`. Default: 1.
    pub gyro_scale: [f64; 3],
    /// Axes of the accelerometer alone, as `gyro_axes`. Default: the identity.
    pub accel_axes: AxisMap,
    /// Factors of the accelerometer's recorded columns, before `accel_axes`. Default: 1.
    pub accel_scale: [f64; 3],
    /// Axes of the magnetometer alone, before `mag_mount` or `body`. Default: the identity.
    pub mag_axes: AxisMap,
    /// Axes of the recorded vectors, which are relabelled to forward, left, up. Default: `None`, as the format states
    /// them, else [`BodyAxes::Flu`].
    pub body: Option<BodyAxes>,
    /// World against which attitudes are given. Default: [`World::Start`], which an aid replaces by the one it knows.
    pub world: World,
    /// Rotation q_bs from sensor to body axes, applied after `body`. Default: `None`, no rotation.
    pub mount: Option<Quaternion<Body, Sensor>>,
    /// Clock whose stamps count: every interval is a step between two of them. Default: [`Clock::Header`]. Settings
    /// `time`, `rate_hz` (Hz).
    pub clock: Clock,
    /// Attitude at the first sample, in the convention of `world`. Where gravity aids, it sets the heading alone.
    /// Default: [`Initial::Identity`].
    pub initial: Initial,
    /// Bias of the gyro, rad/s about the body axes, subtracted from every rate; what is left of it drifts, or is
    /// estimated by an aid. Default: [`Bias::Unsaid`].
    pub bias: Bias,
    /// Longest gap that is interpolated across, s. Default: 0.5.
    pub max_gap_secs: f64,
    /// Treatment of a longer gap. Default: [`OnGap::Hold`], which adds no rotation.
    pub on_gap: OnGap,
    /// Latitude of a fixed site whose rotation with the Earth is taken out, degrees, north positive (as given, so that
    /// it is repeated as given). Default: `None`, the Earth's rotation stays in the rates as a bias of 15 deg/h.
    /// Setting `earth_rate`.
    pub latitude_deg: Option<f64>,
    /// Treatment of stamps whose counter wraps, whose clock was set or stands still, or that batches were given when they
    /// came. Default: [`StampRepair::Auto`].
    pub stamps: StampRepair,
    /// Whether stamps that jitter are replaced by evenly spaced ones; only for a sensor that samples evenly. Default:
    /// `false`.
    pub regularise_stamps: bool,
    /// Full scale of the gyro, rad/s: components at or beyond it are marked saturated. Default: `None`, unknown.
    pub gyro_range: Option<f64>,
    /// Treatment of spikes of the gyro: one to three samples that nothing around them agrees with.
    /// Default: [`SpikePolicy::Repair`].
    pub spikes: SpikePolicy,
    /// Whether cures that are certain are applied to a recording. Default: `false`, findings name them.
    pub mend: bool,
    /// Cures that were applied. Default: none.
    pub mended: Vec<Mended>,
    /// Noise of the sensor: sigma of the attitude grows by it, and the filter expects it. Default: the class `consumer`.
    pub noise: Noise,
    /// Measurements that correct the attitude of the gyro: gravity holds the tilt, a magnetic field the heading. Default:
    /// [`Aid::None`]; of a run by the table [`Aid::Auto`].
    pub aid: Aid,
    /// Whether the recording is estimated as a whole, with all attitudes at its end and the sensor calibrated from it.
    /// Default: `false`, a filter.
    pub smooth: bool,
    /// Whether attitudes carry the acceleration without gravity. It needs an accelerometer and a world that knows the
    /// vertical. Default: `false`.
    pub linear_acceleration: bool,
    /// Whether the accelerometer reads down at rest (kinematic acceleration), not up (specific force). The wrong one
    /// turns the attitude upside down. Default: `false`. Setting `accel_sign`.
    pub is_accel_kinematic: bool,
    /// Whether specific forces come by [`Estimator::take_beside`](super::Estimator::take_beside), not with the rates.
    /// Default: `false`.
    pub has_forces_beside: bool,
    /// Rotation q_bs from the magnetometer's to body axes. Default: `None`, as the gyro's.
    pub mag_mount: Option<Quaternion<Body, Sensor>>,
    /// Prior sigma of hard iron that is estimated, as a share of the field, 0 to 1. It costs accuracy where there is no
    /// hard iron. Default: 0, none is estimated.
    pub mag_hard_iron: f64,
    /// Declination, rad: how far magnetic north lies east of true north, which is added to the heading by the field.
    /// Default: 0, headings are magnetic. The setting is in degrees.
    pub declination: f64,
    /// Treatment of rates that their driver cut towards zero: half a step is put back, without which a bias seen at rest
    /// is wrong in motion. Default: [`Truncation::Unsaid`]. Setting `undo_truncation`.
    pub truncation: Truncation,
    /// Delay of the sensor's own filters, s: each attitude is rotated on by its rate for so long. Default: 0.
    pub sensor_delay_secs: f64,
    /// Calibration of the sensor: its values are taken out first, and the filter begins with its sigmas. Default: `None`.
    pub calibration: Option<Arc<SensorCalibration>>,
    /// Time after the first stamp before which samples are left out, s. Default: `None`.
    pub start: Option<f64>,
    /// Time after the first stamp behind which samples are left out, s. Default: `None`.
    pub until: Option<f64>,
}

/// Cure that was applied to a recording.
#[derive(Clone, PartialEq, Debug)]
pub struct Mended {
    /// Finding that is cured.
    pub what: String,
    /// Settings that cure it.
    pub settings: Vec<Choice>,
}

/// Longest delay of a sensor's own filters, s.
pub(super) const LONGEST_DELAY: f64 = 0.1;

/// Measurements that correct the attitude of the gyro.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum Aid {
    /// Nothing.
    #[default]
    None,
    /// The direction of gravity, from the accelerometer.
    Gravity,
    /// The same, and the heading of the magnetic field.
    GravityAndField,
    /// Gravity where the stream carries a plausible specific force, else nothing.
    Auto,
}

/// Treatment of rates that their driver cut towards zero.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Truncation {
    /// Decided by the data of a file where the attitude is aided; otherwise they stay.
    #[default]
    Unsaid,
    /// Decided by the data of a file.
    Auto,
    /// Truncated; the data show in which steps.
    On,
    /// Truncated in these steps, rad/s.
    Steps(f64),
    /// Not truncated.
    Off,
}

impl Default for EstimationSettings {
    /// Defaults of [`settings`](super::settings::defaults), but for [`Aid::None`].
    fn default() -> EstimationSettings {
        EstimationSettings {
            method: Method::Auto,
            kind: None,
            unit: None,
            gyro_axes: AxisMap::IDENTITY,
            gyro_scale: [1.0; 3],
            accel_axes: AxisMap::IDENTITY,
            accel_scale: [1.0; 3],
            mag_axes: AxisMap::IDENTITY,
            body: None,
            world: World::Start,
            mount: None,
            clock: Clock::Header,
            initial: Initial::Identity,
            bias: Bias::Unsaid,
            max_gap_secs: 0.5,
            on_gap: OnGap::Hold,
            latitude_deg: None,
            stamps: StampRepair::Auto,
            regularise_stamps: false,
            gyro_range: None,
            spikes: SpikePolicy::Repair,
            mend: false,
            mended: Vec::new(),
            noise: Noise::by_data(),
            aid: Aid::None,
            smooth: false,
            linear_acceleration: false,
            is_accel_kinematic: false,
            has_forces_beside: false,
            mag_mount: None,
            mag_hard_iron: 0.0,
            declination: 0.0,
            truncation: Truncation::Unsaid,
            sensor_delay_secs: 0.0,
            calibration: None,
            start: None,
            until: None,
        }
    }
}

impl EstimationSettings {
    /// Returns whether somebody states the unit of the recorded rates, or the factor that makes rad/s of them.
    #[must_use]
    pub fn states_gyro_unit(&self) -> bool {
        self.unit.is_some() || self.gyro_scale != [1.0; 3]
    }

    /// Whether a step of so many nanoseconds is integrated across.
    #[must_use]
    pub fn bridges(&self, nanos: i64) -> bool {
        self.on_gap == OnGap::Bridge || nanos as f64 <= self.max_gap_secs * 1e9
    }
}

/// Attitude at the first sample.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Initial {
    /// World = body at the first sample.
    Identity,
    /// Roll and pitch from the accelerometer at rest; yaw 0.
    Gravity,
    /// The first recorded orientation.
    FirstOrientation,
    /// Attitude as given, in the convention of [`EstimationSettings::world`].
    Given(Quaternion<Nav, Body>),
}

/// Bias of the gyro that is subtracted.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Bias {
    /// Estimate from the rests of a file whose attitude is aided, where it has any that can be no turn; otherwise
    /// nothing is subtracted.
    Unsaid,
    /// Nothing is subtracted.
    None,
    /// Estimate from detected rest; refused when there is none.
    Auto,
    /// Bias as given.
    Given(BodyRate),
}

impl Bias {
    /// One standard deviation of what is left of a bias that this removes, rad/s; `None` where it removes none.
    pub(super) fn left(self) -> Option<f64> {
        match self {
            Bias::Unsaid | Bias::None => None,
            Bias::Auto => Some(BIAS_LEFT_BY_REST),
            Bias::Given(_) => Some(BIAS_LEFT),
        }
    }
}
