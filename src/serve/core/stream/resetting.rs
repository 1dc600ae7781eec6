//! `RESET` of one sensor: remembered until its next sample is there to begin with. Pure.

use super::SensorStream;
use strapd_attitude::estimate::{EstimationSettings, Initial, RestartRequest};
use strapd_attitude::record::RawSample;

/// Reset that was asked of a sensor, and how often.
#[derive(Debug, Default)]
pub(super) struct Resetting {
    /// The next sample begins the attitude anew, so. Of several requests before it the last counts.
    pending: Option<Initial>,
    /// Requests taken.
    pub(super) taken: u64,
}

impl SensorStream {
    /// The attitude begins anew with the next sample, at `initial` or where `plan` says; what was learned of the
    /// sensor is kept. Says where it will begin.
    ///
    /// # Errors
    /// In words: it cannot begin so.
    pub fn reset(
        &mut self,
        plan: &EstimationSettings,
        initial: Option<Initial>,
    ) -> Result<&'static str, String> {
        let asked = initial.unwrap_or(plan.initial);
        let is_aided = self.estimator.filter().is_some();
        let from = match asked {
            Initial::Gravity if !is_aided => {
                return Err("gravity: nothing levels this sensor's attitude (--aid none, or it carries no specific force); identity, q=w,x,y,z or rpy=roll,pitch,yaw".to_owned());
            }
            Initial::Identity | Initial::Gravity if is_aided => "level by the next specific force",
            Initial::Identity | Initial::Gravity => "identity",
            Initial::Given(_) => "as given",
            Initial::FirstOrientation => "the orientation in its next sample",
        };
        self.resetting.pending = Some(asked);
        self.resetting.taken += 1;
        Ok(from)
    }

    /// Resets, if asked, before the sample `next` is integrated.
    pub(super) fn reset_if_asked(&mut self, plan: &EstimationSettings, next: &RawSample) {
        let Some(asked) = self.resetting.pending.take() else {
            return;
        };
        let at = |initial| RestartRequest::at(plan, initial, &self.resolved, &self.prepared, next);
        // Who was promised an orientation and sends none begins as without.
        let Ok(anew) = at(asked).or_else(|_| at(Initial::Identity)) else {
            return;
        };
        self.estimator.begin_anew(&anew);
        self.prepared.initial_origin = format!("{} (RESET)", anew.origin);
    }
}
