//! Two bodies on one topic are never integrated as one; one body in several channels is.
//!
//! The shapes are those of other people's recorders: a converted ROS 1 bag has a channel for each
//! connection, with its `callerid`; rosbag2 puts every publisher of a topic into one channel; merged
//! files and a recorder started again leave channels that differ in nothing that matters.

use crate::made_logs::{ImuSample, START, STEP, TOPIC, imu_definition, imu_message, motion};
use crate::replays::{Bits, attitudes, done, only, replay_named, replay_of};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use strapd::error::Error;
use strapd::pipeline::check::check;
use strapd::pipeline::opening;
use strapd_attitude::record::Verdict;
use strapd_recording::decode::Options;
use strapd_recording::pool::Pool;

/// One message: the metadata of its channel, its frame, its sample.
struct Sent {
    metadata: (&'static str, &'static str),
    frame: &'static str,
    sample: ImuSample,
}

const NO_WORD: (&str, &str) = ("offered_qos_profiles", "");

fn sent(
    metadata: (&'static str, &'static str),
    frame: &'static str,
    all: &[ImuSample],
) -> Vec<Sent> {
    all.iter()
        .map(|sample| Sent {
            metadata,
            frame,
            sample: *sample,
        })
        .collect()
}

/// A log of these, in the order of their stamps.
fn log(dir: &Path, mut all: Vec<Sent>) -> PathBuf {
    all.sort_by_key(|s| s.sample.stamp);
    let options = mcap::WriteOptions::new()
        .compression(None)
        .chunk_size(Some(4096));
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let schema = writer
        .add_schema(
            "sensor_msgs/msg/Imu",
            "ros2msg",
            imu_definition().as_bytes(),
        )
        .unwrap();
    for (sequence, s) in all.iter().enumerate() {
        let (key, value) = s.metadata;
        let metadata = [(key.to_owned(), value.to_owned())].into();
        let channel_id = writer.add_channel(schema, TOPIC, "cdr", &metadata).unwrap();
        let log_time = s.sample.stamp as u64 + 2_000_000;
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: sequence as u32,
            log_time,
            publish_time: log_time,
        };
        writer
            .write_to_known_channel(&header, &imu_message(s.frame, &s.sample))
            .unwrap();
    }
    writer.finish().unwrap();
    let path = dir.join(format!("{}.mcap", all.len()));
    std::fs::write(&path, writer.into_inner().into_inner()).unwrap();
    path
}

/// A second body: it turns the other way, and is sampled 3 ms later.
fn other(n: usize) -> Vec<ImuSample> {
    let turned = |s: ImuSample| ImuSample {
        stamp: s.stamp + 3_000_000,
        gyro: s.gyro.map(|v| -2.0 * v),
        ..s
    };
    motion(n).into_iter().map(turned).collect()
}

