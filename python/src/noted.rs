//! Events that the readers of recordings report on the way -> lines. Pure but for the thread it listens on.
//!
//! They say it as events of `tracing`, which the command prints on stderr. Here nobody prints: without this, what
//! they say would be lost.

use std::fmt::{Debug, Write as _};
use std::sync::{Arc, Mutex, PoisonError};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Metadata, Subscriber};

/// Lines that are kept at most.
const MOST: usize = 100;

/// Warnings of one piece of work.
#[derive(Clone, Debug, Default)]
struct Notes(Arc<Mutex<Vec<String>>>);

/// Does `work` on this thread, and gathers what it warns of.
pub fn noted<T>(work: impl FnOnce() -> T) -> (T, Vec<String>) {
    let notes = Notes::default();
    let found = tracing::subscriber::with_default(notes.clone(), work);
    let said = std::mem::take(&mut *notes.0.lock().unwrap_or_else(PoisonError::into_inner));
    (found, said)
}

impl Subscriber for Notes {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.is_event() && *metadata.level() <= Level::WARN
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut line = Line(String::new());
        event.record(&mut line);
        let mut said = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if said.len() < MOST {
            said.push(line.0);
        }
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// The message of an event, and what stands beside it.
struct Line(String);

impl Visit for Line {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        let name = field.name();
        let _ = match name {
            "message" => write!(self.0, "{value:?}"),
            _ => write!(self.0, " {name}={value:?}"),
        };
    }
}
