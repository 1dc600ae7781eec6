//! ULog, ROS 1 bags, ROS 2 in SQLite: what readers nobody here made read of the same files, from files and pipes, on
//! any number of threads, cut and damaged.

use crate::mcap_logs::{Read, from_bytes, in_order, pool, read};
use crate::meter::Meter;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;
use strapd_attitude::record::{Nanos, RawSample, SampleKind};
use strapd_recording::decode::{Channel, Decoder, Options, role};
use strapd_recording::format::Format;
use strapd_recording::mcap::{Message, ProblemKind, Reader, WalkOptions, WalkReport, walk};

fn fixture(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures")).join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(fixture(name)).unwrap()
}

/// Every sample, by topic, in order of log time.
fn samples(
    reader: Reader,
    options: &WalkOptions<'_>,
) -> (BTreeMap<String, Vec<RawSample>>, WalkReport) {
    let mut found: BTreeMap<String, Vec<RawSample>> = BTreeMap::new();
    let report = walk(
        reader,
        options,
        |channel| {
            let schema = channel.schema.as_deref()?;
            let channel = Channel {
                topic: &channel.topic,
                message_encoding: &channel.message_encoding,
                schema_name: &schema.name,
                schema_encoding: &schema.encoding,
                schema_data: &schema.data,
            };
            Decoder::compile(&channel, &Options::default()).ok()
        },
        |decoder: &Decoder, message: &Message<'_>, out: &mut Vec<(String, RawSample)>| {
            let mut list = Vec::new();
            let log = Nanos(message.log_time as i64);
            decoder.decode(message.data, log, log, &mut list).unwrap();
            let topic = &message.channel.topic;
            out.extend(list.into_iter().map(|sample| (topic.clone(), sample)));
        },
        |items| {
            for (topic, sample) in items.drain(..) {
                found.entry(topic).or_default().push(sample);
            }
            std::ops::ControlFlow::Continue(())
        },
    )
    .unwrap();
    (found, report)
}

/// CRC-32 of the stamps in us and the numbers as they lie in the file.
fn digest(samples: &[RawSample]) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    for sample in samples {
        crc.update(&(sample.header.unwrap().0 as u64 / 1000).to_le_bytes());
        let gyro = sample.gyro.iter().flatten();
        for number in gyro.chain(sample.orientation.iter().flatten()) {
            crc.update(&(*number as f32).to_le_bytes());
        }
    }
    crc.finalize()
}

#[test]
fn every_sample_of_a_flight_is_what_pyulog_reads_to_the_bit() {
    let (found, report) = samples(
        Reader::open(&fixture("px4_flight.ulg")).unwrap(),
        &WalkOptions::default(),
    );
    // pyulog 1.3.0: data['timestamp'] or ['timestamp_sample'], then gyro_rad, delta_angle, xyz, x y z or q, as `<Qfff`.
    let expected: [(&str, usize, u32); 9] = [
        ("sensor_combined", 3627, 0xb5a2_8ce4),
        ("sensor_gyro", 18, 0x816e_0731),
        ("sensor_gyro/1", 18, 0x1d03_8055),
        ("sensor_gyro/2", 18, 0x406f_f3f8),
        ("vehicle_angular_velocity", 917, 0xec3b_b3d6),
        ("vehicle_attitude", 368, 0xf76d_5513),
        ("vehicle_imu", 37, 0xca4a_18da),
        ("vehicle_imu/1", 37, 0x3df8_be7c),
        ("vehicle_imu/2", 37, 0x48fc_1c48),
    ];
    let read: Vec<(&str, usize, u32)> = found
        .iter()
        .map(|(topic, samples)| (topic.as_str(), samples.len(), digest(samples)))
        .collect();
    assert_eq!(read, expected);
    let survey = report.survey;
    assert_eq!(survey.facts.format, Format::Ulog);
    assert_eq!(survey.facts.library, "PX4 on PX4_FMU_V5, 1dacb4cdef2d");
    // The logger said itself that it dropped what came within 97 ms, and nothing else is wrong: one of 0 ms is nothing.
    let kinds: Vec<&ProblemKind> = survey.problems.first().iter().map(|p| &p.kind).collect();
    let dropouts = [97].map(|millis| ProblemKind::Dropout { millis });
    assert_eq!(kinds, dropouts.iter().collect::<Vec<_>>());
}

