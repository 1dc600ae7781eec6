//! The estimation flags shared by `replay` (and, later, `serve` and `simulate`): text -> settings,
//! checked once. Pure but for the calibrations that are read.

use super::calibration_files::Calibrations;
use super::known_words;
use crate::config::{
    parse_bias, parse_initial, parse_noise, parse_truncation, selection, unit_quaternion,
};
use crate::error::{Error, Result};
use clap::{Args, ValueEnum};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use strapd_attitude::condition::{Clock, GyroUnit, OnGap};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Aid, Bias, Plan, SensorCalibration, Truncation};
use strapd_attitude::propagate::{Method, Order, Placement};
use strapd_attitude::record::SampleKind;
use strapd_recording::Selection;

/// `--method`.
const METHODS: [&str; 12] = [
    "auto",
    "magnus",
    "causal",
    "commit",
    "dcm-left",
    "dcm-right",
    "dcm-mean",
    "rotvec-sum",
    "coning2",
    "coning3",
    "coning4",
    "rk4",
];
/// `--world`.
const WORLDS: [&str; 5] = ["start", "level", "enu", "ned", "nwu"];

/// Settings by which the samples are understood and integrated.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Estimation")]
pub struct Estimation {
    /// IMU topic, or TOPIC@FRAME of one with several publishers; needed only when a log has several.
    /// `all` = each of them
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Clock on which the samples are placed; `index` needs --rate-hz
    #[arg(long, value_enum, default_value = "header", env = "STRAPD_TIME")]
    pub time: TimeArg,
    /// Sample rate for --time index
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub rate_hz: Option<f64>,
    /// Path of a value in the message: ROLE=PATH, ROLE one of gyro, accel, mag, orientation, stamp, dt
    #[arg(long = "field", value_name = "ROLE=PATH")]
    pub fields: Vec<String>,
    /// Method by which rates become turns. `commit` is that of `serve`: it waits for no later sample, nor for one
    /// that was overtaken
    #[arg(
        long,
        default_value = "auto",
        env = "STRAPD_METHOD",
        value_parser = METHODS
    )]
    pub method: String,
    /// Samples in the window of --method magnus|causal|commit (2 to 24; commit: 6 rates or 5 increments)
    #[arg(long, value_name = "P")]
    pub window: Option<usize>,
    /// Order of the Magnus step of --method magnus|causal|commit: 2, 4, 6, 8 or exact
    #[arg(long, value_name = "ORDER")]
    pub order: Option<String>,
    /// Meaning of a sample in time: the rate at its stamp, the mean over the interval that ends at
    /// its stamp, the integral over it, or the whole rotation in it [default: rate, unless the format says otherwise]
    #[arg(long, value_enum, env = "STRAPD_SAMPLE_KIND")]
    pub sample_kind: Option<KindArg>,
    /// Measurements that correct the attitude: auto (gravity where the samples carry a specific force), none (the gyro
    /// alone), gravity, gravity+mag
    ///
    /// By gravity it is level from the first sample, its tilt does not drift, and the gyro's bias, scale and
    /// axes are learned; the heading stays the gyro's. By gravity+mag the heading is that of the magnetic field.
    #[arg(long, value_enum, default_value = "auto", env = "STRAPD_AID")]
    pub aid: AidArg,
    /// Topic of the specific force, where it comes in messages of its own
    #[arg(long, value_name = "NAME")]
    pub accel_topic: Option<String>,
    /// Reading of the accelerometer at rest: specific force (up, as most do) or kinematic acceleration (down)
    #[arg(long, value_enum, default_value = "specific")]
    pub accel_sign: SignArg,
    /// Topic of the magnetic field for --aid gravity+mag, where it comes in messages of its own [default: the
    /// one there is]
    #[arg(long, value_name = "NAME")]
    pub mag_topic: Option<String>,
    /// Rotation from the magnetometer's to body axes, as --mount [default: as the gyro's]
    #[arg(long, value_name = "q=W,X,Y,Z")]
    pub mag_mount: Option<String>,
    /// Learn the magnetometer's hard iron, too, known at the start to so large a share of the field (1 sigma: 0.03
    /// to 0.1): for one that nobody has calibrated, on a body that turns every way [default: it has none]
    #[arg(
        long,
        value_name = "SIGMA",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub mag_hard_iron: f64,
    /// Declination: how far magnetic north lies east of true north, in degrees: the heading by --aid gravity+mag is
    /// true then
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub declination: f64,
    /// Put back what a driver cut from the rates towards zero, half a step: auto (a file shows it), on,
    /// on=STEP in rad/s, off [default: auto where the attitude is aided, else off]
    #[arg(
        long,
        value_name = "WHEN",
        env = "STRAPD_UNDO_TRUNCATION",
        value_parser = known_words::truncation(),
        hide_possible_values = true
    )]
    pub undo_truncation: Option<String>,
    /// Delay of the sensor's own filters, in seconds: each attitude is turned on by its rate for so long
    #[arg(
        long,
        value_name = "SECS",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub sensor_delay: f64,
    /// Unit of the recorded rates [default: rad, unless the format says otherwise]
    #[arg(long, value_enum, env = "STRAPD_GYRO_UNIT")]
    pub gyro_unit: Option<UnitArg>,
    /// Axes of the input: flu, frd, or a map such as YxZ (which sensor axis is x, y, z of the body;
    /// lower case = reversed) [default: flu, unless the format says otherwise]
    #[arg(
        long,
        value_name = "AXES",
        env = "STRAPD_BODY",
        value_parser = known_words::body(),
        hide_possible_values = true
    )]
    pub body: Option<String>,
    /// World of the output: start (the attitude at the first sample), level (z up, heading of the
    /// start; what --aid gives unless told otherwise), enu, ned, nwu
    #[arg(
        long,
        value_name = "WORLD",
        value_parser = WORLDS,
        ignore_case = true,
        default_value = "start",
        env = "STRAPD_WORLD"
    )]
    pub world: String,
    /// Rotation from sensor to body axes, C_bs, as a quaternion: q=w,x,y,z
    #[arg(long, value_name = "q=W,X,Y,Z")]
    pub mount: Option<String>,
    /// Initial attitude: identity, gravity (level from the accelerometer at rest),
    /// first-orientation, q=w,x,y,z, or rpy=roll,pitch,yaw in degrees
    #[arg(
        long,
        value_name = "INIT",
        value_parser = known_words::initial(),
        hide_possible_values = true,
        default_value = "identity",
        allow_hyphen_values = true
    )]
    pub init: String,
    /// Gyro bias in rad/s, body axes: none, auto (from detected rest), or x,y,z [default: auto in a file whose
    /// attitude is aided, if it rests, else none]
    #[arg(
        long,
        value_name = "BIAS",
        value_parser = known_words::bias(),
        hide_possible_values = true,
        allow_hyphen_values = true
    )]
    pub bias: Option<String>,
    /// Calibration of the sensor: a TOML file, as --save-calibration of replay writes it. It is taken
    /// out first, and its sigmas are where the filter begins. serve: or a folder of such files, each for the
    /// sensor it names
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<PathBuf>,
    /// Longest gap that is bridged, in seconds
    #[arg(
        long,
        value_name = "SECS",
        default_value_t = 0.5,
        allow_negative_numbers = true
    )]
    pub max_gap: f64,
    /// Beyond that: hold the attitude, bridge all the same, or reset to the initial attitude
    #[arg(long, value_enum, default_value = "hold")]
    pub on_gap: OnGapArg,
    /// Take out the Earth's rotation at a fixed site, exactly: its latitude in degrees, north positive.
    /// Needs --world enu, ned or nwu and a known heading
    #[arg(long, value_name = "LAT_DEG", allow_negative_numbers = true)]
    pub earth_rate: Option<f64>,
    /// Replace stamps that jitter by evenly spaced ones: a straight line through the stamps of each
    /// stretch of constant rate (a stream: a causal tracker). Only for a sensor that samples evenly
    #[arg(long)]
    pub regularise_stamps: bool,
    /// Full scale of the gyro in rad/s: samples at or beyond it are marked saturated
    #[arg(long, value_name = "RAD_S", allow_negative_numbers = true)]
    pub gyro_range: Option<f64>,
    /// Use a gyro whose covariance is marked -1 (absent) all the same: some drivers set it wrongly
    #[arg(long)]
    pub ignore_covariance_flag: bool,
    /// Class of the sensor: consumer, uncalibrated, industrial, tactical, navigation, or a list
    ///
    /// In the units of data sheets, as in simulate: arw (deg/sqrt(h)) and any of bias-instability (deg/h), rrw
    /// (deg/h/sqrt(h)),
    /// turn-on-bias (deg/h) and initial (deg), with commas between: arw=0.15,bias-instability=2; each one number, or
    /// three x/y/z for
    /// the body axes. The turn-on bias counts unless a bias is removed (--bias); initial is the uncertainty of the
    /// initial attitude.
    /// And one number each: scale-ppm and misalignment (deg), which grow with the angle turned, tilt (deg) of --init
    /// gravity.
    #[arg(
        long,
        value_name = "NOISE",
        default_value = "consumer",
        value_parser = known_words::noise_class(),
        hide_possible_values = true
    )]
    pub noise: String,
    /// Skip the first seconds of the data
    #[arg(long, value_name = "SECS", allow_negative_numbers = true)]
    pub start: Option<f64>,
    /// Stop after this many seconds of the data
    #[arg(long, value_name = "SECS", allow_negative_numbers = true)]
    pub until: Option<f64>,
}

