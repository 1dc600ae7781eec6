//! The schemas our messages are described by, and the quality of service of our topics. Pure.
//!
//! Field names and types are those of the public ROS 2 interfaces (sensor_msgs, geometry_msgs,
//! std_msgs, tf2_msgs, builtin_interfaces) and of Foxglove's FrameTransform; concatenated as rosbag2 does.

/// Separator of two message definitions: 80 equal signs on a line of their own, then the next one's name.
macro_rules! next {
    ($name:literal) => {
        concat!(
            "\n",
            "====================",
            "====================",
            "====================",
            "====================",
            "\nMSG: ",
            $name,
            "\n"
        )
    };
}

macro_rules! header {
    () => {
        concat!(
            next!("std_msgs/Header"),
            "builtin_interfaces/Time stamp\nstring frame_id\n",
            next!("builtin_interfaces/Time"),
            "int32 sec\nuint32 nanosec\n",
        )
    };
}

macro_rules! quaternion {
    () => {
        concat!(
            next!("geometry_msgs/Quaternion"),
            "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
        )
    };
}

macro_rules! vector {
    () => {
        concat!(
            next!("geometry_msgs/Vector3"),
            "float64 x\nfloat64 y\nfloat64 z\n"
        )
    };
}

/// `sensor_msgs/msg/Imu`, as `ros2msg`.
#[rustfmt::skip]
pub(super) const IMU: &str = concat!(
    "# Orientation: frame_id relative to the world; covariance about the axes of frame_id, rad^2.\n",
    "# Angular velocity in rad/s, specific force in m/s^2, both along the axes of frame_id.\n",
    "# Covariance row-major; all zeros: unknown; -1 as its first element: the quantity is absent.\n",
    "std_msgs/Header header\n",
    "geometry_msgs/Quaternion orientation\n",
    "float64[9] orientation_covariance\n",
    "geometry_msgs/Vector3 angular_velocity\n",
    "float64[9] angular_velocity_covariance\n",
    "geometry_msgs/Vector3 linear_acceleration\n",
    "float64[9] linear_acceleration_covariance\n",
    header!(), quaternion!(), vector!(),
);

/// `sensor_msgs/msg/MagneticField`, as `ros2msg`.
#[rustfmt::skip]
pub(super) const MAGNETIC_FIELD: &str = concat!(
    "# Field in tesla along the axes of frame_id. Covariance row-major; all zeros: unknown.\n",
    "std_msgs/Header header\n",
    "geometry_msgs/Vector3 magnetic_field\n",
    "float64[9] magnetic_field_covariance\n",
    header!(), vector!(),
);

/// `tf2_msgs/msg/TFMessage`, as `ros2msg`.
#[rustfmt::skip]
pub(super) const TF_MESSAGE: &str = concat!(
    "geometry_msgs/TransformStamped[] transforms\n",
    next!("geometry_msgs/TransformStamped"),
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    next!("geometry_msgs/Transform"),
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    header!(), vector!(), quaternion!(),
);

/// `geometry_msgs/msg/QuaternionStamped`, as `ros2msg`.
#[rustfmt::skip]
pub(super) const QUATERNION_STAMPED: &str = concat!(
    "# Rotates body components to components of frame_id.\n",
    "std_msgs/Header header\n",
    "geometry_msgs/Quaternion quaternion\n",
    header!(), quaternion!(),
);

/// `geometry_msgs/msg/Vector3Stamped`, as `ros2msg`.
#[rustfmt::skip]
pub(super) const VECTOR3_STAMPED: &str = concat!(
    "# Along the axes of frame_id.\n",
    "std_msgs/Header header\n",
    "geometry_msgs/Vector3 vector\n",
    header!(), vector!(),
);

/// `geometry_msgs/msg/AccelWithCovarianceStamped`, as `ros2msg`.
#[rustfmt::skip]
pub(super) const ACCEL_WITH_COVARIANCE_STAMPED: &str = concat!(
    "# Without gravity, along the axes of frame_id. The angular part is not known: NaN.\n",
    "std_msgs/Header header\n",
    "geometry_msgs/AccelWithCovariance accel\n",
    header!(), vector!(),
    "================================================================================\n",
    "MSG: geometry_msgs/AccelWithCovariance\n",
    "geometry_msgs/Accel accel\n",
    "float64[36] covariance\n",
    "================================================================================\n",
    "MSG: geometry_msgs/Accel\n",
    "geometry_msgs/Vector3 linear\n",
    "geometry_msgs/Vector3 angular\n",
);

/// `foxglove.FrameTransform`, as `jsonschema`.
pub(super) const FRAME_TRANSFORM: &str = r#"{"title":"foxglove.FrameTransform","description":"Orientation of the child frame in the parent frame","type":"object","properties":{"timestamp":{"type":"object","title":"time","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer","minimum":0,"maximum":999999999}},"required":["sec","nsec"]},"parent_frame_id":{"type":"string"},"child_frame_id":{"type":"string"},"translation":{"type":"object","title":"foxglove.Vector3","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}},"required":["x","y","z"]},"rotation":{"type":"object","title":"foxglove.Quaternion","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}},"required":["x","y","z","w"]}},"required":["timestamp","parent_frame_id","child_frame_id","translation","rotation"]}"#;

/// Our `ATT` object, as `jsonschema`.
pub(super) const ATTITUDE: &str = r#"{"title":"strapd.Attitude","description":"Attitude of a body (Hamilton quaternion, rotates body components to world components), its rate in rad/s, one standard deviation about each body axis in degrees","type":"object","properties":{"class":{"const":"ATT"},"id":{"type":"string"},"seq":{"type":"integer","minimum":0},"stamp":{"type":"object","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer","minimum":0,"maximum":999999999}},"required":["sec","nsec"]},"q":{"type":"object","properties":{"w":{"type":"number"},"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}},"required":["w","x","y","z"]},"rotates":{"type":"string"},"world":{"type":"string"},"body":{"type":"string"},"rate":{"type":"array","items":{"type":["number","null"]},"minItems":3,"maxItems":3},"sigma_deg":{"type":"array","items":{"type":["number","null"]},"minItems":3,"maxItems":3},"status":{"type":"array","items":{"type":"string"}},"reset":{"type":"integer","minimum":0},"linear_acceleration":{"type":"array","items":{"type":["number","null"]},"minItems":3,"maxItems":3},"sigma_linear_acceleration":{"type":"array","items":{"type":["number","null"]},"minItems":3,"maxItems":3},"world_linear_acceleration":{"type":"array","items":{"type":["number","null"]},"minItems":3,"maxItems":3}},"required":["class","id","seq","stamp","q","rotates","world","body","rate","sigma_deg","status","reset"]}"#;

/// Reliable, volatile, keep the last 10: without it `ros2 bag play` guesses.
///
/// Numbers, not names: rosbag2 up to Humble reads only numbers. Later ones read numbers when a
/// metadata record `rosbag2` without `serialized_metadata` says that the file is in the older form
/// (rosbag2_storage_mcap, `read_metadata`): see [`ROSBAG2_FORM`].
pub(super) const OFFERED_QOS: &str = "- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n  deadline:\n    sec: 9223372036\n    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n  avoid_ros_namespace_conventions: false";

/// Key and value of the metadata record `rosbag2`: which distribution's conventions the file
/// follows (not which one wrote it; that is in the header and in the record `strapd`).
pub(super) const ROSBAG2_FORM: (&str, &str) = ("ROS_DISTRO", "humble");
