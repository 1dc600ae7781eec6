//! Times in a message: which of several is believed, and what becomes of one that cannot be.
//!
//! The messages are those of drivers and loggers seen in the wild: a header around a whole Imu message,
//! stamps cut to seconds, intervals in another unit than the name says.

use crate::made_logs::{ImuSample, START, STEP, TOPIC, motion};
use crate::replays::{Bits, attitudes, done, only, replay_by, replay_of, replay_with, target};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use strapd::pipeline::check::check;
use strapd::pipeline::opening;
use strapd::report::findings::findings;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::record::{SampleKind, Verdict};
use strapd_recording::decode::{Channel, Rank, role};
use strapd_recording::pool::Pool;

const SECOND: i64 = 1_000_000_000;

/// A type, its schema, and the encoding of its messages.
type Type = (&'static str, &'static str, String, &'static str);

/// A log of one topic: log time and payload of each message.
fn log(dir: &Path, name: &str, of: &Type, messages: &[(i64, Vec<u8>)]) -> PathBuf {
    let mut writer = mcap::WriteOptions::new()
        .compression(None)
        .create(Cursor::new(Vec::new()))
        .unwrap();
    let (type_name, language, text, encoding) = of;
    let schema = writer
        .add_schema(type_name, language, text.as_bytes())
        .unwrap();
    let channel_id = writer
        .add_channel(schema, TOPIC, encoding, &Default::default())
        .unwrap();
    for (sequence, (log_time, payload)) in messages.iter().enumerate() {
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: sequence as u32,
            log_time: *log_time as u64,
            publish_time: *log_time as u64,
        };
        writer.write_to_known_channel(&header, payload).unwrap();
    }
    writer.finish().unwrap();
    let path = dir.join(name);
    std::fs::write(&path, writer.into_inner().into_inner()).unwrap();
    path
}

/// A message by the CDR rules: every number on a multiple of its size.
#[derive(Default)]
struct Cdr(Vec<u8>);

impl Cdr {
    fn put(&mut self, bytes: &[u8]) -> &mut Cdr {
        while !self.0.len().is_multiple_of(bytes.len()) {
            self.0.push(0);
        }
        self.0.extend(bytes);
        self
    }

    fn header(&mut self, stamp: i64, frame: &str) -> &mut Cdr {
        self.put(&(stamp.div_euclid(SECOND) as i32).to_le_bytes())
            .put(&(stamp.rem_euclid(SECOND) as u32).to_le_bytes())
            .put(&(frame.len() as u32 + 1).to_le_bytes());
        self.0.extend(frame.as_bytes());
        self.0.push(0);
        self
    }

    fn done(&self) -> Vec<u8> {
        [&[0, 1, 0, 0][..], &self.0].concat()
    }
}

const HEADER: &str = "std_msgs/Header header\n";
const REST: &str = "\
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
";

/// A message of a driver's own around a message with a header of its own.
fn nested() -> Type {
    let text = format!(
        "{HEADER}driver_msgs/Reading imu\n{}\nMSG: driver_msgs/Reading\n{HEADER}geometry_msgs/Vector3 angular_velocity\n{REST}",
        "=".repeat(80)
    );
    ("driver_msgs/msg/Packet", "ros2msg", text, "cdr")
}

fn nested_log(dir: &Path, name: &str, outer: fn(i64) -> i64, inner: fn(i64) -> i64) -> PathBuf {
    let messages: Vec<(i64, Vec<u8>)> = motion(600)
        .iter()
        .map(|s| {
            let mut cdr = Cdr::default();
            cdr.header(outer(s.stamp), "base")
                .header(inner(s.stamp), "imu");
            for v in s.gyro {
                cdr.put(&v.to_le_bytes());
            }
            (s.stamp, cdr.done())
        })
        .collect();
    log(dir, name, &nested(), &messages)
}

fn nested_json(dir: &Path, name: &str, outer: fn(i64) -> i64, inner: fn(i64) -> i64) -> PathBuf {
    let time =
        |t: i64| serde_json::json!({"sec": t.div_euclid(SECOND), "nanosec": t.rem_euclid(SECOND)});
    let messages: Vec<(i64, Vec<u8>)> = motion(600)
        .iter()
        .map(|s| {
            let [x, y, z] = s.gyro;
            let message = serde_json::json!({
                "header": {"stamp": time(outer(s.stamp)), "frame_id": "base"},
                "imu": {
                    "header": {"stamp": time(inner(s.stamp)), "frame_id": "imu"},
                    "angular_velocity": {"x": x, "y": y, "z": z},
                },
            });
            (s.stamp, message.to_string().into_bytes())
        })
        .collect();
    let of = (
        "driver_msgs/msg/Packet",
        "jsonschema",
        "{}".to_owned(),
        "json",
    );
    log(dir, name, &of, &messages)
}

