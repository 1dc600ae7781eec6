//! Bytes nobody made on purpose: no panic, no hang, no memory without bound.

use super::writer::*;
use super::{LOG, channel, options};
use crate::meter::Meter;
use proptest::prelude::*;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Duration;
use strapd_recording::decode::{Channel, Decoder, MAX_BATCH, Options, decode_line, role};

/// A payload and the decoder it was made for, one of each kind.
fn corpus() -> Vec<(Decoder, Vec<u8>)> {
    let compile = |c: &Channel<'_>, fields: &[&str]| Decoder::compile(c, &options(fields)).unwrap();
    let rig = format!(
        "string[] words\nsensor_msgs/Imu[] imus\nfloat32[] data\n{}",
        imu_section()
    );
    let rig_payload = Writer::cdr(false)
        .u32(2)
        .string("a")
        .string("")
        .u32(2)
        .imu("x")
        .imu("yy")
        .u32(3)
        .f32s(&[1.0; 3]);
    let set = Proto::file_set(
        "p",
        vec![
            Proto::message_type(
                "S",
                vec![
                    Proto::field("gyro", 1, true, 2, ""),
                    Proto::field("t", 2, false, 4, ""),
                ],
            ),
            Proto::message_type("B", vec![Proto::field("samples", 4, true, 11, ".p.S")]),
        ],
    );
    let sample = Proto::default().bytes(1, &[0; 12]).varint(2, 300);
    let proto = Channel {
        topic: "/p",
        message_encoding: "protobuf",
        schema_name: "p.B",
        schema_encoding: "protobuf",
        schema_data: &set,
    };
    let json = br#"{"header":{"stamp":{"sec":1,"nanosec":2},"frame_id":"a\u00e9"},"angular_velocity":{"x":1.5,"y":-2e-3,"z":3},"items":[{"gyro":[1,2,3]}],"orientation":{"x":0,"y":0,"z":0,"w":1}}"#;
    vec![
        (
            compile(&channel("cdr", "sensor_msgs/msg/Imu", IMU), &[]),
            Writer::cdr(false).imu("imu_link").bytes,
        ),
        (
            compile(&channel("cdr", "sensor_msgs/msg/Imu", IMU), &[]),
            Writer::cdr(true).imu("imu_link").bytes,
        ),
        (
            compile(&channel("cdr", "a/msg/Rig", &rig), &[]),
            rig_payload.clone().bytes,
        ),
        (
            compile(&channel("cdr", "a/msg/Rig", &rig), &["gyro=data"]),
            rig_payload.bytes,
        ),
        (
            compile(&channel("cdr", "tf2_msgs/msg/TFMessage", ""), &[]),
            Writer::cdr(false)
                .u32(1)
                .header(1, 2, "a")
                .string("b")
                .f64s(&[1.0; 7])
                .bytes,
        ),
        (
            compile(&channel("ros1", "sensor_msgs/Imu", ""), &[]),
            Writer::ros1().imu("imu").bytes,
        ),
        (
            compile(&proto, &[]),
            Proto::default()
                .message(4, sample.clone())
                .message(4, sample)
                .0,
        ),
        (compile(&channel("json", "", ""), &[]), json.to_vec()),
        (
            compile(
                &channel("json", "", ""),
                &["gyro=items[].gyro", "stamp=header.stamp"],
            ),
            json.to_vec(),
        ),
    ]
}

fn mutate(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(1..6) {
        let at = rng.random_range(0..bytes.len().max(1)).min(bytes.len());
        match rng.random_range(0..6) {
            0 if !bytes.is_empty() => {
                let last = bytes.len() - 1;
                bytes[at.min(last)] ^= 1 << rng.random_range(0..8);
            }
            1 => bytes.truncate(at),
            2 => bytes.insert(at, rng.random()),
            3 => {
                // A count that promises the world.
                let end = (at + 4).min(bytes.len());
                bytes[at..end].fill(if rng.random() { 0xff } else { 0x7f });
            }
            4 => {
                let end = (at + rng.random_range(0..20)).min(bytes.len());
                bytes.drain(at..end);
            }
            _ => {
                let copy = bytes[at..(at + 8).min(bytes.len())].to_vec();
                bytes.splice(at..at, copy);
            }
        }
    }
}

