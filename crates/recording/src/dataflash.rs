//! Logs of ArduPilot's flight controllers (DataFlash, `.BIN`) -> the records MCAP has for them. Pure.
//!
//! A stage of its own because such a log says itself how its messages lie (FMT), and samples are looked for by the names of
//! its columns.
//!
//! ```text
//! bytes -> message (marks, type) -> layout (its FMT) -> transcriber (samples in SI, x forward, y left, z up; what was lost)
//! ```
//!
//! | message | what it becomes |
//! |---|---|
//! | `IMU`, `IMU2`, `IMU3`, by instance `I` | `sensor_msgs/msg/Imu`: rad/s, m/s^2 |
//! | `MAG`, `MAG2`, `MAG3`, by instance `I` | `sensor_msgs/msg/MagneticField`: T, less the offsets that the controller knew |
//! | `ATT` | `geometry_msgs/msg/QuaternionStamped`: what the controller took its attitude for |
//!
//! Layout: ardupilot.org, "Code Overview: Adding a New Log Message"; `libraries/AP_Logger/LogStructure.h`.

mod layout;
mod sample;
mod transcriber;

pub(crate) use transcriber::Transcriber;

/// First bytes: the marks of a message, and the type of those that say how others lie.
pub(crate) const MAGIC: [u8; 3] = [0xa3, 0x95, 0x80];
