//! Outputs of strapd: whole files, the same bytes every time, readable by others, and nothing at
//! all where there should be nothing.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use mcap::records::{MessageHeader, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use nalgebra::Vector3;
use proptest::prelude::*;
use strapd::sink::{
    Compression, Encoding, Flow, InputChannel, InputMessage, Options, Provenance, Sink, Stream,
    Target, Written,
};
use strapd_attitude::frames::In;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{
    AttitudeCovariance, AttitudeSample, LinearAcceleration, Nanos, Status,
};

mod files;

const COMPRESSIONS: [Compression; 3] = [Compression::None, Compression::Lz4, Compression::Zstd];

/// A turning body, each sample different in every field; every 1000th has the stamp of the one before.
fn samples(count: usize) -> Vec<AttitudeSample> {
    (0..count)
        .map(|k| {
            let t = 1e-3 * k as f64;
            let repeated = i64::from(k > 0 && k % 1000 == 0);
            let stamp = Nanos(1_700_000_000_000_000_000 + (k as i64 - repeated) * 1_000_000);
            let (s, c) = (0.5 * t).sin_cos();
            AttitudeSample {
                stamp,
                q_nb: Quaternion::assume_unit([c, 0.6 * s, 0.48 * s, 0.64 * s]),
                rate: BodyRate(Vector3::new(0.6, 0.48, 0.64 + 1e-6 * t.sin())),
                accel: (k % 7 != 0)
                    .then(|| In::assume(Vector3::new(0.1 * t.cos(), 0.1 * t.sin(), 9.8))),
                linear_acceleration: None,
                covariance: AttitudeCovariance::from_sigma(
                    Vector3::new(1e-5, 2e-5, 3e-5) * (1.0 + t),
                ),
                status: if repeated == 1 {
                    Status::BRIDGED
                } else {
                    Status::OK
                },
                reset_count: (k / 1500) as u32,
                log: Nanos(stamp.0 + 150_000),
                temperature: None,
            }
        })
        .collect()
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
}

fn provenance() -> Provenance {
    Provenance {
        metadata: BTreeMap::from([
            ("rotates".to_owned(), "sensor_to_world".to_owned()),
            ("version".to_owned(), "test".to_owned()),
        ]),
    }
}

fn target(path: &Path) -> Target {
    Target::from_path(path).unwrap()
}

fn imu() -> [Stream; 1] {
    [Stream::new("/imu/data_raw", "imu_link")]
}

/// Writes `samples` in pieces of `cut`.
fn write(
    path: &Path,
    samples: &[AttitudeSample],
    options: Options,
    threads: usize,
    cut: usize,
) -> Written {
    let mut sink = Sink::create(&target(path), &[], options, &imu(), &provenance()).unwrap();
    let pool = pool(threads);
    for part in samples.chunks(cut) {
        assert_eq!(sink.write(0, part, &pool).unwrap(), Flow::Continue);
    }
    sink.finish().unwrap()
}

type Messages = Vec<(MessageHeader, Vec<u8>)>;
type Metadata = BTreeMap<String, BTreeMap<String, String>>;

/// Reads every record with the `mcap` crate, all three checksums checked; the messages in file order.
fn read_checked(bytes: &[u8]) -> (Messages, Metadata) {
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true),
    );
    let (mut rest, mut messages, mut metadata) = (bytes, Vec::new(), BTreeMap::new());
    while let Some(event) = reader.next_event() {
        match event.unwrap() {
            LinearReadEvent::ReadRequest(wanted) => {
                let n = wanted.min(rest.len());
                reader.insert(n).copy_from_slice(&rest[..n]);
                reader.notify_read(n);
                rest = &rest[n..];
            }
            LinearReadEvent::Record { data, opcode } => {
                match mcap::parse_record(opcode, data).unwrap() {
                    Record::Message { header, data } => messages.push((header, data.into_owned())),
                    Record::Metadata(m) => {
                        metadata.insert(m.name, m.metadata);
                    }
                    _ => {}
                }
            }
        }
    }
    (messages, metadata)
}

