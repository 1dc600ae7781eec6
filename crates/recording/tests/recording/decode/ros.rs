//! CDR and ROS 1 against bytes made by hand.

use super::writer::*;
use super::{channel, decode, decode_one, options};
use strapd_attitude::record::{Nanos, SampleKind};
use strapd_recording::decode::{Channel, Decoder, GyroUnit, Options, Undecodable};

fn imu_decoder() -> Decoder {
    Decoder::compile(
        &channel("cdr", "sensor_msgs/msg/Imu", IMU),
        &Options::default(),
    )
    .unwrap()
}

#[test]
fn an_imu_decodes_with_every_frame_length_in_both_byte_orders() {
    let decoder = imu_decoder();
    for big in [false, true] {
        for n in 0..=40 {
            let frame = "abcdefghijklmnopqrstuvwxyz0123456789_-./"[..n].to_owned();
            let payload = Writer::cdr(big).imu(&frame).bytes;
            // base = 4 + align8(12 + n + 1), length = base + 296.
            assert_eq!(payload.len(), 4 + (13 + n).next_multiple_of(8) + 296);
            let sample = decode_one(&decoder, &payload);
            assert_eq!(sample.header, Some(Nanos(STAMP)));
            assert_eq!(sample.gyro, Some(GYRO));
            assert_eq!(sample.accel, Some(ACCEL));
            assert_eq!(
                sample.orientation,
                Some(ORIENTATION),
                "x, y, z, w on the wire"
            );
            assert_eq!(sample.interval_nanos, None);
            assert_eq!(decoder.frame_id(&payload), Some(frame));
        }
    }
}

#[test]
fn a_frame_of_length_zero_without_terminator_is_empty() {
    let mut payload = Writer::cdr(false)
        .i32(1)
        .u32(2)
        .u32(0)
        .imu_body(0.0, 0.0)
        .bytes;
    let decoder = imu_decoder();
    assert_eq!(decode_one(&decoder, &payload).gyro, Some(GYRO));
    assert_eq!(decoder.frame_id(&payload).as_deref(), Some(""));
    // Bytes that are no UTF-8 and control characters reach no terminal.
    payload = Writer::cdr(false)
        .header(1, 2, "a\u{1b}[31m\u{202e}")
        .imu_body(0.0, 0.0)
        .bytes;
    let frame = decoder.frame_id(&payload).unwrap();
    assert!(
        !frame.contains(['\u{1b}', '\u{202e}']) && frame.starts_with("a\\u{1b}"),
        "{frame}"
    );
    payload = Writer::cdr(false)
        .header(1, 2, &"é".repeat(4000))
        .imu_body(0.0, 0.0)
        .bytes;
    assert!(decoder.frame_id(&payload).unwrap().len() <= 255);
}

#[test]
fn a_message_cut_anywhere_says_how_much_is_missing_and_where() {
    let decoder = imu_decoder();
    for big in [false, true] {
        let whole = Writer::cdr(big).imu("imu_link").bytes;
        let full = whole.len() as u64;
        let mut last_need = 0;
        for cut in 0..whole.len() {
            match decode(&decoder, &whole[..cut]) {
                Err(Undecodable::Short { have, need, field }) => {
                    assert_eq!(have, cut as u64);
                    assert!(
                        need > have && need <= full && need >= last_need,
                        "{cut}: {need} {field}"
                    );
                    last_need = need;
                }
                other => panic!("cut at {cut}: {other:?}"),
            }
        }
        let at = |cut: usize| decode(&decoder, &whole[..cut]).unwrap_err().to_string();
        assert_eq!(at(23), "23 bytes, need 25, at header.frame_id");
        assert_eq!(at(140), "140 bytes, need 148, at angular_velocity.y");
        assert_eq!(at(2), "2 bytes, need 4, at the CDR encapsulation");
    }
}

