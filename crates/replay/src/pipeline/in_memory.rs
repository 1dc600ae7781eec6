//! A recording -> its attitudes, in memory: for programs, which have no file to name. I/O.
//!
//! The same run as into a file, with somebody who takes what it makes in the place of an output: the same samples, in
//! the same order, to the bit.

use super::audience::{Audience, Grant};
use super::replay::run;
use super::request::ReplayRequest;
use crate::error::Result;
use crate::sink::Stream;
use crate::summary::RunSummary;
use std::fmt;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};
use strapd_recording::pool::Pool;

/// The attitudes of one topic.
#[derive(Clone, Debug)]
pub struct TopicAttitudes {
    /// Names: topic, frames, axes, what the quaternions rotate.
    pub stream: Stream,
    /// Attitudes in order of time.
    pub samples: Vec<AttitudeSample>,
}

impl ReplayRequest {
    /// All attitudes of the recording, topic by topic, and what is said of the run.
    ///
    /// # Errors
    /// As [`run`].
    pub fn attitudes(&self, pool: &Pool) -> Result<(Vec<TopicAttitudes>, RunSummary)> {
        let topics = Arc::new(Mutex::new(Vec::<TopicAttitudes>::new()));
        let kept = topics.clone();
        let summary = self.each_attitude(pool, move |streams, topic, samples| {
            let mut topics = kept.lock().unwrap_or_else(PoisonError::into_inner);
            if topics.is_empty() {
                topics.extend(streams.iter().map(|stream| TopicAttitudes {
                    stream: stream.clone(),
                    samples: Vec::new(),
                }));
            }
            if let Some(topic) = topics.get_mut(topic) {
                topic.samples.extend_from_slice(samples);
            }
            ControlFlow::Continue(())
        })?;
        let topics = std::mem::take(&mut *topics.lock().unwrap_or_else(PoisonError::into_inner));
        Ok((topics, summary))
    }

    /// Gives the attitudes to `take` as they are made: all streams of the run, the number of one of them, and its next
    /// attitudes. What `take` breaks off ends there, and says so in the summary's counts alone. With
    /// [`smooth`](strapd_attitude::estimate::EstimationSettings::smooth) all of them come at the end.
    ///
    /// # Errors
    /// As [`run`].
    pub fn each_attitude(
        &self,
        pool: &Pool,
        take: impl FnMut(&[Stream], usize, &[AttitudeSample]) -> ControlFlow<()> + Send + 'static,
    ) -> Result<RunSummary> {
        let taker = AttitudeCollector {
            streams: Mutex::default(),
            take: Mutex::new(take),
            has_enough: AtomicBool::new(false),
        };
        let mut request = self.clone();
        request.audience = Some(Arc::new(taker));
        run(&request, pool, &mut |_| {})
    }
}

/// Whoever takes the attitudes of a run, as its audience: nothing is paced, and it may have enough.
struct AttitudeCollector<F> {
    streams: Mutex<Vec<Stream>>,
    take: Mutex<F>,
    has_enough: AtomicBool,
}

impl<F> fmt::Debug for AttitudeCollector<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Taker").finish_non_exhaustive()
    }
}

impl<F: FnMut(&[Stream], usize, &[AttitudeSample]) -> ControlFlow<()> + Send> Audience
    for AttitudeCollector<F>
{
    fn begin(&self, streams: &[Stream]) {
        *self.streams.lock().unwrap_or_else(PoisonError::into_inner) = streams.to_vec();
    }

    fn length(&self, _secs: f64) {}

    fn turn(&self, count: usize, _due: &dyn Fn(usize) -> Nanos) -> Option<Grant> {
        (!self.has_enough.load(Ordering::Relaxed)).then_some(Grant {
            count,
            is_shown: true,
        })
    }

    fn attitudes(&self, stream: usize, samples: &[AttitudeSample], _is_shown: bool) {
        let streams = self.streams.lock().unwrap_or_else(PoisonError::into_inner);
        let mut take = self.take.lock().unwrap_or_else(PoisonError::into_inner);
        if take(&streams, stream, samples).is_break() {
            self.has_enough.store(true, Ordering::Relaxed);
        }
    }

    fn samples(&self, _stream: usize, _samples: &[RawSample], _is_shown: bool) {}

    fn is_cut(&self) -> bool {
        self.has_enough.load(Ordering::Relaxed)
    }
}