#[test]
fn the_topics_of_a_flight_say_what_a_sample_is_and_which_is_the_imu() {
    let mut ranks = BTreeMap::new();
    let mut kinds = BTreeMap::new();
    let reader = Reader::open(&fixture("px4_flight.ulg")).unwrap();
    strapd_recording::mcap::survey(&reader, &WalkOptions::default())
        .unwrap()
        .channels
        .iter()
        .for_each(|found| {
            let schema = found.channel.schema.as_deref().unwrap();
            let channel = Channel {
                topic: &found.channel.topic,
                message_encoding: &found.channel.message_encoding,
                schema_name: &schema.name,
                schema_encoding: &schema.encoding,
                schema_data: &schema.data,
            };
            let decoder = Decoder::compile(&channel, &Options::default()).unwrap();
            let topic = found.channel.topic.clone();
            kinds.insert(
                topic.clone(),
                decoder.stated().declared.sample_kind.unwrap(),
            );
            let role = role(&channel, None);
            if role.has_rate {
                ranks.insert(topic, role.rank);
            }
        });
    assert_eq!(kinds["sensor_combined"], SampleKind::Average);
    assert_eq!(kinds["vehicle_imu"], SampleKind::Rotation);
    assert_eq!(kinds["sensor_gyro"], SampleKind::Rate);
    let best = |least: &str| ranks[least];
    assert!(best("sensor_combined") < best("vehicle_imu"));
    assert!(best("vehicle_imu") < best("vehicle_imu/1"));
    assert!(best("vehicle_imu") < best("vehicle_angular_velocity"));
    assert!(best("vehicle_imu/1") < best("sensor_gyro"));
    assert!(!ranks.contains_key("vehicle_attitude"));
}

#[test]
fn bags_of_every_packing_hold_the_messages_of_the_log_they_were_made_of() {
    // Written by rosbags 0.11 from this very log.
    let (expected, _) = read(Reader::open(&fixture("constant_rate_ros1.mcap")).unwrap());
    let plain = |list: Vec<Read>| -> Vec<_> {
        list.into_iter()
            .map(|(topic, time, _, data)| (topic, time, data))
            .collect()
    };
    let expected = plain(expected);
    assert_eq!(expected.len(), 251);
    for packing in ["none", "lz4", "bz2"] {
        let (ours, report) =
            read(Reader::open(&fixture(&format!("constant_rate_{packing}.bag"))).unwrap());
        assert!(plain(ours) == expected, "{packing}");
        let survey = report.survey;
        assert!(
            survey.problems.is_empty(),
            "{packing}: {:?}",
            survey.problems
        );
        assert_eq!(survey.facts.format, Format::Bag);
        let chunks: Vec<&str> = survey.facts.chunks.keys().map(|how| how.name()).collect();
        assert_eq!(chunks, [packing]);
        let channel = &survey.channels[0].channel;
        assert_eq!(channel.metadata["callerid"], "/imu_driver");
    }
}

const ALL: [&str; 5] = [
    "px4_flight.ulg",
    "constant_rate_none.bag",
    "constant_rate_lz4.bag",
    "constant_rate_bz2.bag",
    "constant_rate.db3",
];

#[test]
fn files_pipes_and_threads_give_the_same_items_and_the_same_report() {
    for name in ALL {
        let mut damaged = bytes(name);
        let n = damaged.len();
        damaged[n / 2..n / 2 + 60].fill(0x55);
        damaged.drain(n / 4..n / 4 + 5);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        std::fs::write(&path, &damaged).unwrap();
        for (log, path) in [(bytes(name), fixture(name)), (damaged, path)] {
            let (whole, mut report) = read(Reader::open(&path).unwrap());
            let (piped, mut of_pipe) = read(from_bytes(&log).unwrap());
            assert!(whole == piped, "{name}: {} {}", whole.len(), piped.len());
            report.survey.file_size = None;
            of_pipe.survey.file_size = None;
            assert_eq!(report, of_pipe, "{name}");
            let pool = pool(3);
            let mut options = WalkOptions::default();
            let (alone, _) =
                crate::mcap_logs::read_some(Reader::open(&path).unwrap(), &options, |_| true);
            options.pool = Some(&pool);
            let (many, _) =
                crate::mcap_logs::read_some(Reader::open(&path).unwrap(), &options, |_| true);
            assert!(alone == many && alone == whole, "{name}");
        }
    }
}

#[test]
fn a_bag_cut_anywhere_gives_every_message_before_the_cut_and_says_that_it_was_cut() {
    for packing in ["none", "lz4", "bz2"] {
        let whole = bytes(&format!("constant_rate_{packing}.bag"));
        let (all, _) = read(from_bytes(&whole).unwrap());
        let mut before = 0;
        for cut in (5_000..whole.len()).step_by(997) {
            let (ours, report) = read(from_bytes(&whole[..cut]).unwrap());
            assert!(ours[..] == all[..ours.len()], "{packing} {cut}");
            assert!(
                ours.len() >= before,
                "{packing} {cut}: {} then {}",
                before,
                ours.len()
            );
            before = ours.len();
            assert!(report.survey.problems.losses() > 0, "{packing} {cut}");
            if packing == "none" {
                // The payload itself and its head: what is whole in the file is given.
                let last = all[..]
                    .iter()
                    .take_while(|m| memchr::memmem::find(&whole[..cut], &m.3).is_some());
                assert_eq!(ours.len(), last.count(), "{cut}");
            }
        }
        assert!(before > 200, "{packing}");
    }
}

