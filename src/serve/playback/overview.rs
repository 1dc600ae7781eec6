//! A run of its own over the whole recording -> curves of it, few enough for a page. Pure but for a lock.
//!
//! The run that is played waits for its time; this one goes as fast as it can beside it, and what it finds is kept
//! in stretches of time, so that a page shows the whole recording when it opens. To the run it is an [`Audience`].

mod buckets;
mod course;

use crate::pipeline::audience::{Audience, Grant};
use crate::serve::protocol::position::Part;
use crate::sink::Stream;
use course::Course;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};

/// Stretches kept of all streams together: some 18 MB.
const MOST: usize = 1 << 17;
/// Least of one stream.
const LEAST: usize = 1 << 10;
/// Points that are answered at most, of all streams together.
const MOST_POINTS: usize = 32_000;

/// Overview of a recording, as far as it was read.
#[derive(Debug, Default)]
pub struct Overview {
    found: Mutex<Found>,
}

#[derive(Debug, Default)]
struct Found {
    courses: Vec<Course>,
    /// References, by the stream they belong to.
    references: BTreeMap<usize, Course>,
    most: usize,
    is_complete: bool,
    is_stopped: bool,
}

impl Overview {
    fn found(&self) -> MutexGuard<'_, Found> {
        // Every change is whole before anything in it could panic.
        self.found.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Marks it as whole: the run has come to its end.
    pub fn complete(&self) {
        self.found().is_complete = true;
    }

    /// Ends the run that makes it.
    pub fn stop(&self) {
        self.found().is_stopped = true;
    }

    /// Answer about a part, as one JSON object.
    #[must_use]
    pub fn answer(&self, part: &Part) -> Value {
        let found = self.found();
        let count = found.courses.len() + found.references.len();
        let points = part.points.min(MOST_POINTS / count.max(1)).max(2);
        let all = || found.courses.iter().chain(found.references.values());
        let start = all().filter_map(Course::start).min();
        let start = start.map(|start| {
            let (sec, nsec) = start.to_sec_nanosec();
            json!({"sec": sec, "nsec": nsec})
        });
        let streams: Vec<Value> = all()
            .filter_map(|course| course.json((part.from, part.to), points))
            .collect();
        json!({
            "class": "OVERVIEW",
            "complete": found.is_complete,
            "start": start,
            "streams": streams,
        })
    }
}

impl Audience for Overview {
    fn begin(&self, streams: &[Stream]) {
        let mut found = self.found();
        // A reference may come to each.
        found.most = (MOST / (2 * streams.len()).max(1)).max(LEAST);
        let most = found.most;
        found.courses = streams.iter().map(|of| Course::new(of, most)).collect();
    }

    fn length(&self, _: f64) {}

    fn turn(&self, count: usize, _: &dyn Fn(usize) -> Nanos) -> Option<Grant> {
        let is_shown = true;
        (!self.is_cut()).then_some(Grant { count, is_shown })
    }

    fn attitudes(&self, stream: usize, samples: &[AttitudeSample], _: bool) {
        if let Some(course) = self.found().courses.get_mut(stream) {
            course.take(samples, true);
        }
    }

    fn samples(&self, _: usize, _: &[RawSample], _: bool) {}

    fn wants_recorded(&self) -> bool {
        true
    }

    fn recorded(&self, of: usize, stream: &Stream, samples: &[AttitudeSample], _: bool) {
        let mut found = self.found();
        let most = found.most;
        let reference = found
            .references
            .entry(of)
            .or_insert_with(|| Course::new(stream, most));
        reference.take(samples, false);
        if let Some(course) = found.courses.get_mut(of) {
            course.compare(samples);
        }
    }

    fn is_cut(&self) -> bool {
        self.found().is_stopped
    }
}
