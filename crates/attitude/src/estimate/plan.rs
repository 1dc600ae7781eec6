//! Settings by which the samples of a run are understood and integrated. Pure.
//!
//! Apart from the stages because each of them takes its part of it, and because what cannot be is refused
//! here, before the data are looked at.

use super::noise_presets::{NOISE_PRESETS, NoisePreset};
use super::sensor_calibration::SensorCalibration;
use crate::condition::{self, Clock, GyroUnit, OnGap, SpikePolicy, StampRepair};
use crate::diagnostic::Diagnostic;
use crate::frames::{AxisMap, Body, BodyAxes, Nav, Sensor};
use crate::propagate::{self, Method, Propagator};
use crate::quaternion::{BodyRate, Quaternion};
use crate::record::SampleKind;
use crate::setting::{
    ACCEL_SCALE, AID, BIAS, CALIBRATION, Choice, DECLINATION, EARTH_RATE, INIT,
    LINEAR_ACCELERATION, MAG_AXES, MAG_HARD_IRON, MAG_MOUNT, METHOD, NOISE, RATE_HZ,
    REGULARISE_STAMPS, SENSOR_DELAY, SMOOTH, TIME, UNDO_TRUNCATION, WORLD,
};
use crate::smooth::BIAS_SIGMA;
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

    /// Checks what can be judged without the data.
    ///
    /// # Errors
    /// In words, naming the setting.
    pub fn check(&self) -> Result<(), Diagnostic> {
        if let Clock::Index { rate_hz } = self.clock
            && rate_hz.is_nan()
        {
            return Err(
                Diagnostic::new(format!("{TIME} index: the sample rate is needed too"))
                    .help(format!("{RATE_HZ} HZ")),
            );
        }
        self.check_noise()?;
        if let Truncation::Steps(step) = self.truncation
            && !(step > 0.0 && step < 1.0)
        {
            return Err(Diagnostic::new(format!(
                "{UNDO_TRUNCATION} on={step}: a step in rad/s above 0 and below 1 is needed"
            )));
        }
        let conditioning = condition::Settings {
            clock: self.clock,
            max_gap_secs: self.max_gap_secs,
            on_gap: self.on_gap,
            bias: match self.bias {
                Bias::Given(bias) => bias,
                Bias::Unsaid | Bias::None | Bias::Auto => BodyRate::ZERO,
            },
            gyro_range: self.gyro_range,
            gyro_scale: self.gyro_scale,
            start: self.start,
            until: self.until,
            ..condition::Settings::default()
        };
        conditioning.validate().map_err(|e| e.to_string())?;
        if !self.accel_scale.iter().all(|f| f.is_finite() && *f > 0.0) {
            return Err(format!("{ACCEL_SCALE}: {:?} are no factors", self.accel_scale).into());
        }
        if self.sensor_delay_secs.is_nan() || self.sensor_delay_secs.abs() > LONGEST_DELAY {
            return Err(Diagnostic::new(format!(
                "{SENSOR_DELAY}: {} s is no delay of a sensor",
                self.sensor_delay_secs
            ))
            .help(format!(
                "seconds, at most {LONGEST_DELAY}: 0.0023 for 2.3 ms"
            )));
        }
        self.check_earth_rate()?;
        self.check_field()?;
        self.check_calibration()?;
        self.check_smoothing()?;
        self.check_vertical()?;
        if self.regularise_stamps && matches!(self.clock, Clock::Index { .. }) {
            return Err(Diagnostic::new(format!(
                "{REGULARISE_STAMPS}: the stamps of {TIME} index are even already"
            ))
            .help("leave one of the two out"));
        }
        Propagator::new(propagate::Settings {
            method: self.method,
            // Where the format decides, the kind with the wider choice: the rest is said by topic.
            kind: self.kind.unwrap_or(SampleKind::Average),
            initial: Quaternion::identity(),
            noise: self.noise.with_bias(self.noise.unremoved_bias()),
            ..propagate::Settings::default()
        })
        .map_err(|e| Diagnostic::from(&e))?;
        Ok(())
    }

    /// Gravity is taken out along the vertical.
    fn check_vertical(&self) -> Result<(), Diagnostic> {
        let is_level = self.world != World::Start || self.initial == Initial::Gravity;
        if self.linear_acceleration && self.aid == Aid::None && !is_level {
            return Err(Diagnostic::new(format!(
                "{LINEAR_ACCELERATION}: the world of a gyro alone, which is that of its start, has no vertical"
            ))
            .help(format!("{AID} gravity, {INIT} gravity, or the world of a known {INIT} ({WORLD} enu)")));
        }
        Ok(())
    }

    /// A filter weighs by the noise of its sensor.
    fn check_noise(&self) -> Result<(), Diagnostic> {
        if self.noise.is_none() && (self.aid != Aid::None || self.smooth) {
            return Err(Diagnostic::new(format!(
                "{NOISE} none: what corrects the attitude weighs it by its noise"
            ))
            .help(format!("{AID} none, or a class of sensors")));
        }
        Ok(())
    }

    /// A field needs stamps to find its gyro sample by, and a declination a field.
    fn check_field(&self) -> Result<(), Diagnostic> {
        let has_field = self.aid == Aid::GravityAndField;
        if self.declination != 0.0 && !has_field {
            return Err(Diagnostic::new(format!(
                "{DECLINATION}: only a heading by the magnetic field has one"
            ))
            .help(format!("{AID} gravity+mag")));
        }
        if self.declination.is_nan() || self.declination.abs() > std::f64::consts::PI {
            return Err(format!(
                "{DECLINATION}: degrees from -180 to 180, east of true north positive"
            )
            .into());
        }
        if self.mag_hard_iron != 0.0 && !has_field {
            return Err(
                Diagnostic::new(format!("{MAG_HARD_IRON}: no magnetic field is used"))
                    .help(format!("{AID} gravity+mag")),
            );
        }
        if !(0.0..=1.0).contains(&self.mag_hard_iron) {
            return Err(format!(
                "{MAG_HARD_IRON}: one standard deviation as a share of the field, from 0 to 1: 0.05"
            )
            .into());
        }
        if self.mag_mount.is_some() && !has_field {
            return Err(
                Diagnostic::new(format!("{MAG_MOUNT}: no magnetic field is used"))
                    .help(format!("{AID} gravity+mag")),
            );
        }
        if self.mag_axes != AxisMap::IDENTITY && !has_field {
            return Err(
                Diagnostic::new(format!("{MAG_AXES}: no magnetic field is used"))
                    .help(format!("{AID} gravity+mag")),
            );
        }
        let is_beside = has_field || self.has_forces_beside;
        if is_beside && matches!(self.clock, Clock::Index { .. }) {
            return Err(
                Diagnostic::new(format!(
                    "{TIME} index: samples without stamps cannot be paired with a field, or a specific force of its own"
                ))
                .help(format!(
                    "{TIME} header, log or publish"
                ))
            );
        }
        if has_field && self.world == World::Level {
            return Err(Diagnostic::new(format!(
                "{WORLD} level: with a magnetic field the heading is that of north"
            ))
            .help(format!(
                "{WORLD} enu, ned or nwu; {AID} gravity for the heading of the start"
            )));
        }
        Ok(())
    }

    /// A calibration is one of a sensor, and says no other bias than the plan.
    fn check_calibration(&self) -> Result<(), Diagnostic> {
        let Some(known) = &self.calibration else {
            return Ok(());
        };
        known.check().map_err(|e| e.at(CALIBRATION))?;
        if known.bias.is_some() && matches!(self.bias, Bias::Given(_)) {
            return Err(
                Diagnostic::new(format!(
                    "{BIAS} x,y,z: the calibration says a bias, too"
                ))
                .help(format!(
                    "leave {BIAS} out, or `bias` out of the file; {BIAS} auto takes that of the rest in this log"
                ))
            );
        }
        Ok(())
    }

    /// A smoother needs forces, and integrates by itself.
    fn check_smoothing(&self) -> Result<(), Diagnostic> {
        if !self.smooth {
            return Ok(());
        }
        let refused = match self {
            EstimationSettings { aid: Aid::None, .. } => {
                Diagnostic::new(format!("{AID} none: a smoother needs the accelerometer")).help(
                    format!("{AID} gravity or gravity+mag; without {SMOOTH} the gyro alone"),
                )
            }
            EstimationSettings { method, .. } if *method != Method::Auto => Diagnostic::new(
                format!("{METHOD}: a smoother integrates between its nodes by itself"),
            )
            .help("leave one of the two out"),
            EstimationSettings {
                latitude_deg: Some(_),
                ..
            } => Diagnostic::new(format!(
                "{EARTH_RATE}: the smoother takes the Earth's rotation for bias"
            ))
            .help("leave one of the two out"),
            EstimationSettings { mag_hard_iron, .. } if *mag_hard_iron != 0.0 => Diagnostic::new(
                format!("{MAG_HARD_IRON}: a smoother learns the magnetometer's errors by itself"),
            )
            .help("leave it out"),
            _ => return Ok(()),
        };
        Err(refused.after(format_args!("{SMOOTH} with")))
    }

    /// The Earth's rotation needs a latitude that is one, and a world in which the Earth's axis has a place.
    fn check_earth_rate(&self) -> Result<(), Diagnostic> {
        let Some(latitude) = self.latitude_deg else {
            return Ok(());
        };
        if !(-90.0..=90.0).contains(&latitude) {
            return Err(format!(
                "{EARTH_RATE} {latitude}: a latitude lies between -90 and 90 degrees, north positive"
            ).into());
        }
        if self.world == World::Start {
            return Err(
                Diagnostic::new(format!(
                    "{EARTH_RATE}: in {WORLD} start nobody knows where north and up are, and so not how the Earth turns"
                ))
                .help(format!(
                    "{WORLD} enu (or ned, nwu) with {INIT} first-orientation, q=w,x,y,z, rpy=roll,pitch,yaw, or gravity where the heading is 0"
                ))
            );
        }
        Ok(())
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

/// Noise that the covariance is made of: 1 sigma, about the body axes x, y, z.
#[derive(Clone, PartialEq, Debug)]
pub struct Noise {
    /// Name as it was given, for the summary.
    pub name: String,
    /// Angle random walk N, rad/sqrt(s).
    pub arw: [f64; 3],
    /// Bias instability B, rad/s; 1.7 of it is taken as the uncertainty of a constant bias that no estimate removes.
    pub bias_instability: [f64; 3],
    /// Rate random walk K, rad/s/sqrt(s).
    pub rrw: [f64; 3],
    /// Turn-on bias, rad/s: unknown as long as no bias is removed.
    pub turn_on_bias: [f64; 3],
    /// Uncertainty of the initial attitude, rad.
    pub initial: [f64; 3],
    /// Error of the scale factors, as a share.
    pub scale: f64,
    /// Angles between the axes, rad.
    pub misalignment: f64,
    /// Error of an attitude levelled by the accelerometer, rad.
    pub tilt: f64,
    /// Delay of its filters that nobody has taken out, s.
    pub delay: f64,
    /// Sensitivity of the gyro to acceleration, rad/s per g; 0: nothing is said.
    pub sensitivity: f64,
}

const DEG: f64 = std::f64::consts::PI / 180.0;

/// Deviation of a bias of instability B after an hour or so, in B: its flicker has the Allan floor 0.664 B, and
/// 1.6 to 1.8 B of standard deviation over the decades of time a run has (`docs/theory/attitude.md` 9).
const FLICKER: f64 = 1.7;

/// Share of a turn-on bias that is left once it was measured at rest. Chosen on 14 recordings of BROAD
/// (`docs/estimation.md`): without it one of them has 80 % of its errors within three sigma, with it every one all.
const LEFT: f64 = 0.03;

/// Name of the class that is found: the first of [`NOISE_PRESETS`] where the data of a file do not clearly tell that
/// nobody calibrated the sensor.
pub const CLASS_BY_DATA: &str = "auto";

/// Name of noise of which nothing is stated.
pub(super) const NO_NOISE: &str = "none";

impl Noise {
    /// Noise of the default class, which the data of a file may replace.
    #[must_use]
    pub fn by_data() -> Noise {
        Noise {
            name: CLASS_BY_DATA.to_owned(),
            ..Noise::preset(&NOISE_PRESETS[0])
        }
    }

    /// Noise of which nothing is stated: no covariance is carried.
    #[must_use]
    pub fn none() -> Noise {
        Noise {
            name: NO_NOISE.to_owned(),
            arw: [0.0; 3],
            bias_instability: [0.0; 3],
            rrw: [0.0; 3],
            turn_on_bias: [0.0; 3],
            initial: [0.0; 3],
            scale: 0.0,
            misalignment: 0.0,
            tilt: 0.0,
            delay: 0.0,
            sensitivity: 0.0,
        }
    }

    /// Whether nothing is stated of it.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.name == NO_NOISE
    }

    /// Whether the data of a file may replace it.
    pub(super) fn is_by_data(&self) -> bool {
        self.name == CLASS_BY_DATA
    }

    /// The same under the name of the class that it is.
    pub(super) fn taken(&self) -> Noise {
        if self.is_by_data() {
            Noise::preset(&NOISE_PRESETS[0])
        } else {
            self.clone()
        }
    }

    /// Noise of the class of this name, [`CLASS_BY_DATA`] included; `None` where there is none.
    #[must_use]
    pub fn named(name: &str) -> Option<Noise> {
        if name == CLASS_BY_DATA {
            return Some(Noise::by_data());
        }
        let class = NOISE_PRESETS.iter().find(|class| class.name == name);
        class.map(Noise::preset)
    }

    /// Noise of a class.
    #[must_use]
    pub fn preset(class: &NoisePreset) -> Noise {
        Noise {
            name: class.name.to_owned(),
            arw: [class.arw * DEG / 60.0; 3],
            bias_instability: [class.bias_instability * DEG / 3600.0; 3],
            rrw: [0.0; 3],
            turn_on_bias: [class.turn_on_bias * DEG; 3],
            initial: [0.0; 3],
            scale: class.scale,
            misalignment: class.misalignment,
            tilt: class.tilt,
            delay: class.delay,
            sensitivity: class.sensitivity * DEG,
        }
    }

    /// Bias left after removal, rad/s: flicker in full, and a share of the turn-on bias, since
    /// that of a body at rest is not that of one in motion (temperature, acceleration, what drivers cut off).
    #[must_use]
    pub fn unstable_bias(&self) -> [f64; 3] {
        let ([x, y, z], [u, v, w]) = (self.flicker(), self.left_of_turn_on());
        [x.hypot(u), y.hypot(v), z.hypot(w)]
    }

    /// The part of it that is flicker.
    #[must_use]
    pub fn flicker(&self) -> [f64; 3] {
        self.bias_instability.map(|b| FLICKER * b)
    }

    /// The part of it that is the turn-on bias.
    #[must_use]
    pub fn left_of_turn_on(&self) -> [f64; 3] {
        self.turn_on_bias.map(|b| LEFT * b)
    }

    /// Sigma of the bias, rad/s, when none is removed: turn-on bias and instability.
    #[must_use]
    pub fn unremoved_bias(&self) -> [f64; 3] {
        let [x, y, z] = self.turn_on_bias;
        let [u, v, w] = self.unstable_bias();
        [x.hypot(u), y.hypot(v), z.hypot(w)]
    }

    /// One standard deviation of the bias after switching on, rad/s; that of the default class where nothing is said.
    pub(super) fn bias_of_class(&self) -> f64 {
        match self.turn_on_bias.into_iter().fold(0.0, f64::max) {
            0.0 => BIAS_SIGMA,
            class => class,
        }
    }

    /// The same for an attitude that begins level by the accelerometer at a rest that tells the vertical to
    /// `scatter`, rad.
    #[must_use]
    pub fn levelled(&self, scatter: f64) -> Noise {
        let tilt = self.tilt.hypot(scatter);
        Noise {
            initial: self.initial.map(|sigma| sigma.hypot(tilt)),
            ..self.clone()
        }
    }

    /// Noise for the propagator, when `bias` (rad/s) is not known of the bias.
    #[must_use]
    pub fn with_bias(&self, bias: [f64; 3]) -> propagate::Noise {
        if self.is_none() {
            return propagate::Noise::default();
        }
        propagate::Noise {
            initial: self.initial,
            arw: self.arw,
            bias,
            rrw: self.rrw,
            scale: self.scale,
            misalignment: self.misalignment,
            bias_tau: None,
        }
    }
}
