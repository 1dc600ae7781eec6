//! `RESET` of one sensor: remembered until its next sample is there to begin with. Pure.

use super::SensorStream;
use crate::serve::protocol::wire::Beginning;
use strapd_attitude::estimate::{EstimationSettings, Initial, RestartRequest};
use strapd_attitude::record::RawSample;

/// Reset that was asked of a sensor, and how often.
#[derive(Debug, Default)]
pub(super) struct Resetting {
    /// The next sample begins the attitude anew, so. Of several requests before it the last counts.
    pending: Option<Asked>,
    /// Requests taken.
    pub(super) taken: u64,
}

/// Beginning that can be kept, and where it is in words.
#[derive(Clone, Copy, Debug)]
pub(in crate::serve::core) struct Promise {
    asked: Asked,
    from: &'static str,
}

/// Beginning that was promised.
#[derive(Clone, Copy, Debug)]
enum Asked {
    /// Attitude and covariance begin anew.
    Attitude(Initial),
    /// The heading begins anew, at that of this attitude.
    Heading(Initial),
}

impl SensorStream {
    /// Judges whether the attitude, or its heading alone, can begin anew with the next sample, where `plan` says if nothing
    /// was said. Nothing changes yet.
    ///
    /// # Errors
    /// In words: it cannot begin so.
    pub(in crate::serve::core) fn judge_reset(
        &self,
        plan: &EstimationSettings,
        beginning: Beginning,
    ) -> Result<Promise, String> {
        let filter = self.estimator.filter();
        let is_level = filter.is_some_and(|filter| filter.is_started());
        let has_field = filter.is_some_and(|filter| filter.has_field());
        let initial = match beginning {
            Beginning::Unsaid => plan.initial,
            Beginning::At(initial) | Beginning::Heading(initial) => initial,
        };
        let is_heading = match beginning {
            Beginning::Heading(_) if filter.is_none() => {
                return Err("heading: no vertical is known of this sensor to turn about (--aid none, or it carries no specific force); `init` with identity, q=w,x,y,z or rpy=roll,pitch,yaw".to_owned());
            }
            Beginning::Heading(_) if has_field => {
                return Err("heading: the magnetic field tells it; without `heading` it is found anew by the field".to_owned());
            }
            Beginning::Heading(_) => true,
            // A moving body is not levelled by one specific force where the tilt is known.
            Beginning::Unsaid => {
                is_level && matches!(initial, Initial::Identity | Initial::Gravity)
            }
            Beginning::At(_) => is_level && initial == Initial::Identity,
        };
        let (asked, from) = match initial {
            initial if is_heading && has_field => (
                Asked::Heading(initial),
                "heading by the next magnetic field, tilt as it is",
            ),
            initial if is_heading => (Asked::Heading(initial), "heading as asked, tilt as it is"),
            Initial::Gravity if filter.is_none() => {
                return Err("gravity: nothing levels this sensor's attitude (--aid none, or it carries no specific force); identity, q=w,x,y,z or rpy=roll,pitch,yaw".to_owned());
            }
            Initial::Identity | Initial::Gravity if filter.is_some() => {
                (Asked::Attitude(initial), "level by the next specific force")
            }
            Initial::Identity | Initial::Gravity => (Asked::Attitude(initial), "identity"),
            Initial::Given(_) => (Asked::Attitude(initial), "as given"),
            Initial::FirstOrientation => (
                Asked::Attitude(initial),
                "the orientation in its next sample",
            ),
        };
        Ok(Promise { asked, from })
    }

    /// The attitude begins so with the next sample; what was learned of the sensor is kept. Says where it will begin.
    pub(in crate::serve::core) fn promise(&mut self, promise: Promise) -> &'static str {
        self.resetting.pending = Some(promise.asked);
        self.resetting.taken += 1;
        promise.from
    }

    /// Resets, if asked, before the sample `next` is integrated.
    pub(super) fn reset_if_asked(&mut self, plan: &EstimationSettings, next: &RawSample) {
        let Some(asked) = self.resetting.pending.take() else {
            return;
        };
        let at = |initial| RestartRequest::at(plan, initial, &self.resolved, &self.prepared, next);
        let (Asked::Attitude(initial) | Asked::Heading(initial)) = asked;
        // Who was promised an orientation and sends none begins as without.
        let Ok(anew) = at(initial).or_else(|_| at(Initial::Identity)) else {
            return;
        };
        self.prepared.initial_origin = match asked {
            Asked::Attitude(_) => {
                self.estimator.begin_anew(&anew);
                format!("{} (RESET)", anew.origin)
            }
            Asked::Heading(_) => {
                let heading = anew.attitude.yaw_pitch_roll().yaw;
                self.estimator.turn_heading(heading);
                "heading alone (RESET)".to_owned()
            }
        };
    }
}
