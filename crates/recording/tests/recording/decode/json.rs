//! JSON against texts made by hand.

use super::{LOG, channel, decode, decode_one, options};
use strapd_attitude::record::{Nanos, SampleKind};
use strapd_recording::decode::{
    Class, Decoder, GyroUnit, LineDecoder, MAX_LINE, Options, decode_line,
};

const GYRO: [f64; 3] = [1.5, -2.5, 0.1];

fn decoder(type_name: &str) -> Decoder {
    Decoder::compile(&channel("json", type_name, "{}"), &Options::default()).unwrap()
}

#[test]
fn a_body_rate_is_found_under_every_name_and_shape() {
    let decoder = decoder("");
    for body in [
        r#""angular_velocity":{"x":1.5,"y":-2.5,"z":0.1}"#,
        r#""angularVelocity":{"z":0.1,"y":-2.5,"x":1.5,"note":["a",{}]}"#,
        r#""gyro":[1.5,-2.5,0.1]"#,
        r#""gyroscope":{"report":{"sequence":3},"vec":{"x":1.5,"y":-2.5,"z":1e-1}}"#,
        r#""gyro_x":1.5,"gyro_y":-2.5,"gyro_z":0.1"#,
        r#""xgyro":1.5,"ygyro":-2.5,"zgyro":0.1,"gx":9,"gy":9,"gz":9"#,
        r#""gx":9,"gy":9,"gz":9,"gyro_x":1.5,"gyro_y":-2.5,"gyro_z":0.1"#,
        r#""imu":{"data":{"gyro":[1.5,-2.5,0.1]}}"#,
        r#""twist":{"linear":{"x":9,"y":9,"z":9},"angular":{"x":1.5,"y":-2.5,"z":0.1}}"#,
        r#""a\u006egular_velocity":[1.5,-2.5,0.1]"#,
    ] {
        let text = format!(
            r#"{{"before":[[{{"gyro":0}}],"\"}}"],{body},"stamp":{{"sec":1,"nsec":2}},"after":null}}"#
        );
        let sample = decode_one(&decoder, text.as_bytes());
        assert_eq!(sample.gyro, Some(GYRO), "{text}");
        assert_eq!(sample.header, Some(Nanos(1_000_000_002)), "{text}");
    }
}

