//! The magnetic fields that were met, and which of them headings are believed in. Pure.

use super::settings::Settings;
use crate::plausible::is_amount;

/// Norm and dip of a field.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Field {
    pub(super) norm: f64,
    /// Downwards from horizontal, rad.
    pub(super) dip: f64,
}

impl Field {
    /// Share of the norm, and angle, by which another differs.
    pub(super) fn off(&self, other: &Field) -> (f64, f64) {
        (other.norm / self.norm - 1.0, other.dip - self.dip)
    }

    pub(super) fn is_like(&self, other: &Field, settings: &Settings) -> bool {
        let (norm, dip) = self.off(other);
        norm.abs() < settings.field_same && dip.abs() < settings.field_same
    }

    pub(super) fn approach(&mut self, other: &Field, share: f64) {
        self.norm += share * (other.norm - self.norm);
        self.dip += share * (other.dip - self.dip);
    }
}

/// History of the field.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Surroundings {
    /// The field that headings are believed in.
    pub(super) reference: Option<Field>,
    /// Another that may be accepted, and for how long it has been the same, s.
    pub(super) other: Option<Field>,
    pub(super) other_secs: f64,
    /// Mean square deviation from the reference.
    pub(super) deviation: f64,
    /// Time for which a good field has shown another heading, s.
    pub(super) contradicted: f64,
    /// Mean norm of what is left of the field without hard iron; 0 before the first.
    pub(super) mean_norm: f64,
}

impl Surroundings {
    /// Whether a field can have been so: what a file says may be anything.
    pub(super) fn is_plausible(&self) -> bool {
        let mut fields = self.reference.iter().chain(&self.other);
        let amounts = [
            self.other_secs,
            self.deviation,
            self.contradicted,
            self.mean_norm,
        ];
        amounts.into_iter().all(is_amount)
            && fields
                .all(|field| field.norm > 0.0 && is_amount(field.norm) && field.dip.abs() <= 4.0)
    }

    /// Mean norm of the field, where hard iron is looked for.
    pub(super) fn mean_norm(&self) -> f64 {
        self.mean_norm
    }
}
