//! Samples from lines of JSON, or rows of a table -> the same run as from a log. I/O.

use super::position::Position;
use super::replay::integrated_again;
use super::replay_start::StreamStart;
use super::request::ReplayRequest;
use super::session::Found;
use super::summarise;
use crate::error::{Error, Result};
use crate::sink::{Flow, Stream, output_topic};
use crate::summary::RunSummary;
use std::collections::BTreeSet;
use std::io::Read;
use std::ops::ControlFlow;
use std::sync::Arc;
use strapd_attitude::condition::Clock;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Meaning, Prepared};
use strapd_recording::MadeBefore;
use strapd_recording::Selection;
use strapd_recording::lines::Lines;
use strapd_recording::mcap::Survey;
use strapd_recording::pool::Pool;
use strapd_recording::recording::channel_route::Item;
use strapd_recording::recording::sensor_lines::{Sensor, SensorTaker, read};

/// Replays lines; `prepared` is what [`prepare`] found, of those that can be read twice.
///
/// # Errors
/// As [`super::replay::run`]; several sensors in one stream and none named.
pub(super) fn replay(
    run: &ReplayRequest,
    input: Lines<impl Read>,
    prepared: Option<Prepared>,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let path = run.source.name();
    let mut running = Running {
        run,
        made_before: MadeBefore::in_lines(&input),
        start: StreamStart::new(run, &path, prepared),
        pool,
        watch,
    };
    read(wanted(run), input, &path, &mut running)?;
    let ended = running.start.into_session(pool)?.finish(run, pool)?;
    Ok(summarise::run(run, ended, &Survey::default()))
}

/// Reads a file of lines as far as is needed to know how it begins, as any other file; `None` where it holds no sensor.
///
/// # Errors
/// As [`replay`].
pub(super) fn prepare(
    run: &ReplayRequest,
    input: Lines<impl Read>,
    pool: &Pool,
) -> Result<Option<Prepared>> {
    let path = run.source.name();
    let mut looking = Running {
        run,
        made_before: None,
        start: StreamStart::look(run, &path),
        pool,
        watch: &mut |_| {},
    };
    read(wanted(run), input, &path, &mut looking)?;
    looking.start.into_prepared()
}

/// A run, or the look before it.
struct Running<'r, 'w> {
    run: &'r ReplayRequest,
    /// Origin of attitudes that are no recording.
    made_before: Option<MadeBefore>,
    start: StreamStart<'r>,
    pool: &'r Pool,
    watch: &'w mut dyn FnMut(&Position),
}

impl SensorTaker for Running<'_, '_> {
    type Error = Error;

    fn meet(&mut self, sensor: Sensor) -> Result<()> {
        let (mut found, stream) = met(self.run, sensor);
        if self.run.selection.topic.is_none()
            && let Some(made) = &self.made_before
        {
            found.warnings.push(integrated_again(made));
        }
        self.start.meet(found, stream)
    }

    fn take(&mut self, items: &mut Vec<Item>) -> Result<ControlFlow<()>> {
        let flow = self.start.consume(items.drain(..), self.pool)?;
        (self.watch)(&self.start.position());
        Ok(match flow {
            Flow::Continue => ControlFlow::Continue(()),
            Flow::Closed => ControlFlow::Break(()),
        })
    }

    fn pause(&mut self) -> Result<()> {
        self.start.flush_to_readers(self.pool)
    }
}

fn wanted(run: &ReplayRequest) -> (&Selection, Clock) {
    (&run.selection, run.plan.clock)
}

fn met(run: &ReplayRequest, sensor: Sensor) -> (Found, Stream) {
    let doubt = sensor.doubt.filter(|_| run.plan.unit.is_none());
    let stream = Stream::new(&sensor.name, "");
    let found = Found {
        output_topic: output_topic(&sensor.name, &BTreeSet::new()),
        name: sensor.name,
        described: sensor.described,
        resolved: Meaning::new(&run.plan, &sensor.declared),
        noticed: Arc::default(),
        warnings: sensor
            .notes
            .into_iter()
            .chain(doubt)
            .map(Diagnostic::from)
            .collect(),
    };
    (found, stream)
}
