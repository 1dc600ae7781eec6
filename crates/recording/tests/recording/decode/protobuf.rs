//! Protobuf against bytes made by hand, and against prost-reflect.

use super::writer::Proto;
use super::{LOG, decode, decode_one, options};
use strapd_attitude::record::Nanos;
use strapd_recording::decode::{Channel, Decoder, Options};

fn vector3(kind: u64) -> Proto {
    let axis = |name: &str, number| Proto::field(name, number, false, kind, "");
    Proto::message_type("Vec", vec![axis("x", 1), axis("y", 2), axis("z", 3)])
}

/// The set names google.protobuf.Timestamp, and defines it.
fn timestamp() -> Proto {
    let fields = vec![
        Proto::field("seconds", 1, false, 3, ""),
        Proto::field("nanos", 2, false, 5, ""),
    ];
    Proto::message_type("Timestamp", fields)
}

fn channel<'a>(name: &'a str, set: &'a [u8]) -> Channel<'a> {
    Channel {
        topic: "/imu",
        message_encoding: "protobuf",
        schema_name: name,
        schema_encoding: "protobuf",
        schema_data: set,
    }
}

fn xyz(v: [f64; 3]) -> Proto {
    Proto::default()
        .double(1, v[0])
        .double(2, v[1])
        .double(3, v[2])
}

#[test]
fn a_message_of_vectors_and_a_timestamp_is_read_in_any_field_order() {
    let fields = vec![
        Proto::field("gyroscope", 7, false, 11, ".a.b.Vec"),
        Proto::field("stamp", 1, false, 11, ".a.b.Timestamp"),
        Proto::field("linear_acceleration", 300, false, 11, ".a.b.Vec"),
        Proto::field("frame_id", 5, false, 9, ""),
    ];
    let set = Proto::file_set(
        "a.b",
        vec![vector3(1), timestamp(), Proto::message_type("Imu", fields)],
    );
    let decoder = Decoder::compile(&channel("a.b.Imu", &set), &Options::default()).unwrap();
    let stamp = Proto::default().varint(1, 1_700_000_000).varint(2, 5);
    let parts = [
        Proto::default().message(7, xyz([1.0, 2.0, 3.0])),
        Proto::default().message(1, stamp),
        Proto::default().message(300, xyz([4.0, 5.0, 6.0])),
        Proto::default().bytes(5, b"imu"),
        Proto::default()
            .varint(99, 3)
            .bytes(98, b"unknown")
            .double(97, 1.0)
            .float(96, 1.0),
    ];
    for turn in 0..parts.len() {
        let bytes: Vec<u8> = (0..parts.len())
            .flat_map(|i| parts[(i + turn) % parts.len()].0.clone())
            .collect();
        let sample = decode_one(&decoder, &bytes);
        assert_eq!(
            (sample.gyro, sample.accel),
            (Some([1.0, 2.0, 3.0]), Some([4.0, 5.0, 6.0]))
        );
        assert_eq!(sample.header, Some(Nanos(1_700_000_000_000_000_005)));
        assert_eq!(decoder.frame_id(&bytes).as_deref(), Some("imu"));
    }
}

#[test]
fn zeros_that_proto3_leaves_out_are_zero_and_a_missing_vector_is_absent() {
    let fields = vec![
        Proto::field("gyro", 1, false, 11, ".p.Vec"),
        Proto::field("timestamp_us", 2, false, 4, ""),
    ];
    let set = Proto::file_set("p", vec![vector3(2), Proto::message_type("M", fields)]);
    let decoder = Decoder::compile(&channel("p.M", &set), &Options::default()).unwrap();
    let only_y = Proto::default()
        .message(1, Proto::default().float(2, 0.5))
        .varint(2, 1234);
    let sample = decode_one(&decoder, &only_y.0);
    assert_eq!(
        (sample.gyro, sample.header),
        (Some([0.0, 0.5, 0.0]), Some(Nanos(1_234_000)))
    );
    assert_eq!(
        decode_one(&decoder, &Proto::default().message(1, Proto::default()).0).gyro,
        Some([0.0; 3])
    );
    assert_eq!(decode_one(&decoder, &[]).gyro, None);
    // The wire type of another field type is an unknown field, not a number.
    let wrong = Proto::default().message(1, Proto::default().double(1, 7.0));
    assert_eq!(decode_one(&decoder, &wrong.0).gyro, Some([0.0; 3]));
}

#[test]
fn repeated_numbers_are_read_packed_and_one_by_one() {
    let fields = vec![
        Proto::field("gyro", 1, true, 2, ""),
        Proto::field("t_ns", 2, false, 4, ""),
    ];
    let set = Proto::file_set("", vec![Proto::message_type("M", fields)]);
    let decoder = Decoder::compile(&channel("M", &set), &Options::default()).unwrap();
    let packed: Vec<u8> = [1.5_f32, -2.5, 3.5]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let singly = Proto::default()
        .float(1, 1.5)
        .varint(2, 9)
        .float(1, -2.5)
        .float(1, 3.5);
    for bytes in [Proto::default().bytes(1, &packed).varint(2, 9).0, singly.0] {
        let sample = decode_one(&decoder, &bytes);
        assert_eq!(
            (sample.gyro, sample.header),
            (Some([1.5, -2.5, 3.5]), Some(Nanos(9)))
        );
    }
    let two = Proto::default().bytes(1, &packed[..8]);
    assert_eq!(
        decode_one(&decoder, &two.0).gyro,
        None,
        "two of three are none"
    );
    assert!(decode(&decoder, &Proto::default().bytes(1, &packed[..7]).0).is_err());
}

