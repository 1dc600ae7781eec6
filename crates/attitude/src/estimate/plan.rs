//! How the samples of a run are to be understood and integrated. Pure.
//!
//! Apart from the stages because each of them takes its part of it, and because what can not be is refused
//! here, before the data are looked at.

use crate::condition::{self, Clock, GyroUnit, OnGap};
use crate::frames::BodyAxes;
use crate::propagate::{self, Method, Propagator};
use crate::quaternion::Quaternion;
use crate::record::SampleKind;
use crate::worlds::World;
use nalgebra::Vector3;

/// How the samples of a run are to be understood and integrated: the estimation flags, checked.
/// `None` = the format decides where it states it, else the default.
#[derive(Clone, Debug)]
pub struct Plan {
    /// `--method`, `--window`, `--order`.
    pub method: Method,
    /// `--sample-kind`.
    pub kind: Option<SampleKind>,
    /// `--gyro-unit`.
    pub unit: Option<GyroUnit>,
    /// `--body`.
    pub body: Option<BodyAxes>,
    /// `--world`.
    pub world: World,
    /// `--mount`: C_bs as `[w, x, y, z]`.
    pub mount: Option<[f64; 4]>,
    /// `--time`, `--rate-hz`.
    pub clock: Clock,
    /// `--init`, in the convention of `world`.
    pub initial: Initial,
    /// `--bias`.
    pub bias: Bias,
    /// `--max-gap`.
    pub max_gap_secs: f64,
    /// `--on-gap`.
    pub on_gap: OnGap,
    /// `--earth-rate`: latitude of a fixed site whose turning with the Earth is taken out. In degrees,
    /// as given, so that it is repeated as given.
    pub latitude_deg: Option<f64>,
    /// `--regularise-stamps`.
    pub regularise_stamps: bool,
    /// `--gyro-range`, rad/s.
    pub gyro_range: Option<f64>,
    /// `--noise`.
    pub noise: Noise,
    /// `--aid`.
    pub aid: Aid,
    /// `--accel-sign`: the accelerometer says down at rest, not up.
    pub is_accel_kinematic: bool,
    /// Specific forces come by [`Estimator::take_force`](super::Estimator::take_force), not with the rates.
    pub has_forces_beside: bool,
    /// `--mag-mount`: magnetometer to body, `[w, x, y, z]`; `None` = as the gyro.
    pub mag_mount: Option<[f64; 4]>,
    /// `--declination`, rad: how far magnetic north lies east of true north.
    pub declination: f64,
    /// `--undo-truncation`.
    pub truncation: Truncation,
    /// `--sensor-delay`, s.
    pub sensor_delay_secs: f64,
    /// `--start`, s.
    pub start: Option<f64>,
    /// `--until`, s.
    pub until: Option<f64>,
}

/// No sensor's own filters take longer, s.
const LONGEST_DELAY: f64 = 0.1;

/// `--aid`: what corrects the attitude of the gyro.
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

/// `--undo-truncation`: what becomes of rates that their driver cut towards zero.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Truncation {
    /// Decided by the data of a file where the attitude is aided; otherwise they stay.
    #[default]
    Unsaid,
    /// Decided by the data of a file.
    Auto,
    /// It was; the data say in which steps.
    On,
    /// In these steps, rad/s.
    Steps(f64),
    /// They stay.
    Off,
}

impl Default for Plan {
    /// What the command line's defaults say, but for [`Aid::None`].
    fn default() -> Plan {
        Plan {
            method: Method::Auto,
            kind: None,
            unit: None,
            body: None,
            world: World::Start,
            mount: None,
            clock: Clock::Header,
            initial: Initial::Identity,
            bias: Bias::None,
            max_gap_secs: 0.5,
            on_gap: OnGap::Hold,
            latitude_deg: None,
            regularise_stamps: false,
            gyro_range: None,
            noise: Noise::preset(&NOISE_PRESETS[0]),
            aid: Aid::None,
            is_accel_kinematic: false,
            has_forces_beside: false,
            mag_mount: None,
            declination: 0.0,
            truncation: Truncation::Unsaid,
            sensor_delay_secs: 0.0,
            start: None,
            until: None,
        }
    }
}

impl Plan {
    /// Whether a step of so many nanoseconds is integrated across.
    #[must_use]
    pub fn bridges(&self, nanos: i64) -> bool {
        self.on_gap == OnGap::Bridge || nanos as f64 <= self.max_gap_secs * 1e9
    }

    /// Checks what can be judged without the data.
    ///
    /// # Errors
    /// In words, naming the flag.
    pub fn check(&self) -> Result<(), String> {
        let conditioning = condition::Settings {
            clock: self.clock,
            max_gap_secs: self.max_gap_secs,
            on_gap: self.on_gap,
            bias: match self.bias {
                Bias::Given(bias) => bias,
                Bias::None | Bias::Auto => Vector3::zeros(),
            },
            gyro_range: self.gyro_range,
            start: self.start,
            until: self.until,
            ..condition::Settings::default()
        };
        conditioning.validate().map_err(|e| e.to_string())?;
        if self.sensor_delay_secs.is_nan() || self.sensor_delay_secs.abs() > LONGEST_DELAY {
            return Err(format!(
                "--sensor-delay: {} s is no delay of a sensor\n  help: seconds, at most {LONGEST_DELAY}: 0.0023 for 2.3 ms",
                self.sensor_delay_secs
            ));
        }
        self.check_earth_rate()?;
        self.check_field()?;
        if self.regularise_stamps && matches!(self.clock, Clock::Index { .. }) {
            return Err("--regularise-stamps: the stamps of --time index are even already\n  help: leave one of the two out".to_owned());
        }
        Propagator::new(propagate::Settings {
            method: self.method,
            // Where the format decides, the kind with the wider choice: the rest is said by topic.
            kind: self.kind.unwrap_or(SampleKind::Average),
            initial: Quaternion::identity(),
            noise: self.noise.with_bias(self.noise.unremoved_bias()),
            ..propagate::Settings::default()
        })
        .map_err(|e| e.to_string())?;
        Ok(())
    }

