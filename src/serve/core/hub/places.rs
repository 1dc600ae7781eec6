//! Places for sensors: who takes one, and who gives way. Pure but for locks.

use super::{Client, Hub, Sensor, count, lock, read, write};
use crate::serve::core::channel::Channel;
use crate::serve::core::state::{Saved, Sensors};
use crate::serve::core::stream::SensorStream;
use crate::serve::core::stream::run::SampleRun;
use crate::serve::guard::fault::{Fault, Kind};
use crate::serve::guard::peer::Origin;
use crate::serve::protocol::foxglove;
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use strapd_recording::text::printable;

/// The time between two looks for sensors that were silent for too long.
pub const TICK: Duration = Duration::from_millis(250);
/// Sensors whose samples are doubted: those beyond would take 100 kB each for it.
const WATCHED: usize = 1000;
/// Sensors that gave way last, in `STATUS`.
const TOLD: usize = 16;

/// Attitudes of sensors that are not there: not since the start, or no more. As many as there may be
/// sensors; the one that has been in it longest gives way.
#[derive(Debug, Default)]
pub(super) struct Absent {
    sensors: Sensors,
    /// Oldest first.
    order: VecDeque<String>,
}

impl Absent {
    /// Makes it of the sensors from before the start.
    pub(super) fn new(sensors: Sensors) -> Absent {
        Absent {
            order: sensors.keys().cloned().collect(),
            sensors,
        }
    }

    pub(super) fn get(&self, id: &str) -> Option<&Saved> {
        self.sensors.get(id)
    }

    /// Removes a sensor that is there again.
    pub(super) fn remove(&mut self, id: &str) {
        if self.sensors.remove(id).is_some() {
            self.order.retain(|known| known != id);
        }
    }

    fn insert(&mut self, id: &str, saved: Saved, most: usize) {
        self.remove(id);
        while self.sensors.len() >= most
            && let Some(oldest) = self.order.pop_front()
        {
            self.sensors.remove(&oldest);
        }
        self.sensors.insert(id.to_owned(), saved);
        self.order.push_back(id.to_owned());
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (&String, &Saved)> {
        self.sensors.iter()
    }
}

impl Hub {
    /// The sensor a run of `client` is of; begun by its first sample. Where all places are taken, the
    /// sensor that nobody sends and that has been silent longest gives way.
    ///
    /// # Errors
    /// The fault to answer with.
    pub fn sensor(
        &self,
        id: &str,
        client: &Client,
        run: &SampleRun<'_>,
    ) -> Result<Arc<Mutex<Sensor>>, Fault> {
        self.check_share(client)?;
        if let Some(sensor) = read(&self.sensors.by_id).get(id) {
            client.sensors.fetch_add(1, Ordering::Relaxed);
            return Ok(sensor.clone());
        }
        if lock(&self.simulation.truths).contains_key(id) {
            let what = format!(
                "`{}` is what a simulation sends here: a sensor needs another name",
                printable(id)
            );
            return Err(Fault::new("id_in_use", what).of(Kind::InUse));
        }
        let mut sensors = write(&self.sensors.by_id);
        if let Some(sensor) = sensors.get(id) {
            client.sensors.fetch_add(1, Ordering::Relaxed);
            return Ok(sensor.clone());
        }
        if sensors.len() >= self.limits.sensors {
            self.make_room(&mut sensors)?;
        }
        let id: Arc<str> = id.into();
        let last = lock(&self.sensors.absent).get(&id).cloned();
        let stream = SensorStream::new(
            self.sensors.plan_of(&id),
            id.clone(),
            run.head,
            run.samples,
            (last, sensors.len() < WATCHED),
            |labels| self.declare(&self.named(labels)),
        )?;
        lock(&self.sensors.absent).remove(&id);
        if let Some(recorder) = &self.recorder {
            recorder.declare(stream.recorded());
        }
        let sensor = Arc::new(Mutex::new(Sensor {
            stream,
            owner: None,
            heading_by: None,
            heard: self.sensors.heard.fetch_add(1, Ordering::Relaxed),
            heard_at: self.sensors.tick.load(Ordering::Relaxed),
            gave_way: false,
        }));
        sensors.insert(id, sensor.clone());
        client.sensors.fetch_add(1, Ordering::Relaxed);
        Ok(sensor)
    }

    /// Whether a client may send one sensor more.
    fn check_share(&self, client: &Client) -> Result<(), Fault> {
        let refuse = |what: String| Err(Fault::new("too_many_sensors", what));
        if client.is_broker.load(Ordering::Relaxed) {
            return Ok(());
        }
        let most = self.limits.sensors_of_client;
        if client.sensors.load(Ordering::Relaxed) >= most {
            return Err(Fault::too_many_sensors(most));
        }
        let Some(who) = client.peer.origin.named() else {
            return Ok(());
        };
        let all: usize = read(&self.clients.by_number)
            .values()
            .filter(|c| c.peer.origin == client.peer.origin)
            .map(|c| c.sensors.load(Ordering::Relaxed))
            .sum();
        let most = self.limits.sensors_of_peer();
        if all >= most {
            return refuse(format!(
                "{who} sends {all} sensors already, and may send {most}; --max-sensors allows more"
            ));
        }
        Ok(())
    }

