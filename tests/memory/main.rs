//! Memory does not follow the file: neither a long log nor a chunk that claims to be huge.
//!
//! One test in a binary of its own, because it watches the peak memory of the whole process.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::io::{BufWriter, Write};
use std::ops::ControlFlow;
use std::path::Path;
use strapd::pipeline::recover::{Recover, run};
use strapd::sink::{Options, Target};
use strapd_attitude::record::RawSample;
use strapd_recording::Source;
use strapd_recording::format::Format;
use strapd_recording::lines::Lines;
use strapd_recording::mcap::{MAGIC, Message, ProblemKind, Reader, WalkOptions, op, walk};
use strapd_recording::pool::Pool;

/// Peak resident memory of this process so far, MiB.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap();
    line.split_whitespace()
        .nth(1)
        .unwrap()
        .parse::<u64>()
        .unwrap()
        >> 10
}

fn long_log(path: &Path, messages: u64, compression: Option<mcap::Compression>, chunked: bool) {
    let out = BufWriter::new(std::fs::File::create(path).unwrap());
    let options = mcap::WriteOptions::new()
        .compression(compression)
        .compression_threads(0)
        .use_chunks(chunked);
    let mut writer = options.create(out).unwrap();
    let channel_id = writer
        .add_channel(0, "/imu", "cdr", &Default::default())
        .unwrap();
    let mut payload = [0u8; 324];
    for i in 0..messages {
        payload[100..108].copy_from_slice(&i.wrapping_mul(0x9E37_79B9_7F4A_7C15).to_le_bytes());
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: i as u32,
            log_time: i,
            publish_time: i,
        };
        writer.write_to_known_channel(&header, &payload).unwrap();
    }
    writer.finish().unwrap();
}

/// Messages read, and the first problem.
fn count(reader: Reader, pool: &rayon::ThreadPool) -> (u64, Option<ProblemKind>) {
    let options = WalkOptions {
        pool: Some(pool),
        ..WalkOptions::default()
    };
    let mut last = 0;
    let report = walk(
        reader,
        &options,
        |_| Some(()),
        |(), m: &Message<'_>, out: &mut Vec<(u64, RawSample)>| {
            out.push((m.log_time, RawSample::default()));
        },
        |batch| {
            assert!(batch.iter().all(|(t, _)| *t >= last));
            last = batch.last().unwrap().0;
            ControlFlow::Continue(())
        },
    )
    .unwrap();
    (
        report.items,
        report
            .survey
            .problems
            .first()
            .first()
            .map(|p| p.kind.clone()),
    )
}

/// A log of one zstd chunk that unpacks to `size` zeros and declares `declared` bytes.
fn bomb(path: &Path, size: u64, declared: u64) {
    let mut packed = zstd::stream::Encoder::new(Vec::new(), 1).unwrap();
    let zeros = vec![0; 1 << 20];
    for _ in 0..size >> 20 {
        packed.write_all(&zeros).unwrap();
    }
    let packed = packed.finish().unwrap();
    let mut body = vec![0; 16];
    body.extend(declared.to_le_bytes());
    body.extend(1u32.to_le_bytes());
    body.extend(4u32.to_le_bytes());
    body.extend(b"zstd");
    body.extend((packed.len() as u64).to_le_bytes());
    body.extend(&packed);
    let mut file = std::fs::File::create(path).unwrap();
    file.write_all(&MAGIC).unwrap();
    file.write_all(&[op::CHUNK]).unwrap();
    file.write_all(&(body.len() as u64).to_le_bytes()).unwrap();
    file.write_all(&body).unwrap();
}

