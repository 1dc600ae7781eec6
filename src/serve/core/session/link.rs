//! Bytes of a link that has no lines -> lines of its samples. Pure but for the log.
//!
//! Apart from the steps because everything behind this is the same for both: names, stamps, who may speak, what is said.

use super::Session;
use crate::serve::guard::log_throttle;

impl Session {
    /// Lines of the samples in these bytes; `None`: the bytes are lines themselves.
    pub(super) fn lines_of_link(&mut self, bytes: &[u8]) -> Option<Vec<u8>> {
        let link = self.link.as_mut()?;
        let (_, before) = link.counts();
        let mut lines = Vec::new();
        link.push(bytes, self.reading.id.as_deref(), &mut lines);
        let (frames, missing) = link.counts();
        if missing > before {
            let peer = &self.client.peer;
            log_throttle::warn(
                &format!("{peer} frames missing"),
                &format!(
                    "{peer}: {missing} frames that the sender has numbered did not come, of {}",
                    frames + missing
                ),
            );
        }
        Some(lines)
    }
}
