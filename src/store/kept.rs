//! An object -> its bytes as they are asked for, each fetched once. I/O.
//!
//! What was fetched is in a file without a name that goes with this process; in memory is only what has just come. So
//! a second pass over a recording costs no second download, and who reads in no order at all is served, too.

use super::answer::{Part, Version};
use super::download;
use super::fault::Fault;
use super::patience::{Pace, Patience};
use super::place::Place;
use super::ranges::{Ranges, pieces};
use futures_util::StreamExt;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::remote_object::Object;
use tokio::runtime::Handle;

/// Requests on their way at once.
const ON_THE_WAY: usize = 8;
/// Number of bytes fetched where nobody announced what would be read.
const LOOK: u64 = 64 << 10;
/// Bytes that are kept at most, as of a pipe.
const MOST: u64 = 8 << 30;

/// An object that is being read.
#[derive(Debug)]
pub(super) struct CachedObject {
    shared: Arc<Shared>,
    runtime: Handle,
}

#[derive(Debug)]
struct Shared {
    place: Arc<Place>,
    version: Version,
    patience: Patience,
    file: File,
    #[cfg(not(unix))]
    turn: Mutex<()>,
    state: Mutex<State>,
    /// Something came, or will not.
    changed: Condvar,
    /// Nobody reads any more.
    is_over: AtomicBool,
}

#[derive(Debug, Default)]
struct State {
    have: Ranges,
    /// Bytes that are here or on their way.
    asked: Ranges,
    on_the_way: usize,
    bytes: u64,
    /// Plan of what to fetch at a time, in the order in which it will be read.
    plan: Vec<Range<u64>>,
    /// Index in the plan before which all are read; and how far ahead of it is fetched.
    at: usize,
    ahead: u64,
    failed: Option<Diagnostic>,
}

impl CachedObject {
    /// An object of which the first part is on its way.
    ///
    /// # Errors
    /// There is no room for a file.
    pub(super) fn new(
        runtime: Handle,
        place: Arc<Place>,
        first: Part,
        patience: Patience,
    ) -> io::Result<CachedObject> {
        let shared = Arc::new(Shared {
            place,
            version: first.version,
            patience,
            file: tempfile::tempfile()?,
            #[cfg(not(unix))]
            turn: Mutex::new(()),
            state: Mutex::default(),
            changed: Condvar::new(),
            is_over: AtomicBool::new(false),
        });
        let range = first.start..shared.version.size.min(super::FIRST);
        let mut state = shared.state();
        state.on_the_way += 1;
        state.asked.add(range.clone());
        drop(state);
        let (by, mut body) = (Arc::clone(&shared), first.body);
        runtime.spawn(async move {
            let (mut at, mut pace) = (range.start, Pace::new());
            while at < range.end
                && let Some(Ok(bytes)) = body.next().await
            {
                let left = usize::try_from(range.end - at).unwrap_or(usize::MAX);
                let bytes = bytes.get(..left).unwrap_or(&bytes);
                if let Err(fault) = by.take(at, bytes) {
                    return by.ended(Err(fault));
                }
                at += bytes.len() as u64;
                if !pace.holds(bytes.len(), &by.patience) {
                    break;
                }
            }
            drop(body);
            // What was cut is fetched as anything else is.
            by.ended(by.download(at..range.end).await);
        });
        Ok(CachedObject { shared, runtime })
    }

    fn start(&self, state: &mut State, range: Range<u64>) {
        state.asked.add(range.clone());
        state.on_the_way += 1;
        let by = Arc::clone(&self.shared);
        self.runtime.spawn(async move {
            let ended = by.download(range).await;
            by.ended(ended);
        });
    }

    /// Fetches what stands at `at`, which is not on its way, and is needed up to `end` at least.
    fn fetch(&self, state: &mut State, at: u64, end: u64) {
        let size = self.shared.version.size;
        let planned = state.plan.iter().position(|piece| piece.contains(&at));
        let range = match planned.and_then(|n| state.plan.get(n)) {
            Some(piece) => state.asked.gap(at, piece.end),
            None => {
                let range = state
                    .asked
                    .gap(at, end.max(at.saturating_add(LOOK)).min(size));
                // At the end of an object stands what is in it.
                let is_end = size - at < LOOK && range.end == size;
                let before = size.saturating_sub(LOOK).max(state.asked.end_before(at));
                match is_end {
                    true => before.min(at)..size,
                    false => range,
                }
            }
        };
        self.start(state, range);
    }

