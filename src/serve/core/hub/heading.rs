//! `HEADING` -> the sensor it is for. Locks.

use super::{Client, Hub, Sensor, count, lock, read};
use crate::serve::guard::fault::Fault;
use crate::serve::protocol::wire::{MeasuredHeading, NAMELESS};

impl Hub {
    /// Takes a heading that something else has measured, from whatever connection: what measures it is seldom what sends
    /// the samples. One connection for a sensor, as long as it is there.
    ///
    /// # Errors
    /// The fault to answer with: it was not said as it should, there is no such sensor, nothing can use it, another
    /// connection measures it, or this is a replay.
    pub fn heading(
        &self,
        asked: Result<MeasuredHeading, Fault>,
        client: &Client,
    ) -> Result<(), Fault> {
        let taken = asked.and_then(|asked| self.take_heading(&asked, client));
        let counter = match taken {
            Ok(()) => &self.counters.headings,
            Err(_) => &self.counters.refused_headings,
        };
        count(counter, 1);
        taken
    }

    fn take_heading(&self, asked: &MeasuredHeading, client: &Client) -> Result<(), Fault> {
        let id = asked.id.as_deref().unwrap_or(NAMELESS);
        let fault = |code, what: &str| Fault {
            id: Some(id.to_owned()),
            ..Fault::new(code, what)
        };
        if !self.takes_samples() {
            return Err(fault(
                "heading_not_taken",
                "this is a replay or a simulation, which has its own samples; strapd serve takes HEADING",
            ));
        }
        let sensor = read(&self.sensors.by_id).get(id).cloned();
        let unknown = || {
            fault(
                "unknown_sensor",
                "no samples have come of a sensor of this name, whose heading it could be; POLL says which there are",
            )
        };
        let sensor = sensor.ok_or_else(unknown)?;
        let mut sensor = lock(&sensor);
        if sensor.gave_way || sensor.stream.span().is_none() {
            return Err(unknown());
        }
        if self.is_measured_by_another(&sensor, client.number) {
            return Err(fault(
                "heading_in_use",
                "another connection measures the heading of this sensor",
            ));
        }
        if !sensor.stream.take_heading(asked.stamp, asked.measured) {
            return Err(fault(
                "heading_not_taken",
                "no vertical is known of this sensor to turn about (--aid none, or it carries no specific force)",
            ));
        }
        sensor.heading_by = Some(client.number);
        Ok(())
    }

    fn is_measured_by_another(&self, sensor: &Sensor, client: u64) -> bool {
        let is_there = |other: u64| read(&self.clients.by_number).contains_key(&other);
        sensor
            .heading_by
            .is_some_and(|other| other != client && is_there(other))
    }
}