#[test]
fn a_recorder_killed_inside_an_open_chunk_loses_no_message_of_it() {
    let mut bag = bytes("constant_rate_none.bag");
    // Its sizes are filled in when a chunk is closed; the index is written at the end.
    let last = memchr::memmem::rfind(&bag, b"\x04\0\0\0op=\x05").unwrap();
    let size = last + memchr::memmem::find(&bag[last..], b"size=").unwrap() + 5;
    let length = u32::from_le_bytes(*bag[size..].first_chunk().unwrap()) as usize;
    let index = memchr::memmem::find(&bag, b"index_pos=").unwrap() + 10;
    bag[index..index + 8].fill(0);
    bag[size..size + 4].fill(0);
    let data = memchr::memmem::find(&bag[size..], &(length as u32).to_le_bytes()).unwrap() + size;
    bag[data..data + 4].fill(0);
    bag.truncate(data + 4 + length);
    let (ours, report) = read(from_bytes(&bag).unwrap());
    assert_eq!(ours.len(), 251);
    let kinds: Vec<_> = report
        .survey
        .problems
        .first()
        .iter()
        .map(|p| p.kind.clone())
        .collect();
    assert_eq!(
        kinds,
        [
            ProblemKind::UnfinishedChunk { read_on: true },
            ProblemKind::NoIndex
        ]
    );
}

#[test]
fn a_bag_whose_first_chunk_is_lost_is_read_by_the_connections_in_its_index() {
    let mut bag = bytes("constant_rate_bz2.bag");
    let first = memchr::memmem::find(&bag, b"BZh9").unwrap();
    bag[first + 30] ^= 0x10;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("damaged.bag");
    std::fs::write(&path, &bag).unwrap();
    let (ours, report) = read(Reader::open(&path).unwrap());
    let kinds: Vec<_> = report
        .survey
        .problems
        .first()
        .iter()
        .map(|p| p.kind.clone())
        .collect();
    assert!(matches!(kinds[0], ProblemKind::Unpack { .. }), "{kinds:?}");
    assert!(
        matches!(kinds[1], ProblemKind::DefinedBySummary { .. }),
        "{kinds:?}"
    );
    // How many are gone is known from the index behind the chunk.
    let lost = report.survey.problems.messages_lost();
    assert!(lost > 10);
    assert_eq!(ours.len() as u64 + lost, 251);
}

/// Bytes changed, cut out, put in, repeated, filled.
fn mutate(log: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(1..6) {
        if log.len() < 64 {
            return;
        }
        // Heads and definitions are at the beginning, and hurt most.
        let near = rng.random_range(16..log.len().min(6_000));
        let far = rng.random_range(16..log.len());
        let at = if rng.random() { near } else { far };
        let end = (at + rng.random_range(1..300)).min(log.len());
        match rng.random_range(0..6) {
            0 => log[at] ^= 1 << rng.random_range(0..8),
            1 => log[at..end].fill([0, 0x7f, 0xff][rng.random_range(0..3)]),
            2 => drop(log.drain(at..end)),
            3 => {
                let piece = log[at..end].to_vec();
                log.splice(at..at, piece);
            }
            4 => {
                let mut noise = vec![0; end - at];
                rng.fill_bytes(&mut noise);
                log.splice(at..at, noise);
            }
            _ => log.truncate(at.max(100)),
        }
    }
}

