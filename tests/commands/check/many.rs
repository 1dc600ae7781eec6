//! Logs of many topics, channels and schemas: told in one pass, within bounds, and each topic as it is alone.

use crate::made_logs::{Logged, logged, motion};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use strapd::inspection::{Checked, CheckedTopic};
use strapd::pipeline::check::{Examination, check, examine};
use strapd::pipeline::inspection::look;
use strapd::pipeline::opening;
use strapd::report::findings::findings;
use strapd_attitude::estimate::EstimationSettings;
use strapd_recording::Recording;
use strapd_recording::decode::Options;
use strapd_recording::pool::Pool;

/// `topics` IMUs, which take turns, each of a motion of its own.
fn several(dir: &Path, topics: usize, samples: usize) -> PathBuf {
    let motion = motion(samples + topics);
    let mut messages: Vec<Logged> = (0..topics)
        .flat_map(|n| {
            let topic: &'static str = Box::leak(format!("/body{n}/imu").into_boxed_str());
            let stamps = motion.iter().map(|s| s.stamp).take(samples);
            let own = motion.iter().skip(n).zip(stamps);
            let own: Vec<_> = own
                .map(|(sample, stamp)| {
                    let mut sample = *sample;
                    sample.stamp = stamp;
                    sample
                })
                .collect();
            logged(topic, &own)
        })
        .collect();
    messages.sort_by_key(|m| m.log_time);
    let path = dir.join(format!("{topics}.mcap"));
    let packing = Some(Some(mcap::Compression::Zstd));
    std::fs::write(&path, crate::made_logs::bytes(packing, 1 << 16, &messages)).unwrap();
    path
}

fn surveyed(path: &Path, pool: &Pool) -> Recording {
    Recording::of(&opening::open(path).unwrap(), &Options::default(), pool).unwrap()
}

fn checked(path: &Path, named: Option<&str>) -> Checked {
    check(
        &opening::open(path).unwrap(),
        named,
        &Options::default(),
        &Pool::new(2).unwrap(),
    )
    .unwrap()
}

#[test]
fn a_topic_among_others_is_told_as_it_is_alone() {
    let dir = tempfile::tempdir().unwrap();
    let path = several(dir.path(), 5, 400);
    let together = checked(&path, None);
    assert_eq!(together.topics.len(), 5);
    for topic in &together.topics {
        let name = topic.looked.topic.as_str();
        let alone = checked(&path, Some(name));
        let own = |checked: &Checked| {
            let found = findings(checked).into_iter().filter(|f| f.topic == name);
            found.map(|f| f.json().to_string()).collect::<Vec<_>>()
        };
        assert_eq!(own(&together), own(&alone), "{name}");
        let [alone] = &alone.topics[..] else {
            panic!("{name}");
        };
        let summary = |topic: &CheckedTopic| format!("{:?}", topic.replayed.as_ref().unwrap());
        assert_eq!(summary(topic), summary(alone));
        assert_eq!(topic.replayed.as_ref().unwrap().counts.used(), 400);
    }
}

#[test]
fn a_topic_that_is_refused_keeps_no_other_from_being_told_about() {
    let dir = tempfile::tempdir().unwrap();
    let path = several(dir.path(), 3, 400);
    // None of them rests, so no bias can be found: each is refused, and each says so.
    let examination = Examination {
        selection: strapd_recording::Selection::default(),
        plan: EstimationSettings {
            bias: strapd_attitude::estimate::Bias::Auto,
            ..EstimationSettings::default()
        },
        reference_topic: String::new(),
        drawing: None,
        command: String::new(),
    };
    let pool = Pool::new(2).unwrap();
    let checked = examine(
        &opening::open(&path).unwrap(),
        &examination,
        &pool,
        &mut |_| {},
    )
    .unwrap();
    assert_eq!(checked.topics.len(), 3);
    for topic in &checked.topics {
        let refused = topic.replayed.as_ref().unwrap_err();
        assert!(refused.what().contains(&topic.looked.topic), "{refused}");
    }
}

