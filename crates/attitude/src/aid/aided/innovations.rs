//! Corrections of an aided propagator -> their innovations, for who looks at them. Pure.
//!
//! Apart from the samples' way because they are of one stream, and stay with it where its propagator is gone back to.

use super::super::filter::Innovation;
use super::AidedPropagator;
use crate::record::Nanos;

impl AidedPropagator {
    /// Keeps the innovations of every correction from now on, for [`AidedPropagator::innovations`].
    pub fn keep_innovations(&mut self) {
        self.innovations.get_or_insert_default();
    }

    /// Whether they are kept.
    pub(crate) fn keeps_innovations(&self) -> bool {
        self.innovations.is_some()
    }

    /// Takes the innovations kept since the last call, each with the stamp of the correction.
    pub fn innovations(&mut self) -> Vec<(Nanos, Innovation)> {
        self.innovations
            .as_mut()
            .map(std::mem::take)
            .unwrap_or_default()
    }

    /// The same propagator, which keeps no innovations: those of one that is gone back to are kept already.
    pub(crate) fn checkpoint(&mut self) -> AidedPropagator {
        let kept = self.innovations.take();
        let same = self.clone();
        self.innovations = kept;
        same
    }

    /// Keeps the innovations of the one that this is instead of.
    pub(crate) fn keep_innovations_of(&mut self, before: &mut AidedPropagator) {
        self.innovations = before.innovations.take();
    }
}
