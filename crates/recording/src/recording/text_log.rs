//! Lines of a text -> the channels of a log, and the items of its samples, in the order of the lines. I/O.
//!
//! Apart from the log because nothing in a text is defined before it comes. Of a file all of it is read, which is once,
//! and then it is known which sensors there are; of lines that come once a sensor is a channel from its first line on, and
//! what is known goes on before the next line is waited for.

use super::bare_stamps::BareStamps;
use super::channel_route::{Item, Route};
use super::input::{Bytes, Input};
use super::line_input::{are_judged, no_rates};
use super::line_reader::{LineEvent, MOST_SENSORS, Sensors, read};
use super::log_channel::LogChannel;
use super::sample_cache::{CacheWriter, SampleCache};
use super::text_channels::TextChannels;
use crate::columns::RowSelection;
use crate::decode::Options;
use crate::delimited::Table;
use crate::error::{Error, Result};
use crate::lines::Lines;
use crate::mcap::{Channel, Survey};
use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

/// Items that go through the pipeline together.
const BATCH: usize = 1024;
/// Steps between stamps after which the unit of their name is judged, of lines that come once; fewer are judged at the
/// end.
const STEPS: u64 = 4096;
/// Lines without any rate after which this is no log of samples, of lines that come once.
const PATIENCE: u64 = 1000;

/// A text, read once.
#[derive(Debug)]
pub(super) struct TextLog {
    input: Input,
    options: Options,
    channels: Vec<Arc<Channel>>,
    survey: Survey,
    /// Notes for the reader of its tables, and why the unit of its rates may be another one.
    pub(super) notes: (Vec<String>, Option<String>),
    /// Samples, if they are few enough to be kept.
    cache: Option<SampleCache>,
}

impl TextLog {
    /// Reads all of it, for what is in it; its samples are kept if these are at most so many bytes.
    pub(super) fn survey(
        input: &Input,
        options: &Options,
        kept: u64,
    ) -> Result<(TextLog, Vec<LogChannel>)> {
        let mut lines = input.lines(options)?;
        let mut met = TextChannels::of(&lines, options);
        let doubt = doubt_of_unit(&lines).filter(|_| !options.is_unit_stated);
        let mut notes = (lines.notes(), doubt);
        let mut cache = CacheWriter::new(kept);
        let take = |event: LineEvent<'_, Bytes>| -> Result<_> {
            match &event {
                LineEvent::Met(key, line, ..) => met.meet(key, line),
                LineEvent::Samples(place, samples) => met.take(*place, samples),
                _ => {}
            }
            cache.push(event);
            Ok(ControlFlow::Continue(()))
        };
        let sensors = read(&mut lines, input.name(), take)?;
        if are_judged(&lines, options) {
            sensors.check_stated(input.name(), lines.format())?;
        }
        let channels = met.channels();
        let selection = lines.selection();
        notes.0.extend(selection.and_then(RowSelection::note));
        if let Some(why) = selection.and_then(RowSelection::nothing) {
            return Err(Error::unsupported(input.name(), why));
        }
        if channels.is_empty() {
            let or_else = " or an orientation";
            return Err(no_rates(input.name(), input.format(), or_else));
        }
        let mut survey = Survey {
            file_size: Some(lines.offset()),
            channels: met.surveyed(&channels),
            messages: channels.iter().map(|known| known.messages).sum(),
            times: met.times(),
            ..Survey::default()
        };
        survey.facts.format = input.format();
        if sensors.left_out > 0 {
            input.warn().say(&format!(
                "{}: {} lines are of more than {MOST_SENSORS} sensors, and were left out",
                input.name().display(),
                sensors.left_out
            ));
        }
        let log = TextLog {
            input: input.clone(),
            options: options.clone(),
            channels: channels.iter().map(|known| known.channel.clone()).collect(),
            survey,
            notes,
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
        select: impl FnMut(&Arc<Channel>) -> Option<Route>,
        mut take: impl FnMut(&mut Vec<Item>) -> std::result::Result<ControlFlow<()>, E>,
    ) -> std::result::Result<(), E> {
        let mut out = RoutedItems {
            routes: self.channels.iter().map(select).collect(),
            items: Vec::with_capacity(BATCH),
        };
        let mut is_over = false;
        let mut each = |event: LineEvent<'_, Bytes>| -> std::result::Result<_, E> {
            out.add(event);
            if out.items.len() < BATCH {
                return Ok(ControlFlow::Continue(()));
            }
            let flow = take(&mut out.items)?;
            out.items.clear();
            is_over = flow.is_break();
            Ok(flow)
        };
        let kept = self.cache.as_ref().and_then(|cache| cache.walk(&mut each));
        match kept {
            Some(walked) => walked?,
            None => {
                let mut lines = self.input.lines(&self.options)?;
                read(&mut lines, self.input.name(), each)?;
            }
        }
        if !is_over && !out.items.is_empty() {
            let _ = take(&mut out.items)?;
        }
        Ok(())
    }
}

