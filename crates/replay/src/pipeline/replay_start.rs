//! Items of a stream that can be read only once -> a session, as soon as enough has been seen. I/O
//! only through the session.

use super::position::Position;
use super::request::{ReplayRequest, refused};
use super::session::{Found, Session};
use super::session_builder::{begin, labelled};
use crate::error::Result;
use crate::sink::{Flow, Stream};
use std::path::Path;
use strapd_attitude::estimate::{Patience, Preparation, Prepared, StampPass};
use strapd_recording::pool::Pool;
use strapd_recording::recording::channel_route::Item;
use strapd_recording::recording::topics;

/// Preparation that decides how the samples of `found` begin, before it has seen any.
pub(super) fn preparation(run: &ReplayRequest, found: &Found, patience: Patience) -> Preparation {
    let stamps = StampPass::new(&run.plan, &found.resolved, run.other_kinds());
    Preparation::new(&run.plan, &found.resolved, patience).with_stamps(stamps)
}

/// A run over a stream: first gathers, then runs; over a file that was read before, runs at once.
pub(super) struct Waiting<'r> {
    run: &'r ReplayRequest,
    path: &'r Path,
    /// Decisions of a pass over the file, where it is one.
    prepared: Option<Prepared>,
    gathering: Option<(Found, Stream, Preparation)>,
    held: Vec<Item>,
    session: Option<Session>,
}

impl<'r> Waiting<'r> {
    pub(super) fn new(
        run: &'r ReplayRequest,
        path: &'r Path,
        prepared: Option<Prepared>,
    ) -> Waiting<'r> {
        Waiting {
            run,
            path,
            prepared,
            gathering: None,
            held: Vec::new(),
            session: None,
        }
    }

    /// The stream's topic is known.
    pub(super) fn meet(&mut self, found: &mut Option<(Found, Stream)>) -> Result<()> {
        if let Some((found, stream)) = found.take() {
            if let Some(prepared) = self.prepared.take() {
                self.session = Some(self.session(found, stream, prepared)?);
                return Ok(());
            }
            let preparation = preparation(self.run, &found, Patience::FirstMinute);
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
            let held = std::mem::take(&mut self.held);
            return session.consume(held.into_iter().chain(items), pool);
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
        let session = self.session(found, stream, prepared)?;
        let held = std::mem::take(&mut self.held);
        self.session.insert(session).consume(held.into_iter(), pool)
    }

    fn session(&self, found: Found, stream: Stream, prepared: Prepared) -> Result<Session> {
        let stream = labelled(stream, &self.run.plan, &found.resolved, &prepared);
        begin(self.run, self.path, vec![found], vec![prepared], &[stream])
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