fn both(
    dir: &Path,
    one: ((&'static str, &'static str), &'static str),
    two: ((&'static str, &'static str), &'static str),
) -> PathBuf {
    let mut all = sent(one.0, one.1, &motion(600));
    all.extend(sent(two.0, two.1, &other(600)));
    log(dir, all)
}

fn alone(dir: &Path, samples: &[ImuSample]) -> Vec<Bits> {
    let dir_of_one = dir.join("alone");
    std::fs::create_dir_all(&dir_of_one).unwrap();
    let path = log(&dir_of_one, sent(NO_WORD, "imu_link", samples));
    attitudes(&replay_of(&path), dir).1
}

/// The three ways in which two publishers share a topic, and the names they get.
fn shared_topics(dir: &Path) -> Vec<(PathBuf, [String; 2])> {
    let at = |name: &str| {
        let dir = dir.join(name);
        std::fs::create_dir_all(&dir).unwrap();
        dir
    };
    let names = |a: &str, b: &str| [format!("{TOPIC}@{a}"), format!("{TOPIC}@{b}")];
    let left = ("callerid", "/left_driver");
    let right = ("callerid", "/right_driver");
    vec![
        (
            both(&at("frames"), (NO_WORD, "left"), (NO_WORD, "right")),
            names("left", "right"),
        ),
        (
            both(&at("connections"), (left, "imu_link"), (right, "imu_link")),
            names("/left_driver", "/right_driver"),
        ),
        (
            both(
                &at("turns"),
                (NO_WORD, "imu_link"),
                (("offered_qos_profiles", "- depth: 5"), "imu_link"),
            ),
            names("channel-1", "channel-2"),
        ),
    ]
}

#[test]
fn two_publishers_on_one_topic_are_refused_and_both_are_named() {
    let dir = tempfile::tempdir().unwrap();
    for (path, names) in shared_topics(dir.path()) {
        for replay in [replay_of(&path), replay_named(&path, TOPIC)] {
            let error = done(&replay).unwrap_err();
            assert!(
                matches!(
                    error,
                    Error::Recording(strapd_recording::Error::SeveralImuTopics { .. })
                ),
                "{error:?}"
            );
            let said = error.to_string();
            for name in &names {
                assert!(said.contains(name), "{name} is missing: {said}");
            }
            assert!(said.contains("topic NAME takes one"), "{said}");
        }
    }
}

#[test]
fn each_of_two_publishers_on_one_topic_is_taken_by_its_name_and_all_are_taken_apart() {
    let dir = tempfile::tempdir().unwrap();
    let expected = [
        alone(dir.path(), &motion(600)),
        alone(dir.path(), &other(600)),
    ];
    for (path, names) in shared_topics(dir.path()) {
        for (name, expected) in names.iter().zip(&expected) {
            let (summary, found) = attitudes(&replay_named(&path, name), dir.path());
            assert_eq!(only(&summary).topic, *name);
            assert_eq!(found, *expected, "{name}");
            assert!(
                !summary.is_lossy(),
                "the other was not asked for: {summary:?}"
            );
        }
        let summary = done(&replay_named(&path, "all")).unwrap();
        let of = |n: usize| (summary.topics[n].topic.clone(), summary.topics[n].written);
        assert_eq!(summary.topics.len(), 2);
        assert_eq!(of(0), (names[0].clone(), 600));
        assert_eq!(of(1), (names[1].clone(), 600));
        assert_ne!(
            summary.topics[0].output_topic,
            summary.topics[1].output_topic
        );
        // The last attitude of each is that of a run alone, to the bit.
        for (topic, expected) in summary.topics.iter().zip(&expected) {
            let last = expected.last().unwrap().numbers();
            assert_eq!(topic.final_wxyz, last, "{}", topic.topic);
        }
    }
}

#[test]
fn a_check_of_two_publishers_looks_at_each_and_does_not_advise_to_straighten_their_stamps() {
    let dir = tempfile::tempdir().unwrap();
    for (path, names) in shared_topics(dir.path()) {
        let pool = Pool::new(2).unwrap();
        let checked = check(
            &opening::open(&path).unwrap(),
            None,
            &Options::default(),
            &pool,
        )
        .unwrap();
        let found: Vec<&String> = checked.topics.iter().map(|t| &t.looked.topic).collect();
        assert_eq!(found, names.iter().collect::<Vec<_>>());
        for topic in &checked.topics {
            assert_eq!(topic.looked.quality.count, 600);
            let found = strapd::report::findings::of_samples(&topic.looked);
            let of_stamps = ["jitter", "stamps-stand-still"];
            assert!(
                found.iter().all(|f| !of_stamps.contains(&f.code)),
                "{found:?}"
            );
        }
    }
}

#[test]
fn a_topic_split_over_channels_by_a_recorder_started_again_is_one_body() {
    let dir = tempfile::tempdir().unwrap();
    let samples = motion(600);
    let expected = alone(dir.path(), &samples);
    let mut all = sent(NO_WORD, "imu_link", &samples[..200]);
    all.extend(sent(
        ("offered_qos_profiles", "2"),
        "imu_link",
        &samples[200..410],
    ));
    all.extend(sent(
        ("offered_qos_profiles", "3"),
        "imu_link",
        &samples[410..],
    ));
    let path = log(dir.path(), all);
    let (summary, found) = attitudes(&replay_of(&path), dir.path());
    assert_eq!(found, expected);
    assert_eq!(only(&summary).topic, TOPIC);
    assert!(!summary.is_lossy());
}

#[test]
fn what_two_recorders_wrote_of_one_publisher_is_one_body() {
    let dir = tempfile::tempdir().unwrap();
    let samples = motion(600);
    let mut all = sent(NO_WORD, "imu_link", &samples);
    all.extend(sent(
        ("offered_qos_profiles", "2"),
        "imu_link",
        &samples[150..450],
    ));
    let path = log(dir.path(), all);
    let (summary, found) = attitudes(&replay_of(&path), dir.path());
    assert_eq!(found, alone(dir.path(), &samples));
    assert_eq!(only(&summary).counts.get(Verdict::Repeated), 300);
    assert!(!summary.is_lossy());
}

#[test]
fn a_second_publisher_that_comes_late_is_left_out_counted_and_named() {
    let dir = tempfile::tempdir().unwrap();
    let samples = motion(1500);
    let mut all = sent(NO_WORD, "left", &samples);
    all.extend(sent(NO_WORD, "right", &other(1500)[1200..]));
    let path = log(dir.path(), all);
    let (summary, found) = attitudes(&replay_of(&path), dir.path());
    assert_eq!(found, alone(dir.path(), &samples));
    let topic = only(&summary);
    assert_eq!(topic.left_out, 300);
    assert!(summary.is_lossy(), "nobody asked to leave them out");
    let said = topic.warnings().join("; ");
    let name = format!("{TOPIC}@right");
    assert!(
        said.contains("300 messages") && said.contains(&name),
        "{said}"
    );

    let (summary, found) = attitudes(&replay_named(&path, &name), dir.path());
    assert_eq!(found, alone(dir.path(), &other(1500)[1200..]));
    assert!(!summary.is_lossy());
}

#[test]
fn one_message_without_a_frame_is_no_second_body() {
    let dir = tempfile::tempdir().unwrap();
    let mut all = sent(NO_WORD, "imu_link", &motion(600));
    all[77].frame = "";
    let path = log(dir.path(), all);
    let summary = done(&replay_of(&path)).unwrap();
    let topic = only(&summary);
    assert_eq!((topic.written, topic.left_out), (599, 1));
}

#[cfg(unix)]
#[test]
fn two_publishers_in_a_pipe_are_not_mixed_either() {
    let dir = tempfile::tempdir().unwrap();
    let expected = alone(dir.path(), &motion(600));
    let piped = |path: &Path| {
        let pipe = path.with_extension("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let bytes = std::fs::read(path).unwrap();
        let end = pipe.clone();
        // It fails where the run ends before the pipe does.
        let writer = std::thread::spawn(move || drop(std::fs::write(end, bytes)));
        let out = pipe.with_extension("ndjson");
        let mut replay = replay_of(&pipe);
        replay.targets = vec![crate::replays::target(&out)];
        let summary = done(&replay);
        writer.join().unwrap();
        let text = std::fs::read_to_string(&out).unwrap_or_default();
        (summary, crate::replays::ndjson(&text))
    };
    let [frames, connections, turns] = <[_; 3]>::try_from(shared_topics(dir.path())).unwrap();
    for ((path, _), word) in [(frames, "right"), (connections, "/right_driver")] {
        let (summary, found) = piped(&path);
        let summary = summary.unwrap();
        assert_eq!(found, expected, "the first publisher's alone");
        let said = only(&summary).warnings().join("; ");
        assert!(said.contains(word), "{said}");
    }
    let (summary, found) = piped(&turns.0);
    let error = summary.unwrap_err().to_string();
    assert!(error.contains("take turns"), "{error}");
    assert_eq!(found, []);
}

#[test]
fn the_step_of_the_logs_made_here_is_that_of_the_motion() {
    // What the shapes rest on: two publishers 3 ms apart, each at its own 10 ms.
    let (one, two) = (motion(3), other(3));
    assert_eq!(one[1].stamp - one[0].stamp, STEP);
    assert_eq!(two[0].stamp - START, 3_000_000);
}
