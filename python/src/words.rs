//! The arguments of a replay as the command takes them -> what is to be done. Pure but for a file with a calibration.
//!
//! As texts, and by the functions that read the command's: what `strapd replay` understands is understood here, in
//! its words. (What arrays are estimated by, [`crate::settings`] reads: there a number is a number.)

use crate::settings::method_of;
use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use strapd_attitude::condition::{Clock, GyroUnit, OnGap};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Aid, Plan, SensorCalibration};
use strapd_attitude::propagate::Method;
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::SampleKind;
use strapd_recording::{Selection, Source};
use strapd_replay::config::{
    calibration, parse_bias, parse_initial, parse_noise, parse_truncation, selection,
    unit_quaternion,
};
use strapd_replay::error::{Error, Result};
use strapd_replay::pipeline::request::ReplayRequest;

/// A larger file is no calibration.
const LARGEST_CALIBRATION: u64 = 1 << 16;

/// Values by name; the names are the command's, `-` as `_`. Only `field` may have several.
pub struct Words(BTreeMap<String, Vec<String>>);

fn usage(what: impl Into<Diagnostic>) -> Error {
    Error::usage(what)
}

impl Words {
    /// Makes them of these names and values.
    pub fn new(words: BTreeMap<String, Vec<String>>) -> Words {
        Words(words)
    }

    fn all(&self, name: &str) -> &[String] {
        self.0.get(name).map_or(&[], Vec::as_slice)
    }

