//! Recordings of ROS 2 in SQLite: the messages of the log they were made of, from files and pipes, with and without
//! what a killed recorder left beside them; cut, and with each page lost in turn.

use crate::made_databases::{Message, Topic, database, sealed};
use crate::mcap_logs::{Read, from_bytes, read, read_some};
use std::path::PathBuf;
use strapd_recording::format::Format;
use strapd_recording::mcap::{ProblemKind, Reader, WalkOptions, WalkReport};

const PAGE: usize = 4096;
/// Page of the recording that has its topics, from 0.
const TOPICS: usize = 3;

fn fixture(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures")).join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(fixture(name)).unwrap()
}

const IMU: Topic<'static> = ("/imu", "sensor_msgs/msg/Imu");

/// Topic, time and payload, in the order of the rows.
type Told = Vec<(String, u64, Vec<u8>)>;

fn told(list: Vec<Read>) -> Told {
    let short = |(topic, time, _, data)| (topic, time, data);
    list.into_iter().map(short).collect()
}

/// Samples and truths of which the recordings were made, of the first hundred instants.
fn expected() -> Told {
    let mut all = told(read(Reader::open(&fixture("constant_rate.mcap")).unwrap()).0);
    all.truncate(200);
    all
}

/// Numbers of them that the killed recorder had taken, in the database, and with each transaction beside it.
const KILLED: [usize; 3] = [48, 64, 80];

fn kinds(report: &WalkReport) -> Vec<ProblemKind> {
    let problems = report.survey.problems.first().iter();
    problems.map(|problem| problem.kind.clone()).collect()
}

/// A file of these bytes, with these beside it.
fn opened(database: &[u8], wal: Option<&[u8]>) -> (tempfile::TempDir, Reader) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r.db3");
    std::fs::write(&path, database).unwrap();
    if let Some(wal) = wal {
        std::fs::write(dir.path().join("r.db3-wal"), wal).unwrap();
    }
    let reader = Reader::open(&path).unwrap();
    (dir, reader)
}

#[test]
fn a_recording_in_sqlite_holds_the_messages_of_the_log_it_was_made_of() {
    // Written by rosbags 0.11.9, with the definitions of its types.
    let (ours, report) = read(Reader::open(&fixture("constant_rate.db3")).unwrap());
    assert!(told(ours) == expected());
    assert!(report.survey.problems.is_empty(), "{:?}", kinds(&report));
    assert_eq!(report.survey.facts.format, Format::Rosbag2);
    assert_eq!(report.survey.facts.library, "rosbag2 of ROS 2 rosbags");
    let channels = &report.survey.channels;
    assert_eq!(channels.len(), 2);
    for found in channels {
        let schema = found.channel.schema.as_deref().unwrap();
        assert_eq!(schema.encoding, "ros2msg");
        assert!(schema.data.len() > 100);
        assert_eq!(found.channel.message_encoding, "cdr");
        assert!(found.channel.metadata["topic_type_hash"].starts_with("RIHS01_"));
    }
}

#[test]
fn what_a_killed_recorder_committed_beside_the_database_is_read_and_without_that_file_what_came_before()
 {
    let name = "constant_rate_killed.db3";
    let (ours, report) = read(Reader::open(&fixture(name)).unwrap());
    assert!(told(ours)[..] == expected()[..KILLED[2]]);
    assert!(report.survey.problems.is_empty(), "{:?}", kinds(&report));
    // ROS 2 Humble has no definitions in its tables: those of the types every ROS has are ours.
    let schema = report.survey.channels[0].channel.schema.as_deref().unwrap();
    let text = String::from_utf8(schema.data.clone()).unwrap();
    assert!(text.contains("MSG: builtin_interfaces/Time"), "{text}");
    let (_dir, alone) = opened(&bytes(name), None);
    let (ours, report) = read(alone);
    assert!(told(ours)[..] == expected()[..KILLED[0]]);
    assert!(report.survey.problems.is_empty(), "{:?}", kinds(&report));
}

