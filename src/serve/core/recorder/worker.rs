//! Entries -> chunks, files, syncs, on the recorder's own thread. I/O, reads the clock.

use super::file::RecordingFile;
use super::naming::Names;
use super::sync::Syncer;
use super::{Entry, Settings, Shared, Split, space, stream_of};
use crate::error::{Error, Result};
use crate::report::summary::human_bytes;
use crate::sink::{LiveMcap, LiveStream, Stream};
use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::{AttitudeSample, RawSample};

/// A chunk is closed early at this size, so that a flood costs memory in the queue alone.
const CHUNK_BYTES: usize = 1 << 20;

/// Time in which what a full queue dropped is logged at most once.
const SAY_EVERY: Duration = Duration::from_secs(10);

/// The recorder's thread.
#[derive(Debug)]
pub(super) struct Worker {
    settings: Settings,
    shared: Arc<Shared>,
    names: Names,
    syncer: Syncer,
    /// `None` once it has stopped.
    file: Option<RecordingFile>,
    streams: BTreeMap<Arc<str>, Recorded>,
    /// Bytes of the files before the present one.
    earlier: u64,
    opened: Instant,
    synced: Instant,
    said: Option<(Instant, u64)>,
    /// Counts in the chunk being filled, and in the last one written.
    pending: RecordedCounts,
    last: RecordedCounts,
}

/// Input samples and attitudes.
#[derive(Clone, Copy, Debug, Default)]
struct RecordedCounts {
    samples: u64,
    attitudes: u64,
}

/// A stream, its place in the present file, and how many of its input samples there were.
#[derive(Debug)]
struct Recorded {
    stream: Stream,
    place: Option<LiveStream>,
    samples: u64,
}

impl Worker {
    /// Opens the first file.
    pub(super) fn open(settings: Settings, shared: Arc<Shared>) -> Result<Worker> {
        let failed = |source| Error::Write {
            path: settings.path.clone(),
            source,
        };
        check_free(&settings)?;
        let mut worker = Worker {
            names: Names::new(&settings.path, settings.split),
            syncer: Syncer::start(shared.clone()).map_err(failed)?,
            settings,
            shared,
            file: None,
            streams: BTreeMap::new(),
            earlier: 0,
            opened: Instant::now(),
            synced: Instant::now(),
            said: None,
            pending: RecordedCounts::default(),
            last: RecordedCounts::default(),
        };
        worker.begin(worker.settings.force)?;
        Ok(worker)
    }

    fn begin(&mut self, force: bool) -> Result<()> {
        let (path, file) = loop {
            let path = self.names.next();
            let live = LiveMcap::new(self.settings.compression, &self.settings.provenance)?;
            match RecordingFile::create(&path, live, force) {
                // Another process took the number meanwhile.
                Err(Error::OutputExists { .. }) if self.names.is_numbered(&path) => {}
                created => break (path, created?),
            }
        };
        self.opened = Instant::now();
        self.synced = self.opened;
        for recorded in self.streams.values_mut() {
            recorded.place = None;
        }
        let mut status = self.shared.status();
        status.files.push(path);
        status.syncs = 0;
        status.synced = file.bytes;
        status.bytes = self.earlier + file.bytes;
        drop(status);
        self.file = Some(file);
        Ok(())
    }

    /// Runs until it is told to finish, or nobody is left to tell it.
    pub(super) fn run(mut self, entries: &Receiver<Entry>) {
        let mut next = Instant::now() + self.settings.flush_every;
        loop {
            match entries.recv_timeout(next.saturating_duration_since(Instant::now())) {
                Ok(Entry::Finish) | Err(RecvTimeoutError::Disconnected) => break,
                Ok(entry) => self.take(entry),
                Err(RecvTimeoutError::Timeout) => {}
            }
            let now = Instant::now();
            if now >= next {
                self.tick(now);
                next = (next + self.settings.flush_every).max(now);
            }
        }
        self.stop_if_failed(Worker::flush);
        self.close();
        self.say_unrecorded(true);
    }

    fn take(&mut self, entry: Entry) {
        match entry {
            Entry::Declare(stream) => {
                let id: Arc<str> = stream.id.as_str().into();
                self.streams.entry(id).or_insert(Recorded {
                    stream: *stream,
                    place: None,
                    samples: 0,
                });
            }
            Entry::Samples(id, samples) => match self.place(&id) {
                Some(place) => self.input(&id, place, &samples),
                None => self.shared.miss(samples.len() as u64),
            },
            Entry::Attitudes(id, first, attitudes) => match self.place(&id) {
                Some(place) => self.attitudes(place, first, &attitudes),
                None => self.shared.miss(attitudes.len() as u64),
            },
            Entry::Reopen => self.stop_if_failed(Worker::go_on_in_a_new_file),
            Entry::Finish => {}
        }
        let pending = self.file.as_ref().map_or(0, |file| file.live.pending());
        if pending >= CHUNK_BYTES {
            self.stop_if_failed(Worker::flush);
        }
    }

    /// Place of the stream in the present file; declared there at its first entry.
    fn place(&mut self, id: &Arc<str>) -> Option<LiveStream> {
        let file = self.file.as_mut()?;
        let recorded = self.streams.entry(id.clone()).or_insert_with(|| Recorded {
            stream: stream_of(id),
            place: None,
            samples: 0,
        });
        if recorded.place.is_none() {
            // Declarations stand before the chunk that needs them.
            match file.live.stream(&recorded.stream) {
                Ok(place) => recorded.place = Some(place),
                Err(e) => tracing::warn!("recording: {id}: {e}"),
            }
        }
        recorded.place
    }

