//! Settings of a run -> their names where a person reads of them. Pure.
//!
//! A stage of its own because a refusal or a warning of a library says which setting helps, and a library does not
//! know how
//! that is set: by a flag of a command, an argument in Python, a field of [`EstimationSettings`](crate::estimate::EstimationSettings). So its
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
pub struct Setting {
    name: &'static str,
    key: &'static str,
}

impl Setting {
    /// Name as that of a field: `gyro_unit`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.name
    }

    /// The same name in a file or on a command line: `gyro-unit`.
    #[must_use]
    pub const fn key(self) -> &'static str {
        self.key
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
            Some(write) => write(self.name, f),
            None => f.write_str(self.name),
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
pub type SettingNamer = fn(&str, &mut fmt::Formatter<'_>) -> fmt::Result;

static NAMING: OnceLock<SettingNamer> = OnceLock::new();

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
pub fn name_settings(naming: SettingNamer) -> Result<(), AlreadyNamed> {
    NAMING.set(naming).map_err(|_| AlreadyNamed)
}

/// A name with `-` for `_`, as bytes, which a constant can have.
const fn dashed<const N: usize>(name: &str) -> [u8; N] {
    let (mut key, mut n) = ([b'-'; N], 0);
    while n < N {
        if name.as_bytes()[n] != b'_' {
            key[n] = name.as_bytes()[n];
        }
        n += 1;
    }
    key
}

macro_rules! settings {
    ($($name:ident = $field:literal;)*) => {
        $(#[doc = concat!("Setting `", $field, "`.")]
        pub const $name: Setting = {
            const KEY: [u8; $field.len()] = dashed($field);
            match std::str::from_utf8(&KEY) {
                Ok(key) => Setting { name: $field, key },
                Err(_) => panic!("a name is ASCII"),
            }
        };)*

        /// All of them.
        pub const ALL: &[Setting] = &[$($name),*];
    };
}

// What one of an estimation means, stands in its row (`estimate/settings/rows.rs`); of the others, in the command's help.
settings! {
    ACCEL_AXES = "accel_axes";
    ACCEL_SCALE = "accel_scale";
    ACCEL_SIGN = "accel_sign";
    ACCEL_TOPIC = "accel_topic";
    AGAINST_RECORDED = "against_recorded";
    AID = "aid";
    AT = "at";
    BASE_FRAME = "base_frame";
    BIAS = "bias";
    BODY = "body";
    CALIBRATION = "calibration";
    COLUMNS = "columns";
    COPY_INPUT = "copy_input";
    DECLINATION = "declination";
    DELIMITER = "delimiter";
    EARTH_RATE = "earth_rate";
    ENCODING = "encoding";
    FIELD = "field";
    FORCE = "force";
    GYRO_AXES = "gyro_axes";
    GYRO_RANGE = "gyro_range";
    GYRO_SCALE = "gyro_scale";
    GYRO_UNIT = "gyro_unit";
    IGNORE_COVARIANCE_FLAG = "ignore_covariance_flag";
    INIT = "init";
    JOIN = "join";
    LINEAR_ACCELERATION = "linear_acceleration";
    LISTEN = "listen";
    MAG_AXES = "mag_axes";
    MAG_HARD_IRON = "mag_hard_iron";
    MAG_MOUNT = "mag_mount";
    MAG_TOPIC = "mag_topic";
    MAX_GAP = "max_gap";
    MEND = "mend";
    METHOD = "method";
    MOUNT = "mount";
    NOISE = "noise";
    ON_GAP = "on_gap";
    ORDER = "order";
    RATE_HZ = "rate_hz";
    REF_TOPIC = "ref_topic";
    REGULARISE_STAMPS = "regularise_stamps";
    SAMPLE_KIND = "sample_kind";
    SECOND_TOPIC = "second_topic";
    SENSOR_DELAY = "sensor_delay";
    SHARD = "shard";
    SMOOTH = "smooth";
    SPIKES = "spikes";
    STAMPS = "stamps";
    START = "start";
    START_STAMP = "start_stamp";
    TF = "tf";
    TIME = "time";
    TOKEN_FILE = "token_file";
    TOPIC = "topic";
    UNDO_TRUNCATION = "undo_truncation";
    UNTIL = "until";
    WINDOW = "window";
    WHERE = "where";
    WORLD = "world";
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
            let is_letter = |b: u8| b.is_ascii_lowercase() || b == b'_';
            assert!(setting.name().bytes().all(is_letter));
            assert_eq!(setting.key(), setting.name().replace('_', "-"));
            assert!(!ALL[n + 1..].contains(setting), "{}", setting.name());
        }
    }
}
