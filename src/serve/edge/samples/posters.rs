//! The objects of a body that was posted -> the hub, for each address that posts. Pure but for waiting.
//!
//! Apart from the requests, since a poster outlives each of them.

use crate::serve::core::hub::{Asker, Client, Feedback, Flood, Hub, count, rates_in};
use crate::serve::core::owned::Owned;
use crate::serve::core::run_builder::RunBuilder;
use crate::serve::core::stream::run::SampleRun;
use crate::serve::edge::http::answer::response;
use crate::serve::guard::fault::Fault;
use crate::serve::guard::losses::Lost;
use crate::serve::guard::peer::{Origin, Peer};
use crate::serve::protocol::wire::{self, Message};
use axum::body::Body;
use axum::http::{Response, StatusCode};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::{Line, Objects};
use tokio::time::{Instant, sleep};

/// Samples published at once: what is made of them must find room with those who watch.
const AT_ONCE: usize = 256;
/// Addresses that post, at once.
pub(super) const MAX_POSTERS: usize = 256;
/// Posters by address. A sensor stays its poster's for a while, as a datagram's its sender's:
/// requests are no connections, and two gyros in one attitude are no attitude.
#[derive(Debug, Default)]
pub(crate) struct Posters {
    known: Mutex<HashMap<IpAddr, KnownAddress>>,
}

#[derive(Debug)]
struct KnownAddress {
    heard: Instant,
    poster: Arc<tokio::sync::Mutex<Poster>>,
}

/// One address, and the sensors it sends.
#[derive(Debug)]
pub(super) struct Poster {
    hub: Arc<Hub>,
    client: Arc<Client>,
    owned: Owned,
}

/// Outcome of a body.
#[derive(Debug, Default)]
pub(super) struct PostOutcome {
    objects: u64,
    samples: u64,
    resets: u64,
    errors: u64,
    first: Option<Value>,
    /// Notes of sensors whose run began anew, and why.
    notes: Vec<String>,
}

/// Request of an object.
enum Posted {
    Samples(Line),
    Reset(Result<wire::Reset, Fault>),
}

impl Posters {
    fn known(&self) -> MutexGuard<'_, HashMap<IpAddr, KnownAddress>> {
        // Every change is whole before anything could panic.
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The one at this address; `None` when there are too many others.
    pub(super) fn find(
        self: &Arc<Posters>,
        hub: &Arc<Hub>,
        from: IpAddr,
    ) -> Option<Arc<tokio::sync::Mutex<Poster>>> {
        let mut known = self.known();
        if known.len() >= MAX_POSTERS && !known.contains_key(&from) {
            return None;
        }
        let entry = known.entry(from).or_insert_with(|| {
            tokio::spawn(self.clone().forget_when_silent(from, hub.clone()));
            KnownAddress {
                heard: Instant::now(),
                poster: Arc::new(tokio::sync::Mutex::new(Poster::new(hub, from))),
            }
        });
        entry.heard = Instant::now();
        Some(entry.poster.clone())
    }

    /// Gives its sensors free once it has posted nothing for a while.
    async fn forget_when_silent(self: Arc<Posters>, from: IpAddr, hub: Arc<Hub>) {
        let silence = hub.limits().sender_silence;
        loop {
            sleep(silence / 4).await;
            let mut known = self.known();
            let is_silent = known.get(&from).is_none_or(|one| {
                one.heard.elapsed() >= silence && Arc::strong_count(&one.poster) == 1
            });
            if is_silent {
                known.remove(&from);
                return;
            }
        }
    }
}

impl Poster {
    fn new(hub: &Arc<Hub>, from: IpAddr) -> Poster {
        Poster {
            client: hub.join(Peer {
                name: format!("http://{from}"),
                origin: Origin::Address(from),
            }),
            hub: hub.clone(),
            owned: Owned::default(),
        }
    }

