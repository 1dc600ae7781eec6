//! Forces on a topic of their own are named, with the settings that take them; another vector is no force.

use crate::made_logs::START;
use crate::program::strapd;
use std::io::Cursor;
use std::path::Path;

const RATES: &str = "/imu/angular_velocity";

/// A `geometry_msgs/msg/Vector3Stamped`, by the CDR rules.
fn vector(stamp: i64, [x, y, z]: [f64; 3]) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(((stamp / 1_000_000_000) as i32).to_le_bytes());
    bytes.extend(((stamp % 1_000_000_000) as u32).to_le_bytes());
    // An empty frame, its length with the terminator; doubles lie at multiples of eight after the first four.
    bytes.extend([1, 0, 0, 0, 0, 0, 0, 0]);
    for value in [x, y, z] {
        bytes.extend(value.to_le_bytes());
    }
    bytes
}

/// Five seconds at 100 Hz of rates, and of vectors of length `length` on `topic`.
fn written(dir: &Path, topic: &str, length: f64) {
    let mut writer = mcap::WriteOptions::new()
        .profile("ros2")
        .create(Cursor::new(Vec::new()))
        .unwrap();
    let definition = "std_msgs/Header header\ngeometry_msgs/Vector3 vector\n================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n================\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
    let schema = writer
        .add_schema(
            "geometry_msgs/msg/Vector3Stamped",
            "ros2msg",
            definition.as_bytes(),
        )
        .unwrap();
    for n in 0..500_i64 {
        let stamp = START + n * 10_000_000;
        let t = n as f64 * 0.01;
        let turning = [0.3 * (1.7 * t).sin(), 0.2 * (0.9 * t).cos(), 0.1 * t.sin()];
        for (topic, value) in [(RATES, turning), (topic, [0.0, 0.0, length])] {
            let channel_id = writer
                .add_channel(schema, topic, "cdr", &Default::default())
                .unwrap();
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence: n as u32,
                log_time: stamp as u64,
                publish_time: stamp as u64,
            };
            writer
                .write_to_known_channel(&header, &vector(stamp, value))
                .unwrap();
        }
    }
    writer.finish().unwrap();
    std::fs::write(dir.join("log.mcap"), writer.into_inner().into_inner()).unwrap();
}

#[test]
fn accelerations_on_a_topic_of_their_own_are_named_and_the_advice_takes_them() {
    let dir = tempfile::tempdir().unwrap();
    for (topic, length, is_named) in [
        ("/imu/acceleration", 9.81, true),
        ("/imu/accel", 9.7, true),
        ("/imu/linear_acceleration", 9.81, true),
        // Without gravity, of something else, or of nothing that is said.
        ("/imu/free_acceleration", 0.02, false),
        ("/imu/angular_acceleration", 9.81, false),
        ("/imu/velocity_increment", 9.81, false),
    ] {
        written(dir.path(), topic, length);
        let said = |args: &str| {
            let ran = strapd(dir.path(), args);
            ran.done();
            format!("{}{}", ran.out, ran.err)
        };
        let advice = format!("--aid gravity --accel-topic {topic}");
        let checked = said("check log.mcap --aid auto --topic /imu/angular_velocity");
        assert_eq!(
            checked.contains("force-on-another-topic"),
            is_named,
            "{checked}"
        );
        let replayed = said("replay log.mcap -o null: --aid auto --topic /imu/angular_velocity");
        let listed = said("info log.mcap");
        for text in [&checked, &replayed, &listed] {
            assert_eq!(text.contains(&advice), is_named, "{topic}: {text}");
        }
        if is_named {
            let with = said(&format!(
                "replay log.mcap -o null: --topic {RATES} {advice}"
            ));
            assert!(with.contains("gravity updates"), "{with}");
            assert!(!with.contains("no specific force"), "{with}");
        }
    }
}
