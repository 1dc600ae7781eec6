//! Packed attitudes -> what their lines would say. Pure.
//!
//! A line `PACKED` names the stream of a number once; nothing in either is believed unseen.

use serde::Deserialize;
use std::collections::BTreeMap;
use strapd_attitude::record::{Nanos, Status};
use strapd_recording::attitude_line::Attitude;
use strapd_recording::decode::packed::{self, Object};
use strapd_recording::text::printable;

/// Numbers that are remembered: as many as a daemon may have sensors.
const MOST: usize = 100_000;

/// Labels of the numbers in a daemon's packed attitudes.
#[derive(Debug, Default)]
pub(super) struct Numbers(BTreeMap<u32, Labels>);

#[derive(Debug, Deserialize)]
struct Labels {
    stream: u32,
    #[serde(default)]
    id: String,
    #[serde(default)]
    world: String,
    #[serde(default)]
    body: String,
}

impl Numbers {
    /// Learns from this line what a number holds from now on.
    ///
    /// # Errors
    /// In words: it says nothing of one, or there are too many.
    pub(super) fn learn(&mut self, line: &[u8]) -> Result<(), String> {
        let labels: Labels = serde_json::from_slice(line)
            .map_err(|e| printable(&format!("a PACKED line that names no stream: {e}")))?;
        if self.0.len() >= MOST && !self.0.contains_key(&labels.stream) {
            return Err(format!("more than {MOST} packed streams"));
        }
        let harmless = Labels {
            stream: labels.stream,
            id: printable(&labels.id),
            world: printable(&labels.world),
            body: printable(&labels.body),
        };
        self.0.insert(labels.stream, harmless);
        Ok(())
    }

    /// The attitude of an object.
    ///
    /// # Errors
    /// In words: it is none, or no line has named its number.
    pub(super) fn attitude(&self, object: &[u8]) -> Result<Attitude, String> {
        let read = packed::read(object, Nanos(0)).map_err(|why| why.to_string())?;
        let Object::Att { stream, attitude } = read else {
            return Err("a packed sample, which nobody asked for; skipped".to_owned());
        };
        let labels = self.0.get(&stream);
        let labels = labels.ok_or_else(|| {
            format!("a packed attitude of number {stream}, which no PACKED line has named")
        })?;
        // Two bytes of the four mean something.
        let mut status: Vec<_> = Status(attitude.status as u16)
            .names()
            .map(str::to_owned)
            .collect();
        if status.is_empty() {
            status.push("ok".to_owned());
        }
        Ok(Attitude {
            id: labels.id.clone(),
            seq: attitude.seq,
            stamp: Some(attitude.stamp),
            q: attitude.q,
            rate: attitude.rate,
            sigma_deg: attitude.sigma_deg,
            status,
            reset: attitude.reset.into(),
            world: labels.world.clone(),
            body: labels.body.clone(),
        })
    }
}
