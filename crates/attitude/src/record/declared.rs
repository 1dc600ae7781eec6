//! Declarations of a format about its own numbers. Pure.
//!
//! Apart from the samples because it is decided once per channel, and because the user may know better: a
//! setting given by hand wins over anything declared here.

use super::{Nanos, SampleKind};
use crate::frames::BodyAxes;
use crate::worlds::Convention;

/// Unit of the recorded rates (or of the recorded angles, for delta angles).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum GyroUnit {
    /// rad/s (or rad).
    #[default]
    Rad,
    /// degrees per second (or degrees).
    Deg,
    /// mrad/s (or mrad).
    Mrad,
}

impl GyroUnit {
    /// Every unit.
    pub const ALL: [GyroUnit; 3] = [GyroUnit::Rad, GyroUnit::Deg, GyroUnit::Mrad];

    /// Multiply by this to get rad/s (or rad).
    #[must_use]
    pub fn to_rad(self) -> f64 {
        match self {
            GyroUnit::Rad => 1.0,
            GyroUnit::Deg => std::f64::consts::PI / 180.0,
            GyroUnit::Mrad => 1e-3,
        }
    }

    /// The name used by `--gyro-unit`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            GyroUnit::Rad => "rad",
            GyroUnit::Deg => "deg",
            GyroUnit::Mrad => "mrad",
        }
    }
}

/// Unit of a specific force.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum AccelUnit {
    /// m/s^2.
    MetresPerSecondSquared,
    /// Multiples of standard gravity.
    StandardGravity,
}

/// Declarations of a channel's type and schema. `None`: they do not say, and nothing was guessed.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Declared {
    /// Meaning of a sample in time.
    pub sample_kind: Option<SampleKind>,
    /// Meaning that samples of this format's sensors usually have, where nothing in it states one.
    pub usual_kind: Option<SampleKind>,
    /// Unit of the body rate.
    pub gyro_unit: Option<GyroUnit>,
    /// Unit of the specific force.
    pub accel_unit: Option<AccelUnit>,
    /// Axes of the body.
    pub body: Option<BodyAxes>,
    /// World and body of recorded orientations.
    pub world: Option<Convention>,
    /// Path of the samples' own integration interval, and its unit; a path only where a schema says so.
    pub interval: Option<(String, TimeUnit)>,
    /// Whether the user stated that unit: then it is believed, whatever the stamps say.
    pub interval_unit_given: bool,
}

/// Unit of a stamp or of an interval held in one number.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum TimeUnit {
    /// Nanoseconds.
    Nano,
    /// Microseconds.
    Micro,
    /// Milliseconds.
    Milli,
    /// Seconds.
    Second,
    /// Nobody says: by magnitude, as an instant since 1970. 1e17 and above is nanoseconds,
    /// 1e14 microseconds, 1e11 milliseconds, less is seconds.
    #[default]
    ByMagnitude,
}

impl TimeUnit {
    /// Nanoseconds in one unit; `magnitude` is looked at only when nobody says the unit.
    #[must_use]
    pub fn nanos(self, magnitude: f64) -> i64 {
        match self {
            TimeUnit::Nano => 1,
            TimeUnit::Micro => 1_000,
            TimeUnit::Milli => 1_000_000,
            TimeUnit::Second => 1_000_000_000,
            TimeUnit::ByMagnitude => TimeUnit::of_magnitude(magnitude).nanos(magnitude),
        }
    }

    /// The unit of an instant since 1970 of which nothing is known but its magnitude.
    #[must_use]
    pub fn of_magnitude(magnitude: f64) -> TimeUnit {
        match magnitude.abs() {
            m if m >= 1e17 => TimeUnit::Nano,
            m if m >= 1e14 => TimeUnit::Micro,
            m if m >= 1e11 => TimeUnit::Milli,
            _ => TimeUnit::Second,
        }
    }

    /// Name, as [`TimeUnit::named`] takes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            TimeUnit::Nano => "ns",
            TimeUnit::Micro => "us",
            TimeUnit::Milli => "ms",
            TimeUnit::Second => "s",
            TimeUnit::ByMagnitude => "",
        }
    }

    /// Every unit that has a name.
    pub const NAMED: [(&str, TimeUnit); 4] = [
        ("ns", TimeUnit::Nano),
        ("us", TimeUnit::Micro),
        ("ms", TimeUnit::Milli),
        ("s", TimeUnit::Second),
    ];

    /// The unit that a name like `ns`, `us`, `ms`, `s` states.
    #[must_use]
    pub fn named(name: &str) -> Option<TimeUnit> {
        match name {
            "ns" => Some(TimeUnit::Nano),
            "us" => Some(TimeUnit::Micro),
            "ms" => Some(TimeUnit::Milli),
            "s" => Some(TimeUnit::Second),
            _ => None,
        }
    }

    /// The unit that brings `count` nearest to `log`, when one does so to within a factor of 3.
    /// A recorder and a sensor on the same clock agree far better; two clocks do not agree at all,
    /// and then magnitude is all there is.
    #[must_use]
    pub fn nearest(count: f64, log: Nanos) -> Option<TimeUnit> {
        let log = log.0 as f64;
        [
            TimeUnit::Nano,
            TimeUnit::Micro,
            TimeUnit::Milli,
            TimeUnit::Second,
        ]
        .into_iter()
        .find(|unit| {
            let ratio = count * unit.nanos(count) as f64 / log;
            ratio > 1.0 / 3.0 && ratio < 3.0
        })
    }
}
