//! Several files that continue each other -> the channels of one recording. Pure.
//!
//! Apart from the recording because a part is one itself: it is surveyed and read as if it were alone. What makes
//! them one
//! is here: that the times of one follow those of the other, and which channel of a part is which of the whole.

use super::log_channel::{LogChannel, described};
use super::sources::{is_same, publisher};
use super::topics::PICKED_UNNAMED;
use super::warn::Warn;
use crate::error::{Error, Result};
use crate::mcap::{Channel, Survey};
use crate::text::{named_few, printable};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::AccelUnit;
use strapd_attitude::setting::JOIN;

/// A clock that differs so much between two files is another clock, s: what is less is a recorder that wrote two files
/// for a moment.
const OVERLAP_SECS: f64 = 1.0;

/// A gap between two files that is worth a word, s.
const GAP_SECS: f64 = 1.0;

/// Index in the whole of each channel of a part.
#[derive(Debug)]
pub(super) struct Same {
    own: Vec<Arc<Channel>>,
    whole: Vec<Arc<Channel>>,
}

impl Same {
    /// The channel of the whole that is met in the part.
    pub(super) fn known(&self, met: &Arc<Channel>) -> Arc<Channel> {
        let place = self.own.iter().position(|known| is_same(known, met));
        let known = place.and_then(|place| self.whole.get(place));
        known.unwrap_or(met).clone()
    }
}

/// Contents of all parts together.
#[derive(Debug)]
pub(super) struct Whole {
    pub(super) channels: Vec<LogChannel>,
    pub(super) survey: Survey,
    /// The first and the last part so far.
    first: PathBuf,
    last: Option<(PathBuf, (u64, u64))>,
    warn: Warn,
}

/// Says of a part that holds no message that the others are joined without it.
pub(super) fn say_left_out(name: &Path, warn: &Warn) {
    let name = printable(&name.display().to_string());
    warn.say(&format!("{name}: holds no message, and is left out"));
}

/// Error of a part without a time, by which they are put in order.
pub(super) fn without_time(name: &Path) -> Error {
    Error::unsupported(
        name,
        Diagnostic::new("nothing in it has a time, so that its place among the parts is not known")
            .help("leave it out"),
    )
}

/// Whether one file can follow another: what lies between them is said.
fn said_of_border(
    (a, before): (&Path, (u64, u64)),
    (b, after): (&Path, (u64, u64)),
    warn: &Warn,
) -> Result<()> {
    let shown = |path: &Path| printable(&path.display().to_string());
    if after.0 > before.1 {
        let secs = (after.0 - before.1) as f64 * 1e-9;
        if secs > GAP_SECS {
            warn.say(&format!(
                "{}: nothing for {secs:.3} s before it, after {} ended",
                shown(b),
                shown(a)
            ));
        }
        return Ok(());
    }
    let common = before.1.min(after.1) - after.0;
    let secs = common as f64 * 1e-9;
    // Of a short file most of it.
    let shortest = (before.1 - before.0).min(after.1 - after.0);
    if secs > OVERLAP_SECS || 2 * common > shortest {
        return Err(Error::unsupported(
            b,
            Diagnostic::new(format!(
                "{secs:.3} s of it are in {} too: recordings of the same time do not continue each other",
                shown(a)
            ))
            .help(apart()),
        ));
    }
    if common > 0 {
        warn.say(&format!(
            "{}: begins {secs:.3} s before {} ends; samples are put in the order of their stamps as far as they are remembered",
            shown(b),
            shown(a)
        ));
    }
    Ok(())
}

impl Whole {
    /// Nothing so far.
    pub(super) fn new(warn: &Warn) -> Whole {
        Whole {
            channels: Vec::new(),
            survey: Survey::default(),
            first: PathBuf::new(),
            last: None,
            warn: warn.clone(),
        }
    }

    /// Puts the next part, in the order of their times (first and last), behind the others.
    ///
    /// # Errors
    /// The part is of the time of the one before it, or of other sensors.
    pub(super) fn add(
        &mut self,
        (name, now): (&Path, (u64, u64)),
        channels: &[LogChannel],
        survey: &Survey,
    ) -> Result<Same> {
        match &self.last {
            None => self.first = name.to_owned(),
            Some((last, before)) => {
                self.is_of_the_same_sensors(name, channels)?;
                said_of_border((last, *before), (name, now), &self.warn)?;
            }
        }
        let mut whole = Vec::new();
        let mut taken = vec![false; self.channels.len()];
        for known in channels {
            let mut all = self.channels.iter_mut().zip(&mut taken);
            let Some((of, taken)) = all.find(|(of, taken)| !**taken && is_continued(of, known))
            else {
                let channel = self.renumbered(&known.channel);
                whole.push(channel.clone());
                self.channels.push(LogChannel {
                    channel,
                    ..known.clone()
                });
                continue;
            };
            *taken = true;
            of.messages = of.messages.saturating_add(known.messages);
            if of.first.is_none() {
                of.first.clone_from(&known.first);
                of.role.clone_from(&known.role);
            }
            whole.push(of.channel.clone());
        }
        self.survey.append(survey, &whole);
        self.last = Some((name.to_owned(), now));
        Ok(Same {
            own: channels.iter().map(|known| known.channel.clone()).collect(),
            whole,
        })
    }

