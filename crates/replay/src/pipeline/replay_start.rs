//! Items of a stream that can be read only once -> a session, as soon as enough has been seen. I/O
//! only through the session.

use super::position::Position;
use super::request::{ReplayRequest, refused};
use super::session::{Session, TopicInfo};
use super::session_builder::begin;
use crate::error::Result;
use crate::sink::{Flow, Stream};
use std::path::Path;
use strapd_attitude::estimate::{Patience, Preparation, StampPass};
use strapd_recording::pool::Pool;
use strapd_recording::recording::channel_route::Item;
use strapd_recording::recording::topics;

/// Preparation that decides how the samples of `found` begin, before it has seen any.
pub(super) fn preparation(
    run: &ReplayRequest,
    found: &TopicInfo,
    patience: Patience,
) -> Preparation {
    let stamps = StampPass::new(&run.plan, &found.resolved, run.other_kinds());
    Preparation::new(&run.plan, &found.resolved, patience).with_stamps(stamps)
}

/// Beginning of a run over what comes once: the first samples wait until enough has been seen.
pub(super) struct StreamStart<'r> {
    run: &'r ReplayRequest,
    path: &'r Path,
    gathering: Option<(TopicInfo, Stream, Preparation)>,
    /// Items that wait for these decisions.
    held: Vec<Item>,
    session: Option<Session>,
}

impl<'r> StreamStart<'r> {
    pub(super) fn new(run: &'r ReplayRequest, path: &'r Path) -> StreamStart<'r> {
        StreamStart {
            run,
            path,
            gathering: None,
            held: Vec::new(),
            session: None,
        }
    }

    /// Takes note of the topic once it is known.
    pub(super) fn meet(&mut self, found: TopicInfo, stream: Stream) {
        let preparation = preparation(self.run, &found, Patience::FirstMinute);
        self.gathering = Some((found, stream, preparation));
    }

    /// Whether no topic was met.
    pub(super) fn is_idle(&self) -> bool {
        self.gathering.is_none() && self.session.is_none()
    }

    pub(super) fn consume(
        &mut self,
        items: impl Iterator<Item = Item>,
        pool: &Pool,
    ) -> Result<Flow> {
        if let Some(session) = &mut self.session {
            return session.consume(items, pool);
        }
        for item in items {
            match (&item, &mut self.gathering) {
                (Item::Sample(_, raw), Some((found, _, preparation))) => preparation
                    .take(raw)
                    .map_err(|what| refused(self.path, &found.name, what))?,
                (Item::Beside(raw), Some((_, _, preparation))) => preparation.take_beside(raw),
                _ => {}
            }
            self.held.push(item);
        }
        match &self.gathering {
            Some((_, _, preparation)) if !preparation.wants_more() => self.begin(pool),
            _ => Ok(Flow::Continue),
        }
    }

    fn begin(&mut self, pool: &Pool) -> Result<Flow> {
        let Some((found, mut stream, preparation)) = self.gathering.take() else {
            return Ok(Flow::Continue);
        };
        let prepared = preparation
            .decide()
            .map_err(|what| refused(self.path, &found.name, what))?;
        // Read on this thread alone, so that the first message is the first.
        if let Some(frame) = found.noticed.frame_id.get() {
            stream.frame_id.clone_from(frame);
        }
        let decided = std::iter::once(((found, stream), prepared));
        let session = begin(self.run, self.path, decided)?;
        let held = std::mem::take(&mut self.held);
        self.session.insert(session).consume(held.into_iter(), pool)
    }

    /// Pushes what is known out to whoever reads it as it comes.
    pub(super) fn flush_to_readers(&mut self, pool: &Pool) -> Result<()> {
        match &mut self.session {
            Some(session) => session.flush_to_readers(pool),
            None => Ok(()),
        }
    }

    pub(super) fn position(&self) -> Position {
        self.session
            .as_ref()
            .map_or_else(Position::default, |s| s.position(None))
    }

    /// The input has ended.
    pub(super) fn into_session(mut self, pool: &Pool) -> Result<Session> {
        if self.session.is_none() {
            let _ = self.begin(pool)?;
        }
        self.session.ok_or_else(|| {
            strapd_recording::Error::NoImuTopic {
                path: self.path.to_owned(),
                topics: topics::listing(&[]),
                undefined: None,
            }
            .into()
        })
    }
}
