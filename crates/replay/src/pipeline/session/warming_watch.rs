//! Temperatures as they come, and the estimator -> pairs of a temperature and the bias at it. Pure.
//!
//! Apart from the topic because when it looks is its own affair: a second apart, and only once what was received counts.

use crate::summary::warming::Warming;
use nalgebra::Vector3;
use strapd_attitude::estimate::Estimator;
use strapd_attitude::quaternion::BodyRate;
use strapd_attitude::record::{Nanos, RawSample};

/// Time between two looks at the bias and its temperature, ns.
const LOOK: i64 = 1_000_000_000;

/// Looks at the bias and its temperature, a second apart.
#[derive(Debug, Default)]
pub(in crate::pipeline) struct WarmingWatch {
    /// The pairs.
    pub pairs: Warming,
    next: Option<Nanos>,
    is_due: bool,
}

impl WarmingWatch {
    /// Takes note of a temperature that was received. Whether it is time to look.
    pub(super) fn note(&mut self, raw: &RawSample) -> bool {
        if raw.temperature.is_none() || self.next.is_some_and(|next| raw.log < next) {
            return false;
        }
        self.next = Some(Nanos(raw.log.0.saturating_add(LOOK)));
        self.is_due = true;
        true
    }

    /// Looks, where it is time.
    pub(super) fn look(&mut self, estimator: &Estimator, removed: BodyRate) {
        if !std::mem::take(&mut self.is_due) {
            return;
        }
        let Some(temperature) = estimator.temperature() else {
            return;
        };
        let learned = estimator.filter().filter(|filter| filter.is_started());
        let (bias, sigma) = match learned {
            Some(filter) => (filter.calibration().bias, filter.calibration_sigma().bias),
            None => (Vector3::zeros(), Vector3::repeat(f64::INFINITY)),
        };
        self.pairs
            .push(f64::from(temperature), removed.0 + bias, sigma);
    }
}
