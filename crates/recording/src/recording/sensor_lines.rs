//! The samples of one sensor from lines of JSON, or rows of a table, as they come -> whoever takes them. I/O.
//!
//! Apart from the log in a text because nothing is read twice: of a stream the first sensor is the one that is meant,
//! and what is known goes on before the next line is waited for.

use super::channel_route::Item;
use super::line_input::{are_judged, described};
use super::line_reader::{self, Key, LineEvent, LineTaker, Sensors};
use super::log_channel::nanos;
use super::payload_type::PayloadType;
use super::selection::Selection;
use crate::attitude_line::TRUTH_ID;
use crate::decode::{Class, Line};
use crate::delimited::Table;
use crate::error::Error;
use crate::format::Format;
use crate::lines::Lines;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;
use strapd_attitude::condition::Clock;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::{Declared, RawSample};
use strapd_attitude::setting::{COLUMNS, FIELD, RATE_HZ, TIME, TOPIC};

/// Samples that are handed over together.
const BATCH: usize = 2048;
/// Steps between stamps after which the unit of their name is judged; fewer are judged at the end.
const STEPS: u64 = 4096;
/// Lines without any sample before the first, after which this is no log of samples.
const PATIENCE: u64 = 1000;

/// The sensor of a text, known by its first sample.
#[derive(Debug)]
pub struct Sensor {
    /// Name.
    pub name: String,
    /// Text of how its lines are read.
    pub described: PayloadType,
    /// Meaning of all its samples that its format declares.
    pub declared: Declared,
    /// Notes for the reader of its tables.
    pub notes: Vec<String>,
    /// Why the unit of its rates may be another one.
    pub doubt: Option<String>,
}

impl Sensor {
    fn of(id: &str, lines: &Lines<impl Read>, declared: Declared) -> Sensor {
        Sensor {
            name: if id.is_empty() { "imu" } else { id }.to_owned(),
            described: described(lines),
            declared,
            notes: lines.notes(),
            doubt: lines.table().and_then(Table::doubt_of_unit),
        }
    }
}

/// Receiver of the samples of one sensor.
pub trait SensorTaker {
    /// Reason to stop reading.
    type Error: From<Error>;

    /// The sensor is known.
    ///
    /// # Errors
    /// It is not taken.
    fn meet(&mut self, sensor: Sensor) -> Result<(), Self::Error>;
    /// The next items, to be taken out of the vector; whether more are wanted.
    ///
    /// # Errors
    /// They cannot be taken.
    fn take(&mut self, items: &mut Vec<Item>) -> Result<ControlFlow<()>, Self::Error>;
    /// The next line may be long in coming.
    ///
    /// # Errors
    /// What waits cannot be handed on.
    fn pause(&mut self) -> Result<(), Self::Error>;
}

/// Reads lines to their end, or until nobody wants them.
///
/// # Errors
/// They cannot be read; no samples, or without stamps where `clock` wants any; several sensors and none selected; as
/// `taker`.
pub fn read<T: SensorTaker>(
    (selection, clock): (&Selection, Clock),
    mut lines: Lines<impl Read>,
    path: &Path,
    taker: &mut T,
) -> Result<(), T::Error> {
    let format = lines.format();
    let is_judged = clock == Clock::Header && are_judged(&lines, &selection.decode);
    let mut one = OneSensor {
        selection,
        clock,
        path,
        taker,
        is_judged,
        id: None,
        has_rates: false,
        items: Vec::with_capacity(BATCH),
    };
    let sensors = line_reader::read(&mut lines, path, &mut one)?;
    let Some(bare) = sensors.bare.first() else {
        return Err(nothing(path, format).into());
    };
    if one.is_judged && bare.steps() < STEPS {
        sensors.check_nanos(path, format)?;
    }
    let _ = one.taker.take(&mut one.items)?;
    Ok(())
}

/// The one sensor that is taken of a stream.
struct OneSensor<'r, T> {
    selection: &'r Selection,
    clock: Clock,
    path: &'r Path,
    taker: &'r mut T,
    /// Whether stamps that are nanoseconds by their name are held against their steps.
    is_judged: bool,
    /// Id of the sensor, once it is known.
    id: Option<String>,
    has_rates: bool,
    items: Vec<Item>,
}