#[test]
fn padding_at_the_end_is_accepted_and_another_schema_is_not() {
    let decoder = imu_decoder();
    let mut payload = Writer::cdr(false).imu("imu").bytes;
    for _ in 0..7 {
        payload.push(0);
        assert_eq!(decode_one(&decoder, &payload).gyro, Some(GYRO));
    }
    payload.push(0);
    let error = decode(&decoder, &payload).unwrap_err().to_string();
    assert!(
        error.contains("324 bytes") && error.contains("after 316"),
        "{error}"
    );
}

#[test]
fn encapsulations_that_are_not_plain_cdr_are_refused_in_words() {
    let decoder = imu_decoder();
    let mut payload = Writer::cdr(false).imu("imu").bytes;
    for (byte, word) in [
        (2, "parameter list"),
        (3, "parameter list"),
        (6, "XCDR2"),
        (9, "delimited"),
        (11, "PL_CDR2"),
        (77, "none"),
    ] {
        payload[1] = byte;
        let error = decode(&decoder, &payload).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("00 01"), "{error}");
    }
    payload[0] = 1;
    assert!(decode(&decoder, &payload).is_err());
}

#[test]
fn nanoseconds_beyond_a_second_carry_over_and_are_counted_and_seconds_may_be_negative() {
    let decoder = imu_decoder();
    let mut out = Vec::new();
    let payload = Writer::cdr(false)
        .header(-2, 2_500_000_000, "")
        .imu_body(0.0, 0.0)
        .bytes;
    let outcome = decoder
        .decode(&payload, Nanos(0), Nanos(0), &mut out)
        .unwrap();
    assert_eq!(out[0].header, Some(Nanos(500_000_000)));
    assert_eq!(outcome.stamps_carried, 1);
}

#[test]
fn minus_one_marks_data_as_absent_unless_the_mark_is_to_be_ignored() {
    let payload = Writer::cdr(false)
        .header(1, 2, "")
        .imu_body(-1.0, -1.0)
        .bytes;
    let channel = channel("cdr", "sensor_msgs/msg/Imu", IMU);
    for ignore in [false, true] {
        let options = Options {
            ignore_covariance_flag: ignore,
            ..Options::default()
        };
        let decoder = Decoder::compile(&channel, &options).unwrap();
        let mut out = Vec::new();
        let outcome = decoder
            .decode(&payload, Nanos(0), Nanos(0), &mut out)
            .unwrap();
        assert_eq!(outcome.gyro_marked_absent, 1, "said in both cases");
        assert_eq!(out[0].gyro, ignore.then_some(GYRO));
        assert_eq!(out[0].orientation, ignore.then_some(ORIENTATION));
        assert_eq!(out[0].accel, Some(ACCEL));
    }
}

#[test]
fn an_orientation_of_zeros_or_nan_is_none_and_a_gyro_with_nan_stays() {
    let decoder = imu_decoder();
    let body = |q: [f64; 4], w: [f64; 3]| {
        Writer::cdr(false)
            .header(1, 2, "")
            .f64s(&q)
            .f64s(&[0.0; 9])
            .f64s(&w)
            .f64s(&[0.0; 21])
            .bytes
    };
    for q in [[0.0; 4], [f64::NAN, 0.0, 0.0, 1.0], [0.2, 0.2, 0.2, 0.2]] {
        assert_eq!(
            decode_one(&decoder, &body(q, GYRO)).orientation,
            None,
            "{q:?}"
        );
    }
    let far = [0.0, 0.0, 0.0, 195.7];
    assert_eq!(
        decode_one(&decoder, &body(far, GYRO)).orientation,
        Some([195.7, 0.0, 0.0, 0.0]),
        "as found"
    );
    let gyro = decode_one(&decoder, &body([0.0; 4], [f64::NAN, f64::INFINITY, 1.0]))
        .gyro
        .unwrap();
    assert!(
        gyro[0].is_nan() && gyro[1].is_infinite(),
        "conditioning counts it, not the decoder"
    );
}

