//! A file or a stream -> bytes in order, ahead of a position. I/O.
//!
//! A stage of its own so that the walk is written once: it sees a position, the bytes after it,
//! and a way to hand a stretch of them to another thread. Files are read by position
//! (no memory map: a file cut by another process must be an error, not a signal), streams in sequence.

use crate::remote_object::Object;
use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Number of bytes that a stream may make us allocate at once on the word of a length field.
const STEP: usize = 1 << 20;
/// Handed-back buffers kept for reuse, and the largest worth keeping.
const SPARE: usize = 32;
const SPARE_BYTES: usize = 4 << 20;
/// The same for copies of short stretches.
const SMALL: usize = 256;
const SMALL_BYTES: usize = 64 << 10;

/// A regular file, or an object elsewhere, read by position from any thread.
#[derive(Debug)]
pub(super) struct LogFile {
    pub(super) path: PathBuf,
    /// Length when it was opened; what is appended later is not seen.
    pub(super) len: u64,
    bytes: Bytes,
    #[cfg(not(unix))]
    turn: std::sync::Mutex<()>,
}

#[derive(Debug)]
enum Bytes {
    File(File),
    Object(Arc<dyn Object>),
}

impl LogFile {
    pub(super) fn new(path: &Path, file: File, len: u64) -> Self {
        LogFile {
            path: path.to_owned(),
            len,
            bytes: Bytes::File(file),
            #[cfg(not(unix))]
            turn: std::sync::Mutex::new(()),
        }
    }

    pub(super) fn of_object(path: &Path, object: Arc<dyn Object>) -> Self {
        LogFile {
            path: path.to_owned(),
            len: object.size(),
            bytes: Bytes::Object(object),
            #[cfg(not(unix))]
            turn: std::sync::Mutex::new(()),
        }
    }

    /// Remote object, if it is one.
    pub(super) fn object(&self) -> Option<&dyn Object> {
        match &self.bytes {
            Bytes::File(_) => None,
            Bytes::Object(object) => Some(object.as_ref()),
        }
    }

    fn read_once(&self, buf: &mut [u8], offset: u64) -> io::Result<usize> {
        match &self.bytes {
            Bytes::File(file) => self.read_file(file, buf, offset),
            // As if it ended where it did when it was opened.
            Bytes::Object(object) => {
                let left = usize::try_from(self.len.saturating_sub(offset)).unwrap_or(usize::MAX);
                let most = buf.len().min(left);
                let Some(room) = buf.get_mut(..most) else {
                    return Ok(0);
                };
                Ok(object.read_at(room, offset)?.min(most))
            }
        }
    }

    #[cfg(unix)]
    #[allow(clippy::unused_self, reason = "elsewhere one at a time has the turn")]
    fn read_file(&self, file: &File, buf: &mut [u8], offset: u64) -> io::Result<usize> {
        std::os::unix::fs::FileExt::read_at(file, buf, offset)
    }

    #[cfg(not(unix))]
    fn read_file(&self, mut file: &File, buf: &mut [u8], offset: u64) -> io::Result<usize> {
        use std::io::{Seek, SeekFrom};
        let _turn = self.turn.lock().unwrap_or_else(|e| e.into_inner());
        file.seek(SeekFrom::Start(offset))?;
        file.read(buf)
    }

    /// Fills `buf` from `offset`; less only at the end of the file.
    pub(super) fn read_at(&self, buf: &mut [u8], offset: u64) -> io::Result<usize> {
        let mut got = 0;
        while let Some(rest) = buf.get_mut(got..).filter(|r| !r.is_empty()) {
            match self.read_once(rest, offset.saturating_add(got as u64)) {
                Ok(0) => break,
                Ok(n) => got += n,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(got)
    }
}

/// Bytes of a file, from one place to another.
#[derive(Debug)]
pub(super) struct Stretch<'f> {
    file: &'f LogFile,
    at: u64,
    left: usize,
}

impl<'f> Stretch<'f> {
    pub(super) fn of(file: &'f LogFile, at: u64, left: usize) -> Self {
        Stretch { file, at, left }
    }
}

impl Read for Stretch<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let most = self.left.min(into.len());
        let n = self
            .file
            .read_at(into.get_mut(..most).unwrap_or(&mut []), self.at)?;
        self.at += n as u64;
        self.left -= n;
        Ok(n)
    }
}

/// Source of the bytes.
pub(super) enum Input {
    File(Arc<LogFile>),
    Stream {
        name: PathBuf,
        from: Box<dyn Read + Send>,
    },
}

impl std::fmt::Debug for Input {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Input({})", self.name().display())
    }
}

impl Input {
    pub(super) fn name(&self) -> &Path {
        match self {
            Input::File(file) => &file.path,
            Input::Stream { name, .. } => name,
        }
    }
}

/// Bytes that belong to whoever holds them: `bytes[range]`.
#[derive(Debug, Default)]
pub(super) struct OwnedBytes {
    pub(super) bytes: Vec<u8>,
    pub(super) range: Range<usize>,
}

impl OwnedBytes {
    pub(super) fn as_slice(&self) -> &[u8] {
        self.bytes.get(self.range.clone()).unwrap_or(&[])
    }
}

/// The input, a position in it, and what has been read ahead of the position.
#[derive(Debug)]
pub(super) struct Tape {
    input: Input,
    buf: Vec<u8>,
    start: usize,
    end: usize,
    /// Offset in the input of `buf[start]`.
    position: u64,
    at_end: bool,
    spare: Vec<Vec<u8>>,
    small: Vec<Vec<u8>>,
}

