//! Delay of rates behind an orientation -> what a sample means, and the delay beside that. Pure.
//!
//! Apart from the fit that finds it, which needs samples: the reason for a kind is told by this alone.

use crate::digits::significant;
use crate::record::SampleKind;

/// Sigma of the delay, steps, and distance of the map from one, up to which it tells the kind.
const SURE: f64 = 0.12;
const MAP: f64 = 0.15;
/// Delay, steps, up to which samples are rates, and from which they are means.
const RATES: f64 = 0.2;
const MEANS: f64 = 0.3;
/// Delay beyond that of the kind, in steps and in sigmas, from which it is worth a word.
const WORTH: f64 = 0.1;
const SIGMAS: f64 = 3.0;

/// Delay of the rates behind a recorded orientation.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OrientationLag {
    /// Delay, s.
    pub delay_secs: f64,
    /// One standard deviation of it, s.
    pub sigma_secs: f64,
    /// Ordinary step of the rates, s.
    pub step_secs: f64,
    /// Largest difference of the map between rates and rotations from one.
    pub(super) map_off: f64,
}

impl OrientationLag {
    /// Delay in steps, for people.
    pub(super) fn in_steps(&self) -> String {
        let share = |secs: f64| secs / self.step_secs;
        format!(
            "{:.2} +- {}",
            share(self.delay_secs),
            significant(share(self.sigma_secs).max(0.001), 1)
        )
    }

    /// Kind that it tells, where it is sure enough.
    pub(super) fn kind(&self) -> Option<SampleKind> {
        if !(self.sigma_secs <= SURE * self.step_secs && self.map_off <= MAP) {
            return None;
        }
        match self.delay_secs / self.step_secs {
            share if share.abs() <= RATES => Some(SampleKind::Rate),
            share if share >= MEANS => Some(SampleKind::Average),
            _ => None,
        }
    }

    /// Delay of the sensor's own filter, s: what the kind does not explain, where that is more than its error. Nothing
    /// measures ahead.
    #[must_use]
    pub fn of_filter(&self) -> Option<f64> {
        let own = match self.kind()? {
            SampleKind::Average => 0.5 * self.step_secs,
            _ => 0.0,
        };
        let left = self.delay_secs - own;
        (left > (WORTH * self.step_secs).max(SIGMAS * self.sigma_secs)).then_some(left)
    }
}
