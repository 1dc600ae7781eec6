//! Faulty streams -> the same releases, whether samples or their digests are kept.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::condition::gate::NO_ACCEL;
use nalgebra::Vector3;

fn entry(index: u64, stamp: i64, value: f64) -> Entry {
    Entry {
        stamp: Nanos(stamp),
        log: Nanos(stamp),
        value: Vector3::new(value, -value, 0.5),
        accel: NO_ACCEL,
        interval: 0,
        index,
        epoch: 0,
        status: Status::OK,
    }
}

/// Index, stamp, epoch, status.
type Released = (u64, i64, u32, u16);

/// Releases as a live stream takes them: each as soon as it stands in the line; then the counts; and the
/// most bytes it held.
fn released(mut order: Order, entries: &[Entry]) -> (Vec<Released>, String, usize) {
    let (mut out, mut report, mut most) = (Vec::new(), Report::default(), 0);
    let take = |order: &mut Order, out: &mut Vec<_>| {
        while let Some(e) = order.line.get(order.cursor).copied() {
            order.cursor += 1;
            order.timed(e.stamp, e.epoch);
            out.push((e.index, e.stamp.0, e.epoch, e.status.0));
        }
    };
    for entry in entries {
        order.arrive(*entry, Some(1000), &mut report);
        take(&mut order, &mut out);
        most = most.max(
            order.line.capacity() * size_of::<Entry>() + order.past.capacity() * size_of::<Past>(),
        );
    }
    order.finish(Some(1000), &mut report);
    take(&mut order, &mut out);
    (out, format!("{report:?}"), most)
}

/// A stream in which every fifteenth sample is repeated (now, or later), overtaken, shares a stamp, leaps ahead, or
/// sets the clock back.
fn faulty(seed: u64) -> Vec<Entry> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut random = |below: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state % below
    };
    let (mut entries, mut now) = (Vec::new(), 1_000_000_i64);
    for index in 0..2000_u64 {
        now += 1000;
        let value = index as f64;
        match random(75) {
            0 => entries.push(*entries.last().unwrap_or(&entry(index, now, value))),
            1 => {
                let back = random(20) as usize + 1;
                let at = entries.len().saturating_sub(back);
                let again = entries.get(at).copied();
                entries.extend(again.map(|e| Entry { index, ..e }));
            }
            2 => entries.push(entry(index, now - 2000 - random(40_000) as i64, value)),
            3 => entries.push(entry(index, now - 1000, value)),
            4 => {
                now -= random(90_000) as i64;
                entries.push(entry(index, now, value));
            }
            5 => entries.push(entry(index, now + 20_000_000, value)),
            6 => now += 3000,
            _ => entries.push(entry(index, now, value)),
        }
    }
    entries
}

#[test]
fn a_live_stream_that_keeps_digests_releases_what_one_that_keeps_samples_does() {
    let mut counted = 0;
    for seed in 1..=200 {
        let entries = faulty(seed);
        let live = Order::new(0, 5_000_000, false);
        let whole = Order {
            is_live: false,
            ..live.clone()
        };
        // Nothing is sent again, or fits into a hole, further back than what is kept.
        let (expected, told, _) = released(whole, &entries);
        let (out, told_live, most) = released(live, &entries);
        assert_eq!(out, expected, "{seed}");
        assert_eq!(told_live, told, "{seed}");
        assert!(most <= 3 << 10, "{most} bytes");
        counted += usize::from(told.contains("Repeated") || expected.last().unwrap().2 > 0);
    }
    assert_eq!(counted, 200);
}