    fn input(&mut self, id: &Arc<str>, place: LiveStream, samples: &[RawSample]) {
        let (Some(file), Some(recorded)) = (&mut self.file, self.streams.get_mut(id)) else {
            return;
        };
        let (mut misfits, mut intervals) = (0, 0);
        for sample in samples {
            misfits += u64::from(!file.live.input(place, recorded.samples, sample));
            intervals += u64::from(sample.interval_nanos.is_some());
            recorded.samples += 1;
        }
        self.pending.samples += samples.len() as u64;
        let mut status = self.shared.status();
        status.stamps_out_of_range += misfits;
        status.intervals_left_out += intervals;
    }

    fn attitudes(&mut self, place: LiveStream, first: u64, attitudes: &[AttitudeSample]) {
        let Some(file) = &mut self.file else {
            return;
        };
        let mut misfits = 0;
        for (n, attitude) in (first..).zip(attitudes) {
            misfits += u64::from(!file.live.attitude(place, n, attitude));
        }
        self.pending.attitudes += attitudes.len() as u64;
        self.shared.status().stamps_out_of_range += misfits;
    }

    fn tick(&mut self, now: Instant) {
        self.stop_if_failed(|worker| {
            if worker.file.is_some() {
                check_free(&worker.settings)?;
            }
            worker.flush()
        });
        if let Some(file) = &self.file
            && self.settings.is_sync_due(now.duration_since(self.synced))
            && self.syncer.request(&file.file, file.bytes)
        {
            self.synced = now;
        }
        let split = match (self.settings.split, &self.file) {
            (Some(Split::Bytes(limit)), Some(file)) => file.bytes >= limit,
            (Some(Split::Every(limit)), Some(_)) => now.duration_since(self.opened) >= limit,
            _ => false,
        };
        if split {
            self.stop_if_failed(Worker::go_on_in_a_new_file);
        }
        // A sync that failed is reported by its thread.
        let unsynced = self.shared.status().stopped.clone();
        if let (Some(_), Some(why)) = (&self.file, unsynced) {
            tracing::error!("recording stopped: {why}; streaming goes on");
            self.close();
        }
        self.say_unrecorded(false);
    }

    fn flush(&mut self) -> Result<()> {
        let Some(file) = &mut self.file else {
            return Ok(());
        };
        let taken = std::mem::take(&mut self.pending);
        if let Err(error) = file.flush() {
            self.shared.miss(taken.samples + taken.attitudes);
            return Err(error);
        }
        if taken.samples + taken.attitudes > 0 {
            self.last = taken;
        }
        let mut status = self.shared.status();
        status.bytes = self.earlier + file.bytes;
        status.samples += taken.samples;
        status.attitudes += taken.attitudes;
        Ok(())
    }

    fn go_on_in_a_new_file(&mut self) -> Result<()> {
        self.flush()?;
        if let Some(mut file) = self.file.take() {
            file.close()?;
            self.earlier += file.bytes;
        }
        self.begin(false)
    }

    /// Does it; a failure ends the recording, once, and nothing else.
    fn stop_if_failed(&mut self, step: impl FnOnce(&mut Worker) -> Result<()>) {
        if let Err(error) = step(self) {
            tracing::error!("recording stopped: {error}; streaming goes on");
            self.shared
                .status()
                .stopped
                .get_or_insert(error.to_string());
            self.close();
        }
    }

    fn close(&mut self) {
        // Stopped for another reason than a failed write, it still has a chunk to write; one that
        // fails here is counted, and the file ends before it.
        let _ = self.flush();
        let Some(mut file) = self.file.take() else {
            return;
        };
        let outcome = file.close();
        let mut status = self.shared.status();
        if file.last_left_out {
            status.samples -= self.last.samples;
            status.attitudes -= self.last.attitudes;
            self.shared.miss(self.last.samples + self.last.attitudes);
        }
        status.bytes = self.earlier + file.bytes;
        match outcome {
            Ok(()) => {
                let number = status.files.len();
                status.count_sync(number, file.bytes);
            }
            Err(error) => {
                tracing::error!("recording: {error}\n  help: strapd recover reads what is there");
                status.stopped.get_or_insert(error.to_string());
            }
        }
    }

    fn say_unrecorded(&mut self, last: bool) {
        let now = self.shared.snapshot().unrecorded;
        let (when, before) = self.said.map_or((None, 0), |(when, n)| (Some(when), n));
        if now > before && (last || when.is_none_or(|t| t.elapsed() >= SAY_EVERY)) {
            tracing::warn!(
                "recording: {} samples and attitudes were not recorded, {now} in all",
                now - before
            );
            self.said = Some((Instant::now(), now));
        }
    }
}

/// # Errors
/// [`Error::Write`] when there is less room than asked for.
fn check_free(settings: &Settings) -> Result<()> {
    let path: &Path = &settings.path;
    match space::free(path) {
        Some(free) if free < settings.min_free => Err(Error::Write {
            path: path.to_owned(),
            source: io::Error::new(
                io::ErrorKind::StorageFull,
                Diagnostic::new(format!(
                    "{} free, less than the {} to be left",
                    human_bytes(free),
                    human_bytes(settings.min_free)
                ))
                .help("--min-free sets the limit"),
            ),
        }),
        _ => Ok(()),
    }
}
