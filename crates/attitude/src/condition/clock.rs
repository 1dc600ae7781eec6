//! RawSample -> stamp. Pure.
//!
//! A stage of its own because a sample carries up to three clocks, of which any can be absent,
//! zero or standing still, and the choice decides every interval after it.

use crate::diagnostic::Diagnostic;
use crate::record::{Nanos, RawSample};
use crate::setting::{RATE_HZ, TIME};

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
    /// Neither the clock asked for nor the log time advances: only `--time index` can work.
    NoneMoves,
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
            ClockWarning::NoneMoves => {
                return Diagnostic::new(
                    "neither the message stamps nor the log time advance: integration needs time",
                )
                .help(format!("{TIME} index {RATE_HZ} HZ"))
                .coded("clock");
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
    if matches!(requested, Clock::Index { .. }) || prefix.is_empty() {
        return (requested, None);
    }
    let Some(fault) = fault(prefix, requested) else {
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
