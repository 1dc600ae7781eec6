//! Samples from lines of JSON, or rows of a table -> the same run as from a log. I/O.

use super::bare_stamps::BareStamps;
use super::channel_route::Item;
use super::early_besides::{EarlyBesides, are_beside};
use super::line_input::{described, no_samples, unclear};
use super::position::Position;
use super::replay_start::Waiting;
use super::request::{ReplayRequest, refused};
use super::session::Found;
use super::simulate::TRUTH_ID;
use super::summarise;
use crate::error::{Error, Result};
use crate::sink::{Flow, Stream, output_topic};
use crate::summary::RunSummary;
use std::collections::BTreeSet;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::condition::Clock;
use strapd_attitude::estimate::Meaning;
use strapd_attitude::estimate::{StampPass, Stamps};
use strapd_attitude::record::{Declared, Nanos};
use strapd_attitude::setting::{COLUMNS, FIELD, RATE_HZ, TIME, TOPIC};
use strapd_recording::decode::{Class, Undecodable};
use strapd_recording::delimited::Table;
use strapd_recording::format::Format;
use strapd_recording::lines::Lines;
use strapd_recording::mcap::Survey;
use strapd_recording::pool::Pool;

/// Samples that go through the pipeline together.
const BATCH: usize = 2048;
/// Lines without any sample before the first, after which this is no log of samples.
const PATIENCE: u64 = 1000;

/// Replays lines; `stamps` is what [`stamps`] found.
///
/// # Errors
/// As [`super::replay::run`]; several sensors in one stream and none named.
pub(super) fn replay(
    run: &ReplayRequest,
    input: Lines<impl Read>,
    stamps: Option<Stamps>,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let path = run.source.name();
    let mut running = Running {
        waiting: Waiting::new(run, &path, stamps),
        pool,
        watch,
    };
    read(run, input, &path, &mut running)?;
    let ended = running.waiting.into_session(pool)?.finish(pool)?;
    Ok(summarise::run(run, ended, &Survey::default()))
}

/// Reads a file of lines for its stamps alone, where these are to be regularised.
///
/// # Errors
/// As [`replay`]; there is no constant rate.
pub(super) fn stamps(run: &ReplayRequest, input: Lines<impl Read>) -> Result<Option<Stamps>> {
    if !run.plan.regularise_stamps {
        return Ok(None);
    }
    let path = run.source.name();
    let mut looking = Looking {
        run,
        path: &path,
        pass: None,
    };
    read(run, input, &path, &mut looking)?;
    let Some((name, pass)) = looking.pass else {
        return Ok(None);
    };
    let found = pass.finish().map_err(|what| refused(&path, &name, what))?;
    Ok(Some(found))
}

/// Whoever takes what is read from lines.
trait Taker {
    /// The sensor is known.
    fn meet(&mut self, found: Found, stream: Stream) -> Result<()>;
    /// The next items.
    fn take(&mut self, items: &mut Vec<Item>) -> Result<Flow>;
    /// The next line may be long in coming.
    fn pause(&mut self) -> Result<()>;
}

/// A run.
struct Running<'r, 'w> {
    waiting: Waiting<'r>,
    pool: &'r Pool,
    watch: &'w mut dyn FnMut(&Position),
}

impl Taker for Running<'_, '_> {
    fn meet(&mut self, found: Found, stream: Stream) -> Result<()> {
        self.waiting.meet(&mut Some((found, stream)))
    }

    fn take(&mut self, items: &mut Vec<Item>) -> Result<Flow> {
        let flow = self.waiting.consume(items.drain(..), self.pool)?;
        (self.watch)(&self.waiting.position());
        Ok(flow)
    }

    fn pause(&mut self) -> Result<()> {
        self.waiting.flush_to_readers(self.pool)
    }
}

/// A pass for the stamps.
struct Looking<'r> {
    run: &'r ReplayRequest,
    path: &'r Path,
    pass: Option<(String, StampPass)>,
}

impl Taker for Looking<'_> {
    fn meet(&mut self, found: Found, _: Stream) -> Result<()> {
        self.pass = StampPass::new(&self.run.plan, &found.resolved, self.run.other_kinds())
            .map(|pass| (found.name, pass));
        Ok(())
    }

    fn take(&mut self, items: &mut Vec<Item>) -> Result<Flow> {
        for item in items.drain(..) {
            if let (Item::Sample(_, raw), Some((name, pass))) = (item, &mut self.pass)
                && !raw.is_beside
            {
                pass.push(&raw)
                    .map_err(|what| refused(self.path, name, what))?;
            }
        }
        Ok(Flow::Continue)
    }

    fn pause(&mut self) -> Result<()> {
        Ok(())
    }
}