impl<R: Read, T: SensorTaker> LineTaker<R> for OneSensor<'_, T> {
    type Error = T::Error;

    fn sensor_of(
        &mut self,
        line: &mut Line,
        samples: &[RawSample],
        lines: &Lines<R>,
    ) -> Result<Option<Key>, T::Error> {
        // A sample of our own whose rate is null was one with NaN: it is counted, not passed over.
        let is_sample = line.class == Class::Rate && !samples.is_empty();
        if !is_sample && samples.iter().all(|s| s.gyro.is_none()) {
            // Attitudes, status and the like between the samples.
            self.hold(lines)?;
            return Ok(None);
        }
        let id = line.id.take().unwrap_or_default();
        let named = self.selection.topic.as_deref();
        // An attitude carries the rate behind it, which makes it a sample where there is
        // nothing else: not beside samples, and not when it is the truth about them.
        let is_truth = id == TRUTH_ID && named != Some(TRUTH_ID);
        if line.class == Class::Att && (self.has_rates || is_truth) {
            return Ok(None);
        }
        if named.is_some_and(|name| name != "all" && name != id) {
            return Ok(None);
        }
        self.has_rates |= line.class == Class::Rate;
        match &self.id {
            Some(first) if *first != id => Err(Error::Topic {
                path: self.path.to_owned(),
                topic: first.clone(),
                what: Diagnostic::new(format!(
                    "line {}: samples of another sensor, `{id}`",
                    lines.number()
                ))
                .help(format!(
                    "{TOPIC} ID takes one of them, and of a file {TOPIC} all each"
                )),
            }
            .into()),
            Some(_) => Ok(Some((id, false))),
            None => {
                self.meet(&id, line, lines)?;
                Ok(Some((id, false)))
            }
        }
    }

    fn take(&mut self, event: LineEvent<'_>) -> Result<ControlFlow<()>, T::Error> {
        match event {
            LineEvent::Met(..) => {}
            LineEvent::Samples(_, samples) => {
                let samples = samples.iter().map(|raw| Item::Sample(0, *raw));
                self.items.extend(samples);
            }
            LineEvent::Undecodable(_, number, why) => {
                let lost = Item::Undecodable(0, Box::new((nanos(number), why)));
                self.items.push(lost);
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    fn hold(&mut self, lines: &Lines<R>) -> Result<(), T::Error> {
        match &self.id {
            None if lines.number() > PATIENCE => Err(nothing(self.path, lines.format()).into()),
            _ => Ok(()),
        }
    }

    fn line_over(
        &mut self,
        lines: &Lines<R>,
        sensors: &Sensors,
    ) -> Result<ControlFlow<()>, T::Error> {
        let Some(bare) = sensors.bare.first() else {
            return Ok(ControlFlow::Continue(()));
        };
        if self.is_judged && bare.steps() == STEPS {
            sensors.check_nanos(self.path, lines.format())?;
        }
        // With nothing left in the buffer the next line may be long in coming: what is known goes
        // out first.
        let may_wait = lines.may_wait();
        let mut flow = ControlFlow::Continue(());
        if self.items.len() >= BATCH || may_wait {
            flow = self.taker.take(&mut self.items)?;
        }
        if may_wait {
            self.taker.pause()?;
        }
        Ok(flow)
    }
}

impl<T: SensorTaker> OneSensor<'_, T> {
    fn meet(&mut self, id: &str, line: &Line, lines: &Lines<impl Read>) -> Result<(), T::Error> {
        let declared = Declared {
            sample_kind: line.sample_kind,
            gyro_unit: line.gyro_unit,
            interval_unit_given: self.selection.decode.states_interval_unit(),
            ..lines.declared()
        };
        let has_stamps = lines.table().is_none_or(Table::has_stamps);
        if !has_stamps && !matches!(self.clock, Clock::Index { .. }) {
            return Err(unplaced(self.path, lines).into());
        }
        self.id = Some(id.to_owned());
        self.taker.meet(Sensor::of(id, lines, declared))
    }
}

fn nothing(path: &Path, format: Format) -> Error {
    let what = match format {
        format if format.is_table() => {
            Diagnostic::new(
                "no row carries a body rate",
            )
            .help(format!(
                "columns gyro_x, gyro_y, gyro_z, in rad/s, or {COLUMNS} gyro=NAME:NAME:NAME"
            ))
        }
        _ => {
            Diagnostic::new(
                "no line carries a body rate",
            )
            .help(format!(
                "{{\"class\":\"RATE\",\"stamp\":{{\"sec\":1,\"nsec\":0}},\"gyro\":[0.1,0,0]}}, or {FIELD} gyro=PATH"
            ))
        }
    };
    Error::Unsupported {
        path: path.to_owned(),
        what,
    }
}

/// Rows without stamps, and nothing said of it.
fn unplaced(path: &Path, lines: &Lines<impl Read>) -> Error {
    let notes = lines.table().map(Table::notes).unwrap_or_default();
    Error::Unsupported {
        path: path.to_owned(),
        what: Diagnostic::new(format!(
            "no row says when it was measured\n  note: {}",
            notes.join("; ")
        ))
        .help(format!(
            "{TIME} index {RATE_HZ} HZ, or {COLUMNS} stamp=NAME:UNIT"
        )),
    }
}
