//! A publisher of a log -> how each of its channels is read, and which messages of a walk are its own. Pure.
//!
//! Apart from the choice of topics because whoever walks a log needs the same of those chosen: an inspection, a replay,
//! a command that wants samples alone.

use super::channel_route::{Route, RouteTarget};
use super::decoders::Decoders;
use super::log_channel::{LogChannel, described};
use super::opened::Recording;
use super::sources::Publisher;
use super::topics;
use crate::decode::{Decoder, Unsupported};
use crate::error::{Error, Result};
use crate::mcap::Channel;
use crate::text::printable;
use std::collections::BTreeMap;
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::{ACCEL_TOPIC, FIELD, MAG_TOPIC};

/// A topic, and how it is read.
#[derive(Debug)]
pub struct TopicPlan<'l> {
    /// Publisher whose messages these are.
    pub source: Publisher,
    /// Channels that can be read, with their decoders.
    pub channels: Vec<(&'l LogChannel, Decoder)>,
    /// Reasons why the others cannot.
    pub refusals: Vec<Unsupported>,
    /// Index among the channels, by id and schema id: that of a channel met in a walk may differ from the survey's, since
    /// the summary lists them in another order.
    places: BTreeMap<(u16, u16), usize>,
}

impl<'l> TopicPlan<'l> {
    /// Makes the plan of those channels of a publisher that are wanted.
    #[must_use]
    pub fn of(
        log: &'l Recording,
        source: Publisher,
        decoders: &mut Decoders,
        is_wanted: impl Fn(&LogChannel) -> bool,
    ) -> TopicPlan<'l> {
        let (mut channels, mut refusals) = (Vec::new(), Vec::new());
        let mut places = BTreeMap::new();
        for known in log.channels_of(&source).filter(|known| is_wanted(known)) {
            match known.decoder(decoders) {
                Ok(decoder) => {
                    let id = (known.channel.id, known.channel.schema_id);
                    places.entry(id).or_insert(channels.len());
                    channels.push((known, decoder));
                }
                Err(why) => refusals.push(why),
            }
        }
        TopicPlan {
            source,
            channels,
            refusals,
            places,
        }
    }

    /// Makes the plan of the topic, or publisher on one, of this name.
    ///
    /// # Errors
    /// It is not there.
    pub fn named(log: &'l Recording, name: &str, decoders: &mut Decoders) -> Result<TopicPlan<'l>> {
        let source = log.source(name).ok_or_else(|| Error::NoSuchTopic {
            path: log.name().to_owned(),
            topic: name.to_owned(),
            topics: topics::listing(&log.candidates()),
        })?;
        Ok(TopicPlan::of(log, source, decoders, |_| true))
    }

    /// Returns its first channel, by which all of it is understood.
    ///
    /// # Errors
    /// None can be read, or it carries no rate.
    pub fn first_with_rate(&self, path: &Path) -> Result<(&'l LogChannel, &Decoder)> {
        let Some((first, decoder)) = self.channels.first() else {
            let none = || Diagnostic::new("no channel of it");
            let why = self.refusals.first().map_or_else(none, Diagnostic::from);
            return Err(Error::unsupported(path, why));
        };
        if !decoder.stated().has_gyro {
            let name = printable(&self.source.name);
            let stated = decoder.stated();
            let (carries, beside) = match (stated.has_mag, stated.has_accel) {
                (true, _) => ("a magnetic field and no body rate", Some(MAG_TOPIC)),
                (_, true) => ("forces and no body rate", Some(ACCEL_TOPIC)),
                _ => ("no body rate", None),
            };
            let what = format!("{name} ({}): carries {carries}", described(&first.channel));
            let help = match beside {
                Some(beside) => format!(
                    "{beside} {name} takes it beside the rates of another topic; {FIELD} gyro=PATH names a rate in it"
                ),
                None => format!("{FIELD} gyro=PATH names one"),
            };
            let what = Diagnostic::new(what).help(help);
            return Err(Error::unsupported(path, what));
        }
        Ok((*first, decoder))
    }

    /// Returns the frame of its samples: the publisher's, or that of the first message; empty where none is named.
    #[must_use]
    pub fn frame(&self) -> String {
        let of_first = || {
            let (known, decoder) = self.channels.first()?;
            let (_, payload) = known.first.as_ref()?;
            decoder.frame_id(payload)
        };
        let named = self.source.frame.clone();
        named.or_else(of_first).unwrap_or_default()
    }

    /// Returns the index of a channel met in a walk, and its decoder.
    fn channel(&self, met: &Channel) -> Option<(usize, &Decoder)> {
        let place = self.places.get(&(met.id, met.schema_id));
        let place = *place.filter(|_| met.topic == self.source.topic)?;
        let (_, decoder) = self.channels.get(place)?;
        Some((place, decoder))
    }
}

/// Returns the way of a channel's messages to the topics they may belong to: of several, to the one of the frame that a
/// message names. `taker` makes the stream of a topic and its channel, by their indices.
pub fn route<'p>(
    plans: impl Iterator<Item = &'p TopicPlan<'p>>,
    met: &Channel,
    taker: impl Fn(usize, usize) -> RouteTarget,
) -> Option<Route> {
    let (mut decoder, mut takers) = (None, Vec::new());
    for (at, plan) in plans.enumerate() {
        if let Some((place, own)) = plan.channel(met) {
            decoder.get_or_insert(own);
            takers.push(taker(at, place));
        }
    }
    Some(Route::to(decoder?.clone(), takers))
}