#[test]
fn a_hundred_thousand_mutated_payloads_do_no_harm() {
    let corpus = corpus();
    // A fixed generator: the same bytes everywhere, every time.
    let mut rng = ChaCha8Rng::seed_from_u64(42);
    let mut out = Vec::new();
    let (mut good, mut bad) = (0, 0);
    let mut meter = Meter::start();
    for round in 0..100_000 {
        let (decoder, payload) = &corpus[round % corpus.len()];
        let mut payload = payload.clone();
        mutate(&mut payload, &mut rng);
        out.clear();
        match decoder.decode(&payload, LOG, LOG, &mut out) {
            Ok(outcome) => {
                assert_eq!(outcome.samples, out.len());
                good += 1;
            }
            Err(error) => {
                assert!(out.is_empty() && !error.to_string().is_empty());
                bad += 1;
            }
        }
        let _ = decoder.frame_id(&payload);
        let _ = decode_line(&payload, LOG, &mut out);
        // A payload of this size takes microseconds; a loop over a forged count would take minutes.
        meter.lap(Duration::from_secs(2), format_args!("{payload:?}"));
    }
    assert!(
        good > 10_000 && bad > 10_000,
        "{good} good, {bad} bad: the mutations reach both sides"
    );
}

#[test]
fn random_bytes_do_no_harm() {
    let corpus = corpus();
    let mut rng = ChaCha8Rng::seed_from_u64(43);
    let mut out = Vec::new();
    for round in 0..50_000 {
        let mut payload = vec![0; rng.random_range(0..400)];
        rng.fill_bytes(&mut payload);
        if let (true, Some(head)) = (round % 2 == 0, payload.get_mut(..4)) {
            head.copy_from_slice(&[0, 1, 0, 0]);
        }
        out.clear();
        let _ = corpus[round % corpus.len()]
            .0
            .decode(&payload, LOG, LOG, &mut out);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]
    #[test]
    fn schemas_of_any_text_do_no_harm(text in "((float64|uint8|string|wstring|A|B|a/A|time)(\\[[0-9]{0,3}\\])? (gyro|stamp|x|y|z|header)\n|=====\nMSG: (a/A|a/B)\n|[ -~]{0,8}\n){0,12}", payload in proptest::collection::vec(any::<u8>(), 0..200), encoding in "cdr|ros1|json|protobuf") {
        for schema_encoding in ["ros2msg", "ros2idl"] {
            let channel = Channel { schema_encoding, ..channel(&encoding, "a/A", &text) };
            let _ = role(&channel, Some((&payload, LOG)));
            if let Ok(decoder) = Decoder::compile(&channel, &Options::default()) {
                let mut out = Vec::new();
                let _ = decoder.decode(&payload, LOG, LOG, &mut out);
                let _ = decoder.frame_id(&payload);
            }
        }
    }

    #[test]
    fn idl_of_any_text_does_no_harm(text in "((module|struct|typedef|enum|const|@key|sequence<|double|long|string<|A|B|::|\\{|\\}|;|\\[9\\]|>|,|\"|/\\*) ?){0,40}") {
        let channel = Channel { schema_encoding: "ros2idl", ..channel("cdr", "A", &text) };
        let _ = role(&channel, None);
    }
}