#[test]
fn all_topics_are_replayed_in_one_pass() {
    let dir = tempfile::tempdir().unwrap();
    let path = several(dir.path(), 40, 300);
    let examination = Examination {
        selection: strapd_recording::Selection::default(),
        plan: EstimationSettings::default(),
        reference_topic: String::new(),
        drawing: None,
        command: String::new(),
    };
    let mut places: Vec<f64> = Vec::new();
    let pool = Pool::new(2).unwrap();
    let checked = examine(
        &opening::open(&path).unwrap(),
        &examination,
        &pool,
        &mut |position| {
            places.extend(position.fraction);
        },
    )
    .unwrap();
    assert_eq!(checked.topics.len(), 40);
    assert!(places.len() > 2 && places.is_sorted(), "{places:?}");
}

#[test]
fn beyond_256_topics_the_rest_is_named_and_counted() {
    let dir = tempfile::tempdir().unwrap();
    let path = several(dir.path(), 300, 4);
    let checked = checked(&path, None);
    assert_eq!((checked.topics.len(), checked.left_out.len()), (256, 44));
    assert_eq!(checked.left_out[0], "/body256/imu");
    let found = findings(&checked);
    let left_out = found.iter().find(|f| f.code == "topics-left-out").unwrap();
    assert!(left_out.what.starts_with("44 more topics"), "{left_out:?}");
    assert_eq!(left_out.evidence["topics"].as_array().unwrap().len(), 44);
    let pool = Pool::new(2).unwrap();
    let log = surveyed(&path, &pool);
    let looks = look(&log, Some("/body299/imu"), &Options::default(), &pool).unwrap();
    assert_eq!((looks.topics.len(), looks.left_out.len()), (256, 44));
    assert!(looks.topics.iter().any(|l| l.topic == "/body299/imu"));
    // Who asks for all of them is told that they are too many, and how many.
    let refused = log.choose(&path, Some("all")).unwrap_err().to_string();
    assert!(refused.contains("300 topics"), "{refused}");
}

/// A log of these channels (topic, schema), and no message.
fn channels(path: &Path, channels: impl Iterator<Item = (String, String)>) {
    let out = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut writer = mcap::WriteOptions::new().create(out).unwrap();
    let mut ids = BTreeMap::new();
    for (topic, text) in channels {
        let id = *ids.entry(text).or_insert_with_key(|text| {
            writer
                .add_schema("a/msg/A", "ros2msg", text.as_bytes())
                .unwrap()
        });
        writer
            .add_channel(id, &topic, "cdr", &BTreeMap::new())
            .unwrap();
    }
    writer.finish().unwrap();
}

/// A schema of 3 kB that spells out to 50,000 fields.
fn spelled_out(n: usize) -> String {
    let fields = |kind: &str| {
        (0..220)
            .map(|k| format!("{kind} f{k}\n"))
            .collect::<String>()
    };
    let line = "=".repeat(80);
    format!(
        "float64[3] gyro\nfloat64 stamp\nfloat64 n{n}\n{}{line}\nMSG: a/B\n{}",
        fields("B"),
        fields("byte")
    )
}

/// Bound by the clock, for what takes seconds; each schema for itself would take hours.
const LAST_RESORT: Duration = Duration::from_secs(600);

#[test]
fn a_schema_of_many_channels_is_compiled_once_and_all_schemas_within_a_bound() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("c.mcap");
    let pool = Pool::new(2).unwrap();
    // One schema: 2000 times 50,000 fields would be minutes.
    channels(
        &path,
        (0..2_000).map(|n| (format!("/t{n}"), spelled_out(0))),
    );
    let start = Instant::now();
    let log = surveyed(&path, &pool);
    assert!(log.channels.iter().all(|k| k.role.has_rate));
    eprintln!("one schema: {:?}", start.elapsed());
    assert!(
        start.elapsed() < LAST_RESORT,
        "timed out: {:?}",
        start.elapsed()
    );
    // As many schemas: what is beyond the bound is refused, and said.
    channels(
        &path,
        (0..2_000).map(|n| (format!("/t{n}"), spelled_out(n))),
    );
    let start = Instant::now();
    let log = surveyed(&path, &pool);
    let understood = log.channels.iter().filter(|k| k.role.has_rate).count();
    eprintln!("{understood} of 2000 schemas: {:?}", start.elapsed());
    assert!(
        start.elapsed() < LAST_RESORT,
        "timed out: {:?}",
        start.elapsed()
    );
    assert!((60..150).contains(&understood), "{understood}");
    let mut decoders = strapd_recording::recording::decoders::Decoders::default();
    let refused = log
        .channels
        .iter()
        .find_map(|k| k.decoder(&mut decoders).err());
    assert!(refused.unwrap().why.contains("the schemas of this log"));
}
