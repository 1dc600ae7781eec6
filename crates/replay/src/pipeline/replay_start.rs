//! Items of a stream that can be read only once -> a session, as soon as enough has been seen. I/O
//! only through the session.

use super::position::Position;
use super::request::{ReplayRequest, refused};
use super::session::{Session, TopicInfo};
use super::session_builder::begin;
use crate::error::Result;
use crate::sink::{Flow, Stream};
use std::path::Path;
use strapd_attitude::estimate::{Patience, Preparation, Prepared, StampPass};
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

/// Beginning of a run over what comes once, or of a look at what comes again.
pub(super) struct StreamStart<'r> {
    run: &'r ReplayRequest,
    path: &'r Path,
    /// Decisions of a look that went before.
    prepared: Option<Prepared>,
    gathering: Option<(TopicInfo, Stream, Preparation)>,
    /// Items that wait for these decisions; `None` of a look, to which all comes again.
    held: Option<Vec<Item>>,
    session: Option<Session>,
}

impl<'r> StreamStart<'r> {
    /// Makes a run: of a stream the first samples wait until enough has been seen.
    pub(super) fn new(
        run: &'r ReplayRequest,
        path: &'r Path,
        prepared: Option<Prepared>,
    ) -> StreamStart<'r> {
        StreamStart {
            run,
            path,
            prepared,
            gathering: None,
            held: Some(Vec::new()),
            session: None,
        }
    }

    /// Makes a look, which ends when no more would be learned.
    pub(super) fn look(run: &'r ReplayRequest, path: &'r Path) -> StreamStart<'r> {
        StreamStart {
            held: None,
            ..StreamStart::new(run, path, None)
        }
    }

    /// Takes note of the topic once it is known.
    pub(super) fn meet(&mut self, found: TopicInfo, stream: Stream) -> Result<()> {
        if let Some(prepared) = self.prepared.take() {
            self.session = Some(self.session(found, stream, prepared)?);
            return Ok(());
        }
        let patience = match self.held {
            Some(_) => Patience::FirstMinute,
            None => Patience::WholeLog,
        };
        let preparation = preparation(self.run, &found, patience);
        self.gathering = Some((found, stream, preparation));
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
            let held = std::mem::take(&mut self.held).unwrap_or_default();
            return session.consume(held.into_iter().chain(items), pool);
        }
        for item in items {
            match (&item, &mut self.gathering) {
                (Item::Sample(_, raw), Some((found, _, preparation))) => preparation
                    .take(raw)
                    .map_err(|what| refused(self.path, &found.name, what))?,
                (Item::Beside(raw), Some((_, _, preparation))) => preparation.take_beside(raw),
                _ => {}
            }
            if let Some(held) = &mut self.held {
                held.push(item);
            }
        }
        match &self.gathering {
            Some((_, _, preparation)) if !preparation.wants_more() => match self.held {
                Some(_) => self.begin(pool),
                None => Ok(Flow::Closed),
            },
            _ => Ok(Flow::Continue),
        }
    }

    /// Decides from what was gathered.
    fn decide(&mut self) -> Result<Option<(TopicInfo, Stream, Prepared)>> {
        let Some((found, stream, preparation)) = self.gathering.take() else {
            return Ok(None);
        };
        let prepared = preparation
            .decide()
            .map_err(|what| refused(self.path, &found.name, what))?;
        Ok(Some((found, stream, prepared)))
    }

    fn begin(&mut self, pool: &Pool) -> Result<Flow> {
        let Some((found, mut stream, prepared)) = self.decide()? else {
            return Ok(Flow::Continue);
        };
        // Read on this thread alone, so that the first message is the first.
        if let Some(frame) = found.noticed.frame_id.get() {
            stream.frame_id.clone_from(frame);
        }
        let session = self.session(found, stream, prepared)?;
        let held = std::mem::take(&mut self.held).unwrap_or_default();
        self.session.insert(session).consume(held.into_iter(), pool)
    }

    fn session(&self, found: TopicInfo, stream: Stream, prepared: Prepared) -> Result<Session> {
        let decided = std::iter::once(((found, stream), prepared));
        begin(self.run, self.path, decided)
    }

    /// Ends a look: what was decided, `None` where no topic was met.
    pub(super) fn into_prepared(mut self) -> Result<Option<Prepared>> {
        Ok(self.decide()?.map(|(_, _, prepared)| prepared))
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