#[test]
fn a_changed_or_cut_file_beside_the_database_gives_its_whole_transactions_and_says_what_is_left_out()
 {
    let (database, wal) = (
        bytes("constant_rate_killed.db3"),
        bytes("constant_rate_killed.db3-wal"),
    );
    let all = expected();
    let of = |wal: &[u8]| {
        let (_dir, reader) = opened(&database, Some(wal));
        let (ours, report) = read(reader);
        let ours = told(ours);
        assert!(ours[..] == all[..ours.len()], "{}", ours.len());
        (ours.len(), report)
    };
    let mut counts = std::collections::BTreeSet::new();
    for cut in (0..wal.len()).step_by(128) {
        let (n, report) = of(&wal[..cut]);
        counts.insert(n);
        let said = kinds(&report);
        let is_said = said.iter().any(|k| matches!(k, ProblemKind::Beside { .. }));
        // At the end of a transaction nothing tells that another followed.
        let is_border = cut == 0 || (cut - 32).is_multiple_of(24 + 1024);
        assert!(is_said || is_border, "{cut}: {said:?}");
    }
    assert_eq!(counts.into_iter().collect::<Vec<_>>(), KILLED[..2]);
    for at in (0..wal.len()).step_by(197) {
        let mut changed = wal.clone();
        changed[at] ^= 4;
        let (n, report) = of(&changed);
        assert!(n < KILLED[2], "{at}");
        // A changed salt is one of another use of the file, which is no damage.
        let frame = at.saturating_sub(32) % (24 + 1024);
        let is_said = report.survey.problems.losses() > 0;
        assert!(
            is_said || (8..16).contains(&frame),
            "{at}: {:?}",
            kinds(&report)
        );
    }
    // Of another database.
    let mut other = wal.clone();
    other[10] = 0x40;
    let (n, report) = of(&other);
    assert!(n == KILLED[0] && report.survey.problems.losses() > 0);
}

/// A page that lies beyond everything costs neither time nor memory, whether its transaction gives it a number or not.
#[test]
fn a_far_page_in_the_file_beside_the_database_is_no_page_of_it() {
    let (database, wal) = (
        bytes("constant_rate_killed.db3"),
        bytes("constant_rate_killed.db3-wal"),
    );
    let frame = |nth: usize| 32 + nth * (24 + 1024);
    let frames = (wal.len() - 32) / (24 + 1024);
    for far in [3_000_000_u32, u32::MAX - 1] {
        for is_committed in [false, true] {
            let mut changed = wal.clone();
            changed[frame(8)..][..4].copy_from_slice(&far.to_be_bytes());
            for nth in (0..frames).filter(|_| is_committed) {
                let size = &mut changed[frame(nth) + 4..][..4];
                if size != [0; 4] {
                    size.copy_from_slice(&far.to_be_bytes());
                }
            }
            sealed(&mut changed);
            let (_dir, reader) = opened(&database, Some(&changed));
            let start = std::time::Instant::now();
            let (ours, report) = read(reader);
            let said = kinds(&report);
            let ours = told(ours);
            let all = expected();
            assert!(ours.len() >= KILLED[0] && ours.iter().all(|m| all.contains(m)));
            let is_beside = |kind: &ProblemKind| matches!(kind, ProblemKind::Beside { .. });
            assert_eq!(said.iter().any(is_beside), !is_committed, "{far}: {said:?}");
            // They take milliseconds; a look at each number would take minutes.
            assert!(
                start.elapsed() < std::time::Duration::from_secs(20),
                "{far}"
            );
        }
    }
}

#[test]
fn a_database_cut_anywhere_gives_every_message_whose_page_is_whole_and_says_that_it_is_cut() {
    let whole = bytes("constant_rate.db3");
    let all = expected();
    for cut in (512..whole.len()).step_by(512) {
        let (ours, report) = read(from_bytes(&whole[..cut]).unwrap());
        let ours = told(ours);
        let pages = &whole[..cut / PAGE * PAGE];
        let is_there = |m: &&(String, u64, Vec<u8>)| memchr::memmem::find(pages, &m.2).is_some();
        // Without the page of topics nothing can be told of any message.
        let are_topics = cut >= 5 * PAGE;
        let there: Told = all.iter().filter(is_there).cloned().collect();
        if are_topics || !ours.is_empty() {
            assert!(ours == there, "{cut}: {} of {}", ours.len(), there.len());
        }
        assert!(report.survey.problems.losses() > 0, "{cut}");
    }
    let (ours, _) = read(from_bytes(&whole[..whole.len() * 3 / 4]).unwrap());
    assert!(ours.len() > 60, "{}", ours.len());
}