#[test]
fn a_batch_gives_one_sample_each_and_nothing_leaks_into_the_next() {
    let sample = Proto::message_type(
        "S",
        vec![
            Proto::field("gyro", 1, false, 11, ".p.Vec"),
            Proto::field("t_ns", 2, false, 4, ""),
            Proto::field("accel", 3, false, 11, ".p.Vec"),
        ],
    );
    let batch = Proto::message_type(
        "B",
        vec![
            Proto::field("samples", 4, true, 11, ".p.S"),
            Proto::field("time_ns", 1, false, 4, ""),
        ],
    );
    let set = Proto::file_set("p", vec![vector3(1), sample, batch]);
    let one = |v: [f64; 3], t| Proto::default().message(1, xyz(v)).varint(2, t);
    let bytes = Proto::default()
        .message(4, one([1.0, 2.0, 3.0], 10).message(3, xyz([7.0; 3])))
        .message(4, Proto::default().varint(2, 11))
        .message(4, one([4.0, 5.0, 6.0], 12))
        .varint(1, 99)
        .0;
    let decoder = Decoder::compile(&channel("p.B", &set), &Options::default()).unwrap();
    let read = |decoder: &Decoder| -> Vec<_> {
        decode(decoder, &bytes)
            .unwrap()
            .iter()
            .map(|s| (s.gyro, s.accel.is_some(), s.header.unwrap().0))
            .collect()
    };
    assert_eq!(
        read(&decoder),
        [
            (Some([1.0, 2.0, 3.0]), true, 10),
            (None, false, 11),
            (Some([4.0, 5.0, 6.0]), false, 12)
        ]
    );
    let outer = options(&["gyro=samples[].gyro", "stamp=time_ns:ns"]);
    let decoder = Decoder::compile(&channel("p.B", &set), &outer).unwrap();
    assert_eq!(
        read(&decoder).iter().map(|s| s.2).collect::<Vec<_>>(),
        [99; 3],
        "a stamp behind the batch"
    );
    let second =
        Decoder::compile(&channel("p.B", &set), &options(&["gyro=samples[2].gyro"])).unwrap();
    assert_eq!(read(&second), [(Some([4.0, 5.0, 6.0]), false, 12)]);
    for cut in 1..bytes.len() {
        let _ = decode(&decoder, &bytes[..cut]);
    }
    let flood = vec![[0x22_u8, 0]; 70_000].concat();
    assert!(
        decode(&decoder, &flood)
            .unwrap_err()
            .to_string()
            .contains("65536")
    );
}

#[test]
fn a_descriptor_set_without_the_message_or_with_circles_is_no_trouble() {
    let circle = Proto::message_type(
        "M",
        vec![
            Proto::field("m", 1, false, 11, ".M"),
            Proto::field("ms", 2, true, 11, ".M"),
            Proto::field("lost", 3, false, 11, ".gone.T"),
        ],
    );
    let set = Proto::file_set("", vec![circle]);
    let error = Decoder::compile(&channel("M", &set), &Options::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("no body rate"), "{error}");
    let error = Decoder::compile(&channel("N", &set), &Options::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("does not define"), "{error}");
    for cut in 1..set.len() {
        assert!(Decoder::compile(&channel("M", &set[..cut]), &Options::default()).is_err());
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_sample_of_the_protobuf_recording_equals_what_prost_reflect_reads() {
    use prost_reflect::{DescriptorPool, DynamicMessage, Value};
    let Some(messages) =
        super::recordings::messages("logs/real/xio_gait_short_walk_protobuf_batch.mcap")
    else {
        return;
    };
    let (_, channel_of) = &messages[0];
    let pool = DescriptorPool::decode(&channel_of.schema_data[..]).unwrap();
    let batch = pool.get_message_by_name("bench.ImuBatch").unwrap();
    let decoder = Decoder::compile(&channel_of.channel(), &Options::default()).unwrap();
    let field = |m: &DynamicMessage, name: &str| m.get_field_by_name(name).unwrap().into_owned();
    let inner = |m: &DynamicMessage, name: &str| match field(m, name) {
        Value::Message(m) => m,
        other => panic!("{other:?}"),
    };
    let vector = |m: &DynamicMessage| {
        ["x", "y", "z"].map(|a| f64::from(field(&inner(m, "vec"), a).as_f32().unwrap()))
    };
    let (mut total, mut repeats, mut last) = (0, 0, None);
    for (payload, _) in &messages {
        let mut samples = Vec::new();
        decoder.decode(payload, LOG, LOG, &mut samples).unwrap();
        let message = DynamicMessage::decode(batch.clone(), &payload[..]).unwrap();
        let packets = field(&message, "packets");
        let packets = packets.as_list().unwrap();
        assert_eq!(packets.len(), samples.len());
        for (packet, sample) in packets.iter().zip(&samples) {
            let packet = packet.as_message().unwrap();
            let gyro = inner(packet, "gyroscope");
            let ts = inner(&inner(&gyro, "report"), "ts");
            let nanos = field(&ts, "sec").as_i64().unwrap() * 1_000_000_000
                + field(&ts, "nsec").as_i64().unwrap();
            assert_eq!(sample.header, Some(Nanos(nanos)));
            assert_eq!(sample.gyro, Some(vector(&gyro)));
            assert_eq!(sample.accel, Some(vector(&inner(packet, "accelerometer"))));
            total += 1;
            repeats += i32::from(last == sample.header);
            last = sample.header;
        }
    }
    // 205 duplicate stamps: logs/README.md.
    assert_eq!((total, repeats), (16_539, 205));
}
