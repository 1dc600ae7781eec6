//! Items in order -> estimators -> outlet: the consuming half of a run, whatever the source. I/O
//! only through the outlet.

use super::delivery::{Outlet, Resampled};
use super::history::History;
use super::position::Position;
use super::recorded::RecordedTrack;
use super::request::{ReplayRequest, refused};
use super::sample_kinds::AgainstRecorded;
use super::unmet::{is_outside, unmet};
use crate::error::{Error, Result};
use crate::field_watch::FieldWatch;
use crate::sink::{Flow, Target, Written};
use crate::summary::warming::Warming;
use nalgebra::Vector3;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::condition::quality::BrokenAxes;
use strapd_attitude::condition::{Histogram, LoneZeros};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::Estimator;
use strapd_attitude::estimate::{Aid, EstimationSettings};
use strapd_attitude::estimate::{Meaning, Prepared};
use strapd_attitude::quaternion::BodyRate;
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample, SampleKind, Status};
use strapd_recording::decode::Undecodable;
use strapd_recording::pool::Pool;
use strapd_recording::recording::channel_route::{Item, PayloadNotes};
use strapd_recording::recording::payload_type::PayloadType;

/// One estimated topic of a run.
#[derive(Debug)]
pub(super) struct Topic {
    /// Name of its source.
    pub name: String,
    /// Topic of its attitude.
    pub output_topic: String,
    /// Type and encoding.
    pub described: PayloadType,
    /// Meaning of its samples.
    pub resolved: Meaning,
    /// Decisions made before the first was integrated.
    pub prepared: Prepared,
    /// Observations in its payloads.
    pub noticed: Arc<PayloadNotes>,
    /// Things to know, beside those of `prepared`.
    pub warnings: Vec<Diagnostic>,
    /// Estimator.
    pub estimator: Estimator,
    /// Figures of its attitudes.
    pub output: AttitudeStats,
    /// Samples without any rate amid others.
    pub zeros: LoneZeros,
    /// The stamp of the last sample, used or not.
    pub last_stamp: Option<Nanos>,
    /// Whether its magnetic field is one, where it is to tell north.
    pub field: Option<FieldWatch>,
    /// The first payload that could not be decoded.
    pub first_undecodable: Option<(Nanos, Undecodable)>,
    /// Comparison with the recorded orientation.
    pub against: Option<AgainstRecorded>,
    /// Outcome of the instants of `--at`.
    pub instants: Option<Resampled>,
    /// Series kept to be drawn, for a report.
    pub history: Option<History>,
    /// The recorded orientation, for who is shown it beside the estimate.
    pub recorded: Option<RecordedTrack>,
    /// The bias against the temperature of its samples.
    pub warming: WarmingWatch,
    /// Faults of single axes of the gyro.
    pub broken: BrokenAxes,
}

/// Time between two looks at the bias and its temperature, ns.
const LOOK: i64 = 1_000_000_000;

/// Looks at the bias and its temperature, a second apart.
#[derive(Debug, Default)]
pub(super) struct WarmingWatch {
    /// The pairs.
    pub pairs: Warming,
    next: Option<Nanos>,
    is_due: bool,
}

impl WarmingWatch {
    /// Takes note of a temperature that was received. Whether it is time to look.
    fn note(&mut self, raw: &RawSample) -> bool {
        if raw.temperature.is_none() || self.next.is_some_and(|next| raw.log < next) {
            return false;
        }
        self.next = Some(Nanos(raw.log.0.saturating_add(LOOK)));
        self.is_due = true;
        true
    }

    /// Looks, where it is time.
    fn look(&mut self, estimator: &Estimator, removed: BodyRate) {
        if !std::mem::take(&mut self.is_due) {
            return;
        }
        let Some(temperature) = estimator.temperature() else {
            return;
        };
        let learned = estimator.filter().filter(|filter| filter.is_started());
        let (bias, sigma) = match learned {
            Some(filter) => (filter.calibration().bias, filter.calibration_sigma().bias),
            None => (Vector3::zeros(), Vector3::repeat(f64::INFINITY)),
        };
        self.pairs
            .push(f64::from(temperature), removed.0 + bias, sigma);
    }
}

/// Figures of the attitudes of an estimator.
#[derive(Clone, Debug, Default)]
pub(super) struct AttitudeStats {
    /// First attitude.
    pub first: Option<AttitudeSample>,
    /// Last attitude.
    pub last: Option<AttitudeSample>,
    /// Number.
    pub count: u64,
    /// Largest component of any rate, rad/s.
    pub largest_rate: f64,
    /// Steps between attitudes, nanoseconds.
    steps: Histogram,
    /// Sum of the vertical parts of the body's z, up positive; and that at the first rest.
    up: f64,
    up_at_rest: Option<f64>,
}

