//! Promise: files that continue each other are one recording: the bits of the whole, in whatever order they are given; and
//! what does not continue another is refused, with the reason.

use crate::program::{Ran, strapd};
use crate::replays::fixture;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Cuts an MCAP by somebody else's library: messages before `at` of the first `names` to the first file, and so on. In the
/// later files channels are defined the other way round, and so have other numbers.
fn cut(log: &Path, folder: &Path, names: &[&str]) {
    let bytes = fs::read(log).unwrap();
    let messages: Vec<mcap::Message<'_>> = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    for (n, name) in names.iter().enumerate() {
        let share = |n: usize| messages.len() * n / names.len();
        let mut out = mcap::Writer::new(fs::File::create(folder.join(name)).unwrap()).unwrap();
        let mut channels = BTreeMap::new();
        for message in &messages {
            channels.insert(message.channel.topic.clone(), message.channel.clone());
        }
        let mut defined: Vec<_> = channels.into_values().collect();
        if n > 0 {
            defined.reverse();
            let schema = out
                .add_schema("nobody/msg/Uses", "ros2msg", b"int32 x")
                .unwrap();
            out.add_channel(schema, "/nobody", "cdr", &BTreeMap::new())
                .unwrap();
        }
        let mut ids = BTreeMap::new();
        for channel in defined {
            let schema = channel.schema.as_ref().unwrap();
            let schema = out
                .add_schema(&schema.name, &schema.encoding, &schema.data)
                .unwrap();
            let id = out
                .add_channel(
                    schema,
                    &channel.topic,
                    &channel.message_encoding,
                    &channel.metadata,
                )
                .unwrap();
            ids.insert(channel.topic.clone(), id);
        }
        for message in &messages[share(n)..share(n + 1)] {
            let header = mcap::records::MessageHeader {
                channel_id: ids[&message.channel.topic],
                sequence: message.sequence,
                log_time: message.log_time,
                publish_time: message.publish_time,
            };
            out.write_to_known_channel(&header, &message.data).unwrap();
        }
        out.finish().unwrap();
    }
}

fn attitudes(at: &Path, of: &str) -> (String, Ran) {
    let ran = strapd(
        at,
        &format!("replay {of} -o out.ndjson --force --aid gravity"),
    );
    assert!([Some(0), Some(3)].contains(&ran.code), "{of}: {ran:?}");
    (fs::read_to_string(at.join("out.ndjson")).unwrap(), ran)
}

#[test]
fn a_log_that_was_cut_has_the_bits_of_the_whole_in_any_order_and_on_any_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for name in ["xsens_mti.mcap", "ximu3.mcap", "constant_rate_ros1.mcap"] {
        let log = fixture(name);
        cut(&log, at, &["a_0.mcap", "a_1.mcap", "a_2.mcap"]);
        let (whole, _) = attitudes(at, &log.display().to_string());
        assert!(whole.lines().count() > 100, "{name}");
        for of in [
            "--join a_0.mcap a_1.mcap a_2.mcap",
            "--join a_2.mcap a_0.mcap a_1.mcap --threads 1",
            "--join a_1.mcap a_2.mcap a_0.mcap --threads 4",
        ] {
            let (joined, ran) = attitudes(at, of);
            assert_eq!(joined, whole, "{name} {of}");
            assert!(ran.out.contains("and 2 more"), "{ran:?}");
        }
    }
}

#[test]
fn a_folder_of_a_recorder_of_ros_is_one_recording_without_a_word() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let log = fixture("xsens_mti.mcap");
    fs::create_dir(at.join("bag")).unwrap();
    cut(&log, &at.join("bag"), &["bag_0.mcap", "bag_1.mcap"]);
    strapd(at, "replay bag -o out.csv").refused(1, &["bag_0.mcap, bag_1.mcap", "--join"]);
    fs::write(
        at.join("bag/metadata.yaml"),
        "rosbag2_bagfile_information:\n  version: 8\n  relative_file_paths:\n    - bag_0.mcap\n    - bag_1.mcap\n",
    )
    .unwrap();
    let (whole, _) = attitudes(at, &log.display().to_string());
    let (joined, _) = attitudes(at, "bag");
    assert_eq!(joined, whole);
    // What can be said of a log is said of it too.
    let ran = strapd(at, "info bag --json");
    let said: serde_json::Value = serde_json::from_str(&ran.done().out).unwrap();
    assert!(said.to_string().contains("/imu/data"), "{said}");
    let checked = strapd(at, "check bag").out;
    assert!(checked.contains("(953 samples)"), "{checked}");
}