#[test]
fn schemas_that_grow_without_end_are_refused_quickly() {
    let mut meter = Meter::start();
    // Ten fields of ten fields of ...: 10^40 fields in 4 kB.
    let mut tree = "T0 a\nfloat64[3] gyro\n".to_owned();
    for level in 0..40 {
        let fields: String = (0..10).map(|n| format!("T{} f{n}\n", level + 1)).collect();
        tree += &section(&format!("a/T{level}"), &fields);
    }
    tree += &section("a/T40", "float64 x");
    let circle = format!("a/C c\nfloat64[3] gyro{}", section("a/C", "a/C c\nuint8 x"));
    let own = "a/Own c\nfloat64[3] gyro".to_owned();
    let arrays = format!(
        "a/D[4294967295] d\nfloat64[3] gyro{}",
        section("a/D", "a/E[4294967295] e") + &section("a/E", "string[4294967295] f")
    );
    let long = format!("float64[3] {}", "g".repeat(900_000));
    for text in [
        tree,
        circle,
        own,
        long,
        "float64[3] gyro\n".repeat(60_000),
        "=".repeat(1 << 21),
    ] {
        let error = Decoder::compile(&channel("cdr", "a/Own", &text), &Options::default());
        assert!(error.is_err(), "{:.60}", text);
    }
    // Legal, and no payload can fill it.
    let decoder = Decoder::compile(&channel("cdr", "a/Own", &arrays), &Options::default()).unwrap();
    assert!(
        decoder
            .decode(&[0, 1, 0, 0, 9, 9, 9, 9], LOG, LOG, &mut Vec::new())
            .is_err()
    );
    // Empty ROS 1 messages take no bytes: four billion of them are gone over at once.
    let empty = format!(
        "a/E[] e\na/E[4294967295] f\nfloat64[3] gyro{}",
        section("a/E", "# nothing")
    );
    let decoder = Decoder::compile(&channel("ros1", "a/Own", &empty), &Options::default()).unwrap();
    let payload = Writer::ros1().u32(u32::MAX).f64s(&GYRO).bytes;
    let mut out = Vec::new();
    decoder.decode(&payload, LOG, LOG, &mut out).unwrap();
    assert_eq!(out[0].gyro, Some(GYRO));
    meter.lap(Duration::from_secs(5), "all of these");
}

/// A megabyte each that costs minutes where work grows as the square of the length: the same tokens as in any
/// schema, but on one line, under one long name, or of one name again and again. `growth.rs` counts instructions;
/// this has room for a slow machine.
#[test]
fn long_schemas_are_read_in_time_that_grows_as_they_do() {
    const LENGTH: usize = 1_000_000;
    let fill = |head: &str, piece: &str, tail: &str| {
        let times = (LENGTH - head.len() - tail.len()) / piece.len();
        format!("{head}{}{tail}", piece.repeat(times))
    };
    let long = "n".repeat(250);
    let modules: String = (0..30).map(|_| format!("module {long} {{ ")).collect();
    let path = format!("{long}::").repeat(LENGTH / 2 / 252);
    let typedefs: String = (0..19_000)
        .map(|n| format!("typedef T{n} T{}; ", n + 1))
        .collect();
    let idl = [
        fill("struct A { double x; }; ", "; ", ""),
        fill("struct A { double x; }; ", "const long a = 1; ", ""),
        fill(&modules, "struct A { B b; }; ", ""),
        fill(&format!("struct A {{ {path}B "), "a,", "b; };"),
        format!("{typedefs} struct A {{ {} }};", "T19000 a; ".repeat(900)),
        fill("struct A { T9 x; }; ", "module a{};", ""),
    ];
    let package = "p".repeat(LENGTH / 2);
    let rosmsg = format!(
        "float64 x\n=====\nMSG: {package}/A\n{}",
        "B b\n".repeat(19_000)
    );
    let keys = |n| format!("\"{}\":", "k".repeat(n));
    let json = format!("{{{}", keys(250)).repeat(5)
        + "{"
        + &format!("{}{{}},", keys(0)).repeat(LENGTH / 6);
    let channels = idl
        .iter()
        .map(|text| Channel {
            schema_encoding: "ros2idl",
            ..channel("cdr", "a/msg/A", text)
        })
        .chain([
            channel("cdr", "a/msg/A", &rosmsg),
            channel("json", "A", &json),
        ]);
    for (n, channel) in channels.enumerate() {
        let mut meter = Meter::start();
        let _ = role(&channel, None);
        let secs = meter.lap(Duration::from_secs(5), n);
        eprintln!("{n}: {} bytes in {secs:?}", channel.schema_data.len());
    }
}

#[test]
fn a_batch_has_a_limit_and_beyond_it_nothing_is_pushed() {
    let text = format!("a/S[] samples{}", section("a/S", "uint8[3] gyro"));
    let decoder = Decoder::compile(&channel("cdr", "a/B", &text), &Options::default()).unwrap();
    for (n, ok) in [(MAX_BATCH, true), (MAX_BATCH + 1, false)] {
        let mut payload = Writer::cdr(false).u32(n as u32).bytes;
        payload.resize(8 + 3 * n, 1);
        let mut out = Vec::new();
        let result = decoder.decode(&payload, LOG, LOG, &mut out);
        assert_eq!((result.is_ok(), out.len()), (ok, if ok { n } else { 0 }));
    }
}
