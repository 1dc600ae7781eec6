//! Findings and decisions -> a session with its outputs open. I/O.
//!
//! Apart from the sources because a file, a stream and lines all begin the same way.

use super::delivery::{Delivery, Outlet};
use super::provenance;
use super::recorded::RecordedTrack;
use super::request::ReplayRequest;
use super::session::{Session, Topic, TopicInfo};
use crate::error::{Error, Result};
use crate::sink::{Stream, Transforms};
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::estimate::{Meaning, Prepared};
use strapd_attitude::setting::TOPIC;

/// The output's labels: frames and axes as they will be in the numbers.
pub fn labelled(
    mut stream: Stream,
    plan: &EstimationSettings,
    resolved: &Meaning,
    prepared: &Prepared,
) -> Stream {
    let (world, body) = resolved.labels(prepared.world);
    let kind = resolved.kind_choice();
    stream.input_kind = kind.reason.is_stated().then_some(kind.kind);
    stream.world_axes = world;
    stream.body_axes = body;
    stream.has_linear_acceleration = plan.linear_acceleration;
    stream.has_temperature |= prepared.has_temperature;
    if resolved.is_remapped(plan, prepared.world) {
        stream.rotates = "body_to_world".to_owned();
        // The sensor's own frame keeps its axes; this is another one.
        stream.frame_id = match stream.frame_id.as_str() {
            "" => stream.body_axes.clone(),
            id => format!("{id}_{}", stream.body_axes),
        };
    }
    stream
}

/// A topic ready to run, and the labels of its output.
///
/// # Errors
/// As [`Topic::new`].
pub(super) fn topic(
    run: &ReplayRequest,
    path: &Path,
    (found, stream): (TopicInfo, Stream),
    prepared: Prepared,
) -> Result<(Topic, Stream)> {
    let stream = labelled(stream, &run.plan, &found.resolved, &prepared);
    let mut topic = Topic::new(path, &run.plan, found, prepared, run.against.is_some())?;
    if let (Some(against), Some(track)) = (&mut topic.against, &run.reference) {
        against.take_reference_track(track);
    }
    if run.plan.smooth {
        topic.spool_beside(&run.targets);
    }
    Ok((topic, stream))
}

/// Gives frames the names that were asked for.
///
/// # Errors
/// One name, or one world as a child, for several sensors.
fn name_frames(run: &ReplayRequest, streams: &mut [Stream]) -> Result<()> {
    let frames = &run.frames;
    let is_reverse = frames.transforms == Transforms::Reverse;
    if streams.len() > 1 && (frames.body.is_some() || is_reverse) {
        let what = match &frames.body {
            Some(name) => format!("{} sensors cannot all be the frame {name}", streams.len()),
            None => format!(
                "--tf reverse: the world would have {} parents, a sensor each",
                streams.len()
            ),
        };
        return Err(Error::usage(
            Diagnostic::new(what).help(format!("{TOPIC} NAME")),
        ));
    }
    streams.iter_mut().for_each(|stream| frames.name(stream));
    Ok(())
}

/// Opens the outputs of topics and what was decided of each.
pub(super) fn begin(
    run: &ReplayRequest,
    path: &Path,
    decided: impl Iterator<Item = ((TopicInfo, Stream), Prepared)>,
) -> Result<Session> {
    let topics = decided.map(|(start, prepared)| topic(run, path, start, prepared));
    let topics = topics.collect::<Result<Vec<_>>>()?;
    let (mut topics, mut streams): (Vec<Topic>, Vec<Stream>) = topics.into_iter().unzip();
    name_frames(run, &mut streams)?;
    let provenance = provenance::of(run, &topics, &streams)?;
    if run.audience.as_ref().is_some_and(|a| a.wants_recorded()) {
        let is_alone = streams.len() == 1;
        for (topic, stream) in topics.iter_mut().zip(&streams) {
            let mut recorded =
                RecordedTrack::new(stream, is_alone, &topic.resolved, &topic.prepared);
            if let Some(track) = &run.reference {
                recorded.take_reference_track(track.clone());
            }
            topic.recorded = Some(recorded);
        }
    }
    let outlet = Outlet::open(
        &run.targets,
        &run.source.files(),
        run.options,
        &streams,
        &provenance,
        Delivery {
            out_rate: run.out_rate,
            instants: run.instants.clone(),
            speed: run.speed,
            audience: run.audience.clone(),
        },
    )?;
    Ok(Session::new(topics, outlet))
}