    fn make_room(&self, sensors: &mut BTreeMap<Arc<str>, Arc<Mutex<Sensor>>>) -> Result<(), Fault> {
        let silent = sensors
            .iter()
            .filter_map(|(id, sensor)| {
                // One that is being looked at (`STATUS`) is waited for: it may be the one.
                let sensor = lock(sensor);
                self.is_left(&sensor).then(|| (sensor.heard, id.clone()))
            })
            .min();
        let Some((_, id)) = silent else {
            return Err(Fault::new(
                "too_many_sensors",
                format!(
                    "there are {} sensors already, and all of them are being sent; --max-sensors allows more",
                    sensors.len()
                ),
            ));
        };
        self.put_away(sensors, &id);
        count(&self.counters.gave_way, 1);
        let mut told = lock(&self.sensors.gave_way);
        told.retain(|known| *known != id);
        if told.len() == TOLD {
            told.pop_front();
        }
        told.push_back(id);
        Ok(())
    }

    /// Whether nobody sends a sensor: its sender has gone, or is a broker that has brought nothing of it for as
    /// long as a sender of datagrams may be silent. A broker stays connected when its publishers go.
    pub(super) fn is_left(&self, sensor: &Sensor) -> bool {
        let Some(owner) = sensor.owner else {
            return true;
        };
        let now = self.sensors.tick.load(Ordering::Relaxed);
        now - sensor.heard_at.min(now) > ticks(self.limits.sender_silence)
            && read(&self.clients.by_number)
                .get(&owner)
                .is_some_and(|owner| owner.is_broker.load(Ordering::Relaxed))
    }

    /// Gives up places of sensors that were silent for longer than they may be; to be called every [`TICK`].
    /// Their attitudes are kept, and go on when they come back.
    pub fn forget_silent(&self) {
        let now = self.sensors.tick.fetch_add(1, Ordering::Relaxed) + 1;
        let Some(after) = self.limits.forget_after else {
            return;
        };
        let most = ticks(after);
        // A pass over all of them now and then, not at every tick.
        if !now.is_multiple_of((most / 8).max(1)) {
            return;
        }
        let all: Vec<_> = {
            let sensors = read(&self.sensors.by_id);
            let all = sensors.iter().map(|(id, s)| (id.clone(), s.clone()));
            all.collect()
        };
        let is_silent = |sensor: &Mutex<Sensor>| {
            let sensor = lock(sensor);
            // Samples that wait for the unit of their stamps are in no state.
            now - sensor.heard_at.min(now) > most && !sensor.stream.is_waiting()
        };
        let silent = all.into_iter().filter(|(_, sensor)| is_silent(sensor));
        for (id, sensor) in silent {
            let mut sensors = write(&self.sensors.by_id);
            // It may have spoken meanwhile.
            if is_silent(&sensor) {
                self.put_away(&mut sensors, &id);
                count(&self.counters.forgotten, 1);
            }
        }
    }

    /// A sensor's place is free, and its attitude is kept.
    fn put_away(&self, sensors: &mut BTreeMap<Arc<str>, Arc<Mutex<Sensor>>>, id: &Arc<str>) {
        if let Some(sensor) = sensors.remove(id) {
            let mut sensor = lock(&sensor);
            // Somebody may be about to send it.
            sensor.gave_way = true;
            if let Some(saved) = sensor.stream.saved().filter(|last| last.check().is_ok()) {
                lock(&self.sensors.absent).insert(id, saved, self.limits.sensors);
            }
            self.withdraw(sensor.stream.channel());
        }
    }

    /// Sensors that another worker has had go on from where they were.
    #[cfg(feature = "nats")]
    pub fn restore(&self, sensors: Sensors) {
        let mut saved = lock(&self.sensors.absent);
        for (id, one) in sensors {
            saved.insert(&id, one, self.limits.sensors);
        }
    }

    /// Forgets these sensors, which are another worker's.
    #[cfg(feature = "nats")]
    pub fn forget(&self, ids: &std::collections::BTreeSet<String>) {
        let mut sensors = write(&self.sensors.by_id);
        for id in ids {
            if let Some(sensor) = sensors.remove(id.as_str()) {
                let mut sensor = lock(&sensor);
                sensor.gave_way = true;
                self.withdraw(sensor.stream.channel());
            }
            lock(&self.sensors.absent).remove(id);
        }
    }

    /// A stream is no more; viewers are told.
    fn withdraw(&self, channel: &Channel) {
        let mut channels = write(&self.channels.by_number);
        if channels.remove(&channel.number()).is_some() {
            lock(&self.channels.child_frames).give_back(channel.stream(), channel.child());
        }
        let numbers: Vec<u32> = channel.topics().map(|(number, _)| number).collect();
        let said = foxglove::withdrawn(&numbers);
        for client in read(&self.clients.by_number).values() {
            client
                .outbox
                .forget_stream(channel.id(), channel.number(), &numbers);
            if client.is_viewer() {
                client.outbox.announce(said.clone());
            }
        }
    }

