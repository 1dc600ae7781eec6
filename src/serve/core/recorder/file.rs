//! Chunks -> one file that is whole up to its last chunk, whatever happens. I/O.
//!
//! A stage of its own because everything that can go wrong with the disk is here. A chunk is one write.
//! What a write that failed has left behind is cut off, so the file ends at a chunk and can be closed.

use crate::error::{Error, Result};
use crate::sink::{LiveMcap, claim_or_warn, is_named, unclaimed};
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file being recorded.
#[derive(Debug)]
pub(super) struct RecordingFile {
    pub(super) path: PathBuf,
    pub(super) file: Arc<File>,
    pub(super) live: LiveMcap,
    /// Bytes of it, to the end of the last chunk.
    pub(super) bytes: u64,
    /// Offset of the end of the one before.
    before: u64,
    /// The last chunk had to make room for the end of the file.
    pub(super) last_left_out: bool,
}

impl RecordingFile {
    /// Makes the file and writes its head.
    pub(super) fn create(path: &Path, live: LiveMcap, force: bool) -> Result<RecordingFile> {
        let error = |source| Error::Write {
            path: path.to_owned(),
            source,
        };
        // What another process is writing is not replaced; who has just begun it finds it locked.
        let replaced = match force {
            true => unclaimed(path).map_err(error)?,
            false => None,
        };
        if force && path.symlink_metadata().is_ok_and(|found| found.is_file()) {
            // Not emptied: whoever holds or links the old file keeps it.
            std::fs::remove_file(path).map_err(error)?;
        }
        let file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(path)
            .map_err(|source| match source.kind() {
                ErrorKind::AlreadyExists => Error::OutputExists {
                    path: path.to_owned(),
                },
                _ => error(source),
            })?;
        drop(replaced);
        claim_or_warn(&file, path).map_err(error)?;
        // Another process may have replaced it before it was locked.
        if !file.metadata().is_ok_and(|opened| is_named(&opened, path)) {
            let why = "another process has just replaced it";
            return Err(error(io::Error::new(ErrorKind::ResourceBusy, why)));
        }
        let mut recording = RecordingFile {
            path: path.to_owned(),
            file: Arc::new(file),
            live,
            bytes: 0,
            before: 0,
            last_left_out: false,
        };
        recording.flush()?;
        recording.file.sync_data().map_err(error)?;
        crate::sink::sync_directory(path).map_err(error)?;
        Ok(recording)
    }

    /// Writes what is pending as one chunk.
    ///
    /// # Errors
    /// [`Error::Write`]; then the file ends at the chunk before, and what was pending is gone.
    pub(super) fn flush(&mut self) -> Result<()> {
        if self.live.pending() == 0 {
            return Ok(());
        }
        let sealed = self.live.seal(&self.path)?;
        let length = sealed.len() as u64;
        match (&*self.file).write_all(sealed) {
            Ok(()) => {
                self.live.booked();
                self.before = self.bytes;
                self.bytes += length;
                Ok(())
            }
            Err(source) => {
                self.live.drop_pending();
                self.cut(self.bytes);
                Err(self.failed(source))
            }
        }
    }

    /// Ends the file and syncs it. Where there is no room for index and summary it ends without them,
    /// and where there is no room even for that, without the last chunk.
    ///
    /// # Errors
    /// [`Error::Write`]: it could not be ended or synced; `strapd recover` reads what is there.
    pub(super) fn close(&mut self) -> Result<()> {
        let written = self.write_closing();
        let synced = self.file.sync_all();
        written.and(synced).map_err(|source| self.failed(source))
    }

    fn write_closing(&mut self) -> io::Result<()> {
        let [whole, shortest] = self.live.closings();
        let attempts = [
            (self.bytes, &whole),
            (self.bytes, &shortest),
            (self.before, &shortest),
        ];
        let mut last = Ok(());
        for (end, closing) in attempts {
            self.cut(end);
            last = (&*self.file).write_all(closing);
            if last.is_ok() {
                self.last_left_out = end < self.bytes;
                self.bytes = end + closing.len() as u64;
                return last;
            }
        }
        self.cut(self.bytes);
        last
    }

    /// Cuts the file, best effort: what a cut that fails leaves behind is a chunk cut short, as after
    /// a crash.
    fn cut(&mut self, end: u64) {
        if self.file.set_len(end).is_ok() {
            let _ = (&*self.file).seek(SeekFrom::Start(end));
        }
    }

    fn failed(&self, source: io::Error) -> Error {
        Error::Write {
            path: self.path.clone(),
            source,
        }
    }
}
