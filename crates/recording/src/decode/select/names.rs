//! Field names seen in the wild -> what they hold. Pure.
//!
//! One table for schemas and for JSON keys. Names are compared without case, underscores and
//! dashes: `angular_velocity`, `angularVelocity` and `AngularVelocity` are one name.

use strapd_attitude::condition::GyroUnit;
use strapd_attitude::record::TimeUnit;

/// Meaning that a name gives to the value behind it; `rank` orders rivals, 0 first.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Meaning {
    /// A body rate, x, y, z.
    Gyro { rank: u8, unit: Option<GyroUnit> },
    /// A delta angle, x, y, z.
    DeltaAngle,
    /// One axis of a body rate.
    GyroAxis {
        axis: u8,
        rank: u8,
        unit: Option<GyroUnit>,
    },
    /// A specific force, x, y, z.
    Accel { rank: u8 },
    /// A specific force integrated over its interval.
    DeltaVelocity,
    /// One axis of a specific force.
    AccelAxis { axis: u8 },
    /// A magnetic field, x, y, z.
    Mag,
    /// One axis of a magnetic field.
    MagAxis { axis: u8 },
    /// An orientation.
    Orientation { rank: u8 },
    /// Count of an orientation's resets.
    OrientationResets,
    /// Temperature of the sensor, degrees Celsius.
    Temperature,
    /// A stamp.
    Stamp { rank: u8, unit: TimeUnit },
    /// Something that holds a stamp.
    Header,
    /// The interval of a delta angle or an average; of a floating-point field in seconds ([`interval_unit`]).
    GyroInterval(TimeUnit),
    /// The interval of a delta velocity.
    AccelInterval(TimeUnit),
    /// Interval in a unit that only its own name states.
    Interval(TimeUnit),
}

/// `name` without case, underscores, dashes and spaces, when it is not absurdly long.
pub(crate) fn plain(name: &str, buffer: &mut [u8; 40]) -> usize {
    let mut len = 0;
    for byte in name.bytes().filter(u8::is_ascii_alphanumeric) {
        match buffer.get_mut(len) {
            Some(slot) => *slot = byte.to_ascii_lowercase(),
            None => return 0,
        }
        len += 1;
    }
    len
}

/// Meaning of `name`.
pub(crate) fn meaning(name: &str) -> Option<Meaning> {
    let mut buffer = [0; 40];
    let len = plain(name, &mut buffer);
    let name = std::str::from_utf8(buffer.get(..len)?).ok()?;
    // By first letter: this runs for every key of every JSON message.
    match *name.as_bytes().first()? {
        b'a' => a_names(name),
        b'd' => d_names(name),
        b'g' => g_names(name),
        b'h' | b'm' | b'r' => misc_names(name),
        b'l' => linear(name),
        b'b' | b'i' | b'o' | b'p' | b'q' | b'w' | b'y' => rare_names(name),
        b's' | b't' => time_names(name),
        b'x' | b'z' => axis_first(name),
        _ => None,
    }
}

fn gyro(rank: u8) -> Option<Meaning> {
    Some(Meaning::Gyro { rank, unit: None })
}

/// A body rate whose name goes on with an axis, a unit, or both.
fn gyro_tail(tail: &str, rank: u8) -> Option<Meaning> {
    let (axis, tail) = match tail.as_bytes().first() {
        Some(letter @ b'x'..=b'z') => (Some(letter - b'x'), tail.get(1..)?),
        _ => (None, tail),
    };
    let unit = match tail {
        "" | "raw" | "data" | "calibrated" if axis.is_none() || tail.is_empty() => None,
        "rad" | "rads" | "radps" | "radpers" | "radpersec" | "radsec" => Some(GyroUnit::Rad),
        "deg" | "dps" | "degs" | "degps" | "degpers" | "degpersec" | "degsec" => {
            Some(GyroUnit::Deg)
        }
        "mrad" | "mrads" | "mradps" | "mradpers" => Some(GyroUnit::Mrad),
        _ => return None,
    };
    Some(match axis {
        Some(axis) => Meaning::GyroAxis { axis, rank, unit },
        None => Meaning::Gyro { rank, unit },
    })
}

