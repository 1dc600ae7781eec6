//! State of an estimator -> another one that goes on exactly. Pure.
//!
//! Apart from the estimator because a file may say anything: what can be is judged here, what fits there.

use super::sample_kind::{KindChoice, KindReason};
use crate::record::{Nanos, SampleKind};
use crate::{aid, condition, propagate};

/// State of an estimator at one moment: a few kilobytes of text.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Memory {
    pub(super) settings: u64,
    pub(super) conditioning: condition::Memory,
    pub(super) propagation: propagate::Memory,
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    pub(super) aiding: Option<aid::Memory>,
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    pub(super) force_scale: Option<f64>,
    /// Kind of the samples and the ordinary step, ns, where nothing but that tells it.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    pub(super) sample_kind: Option<(SampleKind, i64)>,
}

impl Memory {
    /// The last stamp that was used.
    #[must_use]
    pub fn last(&self) -> Option<Nanos> {
        self.conditioning.last()
    }

    /// Whether an estimator can have known it, whatever its settings: a file may say anything.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        let scale = self.force_scale.unwrap_or(1.0);
        self.conditioning.is_plausible()
            && self.propagation.is_plausible()
            && self.aiding.as_ref().is_none_or(aid::Memory::is_plausible)
            && scale.is_finite()
            && scale > 0.0
    }

    /// Kind of the samples, where nothing but their steps told it.
    #[must_use]
    pub fn sample_kind(&self) -> Option<KindChoice> {
        let (kind, step) = self.sample_kind?;
        let reason = KindReason::Step(step);
        Some(KindChoice { kind, reason })
    }

    /// Whether specific forces came in messages of their own.
    #[must_use]
    pub fn has_forces_beside(&self) -> bool {
        self.aiding
            .as_ref()
            .is_some_and(aid::Memory::has_forces_beside)
    }
}