#[test]
fn rows_and_lines_are_joined_too() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(
        at,
        "simulate hand --duration 20 --rate-hz 100 --seed 3 -o all.csv -o all.ndjson -q",
    )
    .done();
    let text = fs::read_to_string(at.join("all.csv")).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let rows: Vec<&str> = rows.lines().collect();
    for (name, rows) in [("b.csv", &rows[..900]), ("a.csv", &rows[900..])] {
        fs::write(at.join(name), format!("{header}\n{}\n", rows.join("\n"))).unwrap();
    }
    let text = fs::read_to_string(at.join("all.ndjson")).unwrap();
    let lines: Vec<&str> = text.lines().filter(|l| !l.contains("truth")).collect();
    fs::write(at.join("all.ndjson"), lines.join("\n")).unwrap();
    for (name, lines) in [("b.ndjson", &lines[..700]), ("a.ndjson", &lines[700..])] {
        fs::write(at.join(name), lines.join("\n")).unwrap();
    }
    for ending in ["csv", "ndjson"] {
        let (whole, _) = attitudes(at, &format!("all.{ending}"));
        let (joined, _) = attitudes(at, &format!("--join a.{ending} b.{ending}"));
        assert!(whole.lines().count() > 1000);
        let first = whole.lines().zip(joined.lines()).find(|(a, b)| a != b);
        assert_eq!(first, None, "{ending}");
        assert_eq!(joined, whole, "{ending}");
    }
}

#[test]
fn what_does_not_continue_another_is_refused_and_why() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let xsens = fixture("xsens_mti.mcap");
    cut(&xsens, at, &["a.mcap", "b.mcap"]);
    fs::copy(at.join("a.mcap"), at.join("copy.mcap")).unwrap();
    fs::copy(fixture("ximu3.mcap"), at.join("other.mcap")).unwrap();
    fs::copy(fixture("px4_flight.ulg"), at.join("flight.ulg")).unwrap();
    fs::create_dir(at.join("folder")).unwrap();
    for (of, words) in [
        ("a.mcap a.mcap", &["a.mcap", "given twice"][..]),
        ("a.mcap ./a.mcap", &["./a.mcap", "given twice", "as a.mcap"]),
        (
            "a.mcap copy.mcap",
            &["9.", "s of it are in a.mcap too", "without --join"],
        ),
        (
            "a.mcap other.mcap",
            &["its sensors are", "/imu/data", "without --join"],
        ),
        (
            "a.mcap flight.ulg",
            &["flight.ulg", "ULog", "a.mcap is", "same format"],
        ),
        ("a.mcap -", &["-", "comes only once", "save it to a file"]),
        ("a.mcap folder", &["folder", "--join takes the files"]),
        ("a.mcap none.mcap", &["none.mcap", "cannot open"]),
    ] {
        strapd(at, &format!("replay --join {of} -o out.mcap")).refused(1, words);
    }
    strapd(at, "replay --join a.mcap b.mcap --shard 0/2 -o out.mcap")
        .refused(2, &["--join", "--shard"]);
    strapd(at, "replay --join a.mcap b.mcap -o b.mcap --force")
        .refused(1, &["b.mcap", "is the input"]);
    assert!(!at.join("out.mcap").exists());
}

#[test]
fn gaps_between_files_are_said_and_held_over_as_others() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let log = fixture("xsens_mti.mcap");
    cut(&log, at, &["a.mcap", "hole.mcap", "b.mcap"]);
    let (_, ran) = attitudes(at, "--join b.mcap a.mcap");
    assert!(ran.err.contains("b.mcap: nothing for 6."), "{ran:?}");
    assert!(ran.out.contains("held"), "{ran:?}");
}

#[test]
fn who_gives_files_that_continue_each_other_is_told_once_of_the_flag() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    cut(
        &fixture("xsens_mti.mcap"),
        at,
        &["a.mcap", "b.mcap", "c.mcap"],
    );
    let ran = strapd(at, "replay c.mcap a.mcap b.mcap -o null:");
    let said = "b.mcap goes on where a.mcap ends, and 1 more like it";
    assert_eq!(ran.done().err.matches(said).count(), 1, "{ran:?}");
    assert_eq!(ran.err.matches("--join").count(), 1, "{ran:?}");
    let ran = strapd(at, "replay a.mcap c.mcap -o null:");
    assert!(!ran.done().err.contains("--join"), "{ran:?}");
    let ran = strapd(at, "replay --join c.mcap a.mcap b.mcap -o null:");
    assert!(!ran.done().err.contains("goes on"), "{ran:?}");
}

