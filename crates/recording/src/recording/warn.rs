//! Warnings about a recording that are no errors -> whoever prints them. Pure.
//!
//! Apart from the readers because they log nothing themselves: a command prints it, a program may gather it.

use std::fmt;
use std::sync::Arc;

/// Receiver of warnings about a recording that can be read all the same.
#[derive(Clone)]
pub struct Warn(Arc<dyn Fn(&str) + Send + Sync>);

impl Warn {
    /// Makes one that calls `say` with each warning as it comes: one line without an end, and lines of help behind it.
    pub fn by(say: impl Fn(&str) + Send + Sync + 'static) -> Warn {
        Warn(Arc::new(say))
    }

    pub(super) fn say(&self, what: &str) {
        (self.0)(what);
    }
}

impl fmt::Debug for Warn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Warn")
    }
}
