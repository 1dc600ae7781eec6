//! The samples of one sensor from lines of JSON, or rows of a table, as they come -> whoever takes them. I/O.
//!
//! Apart from the log in a text because nothing is read twice: of a stream the first sensor is the one that is meant,
//! and what is known goes on before the next line is waited for.

use super::bare_stamps::BareStamps;
use super::channel_route::Item;
use super::line_input::{are_judged, described};
use super::line_reader::{self, Key, LineEvent, Sensors};
use super::log_channel::nanos;
use super::payload_type::PayloadType;
use super::selection::Selection;
use crate::attitude_line::TRUTH_ID;
use crate::decode::{Class, Line, Options};
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

/// Next of what is read of one sensor.
#[derive(Debug)]
pub enum SensorEvent<'i> {
    /// The sensor, before all its items.
    Met(Sensor),
    /// Items, to be taken out of the vector.
    Items(&'i mut Vec<Item>),
    /// Nothing, perhaps for long.
    Pause,
}

/// Reads lines to their end, or until nobody wants them.
///
/// # Errors
/// They cannot be read; no samples, or without stamps where `clock` wants any; several sensors and none selected; as
/// `take`, which says whether more are wanted.
pub fn read<E: From<Error>>(
    (selection, clock): (&Selection, Clock),
    mut lines: Lines<impl Read>,
    path: &Path,
    mut take: impl FnMut(SensorEvent<'_>) -> Result<ControlFlow<()>, E>,
) -> Result<(), E> {
    let format = lines.format();
    let is_judged = clock == Clock::Header && are_judged(&lines, &selection.decode);
    let mut choice = SensorChoice {
        selection,
        path,
        id: None,
        has_rates: false,
    };
    let (mut is_met, mut items) = (false, Vec::with_capacity(BATCH));
    let of_line = |event: LineEvent<'_, _>| -> Result<_, E> {
        match event {
            LineEvent::Met((id, _), line, lines) => {
                is_met = true;
                let sensor = sensor(id, line, lines, &selection.decode);
                let is_placed = matches!(clock, Clock::Index { .. })
                    || lines.table().is_none_or(Table::has_stamps);
                if !is_placed {
                    return Err(unplaced(path, lines).into());
                }
                return take(SensorEvent::Met(sensor));
            }
            LineEvent::Samples(_, samples) => {
                items.extend(samples.iter().map(|raw| Item::Sample(0, *raw)));
            }
            LineEvent::Undecodable(_, number, why) => {
                items.push(Item::Undecodable(0, Box::new((nanos(number), why))));
            }
            LineEvent::Held(lines) if !is_met => has_patience(path, lines)?,
            LineEvent::LineOver(lines, sensors) if is_met => {
                if is_judged && steps_of(sensors) == STEPS {
                    sensors.check_nanos(path, format)?;
                }
                // With nothing left in the buffer the next line may be long in coming: what is known goes out first.
                let may_wait = lines.may_wait();
                if may_wait || items.len() >= BATCH {
                    let flow = take(SensorEvent::Items(&mut items))?;
                    if may_wait {
                        let _ = take(SensorEvent::Pause)?;
                    }
                    return Ok(flow);
                }
            }
            LineEvent::Held(_) | LineEvent::LineOver(..) => {}
        }
        Ok(ControlFlow::Continue(()))
    };
    let sensor_of = |line: &mut Line, samples: &[RawSample], lines: &Lines<_>| {
        let found = choice.sensor_of(line, samples, lines);
        found.map_err(E::from)
    };
    let sensors = line_reader::read(&mut lines, path, sensor_of, of_line)?;
    if !is_met {
        return Err(nothing(path, format).into());
    }
    if is_judged && steps_of(&sensors) < STEPS {
        sensors.check_nanos(path, format)?;
    }
    let _ = take(SensorEvent::Items(&mut items))?;
    Ok(())
}

/// The one sensor that is taken of a stream: the one selected, or the first.
struct SensorChoice<'r> {
    selection: &'r Selection,
    path: &'r Path,
    /// Id of the sensor, once it is known.
    id: Option<String>,
    has_rates: bool,
}

impl SensorChoice<'_> {
    fn sensor_of(
        &mut self,
        line: &mut Line,
        samples: &[RawSample],
        lines: &Lines<impl Read>,
    ) -> Result<Option<Key>, Error> {
        // A sample of our own whose rate is null was one with NaN: it is counted, not passed over.
        let is_sample = line.class == Class::Rate && !samples.is_empty();
        if !is_sample && samples.iter().all(|s| s.gyro.is_none()) {
            // Attitudes, status and the like between the samples.
            if self.id.is_none() {
                has_patience(self.path, lines)?;
            }
            return Ok(None);
        }
        let id = line.id.take().unwrap_or_default();
        let named = self.selection.topic.as_deref();
        // An attitude carries the rate behind it, which makes it a sample where there is
        // nothing else: not beside samples, and not when it is the truth about them.
        let is_truth = id == TRUTH_ID && named != Some(TRUTH_ID);
        let is_passed_over = line.class == Class::Att && (self.has_rates || is_truth);
        if is_passed_over || named.is_some_and(|name| name != "all" && name != id) {
            return Ok(None);
        }
        self.has_rates |= line.class == Class::Rate;
        let first = self.id.get_or_insert_with(|| id.clone());
        if *first == id {
            return Ok(Some((id, false)));
        }
        let number = lines.number();
        Err(Error::Topic {
            path: self.path.to_owned(),
            topic: first.clone(),
            what: Diagnostic::new(format!("line {number}: samples of another sensor, `{id}`"))
                .help(format!(
                    "{TOPIC} ID takes one of them, and of a file {TOPIC} all each"
                )),
        })
    }
}

fn sensor(id: &str, line: &Line, lines: &Lines<impl Read>, options: &Options) -> Sensor {
    Sensor {
        name: if id.is_empty() { "imu" } else { id }.to_owned(),
        described: described(lines),
        declared: Declared {
            sample_kind: line.sample_kind,
            gyro_unit: line.gyro_unit,
            interval_unit_given: options.states_interval_unit(),
            ..lines.declared()
        },
        notes: lines.notes(),
        doubt: lines.table().and_then(Table::doubt_of_unit),
    }
}

fn steps_of(sensors: &Sensors) -> u64 {
    sensors.bare.first().map_or(0, BareStamps::steps)
}

/// Whether a text without any sample so far may still be one of samples.
fn has_patience(path: &Path, lines: &Lines<impl Read>) -> Result<(), Error> {
    match lines.number() > PATIENCE {
        true => Err(nothing(path, lines.format())),
        false => Ok(()),
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
