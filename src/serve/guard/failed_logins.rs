//! Wrong tokens by address -> how long the answer is held back. Pure: time is given.
//!
//! What is held back is the answer to the wrong token, and nothing else: a right one is answered at
//! once, whatever others at the same address tried. So nobody can lock anybody out.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::time::{Duration, Instant};

/// The first wrong token of an address waits so long for its answer, each further one twice as long.
const FIRST: Duration = Duration::from_millis(100);
/// Longest wait of an answer.
const LONGEST: Duration = Duration::from_secs(5);
/// An address that tried nothing for so long begins anew.
const FORGOTTEN: Duration = Duration::from_secs(60);
/// Addresses remembered; the one silent longest makes room for another.
const MOST: usize = 1024;

/// Peers that have shown wrong tokens.
#[derive(Debug, Default)]
pub(super) struct Strangers {
    known: HashMap<IpAddr, Failures>,
}

#[derive(Debug)]
struct Failures {
    count: u32,
    last: Instant,
}

impl Strangers {
    /// A wrong token came from this address: its answer waits so long.
    pub(in crate::serve) fn failed(&mut self, from: IpAddr, now: Instant) -> Duration {
        let from = network(from);
        if self.known.len() >= MOST && !self.known.contains_key(&from) {
            let silent = self.known.iter().min_by_key(|(_, failures)| failures.last);
            if let Some(silent) = silent.map(|(from, _)| *from) {
                self.known.remove(&silent);
            }
        }
        let failures = self.known.entry(from).or_insert(Failures {
            count: 0,
            last: now,
        });
        if now.saturating_duration_since(failures.last) >= FORGOTTEN {
            failures.count = 0;
        }
        let delay = FIRST * (1 << failures.count.min(6));
        failures.count = failures.count.saturating_add(1);
        failures.last = now;
        delay.min(LONGEST)
    }
}

/// Whoever has one address of IPv6 has the 2^64 beside it.
fn network(from: IpAddr) -> IpAddr {
    match from.to_canonical() {
        IpAddr::V6(ip) => Ipv6Addr::from_bits(ip.to_bits() & !u128::from(u64::MAX)).into(),
        v4 => v4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_answer_to_a_wrong_token_waits_ever_longer_and_no_longer_than_five_seconds() {
        let (mut strangers, start) = (Strangers::default(), Instant::now());
        let one = IpAddr::from([192, 168, 1, 7]);
        let delays: Vec<u128> = (0..100)
            .map(|_| strangers.failed(one, start).as_millis())
            .collect();
        assert_eq!(delays[..8], [100, 200, 400, 800, 1600, 3200, 5000, 5000]);
        assert_eq!(delays[99], 5000);
        // Not for another, and not a minute later.
        let other = IpAddr::from([192, 168, 1, 8]);
        assert_eq!(strangers.failed(other, start), FIRST);
        assert_eq!(strangers.failed(one, start + FORGOTTEN), FIRST);
        assert_eq!(strangers.failed(one, start + FORGOTTEN), 2 * FIRST);
        // One that changes the lower half of its address is the same.
        let v6 = |low: u128| IpAddr::from(Ipv6Addr::from_bits((0x2001_0db8 << 96) | low));
        assert_eq!(strangers.failed(v6(1), start), FIRST);
        assert_eq!(strangers.failed(v6(0xffff), start), 2 * FIRST);
        assert_eq!(strangers.failed(v6(1 << 64), start), FIRST);
        let mapped = IpAddr::from(std::net::Ipv4Addr::new(192, 168, 1, 8).to_ipv6_mapped());
        assert_eq!(strangers.failed(mapped, start), 2 * FIRST);
    }

    #[test]
    fn of_any_number_of_addresses_no_more_than_a_thousand_are_remembered() {
        let (mut strangers, start) = (Strangers::default(), Instant::now());
        for n in 0..100_000_u32 {
            let now = start + Duration::from_micros(n.into());
            strangers.failed(IpAddr::from(n.to_be_bytes()), now);
            assert!(strangers.known.len() <= MOST);
        }
        // The last are known.
        let last = IpAddr::from(99_999_u32.to_be_bytes());
        assert_eq!(strangers.failed(last, start), 2 * FIRST);
    }
}
