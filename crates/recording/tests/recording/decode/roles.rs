//! Channels that are taken for an IMU, and those that never are.

use super::channel;
use strapd_recording::decode::{Channel, Rank, Role, role};

fn role_of(topic: &str, type_name: &str, schema: &str) -> Role {
    role(
        &Channel {
            topic,
            ..channel("cdr", type_name, schema)
        },
        None,
    )
}

#[test]
fn imus_come_before_processed_rates_before_vectors_before_twists() {
    let rank = |topic: &str, name: &str| {
        let role = role_of(topic, name, "");
        assert!(role.has_rate, "{name}");
        role.rank
    };
    assert_eq!(rank("/a", "sensor_msgs/msg/Imu"), Rank::Imu);
    assert_eq!(rank("/a", "px4_msgs/msg/SensorCombined"), Rank::Imu);
    assert_eq!(rank("/a", "px4_msgs/msg/VehicleImu"), Rank::Processed);
    assert_eq!(
        rank("/a", "px4_msgs/msg/VehicleAngularVelocity"),
        Rank::RateByTopic
    );
    assert_eq!(
        rank("vehicle_imu/0", "px4_msgs/msg/VehicleImu"),
        Rank::Processed
    );
    assert_eq!(
        rank("vehicle_imu/1", "px4_msgs/msg/VehicleImu"),
        Rank::RateByTopic
    );
    assert_eq!(
        rank("/imu/angular_velocity", "geometry_msgs/msg/Vector3Stamped"),
        Rank::RateByTopic
    );
    assert_eq!(rank("/a", "geometry_msgs/msg/Vector3Stamped"), Rank::Weak);
    assert_eq!(rank("/a", "geometry_msgs/msg/TwistStamped"), Rank::Weak);
    assert_eq!(rank("/odom", "nav_msgs/msg/Odometry"), Rank::ByNameOnly);
    assert!(
        Rank::Imu < Rank::Processed
            && Rank::RateByTopic < Rank::Weak
            && Rank::Weak < Rank::ByNameOnly
    );
}

#[test]
fn vectors_that_are_something_else_are_never_taken() {
    for topic in [
        "/imu/mag",
        "/imu/acceleration",
        "/filter/euler",
        "/filter/velocity",
        "/imu/dv",
        "/gyro_bias",
        "/wind",
        "/cmd_rate",
        "/Magnetometer",
    ] {
        assert!(
            !role_of(topic, "geometry_msgs/msg/Vector3Stamped", "").is_automatic(),
            "{topic}"
        );
    }
    for (name, text) in [
        (
            "geometry_msgs/msg/AccelStamped",
            "std_msgs/Header header\nAccel accel\n=====\nMSG: geometry_msgs/Accel\nVector3 linear\nVector3 angular\n=====\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z",
        ),
        (
            "mavros_msgs/msg/AttitudeTarget",
            "builtin_interfaces/Time stamp\nfloat64[3] body_rate",
        ),
        ("a/msg/Bare", "float64[3] gyro"),
        (
            "a/msg/Links",
            "builtin_interfaces/Time stamp\nTwist[] twist\n=====\nMSG: a/Twist\nfloat64[3] linear\nfloat64[3] angular",
        ),
        (
            "sensor_msgs/msg/MagneticField",
            "builtin_interfaces/Time stamp\nfloat64[3] magnetic_field",
        ),
    ] {
        assert!(!role_of("/a", name, text).is_automatic(), "{name}");
    }
}

#[test]
fn orientations_are_offered_as_references() {
    for name in [
        "geometry_msgs/msg/QuaternionStamped",
        "tf2_msgs/msg/TFMessage",
        "nav_msgs/msg/Odometry",
        "px4_msgs/msg/VehicleAttitude",
        "sensor_msgs/msg/Imu",
    ] {
        assert!(role_of("/a", name, "").has_orientation, "{name}");
    }
    assert!(!role_of("/a", "geometry_msgs/msg/TwistStamped", "").has_orientation);
}

#[test]
fn json_shows_what_it_is_in_its_first_message_or_its_schema() {
    let bare = channel("json", "my.Type", "");
    assert!(!role(&bare, None).has_rate, "nothing is known yet");
    let first = br#"{"t_ns":1,"gyro":[1,2,3]}"#;
    let seen = role(&bare, Some((first, super::LOG)));
    assert!(seen.is_automatic() && seen.rank == Rank::Imu);
    let schema = r#"{"type":"object","properties":{"t_ns":{"type":"number"},"gyro":{"type":"array","items":{"type":"number"}}}}"#;
    assert!(role(&channel("json", "my.Type", schema), None).is_automatic());
    let odometry = br#"{"header":{"stamp":{"sec":1,"nsec":2}},"twist":{"twist":{"angular":{"x":1,"y":2,"z":3}}}}"#;
    assert!(
        !role(
            &channel("json", "nav_msgs/Odometry", "{}"),
            Some((odometry, super::LOG))
        )
        .is_automatic()
    );
    let twist = role(
        &channel("json", "geometry_msgs/TwistStamped", "{}"),
        Some((odometry, super::LOG)),
    );
    assert_eq!((twist.has_rate, twist.rank), (true, Rank::Weak));
}
