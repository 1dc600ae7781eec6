//! `RESET` -> the sensor it is for, where who asks may ask. Locks.

use super::{Hub, count, lock, read};
use crate::serve::guard::fault::Fault;
use crate::serve::guard::log_throttle;
use crate::serve::protocol::wire::Reset;
use strapd_recording::text::printable;

/// Client that asks for something of a sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Asker {
    /// A connection: of the sensors it sends, or that nobody sends.
    Client(u64),
    /// A page of the daemon itself: of all of them.
    OwnPage,
}

impl Hub {
    /// A sensor's attitude begins anew with its next sample. What was asked comes back, and in words where it will
    /// begin.
    ///
    /// # Errors
    /// The fault to answer with: nothing was asked that can be, there is no such sensor, another connection sends it,
    /// it cannot begin so, or this is a replay.
    pub fn reset(
        &self,
        asked: Result<Reset, Fault>,
        asker: Asker,
    ) -> Result<(Reset, &'static str), Fault> {
        let done = asked.and_then(|asked| {
            let from = self.reset_sensor(&asked, asker)?;
            Ok((asked, from))
        });
        match &done {
            Ok((asked, _)) => {
                count(&self.counters.resets, 1);
                let id = printable(asked.sensor());
                log_throttle::info(&format!("reset {id}"), &format!("{id}: RESET"));
            }
            Err(_) => count(&self.counters.refused_resets, 1),
        }
        done
    }

    fn reset_sensor(&self, asked: &Reset, asker: Asker) -> Result<&'static str, Fault> {
        let fault = |code, what: &str| Fault {
            id: Some(asked.sensor().to_owned()),
            ..Fault::new(code, what)
        };
        if !self.takes_samples() {
            return Err(fault(
                "reset_not_taken",
                "this is a replay or a simulation: its attitudes are those of its samples from the start, whoever looks; strapd serve takes RESET",
            ));
        }
        let unknown = || {
            fault(
                "unknown_sensor",
                "no samples have come of a sensor of this name, so that there is nothing to begin anew; POLL says which there are",
            )
        };
        let sensor = read(&self.sensors.by_id).get(asked.sensor()).cloned();
        let sensor = sensor.ok_or_else(unknown)?;
        let mut sensor = lock(&sensor);
        // Its place was made for samples that are still to be taken: nobody is known to send it yet.
        let is_new = sensor.owner.is_none() && sensor.stream.span().is_none();
        if sensor.gave_way || is_new {
            return Err(unknown());
        }
        let is_others = |client: u64| {
            sensor.owner.is_some_and(|owner| owner != client) && !self.is_left(&sensor)
        };
        if matches!(asker, Asker::Client(client) if is_others(client)) {
            return Err(fault(
                "id_in_use",
                "another connection sends the samples of this sensor, and only that (or the daemon's own page) may begin its attitude anew",
            ));
        }
        let plan = self.sensors.plan_of(asked.sensor());
        sensor
            .stream
            .reset(plan, asked.beginning)
            .map_err(|why| fault("bad_reset", &why))
    }
}
