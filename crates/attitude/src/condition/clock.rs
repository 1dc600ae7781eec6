//! RawSample -> stamp. Pure.
//!
//! A stage of its own because a sample carries up to three clocks, of which any can be absent,
//! zero or standing still, and the choice decides every interval after it.

mod arrivals;
mod batch_line;
mod batches;
mod coarse;
mod line;
mod live_batches;
mod speed;
mod steps;
mod unwrap;

pub use arrivals::{ArrivalClock, ArrivalReport, MOST_ARRIVALS};
pub(super) use batch_line::BatchLine;
pub use batches::{BatchRate, Batches, batches};
pub use coarse::{CoarseClock, Sharing, sharing};
pub(super) use live_batches::BatchLearner;
pub use speed::{ClockSpeed, SpeedPass, SpeedVerdict};
pub(super) use steps::ClockSteps;
pub use unwrap::Period;
pub(super) use unwrap::Turns;

use super::repairs::StampRepair;
use crate::diagnostic::Diagnostic;
use crate::record::{Nanos, RawSample};
use crate::setting::{COLUMNS, FIELD, RATE_HZ, TIME};

/// Clock of a sample that is believed (`--time`).
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Clock {
    /// The stamp inside the message.
    #[default]
    Header,
    /// Time at which the recorder received it.
    Log,
    /// Time at which the publisher sent it.
    Publish,
    /// Counter: the n-th sample is n periods after the first one's log time.
    Index {
        /// Samples per second.
        rate_hz: f64,
    },
}

impl Clock {
    /// The name used by `--time`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Clock::Header => "header",
            Clock::Log => "log",
            Clock::Publish => "publish",
            Clock::Index { .. } => "index",
        }
    }

    /// Stamp of this clock, or `None` where the message has none. [`Clock::Index`] reads no stamp.
    #[must_use]
    pub fn read(self, raw: &RawSample) -> Option<Nanos> {
        match self {
            Clock::Header => raw.header,
            Clock::Log => Some(raw.log),
            Clock::Publish => Some(raw.publish),
            Clock::Index { .. } => None,
        }
    }
}

/// Why the clock asked for cannot be used, or why no clock can.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ClockWarning {
    /// The messages carry no such stamp.
    Absent {
        /// Name of the clock: `header` or `publish`.
        clock: &'static str,
    },
    /// All stamps are zero.
    Zero {
        /// Name of the clock.
        clock: &'static str,
        /// Number of samples looked at.
        looked_at: usize,
    },
    /// All stamps are the same, and not zero.
    StandsStill {
        /// Name of the clock.
        clock: &'static str,
        /// The value they all have.
        at: Nanos,
        /// Number of samples looked at.
        looked_at: usize,
    },
    /// The clock stands still, or counts in another unit, by the recorder's: no gyro samples so fast, or so slowly.
    Speed {
        /// Name of the clock.
        clock: &'static str,
        /// Speed of the clock.
        found: SpeedFault,
    },
    /// Neither the clock asked for nor the log time advances: only `--time index` can work.
    NoneMoves,
}

impl ClockWarning {
    /// Code of what is said where no clock moves at all.
    pub const NO_CLOCK: &str = "no-clock";
}

impl From<&ClockWarning> for Diagnostic {
    fn from(error: &ClockWarning) -> Diagnostic {
        let what = match error {
            ClockWarning::Absent { clock } => {
                format!("the messages carry no {clock} stamp: using the log time")
            }
            ClockWarning::Zero { clock, looked_at } => {
                format!("{looked_at} of {looked_at} {clock} stamps are 0: using the log time")
            }
            ClockWarning::StandsStill {
                clock,
                at,
                looked_at,
            } => format!(
                "{looked_at} of {looked_at} {clock} stamps are {} ns: that clock stands still, using the log time",
                at.0
            ),
            ClockWarning::Speed { clock, found } => {
                format!("{clock} stamps {found}: using the log time")
            }
            ClockWarning::NoneMoves => {
                return Diagnostic::new(
                    "neither the message stamps nor the log time advance: integration needs time",
                )
                .help(format!(
                    "{TIME} index {RATE_HZ} HZ, or where the time stands: {COLUMNS} stamp=NAME:UNIT of a table, {FIELD} stamp=PATH of a message"
                ))
                .coded(ClockWarning::NO_CLOCK);
            }
        };
        Diagnostic::new(what)
            .help(format!(
                "{TIME} log makes this explicit; {TIME} index {RATE_HZ} HZ for a fixed rate"
            ))
            .coded("clock")
    }
}

impl std::fmt::Display for ClockWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

/// The clock to use for a stream that begins with `prefix` (some hundred samples, or all).
///
/// What was asked for is used when it can be; when its stamps are absent, all zero or all equal
/// the log time takes over and the warning says so. With fewer than two samples nothing can be
/// said about a clock that stands still, only about one that is absent or zero.
#[must_use]
pub fn choose_clock(prefix: &[RawSample], requested: Clock) -> (Clock, Option<ClockWarning>) {
    choose_clock_as(prefix, requested, StampRepair::Auto)
}

/// The same, where stamps as recorded are believed at any speed.
#[must_use]
pub fn choose_clock_as(
    prefix: &[RawSample],
    requested: Clock,
    repair: StampRepair,
) -> (Clock, Option<ClockWarning>) {
    if matches!(requested, Clock::Index { .. }) || prefix.is_empty() {
        return (requested, None);
    }
    let Some(fault) = fault(prefix, requested).or_else(|| match repair {
        StampRepair::Auto => speed_fault(prefix, requested),
        StampRepair::AsRecorded => None,
    }) else {
        return (requested, None);
    };
    let log_fault = self::fault(prefix, Clock::Log);
    if requested == Clock::Log || (prefix.len() > 1 && log_fault.is_some()) {
        // A single message stamped 0 everywhere still has an attitude: the initial one.
        let warning = (prefix.len() > 1).then_some(ClockWarning::NoneMoves);
        return (Clock::Log, warning);
    }
    (Clock::Log, Some(fault))
}