impl Tape {
    /// `position` is how much of a stream has been read already; 0 for a file.
    pub(super) fn new(input: Input, position: u64) -> Self {
        Tape {
            input,
            buf: Vec::new(),
            start: 0,
            end: 0,
            position,
            at_end: false,
            spare: Vec::new(),
            small: Vec::new(),
        }
    }

    pub(super) fn input(&self) -> &Input {
        &self.input
    }

    pub(super) fn position(&self) -> u64 {
        self.position
    }

    /// Bytes between the position and the end of a file; unknown for a stream.
    pub(super) fn remaining(&self) -> Option<u64> {
        match &self.input {
            Input::File(file) => Some(file.len.saturating_sub(self.position)),
            Input::Stream { .. } => None,
        }
    }

    /// Whether `n` more bytes can be there; a stream can only be tried.
    pub(super) fn may_have(&self, n: u64) -> bool {
        self.remaining().is_none_or(|r| n <= r)
    }

    /// Bytes buffered ahead of the position already.
    fn ahead(&self) -> &[u8] {
        self.buf.get(self.start..self.end).unwrap_or(&[])
    }

    /// Reads ahead at least `need` bytes of the position, less only at the end of the input. Where it
    /// has to read, it reads `want`, so that many small needs cost one read.
    pub(super) fn available(&mut self, need: usize, want: usize) -> io::Result<&[u8]> {
        if self.end - self.start < need && !self.at_end {
            self.read_more(need, want.max(need))?;
        }
        Ok(self.ahead())
    }

    fn read_more(&mut self, need: usize, want: usize) -> io::Result<()> {
        if self.start > 0 {
            self.buf.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        while self.end < need && !self.at_end {
            let goal = match self.remaining() {
                Some(left) => want.min(usize::try_from(left).unwrap_or(usize::MAX)),
                None => want.min(self.end + STEP),
            };
            if goal <= self.end {
                self.at_end = true;
                break;
            }
            if self.buf.len() < goal {
                self.buf.resize(goal, 0);
            }
            let Some(room) = self.buf.get_mut(self.end..goal) else {
                break;
            };
            let got = match &mut self.input {
                Input::File(file) => file.read_at(room, self.position + self.end as u64)?,
                Input::Stream { from, .. } => loop {
                    match from.read(room) {
                        Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                        other => break other?,
                    }
                },
            };
            // A `Read` that claims more than it was given room for must not move us past the buffer.
            self.end += got.min(goal - self.end);
            self.at_end = got == 0;
        }
        Ok(())
    }

    /// Moves on by `n` bytes; how many there were (fewer only at the end).
    pub(super) fn skip(&mut self, n: u64) -> io::Result<u64> {
        let ahead = (self.end - self.start) as u64;
        if n <= ahead {
            self.start += n as usize;
            self.position += n;
            return Ok(n);
        }
        if let Some(left) = self.remaining() {
            let n = n.min(left);
            self.seek(self.position + n);
            return Ok(n);
        }
        let mut done = 0;
        while done < n {
            let here = self.available(1, STEP.min(usize::try_from(n - done).unwrap_or(STEP)))?;
            let step = (here.len() as u64).min(n - done);
            if step == 0 {
                break;
            }
            self.start += step as usize;
            self.position += step;
            done += step;
        }
        Ok(done)
    }

    /// Moves a file's position anywhere; a stream cannot.
    pub(super) fn seek(&mut self, position: u64) {
        if let Input::File(_) = self.input {
            self.position = position;
            self.start = 0;
            self.end = 0;
            self.at_end = false;
        }
    }

    /// Hands out the next `n` bytes, which must be available, without copying them; what was read
    /// beyond them moves to a spare buffer.
    pub(super) fn hand_out(&mut self, n: usize) -> OwnedBytes {
        let n = n.min(self.end - self.start);
        let cut = self.start + n;
        let mut next = self.spare.pop().unwrap_or_default();
        let tail = self.buf.get(cut..self.end).unwrap_or(&[]);
        if next.len() < tail.len() {
            next.resize(tail.len(), 0);
        }
        if let Some(room) = next.get_mut(..tail.len()) {
            room.copy_from_slice(tail);
        }
        let tail = tail.len();
        let held = OwnedBytes {
            bytes: std::mem::replace(&mut self.buf, next),
            range: self.start..cut,
        };
        self.start = 0;
        self.end = tail;
        self.position += n as u64;
        held
    }

    /// The next `n` bytes as [`Tape::hand_out`], copied, if they are buffered already: for stretches
    /// so short that a buffer for each would be waste.
    pub(super) fn copy_out(&mut self, n: usize) -> Option<OwnedBytes> {
        if n > self.ahead().len() {
            return None;
        }
        let mut bytes = self.small.pop().unwrap_or_default();
        bytes.clear();
        bytes.extend_from_slice(self.ahead().get(..n)?);
        self.start += n;
        self.position += n as u64;
        Some(OwnedBytes { bytes, range: 0..n })
    }

    /// Takes back a buffer that was handed out.
    pub(super) fn recycle(&mut self, held: OwnedBytes) {
        let bytes = held.bytes.capacity();
        if bytes <= SMALL_BYTES && self.small.len() < SMALL {
            self.small.push(held.bytes);
        } else if bytes > SMALL_BYTES && bytes <= SPARE_BYTES && self.spare.len() < SPARE {
            self.spare.push(held.bytes);
        }
    }
}
