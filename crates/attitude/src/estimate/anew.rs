//! A stream that goes on -> the attitude it begins anew with, when it is asked to. Pure.
//!
//! Apart from the preparation because nothing else is decided anew: clock, bias, world and what corrects the
//! attitude stay as they are.

use super::aiding;
use super::meaning::Meaning;
use super::plan::{EstimationSettings, Initial};
use super::preparation::{Prepared, decide_initial, learned_on_the_way};
use crate::aid::Start;
use crate::condition::stillness::Rests;
use crate::diagnostic::Diagnostic;
use crate::frames::{Body, Nav};
use crate::quaternion::Quaternion;
use crate::record::RawSample;
use crate::setting::AID;

/// Attitude with which a stream that goes on begins again.
#[derive(Clone, Debug)]
pub struct RestartRequest {
    /// q_nb at the next sample, ENU (or start) and FLU.
    pub attitude: Quaternion<Nav, Body>,
    /// Knowledge of it.
    pub start: Start,
    /// Origin.
    pub origin: String,
}

impl RestartRequest {
    /// The attitude `initial` at the sample `next` of a stream that was understood as `resolved` and begun as
    /// `prepared`, live: gravity is the next specific force.
    ///
    /// # Errors
    /// In words: nothing levels the attitude, or the sample carries no orientation.
    pub fn at(
        plan: &EstimationSettings,
        initial: Initial,
        resolved: &Meaning,
        prepared: &Prepared,
        next: &RawSample,
    ) -> Result<RestartRequest, Diagnostic> {
        let aiding = prepared.aiding.as_ref();
        if initial == Initial::Gravity && aiding.is_none() {
            return Err(
                Diagnostic::new(format!(
                    "gravity: nothing levels this sensor's attitude ({AID} none, or it carries no specific force)"
                ))
                .help(
                    "identity, q=w,x,y,z or rpy=roll,pitch,yaw",
                )
            );
        }
        let plan = learned_on_the_way(&EstimationSettings {
            initial,
            ..plan.clone()
        });
        let (attitude, origin, _) = decide_initial(
            (&plan, aiding),
            resolved,
            std::slice::from_ref(next),
            &Rests::default(),
            &mut Vec::new(),
        )?;
        let has_field = aiding.is_some_and(|aiding| aiding.settings.has_field);
        Ok(RestartRequest {
            attitude,
            start: aiding::start(plan.initial, has_field),
            origin,
        })
    }
}
