//! Settings of a run -> their names where a person reads of them. Pure.
//!
//! A stage of its own because a refusal or a warning of a library says which setting helps, and a library does not
//! know how
//! that is set: by a flag of a command, an argument in Python, a field of [`Plan`](crate::estimate::Plan). So its
//! texts hold a
//! [`Setting`], which a program that talks to people names in its own way, once, by [`name_settings`] (as
//! `std::panic::set_hook` does for panics). Until then it is called as a field is: `gyro_unit`.
//!
//! ```
//! use strapd_attitude::setting::{GYRO_UNIT, name_settings};
//!
//! assert_eq!(format!("help: {GYRO_UNIT} deg"), "help: gyro_unit deg");
//! name_settings(|name, f| write!(f, "--{}", name.replace('_', "-")))?;
//! assert_eq!(format!("help: {GYRO_UNIT} deg"), "help: --gyro-unit deg");
//! # Ok::<(), strapd_attitude::setting::AlreadyNamed>(())
//! ```

use std::fmt;
use std::sync::OnceLock;

/// Something that can be set for a run, whoever sets it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub struct Setting(&'static str);

impl Setting {
    /// Name as that of a field: `gyro_unit`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.0
    }

    /// Returns it with a value, as advice: `GYRO_UNIT.to("deg")`.
    #[must_use]
    pub fn to(self, value: impl fmt::Display) -> Choice {
        Choice {
            setting: self,
            value: value.to_string(),
        }
    }
}

impl From<Setting> for Choice {
    /// One that is on or off: on.
    fn from(setting: Setting) -> Choice {
        Choice {
            setting,
            value: String::new(),
        }
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match NAMING.get() {
            Some(write) => write(self.0, f),
            None => f.write_str(self.0),
        }
    }
}

/// A setting with the value that helps.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Choice {
    /// Setting that is set.
    pub setting: Setting,
    /// Value, or a placeholder to be filled in (`NAME`); empty for one that is on or off.
    pub value: String,
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value.as_str() {
            "" => self.setting.fmt(f),
            // A value that may be left out stands behind `=`, so that it is not taken for something else.
            value if self.setting == AGAINST_RECORDED => write!(f, "{}={value}", self.setting),
            value => write!(f, "{} {value}", self.setting),
        }
    }
}

/// Writes how a setting of this name is called.
pub type Naming = fn(&str, &mut fmt::Formatter<'_>) -> fmt::Result;

static NAMING: OnceLock<Naming> = OnceLock::new();

/// [`name_settings`] was called before: a program talks in one way.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AlreadyNamed;

impl fmt::Display for AlreadyNamed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("how settings are named has been said before")
    }
}

impl std::error::Error for AlreadyNamed {}

/// Says how this program names settings, for all of its texts from now on.
///
/// # Errors
/// [`AlreadyNamed`]; what was said first holds.
pub fn name_settings(naming: Naming) -> Result<(), AlreadyNamed> {
    NAMING.set(naming).map_err(|_| AlreadyNamed)
}

macro_rules! settings {
    ($($name:ident = $field:literal: $what:literal;)*) => {
        $(#[doc = $what] pub const $name: Setting = Setting($field);)*

        /// All of them.
        pub const ALL: &[Setting] = &[$($name),*];
    };
}

settings! {
    ACCEL_TOPIC = "accel_topic": "The topic of the specific force, where it has one of its own.";
    AGAINST_RECORDED = "against_recorded": "Hold the result against an orientation in the recording.";
    AID = "aid": "What corrects the attitude.";
    BIAS = "bias": "The gyro's bias.";
    BODY = "body": "Axes of the recorded body.";
    CALIBRATION = "calibration": "What is known of the sensor.";
    COLUMNS = "columns": "What the columns of a table are.";
    COPY_INPUT = "copy_input": "Copy the recording to the output.";
    DECLINATION = "declination": "Magnetic north from true north.";
    DELIMITER = "delimiter": "What stands between the cells of a table.";
    EARTH_RATE = "earth_rate": "The latitude whose share of the Earth's rotation is taken out.";
    ENCODING = "encoding": "How messages of an output are encoded.";
    FIELD = "field": "Where a quantity lies in a message.";
    FORCE = "force": "Replace an output that exists.";
    GYRO_RANGE = "gyro_range": "Where the gyro clips.";
    GYRO_UNIT = "gyro_unit": "Unit of the recorded rates.";
    IGNORE_COVARIANCE_FLAG = "ignore_covariance_flag": "Take values that a message marks as absent.";
    INIT = "init": "The attitude at the start.";
    JOIN = "join": "Several files are one recording.";
    LISTEN = "listen": "An address that is listened on.";
    MAG_HARD_IRON = "mag_hard_iron": "Hard iron, to be learned.";
    MAG_MOUNT = "mag_mount": "Mounting of the magnetometer.";
    MAG_TOPIC = "mag_topic": "The topic of the magnetic field, where it has one of its own.";
    MAX_GAP = "max_gap": "The longest gap that is bridged.";
    METHOD = "method": "How rates are integrated.";
    MOUNT = "mount": "Mounting of the sensor.";
    NOISE = "noise": "What the sensor adds.";
    ON_GAP = "on_gap": "What happens at a longer gap.";
    RATE_HZ = "rate_hz": "Samples a second, where stamps do not say.";
    REF_TOPIC = "ref_topic": "The topic of the reference.";
    REGULARISE_STAMPS = "regularise_stamps": "Straighten the stamps.";
    SAMPLE_KIND = "sample_kind": "What a sample means in time.";
    SENSOR_DELAY = "sensor_delay": "By how much samples are later than their stamps.";
    SHARD = "shard": "Which part of many recordings is done.";
    SMOOTH = "smooth": "The recording as a whole.";
    START = "start": "Where in the recording it begins.";
    START_STAMP = "start_stamp": "The first stamp of what is simulated.";
    TIME = "time": "Which clock counts.";
    TOKEN_FILE = "token_file": "The file with a secret.";
    TOPIC = "topic": "Which topic, or sensor.";
    UNDO_TRUNCATION = "undo_truncation": "Put back what a driver has cut off.";
    UNTIL = "until": "Where in the recording it ends.";
    WINDOW = "window": "Samples that are integrated together.";
    WORLD = "world": "Axes of the world.";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advice_of_a_library_names_a_field_and_a_value() {
        assert_eq!(GYRO_UNIT.to("deg").to_string(), "gyro_unit deg");
        assert_eq!(Choice::from(SMOOTH).to_string(), "smooth");
        assert_eq!(AGAINST_RECORDED.to("/q").to_string(), "against_recorded=/q");
    }

    #[test]
    fn every_setting_is_listed_once_and_named_as_a_field() {
        for (n, setting) in ALL.iter().enumerate() {
            assert!(
                setting
                    .name()
                    .bytes()
                    .all(|b| b.is_ascii_lowercase() || b == b'_')
            );
            assert!(!ALL[n + 1..].contains(setting), "{}", setting.name());
        }
    }
}
