//! Small logs made by the `mcap` crate's writer, and ways to read them back.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, clippy::expect_used)]

use std::io::Cursor;
use std::ops::ControlFlow;
use std::path::Path;
use strapd_recording::mcap::{Message, Reader, WalkOptions, WalkReport, walk};

/// A message as it was read: topic, log time, sequence, payload.
pub type Read = (String, u64, u32, Vec<u8>);

/// Packing of a log; `None` for unchunked.
pub type Packing = Option<Option<mcap::Compression>>;

pub const PACKINGS: [(&str, Packing); 4] = [
    ("none", Some(None)),
    ("lz4", Some(Some(mcap::Compression::Lz4))),
    ("zstd", Some(Some(mcap::Compression::Zstd))),
    ("unchunked", None),
];

/// A fixed linear congruential sequence.
pub fn random(state: &mut u64) -> u64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    *state >> 33
}

/// Messages that `log` writes: `n` on two topics, `jitter` ns of disorder in log time.
pub fn messages(n: u32, jitter: u64) -> Vec<Read> {
    let mut state = 7;
    (0..n)
        .map(|i| {
            let topic = if i % 3 == 1 { "/other" } else { "/imu" };
            let time = 10_000_000 + u64::from(i) * 1000;
            let time = time
                - if jitter > 0 {
                    random(&mut state) % jitter
                } else {
                    0
                };
            let data = (0..40 + i % 7)
                .map(|_| random(&mut state) as u8 & 31)
                .collect();
            (topic.to_owned(), time, i, data)
        })
        .collect()
}

/// The bytes of a log of these messages.
pub fn log(packing: Packing, chunk: u64, messages: &[Read]) -> Vec<u8> {
    let options = mcap::WriteOptions::new()
        .use_chunks(packing.is_some())
        .compression(packing.flatten())
        .compression_threads(0)
        .chunk_size(Some(chunk))
        .profile("ros2");
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let schema = writer
        .add_schema("sensor_msgs/msg/Imu", "ros2msg", b"# text")
        .unwrap();
    let metadata = [("k".to_owned(), "v".to_owned())].into();
    let imu = writer
        .add_channel(schema, "/imu", "cdr", &metadata)
        .unwrap();
    let other = writer
        .add_channel(0, "/other", "json", &Default::default())
        .unwrap();
    for (topic, log_time, sequence, data) in messages {
        let channel_id = if topic == "/imu" { imu } else { other };
        let (log_time, sequence) = (*log_time, *sequence);
        let publish_time = log_time - 1;
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence,
            log_time,
            publish_time,
        };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// Messages in the order the walk promises: log time, then place in the file.
pub fn in_order(mut messages: Vec<Read>) -> Vec<Read> {
    messages.sort_by_key(|m| m.1);
    messages
}

pub fn from_bytes(bytes: &[u8]) -> strapd_recording::Result<Reader> {
    Reader::from_stream("memory", Box::new(Cursor::new(bytes.to_vec())))
}

/// Options under which even a small log takes the ways of a large one: every block is handed over
/// and passed on by itself.
pub fn fine(pool: Option<&rayon::ThreadPool>) -> WalkOptions<'_> {
    WalkOptions {
        pool,
        hand_over: 1,
        batch: 1,
        ..WalkOptions::default()
    }
}

/// Every message on the topics that `wanted` likes.
pub fn read_some(
    reader: Reader,
    options: &WalkOptions<'_>,
    wanted: impl Fn(&str) -> bool,
) -> (Vec<Read>, WalkReport) {
    let mut all = Vec::new();
    let report = walk(
        reader,
        options,
        |channel| wanted(&channel.topic).then_some(()),
        |(), m: &Message<'_>, out: &mut Vec<Read>| {
            out.push((
                m.channel.topic.clone(),
                m.log_time,
                m.sequence,
                m.data.to_vec(),
            ));
        },
        |batch| {
            all.append(batch);
            ControlFlow::Continue(())
        },
    )
    .unwrap();
    assert_eq!(report.items, all.len() as u64);
    (all, report)
}

pub fn read(reader: Reader) -> (Vec<Read>, WalkReport) {
    read_some(reader, &WalkOptions::default(), |_| true)
}

pub fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
}

/// The file written to a temporary place, so that it is read by position.
pub fn on_disk(bytes: &[u8], dir: &Path, name: &str) -> Reader {
    let path = dir.join(name);
    std::fs::write(&path, bytes).unwrap();
    Reader::open(&path).unwrap()
}

/// Stretches by the `mcap` crate alone: where each part of the file that stands or falls together ends, and
/// the messages in it. Chunks by its summary; unchunked messages by its linear reader's record sizes.
pub fn stretches(bytes: &[u8]) -> Vec<(usize, Vec<Read>)> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let read = |m: mcap::Message<'_>| {
        (
            m.channel.topic.clone(),
            m.log_time,
            m.sequence,
            m.data.to_vec(),
        )
    };
    let mut chunks: Vec<_> = summary
        .chunk_indexes
        .iter()
        .map(|index| {
            let end = (index.chunk_start_offset + index.chunk_length) as usize;
            let inside = summary.stream_chunk(bytes, index).unwrap();
            (end, inside.map(|m| read(m.unwrap())).collect())
        })
        .collect();
    if chunks.is_empty() {
        // A message record is 9 + 22 bytes and its payload, and payloads here are unlike each other.
        let mut from = 0;
        for message in mcap::MessageStream::new(bytes).unwrap() {
            let message = read(message.unwrap());
            let at = bytes[from..]
                .windows(message.3.len())
                .position(|w| w == message.3)
                .unwrap();
            from += at + message.3.len();
            chunks.push((from, vec![message]));
        }
    }
    chunks
}