    /// A channel of a later part, under a number that is free.
    fn renumbered(&self, channel: &Arc<Channel>) -> Arc<Channel> {
        if self.last.is_none() {
            return channel.clone();
        }
        let free = |id: &u16| self.channels.iter().all(|known| known.channel.id != *id);
        Arc::new(Channel {
            index: self.channels.len(),
            id: (0..u16::MAX).find(free).unwrap_or(u16::MAX),
            ..Channel::clone(channel)
        })
    }

    /// Whether the topics of a part are those of the others, as far as there are rates on them.
    fn is_of_the_same_sensors(&self, name: &Path, channels: &[LogChannel]) -> Result<()> {
        let refuse = |what: Diagnostic| Err(Error::unsupported(name, what));
        let before = self.first.display().to_string();
        for known in channels {
            let topic = &known.channel.topic;
            let mut same = self.channels.iter().filter(|of| of.channel.topic == *topic);
            let Some(of) = same.clone().next() else {
                continue;
            };
            let Some(of) = same.find(|of| is_continued(of, known)) else {
                return refuse(
                    Diagnostic::new(format!(
                        "{} is {}: parts of one recording are of one device",
                        printable(topic),
                        unlike(known, of, &printable(&before))
                    ))
                    .help(apart()),
                );
            };
            let columns = |known: &LogChannel| Some(known.stated.as_ref()?.description.clone());
            if let (Some(here), Some(there)) = (columns(known), columns(of))
                && here != there
            {
                self.warn.say(&format!(
                    "{}: {} is {here} here and {there} in {}: where they are of two devices, {}",
                    printable(&name.display().to_string()),
                    printable(topic),
                    printable(&before),
                    apart()
                ));
            }
        }
        let [here, there] = [channels, &self.channels].map(imus);
        let missing: Vec<&str> = there
            .iter()
            .copied()
            .filter(|t| !here.contains(t))
            .collect();
        if missing.is_empty() {
            return Ok(());
        }
        if missing.len() == there.len() {
            return refuse(
                Diagnostic::new(format!(
                    "its sensors are {}, those of {} are {}: parts of one recording have the same topics",
                    named_few(&here),
                    printable(&before),
                    named_few(&there)
                ))
                .help(apart())
            );
        }
        self.warn.say(&format!(
            "{}: nothing of {} in it",
            printable(&name.display().to_string()),
            named_few(&missing)
        ));
        Ok(())
    }
}

/// The topics that are sensors.
fn imus(channels: &[LogChannel]) -> Vec<&str> {
    let is_one = |known: &&LogChannel| known.rank() > PICKED_UNNAMED;
    let topics = channels.iter().filter(is_one);
    topics.map(|known| known.channel.topic.as_str()).collect()
}

/// Cure of what are two recordings.
fn apart() -> String {
    format!("name one of them, or several without {JOIN}: each has an attitude of its own")
}

/// Difference between a channel of a part and the one that it does not continue: of what is alike nothing is said.
fn unlike(known: &LogChannel, of: &LogChannel, before: &str) -> String {
    let [a, b] = [known, of].map(|known| described(&known.channel).to_string());
    if a != b {
        return format!("{a} here and {b} in {before}");
    }
    let [a, b] = [known, of].map(|known| publisher(&known.channel));
    if a != b {
        let name = |text: String| match text.is_empty() {
            true => "a device without a name".to_owned(),
            false => format!("`{text}`"),
        };
        return format!("from {} here and from {} in {before}", name(a), name(b));
    }
    let [a, b] = [known, of].map(units);
    if a != b {
        return format!("in {a} here and in {b} in {before}");
    }
    let meant = |known: &LogChannel| {
        known
            .stated
            .as_ref()
            .map(|stated| stated.description.clone())
    };
    let [a, b] = [known, of].map(|known| meant(known).unwrap_or_default());
    match a == b {
        true => format!("defined otherwise here than in {before}"),
        false => format!("{a} here and {b} in {before}"),
    }
}

/// Units of a channel's rates and forces.
fn units(known: &LogChannel) -> String {
    let Some(stated) = known.stated.as_ref() else {
        return "no unit".to_owned();
    };
    let gyro = stated.declared.gyro_unit;
    let gyro = gyro.map_or("no unit", |unit| unit.name());
    match (stated.declared.accel_unit, stated.has_accel) {
        (Some(AccelUnit::MetresPerSecondSquared), _) => format!("{gyro} and m/s^2"),
        (Some(AccelUnit::StandardGravity), _) => format!("{gyro} and g"),
        (None, true) => format!("{gyro}, accelerations in no unit"),
        (None, false) => format!("{gyro}, without accelerations"),
    }
}

/// Whether a channel of a later part is this one: the same publisher, topic and type, and numbers that mean the same.
fn is_continued(of: &LogChannel, known: &LogChannel) -> bool {
    let (a, b) = (&of.channel, &known.channel);
    let ([a_schema, b_schema], [a_stated, b_stated]) = (
        [a, b].map(|channel| channel.schema.as_deref()),
        [of, known].map(|known| known.stated.as_ref().map(|stated| &stated.declared)),
    );
    let is_same_type = match (a_schema, b_schema) {
        (Some(a), Some(b)) => (&a.name, &a.encoding, &a.data) == (&b.name, &b.encoding, &b.data),
        (None, None) => true,
        _ => false,
    };
    a.topic == b.topic
        && a.message_encoding == b.message_encoding
        && is_same_type
        && a_stated == b_stated
        && publisher(a) == publisher(b)
}
