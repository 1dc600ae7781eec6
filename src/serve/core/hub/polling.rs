//! `POLL` of many clients -> one `STATUS` for all of them. Locks; the task that makes it waits between two.
//!
//! With a thousand sensors it takes milliseconds to make and is half a megabyte: made for each who
//! asks, a few lines from anybody would keep every thread of the daemon for seconds. It is made
//! after the last of those was asked for whom it answers, so that everybody finds in it what he sent
//! before he asked.

use super::{Client, Hub, lock};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::{Mutex as Turns, MutexGuard, Notify};

/// Time between two of them.
const BETWEEN: Duration = Duration::from_millis(100);

/// Clients that wait to be told.
#[derive(Debug, Default)]
pub(super) struct Polling {
    waiting: Mutex<Vec<Arc<Client>>>,
    asked: Notify,
    /// Whoever asks for one thing after another has his turn here, with all who do.
    turns: Turns<()>,
}

impl Hub {
    /// A client asks for the state. `false`: its last question is not answered yet, and this one is
    /// not taken.
    pub fn poll(&self, client: &Arc<Client>) -> bool {
        if !client.outbox.ask() {
            return false;
        }
        lock(&self.polling.waiting).push(client.clone());
        self.polling.asked.notify_one();
        true
    }

    /// Answers all who have asked. Says whether there was one.
    pub fn answer_polls(&self) -> bool {
        let waiting = std::mem::take(&mut *lock(&self.polling.waiting));
        if waiting.is_empty() {
            return false;
        }
        let status = self.status();
        for client in &waiting {
            client.outbox.answer(status.clone());
        }
        true
    }

    /// Answers whoever asks, again and again, until it is dropped.
    pub(in crate::serve) async fn keep_answering(self: Arc<Hub>) {
        loop {
            self.polling.asked.notified().await;
            let hub = self.clone();
            // Made on a thread of its own: those of the runtime go on. It can only panic on a bug, which
            // would be printed; those who wait then wait for the next.
            let did = tokio::task::spawn_blocking(move || hub.answer_polls()).await;
            if did.unwrap_or(true) {
                tokio::time::sleep(BETWEEN).await;
            }
        }
    }

    /// The turn of a client at its next step. One that is `asking` (the step before was a request) has it
    /// after all others that do, wherever they are connected: a hundred that ask as fast as they can take
    /// the time of one.
    pub(in crate::serve) async fn turn(&self, asking: bool) -> Option<MutexGuard<'_, ()>> {
        match asking {
            true => Some(self.polling.turns.lock().await),
            false => None,
        }
    }
}
