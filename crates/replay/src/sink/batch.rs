//! Samples of one stream that are encoded together.

use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};

/// A run of samples of one stream, with what of its past their messages depend on.
#[derive(Debug, Default)]
pub(super) struct Batch {
    pub(super) stream: usize,
    /// Number of the first sample within its stream.
    pub(super) first: u64,
    /// Stamp of the sample before.
    pub(super) previous: Option<Nanos>,
    pub(super) samples: Vec<AttitudeSample>,
    /// Raw samples in their place, for a stream of what a gyro puts out.
    pub(super) raw: Vec<RawSample>,
}

impl Batch {
    pub(super) fn len(&self) -> usize {
        self.samples.len() + self.raw.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
