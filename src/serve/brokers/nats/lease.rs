//! A bucket <-> which worker has a partition, and the state of its sensors. I/O.
//!
//! One document is both: who saves the state has the sensors. It is written every [`EVERY`], by its
//! revision, so that of two who write only one can. A worker that could not for [`HELD`], counted from
//! before its last write that succeeded, publishes nothing more; one that saw no new revision for
//! [`LAPSED`], which is longer, takes over. No clock of one machine is held against another's.

use super::connection::in_words;
use super::tenure::{LeaseState, LeaseWatch};
use crate::serve::core::state::{FORMAT, Sensors};
use crate::serve::guard::log_throttle;
use async_nats::jetstream::kv::{CreateErrorKind, Operation, Store, UpdateErrorKind};
use bytes::Bytes;
use serde::{Deserialize, Serialize};
use std::hash::{BuildHasher, RandomState};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::time::{MissedTickBehavior, interval, sleep, timeout};

/// Interval at which the document is written.
const EVERY: Duration = Duration::from_millis(500);
/// Time after a write for which attitudes may be published.
const HELD: Duration = Duration::from_millis(1800);
/// Time for which nobody must have written before another takes over.
const LAPSED: Duration = Duration::from_millis(2500);
/// Interval at which a waiting worker looks.
const LOOK: Duration = Duration::from_millis(200);
/// Time that one write may take.
const PATIENCE: Duration = Duration::from_millis(1000);
/// A larger document is packed.
const PACKED_FROM: usize = 64 << 10;
/// One that unpacks to more is none of ours.
const MAX_BYTES: usize = 64 << 20;

/// Document that a worker leaves to the next.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Document {
    strapd_state: u32,
    worker: String,
    /// Whether it has ended in order: nobody needs to wait.
    #[serde(default)]
    released: bool,
    /// Number of the last message of the stream that is in the state.
    #[serde(default)]
    pub(super) sequence: Option<u64>,
    /// The state.
    pub(super) sensors: Sensors,
}

/// A partition that is ours.
#[derive(Debug)]
pub(super) struct Lease {
    store: Store,
    key: String,
    worker: String,
    number: u64,
    /// The newest state, and the revision of what was written last.
    saved: Mutex<(Document, u64)>,
}

/// A name nobody else has.
pub(super) fn worker_name(session: &str) -> String {
    let chance = RandomState::new().hash_one(session);
    format!("{session}-{chance:016x}")
}

impl Lease {
    /// Waits until nobody has it, and takes it. The state comes with it.
    ///
    /// # Errors
    /// In words: the bucket cannot be read, or holds what is no state of ours.
    pub(super) async fn acquire(
        store: Store,
        key: &str,
        worker: &str,
        tenancy: &LeaseWatch,
    ) -> Result<(Lease, Document), String> {
        let number = tenancy.now().number() + 1;
        let mut seen: Option<(u64, Instant)> = None;
        loop {
            let entry = store.entry(key).await.map_err(|e| in_words(&e))?;
            let entry = entry.filter(|e| e.operation == Operation::Put);
            let before = Instant::now();
            let (document, taken) = match entry {
                None => {
                    let document = Document {
                        strapd_state: FORMAT,
                        ..Document::default()
                    };
                    let ours = document.of(worker, false);
                    match store.create(key, ours.bytes()?).await {
                        Ok(revision) => (document, Some(revision)),
                        Err(e) if e.kind() == CreateErrorKind::AlreadyExists => (document, None),
                        Err(e) => return Err(in_words(&e)),
                    }
                }
                Some(entry) => {
                    let document = Document::read(&entry.value)?;
                    let has_lapsed = match seen {
                        Some((revision, since)) if revision == entry.revision => {
                            since.elapsed() >= LAPSED
                        }
                        _ => {
                            seen = Some((entry.revision, Instant::now()));
                            false
                        }
                    };
                    if !has_lapsed && !document.released {
                        sleep(LOOK).await;
                        continue;
                    }
                    let ours = document.of(worker, false);
                    match store.update(key, ours.bytes()?, entry.revision).await {
                        Ok(revision) => (document, Some(revision)),
                        Err(e) if e.kind() == UpdateErrorKind::WrongLastRevision => {
                            (document, None)
                        }
                        Err(e) => return Err(in_words(&e)),
                    }
                }
            };
            // Somebody else was faster.
            let Some(revision) = taken else { continue };
            tenancy.set(LeaseState::Held {
                number,
                until: before + HELD,
            });
            let lease = Lease {
                store,
                key: key.to_owned(),
                worker: worker.to_owned(),
                number,
                saved: Mutex::new((document.clone(), revision)),
            };
            return Ok((lease, document));
        }
    }

    fn saved(&self) -> std::sync::MutexGuard<'_, (Document, u64)> {
        // Whole after every statement.
        self.saved.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the state that is written from now on.
    pub(super) fn save(&self, sequence: Option<u64>, sensors: Sensors) {
        let document = &mut self.saved().0;
        document.sequence = sequence;
        document.sensors = sensors;
    }