    /// Places for sensors, for `STATUS`.
    pub(super) fn places(&self) -> serde_json::Value {
        serde_json::json!({
            "sensors": self.limits.sensors,
            "taken": read(&self.sensors.by_id).len(),
            "saved": lock(&self.sensors.absent).iter().count(),
            "gave_way": self.counters.gave_way.load(Ordering::Relaxed),
            "gave_way_last": lock(&self.sensors.gave_way).iter().map(|id| &**id).collect::<Vec<_>>(),
        })
    }
}

/// The number of ticks in a time, rounded up.
fn ticks(time: Duration) -> u64 {
    u64::try_from(time.as_nanos().div_ceil(TICK.as_nanos())).unwrap_or(u64::MAX)
}

impl Origin {
    /// Name in words; `None`: somebody we chose ourselves.
    fn named(self) -> Option<String> {
        match self {
            Origin::Own => None,
            Origin::Address(ip) => Some(ip.to_string()),
            Origin::User(id) => Some(format!("user {id}")),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::{ClientProtocol, Hub, Settings};
    use super::*;
    use crate::serve::core::session::{Scratch, Session};
    use crate::serve::guard::limits::Limits;
    use strapd_attitude::record::Nanos;

    fn line(id: &str, n: u64) -> String {
        format!("{{\"id\":\"{id}\",\"stamp\":{{\"sec\":{n},\"nsec\":0}},\"gyro\":[0.1,0,0]}}\n")
    }

    #[test]
    fn a_sensor_that_is_being_looked_at_gives_way_all_the_same() {
        let limits = Limits {
            sensors: 2,
            ..Limits::default()
        };
        let settings = Settings {
            limits,
            ..Settings::default()
        };
        let hub = Arc::new(Hub::new(settings).unwrap());
        let mut scratch = Scratch::default();
        let mut send = |id: &str| {
            let mut session = Session::new(&hub, "sender".to_owned(), true);
            session.bytes(line(id, 1).as_bytes(), Nanos(0), &mut scratch);
            assert_eq!(session.end(), None);
        };
        send("silent longest");
        send("newer");
        let looked_at = read(&hub.sensors.by_id)["silent longest"].clone();
        let held = lock(&looked_at);
        std::thread::scope(|scope| {
            let sent = scope.spawn(|| send("newest"));
            // Without the wait it would have been done long ago.
            std::thread::sleep(std::time::Duration::from_millis(200));
            drop(held);
            sent.join().unwrap();
        });
        assert_eq!(hub.places()["gave_way_last"][0], "silent longest");
    }

    #[test]
    fn who_comes_with_ever_new_names_makes_nothing_grow() {
        let places = 8;
        let hub = Arc::new(
            Hub::new(Settings {
                limits: Limits {
                    sensors: places,
                    ..Limits::default()
                },
                ..Settings::default()
            })
            .unwrap(),
        );
        let viewer = hub.join_as(
            "viewer".to_owned(),
            ClientProtocol::Foxglove { controls: false },
        );
        let watcher = hub.join("watcher".to_owned());
        watcher.outbox.watch(Some(Default::default()));
        hub.watch_changed();
        let mut scratch = Scratch::default();
        let mut said = VecDeque::new();
        for n in 0..20 * places as u64 {
            let mut session = Session::new(&hub, "sender".to_owned(), true);
            session.bytes(
                line(&format!("s{n}"), n + 1).as_bytes(),
                Nanos(0),
                &mut scratch,
            );
            assert_eq!(session.end(), None);
            drop(session);
            viewer
                .outbox
                .subscribe(foxglove::frames::channel_of(n as u32 + 1), n as u32, 4096);
            viewer.outbox.discard(&mut said);
        }
        assert_eq!(read(&hub.sensors.by_id).len(), places);
        assert_eq!(read(&hub.channels.by_number).len(), places);
        assert_eq!(lock(&hub.sensors.absent).order.len(), places);
        assert_eq!(lock(&hub.sensors.absent).sensors.len(), places);
        // The newest are there, those before them are saved, and the viewer was told of each.
        assert!(
            read(&hub.sensors.by_id).contains_key("s159")
                && !read(&hub.sensors.by_id).contains_key("s151")
        );
        assert!(
            lock(&hub.sensors.absent).get("s151").is_some()
                && lock(&hub.sensors.absent).get("s143").is_none()
        );
        let count = |what: &[u8]| {
            let has = |line: &&bytes::Bytes| line.windows(what.len()).any(|w| w == what);
            said.iter().filter(has).count()
        };
        assert_eq!(count(b"\"unadvertise\""), 19 * places);
        let told = hub.places();
        assert_eq!(
            (&told["gave_way"], &told["taken"]),
            (&152.into(), &8.into())
        );
        assert_eq!(told["gave_way_last"].as_array().map(Vec::len), Some(TOLD));
    }
}
