//! Samples and attitudes of a running daemon -> MCAP files that survive a crash. I/O.
//!
//! A stage of its own, on a thread of its own, because a single write can take 20 ms and a sync of the disk
//! seconds, and a stream must never wait for either. What a full queue does not take is counted and
//! said, never waited for.
//!
//! ```text
//! Handle (any thread) -> bounded queue -> worker -> chunk every 200 ms -> file -> (sync thread, every second)
//! ```
//!
//! What is promised, and measured, is in `docs/recording.md`. A file is written under its own name from
//! the start: after a crash it is there, whole up to its last chunk, for `strapd recover`.

mod file;
mod naming;
mod space;
mod sync;
mod worker;

use crate::error::{Error, Result};
use crate::sink::{Compression, Provenance, Stream, output_topic};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::{AttitudeSample, RawSample};
use worker::Worker;

/// Condition on which a recording goes on in a new file. The files are numbered: `name_0000.mcap`, `name_0001.mcap`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Split {
    /// Size in bytes.
    Bytes(u64),
    /// Duration.
    Every(Duration),
}

impl std::str::FromStr for Split {
    type Err = Error;

    /// `512MiB`, `2GB`, or `90s`, `10min`, `1h`.
    fn from_str(text: &str) -> Result<Split> {
        const UNITS: [(&str, u64, bool); 10] = [
            ("KiB", 1 << 10, true),
            ("MiB", 1 << 20, true),
            ("GiB", 1 << 30, true),
            ("kB", 1_000, true),
            ("MB", 1_000_000, true),
            ("GB", 1_000_000_000, true),
            ("min", 60, false),
            ("B", 1, true),
            ("s", 1, false),
            ("h", 3600, false),
        ];
        let parsed = UNITS.iter().find_map(|(unit, scale, is_size)| {
            let number: u64 = text.strip_suffix(unit)?.trim_end().parse().ok()?;
            let value = number.checked_mul(*scale).filter(|value| *value > 0)?;
            Some(match is_size {
                true => Split::Bytes(value),
                false => Split::Every(Duration::from_secs(value)),
            })
        });
        parsed.ok_or_else(|| {
            Error::usage(
                Diagnostic::new(format!("`{text}` is neither a size nor a time"))
                    .help("512MiB, 2GB, 90s, 10min, 1h"),
            )
        })
    }
}

/// Settings of a recording.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The file; with a [`Split`], the pattern its numbered files are named after.
    pub path: PathBuf,
    /// Replace an existing file. With a split nothing is ever replaced: numbers go on behind those
    /// that are there.
    pub force: bool,
    /// Chunks.
    pub compression: Compression,
    /// Condition on which to go on in a new file.
    pub split: Option<Split>,
    /// Stop recording when the file system has less than this free, bytes.
    pub min_free: u64,
    /// A chunk is written at least this often: what a crash of the process can cost.
    pub flush_every: Duration,
    /// The file is synced at least this often: what a power cut can cost, with the above.
    pub sync_every: Duration,
    /// Batches that may wait for the disk; more are dropped and counted.
    pub queue: usize,
    /// Facts about the run, for the head of each file.
    pub provenance: Provenance,
}

impl Settings {
    /// Makes them with every default: zstd, 200 ms, 1 s, 256 MiB free, no split, nothing replaced.
    #[must_use]
    pub fn new(path: impl Into<PathBuf>) -> Settings {
        Settings {
            path: path.into(),
            force: false,
            compression: Compression::default(),
            split: None,
            min_free: 256 << 20,
            flush_every: Duration::from_millis(200),
            sync_every: Duration::from_secs(1),
            queue: 8192,
            provenance: Provenance::default(),
        }
    }

    /// Whether a tick, so long after the one that asked for a sync, asks for the next. That is the tick before
    /// [`Settings::sync_every`] is over, also where either of the two is late by up to half of [`Settings::flush_every`].
    fn is_sync_due(&self, since: Duration) -> bool {
        since >= self.sync_every.saturating_sub(self.flush_every * 3 / 2)
    }
}

/// State of a recording.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Status {
    /// Files so far, the one being written last.
    pub files: Vec<PathBuf>,
    /// Bytes written to all of them.
    pub bytes: u64,
    /// Input samples written.
    pub samples: u64,
    /// Attitudes written.
    pub attitudes: u64,
    /// Samples and attitudes that were not recorded: the queue was full, or the recording had stopped.
    pub unrecorded: u64,
    /// Samples with an integration interval of their own, which an Imu message has no field for.
    pub intervals_left_out: u64,
    /// Stamps that do not fit into a ROS time; the nearest one was written.
    pub stamps_out_of_range: u64,
    /// Completed syncs of the present file.
    pub syncs: u64,
    /// Bytes of the present file that the last of them made durable.
    pub synced: u64,
    /// Why it stopped before its end.
    pub stopped: Option<String>,
}

impl Status {
    /// Whether something that should be in the file is not (exit code 3).
    #[must_use]
    pub fn is_lossy(&self) -> bool {
        self.unrecorded > 0 || self.stopped.is_some()
    }

    /// Counts a sync that made `bytes` of the file number `file` (from 1) durable. A sync takes as long as the disk
    /// does: its file may have ended, and been synced whole, before this outcome arrives.
    fn count_sync(&mut self, file: usize, bytes: u64) {
        if file == self.files.len() && bytes >= self.synced {
            self.syncs += 1;
            self.synced = bytes;
        }
    }
}

/// Message to the worker.
enum Entry {
    Declare(Box<Stream>),
    Samples(Arc<str>, Vec<RawSample>),
    Attitudes(Arc<str>, u64, Vec<AttitudeSample>),
    /// Go on in a new file.
    Reopen,
    Finish,
}

