//! Packed in is lines in, packed out is lines out, to the bit; what is wrong with it is answered and
//! counted as with lines.
//!
//! The objects sent are laid out here from the table of `docs/protocol.md`, not by the daemon's encoder.

use super::client::{Client, Item, rate};
use super::daemon::{Daemon, Process, TCP, UDP, WS, eventually, listening, strapd};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::process::Command;
use std::sync::Arc;
use strapd::serve::core::hub::{Hub, Settings};
use strapd::serve::core::session::{Scratch, Session};
use strapd::serve::guard::admission::Token;
use strapd::serve::guard::limits::Limits;
use strapd_attitude::condition::StampRepair;
use strapd_attitude::record::{Nanos, Status};

const WATCH: &str = r#"{"class":"WATCH"}"#;
const WATCH_PACKED: &str = r#"{"class":"WATCH","packed":true}"#;

/// One sample, in both forms.
#[derive(Clone, Copy, Debug)]
struct Sample {
    seq: Option<u64>,
    stamp: Option<i64>,
    gyro: [f64; 3],
    accel: Option<[f64; 3]>,
    dt: Option<i64>,
}

impl Sample {
    /// Number `n` of a lively motion at 1 kHz.
    fn lively(n: u64) -> Sample {
        let t = n as f64 * 1e-3;
        Sample {
            seq: Some(n),
            stamp: Some(1_700_000_000_000_000_000 + n as i64 * 1_000_000),
            gyro: [
                0.9 * (17.0 * t + 0.3).sin() + 0.2 * (230.0 * t).cos(),
                13.0 * (9.0 * t).cos(),
                0.4 + 7.0 * (31.0 * t + 1.0).sin(),
            ],
            accel: (n % 3 != 1).then_some([0.1 * (20.0 * t).sin(), -0.0, 9.80665]),
            dt: None,
        }
    }

    fn packed(&self, stream: u32) -> Vec<u8> {
        let mut body = Vec::new();
        body.extend(self.seq.unwrap_or(u64::MAX).to_le_bytes());
        body.extend(self.stamp.unwrap_or(i64::MIN).to_le_bytes());
        let mut vector = |v: [f64; 3]| body.extend(v.iter().flat_map(|c| c.to_le_bytes()));
        vector(self.gyro);
        if self.accel.is_some() || self.dt.is_some() {
            vector(self.accel.unwrap_or([f64::NAN; 3]));
        }
        body.extend(self.dt.iter().flat_map(|dt| dt.to_le_bytes()));
        object(1, stream, &body)
    }

    fn line(&self, head: &str, gyro: &str) -> String {
        let vector = |v: [f64; 3]| {
            let c = v.map(|c| {
                if c.is_nan() {
                    "null".to_owned()
                } else {
                    format!("{c:e}")
                }
            });
            format!("[{}]", c.join(","))
        };
        let mut line = format!("{{{head},\"{gyro}\":{}", vector(self.gyro));
        if let Some(seq) = self.seq {
            line += &format!(",\"seq\":{seq}");
        }
        if let Some(stamp) = self.stamp {
            let (sec, nsec) = (
                stamp.div_euclid(1_000_000_000),
                stamp.rem_euclid(1_000_000_000),
            );
            line += &format!(",\"stamp\":{{\"sec\":{sec},\"nsec\":{nsec}}}");
        }
        if let Some(accel) = self.accel {
            line += &format!(",\"accel\":{}", vector(accel));
        }
        if let Some(dt) = self.dt {
            line += &format!(",\"dt_ns\":{dt}");
        }
        line + "}\n"
    }
}

pub(super) fn object(kind: u8, stream: u32, body: &[u8]) -> Vec<u8> {
    let [low, high] = u16::try_from(8 + body.len()).unwrap().to_le_bytes();
    let mut object = vec![0xf8, kind, low, high];
    object.extend(stream.to_le_bytes());
    object.extend_from_slice(body);
    object
}