    /// A field needs stamps to find its gyro sample by, and a declination a field.
    fn check_field(&self) -> Result<(), String> {
        let has_field = self.aid == Aid::GravityAndField;
        if self.declination != 0.0 && !has_field {
            return Err("--declination: only a heading by the magnetic field has one\n  help: --aid gravity+mag".to_owned());
        }
        if self.declination.is_nan() || self.declination.abs() > std::f64::consts::PI {
            return Err(
                "--declination: degrees from -180 to 180, east of true north positive".to_owned(),
            );
        }
        if self.mag_mount.is_some() && !has_field {
            return Err(
                "--mag-mount: no magnetic field is used\n  help: --aid gravity+mag".to_owned(),
            );
        }
        let is_beside = has_field || self.has_forces_beside;
        if is_beside && matches!(self.clock, Clock::Index { .. }) {
            return Err("--time index: samples without stamps can not be paired with a field, or a specific force of its own\n  help: --time header, log or publish".to_owned());
        }
        if has_field && self.world == World::Level {
            return Err("--world level: with a magnetic field the heading is that of north\n  help: --world enu, ned or nwu; --aid gravity for the heading of the start".to_owned());
        }
        Ok(())
    }

    /// `--earth-rate` needs a latitude that is one, and a world in which the Earth's axis has a place.
    fn check_earth_rate(&self) -> Result<(), String> {
        let Some(latitude) = self.latitude_deg else {
            return Ok(());
        };
        if !(-90.0..=90.0).contains(&latitude) {
            return Err(format!(
                "--earth-rate {latitude}: a latitude lies between -90 and 90 degrees, north positive"
            ));
        }
        if self.world == World::Start {
            return Err("--earth-rate: in --world start nobody knows where north and up are, and so not how the Earth turns\n  help: --world enu (or ned, nwu) with --init first-orientation, q=w,x,y,z, rpy=roll,pitch,yaw, or gravity where the heading is 0".to_owned());
        }
        Ok(())
    }
}

/// `--init`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Initial {
    /// World = body at the first sample.
    Identity,
    /// Roll and pitch from the accelerometer at rest; yaw 0.
    Gravity,
    /// The first recorded orientation.
    FirstOrientation,
    /// Given: `[w, x, y, z]`, unit norm.
    Given([f64; 4]),
}

/// `--bias`, rad/s in body axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Bias {
    /// Nothing is subtracted.
    None,
    /// From detected rest; refused when there is none.
    Auto,
    /// Given.
    Given(Vector3<f64>),
}

/// `--noise`: what the covariance is made of. 1 sigma, about the body axes x, y, z.
#[derive(Clone, PartialEq, Debug)]
pub struct Noise {
    /// As named on the command line, for the summary.
    pub name: String,
    /// Angle random walk N, rad/sqrt(s).
    pub arw: [f64; 3],
    /// Bias instability B, rad/s; taken as the uncertainty of a constant bias that no estimate removes.
    pub bias_instability: [f64; 3],
    /// Rate random walk K, rad/s/sqrt(s).
    pub rrw: [f64; 3],
    /// Turn-on bias, rad/s: unknown as long as no bias is removed.
    pub turn_on_bias: [f64; 3],
    /// Uncertainty of the initial attitude, rad.
    pub initial: [f64; 3],
}

const DEG: f64 = std::f64::consts::PI / 180.0;

/// Named noise presets: name, ARW in deg/sqrt(h), bias instability in deg/h, an example.
/// Sources: `docs/theory/attitude.md` 9 (Bosch BMI088 class, ADIS16465, STIM300, HG9900 class).
pub const NOISE_PRESETS: [(&str, f64, f64); 4] = [
    ("consumer", 0.84, 5.0),
    ("industrial", 0.15, 2.0),
    ("tactical", 0.15, 0.5),
    ("navigation", 0.002, 0.01),
];

impl Noise {
    /// By its row.
    #[must_use]
    pub fn preset((name, arw, bias): &(&str, f64, f64)) -> Noise {
        Noise {
            name: (*name).to_owned(),
            arw: [arw * DEG / 60.0; 3],
            bias_instability: [bias * DEG / 3600.0; 3],
            rrw: [0.0; 3],
            turn_on_bias: [0.0; 3],
            initial: [0.0; 3],
        }
    }

    /// What is not known of the bias, rad/s, when none is removed: turn-on bias and instability.
    #[must_use]
    pub fn unremoved_bias(&self) -> [f64; 3] {
        let [x, y, z] = self.turn_on_bias;
        let [u, v, w] = self.bias_instability;
        [x.hypot(u), y.hypot(v), z.hypot(w)]
    }

    /// What the propagator is told, when `bias` (rad/s) is not known of the bias.
    #[must_use]
    pub fn with_bias(&self, bias: [f64; 3]) -> propagate::Noise {
        propagate::Noise {
            initial: self.initial,
            arw: self.arw,
            bias,
            rrw: self.rrw,
            bias_tau: None,
        }
    }
}