#[test]
fn the_mcap_crate_finds_every_checksum_count_schema_and_index_in_order() {
    let dir = tempfile::tempdir().unwrap();
    let samples = samples(5000);
    for encoding in [Encoding::Cdr, Encoding::Json] {
        for compression in COMPRESSIONS {
            let path = dir.path().join("a.mcap");
            let options = Options {
                force: true,
                encoding,
                compression,
                ..Options::default()
            };
            let written = write(&path, &samples, options, 2, 777);
            let bytes = fs::read(&path).unwrap();
            assert_eq!(written.bytes, bytes.len() as u64);
            assert_eq!(written.samples, 5000);
            // 4 of the 5000 repeat a stamp: their transforms are left out.
            assert_eq!(written.messages, 5000 + 4996);

            let (messages, metadata) = read_checked(&bytes);
            assert_eq!(messages.len(), 9996);
            assert_eq!(metadata["strapd"]["rotates"], "sensor_to_world");

            let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
            let stats = summary.stats.as_ref().unwrap();
            assert_eq!(stats.message_count, 9996);
            assert_eq!(
                stats.channel_message_counts,
                BTreeMap::from([(1, 5000), (2, 4996)])
            );
            assert_eq!((stats.schema_count, stats.channel_count), (2, 2));
            // 5000 samples in chunks of 2048.
            assert_eq!((stats.chunk_count, summary.chunk_indexes.len()), (3, 3));
            assert_eq!(stats.message_start_time, samples[0].log.0 as u64);
            assert_eq!(stats.message_end_time, samples[4999].log.0 as u64);
            assert_eq!(
                summary.metadata_indexes.len(),
                stats.metadata_count as usize
            );
            for index in &summary.metadata_indexes {
                assert_eq!(
                    mcap::read::metadata(&bytes, index).unwrap().name,
                    index.name
                );
            }

            let (attitude, transform) = (&summary.channels[&1], &summary.channels[&2]);
            assert_eq!(
                (attitude.topic.as_str(), transform.topic.as_str()),
                ("/imu/data", "/tf")
            );
            let schemas = [attitude, transform].map(|c| {
                let schema = c.schema.as_ref().unwrap();
                (
                    schema.name.clone(),
                    schema.encoding.clone(),
                    c.message_encoding.clone(),
                )
            });
            let expected = match encoding {
                Encoding::Cdr => {
                    assert!(attitude.metadata["offered_qos_profiles"].contains("depth: 10"));
                    [
                        ("sensor_msgs/msg/Imu", "ros2msg", "cdr"),
                        ("tf2_msgs/msg/TFMessage", "ros2msg", "cdr"),
                    ]
                }
                Encoding::Json => {
                    for c in [attitude, transform] {
                        let text = &c.schema.as_ref().unwrap().data;
                        let schema: serde_json::Value = serde_json::from_slice(text).unwrap();
                        assert_eq!(schema["type"], "object");
                    }
                    [
                        ("strapd.Attitude", "jsonschema", "json"),
                        ("foxglove.FrameTransform", "jsonschema", "json"),
                    ]
                }
            };
            let expected = expected.map(|(a, b, c)| (a.to_owned(), b.to_owned(), c.to_owned()));
            assert_eq!(schemas, expected);

            // Through the indexes: each entry leads to the message it promises. (Every 211th:
            // seek_message unpacks the chunk anew each time.)
            let mut entries_seen = 0;
            for chunk in &summary.chunk_indexes {
                for (channel, entries) in summary.read_message_indexes(&bytes, chunk).unwrap() {
                    entries_seen += entries.len();
                    for entry in entries.iter().step_by(211) {
                        let message = summary.seek_message(&bytes, chunk, entry).unwrap();
                        assert_eq!(message.channel.id, channel.id);
                        assert_eq!(message.log_time, entry.log_time);
                    }
                }
            }
            assert_eq!(entries_seen, 9996);

            // Without the summary, and all of it.
            assert_eq!(
                mcap::MessageStream::new(&bytes)
                    .unwrap()
                    .map(Result::unwrap)
                    .count(),
                9996
            );
            assert_eq!(
                messages[0].0,
                MessageHeader {
                    channel_id: 1,
                    sequence: 0,
                    log_time: samples[0].log.0 as u64,
                    publish_time: samples[0].log.0 as u64,
                }
            );
        }
    }
}

