//! A file of lines or rows -> the channels of a log, and its samples. I/O.
//!
//! Apart from the log because nothing in a text is defined before it comes: which sensors there are, and what their
//! samples
//! mean, is known when all of it has been read once. A sensor is a channel, of the name its lines say; attitudes are
//! another one than samples.

use super::bare_stamps::BareStamps;
use super::channel_route::{Item, Route};
use super::early_besides::{EarlyBesides, are_beside};
use super::input::{Bytes, Input};
use super::line_input::{are_judged, described, is_sure, no_samples, unclear};
use super::log_channel::LogChannel;
use crate::attitude_line::TRUTH_ID;
use crate::decode::{Class, Line, Options, Rank, Role, Stated, Undecodable};
use crate::delimited::Table;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::lines::Lines;
use crate::mcap::{Channel, ChannelSurvey, Schema, Survey};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::record::{Declared, Nanos, RawSample};

/// Sensors that are told apart. More are no sensors.
const MOST_SENSORS: usize = 1024;
/// Items that go through the pipeline together.
const BATCH: usize = 1024;
/// Name of samples that name no sensor.
const UNNAMED: &str = "imu";

/// A text, read once.
#[derive(Debug)]
pub(super) struct TextLog {
    input: Input,
    options: Options,
    channels: Vec<Arc<Channel>>,
    survey: Survey,
}

/// A sensor, and whether these are attitudes.
type Key = (String, bool);

/// Channel as far as it was met.
struct Met {
    stated: Stated,
    class: String,
    messages: u64,
    times: Option<(u64, u64)>,
}

/// The sensors met so far, each with its samples whose stamps are not known yet.
#[derive(Default)]
struct Sensors {
    places: BTreeMap<Key, usize>,
    bare: Vec<BareStamps>,
    /// Lines of those that are too many.
    left_out: u64,
}

impl Sensors {
    /// Refuses stamps whose name says nanoseconds and whose steps say another unit.
    fn check_nanos(&self, lines: &Lines<Bytes>, options: &Options, path: &Path) -> Result<()> {
        if !are_judged(lines, options) {
            return Ok(());
        }
        match self.bare.iter().find_map(BareStamps::too_fast) {
            Some(found) => Err(Error::unsupported(
                path,
                found.in_file(lines.format().is_table()),
            )),
            None => Ok(()),
        }
    }
}

/// The next of a text.
enum Read<'l> {
    /// Line and its samples, of the channel of this place; more may still wait for their stamps.
    Samples(usize, &'l Key, &'l Line, &'l [RawSample]),
    /// A line that is none, of the channel before it, and its number.
    Undecodable(usize, u64, Undecodable),
}

impl TextLog {
    /// Reads all of it, for what is in it.
    pub(super) fn survey(input: &Input, options: &Options) -> Result<(TextLog, Vec<LogChannel>)> {
        let mut met: Vec<(Key, Met)> = Vec::new();
        let mut lines = input.lines(options)?;
        let declared = lines.declared();
        let table = lines.table().cloned();
        let description = match &table {
            Some(table) if !table.is_own() => described(&lines).to_string(),
            _ => "fields by name, in each line".to_owned(),
        };
        let doubt = table.as_ref().and_then(Table::doubt_of_unit);
        for note in lines.notes().iter().chain(&doubt) {
            input
                .warn()
                .say(&format!("{}: {note}", input.name().display()));
        }
        let sensors = read::<Error>(&mut lines, input.name(), |read| {
            if let Read::Samples(place, key, line, samples) = read {
                if place == met.len() {
                    met.push((
                        key.clone(),
                        Met::new(line, options, &declared, &description),
                    ));
                }
                if let Some((_, met)) = met.get_mut(place) {
                    met.take(samples);
                }
            }
            Ok(ControlFlow::Continue(()))
        })?;
        sensors.check_nanos(&lines, options, input.name())?;
        if met.is_empty() {
            return Err(Error::Unsupported {
                path: input.name().to_owned(),
                what: format!(
                    "no {} carries a body rate or an orientation",
                    if input.format().is_table() {
                        "row"
                    } else {
                        "line"
                    }
                )
                .into(),
            });
        }
        let channels = named(met, input.format());
        let mut survey = Survey {
            file_size: Some(lines.offset()),
            channels: channels.iter().map(surveyed).collect(),
            messages: channels.iter().map(|(known, _)| known.messages).sum(),
            ..Survey::default()
        };
        survey.facts.format = input.format();
        for times in channels.iter().filter_map(|(_, times)| *times) {
            survey.times = Some(spanning(survey.times, times));
        }
        if sensors.left_out > 0 {
            input.warn().say(&format!(
                "{}: {} lines are of more than {MOST_SENSORS} sensors, and were left out",
                input.name().display(),
                sensors.left_out
            ));
        }
        let channels: Vec<LogChannel> = channels.into_iter().map(|(known, _)| known).collect();
        let log = TextLog {
            input: input.clone(),
            options: options.clone(),
            channels: channels.iter().map(|known| known.channel.clone()).collect(),
            survey,
        };
        Ok((log, channels))
    }

