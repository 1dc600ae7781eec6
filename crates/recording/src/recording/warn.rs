//! What is to be known of a recording and is no error -> whoever says it. Pure.
//!
//! Apart from the readers because they log nothing themselves: a command prints it, a program may gather it.

use std::fmt;
use std::sync::Arc;

/// Who is told, in words, what to know of a recording that can be read all the same.
#[derive(Clone)]
pub struct Warn(Arc<dyn Fn(&str) + Send + Sync>);

impl Warn {
    /// By calling `say` with each warning as it comes: one line without an end, and lines of help behind it.
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
