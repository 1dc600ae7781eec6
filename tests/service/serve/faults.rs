//! Faults in number, exactly counted, with the time injected.

use super::client::rate;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::collections::VecDeque;
use std::sync::Arc;
use strapd::serve::core::hub::{Hub, Settings};
use strapd::serve::core::session::{Scratch, Session};
use strapd_attitude::record::Nanos;

/// A conversation without a socket: lines with the time each is received at -> what a watcher gets.
fn conversation<'a>(lines: impl Iterator<Item = (i64, &'a str)>) -> (Vec<u8>, Value) {
    let hub = Arc::new(Hub::new(Settings::default()).unwrap());
    let mut sender = Session::new(&hub, "sender".to_owned(), true);
    let mut watcher = Session::new(&hub, "watcher".to_owned(), true);
    let mut scratch = Scratch::default();
    watcher.bytes(b"{\"class\":\"WATCH\"}\n", Nanos(0), &mut scratch);
    let mut out = Vec::new();
    let mut take = || {
        let mut chunks = VecDeque::new();
        let outbox = &watcher.client().outbox;
        let bytes = outbox.take(usize::MAX, &mut chunks);
        outbox.written(bytes);
        chunks.iter().for_each(|c| out.extend_from_slice(c));
    };
    for (received, line) in lines {
        sender.bytes(
            format!("{line}\n").as_bytes(),
            Nanos(received),
            &mut scratch,
        );
        take();
    }
    let status = serde_json::from_slice(&hub.status()).unwrap();
    // What was said before the first attitude names the session, which is another each time.
    let from = out
        .windows(12)
        .position(|w| w == b"\"class\":\"ATT")
        .unwrap();
    (out.split_off(from), status)
}

#[test]
fn the_clock_on_the_wall_changes_no_bit() {
    const SECOND: i64 = 1_000_000_000;
    let now = 1_700_000_000 * SECOND;
    let lines: Vec<String> = (0..2000)
        .map(|n| rate("a", n, 1.0 + 1e-3 * n as f64))
        .collect();
    let with = |clock: &dyn Fn(i64) -> i64| {
        conversation((0..).zip(&lines).map(|(n, l)| (clock(n), l.as_str()))).0
    };
    let undisturbed = with(&|n| now + n * 1_000_000);
    assert_eq!(undisturbed.iter().filter(|b| **b == b'\n').count(), 2000);
    let years = 6 * 365 * 86_400 * SECOND;
    for jump in [
        3600 * SECOND,
        -3600 * SECOND,
        years,
        -years,
        i64::MAX / 2 - now,
        -now,
    ] {
        let jumped = with(&|n| now + n * 1_000_000 + if n >= 1000 { jump } else { 0 });
        assert!(jumped == undisturbed, "jump of {jump} ns");
    }
    // Nor does a clock that stands still, or runs backwards.
    assert!(with(&|_| now) == undisturbed);
    assert!(with(&|n| now - n * 1_000_000) == undisturbed);
}

/// Faults injected into a stream.
#[derive(Default, Debug, PartialEq)]
struct Injected {
    dropped: u64,
    repeated: u64,
    late: u64,
    undecodable: u64,
    not_finite: u64,
}

#[test]
fn faults_are_counted_exactly_as_they_were_injected() {
    for seed in 0..100 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut injected = Injected::default();
        let mut lines: Vec<String> = Vec::new();
        let mut n = 0;
        // The first few and the last few are whole: what is lost there nobody can know.
        while n < 600 {
            let line = rate("a", n, 0.5 + 1e-3 * n as f64);
            let calm = !(20..580).contains(&n);
            match rng.random_range(0..20) {
                _ if calm => lines.push(line),
                0 | 1 => injected.dropped += 1,
                2 => {
                    lines.extend([line.clone(), line]);
                    injected.repeated += 1;
                }
                3 => {
                    // Overtaken by its successor: in a live stream, too late.
                    let next = rate("a", n + 1, 0.5 + 1e-3 * (n + 1) as f64);
                    lines.extend([next, line]);
                    injected.late += 1;
                    n += 1;
                }
                4 => {
                    lines.extend([line, "{\"class\":\"RATE\",".to_owned()]);
                    injected.undecodable += 1;
                }
                5 => {
                    // NaN as JSON has it.
                    lines.push(line.replace(",0,0]", ",null,0]"));
                    injected.not_finite += 1;
                }
                _ => lines.push(line),
            }
            n += 1;
        }
        let lines = (0..)
            .zip(&lines)
            .map(|(n, l)| (1_700_000_000_000_000_000 + n, l.as_str()));
        let (_, status) = conversation(lines);
        let source = &status["sources"][0];
        let of = |name: &str| source["counts"][name].as_u64().unwrap_or(0);
        let counted = Injected {
            // A sample that was overtaken is missing when its successor comes, and late afterwards.
            dropped: source["missing"].as_u64().unwrap() - of("late"),
            repeated: of("repeated"),
            late: of("late"),
            undecodable: of("undecodable"),
            not_finite: of("no_gyro") + of("not_finite"),
        };
        assert_eq!(counted, injected, "seed {seed}: {source}");
        assert!(counted.dropped > 20 && counted.late > 5, "{counted:?}");
    }
}