    /// Survey of its contents.
    pub(super) fn surveyed(&self) -> &Survey {
        &self.survey
    }

    /// Reads all of it once more: the items of the channels that have a way, in the order of the lines.
    pub(super) fn walk<E: From<Error>>(
        &self,
        mut select: impl FnMut(&Arc<Channel>) -> Option<Route>,
        mut take: impl FnMut(&mut Vec<Item>) -> std::result::Result<ControlFlow<()>, E>,
    ) -> std::result::Result<(), E> {
        let routes: Vec<Option<Route>> = self.channels.iter().map(&mut select).collect();
        let mut items = Vec::with_capacity(BATCH);
        let mut lines = self.input.lines(&self.options)?;
        let mut is_over = false;
        read::<E>(&mut lines, self.input.name(), |read| {
            match read {
                Read::Samples(place, _, _, samples) => {
                    if let Some(Some(route)) = routes.get(place) {
                        route.pass(samples, &mut items);
                    }
                }
                Read::Undecodable(place, number, why) => {
                    if let Some(Some(route)) = routes.get(place) {
                        let number = Nanos(i64::try_from(number).unwrap_or(i64::MAX));
                        route.lose(number, why, &mut items);
                    }
                }
            }
            if items.len() < BATCH {
                return Ok(ControlFlow::Continue(()));
            }
            let flow = take(&mut items)?;
            items.clear();
            is_over = flow.is_break();
            Ok(flow)
        })?;
        if !is_over && !items.is_empty() {
            let _ = take(&mut items)?;
        }
        Ok(())
    }
}