fn bind(stream: u32, id: &str) -> String {
    format!("{{\"class\":\"PACKED\",\"stream\":{stream},\"id\":\"{id}\"}}\n")
}

fn u64_at(object: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(object[at..at + 8].try_into().unwrap())
}

fn u32_at(object: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(object[at..at + 4].try_into().unwrap())
}

/// `null`, or the number with these bits.
fn float_at(object: &[u8], at: usize) -> Value {
    json!(f64::from_bits(u64_at(object, at)))
}

fn floats_at(object: &[u8], at: usize) -> Value {
    json!([0, 8, 16].map(|n| float_at(object, at + n)))
}

fn stamp_at(object: &[u8], at: usize) -> Value {
    let stamp = u64_at(object, at).cast_signed();
    json!({"sec": stamp.div_euclid(1_000_000_000), "nsec": stamp.rem_euclid(1_000_000_000)})
}

/// The `ATT` line that says what a packed attitude says, with the labels of its stream.
fn unpacked(object: &[u8], labels: &Value) -> Value {
    assert_eq!((object[1], object.len()), (2, 112));
    assert_eq!(labels["stream"], u32_at(object, 4));
    let bits = Status(u16::try_from(u32_at(object, 104)).unwrap());
    let mut names: Vec<_> = bits.names().collect();
    if names.is_empty() {
        names.push("ok");
    }
    let q = |n: usize| float_at(object, 24 + 8 * n);
    json!({
        "class": "ATT", "id": labels["id"], "seq": u64_at(object, 8), "stamp": stamp_at(object, 16),
        "q": {"w": q(0), "x": q(1), "y": q(2), "z": q(3)},
        "rotates": labels["rotates"], "world": labels["world"], "body": labels["body"],
        "rate": floats_at(object, 56), "sigma_deg": floats_at(object, 80),
        "status": names, "reset": u32_at(object, 108),
    })
}

fn read(line: &str) -> Value {
    serde_json::from_str(line).unwrap()
}

/// The next line, of this class.
fn said(client: &mut Client, class: &str) -> Value {
    match client.item() {
        Some(Item::Line(line)) if read(&line)["class"] == class => read(&line),
        other => unreachable!("{other:?} in place of {class}"),
    }
}

/// Samples of every kind: whole ones, some missing, some late, absent, not finite, without number, a jump.
fn mixed(with_intervals: bool) -> Vec<Sample> {
    let mut samples: Vec<Sample> = (0..400).map(Sample::lively).collect();
    samples.drain(50..53);
    samples.drain(300..340);
    samples.swap(100, 101);
    samples[120].gyro[1] = f64::NAN;
    samples[130].stamp = None;
    samples[140].seq = None;
    samples[150].accel = Some([f64::NAN, 1.0, 2.0]);
    samples[160].gyro = [1e300, 0.0, 0.0];
    samples.insert(170, samples[169]);
    for sample in &mut samples[250..] {
        sample.stamp = sample.stamp.map(|s| s + 3_000_000_000);
    }
    if with_intervals {
        for sample in &mut samples {
            sample.gyro = sample.gyro.map(|c| c * 1e-3);
            sample.dt = Some(999_000);
        }
    }
    samples
}