/// A magnetic field whose name goes on with an axis, a unit, or both: its unit says nothing about north.
fn mag_tail(tail: &str) -> Option<Meaning> {
    let (axis, tail) = match tail.as_bytes().first() {
        Some(letter @ b'x'..=b'z') => (Some(letter - b'x'), tail.get(1..)?),
        _ => (None, tail),
    };
    match (axis, tail) {
        (None, "raw" | "data" | "calibrated") => Some(Meaning::Mag),
        (
            axis,
            "" | "t" | "ut" | "nt" | "mt" | "g" | "ga" | "mg" | "gauss" | "tesla" | "microtesla",
        ) => Some(axis.map_or(Meaning::Mag, |axis| Meaning::MagAxis { axis })),
        _ => None,
    }
}

fn accel_tail(tail: &str, rank: u8) -> Option<Meaning> {
    match tail {
        "" | "raw" | "data" | "ms2" | "mps2" => Some(Meaning::Accel { rank }),
        "x" | "xms2" => Some(Meaning::AccelAxis { axis: 0 }),
        "y" | "yms2" => Some(Meaning::AccelAxis { axis: 1 }),
        "z" | "zms2" => Some(Meaning::AccelAxis { axis: 2 }),
        _ => None,
    }
}

/// The temperature of a gyro; under another unit's name none is taken.
fn temperature(name: &str) -> Option<Meaning> {
    let tail = name.strip_prefix("temperature");
    let tail = tail.or_else(|| name.strip_prefix("temp"))?;
    matches!(tail, "" | "c" | "degc" | "celsius").then_some(Meaning::Temperature)
}

/// Whether a key means a body rate, or one axis of it.
#[must_use]
pub fn is_rate_name(key: &str) -> bool {
    use Meaning::{DeltaAngle, Gyro, GyroAxis};
    matches!(
        meaning(key),
        Some(Gyro { .. } | GyroAxis { .. } | DeltaAngle)
    )
}

fn a_names(name: &str) -> Option<Meaning> {
    for (head, rank) in [
        ("angularvelocity", 0),
        ("angularrates", 1),
        ("angularrate", 1),
        ("angularvel", 1),
        ("angvel", 1),
    ] {
        if let Some(tail) = name.strip_prefix(head) {
            return gyro_tail(tail, rank);
        }
    }
    match name {
        "attitude" => return Some(Meaning::Orientation { rank: 1 }),
        "ax" => return Some(Meaning::AccelAxis { axis: 0 }),
        "ay" => return Some(Meaning::AccelAxis { axis: 1 }),
        "az" => return Some(Meaning::AccelAxis { axis: 2 }),
        _ => {}
    }
    ["accelerometer", "acceleration", "accel", "acc"]
        .into_iter()
        .find_map(|head| name.strip_prefix(head))
        .and_then(|tail| accel_tail(tail, 1))
}

fn d_names(name: &str) -> Option<Meaning> {
    Some(match name {
        "deltaangle" | "deltatheta" | "dtheta" => Meaning::DeltaAngle,
        "deltavelocity" => Meaning::DeltaVelocity,
        "deltaangledt" => Meaning::GyroInterval(TimeUnit::Micro),
        "deltavelocitydt" => Meaning::AccelInterval(TimeUnit::Micro),
        "dt" => Meaning::Interval(TimeUnit::ByMagnitude),
        "dts" => Meaning::Interval(TimeUnit::Second),
        "dtms" => Meaning::Interval(TimeUnit::Milli),
        "dtus" => Meaning::Interval(TimeUnit::Micro),
        "dtns" => Meaning::Interval(TimeUnit::Nano),
        _ => return None,
    })
}

fn g_names(name: &str) -> Option<Meaning> {
    match name {
        "gyrointegraldt" => return Some(Meaning::GyroInterval(TimeUnit::Micro)),
        "gx" | "gy" | "gz" => return gyro_tail(name.get(1..)?, 3),
        _ => {}
    }
    for (head, rank) in [("gyroscope", 0), ("gyro", 0), ("gyr", 1)] {
        if let Some(tail) = name.strip_prefix(head) {
            return gyro_tail(tail, rank).or_else(|| temperature(tail));
        }
    }
    None
}