#[test]
fn ros_1_packs_without_alignment_and_has_a_sequence_number() {
    let text = IMU
        .replace("builtin_interfaces/Time stamp", "uint32 seq\ntime stamp")
        .replace("std_msgs/Header header", "Header header");
    let decoder = Decoder::compile(
        &channel("ros1", "sensor_msgs/Imu", &text),
        &Options::default(),
    )
    .unwrap();
    for n in 0..=17 {
        let frame = "x".repeat(n);
        let payload = Writer::ros1().imu(&frame).bytes;
        assert_eq!(payload.len(), 16 + n + 296, "head, frame, 296 bytes");
        let sample = decode_one(&decoder, &payload);
        assert_eq!(
            (sample.header, sample.gyro, sample.accel, sample.orientation),
            (
                Some(Nanos(STAMP)),
                Some(GYRO),
                Some(ACCEL),
                Some(ORIENTATION)
            )
        );
        assert_eq!(decoder.frame_id(&payload), Some(frame));
        for cut in 0..payload.len() {
            assert!(decode(&decoder, &payload[..cut]).is_err());
        }
    }
}

#[test]
fn well_known_types_need_no_schema_text() {
    for (encoding, payload) in [
        ("cdr", Writer::cdr(true).imu("imu")),
        ("ros1", Writer::ros1().imu("imu")),
    ] {
        for name in [
            "sensor_msgs/msg/Imu",
            "sensor_msgs/Imu",
            "sensor_msgs::msg::dds_::Imu_",
        ] {
            let decoder =
                Decoder::compile(&channel(encoding, name, ""), &Options::default()).unwrap();
            assert_eq!(
                decode_one(&decoder, &payload.bytes).gyro,
                Some(GYRO),
                "{encoding} {name}"
            );
        }
    }
    let error =
        Decoder::compile(&channel("cdr", "my/msg/Own", ""), &Options::default()).unwrap_err();
    assert!(
        error.to_string().contains("schema text is empty"),
        "{error}"
    );
}

#[test]
fn a_nested_imu_is_found_behind_strings_and_sequences_of_every_size() {
    let text = format!(
        "string name\nuint8[] blob\nfloat64[] doubles\nstring[] words\nmy_msgs/Pair[] pairs\nuint8 flag\n\
         sensor_msgs/Imu imu\nstring tail\n{}{}",
        section("my_msgs/Pair", "uint8 a\nfloat64 b"),
        imu_section()
    );
    let decoder = Decoder::compile(
        &channel("cdr", "my_msgs/msg/Rig", &text),
        &Options::default(),
    )
    .unwrap();
    assert!(
        decoder
            .stated()
            .description
            .contains("gyro imu.angular_velocity")
    );
    assert!(
        decoder
            .stated()
            .description
            .contains("stamp imu.header.stamp")
    );
    assert_eq!(
        decoder.stated().declared.gyro_unit,
        Some(GyroUnit::Rad),
        "Imu.msg states it"
    );
    for big in [false, true] {
        for n in 0..9_usize {
            let mut w = Writer::cdr(big).string(&"n".repeat(n)).u32(n as u32);
            for _ in 0..n {
                w = w.u8(1);
            }
            w = w
                .u32((n % 3) as u32)
                .f64s(&vec![1.0; n % 3])
                .u32((n % 4) as u32);
            for i in 0..n % 4 {
                w = w.string(&"w".repeat(i));
            }
            w = w.u32((n % 5) as u32);
            for _ in 0..n % 5 {
                w = w.u8(3).f64(4.0);
            }
            let payload = w.u8(9).imu("imu").string("end").bytes;
            let sample = decode_one(&decoder, &payload);
            assert_eq!(
                (sample.gyro, sample.header, sample.accel),
                (Some(GYRO), Some(Nanos(STAMP)), Some(ACCEL))
            );
            for cut in 0..payload.len() {
                assert!(
                    decode(&decoder, &payload[..cut]).is_err(),
                    "{n} cut at {cut}"
                );
            }
        }
    }
}

