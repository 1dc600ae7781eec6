//! What a client watches: which classes of objects, of which streams, how often, in which form.

use std::collections::BTreeSet;
use strapd_recording::decode::packed::Form;

/// What the objects of a stream are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Attitudes.
    Att,
    /// What a sensor put out.
    Rate,
}

impl Class {
    /// Its name on the wire.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Class::Att => "ATT",
            Class::Rate => "RATE",
        }
    }
}

/// What a client asked for with `WATCH`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Filter {
    /// Classes; `None` = all there are.
    pub classes: Option<BTreeSet<Class>>,
    /// Sensors; `None` = all.
    pub ids: Option<BTreeSet<String>>,
    /// At most this many attitudes a second of each.
    pub rate_hz: Option<f64>,
    /// How they are written.
    pub form: Form,
    /// Whether the last attitude of each stream that was not watched before is wanted first.
    pub last: bool,
}

impl Filter {
    /// Whether it wants objects of this class of stream `id`.
    #[must_use]
    pub fn takes(&self, id: &str, class: Class) -> bool {
        self.ids.as_ref().is_none_or(|ids| ids.contains(id))
            && self.classes.as_ref().is_none_or(|c| c.contains(&class))
    }
}
