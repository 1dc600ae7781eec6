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

/// The definition of a well-known message as `ros2msg`, for who reads what is made of a recording that has none. The
/// types of px4_msgs have none here: they change between releases.
pub(crate) fn definition(ros_name: &str) -> Option<String> {
    let fields_of = |wanted: &str| {
        let mut known = LAYOUTS.iter();
        let found = known.find(|(name, _)| *name == wanted);
        found.map(|(_, fields)| *fields)
    };
    let root = fields_of(ros_name).filter(|_| !ros_name.starts_with("px4_msgs/"))?;
    let mut text = root.replace(';', "\n");
    text.push('\n');
    let package = |name: &str| name.split('/').next().unwrap_or_default().to_owned();
    let mut open = vec![(package(ros_name), root)];
    let mut told = Vec::new();
    while let Some((own, fields)) = open.pop() {
        for field in fields.split(';') {
            let kind = field.trim().split([' ', '[']).next().unwrap_or_default();
            let name = match kind.contains('/') {
                true => kind.to_owned(),
                false => format!("{own}/{kind}"),
            };
            let inner = match name.as_str() {
                "builtin_interfaces/Time" => Some("int32 sec;uint32 nanosec"),
                name => fields_of(name),
            };
            let Some(inner) = inner.filter(|_| !told.contains(&name)) else {
                continue;
            };
            text.push_str(&format!("{:=<80}\nMSG: {name}\n", ""));
            text.push_str(&inner.replace(';', "\n"));
            text.push('\n');
            open.push((package(&name), inner));
            told.push(name);
        }
    }
    Some(text)
}

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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_definition_told_to_others_is_the_layout_it_was_made_of() {
        for (name, _) in LAYOUTS.iter().filter(|(name, _)| !name.starts_with("px4")) {
            let own = schema(name, Dialect::Ros2).unwrap();
            let told = parse(&definition(name).unwrap(), name, Dialect::Ros2).unwrap();
            let flat = |schema: &Schema| {
                let mut open = vec![schema.root];
                let mut found = Vec::new();
                while let Some(at) = open.pop() {
                    for field in &schema.get(at).unwrap().fields {
                        let kind = match field.kind {
                            super::super::Kind::Struct(inner) => {
                                open.push(inner);
                                None
                            }
                            kind => Some(kind),
                        };
                        found.push((field.name.clone(), kind, field.many));
                    }
                }
                found
            };
            assert_eq!(flat(&told), flat(&own), "{name}");
        }
        assert_eq!(definition("px4_msgs/VehicleImu"), None);
        assert_eq!(definition("std_msgs/String"), None);
    }
}