#[test]
fn no_transform_repeats_a_stamp_not_even_across_chunks() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = samples(4097);
    // The last of the first chunk and the first of the second; the second and third of the file.
    samples[2048].stamp = samples[2047].stamp;
    samples[2].stamp = samples[1].stamp;
    let path = dir.path().join("a.mcap");
    write(&path, &samples, Options::default(), 2, 10_000);
    let (messages, _) = read_checked(&fs::read(&path).unwrap());
    let stamps: Vec<&[u8]> = messages
        .iter()
        .filter(|(h, _)| h.channel_id == 2)
        .map(|(_, data)| &data[8..16])
        .collect();
    // Four repeats of samples() and the two above.
    assert_eq!(stamps.len(), 4097 - 6);
    assert!(stamps.windows(2).all(|w| w[0] != w[1]));
}

#[test]
fn the_bytes_depend_neither_on_threads_nor_on_how_the_samples_were_cut() {
    let dir = tempfile::tempdir().unwrap();
    // More than the batches in flight for 4 threads (8 * 2048), and a remainder.
    let samples = samples(20_011);
    for (name, encoding, compression) in [
        ("z.mcap", Encoding::Cdr, Compression::Zstd),
        ("l.mcap", Encoding::Cdr, Compression::Lz4),
        ("j.mcap", Encoding::Json, Compression::Zstd),
        ("a.ndjson", Encoding::Cdr, Compression::None),
        ("a.csv", Encoding::Cdr, Compression::None),
    ] {
        let path = dir.path().join(name);
        let options = Options {
            force: true,
            encoding,
            compression,
            ..Options::default()
        };
        write(&path, &samples, options, 1, samples.len());
        let first = fs::read(&path).unwrap();
        for (threads, cut) in [(1, 1), (2, 999), (4, 2048), (4, 5000), (2, samples.len())] {
            write(&path, &samples, options, threads, cut);
            assert!(
                fs::read(&path).unwrap() == first,
                "{name}, {threads} threads, cut {cut}"
            );
        }
    }
}

#[test]
fn no_samples_still_give_a_whole_file() {
    let dir = tempfile::tempdir().unwrap();
    for compression in COMPRESSIONS {
        let path = dir.path().join("empty.mcap");
        write(
            &path,
            &[],
            Options {
                force: true,
                compression,
                ..Options::default()
            },
            1,
            1,
        );
        let bytes = fs::read(&path).unwrap();
        assert!(read_checked(&bytes).0.is_empty());
        assert_eq!(
            mcap::Summary::read(&bytes).unwrap().unwrap().channels.len(),
            2
        );
    }
    let path = dir.path().join("empty.csv");
    write(&path, &[], Options::default(), 1, 1);
    assert!(
        fs::read_to_string(&path)
            .unwrap()
            .starts_with("stamp_ns,qw,qx,qy,qz,roll_deg")
    );
}

#[test]
fn ndjson_numbers_each_stream_by_itself_and_keeps_every_bit() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("two.ndjson");
    let streams = [Stream::new("/a", "fa"), Stream::new("/b", "fb")];
    let (samples, pool) = (samples(3000), pool(2));
    let mut sink = Sink::create(
        &target(&path),
        &[],
        Options::default(),
        &streams,
        &provenance(),
    )
    .unwrap();
    for part in samples.chunks(500) {
        for stream in 0..2 {
            assert_eq!(sink.write(stream, part, &pool).unwrap(), Flow::Continue);
        }
    }
    let written = sink.finish().unwrap();
    assert_eq!((written.samples, written.messages), (6000, 6000));
    let mut next = BTreeMap::from([("/a".to_owned(), 0), ("/b".to_owned(), 0)]);
    for line in fs::read_to_string(&path).unwrap().lines() {
        let v: serde_json::Value = serde_json::from_str(line).unwrap();
        let seq = next.get_mut(v["id"].as_str().unwrap()).unwrap();
        let s = &samples[*seq];
        assert_eq!(v["seq"], *seq as u64);
        assert_eq!(v["stamp"]["nsec"], s.stamp.to_sec_nanosec().1);
        let q = ["w", "x", "y", "z"].map(|k| v["q"][k].as_f64().unwrap().to_bits());
        assert_eq!(q, s.q_nb.wxyz().map(f64::to_bits));
        *seq += 1;
    }
    assert_eq!(next.into_values().collect::<Vec<_>>(), [3000, 3000]);
}

