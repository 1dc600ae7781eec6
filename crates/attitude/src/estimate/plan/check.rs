//! Settings -> what cannot be of them, in words. Pure.
//!
//! Apart from the table of them because here they meet: most refusals are of two that exclude each other.

use super::{Aid, Bias, EstimationSettings, Initial, LONGEST_DELAY, Truncation};
use crate::condition::{self, Clock};
use crate::diagnostic::Diagnostic;
use crate::frames::AxisMap;
use crate::propagate::{self, Method, Propagator};
use crate::quaternion::{BodyRate, Quaternion};
use crate::record::SampleKind;
use crate::setting::{
    ACCEL_SCALE, AID, BIAS, CALIBRATION, DECLINATION, EARTH_RATE, INIT, LINEAR_ACCELERATION,
    MAG_AXES, MAG_HARD_IRON, MAG_MOUNT, METHOD, NOISE, RATE_HZ, REGULARISE_STAMPS, SENSOR_DELAY,
    SMOOTH, TIME, UNDO_TRUNCATION, WORLD,
};
use crate::worlds::World;

impl EstimationSettings {
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
