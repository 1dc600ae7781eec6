//! Messages of one topic's channels, in order -> whether the channels are of several publishers. Pure.
//!
//! Apart from who speaks because a run over what comes once asks the same, message by message.

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::hash::{DefaultHasher, Hash, Hasher};

/// A payload in a number: the same payload in two channels was recorded twice.
pub(super) fn digest(payload: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    payload.hash(&mut hasher);
    hasher.finish()
}

/// Recent payloads that are remembered.
const RECENT: usize = 512;
/// Returns to a channel that was left which are no second publisher's: messages that overtook each other
/// where one channel ends and the next begins.
const MOST_RETURNS: u64 = 2;

/// Whether channels of one topic follow each other, as when a recorder was started again, or take turns.
#[derive(Debug, Default)]
pub(super) struct Turns {
    current: Option<usize>,
    left: BTreeSet<usize>,
    returns: u64,
    echoes: u64,
    recent: HashMap<u64, usize>,
    order: VecDeque<u64>,
}

impl Turns {
    /// The next message came on `channel`.
    pub(super) fn take(&mut self, channel: usize, digest: u64) {
        if self.recent.get(&digest).is_some_and(|of| *of != channel) {
            // Two recorders wrote what one publisher sent.
            self.echoes += 1;
        }
        if self.recent.insert(digest, channel).is_none() {
            self.order.push_back(digest);
        }
        if self.order.len() > RECENT
            && let Some(oldest) = self.order.pop_front()
        {
            self.recent.remove(&oldest);
        }
        if let Some(current) = self.current.filter(|current| *current != channel) {
            self.left.insert(current);
            self.returns += u64::from(self.left.contains(&channel));
        }
        self.current = Some(channel);
    }

    /// Whether they are several publishers' channels.
    #[must_use]
    pub(super) fn are_several(&self) -> bool {
        // Each message that is there twice may bring two returns.
        self.returns > MOST_RETURNS + 2 * self.echoes
    }
}