    /// Fetches what will be read next, now that `at` is.
    fn fetch_ahead(&self, state: &mut State, at: u64) {
        let Some(now) = state
            .plan
            .iter()
            .skip(state.at)
            .position(|p| p.contains(&at))
        else {
            return;
        };
        state.at += now;
        let mut ahead = state.ahead;
        for n in state.at.. {
            if state.on_the_way >= ON_THE_WAY || state.failed.is_some() {
                return;
            }
            let Some(piece) = state.plan.get(n).cloned() else {
                return;
            };
            if n > state.at {
                let length = piece.end - piece.start;
                match ahead.checked_sub(length) {
                    Some(left) => ahead = left,
                    None => return,
                }
            }
            let from = piece.start.max(if n == state.at { at } else { 0 });
            if let Some(gap) = state.asked.first_gap(&(from..piece.end)) {
                let range = state.asked.gap(gap, piece.end);
                self.start(state, range);
            }
        }
    }
}

impl Object for CachedObject {
    fn size(&self) -> u64 {
        self.shared.version.size
    }

    fn read_at(&self, into: &mut [u8], offset: u64) -> io::Result<usize> {
        let end = offset.saturating_add(into.len() as u64).min(self.size());
        let wanted = offset..end;
        if wanted.is_empty() {
            return Ok(0);
        }
        let mut state = self.shared.state();
        self.fetch_ahead(&mut state, offset);
        while let Some(gap) = state.have.first_gap(&wanted) {
            if let Some(why) = &state.failed {
                return Err(io::Error::other(why.clone()));
            }
            if state.asked.first_gap(&(gap..gap + 1)).is_some() {
                self.fetch(&mut state, gap, end);
            }
            let waited = self.shared.changed.wait(state);
            state = waited.unwrap_or_else(PoisonError::into_inner);
        }
        drop(state);
        let length = usize::try_from(end - offset).unwrap_or(usize::MAX);
        let room = into.get_mut(..length).unwrap_or_default();
        self.shared.read(room, offset)?;
        Ok(room.len())
    }

    fn expect(&self, ranges: Vec<Range<u64>>, ahead: u64) {
        let plan = pieces(&ranges, self.size());
        let mut state = self.shared.state();
        (state.plan, state.at, state.ahead) = (plan, 0, ahead);
    }
}

impl Drop for CachedObject {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
    }
}

impl Shared {
    /// A panic elsewhere ends the process anyway.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    async fn download(&self, range: Range<u64>) -> Result<(), Fault> {
        let (place, version) = (self.place.as_ref(), &self.version);
        let take = |at, bytes: &[u8]| self.take(at, bytes);
        download::range(place, range, version, &self.patience, take).await
    }

    /// Keeps what came.
    fn take(&self, at: u64, bytes: &[u8]) -> Result<(), Fault> {
        if self.is_over.load(Ordering::Relaxed) {
            return Err(Diagnostic::new("nobody reads any more").into());
        }
        let no_room = |why: io::Error| Fault::from(super::no_room(why));
        self.write(bytes, at).map_err(no_room)?;
        let mut state = self.state();
        state.have.add(at..at + bytes.len() as u64);
        state.bytes += bytes.len() as u64;
        if state.bytes > MOST {
            let why = format!("more than {} GiB", MOST >> 30);
            return Err(no_room(io::Error::other(why)));
        }
        drop(state);
        self.changed.notify_all();
        Ok(())
    }

    fn ended(&self, how: Result<(), Fault>) {
        let mut state = self.state();
        state.on_the_way -= 1;
        if let Err(fault) = how {
            let said = fault.told(|status| self.place.help(status));
            state.failed.get_or_insert(said);
        }
        drop(state);
        self.changed.notify_all();
    }

    #[cfg(unix)]
    fn write(&self, bytes: &[u8], at: u64) -> io::Result<()> {
        std::os::unix::fs::FileExt::write_all_at(&self.file, bytes, at)
    }

    #[cfg(unix)]
    fn read(&self, into: &mut [u8], at: u64) -> io::Result<()> {
        std::os::unix::fs::FileExt::read_exact_at(&self.file, into, at)
    }

    #[cfg(not(unix))]
    fn write(&self, bytes: &[u8], at: u64) -> io::Result<()> {
        use std::io::{Seek, SeekFrom, Write};
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        (&self.file).seek(SeekFrom::Start(at))?;
        (&self.file).write_all(bytes)
    }

    #[cfg(not(unix))]
    fn read(&self, into: &mut [u8], at: u64) -> io::Result<()> {
        use std::io::{Read, Seek, SeekFrom};
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        (&self.file).seek(SeekFrom::Start(at))?;
        (&self.file).read_exact(into)
    }
}
