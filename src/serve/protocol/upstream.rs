//! Messages of a daemon we are connected to about itself. Pure.

use serde::Deserialize;
use strapd_recording::text::printable;

/// Something to know of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// Greeting of a daemon, with the name of its run.
    Greeted(String),
    /// Complaint.
    Complained(String),
    /// We were too slow for so many of what it has.
    Dropped(u64),
}

#[derive(Deserialize)]
struct Said {
    class: String,
    #[serde(default)]
    session: String,
    #[serde(default)]
    code: String,
    #[serde(default)]
    message: String,
    #[serde(default)]
    dropped: u64,
}

/// Reads a line that is no sample; `None` where it means nothing to us.
#[must_use]
pub fn read(line: &[u8]) -> Option<Event> {
    let said: Said = serde_json::from_slice(line).ok()?;
    match said.class.as_str() {
        "VERSION" => Some(Event::Greeted(said.session)),
        "ERROR" => Some(Event::Complained(printable(&format!(
            "{}: {}",
            said.code, said.message
        )))),
        "GAP" => Some(Event::Dropped(said.dropped)),
        _ => None,
    }
}