#[test]
fn a_batch_gives_one_sample_each_and_an_index_gives_that_one() {
    let text = format!(
        "std_msgs/Header header\nsensor_msgs/Imu[] imus\nuint8 last\n{}",
        imu_section()
    );
    let channel = channel("cdr", "my_msgs/msg/Batch", &text);
    let mut w = Writer::cdr(false).header(5, 6, "outer").u32(3);
    for n in 0..3 {
        w = w
            .header(100 + n, 0, &"f".repeat(n as usize))
            .imu_body(0.0, 0.0);
    }
    let payload = w.u8(1).bytes;
    let decoder = Decoder::compile(&channel, &Options::default()).unwrap();
    assert!(decoder.stated().batched);
    let secs = |samples: Vec<strapd_attitude::record::RawSample>| -> Vec<i64> {
        samples
            .iter()
            .map(|s| s.header.unwrap().0 / 1_000_000_000)
            .collect()
    };
    assert_eq!(
        secs(decode(&decoder, &payload).unwrap()),
        [100, 101, 102],
        "each its own stamp"
    );
    let decoder = Decoder::compile(&channel, &options(&["gyro=imus[1].angular_velocity"])).unwrap();
    assert_eq!(secs(decode(&decoder, &payload).unwrap()), [101]);
    let outer = options(&["gyro=imus[].angular_velocity", "stamp=header.stamp"]);
    let decoder = Decoder::compile(&channel, &outer).unwrap();
    assert_eq!(secs(decode(&decoder, &payload).unwrap()), [5, 5, 5]);
    for cut in 0..payload.len() {
        assert!(
            decode(&decoder, &payload[..cut]).is_err(),
            "half a batch pushes nothing"
        );
    }
}

#[test]
fn fields_can_be_given_by_scalars_elements_and_units_and_a_wrong_one_lists_what_there_is() {
    let text = format!(
        "uint32 t\nint16 wx\nint16 wy\nint16 wz\nfloat32[] data\nmy_msgs/V v\n{}",
        section("my_msgs/V", "float32[3] w")
    );
    let channel = channel("cdr", "my_msgs/msg/Raw", &text);
    let payload = Writer::cdr(false)
        .u32(1234)
        .i16(-1)
        .i16(2)
        .i16(3)
        .u32(4)
        .f32s(&[9.0, 8.0, 7.0, 6.0])
        .f32s(&[0.5, 1.5, 2.5])
        .bytes;
    for (field, expected) in [
        ("gyro=wz,wy,wx", [3.0, 2.0, -1.0]),
        ("gyro=data[3],data[1],data[0]", [6.0, 8.0, 9.0]),
        ("gyro=v.w", [0.5, 1.5, 2.5]),
    ] {
        let decoder = Decoder::compile(&channel, &options(&[field, "stamp=t:ms"])).unwrap();
        let sample = decode_one(&decoder, &payload);
        assert_eq!(sample.gyro, Some(expected), "{field}");
        assert_eq!(sample.header, Some(Nanos(1_234_000_000)));
    }
    let short = Writer::cdr(false)
        .u32(1234)
        .i16(-1)
        .i16(2)
        .i16(3)
        .u32(2)
        .f32s(&[9.0; 2])
        .f32s(&[0.5; 3])
        .bytes;
    let decoder = Decoder::compile(&channel, &options(&["gyro=data[3],data[1],data[0]"])).unwrap();
    assert!(
        decode(&decoder, &short)
            .unwrap_err()
            .to_string()
            .ends_with("at data")
    );
    for wrong in [
        "gyro=imu.w",
        "gyro=t",
        "gyro=v",
        "stamp=v.w",
        "gyro=v.w[3],v.w[0],v.w[1]",
        "accel=data[]",
    ] {
        let error = Decoder::compile(&channel, &options(&[wrong]))
            .unwrap_err()
            .to_string();
        assert!(error.contains("fields that fit"), "{wrong}: {error}");
        assert!(
            !wrong.starts_with("gyro") || error.contains("v.w"),
            "{error}"
        );
    }
}

