//! Promise: parts of recordings of every format that recorders write in several files have the bits of the whole.
//!
//! ULogs and telemetry are cut here, between two records; bags and databases by somebody else's programs.

use crate::program::strapd;
use crate::replays::fixture;
use std::path::Path;
use std::process::Command;

/// The attitudes of a run.
fn attitudes(at: &Path, of: &str) -> String {
    let ran = strapd(at, &format!("replay {of} -o out.csv --force"));
    assert!([Some(0), Some(3)].contains(&ran.code), "{of}: {ran:?}");
    std::fs::read_to_string(at.join("out.csv")).unwrap()
}

/// Both parts, in any order and on any number of threads, against the whole.
fn assert_joined(at: &Path, whole: &str, [first, second]: [&str; 2], flags: &str, least: usize) {
    let expected = attitudes(at, &format!("{whole} {flags}"));
    assert!(expected.lines().count() > least, "{whole}: {expected:.300}");
    for of in [
        format!("--join {first} {second}"),
        format!("--join {second} {first} --threads 1"),
        format!("--join {second} {first} --threads 4"),
    ] {
        let joined = attitudes(at, &format!("{of} {flags}"));
        assert!(joined == expected, "{of}");
    }
    // Either has less.
    let alone = attitudes(at, &format!("{second} {flags}"));
    assert!(alone.lines().count() < expected.lines().count());
}

/// The records of a ULog behind its sixteen bytes, by their letter.
fn records(log: &[u8]) -> Vec<(char, &[u8])> {
    let mut found = Vec::new();
    let mut rest = &log[16..];
    while let [a, b, letter, ..] = rest {
        let length = 3 + usize::from(u16::from_le_bytes([*a, *b]));
        let (record, behind) = rest.split_at(length.min(rest.len()));
        found.push((char::from(*letter), record));
        rest = behind;
    }
    found
}

#[test]
fn a_flight_in_two_ulogs_is_that_of_one() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let log = std::fs::read(fixture("px4_flight.ulg")).unwrap();
    let records = records(&log);
    let is_data = |(_, (letter, _)): &(usize, &(char, &[u8]))| *letter == 'D';
    let data: Vec<usize> = records
        .iter()
        .enumerate()
        .filter(is_data)
        .map(|(n, _)| n)
        .collect();
    for share in [5, 2] {
        let cut = data[data.len() / share];
        let bytes = |of: &[(char, &[u8])], letters: &str| -> Vec<u8> {
            let of = of
                .iter()
                .filter(|(l, _)| letters.is_empty() || letters.contains(*l));
            of.flat_map(|(_, record)| record.to_vec()).collect()
        };
        let head = &log[..16];
        // The next file defines and subscribes to all there is once more.
        let second = [
            head,
            &bytes(&records[..cut], "BFIMPQA"),
            &bytes(&records[cut..], ""),
        ];
        std::fs::write(
            at.join("a.ulg"),
            [head, &bytes(&records[..cut], "")].concat(),
        )
        .unwrap();
        std::fs::write(at.join("b.ulg"), second.concat()).unwrap();
        let whole = fixture("px4_flight.ulg").display().to_string();
        for topic in ["", "--topic sensor_combined"] {
            assert_joined(at, &whole, ["a.ulg", "b.ulg"], topic, 3000);
        }
    }
}

#[test]
fn telemetry_in_two_files_is_that_of_one() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let log = std::fs::read(fixture("ardupilot.tlog")).unwrap();
    // Where frames begin: eight bytes of time, the mark, the length of what it carries.
    let mut begins = Vec::new();
    let mut place = 0;
    while let Some(&[mark, length, flags]) = log.get(place + 8..).and_then(<[u8]>::first_chunk) {
        begins.push(place);
        let signature = if flags & 1 == 1 { 13 } else { 0 };
        place += 8 + usize::from(length) + if mark == 0xfe { 8 } else { 12 + signature };
    }
    assert!(begins.len() > 300);
    let (first, second) = log.split_at(begins[begins.len() / 2]);
    std::fs::write(at.join("a.tlog"), first).unwrap();
    std::fs::write(at.join("b.tlog"), second).unwrap();
    let whole = fixture("ardupilot.tlog").display().to_string();
    for topic in ["--topic RAW_IMU", "--topic SCALED_IMU2"] {
        assert_joined(at, &whole, ["a.tlog", "b.tlog"], topic, 8);
    }
}

#[test]
fn a_camera_says_no_time_by_which_its_parts_could_be_ordered() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let log = std::fs::read(fixture("gopro_hero6.raw")).unwrap();
    let second = memchr::memmem::rfind(&log, b"DEVC").unwrap();
    std::fs::write(at.join("a.raw"), &log[..second]).unwrap();
    std::fs::write(at.join("b.raw"), &log[second..]).unwrap();
    strapd(
        at,
        "replay --join a.raw b.raw --sample-kind average -o out.csv",
    )
    .refused(
        1,
        &[
            "nothing in it has a time",
            "its place among the parts is not known",
        ],
    );
}

#[test]
#[cfg_attr(
    not(has_oracles),
    ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn bags_and_databases_that_others_cut_are_those_of_one() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracles/split_recordings.py");
    for (log, parts, messages) in [
        ("constant_rate_lz4.bag", ["a.bag", "b.bag"], "251 messages"),
        ("constant_rate.db3", ["a.db3", "b.db3"], "200 messages"),
    ] {
        let whole = fixture(log).display().to_string();
        let output = Command::new(&python)
            .current_dir(at)
            .args([script.as_os_str(), whole.as_ref()])
            .args(parts)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned()
            + &String::from_utf8_lossy(&output.stderr);
        assert!(said.contains(messages), "{log}: {said}");
        assert_joined(at, &whole, parts, "", 80);
    }
}
