//! Promise: a ULog or a ROS 1 bag is a log like any other, for every command.

use crate::program::{Ran, strapd, strapd_fed};
use crate::replays::fixture;
use std::path::Path;

fn bench(files: &[&str]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for file in files {
        std::fs::copy(fixture(file), dir.path().join(file)).unwrap();
    }
    dir
}

/// Asserts that what was lost is reported, and nothing else went wrong.
#[track_caller]
fn lossy(ran: &Ran) -> &Ran {
    assert_eq!(ran.code, Some(3), "{ran:?}");
    assert!(!ran.err.contains("panicked"), "{ran:?}");
    ran
}

fn text(dir: &Path, file: &str) -> String {
    std::fs::read_to_string(dir.join(file)).unwrap()
}

#[test]
fn a_bag_of_any_packing_gives_the_attitude_of_the_mcap_to_the_last_bit() {
    let dir = bench(&[
        "constant_rate_ros1.mcap",
        "constant_rate_none.bag",
        "constant_rate_lz4.bag",
        "constant_rate_bz2.bag",
    ]);
    let at = dir.path();
    strapd(at, "replay constant_rate_ros1.mcap -o mcap.csv").done();
    let expected = text(at, "mcap.csv");
    for packing in ["none", "lz4", "bz2"] {
        let bag = format!("constant_rate_{packing}.bag");
        strapd(at, &format!("replay {bag} -o {packing}.csv")).done();
        assert!(text(at, &format!("{packing}.csv")) == expected, "{packing}");
        let bytes = std::fs::read(at.join(&bag)).unwrap();
        strapd_fed(at, "replay - -o piped.csv --force", bytes).done();
        assert!(text(at, "piped.csv") == expected, "{packing} on a pipe");
    }
    for command in ["info", "cat", "report -o page.html"] {
        strapd(at, &format!("{command} constant_rate_bz2.bag")).done();
    }
    let info = strapd(at, "info constant_rate_bz2.bag");
    for words in ["251 messages", "ROS 1 bag", "sensor_msgs/Imu [ros1]"] {
        assert!(info.out.contains(words), "{words}: {info:?}");
    }
}

#[test]
fn a_flight_of_px4_is_looked_at_replayed_and_held_against_its_own_attitude() {
    let dir = bench(&["px4_flight.ulg"]);
    let at = dir.path();
    let info = strapd(at, "info px4_flight.ulg");
    for words in [
        "ULog; written by PX4 on PX4_FMU_V5",
        "ulog/sensor_combined [ros1]",
        "vehicle_attitude",
        "what came within 97 ms is missing",
    ] {
        assert!(lossy(&info).out.contains(words), "{words}: {info:?}");
    }
    let replay = strapd(
        at,
        "replay px4_flight.ulg -o flight.csv --against-recorded --json",
    );
    let summary: serde_json::Value = serde_json::from_str(&lossy(&replay).out).unwrap();
    let run = summary.get(0).unwrap_or(&summary);
    let topic = &run["topics"][0];
    assert_eq!(topic["topic"], "sensor_combined", "{topic:#}");
    assert_eq!(topic["samples"]["total"], 3627, "{topic:#}");
    assert_eq!(topic["sample_kind"], "average", "{topic:#}");
    // PX4's filter and the gyro alone agree over a second to some tenths of a degree: axes, units and the order of the
    // quaternion are right. With any of them wrong it is tens of degrees.
    let median = |nth: usize| {
        topic["against_recorded"][nth]["median_deg"]
            .as_f64()
            .unwrap()
    };
    assert!(median(0) < 0.5 && median(1) < 0.5, "{topic:#}");
    // The last is a rate taken for an angle.
    assert!(median(3) > 20.0, "{topic:#}");
    for command in ["cat", "check", "report -o page.html"] {
        lossy(&strapd(at, &format!("{command} px4_flight.ulg")));
    }
    let rates = strapd(
        at,
        "replay px4_flight.ulg --topic vehicle_angular_velocity -o null: --json",
    );
    assert!(
        lossy(&rates).out.contains("\"sample_kind\":\"rate\""),
        "{rates:?}"
    );
    // Logged twice a second, over 5 ms each: no basis for an attitude.
    strapd(at, "replay px4_flight.ulg --topic vehicle_imu/1 -o null:").refused(
        1,
        &["vehicle_imu/1", "a sample lasts 0.00500 s", "0.500 s apart"],
    );
}

