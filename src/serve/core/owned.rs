//! The sensors one client sends -> the hub, run by run. Pure but for locks.
//!
//! The hub alone keeps a sensor: one that was put away is gone, and whoever sends it asks for a place again.

use super::hub::{Client, Feedback, Hub, Sensor, count};
use super::stream::run::SampleRun;
use crate::serve::guard::fault::{Fault, Kind};
use crate::serve::guard::log_throttle;
use crate::serve::guard::losses::Lost;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, Weak};

/// Number above which it is looked now and then which are there still.
const MANY: usize = 64;

/// The sensors of one client.
#[derive(Debug, Default)]
pub struct Owned {
    sensors: BTreeMap<String, Weak<Mutex<Sensor>>>,
    /// Number at the last look.
    looked: usize,
    /// The one that was sent last.
    last: Option<Weak<Mutex<Sensor>>>,
    /// Some of its samples were taken.
    has_sent: bool,
}

impl Owned {
    /// Gives a run to its sensor, which is begun by its first sample and goes on when it was put away. What became
    /// of it is counted, and stands in the log.
    ///
    /// # Errors
    /// The fault to answer with; none of the samples was used.
    pub fn publish(
        &mut self,
        hub: &Hub,
        client: &Client,
        run: &SampleRun<'_>,
        text: &mut Vec<u8>,
    ) -> Result<Feedback, Fault> {
        let news = self.hand_over_again(hub, client, run, text);
        match &news {
            Ok(feedback) => {
                self.has_sent = true;
                hub.losses.over(&client.peer.name);
                if let Some(note) = &feedback.note {
                    let id = run.id();
                    log_throttle::info(&format!("run {id}"), &format!("{id}: {}", note.message));
                }
            }
            Err(fault) => {
                count(&hub.counters.refused_samples, run.samples.len());
                hub.losses.add(&Lost {
                    source: run.id(),
                    fault,
                    first: run.first,
                    count: run.samples.len() as u64,
                    // Another may send it as it should.
                    is_whole: fault.kind != Kind::InUse,
                });
            }
        }
        news
    }

    /// Whether some of its samples were taken.
    #[must_use]
    pub fn has_sent(&self) -> bool {
        self.has_sent
    }

    /// Hands a run over, and once more when its sensor was put away just then.
    fn hand_over_again(
        &mut self,
        hub: &Hub,
        client: &Client,
        run: &SampleRun<'_>,
        text: &mut Vec<u8>,
    ) -> Result<Feedback, Fault> {
        let id = run.id();
        let news = self.hand_over(hub, client, run, text);
        if !matches!(&news, Err(fault) if fault.kind == Kind::GaveWay) {
            return news;
        }
        self.drop_one(id, client);
        let news = self.hand_over(hub, client, run, text);
        if matches!(&news, Err(fault) if fault.kind == Kind::GaveWay) {
            self.drop_one(id, client);
        }
        news
    }

    fn hand_over(
        &mut self,
        hub: &Hub,
        client: &Client,
        run: &SampleRun<'_>,
        text: &mut Vec<u8>,
    ) -> Result<Feedback, Fault> {
        self.last = None;
        let id = run.id();
        let known = self.sensors.get(id).map(Weak::upgrade);
        let sensor = match known {
            Some(Some(sensor)) => sensor,
            other => {
                if other.is_some() {
                    self.drop_one(id, client);
                }
                self.drop_absent(client);
                let sensor = hub.sensor(id, client, run)?;
                self.sensors.insert(id.to_owned(), Arc::downgrade(&sensor));
                sensor
            }
        };
        let news = hub.publish(&sensor, run, text)?;
        self.last = Some(Arc::downgrade(&sensor));
        Ok(news)
    }

    fn drop_one(&mut self, id: &str, client: &Client) {
        if self.sensors.remove(id).is_some() {
            client.let_go();
        }
    }

    /// Drops the names of those that were put away, so that a client that sends ever new sensors keeps none.
    fn drop_absent(&mut self, client: &Client) {
        if self.sensors.len() < MANY.max(2 * self.looked) {
            return;
        }
        self.sensors.retain(|_, sensor| {
            let is_there = sensor.strong_count() > 0;
            if !is_there {
                client.let_go();
            }
            is_there
        });
        self.looked = self.sensors.len();
    }

    /// A line that could not be read stood behind the last samples.
    pub fn undecodable(&self, hub: &Hub, client: &Client) {
        if let Some(sensor) = self.last.as_ref().and_then(Weak::upgrade) {
            hub.undecodable(&sensor, client.number);
        }
    }

    /// A message of this sensor could not be read; one that never sent any is none yet.
    pub fn undecodable_of(&self, id: &str, hub: &Hub, client: &Client) {
        if let Some(sensor) = self.sensors.get(id).and_then(Weak::upgrade) {
            hub.undecodable(&sensor, client.number);
        }
    }

    /// Ids.
    #[cfg(feature = "nats")]
    pub fn ids(&self) -> impl Iterator<Item = &String> {
        self.sensors.keys()
    }

    /// The client sends nothing more, but may still watch; others may send its sensors.
    pub fn give_back(&mut self, hub: &Hub, client: &Client) {
        hub.give_back(client, &self.take_all(client));
    }

    /// The client has gone; others may send them.
    pub fn leave(&mut self, hub: &Hub, client: &Client) {
        hub.leave(client, &self.take_all(client));
    }

    fn take_all(&mut self, client: &Client) -> Vec<Arc<Mutex<Sensor>>> {
        self.last = None;
        let all = std::mem::take(&mut self.sensors);
        all.values().for_each(|_| client.let_go());
        all.values().filter_map(Weak::upgrade).collect()
    }
}
