//! The lease -> whether attitudes may leave; the outputs -> whether all have. Locks.

use crate::serve::core::hub::Client;
use crate::serve::protocol::chunk::MAX_QUEUED;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::watch;
use tokio::time::timeout_at;

/// Number of waiting pieces above which no more samples are taken.
const CROWDED: usize = MAX_QUEUED / 2;

/// State of the lease: which sensors are ours, and until when.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LeaseState {
    /// Free: a lease is not needed.
    #[default]
    Free,
    /// Others may have them.
    None {
        /// Number of leases before.
        number: u64,
    },
    /// Ours.
    Held {
        /// Number of leases before this one.
        number: u64,
        /// Time from which others may take it, unless it is renewed.
        until: Instant,
    },
}

impl LeaseState {
    /// Tells one tenure from the next.
    #[must_use]
    pub fn number(self) -> u64 {
        match self {
            LeaseState::Free => 0,
            LeaseState::None { number } | LeaseState::Held { number, .. } => number,
        }
    }

    /// Whether attitudes may leave now.
    #[must_use]
    pub fn permits(self, now: Instant) -> bool {
        match self {
            LeaseState::Free => true,
            LeaseState::None { .. } => false,
            LeaseState::Held { until, .. } => now < until,
        }
    }
}

/// Knowledge that the subscription and the outputs of one daemon share.
#[derive(Debug, Default)]
pub struct LeaseWatch {
    tenure: watch::Sender<LeaseState>,
    outputs: Mutex<Vec<Arc<Client>>>,
}

impl LeaseWatch {
    /// State of the lease now.
    #[must_use]
    pub fn now(&self) -> LeaseState {
        *self.tenure.borrow()
    }

    /// Receiver of every change.
    #[must_use]
    pub fn changes(&self) -> watch::Receiver<LeaseState> {
        self.tenure.subscribe()
    }

    /// Changes the state.
    pub fn set(&self, tenure: LeaseState) {
        self.tenure.send_replace(tenure);
    }

    /// Attitudes of this client are published.
    pub fn add(&self, output: &Arc<Client>) {
        self.outputs().push(output.clone());
    }

    fn outputs(&self) -> std::sync::MutexGuard<'_, Vec<Arc<Client>>> {
        // A list is whole after every statement.
        self.outputs.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn most_queued(&self) -> usize {
        let outputs = self.outputs();
        outputs
            .iter()
            .map(|client| client.outbox.level().queued)
            .max()
            .unwrap_or(0)
    }

    /// Whether so much waits to be published that no more samples are to be taken.
    #[must_use]
    pub fn is_crowded(&self) -> bool {
        self.most_queued() > CROWDED
    }

    /// Waits until there is room; `false`: not in this time.
    pub async fn has_room(&self, within: Duration) -> bool {
        self.has_fewer(CROWDED, within).await
    }

    /// Waits until every attitude has left and was stored; `false`: not in this time.
    pub async fn has_published(&self, within: Duration) -> bool {
        self.has_fewer(0, within).await
    }

    async fn has_fewer(&self, queued: usize, within: Duration) -> bool {
        let until = Instant::now() + within;
        loop {
            // Every outbox of a daemon tells the same; made before it is looked, no room goes unnoticed.
            let room = self.outputs().first().map(|c| c.outbox.room().clone());
            let made = room.as_ref().map(|room| room.notified());
            if self.most_queued() <= queued {
                return true;
            }
            let Some(made) = made else { return true };
            if timeout_at(until.into(), made).await.is_err() {
                return self.most_queued() <= queued;
            }
        }
    }

    /// Drops what waits: the sensors are somebody else's.
    pub fn forget(&self) {
        for client in self.outputs().iter() {
            client.outbox.forget();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attitudes_leave_while_the_lease_is_held_and_not_a_moment_longer() {
        let now = Instant::now();
        let until = now + Duration::from_secs(1);
        assert!(LeaseState::Free.permits(now));
        assert!(!LeaseState::None { number: 1 }.permits(now));
        let held = LeaseState::Held { number: 1, until };
        assert!(held.permits(until - Duration::from_nanos(1)));
        assert!(!held.permits(until) && !held.permits(until + Duration::from_secs(9)));
        let tenancy = LeaseWatch::default();
        assert_eq!(tenancy.now(), LeaseState::Free);
        tenancy.set(held);
        assert_eq!(tenancy.now().number(), 1);
    }
}
