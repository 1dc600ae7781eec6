//! Back-pressure: who sends as fast as it can waits a moment for who watches.
//!
//! A sensor sends at its own pace and waits for nobody. A log that is pushed in as fast as the
//! socket takes it would otherwise be read before the watchers on the same cores have had their
//! turn, and all but the last of it would be dropped for each. Bounded three times: a wait is at most
//! [`PATIENCE`] long; a watcher that took nothing during one is not waited for again until it takes
//! something; and after a wait in vain the sender goes on without another for as long again. So a
//! moment's absence costs a watcher a moment, a stalled watcher costs a sender one wait, and any number
//! of slow ones half of its time, which leaves it many times the pace of any sensor.

use super::{Client, Hub, read};
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{Instant, timeout_at};

/// Longest wait for room, before one read.
const PATIENCE: Duration = Duration::from_millis(5);
/// Interval at which a thread looks.
const LOOK: Duration = Duration::from_micros(200);
/// Number of messages without a wait from which a sender floods whose reader is not told how much there is to read; the
/// other limit is in bytes.
const MESSAGES: u32 = 32;
const MESSAGE_BYTES: usize = 4 << 10;

/// Notices that a sender floods: it has sent more than was read, time after time.
#[derive(Debug, Default)]
pub struct Flood {
    messages: u32,
    /// Bytes of those messages.
    bytes: usize,
    until: Option<Instant>,
    /// Time before which it does not wait, having waited in vain.
    free: Option<Instant>,
    /// Longest wait for room; `None`: [`PATIENCE`].
    patience: Option<Duration>,
    /// Somebody watches it: less is read at once, so that what is made of it finds room.
    is_watched: bool,
}

impl Flood {
    /// Makes one for a reader whose wait costs its sender nothing: what comes meanwhile waits elsewhere.
    #[cfg(feature = "zenoh")]
    #[must_use]
    pub fn with_patience(patience: Duration) -> Flood {
        Flood {
            patience: Some(patience),
            ..Flood::default()
        }
    }

    /// Number of bytes to read at once, where there is room for `room`.
    #[must_use]
    pub fn most(&self, room: usize) -> usize {
        if self.is_watched { room / 4 } else { room }
    }

    /// `n` bytes were read of a stream, of at most `most`.
    pub fn read(&mut self, n: usize, most: usize) {
        if n >= most {
            self.hold();
        } else {
            self.is_watched = false;
        }
    }

    /// A message, or stretch of a stream, of so many bytes has come; `at_once`: it was there already.
    pub fn message(&mut self, at_once: bool, bytes: usize) {
        if !at_once {
            (self.messages, self.bytes) = (0, 0);
            return;
        }
        self.messages += 1;
        self.bytes += bytes;
        if self.messages >= MESSAGES || self.bytes >= MESSAGE_BYTES {
            (self.messages, self.bytes) = (0, 0);
            self.hold();
        }
    }

    /// Makes it wait before it goes on; while it is free, only until others have had their turn.
    pub fn hold(&mut self) {
        let now = Instant::now();
        self.free = self.free.filter(|free| now < *free);
        self.until = Some(match self.free {
            Some(_) => now,
            None => now + self.patience.unwrap_or(PATIENCE),
        });
    }

    fn waited(&mut self, outcome: Waited) {
        self.is_watched = outcome != Waited::Nobody;
        if outcome == Waited::InVain && self.free.is_none() {
            self.free = Some(Instant::now() + self.patience.unwrap_or(PATIENCE));
        }
        self.until = None;
    }

    /// Whether it is to wait before the next read.
    #[must_use]
    pub fn must_wait(&self) -> bool {
        self.until.is_some()
    }

    /// Waits, if it must. May be dropped and called again: the end of the wait stands.
    pub async fn wait(&mut self, hub: &Hub) {
        if let Some(until) = self.until {
            let outcome = hub.room(until).await;
            self.waited(outcome);
        }
    }