#[test]
fn memory_is_bounded_by_what_is_in_flight_whatever_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("log.mcap");
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .build()
        .unwrap();
    let kinds = [
        (None, true),
        (Some(mcap::Compression::Zstd), true),
        (None, false),
    ];
    for (compression, chunked) in kinds {
        let mut grown = Vec::new();
        for messages in [50_000, 500_000] {
            long_log(&path, messages, compression, chunked);
            let before = peak();
            let file = Reader::open(&path).unwrap();
            assert_eq!(count(file, &pool).0, messages);
            let stream = Box::new(std::fs::File::open(&path).unwrap());
            assert_eq!(
                count(Reader::from_stream("s", stream).unwrap(), &pool).0,
                messages
            );
            grown.push(peak() - before);
        }
        // 17 MB and 173 MB of messages. In flight are at most 32 MiB, held for order another 8 + 4,
        // and items are smaller than their messages; 64 are promised.
        assert!(
            grown[0] <= 64 && grown[1] <= 64,
            "{compression:?}: {grown:?} MiB"
        );
        eprintln!("{compression:?}, chunked {chunked}: peak grew by {grown:?} MiB");
    }
    // 4 GiB of zeros in a few hundred kB: refused by what it declares, or when it does not stop
    // where it said. The packed bytes and one chunk of the limit may be in memory, no more.
    for declared in [4 << 30, 64 << 20, 1 << 20, u64::MAX] {
        bomb(&path, 4 << 30, declared);
        let before = peak();
        let (messages, problem) = count(Reader::open(&path).unwrap(), &pool);
        let grown = peak() - before;
        assert_eq!(messages, 0);
        let refused = match declared {
            0..=0x400_0000 => matches!(problem, Some(ProblemKind::Unpack { .. })),
            _ => matches!(problem, Some(ProblemKind::ChunkTooBig { .. })),
        };
        assert!(refused, "{declared}: {problem:?}");
        assert!(grown <= 66, "{declared}: {grown} MiB");
        eprintln!("bomb declaring {declared}: peak grew by {grown} MiB");
    }
    empty_messages_take_no_more_than_their_chunk(&path);
    recovering_holds_little_of_a_long_record(dir.path());
    a_table_is_read_row_by_row();
}

/// Two chunks of 60 MiB of messages without a payload, of each of which an item of some hundred bytes is made.
fn empty_messages_take_no_more_than_their_chunk(path: &Path) {
    let record = |opcode: u8, body: &[u8]| {
        [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
    };
    let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let channel = [&[1, 0, 0, 0][..], &text("/t"), &text("cdr"), &text("")].concat();
    let message = record(op::MESSAGE, &[&[1, 0][..], &[0; 20]].concat());
    let many = (60 << 20) / message.len();
    {
        let records = message.repeat(many);
        let size = (records.len() as u64).to_le_bytes();
        let head = [&[0; 16][..], &size, &[0; 4], &text(""), &size].concat();
        let mut file = std::fs::File::create(path).unwrap();
        file.write_all(&MAGIC).unwrap();
        file.write_all(&record(op::CHANNEL, &channel)).unwrap();
        for _ in 0..2 {
            let length = (head.len() + records.len()) as u64;
            file.write_all(&[op::CHUNK]).unwrap();
            file.write_all(&length.to_le_bytes()).unwrap();
            file.write_all(&head).unwrap();
            file.write_all(&records).unwrap();
        }
    }
    for threads in [1, 8] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        let mut messages = 0;
        let grown = added(|| messages = count(Reader::open(path).unwrap(), &pool).0);
        assert_eq!(messages, 2 * many as u64);
        eprintln!("empty messages, {threads} threads: peak grew by {grown} MiB");
        // The chunk, and 64 MiB.
        assert!(grown <= 60 + 64, "{threads} threads: {grown} MiB");
    }
}

