//! RateSample of a whole recording -> lines through its stamps, or why there are none. Pure.
//!
//! Apart from the regulariser because it is another pass: only behind the last sample it is known where a line holds.

use super::count::{Counted, Counter};
use super::line::{Fitter, Line};
use super::{ENOUGH, TOO_MANY_DOUBTS, TOO_MUCH_JITTER};
use crate::diagnostic::Diagnostic;
use crate::record::{Join, RateSample};
use crate::setting::{RATE_HZ, REGULARISE_STAMPS, TIME};

/// Most segments of one stream: beyond, there is no constant rate. 100,000 are 6 MB.
const MOST_SEGMENTS: usize = 100_000;
/// Samples per changed rate or lost count, below which there is no constant rate: a block of [`line`](super::line).
const TOO_FEW_BETWEEN: u64 = 256;
/// Steps per sample above which the step is not that of the sensor: batches stamped on arrival look like
/// a fast clock with nearly every sample missing.
const TOO_SPARSE: f64 = 4.0;

/// The first pass over a recording: lays lines through its stamps.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    counter: Counter,
    fitter: Fitter,
    counted: Vec<Counted>,
    samples: u64,
    doubts: u64,
    /// Segments begun where conditioning saw no break.
    lost: u64,
    index: i64,
    steps: i64,
}

impl Survey {
    /// A survey of one stream.
    #[must_use]
    pub fn new() -> Survey {
        Survey::default()
    }

    /// Takes the next conditioned sample.
    pub fn push(&mut self, sample: &RateSample) {
        self.counter.push(sample, &mut self.counted);
        self.fit();
    }

    fn fit(&mut self) {
        for counted in self.counted.drain(..) {
            self.samples += 1;
            self.doubts += u64::from(counted.is_doubtful);
            if counted.begins {
                let join = counted.sample.join;
                self.lost += u64::from(matches!(join, Join::Continuous | Join::Bridge));
            } else {
                self.steps = self
                    .steps
                    .saturating_add(counted.index.saturating_sub(self.index));
            }
            self.index = counted.index;
            if self.fitter.lines.len() < MOST_SEGMENTS {
                self.fitter.push(&counted);
            }
        }
    }

    /// The lines.
    ///
    /// # Errors
    /// [`Uneven`] where there is no constant rate to be found.
    pub fn finish(mut self) -> Result<Lines, Uneven> {
        self.counter.close(&mut self.counted);
        self.fit();
        self.fitter.close();
        let lines = Lines {
            lines: self.fitter.lines,
        };
        let is_restless = self.lost >= 4 && self.lost * TOO_FEW_BETWEEN > self.samples;
        if is_restless || lines.lines.len() >= MOST_SEGMENTS {
            return Err(Uneven::Restless {
                segments: lines.lines.len(),
                samples: self.samples,
            });
        }
        let doubts = self.doubts as f64 / self.samples.max(1) as f64;
        let jitter = lines.jitter();
        if self.samples >= ENOUGH && (jitter > TOO_MUCH_JITTER || doubts > TOO_MANY_DOUBTS) {
            return Err(Uneven::Jitter { jitter, doubts });
        }
        let missing = self.steps as f64 / self.samples.max(1) as f64;
        if self.samples >= ENOUGH && missing > TOO_SPARSE {
            return Err(Uneven::Sparse { steps: missing });
        }
        Ok(lines)
    }
}

/// The lines of one stream, in order.
#[derive(Clone, PartialEq, Debug)]
pub struct Lines {
    pub(super) lines: Vec<Line>,
}

impl Lines {
    /// Number of lines.
    #[must_use]
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// Whether there are none: no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Jitter about all lines: rms over the step.
    #[must_use]
    pub fn jitter(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for line in self.lines.iter().filter(|l| l.step > 0.0) {
            sum += line.rest / (line.step * line.step);
            count += line.samples as f64;
        }
        (sum / f64::max(count, 1.0)).sqrt()
    }

    /// The first line's rate, Hz.
    #[must_use]
    pub fn rate_hz(&self) -> Option<f64> {
        let step = self.lines.iter().map(|l| l.step).find(|step| *step > 0.0)?;
        Some(1e9 / step)
    }
}

/// Why stamps cannot be regularised.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Uneven {
    /// Stamps are so far off even instants that samples cannot be counted by them.
    Jitter {
        /// rms over the step; never much above 0.29, because a stamp further off is not believed.
        jitter: f64,
        /// Part of the samples that could belong to another instant.
        doubts: f64,
    },
    /// The step most samples have is far shorter than their distance.
    Sparse {
        /// Steps per sample.
        steps: f64,
    },
    /// Refusal: no rate holds for long.
    Restless {
        /// Segments found.
        segments: usize,
        /// Number of samples in which they lie.
        samples: u64,
    },
}

impl From<&Uneven> for Diagnostic {
    fn from(error: &Uneven) -> Diagnostic {
        let why = match error {
            Uneven::Jitter { jitter, doubts } => format!(
                "stamps are off even instants by {:.0} % of the step (rms), and {:.1} % of the samples could belong to another instant",
                jitter * 100.0,
                doubts * 100.0
            ),
            Uneven::Sparse { steps } => format!(
                "the commonest step is a {steps:.0}th of the mean one, as where batches are stamped on arrival"
            ),
            Uneven::Restless { segments, samples } => format!(
                "it changes, or samples cannot be counted, {segments} times in {samples} samples"
            ),
        };
        Diagnostic::new(format!("{REGULARISE_STAMPS}: there is no constant rate: {why}"))
            .help(format!(
                "{TIME} index {RATE_HZ} HZ if no sample is missing; {TIME} log if that clock is steadier; else the stamps as they are"
            ))
    }
}

impl std::fmt::Display for Uneven {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for Uneven {}
