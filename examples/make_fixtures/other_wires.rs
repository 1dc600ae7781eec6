//! One IMU sample -> the bytes of a ROS 1 message, or of a JSON object. Pure.
//!
//! A stage of its own because these two carry the same numbers as `imu_cdr` by other rules: readers of the
//! three must agree.

use super::imu_cdr::{IMU_FIELDS, ImuSample, QUATERNION, VECTOR3, definition};

/// `sensor_msgs/Imu`, ROS 1: no alignment, no terminating zero, a sequence number in the header.
pub(crate) fn ros1_message(sequence: u32, frame_id: &str, sample: &ImuSample) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(320);
    bytes.extend(sequence.to_le_bytes());
    bytes.extend((sample.stamp.div_euclid(1_000_000_000) as u32).to_le_bytes());
    bytes.extend((sample.stamp.rem_euclid(1_000_000_000) as u32).to_le_bytes());
    bytes.extend((frame_id.len() as u32).to_le_bytes());
    bytes.extend(frame_id.as_bytes());
    for number in sample.numbers() {
        bytes.extend(number.to_le_bytes());
    }
    bytes
}

/// The definition of ROS 1's `sensor_msgs/Imu`.
pub(crate) fn ros1_definition() -> String {
    let header = (
        "std_msgs/Header",
        "uint32 seq\ntime stamp\nstring frame_id\n",
    );
    let quaternion = (QUATERNION.0, "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n");
    definition(IMU_FIELDS, &[header, quaternion, VECTOR3])
}

/// A JSON object with ROS field names. Rust prints a double so that it reads back to the same bits.
pub(crate) fn json_message(frame_id: &str, sample: &ImuSample) -> Vec<u8> {
    let [gx, gy, gz] = sample.gyro;
    let [ax, ay, az] = sample.accel;
    format!(
        concat!(
            r#"{{"header":{{"stamp":{{"sec":{},"nanosec":{}}},"frame_id":"{}"}},"#,
            r#""angular_velocity":{{"x":{:?},"y":{:?},"z":{:?}}},"#,
            r#""linear_acceleration":{{"x":{:?},"y":{:?},"z":{:?}}}}}"#
        ),
        sample.stamp.div_euclid(1_000_000_000),
        sample.stamp.rem_euclid(1_000_000_000),
        frame_id,
        gx,
        gy,
        gz,
        ax,
        ay,
        az
    )
    .into_bytes()
}

/// JSON Schema of [`json_message`].
pub(crate) const JSON_SCHEMA: &str = r##"{
  "type": "object",
  "title": "sensor_msgs/Imu",
  "properties": {
    "header": {
      "type": "object",
      "properties": {
        "stamp": {
          "type": "object",
          "properties": { "sec": { "type": "integer" }, "nanosec": { "type": "integer" } }
        },
        "frame_id": { "type": "string" }
      }
    },
    "angular_velocity": { "$ref": "#/$defs/vector" },
    "linear_acceleration": { "$ref": "#/$defs/vector" }
  },
  "$defs": {
    "vector": {
      "type": "object",
      "properties": { "x": { "type": "number" }, "y": { "type": "number" }, "z": { "type": "number" } }
    }
  }
}
"##;
