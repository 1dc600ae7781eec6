//! Attitudes of every stream -> every sink of the run. I/O.

use super::audience::{Audience, Grant};
use super::pace::Pace;
use crate::error::Result;
use crate::sink::{
    CopiedChannel, Decimator, Flow, InputChannel, InputMessage, Options, Provenance, Sink, Stream,
    Target, Written,
};
use rayon::ThreadPool;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::Estimator;
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};
use strapd_attitude::resample::{Left, Resampler};
use strapd_attitude::setting::AT;
use strapd_recording::pool::Pool;
use strapd_recording::recording::channel_route::Copied;

/// Name of standard output in the summary.
const STDOUT: &str = "standard output";

/// Way by which items of a kind are handed over.
struct Way<T> {
    due: fn(&T) -> Nanos,
    write: fn(&mut Sink, usize, &[T], &ThreadPool) -> Result<Flow>,
    show: fn(&dyn Audience, usize, &[T], bool),
}

const ATTITUDES: Way<AttitudeSample> = Way {
    due: |sample| sample.stamp,
    write: Sink::write,
    show: |audience, stream, samples, shown| audience.attitudes(stream, samples, shown),
};

const SAMPLES: Way<RawSample> = Way {
    due: |sample| sample.log,
    write: Sink::write_raw,
    show: |audience, stream, samples, shown| audience.samples(stream, samples, shown),
};

/// Name of a target in the summary.
fn name(target: &Target) -> String {
    match target {
        Target::File { path, .. } => path.display().to_string(),
        Target::Store { address, .. } => address.place(),
        Target::Stdout => STDOUT.to_owned(),
        Target::Null => "null:".to_owned(),
        Target::Listen(listen) => listen.to_string(),
        Target::Tcp(address) => format!("tcp://{address}"),
        Target::Udp { address, .. } => format!("udp://{address}"),
        Target::Protocol(recipient) => recipient.to_string(),
    }
}

/// Outcome of the instants of `--at` in a stream.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resampled {
    /// Instants that have no attitude.
    pub left: Left,
    /// Number that were asked for.
    pub asked: usize,
    /// First and last.
    pub span: Option<(Nanos, Nanos)>,
}

impl Resampled {
    fn of(resampler: &Resampler) -> Resampled {
        let instants = resampler.instants();
        Resampled {
            left: resampler.left(),
            asked: instants.len(),
            span: instants.first().copied().zip(instants.last().copied()),
        }
    }

    /// Number of instants without an attitude.
    pub(super) fn missing(&self) -> usize {
        self.left.outside + self.left.in_gaps
    }

    /// Warning about them.
    pub(super) fn warning(&self) -> Option<Diagnostic> {
        let why = [
            (self.left.outside, "before the first or after the last"),
            (self.left.in_gaps, "in gaps"),
        ];
        let why = why.iter().filter(|(n, _)| *n > 0);
        let why: Vec<String> = why.map(|(n, why)| format!("{n} {why}")).collect();
        let what = format!(
            "{AT}: {} of {} instants have no attitude: {}",
            self.missing(),
            self.asked,
            why.join(", ")
        );
        (self.missing() > 0).then(|| Diagnostic::new(what))
    }
}

/// Choice of the attitudes that are handed over.
#[derive(Debug)]
enum Selector {
    /// Attitudes at a rate.
    Rate(Decimator),
    /// Attitudes at instants of their own.
    At(Resampler),
}

/// The sinks of a run.
#[derive(Debug)]
pub(super) struct Outlet {
    sinks: Vec<(String, Sink)>,
    copied: Vec<BTreeMap<usize, CopiedChannel>>,
    selectors: Vec<Option<Selector>>,
    kept: Vec<AttitudeSample>,
    pace: Option<Pace>,
    audience: Option<Arc<dyn Audience>>,
    /// Whether what was handed over last was shown.
    is_shown: bool,
    closed: bool,
}

/// Pacing: when items are handed over, and how many of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Delivery {
    /// `--out-rate`, Hz.
    pub out_rate: Option<f64>,
    /// `--at`: instants of the attitudes that are handed over, in place of the samples'.
    pub instants: Option<Arc<[Nanos]>>,
    /// `--speed`; `None` = as fast as possible.
    pub speed: Option<f64>,
    /// Audience that is served if targets listen.
    pub audience: Option<Arc<dyn Audience>>,
}