#[test]
fn the_messages_own_stamp_comes_before_a_nested_one() {
    let decoder = decoder("");
    let header = |sec| format!(r#""header":{{"stamp":{{"sec":{sec},"nsec":0}}}}"#);
    for (text, sec) in [
        (
            format!(
                r#"{{{},"imu":{{{},"gyro":[1,2,3]}}}}"#,
                header(1),
                header(2)
            ),
            1,
        ),
        (
            format!(
                r#"{{"imu":{{"gyro":[1,2,3],{}}},{}}}"#,
                header(2),
                header(1)
            ),
            1,
        ),
        (
            format!(
                r#"{{{},"imu":{{"gyro":[1,2,3]}},"other":{{{}}}}}"#,
                header(1),
                header(9)
            ),
            1,
        ),
        (
            format!(
                r#"{{{},"imu":{{{},"gyro":[1,2,3]}},"gyro":[4,5,6]}}"#,
                header(1),
                header(2)
            ),
            1,
        ),
    ] {
        let stamp = decode_one(&decoder, text.as_bytes()).header;
        assert_eq!(stamp, Some(Nanos(sec * 1_000_000_000)), "{text}");
    }
}

#[test]
fn a_stamp_is_read_in_every_notation_to_the_nanosecond() {
    let decoder = decoder("");
    for stamp in [
        r#""header":{"stamp":{"sec":1700000000,"nanosec":123456789},"frame_id":"f"}"#,
        r#""header":{"seq":1,"stamp":{"secs":1700000000,"nsecs":123456789}}"#,
        r#""stamp":{"sec":1700000000,"nsec":123456789}"#,
        r#""timestamp":{"seconds":"1700000000","nanos":123456789}"#,
        r#""stamp":{"sec":1699999999,"nsec":1123456789}"#,
        r#""stamp":1700000000123456789"#,
        r#""timestamp_ns":1700000000123456789"#,
        r#""time":1700000000.123456789"#,
        r#""time":"1700000000.123456789""#,
        r#""time":"2023-11-14T22:13:20.123456789Z""#,
        r#""t":1700000000123.456789"#,
        r#""timestamp_us":1700000000123456.789"#,
    ] {
        let sample = decode_one(
            &decoder,
            format!(r#"{{"gyro":[1,2,3],{stamp}}}"#).as_bytes(),
        );
        assert_eq!(
            sample.header,
            Some(Nanos(1_700_000_000_123_456_789)),
            "{stamp}"
        );
    }
    for (stamp, expected) in [
        ("0", Some(Nanos(0))),
        ("null", None),
        ("{}", None),
        ("\"soon\"", None),
        ("true", None),
    ] {
        let sample = decode_one(
            &decoder,
            format!(r#"{{"gyro":[1,2,3],"stamp":{stamp}}}"#).as_bytes(),
        );
        assert_eq!(sample.header, expected, "{stamp}");
    }
}

#[test]
fn null_is_absent_and_pythons_nan_is_not_finite() {
    let decoder = decoder("");
    let gyro = |text: &str| decode_one(&decoder, text.as_bytes()).gyro;
    for none in [
        r#"{"gyro":[1,null,3]}"#,
        r#"{"gyro":null}"#,
        r#"{"gyro":[1,2]}"#,
        r#"{"gyro":[1,2,3,4]}"#,
        r#"{"gyro":{"x":1,"y":2}}"#,
        r#"{"gyro":["1","2","3"]}"#,
        r#"{"gyro_x":1,"gyro_y":2}"#,
        "{}",
    ] {
        assert_eq!(gyro(none), None, "{none}");
    }
    let odd = gyro(r#"{"gyro":[NaN,-Infinity,1e999]}"#).unwrap();
    assert!(odd[0].is_nan() && odd[1] == f64::NEG_INFINITY && odd[2] == f64::INFINITY);
}

#[test]
fn null_is_as_if_its_key_were_not_there() {
    let decoder = LineDecoder::default().with_besides();
    let read = |text: &str| {
        let mut samples = Vec::new();
        let line = decoder.decode(text.as_bytes(), Nanos(7), &mut samples);
        (format!("{:?}", line.unwrap()), samples)
    };
    for (null, without) in [
        (
            r#"{"t":0.1,"gyro":null,"accel":[0,0,9.8]}"#,
            r#"{"t":0.1,"accel":[0,0,9.8]}"#,
        ),
        (
            r#"{"t":0.1,"gx":null,"gy":null,"gz": null,"mag":{"x":1,"y":2,"z":3}}"#,
            r#"{"t":0.1,"mag":{"x":1,"y":2,"z":3}}"#,
        ),
        (
            r#"{"t":0.1,"gyro":[1,2,3],"accel":null,"mag":null}"#,
            r#"{"t":0.1,"gyro":[1,2,3]}"#,
        ),
        (
            r#"[{"t":0.1,"gyro":null,"accel":[0,0,9.8]}]"#,
            r#"[{"t":0.1,"accel":[0,0,9.8]}]"#,
        ),
    ] {
        let (line, samples) = read(null);
        assert_eq!((&line, &samples), (&read(without).0, &read(without).1));
        assert_eq!(samples.len(), 1, "{null}");
        assert_eq!(samples[0].is_beside, samples[0].gyro.is_none(), "{null}");
    }
    // A rate that is there in part is one that is lost.
    for part in ["[null,1,2]", "[null,null,null]"] {
        let (_, samples) = read(&format!(r#"{{"t":0.1,"gyro":{part},"accel":[0,0,9.8]}}"#));
        assert!(!samples[0].is_beside, "{part}");
    }
}

#[test]
fn quaternions_are_taken_by_name_and_never_from_a_bare_array() {
    let decoder = decoder("");
    let read = |text: &str| decode_one(&decoder, text.as_bytes()).orientation;
    let q = Some([0.9, 0.1, 0.2, 0.3]);
    assert_eq!(
        read(r#"{"orientation":{"x":0.1,"y":0.2,"z":0.3,"w":0.9}}"#),
        q
    );
    assert_eq!(
        read(
            r#"{"pose":{"position":{"x":1,"y":2,"z":3},"orientation":{"w":0.9,"x":0.1,"y":0.2,"z":0.3}}}"#
        ),
        q
    );
    assert_eq!(
        read(
            r#"{"transforms":[{"child_frame_id":"a","rotation":{"w":0.9,"x":0.1,"y":0.2,"z":0.3}},{"rotation":{"w":1,"x":0,"y":0,"z":0}}]}"#
        ),
        q
    );
    assert_eq!(read(r#"{"q":[0.9,0.1,0.2,0.3]}"#), None);
    assert_eq!(read(r#"{"orientation":{"x":0,"y":0,"z":0,"w":0}}"#), None);
    assert_eq!(
        read(
            r#"{"orientation":{"w":0.9,"x":0.1,"y":0.2,"z":0.3},"orientation_covariance":[-1,0,0,0,0,0,0,0,0]}"#
        ),
        None
    );
    let foxglove = r#"{"timestamp":{"sec":5,"nsec":6},"parent_frame_id":"world","child_frame_id":"imu_link","translation":{"x":0,"y":0,"z":0},"rotation":{"x":0.1,"y":0.2,"z":0.3,"w":0.9}}"#;
    let sample = decode_one(&decoder, foxglove.as_bytes());
    assert_eq!(
        (sample.orientation, sample.header, sample.gyro),
        (q, Some(Nanos(5_000_000_006)), None)
    );
}

#[test]
fn ros_messages_in_json_keep_marks_and_frames() {
    let decoder = decoder("sensor_msgs/Imu");
    let text = r#"{"header":{"stamp":{"sec":1,"nanosec":2},"frame_id":"imu\u001b"},"angular_velocity":{"x":1,"y":2,"z":3},"angular_velocity_covariance":[-1,0,0,0,0,0,0,0,0]}"#;
    let mut out = Vec::new();
    let outcome = decoder.decode(text.as_bytes(), LOG, LOG, &mut out).unwrap();
    assert_eq!((out[0].gyro, outcome.gyro_marked_absent), (None, 1));
    assert_eq!(
        decoder.frame_id(text.as_bytes()).as_deref(),
        Some("imu\\u{1b}")
    );
    assert_eq!(decoder.stated().declared.gyro_unit, Some(GyroUnit::Rad));
}

#[test]
fn px4_messages_bring_their_own_interval_and_meaning() {
    let combined = r#"{"timestamp":27329869,"gyro_rad":[0.1,0.2,0.3],"gyro_integral_dt":5007,"accelerometer_timestamp_relative":0,"accelerometer_m_s2":[1,2,-9],"accelerometer_integral_dt":4871}"#;
    // By its name, and by its keys alone.
    for name in ["px4.sensor_combined", ""] {
        let mut decoder = decoder(name);
        decoder.settle(combined.as_bytes(), Nanos(0)).unwrap();
        let sample = decode_one(&decoder, combined.as_bytes());
        assert_eq!(
            (sample.gyro, sample.accel),
            (Some([0.1, 0.2, 0.3]), Some([1.0, 2.0, -9.0]))
        );
        assert_eq!(
            (sample.header, sample.interval_nanos),
            (Some(Nanos(27_329_869_000)), Some(5_007_000)),
            "{name}"
        );
        assert_eq!(
            decoder.stated().declared.sample_kind,
            Some(SampleKind::Average)
        );
        assert_eq!(decoder.stated().declared.gyro_unit, Some(GyroUnit::Rad));
    }
    let imu = r#"{"timestamp":9,"timestamp_sample":5,"delta_angle":[0.1,0.2,0.3],"delta_velocity":[0.25,0.5,1],"delta_angle_dt":5000,"delta_velocity_dt":4000}"#;
    let mut vehicle_imu = decoder("px4.vehicle_imu");
    vehicle_imu.settle(imu.as_bytes(), Nanos(0)).unwrap();
    let sample = decode_one(&vehicle_imu, imu.as_bytes());
    assert_eq!(
        (sample.header, sample.interval_nanos),
        (Some(Nanos(5_000)), Some(5_000_000))
    );
    assert_eq!(
        vehicle_imu.stated().declared.sample_kind,
        Some(SampleKind::DeltaAngle)
    );
    assert!(
        (sample.accel.unwrap()[2] - 250.0).abs() < 1e-10,
        "delta velocity over its interval"
    );
    let without = r#"{"delta_angle":[0.1,0.2,0.3],"delta_velocity":[0.25,0.5,1]}"#;
    assert_eq!(decode_one(&vehicle_imu, without.as_bytes()).accel, None);
    let attitude = r#"{"timestamp":9,"timestamp_sample":5,"q":[0.5,0.25,-0.125,0.75]}"#;
    assert_eq!(
        decode_one(&decoder("px4.vehicle_attitude"), attitude.as_bytes()).orientation,
        Some([0.5, 0.25, -0.125, 0.75])
    );
    let five = r#"{"timestamp_sample":5,"q":[1,0,0,0,0]}"#;
    assert_eq!(
        decode_one(&decoder("px4.vehicle_attitude"), five.as_bytes()).orientation,
        None
    );
    let rate = r#"{"timestamp":9,"timestamp_sample":5,"xyz":[1,2,3],"xyz_derivative":[7,7,7]}"#;
    assert_eq!(
        decode_one(&decoder("px4.vehicle_angular_velocity"), rate.as_bytes()).gyro,
        Some([1.0, 2.0, 3.0])
    );
    assert_eq!(
        decode_one(&decoder("px4.vehicle_acceleration"), rate.as_bytes()).gyro,
        None,
        "the same keys, another thing"
    );
}

#[test]
fn given_paths_reach_anything_and_a_wrong_one_lists_the_keys() {
    let text =
        br#"{"a":{"b":[{"w":[1,2,3]},{"w":[4,5,6]}]},"p":7,"q":8,"r":9,"gyro":[0,0,0],"when":12}"#;
    let read = |fields: &[&str]| {
        let decoder = Decoder::compile(&channel("json", "", ""), &options(fields)).unwrap();
        let samples = decode(&decoder, text).unwrap();
        samples
            .iter()
            .map(|s| (s.gyro.unwrap(), s.header.map(|n| n.0)))
            .collect::<Vec<_>>()
    };
    assert_eq!(read(&["gyro=p,q,r"]), [([7.0, 8.0, 9.0], None)]);
    assert_eq!(
        read(&["gyro=a.b[1].w", "stamp=when:ms"]),
        [([4.0, 5.0, 6.0], Some(12_000_000))]
    );
    assert_eq!(
        read(&["gyro=a.b[].w", "stamp=when:s"]),
        [
            ([1.0, 2.0, 3.0], Some(12_000_000_000)),
            ([4.0, 5.0, 6.0], Some(12_000_000_000))
        ]
    );
    let mut decoder = Decoder::compile(&channel("json", "", ""), &options(&["gyro=a.c"])).unwrap();
    let error = decoder.settle(text, LOG).unwrap_err().to_string();
    assert!(
        error.contains("no gyro at `a.c`") && error.contains("a.b[].w, p, q, r"),
        "{error}"
    );
}

#[test]
fn arrays_of_samples_are_batches() {
    let decoder = decoder("");
    let logger = br#"{"messageId":0,"payload":[{"name":"gyroscope","time":1700000000000000001,"values":{"z":3,"y":2,"x":1}},
        {"name":"accelerometer","time":1700000000000000002,"values":{"z":9,"y":9,"x":9}},
        {"values":{"z":6,"y":5,"x":4},"time":1700000000000000003,"name":"gyroscope"}]}"#;
    let samples = decode(&decoder, logger).unwrap();
    let read: Vec<_> = samples
        .iter()
        .map(|s| (s.gyro.unwrap(), s.header.unwrap().0 % 10))
        .collect();
    assert_eq!(
        read,
        [([1.0, 2.0, 3.0], 1), ([4.0, 5.0, 6.0], 3)],
        "the accelerometer is no gyro"
    );
    let outer = br#"[{"gyro":[1,2,3],"t_ns":1},{"gyro":[4,5,6],"t_ns":2}]"#;
    assert_eq!(decode(&decoder, outer).unwrap().len(), 2);
    let many = format!("[{}0]", r#"{"gyro":[1,2,3]},"#.repeat(70_000));
    assert!(
        decode(&decoder, many.as_bytes())
            .unwrap_err()
            .to_string()
            .contains("65536")
    );
}

#[test]
fn a_text_cut_anywhere_or_followed_by_anything_is_refused() {
    let decoder = decoder("");
    let text =
        br#"{"stamp":{"sec":1,"nsec":2},"gyro":[1.5e-3,-2,3],"s":"\u00e9\n","b":true,"n":null}"#;
    assert!(decode(&decoder, text).is_ok());
    for cut in 0..text.len() {
        assert!(decode(&decoder, &text[..cut]).is_err(), "{cut}");
    }
    assert!(decode(&decoder, &[&text[..], b"x"].concat()).is_err());
    assert_eq!(
        decode(&decoder, br#"{"gyro" [1]}"#)
            .unwrap_err()
            .to_string(),
        "JSON, byte 8: expected `:`"
    );
    assert!(
        decode(&decoder, b"{\"a\":\"\xff\"}")
            .unwrap_err()
            .to_string()
            .contains("UTF-8")
    );
    for nested in ["[", "{\"gyro\":", "{\"a\":[", "{\"stamp\":{\"stamp\":"] {
        assert!(decode(&decoder, nested.repeat(50_000).as_bytes()).is_err());
    }
}

#[test]
fn lines_of_our_own_wire_and_of_gpsd_and_sensorserver_are_read() {
    let mut out = Vec::new();
    let rate = br#"{"class":"RATE","id":"imu0","stamp":{"sec":1700000000,"nsec":5000000},"gyro":[0.01,0.0,-0.2],"seq":17}"#;
    let mut with_end = rate.to_vec();
    with_end.extend(b"\r\n");
    let line = decode_line(&with_end, LOG, &mut out).unwrap();
    assert_eq!(
        (line.class, line.id.as_deref(), line.seq, line.gyro_unit),
        (Class::Rate, Some("imu0"), Some(17), Some(GyroUnit::Rad))
    );
    assert_eq!(
        (out[0].gyro, out[0].header, out[0].log),
        (
            Some([0.01, 0.0, -0.2]),
            Some(Nanos(1_700_000_000_005_000_000)),
            LOG
        )
    );

    out.clear();
    let att = br#"{"class":"ATT","id":"imu0","seq":17,"stamp":{"sec":1700000000,"nsec":5000000},"q":{"w":1,"x":0,"y":0,"z":0},"rotates":"sensor_to_world","world":"start","body":"flu","rate":[0.01,0,-0.2],"sigma_deg":[0.01,0.01,0.02],"status":["ok"],"reset":0}"#;
    let line = decode_line(att, LOG, &mut out).unwrap();
    assert_eq!(
        (line.class, out[0].gyro, out[0].orientation),
        (
            Class::Att,
            Some([0.01, 0.0, -0.2]),
            Some([1.0, 0.0, 0.0, 0.0])
        )
    );

    out.clear();
    let gpsd = br#"{"class":"IMU","device":"/dev/ttyUSB0","time":"2023-11-14T22:13:20.005Z","gyro_x":1.0,"gyro_y":2.0,"gyro_z":3.0,"acc_x":0.5,"acc_y":0.25,"acc_z":9.75,"temp":21}"#;
    let line = decode_line(gpsd, LOG, &mut out).unwrap();
    assert_eq!(
        (line.class, line.gyro_unit, line.id.as_deref()),
        (Class::Imu, Some(GyroUnit::Deg), Some("/dev/ttyUSB0"))
    );
    assert_eq!(
        (out[0].gyro, out[0].accel),
        (Some([1.0, 2.0, 3.0]), Some([0.5, 0.25, 9.75]))
    );
    assert_eq!(out[0].header, Some(Nanos(1_700_000_000_005_000_000)));

    out.clear();
    let android = br#"{"type":"android.sensor.gyroscope","timestamp":12345678901234,"values":[1,2,3],"accuracy":3}"#;
    let line = decode_line(android, LOG, &mut out).unwrap();
    assert_eq!(
        (out[0].gyro, out[0].header, line.gyro_unit),
        (
            Some([1.0, 2.0, 3.0]),
            Some(Nanos(12_345_678_901_234)),
            Some(GyroUnit::Rad)
        )
    );

    // The uncalibrated one says what it thinks of its drift as well, and does not remove it.
    out.clear();
    let uncalibrated = br#"{"type":"android.sensor.gyroscope_uncalibrated","timestamp":12345678901234,"values":[1,2,3,0.1,0.2,0.3]}"#;
    decode_line(uncalibrated, LOG, &mut out).unwrap();
    assert_eq!(out[0].gyro, Some([1.0, 2.0, 3.0]));
    // Asked for alone, no event says what it is of: then it is what was asked for.
    out.clear();
    let nameless = br#"{"values":[1,2,3],"timestamp":12345678901234,"accuracy":3}"#;
    decode_line(nameless, LOG, &mut out).unwrap();
    assert_eq!(out[0].gyro, None);
    out.clear();
    let phone = LineDecoder::with_sensor(&Options::default(), "android.sensor.gyroscope");
    let line = phone.decode(nameless, LOG, &mut out).unwrap();
    assert_eq!(line.sensor.as_deref(), Some("android.sensor.gyroscope"));
    assert_eq!(
        (out[0].gyro, out[0].header),
        (Some([1.0, 2.0, 3.0]), Some(Nanos(12_345_678_901_234)))
    );

    out.clear();
    let status = decode_line(
        br#"{"class":"STA\u001bTUS","uptime_s":12.5}"#,
        LOG,
        &mut out,
    )
    .unwrap();
    assert_eq!(
        (status.class, out[0].gyro),
        (Class::Other("STA\\u{1b}TUS".to_owned()), None)
    );
    let long = format!(r#"{{"a":"{}"}}"#, "x".repeat(MAX_LINE));
    assert!(decode_line(long.as_bytes(), LOG, &mut out).is_err());
    for bad in [
        &b""[..],
        b"\n",
        b"null",
        b"17",
        b"\"RATE\"",
        b"{",
        b"garbage",
    ] {
        assert!(decode_line(bad, LOG, &mut out).is_err());
    }
}

#[test]
fn an_interval_of_px4_with_a_fraction_is_in_seconds() {
    let decoder = Decoder::compile(&channel("json", "SensorCombined", ""), &options(&[])).unwrap();
    for (interval, nanos) in [
        ("5007", 5_007_000),
        ("0.005007", 5_007_000),
        ("4e-3", 4_000_000),
    ] {
        let line = format!(
            "{{\"timestamp\":27329869,\"gyro_rad\":[0.1,0.2,0.3],\"gyro_integral_dt\":{interval}}}"
        );
        let sample = decode_one(&decoder, line.as_bytes());
        assert_eq!(sample.interval_nanos, Some(nanos), "{interval}");
    }
}

#[test]
fn an_attitude_of_px4_says_how_often_it_was_set_anew() {
    let decoder = Decoder::compile(&channel("json", "VehicleAttitude", ""), &options(&[])).unwrap();
    let line =
        r#"{"timestamp":1,"q":[1,0,0,0],"delta_q_reset":[0.9,0,0,0.1],"quat_reset_counter":7}"#;
    assert_eq!(
        decode_one(&decoder, line.as_bytes()).orientation_resets,
        Some(7)
    );
}