/// Reads a text to its end, or until `take` has enough.
fn read<E: From<Error>>(
    lines: &mut Lines<Bytes>,
    path: &Path,
    mut take: impl FnMut(Read<'_>) -> std::result::Result<ControlFlow<()>, E>,
) -> std::result::Result<Sensors, E> {
    let mut sensors = Sensors::default();
    let mut samples = Vec::new();
    let mut before = None;
    // Rows under a header that is known are of a table, though the first be none.
    let (mut early, mut first_bad) = (Vec::new(), None);
    let mut early_besides = EarlyBesides::default();
    while let Some(line) = lines.next(&mut samples)? {
        let line = match (line, before) {
            (Ok(line), _) => line,
            (Err(why), None) => {
                first_bad.get_or_insert_with(|| no_samples(path, lines, &why));
                if !is_sure(lines, early.len()) {
                    break;
                }
                early.push((lines.number(), why));
                continue;
            }
            (Err(why), Some(place)) => {
                if take(Read::Undecodable(place, lines.number(), why))?.is_break() {
                    return Ok(sensors);
                }
                continue;
            }
        };
        if are_beside(&line, &mut samples) {
            let place = match &line.id {
                Some(id) => sensors.places.get(&(id.clone(), false)).copied(),
                None => before,
            };
            let Some(bare) = place.and_then(|place| sensors.bare.get_mut(place)) else {
                early_besides.hold(line, &mut samples);
                continue;
            };
            let known: Vec<RawSample> = bare
                .take(&mut samples, &line)
                .map_err(|what| unclear(path, &what))?
                .collect();
            let id = line.id.clone().unwrap_or_default();
            let of = Read::Samples(place.unwrap_or_default(), &(id, false), &line, &known);
            if !known.is_empty() && take(of)?.is_break() {
                return Ok(sensors);
            }
            continue;
        }
        let says_something = |s: &RawSample| s.gyro.is_some() || s.orientation.is_some();
        if line.class != Class::Rate && !samples.iter().any(says_something) {
            // Status and the like between the samples.
            samples.clear();
            continue;
        }
        let key = (
            line.id.clone().unwrap_or_default(),
            line.class == Class::Att,
        );
        let next = sensors.places.len();
        let mut of_before = Vec::new();
        let place = match sensors.places.get(&key) {
            Some(place) => *place,
            None if next >= MOST_SENSORS => {
                sensors.left_out += 1;
                samples.clear();
                continue;
            }
            None => {
                sensors.places.insert(key.clone(), next);
                sensors.bare.push(BareStamps::default());
                of_before = early_besides.release(&key.0);
                next
            }
        };
        before = Some(place);
        for (number, why) in early.drain(..) {
            if take(Read::Undecodable(place, number, why))?.is_break() {
                return Ok(sensors);
            }
        }
        let Some(bare) = sensors.bare.get_mut(place) else {
            continue;
        };
        let mut known: Vec<RawSample> = Vec::new();
        for (line, samples) in of_before
            .iter_mut()
            .map(|(line, samples)| (&*line, samples))
        {
            let first = bare.take(samples, line);
            known.extend(first.map_err(|what| unclear(path, &what))?);
        }
        known.extend(
            bare.take(&mut samples, &line)
                .map_err(|what| unclear(path, &what))?,
        );
        if take(Read::Samples(place, &key, &line, &known))?.is_break() {
            return Ok(sensors);
        }
    }
    if let Some(why) = first_bad.filter(|_| before.is_none()) {
        return Err(why.into());
    }
    let places: Vec<(Key, usize)> = std::mem::take(&mut sensors.places).into_iter().collect();
    for (key, place) in places {
        let Some(bare) = sensors.bare.get_mut(place) else {
            continue;
        };
        let last: Vec<RawSample> = bare
            .settle()
            .map_err(|what| unclear(path, &what))?
            .collect();
        if !last.is_empty() && take(Read::Samples(place, &key, &Line::default(), &last))?.is_break()
        {
            break;
        }
    }
    Ok(sensors)
}

impl Met {
    fn new(line: &Line, options: &Options, declared: &Declared, description: &str) -> Met {
        Met {
            stated: Stated {
                declared: Declared {
                    interval_unit_given: options.states_interval_unit(),
                    sample_kind: line.sample_kind,
                    gyro_unit: line.gyro_unit,
                    ..declared.clone()
                },
                has_stamp: true,
                description: description.to_owned(),
                ..Stated::default()
            },
            class: match &line.class {
                Class::None => String::new(),
                Class::Rate => "RATE".to_owned(),
                Class::Att => "ATT".to_owned(),
                Class::Imu => "IMU".to_owned(),
                Class::Other(name) => name.clone(),
            },
            messages: 0,
            times: None,
        }
    }

    fn take(&mut self, samples: &[RawSample]) {
        for sample in samples {
            self.stated.has_accel |= sample.accel.is_some();
            self.stated.has_mag |= sample.mag.is_some();
        }
        for sample in samples.iter().filter(|raw| !raw.is_beside) {
            self.messages += 1;
            self.stated.has_gyro |= sample.gyro.is_some();
            self.stated.has_orientation |= sample.orientation.is_some();
            self.stated.has_interval |= sample.interval_nanos.is_some();
            if let Ok(log) = u64::try_from(sample.log.0) {
                self.times = Some(spanning(self.times, (log, log)));
            }
        }
    }
}

fn spanning(all: Option<(u64, u64)>, (first, last): (u64, u64)) -> (u64, u64) {
    all.map_or((first, last), |(a, b)| (a.min(first), b.max(last)))
}

/// The channels with their names: a sensor's own, unless its attitudes stand beside its samples.
fn named(met: Vec<(Key, Met)>, format: Format) -> Vec<(LogChannel, Option<(u64, u64)>)> {
    let sampled: BTreeSet<String> = met
        .iter()
        .filter(|((_, is_attitude), _)| !is_attitude)
        .map(|((id, _), _)| id.clone())
        .collect();
    let channel = |(index, ((id, is_attitude), met)): (usize, (Key, Met))| {
        let name = if id.is_empty() { UNNAMED } else { &id };
        let topic = match is_attitude && sampled.contains(&id) {
            true => format!("{name}/attitude"),
            false => name.to_owned(),
        };
        let number = u16::try_from(index).unwrap_or(u16::MAX);
        let is_truth = is_attitude && id == TRUTH_ID;
        let schema = Schema {
            id: number.saturating_add(1),
            name: match (format, is_attitude) {
                (format, false) if format.is_table() => "samples".to_owned(),
                (format, true) if format.is_table() => "attitudes".to_owned(),
                _ if met.class.is_empty() => "samples".to_owned(),
                _ => met.class,
            },
            encoding: String::new(),
            data: Vec::new(),
        };
        let known = LogChannel {
            channel: Arc::new(Channel {
                index,
                id: number,
                topic,
                message_encoding: format.name().to_owned(),
                metadata: BTreeMap::new(),
                schema_id: schema.id,
                schema: Some(Arc::new(schema)),
                text: Some(format),
            }),
            messages: met.messages,
            first: None,
            openings: Vec::new(),
            // The rate behind an attitude is a sample where there is nothing else; the truth about samples is none.
            role: Role {
                has_rate: met.stated.has_gyro && !is_truth,
                has_orientation: met.stated.has_orientation,
                rank: if is_attitude { Rank::Weak } else { Rank::Imu },
            },
            stated: Some(met.stated),
        };
        (known, met.times)
    };
    met.into_iter().enumerate().map(channel).collect()
}

fn surveyed((known, times): &(LogChannel, Option<(u64, u64)>)) -> ChannelSurvey {
    ChannelSurvey {
        channel: known.channel.clone(),
        messages: known.messages,
        times: *times,
        bytes: None,
    }
}