/// The sockets that broke before the end.
pub(super) fn broken(written: &[(String, Written)]) -> Vec<String> {
    written
        .iter()
        .filter(|(_, w)| w.broken)
        .map(|(name, _)| name.clone())
        .collect()
}

impl Outlet {
    /// Opens every target; those that listen are the `audience`'s, which then has the pace too.
    ///
    /// # Errors
    /// As [`Sink::create`]; nothing is left behind.
    pub(super) fn open(
        targets: &[Target],
        inputs: &[PathBuf],
        options: Options,
        streams: &[Stream],
        provenance: &Provenance,
        delivery: Delivery,
    ) -> Result<Outlet> {
        let Delivery {
            out_rate,
            instants,
            speed,
            audience,
        } = delivery;
        let sinks = targets
            .iter()
            .filter(|target| target.listens().is_none())
            .map(|target| {
                let sink = Sink::create(target, inputs, options, streams, provenance)?;
                Ok((name(target), sink))
            })
            .collect::<Result<Vec<_>>>()?;
        if let Some(audience) = &audience {
            audience.begin(streams);
        }
        Ok(Outlet {
            copied: sinks.iter().map(|_| BTreeMap::new()).collect(),
            sinks,
            selectors: streams
                .iter()
                .map(|_| match &instants {
                    Some(instants) => Some(Selector::At(Resampler::new(instants.clone()))),
                    None => Some(Selector::Rate(out_rate.and_then(Decimator::new)?)),
                })
                .collect(),
            kept: Vec::new(),
            pace: Pace::new(speed),
            audience,
            is_shown: true,
            closed: false,
        })
    }

    /// Hands attitudes of one stream to every sink, no faster than asked.
    ///
    /// # Errors
    /// As [`Sink::write`].
    pub(super) fn write(
        &mut self,
        stream: usize,
        samples: &[AttitudeSample],
        pool: &Pool,
    ) -> Result<Flow> {
        let Some(selector) = self.selectors.get_mut(stream).and_then(Option::as_mut) else {
            return self.hand_over(stream, samples, ATTITUDES, pool);
        };
        let mut kept = std::mem::take(&mut self.kept);
        kept.clear();
        match selector {
            Selector::Rate(decimator) => decimator.select(samples, &mut kept),
            Selector::At(resampler) => resampler.push(samples, &mut kept),
        }
        let flow = self.hand_over(stream, &kept, ATTITUDES, pool);
        self.kept = kept;
        flow
    }

    /// Hands over what waits for a later attitude of a stream that has ended. What became of the instants of `--at`.
    ///
    /// # Errors
    /// As [`Sink::write`].
    pub(super) fn end(&mut self, stream: usize, pool: &Pool) -> Result<Option<Resampled>> {
        let Some(Some(Selector::At(resampler))) = self.selectors.get_mut(stream) else {
            return Ok(None);
        };
        let mut rest = Vec::new();
        resampler.finish(&mut rest);
        let left = Resampled::of(resampler);
        // Who has had enough misses nothing by it: the stream is over.
        let _ = self.hand_over(stream, &rest, ATTITUDES, pool)?;
        Ok(Some(left))
    }

    /// Hands what a gyro put out to every sink, no faster than asked.
    ///
    /// # Errors
    /// As [`Sink::write_raw`].
    pub(super) fn write_raw(
        &mut self,
        stream: usize,
        samples: &[RawSample],
        pool: &Pool,
    ) -> Result<Flow> {
        self.hand_over(stream, samples, SAMPLES, pool)
    }