/// Rest of a recorder that was killed as it began its next file.
#[test]
fn a_part_that_holds_nothing_is_left_out_with_a_word() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    cut(&fixture("ximu3.mcap"), at, &["a.mcap", "b.mcap"]);
    let whole = strapd(at, "replay --join a.mcap b.mcap -o whole.ndjson");
    whole.done();
    fs::write(at.join("none.mcap"), "").unwrap();
    let mut begun = mcap::Writer::new(fs::File::create(at.join("begun.mcap")).unwrap()).unwrap();
    begun.finish().unwrap();
    drop(begun);
    let head = fs::read(at.join("begun.mcap")).unwrap();
    fs::write(at.join("killed.mcap"), &head[..40]).unwrap();
    for part in ["none", "begun", "killed"] {
        let join = format!("replay --join a.mcap b.mcap {part}.mcap --force -o out.ndjson");
        let ran = strapd(at, &join);
        assert!(
            ran.err
                .contains(&format!("{part}.mcap: holds no message, and is left out")),
            "{ran:?}"
        );
        let [found, expected] =
            ["out", "whole"].map(|n| fs::read(at.join(n.to_owned() + ".ndjson")).unwrap());
        assert!(found == expected, "{part}");
        ran.done();
        let alone = format!("replay --join {part}.mcap -o alone.ndjson");
        assert_ne!(strapd(at, &alone).code, Some(0));
    }
    strapd(at, "replay --join killed.mcap begun.mcap -o no.ndjson")
        .refused(1, &["nothing in it has a time"]);
}

/// Rows of half a minute at rest under this header, by a tenth of a second from `from` on.
fn table(at: &Path, name: &str, head: &str, from: u32, row: &str) {
    let rows = (0..300).map(|k| format!("{},{row}\n", from + 100 * k));
    fs::write(
        at.join(name),
        format!("{head}\n{}", rows.collect::<String>()),
    )
    .unwrap();
}

#[test]
fn recordings_of_two_devices_are_refused_with_what_tells_them_apart() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let rad = "time_ms,gyro_x (rad/s),gyro_y (rad/s),gyro_z (rad/s),acc_x (m/s^2),acc_y (m/s^2),acc_z (m/s^2)";
    table(at, "a.csv", rad, 0, "0,0,0.1,0,0,9.81");
    table(at, "b.csv", rad, 30_000, "0,0,0.1,0,0,9.81");
    let deg = "time_ms,gx (deg/s),gy (deg/s),gz (deg/s)";
    table(at, "deg.csv", deg, 30_000, "0,0,5.73");
    let other = "time_ms,w_x (rad/s),w_y (rad/s),w_z (rad/s),a_x (m/s^2),a_y (m/s^2),a_z (m/s^2)";
    table(at, "other.csv", other, 30_000, "0,0,0.1,0,0,9.81");
    let joined = |second: &str| {
        strapd(
            at,
            &format!("replay --join a.csv {second} -o out.csv --force"),
        )
    };
    joined("deg.csv").refused(
        1,
        &[
            "deg.csv: imu is in deg, without accelerations here and in rad and m/s^2 in a.csv",
            "one device",
            "without --join",
        ],
    );
    // One device may write other columns from some day on: that is said, and no more.
    let ran = joined("other.csv");
    assert!(ran.done().err.contains("w_x (rad/s)"), "{ran:?}");
    assert!(ran.err.contains("two devices"), "{ran:?}");
    // Nothing is said of one device, and no command is named that would not run.
    let ran = joined("b.csv");
    assert_eq!(
        (ran.done().err.as_str(), ran.out.contains("and 1 more' ")),
        ("", false),
        "{ran:?}"
    );
    let cameras =
        ["gopro_hero6.raw", "gopro_fusion.raw"].map(|name| fixture(name).display().to_string());
    let cameras = cameras.join(" ");
    strapd(at, &format!("replay --join {cameras} -o out.csv --force")).refused(
        1,
        &[
            "gopro/imu is from `",
            "` here and from `",
            "one device",
            "without --join",
        ],
    );
}