    /// The value of a name, where it has one.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.all(name).last().map(String::as_str)
    }

    fn owned(&self, name: &str) -> Option<String> {
        self.text(name).map(str::to_owned)
    }

    /// The value of a name as what it is.
    ///
    /// # Errors
    /// [`Error::Usage`] for a text that is none.
    pub fn parsed<T: FromStr<Err: std::fmt::Display>>(&self, name: &str) -> Result<Option<T>> {
        let parsed = self.text(name).map(|text| {
            text.parse()
                .map_err(|why| usage(format!("{name}: {text:?}: {why}")))
        });
        parsed.transpose()
    }

    fn truth(&self, name: &str) -> bool {
        self.text(name) == Some("true")
    }

    fn one_of<T: Copy>(&self, name: &str, all: &[(&str, T)]) -> Result<Option<T>> {
        let Some(text) = self.text(name) else {
            return Ok(None);
        };
        let found = all.iter().find(|(known, _)| *known == text);
        found.map(|(_, value)| Some(*value)).ok_or_else(|| {
            let known: Vec<&str> = all.iter().map(|(known, _)| *known).collect();
            usage(
                Diagnostic::new(format!("{name}: there is no {text:?}"))
                    .help(format!("one of {}", known.join(", "))),
            )
        })
    }

    fn quaternion<To, From>(&self, name: &str) -> Result<Option<Quaternion<To, From>>> {
        let given = self.text(name).map(|text| unit_quaternion(name, text));
        given.transpose()
    }

    /// The replay of the log at `path`.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the argument; the calibration cannot be read.
    pub fn request(
        &self,
        path: PathBuf,
        known: Option<SensorCalibration>,
    ) -> Result<ReplayRequest> {
        let out_rate = self.parsed::<f64>("out_rate")?;
        if out_rate.is_some_and(|hz| !(hz.is_finite() && hz > 0.0)) {
            return Err(usage("out_rate: a rate above 0 Hz is needed"));
        }
        Ok(ReplayRequest {
            selection: self.selection()?,
            plan: self.plan(known)?,
            out_rate,
            ..ReplayRequest::new(Source::File(path))
        })
    }

    /// Selection of samples, and how messages are read.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the argument.
    pub fn selection(&self) -> Result<Selection> {
        let (topic, accel, mag) = (
            self.owned("topic"),
            self.owned("accel_topic"),
            self.owned("mag_topic"),
        );
        let mut selection = selection(
            topic.as_ref(),
            self.all("field"),
            self.truth("ignore_covariance_flag"),
            [accel.as_ref(), mag.as_ref()],
        )?;
        selection.decode.columns = self.parsed("columns")?;
        selection.decode.delimiter = self.parsed("delimiter")?;
        Ok(selection)
    }

    fn plan(&self, known: Option<SensorCalibration>) -> Result<Plan> {
        let plain = Plan::default();
        let kinds = SampleKind::ALL;
        let units = [GyroUnit::Rad, GyroUnit::Deg, GyroUnit::Mrad];
        let policies = [OnGap::Hold, OnGap::Bridge, OnGap::Reset];
        let aids = [
            ("auto", Aid::Auto),
            ("none", Aid::None),
            ("gravity", Aid::Gravity),
            ("gravity+mag", Aid::GravityAndField),
        ];
        let aid = self.one_of("aid", &aids)?.unwrap_or(Aid::Auto);
        for (name, is_used, help) in [
            ("accel_topic", aid != Aid::None, "gravity"),
            ("mag_topic", aid == Aid::GravityAndField, "gravity+mag"),
        ] {
            if self.text(name).is_some() && !is_used {
                return Err(usage(
                    Diagnostic::new(format!("{name}: nothing is taken from it with this aid"))
                        .help(format!("aid={help}")),
                ));
            }
        }
        let plan = Plan {
            method: self.method()?,
            kind: self.one_of("sample_kind", &kinds.map(|k| (k.name(), k)))?,
            unit: self.one_of("gyro_unit", &units.map(|u| (u.name(), u)))?,
            body: self.parsed("body")?,
            world: self.parsed("world")?.unwrap_or(plain.world),
            mount: self.quaternion("mount")?,
            clock: self.clock()?,
            initial: parse_initial(self.text("init").unwrap_or("identity"))?,
            bias: self
                .text("bias")
                .map_or(Ok(plain.bias), parse_bias)?,
            max_gap_secs: self.parsed("max_gap")?.unwrap_or(plain.max_gap_secs),
            on_gap: self
                .one_of("on_gap", &policies.map(|p| (p.name(), p)))?
                .unwrap_or_default(),
            latitude_deg: self.parsed("earth_rate")?,
            regularise_stamps: self.truth("regularise_stamps"),
            gyro_range: self.parsed("gyro_range")?,
            noise: self
                .text("noise")
                .map_or_else(|| Ok(plain.noise.clone()), parse_noise)?,
            aid,
            smooth: self.truth("smooth"),
            is_accel_kinematic: self
                .one_of("accel_sign", &[("specific", false), ("kinematic", true)])?
                .unwrap_or(false),
            has_forces_beside: self.text("accel_topic").is_some(),
            mag_mount: self.quaternion("mag_mount")?,
            mag_hard_iron: self.parsed("mag_hard_iron")?.unwrap_or(0.0),
            declination: self
                .parsed::<f64>("declination")?
                .unwrap_or(0.0)
                .to_radians(),
            sensor_delay_secs: self.parsed("sensor_delay")?.unwrap_or(0.0),
            truncation: self
                .text("undo_truncation")
                .map_or(Ok(plain.truncation), parse_truncation)?,
            calibration: match (known, self.text("calibration")) {
                (Some(known), _) => Some(Arc::new(known)),
                (None, Some(path)) => Some(Arc::new(read_calibration(Path::new(path))?)),
                (None, None) => None,
            },
            start: self.parsed("start")?,
            until: self.parsed("until")?,
        };
        plan.check().map_err(Error::usage)?;
        Ok(plan)
    }

    fn clock(&self) -> Result<Clock> {
        let rate_hz = self.parsed("rate_hz")?;
        let time = self.text("time").unwrap_or("header");
        Ok(match (time, rate_hz) {
            ("index", Some(rate_hz)) => Clock::Index { rate_hz },
            ("index", None) => {
                return Err(usage(
                    Diagnostic::new("time: \"index\" needs the sample rate too").help("rate_hz"),
                ));
            }
            (_, Some(_)) => {
                return Err(usage(
                    Diagnostic::new("rate_hz: only time=\"index\" uses it").help("time=\"index\""),
                ));
            }
            ("header", None) => Clock::Header,
            ("log", None) => Clock::Log,
            ("publish", None) => Clock::Publish,
            (other, None) => {
                return Err(usage(
                    Diagnostic::new(format!("time: there is no {other:?}"))
                        .help("one of header, log, publish, index"),
                ));
            }
        })
    }

    fn method(&self) -> Result<Method> {
        let name = self.text("method").unwrap_or("auto");
        let (window, order) = (self.parsed("window")?, self.parsed("order")?);
        method_of(name, window, order, false).map_err(Error::usage)
    }
}

fn read_calibration(path: &Path) -> Result<SensorCalibration> {
    let opening = |source| strapd_recording::Error::Open {
        path: path.to_owned(),
        source,
    };
    let file = std::fs::File::open(path).map_err(opening)?;
    let mut text = String::new();
    file.take(LARGEST_CALIBRATION + 1)
        .read_to_string(&mut text)
        .map_err(opening)?;
    let wrong = |what: &str| usage(format!("calibration: {}: {what}", path.display()));
    if text.len() as u64 > LARGEST_CALIBRATION {
        return Err(wrong("larger than any calibration"));
    }
    calibration::parse(&text).map_err(|what| wrong(&what.to_string()))
}
