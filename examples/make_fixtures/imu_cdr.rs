//! One IMU sample -> the bytes of a ROS 2 message. Pure.
//!
//! A stage of its own because both generators write it, and because it is written from the CDR rules
//! and not with this project's own encoder: a reader checked against it is not checked against itself.

/// One sample in SI units and sensor axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct ImuSample {
    /// Nanoseconds since the epoch.
    pub(crate) stamp: i64,
    /// Sensor to world `[w, x, y, z]`; `None` marks the field as absent (covariance -1).
    pub(crate) orientation: Option<[f64; 4]>,
    /// Body rate, rad/s.
    pub(crate) gyro: [f64; 3],
    /// Element 0 of the rate's covariance: 0 unknown, -1 "there is no gyro".
    pub(crate) gyro_covariance_0: f64,
    /// Specific force, m/s^2.
    pub(crate) accel: [f64; 3],
}

impl ImuSample {
    /// The 37 numbers of a `sensor_msgs/Imu` in wire order: orientation x, y, z, w and its covariance,
    /// rate and covariance, specific force and covariance.
    pub(crate) fn numbers(&self) -> [f64; 37] {
        let mut numbers = [0.0; 37];
        let [w, x, y, z] = self.orientation.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        numbers[..4].copy_from_slice(&[x, y, z, w]);
        numbers[4] = if self.orientation.is_some() {
            0.0
        } else {
            -1.0
        };
        numbers[13..16].copy_from_slice(&self.gyro);
        numbers[16] = self.gyro_covariance_0;
        numbers[25..28].copy_from_slice(&self.accel);
        numbers
    }
}

/// `sensor_msgs/msg/Imu`, CDR little endian: 324 bytes when the frame is called `imu_link`.
pub(crate) fn imu_message(frame_id: &str, sample: &ImuSample) -> Vec<u8> {
    cdr_message(sample.stamp, frame_id, &sample.numbers())
}

/// A header, then doubles: the shape of every message written here.
pub(crate) fn cdr_message(stamp: i64, frame_id: &str, numbers: &[f64]) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0]; // encapsulation: plain CDR, little endian
    bytes.extend((stamp.div_euclid(1_000_000_000) as i32).to_le_bytes());
    bytes.extend((stamp.rem_euclid(1_000_000_000) as u32).to_le_bytes());
    bytes.extend((frame_id.len() as u32 + 1).to_le_bytes());
    bytes.extend(frame_id.as_bytes());
    bytes.push(0);
    // Doubles stand on multiples of eight, counted from behind the encapsulation.
    while bytes.len() % 8 != 4 {
        bytes.push(0);
    }
    for number in numbers {
        bytes.extend(number.to_le_bytes());
    }
    bytes
}

/// A message definition as rosbag2 stores it: the type's own lines, then each type it needs under a
/// rule of 80 equals signs.
pub(crate) fn definition(fields: &str, needs: &[(&str, &str)]) -> String {
    let mut text = fields.to_owned();
    for (name, fields) in needs {
        text.push_str(&format!("{}\nMSG: {name}\n{fields}", "=".repeat(80)));
    }
    text
}

pub(crate) const HEADER: (&str, &str) = (
    "std_msgs/Header",
    "builtin_interfaces/Time stamp\nstring frame_id\n",
);
pub(crate) const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
pub(crate) const VECTOR3: (&str, &str) =
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
pub(crate) const QUATERNION: (&str, &str) = (
    "geometry_msgs/Quaternion",
    "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
);

/// Fields of `sensor_msgs/msg/Imu`.
pub(crate) const IMU_FIELDS: &str = "\
std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
";

/// The definition of `sensor_msgs/msg/Imu`.
pub(crate) fn imu_definition() -> String {
    definition(IMU_FIELDS, &[HEADER, TIME, QUATERNION, VECTOR3])
}

/// Quality of service that `rosbag2` writes beside a channel, so that `ros2 bag play` offers the topic as a driver
/// would: best effort, volatile, keep last 10.
pub(crate) const SENSOR_DATA_QOS: &str = "\
- history: 1
  depth: 10
  reliability: 2
  durability: 2
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
";