/// `--time`.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeArg {
    /// The stamp inside the message.
    Header,
    /// Time at which it was recorded.
    Log,
    /// Time at which it was sent.
    Publish,
    /// Number of the sample divided by --rate-hz.
    Index,
}

/// `--sample-kind`.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum KindArg {
    /// Instantaneous rate at the stamp.
    Rate,
    /// Mean rate over the interval ending at the stamp.
    Average,
    /// Integral of the rate over it.
    DeltaAngle,
    /// Rotation vector of the whole turn in it, coning included.
    Rotation,
}

impl From<KindArg> for SampleKind {
    fn from(kind: KindArg) -> SampleKind {
        match kind {
            KindArg::Rate => SampleKind::Rate,
            KindArg::Average => SampleKind::Average,
            KindArg::DeltaAngle => SampleKind::DeltaAngle,
            KindArg::Rotation => SampleKind::Rotation,
        }
    }
}

/// `--aid`.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum AidArg {
    /// The accelerometer, where the samples carry a specific force.
    Auto,
    /// The gyro alone.
    None,
    /// The accelerometer.
    Gravity,
    /// The same, and a magnetometer.
    #[value(name = "gravity+mag")]
    GravityAndMag,
}

/// `--accel-sign`.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignArg {
    /// Up at rest.
    Specific,
    /// Down at rest.
    Kinematic,
}