/// 100 MB of a table from nowhere: a line of 60 MB, and rows behind it.
fn a_table_is_read_row_by_row() {
    let head = &b"time_s,gyro_x,gyro_y,gyro_z\n0,1,2,3\n"[..];
    let row = b"0.01,1.25,2.25,3.25\n";
    let rows = row.repeat(1000);
    let mut counted = (0, 0);
    let grown = added(|| {
        let rows = std::iter::repeat_n(&rows[..], 2000);
        let rows = Pieces(rows.chain(std::iter::once(&b"\n"[..])), &[]);
        let long = std::io::Read::take(std::io::repeat(b'7'), 60 << 20);
        let input = std::io::Read::chain(std::io::Read::chain(head, long), &b"\n"[..]);
        let input = std::io::Read::chain(input, rows);
        let mut lines = Lines::new(
            Path::new("-"),
            Format::Table,
            input,
            &strapd_recording::decode::Options::default(),
        )
        .unwrap();
        let mut samples = Vec::new();
        while let Some(line) = lines.next(&mut samples).unwrap() {
            counted.0 += samples.len();
            counted.1 += usize::from(line.is_err());
            samples.clear();
        }
    });
    assert_eq!(counted, (2_000_001, 1));
    eprintln!("a table: peak grew by {grown} MiB");
    assert!(grown <= 8, "{grown} MiB");
}

/// Reads pieces, one after the other.
struct Pieces<'b, I>(I, &'b [u8]);

impl<'b, I: Iterator<Item = &'b [u8]>> std::io::Read for Pieces<'b, I> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        if self.1.is_empty() {
            self.1 = self.0.next().unwrap_or_default();
        }
        std::io::Read::read(&mut self.1, into)
    }
}

/// Peak resident memory that `work` adds to what is there now, MiB.
fn added(work: impl FnOnce()) -> u64 {
    // Forgets the peak of what came before.
    std::fs::write("/proc/self/clear_refs", "5").unwrap();
    let before = peak();
    work();
    peak() - before
}

fn recovering_holds_little_of_a_long_record(dir: &Path) {
    let sized = |bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes(), bytes].concat();
    let metadata = |pairs: Vec<u8>| [sized(b"m"), sized(&pairs)].concat();
    let pair = |key: &[u8], value: &[u8]| [sized(key), sized(value)].concat();
    let long = vec![b'v'; 60 << 20];
    let small = (0u32..3_000_000).flat_map(|n| pair(&n.to_le_bytes().map(|b| b & 0x7F), b""));
    let attachment = [
        &[0; 16],
        &sized(b"a")[..],
        &sized(b""),
        &(long.len() as u64).to_le_bytes(),
        &long,
        &[0; 4],
    ];
    // An attachment is read once and written once; a metadata record of this size is nobody's.
    for (name, opcode, body, copied, most) in [
        ("pairs", op::METADATA, metadata(small.collect()), 0, 90),
        ("value", op::METADATA, metadata(pair(b"k", &long)), 0, 90),
        ("attachment", op::ATTACHMENT, attachment.concat(), 1, 200),
    ] {
        let input = dir.join(format!("{name}.mcap"));
        let mut file = std::fs::File::create(&input).unwrap();
        let header = [sized(b""), sized(b"")].concat();
        for bytes in [
            &MAGIC[..],
            &[op::HEADER],
            &(header.len() as u64).to_le_bytes(),
            &header,
            &[opcode],
            &(body.len() as u64).to_le_bytes(),
            &body,
        ] {
            file.write_all(bytes).unwrap();
        }
        drop(body);
        let wanted = Recover {
            source: Source::File(input),
            target: Target::parse(dir.join("out.mcap").to_str().unwrap()).unwrap(),
            options: Options {
                force: true,
                ..Options::default()
            },
        };
        let mut recovered = None;
        let grown = added(|| {
            let pool = Pool::new(2).unwrap();
            recovered = Some(run(&wanted, &pool, &mut |_| {}).unwrap());
        });
        let recovered = recovered.unwrap();
        eprintln!("recover, one long record, {name}: {grown} MiB");
        assert_eq!(recovered.attachments + recovered.metadata, copied, "{name}");
        assert!(recovered.was_damaged(), "{name}");
        assert!(grown <= most, "{name}: {grown} MiB");
    }
}
