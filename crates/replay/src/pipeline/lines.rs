//! Samples from lines of JSON, or rows of a table -> the same run as from a log. I/O.

use super::position::Position;
use super::replay::integrated_again;
use super::replay_start::StreamStart;
use super::request::ReplayRequest;
use super::session::TopicInfo;
use super::summarise;
use crate::error::Result;
use crate::sink::{Flow, Stream, output_topic};
use crate::summary::RunSummary;
use std::collections::BTreeSet;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Meaning, Prepared};
use strapd_recording::MadeBefore;
use strapd_recording::lines::Lines;
use strapd_recording::mcap::Survey;
use strapd_recording::pool::Pool;
use strapd_recording::recording::sensor_lines::{Sensor, SensorEvent, read};

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
    let mut start = StreamStart::new(run, &path, prepared);
    read_into(&mut start, run, &path, input, pool, watch)?;
    let ended = start.into_session(pool)?.finish(run, pool)?;
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
    let mut look = StreamStart::look(run, &path);
    read_into(&mut look, run, &path, input, pool, &mut |_| {})?;
    look.into_prepared()
}

fn read_into(
    start: &mut StreamStart<'_>,
    run: &ReplayRequest,
    path: &Path,
    input: Lines<impl Read>,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<()> {
    let made_before = MadeBefore::in_lines(&input);
    let made_before = made_before.filter(|_| run.selection.topic.is_none());
    read((&run.selection, run.plan.clock), input, path, |event| {
        match event {
            SensorEvent::Met(sensor) => {
                let (mut found, stream) = met(run, sensor);
                let again = made_before.as_ref().map(integrated_again);
                found.warnings.extend(again);
                start.meet(found, stream)?;
            }
            SensorEvent::Items(items) => {
                let flow = start.consume(items.drain(..), pool)?;
                watch(&start.position());
                if flow == Flow::Closed {
                    return Ok(ControlFlow::Break(()));
                }
            }
            SensorEvent::Pause => start.flush_to_readers(pool)?,
        }
        Ok(ControlFlow::Continue(()))
    })
}

fn met(run: &ReplayRequest, sensor: Sensor) -> (TopicInfo, Stream) {
    let doubt = sensor.doubt.filter(|_| run.plan.unit.is_none());
    let stream = Stream::new(&sensor.name, "");
    let found = TopicInfo {
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