impl From<AidArg> for Aid {
    fn from(aid: AidArg) -> Aid {
        match aid {
            AidArg::Auto => Aid::Auto,
            AidArg::None => Aid::None,
            AidArg::Gravity => Aid::Gravity,
            AidArg::GravityAndMag => Aid::GravityAndField,
        }
    }
}

/// `--gyro-unit`.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnitArg {
    /// rad/s.
    Rad,
    /// deg/s.
    Deg,
    /// mrad/s.
    Mrad,
}

impl From<UnitArg> for GyroUnit {
    fn from(unit: UnitArg) -> GyroUnit {
        match unit {
            UnitArg::Rad => GyroUnit::Rad,
            UnitArg::Deg => GyroUnit::Deg,
            UnitArg::Mrad => GyroUnit::Mrad,
        }
    }
}

/// `--on-gap`.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnGapArg {
    /// Keep the attitude.
    Hold,
    /// Interpolate all the same.
    Bridge,
    /// Go back to the initial attitude.
    Reset,
}

impl From<OnGapArg> for OnGap {
    fn from(policy: OnGapArg) -> OnGap {
        match policy {
            OnGapArg::Hold => OnGap::Hold,
            OnGapArg::Bridge => OnGap::Bridge,
            OnGapArg::Reset => OnGap::Reset,
        }
    }
}