#[test]
fn two_streams_share_an_mcap_and_keep_their_channels_and_frames() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("two.mcap");
    let streams = [
        Stream::new("/left/imu/data_raw", "left"),
        Stream::new("/right/imu", "right"),
    ];
    let (samples, pool) = (samples(100), pool(2));
    let mut sink = Sink::create(
        &target(&path),
        &[],
        Options::default(),
        &streams,
        &provenance(),
    )
    .unwrap();
    for stream in 0..2 {
        let part = &samples[stream * 10..];
        assert_eq!(sink.write(stream, part, &pool).unwrap(), Flow::Continue);
    }
    sink.finish().unwrap();
    let bytes = fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let topics: BTreeMap<u16, &str> = summary
        .channels
        .iter()
        .map(|(id, c)| (*id, c.topic.as_str()))
        .collect();
    let expected = [
        (1, "/left/imu/data"),
        (2, "/right/imu/attitude"),
        (3, "/tf"),
    ];
    assert_eq!(topics, BTreeMap::from(expected));
    let (messages, _) = read_checked(&bytes);
    let holding = |channel: u16, name: &[u8]| {
        messages
            .iter()
            .filter(|(h, data)| {
                h.channel_id == channel && data.windows(name.len()).any(|w| w == name)
            })
            .count()
    };
    assert_eq!([holding(1, b"left\0"), holding(2, b"right\0")], [100, 90]);
    assert_eq!([holding(3, b"left\0"), holding(3, b"right\0")], [100, 90]);
}

#[test]
fn several_topics_do_not_fit_into_a_table_and_the_message_says_what_does() {
    let streams = [Stream::new("/a", "fa"), Stream::new("/b", "fb")];
    let dir = tempfile::tempdir().unwrap();
    for name in ["two.csv", "two.tum"] {
        let path = dir.path().join(name);
        let error = Sink::create(
            &target(&path),
            &[],
            Options::default(),
            &streams,
            &provenance(),
        )
        .unwrap_err()
        .to_string();
        assert!(error.contains("choose one with topic"), "{error}");
        assert!(!path.exists());
    }
}

#[test]
fn null_counts_and_writes_nothing() {
    let mut sink = Sink::create(
        &Target::Null,
        &[],
        Options::default(),
        &imu(),
        &provenance(),
    )
    .unwrap();
    assert_eq!(
        sink.write(0, &samples(10), &pool(1)).unwrap(),
        Flow::Continue
    );
    let written = sink.finish().unwrap();
    assert_eq!(
        (written.samples, written.bytes, written.path),
        (10, 0, None)
    );
}

#[test]
fn copied_messages_arrive_unchanged_beside_the_attitude() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("copy.mcap");
    let (samples, pool) = (samples(3000), pool(2));
    let mut sink = Sink::create(
        &target(&path),
        &[],
        Options::default(),
        &imu(),
        &provenance(),
    )
    .unwrap();
    let metadata = BTreeMap::from([("callerid".to_owned(), "/x".to_owned())]);
    let camera = InputChannel {
        topic: "/camera",
        message_encoding: "protobuf",
        schema: Some(("foxglove.Image", "protobuf", &[1, 2, 3])),
        metadata: &metadata,
    };
    let bare = InputChannel {
        topic: "/bare",
        message_encoding: "json",
        schema: None,
        metadata: &BTreeMap::new(),
    };
    let [a, again, b] = [&camera, &camera, &bare].map(|c| sink.copy_channel(c).unwrap());
    assert_ne!(a, again, "two channels of the input stay two");
    let payload = |k: usize| vec![k as u8; 100_000 + k];
    for (k, part) in samples.chunks(100).enumerate() {
        assert_eq!(sink.write(0, part, &pool).unwrap(), Flow::Continue);
        let data = payload(k);
        let channel = if k % 2 == 0 { a } else { b };
        let message = InputMessage {
            sequence: k as u32,
            log_time: 7 + k as u64,
            publish_time: u64::MAX - k as u64,
            data: &data,
        };
        assert_eq!(sink.copy(channel, &message, &pool).unwrap(), Flow::Continue);
    }
    sink.finish().unwrap();

    let bytes = fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let stats = summary.stats.as_ref().unwrap();
    // The copied camera channel that brought no message is there too.
    assert_eq!(
        stats.channel_message_counts,
        BTreeMap::from([(1, 3000), (2, 2998), (3, 15), (5, 15)])
    );
    assert_eq!(summary.channels[&3].metadata, metadata);
    assert_eq!(summary.channels[&3].schema, summary.channels[&4].schema);
    assert_eq!(summary.channels[&5].schema, None);
    assert_eq!(stats.message_start_time, 7);
    for chunk in &summary.chunk_indexes {
        let indexes = summary.read_message_indexes(&bytes, chunk).unwrap();
        assert!(indexes.values().all(|entries| !entries.is_empty()));
    }
    let (messages, _) = read_checked(&bytes);
    let copied: Vec<_> = messages.iter().filter(|(h, _)| h.channel_id > 2).collect();
    assert_eq!(copied.len(), 30);
    for (k, (header, data)) in copied.into_iter().enumerate() {
        assert_eq!((header.sequence, header.log_time), (k as u32, 7 + k as u64));
        assert_eq!(header.publish_time, u64::MAX - k as u64);
        assert!(*data == payload(k));
    }
}

