//! Items of a stream that can be read only once -> a session, as soon as enough has been seen. I/O
//! only through the session.

use super::position::Position;
use super::request::{ReplayRequest, refused};
use super::session::{Found, Session};
use super::session_builder::{begin, labelled};
use crate::error::Result;
use crate::sink::{Flow, Stream};
use std::path::Path;
use strapd_attitude::estimate::{Patience, Preparation};
use strapd_attitude::estimate::{StampPass, Stamps};
use strapd_recording::pool::Pool;
use strapd_recording::recording::channel_route::Item;
use strapd_recording::recording::topics;

/// A run over a stream: first gathers, then runs.
pub(super) struct Waiting<'r> {
    run: &'r ReplayRequest,
    path: &'r Path,
    /// What a pass over the file found, where it is one.
    stamps: Option<Stamps>,
    gathering: Option<(Found, Stream, Preparation)>,
    held: Vec<Item>,
    session: Option<Session>,
}

impl<'r> Waiting<'r> {
    pub(super) fn new(
        run: &'r ReplayRequest,
        path: &'r Path,
        stamps: Option<Stamps>,
    ) -> Waiting<'r> {
        Waiting {
            run,
            path,
            stamps,
            gathering: None,
            held: Vec::new(),
            session: None,
        }
    }

    /// The stream's topic is known.
    pub(super) fn meet(&mut self, found: &mut Option<(Found, Stream)>) -> Result<()> {
        if let Some((found, stream)) = found.take() {
            let preparation =
                Preparation::new(&self.run.plan, &found.resolved, Patience::FirstMinute);
            let preparation = match self.stamps.take() {
                None => preparation.with_stamps(StampPass::new(
                    &self.run.plan,
                    &found.resolved,
                    self.run.other_kinds(),
                )),
                known => preparation.with_known_stamps(known),
            };
            self.gathering = Some((found, stream, preparation));
        }
        Ok(())
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
        let Some((found, _, preparation)) = &mut self.gathering else {
            self.held.extend(items);
            return Ok(Flow::Continue);
        };
        for item in items {
            if let Item::Sample(_, raw) = &item {
                preparation
                    .take(raw)
                    .map_err(|what| refused(self.path, &found.name, what))?;
            }
            self.held.push(item);
        }
        if preparation.wants_more() {
            return Ok(Flow::Continue);
        }
        self.begin(pool)
    }

    fn begin(&mut self, pool: &Pool) -> Result<Flow> {
        let Some((found, mut stream, preparation)) = self.gathering.take() else {
            return Ok(Flow::Continue);
        };
        // Read on this thread alone, so that the first message is the first.
        if let Some(frame) = found.noticed.frame_id.get() {
            stream.frame_id.clone_from(frame);
        }
        let prepared = preparation
            .decide()
            .map_err(|what| refused(self.path, &found.name, what))?;
        let stream = labelled(stream, &self.run.plan, &found.resolved, &prepared);
        let session = begin(self.run, self.path, vec![found], vec![prepared], &[stream])?;
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
            }
            .into()
        })
    }
}
