//! The samples of one sensor from lines of JSON, or rows of a table, as they come -> whoever takes them. I/O.
//!
//! Apart from the log in a text because nothing is read twice: of a stream the first sensor is the one that is meant,
//! and what is known goes on before the next line is waited for.

use super::bare_stamps::BareStamps;
use super::channel_route::Item;
use super::early_besides::{EarlyBesides, are_beside};
use super::line_input::{are_judged, described, is_sure, no_samples, unclear};
use super::payload_type::PayloadType;
use super::selection::Selection;
use crate::attitude_line::TRUTH_ID;
use crate::decode::{Class, Undecodable};
use crate::delimited::Table;
use crate::error::Error;
use crate::format::Format;
use crate::lines::Lines;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;
use strapd_attitude::condition::Clock;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::{Declared, Nanos};
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

/// Whoever takes what is read from lines.
pub trait SensorTaker<E> {
    /// The sensor is known.
    ///
    /// # Errors
    /// It is not taken.
    fn meet(&mut self, sensor: Sensor) -> Result<(), E>;
    /// The next items, to be taken out of the vector; whether more are wanted.
    ///
    /// # Errors
    /// They cannot be taken.
    fn take(&mut self, items: &mut Vec<Item>) -> Result<ControlFlow<()>, E>;
    /// The next line may be long in coming.
    ///
    /// # Errors
    /// What waits cannot be handed on.
    fn pause(&mut self) -> Result<(), E>;
}

/// Reads lines to their end, or until nobody wants them.
///
/// # Errors
/// They cannot be read; no samples, or without stamps where `clock` wants any; several sensors and none selected; as
/// `taker`.
pub fn read<E: From<Error>>(
    (selection, clock): (&Selection, Clock),
    mut lines: Lines<impl Read>,
    path: &Path,
    taker: &mut impl SensorTaker<E>,
) -> Result<(), E> {
    let format = lines.format();
    let mut sensor: Option<String> = None;
    let mut bare = BareStamps::default();
    // Rows under a header that is known are of a table, though the first be none.
    let (mut early, mut first_bad) = (Vec::new(), None);
    let mut early_besides = EarlyBesides::default();
    let mut has_rates = false;
    let is_judged = clock == Clock::Header && are_judged(&lines, &selection.decode);
    let refused = |bare: &BareStamps| match bare.too_fast().filter(|_| is_judged) {
        Some(found) => Err(Error::unsupported(path, found.in_file(format.is_table()))),
        None => Ok(()),
    };
    let mut samples = Vec::new();
    let mut items = Vec::with_capacity(BATCH);
    let mut closed = false;
    while !closed && let Some(line) = lines.next(&mut samples)? {
        match line {
            Err(why) if sensor.is_none() => {
                first_bad.get_or_insert_with(|| no_samples(path, &lines, &why));
                if !is_sure(&lines, early.len()) {
                    break;
                }
                early.push(undecodable(lines.number(), why));
            }
            Err(why) => items.push(undecodable(lines.number(), why)),
            // Of another sensor of the device than the gyro.
            Ok(line) if are_beside(&line, &mut samples) => match &sensor {
                None if lines.number() > PATIENCE => return Err(nothing(path, format).into()),
                None => early_besides.hold(line, &mut samples),
                Some(own) if line.id.as_ref().is_none_or(|id| id == own) => {
                    let known = bare.take(&mut samples, &line);
                    let known = known.map_err(|what| unclear(path, &what))?;
                    items.extend(known.map(|raw| Item::Sample(0, raw)));
                }
                Some(_) => samples.clear(),
            },
            Ok(mut line) => {
                // A sample of our own whose rate is null was one with NaN: it is counted, not
                // passed over.
                let is_sample = line.class == Class::Rate && !samples.is_empty();
                let has_rate = samples.iter().any(|s| s.gyro.is_some());
                if !is_sample && !has_rate {
                    // Attitudes, status and the like between the samples.
                    samples.clear();
                    if sensor.is_none() && lines.number() > PATIENCE {
                        return Err(nothing(path, format).into());
                    }
                    continue;
                }
                let id = line.id.take().unwrap_or_default();
                // An attitude carries the rate behind it, which makes it a sample where there is
                // nothing else: not beside samples, and not when it is the truth about them.
                let truth = id == TRUTH_ID && selection.topic.as_deref() != Some(TRUTH_ID);
                if line.class == Class::Att && (has_rates || truth) {
                    samples.clear();
                    continue;
                }
                if selection
                    .topic
                    .as_deref()
                    .is_some_and(|t| t != "all" && t != id)
                {
                    samples.clear();
                    continue;
                }
                has_rates |= line.class == Class::Rate;
                match &sensor {
                    None => {
                        let declared = Declared {
                            sample_kind: line.sample_kind,
                            gyro_unit: line.gyro_unit,
                            interval_unit_given: selection.decode.states_interval_unit(),
                            ..lines.declared()
                        };
                        let is_placed = matches!(clock, Clock::Index { .. })
                            || lines.table().is_none_or(Table::has_stamps);
                        if !is_placed {
                            return Err(unplaced(path, &lines).into());
                        }
                        taker.meet(Sensor::of(&id, &lines, declared))?;
                        items.append(&mut early);
                        for (line, mut samples) in early_besides.release(&id) {
                            let known = bare.take(&mut samples, &line);
                            let known = known.map_err(|what| unclear(path, &what))?;
                            items.extend(known.map(|raw| Item::Sample(0, raw)));
                        }
                        sensor = Some(id);
                    }
                    Some(first) if *first != id => {
                        return Err(Error::Topic {
                            path: path.to_owned(),
                            topic: first.clone(),
                            what: Diagnostic::new(format!(
                                "line {}: samples of another sensor, `{id}`",
                                lines.number()
                            ))
                            .help(format!(
                                "{TOPIC} ID takes one of them, and of a file {TOPIC} all each"
                            )),
                        }
                        .into());
                    }
                    Some(_) => {}
                }
                let known = bare.take(&mut samples, &line);
                let known = known.map_err(|what| unclear(path, &what))?;
                items.extend(known.map(|raw| Item::Sample(0, raw)));
                if bare.steps() == STEPS {
                    refused(&bare)?;
                }
            }
        }
        // With nothing left in the buffer the next line may be long in coming: what is known goes
        // out first.
        let may_wait = lines.may_wait();
        if sensor.is_some() && (items.len() >= BATCH || may_wait) {
            closed = taker.take(&mut items)?.is_break();
        }
        if sensor.is_some() && may_wait {
            taker.pause()?;
        }
    }
    if sensor.is_none() {
        return Err(first_bad.unwrap_or_else(|| nothing(path, format)).into());
    }
    if bare.steps() < STEPS {
        refused(&bare)?;
    }
    let last = bare.settle().map_err(|what| unclear(path, &what))?;
    items.extend(last.map(|raw| Item::Sample(0, raw)));
    let _ = taker.take(&mut items)?;
    Ok(())
}

fn undecodable(number: u64, why: Undecodable) -> Item {
    let number = Nanos(i64::try_from(number).unwrap_or(i64::MAX));
    Item::Undecodable(0, Box::new((number, why)))
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