#[test]
fn flush_brings_the_pending_samples_out() {
    let dir = tempfile::tempdir().unwrap();
    let fifo = dir.path().join("live.ndjson");
    assert!(
        Command::new("mkfifo")
            .arg(&fifo)
            .status()
            .unwrap()
            .success()
    );
    let (sender, received) = std::sync::mpsc::channel();
    let reader = std::thread::spawn({
        let fifo = fifo.clone();
        move || {
            let mut line = String::new();
            let mut file = std::io::BufReader::new(fs::File::open(fifo).unwrap());
            std::io::BufRead::read_line(&mut file, &mut line).unwrap();
            sender.send(line).unwrap();
        }
    });
    let pool = pool(1);
    let mut sink = Sink::create(
        &target(&fifo),
        &[],
        Options::default(),
        &imu(),
        &provenance(),
    )
    .unwrap();
    assert_eq!(sink.write(0, &samples(1), &pool).unwrap(), Flow::Continue);
    assert_eq!(sink.flush(&pool).unwrap(), Flow::Continue);
    // The line comes although the sink is still open. Ten minutes by the clock, as a last resort.
    let line = received
        .recv_timeout(std::time::Duration::from_secs(600))
        .expect("timed out: no line while the sink is open");
    assert!(line.starts_with("{\"class\":\"ATT\""));
    reader.join().unwrap();
    // The reader is gone now: quiet end.
    let more = samples(20_000);
    assert_eq!(sink.write(0, &more, &pool).unwrap(), Flow::Closed);
    assert_eq!(sink.write(0, &more, &pool).unwrap(), Flow::Closed);
    assert!(sink.finish().unwrap().closed);
    assert!(fifo.exists(), "a named pipe is written into, not replaced");
}

