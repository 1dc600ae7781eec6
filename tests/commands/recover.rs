//! Promise: `strapd recover` carries everything that is intact in a damaged log into an intact one, as it
//! was and in its order, and says what was lost.

mod command;
mod damage;
mod oracle;

use crate::mcap_logs::{Packing, Read, log, messages};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use strapd::pipeline::recover::{Recover, Recovered, run};
use strapd::sink::{Options, Target};
use strapd_recording::Source;
use strapd_recording::mcap::{Message, Order, Reader, Survey, WalkOptions, walk};
use strapd_recording::pool::Pool;

/// Recovers `input` into `output` on so many threads.
fn recover(input: &Path, output: &Path, threads: usize) -> Recovered {
    let wanted = Recover {
        source: Source::File(input.to_owned()),
        target: Target::parse(output.to_str().unwrap()).unwrap(),
        options: Options {
            force: true,
            ..Options::default()
        },
    };
    run(&wanted, &Pool::new(threads).unwrap(), &mut |_| {}).unwrap()
}

/// A message with all its numbers: topic, log time, publish time, sequence, payload.
type Whole = (String, u64, u64, u32, Vec<u8>);

/// Messages that the guarded walk yields, in file order.
fn walked(path: &Path) -> (Vec<Whole>, Survey) {
    let mut all = Vec::new();
    let options = WalkOptions {
        order: Order::File,
        ..WalkOptions::default()
    };
    let report = walk(
        Reader::open(path).unwrap(),
        &options,
        |_| Some(()),
        |(), m: &Message<'_>, out: &mut Vec<Whole>| {
            let topic = m.channel.topic.clone();
            let data = m.data.to_vec();
            out.push((topic, m.log_time, m.publish_time, m.sequence, data));
        },
        |batch| {
            all.append(batch);
            ControlFlow::Continue(())
        },
    )
    .unwrap();
    (all, report.survey)
}

/// Messages that the `mcap` crate reads, in file order; its summary must hold together and count the same.
fn by_the_crate(bytes: &[u8]) -> Vec<Whole> {
    let summary = mcap::Summary::read(bytes).unwrap().expect("a summary");
    let all: Vec<Whole> = mcap::MessageStream::new(bytes)
        .unwrap()
        .map(|m| {
            let m = m.unwrap();
            let topic = m.channel.topic.clone();
            (
                topic,
                m.log_time,
                m.publish_time,
                m.sequence,
                m.data.to_vec(),
            )
        })
        .collect();
    let indexed: usize = summary
        .chunk_indexes
        .iter()
        .map(|index| summary.stream_chunk(bytes, index).unwrap().count())
        .sum();
    let counted = summary.stats.as_ref().unwrap().message_count;
    assert_eq!((indexed, counted), (all.len(), all.len() as u64));
    all
}

/// Channels by the `mcap` crate: topic, encoding, metadata, name, encoding and text of the schema.
type Channels = Vec<(
    String,
    String,
    BTreeMap<String, String>,
    Option<(String, String, Vec<u8>)>,
)>;

fn channels(bytes: &[u8]) -> Channels {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let mut all: Channels = summary
        .channels
        .values()
        .map(|c| {
            let schema = c.schema.as_ref();
            (
                c.topic.clone(),
                c.message_encoding.clone(),
                c.metadata.clone(),
                schema.map(|s| (s.name.clone(), s.encoding.clone(), s.data.to_vec())),
            )
        })
        .collect();
    all.sort();
    all
}

