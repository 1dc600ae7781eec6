//! Lines of a sensor -> the channel they are. Pure.
//!
//! Apart from the reading because a text has no channels: a sensor becomes one, of the name its lines say, when all
//! lines are known, or with its first one. Its attitudes are another channel than its samples.

use super::line_input::described;
use super::line_reader::Key;
use super::log_channel::LogChannel;
use super::payload_type::PayloadType;
use crate::attitude_line::sensor_of_truth;
use crate::decode::{Class, Line, Options, Rank, Role, Stated};
use crate::delimited::Table;
use crate::lines::Lines;
use crate::mcap::{Channel, ChannelSurvey, Schema};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::sync::Arc;
use strapd_attitude::record::{Declared, RawSample};

/// Name of samples that name no sensor.
const UNNAMED: &str = "imu";

/// The sensors of a text, as far as they were met.
#[derive(Debug)]
pub(super) struct TextChannels {
    /// Type of the payloads, with how a table is read.
    read_as: PayloadType,
    is_table: bool,
    sensor_column: Option<String>,
    stated: Stated,
    /// Sensors in the order of appearance.
    met: Vec<Met>,
}

/// Sensor as far as it was met.
#[derive(Clone, Debug)]
struct Met {
    key: Key,
    class: String,
    stated: Stated,
    messages: u64,
    times: Option<(u64, u64)>,
}

impl TextChannels {
    /// Makes it before the first line.
    pub(super) fn of(lines: &Lines<impl Read>, options: &Options) -> TextChannels {
        let read_as = described(lines);
        TextChannels {
            is_table: lines.format().is_table(),
            sensor_column: lines.table().and_then(Table::sensor_column),
            stated: Stated {
                declared: Declared {
                    interval_unit_given: options.states_interval_unit(),
                    ..lines.declared()
                },
                has_stamp: true,
                description: match lines.table() {
                    Some(table) if !table.is_own() => read_as.to_string(),
                    _ => "fields by name, in each line".to_owned(),
                },
                ..Stated::default()
            },
            read_as,
            met: Vec::new(),
        }
    }

    /// Takes the first line of a sensor.
    pub(super) fn meet(&mut self, key: &Key, line: &Line) {
        let (_, is_attitude) = key;
        let mut stated = self.stated.clone();
        stated.has_gyro = !is_attitude;
        stated.declared.sample_kind = line.sample_kind;
        stated.declared.gyro_unit = line.gyro_unit;
        let class = match &line.class {
            Class::None => "",
            Class::Rate => "RATE",
            Class::Att => "ATT",
            Class::Imu => "IMU",
            Class::Other(name) => name,
        };
        self.met.push(Met {
            key: key.clone(),
            class: class.to_owned(),
            stated,
            messages: 0,
            times: None,
        });
    }

    /// Takes samples of the sensor of this place.
    pub(super) fn take(&mut self, place: usize, samples: &[RawSample]) {
        if let Some(met) = self.met.get_mut(place) {
            met.take(samples);
        }
    }

    /// Returns the sensor met last as a channel, as its first samples make it.
    pub(super) fn newest(&self, samples: &[RawSample]) -> Option<LogChannel> {
        let mut met = self.met.last()?.clone();
        met.take(samples);
        let is_sampled = self
            .met
            .iter()
            .any(|of| of.key == (met.key.0.clone(), false));
        Some(self.channel(self.met.len() - 1, &met, is_sampled))
    }

    /// Returns all as channels, with their names: a sensor's own, unless its attitudes stand beside its samples.
    pub(super) fn channels(&self) -> Vec<LogChannel> {
        let keys = self.met.iter().map(|met| &met.key);
        let sampled: BTreeSet<&str> = keys
            .filter(|(_, is_attitude)| !is_attitude)
            .map(|(id, _)| id.as_str())
            .collect();
        let all = self.met.iter().enumerate();
        all.map(|(index, met)| self.channel(index, met, sampled.contains(met.key.0.as_str())))
            .collect()
    }

    fn channel(&self, index: usize, met: &Met, is_sampled: bool) -> LogChannel {
        let (id, is_attitude) = &met.key;
        let name = if id.is_empty() { UNNAMED } else { id };
        let topic = match *is_attitude && is_sampled {
            true => format!("{name}/attitude"),
            false => name.to_owned(),
        };
        let number = u16::try_from(index).unwrap_or(u16::MAX);
        let is_truth = *is_attitude && sensor_of_truth(id).is_some();
        let schema = Schema {
            id: number.saturating_add(1),
            name: match (self.is_table, met.class.as_str()) {
                (true, "ATT") => "attitudes".to_owned(),
                (true, _) | (false, "") => "samples".to_owned(),
                (false, class) => class.to_owned(),
            },
            encoding: String::new(),
            data: Vec::new(),
        };
        LogChannel {
            channel: Arc::new(Channel {
                index,
                id: number,
                topic,
                message_encoding: self
                    .read_as
                    .text
                    .map_or_else(String::new, |format| format.name().to_owned()),
                metadata: BTreeMap::new(),
                schema_id: schema.id,
                schema: Some(Arc::new(schema)),
                text: self.read_as.text,
            }),
            messages: met.messages,
            first: None,
            openings: Vec::new(),
            // The rate behind an attitude is a sample where there is nothing else; the truth about samples is none.
            role: Role {
                has_rate: met.stated.has_gyro && !is_truth,
                has_orientation: met.stated.has_orientation,
                rank: if *is_attitude { Rank::Weak } else { Rank::Imu },
            },
            stated: Some(met.stated.clone()),
            read_as: Some(self.read_as.clone()),
            is_derived: *is_attitude && is_sampled,
            sensor_column: self.sensor_column.clone(),
        }
    }

    /// Returns what a survey says of these channels.
    pub(super) fn surveyed(&self, channels: &[LogChannel]) -> Vec<ChannelSurvey> {
        let all = channels.iter().zip(&self.met);
        all.map(|(known, met)| ChannelSurvey {
            channel: known.channel.clone(),
            messages: met.messages,
            times: met.times,
            bytes: None,
        })
        .collect()
    }

    /// Returns the times of the first and the last sample of all.
    pub(super) fn times(&self) -> Option<(u64, u64)> {
        let all = self.met.iter().filter_map(|met| met.times);
        all.fold(None, |all, times| Some(spanning(all, times)))
    }
}

impl Met {
    fn take(&mut self, samples: &[RawSample]) {
        for sample in samples {
            self.stated.has_accel |= sample.accel.is_some();
            self.stated.has_mag |= sample.mag.is_some();
            self.stated.has_temperature |= sample.temperature.is_some();
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
