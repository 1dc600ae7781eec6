//! Effects of the flags of the output and of the frames on the numbers.

use crate::made_logs::{ImuSample, PACKINGS, START, TOPIC, bytes, logged, motion, written};
use crate::replays::{Bits, attitudes, done, fixture, mcap, only, replay_of, replay_with, target};
use crate::shared_data::shared;
use std::collections::BTreeMap;
use strapd::error::Error;
use strapd_attitude::estimate::{Bias, EstimationSettings, Initial};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::worlds::World;

/// Largest difference of a component, either sign of the quaternion.
fn apart(a: [f64; 4], b: [f64; 4]) -> f64 {
    let off = |sign: f64| {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - sign * b).abs())
            .fold(0.0, f64::max)
    };
    off(1.0).min(off(-1.0))
}

/// Hamilton product.
fn times([a, b, c, d]: [f64; 4], [w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
}

/// Twice the rounding of a product of unit quaternions, with room for the accumulation over a few
/// hundred steps; a wrong frame is off by order 1.
const ROUNDING: f64 = 1e-13;

#[test]
fn the_initial_attitude_multiplies_from_the_left() {
    let dir = tempfile::tempdir().unwrap();
    let path = written(dir.path(), "log.mcap", &motion(200));
    let (_, plain) = attitudes(&replay_of(&path), dir.path());
    let q0 = [0.5, 0.5, -0.5, 0.5];
    for (text, q0) in [
        ("q=0.5,0.5,-0.5,0.5", q0),
        // Yaw 90 deg about z up.
        ("rpy=0,0,90", [0.5_f64.sqrt(), 0.0, 0.0, 0.5_f64.sqrt()]),
        // Roll 180 about x.
        ("rpy=180,0,0", [0.0, 1.0, 0.0, 0.0]),
        ("identity", [1.0, 0.0, 0.0, 0.0]),
    ] {
        let plan = EstimationSettings {
            initial: strapd::config::parse_initial(text).unwrap(),
            world: World::Enu,
            ..EstimationSettings::default()
        };
        let (_, turned) = attitudes(&replay_with(&path, plan), dir.path());
        assert_eq!(turned.len(), plain.len());
        for (plain, turned) in plain.iter().zip(&turned) {
            let off = apart(times(q0, plain.numbers()), turned.numbers());
            assert!(off <= ROUNDING, "{text}: off by {off:e}");
        }
    }
}

/// Still for three seconds, tilted, then turning.
fn tilted_rest() -> (Vec<ImuSample>, [f64; 4], [f64; 3]) {
    // Roll 30 deg: gravity's reaction has y and z components.
    let (s, c) = 30f64.to_radians().sin_cos();
    let bias = [0.011, -0.007, 0.003];
    let mut samples = motion(600);
    for (k, sample) in samples.iter_mut().enumerate() {
        sample.accel = [0.0, 9.80665 * s, 9.80665 * c];
        if k < 300 {
            // A real sensor is never exactly still; 1e-4 rad/s either way, mean zero.
            let noise = if k % 2 == 0 { 1e-4 } else { -1e-4 };
            sample.gyro = [noise, -noise, noise];
        }
        for (rate, bias) in sample.gyro.iter_mut().zip(bias) {
            *rate += bias;
        }
    }
    let half = 15f64.to_radians();
    (samples, [half.cos(), half.sin(), 0.0, 0.0], bias)
}

#[test]
fn gravity_levels_a_body_at_rest_and_its_bias_is_found() {
    let dir = tempfile::tempdir().unwrap();
    let (samples, tilt, bias) = tilted_rest();
    let path = written(dir.path(), "rest.mcap", &samples);
    let plan = EstimationSettings {
        initial: Initial::Gravity,
        bias: Bias::Auto,
        world: World::Enu,
        ..EstimationSettings::default()
    };
    let (summary, found) = attitudes(&replay_with(&path, plan), dir.path());
    // The acceleration is noiseless: rounding alone.
    let off = apart(found[0].numbers(), tilt);
    assert!(off <= 1e-9, "{:?} against {tilt:?}", found[0].numbers());
    let topic = only(&summary);
    for (found, given) in topic.bias.iter().zip(bias) {
        // Noise of 1e-4 over about three hundred samples: 6e-6; five of them.
        assert!((found - given).abs() <= 3e-5, "{found}, given {given}");
    }
    assert!(
        topic.bias_origin.contains("of rest"),
        "{}",
        topic.bias_origin
    );
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn what_only_rest_can_tell_is_refused_on_a_moving_body_with_the_way_out() {
    let Some(path) = shared("logs/real/broad07_60s_ros2_zstd.mcap") else {
        return;
    };
    for (plan, flag, ways_out) in [
        (
            EstimationSettings {
                bias: Bias::Auto,
                ..EstimationSettings::default()
            },
            "bias auto",
            ["bias x,y,z", "bias none"],
        ),
        (
            EstimationSettings {
                initial: Initial::Gravity,
                ..EstimationSettings::default()
            },
            "init gravity",
            ["init identity", "init rpy="],
        ),
    ] {
        let error = done(&replay_with(&path, plan)).unwrap_err();
        assert!(
            matches!(
                error,
                Error::Recording(strapd_recording::Error::Topic { .. })
            ),
            "{error:?}"
        );
        let said = error.to_string();
        assert!(said.contains("/imu") && said.contains(flag), "{said}");
        assert!(said.contains("never stands still"), "{said}");
        for way in ways_out {
            assert!(said.contains(way), "{way} is missing: {said}");
        }
    }
}

#[test]
fn the_first_orientation_is_where_the_attitude_starts() {
    let path = fixture("xsens_mti.mcap");
    let dir = tempfile::tempdir().unwrap();
    let plan = EstimationSettings {
        initial: Initial::FirstOrientation,
        ..EstimationSettings::default()
    };
    let (summary, found) = attitudes(&replay_with(&path, plan), dir.path());
    // First row of the recording (w, x, y, z), made a unit quaternion: six digits were recorded.
    let recorded = [0.567189, 0.769786, 0.003829, 0.292765];
    assert!(
        apart(found[0].numbers(), recorded) <= 1e-6,
        "{:?}",
        found[0]
    );
    assert_eq!(only(&summary).world, "enu");

    let error = {
        let path = written(dir.path(), "none.mcap", &motion(50));
        let plan = EstimationSettings {
            initial: Initial::FirstOrientation,
            ..EstimationSettings::default()
        };
        done(&replay_with(&path, plan)).unwrap_err().to_string()
    };
    assert!(error.contains("carry no orientation"), "{error}");
    assert!(error.contains("init gravity"), "{error}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn px4_in_ned_is_px4_in_enu_seen_from_the_other_convention() {
    let Some(path) = shared("logs/real/px4_fmuv6c_json_zstd.mcap") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let in_world = |world: World| {
        let plan = EstimationSettings {
            world,
            ..EstimationSettings::default()
        };
        attitudes(&replay_with(&path, plan), dir.path())
    };
    let (ned, in_ned) = in_world(World::Ned);
    let (enu, in_enu) = in_world(World::Enu);
    assert_eq!((&*only(&ned).world, &*only(&ned).body), ("ned", "frd"));
    assert_eq!((&*only(&enu).world, &*only(&enu).body), ("enu", "flu"));
    // q_ned_frd = q(ned from enu) q_enu_flu q(flu from frd): half turns about (1,1,0)/sqrt 2 and x.
    let h = 0.5_f64.sqrt();
    let (ned_from_enu, flu_from_frd) = ([0.0, h, h, 0.0], [0.0, 1.0, 0.0, 0.0]);
    // Identity means: body axes are the world's. It is the same body, so the first attitudes
    // differ by what differs between the worlds' identities: remove it.
    let conjugate = |[w, x, y, z]: [f64; 4]| [w, -x, -y, -z];
    let turned_since_start = |all: &[Bits]| -> Vec<[f64; 4]> {
        let first = conjugate(all[0].numbers());
        all.iter().map(|a| times(first, a.numbers())).collect()
    };
    let body_ned = turned_since_start(&in_ned);
    let body_enu = turned_since_start(&in_enu);
    assert_eq!(body_ned.len(), 1297);
    for (ned, enu) in body_ned.iter().zip(&body_enu) {
        let seen = times(times(conjugate(flu_from_frd), *enu), flu_from_frd);
        assert!(apart(*ned, seen) <= 1e-12, "{ned:?} {seen:?}");
    }
    // And with an attitude given in each world's own convention, the whole of it.
    let given = |world: World, q: [f64; 4]| {
        let plan = EstimationSettings {
            world,
            initial: Initial::Given(Quaternion::assume_unit(q)),
            ..EstimationSettings::default()
        };
        attitudes(&replay_with(&path, plan), dir.path()).1
    };
    let q_enu = [0.5, -0.5, 0.5, 0.5];
    let q_ned = times(times(ned_from_enu, q_enu), flu_from_frd);
    for (ned, enu) in given(World::Ned, q_ned)
        .iter()
        .zip(given(World::Enu, q_enu))
    {
        let seen = times(times(ned_from_enu, enu.numbers()), flu_from_frd);
        assert!(apart(ned.numbers(), seen) <= 1e-12);
    }
}

#[test]
fn a_lower_output_rate_is_a_selection_and_not_another_integration() {
    let dir = tempfile::tempdir().unwrap();
    let path = written(dir.path(), "log.mcap", &motion(500));
    let (_, all) = attitudes(&replay_of(&path), dir.path());
    let mut replay = replay_of(&path);
    replay.out_rate = Some(10.0);
    let (summary, few) = attitudes(&replay, dir.path());
    // 4.99 s at 10 Hz: one at the start and one per 0.1 s after it.
    assert_eq!(few.len(), 50);
    assert_eq!(only(&summary).counts.used(), 500);
    for (k, kept) in few.iter().enumerate() {
        assert!(all.contains(kept), "{kept:?}");
        assert_eq!(kept.stamp, START + k as i64 * 100_000_000);
    }
}

#[test]
fn every_imu_of_a_log_gets_an_output_topic_of_its_own_and_they_are_not_mixed() {
    let dir = tempfile::tempdir().unwrap();
    let one = motion(200);
    let two: Vec<ImuSample> = one
        .iter()
        .map(|s| ImuSample {
            gyro: [-s.gyro[2], s.gyro[0] * 0.5, s.gyro[1]],
            ..*s
        })
        .collect();
    let mut both = logged("/left/data_raw", &one);
    both.extend(logged("/right", &two));
    both.sort_by_key(|m| m.log_time);
    let path = dir.path().join("both.mcap");
    std::fs::write(&path, bytes(PACKINGS[2].1, 4096, &both)).unwrap();

    let mut replay = replay_of(&path);
    replay.selection.topic = Some("all".to_owned());
    let out = dir.path().join("out.mcap");
    replay.targets = vec![target(&out)];
    let summary = done(&replay).unwrap();
    assert_eq!(summary.topics.len(), 2);
    let out = std::fs::read(&out).unwrap();
    for (topic, samples) in [("/left/data", &one), ("/right/attitude", &two)] {
        let alone = written(dir.path(), "alone.mcap", samples);
        let (_, expected) = attitudes(&replay_of(&alone), dir.path());
        assert_eq!(mcap(&out, topic), expected, "{topic}");
    }

    let csv = dir.path().join("out.csv");
    replay.targets = vec![target(&csv)];
    let error = done(&replay).unwrap_err();
    assert!(matches!(error, Error::Usage(_)), "{error:?}");
    assert!(
        error.to_string().contains("choose one with topic"),
        "{error}"
    );
    assert!(!csv.exists());
}

/// Log time, publish time, sequence, payload.
type Message = (u64, u64, u32, Vec<u8>);

/// Topic -> its messages.
fn messages(bytes: &[u8]) -> BTreeMap<String, Vec<Message>> {
    let mut all: BTreeMap<String, Vec<_>> = BTreeMap::new();
    for message in mcap::MessageStream::new(bytes).unwrap() {
        let m = message.unwrap();
        all.entry(m.channel.topic.clone()).or_default().push((
            m.log_time,
            m.publish_time,
            m.sequence,
            m.data.into_owned(),
        ));
    }
    all
}

#[test]
fn a_copied_input_is_whole_in_the_output_channels_schemas_and_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let made = written(dir.path(), "made.mcap", &motion(100));
    for path in [
        made,
        fixture("xsens_mti.mcap"),
        fixture("constant_rate_ros1.mcap"),
        fixture("constant_rate_json.mcap"),
    ] {
        let name = path.file_name().unwrap().to_str().unwrap();
        let out = dir.path().join(format!("copy_of_{name}"));
        let mut replay = replay_of(&path);
        replay.copy_input = true;
        replay.targets = vec![target(&out)];
        let summary = done(&replay).unwrap();
        let output_topic = only(&summary).output_topic.clone();
        let (before, after) = (std::fs::read(&path).unwrap(), std::fs::read(&out).unwrap());
        let (read, copied) = (messages(&before), messages(&after));
        for (topic, expected) in &read {
            assert_eq!(copied.get(topic), Some(expected), "{name} {topic}");
        }
        assert!(!read.contains_key(&output_topic), "{output_topic}");
        assert_eq!(copied[&output_topic].len() as u64, only(&summary).written);
        let channels = |bytes: &[u8]| -> BTreeMap<String, (String, String, Vec<u8>)> {
            mcap::MessageStream::new(bytes)
                .unwrap()
                .map(|m| m.unwrap().channel)
                .map(|c| {
                    let schema = c.schema.as_ref();
                    let name = schema.map(|s| s.name.clone()).unwrap_or_default();
                    let data = schema.map(|s| s.data.to_vec()).unwrap_or_default();
                    (c.topic.clone(), (c.message_encoding.clone(), name, data))
                })
                .collect()
        };
        let after = channels(&after);
        for (topic, expected) in channels(&before) {
            assert_eq!(after.get(&topic), Some(&expected), "{name} {topic}");
        }
    }
}

#[test]
fn a_topic_that_is_not_there_lists_those_that_are() {
    let mut replay = replay_of(&fixture("xsens_mti.mcap"));
    replay.selection.topic = Some("/imu".to_owned());
    let error = done(&replay).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Recording(strapd_recording::Error::NoSuchTopic { .. })
        ),
        "{error:?}"
    );
    let said = error.to_string();
    assert!(
        said.contains("`/imu`") && said.contains("/imu/data "),
        "{said}"
    );
}