/// Reads lines that come once, to their end or until `take` has enough. `select` says the way of a channel's samples when
/// it is met; `take` gets their items, to be taken out of the vector, and whether the next line may be long in coming.
/// Returns the channels that were met, and a note about rows that were left out.
///
/// # Errors
/// They cannot be read, or carry no rate; as `take`.
pub fn walk_once<R: Read, E: From<Error>>(
    mut lines: Lines<R>,
    (path, options): (&Path, &Options),
    mut select: impl FnMut(&LogChannel) -> Option<Route>,
    mut take: impl FnMut(&mut Vec<Item>, bool) -> std::result::Result<ControlFlow<()>, E>,
) -> std::result::Result<(Vec<LogChannel>, Option<String>), E> {
    let format = lines.format();
    let is_judged = are_judged(&lines, options);
    let mut met = TextChannels::of(&lines, options);
    let mut out = RoutedItems::default();
    let (mut has_rates, mut is_enough) = (false, false);
    let of_line = |event: LineEvent<'_, R>| -> std::result::Result<_, E> {
        match &event {
            LineEvent::Met(key, line, samples) => {
                met.meet(key, line);
                let known = met.newest(samples);
                let stated = known.as_ref().and_then(|known| known.stated.as_ref());
                has_rates |= stated.is_some_and(|stated| stated.has_gyro);
                out.routes.push(known.as_ref().and_then(&mut select));
            }
            LineEvent::Samples(place, samples) => met.take(*place, samples),
            LineEvent::LineOver(lines, sensors) => {
                let left_out = lines.selection().map_or(0, RowSelection::left_out);
                if lines.number().saturating_sub(left_out) > PATIENCE && !has_rates {
                    return Err(no_rates(path, format, "").into());
                }
                if is_judged && out.steps(sensors) == STEPS {
                    sensors.check_stated(path, format)?;
                }
                let may_wait = lines.may_wait();
                if may_wait || out.items.len() >= BATCH {
                    let flow = take(&mut out.items, may_wait)?;
                    is_enough = flow.is_break();
                    return Ok(flow);
                }
            }
            LineEvent::Undecodable(..) => {}
        }
        out.add(event);
        Ok(ControlFlow::Continue(()))
    };
    let sensors = read(&mut lines, path, of_line)?;
    let selection = lines.selection();
    if let Some(why) = selection.and_then(RowSelection::nothing) {
        return Err(Error::unsupported(path, why).into());
    }
    if !has_rates {
        return Err(no_rates(path, format, "").into());
    }
    if is_judged && out.steps(&sensors) < STEPS {
        sensors.check_stated(path, format)?;
    }
    if !is_enough {
        let _ = take(&mut out.items, false)?;
    }
    Ok((met.channels(), selection.and_then(RowSelection::note)))
}

/// Why the unit of the rates may be another one than it is taken for.
#[must_use]
pub fn doubt_of_unit(lines: &Lines<impl Read>) -> Option<String> {
    lines.table().and_then(Table::doubt_of_unit)
}

/// The ways of channels, and what went along them.
#[derive(Default)]
struct RoutedItems {
    routes: Vec<Option<Route>>,
    items: Vec<Item>,
}

impl RoutedItems {
    fn add(&mut self, event: LineEvent<'_, impl Read>) {
        let of = |place: usize| self.routes.get(place).and_then(Option::as_ref);
        match event {
            LineEvent::Samples(place, samples) => {
                if let Some(route) = of(place) {
                    route.pass(samples, &mut self.items);
                }
            }
            LineEvent::Undecodable(place, number, why) => {
                if let Some(route) = of(place) {
                    route.lose(number, why, &mut self.items);
                }
            }
            LineEvent::Met(..) | LineEvent::LineOver(..) => {}
        }
    }

    /// Steps between the stamps of the first channel that has a way.
    fn steps(&self, sensors: &Sensors) -> u64 {
        let first = self.routes.iter().position(Option::is_some);
        let bare = first.and_then(|place| sensors.bare.get(place));
        bare.map_or(0, BareStamps::steps)
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