#[test]
fn what_lies_behind_a_wide_string_or_an_undefined_type_is_refused_and_before_it_is_read() {
    let read = |text: &str| Decoder::compile(&channel("cdr", "a/msg/B", text), &Options::default());
    let error = read("wstring w\nfloat64[3] gyro").unwrap_err().to_string();
    assert!(
        error.contains("wide string") && error.contains("`w`"),
        "{error}"
    );
    let error = read("other/Thing w\nfloat64[3] gyro")
        .unwrap_err()
        .to_string();
    assert!(error.contains("does not define"), "{error}");
    for tail in [
        "wstring w",
        "other/Thing w",
        "other/Thing[] w",
        "wstring[] w",
    ] {
        let decoder = read(&format!("float64[3] gyro\n{tail}")).unwrap();
        let payload = Writer::cdr(false)
            .f64s(&GYRO)
            .u32(0)
            .u32(0)
            .u32(0)
            .u32(0)
            .bytes;
        assert_eq!(decode_one(&decoder, &payload).gyro, Some(GYRO), "{tail}");
    }
}

#[test]
fn px4_messages_bring_their_own_interval_and_meaning() {
    let compile =
        |name: &str| Decoder::compile(&channel("cdr", name, ""), &Options::default()).unwrap();
    let decoder = compile("px4_msgs/msg/SensorCombined");
    let payload = Writer::cdr(false)
        .u64(27_329_869)
        .f32s(&[0.5, -0.25, 0.125])
        .u32(5007)
        .i32(0)
        .f32s(&[1.0, 2.0, -9.5])
        .u32(4871);
    let payload = payload.u8(0).u8(0).u8(2).u8(1).bytes;
    let sample = decode_one(&decoder, &payload);
    assert_eq!(
        decoder.stated().declared.sample_kind,
        Some(SampleKind::Average)
    );
    assert_eq!(
        (sample.gyro, sample.accel),
        (Some([0.5, -0.25, 0.125]), Some([1.0, 2.0, -9.5]))
    );
    assert_eq!(
        (sample.header, sample.interval_nanos),
        (Some(Nanos(27_329_869_000)), Some(5_007_000))
    );

    let decoder = compile("px4_msgs/msg/VehicleImu");
    let payload = Writer::cdr(false)
        .u64(9)
        .u64(27_615_299)
        .u32(1)
        .u32(2)
        .f32s(&[0.5, -0.25, 0.125])
        .f32s(&[0.25, 0.5, -0.125]);
    let payload = payload.u32(5000).u32(4000).u8(0).u8(0).u8(0).u8(0).bytes;
    let sample = decode_one(&decoder, &payload);
    assert_eq!(
        decoder.stated().declared.sample_kind,
        Some(SampleKind::Rotation)
    );
    assert_eq!(
        (sample.gyro, sample.interval_nanos),
        (Some([0.5, -0.25, 0.125]), Some(5_000_000))
    );
    assert_eq!(
        sample.header,
        Some(Nanos(27_615_299_000)),
        "timestamp_sample, not timestamp"
    );
    // delta_velocity / delta_velocity_dt; 0.25 / 0.004 is 62.5 to the last bit or the one before.
    for (a, e) in sample.accel.unwrap().iter().zip([62.5, 125.0, -31.25]) {
        assert!((a - e).abs() < 1e-13 * e.abs(), "{a} {e}");
    }

    let decoder = compile("px4_msgs/msg/VehicleAttitude");
    let payload = Writer::cdr(false)
        .u64(1)
        .u64(2)
        .f32s(&[0.5, 0.25, -0.125, 0.75])
        .f32s(&[1.0, 0.0, 0.0, 0.0])
        .u8(2)
        .bytes;
    let sample = decode_one(&decoder, &payload);
    assert_eq!(
        (sample.orientation, sample.gyro),
        (Some([0.5, 0.25, -0.125, 0.75]), None),
        "w first"
    );

    let decoder = compile("px4_msgs/msg/VehicleAngularVelocity");
    let payload = Writer::cdr(false)
        .u64(1)
        .u64(2)
        .f32s(&[0.5, 0.25, -0.125])
        .f32s(&[7.0; 3])
        .bytes;
    assert_eq!(
        decode_one(&decoder, &payload).gyro,
        Some([0.5, 0.25, -0.125])
    );
}