fn good(t: i64) -> i64 {
    t
}
fn late(t: i64) -> i64 {
    t + 40_000_000
}
fn zero(_: i64) -> i64 {
    0
}
fn whole(t: i64) -> i64 {
    t - t.rem_euclid(SECOND)
}
/// Ten messages to a stamp.
fn shared(t: i64) -> i64 {
    t - t.rem_euclid(10 * STEP)
}

#[test]
fn the_messages_own_stamp_is_taken_unless_it_is_none_and_a_nested_one_is() {
    let dir = tempfile::tempdir().unwrap();
    let stamps = |path: &Path| -> (Vec<i64>, String) {
        let (summary, found) = attitudes(&replay_of(path), dir.path());
        let said = only(&summary).warnings().join("; ");
        (found.iter().map(|a| a.stamp).collect(), said)
    };
    let at = |offset: i64| -> Vec<i64> { (0..600).map(|k| START + k * STEP + offset).collect() };
    type Stamp = fn(i64) -> i64;
    let cases: [(&str, Stamp, Stamp, i64); 6] = [
        ("both good", late, good, 40_000_000),
        ("the inner in whole seconds", late, whole, 40_000_000),
        ("the inner zero", late, zero, 40_000_000),
        ("the outer zero", zero, late, 40_000_000),
        ("the outer in whole seconds", whole, late, 40_000_000),
        ("the outer shared", shared, late, 40_000_000),
    ];
    for (what, outer, inner, offset) in cases {
        for path in [
            nested_log(dir.path(), "nested.mcap", outer, inner),
            nested_json(dir.path(), "nested_json.mcap", outer, inner),
        ] {
            let (found, said) = stamps(&path);
            assert_eq!(found, at(offset), "{what}");
            assert!(said.contains("field stamp="), "{what}: {said}");
        }
    }
    // Named, it is taken whatever it is.
    let path = nested_log(dir.path(), "nested.mcap", late, good);
    let (_, found) = attitudes(&replay_by(&path, "stamp=imu.header.stamp"), dir.path());
    let found: Vec<i64> = found.iter().map(|a| a.stamp).collect();
    assert_eq!(found, at(0));
}

fn imu_log(dir: &Path, name: &str, samples: &[ImuSample], stamp: fn(i64) -> i64) -> PathBuf {
    let messages: Vec<(i64, Vec<u8>)> = samples
        .iter()
        .map(|s| {
            let stamped = ImuSample {
                stamp: stamp(s.stamp),
                ..*s
            };
            (s.stamp, crate::made_logs::imu_message("imu_link", &stamped))
        })
        .collect();
    let text = crate::made_logs::imu_definition();
    log(
        dir,
        name,
        &("sensor_msgs/msg/Imu", "ros2msg", text, "cdr"),
        &messages,
    )
}

#[test]
fn stamps_in_whole_seconds_give_every_sample_within_the_logs_span_wherever_it_begins() {
    let dir = tempfile::tempdir().unwrap();
    let all = motion(1500);
    for from in [0, 4, 50, 97, 99] {
        let samples = &all[from..from + 1234];
        let fine = imu_log(dir.path(), "fine.mcap", samples, good);
        let coarse = imu_log(dir.path(), "coarse.mcap", samples, whole);
        for kind in [
            SampleKind::Rate,
            SampleKind::Average,
            SampleKind::DeltaAngle,
        ] {
            let plan = EstimationSettings {
                kind: Some(kind),
                ..EstimationSettings::default()
            };
            let (_, expected) = attitudes(&replay_with(&fine, plan.clone()), dir.path());
            let (summary, found) = attitudes(&replay_with(&coarse, plan), dir.path());
            let topic = only(&summary);
            assert!(!summary.is_lossy(), "{kind:?} from {from}: {topic:?}");
            assert!(topic.counts.get(Verdict::Restamped) > 1200, "{topic:?}");
            assert_eq!(found, expected, "{kind:?} from {from}");
            let said = topic.warnings().join("; ");
            assert!(
                said.contains("steps of 1") && said.contains("time log"),
                "{said}"
            );
        }
    }
}

