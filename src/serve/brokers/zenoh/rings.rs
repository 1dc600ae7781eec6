//! Messages of many keys, as fast as they come -> as fast as they are taken. Pure but for the lock.
//!
//! Whoever brings a message never waits: a ring that is full loses its oldest. Keys take turns, so that
//! one that floods delays no other by more than a turn.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// Most bytes that wait of one key.
const RING: usize = 4 << 20;
/// Most bytes that wait in all.
const ALL: usize = 64 << 20;
/// Size of a message beside its bytes, about.
const BESIDE: usize = 64;
/// Size of a key beside its name, about.
const BESIDE_KEY: usize = 192;
/// Most messages of a key in one turn, and most bytes but for the first.
const TURN: usize = 64;
const TURN_BYTES: usize = 64 << 10;

/// One message.
#[derive(Debug, PartialEq, Eq)]
pub struct Message {
    /// Payload.
    pub payload: Box<[u8]>,
    /// Attachment.
    pub attachment: Option<Box<[u8]>>,
}

impl Message {
    fn size(&self) -> usize {
        self.payload.len() + self.attachment.as_ref().map_or(0, |a| a.len()) + BESIDE
    }
}

/// Consecutive messages of one key.
#[derive(Debug, PartialEq, Eq)]
pub struct KeyBatch {
    /// The key.
    pub key: Arc<str>,
    /// Number lost before them, since the last turn of this key; with those of keys there was no room for.
    pub lost: u64,
    /// The messages, oldest first.
    pub messages: Vec<Message>,
}

#[derive(Debug, Default)]
struct Ring {
    messages: VecDeque<Message>,
    bytes: usize,
    lost: u64,
}

#[derive(Debug, Default)]
struct State {
    /// Rings of keys of which something waits.
    rings: HashMap<Arc<str>, Ring>,
    /// Keys in the order of their turns.
    turns: VecDeque<Arc<str>>,
    bytes: usize,
    /// Messages of keys there was no room for.
    lost: u64,
}

/// Size of a key while something waits of it.
fn taken_by(key: &str) -> usize {
    key.len() + BESIDE_KEY
}

/// All that waits.
#[derive(Debug, Default)]
pub struct Rings {
    state: Mutex<State>,
    filled: Notify,
}

impl Rings {
    fn state(&self) -> MutexGuard<'_, State> {
        // A State is whole after every statement that could panic.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A message has come. Waits for nobody.
    pub fn push(&self, key: &str, message: Message) {
        let mut state = self.state();
        let State {
            rings,
            turns,
            bytes,
            lost,
        } = &mut *state;
        let size = message.size();
        let ring = match rings.get_mut(key) {
            Some(ring) => ring,
            // Somebody waits already, who will say so.
            None if *bytes + taken_by(key) + size > ALL => {
                *lost += 1;
                return;
            }
            None => {
                *bytes += taken_by(key);
                let key: Arc<str> = key.into();
                turns.push_back(key.clone());
                rings.entry(key).or_default()
            }
        };
        while (ring.bytes + size > RING || *bytes + size > ALL)
            && let Some(oldest) = ring.messages.pop_front()
        {
            ring.bytes -= oldest.size();
            *bytes -= oldest.size();
            ring.lost += 1;
        }
        if *bytes + size > ALL {
            ring.lost += 1;
        } else {
            ring.bytes += size;
            *bytes += size;
            ring.messages.push_back(message);
        }
        drop(state);
        self.filled.notify_one();
    }

    /// The next turn that is there, if one is.
    #[must_use]
    pub fn now(&self) -> Option<KeyBatch> {
        let mut state = self.state();
        let State {
            rings,
            turns,
            bytes,
            lost: of_others,
        } = &mut *state;
        let key = turns.pop_front()?;
        let ring = rings.get_mut(&key)?;
        let (mut messages, mut taken) = (Vec::new(), 0);
        while messages.len() < TURN
            && taken < TURN_BYTES
            && let Some(message) = ring.messages.pop_front()
        {
            taken += message.size();
            messages.push(message);
        }
        ring.bytes -= taken;
        *bytes -= taken;
        let lost = std::mem::take(&mut ring.lost) + std::mem::take(of_others);
        match ring.messages.is_empty() {
            true => {
                *bytes -= taken_by(&key);
                rings.remove(&key);
            }
            false => turns.push_back(key.clone()),
        }
        Some(KeyBatch {
            key,
            lost,
            messages,
        })
    }