#[test]
fn packed_or_as_lines_in_or_out_the_attitudes_are_the_same_to_the_bit_over_every_transport() {
    let dir = tempfile::tempdir().unwrap();
    for (head, gyro, binding, with_intervals) in [
        (r#""class":"RATE","id":"a""#, "gyro", r#""id":"a""#, false),
        (
            r#""class":"RATE","id":"é\"""#,
            "gyro_deg",
            r#""id":"é\"","gyro_unit":"deg""#,
            false,
        ),
        (
            r#""class":"RATE","id":"d","sample_kind":"delta-angle""#,
            "gyro",
            r#""id":"d","sample_kind":"delta-angle""#,
            true,
        ),
        (
            r#""class":"RATE","sample_kind":"rate""#,
            "gyro",
            r#""sample_kind":"rate""#,
            false,
        ),
    ] {
        let samples = mixed(with_intervals);
        let mut seen: Vec<Vec<Value>> = Vec::new();
        for (n, (way, packs, piece)) in [
            ("tcp", false, 7),
            ("tcp", true, 1),
            ("unix", true, 64),
            ("web", true, 20),
            ("udp", true, 20),
        ]
        .into_iter()
        .enumerate()
        {
            let path = dir.path().join(format!("{n}"));
            let unix = format!("unix-listen://{}", path.display());
            let mut settings = listening(&[TCP, UDP, WS, &unix]);
            // The jump is held, however long the samples before it took to come: on a busy machine, as long as by
            // their stamps, and then a clock was set.
            settings.hub.plan.stamps = StampRepair::AsRecorded;
            let daemon = Daemon::start(settings);
            let client = || match way {
                "unix" => Client::unix(&path),
                "web" => Client::web(daemon.address(2)),
                _ => Client::tcp(daemon.address(0)),
            };
            let mut lines = client().watching(WATCH);
            let mut packed = client().watching(WATCH_PACKED);
            let mut sender = match way {
                "udp" => Client::udp(daemon.address(1)),
                _ => client(),
            };
            // Over UDP no answer tells when a datagram was taken: all of them fit a socket's buffer.
            for some in samples.chunks(piece) {
                if packs {
                    // Bound anew with every piece: a datagram before it may be lost.
                    let mut bytes =
                        format!("{{\"class\":\"PACKED\",\"stream\":7,{binding}}}\n").into_bytes();
                    bytes.extend(some.iter().flat_map(|s| s.packed(7)));
                    sender.send_packed(&bytes);
                } else {
                    let text: String = some.iter().map(|s| s.line(head, gyro)).collect();
                    sender.send_bytes(text.as_bytes());
                }
            }
            eventually(
                &format!("{} samples, {way}, {binding}", samples.len()),
                || daemon.status()["sources"][0]["samples"] == samples.len(),
            );
            let source = daemon.status()["sources"][0].clone();
            let count = source["attitudes"].as_u64().unwrap();
            assert!(count > 300, "{source}");
            let labels = said(&mut packed, "PACKED");
            let mut got = Vec::new();
            for _ in 0..count {
                let line = said(&mut lines, "ATT");
                assert_eq!(unpacked(&packed.packed(), &labels), line);
                got.push(line);
            }
            let told = ["counts", "missing", "sample_kind", "gyro_unit", "reset"];
            got.push(told.map(|name| source[name].clone()).into());
            seen.push(got);
        }
        let statuses: Vec<String> = seen[0].iter().map(|v| v["status"].to_string()).collect();
        for name in ["bridged", "held", "rejected-before"] {
            assert!(statuses.iter().any(|s| s.contains(name)), "{name}");
        }
        for other in &seen[1..] {
            assert!(
                *other == seen[0],
                "{binding}: {:?} {:?}",
                other.last(),
                seen[0].last()
            );
        }
    }
}

#[test]
fn a_packed_watch_is_answered_with_its_form_and_each_stream_is_named_once_before_its_first_object()
{
    let daemon = Daemon::tcp();
    let mut client = Client::tcp(daemon.address(0));
    said(&mut client, "VERSION");
    client.send(r#"{"class":"WATCH","packed":true,"rate_hz":50}"#);
    let answer = said(&mut client, "WATCH");
    assert_eq!(
        (&answer["packed"], &answer["rate_hz"]),
        (&json!(true), &json!(50.0))
    );
    client.send(WATCH_PACKED);
    assert_eq!(said(&mut client, "WATCH")["packed"], true);
    // Lines and objects in one stream of bytes, and one connection that is both.
    let mut bytes = Vec::new();
    for (n, id) in ["a", "b"].into_iter().enumerate() {
        bytes.extend(bind(n as u32, id).into_bytes());
        bytes.extend(Sample::lively(0).packed(n as u32));
    }
    bytes.extend(Sample::lively(1).packed(0));
    bytes.extend_from_slice(b"\n");
    bytes.extend(
        Sample::lively(2)
            .line(r#""class":"RATE","id":"a""#, "gyro")
            .into_bytes(),
    );
    bytes.extend(Sample::lively(3).packed(0));
    client.send_bytes(&bytes);
    let mut labels = std::collections::BTreeMap::new();
    let mut seqs = Vec::new();
    while seqs.len() < 5 {
        match client.item().unwrap() {
            Item::Line(line) => {
                let label = read(&line);
                assert_eq!(label["class"], "PACKED", "{line}");
                assert_eq!(
                    (&label["rotates"], &label["world"], &label["body"]),
                    (&json!("sensor_to_world"), &json!("start"), &json!("flu"))
                );
                let stream = label["stream"].as_u64().unwrap() as u32;
                assert!(
                    labels.insert(stream, label["id"].clone()).is_none(),
                    "named twice"
                );
            }
            Item::Packed(object) => {
                let id = &labels[&u32_at(&object, 4)];
                seqs.push((id.as_str().unwrap().to_owned(), u64_at(&object, 8)));
            }
        }
    }
    seqs.sort();
    let expected = [("a", 0), ("a", 1), ("a", 2), ("a", 3), ("b", 0)];
    assert!(
        seqs.iter().map(|(id, n)| (id.as_str(), *n)).eq(expected),
        "{seqs:?}"
    );
    // Back to lines, and what is no stream of this connection stays unnamed.
    client.send(WATCH);
    assert_eq!(said(&mut client, "WATCH")["packed"], Value::Null);
    client.send(&rate("a", 4, 1.0));
    assert_eq!(said(&mut client, "ATT")["seq"], 4);
    client.send(WATCH_PACKED);
    said(&mut client, "WATCH");
    client.send(&rate("a", 5, 1.0));
    assert_eq!(u64_at(&client.packed(), 8), 5);
}

#[test]
fn thinned_packed_attitudes_are_the_thinned_lines() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let thin = r#"{"class":"WATCH","rate_hz":30,"id":"a""#;
    let mut lines = Client::tcp(daemon.address(0)).watching(&format!("{thin}}}"));
    let mut packed = Client::web(daemon.address(1)).watching(&format!("{thin},\"packed\":true}}"));
    let mut sender = Client::tcp(daemon.address(0));
    for n in 0..1000 {
        sender.send(&rate("a", n, 2.0));
        sender.send(&rate("b", n, 2.0));
    }
    let labels = said(&mut packed, "PACKED");
    for _ in 0..30 {
        assert_eq!(unpacked(&packed.packed(), &labels), said(&mut lines, "ATT"));
    }
}

#[test]
fn what_is_wrong_with_an_object_is_answered_with_its_place_and_the_next_one_counts() {
    let daemon = Daemon::tcp();
    let mut client = Client::tcp(daemon.address(0)).watching(WATCH);
    // WATCH was the first; the objects count with the lines.
    client.send_bytes(&[bind(1, "a").into_bytes(), Sample::lively(0).packed(1)].concat());
    client.object("ATT");
    let good = Sample::lively(1).packed(1);
    let attitude = object(2, 1, &[0; 104]);
    let whole = |bytes: &[u8]| bytes.to_vec();
    for (number, (bytes, code, words)) in (4..).zip([
        (Sample::lively(1).packed(2), "unknown_stream", "number 2 is"),
        (object(9, 1, &[b'\n'; 40]), "bad_packed", "kind 9"),
        (attitude, "bad_packed", "kind 2 (ATT)"),
        (object(1, 1, &[0; 39]), "bad_packed", "47 bytes, need 48"),
        (
            whole(b"\xf8\x01\x07\0 all of it \xf8 up to here\n"),
            "bad_packed",
            "less than 8",
        ),
        (
            whole(b"{\"class\":\"PACKED\"}\n"),
            "bad_packed",
            "missing field",
        ),
        (whole(b"x\xf8\n"), "bad_json", "column 2"),
    ]) {
        client.send_bytes(&bytes);
        let error = client.object("ERROR");
        assert_eq!(
            (&error["code"], &error["line"]),
            (&json!(code), &json!(number)),
            "{error}"
        );
        assert!(
            error["message"].as_str().unwrap().contains(words),
            "{error}"
        );
    }
    client.send_bytes(&good);
    let att = client.object("ATT");
    assert_eq!(att["seq"], 1);
    assert_eq!(att["status"], json!(["rejected-before", "provisional"]));
    let status = daemon.status();
    assert_eq!(status["sources"][0]["counts"]["undecodable"], 7);
    assert_eq!(status["counters"]["lines"], 11);
    // A client that ends within an object has sent a bad one.
    client.send_bytes(&good[..20]);
    client.shut();
    assert_eq!(client.object("ERROR")["line"], 12);
}

#[test]
fn twenty_one_bad_objects_in_a_row_close_the_connection_and_good_ones_make_up_for_bad_ones() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut patient = Client::web(daemon.address(1));
    patient.object("VERSION");
    patient.send(bind(1, "a").trim_end());
    for n in 0..3 {
        let bad = object(9, 1, &[]).repeat(20);
        patient.send_packed(&[bad, Sample::lively(n).packed(1)].concat());
        for _ in 0..20 {
            assert_eq!(patient.object("ERROR")["code"], "bad_packed");
        }
    }
    // The end of a message is the end of what is skipped, and of what is cut short.
    patient.send_packed(b"\xf8\x01\0\0 \xf8 ");
    patient.send_packed(&Sample::lively(3).packed(1)[..47]);
    patient.send_packed(&Sample::lively(3).packed(1));
    assert_eq!(patient.object("ERROR")["code"], "bad_packed");
    assert_eq!(patient.object("ERROR")["code"], "bad_packed");
    // Before the first sample nobody knew whose the bad ones were.
    eventually("four samples", || {
        daemon.status()["sources"][0]["samples"] == 4 + 42
    });
    let mut other = Client::tcp(daemon.address(0));
    other.send_bytes(&Sample::lively(0).packed(1).repeat(500));
    let said = other.rest();
    assert_eq!(said.len(), 1 + 21 + 1, "greeting, errors, reason");
    assert_eq!(said.last().unwrap()["code"], "too_many_errors");
}

#[test]
fn numbers_are_of_one_connection_may_be_bound_anew_and_are_at_most_256() {
    let daemon = Daemon::tcp();
    let mut watcher = Client::tcp(daemon.address(0)).watching(WATCH);
    let mut client = Client::tcp(daemon.address(0));
    client.object("VERSION");
    for (id, n) in [("a", 0), ("b", 0), ("a", 1)] {
        client.send_bytes(&[bind(5, id).into_bytes(), Sample::lively(n).packed(5)].concat());
        let att = watcher.object("ATT");
        assert_eq!((&att["id"], &att["seq"]), (&json!(id), &json!(n)));
    }
    let mut other = Client::tcp(daemon.address(0));
    other.object("VERSION");
    other.send_bytes(&Sample::lively(2).packed(5));
    assert_eq!(other.object("ERROR")["code"], "unknown_stream");
    // The rules of lines: a sensor has one sender, and one meaning.
    other.send_bytes(&[bind(5, "a").into_bytes(), Sample::lively(2).packed(5)].concat());
    assert_eq!(other.object("ERROR")["code"], "id_in_use");
    client.send(r#"{"class":"PACKED","stream":6,"id":"a","sample_kind":"rotation"}"#);
    client.send_bytes(&Sample::lively(2).packed(6));
    assert_eq!(client.object("ERROR")["code"], "meaning_changed");
    for stream in 7..261 {
        client.send(bind(stream, "c").trim_end());
    }
    client.send(bind(261, "c").trim_end());
    let error = client.object("ERROR");
    assert_eq!(error["code"], "bad_packed");
    assert!(error["message"].to_string().contains("256"), "{error}");
    client.send(bind(260, "c").trim_end());
    client.send_bytes(&Sample::lively(0).packed(260));
    assert_eq!(watcher.object("ATT")["id"], "c");
}

#[test]
fn more_packed_streams_at_once_than_replies_may_wait_are_all_named() {
    let daemon = Daemon::tcp();
    let mut watcher = Client::tcp(daemon.address(0)).watching(WATCH_PACKED);
    let mut sender = Client::tcp(daemon.address(0));
    let mut bytes = Vec::new();
    for stream in 0..200 {
        bytes.extend(bind(stream, &format!("s{stream}")).into_bytes());
        bytes.extend(Sample::lively(0).packed(stream));
    }
    sender.send_bytes(&bytes);
    let mut named = std::collections::BTreeSet::new();
    let mut seen = 0;
    while seen < 200 {
        match watcher.item().unwrap() {
            Item::Line(line) => assert!(named.insert(read(&line)["stream"].as_u64().unwrap())),
            Item::Packed(object) => {
                assert!(
                    named.contains(&u64::from(u32_at(&object, 4))),
                    "not named before"
                );
                seen += 1;
            }
        }
    }
    assert_eq!(named.len(), 200);
}

#[test]
fn a_fleet_comes_through_one_connection_up_to_a_quarter_of_all_places() {
    let mut settings = listening(&[TCP]);
    settings.hub.limits = Limits::of_sensors(8000);
    let daemon = Daemon::start(settings);
    let mut gateway = Client::tcp(daemon.address(0));
    gateway.object("VERSION");
    for block in 0..20 {
        let of_block = block * 100..(block + 1) * 100;
        let bytes: Vec<u8> = of_block
            .flat_map(|n| {
                let named = bind(n, &format!("s{n}")).into_bytes();
                [named, Sample::lively(0).packed(n)].concat()
            })
            .collect();
        gateway.send_bytes(&bytes);
    }
    gateway.send(bind(2000, "one more").trim_end());
    let error = gateway.object("ERROR");
    assert_eq!(error["code"], "bad_packed");
    assert!(error["message"].to_string().contains("2000"), "{error}");
    let sources = daemon.status()["sources"].clone();
    let sources = sources.as_array().unwrap();
    assert_eq!(sources.len(), 2000);
    let taken = |source: &Value| source["counts"]["accepted"] == 1;
    assert!(sources.iter().all(taken), "{sources:?}");
}

#[test]
fn where_a_token_is_asked_for_a_packed_object_is_no_way_in() {
    let mut settings = listening(&[TCP]);
    settings.hub.token = Some(Token::new("0123456789abcdef"));
    let daemon = Daemon::start(settings);
    for first in [Sample::lively(0).packed(1), bind(1, "a").into_bytes()] {
        let mut client = Client::tcp(daemon.address(0));
        client.object("VERSION");
        client.send_bytes(&first);
        assert_eq!(client.object("ERROR")["code"], "unauthorised");
        assert_eq!(client.rest(), [Value::Null; 0]);
    }
    assert_eq!(daemon.status()["sources"], json!([]));
}

/// `strapd ARGS` in one go: what it writes.
fn output(args: &[&str]) -> String {
    let output = Command::new(strapd()).args(args).output().unwrap();
    assert!(output.status.success(), "{args:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The `RATE` line that says what a packed sample says.
fn unpacked_sample(object: &[u8], label: &Value) -> Value {
    assert_eq!(
        (object[1], label["stream"].as_u64()),
        (1, Some(u32_at(object, 4).into()))
    );
    let mut line = json!({
        "class": "RATE", "id": label["id"], "seq": u64_at(object, 8), "stamp": stamp_at(object, 16),
        "gyro": floats_at(object, 24),
    });
    if object.len() > 48 && !floats_at(object, 48)[0].is_null() {
        line["accel"] = floats_at(object, 48);
    }
    if object.len() > 72 {
        line["dt_ns"] = u64_at(object, 72).cast_signed().into();
    }
    line["sample_kind"] = label["sample_kind"].clone();
    line
}

#[test]
fn a_simulation_packs_its_samples_and_its_truth_and_takes_no_samples() {
    for kind in ["rate", "delta-angle"] {
        let run = [
            "simulate",
            "coning",
            "--rate-hz",
            "200",
            "--duration",
            "2",
            "--sample-kind",
            kind,
        ];
        let expected = output(&[&run[..], &["-o", "-"]].concat());
        let expected: Vec<Value> = expected.lines().map(read).collect();
        let serving = ["-o", TCP, "-o", WS, "--speed", "10", "--paused"];
        let mut process = Process::of(&[&run[..], &serving].concat());
        let mut client = Client::web(process.address(1)).watching(WATCH_PACKED);
        client.send(bind(1, "a").trim_end());
        client.send_packed(&Sample::lively(0).packed(1));
        assert_eq!(client.next_of("ERROR")["code"], "samples_not_taken");
        client.send(r#"{"class":"PLAYBACK","action":"play"}"#);
        let mut labels = std::collections::BTreeMap::new();
        let mut got = Vec::new();
        while let Some(item) = client.item() {
            match item {
                Item::Line(line) => {
                    let said = read(&line);
                    match said["class"].as_str().unwrap() {
                        "PACKED" => drop(labels.insert(said["stream"].as_u64().unwrap(), said)),
                        class => assert_eq!(class, "PLAYBACK"),
                    }
                }
                Item::Packed(object) => {
                    let label = &labels[&u64::from(u32_at(&object, 4))];
                    got.push(match object[1] {
                        1 => unpacked_sample(&object, label),
                        _ => unpacked(&object, label),
                    });
                }
            }
        }
        for class in ["RATE", "ATT"] {
            let of = |all: &[Value]| -> Vec<Value> {
                all.iter()
                    .filter(|v| v["class"] == class)
                    .cloned()
                    .collect()
            };
            assert!(of(&expected).len() > 300, "{class} {}", expected.len());
            assert!(of(&got) == of(&expected), "{class} of {kind}");
        }
        assert_eq!(process.exit(), Some(0));
    }
}

#[test]
fn a_packed_watcher_that_stalls_is_told_what_it_lost_and_every_other_object_is_whole() {
    let hub = Arc::new(Hub::new(Settings::default()).unwrap());
    let mut scratch = Scratch::default();
    let mut sender = Session::new(&hub, "sender".to_owned(), true);
    let mut watcher = Session::new(&hub, "watcher".to_owned(), true);
    watcher.bytes(
        format!("{WATCH_PACKED}\n").as_bytes(),
        Nanos(0),
        &mut scratch,
    );
    sender.bytes(bind(1, "a").as_bytes(), Nanos(0), &mut scratch);
    let count = 10_000;
    for n in 0..count {
        sender.bytes(&Sample::lively(n).packed(1), Nanos(0), &mut scratch);
    }
    let mut parts = VecDeque::new();
    watcher.client().outbox.take(usize::MAX, &mut parts);
    let (packed, lines): (Vec<_>, Vec<_>) = parts.into_iter().partition(|part| part[0] == 0xf8);
    let lines: Vec<Value> = lines
        .iter()
        .map(|l| serde_json::from_slice(l).unwrap())
        .collect();
    let classes: Vec<_> = lines.iter().filter_map(|v| v["class"].as_str()).collect();
    assert_eq!(classes, ["VERSION", "WATCH", "PACKED", "GAP"]);
    let dropped = lines[3]["dropped"].as_u64().unwrap();
    assert_eq!(lines[3]["last_seq"], dropped - 1);
    let packed = packed.concat();
    let seqs: Vec<u64> = packed.chunks(112).map(|object| u64_at(object, 8)).collect();
    assert!(seqs.into_iter().eq(dropped..count));
    assert!(packed.len() <= 256 << 10 && packed.len() > 255 << 10);
}