#[test]
fn orientations_are_found_in_every_type_that_holds_one() {
    let q = [0.1, 0.2, 0.3, 0.9];
    let head = || Writer::cdr(false).header(1, 5, "world");
    let cases = [
        ("geometry_msgs/msg/QuaternionStamped", head().f64s(&q)),
        (
            "geometry_msgs/msg/PoseStamped",
            head().f64s(&[7.0; 3]).f64s(&q),
        ),
        (
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            head().f64s(&[7.0; 3]).f64s(&q).f64s(&[0.0; 36]),
        ),
        (
            "geometry_msgs/msg/TransformStamped",
            head().string("base").f64s(&[7.0; 3]).f64s(&q),
        ),
        (
            "nav_msgs/msg/Odometry",
            head()
                .string("base")
                .f64s(&[7.0; 3])
                .f64s(&q)
                .f64s(&[0.0; 36 + 6 + 36]),
        ),
    ];
    for (name, payload) in cases {
        let decoder = Decoder::compile(&channel("cdr", name, ""), &Options::default()).unwrap();
        let sample = decode_one(&decoder, &payload.bytes);
        assert_eq!(
            (sample.orientation, sample.header),
            (Some(ORIENTATION), Some(Nanos(1_000_000_005))),
            "{name}"
        );
        assert_eq!(decoder.frame_id(&payload.bytes).as_deref(), Some("world"));
    }
}

#[test]
fn of_several_transforms_the_first_is_taken_or_the_one_to_the_child_asked_for() {
    let one = |w: Writer, sec, child: &str, q: f64| {
        w.header(sec, 0, "world")
            .string(child)
            .f64s(&[0.0; 3])
            .f64s(&[0.0, 0.0, q, 1.0])
    };
    let mut w = Writer::cdr(false).u32(3);
    for (sec, child, q) in [(1, "a", 0.1), (2, "imu", 0.2), (3, "imu", 0.3)] {
        w = one(w, sec, child, q);
    }
    let channel = channel("cdr", "tf2_msgs/msg/TFMessage", "");
    for (child, expected) in [
        (None, vec![(1, 0.1)]),
        (Some("imu"), vec![(2, 0.2)]),
        (Some("gone"), vec![]),
    ] {
        let options = Options {
            child_frame: child.map(str::to_owned),
            ..Options::default()
        };
        let decoder = Decoder::compile(&channel, &options).unwrap();
        let found: Vec<_> = decode(&decoder, &w.bytes)
            .unwrap()
            .iter()
            .map(|s| {
                (
                    s.header.unwrap().0 / 1_000_000_000,
                    s.orientation.unwrap()[3],
                )
            })
            .collect();
        assert_eq!(found, expected, "{child:?}");
        assert_eq!(
            decode(&decoder, &Writer::cdr(false).u32(0).bytes).unwrap(),
            [],
            "no transform, no sample"
        );
    }
}

#[test]
fn idl_and_message_text_give_the_same_plan() {
    let idl = "\
=====\nIDL: my_msgs/msg/Own\nmodule my_msgs { module msg { typedef double nine[9]; struct Own {
 std_msgs::msg::Header header; sequence<octet> blob; geometry_msgs::msg::Vector3 angular_velocity; nine angular_velocity_covariance; }; }; };
=====\nIDL: std_msgs/msg/Header\nmodule std_msgs { module msg { struct Header { builtin_interfaces::msg::Time stamp; string frame_id; }; }; };
=====\nIDL: builtin_interfaces/msg/Time\nmodule builtin_interfaces { module msg { struct Time { long sec; unsigned long nanosec; }; }; };
=====\nIDL: geometry_msgs/msg/Vector3\nmodule geometry_msgs { module msg { struct Vector3 { double x; double y; double z; }; }; };";
    let idl = Channel {
        schema_encoding: "ros2idl",
        ..channel("cdr", "my_msgs/msg/Own", idl)
    };
    let decoder = Decoder::compile(&idl, &Options::default()).unwrap();
    let payload = Writer::cdr(true)
        .header(1, 5, "imu")
        .u32(2)
        .u8(0)
        .u8(0)
        .f64s(&GYRO)
        .f64(-1.0)
        .f64s(&[0.0; 8])
        .bytes;
    let mut out = Vec::new();
    let outcome = decoder
        .decode(&payload, Nanos(0), Nanos(0), &mut out)
        .unwrap();
    assert_eq!(
        (out[0].header, out[0].gyro, outcome.gyro_marked_absent),
        (Some(Nanos(1_000_000_005)), None, 1)
    );
}

