//! Names of columns, as makers write them.

use super::*;

fn meant(text: &str) -> (Option<(Kind, usize)>, Option<&'static str>) {
    let name = Name::of(text.as_bytes());
    let unit = name.unit.and_then(Result::ok).and_then(Unit::name);
    match name.meant {
        Meant::Part { kind, part, .. } => (Some((kind, part)), unit),
        _ => (None, unit),
    }
}

#[test]
fn names_of_many_makers_say_the_same() {
    use Kind::{Accel, Gyro, Mag, Matrix, Orientation, Push, Turn};
    for (text, kind, part, unit) in [
        ("gyro_x", Gyro, 0, None),
        ("Gyr_Y", Gyro, 1, None),
        ("GyroZ", Gyro, 2, None),
        ("wx", Gyro, 0, None),
        ("gy", Gyro, 1, None),
        ("Gyroscope z (rad/s)", Gyro, 2, Some("rad/s")),
        ("Gyroscope X (deg/s)", Gyro, 0, Some("deg/s")),
        ("w_RS_S_x [rad s^-1]", Gyro, 0, Some("rad/s")),
        ("angular_velocity.y", Gyro, 1, None),
        ("gyroADC[2]", Gyro, 2, None),
        ("gyroADC[0] (deg/s)", Gyro, 0, Some("deg/s")),
        ("Shimmer_B663_Gyro_X_CAL", Gyro, 0, None),
        ("gyroRotationY(rad/s)", Gyro, 1, Some("rad/s")),
        ("gyro_x_dps", Gyro, 0, Some("deg/s")),
        ("gyro_z_rad_s", Gyro, 2, Some("rad/s")),
        ("gyro_dps_x", Gyro, 0, Some("deg/s")),
        ("a_RS_S_y [m s^-2]", Accel, 1, Some("m/s2")),
        ("Acc_X", Accel, 0, None),
        ("acc_z_g", Accel, 2, Some("g")),
        ("acc_x_m_s2", Accel, 0, Some("m/s2")),
        ("Accelerometer X (g)", Accel, 0, Some("g")),
        ("gFx", Accel, 0, None),
        ("Mag_Z", Mag, 2, None),
        ("Magnetic field x (µT)", Mag, 0, Some("ut")),
        ("mag_x_mT", Mag, 0, Some("mt")),
        ("By", Mag, 1, None),
        ("Quat_w", Orientation, 0, None),
        ("Quat_q3", Orientation, 3, None),
        ("qz", Orientation, 3, None),
        ("q_RS_x []", Orientation, 1, None),
        ("W Element", Orientation, 0, None),
        ("orientation.w", Orientation, 0, None),
        ("Mat[2][3]", Matrix, 5, None),
        ("dq_W", Turn, 0, None),
        ("dQ_Z", Turn, 3, None),
        ("OriInc_q2", Turn, 2, None),
        ("OriInc_w", Turn, 0, None),
        ("dv[1]", Push, 0, None),
        ("VelInc_Z", Push, 2, None),
    ] {
        assert_eq!(meant(text), (Some((kind, part)), unit), "{text}");
    }
}

#[test]
fn what_only_sounds_like_a_measurement_is_none() {
    for text in [
        "b_w_RS_S_x [rad s^-1]",
        "p_RS_R_x [m]",
        "gravity_x",
        "gyro_bias_x",
        "angular_acceleration_x",
        "Euler_X",
        "w",
        "x",
        "q0",
        "status",
        "baro_temperature",
        "",
        "axisP[0]",
    ] {
        assert_eq!(meant(text).0, None, "{text}");
    }
    for text in [
        "Linear Acceleration x (m/s^2)",
        "userAcceleration_x",
        "FreeAcc_X",
        "gyro_raw_x",
    ] {
        let name = Name::of(text.as_bytes());
        assert!(
            matches!(name.meant, Meant::Aside { .. }),
            "{text}: {name:?}"
        );
    }
}

#[test]
fn stamps_are_known_with_their_units() {
    for (text, unit) in [
        ("#timestamp [ns]", Some("ns")),
        ("time", None),
        ("t", None),
        ("Time (s)", Some("s")),
        ("Timestamp (us)", Some("us")),
        ("seconds_elapsed", Some("s")),
        ("time_ms", Some("ms")),
        ("millis", Some("ms")),
        ("SampleTimeFine", None),
        ("Shimmer_B663_Timestamp_Unix_CAL", None),
        ("timestampNanos", Some("ns")),
        ("GPS_TOW", None),
        ("iTOW [ms]", Some("ms")),
        ("TimeOfWeek (s)", Some("s")),
    ] {
        let name = Name::of(text.as_bytes());
        assert_eq!(name.meant, Meant::Stamp, "{text}");
        let said = name.unit.and_then(Result::ok).and_then(Unit::name);
        assert_eq!(said, unit, "{text}");
    }
    for text in [
        "second",
        "UTC_Second",
        "loggingTime(txt)",
        "datetime",
        "accelerometerTimestamp(s)",
    ] {
        assert_ne!(Name::of(text.as_bytes()).meant, Meant::Stamp, "{text}");
    }
}
