//! "Up to here" -> durable, on a thread that may wait. I/O.
//!
//! A stage of its own because a sync can take seconds on a busy disk, while chunks go on being written.

use super::Shared;
use std::fs::File;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

/// A file, its number in the recording (from 1), and how much of it there is.
type Request = (Arc<File>, usize, u64);

/// The thread's end.
#[derive(Debug)]
pub(super) struct Syncer {
    sender: Option<SyncSender<Request>>,
    thread: Option<JoinHandle<()>>,
    shared: Arc<Shared>,
}

impl Syncer {
    pub(super) fn start(shared: Arc<Shared>) -> std::io::Result<Syncer> {
        // One waits while one is under way; more would sync the same again.
        let (sender, receiver) = sync_channel::<Request>(1);
        let outcomes = shared.clone();
        let thread = std::thread::Builder::new()
            .name("strapd-sync".to_owned())
            .spawn(move || {
                for (file, number, bytes) in receiver {
                    let outcome = file.sync_data();
                    let mut status = outcomes.status();
                    match outcome {
                        Ok(()) => status.count_sync(number, bytes),
                        Err(e) => {
                            status
                                .stopped
                                .get_or_insert(format!("the disk did not sync: {e}"));
                        }
                    }
                }
            })?;
        Ok(Syncer {
            sender: Some(sender),
            thread: Some(thread),
            shared,
        })
    }

    /// Asks for a sync of the present file; `false` when the last ones are not done.
    pub(super) fn request(&self, file: &Arc<File>, bytes: u64) -> bool {
        let number = self.shared.status().files.len();
        self.sender
            .as_ref()
            .is_some_and(|s| s.try_send((file.clone(), number, bytes)).is_ok())
    }
}

impl Drop for Syncer {
    fn drop(&mut self) {
        self.sender = None;
        if let Some(thread) = self.thread.take() {
            // A panic there has been said by the thread itself.
            let _ = thread.join();
        }
    }
}
