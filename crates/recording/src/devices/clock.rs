//! Counters of a device, which wrap -> time that goes on, and how many packets are missing. Pure.
//!
//! Apart from the protocols because counters wrap alike whatever they count.

use super::numbers::G;

/// Counter of `bits` bits that goes on beyond them.
#[derive(Debug)]
pub(super) struct Counter {
    bits: u32,
    last: Option<u64>,
}

impl Counter {
    pub(super) fn of(bits: u32) -> Counter {
        Counter { bits, last: None }
    }

    /// Value beyond the counter's own range. What lies less than half of the range ahead has gone on, what lies
    /// further has come late, or begun anew.
    pub(super) fn goes_on(&mut self, count: u64) -> u64 {
        let range = 1u64 << self.bits.min(63);
        let value = match self.last {
            None => count,
            Some(last) => {
                let ahead = count.wrapping_sub(last) % range;
                match ahead < range / 2 {
                    true => last.saturating_add(ahead),
                    false => last.saturating_sub(range - ahead),
                }
            }
        };
        self.last = Some(value);
        value
    }
}

/// Numbers of packets.
#[derive(Debug, Default)]
pub(super) struct Packets {
    next: Option<u16>,
}

impl Packets {
    /// Number of packets that are missing before this one; of one that comes late, twice or after a restart, none.
    pub(super) fn missing(&mut self, number: u16) -> u64 {
        let missing = self.next.map_or(0, |next| number.wrapping_sub(next));
        if missing > u16::MAX / 2 {
            // Late: the one that is expected stays so, unless the count began anew.
            if missing < u16::MAX - 64 {
                self.next = Some(number.wrapping_add(1));
            }
            return 0;
        }
        self.next = Some(number.wrapping_add(1));
        match missing {
            // Nobody loses so many at once: the device was switched on again.
            8192.. => 0,
            missing => u64::from(missing),
        }
    }
}

/// Largest interval over which a change of velocity is divided, s.
const LONGEST_INTERVAL: f64 = 0.5;

/// Mean specific force of a change of velocity between two instants, ns; `None` where they say no interval.
pub(super) fn mean_force(
    change: [f64; 3],
    before: Option<u64>,
    now: Option<u64>,
) -> Option<[f64; 3]> {
    let nanos = now?.checked_sub(before?)?;
    let secs = nanos as f64 * 1e-9;
    let force = change.map(|v| v / secs);
    // A gap makes of a few milliseconds of velocity nothing.
    let fits = secs > 0.0 && secs < LONGEST_INTERVAL && force.iter().all(|f| f.abs() < 1e3 * G);
    fits.then_some(force)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_that_wraps_goes_on_and_one_that_begins_anew_goes_back() {
        let mut counter = Counter::of(32);
        let mut at = |n| counter.goes_on(n);
        assert_eq!(at(0xffff_fff0), 0xffff_fff0);
        assert_eq!(at(0x10), 0x1_0000_0010);
        assert_eq!(at(0x08), 0x1_0000_0008, "late");
        let mut counter = Counter::of(32);
        assert_eq!([1000, 0].map(|n| counter.goes_on(n)), [1000, 0], "anew");
    }

    #[test]
    fn packets_that_are_missing_are_counted_over_the_wrap() {
        let mut packets = Packets::default();
        let missing = [65_533, 65_535, 2, 1, 3, 3].map(|n| packets.missing(n));
        assert_eq!(missing, [0, 1, 2, 0, 0, 0]);
        // Switched on again.
        assert_eq!(
            [40_000, 40_001, 0, 2].map(|n| packets.missing(n)),
            [0, 0, 0, 1]
        );
    }
}