/// State that worker, sync thread and handles share.
#[derive(Debug, Default)]
struct Shared {
    status: Mutex<Status>,
    unrecorded: AtomicU64,
}

impl Shared {
    fn status(&self) -> MutexGuard<'_, Status> {
        self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn miss(&self, count: u64) {
        self.unrecorded.fetch_add(count, Ordering::Relaxed);
    }

    fn snapshot(&self) -> Status {
        let mut status = self.status().clone();
        status.unrecorded = self.unrecorded.load(Ordering::Relaxed);
        status
    }
}

/// The recording, for those who feed it. Cheap to clone, never blocks.
#[derive(Clone, Debug)]
pub struct Handle {
    sender: SyncSender<Entry>,
    shared: Arc<Shared>,
}

impl std::fmt::Debug for Entry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Entry")
    }
}

impl Handle {
    /// Names topics and frames of the stream with this `id`, before its first sample. A stream that
    /// is not declared gets those of [`stream_of`].
    pub fn declare(&self, stream: Stream) {
        self.send(Entry::Declare(Box::new(stream)));
    }

    /// Records samples as they were received, oldest first.
    pub fn input(&self, id: &Arc<str>, samples: Vec<RawSample>) {
        self.send(Entry::Samples(id.clone(), samples));
    }

    /// Records attitudes, oldest first; `first` is the number of the first in its stream.
    pub fn attitude(&self, id: &Arc<str>, first: u64, attitudes: Vec<AttitudeSample>) {
        self.send(Entry::Attitudes(id.clone(), first, attitudes));
    }

    /// Ends the present file and goes on in a new one (after its name was taken away, or SIGHUP).
    pub fn reopen(&self) {
        self.send(Entry::Reopen);
    }

    /// State as of the last chunk.
    #[must_use]
    pub fn status(&self) -> Status {
        self.shared.snapshot()
    }

    fn send(&self, entry: Entry) {
        if let Err(TrySendError::Full(lost) | TrySendError::Disconnected(lost)) =
            self.sender.try_send(entry)
        {
            self.shared.miss(match lost {
                Entry::Samples(_, samples) => samples.len() as u64,
                Entry::Attitudes(_, _, attitudes) => attitudes.len() as u64,
                // A stream that could not be named still records, under default names.
                Entry::Declare(_) | Entry::Reopen | Entry::Finish => 0,
            });
        }
    }
}

/// The topics and frames of a stream nobody has named: input on `<id>/data_raw`, attitude beside it.
#[must_use]
pub fn stream_of(id: &str) -> Stream {
    let base = id.trim_end_matches('/');
    let named_raw = base == "data_raw" || base.ends_with("/data_raw");
    let input_topic = match named_raw {
        true => base.to_owned(),
        false => format!("{base}/data_raw"),
    };
    let mut stream = Stream::new(&input_topic, base.trim_start_matches('/'));
    stream.id = id.to_owned();
    stream.output_topic = output_topic(&input_topic, &BTreeSet::new());
    stream
}

/// A recording under way. Dropped without [`Recorder::finish`] it is finished all the same.
#[derive(Debug)]
pub struct Recorder {
    handle: Handle,
    worker: Option<JoinHandle<()>>,
}

impl Recorder {
    /// Opens the first file and starts the worker.
    ///
    /// # Errors
    /// [`Error::OutputExists`]; [`Error::Write`]: the file cannot be made, or there is less room than
    /// `min_free` already.
    pub fn start(settings: Settings) -> Result<Recorder> {
        let shared = Arc::new(Shared::default());
        let (sender, receiver) = sync_channel(settings.queue.max(1));
        let path = settings.path.clone();
        let worker = Worker::open(settings, shared.clone())?;
        let worker = std::thread::Builder::new()
            .name("strapd-record".to_owned())
            .spawn(move || worker.run(&receiver))
            .map_err(|source| Error::Write { path, source })?;
        Ok(Recorder {
            handle: Handle { sender, shared },
            worker: Some(worker),
        })
    }

    /// Handle for those who feed it.
    #[must_use]
    pub fn handle(&self) -> Handle {
        self.handle.clone()
    }

    /// Writes everything handed over before this call, ends the file and syncs it.
    #[must_use]
    pub fn finish(mut self) -> Status {
        self.end();
        self.handle.status()
    }

    fn end(&mut self) {
        if let Some(worker) = self.worker.take() {
            // Waits for room: the worker is taking entries out all the while. It is gone only after
            // a panic, which `join` reports.
            let _ = self.handle.sender.send(Entry::Finish);
            if worker.join().is_err() {
                let mut status = self.handle.shared.status();
                status.stopped = Some("the recorder's thread panicked".to_owned());
            }
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.end();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_tick_moves_no_sync_to_another_tick() {
        let settings = Settings::new("a.mcap");
        for (before, now) in [(0, 0), (1, 0), (0, 1), (90, 0), (0, 90), (90, 90)] {
            let since = |ticks: u64| Duration::from_millis(200 * ticks + now - before);
            assert!(!settings.is_sync_due(since(3)), "{before} {now}");
            assert!(settings.is_sync_due(since(4)), "{before} {now}");
        }
    }

    #[test]
    fn a_sync_that_is_done_late_takes_nothing_back() {
        let mut status = Status {
            files: vec!["a.mcap".into()],
            ..Status::default()
        };
        status.count_sync(1, 100);
        status.count_sync(1, 300);
        status.count_sync(1, 200);
        assert_eq!((status.syncs, status.synced), (2, 300));
        status.files.push("a.1.mcap".into());
        (status.syncs, status.synced) = (0, 20);
        status.count_sync(1, 400);
        assert_eq!((status.syncs, status.synced), (0, 20));
        status.count_sync(2, 50);
        assert_eq!((status.syncs, status.synced), (1, 50));
    }
}