    /// The next turn. May be dropped and called again: nothing is lost.
    pub async fn next(&self) -> KeyBatch {
        loop {
            if let Some(turn) = self.now() {
                return turn;
            }
            self.filled.notified().await;
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn message(first: u8, bytes: usize) -> Message {
        let mut payload = vec![0; bytes - BESIDE];
        payload[0] = first;
        Message {
            payload: payload.into(),
            attachment: None,
        }
    }

    fn firsts(turn: &KeyBatch) -> Vec<u8> {
        turn.messages.iter().map(|m| m.payload[0]).collect()
    }

    #[test]
    fn a_ring_that_is_full_loses_its_oldest_and_says_how_many() {
        let rings = Rings::default();
        for n in 0..6 {
            rings.push("a", message(n, 1 << 20));
        }
        let first = rings.now().unwrap();
        assert_eq!((first.lost, firsts(&first)), (2, vec![2]));
        let second = rings.now().unwrap();
        assert_eq!((second.lost, firsts(&second)), (0, vec![3]));
        rings.now().unwrap();
        rings.now().unwrap();
        assert_eq!(rings.now(), None);
        let state = rings.state();
        assert_eq!(
            (state.bytes, state.rings.len(), state.turns.len()),
            (0, 0, 0)
        );
    }

    #[test]
    fn keys_take_turns_and_each_keeps_its_order() {
        let rings = Rings::default();
        for n in 0..100 {
            rings.push("a", message(n, 100));
        }
        rings.push("b", message(7, 100));
        let turns: Vec<_> = std::iter::from_fn(|| rings.now()).collect();
        let seen: Vec<_> = turns.iter().map(|t| (&*t.key, firsts(t).len())).collect();
        assert_eq!(seen, [("a", 64), ("b", 1), ("a", 36)]);
        let all: Vec<u8> = turns
            .iter()
            .filter(|t| &*t.key == "a")
            .flat_map(firsts)
            .collect();
        assert_eq!(all, (0..100).collect::<Vec<u8>>());
    }

    #[test]
    fn many_keys_together_take_no_more_than_there_is_for_all() {
        let rings = Rings::default();
        for key in 0..100 {
            for n in 0..4 {
                rings.push(&key.to_string(), message(n, 1 << 20));
            }
        }
        let names: usize = (0..16).map(|key| taken_by(&key.to_string())).sum();
        assert_eq!(rings.state().bytes, (63 << 20) + names);
        let turns: Vec<_> = std::iter::from_fn(|| rings.now()).collect();
        let lost: u64 = turns.iter().map(|t| t.lost).sum();
        let kept: usize = turns.iter().map(|t| t.messages.len()).sum();
        // The names take the place of one of the 64 there would be room for.
        assert_eq!((lost, kept), (400 - 63, 63));
        assert_eq!(rings.state().bytes, 0);
    }

    /// While nothing is taken, names without end take no more than there is for all.
    #[test]
    fn names_count_too() {
        let rings = Rings::default();
        let name = "x".repeat(10_000);
        for n in 0..20_000 {
            rings.push(&format!("{name}/{n}"), message(0, 100));
        }
        let held: usize = rings.state().rings.keys().map(|key| key.len()).sum();
        assert!((ALL / 2..=ALL).contains(&held), "{held} bytes of names");
        let turns: Vec<_> = std::iter::from_fn(|| rings.now()).collect();
        let lost: u64 = turns.iter().map(|t| t.lost).sum();
        assert_eq!(lost as usize + turns.len(), 20_000);
        assert_eq!(rings.state().bytes, 0);
    }

    #[tokio::test]
    async fn who_waits_is_woken() {
        let rings = Arc::new(Rings::default());
        let waiting = tokio::spawn({
            let rings = rings.clone();
            async move { rings.next().await }
        });
        tokio::task::yield_now().await;
        rings.push("a", message(1, 100));
        let turn = waiting.await.unwrap();
        assert_eq!(firsts(&turn), [1]);
    }
}