#[test]
fn an_orientation_in_samples_with_whole_seconds_is_compared_at_the_stamps_they_got() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = motion(1500);
    let rates = || EstimationSettings {
        kind: Some(SampleKind::Rate),
        ..EstimationSettings::default()
    };
    let (_, truth) = attitudes(
        &replay_with(&imu_log(dir.path(), "a.mcap", &samples, good), rates()),
        dir.path(),
    );
    for (sample, truth) in samples.iter_mut().zip(&truth) {
        sample.orientation = Some(truth.numbers());
    }
    let mut replay = replay_with(&imu_log(dir.path(), "b.mcap", &samples, whole), rates());
    replay.against = Some(String::new());
    let summary = done(&replay).unwrap();
    let rate = only(&summary)
        .against
        .iter()
        .find(|row| row.kind == "rate")
        .unwrap();
    // The orientation is the replay's own; at its recorded stamps it would be off by up to a second of turning.
    assert!(rate.median_deg < 1e-6 && rate.pairs > 1000, "{rate:?}");
}

/// PX4's `sensor_combined` as its ROS 2 bridge writes it, the interval in `unit` nanoseconds.
fn px4_log(dir: &Path, name: &str, unit: i64) -> PathBuf {
    let interval = ((STEP / unit) as u32).to_le_bytes();
    px4_log_with(dir, name, "uint32", &interval)
}

/// The same with an interval of this type, and these bytes.
fn px4_log_with(dir: &Path, name: &str, number: &str, interval: &[u8]) -> PathBuf {
    let text = format!("uint64 timestamp\nfloat32[3] gyro_rad\n{number} gyro_integral_dt\n");
    let messages: Vec<(i64, Vec<u8>)> = motion(600)
        .iter()
        .map(|s| {
            let mut cdr = Cdr::default();
            cdr.put(&((s.stamp / 1000) as u64).to_le_bytes());
            for v in s.gyro {
                cdr.put(&(v as f32).to_le_bytes());
            }
            cdr.put(interval);
            (s.stamp, cdr.done())
        })
        .collect();
    log(
        dir,
        name,
        &("px4_msgs/msg/SensorCombined", "ros2msg", text, "cdr"),
        &messages,
    )
}

#[test]
fn an_interval_in_another_unit_than_thought_is_refused_with_the_flag_that_states_the_unit() {
    let dir = tempfile::tempdir().unwrap();
    let right = px4_log(dir.path(), "us.mcap", 1_000);
    let (summary, expected) = attitudes(&replay_of(&right), dir.path());
    assert_eq!(only(&summary).kind, SampleKind::Average);
    assert_eq!(only(&summary).gaps.bridged, 0);

    let wrong = px4_log(dir.path(), "ms.mcap", 1_000_000);
    let error = done(&replay_of(&wrong)).unwrap_err().to_string();
    for word in [
        "1.00e-5 s",
        "0.0100 s",
        "field dt=gyro_integral_dt:ms",
        "sample_kind rate",
    ] {
        assert!(error.contains(word), "{word} is missing: {error}");
    }
    let (_, found) = attitudes(&replay_by(&wrong, "dt=gyro_integral_dt:ms"), dir.path());
    let bits = |a: &[Bits]| a.iter().map(|a| a.wxyz).collect::<Vec<_>>();
    assert_eq!(bits(&found), bits(&expected));
}

#[test]
fn an_interval_that_is_a_floating_point_number_is_in_seconds() {
    let dir = tempfile::tempdir().unwrap();
    let whole = px4_log(dir.path(), "us.mcap", 1_000);
    let (_, expected) = attitudes(&replay_of(&whole), dir.path());
    let secs = STEP as f64 * 1e-9;
    for (name, number, interval) in [
        ("f32.mcap", "float32", (secs as f32).to_le_bytes().to_vec()),
        ("f64.mcap", "float64", secs.to_le_bytes().to_vec()),
    ] {
        let log = px4_log_with(dir.path(), name, number, &interval);
        let (summary, found) = attitudes(&replay_of(&log), dir.path());
        assert_eq!(only(&summary).kind, SampleKind::Average, "{name}");
        assert_eq!(only(&summary).gaps.bridged, 0, "{name}");
        assert_eq!(found, expected, "{name}");
    }
}

#[test]
fn what_is_bridged_is_excluded_from_the_integration_error_in_words() {
    let dir = tempfile::tempdir().unwrap();
    let wrong = px4_log(dir.path(), "ms.mcap", 1_000_000);
    // Said outright, it is believed: points, and bridges between them.
    let summary = done(&replay_by(&wrong, "dt=gyro_integral_dt:us")).unwrap();
    let topic = only(&summary);
    assert_eq!(topic.gaps.bridged, 599);
    let said = topic.warnings().join("; ");
    assert!(said.contains("a sample lasts 1.00e-5 s"), "{said}");
    let text = summary.text();
    assert!(
        text.contains("not in it: 599 gaps of 5.984 s that were bridged"),
        "{text}"
    );
}

