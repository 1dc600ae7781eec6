//! The estimation flags of `replay`, `serve`, `check`, `report` and `calibrate`: how messages are read, and the settings
//! of the table -> a plan, checked once. Pure but for the calibrations that are read.

use super::calibration_files::Calibrations;
use super::setting_args::{Every, Given};
use crate::config::{selection, take_beside};
use crate::error::{Error, Result};
use clap::Args;
use std::collections::BTreeMap;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{EstimationSettings, SensorCalibration, settings};
use strapd_attitude::setting::{AID, CALIBRATION};
use strapd_recording::Selection;

/// Settings by which the samples are understood and integrated.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Estimation")]
pub struct Estimation {
    /// IMU topic, or TOPIC@FRAME of one with several publishers; needed only when a log has several.
    /// `all` = each of them
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Path of a value in the message: ROLE=PATH, ROLE one of gyro, accel, mag, orientation, stamp, dt,
    /// temperature
    #[arg(long = "field", value_name = "ROLE=PATH")]
    pub fields: Vec<String>,
    /// Topic of the specific force, where it comes in messages of its own
    #[arg(long, value_name = "NAME")]
    pub accel_topic: Option<String>,
    /// Topic of the magnetic field for --aid gravity+mag, where it comes in messages of its own [default: the
    /// one there is]
    #[arg(long, value_name = "NAME")]
    pub mag_topic: Option<String>,
    /// Use a gyro whose covariance is marked -1 (absent) all the same: some drivers set it wrongly
    #[arg(long)]
    pub ignore_covariance_flag: bool,
    /// Settings of the table.
    #[command(flatten)]
    pub settings: Given<Every>,
}

impl Estimation {
    /// Whether the gyro is alone: `--aid none`.
    #[must_use]
    pub fn is_unaided(&self) -> bool {
        self.settings.is(AID, "none")
    }

    /// The flags as one checked plan.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the flag, for anything that can be judged without the data; the calibration cannot
    /// be read.
    pub fn plan(&self) -> Result<EstimationSettings> {
        let known = match self.settings.path(CALIBRATION) {
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

    fn plan_with(&self, calibration: Option<Arc<SensorCalibration>>) -> Result<EstimationSettings> {
        let mut plan = settings::defaults();
        self.settings
            .put(&mut plan, calibration)
            .map_err(Error::usage)?;
        take_beside(&mut plan, self.topics_beside())?;
        plan.check().map_err(Error::usage)?;
        Ok(plan)
    }

    fn topics_beside(&self) -> [Option<&String>; 2] {
        [self.accel_topic.as_ref(), self.mag_topic.as_ref()]
    }

    /// The same with `--smooth`, where it was given.
    ///
    /// # Errors
    /// As [`Estimation::plan`]; [`Error::Usage`]: the flags do not go with a smoother.
    pub fn plan_of_a_recording(&self, smooth: bool) -> Result<EstimationSettings> {
        let plan = EstimationSettings {
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
            self.topics_beside(),
        )
    }

    /// The plan of live streams, which have no topics, and those of sensors with calibrations of their own.
    ///
    /// # Errors
    /// As [`Estimation::plan`].
    pub fn live_plans(&self) -> Result<(EstimationSettings, BTreeMap<String, EstimationSettings>)> {
        self.check_live()?;
        let known = self.settings.path(CALIBRATION).map(Calibrations::read);
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
}