#[test]
fn thousands_of_changed_logs_neither_panic_nor_hang_nor_lose_anything_in_silence() {
    for name in ALL {
        // As long as it takes to have every kind of record.
        let seed: Vec<u8> = {
            let whole = bytes(name);
            let n = whole.len().min(60_000);
            if !name.ends_with(".ulg") {
                whole
            } else {
                whole[..n].to_vec()
            }
        };
        let (all, clean) = read(from_bytes(&seed).unwrap());
        let before = clean.survey.problems.losses();
        let mut rng = ChaCha8Rng::seed_from_u64(17);
        let (mut damaged, mut silent, mut slowest) = (0, 0, Duration::ZERO);
        let mut meter = Meter::start();
        for case in 0..2_500 {
            let mut log = seed.clone();
            mutate(&mut log, &mut rng);
            let (ours, report) = read(from_bytes(&log).unwrap());
            // They take milliseconds; a loop over a forged count would take minutes.
            let took = meter.lap(Duration::from_secs(20), format_args!("{name} {case}"));
            slowest = slowest.max(took);
            assert!(
                ours.len() <= log.len() / 10,
                "{name} {case}: {}",
                ours.len()
            );
            let told = report.survey.problems.total() > 0;
            assert!(report.survey.messages as usize == ours.len());
            damaged += 1;
            let lost = report.survey.problems.losses();
            // Neither format has checksums for all: what is changed in place cannot be seen. What is gone can.
            if ours.len() < all.len() && (!told || lost == 0 || lost < before.min(1)) {
                silent += 1;
                eprintln!(
                    "{name} {case}: {} of {}, nothing said",
                    ours.len(),
                    all.len()
                );
            }
        }
        eprintln!("{name}: {damaged} changed logs, the slowest {slowest:?}, {silent} silent");
        // A piece cut out at the borders of records leaves a whole log: 3 in 10,000 are met by chance.
        assert!(silent <= 3, "{name}: {silent}");
    }
}

#[test]
fn order_and_times_of_a_bag_are_those_of_its_records() {
    let (ours, _) = read(from_bytes(&bytes("constant_rate_lz4.bag")).unwrap());
    assert!(ours == in_order(ours.clone()));
}

/// A record of a bag: its fields, and data.
fn bag_record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let of = |(name, value): &(&str, &[u8])| {
        let length = (name.len() + 1 + value.len()) as u32;
        [&length.to_le_bytes()[..], name.as_bytes(), b"=", value].concat()
    };
    let fields: Vec<u8> = fields.iter().flat_map(of).collect();
    let (head, length) = (fields.len() as u32, data.len() as u32);
    [
        &head.to_le_bytes()[..],
        &fields,
        &length.to_le_bytes(),
        data,
    ]
    .concat()
}

/// A bag of one chunk of these records, packed with bzip2.
fn bag_of(records: &[u8]) -> Vec<u8> {
    let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::best());
    std::io::Write::write_all(&mut encoder, records).unwrap();
    let packed = encoder.finish().unwrap();
    let size = (records.len() as u32).to_le_bytes();
    let chunk = bag_record(
        &[("op", &[5]), ("compression", b"bz2"), ("size", &size)],
        &packed,
    );
    [&b"#ROSBAG V2.0\n"[..], &chunk].concat()
}

fn first_problem(bag: &[u8]) -> (usize, ProblemKind) {
    let (ours, report) = read(from_bytes(bag).unwrap());
    (ours.len(), report.survey.problems.first()[0].kind.clone())
}

/// Messages that differ in nothing are no recording, and cost as much as those that are.
#[test]
fn a_chunk_of_more_messages_than_its_bytes_can_tell_apart_is_refused() {
    let connection = bag_record(
        &[("op", &[7]), ("conn", &[0; 4]), ("topic", b"/t")],
        &[&11_u32.to_le_bytes()[..], b"type=a/B..."].concat(),
    );
    let message = |time: u32| {
        let time = [time.to_le_bytes(), [0; 4]].concat();
        bag_record(&[("op", &[2]), ("conn", &[0; 4]), ("time", &time)], b"")
    };
    let same = [connection.clone(), message(7).repeat(100_000)].concat();
    let (n, kind) = first_problem(&bag_of(&same));
    assert!(
        n == 0 && matches!(kind, ProblemKind::Unpack { .. }),
        "{n} {kind:?}"
    );
    // Of those that differ in their time alone, each is one.
    let apart: Vec<u8> = (0..20_000).flat_map(message).collect();
    let (n, kind) = first_problem(&bag_of(&[connection, apart].concat()));
    assert_eq!((n, kind), (20_000, ProblemKind::NoIndex));
}

/// A block of bzip2 takes the time of its size, whatever it is packed in: 45 bytes of zeros fill the largest.
#[test]
fn a_chunk_of_bzip2_is_given_no_larger_blocks_than_its_bytes_can_fill() {
    let (n, kind) = first_problem(&bag_of(&vec![0; 60 << 20]));
    assert!(
        n == 0 && matches!(kind, ProblemKind::Unpack { .. }),
        "{kind:?}"
    );
    // An image of one colour is nothing like it.
    let black = bag_record(
        &[("op", &[2]), ("conn", &[0; 4]), ("time", &[0; 8])],
        &vec![0; 900_000],
    );
    let connection = bag_record(&[("op", &[7]), ("conn", &[0; 4]), ("topic", b"/t")], b"");
    let (n, _) = first_problem(&bag_of(&[connection, black].concat()));
    assert_eq!(n, 1);
}