#[test]
fn a_field_that_is_not_there_lists_those_that_would_do() {
    let mut replay = replay_of(&fixture("xsens_mti.mcap"));
    replay.selection.decode.fields = vec!["gyro=imu.rate".parse().unwrap()];
    let error = done(&replay).unwrap_err();
    let said = error.to_string();
    for word in ["/imu/data", "`imu.rate`", "angular_velocity", "field gyro="] {
        assert!(said.contains(word), "{word} is missing: {said}");
    }
}

#[test]
fn a_log_without_an_imu_lists_what_it_holds() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("mag.mcap");
    let options = mcap::WriteOptions::new();
    let mut writer = options
        .create(std::fs::File::create(&path).unwrap())
        .unwrap();
    let channel = writer
        .add_channel(0, "/temperature", "json", &Default::default())
        .unwrap();
    for log_time in 0..3 {
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time,
            publish_time: log_time,
        };
        writer
            .write_to_known_channel(&header, b"{\"degrees\": 20}")
            .unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    let error = done(&replay_of(&path)).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Recording(strapd_recording::Error::NoImuTopic { .. })
        ),
        "{error:?}"
    );
    let said = error.to_string();
    for word in ["/temperature", "json", "3 messages", "field gyro="] {
        assert!(said.contains(word), "{word} is missing: {said}");
    }
}

#[test]
fn an_imu_topic_without_a_message_leaves_nothing_and_that_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("silent.mcap");
    let mut writer = mcap::WriteOptions::new()
        .create(std::fs::File::create(&path).unwrap())
        .unwrap();
    let schema = writer
        .add_schema("sensor_msgs/msg/Imu", "ros2msg", b"")
        .unwrap();
    writer
        .add_channel(schema, TOPIC, "cdr", &Default::default())
        .unwrap();
    writer.finish().unwrap();
    drop(writer);
    let result = done(&replay_of(&path));
    match result {
        Ok(summary) => {
            let said = only(&summary).warnings().join("; ");
            assert!(said.contains("no sample was used"), "{said}");
        }
        Err(error) => {
            let said = error.to_string();
            assert!(
                said.contains(TOPIC) && said.contains("0 messages"),
                "{said}"
            );
        }
    }
}
