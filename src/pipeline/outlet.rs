//! Attitudes of every stream -> every sink of the run. I/O.

use super::pace::Pace;
use super::pool::Pool;
use super::route::Copied;
use crate::error::Result;
use crate::record::{AttitudeSample, Nanos, RawSample};
use crate::sink::{
    CopiedChannel, Decimator, Flow, InputChannel, InputMessage, Options, Provenance, Sink, Stream,
    Target, Written,
};
use rayon::ThreadPool;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What standard output is called in the summary.
const STDOUT: &str = "standard output";

/// What a target is called in the summary.
fn name(target: &Target) -> String {
    match target {
        Target::File { path, .. } => path.display().to_string(),
        Target::Stdout => STDOUT.to_owned(),
        Target::Null => "null:".to_owned(),
    }
}

/// The sinks of a run.
#[derive(Debug)]
pub struct Outlet {
    sinks: Vec<(String, Sink)>,
    copied: Vec<BTreeMap<usize, CopiedChannel>>,
    decimators: Vec<Option<Decimator>>,
    kept: Vec<AttitudeSample>,
    pace: Option<Pace>,
    closed: bool,
}

impl Outlet {
    /// Opens every target.
    ///
    /// # Errors
    /// As [`Sink::create`]; nothing is left behind.
    pub fn open(
        targets: &[Target],
        inputs: &[PathBuf],
        options: Options,
        streams: &[Stream],
        provenance: &Provenance,
        out_rate: Option<f64>,
        speed: Option<f64>,
    ) -> Result<Outlet> {
        let sinks = targets
            .iter()
            .map(|target| {
                let sink = Sink::create(target, inputs, options, streams, provenance)?;
                Ok((name(target), sink))
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(Outlet {
            copied: sinks.iter().map(|_| BTreeMap::new()).collect(),
            sinks,
            decimators: streams
                .iter()
                .map(|_| out_rate.and_then(Decimator::new))
                .collect(),
            kept: Vec::new(),
            pace: Pace::new(speed),
            closed: false,
        })
    }

    /// Hands attitudes of one stream to every sink, no faster than asked.
    ///
    /// # Errors
    /// As [`Sink::write`].
    pub fn write(
        &mut self,
        stream: usize,
        samples: &[AttitudeSample],
        pool: &Pool,
    ) -> Result<Flow> {
        let Some(decimator) = self.decimators.get_mut(stream).and_then(Option::as_mut) else {
            return self.hand_over(stream, samples, |s| s.stamp, Sink::write, pool);
        };
        let mut kept = std::mem::take(&mut self.kept);
        kept.clear();
        decimator.select(samples, &mut kept);
        let flow = self.hand_over(stream, &kept, |s| s.stamp, Sink::write, pool);
        self.kept = kept;
        flow
    }

    /// Hands what a gyro put out to every sink, no faster than asked.
    ///
    /// # Errors
    /// As [`Sink::write_raw`].
    pub fn write_raw(&mut self, stream: usize, samples: &[RawSample], pool: &Pool) -> Result<Flow> {
        self.hand_over(stream, samples, |s| s.log, Sink::write_raw, pool)
    }

    fn hand_over<T>(
        &mut self,
        stream: usize,
        samples: &[T],
        due: fn(&T) -> Nanos,
        write: fn(&mut Sink, usize, &[T], &ThreadPool) -> Result<Flow>,
        pool: &Pool,
    ) -> Result<Flow> {
        let mut rest = samples;
        while let (false, Some(first)) = (self.closed, rest.first()) {
            let n = match &mut self.pace {
                None => rest.len(),
                Some(pace) => {
                    pace.wait(due(first));
                    pace.take(rest.iter().map(due))
                }
            };
            let (now, later) = rest.split_at(n);
            rest = later;
            let mut flows = Vec::with_capacity(self.sinks.len());
            for (_, sink) in &mut self.sinks {
                let mut flow = write(sink, stream, now, pool.rayon())?;
                if self.pace.is_some() && flow == Flow::Continue {
                    flow = sink.flush(pool.rayon())?;
                }
                flows.push(flow);
            }
            // A reader that has gone ends the run only when nobody else is served: a file beside it
            // must still become whole.
            self.closed = !flows.is_empty() && flows.iter().all(|flow| *flow == Flow::Closed);
        }
        Ok(if self.closed {
            Flow::Closed
        } else {
            Flow::Continue
        })
    }

    /// Pushes what was handed over out to standard output, whose reader may wait for it. Files are
    /// left to fill their batches: nobody reads them yet, and an MCAP's bytes would show it.
    ///
    /// # Errors
    /// As [`Sink::flush`].
    pub fn flush_to_readers(&mut self, pool: &Pool) -> Result<()> {
        for (name, sink) in &mut self.sinks {
            if name == STDOUT {
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
    pub fn copy(&mut self, message: &Copied, pool: &Pool) -> Result<()> {
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

    /// Completes every output.
    ///
    /// # Errors
    /// As [`Sink::finish`].
    pub fn finish(self) -> Result<Vec<(String, Written)>> {
        self.sinks
            .into_iter()
            .map(|(name, sink)| Ok((name, sink.finish()?)))
            .collect()
    }
}