#[test]
fn gaps_that_were_bridged_are_not_counted_among_those_that_were_not() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = motion(2000);
    // Twelve gaps of 0.1 s, which are bridged, and one of 1.5 s, which is not.
    samples.retain(|s| {
        let k = (s.stamp - START) / STEP;
        let is_burst = k % 100 > 90 && k < 1200;
        !is_burst && !(1500..1650).contains(&k)
    });
    let path = imu_log(dir.path(), "gaps.mcap", &samples, good);
    let summary = done(&replay_of(&path)).unwrap();
    let gaps = only(&summary).gaps;
    assert_eq!((gaps.bridged, gaps.held), (12, 1));
    // 151 steps of 10 ms; the sample behind them is the mean of the last one.
    assert!((gaps.held_secs - 1.5).abs() < 1e-9, "{gaps:?}");
    assert!((gaps.longest_held_secs - 1.5).abs() < 1e-9, "{gaps:?}");
}

#[test]
fn no_gap_is_advised_to_be_bridged_that_is_a_clock_being_set() {
    let dir = tempfile::tempdir().unwrap();
    let pool = Pool::new(2).unwrap();
    let flags = |name: &str, stamp: fn(i64) -> i64| {
        let path = imu_log(dir.path(), name, &motion(600), stamp);
        let checked = check(
            &opening::open(&path).unwrap(),
            None,
            &Default::default(),
            &pool,
        )
        .unwrap();
        let found = findings(&checked);
        assert!(found.iter().any(|f| f.code == "clock-set"), "{found:?}");
        found.iter().map(crate::check::flags).collect::<String>()
    };
    // A receiver finds the time of day after 3 s; a clock is set back by 2 s.
    let found = flags("set.mcap", |t| {
        if t - START < 3 * SECOND {
            t - START + SECOND
        } else {
            t
        }
    });
    assert!(!found.contains("--max-gap"), "{found}");
    let back = flags("back.mcap", |t| {
        if t - START < 3 * SECOND {
            t
        } else {
            t - 2 * SECOND
        }
    });
    assert!(!back.contains("--max-gap"), "{back}");
}

#[test]
fn the_filters_rates_of_an_older_px4_log_are_no_second_imu() {
    let of = |name: &str, text: &str| {
        let channel = Channel {
            topic: "/vehicle_attitude",
            message_encoding: "cdr",
            schema_name: name,
            schema_encoding: "ros2msg",
            schema_data: text.as_bytes(),
        };
        role(&channel, None)
    };
    let attitude = of(
        "px4_msgs/msg/VehicleAttitude",
        "uint64 timestamp\nfloat32 rollspeed\nfloat32 pitchspeed\nfloat32 yawspeed\nfloat32[4] q\n",
    );
    assert!(attitude.has_orientation);
    assert!(
        !attitude.has_rate || attitude.rank > Rank::Processed,
        "{attitude:?}"
    );
    let combined = of(
        "px4_msgs/msg/SensorCombined",
        "uint64 timestamp\nfloat32[3] gyro_rad\nuint32 gyro_integral_dt\n",
    );
    assert_eq!(combined.rank, Rank::Imu);
}

#[test]
fn a_nameless_sensor_has_one_name_in_its_attitude_and_its_transform() {
    let dir = tempfile::tempdir().unwrap();
    for world in [
        strapd_attitude::worlds::World::Ned,
        strapd_attitude::worlds::World::Enu,
    ] {
        let path = px4_log(dir.path(), "us.mcap", 1_000);
        let out = dir.path().join("out.mcap");
        let mut replay = replay_with(
            &path,
            EstimationSettings {
                world,
                ..EstimationSettings::default()
            },
        );
        replay.targets = vec![target(&out)];
        replay.options.force = true;
        done(&replay).unwrap();
        let bytes = std::fs::read(&out).unwrap();
        let names = |of: &str| -> Vec<String> {
            let message = mcap::MessageStream::new(&bytes)
                .unwrap()
                .map(|m| m.unwrap())
                .find(|m| m.channel.topic.ends_with(of))
                .unwrap();
            let text = |from: usize| {
                let len = u32::from_le_bytes(message.data[from..from + 4].try_into().unwrap());
                let end = from + 4 + len as usize;
                let name = String::from_utf8_lossy(&message.data[from + 4..end - 1]).into_owned();
                (name, end.next_multiple_of(4))
            };
            // The transform's list begins with its count; then header and child.
            let (first, end) = text(if of == "/tf" { 16 } else { 12 });
            if of == "/tf" {
                vec![text(end).0]
            } else {
                vec![first]
            }
        };
        assert_ne!(names("/tf"), [""]);
        assert_eq!(names("/tf"), names("/imu/data"), "{world}");
    }
}
