//! Forms in which a device sends its motion -> the one that is taken. Pure.
//!
//! Apart from the protocols because several devices send rates beside what they integrated themselves, at several
//! frequencies: both together would count the motion twice.

use strapd_attitude::record::SampleKind;

/// Form by its meaning, where the protocol says it, and its numbers in this packet.
pub(super) type Form = (Option<SampleKind>, Option<[f64; 3]>);

/// Choice of a form: the first packet that has any decides, by their order.
#[derive(Debug, Default)]
pub(super) struct Choice {
    taken: Option<usize>,
}

impl Choice {
    /// Numbers of the form that is taken, with their meaning; `None` where this packet has none.
    pub(super) fn of(&mut self, forms: &[Form]) -> Option<([f64; 3], Option<SampleKind>)> {
        let first = || forms.iter().position(|(_, numbers)| numbers.is_some());
        self.taken = self.taken.or_else(first);
        let (kind, numbers) = *forms.get(self.taken?)?;
        Some((numbers?, kind))
    }
}
