//! `RESET` -> the sensor it is for, where who asks may ask. Locks.

use super::{Hub, Sensor, count, lock, read};
use crate::serve::core::stream::resetting::Promise;
use crate::serve::guard::fault::Fault;
use crate::serve::guard::log_throttle;
use crate::serve::protocol::wire::{Reset, Sensors};
use std::collections::BTreeSet;
use strapd_recording::text::printable;

const NOTHING: &str = "no samples have come of a sensor of this name, so that there is nothing to begin anew; POLL says which there are";

/// Client that asks for something of a sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Asker {
    /// A connection: of the sensors it sends, or that nobody sends.
    Client(u64),
    /// A page of the daemon itself, or a program that posts to `/reset`: of all of them.
    OwnPage,
}

/// Outcome of a request: the sensors' names, and in words where each will begin.
type Done = Vec<(String, &'static str)>;

impl Hub {
    /// Attitudes begin anew with the next sample of each sensor. What was asked comes back, and in words where each will
    /// begin.
    ///
    /// # Errors
    /// The fault to answer with: nothing was asked that can be, there is no such sensor, another connection sends it,
    /// it cannot begin so, or this is a replay. Nothing has changed then.
    pub fn reset(&self, asked: Result<Reset, Fault>, asker: Asker) -> Result<(Reset, Done), Fault> {
        let done = asked.and_then(|asked| {
            let done = self.reset_sensors(&asked, asker)?;
            Ok((asked, done))
        });
        match &done {
            Ok((_, done)) => {
                count(&self.counters.resets, done.len());
                let who = match done.as_slice() {
                    [(id, _)] => printable(id),
                    several => format!("{} sensors", several.len()),
                };
                log_throttle::info(&format!("reset {who}"), &format!("{who}: RESET"));
            }
            Err(_) => count(&self.counters.refused_resets, 1),
        }
        done
    }

    fn reset_sensors(&self, asked: &Reset, asker: Asker) -> Result<Done, Fault> {
        if !self.takes_samples() {
            return Err(Fault {
                id: asked.sensors.only().map(str::to_owned),
                ..Fault::new(
                    "reset_not_taken",
                    "this is a replay or a simulation: its attitudes are those of its samples from the start, whoever looks; strapd serve takes RESET",
                )
            });
        }
        let names: BTreeSet<String> = match &asked.sensors {
            Sensors::These(ids) => ids.clone(),
            Sensors::All => read(&self.sensors.by_id)
                .keys()
                .map(ToString::to_string)
                .collect(),
            one @ Sensors::One(_) => one.only().map(str::to_owned).into_iter().collect(),
        };
        let is_all = asked.sensors == Sensors::All;
        let found: Vec<_> = {
            let by_id = read(&self.sensors.by_id);
            let found = names.into_iter().map(|id| {
                let sensor = by_id.get(id.as_str()).cloned();
                sensor
                    .ok_or_else(|| unknown(&id))
                    .map(|sensor| (id, sensor))
            });
            found.collect::<Result<_, _>>()?
        };
        // One instant: none of them takes a sample before the last is told. Locked by the order of their names, so that
        // nobody waits for who waits for him.
        let held: Vec<_> = found
            .iter()
            .map(|(id, sensor)| (id, lock(sensor)))
            .collect();
        let mut promised = Vec::with_capacity(held.len());
        let mut first_fault = None;
        for (id, sensor) in held {
            match self.judged(id, &sensor, asked, asker) {
                Ok(promise) => promised.push((id, sensor, promise)),
                // Of all, who cannot is not meant.
                Err(fault) if is_all => first_fault = first_fault.or(Some(fault)),
                Err(fault) => return Err(fault),
            }
        }
        match first_fault {
            Some(fault) if promised.is_empty() => Err(fault),
            _ if promised.is_empty() => Err(Fault::new("unknown_sensor", NOTHING)),
            _ => Ok(promised
                .into_iter()
                .map(|(id, mut sensor, promise)| (id.clone(), sensor.stream.promise(promise)))
                .collect()),
        }
    }

    /// Whether a sensor may begin anew as asked; nothing changes yet.
    fn judged(
        &self,
        id: &str,
        sensor: &Sensor,
        asked: &Reset,
        asker: Asker,
    ) -> Result<Promise, Fault> {
        // Its place was made for samples that are still to be taken: nobody is known to send it yet.
        let is_new = sensor.owner.is_none() && sensor.stream.span().is_none();
        if sensor.gave_way || is_new {
            return Err(unknown(id));
        }
        let fault = |code, what: &str| Fault {
            id: Some(id.to_owned()),
            ..Fault::new(code, what)
        };
        let is_others = |client: u64| {
            sensor.owner.is_some_and(|owner| owner != client) && !self.is_left(sensor)
        };
        if matches!(asker, Asker::Client(client) if is_others(client)) {
            return Err(fault(
                "id_in_use",
                "another connection sends the samples of this sensor, and only that (or the daemon's own page, or POST /reset) may begin its attitude anew",
            ));
        }
        let plan = self.sensors.plan_of(id);
        let judged = sensor.stream.judge_reset(plan, asked.beginning);
        judged.map_err(|why| fault("bad_reset", &why))
    }
}

/// Fault of a name that no sensor has.
fn unknown(id: &str) -> Fault {
    Fault {
        id: Some(id.to_owned()),
        ..Fault::new("unknown_sensor", NOTHING)
    }
}