#[test]
fn a_row_whose_place_another_has_is_lost_and_rows_in_any_order_of_places_are_not() {
    let all = expected();
    let messages: Vec<Message<'_>> = (0..8).map(|n| (0, n as u64, &all[2 * n].2[..])).collect();
    let whole = database(PAGE, &[IMU], &messages);
    let leaf = (3..whole.len() / PAGE)
        .map(|page| page * PAGE)
        .find(|at| whole[*at] == 0x0d && whole[at + 4] == 8)
        .unwrap();
    let pointer = |nth: usize| leaf + 8 + 2 * nth..leaf + 10 + 2 * nth;
    let times = |bytes: &[u8]| {
        let (ours, report) = read(from_bytes(bytes).unwrap());
        let times: Vec<u64> = told(ours).into_iter().map(|(_, time, _)| time).collect();
        (times, kinds(&report))
    };
    let mut twice = whole.clone();
    twice.copy_within(pointer(2), pointer(5).start);
    let why = "another row lies in its place";
    let lost = vec![ProblemKind::Row { why }];
    assert_eq!(times(&twice), (vec![0, 1, 2, 3, 4, 6, 7], lost));
    let mut turned = whole.clone();
    turned.copy_within(pointer(1), pointer(2).start);
    turned[pointer(1)].copy_from_slice(&whole[pointer(2)]);
    let (mut given, problems) = times(&turned);
    given.sort_unstable();
    assert_eq!((given, problems), ((0..8).collect(), Vec::new()));
}

#[test]
fn a_lost_page_costs_its_own_rows_alone_and_how_many_is_counted() {
    let whole = bytes("constant_rate.db3");
    let all = expected();
    let mut lost_somewhere = 0;
    for page in 1..whole.len() / PAGE {
        let mut damaged = whole.clone();
        damaged[page * PAGE..(page + 1) * PAGE].fill(0x55);
        let is_there = |m: &&(String, u64, Vec<u8>)| memchr::memmem::find(&damaged, &m.2).is_some();
        let mut there: Told = all.iter().filter(is_there).cloned().collect();
        if page == TOPICS {
            // The one page without which no message has a name.
            there.clear();
        }
        let (_dir, reader) = opened(&damaged, None);
        let (ours, report) = read(reader);
        let ours = told(ours);
        assert!(
            ours == there,
            "page {page}: {} of {}",
            ours.len(),
            there.len()
        );
        let lost = (all.len() - ours.len()) as u64;
        let problems = &report.survey.problems;
        if lost > 0 {
            lost_somewhere += 1;
            assert!(problems.losses() > 0, "page {page}");
            // Nothing tells how many were on the last.
            let is_last = page != TOPICS && !ours.contains(all.last().unwrap());
            let counted = if is_last { 0 } else { lost };
            assert_eq!(
                problems.messages_lost(),
                counted,
                "page {page}: {:?}",
                kinds(&report)
            );
        }
    }
    assert!(lost_somewhere > 8, "{lost_somewhere}");
}

#[test]
fn a_page_that_two_places_name_is_given_once() {
    let whole = bytes("constant_rate.db3");
    // The interior page of the table of messages: its first two children.
    let root = (1..whole.len() / PAGE)
        .find(|page| whole[page * PAGE] == 5)
        .unwrap();
    let place = |nth: usize| {
        let at = root * PAGE + 12 + 2 * nth;
        root * PAGE + usize::from(u16::from_be_bytes([whole[at], whole[at + 1]]))
    };
    let mut twice = whole.clone();
    twice.copy_within(place(0)..place(0) + 4, place(1));
    let (ours, report) = read(from_bytes(&twice).unwrap());
    // The page that no place names any more is found all the same.
    assert!(told(ours) == expected());
    assert!(report.survey.problems.losses() > 0);
    assert_eq!(report.survey.problems.messages_lost(), 0);
}

#[test]
fn messages_that_were_packed_one_by_one_are_unpacked_and_a_bomb_among_them_is_refused() {
    let plain = expected();
    let imu = &plain[0].2;
    let packed = zstd::bulk::compress(imu, 3).unwrap();
    let bomb = zstd::bulk::compress(&vec![0; 30 << 20], 3).unwrap();
    let mut cut = packed.clone();
    cut.truncate(packed.len() - 9);
    let messages = [imu, &packed, &bomb, &cut];
    let messages: Vec<Message<'_>> = messages
        .iter()
        .map(|data| (0, 7, data.as_slice()))
        .collect();
    let database = database(65_536, &[IMU], &messages);
    let (ours, report) = read(from_bytes(&database).unwrap());
    let ours: Vec<Vec<u8>> = ours.into_iter().map(|m| m.3).collect();
    assert_eq!(ours, [imu.clone(), imu.clone()]);
    assert_eq!(report.survey.problems.messages_lost(), 2);
    let why: Vec<String> = kinds(&report).iter().map(ToString::to_string).collect();
    assert!(why[0].contains("more than the limit"), "{why:?}");
    assert!(why[1].contains("does not unpack"), "{why:?}");
}