/// Vertical part of the body's z below which it points down at rest, and in the mean of a run.
const DOWN: f64 = -0.87;
const MOSTLY_DOWN: f64 = -0.5;

impl AttitudeStats {
    pub(super) fn add(&mut self, samples: &[AttitudeSample]) {
        if self.first.is_none() {
            self.first = samples.first().copied();
        }
        let mut last = self.last.map(|last| last.stamp);
        for sample in samples {
            // A clock that was set back, or far ahead, makes no step.
            let step = last
                .replace(sample.stamp)
                .map(|last| sample.stamp.since(last));
            if let Some(step) = step.filter(|step| *step > 0) {
                self.steps.add(step);
            }
            let [_, x, y, _] = sample.q_nb.wxyz();
            let up = 1.0 - 2.0 * (x * x + y * y);
            self.up += up;
            if self.up_at_rest.is_none() && sample.status.has(Status::REST) {
                self.up_at_rest = Some(up);
            }
        }
        self.last = samples.last().copied().or(self.last);
        self.count += samples.len() as u64;
        self.largest_rate = samples
            .iter()
            .map(|s| s.rate.0.amax())
            .fold(self.largest_rate, f64::max);
    }
}

impl AttitudeStats {
    /// Whether the body's z, which is up in a body of forward, left, up, points down at the first rest and for most of the
    /// time: who lies on his face for a while turns round.
    pub(super) fn is_upside_down(&self) -> bool {
        let mean = self.up / self.count.max(1) as f64;
        self.up_at_rest.is_some_and(|up| up < DOWN) && mean < MOSTLY_DOWN
    }

    /// The median rate, Hz; `None` below two attitudes.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        let step = self.steps.quantile(0.5);
        (step > 0.0).then(|| 1e9 / step)
    }
}

impl Topic {
    /// A topic ready to run.
    ///
    /// # Errors
    /// [`strapd_recording::Error::Topic`] when the settings do not fit it.
    pub(super) fn new(
        path: &Path,
        plan: &EstimationSettings,
        found: TopicInfo,
        prepared: Prepared,
        against: bool,
    ) -> Result<Topic> {
        let refuse = |what: Diagnostic| strapd_recording::Error::Topic {
            path: path.to_owned(),
            topic: found.name.clone(),
            what,
        };
        // What nothing stated, the preparation has found out.
        let resolved = found.resolved.with_kind(&prepared.sample_kind);
        let mut estimator = Estimator::new(plan, &resolved, &prepared).map_err(refuse)?;
        estimator.watch_sensors(&resolved, &prepared);
        let against = against
            .then(|| AgainstRecorded::new(plan, &resolved, &prepared))
            .transpose()
            .map_err(refuse)?;
        let field = (plan.aid == Aid::GravityAndField).then(|| FieldWatch::new(resolved.kind));
        let mut warnings = found.warnings;
        let known = plan.calibration.as_deref();
        let mismatch = known.and_then(|known| known.mismatch(&found.name));
        warnings.extend(mismatch.map(Diagnostic::from));
        Ok(Topic {
            name: found.name,
            output_topic: found.output_topic,
            described: found.described,
            resolved,
            prepared,
            noticed: found.noticed,
            warnings,
            estimator,
            output: AttitudeStats::default(),
            zeros: LoneZeros::default(),
            last_stamp: None,
            field,
            first_undecodable: None,
            instants: None,
            against,
            history: None,
            recorded: None,
            warming: WarmingWatch::default(),
            broken: BrokenAxes::new(1.0),
        })
    }

    /// Takes a sample: into the estimator, and before the watches over its sensor. Whether it is time to look at what
    /// is known by it.
    pub(super) fn take(&mut self, raw: &RawSample) -> bool {
        self.watch(raw);
        let is_due = self.warming.note(raw);
        self.estimator.take(raw);
        if raw.is_beside {
            return is_due;
        }
        let is_rate = matches!(self.resolved.kind, SampleKind::Rate | SampleKind::Average);
        if let Some(rates) = raw.gyro.map(|gyro| self.resolved.rates(gyro)) {
            self.zeros.push(&rates);
            if is_rate {
                self.broken.push(&rates);
            }
        }
        is_due
    }

    /// Notes the stamp of a sample, and looks at its field.
    fn watch(&mut self, raw: &RawSample) {
        let Some(stamp) = self.prepared.clock.read(raw) else {
            return;
        };
        if !raw.is_beside {
            self.last_stamp = Some(stamp);
        }
        let Some(field) = &mut self.field else { return };
        let raw = self.resolved.in_flu(raw);
        if let Some(mag) = raw.mag {
            field.take_field(mag, stamp);
        }
        if let Some(gyro) = raw.gyro.filter(|_| !raw.is_beside) {
            field.take_rate(gyro, stamp);
        }
    }

