//! What the hub sees -> whoever records it. Pure but for the channel.
//!
//! A recorder must never make a stream wait: the channel is bounded, and what does not fit is
//! counted and shouted.

use crate::record::{AttitudeSample, Nanos, RawSample};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

/// What went through a stream, in its order.
#[derive(Clone, Debug)]
pub enum Tapped {
    /// Samples as they were decoded, before conditioning.
    Samples {
        /// Whose.
        id: Arc<str>,
        /// When their line was received.
        received: Nanos,
        /// The samples.
        samples: Vec<RawSample>,
    },
    /// The attitudes they gave.
    Attitudes {
        /// Whose.
        id: Arc<str>,
        /// Number of the first in its stream.
        first_seq: u64,
        /// The attitudes.
        attitudes: Vec<AttitudeSample>,
    },
}

/// The sending end.
#[derive(Debug)]
pub struct Tap {
    sender: SyncSender<Tapped>,
    lost: AtomicU64,
}

impl Tap {
    /// A tap with room for `batches`, and the end to read from.
    #[must_use]
    pub fn new(batches: usize) -> (Tap, Receiver<Tapped>) {
        let (sender, receiver) = sync_channel(batches);
        let lost = AtomicU64::new(0);
        (Tap { sender, lost }, receiver)
    }

    /// Hands over, or counts as lost when there is no room or nobody reads.
    pub fn send(&self, tapped: Tapped) {
        if let Err(TrySendError::Full(lost) | TrySendError::Disconnected(lost)) =
            self.sender.try_send(tapped)
        {
            let n = match lost {
                Tapped::Samples { samples, .. } => samples.len(),
                Tapped::Attitudes { attitudes, .. } => attitudes.len(),
            };
            self.lost.fetch_add(n as u64, Ordering::Relaxed);
        }
    }

    /// Samples and attitudes that were not recorded.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}
