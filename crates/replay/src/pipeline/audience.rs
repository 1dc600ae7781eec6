//! Audience that is shown a run while it goes, and may stop and move it.
//!
//! The run knows them only by what they are shown and when: who they are, and over what, is the
//! matter of `serve`, which is built on this and not below it.

use crate::sink::Stream;
use strapd_attitude::estimate::Estimator;
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};

/// Instruction for the next items of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grant {
    /// Number of items that are due.
    pub count: usize,
    /// Whether they are shown; those before a place that was sought are not.
    pub is_shown: bool,
}

/// Audience of a run. Has its pace, where there is one.
pub trait Audience: Send + Sync {
    /// A run with these streams begins.
    fn begin(&self, streams: &[Stream]);

    /// The input is so many seconds long, about.
    fn length(&self, secs: f64);

    /// Waits until the first of `count` items, which are due at `due` of their number, is due. `None`: the
    /// run is to end.
    fn turn(&self, count: usize, due: &dyn Fn(usize) -> Nanos) -> Option<Grant>;

    /// Attitudes of a stream.
    fn attitudes(&self, stream: usize, samples: &[AttitudeSample], is_shown: bool);

    /// Samples of a stream.
    fn samples(&self, stream: usize, samples: &[RawSample], is_shown: bool);

    /// Shows what `estimator` of a stream has taken so far; what came of it was handed over.
    fn known(&self, stream: usize, estimator: &Estimator) {
        let _ = (stream, estimator);
    }

    /// Whether orientations that were recorded are shown beside those that are estimated.
    fn wants_recorded(&self) -> bool {
        false
    }

    /// Recorded orientations of what stream number `of` estimates, as a stream of their own.
    fn recorded(&self, of: usize, stream: &Stream, samples: &[AttitudeSample], is_shown: bool) {
        let _ = (of, stream, samples, is_shown);
    }

    /// Whether the run was told to end before its end.
    fn is_cut(&self) -> bool;
}

// By its name: the vtable of every one of them would hold code that prints all its fields.
impl std::fmt::Debug for dyn Audience {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Audience")
    }
}