    fn hand_over<T>(
        &mut self,
        stream: usize,
        samples: &[T],
        way: Way<T>,
        pool: &Pool,
    ) -> Result<Flow> {
        let mut rest = samples;
        while let (false, Some(first)) = (self.closed, rest.first()) {
            let turn = match (&self.audience, &mut self.pace) {
                (Some(audience), _) => {
                    let due = |n: usize| (way.due)(rest.get(n).unwrap_or(first));
                    match audience.turn(rest.len(), &due) {
                        Some(turn) => turn,
                        None => {
                            self.closed = true;
                            break;
                        }
                    }
                }
                (None, pace) => {
                    let count = pace.as_mut().map_or(rest.len(), |pace| {
                        pace.wait((way.due)(first));
                        pace.take(rest.iter().map(way.due))
                    });
                    Grant {
                        count,
                        is_shown: true,
                    }
                }
            };
            self.is_shown = turn.is_shown;
            let (now, later) = rest.split_at(turn.count.min(rest.len()));
            rest = later;
            if let Some(audience) = &self.audience {
                (way.show)(&**audience, stream, now, turn.is_shown);
            }
            let mut flows = Vec::with_capacity(self.sinks.len());
            for (_, sink) in &mut self.sinks {
                let mut flow = (way.write)(sink, stream, now, pool.rayon())?;
                if self.pace.is_some() && turn.is_shown && flow == Flow::Continue {
                    flow = sink.flush(pool.rayon())?;
                }
                flows.push(flow);
            }
            // A reader that has gone ends the run only when nobody else is served: a file beside it
            // must still become whole.
            self.closed = self.audience.is_none()
                && !flows.is_empty()
                && flows.iter().all(|flow| *flow == Flow::Closed);
        }
        Ok(if self.closed {
            Flow::Closed
        } else {
            Flow::Continue
        })
    }

    /// Whether what is handed over waits for its time.
    #[must_use]
    pub(super) fn is_paced(&self) -> bool {
        self.pace.is_some()
    }

    /// Shows recorded orientations of what a stream estimates, up to what was handed over.
    pub(super) fn recorded(&self, of: usize, stream: &Stream, samples: &[AttitudeSample]) {
        if let (Some(audience), false) = (&self.audience, samples.is_empty()) {
            audience.recorded(of, stream, samples, self.is_shown);
        }
    }

    /// Tells whoever is shown the run what is known of a stream by now.
    pub(super) fn known(&self, stream: usize, estimator: &Estimator) {
        if let Some(audience) = &self.audience {
            audience.known(stream, estimator);
        }
    }

    /// Whether somebody is shown the run.
    #[must_use]
    pub(super) fn has_audience(&self) -> bool {
        self.audience.is_some()
    }

    /// Tells the approximate length of the input to whoever is shown where the run is.
    pub(super) fn length(&self, secs: f64) {
        if let Some(audience) = &self.audience {
            audience.length(secs);
        }
    }

    /// Pushes what was handed over out to standard output and sockets, whose readers may wait for it. Files are
    /// left to fill their batches: nobody reads them yet, and an MCAP's bytes would show it.
    ///
    /// # Errors
    /// As [`Sink::flush`].
    pub(super) fn flush_to_readers(&mut self, pool: &Pool) -> Result<()> {
        for (name, sink) in &mut self.sinks {
            if name == STDOUT || name.contains("://") {
                // That it has hung up is noticed at the next write.
                let _ = sink.flush(pool.rayon())?;
            }
        }
        Ok(())
    }

    /// Copies a message of the input to every sink that has room for it.
    ///
    /// # Errors
    /// As [`Sink::copy`].
    pub(super) fn copy(&mut self, message: &Copied, pool: &Pool) -> Result<()> {
        for ((_, sink), channels) in self.sinks.iter_mut().zip(&mut self.copied) {
            let channel = match channels.get(&message.channel.index) {
                Some(channel) => *channel,
                None => {
                    let schema = message.channel.schema.as_deref();
                    let declared = sink.copy_channel(&InputChannel {
                        topic: &message.channel.topic,
                        message_encoding: &message.channel.message_encoding,
                        schema: schema
                            .map(|s| (s.name.as_str(), s.encoding.as_str(), s.data.as_slice())),
                        metadata: &message.channel.metadata,
                    })?;
                    channels.insert(message.channel.index, declared);
                    declared
                }
            };
            let _ = sink.copy(
                channel,
                &InputMessage {
                    sequence: message.sequence,
                    log_time: message.log_time,
                    publish_time: message.publish_time,
                    data: &message.data,
                },
                pool.rayon(),
            )?;
        }
        Ok(())
    }

    /// Completes every output; of a run that was told to end before its end, none.
    ///
    /// # Errors
    /// As [`Sink::finish`].
    pub(super) fn finish(self) -> Result<Vec<(String, Written)>> {
        if self.audience.as_ref().is_some_and(|a| a.is_cut()) {
            return Ok(Vec::new());
        }
        self.sinks
            .into_iter()
            .map(|(name, sink)| Ok((name, sink.finish()?)))
            .collect()
    }
}