    /// Writes it again and again, until somebody else has: then says who.
    pub(super) async fn keep(self: Arc<Lease>, tenancy: Arc<LeaseWatch>) -> String {
        let mut tick = interval(EVERY);
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tick.tick().await;
            let before = Instant::now();
            match self.write(false).await {
                Ok(()) => tenancy.set(LeaseState::Held {
                    number: self.number,
                    until: before + HELD,
                }),
                Err(Refused::Other(who)) => {
                    tenancy.set(LeaseState::None {
                        number: self.number,
                    });
                    return format!("{} has {} now", who, self.key);
                }
                Err(Refused::Now(why)) => log_throttle::warn(
                    "lease",
                    &format!(
                        "the state of {} cannot be written: {why}; trying again, and publishing nothing meanwhile",
                        self.key
                    ),
                ),
            }
        }
    }

    /// Lets it go, so that another need not wait.
    pub(super) async fn release(&self, tenancy: &LeaseWatch) {
        // Twice: the answer to the write before may be lost. Whatever comes of it, it lapses.
        if self.write(true).await.is_err() {
            let _ = self.write(true).await;
        }
        tenancy.set(LeaseState::None {
            number: self.number,
        });
    }

    async fn write(&self, released: bool) -> Result<(), Refused> {
        let (document, revision) = self.saved().clone();
        let bytes = document.of(&self.worker, released).bytes();
        let bytes = bytes.map_err(Refused::Now)?;
        let written = timeout(PATIENCE, self.store.update(&self.key, bytes, revision)).await;
        match written {
            Ok(Ok(revision)) => {
                self.saved().1 = revision;
                Ok(())
            }
            Ok(Err(e)) if e.kind() == UpdateErrorKind::WrongLastRevision => {
                let found = self.store.entry(&self.key).await;
                let found = found.map_err(|e| Refused::Now(in_words(&e)))?;
                let Some(entry) = found.filter(|e| e.operation == Operation::Put) else {
                    return Err(Refused::Other("nobody".to_owned()));
                };
                match Document::read(&entry.value) {
                    // Our own, of which the answer was lost.
                    Ok(document) if document.worker == self.worker => {
                        self.saved().1 = entry.revision;
                        Err(Refused::Now("an answer was lost".to_owned()))
                    }
                    Ok(document) => Err(Refused::Other(document.worker)),
                    Err(_) => Err(Refused::Other("somebody".to_owned())),
                }
            }
            Ok(Err(e)) => Err(Refused::Now(in_words(&e))),
            Err(_) => Err(Refused::Now("no answer".to_owned())),
        }
    }
}

/// Why a write did not succeed.
#[derive(Debug)]
enum Refused {
    /// Failure that may pass the next time.
    Now(String),
    /// Somebody else has it.
    Other(String),
}

impl Document {
    fn of(&self, worker: &str, released: bool) -> Document {
        Document {
            strapd_state: FORMAT,
            worker: worker.to_owned(),
            released,
            sequence: self.sequence,
            sensors: self.sensors.clone(),
        }
    }

    /// Bytes as stored: JSON, packed where it is large.
    fn bytes(&self) -> Result<Bytes, String> {
        let text = serde_json::to_vec(self).map_err(|e| e.to_string())?;
        if text.len() < PACKED_FROM {
            return Ok(text.into());
        }
        let packed = zstd::bulk::compress(&text, 3).map_err(|e| e.to_string())?;
        Ok(packed.into())
    }

    fn read(stored: &[u8]) -> Result<Document, String> {
        let unpacked;
        let text = match stored.first() {
            Some(b'{') | None => stored,
            Some(_) => {
                unpacked = zstd::bulk::decompress(stored, MAX_BYTES)
                    .map_err(|e| format!("what is stored is no state of strapd: {e}"))?;
                &unpacked
            }
        };
        let document: Document = serde_json::from_slice(text)
            .map_err(|e| format!("what is stored is no state of strapd: {e}"))?;
        if document.strapd_state != FORMAT {
            return Err(format!(
                "the state that is stored is of format {}, and this release reads {FORMAT}",
                document.strapd_state
            ));
        }
        crate::serve::core::state::check(&document.sensors)
            .map_err(|why| format!("what is stored is no state of strapd: {why}"))?;
        Ok(document)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_state_comes_back_packed_or_not_and_no_other_is_taken_for_one() {
        let document = Document {
            strapd_state: FORMAT,
            sequence: Some(7),
            ..Document::default()
        };
        let small = document.of("a", true).bytes().unwrap();
        assert!(small.starts_with(b"{"));
        let back = Document::read(&small).unwrap();
        assert_eq!(
            (back.sequence, back.worker.as_str(), back.released),
            (Some(7), "a", true)
        );
        let large = document
            .of(&"x".repeat(PACKED_FROM), false)
            .bytes()
            .unwrap();
        assert!(!large.starts_with(b"{") && large.len() < 4096);
        assert_eq!(Document::read(&large).unwrap().worker.len(), PACKED_FROM);
        for bad in [
            &b""[..],
            b"{}",
            b"\x28\xb5\x2f\xfd",
            br#"{"strapd_state":99,"worker":"a","sensors":{}}"#,
        ] {
            let said = Document::read(bad).unwrap_err();
            assert!(said.contains("stored"), "{said}");
        }
        assert_ne!(worker_name("a"), worker_name("a"));
    }

    /// Checks that whoever may publish has written within [`HELD`]; who takes over has seen nothing new for longer.
    #[test]
    fn nobody_takes_over_while_the_other_may_publish() {
        const { assert!(HELD.as_millis() + 2 * LOOK.as_millis() < LAPSED.as_millis()) };
        const { assert!(EVERY.as_millis() + PATIENCE.as_millis() < HELD.as_millis()) };
    }
}