    /// Puts what does not fit in memory of a recording that is smoothed into a file without a name in the folder of the
    /// output, or in that of temporary files.
    pub(super) fn spool_beside(&mut self, targets: &[Target]) {
        let folder = targets.iter().find_map(|target| match target {
            Target::File { path, .. } => path.parent(),
            _ => None,
        });
        let here = folder.map(|folder| match folder.as_os_str().is_empty() {
            true => Path::new("."),
            false => folder,
        });
        let beside = here.and_then(|here| tempfile::tempfile_in(here).ok());
        match beside.map_or_else(tempfile::tempfile, Ok) {
            Ok(file) => self.estimator.spool_to(Box::new(file)),
            Err(why) => tracing::warn!(
                "{}: all samples are held in memory: no temporary file in {}: {why}",
                self.name,
                std::env::temp_dir().display()
            ),
        }
    }
}

/// Facts about a topic before its first sample.
#[derive(Clone, Debug)]
pub(super) struct TopicInfo {
    /// Name.
    pub name: String,
    /// Topic of its attitude.
    pub output_topic: String,
    /// Type and encoding.
    pub described: PayloadType,
    /// Meaning of its samples.
    pub resolved: Meaning,
    /// Observations in its payloads.
    pub noticed: Arc<PayloadNotes>,
    /// Things to know.
    pub warnings: Vec<Diagnostic>,
}

/// A run from the first integrated sample on.
#[derive(Debug)]
pub(super) struct Session {
    /// The topics.
    pub topics: Vec<Topic>,
    outlet: Outlet,
    samples: u64,
    /// Whether a reader of an output has gone.
    pub closed: bool,
}

impl Session {
    /// A session over `topics` into `outlet`.
    #[must_use]
    pub(super) fn new(topics: Vec<Topic>, outlet: Outlet) -> Session {
        Session {
            topics,
            outlet,
            samples: 0,
            closed: false,
        }
    }

    /// Takes items in order and writes what is known then.
    ///
    /// # Errors
    /// As [`Outlet::write`].
    pub(super) fn consume(
        &mut self,
        items: impl Iterator<Item = Item>,
        pool: &Pool,
    ) -> Result<Flow> {
        // Handed on in time topics must take turns: a batch of one would go by before the other's. And of what has
        // not been shown yet nothing is told.
        let several = self.topics.len() > 1 || self.outlet.has_audience();
        let take_turns = several && self.outlet.is_paced();
        for item in items {
            let is_due = self.take(item, pool)?;
            if (take_turns || is_due) && self.advance(pool)? == Flow::Closed {
                return Ok(Flow::Closed);
            }
        }
        self.advance(pool)
    }

    /// Takes an item. Whether it is time to look at what is known by it.
    fn take(&mut self, item: Item, pool: &Pool) -> Result<bool> {
        let mut is_due = false;
        match item {
            Item::Sample(stream, raw) => {
                let Some(topic) = self.topics.get_mut(stream) else {
                    return Ok(false);
                };
                is_due = topic.take(&raw);
                if raw.is_beside {
                    return Ok(is_due);
                }
                self.samples += 1;
                if let Some(history) = &mut topic.history {
                    history.took(Some(&raw), &topic.estimator.conditioning().counts);
                }
                if let Some(against) = &mut topic.against {
                    against.take(&raw);
                }
                if let Some(recorded) = &mut topic.recorded {
                    recorded.take(&raw);
                }
            }
            Item::Undecodable(stream, why) => {
                self.samples += 1;
                let Some(topic) = self.topics.get_mut(stream) else {
                    return Ok(false);
                };
                topic.estimator.take_undecodable();
                if let Some(history) = &mut topic.history {
                    history.took(None, &topic.estimator.conditioning().counts);
                }
                topic.first_undecodable.get_or_insert(*why);
            }
            Item::Reference(raw, _) => {
                let recorded = self.topics.iter_mut().filter_map(|t| t.recorded.as_mut());
                recorded.for_each(|recorded| recorded.take_reference(&raw));
                let against = self.topics.iter_mut().filter_map(|t| t.against.as_mut());
                for against in against.filter(|a| a.is_held_against_another()) {
                    against.take_reference(&raw);
                }
            }
            Item::Beside(raw) => {
                for topic in &mut self.topics {
                    topic.watch(&raw);
                    is_due |= topic.warming.note(&raw);
                    topic.estimator.take_beside(&raw);
                }
            }
            Item::Copy(message) => self.outlet.copy(&message, pool)?,
        }
        Ok(is_due)
    }