fn misc_names(name: &str) -> Option<Meaning> {
    match name {
        "header" | "head" | "hdr" | "report" | "meta" => Some(Meaning::Header),
        "rotation" => Some(Meaning::Orientation { rank: 2 }),
        "rate" | "rates" => gyro(2),
        "rollspeed" => gyro_tail("x", 3),
        "mx" | "my" | "mz" => mag_tail(name.get(1..)?),
        _ if name.starts_with("mag") => [
            "magneticfield",
            "magnetometer",
            "magfield",
            "magnetic",
            "mag",
        ]
        .into_iter()
        .find_map(|head| mag_tail(name.strip_prefix(head)?)),
        "measurementtime" => Some(Meaning::Stamp {
            rank: 3,
            unit: TimeUnit::ByMagnitude,
        }),
        _ => gyro_tail(name.strip_prefix("rotationrate")?, 1),
    }
}

fn linear(name: &str) -> Option<Meaning> {
    accel_tail(name.strip_prefix("linearacceleration")?, 0)
}

fn rare_names(name: &str) -> Option<Meaning> {
    match name {
        "orientation" => Some(Meaning::Orientation { rank: 0 }),
        "quaternion" => Some(Meaning::Orientation { rank: 0 }),
        "quatresetcounter" => Some(Meaning::OrientationResets),
        "quat" | "q" | "qnb" => Some(Meaning::Orientation { rank: 1 }),
        "bodyrate" | "bodyrates" => gyro(1),
        "wx" | "wy" | "wz" => gyro_tail(name.get(1..)?, 3),
        "pitchspeed" => gyro_tail("y", 3),
        "yawspeed" => gyro_tail("z", 3),
        "ygyro" | "yacc" | "ymag" => axis_first(name),
        _ => match name.strip_prefix("imu") {
            Some(tail) => temperature(tail).or_else(|| gyro_tail(tail.strip_prefix("gyro")?, 1)),
            None => gyro_tail(name.strip_prefix("omega")?, 1),
        },
    }
}

/// MAVLink writes the axis first.
fn axis_first(name: &str) -> Option<Meaning> {
    let axis = name.bytes().next()?.wrapping_sub(b'x');
    match name.get(1..)? {
        "gyro" => Some(Meaning::GyroAxis {
            axis,
            rank: 1,
            unit: None,
        }),
        "acc" => Some(Meaning::AccelAxis { axis }),
        "mag" => Some(Meaning::MagAxis { axis }),
        _ => None,
    }
}

fn time_names(name: &str) -> Option<Meaning> {
    let (rank, tail) = match name {
        "stamp" => (0, ""),
        "timestampsample" => (0, "us"),
        "timebootms" => (2, "ms"),
        "t" | "ts" => (3, ""),
        "sampletime" => (1, ""),
        "specificforce" => return Some(Meaning::Accel { rank: 0 }),
        _ if name.starts_with("temp") => return temperature(name),
        _ => [("timestamp", 1), ("stamp", 1), ("time", 2), ("t", 3)]
            .into_iter()
            .find_map(|(head, rank)| Some((rank, name.strip_prefix(head)?)))?,
    };
    let unit = match tail {
        "" => TimeUnit::ByMagnitude,
        "ns" | "nsec" | "nsecs" | "nano" | "nanos" | "nanoseconds" => TimeUnit::Nano,
        "us" | "usec" | "usecs" | "micro" | "micros" | "microseconds" => TimeUnit::Micro,
        "ms" | "msec" | "millis" | "milliseconds" => TimeUnit::Milli,
        "s" | "sec" | "secs" | "seconds" => TimeUnit::Second,
        _ => return None,
    };
    Some(Meaning::Stamp { rank, unit })
}

/// The seconds of a two-part stamp.
pub(crate) fn is_seconds(name: &str) -> bool {
    matches!(name, "sec" | "secs" | "seconds" | "s")
}

/// The nanoseconds of a two-part stamp.
pub(crate) fn is_nanos(name: &str) -> bool {
    matches!(
        name,
        "nanosec" | "nanosecs" | "nsec" | "nsecs" | "nanos" | "nanoseconds" | "ns"
    )
}

/// Types whose numbers are known by the type's name alone.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Px4 {
    /// `gyro_rad` is the mean rate over `gyro_integral_dt`, with a part of the coning in it (`docs/formats.md`,
    /// "Coning in PX4's numbers", says why it is no rotation).
    SensorCombined,
    /// `delta_angle` over `delta_angle_dt`.
    VehicleImu,
    /// `xyz`, filtered and bias corrected, at `timestamp_sample`.
    VehicleAngularVelocity,
    /// `x`, `y`, `z` at `timestamp_sample`.
    SensorGyro,
    /// The same of specific force, m/s^2.
    SensorAccel,
    /// The same of the magnetic field, gauss.
    SensorMag,
    /// `magnetometer_ga`.
    VehicleMagnetometer,
    /// Counts of up to 32 samples, the last at `timestamp_sample`.
    SensorGyroFifo,
    /// `q` as w, x, y, z: FRD to NED.
    VehicleAttitude,
}