/// A log of messages, with two attachments and a metadata record between and behind them.
fn furnished(packing: Packing, n: u32) -> Vec<u8> {
    let options = mcap::WriteOptions::new()
        .use_chunks(packing.is_some())
        .compression(packing.flatten())
        .compression_threads(0)
        .chunk_size(Some(700))
        .profile("ros2");
    let mut writer = options.create(std::io::Cursor::new(Vec::new())).unwrap();
    let schema = writer
        .add_schema("pkg/Type", "ros2msg", b"uint8 x")
        .unwrap();
    let qos = BTreeMap::from([("offered_qos_profiles".to_owned(), "- history: 1".to_owned())]);
    let ids = [
        writer.add_channel(schema, "/imu", "cdr", &qos).unwrap(),
        writer
            .add_channel(0, "/other", "json", &BTreeMap::new())
            .unwrap(),
    ];
    for (i, (topic, log_time, sequence, data)) in messages(n, 0).into_iter().enumerate() {
        let header = mcap::records::MessageHeader {
            channel_id: ids[usize::from(topic == "/other")],
            sequence,
            log_time,
            publish_time: log_time + 5,
        };
        writer.write_to_known_channel(&header, &data).unwrap();
        if i == 20 || i == 40 {
            let attachment = mcap::Attachment {
                log_time,
                create_time: 3,
                name: format!("calibration {i}"),
                media_type: "text/plain".to_owned(),
                data: std::borrow::Cow::Owned(vec![i as u8; 90]),
            };
            writer.attach(&attachment).unwrap();
            let metadata = BTreeMap::from([("run".to_owned(), i.to_string())]);
            let name = "session".to_owned();
            writer
                .write_metadata(&mcap::records::Metadata { name, metadata })
                .unwrap();
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// Attachments (name, media type, times, data) and metadata records by the `mcap` crate, in file order.
type Extras = (
    Vec<(String, String, u64, u64, Vec<u8>)>,
    Vec<(String, BTreeMap<String, String>)>,
);

fn extras(bytes: &[u8]) -> Extras {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let attachments = summary
        .attachment_indexes
        .iter()
        .map(|index| {
            let a = mcap::read::attachment(bytes, index).unwrap();
            (
                a.name,
                a.media_type,
                a.log_time,
                a.create_time,
                a.data.into_owned(),
            )
        })
        .collect();
    let metadata = summary
        .metadata_indexes
        .iter()
        .map(|index| {
            let m = mcap::read::metadata(bytes, index).unwrap();
            (m.name, m.metadata)
        })
        .collect();
    (attachments, metadata)
}

#[test]
fn a_healthy_log_comes_out_with_all_it_holds_and_nothing_said() {
    let dir = tempfile::tempdir().unwrap();
    let (input, output) = (dir.path().join("in.mcap"), dir.path().join("out.mcap"));
    for (name, packing) in crate::mcap_logs::PACKINGS {
        let bytes = furnished(packing, 60);
        std::fs::write(&input, &bytes).unwrap();
        let recovered = recover(&input, &output, 2);
        assert!(!recovered.was_damaged(), "{name}: {recovered:?}");
        let out = std::fs::read(&output).unwrap();
        let of_input: Vec<Whole> = mcap::MessageStream::new(&bytes)
            .unwrap()
            .map(|m| m.unwrap())
            .map(|m| {
                (
                    m.channel.topic.clone(),
                    m.log_time,
                    m.publish_time,
                    m.sequence,
                    m.data.to_vec(),
                )
            })
            .collect();
        assert_eq!(of_input.len(), 60);
        assert!(by_the_crate(&out) == of_input, "{name}");
        assert_eq!(channels(&out), channels(&bytes), "{name}");
        assert_eq!(extras(&out), extras(&bytes), "{name}");
        assert_eq!(extras(&out).0.len(), 2);
        assert_eq!(walked(&output).1.facts.profile, "ros2");
        assert_eq!((recovered.attachments, recovered.metadata), (2, 2));
    }
}

#[test]
fn the_order_is_the_files_not_the_clocks() {
    let dir = tempfile::tempdir().unwrap();
    let (input, output) = (dir.path().join("in.mcap"), dir.path().join("out.mcap"));
    let written = messages(300, 50_000);
    assert!(!written.is_sorted_by_key(|m| m.1), "log times step back");
    for (name, packing) in crate::mcap_logs::PACKINGS {
        std::fs::write(&input, log(packing, 512, &written)).unwrap();
        for threads in [1, 4] {
            recover(&input, &output, threads);
            let out: Vec<Read> = by_the_crate(&std::fs::read(&output).unwrap())
                .into_iter()
                .map(|(topic, log_time, _, sequence, data)| (topic, log_time, sequence, data))
                .collect();
            assert!(out == written, "{name}, {threads} threads");
        }
    }
}

#[test]
fn the_same_input_gives_the_same_bytes_and_so_does_its_copy() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| dir.path().join(name);
    let mut inputs: Vec<PathBuf> = ["faults.mcap", "constant_rate_ros1.mcap"]
        .map(|name| {
            Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("fixtures")
                .join(name)
        })
        .to_vec();
    for (name, packing) in crate::mcap_logs::PACKINGS {
        let mut bytes = furnished(packing, 60);
        // Damage in the middle: the copy has to be a fixed point all the same.
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0x10;
        std::fs::write(file(name), &bytes).unwrap();
        inputs.push(file(name));
    }
    for input in inputs {
        let first = recover(&input, &file("a.mcap"), 1);
        recover(&input, &file("b.mcap"), 4);
        let again = recover(&file("a.mcap"), &file("c.mcap"), 2);
        let [a, b, c] = ["a.mcap", "b.mcap", "c.mcap"].map(|n| std::fs::read(file(n)).unwrap());
        assert!(a == b, "{}: threads changed the bytes", input.display());
        assert!(a == c, "{}: a copy of the copy differs", input.display());
        assert!(!again.was_damaged(), "{}: {again:?}", input.display());
        assert_eq!(first.written.messages, again.written.messages);
    }
}
