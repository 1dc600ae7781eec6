//! Counts since the start. Pure but for the log.

use super::Hub;
use crate::serve::guard::fault::Fault;
use crate::serve::guard::log_throttle;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// The time between two warnings that somebody found no place.
const MINUTE: Duration = Duration::from_secs(60);

/// Totals since the start.
#[derive(Debug, Default)]
pub struct Counters {
    /// Connections accepted.
    pub accepted: AtomicU64,
    /// Connections refused: too many, or not allowed.
    pub refused: AtomicU64,
    /// Failed accepts.
    pub accept_failures: AtomicU64,
    /// Connections closed by us for what they did or did not do.
    pub closed: AtomicU64,
    /// Lines and packed objects received.
    pub lines: AtomicU64,
    /// Lines before the first sample of a connection that were skipped.
    pub skipped_lines: AtomicU64,
    /// Bytes received.
    pub bytes_in: AtomicU64,
    /// Bytes sent.
    pub bytes_out: AtomicU64,
    /// Lines and packed objects answered with an error, said or suppressed.
    pub faults: AtomicU64,
    /// Samples received.
    pub samples: AtomicU64,
    /// Samples refused before any estimator saw them.
    pub refused_samples: AtomicU64,
    /// Sensors whose place went to another.
    pub gave_way: AtomicU64,
    /// Sensors that were silent for too long.
    pub forgotten: AtomicU64,
    /// Attitudes begun anew because somebody asked.
    pub resets: AtomicU64,
    /// Number of such requests that were refused.
    pub refused_resets: AtomicU64,
    /// Headings from outside that were taken.
    pub headings: AtomicU64,
    /// Number of those that were refused.
    pub refused_headings: AtomicU64,
    /// Attitudes made.
    pub attitudes: AtomicU64,
}

impl Hub {
    /// Counts somebody who found no place, and says so in the log, once a minute with their number.
    pub fn turned_away(&self, fault: &Fault) {
        count(&self.counters.refused, 1);
        log_throttle::warn_every(
            MINUTE,
            &fault.message,
            &format!("a client was turned away: {}", fault.message),
        );
    }
}

impl Counters {
    /// Each, in a fixed order.
    #[must_use]
    pub fn named(&self) -> [Counter; 18] {
        let counter = |name, counts, n: &AtomicU64| Counter {
            name,
            counts,
            value: n.load(Ordering::Relaxed),
        };
        [
            counter(
                "connections_accepted",
                "Connections that got a place, those of plain HTTP among them.",
                &self.accepted,
            ),
            counter(
                "connections_refused",
                "Connections and requests turned away: no place, a foreign Host or Origin, a post from a page, a wrong token; and datagrams of more senders than may be.",
                &self.refused,
            ),
            counter(
                "accept_failures",
                "Attempts to accept a connection that failed, mostly for want of open files.",
                &self.accept_failures,
            ),
            counter(
                "connections_closed",
                "Connections, but none of plain HTTP, that the daemon closed for what they did or did not do.",
                &self.closed,
            ),
            counter(
                "lines",
                "Lines, packed objects, posted objects and viewers' messages received, blank and bad ones among them.",
                &self.lines,
            ),
            counter(
                "lines_skipped",
                "Lines before the first sample of a connection, or the header of its table, that were skipped.",
                &self.skipped_lines,
            ),
            counter(
                "bytes_in",
                "Bytes of lines, datagrams, messages and posted objects received.",
                &self.bytes_in,
            ),
            counter(
                "bytes_out",
                "Bytes of lines, datagrams and messages sent; no answers to plain HTTP.",
                &self.bytes_out,
            ),
            counter(
                "faults",
                "Errors, said or thinned out: of lines and objects, of what was asked for, and the first of each kind of every sensor's samples.",
                &self.faults,
            ),
            counter(
                "samples",
                "Samples given to the estimators, which may have rejected some: see sensor_samples_total.",
                &self.samples,
            ),
            counter(
                "samples_refused",
                "Samples no estimator was given: of another's sensor, of one too many, with another meaning than before, or where none are taken.",
                &self.refused_samples,
            ),
            counter(
                "sensors_gave_way",
                "Sensors that nobody sent and whose place another took; they go on from there when they come back.",
                &self.gave_way,
            ),
            counter(
                "sensors_forgotten",
                "Sensors that were silent for longer than --forget-after; they go on from there when they come back.",
                &self.forgotten,
            ),
            counter("resets", "RESET requests taken.", &self.resets),
            counter(
                "resets_refused",
                "RESET requests refused: of another's sensor, of none there is, or to an attitude that cannot be.",
                &self.refused_resets,
            ),
            counter("headings", "Headings from outside taken.", &self.headings),
            counter(
                "headings_refused",
                "Headings from outside refused: no such sensor, or none that can use one, or measured by another connection.",
                &self.refused_headings,
            ),
            counter(
                "attitudes",
                "Attitudes made, watched or not.",
                &self.attitudes,
            ),
        ]
    }
}

/// A total as it is told.
#[derive(Clone, Copy, Debug)]
pub struct Counter {
    /// Name.
    pub name: &'static str,
    /// Description of what is counted, a sentence.
    pub counts: &'static str,
    /// Count.
    pub value: u64,
}

/// Adds to a counter.
pub fn count(counter: &AtomicU64, n: usize) {
    counter.fetch_add(n as u64, Ordering::Relaxed);
}