/// The unit of an interval whose name is PX4's: whole numbers count in what it says, and floating-point ones, which
/// older firmware logged, are seconds.
pub(crate) fn interval_unit(named: TimeUnit, is_float: bool) -> TimeUnit {
    match is_float {
        true => TimeUnit::Second,
        false => named,
    }
}

/// PX4's own messages, as `px4_msgs/msg/SensorCombined`, `px4.sensor_combined` or `sensor_combined`.
pub(crate) fn px4(type_name: &str) -> Option<Px4> {
    let mut buffer = [0; 40];
    let len = plain(super::super::schema::last_name(type_name), &mut buffer);
    match buffer.get(..len)? {
        b"sensorcombined" => Some(Px4::SensorCombined),
        b"vehicleimu" => Some(Px4::VehicleImu),
        b"vehicleangularvelocity" => Some(Px4::VehicleAngularVelocity),
        b"sensorgyro" => Some(Px4::SensorGyro),
        b"sensoraccel" => Some(Px4::SensorAccel),
        b"sensormag" => Some(Px4::SensorMag),
        b"vehiclemagnetometer" => Some(Px4::VehicleMagnetometer),
        b"sensorgyrofifo" => Some(Px4::SensorGyroFifo),
        b"vehicleattitude" => Some(Px4::VehicleAttitude),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_one_name_however_they_are_spelt() {
        for name in ["angular_velocity", "angularVelocity", "Angular-Velocity"] {
            assert_eq!(meaning(name), gyro(0), "{name}");
        }
        let axis = |axis, rank, unit| Some(Meaning::GyroAxis { axis, rank, unit });
        assert_eq!(meaning("gyro_x"), axis(0, 0, None));
        assert_eq!(meaning("gyro_z_dps"), axis(2, 0, Some(GyroUnit::Deg)));
        assert_eq!(meaning("ygyro"), axis(1, 1, None));
        assert_eq!(meaning("gz"), axis(2, 3, None));
        assert_eq!(
            meaning("gyro_rad"),
            Some(Meaning::Gyro {
                rank: 0,
                unit: Some(GyroUnit::Rad)
            })
        );
        for name in ["magnetic_field", "mag", "magnetometer_ga", "mag_uT"] {
            assert_eq!(meaning(name), Some(Meaning::Mag), "{name}");
        }
        for name in ["my", "mag_y", "ymag", "magnetometer_y_uT"] {
            assert_eq!(meaning(name), Some(Meaning::MagAxis { axis: 1 }), "{name}");
        }
        let stamp = |rank, unit| Some(Meaning::Stamp { rank, unit });
        assert_eq!(meaning("timestamp_us"), stamp(1, TimeUnit::Micro));
        assert_eq!(meaning("t_ns"), stamp(3, TimeUnit::Nano));
        assert_eq!(meaning("time"), stamp(2, TimeUnit::ByMagnitude));
        for name in ["temperature", "temp_c", "gyro_temperature", "imu_temp"] {
            assert_eq!(meaning(name), Some(Meaning::Temperature), "{name}");
        }
    }

    #[test]
    fn names_that_only_look_alike_mean_nothing() {
        for name in [
            "angular_velocity_covariance",
            "temperature_k",
            "accel_temperature",
            "gyro_clipping",
            "gyro_device_id",
            "gyro_bias_x",
            "accelerometer_timestamp_relative",
            "xyz",
            "magnitude",
            "magnetic_declination",
            "mag_device_id",
            "template",
            "timestamp_valid",
            "tag",
            "stamped",
            "gyro_xy",
            "angular",
            "velocity",
            "",
            "___",
            "timezone",
            "accuracy",
        ] {
            assert_eq!(meaning(name), None, "{name}");
        }
        assert_eq!(meaning(&"gyro".repeat(20)), None);
        assert_eq!(px4("px4_msgs/msg/VehicleAcceleration"), None);
        assert_eq!(px4("px4.vehicle_imu"), Some(Px4::VehicleImu));
    }
}
