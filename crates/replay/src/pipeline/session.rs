//! Items in order -> estimators -> outlet: the consuming half of a run, whatever the source. I/O
//! only through the outlet.

mod attitude_stats;
mod topic;
mod warming_watch;

pub(super) use topic::{Topic, TopicInfo};

use super::delivery::Outlet;
use super::position::Position;
use super::request::{ReplayRequest, refused};
use super::unmet::{is_outside, unmet};
use crate::error::{Error, Result};
use crate::sink::{Flow, Written};
use strapd_recording::pool::Pool;
use strapd_recording::recording::channel_route::Item;

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
