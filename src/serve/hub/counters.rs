//! What happened since the start, in numbers. Pure.

use std::sync::atomic::{AtomicU64, Ordering};

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
    /// Attitudes made.
    pub attitudes: AtomicU64,
}

impl Counters {
    /// Name and value of each, in a fixed order.
    #[must_use]
    pub fn named(&self) -> [(&'static str, u64); 12] {
        let of = |n: &AtomicU64| n.load(Ordering::Relaxed);
        [
            ("connections_accepted", of(&self.accepted)),
            ("connections_refused", of(&self.refused)),
            ("accept_failures", of(&self.accept_failures)),
            ("connections_closed", of(&self.closed)),
            ("lines", of(&self.lines)),
            ("bytes_in", of(&self.bytes_in)),
            ("bytes_out", of(&self.bytes_out)),
            ("faults", of(&self.faults)),
            ("samples", of(&self.samples)),
            ("samples_refused", of(&self.refused_samples)),
            ("sensors_gave_way", of(&self.gave_way)),
            ("attitudes", of(&self.attitudes)),
        ]
    }
}

/// Adds to a counter.
pub fn count(counter: &AtomicU64, n: usize) {
    counter.fetch_add(n as u64, Ordering::Relaxed);
}
