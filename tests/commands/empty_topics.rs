//! Promise: a topic without a message is listed, and never the one that is meant, in every container.

use crate::made_databases::database;
use crate::made_logs::{TOPIC, imu_definition, imu_message, motion};
use crate::program::strapd;
use crate::replays::fixture;
use std::io::Cursor;

const EMPTY: &str = "/imu/empty";

/// An MCAP whose channels are defined in this order, with `n` messages on [`TOPIC`].
fn mcap_of(topics: &[&str], n: usize) -> Vec<u8> {
    let mut writer = mcap::WriteOptions::new()
        .compression(None)
        .create(Cursor::new(Vec::new()))
        .unwrap();
    let schema = writer
        .add_schema(
            "sensor_msgs/msg/Imu",
            "ros2msg",
            imu_definition().as_bytes(),
        )
        .unwrap();
    let channels: Vec<u16> = topics
        .iter()
        .map(|topic| {
            writer
                .add_channel(schema, topic, "cdr", &Default::default())
                .unwrap()
        })
        .collect();
    let of = topics.iter().position(|topic| *topic == TOPIC);
    for (sequence, sample) in motion(n).iter().enumerate() {
        let header = mcap::records::MessageHeader {
            channel_id: channels[of.unwrap()],
            sequence: sequence as u32,
            log_time: sample.stamp as u64,
            publish_time: sample.stamp as u64,
        };
        let payload = imu_message("imu_link", sample);
        writer.write_to_known_channel(&header, &payload).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// The fixture with a second connection in its index, of which there is no message.
fn bag() -> (Vec<u8>, String) {
    let mut bytes = std::fs::read(fixture("constant_rate_none.bag")).unwrap();
    let find =
        |bytes: &[u8], what: &[u8]| bytes.windows(what.len()).position(|w| w == what).unwrap();
    let at = find(&bytes, b"index_pos=") + 10;
    let index = u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
    let count = find(&bytes, b"conn_count=") + 11;
    bytes[count] += 1;
    let length_in = |bytes: &[u8], at: usize| {
        u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
    };
    let length = |at: usize| length_in(&bytes, at);
    let data = index + 4 + length(index);
    let mut record = bytes[index..data + 4 + length(data)].to_vec();
    let conn = find(&record, b"conn=") + 5;
    record[conn] += 1;
    let topic = find(&record, b"topic=") + 6;
    let end = topic - 6 + length_in(&record, topic - 10);
    let name = String::from_utf8(record[topic..end].to_vec()).unwrap();
    let empty = name.replace(|c: char| c.is_ascii_alphabetic(), "e");
    for at in 0..record.len() - name.len() {
        if record[at..].starts_with(name.as_bytes()) {
            record[at..at + name.len()].copy_from_slice(empty.as_bytes());
        }
    }
    bytes.splice(index..index, record);
    (bytes, empty)
}

/// A flight whose first gyro was subscribed to, and never published.
fn ulog() -> Vec<u8> {
    let record = |kind: u8, body: &[u8]| {
        let length = (body.len() as u16).to_le_bytes();
        [&length[..], &[kind], body].concat()
    };
    let format = b"sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;";
    let mut log = b"ULog\x01\x12\x35\x01".to_vec();
    log.extend(5_000_u64.to_le_bytes());
    log.extend(record(b'B', &[0; 40]));
    log.extend(record(b'F', format));
    log.extend(record(b'A', b"\0\x07\0sensor_combined"));
    log.extend(record(b'A', b"\x01\x08\0sensor_combined"));
    for (n, sample) in motion(200).iter().enumerate() {
        let mut body = 8_u16.to_le_bytes().to_vec();
        body.extend((10_000 + 10_000 * n as u64).to_le_bytes());
        for rate in sample.gyro {
            body.extend((rate as f32).to_le_bytes());
        }
        body.extend(10_000_u32.to_le_bytes());
        log.extend(record(b'D', &body));
    }
    log
}

#[test]
fn an_empty_topic_is_listed_and_never_chosen() {
    let samples = motion(200);
    let payloads: Vec<Vec<u8>> = samples.iter().map(|s| imu_message("imu_link", s)).collect();
    let messages: Vec<(usize, u64, &[u8])> = samples
        .iter()
        .zip(&payloads)
        .map(|(sample, payload)| (1, sample.stamp as u64, payload.as_slice()))
        .collect();
    let topics = [
        (EMPTY, "sensor_msgs/msg/Imu"),
        (TOPIC, "sensor_msgs/msg/Imu"),
    ];
    let (bag, of_bag) = bag();
    let logs = [
        ("a.mcap", mcap_of(&[EMPTY, TOPIC], 200), EMPTY),
        ("b.mcap", mcap_of(&[TOPIC, EMPTY], 200), EMPTY),
        ("a.db3", database(4096, &topics, &messages), EMPTY),
        ("a.bag", bag, of_bag.as_str()),
        ("a.ulg", ulog(), "sensor_combined"),
    ];
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (file, bytes, empty) in logs {
        std::fs::write(at.join(file), bytes).unwrap();
        let info = strapd(at, &format!("info {file}"));
        info.done();
        assert!(
            info.out.contains(empty) && info.out.contains("0 messages"),
            "{file}: {info:?}"
        );
        let info = strapd(at, &format!("info {file} --json")).json();
        let info = info.get(0).unwrap_or(&info);
        assert_eq!(info["imu"].as_array().unwrap().len(), 1, "{file}: {info:#}");
        assert_ne!(info["imu"][0]["topic"], empty, "{file}");
        let next = info["next"].as_str().unwrap();
        assert!(!next.contains("--topic"), "{file}: {next}");
        strapd(at, &format!("replay {file} -o out.csv --force")).done();
        strapd(at, &format!("cat {file}")).done();
        // Each of them, and nothing of the empty one.
        let all = strapd(
            at,
            &format!("replay {file} --topic all -o all.mcap --force --json"),
        )
        .json();
        let run = all.get(0).unwrap_or(&all);
        assert_eq!(
            run["topics"].as_array().unwrap().len(),
            1,
            "{file}: {run:#}"
        );
        let check = strapd(at, &format!("check {file}"));
        assert!(
            !check.out.contains("no sample was used"),
            "{file}: {check:?}"
        );
    }
}

#[test]
fn a_log_of_nothing_but_empty_topics_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    std::fs::write(at.join("a.mcap"), mcap_of(&[EMPTY, TOPIC], 0)).unwrap();
    strapd(at, "replay a.mcap -o out.csv").refused(1, &["no IMU topic", EMPTY, "has no message"]);
}

/// A summary that counts nothing beside messages is not believed.
#[test]
fn messages_that_the_statistics_deny_are_found() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let mut bytes = mcap_of(&[TOPIC], 200);
    // The statistics: counts of messages, and by channel.
    let statistics = bytes.iter().rposition(|b| *b == 0x0b).map(|end| {
        (0..=end)
            .rev()
            .find(|at| {
                let length = bytes
                    .get(at + 1..at + 9)
                    .map(|l| u64::from_le_bytes(l.try_into().unwrap()));
                bytes[*at] == 0x0b && length == Some(46 + 10)
            })
            .unwrap()
    });
    let body = statistics.unwrap() + 9;
    assert_eq!(bytes[body..body + 8], 200_u64.to_le_bytes());
    bytes[body..body + 8].fill(0);
    bytes[body + 46 + 2..body + 46 + 10].fill(0);
    std::fs::write(at.join("a.mcap"), bytes).unwrap();
    let replay = strapd(at, "replay a.mcap -o out.csv");
    let rows = std::fs::read_to_string(at.join("out.csv")).unwrap_or_default();
    assert_eq!(rows.lines().count(), 201, "{replay:?}");
}
