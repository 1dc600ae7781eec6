//! Position of a run, for whoever shows it. Pure.

/// Position of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Position {
    /// Share of the input done, 0 to 1, where known.
    pub fraction: Option<f64>,
    /// Seconds of data since the first sample.
    pub data_secs: f64,
    /// Samples read.
    pub samples: u64,
    /// Attitudes computed.
    pub written: u64,
    /// Gaps so far.
    pub gaps: u64,
    /// Samples lost so far.
    pub lost: u64,
}
