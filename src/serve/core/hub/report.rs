//! The state of everything -> `STATUS`, metrics, the file of the last attitudes.

use super::{Client, Hub, SensorStream, TICK, lock, read};
use crate::serve::core::recorder::Handle;
use crate::serve::core::state::Sensors;
use crate::serve::protocol::wire;
use bytes::Bytes;
use std::collections::BTreeSet;
use std::sync::atomic::Ordering;
use std::time::Instant;
use strapd_attitude::estimate::SensorCalibration;

/// Outcome of the last saving of attitudes.
#[derive(Debug)]
pub(super) struct StateStatus {
    saved: Option<Instant>,
    failed: Option<String>,
}

impl Hub {
    /// The state of everything, for `STATUS`.
    #[must_use]
    pub fn status(&self) -> Bytes {
        let sensors: Vec<_> = read(&self.sensors.by_id).values().cloned().collect();
        let sources: Vec<_> = sensors
            .iter()
            .map(|s| lock(s).stream.status())
            .chain(self.own_streams())
            .collect();
        // Who is handed attitudes, not who is about to be.
        let watchers: BTreeSet<u64> = self.watchers().iter().map(|c| c.number).collect();
        let clients: Vec<_> = read(&self.clients.by_number)
            .values()
            .map(|client| {
                let level = client.outbox.level();
                serde_json::json!({
                    "client": client.number, "peer": client.peer.name,
                    "since_s": client.since.elapsed().as_secs_f64(),
                    "watching": watchers.contains(&client.number), "queued_bytes": level.queued,
                    "sent": level.sent, "dropped": level.dropped,
                })
            })
            .collect();
        let outgoing: Vec<_> = self.outgoing.iter().map(|o| o.status()).collect();
        let recording = self.recorder.as_ref().map(Handle::status);
        let counters: serde_json::Map<_, _> = self
            .counters
            .named()
            .map(|counter| (counter.name, counter.value))
            .into_iter()
            .chain([("unrecorded", recording.as_ref().map_or(0, |r| r.unrecorded))])
            .map(|(name, value)| (name.to_owned(), value.into()))
            .collect();
        wire::status(serde_json::json!({
            "session": self.session, "uptime_s": self.uptime_secs(),
            "sources": sources, "refused": self.losses.status(), "places": self.places(), "outgoing": outgoing, "clients": clients, "counters": counters,
            "state": lock(&self.state).as_ref().map(|s| serde_json::json!({
                "saved_s_ago": s.saved.map(|t| t.elapsed().as_secs_f64()), "failed": s.failed,
            })),
            "recording": recording.map(|r| serde_json::json!({
                "file": r.files.last().and_then(|f| f.file_name()).map(|f| f.to_string_lossy()), "files": r.files.len(),
                "bytes": r.bytes, "samples": r.samples, "attitudes": r.attitudes, "stopped": r.stopped,
            })),
        }))
    }

    /// The last attitude of every sensor, also of those that are not there; of these no more than there
    /// may be sensors.
    #[must_use]
    pub fn saved(&self) -> Sensors {
        let sensors: Vec<_> = read(&self.sensors.by_id).values().cloned().collect();
        let mut all: Sensors = sensors
            .iter()
            .filter_map(|sensor| {
                let sensor = lock(sensor);
                let last = sensor.stream.saved().filter(|last| last.check().is_ok())?;
                Some((sensor.stream.id().to_string(), last))
            })
            .collect();
        // One that has come back meanwhile is in both, and the newer counts.
        for (id, saved) in lock(&self.sensors.absent).iter() {
            all.entry(id.clone()).or_insert_with(|| saved.clone());
        }
        all
    }

    /// Calibrations of all sensors that are there, by name.
    #[must_use]
    pub fn calibrations(&self) -> Vec<(String, SensorCalibration)> {
        let mut all = Vec::new();
        self.each_sensor(|stream| {
            let known = stream.calibration(self.sensors.plan_of(stream.id()));
            all.push((stream.id().to_string(), known));
        });
        all
    }

    /// The attitudes were saved, or why not.
    pub(in crate::serve) fn state_saved(&self, failed: Option<String>) {
        let mut state = lock(&self.state);
        let before = state.as_ref().and_then(|s| s.saved);
        let saved = match failed {
            None => Some(Instant::now()),
            Some(_) => before,
        };
        *state = Some(StateStatus { saved, failed });
    }

    /// Troubles in words: what does not go on as was asked.
    #[must_use]
    pub fn troubles(&self) -> Vec<String> {
        let recording = self.recorder.as_ref().map(Handle::status);
        let stopped = recording.and_then(|recording| recording.stopped);
        let failed = lock(&self.state).as_ref().and_then(|s| s.failed.clone());
        let stopped = stopped.map(|why| format!("the recording stopped: {why}"));
        let failed = failed.map(|why| format!("attitudes are not saved: {why}"));
        stopped.into_iter().chain(failed).collect()
    }

    /// Seconds since something of a sensor came, in steps of [`TICK`], by name.
    pub fn each_age(&self, mut tell: impl FnMut(&str, f64)) {
        let sensors: Vec<_> = read(&self.sensors.by_id).values().cloned().collect();
        let now = self.sensors.tick.load(Ordering::Relaxed);
        for sensor in sensors {
            let sensor = lock(&sensor);
            let ticks = now.saturating_sub(sensor.heard_at);
            tell(sensor.stream.id(), ticks as f64 * TICK.as_secs_f64());
        }
    }

    /// Seconds since the start.
    #[must_use]
    pub fn uptime_secs(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Every sensor's report, by name, for the metrics.
    pub fn each_sensor(&self, mut tell: impl FnMut(&SensorStream)) {
        let sensors: Vec<_> = read(&self.sensors.by_id).values().cloned().collect();
        for sensor in sensors {
            tell(&lock(&sensor).stream);
        }
    }

    /// Every client's outbox, for the metrics.
    pub fn each_client(&self, mut tell: impl FnMut(&Client)) {
        for client in read(&self.clients.by_number).values() {
            tell(client);
        }
    }
}