    /// Takes the samples of a body, whose objects are of the sensor `name` where they do not say.
    pub(super) async fn take(
        &mut self,
        objects: Objects<'_>,
        name: Option<&str>,
        received: Nanos,
    ) -> PostOutcome {
        let mut taken = PostOutcome::default();
        let mut run = RunBuilder::default();
        let mut in_a_row = 0;
        for object in objects {
            taken.objects += 1;
            let before = run.samples.len();
            let (number, near, read) = match object {
                Ok(object) => (object.number, object.bytes, {
                    count(&self.hub.counters.bytes_in, object.bytes.len());
                    self.sample(object.bytes, received, &mut run.samples)
                }),
                Err((number, why)) => (number, &[][..], Err(wire::undecodable(&why))),
            };
            count(&self.hub.counters.lines, 1);
            match read {
                Ok(Posted::Reset(mut asked)) => {
                    self.publish(&mut run, usize::MAX, received, &mut taken)
                        .await;
                    if let Ok(wire::Reset {
                        sensors: wire::Sensors::One(id),
                        ..
                    }) = &mut asked
                    {
                        *id = id.take().or(name.map(str::to_owned));
                    }
                    match self.hub.reset(asked, Asker::Client(self.client.number)) {
                        Ok((_, done)) => {
                            (in_a_row, taken.resets) = (0, taken.resets + done.len() as u64);
                        }
                        Err(fault) => taken.fault(&self.hub, &fault, number, near),
                    }
                }
                Ok(Posted::Samples(mut head)) => {
                    in_a_row = 0;
                    head.id = head.id.or(name.map(str::to_owned));
                    if !run.goes_on_in(&head) {
                        self.publish(&mut run, before, received, &mut taken).await;
                    }
                    run.add(head, (number, near));
                    if run.samples.len() >= AT_ONCE {
                        self.publish(&mut run, usize::MAX, received, &mut taken)
                            .await;
                    }
                }
                Err(fault) => {
                    self.publish(&mut run, usize::MAX, received, &mut taken)
                        .await;
                    self.owned.undecodable(&self.hub, &self.client);
                    taken.fault(&self.hub, &fault, number, near);
                    self.hub.losses.add(&Lost {
                        source: name.unwrap_or(&self.client.peer.name),
                        fault: &fault,
                        first: (number, near),
                        count: 1,
                        is_whole: !self.owned.has_sent(),
                    });
                    in_a_row += 1;
                    if in_a_row > self.hub.limits().errors_in_a_row {
                        break;
                    }
                }
            }
        }
        self.publish(&mut run, usize::MAX, received, &mut taken)
            .await;
        taken
    }

    /// Reads one object, which must hold samples.
    fn sample(
        &self,
        bytes: &[u8],
        received: Nanos,
        samples: &mut Vec<RawSample>,
    ) -> Result<Posted, Fault> {
        let before = samples.len();
        match wire::read(self.hub.decoder(), bytes, received, samples)? {
            Message::Samples(_) if !self.hub.takes_samples() => {
                count(&self.hub.counters.refused_samples, samples.len() - before);
                samples.truncate(before);
                Err(wire::samples_not_taken())
            }
            Message::Samples(head) => Ok(Posted::Samples(head)),
            Message::Reset(asked) => Ok(Posted::Reset(asked)),
            _ => Err(Fault::new(
                "unknown_class",
                "only samples and RESET are posted; what is answered is asked over a WebSocket at /ws",
            )),
        }
    }