impl Estimation {
    /// The flags as one checked plan.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the flag, for anything that can be judged without the data; the calibration cannot
    /// be read.
    pub fn plan(&self) -> Result<Plan> {
        let known = match &self.calibration {
            None => None,
            Some(path) => Some(Calibrations::read(path)?.of_all().ok_or_else(|| {
                Error::usage(
                    Diagnostic::new(format!("--calibration {}: is a folder", path.display()))
                        .help("name the file in it that is of this sensor"),
                )
            })?),
        };
        self.plan_with(known)
    }

    fn plan_with(&self, calibration: Option<Arc<SensorCalibration>>) -> Result<Plan> {
        for (flag, topic, is_used, help) in [
            (
                "--accel-topic",
                &self.accel_topic,
                self.aid != AidArg::None,
                "gravity",
            ),
            (
                "--mag-topic",
                &self.mag_topic,
                self.aid == AidArg::GravityAndMag,
                "gravity+mag",
            ),
        ] {
            if topic.is_some() && !is_used {
                return Err(Error::usage(
                    Diagnostic::new(format!("{flag}: nothing is taken from it with this --aid"))
                        .help(format!("--aid {help}")),
                ));
            }
        }
        let usage = |flag: &str, e: Diagnostic| Error::usage(e.at(flag));
        let clock = match (self.time, self.rate_hz) {
            (TimeArg::Header, _) => Clock::Header,
            (TimeArg::Log, _) => Clock::Log,
            (TimeArg::Publish, _) => Clock::Publish,
            (TimeArg::Index, Some(rate_hz)) => Clock::Index { rate_hz },
            (TimeArg::Index, None) => {
                return Err(Error::usage(
                    Diagnostic::new("--time index: the sample rate is needed too")
                        .help("--rate-hz HZ"),
                ));
            }
        };
        if self.rate_hz.is_some() && self.time != TimeArg::Index {
            return Err(Error::usage(
                Diagnostic::new("--rate-hz: only --time index uses it")
                    .help("--time index --rate-hz HZ"),
            ));
        }
        let plan = Plan {
            method: self.method()?,
            kind: self.sample_kind.map(SampleKind::from),
            unit: self.gyro_unit.map(GyroUnit::from),
            body: self
                .body
                .as_deref()
                .map(|b| b.parse().map_err(|e| usage("--body", Diagnostic::from(&e))))
                .transpose()?,
            world: self
                .world
                .parse()
                .map_err(|e| usage("--world", Diagnostic::from(&e)))?,
            mount: self
                .mount
                .as_deref()
                .map(|text| unit_quaternion("--mount", text))
                .transpose()?,
            clock,
            initial: parse_initial(&self.init)?,
            bias: self.bias.as_deref().map_or(Ok(Bias::Unsaid), parse_bias)?,
            max_gap_secs: self.max_gap,
            on_gap: self.on_gap.into(),
            latitude_deg: self.earth_rate,
            regularise_stamps: self.regularise_stamps,
            gyro_range: self.gyro_range,
            noise: parse_noise(&self.noise)?,
            aid: self.aid.into(),
            smooth: false,
            is_accel_kinematic: self.accel_sign == SignArg::Kinematic,
            has_forces_beside: self.accel_topic.is_some(),
            mag_mount: self
                .mag_mount
                .as_deref()
                .map(|text| unit_quaternion("--mag-mount", text))
                .transpose()?,
            mag_hard_iron: self.mag_hard_iron,
            declination: self.declination.to_radians(),
            sensor_delay_secs: self.sensor_delay,
            truncation: self
                .undo_truncation
                .as_deref()
                .map_or(Ok(Truncation::Unsaid), parse_truncation)?,
            calibration,
            start: self.start,
            until: self.until,
        };
        plan.check().map_err(Error::usage)?;
        Ok(plan)
    }

