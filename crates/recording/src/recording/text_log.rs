//! A file of lines or rows -> the channels of a log, and its samples. I/O.
//!
//! Apart from the log because nothing in a text is defined before it comes: which sensors there are, and what their
//! samples mean, is known when all of it has been read, which is once. A sensor is a channel, of the name its lines
//! say; attitudes are another one than samples.

use super::channel_route::{Item, Route};
use super::input::{Bytes, Input};
use super::line_input::{are_judged, described};
use super::line_reader::{Key, LineEvent, MOST_SENSORS, read};
use super::log_channel::LogChannel;
use super::sample_cache::{CacheWriter, SampleCache};
use crate::attitude_line::TRUTH_ID;
use crate::decode::{Class, Line, Options, Rank, Role, Stated};
use crate::delimited::Table;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::lines::Lines;
use crate::mcap::{Channel, ChannelSurvey, Schema, Survey};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::sync::Arc;
use strapd_attitude::record::{Declared, RawSample};

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
    /// Samples, if they are few enough to be kept.
    cache: Option<SampleCache>,
}

/// Channel as far as it was met.
struct Met {
    stated: Stated,
    class: String,
    messages: u64,
    times: Option<(u64, u64)>,
}

/// Returns the sensor of a line, whose attitudes are another one; `None` of status and the like between samples.
fn sensor_of<E>(
    line: &mut Line,
    samples: &[RawSample],
    _: &Lines<Bytes>,
) -> std::result::Result<Option<Key>, E> {
    let says_something = |s: &RawSample| s.gyro.is_some() || s.orientation.is_some();
    let is_sample = line.class == Class::Rate || samples.iter().any(says_something);
    let is_attitude = line.class == Class::Att;
    Ok(is_sample.then(|| (line.id.take().unwrap_or_default(), is_attitude)))
}

impl TextLog {
    /// Reads all of it, for what is in it; its samples are kept if these are at most so many bytes.
    pub(super) fn survey(
        input: &Input,
        options: &Options,
        kept: u64,
    ) -> Result<(TextLog, Vec<LogChannel>)> {
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
        let (mut met, mut cache) = (Vec::<(Key, Met)>::new(), CacheWriter::new(kept));
        let take = |event: LineEvent<'_, Bytes>| -> Result<_> {
            match &event {
                LineEvent::Met(key, line, _) => {
                    let first = Met::new(line, options, &declared, &description);
                    met.push(((*key).clone(), first));
                }
                LineEvent::Samples(place, samples) => {
                    if let Some((_, met)) = met.get_mut(*place) {
                        met.take(samples);
                    }
                }
                _ => {}
            }
            cache.push(event);
            Ok(ControlFlow::Continue(()))
        };
        let sensors = read(&mut lines, input.name(), sensor_of, take)?;
        if are_judged(&lines, options) {
            sensors.check_nanos(input.name(), lines.format())?;
        }
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
            cache: cache.finish(),
        };
        Ok((log, channels))
    }

    /// Survey of its contents.
    pub(super) fn surveyed(&self) -> &Survey {
        &self.survey
    }

    /// Gives the items of the channels that have a way, in the order of the lines: as they were kept, or read once more.
    pub(super) fn walk<E: From<Error>>(
        &self,
        mut select: impl FnMut(&Arc<Channel>) -> Option<Route>,
        mut take: impl FnMut(&mut Vec<Item>) -> std::result::Result<ControlFlow<()>, E>,
    ) -> std::result::Result<(), E> {
        let routes: Vec<Option<Route>> = self.channels.iter().map(&mut select).collect();
        let mut items = Vec::with_capacity(BATCH);
        let mut is_over = false;
        let mut each = |event: LineEvent<'_, Bytes>| -> std::result::Result<_, E> {
            let route = |place: usize| routes.get(place).and_then(Option::as_ref);
            match event {
                LineEvent::Samples(place, samples) => {
                    if let Some(route) = route(place) {
                        route.pass(samples, &mut items);
                    }
                }
                LineEvent::Undecodable(place, number, why) => {
                    if let Some(route) = route(place) {
                        route.lose(number, why, &mut items);
                    }
                }
                _ => {}
            }
            if items.len() < BATCH {
                return Ok(ControlFlow::Continue(()));
            }
            let flow = take(&mut items)?;
            items.clear();
            is_over = flow.is_break();
            Ok(flow)
        };
        let kept = self.cache.as_ref().and_then(|cache| cache.walk(&mut each));
        match kept {
            Some(walked) => walked?,
            None => {
                let mut lines = self.input.lines(&self.options)?;
                read(&mut lines, self.input.name(), sensor_of, each)?;
            }
        }
        if !is_over && !items.is_empty() {
            let _ = take(&mut items)?;
        }
        Ok(())
    }
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

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::decoders::Decoders;
    use super::super::sample_cache::MOST;
    use super::*;
    use crate::recording::warn::Warn;

    /// Items of two walks, as text.
    fn walked(text: &str, kept: u64) -> (bool, [String; 2]) {
        let mut file = tempfile::Builder::new()
            .suffix(".ndjson")
            .tempfile()
            .unwrap();
        std::io::Write::write_all(&mut file, text.as_bytes()).unwrap();
        let warn = Warn::by(|_| {});
        let input = Input::open(file.path(), &warn).unwrap();
        let (log, channels) = TextLog::survey(&input, &Options::default(), kept).unwrap();
        let walk = || {
            let mut all = String::new();
            let route = |channel: &Arc<Channel>| {
                let known = channels.get(channel.index)?;
                let decoder = known.decoder(&mut Decoders::default()).ok()?;
                Some(Route::samples(decoder, channel.index))
            };
            let walked = log.walk::<Error>(route, |items| {
                all.push_str(&format!("{} items: {items:?}\n", items.len()));
                Ok(ControlFlow::Continue(()))
            });
            walked.unwrap();
            all
        };
        (log.cache.is_some(), [walk(), walk()])
    }

    #[test]
    fn a_text_that_is_kept_is_walked_as_one_that_is_read_again() {
        let lines = (0..3000).map(|n| match n % 10 {
            3 => "{ no line\n".to_owned(),
            5 => format!("{{\"id\":\"a\",\"stamp_ms\":{n},\"accel\":[0,0,9.8]}}\n"),
            k => {
                let (id, stamp) = (if k < 5 { "a" } else { "b" }, 1_700_000_000_000i64 + n);
                format!("{{\"id\":\"{id}\",\"stamp\":{stamp},\"gyro\":[0.1,{n},-0.0]}}\n")
            }
        });
        let text: String = lines.collect();
        let (is_kept, kept) = walked(&text, MOST);
        let (is_too_long, read) = walked(&text, 1000);
        assert!(is_kept && !is_too_long);
        assert!(kept[0] == read[0] && kept[1] == kept[0] && read[1] == read[0]);
        let (samples, lost) = (
            kept[0].matches("Sample(").count(),
            kept[0].matches("Undecodable(").count(),
        );
        assert_eq!((samples, lost), (2700, 300));
    }
}
