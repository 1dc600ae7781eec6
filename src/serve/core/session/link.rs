//! Bytes of a link that has no lines -> lines of its samples. Pure but for the log.
//!
//! Apart from the steps because everything behind this is the same for both: names, stamps, who may speak, what is said.

use super::Session;
use crate::serve::guard::log_throttle;
use strapd_attitude::record::Nanos;

impl Session {
    /// Lines of the samples in these bytes; `None`: the bytes are lines themselves.
    pub(super) fn lines_of_link(&mut self, bytes: &[u8], received: Nanos) -> Option<Vec<u8>> {
        let link = self.link.as_mut()?;
        let mut lines = Vec::new();
        link.push(bytes, received, self.reading.id.as_deref(), &mut lines);
        let peer = &self.client.peer;
        for note in link.notes() {
            let key = format!("{peer} {}", note.about);
            let text = format!("{peer}: {}", note.text);
            match note.is_warning {
                true => log_throttle::warn(&key, &text),
                false => log_throttle::info(&key, &text),
            }
        }
        Some(lines)
    }
}
