//! Packed in is lines in, packed out is lines out, to the bit; what is wrong with it is answered and
//! counted as with lines.
//!
//! The objects sent are laid out here from the table of `docs/protocol.md`, not by the daemon's encoder.

use super::client::{Client, Item, rate};
use super::daemon::{Daemon, TCP, UDP, WS, eventually, listening};
use serde_json::{Value, json};
use strapd::record::Status;

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
            accel: (n % 3 > 0).then_some([0.1 * (20.0 * t).sin(), -0.0, 9.80665]),
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

fn object(kind: u8, stream: u32, body: &[u8]) -> Vec<u8> {
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
            r#""class":"RATE""#,
            "gyro",
            r#""sample_kind":"rate""#,
            false,
        ),
    ] {
        let mut samples = mixed(with_intervals);
        if gyro != "gyro" {
            // A line whose `gyro_deg` is null states no unit, and so that of its class.
            samples.retain(|s| !s.gyro[1].is_nan());
        }
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
            let daemon = Daemon::start(listening(&[TCP, UDP, WS, &unix]));
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
                if way == "udp" {
                    // No answer tells when one was taken.
                    std::thread::sleep(std::time::Duration::from_millis(2));
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