    /// Writes what is known by now.
    fn advance(&mut self, pool: &Pool) -> Result<Flow> {
        for (stream, topic) in self.topics.iter_mut().enumerate() {
            let attitudes = topic.estimator.attitudes(pool);
            topic.output.add(attitudes);
            let is_more_known = !attitudes.is_empty();
            if let Some(history) = &mut topic.history {
                history.add(attitudes);
            }
            if let Some(against) = &mut topic.against {
                against.take_estimates(attitudes);
            }
            if self.outlet.write(stream, attitudes, pool)? == Flow::Closed {
                self.closed = true;
                return Ok(Flow::Closed);
            }
            if let Some(recorded) = &mut topic.recorded {
                recorded.show(stream, attitudes, &self.outlet);
            }
            topic.warming.look(&topic.estimator, topic.prepared.bias);
            if is_more_known {
                self.outlet.known(stream, &topic.estimator);
            }
            if let Some(against) = &mut topic.against {
                against.advance(pool);
            }
            if let Some(history) = &mut topic.history {
                history.corrected(&topic.estimator.innovations());
            }
        }
        Ok(Flow::Continue)
    }

    /// Pushes what is known out to whoever reads it as it comes.
    ///
    /// # Errors
    /// As [`Outlet::write`].
    pub(super) fn flush_to_readers(&mut self, pool: &Pool) -> Result<()> {
        self.outlet.flush_to_readers(pool)
    }

    /// Tells the approximate length of the input.
    pub(super) fn length(&self, secs: f64) {
        self.outlet.length(secs);
    }

    /// Position of the run.
    #[must_use]
    pub(super) fn position(&self, fraction: Option<f64>) -> Position {
        let mut position = Position {
            fraction,
            samples: self.samples,
            ..Position::default()
        };
        for topic in &self.topics {
            let report = topic.estimator.conditioning();
            position.lost += report.counts.lost();
            position.gaps += report.gaps.count;
            position.written += topic.output.count;
            if let (Some(first), Some(last)) = (topic.output.first, topic.output.last) {
                position.data_secs = position.data_secs.max(last.stamp.secs_since(first.stamp));
            }
        }
        position
    }

    /// Ends the run: writes the rest and completes the outputs.
    ///
    /// # Errors
    /// As [`Outlet::write`] and [`Outlet::finish`]; something was asked for that could not be done.
    pub(super) fn finish(mut self, run: &ReplayRequest, pool: &Pool) -> Result<FinishedRun> {
        self.finish_topics(pool)?;
        // Whoever had enough has seen no end.
        if !self.closed {
            self.refuse(run)?;
        }
        self.complete()
    }

    /// The same of topics that have nothing to do with each other.
    ///
    /// # Errors
    /// As [`Outlet::write`] and [`Outlet::finish`].
    pub(super) fn finish_each(mut self, pool: &Pool) -> Result<FinishedRun> {
        self.finish_topics(pool)?;
        self.complete()
    }

    fn refuse(&self, run: &ReplayRequest) -> Result<()> {
        // One that ended before the others has no sample in a late window.
        let is_window_empty = self.topics.iter().all(is_outside);
        let mut asked = self
            .topics
            .iter()
            .filter(|topic| is_window_empty || !is_outside(topic));
        let found = asked.find_map(|topic| Some((topic, unmet(&run.plan, topic)?)));
        found.map_or(Ok(()), |(topic, what)| {
            Err(refused(&run.source.name(), &topic.name, what))
        })
    }

    fn complete(self) -> Result<FinishedRun> {
        Ok(FinishedRun {
            topics: self.topics,
            outputs: self.outlet.finish()?,
        })
    }

    fn finish_topics(&mut self, pool: &Pool) -> Result<()> {
        for (stream, topic) in self.topics.iter_mut().enumerate() {
            let Topic {
                estimator,
                output,
                history,
                against,
                recorded,
                ..
            } = topic;
            let mut flow = Flow::Continue;
            estimator.finish_into(pool, |attitudes| {
                output.add(attitudes);
                if let Some(history) = history {
                    history.add(attitudes);
                }
                if let Some(against) = against {
                    against.take_estimates(attitudes);
                }
                if flow == Flow::Continue {
                    flow = self.outlet.write(stream, attitudes, pool)?;
                }
                if let Some(recorded) = recorded {
                    recorded.show(stream, attitudes, &self.outlet);
                }
                Ok::<(), Error>(())
            })?;
            topic.instants = self.outlet.end(stream, pool)?;
            let noticed = topic.instants.and_then(|of| of.warning());
            topic.warnings.extend(noticed);
            self.outlet.known(stream, estimator);
            if let Some(against) = against {
                against.finish(pool);
            }
            if let Some(history) = history {
                history.corrected(&estimator.innovations());
            }
            if let Some(field) = &mut topic.field {
                field.finish();
            }
        }
        Ok(())
    }
}

/// A run that is over.
#[derive(Debug)]
pub(super) struct FinishedRun {
    /// Topics.
    pub topics: Vec<Topic>,
    /// Outputs by name.
    pub outputs: Vec<(String, Written)>,
}