    /// Gives the first `until` samples gathered to the hub, not all at once.
    async fn publish(
        &mut self,
        gathered: &mut RunBuilder,
        until: usize,
        received: Nanos,
        taken: &mut PostOutcome,
    ) {
        let Some(run) = gathered.run(self.client.number, received, until) else {
            return;
        };
        let all = run.samples.len();
        let mut text = Vec::new();
        let mut flood = Flood::default();
        for from in (0..all).step_by(AT_ONCE) {
            let to = (from + AT_ONCE).min(all);
            let part = SampleRun {
                lines: &within(run.lines, from, to),
                samples: run.samples.get(from..to).unwrap_or_default(),
                bare: run
                    .bare
                    .get(from..to.min(run.bare.len()))
                    .unwrap_or_default(),
                ..run
            };
            match self
                .owned
                .publish(&self.hub, &self.client, &part, &mut text)
            {
                Ok(feedback) => taken.part(&self.hub, &part, feedback),
                Err(fault) => {
                    taken.fault(&self.hub, &fault, part.first.0, part.first.1);
                    taken.errors += (part.lines.len() as u64).saturating_sub(1);
                }
            }
            if to < all || to - from == AT_ONCE {
                flood.hold();
                flood.wait(&self.hub).await;
                tokio::task::yield_now().await;
            }
        }
        gathered.clear(until);
    }
}

impl Drop for Poster {
    fn drop(&mut self) {
        self.owned.leave(&self.hub, &self.client);
    }
}

/// Number of these objects that so many samples are, counted from the end.
fn objects_of(lines: &[(Option<u64>, usize)], samples: u64) -> u64 {
    let all = lines.last().map_or(0, |(_, end)| *end);
    let used = all.saturating_sub(usize::try_from(samples).unwrap_or(usize::MAX));
    lines.iter().filter(|(_, end)| *end > used).count() as u64
}

/// The part of some lines that lies between two samples; a line that began before has no number there.
fn within(lines: &[(Option<u64>, usize)], from: usize, to: usize) -> Vec<(Option<u64>, usize)> {
    let mut start = 0;
    let mut part = Vec::new();
    for (seq, end) in lines {
        if *end > from && start < to {
            part.push((seq.filter(|_| start >= from), (*end).min(to) - from));
        }
        start = *end;
    }
    part
}

impl PostOutcome {
    /// Counts a part of a run that was used, and what is said of it.
    fn part(&mut self, hub: &Hub, part: &SampleRun<'_>, Feedback { note, faults, lost }: Feedback) {
        self.samples += rates_in(part.samples) as u64;
        if let Some(note) = note {
            self.notes.push(format!("{}: {}", part.id(), note.message));
        }
        // Said once for a sensor, and counted for each object.
        let said = faults.len() as u64;
        for fault in faults {
            self.fault(hub, &fault, 0, &[]);
        }
        if let Some((fault, samples)) = lost {
            self.errors += objects_of(part.lines, samples).saturating_sub(said);
            let (number, near) = part.first;
            self.first
                .get_or_insert_with(|| wire::error_object(&fault, number, near, 0));
        }
    }

    fn fault(&mut self, hub: &Hub, fault: &Fault, number: u64, near: &[u8]) {
        count(&hub.counters.faults, 1);
        self.errors += 1;
        self.first
            .get_or_insert_with(|| wire::error_object(fault, number, near, 0));
    }

    pub(super) fn answer(self) -> Response<Body> {
        let status = match self.first {
            None => StatusCode::OK,
            Some(_) => StatusCode::BAD_REQUEST,
        };
        let mut answer = self.first.unwrap_or_else(|| json!({"class": "SAMPLES"}));
        if let Some(fields) = answer.as_object_mut() {
            for (name, n) in [
                ("objects", self.objects),
                ("samples", self.samples),
                ("errors", self.errors),
            ] {
                fields.insert(name.to_owned(), n.into());
            }
            if self.resets > 0 {
                fields.insert("resets".to_owned(), self.resets.into());
            }
            if !self.notes.is_empty() {
                fields.insert("notes".to_owned(), self.notes.into());
            }
        }
        response(status, "application/json", format!("{answer}\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::within;

    #[test]
    fn an_object_cut_in_two_has_its_number_in_its_first_part() {
        let lines = [(Some(1), 100), (Some(2), 700), (Some(3), 710)];
        assert_eq!(within(&lines, 0, 256), [(Some(1), 100), (Some(2), 256)]);
        assert_eq!(within(&lines, 256, 512), [(None, 256)]);
        assert_eq!(within(&lines, 512, 710), [(None, 188), (Some(3), 198)]);
    }
}
