//! The bytes of GoPro's telemetry, alone or in a video -> blocks of records. I/O.
//!
//! Apart from [`crate::gpmf`], which does the work and knows no files. A video is read where its index says, which may
//! stand at its end, so a stream of one was put into a file before it comes here.

use super::super::block::Block;
use super::super::input::{Input, LogFile};
use super::super::scan::{Facts, Item};
use super::Container;
use crate::format::Format;
use crate::gpmf::{
    self, ITEM_HEAD, LONGEST, Lasts, MAGIC, Movie, SECOND, Sample, Transcriber, item_length,
    next_device,
};
use crate::records::problem::{ProblemKind, Problems};
use crate::records::transcript::Transcript;
use std::io;
use std::sync::Arc;

/// Bytes of records worked on together.
const RUN: usize = 1 << 20;
/// Bytes searched for the next device, at first and at most at a time.
const FIRST: usize = 256;
const WINDOW: usize = 256 << 10;
/// Bytes of a device up to the end of its number, which is its first item.
const DEVICE: usize = ITEM_HEAD + ITEM_HEAD + 4;

/// The walk over a recording.
#[derive(Debug)]
pub(in super::super) struct Scanner {
    file: Option<Arc<LogFile>>,
    source: Source,
    transcriber: Transcriber,
    problems: Problems,
    /// The payload itself.
    bytes: Vec<u8>,
    /// Position of the payload given last.
    position: u64,
    /// Bytes of all payloads so far: each byte of the file belongs to one.
    read: u64,
}

/// Source of payloads.
#[derive(Debug)]
enum Source {
    /// Not looked at yet.
    New,
    Movie(Box<Movie>),
    /// One after the other, from here on: how many there were, and the device each begins with.
    Bare {
        at: u64,
        count: u64,
    },
    Done,
}

impl Scanner {
    pub(super) fn new(input: Input) -> Self {
        let file = match input {
            Input::File(file) => Some(file),
            Input::Stream { .. } => None,
        };
        debug_assert!(file.is_some(), "who opens a stream keeps it in a file");
        Scanner {
            file,
            source: Source::New,
            transcriber: Transcriber::default(),
            problems: Problems::default(),
            bytes: Vec::new(),
            position: 0,
            read: 0,
        }
    }

    /// The next payload, or what stands in its place.
    fn step(&mut self, file: &LogFile, to: &mut Transcript) -> io::Result<()> {
        match &mut self.source {
            Source::New => self.begin(file)?,
            Source::Movie(movie) => {
                let created = movie.begins();
                match movie.next() {
                    Some(sample) => self.sample(file, created, sample, to)?,
                    None => {
                        let (found, said) = (movie.told(), movie.said());
                        if found < said {
                            let why = "its tables end before its payloads do";
                            self.problems.add(0, ProblemKind::Video { why }, None);
                        }
                        self.end(to);
                    }
                }
            }
            Source::Bare { at, count } => {
                let (at, count) = (*at, *count);
                self.bare(file, at, count, to)?;
            }
            Source::Done => {}
        }
        Ok(())
    }

    fn end(&mut self, to: &mut Transcript) {
        self.transcriber.finish(to);
        self.source = Source::Done;
    }

    fn begin(&mut self, file: &LogFile) -> io::Result<()> {
        let mut head = [0; MAGIC.len()];
        file.read_at(&mut head, 0)?;
        self.source = match head == MAGIC {
            true => Source::Bare { at: 0, count: 0 },
            false => match track(file)? {
                Ok(movie) => Source::Movie(Box::new(movie)),
                Err(why) => {
                    self.problems.add(0, ProblemKind::Video { why }, None);
                    Source::Done
                }
            },
        };
        Ok(())
    }

    /// A payload of a video.
    fn sample(
        &mut self,
        file: &LogFile,
        created: u64,
        sample: Sample,
        to: &mut Transcript,
    ) -> io::Result<()> {
        let Sample {
            offset,
            size,
            at,
            lasts,
        } = sample;
        self.position = offset;
        if size > LONGEST {
            let why = "a payload is longer than the limit";
            self.problems.add(offset, ProblemKind::Video { why }, None);
            return Ok(());
        }
        self.read = self.read.saturating_add(size);
        if self.read > file.len {
            let why = "its payloads lie upon each other, or behind its end";
            self.problems.add(offset, ProblemKind::Video { why }, None);
            self.end(to);
            return Ok(());
        }
        self.bytes.resize(usize::try_from(size).unwrap_or(0), 0);
        let have = file.read_at(&mut self.bytes, offset)?;
        if have < self.bytes.len() {
            let (need, have) = (size, have as u64);
            self.problems
                .add(offset, ProblemKind::Truncated { need, have }, None);
            return Ok(());
        }
        self.transcriber
            .push(created.saturating_add(at), lasts, &self.bytes, to);
        self.complain();
        Ok(())
    }