    /// The same for a thread of its own.
    pub fn wait_in_thread(&mut self, hub: &Hub) {
        if let Some(until) = self.until {
            let outcome = hub.room_in_thread(until);
            self.waited(outcome);
        }
    }
}

/// Outcome of a wait.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Waited {
    /// Nobody watches.
    Nobody,
    /// Room.
    Room,
    /// Still full.
    InVain,
}

fn is_crowded(watchers: &[Arc<Client>]) -> bool {
    watchers.iter().any(|c| c.outbox.is_crowded())
}

fn lose_patience(watchers: &[Arc<Client>]) {
    for client in watchers {
        client.outbox.lose_patience();
    }
}

impl Hub {
    pub(super) fn watchers(&self) -> Arc<[Arc<Client>]> {
        read(&self.clients.watchers).clone()
    }

    fn room_in_thread(&self, until: Instant) -> Waited {
        let watchers = self.watchers();
        if watchers.is_empty() {
            return Waited::Nobody;
        }
        while is_crowded(&watchers) {
            if Instant::now() >= until {
                lose_patience(&watchers);
                return Waited::InVain;
            }
            std::thread::sleep(LOOK);
        }
        Waited::Room
    }

    /// Waits until every watcher that takes anything has room for more, or `until`.
    async fn room(&self, until: Instant) -> Waited {
        let watchers = self.watchers();
        if watchers.is_empty() {
            return Waited::Nobody;
        }
        // Others on this thread have their turn, the watchers above all.
        tokio::task::yield_now().await;
        loop {
            // Made before it is looked: no room made meanwhile goes unnoticed.
            let made = self.clients.room_made.notified();
            if !is_crowded(&watchers) {
                return Waited::Room;
            }
            if timeout_at(until, made).await.is_err() {
                lose_patience(&watchers);
                return Waited::InVain;
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::Settings;
    use super::*;
    use crate::serve::protocol::chunk::{Chunk, MAX_QUEUED};
    use crate::serve::protocol::filter::Filter;
    use std::collections::VecDeque;

    fn watched() -> (Arc<Hub>, Arc<Client>) {
        let hub = Arc::new(Hub::new(Settings::default()).unwrap());
        let client = hub.join("somebody".to_owned());
        client.outbox.watch(Some(Filter::default()));
        hub.watch_changed();
        (hub, client)
    }

    fn fill(client: &Client, bytes: usize) {
        let chunk = Chunk {
            id: "a".into(),
            first_seq: 0,
            count: 1,
            bytes: vec![b'x'; bytes].into(),
            label: None,
        };
        client
            .outbox
            .offer_samples(&chunk.id, &mut |_| vec![chunk.clone()]);
    }

    fn flooding() -> Flood {
        let mut flood = Flood::default();
        flood.read(10, 10);
        flood
    }

    /// Duration of the wait.
    async fn wait(hub: &Hub) -> Duration {
        let begin = Instant::now();
        let mut flood = flooding();
        flood.wait(hub).await;
        assert!(!flood.must_wait());
        let is_watched = !hub.watchers().is_empty();
        assert_eq!(flood.most(1000), if is_watched { 250 } else { 1000 });
        flood.read(9, 10);
        assert_eq!(flood.most(1000), 1000, "the flood is over");
        begin.elapsed()
    }

    #[test]
    fn only_who_sends_more_than_is_read_floods() {
        let mut flood = Flood::default();
        flood.read(9, 10);
        assert!(!flood.must_wait());
        flood.read(10, 10);
        assert!(flood.must_wait());
        assert_eq!(flood.most(1000), 1000, "nobody is known to watch");
        let mut flood = Flood::default();
        for n in 0..10 * MESSAGES {
            // A sensor's messages come one by one, now and then a few together.
            flood.message(n % MESSAGES != 0, 100);
            assert!(!flood.must_wait());
        }
        for _ in 0..MESSAGES {
            flood.message(true, 100);
        }
        assert!(flood.must_wait());
        // Many lines in each.
        let mut flood = Flood::default();
        flood.message(false, MESSAGE_BYTES);
        assert!(!flood.must_wait());
        flood.message(true, MESSAGE_BYTES);
        assert!(flood.must_wait());
    }

    #[tokio::test(start_paused = true)]
    async fn nobody_waits_for_a_watcher_with_room() {
        let (hub, client) = watched();
        assert_eq!(wait(&hub).await, Duration::ZERO);
        fill(&client, MAX_QUEUED / 2);
        assert_eq!(wait(&hub).await, Duration::ZERO);
        client.outbox.watch(None);
        hub.watch_changed();
        fill(&client, MAX_QUEUED);
        assert_eq!(wait(&hub).await, Duration::ZERO);
    }

    #[tokio::test(start_paused = true)]
    async fn a_flood_waits_until_the_watcher_has_taken_some() {
        let (hub, client) = watched();
        fill(&client, MAX_QUEUED / 2 + 1);
        let taker = {
            let client = client.clone();
            tokio::spawn(async move {
                tokio::time::sleep(Duration::from_millis(2)).await;
                let taken = client.outbox.take(1, &mut VecDeque::new());
                client.outbox.written(taken);
            })
        };
        assert_eq!(wait(&hub).await, Duration::from_millis(2));
        taker.await.unwrap();
        assert_eq!(client.outbox.level().dropped, 0);
    }

    #[tokio::test(start_paused = true)]
    async fn a_watcher_that_takes_nothing_costs_one_wait() {
        let (hub, client) = watched();
        fill(&client, MAX_QUEUED * 2 / 3);
        assert_eq!(wait(&hub).await, PATIENCE);
        for _ in 0..10 {
            assert_eq!(wait(&hub).await, Duration::ZERO);
            fill(&client, MAX_QUEUED * 2 / 3);
        }
        // It takes something, and is waited for again.
        let taken = client.outbox.take(1, &mut VecDeque::new());
        client.outbox.written(taken);
        fill(&client, MAX_QUEUED * 2 / 3);
        assert_eq!(wait(&hub).await, PATIENCE);
        assert_eq!(wait(&hub).await, Duration::ZERO);
    }

    #[tokio::test(start_paused = true)]
    async fn any_number_of_slow_watchers_costs_a_sender_half_of_its_time() {
        let hub = Arc::new(Hub::new(Settings::default()).unwrap());
        let clients: Vec<_> = (0..20).map(|n| hub.join(n.to_string())).collect();
        for client in &clients {
            client.outbox.watch(Some(Filter::default()));
            fill(client, MAX_QUEUED * 2 / 3);
        }
        hub.watch_changed();
        // Each takes something all the time, and none enough.
        let takers = tokio::spawn(async move {
            loop {
                for client in &clients {
                    tokio::time::sleep(Duration::from_millis(1)).await;
                    client.outbox.written(1);
                }
            }
        });
        let (begin, mut waited, mut flood) = (Instant::now(), Duration::ZERO, Flood::default());
        while begin.elapsed() < Duration::from_secs(10) {
            flood.read(10, 10);
            let before = Instant::now();
            flood.wait(&hub).await;
            waited += before.elapsed();
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        takers.abort();
        let share = waited.as_secs_f64() / begin.elapsed().as_secs_f64();
        assert!((0.3..0.55).contains(&share), "{share}");
    }

    #[test]
    fn a_thread_waits_in_the_same_way() {
        let (hub, client) = watched();
        fill(&client, MAX_QUEUED * 2 / 3);
        let begin = Instant::now();
        flooding().wait_in_thread(&hub);
        assert!(begin.elapsed() >= PATIENCE - Duration::from_millis(1));
        assert!(!client.outbox.is_crowded(), "it is not waited for again");
        flooding().wait_in_thread(&hub);
    }
}
