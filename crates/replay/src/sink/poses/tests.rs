//! Promise: a table has every sensor at the same even instants, in the axes its readers take, and nothing where a sensor had
//! not begun or had ended.

#![allow(clippy::unwrap_used)]

use super::*;
use crate::sink::axes::tests::{close, rotate, telling};
use strapd_attitude::record::AttitudeSample;

const MS: i64 = 1_000_000;

fn track(id: &str, stamps: &[i64], q: impl Fn(i64) -> [f64; 4]) -> Track {
    Track {
        id: id.to_owned(),
        world: Convention::NwuFlu,
        poses: stamps.iter().map(|ms| (Nanos(ms * MS), q(*ms))).collect(),
    }
}

/// A turn about z, 1 rad/s.
fn turning(ms: i64) -> [f64; 4] {
    let (s, c) = (0.5e-3 * ms as f64).sin_cos();
    [c, 0.0, 0.0, s]
}

#[test]
fn rows_are_even_where_all_sensors_are_and_between_attitudes_on_their_way() {
    let tracks = [
        track("/imu/left arm", &[0, 10, 20, 30, 40, 60, 70], turning),
        track("right", &[5, 27, 48], |ms| turning(-ms)),
        track("never", &[], turning),
        track("right", &[0, 100], |_| [1.0, 0.0, 0.0, 0.0]),
    ];
    let frames = frames(&tracks).unwrap();
    assert_eq!(frames.names, ["imu_left_arm", "right", "right_2"]);
    assert_eq!((frames.step, frames.rows.len()), (10 * MS, 5));
    for (row, ms) in frames.rows.iter().zip([5, 15, 25, 35, 45]) {
        assert!(close(&row[0], &turning(ms), 1e-12));
        assert!(close(&row[1], &turning(-ms), 1e-12));
    }
}

#[test]
fn what_has_no_time_in_common_or_asks_for_too_much_is_refused() {
    let apart = [
        track("a", &[0, 10], turning),
        track("b", &[20, 30], turning),
    ];
    assert!(frames(&apart).is_err());
    let uneven = [track("a", &[0, 1, 2, 3, 1_000_000_000], turning)];
    assert!(frames(&uneven).is_err());
    let one = frames(&[track("a", &[7], turning)]).unwrap();
    assert_eq!((one.step, one.rows.len()), (ONE_ROW, 1));
    assert!(frames(&[]).unwrap().rows.is_empty());
}

#[test]
fn a_bvh_turns_left_up_forward_as_the_body_turns_forward_left_up() {
    let q = telling().q_nb.wxyz();
    let frames = frames(&[track("head", &[0, 20], |_| q)]).unwrap();
    let text = String::from_utf8(bvh::write(&frames)).unwrap();
    assert!(text.contains("Frames: 2\nFrame Time: 0.020000000\n"));
    assert!(text.contains("CHANNELS 3 Yrotation Xrotation Zrotation"));
    let last: Vec<f64> = text
        .lines()
        .last()
        .unwrap()
        .split(' ')
        .map(|cell| cell.parse().unwrap())
        .collect();
    let half = |n: usize| last[n].to_radians() / 2.0;
    // Read as BVH is: y, then x, then z, each about the axis as the one before left it.
    let about = |axis: usize, half: f64| {
        let (s, c) = half.sin_cos();
        let mut q = [c, 0.0, 0.0, 0.0];
        q[1 + axis] = s;
        q
    };
    let turned = |v| {
        rotate(
            about(1, half(6)),
            rotate(about(0, half(7)), rotate(about(2, half(8)), v)),
        )
    };
    // Forward, left, up as left, up, forward.
    let seen = |[a, b, c]: [f64; 3]| [b, c, a];
    for v in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
        assert!(close(&turned(seen(v)), &seen(rotate(q, v)), 1e-9));
    }
}

#[test]
fn attitudes_come_into_a_table_in_one_vertical_and_later_ones_only() {
    let ned = AttitudeSample {
        q_nb: Convention::NwuFlu.convert(Convention::NedFrd, telling().q_nb),
        ..telling()
    };
    let mut poses = Poses {
        tracks: vec![Track {
            world: Convention::NedFrd,
            ..track("head", &[], turning)
        }],
        write: sto::write,
    };
    let mut slot = Slot::default();
    let at = |ns: i64| AttitudeSample {
        stamp: Nanos(ns),
        ..ned
    };
    slot.batch.samples = vec![at(0), at(10 * MS), at(10 * MS), at(4 * MS), at(20 * MS)];
    poses.in_order(&mut slot).unwrap();
    let text = String::from_utf8(poses.closing().unwrap()).unwrap();
    let rows: Vec<&str> = text.split("endheader\n").nth(1).unwrap().lines().collect();
    assert_eq!((rows[0], rows.len()), ("time\thead", 4));
    assert!(text.starts_with("DataRate=100.000000\nDataType=Quaternion\n"));
    let (time, q) = rows[3].split_once('\t').unwrap();
    assert_eq!(time, "0.020000000");
    let q: Vec<f64> = q.split(',').map(|cell| cell.parse().unwrap()).collect();
    assert!(close(&q, &telling().q_nb.wxyz(), 1e-14));
}