fn any_sample() -> impl Strategy<Value = AttitudeSample> {
    let f = || any::<u64>().prop_map(f64::from_bits);
    let v = move || (f(), f(), f()).prop_map(|(x, y, z)| Vector3::new(x, y, z));
    let q = (f(), f(), f(), f()).prop_map(|(w, x, y, z)| [w, x, y, z]);
    let numbers = (q, v(), proptest::option::of(v()), v());
    let rest = (any::<i64>(), any::<i64>(), any::<u16>(), any::<u32>());
    (numbers, rest).prop_map(
        |((q, rate, accel, sigma), (stamp, log, status, reset_count))| AttitudeSample {
            stamp: Nanos(stamp),
            q_nb: Quaternion::assume_unit(q),
            rate: BodyRate(rate),
            accel: accel.map(In::assume),
            linear_acceleration: accel.map(|v| LinearAcceleration {
                body: In::assume(v),
                covariance: [sigma.x, sigma.y, sigma.z, sigma.x, sigma.y, sigma.z],
            }),
            covariance: AttitudeCovariance {
                xx: sigma.x,
                xy: sigma.y,
                zz: sigma.z,
                ..AttitudeCovariance::default()
            },
            status: Status(status),
            reset_count,
            log: Nanos(log),
            temperature: accel.map(|v| v.x as f32),
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Bits from anywhere: NaN, infinities, stamps at the ends of i64, names with anything in them.
    #[test]
    fn whatever_the_samples_and_names_hold_the_output_is_well_formed(
        samples in proptest::collection::vec(any_sample(), 0..40),
        topic in any::<String>(),
        frame in any::<String>(),
    ) {
        let dir = tempfile::tempdir().unwrap();
        let streams = [Stream::new(&topic, &frame)];
        let pool = pool(1);
        for (name, encoding) in [
            ("c.mcap", Encoding::Cdr),
            ("j.mcap", Encoding::Json),
            ("a.ndjson", Encoding::Cdr),
            ("a.csv", Encoding::Cdr),
        ] {
            let path = dir.path().join(name);
            let options = Options { encoding, ..Options::default() };
            let mut sink =
                Sink::create(&target(&path), &[], options, &streams, &provenance()).unwrap();
            prop_assert_eq!(sink.write(0, &samples, &pool).unwrap(), Flow::Continue);
            sink.finish().unwrap();
            let bytes = fs::read(&path).unwrap();
            if name == "a.csv" {
                let mut reader = csv::Reader::from_reader(bytes.as_slice());
                let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
                prop_assert_eq!(rows.len(), samples.len());
                for (row, s) in rows.iter().zip(&samples) {
                    prop_assert_eq!(row[0].parse::<i64>().unwrap(), s.stamp.0);
                    for text in row.iter().skip(1).take(13) {
                        prop_assert!(text.parse::<f64>().is_ok(), "{}", text);
                    }
                }
            } else if name == "a.ndjson" {
                let text = String::from_utf8(bytes).unwrap();
                prop_assert_eq!(text.lines().count(), samples.len());
                for line in text.lines() {
                    let v: serde_json::Value = serde_json::from_str(line).unwrap();
                    prop_assert_eq!(v["class"].as_str(), Some("ATT"));
                }
            } else {
                let (messages, _) = read_checked(&bytes);
                let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
                let logs = || samples.iter().map(|s| s.log.0.max(0) as u64);
                let times = (logs().min().unwrap_or(0), logs().max().unwrap_or(0));
                let stats = summary.stats.unwrap();
                prop_assert_eq!((stats.message_start_time, stats.message_end_time), times);
                for chunk in &summary.chunk_indexes {
                    prop_assert_eq!((chunk.message_start_time, chunk.message_end_time), times);
                }
                let attitudes: Vec<_> =
                    messages.iter().filter(|(h, _)| h.channel_id == 1).collect();
                prop_assert_eq!(attitudes.len(), samples.len());
                for ((header, data), s) in attitudes.iter().zip(&samples) {
                    prop_assert_eq!(header.log_time, s.log.0.max(0) as u64);
                    if encoding == Encoding::Json {
                        prop_assert!(serde_json::from_slice::<serde_json::Value>(data).is_ok());
                    }
                }
            }
        }
    }
}

// Other people's readers

/// `STRAPD_ORACLES_PYTHON` names a Python with the packages that `read_output.py` lists.
#[test]
#[cfg_attr(
    not(has_oracles),
    ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn mcap_ros2_support_and_rosbags_read_what_the_ndjson_says() {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let dir = tempfile::tempdir().unwrap();
    let samples = samples(5000);
    let ndjson = dir.path().join("a.ndjson");
    write(&ndjson, &samples, Options::default(), 2, 1000);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracles/read_output.py");
    for encoding in [Encoding::Cdr, Encoding::Json] {
        for compression in COMPRESSIONS {
            let path = dir.path().join("a.mcap");
            write(
                &path,
                &samples,
                Options {
                    force: true,
                    encoding,
                    compression,
                    ..Options::default()
                },
                2,
                1000,
            );
            let output = Command::new(&python)
                .arg(&script)
                .args([&path, &ndjson])
                .output()
                .unwrap();
            let text = String::from_utf8_lossy(&output.stdout).into_owned()
                + &String::from_utf8_lossy(&output.stderr);
            assert!(
                output.status.success(),
                "{encoding:?} {compression:?}: {text}"
            );
            assert!(text.contains("5000 attitudes, 4996 transforms"), "{text}");
        }
    }
}