#[test]
fn a_ulog_made_an_mcap_gives_the_same_attitude_and_can_be_read_by_the_mcap_crate() {
    let dir = bench(&["px4_flight.ulg"]);
    let at = dir.path();
    lossy(&strapd(at, "recover px4_flight.ulg -o flight.mcap"));
    lossy(&strapd(at, "replay px4_flight.ulg -o ulog.csv"));
    strapd(at, "replay flight.mcap -o mcap.csv").done();
    assert!(text(at, "ulog.csv") == text(at, "mcap.csv"));
    let bytes = std::fs::read(at.join("flight.mcap")).unwrap();
    let messages = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap);
    let combined = messages.filter(|m| m.channel.topic == "sensor_combined");
    assert_eq!(combined.count(), 3627);
    // The same from a pipe.
    let log = std::fs::read(at.join("px4_flight.ulg")).unwrap();
    lossy(&strapd_fed(at, "replay - -o piped.csv", log));
    assert!(text(at, "piped.csv") == text(at, "ulog.csv"));
}

#[test]
fn the_telemetry_of_cameras_and_vehicles_is_read_by_every_command_from_a_file_and_a_pipe() {
    let logs = [
        "gopro_hero6.raw",
        "gopro_fusion.raw",
        "ardupilot.tlog --topic SCALED_IMU2",
    ];
    let dir = bench(&logs.map(|log| log.split(' ').next().unwrap()));
    let at = dir.path();
    for log in logs {
        let (camera, topic) = log.split_once(' ').unwrap_or((log, ""));
        // The vehicle's clock jumped, so its samples have gaps.
        let ended = |ran: &Ran| assert!(matches!(ran.code, Some(0 | 3)), "{log}: {ran:?}");
        ended(&strapd(
            at,
            &format!("replay {camera} {topic} -o file.csv --force"),
        ));
        let bytes = std::fs::read(at.join(camera)).unwrap();
        let piped = format!("replay - {topic} -o pipe.csv --force");
        ended(&strapd_fed(at, &piped, bytes.clone()));
        assert!(text(at, "file.csv") == text(at, "pipe.csv"), "{camera}");
        ended(&strapd(
            at,
            &format!("recover {camera} -o copy.mcap --force"),
        ));
        ended(&strapd(
            at,
            &format!("replay copy.mcap {topic} -o copy.csv --force"),
        ));
        assert!(text(at, "file.csv") == text(at, "copy.csv"), "{camera}");
        let [cat, report] = [
            format!("cat {topic}"),
            format!("report {topic} -o page.html --force"),
        ];
        for command in ["info", &cat, &report] {
            ended(&strapd(at, &format!("{command} {camera}")));
            ended(&strapd_fed(at, &format!("{command} -"), bytes.clone()));
        }
    }
    let info = strapd(at, "info gopro_hero6.raw");
    for words in [
        "198 messages",
        "GPMF; written by GoPro Hero6 Black",
        "gopro/imu",
    ] {
        assert!(info.done().out.contains(words), "{words}: {info:?}");
    }
    // A video, but of something else.
    std::fs::write(at.join("v.mp4"), b"\0\0\0\x14ftypmp42\0\0\0\0mp41").unwrap();
    strapd(at, "info v.mp4").refused(1, &["v.mp4", "a video", "Gyroflow"]);
}

#[test]
fn a_log_cut_short_gives_what_came_before_the_cut_says_so_and_exits_with_3() {
    let dir = bench(&[]);
    for (file, samples) in [("px4_flight.ulg", 1_000), ("constant_rate_lz4.bag", 100)] {
        let whole = std::fs::read(fixture(file)).unwrap();
        std::fs::write(dir.path().join(file), &whole[..whole.len() * 6 / 10 + 1]).unwrap();
        let ran = strapd(dir.path(), &format!("replay {file} -o null: --json"));
        let summary: serde_json::Value = serde_json::from_str(&lossy(&ran).out).unwrap();
        let run = summary.get(0).unwrap_or(&summary);
        assert!(
            run["topics"][0]["samples"]["total"].as_u64() > Some(samples),
            "{run:#}"
        );
        assert!(run.to_string().contains("the file is cut"), "{run:#}");
    }
}

#[test]
fn what_only_begins_like_a_log_is_an_error_and_no_panic() {
    let dir = bench(&[]);
    let at = dir.path();
    let ulog = [b"ULog\x01\x12\x35\x01".as_slice(), &[0; 8]].concat();
    let logs: [(&str, &[u8]); 4] = [
        ("a.ulg", b"ULog\x01\x12\x35"),
        ("b.ulg", &ulog),
        ("c.bag", b"#ROSBAG V2.0\n"),
        ("d.bag", b"#ROSBAG V2.0\n\xff\xff\xff\xff\xff\xff"),
    ];
    for (file, bytes) in logs {
        std::fs::write(at.join(file), bytes).unwrap();
        strapd(at, &format!("replay {file} -o null:")).refused(1, &[file, "no IMU topic"]);
    }
    std::fs::write(at.join("old.bag"), b"#ROSBAG V1.2\n....").unwrap();
    strapd(at, "replay old.bag").refused(1, &["old.bag", "before 2.0", "rosbag fix old.bag"]);
}
