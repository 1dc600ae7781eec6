//! Promise: `--at` writes the attitude at the instants of frames, of a topic or of a table, and not at the nearest
//! sample; instants that have none are counted, and a run in which none has is refused.

use crate::program::strapd;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::fmt::Write as _;
use std::path::Path;

/// 2023-11-14 22:13:20 UTC, ns.
const BEGINS: i64 = 1_700_000_000_000_000_000;

/// True attitude of a body that turns and nods, by its seconds.
fn truth(t: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::z() * (1.5 * t))
        * UnitQuaternion::from_scaled_axis(Vector3::x() * (0.5 * (4.0 * t).sin()))
}

/// Turns between samples at 100 Hz for two seconds.
fn turns(at: &Path) {
    let mut text = "t_ns,dw,dx,dy,dz\n".to_owned();
    for n in 1..=200 {
        let t = f64::from(n) * 0.01;
        let turn = truth(t - 0.01).inverse() * truth(t);
        let stamp = BEGINS + i64::from(n) * 10_000_000;
        let _ = writeln!(text, "{stamp},{},{},{},{}", turn.w, turn.i, turn.j, turn.k);
    }
    std::fs::write(at.join("turns.csv"), text).unwrap();
}

const REPLAY: &str = "replay turns.csv --columns dq=dw:dx:dy:dz,stamp=t_ns:ns --aid none -q";

/// Stamps and attitudes of a table.
fn rows(path: &Path) -> Vec<(i64, UnitQuaternion<f64>)> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let rows = reader.records().map(|row| {
        let row = row.unwrap();
        let [w, x, y, z] = [1, 2, 3, 4].map(|n| row[n].parse::<f64>().unwrap());
        let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        (row[0].parse().unwrap(), q)
    });
    rows.collect()
}

#[test]
fn frames_of_a_camera_have_the_attitude_of_their_own_instant() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    turns(at);
    // 29.97 frames a second, half of them in another order.
    let stamps: Vec<i64> = (1..55)
        .map(|n| BEGINS + 50_000_000 + n * 33_366_667)
        .collect();
    let mut text = "frame;t_us\n".to_owned();
    for (n, stamp) in stamps.iter().rev().enumerate() {
        let _ = writeln!(text, "{n};{}.{:03}", stamp / 1000, stamp % 1000);
    }
    std::fs::write(at.join("frames.csv"), text).unwrap();
    strapd(at, &format!("{REPLAY} --at frames.csv -o frames_at.csv")).done();
    strapd(at, &format!("{REPLAY} -o samples.csv")).done();
    let found = rows(&at.join("frames_at.csv"));
    assert_eq!(found.iter().map(|(t, _)| *t).collect::<Vec<_>>(), stamps);
    // Relative to the first sample, whose attitude is the start.
    let begin = truth(0.01).inverse();
    let error = |(t, q): &(i64, UnitQuaternion<f64>)| {
        let secs = (t - BEGINS) as f64 * 1e-9;
        (begin * truth(secs)).angle_to(q)
    };
    let worst = found.iter().map(error).fold(0.0, f64::max);
    println!("{worst:.1e} rad");
    assert!(worst < 3e-5, "{worst:e} rad");
    // The nearest sample is half a step off.
    let samples = rows(&at.join("samples.csv"));
    let nearest = |(t, _): &(i64, UnitQuaternion<f64>)| {
        let (_, q) = samples.iter().min_by_key(|(s, _)| (s - t).abs()).unwrap();
        error(&(*t, *q))
    };
    assert!(found.iter().map(nearest).fold(0.0, f64::max) > 5e-3);
}

#[test]
fn messages_of_a_topic_are_instants_by_the_stamp_in_their_header() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    // The fixture has a field at instants of its own beside the samples.
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/xsens_mti.mcap");
    strapd(at, &format!("replay {fixture} --aid gravity -q -o all.csv")).done();
    strapd(
        at,
        &format!("replay {fixture} --aid gravity -q --at /imu/mag -o mag.csv"),
    )
    .done();
    let (all, mag) = (rows(&at.join("all.csv")), rows(&at.join("mag.csv")));
    assert!(mag.len() > 500, "{}", mag.len());
    for (t, q) in &mag {
        let after = all.partition_point(|(s, _)| s < t);
        match all.get(after).filter(|(s, _)| s == t) {
            Some((_, same)) => assert_eq!(q, same),
            None => {
                let step = all[after - 1].1.angle_to(&all[after].1);
                let [a, b] = [after - 1, after].map(|n| all[n].1.angle_to(q));
                assert!(a <= 1.01 * step + 1e-9 && b <= 1.01 * step + 1e-9, "{t}");
            }
        }
    }
}

#[test]
fn instants_without_an_attitude_are_counted_and_none_at_all_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    turns(at);
    let write = |stamps: &[i64]| {
        let text = stamps
            .iter()
            .fold("t_ns\n".to_owned(), |text, t| format!("{text}{t}\n"));
        std::fs::write(at.join("at.csv"), text).unwrap();
    };
    write(&[BEGINS, BEGINS + 15_000_000, BEGINS + 10_000_000_000]);
    let ran = strapd(
        at,
        &format!("{REPLAY} --at at.csv --json -o out.csv").replace(" -q", ""),
    );
    assert!(
        ran.done().out.contains("2 of 3 instants have no attitude"),
        "{ran:?}"
    );
    assert_eq!(rows(&at.join("out.csv")).len(), 1);
    write(&[5, 6]);
    let none = format!("{REPLAY} --at at.csv --force -o out2.csv");
    strapd(at, &none).refused(1, &["none of the 2 instants", "1700000000.010"]);
    assert!(!at.join("out2.csv").exists());
    for (asked, code, says) in [
        ("nowhere", 1, "neither a file nor a topic"),
        ("frames", 1, "no frames of a video"),
        ("at.csv --out-rate 5", 2, "cannot be used with"),
    ] {
        let refused = format!("{REPLAY} --at {asked} -o out3.csv");
        strapd(at, &refused).refused(code, &[says]);
    }
}