    fn complain(&mut self) {
        for why in self.transcriber.refused.drain(..) {
            let kind = ProblemKind::Telemetry { why };
            self.problems.add(self.position, kind, None);
        }
        let skipped = std::mem::take(&mut self.transcriber.rest) as u64;
        if skipped > 0 {
            let kind = ProblemKind::Garbage { skipped };
            self.problems.add(self.position, kind, None);
        }
    }

    /// A payload of a stream without a video: devices, up to the next that is called as the first.
    fn bare(
        &mut self,
        file: &LogFile,
        from: u64,
        count: u64,
        to: &mut Transcript,
    ) -> io::Result<()> {
        self.bytes.clear();
        let mut at = from;
        let mut first = None;
        loop {
            let begin = self.bytes.len();
            let mut head = [0; DEVICE];
            let have = file.read_at(&mut head, at)?;
            let known = head.first_chunk::<ITEM_HEAD>();
            let is_device = have == DEVICE && head.starts_with(&MAGIC);
            let Some(length) = known.map(item_length).filter(|_| is_device) else {
                // The end of the payload; what stands here is looked at when it is the next.
                break;
            };
            // `DVID` is the first item of a device.
            let number: Option<[u8; DEVICE - ITEM_HEAD]> = head.last_chunk().copied();
            if first.is_some() && number == first {
                break;
            }
            // One that goes on behind the end is cut, unless another follows: then its length is damaged.
            let is_cut = at + length as u64 > file.len + 3;
            if is_cut && find(file, at + 1)?.is_some() {
                break;
            }
            first = first.or(number);
            self.bytes.resize(begin + length, 0);
            let have = file.read_at(self.bytes.get_mut(begin..).unwrap_or(&mut []), at)?;
            self.bytes.truncate(begin + have);
            // What fills the last item up may be left out.
            if have + 4 <= length {
                let (need, have) = (length as u64, have as u64);
                self.problems
                    .add(at, ProblemKind::Truncated { need, have }, None);
                at += have;
                break;
            }
            at += length as u64;
            if self.bytes.len() as u64 > LONGEST {
                break;
            }
        }
        if self.bytes.is_empty() {
            return self.search(file, at, count, to);
        }
        self.position = from;
        let tick = Transcriber::tick(&self.bytes).map(|millis| millis.saturating_mul(1_000_000));
        let time = tick.unwrap_or((count + 1).saturating_mul(SECOND));
        self.transcriber.push(time, Lasts::Unsaid, &self.bytes, to);
        self.complain();
        let count = count + 1;
        self.source = Source::Bare { at, count };
        Ok(())
    }

    /// Searches where no device begins that can be read: the end, or what is skipped up to the next.
    fn search(
        &mut self,
        file: &LogFile,
        from: u64,
        count: u64,
        to: &mut Transcript,
    ) -> io::Result<()> {
        let found = find(file, from + 1)?;
        let skipped = found.unwrap_or(file.len).saturating_sub(from);
        if skipped > 0 {
            self.problems
                .add(from, ProblemKind::Garbage { skipped }, None);
        }
        match found {
            Some(at) => self.source = Source::Bare { at, count },
            None => self.end(to),
        }
        Ok(())
    }
}

impl Container for Scanner {
    fn position(&self) -> u64 {
        self.position
    }

    fn finish(self: Box<Self>) -> (Facts, Problems) {
        let facts = Facts {
            format: Format::Gpmf,
            library: match self.transcriber.camera.as_str() {
                "" => String::new(),
                name => format!("GoPro {name}"),
            },
            ..Facts::default()
        };
        (facts, self.problems)
    }

    fn next(&mut self) -> io::Result<Option<Item>> {
        let mut to = Transcript::default();
        let offset = self.position;
        if let Some(file) = self.file.clone() {
            while to.bytes.len() < RUN && !matches!(self.source, Source::Done) {
                self.step(&file, &mut to)?;
            }
        }
        Ok(Block::of_records(offset, to.bytes).map(Item::Block))
    }
}

/// Offset of the next device, from a place on.
fn find(file: &LogFile, from: u64) -> io::Result<Option<u64>> {
    let mut at = from;
    let mut size = FIRST;
    loop {
        let mut window = vec![0; size];
        let have = file.read_at(&mut window, at)?;
        if let Some(found) = next_device(window.get(..have).unwrap_or(&[])) {
            return Ok(Some(at + found as u64));
        }
        if have < size {
            return Ok(None);
        }
        at += (size - MAGIC.len()) as u64;
        size = WINDOW.min(2 * size);
    }
}

/// Whether a video has telemetry.
///
/// # Errors
/// The input cannot be read.
pub(in super::super) fn has_track(file: &LogFile) -> io::Result<bool> {
    Ok(track(file)?.is_ok())
}

/// The track of telemetry of a video.
///
/// # Errors
/// The input cannot be read; else why there is none, in words.
fn track(file: &LogFile) -> io::Result<Result<Movie, &'static str>> {
    let found = gpmf::index(file.len, &mut |at, into| file.read_at(into, at))?;
    Ok(found.and_then(|index| Movie::of(&index).ok_or("it has no track of telemetry (gpmd)")))
}