    /// The same with `--smooth`, where it was given.
    ///
    /// # Errors
    /// As [`Estimation::plan`]; [`Error::Usage`]: the flags do not go with a smoother.
    pub fn plan_of_a_recording(&self, smooth: bool) -> Result<Plan> {
        let plan = Plan {
            smooth,
            ..self.plan()?
        };
        plan.check().map_err(Error::usage)?;
        Ok(plan)
    }

    /// Selection of samples, and how messages are read.
    ///
    /// # Errors
    /// [`Error::Usage`] for a `--field` that is none.
    pub fn selection(&self) -> Result<Selection> {
        selection(
            self.topic.as_ref(),
            &self.fields,
            self.ignore_covariance_flag,
            [self.accel_topic.as_ref(), self.mag_topic.as_ref()],
        )
    }

    /// The plan of live streams, which have no topics, and those of sensors with calibrations of their own.
    ///
    /// # Errors
    /// As [`Estimation::plan`].
    pub fn live_plans(&self) -> Result<(Plan, BTreeMap<String, Plan>)> {
        self.check_live()?;
        let known = self.calibration.as_deref().map(Calibrations::read);
        Ok(match known.transpose()? {
            None => (self.plan_with(None)?, BTreeMap::new()),
            Some(Calibrations::One(known)) => (self.plan_with(Some(known))?, BTreeMap::new()),
            Some(Calibrations::Each(each)) => {
                let plan = |(id, known)| Ok((id, self.plan_with(Some(known))?));
                (
                    self.plan_with(None)?,
                    each.into_iter().map(plan).collect::<Result<_>>()?,
                )
            }
        })
    }

    /// Flags that are no use to a live stream.
    fn check_live(&self) -> Result<()> {
        if self.topic.is_some() {
            return Err(Error::usage(
                "--topic: a sensor is named by `id` in its samples, and chosen with WATCH"
                    .to_owned(),
            ));
        }
        for (flag, topic) in [
            ("--accel-topic", &self.accel_topic),
            ("--mag-topic", &self.mag_topic),
        ] {
            if topic.is_some() {
                return Err(Error::usage(
                    Diagnostic::new(format!("{flag}: samples over a socket have no topics"))
                        .help("`accel` and `mag` stand beside `gyro` in a sample"),
                ));
            }
        }
        Ok(())
    }

    fn method(&self) -> Result<Method> {
        let named: Method = match self.method.as_str() {
            "causal" => Method::Magnus {
                window: 5,
                order: Order::M6,
                placement: Placement::Causal,
            },
            name => name
                .parse()
                .map_err(|e| Error::usage(Diagnostic::from(&e).at("--method")))?,
        };
        let asked_order: Option<Order> = self
            .order
            .as_deref()
            .map(|o| {
                o.parse()
                    .map_err(|e| Error::usage(Diagnostic::from(&e).at("--order")))
            })
            .transpose()?;
        Ok(match named {
            Method::Magnus {
                window,
                order,
                placement,
            } => Method::Magnus {
                window: self.window.unwrap_or(window),
                order: asked_order.unwrap_or(order),
                placement,
            },
            Method::Live { order, finals } => {
                let order = asked_order.unwrap_or(order);
                match self.window {
                    Some(window) => Method::CommitProvisional {
                        window,
                        order,
                        finals,
                    },
                    None => Method::Live { order, finals },
                }
            }
            other if self.window.is_none() && asked_order.is_none() => other,
            _ => {
                return Err(Error::usage(format!(
                    "--window and --order belong to --method magnus, causal or commit, not to {}",
                    self.method
                )));
            }
        })
    }
}
