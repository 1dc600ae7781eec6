//! The attitudes of all sensors -> the file of the state, again and again. I/O on threads of its own.

use super::Hub;
use crate::serve::core::state::StateFile;
use crate::serve::guard::log_throttle;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::time::MissedTickBehavior;

/// Interval at which it is written.
const EVERY: Duration = Duration::from_millis(500);

impl Hub {
    /// Saves its attitudes again and again, until it is dropped.
    pub async fn keep_saving(self: Arc<Hub>, file: Arc<Mutex<StateFile>>) {
        let mut tick = tokio::time::interval(EVERY);
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tick.tick().await;
            let (file, hub) = (file.clone(), self.clone());
            // A thread of its own for each: the disk may be slow. It can only panic on a bug, which
            // would be printed; the next one tries again.
            let _ = tokio::task::spawn_blocking(move || hub.save(&file)).await;
        }
    }

    /// Saves them once; a failure is said, and is no reason to stop.
    pub fn save(&self, file: &Mutex<StateFile>) {
        let sensors = self.saved();
        let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
        let outcome = file.write(&sensors);
        drop(file);
        if let Err(e) = &outcome {
            log_throttle::warn(
                "state",
                &format!("{e}; a restart would go on from an older attitude"),
            );
        }
        self.state_saved(outcome.err().map(|e| e.to_string()));
    }
}
