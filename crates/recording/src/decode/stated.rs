//! Statements of a format about its own numbers. Pure.
//!
//! Apart from the samples because it is decided once per channel, and because the user may know
//! better: a flag given by hand wins over anything stated here.

use strapd_attitude::condition::GyroUnit;
use strapd_attitude::frames::BodyAxes;
use strapd_attitude::record::{AccelUnit, Declared};
use strapd_attitude::worlds::Convention;

/// Statements of a channel's type and schema.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Stated {
    /// Meaning of its numbers.
    pub declared: Declared,
    /// Whether messages carry a body rate or delta angle.
    pub has_gyro: bool,
    /// Whether they carry a specific force.
    pub has_accel: bool,
    /// Whether they carry a magnetic field.
    pub has_mag: bool,
    /// Whether they carry a temperature.
    pub has_temperature: bool,
    /// Whether they carry an orientation.
    pub has_orientation: bool,
    /// Whether they carry a stamp of their own.
    pub has_stamp: bool,
    /// Whether they carry their own integration interval.
    pub has_interval: bool,
    /// Whether one message may hold several samples.
    pub batched: bool,
    /// Description of the chosen fields: `gyro angular_velocity, stamp header.stamp`.
    pub description: String,
}

impl Stated {
    /// Applies what ROS message types state: Imu.msg asks for rad/s and m/s^2; REP-103 and REP-145 for
    /// axes x forward, y left, z up and a world of east, north, up.
    pub(crate) fn ros(&mut self) {
        self.si(BodyAxes::Flu, Convention::EnuFlu);
    }

    /// Applies what PX4's messages state: SI, x forward, y right, z down, world north, east, down.
    pub(crate) fn px4(&mut self) {
        self.si(BodyAxes::Frd, Convention::NedFrd);
    }

    fn si(&mut self, body: BodyAxes, world: Convention) {
        self.declared = Declared {
            gyro_unit: Some(GyroUnit::Rad),
            accel_unit: Some(AccelUnit::MetresPerSecondSquared),
            body: Some(body),
            world: Some(world),
            ..std::mem::take(&mut self.declared)
        };
    }
}
