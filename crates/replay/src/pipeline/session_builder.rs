//! Findings and decisions -> a session with its outputs open. I/O.
//!
//! Apart from the sources because a file, a stream and lines all begin the same way.

use super::delivery::{Delivery, Outlet};
use super::provenance;
use super::recorded::RecordedTrack;
use super::request::ReplayRequest;
use super::session::{Found, Session, Topic};
use crate::error::Result;
use crate::sink::Stream;
use std::path::Path;
use strapd_attitude::estimate::Plan;
use strapd_attitude::estimate::{Meaning, Prepared};

/// The output's labels: frames and axes as they will be in the numbers.
pub fn labelled(
    mut stream: Stream,
    plan: &Plan,
    resolved: &Meaning,
    prepared: &Prepared,
) -> Stream {
    let (world, body) = resolved.labels(prepared.world);
    stream.world_axes = world;
    stream.body_axes = body;
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

pub(super) fn begin(
    run: &ReplayRequest,
    path: &Path,
    founds: Vec<Found>,
    prepared: Vec<Prepared>,
    streams: &[Stream],
) -> Result<Session> {
    let provenance = provenance::of(run, &founds, &prepared, streams)?;
    let shows_recorded = run.audience.as_ref().is_some_and(|a| a.wants_recorded());
    let topics = founds
        .into_iter()
        .zip(prepared)
        .zip(streams)
        .map(|((found, prepared), stream)| {
            let track = shows_recorded.then(|| {
                RecordedTrack::new(stream, streams.len() == 1, &found.resolved, &prepared)
            });
            let mut topic = Topic::new(path, &run.plan, found, prepared, run.against.is_some())?;
            topic.recorded = track;
            if run.plan.smooth {
                topic.spool_beside(&run.targets);
            }
            Ok(topic)
        })
        .collect::<Result<Vec<_>>>()?;
    let inputs = run.source.files();
    let outlet = Outlet::open(
        &run.targets,
        &inputs,
        run.options,
        streams,
        &provenance,
        Delivery {
            out_rate: run.out_rate,
            speed: run.speed,
            audience: run.audience.clone(),
        },
    )?;
    Ok(Session::new(topics, outlet))
}