/// Speed at which a stamp clock cannot be that of a sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SpeedFault {
    /// Nanoseconds in a second of the recorder's clock.
    pub nanos_a_second: i64,
    /// Whether it is a clock in another unit, not one that stands still.
    pub is_unit: bool,
}

impl std::fmt::Display for SpeedFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let secs = self.nanos_a_second as f64 * 1e-9;
        match (self.is_unit, self.nanos_a_second < 1_000_000_000) {
            (false, _) => write!(
                f,
                "advance by {} ns in a second of the recorder's clock: that clock stands still",
                self.nanos_a_second
            ),
            (true, true) => write!(
                f,
                "advance by {secs:.2e} s in a second of the recorder's clock: their unit is {:.0} times larger",
                1.0 / secs.max(1e-9)
            ),
            (true, false) => write!(
                f,
                "advance by {secs:.0} s in a second of the recorder's clock: their unit is {secs:.0} times smaller"
            ),
        }
    }
}

/// A header clock that stands still, or counts in another unit, while the recorder's goes on as a sensor does.
fn speed_fault(prefix: &[RawSample], clock: Clock) -> Option<ClockWarning> {
    if clock != Clock::Header {
        return None;
    }
    let mut pass = SpeedPass::default();
    let stamped = prefix.iter().filter_map(|raw| Some((raw.header?, raw.log)));
    stamped.for_each(|(stamp, log)| pass.push(stamp.0, log.0));
    let found = pass.finish()?;
    let is_unit = match found.verdict {
        SpeedVerdict::Unit => true,
        SpeedVerdict::Frozen => false,
        _ => return None,
    };
    Some(ClockWarning::Speed {
        clock: clock.name(),
        found: SpeedFault {
            nanos_a_second: (found.speed * 1e9).round() as i64,
            is_unit,
        },
    })
}

fn fault(prefix: &[RawSample], clock: Clock) -> Option<ClockWarning> {
    let name = clock.name();
    let looked_at = prefix.len();
    let mut stamps = prefix.iter().filter_map(|raw| clock.read(raw));
    let Some(first) = stamps.next() else {
        return Some(ClockWarning::Absent { clock: name });
    };
    let mut found = 1;
    for stamp in stamps {
        if stamp != first {
            return None;
        }
        found += 1;
    }
    match first {
        Nanos(0) => Some(ClockWarning::Zero {
            clock: name,
            looked_at,
        }),
        // Two equal stamps are a repeat; three and no other are a clock that stands still.
        at if found > 2 => Some(ClockWarning::StandsStill {
            clock: name,
            at,
            looked_at,
        }),
        _ => None,
    }
}

/// Stamps for [`Clock::Index`]: `base + n * period`, exact to half a nanosecond at any n.
#[derive(Clone, Debug)]
pub(super) struct IndexClock {
    whole: i64,
    fraction: f64,
    base: Option<Nanos>,
}

impl IndexClock {
    pub(super) fn new(rate_hz: f64) -> Self {
        let period = 1e9 / rate_hz;
        IndexClock {
            whole: period as i64,
            // Kept apart so that n * period does not lose its nanoseconds to 53 bits.
            fraction: period.fract(),
            base: None,
        }
    }

    /// Time at which the first sample was received.
    pub(super) fn base(&self) -> Option<Nanos> {
        self.base
    }

    /// The first sample was received at `base`.
    pub(super) fn count_from(&mut self, base: Nanos) {
        self.base = Some(base);
    }

    pub(super) fn stamp(&mut self, index: u64, log: Nanos) -> Nanos {
        let n = i64::try_from(index).unwrap_or(i64::MAX);
        let base = *self.base.get_or_insert(log);
        let after = n
            .saturating_mul(self.whole)
            .saturating_add((n as f64 * self.fraction).round() as i64);
        Nanos(base.0.saturating_add(after))
    }
}

#[cfg(test)]
mod stream_tests;

#[cfg(test)]
mod tests {
    use super::*;

    fn prefix(header: impl Fn(i64) -> i64) -> Vec<RawSample> {
        let t0 = 1_650_000_000_000_000_000;
        (0..512)
            .map(|i| RawSample {
                header: Some(Nanos(header(i * 5_000_000))),
                log: Nanos(t0 + i * 5_000_000 + i % 7 * 300_000),
                ..RawSample::default()
            })
            .collect()
    }

    #[test]
    fn stamps_that_no_sensor_has_give_way_to_the_log_time() {
        // Seconds that stay, nanoseconds that count seconds; microseconds, and picoseconds, for nanoseconds.
        type Warp = fn(i64) -> i64;
        let cases: [(Warp, &str); 3] = [
            (|t| 1_751_654_798 + t / 1_000_000_000 * 1000, "stands still"),
            (|t| 7_000_000 + t / 1000, "1000 times larger"),
            (|t| 7_000_000 + t * 1000, "1000 times smaller"),
        ];
        for (header, expected) in cases {
            let (clock, warning) = choose_clock(&prefix(header), Clock::Header);
            assert_eq!(clock, Clock::Log);
            let said = warning.map(|w| w.to_string()).unwrap_or_default();
            assert!(said.contains(expected), "{said}");
        }
        let (clock, warning) = choose_clock(&prefix(|t| t + t / 50), Clock::Header);
        assert_eq!((clock, warning), (Clock::Header, None));
    }
}