/// Reads lines to their end, or until nobody wants them.
fn read(
    run: &ReplayRequest,
    mut lines: Lines<impl Read>,
    path: &Path,
    taker: &mut impl Taker,
) -> Result<()> {
    let format = lines.format();
    let mut sensor: Option<String> = None;
    let mut bare = BareStamps::default();
    // Rows under a header that is known are of a table, though the first be none.
    let (mut early, mut first_bad) = (Vec::new(), None);
    let mut early_besides = EarlyBesides::default();
    let mut has_rates = false;
    let mut samples = Vec::new();
    let mut items = Vec::with_capacity(BATCH);
    let mut closed = false;
    while !closed && let Some(line) = lines.next(&mut samples)? {
        match line {
            Err(why) if sensor.is_none() => {
                first_bad.get_or_insert_with(|| no_samples(path, &lines, &why));
                let is_sure = lines.table().is_some_and(|table| !table.is_own());
                if !is_sure || early.len() as u64 > PATIENCE {
                    break;
                }
                early.push(undecodable(lines.number(), why));
            }
            Err(why) => items.push(undecodable(lines.number(), why)),
            // Of another sensor of the device than the gyro.
            Ok(line) if are_beside(&line, &mut samples) => match &sensor {
                None if lines.number() > PATIENCE => return Err(nothing(path, format)),
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
                        return Err(nothing(path, format));
                    }
                    continue;
                }
                let id = line.id.take().unwrap_or_default();
                // An attitude carries the rate behind it, which makes it a sample where there is
                // nothing else: not beside samples, and not when it is the truth about them.
                let truth = id == TRUTH_ID && run.selection.topic.as_deref() != Some(TRUTH_ID);
                if line.class == Class::Att && (has_rates || truth) {
                    samples.clear();
                    continue;
                }
                if run
                    .selection
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
                            interval_unit_given: run.selection.decode.states_interval_unit(),
                            ..lines.declared()
                        };
                        let is_placed = matches!(run.plan.clock, Clock::Index { .. })
                            || lines.table().is_none_or(Table::has_stamps);
                        if !is_placed {
                            return Err(unplaced(path, &lines));
                        }
                        let (found, stream) = met(run, &id, &lines, &declared);
                        taker.meet(found, stream)?;
                        items.append(&mut early);
                        for (line, mut samples) in early_besides.release(&id) {
                            let known = bare.take(&mut samples, &line);
                            let known = known.map_err(|what| unclear(path, &what))?;
                            items.extend(known.map(|raw| Item::Sample(0, raw)));
                        }
                        sensor = Some(id);
                    }
                    Some(first) if *first != id => {
                        return Err(refused(
                            path,
                            first,
                            format!(
                                "line {}: samples of another sensor, `{id}`\n  help: {TOPIC} ID takes one of them, and of a file {TOPIC} all each",
                                lines.number()
                            ),
                        ));
                    }
                    Some(_) => {}
                }
                let known = bare.take(&mut samples, &line);
                let known = known.map_err(|what| unclear(path, &what))?;
                items.extend(known.map(|raw| Item::Sample(0, raw)));
            }
        }
        // With nothing left in the buffer the next line may be long in coming: what is known goes
        // out first.
        let may_wait = lines.may_wait();
        if sensor.is_some() && (items.len() >= BATCH || may_wait) {
            closed = taker.take(&mut items)? == Flow::Closed;
        }
        if sensor.is_some() && may_wait {
            taker.pause()?;
        }
    }
    if sensor.is_none() {
        return Err(first_bad.unwrap_or_else(|| nothing(path, format)));
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
        Format::Table => {
            format!(
                "no row carries a body rate\n  help: columns gyro_x, gyro_y, gyro_z, in rad/s, or {COLUMNS} gyro=NAME:NAME:NAME"
            )
        }
        _ => {
            format!(
                "no line carries a body rate\n  help: {{\"class\":\"RATE\",\"stamp\":{{\"sec\":1,\"nsec\":0}},\"gyro\":[0.1,0,0]}}, or {FIELD} gyro=PATH"
            )
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
        what: format!(
            "no row says when it was measured\n  help: {TIME} index {RATE_HZ} HZ, or {COLUMNS} stamp=NAME:UNIT\n  note: {}",
            notes.join("; ")
        ),
    }
}

fn met(
    run: &ReplayRequest,
    id: &str,
    lines: &Lines<impl Read>,
    declared: &Declared,
) -> (Found, Stream) {
    let name = if id.is_empty() { "imu" } else { id };
    let notes = lines.notes();
    let doubt = lines.table().and_then(Table::doubt_of_unit);
    let doubt = doubt.filter(|_| run.plan.unit.is_none());
    let found = Found {
        name: name.to_owned(),
        output_topic: output_topic(name, &BTreeSet::new()),
        described: described(lines),
        resolved: Meaning::new(&run.plan, declared),
        noticed: Arc::default(),
        warnings: notes.into_iter().chain(doubt).collect(),
    };
    (found, Stream::new(name, ""))
}