/// Messages of 60 bytes unpack to a megabyte each: the total has a bound, and what is beyond it is counted.
#[test]
fn messages_that_unpack_to_more_than_their_share_are_read_up_to_a_bound_for_all() {
    let zeros = zstd::bulk::compress(&vec![0; 1 << 20], 1).unwrap();
    assert!(zeros.len() < 100);
    let messages: Vec<Message<'_>> = (0..400).map(|n| (0, n, &zeros[..])).collect();
    let (ours, report) = read(from_bytes(&database(PAGE, &[IMU], &messages)).unwrap());
    // A quarter of a gibibyte beyond a thousand times what they are packed in.
    let share = (1 << 20) - 1000 * zeros.len();
    let all = (256 << 20) / share;
    assert!((all..=all + 1).contains(&ours.len()), "{}", ours.len());
    let lost = 400 - ours.len() as u64;
    assert_eq!(report.survey.problems.messages_lost(), lost);
    let why = ProblemKind::Row {
        why: "it unpacks to more than the limit",
    };
    assert_eq!(kinds(&report).first(), Some(&why));
}

#[test]
fn a_database_of_something_else_and_one_without_its_header_say_what_is_missing() {
    let mut other = database(1024, &[IMU], &[]);
    for at in memchr::memmem::find_iter(&other.clone(), b"messages") {
        other[at..at + 8].copy_from_slice(b"visitors");
    }
    let (ours, report) = read(from_bytes(&other).unwrap());
    assert!(ours.is_empty());
    assert_eq!(kinds(&report), [ProblemKind::NoTable { name: "messages" }]);
    let mut none = bytes("constant_rate.db3");
    none[16] = 3;
    let (_, report) = read(from_bytes(&none).unwrap());
    assert!(matches!(kinds(&report)[..], [ProblemKind::Database { .. }]));
    let (_, report) = read(from_bytes(&none[..40]).unwrap());
    assert!(matches!(kinds(&report)[..], [ProblemKind::Database { .. }]));
}

#[test]
fn a_journal_beside_the_database_that_was_not_rolled_back_is_said() {
    let (dir, _) = opened(&bytes("constant_rate.db3"), None);
    let journal = dir.path().join("r.db3-journal");
    let said = |head: &[u8]| {
        std::fs::write(&journal, head).unwrap();
        let reader = Reader::open(&dir.path().join("r.db3")).unwrap();
        kinds(&read(reader).1)
    };
    let hot = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7, 0, 0];
    assert_eq!(said(&hot), [ProblemKind::Journal]);
    assert!(said(&[0; 10]).is_empty());
}

#[test]
fn without_the_first_pages_topics_and_messages_are_known_by_their_rows() {
    let mut damaged = bytes("constant_rate.db3");
    damaged[100..PAGE].fill(0);
    let (ours, report) = read(from_bytes(&damaged).unwrap());
    assert!(told(ours) == expected());
    assert!(report.survey.problems.losses() >= 2, "{:?}", kinds(&report));
}

#[test]
fn topics_are_told_apart_and_one_alone_can_be_read() {
    let reader = Reader::open(&fixture("constant_rate.db3")).unwrap();
    let (imu, _) = read_some(reader, &WalkOptions::default(), |topic| {
        topic == "/imu/data_raw"
    });
    assert_eq!(imu.len(), 100);
}

#[test]
#[ignore = "measures: cargo test --release -p strapd-recording --test recording -- --ignored --nocapture messages_a_second"]
fn messages_a_second() {
    let imu = expected().swap_remove(0).2;
    let messages: Vec<Message<'_>> = (0..400_000).map(|n| (0, n * 1_000_000, &imu[..])).collect();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("long.db3");
    std::fs::write(&path, database(65_536, &[IMU], &messages)).unwrap();
    for _ in 0..3 {
        let begun = std::time::Instant::now();
        let report = strapd_recording::mcap::walk(
            Reader::open(&path).unwrap(),
            &WalkOptions::default(),
            |_| Some(()),
            |(), message, out: &mut Vec<u64>| out.push(message.log_time),
            |_| std::ops::ControlFlow::Continue(()),
        )
        .unwrap();
        assert_eq!(report.items, 400_000);
        let secs = begun.elapsed().as_secs_f64();
        println!("{:.2} M messages a second", 0.4 / secs);
    }
}