#[test]
fn an_unlabelled_integer_stamp_is_settled_by_the_recorders_clock() {
    let text = "uint64 timestamp\nfloat64[3] gyro";
    let mut decoder =
        Decoder::compile(&channel("cdr", "a/msg/B", text), &Options::default()).unwrap();
    let payload = Writer::cdr(false).u64(27_329_869).f64s(&GYRO).bytes;
    assert_eq!(
        decode_one(&decoder, &payload).header,
        Some(Nanos(27_329_869_000_000_000)),
        "by magnitude: seconds"
    );
    decoder.settle(&payload, Nanos(27_329_900_000)).unwrap();
    assert_eq!(
        decode_one(&decoder, &payload).header,
        Some(Nanos(27_329_869_000))
    );
}

#[test]
fn a_forged_count_is_refused_by_what_it_would_need() {
    let text = format!("sensor_msgs/Imu[] imus\n{}", imu_section());
    let decoder = Decoder::compile(&channel("cdr", "a/msg/B", &text), &Options::default()).unwrap();
    let payload = Writer::cdr(false).u32(u32::MAX).imu("imu").bytes;
    match decode(&decoder, &payload) {
        // 2^32 - 1 times 8 bytes of stamp, 4 of count, 296 of numbers.
        Err(Undecodable::Short { need, field, .. }) => {
            assert_eq!(
                (need, field.as_str()),
                (8 + u64::from(u32::MAX) * 308, "imus")
            );
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_messages_own_orientation_comes_before_those_in_its_arrays() {
    let types = section("a/P", "Q orientation")
        + &section("a/Q", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w");
    let text = format!(
        "a/P[] others\na/Deep own\n{}{types}",
        section("a/Deep", "a/P pose")
    );
    let decoder = Decoder::compile(&channel("cdr", "a/msg/M", &text), &Options::default()).unwrap();
    let others = Writer::cdr(false).u32(1).f64s(&[1.0, 0.0, 0.0, 0.0]);
    let payload = others.f64s(&[0.1, 0.2, 0.3, 0.9]).bytes;
    assert_eq!(
        decode_one(&decoder, &payload).orientation,
        Some(ORIENTATION)
    );
    let given = options(&["orientation=others[0].orientation"]);
    let decoder = Decoder::compile(&channel("cdr", "a/msg/M", &text), &given).unwrap();
    assert_eq!(
        decode_one(&decoder, &payload).orientation,
        Some([0.0, 1.0, 0.0, 0.0])
    );
}

#[test]
fn a_given_field_outside_the_batch_is_refused_not_dropped() {
    let text = format!(
        "float64[3] accel\na/S[] samples\n{}",
        section("a/S", "float64[3] gyro\nuint32 dt_us")
    );
    let channel = channel("cdr", "a/msg/B", &text);
    let error = Decoder::compile(&channel, &options(&["accel=accel"])).unwrap_err();
    assert!(error.to_string().contains("different arrays"), "{error}");
    let given = options(&["gyro=samples[].gyro", "dt=samples[].dt_us:us"]);
    let decoder = Decoder::compile(&channel, &given).unwrap();
    let payload = Writer::cdr(false)
        .f64s(&ACCEL)
        .u32(1)
        .f64s(&GYRO)
        .u32(2500)
        .bytes;
    assert_eq!(
        decode_one(&decoder, &payload).interval_nanos,
        Some(2_500_000)
    );
}
