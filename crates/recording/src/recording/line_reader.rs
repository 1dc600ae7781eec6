//! Lines or rows -> the samples of their sensors, each with its stamp. I/O through the lines.
//!
//! Apart from those who take them because a text that is read as often as is needed, and one that comes once, begin
//! alike: with lines that are none, with forces that come before their gyro, with stamps whose unit is not known yet.

use super::bare_stamps::BareStamps;
use super::early_besides::{Early, EarlyBesides, are_beside};
use super::line_input::{is_sure, no_samples, unclear};
use crate::decode::{Class, Line, Undecodable};
use crate::error::Error;
use crate::format::Format;
use crate::lines::Lines;
use std::collections::BTreeMap;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;
use strapd_attitude::record::RawSample;

/// Sensors that are told apart. More are no sensors.
pub(super) const MOST_SENSORS: usize = 1024;

/// Name of a sensor, and whether these are its attitudes.
pub(super) type Key = (String, bool);

/// Content of a line, of the sensor of this place in the order of appearance.
#[derive(Debug)]
pub(super) enum LineEvent<'s, R> {
    /// A sensor that is new, its first line, and the samples in it.
    Met(&'s Key, &'s Line, &'s [RawSample]),
    /// Samples whose stamps are known by now; more may still wait.
    Samples(usize, &'s [RawSample]),
    /// Number of a line that holds none, behind one of this sensor.
    Undecodable(usize, u64, Undecodable),
    /// The end of a line.
    LineOver(&'s Lines<R>, &'s Sensors),
}

/// The sensors met so far, each with its samples whose stamps are not known yet.
#[derive(Default, Debug)]
pub(super) struct Sensors {
    places: BTreeMap<Key, usize>,
    pub(super) bare: Vec<BareStamps>,
    /// Lines of those that are too many.
    pub(super) left_out: u64,
}

impl Sensors {
    /// Returns the place of a sensor, behind all others if it is new; `None` where there are too many.
    fn place_of(&mut self, key: &Key) -> Option<usize> {
        let next = self.places.len();
        if let Some(place) = self.places.get(key) {
            return Some(*place);
        }
        let is_one_more = next >= MOST_SENSORS;
        self.left_out += u64::from(is_one_more);
        (!is_one_more).then_some(next)
    }

    /// Refuses stamps whose steps are those of a gyro only in another unit than their name says.
    pub(super) fn check_stated(&self, path: &Path, format: Format) -> Result<(), Error> {
        match self.bare.iter().find_map(BareStamps::too_fast) {
            Some(found) => Err(Error::unsupported(path, found.in_file(format.is_table()))),
            None => Ok(()),
        }
    }

    /// Adds a sensor that is new, with the lines beside its samples that came before it. Their samples whose stamps are
    /// known.
    fn add(&mut self, key: Key, early: Vec<Early>, path: &Path) -> Result<Vec<RawSample>, Error> {
        let (mut bare, mut known) = (BareStamps::default(), Vec::new());
        for (line, mut samples) in early {
            stamped(&mut bare, &mut samples, &line, path, &mut known)?;
        }
        self.places.insert(key, self.bare.len());
        self.bare.push(bare);
        Ok(known)
    }

    /// Hands over the samples that still wait at the end.
    fn settle<R, E: From<Error>>(
        &mut self,
        path: &Path,
        mut take: impl FnMut(LineEvent<'_, R>) -> Result<ControlFlow<()>, E>,
    ) -> Result<(), E> {
        for place in self.places.values() {
            let Some(bare) = self.bare.get_mut(*place) else {
                continue;
            };
            let last = bare.settle().map_err(|what| unclear(path, &what))?;
            let last: Vec<RawSample> = last.collect();
            if !last.is_empty() && take(LineEvent::Samples(*place, &last))?.is_break() {
                break;
            }
        }
        Ok(())
    }

    /// Returns the stamps of the sensor of this place that a line belongs to beside its samples.
    fn owner(&mut self, line: &Line, before: Option<usize>) -> Option<(usize, &mut BareStamps)> {
        let place = match &line.id {
            Some(id) => *self.places.get(&(id.clone(), false))?,
            None => before?,
        };
        Some((place, self.bare.get_mut(place)?))
    }
}

/// Returns the sensor of a line; `None` of status and the like between samples.
fn sensor_of(line: &mut Line, samples: &[RawSample]) -> Option<Key> {
    // A sample of our own whose rate is null was one with NaN: it is counted, not passed over.
    let is_own = line.class == Class::Rate && !samples.is_empty();
    let has_rate = is_own || samples.iter().any(|raw| raw.gyro.is_some());
    let is_sample = has_rate || samples.iter().any(|raw| raw.orientation.is_some());
    let is_attitude = line.class == Class::Att || !has_rate;
    is_sample.then(|| (line.id.take().unwrap_or_default(), is_attitude))
}

/// Reads a text to its end, or until `take` has enough.
///
/// # Errors
/// Text that cannot be read, or begins with no line of samples; stamps whose unit is not clear; what `take` fails with.
pub(super) fn read<R: Read, E: From<Error>>(
    lines: &mut Lines<R>,
    path: &Path,
    mut take: impl FnMut(LineEvent<'_, R>) -> Result<ControlFlow<()>, E>,
) -> Result<Sensors, E> {
    let mut sensors = Sensors::default();
    let (mut samples, mut known) = (Vec::new(), Vec::new());
    // The sensor of the line before, and the last one with rates.
    let (mut before, mut rated) = (None, None);
    // Rows under a header that is known are of a table, though the first be none.
    let (mut early, mut first_bad) = (Vec::new(), None);
    let mut early_besides = EarlyBesides::default();
    while let Some(line) = lines.next(&mut samples)? {
        known.clear();
        let of_line = match (line, before) {
            (Err(why), None) => {
                first_bad.get_or_insert_with(|| no_samples(path, lines, &why));
                if !is_sure(lines, early.len()) {
                    break;
                }
                early.push((lines.number(), why));
                None
            }
            (Err(why), Some(place)) => Some(LineEvent::Undecodable(place, lines.number(), why)),
            // Of another sensor of the device than the gyro.
            (Ok(line), _) if are_beside(&line, &mut samples) => match sensors.owner(&line, rated) {
                Some((place, bare)) => {
                    stamped(bare, &mut samples, &line, path, &mut known)?;
                    (!known.is_empty()).then_some(LineEvent::Samples(place, &known))
                }
                None => {
                    early_besides.hold(line, &mut samples);
                    None
                }
            },
            (Ok(mut line), _) => {
                let key = sensor_of(&mut line, &samples);
                let place = key.as_ref().and_then(|key| sensors.place_of(key));
                if let Some((key, place)) = key.zip(place) {
                    if place == sensors.bare.len() {
                        if take(LineEvent::Met(&key, &line, &samples))?.is_break() {
                            return Ok(sensors);
                        }
                        let early = early_besides.of(&key);
                        known.extend(sensors.add(key.clone(), early, path)?);
                    }
                    before = Some(place);
                    rated = if key.1 { rated } else { before };
                    for (number, why) in early.drain(..) {
                        let lost = LineEvent::Undecodable(place, number, why);
                        if take(lost)?.is_break() {
                            return Ok(sensors);
                        }
                    }
                    if let Some(bare) = sensors.bare.get_mut(place) {
                        stamped(bare, &mut samples, &line, path, &mut known)?;
                    }
                }
                // Those of a line that was passed over.
                samples.clear();
                place.map(|place| LineEvent::Samples(place, &known))
            }
        };
        if let Some(event) = of_line
            && take(event)?.is_break()
        {
            return Ok(sensors);
        }
        if take(LineEvent::LineOver(lines, &sensors))?.is_break() {
            return Ok(sensors);
        }
    }
    if let Some(why) = first_bad.filter(|_| before.is_none()) {
        return Err(why.into());
    }
    sensors.settle(path, take)?;
    Ok(sensors)
}

/// Appends the samples whose stamps are known with those of a line.
fn stamped(
    bare: &mut BareStamps,
    samples: &mut Vec<RawSample>,
    line: &Line,
    path: &Path,
    known: &mut Vec<RawSample>,
) -> Result<(), Error> {
    let released = bare.take(samples, line);
    known.extend(released.map_err(|what| unclear(path, &what))?);
    Ok(())
}
