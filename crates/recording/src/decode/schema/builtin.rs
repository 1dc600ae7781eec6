//! Layouts of the well-known messages, for channels whose schema text is empty. Pure.
//!
//! Layouts are facts of the published interfaces (common_interfaces, geometry2, px4_msgs), written
//! here in our own one-line form; a test compares them with the schema texts of recordings.
//! px4_msgs changes between releases: a payload of another release has another length and is refused.

use super::Schema;
use super::rosmsg::{Dialect, parse};

/// `name: fields`, separated by semicolons; every type used is defined in the table or primitive.
const LAYOUTS: &[(&str, &str)] = &[
    (
        "std_msgs/Header",
        "builtin_interfaces/Time stamp;string frame_id",
    ),
    ("geometry_msgs/Vector3", "float64 x;float64 y;float64 z"),
    ("geometry_msgs/Point", "float64 x;float64 y;float64 z"),
    (
        "geometry_msgs/Quaternion",
        "float64 x;float64 y;float64 z;float64 w",
    ),
    (
        "geometry_msgs/Pose",
        "Point position;Quaternion orientation",
    ),
    (
        "geometry_msgs/PoseWithCovariance",
        "Pose pose;float64[36] covariance",
    ),
    ("geometry_msgs/Twist", "Vector3 linear;Vector3 angular"),
    (
        "geometry_msgs/TwistWithCovariance",
        "Twist twist;float64[36] covariance",
    ),
    (
        "geometry_msgs/Transform",
        "Vector3 translation;Quaternion rotation",
    ),
    (
        "sensor_msgs/Imu",
        "std_msgs/Header header;geometry_msgs/Quaternion orientation;float64[9] orientation_covariance;\
         geometry_msgs/Vector3 angular_velocity;float64[9] angular_velocity_covariance;\
         geometry_msgs/Vector3 linear_acceleration;float64[9] linear_acceleration_covariance",
    ),
    (
        "sensor_msgs/MagneticField",
        "std_msgs/Header header;geometry_msgs/Vector3 magnetic_field;float64[9] magnetic_field_covariance",
    ),
    (
        "geometry_msgs/Vector3Stamped",
        "std_msgs/Header header;Vector3 vector",
    ),
    (
        "geometry_msgs/TwistStamped",
        "std_msgs/Header header;Twist twist",
    ),
    (
        "geometry_msgs/TwistWithCovarianceStamped",
        "std_msgs/Header header;TwistWithCovariance twist",
    ),
    (
        "geometry_msgs/QuaternionStamped",
        "std_msgs/Header header;Quaternion quaternion",
    ),
    (
        "geometry_msgs/PoseStamped",
        "std_msgs/Header header;Pose pose",
    ),
    (
        "geometry_msgs/PoseWithCovarianceStamped",
        "std_msgs/Header header;PoseWithCovariance pose",
    ),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header;string child_frame_id;Transform transform",
    ),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header;string child_frame_id;geometry_msgs/PoseWithCovariance pose;\
         geometry_msgs/TwistWithCovariance twist",
    ),
    (
        "tf2_msgs/TFMessage",
        "geometry_msgs/TransformStamped[] transforms",
    ),
    (
        "tf/tfMessage",
        "geometry_msgs/TransformStamped[] transforms",
    ),
    (
        "px4_msgs/SensorCombined",
        "uint64 timestamp;float32[3] gyro_rad;uint32 gyro_integral_dt;\
         int32 accelerometer_timestamp_relative;float32[3] accelerometer_m_s2;\
         uint32 accelerometer_integral_dt;uint8 accelerometer_clipping;uint8 gyro_clipping;\
         uint8 accel_calibration_count;uint8 gyro_calibration_count",
    ),
    (
        "px4_msgs/VehicleImu",
        "uint64 timestamp;uint64 timestamp_sample;uint32 accel_device_id;uint32 gyro_device_id;\
         float32[3] delta_angle;float32[3] delta_velocity;uint32 delta_angle_dt;uint32 delta_velocity_dt;\
         uint8 delta_angle_clipping;uint8 delta_velocity_clipping;uint8 accel_calibration_count;\
         uint8 gyro_calibration_count",
    ),
    (
        "px4_msgs/VehicleAngularVelocity",
        "uint64 timestamp;uint64 timestamp_sample;float32[3] xyz;float32[3] xyz_derivative",
    ),
    (
        "px4_msgs/VehicleAttitude",
        "uint64 timestamp;uint64 timestamp_sample;float32[4] q;float32[4] delta_q_reset;\
         uint8 quat_reset_counter",
    ),
];

/// The layout of a well-known message, by its `pkg/Type` name.
pub(crate) fn schema(ros_name: &str, dialect: Dialect) -> Option<Schema> {
    let (_, root) = LAYOUTS.iter().find(|(name, _)| *name == ros_name)?;
    let mut text = root.replace(';', "\n");
    for (name, fields) in LAYOUTS.iter().filter(|(name, _)| *name != ros_name) {
        text.push_str("\n=====\nMSG: ");
        text.push_str(name);
        if dialect == Dialect::Ros1 && *name == "std_msgs/Header" {
            text.push_str("\nuint32 seq\ntime stamp\nstring frame_id");
            continue;
        }
        text.push('\n');
        text.push_str(&fields.replace(';', "\n"));
    }
    parse(&text, ros_name, dialect).ok()
}
