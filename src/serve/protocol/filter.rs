//! Filter of a client: which classes of objects, of which streams, how often, in which form.

use std::collections::BTreeSet;
use strapd_recording::decode::packed::Form;

/// Class of a stream's objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Attitudes.
    Att,
    /// Samples of a sensor.
    Rate,
}

impl Class {
    /// Name on the wire.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Class::Att => "ATT",
            Class::Rate => "RATE",
        }
    }
}

/// Request of a client with `WATCH`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Filter {
    /// Classes; `None` = all there are.
    pub classes: Option<BTreeSet<Class>>,
    /// Sensors; `None` = all.
    pub ids: Option<BTreeSet<String>>,
    /// Largest number of attitudes a second of each.
    pub rate_hz: Option<f64>,
    /// Form in which they are written.
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
