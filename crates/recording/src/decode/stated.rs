//! What a format says about its own numbers. Pure.
//!
//! Apart from the samples because it is decided once per channel, and because the user may know
//! better: a flag given by hand wins over anything stated here.

use super::stamp::TimeUnit;
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::record::SampleKind;

/// Unit of a specific force.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum AccelUnit {
    /// m/s^2.
    MetresPerSecondSquared,
    /// Multiples of standard gravity.
    StandardGravity,
}

/// Axes of the body the numbers are resolved in.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum BodyAxes {
    /// x forward, y left, z up (ROS, REP-103).
    Flu,
    /// x forward, y right, z down (PX4, MAVLink).
    Frd,
}

/// Axes of the world a recorded orientation refers to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum WorldAxes {
    /// East, north, up (ROS, REP-103).
    Enu,
    /// North, east, down (PX4, MAVLink).
    Ned,
}

/// What a channel's type and schema state. `None`: they do not say, and nothing was guessed.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Stated {
    /// What a sample means in time.
    pub sample_kind: Option<SampleKind>,
    /// Unit of the body rate.
    pub gyro_unit: Option<GyroUnit>,
    /// Unit of the specific force.
    pub accel_unit: Option<AccelUnit>,
    /// Axes of the body.
    pub axes: Option<BodyAxes>,
    /// Axes of the world behind recorded orientations.
    pub world: Option<WorldAxes>,
    /// Whether messages carry a body rate or delta angle.
    pub has_gyro: bool,
    /// Whether they carry a specific force.
    pub has_accel: bool,
    /// Whether they carry an orientation.
    pub has_orientation: bool,
    /// Whether they carry a stamp of their own.
    pub has_stamp: bool,
    /// Whether they carry their own integration interval.
    pub has_interval: bool,
    /// Where that interval lies, and its unit; a path only where a schema says so.
    pub interval: Option<(String, TimeUnit)>,
    /// Whether one message may hold several samples.
    pub batched: bool,
    /// Which fields were chosen, in words: `gyro angular_velocity, stamp header.stamp`.
    pub description: String,
}

impl Stated {
    /// What ROS message types state: Imu.msg asks for rad/s and m/s^2; REP-103 and REP-145 for
    /// axes x forward, y left, z up and a world of east, north, up.
    pub(crate) fn ros(&mut self) {
        self.gyro_unit = Some(GyroUnit::Rad);
        self.accel_unit = Some(AccelUnit::MetresPerSecondSquared);
        self.axes = Some(BodyAxes::Flu);
        self.world = Some(WorldAxes::Enu);
    }

    /// What PX4's messages state: SI, x forward, y right, z down, world north, east, down.
    pub(crate) fn px4(&mut self) {
        self.gyro_unit = Some(GyroUnit::Rad);
        self.accel_unit = Some(AccelUnit::MetresPerSecondSquared);
        self.axes = Some(BodyAxes::Frd);
        self.world = Some(WorldAxes::Ned);
    }
}
