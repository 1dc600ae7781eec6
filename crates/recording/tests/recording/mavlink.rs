//! A telemetry log of a ground station: the numbers pymavlink reads in it, from a file and a pipe, cut and changed.

use crate::mcap_logs::{from_bytes, read};
use crate::meter::Meter;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;
use std::time::Duration;
use strapd_attitude::quaternion::Quaternion;
use strapd_recording::format::Format;
use strapd_recording::mcap::Reader;

fn fixture() -> PathBuf {
    PathBuf::from(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../fixtures/ardupilot.tlog"
    ))
}

#[test]
fn the_samples_of_a_vehicle_are_those_pymavlink_reads() {
    let (ours, report) = read(Reader::open(&fixture()).unwrap());
    assert!(report.survey.problems.is_empty());
    assert_eq!(report.survey.facts.format, Format::Tlog);
    // pymavlink 2.4: how many, sums of xgyro, ygyro, zgyro, xacc, yacc, zacc as sent, and when the first and last came.
    for (topic, sums, (first, last)) in [
        (
            "RAW_IMU",
            [78, 128, 400, 134, 9878, -289],
            (1_632_843_969.833479, 1_632_843_972.3985028),
        ),
        (
            "SCALED_IMU2",
            [148, -471, -31, 594, 8025, 458],
            (1_632_843_969.843587, 1_632_843_972.408587),
        ),
    ] {
        let own: Vec<_> = ours.iter().filter(|m| m.0 == topic).collect();
        assert_eq!(own.len(), 9, "{topic}");
        let number = |data: &[u8], nth: usize| {
            f64::from_le_bytes(*data[4 + 24 + 8 * nth..].first_chunk().unwrap())
        };
        for (axis, (rate, force)) in [(0, (13, 25)), (1, (14, 26)), (2, (15, 27))] {
            // Forward, right, down as forward, left, up.
            let sign = if axis == 0 { 1.0 } else { -1.0 };
            let sum = |nth: usize| own.iter().map(|m| number(&m.3, nth)).sum::<f64>();
            assert!((sum(rate) * 1000.0 * sign - f64::from(sums[axis])).abs() < 1e-6);
            let milli_g = sum(force) / 9.80665 * 1000.0 * sign;
            assert!((milli_g - f64::from(sums[axis + 3])).abs() < 1e-6);
        }
        // It prints microseconds since 1970 in a double.
        let time = |m: &(String, u64, u32, Vec<u8>)| m.1 as f64 * 1e-9;
        assert!((time(own[0]) - first).abs() < 1e-6 && (time(own[8]) - last).abs() < 1e-6);
    }
    // When the vehicle took the first, ms since it was switched on.
    let data = &ours.iter().find(|m| m.0 == "SCALED_IMU2").unwrap().3;
    let stamp = [4, 8].map(|at| u32::from_le_bytes(*data[at..].first_chunk().unwrap()));
    assert_eq!(stamp, [76_673, 745_000_000]);
    // Roll, pitch and yaw of the first and the last attitude, rad, north, east, down.
    let attitudes: Vec<_> = ours.iter().filter(|m| m.0 == "ATTITUDE").collect();
    assert_eq!((attitudes.len(), ours.len()), (9, 27));
    for (message, [roll, pitch, yaw]) in [
        (
            attitudes[0],
            [
                -1.538_471_937_179_565_4,
                0.015_643_049_031_496_048,
                1.178_480_982_780_456_5,
            ],
        ),
        (
            attitudes[8],
            [
                -1.538_198_471_069_336,
                0.014_899_618_923_664_093,
                1.191_441_059_112_548_8,
            ],
        ),
    ] {
        let data = &message.3[message.3.len() - 32..];
        let [x, y, z, w] =
            [0, 8, 16, 24].map(|at| f64::from_le_bytes(*data[at..].first_chunk().unwrap()));
        // Forward, left, up in a world whose x is north and whose y is west: y and z have other signs.
        let own = Quaternion::<(), ()>::assume_unit([w, x, -y, -z]).yaw_pitch_roll();
        for (found, said) in [(own.roll, roll), (own.pitch, pitch), (own.yaw, yaw)] {
            assert!((found - said).abs() < 1e-12, "{own:?}");
        }
    }
}

#[test]
fn cut_or_changed_anywhere_it_gives_the_rest_the_same_from_a_file_and_a_pipe_and_says_what_is_lost()
{
    let whole = std::fs::read(fixture()).unwrap();
    let (all, _) = read(from_bytes(&whole).unwrap());
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.tlog");
    let (mut told, mut cuts) = (0, 0);
    for cut in (100..whole.len()).step_by(187) {
        let (ours, report) = read(from_bytes(&whole[..cut]).unwrap());
        assert!(ours[..] == all[..ours.len()], "{cut}");
        told += usize::from(report.survey.problems.losses() > 0);
        cuts += 1;
    }
    // Between frames nothing tells that another followed.
    assert!(told * 10 > cuts * 9, "{told} of {cuts}");
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut meter = Meter::start();
    for case in 0..1500 {
        let mut log = whole.clone();
        for _ in 0..rng.random_range(1..6) {
            let at = rng.random_range(9..log.len() - 100);
            let end = at + rng.random_range(1..90);
            match rng.random_range(0..4) {
                0 => log[at] ^= 1 << rng.random_range(0..8),
                1 => log[at..end].fill([0, 0xfd, 0xff][rng.random_range(0..3)]),
                2 => drop(log.drain(at..end)),
                _ => {
                    let piece = log[at..end].to_vec();
                    log.splice(at..at, piece);
                }
            }
        }
        let (ours, report) = read(from_bytes(&log).unwrap());
        meter.lap(Duration::from_secs(20), case);
        std::fs::write(&path, &log).unwrap();
        let (of_file, mut same) = read(Reader::open(&path).unwrap());
        same.survey.file_size = None;
        assert!(ours == of_file && report == same, "{case}");
        // What is right by its checksum is what was sent; the time before it has none.
        assert!(
            ours.iter()
                .all(|m| all.iter().any(|known| known.0 == m.0 && known.3 == m.3))
        );
    }
}
