//! The boxes of a video -> where its telemetry lies, and when. Pure, but for who has the bytes.
//!
//! Apart from the telemetry because a video knows nothing of it but one payload after the other. Every table is held
//! against its box, and what all payloads take together against the file.

use std::io;

/// Longest index of a video that is read, bytes: that of hours of high speed takes some ten million.
const LONGEST: u64 = 64 << 20;
/// Most boxes of a file that are looked at.
const MOST: usize = 10_000;
/// Seconds from 1904, where videos count from, to 1970.
const EPOCH: u64 = 2_082_844_800;

/// Times of creation that are believed, s since 1970: of this century.
const CALENDAR: std::ops::Range<u64> = 946_684_800..4_102_444_800;

/// Finds the index of a video, wherever it lies. `read` fills a slice from an offset, less only at the end.
///
/// # Errors
/// The input cannot be read; else why there is none, in words.
pub(crate) fn index(
    size: u64,
    read: &mut dyn FnMut(u64, &mut [u8]) -> io::Result<usize>,
) -> io::Result<Result<Vec<u8>, &'static str>> {
    let mut at = 0;
    for _ in 0..MOST {
        let mut head = [0; 16];
        let have = read(at, &mut head)?;
        let Some((kind, before, length)) =
            head.get(..have).and_then(|head| box_head(head, size - at))
        else {
            return Ok(Err(
                "it ends before its index (moov): the recording was cut",
            ));
        };
        if kind == *b"moov" {
            if length > LONGEST {
                return Ok(Err("its index is longer than the limit"));
            }
            if length > size - at {
                return Ok(Err(
                    "it ends inside its index (moov): the recording was cut",
                ));
            }
            let mut bytes = vec![0; usize::try_from(length.saturating_sub(before)).unwrap_or(0)];
            let have = read(at + before, &mut bytes)?;
            return Ok(match have == bytes.len() {
                true => Ok(bytes),
                false => Err("it ends inside its index (moov): the recording was cut"),
            });
        }
        at = match at.checked_add(length) {
            Some(next) if next < size => next,
            _ => {
                return Ok(Err(
                    "it ends before its index (moov): the recording was cut",
                ));
            }
        };
    }
    Ok(Err("it has more boxes than are looked at"))
}

/// Kind, bytes before what is in it, and length of a box of which `left` bytes can be there.
fn box_head(bytes: &[u8], left: u64) -> Option<([u8; 4], u64, u64)> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let (kind, rest) = rest.split_first_chunk::<4>()?;
    let (before, length) = match u32::from_be_bytes(*length) {
        0 => (8, left),
        1 => (16, u64::from_be_bytes(*rest.first_chunk()?)),
        length => (8, u64::from(length)),
    };
    (length >= before).then_some((*kind, before, length))
}

/// The boxes in `bytes`, with their kinds; what is none ends them.
fn boxes(mut bytes: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    std::iter::from_fn(move || {
        let (kind, before, length) = box_head(bytes, bytes.len() as u64)?;
        let (own, rest) = bytes.split_at_checked(usize::try_from(length).ok()?)?;
        bytes = rest;
        Some((kind, own.get(usize::try_from(before).ok()?..)?))
    })
}

fn inside<'b>(bytes: &'b [u8], path: &[&[u8; 4]]) -> Option<&'b [u8]> {
    path.iter().try_fold(bytes, |bytes, wanted| {
        let mut found = boxes(bytes).filter(|(kind, _)| kind == *wanted);
        found.next().map(|(_, inner)| inner)
    })
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let bytes = bytes.get(at..)?.first_chunk()?;
    Some(u32::from_be_bytes(*bytes))
}

/// Words of a table whose count stands at `at`, `each` for an entry; no more than there are.
fn table(bytes: &[u8], at: usize, each: usize) -> Vec<u32> {
    let count = word(bytes, at).unwrap_or(0) as usize;
    let (words, _) = bytes.get(at + 4..).unwrap_or(&[]).as_chunks::<4>();
    let words = words.iter().map(|word| u32::from_be_bytes(*word));
    words.take(count.saturating_mul(each)).collect()
}

/// Duration of a payload by its track, ns.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Lasts {
    /// The track says it of this one.
    Own(u64),
    /// The track says it of several alike, of which the last may have been cut.
    Alike(u64),
    Unsaid,
}

/// One payload.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Sample {
    pub(crate) offset: u64,
    pub(crate) size: u64,
    /// Time from the beginning of the track, ns.
    pub(crate) at: u64,
    pub(crate) lasts: Lasts,
}

/// The track of telemetry of a video.
#[derive(Debug)]
pub(crate) struct Movie {
    /// Time of recording by the camera's calendar, s since 1970; 0 where it is not stated.
    pub(crate) created: u64,
    timescale: u64,
    /// Sizes of payloads, or that of all and how many.
    sizes: Result<Vec<u32>, (u32, u32)>,
    /// Places of runs of payloads.
    chunks: Vec<u64>,
    /// First run, payloads in each from there on, and a word.
    runs: Vec<u32>,
    /// Numbers of payloads, and how long each lasts.
    lengths: Vec<u32>,
    next: Next,
}

/// Place of the next payload.
#[derive(Clone, Copy, Debug, Default)]
struct Next {
    sample: usize,
    chunk: usize,
    /// Index in its run, and offset in the file.
    in_chunk: u32,
    offset: u64,
    /// Index in `runs`, in `lengths`, and the number of the latter that are used.
    run: usize,
    length: usize,
    used: u32,
    time: u64,
}

impl Movie {
    /// The track of telemetry in an index; `None` where there is none.
    pub(crate) fn of(index: &[u8]) -> Option<Movie> {
        Movie::track(index, |media| {
            let kind = inside(media, &[b"minf", b"stbl", b"stsd"]).and_then(|of| of.get(12..16));
            kind == Some(b"gpmd")
        })
    }

    /// The first track with a picture; `None` where there is none.
    pub(crate) fn picture(index: &[u8]) -> Option<Movie> {
        Movie::track(index, |media| {
            let handler = inside(media, &[b"hdlr"]).and_then(|head| head.get(8..12));
            handler == Some(b"vide")
        })
    }

    /// The first track whose media are those.
    fn track(index: &[u8], is: impl Fn(&[u8]) -> bool) -> Option<Movie> {
        let created = inside(index, &[b"mvhd"]).and_then(|head| {
            let since_1904 = match head.first()? {
                1 => u64::from_be_bytes(*head.get(4..)?.first_chunk()?),
                _ => u64::from(word(head, 4)?),
            };
            since_1904.checked_sub(EPOCH)
        });
        let mut tracks = boxes(index).filter(|(kind, _)| kind == b"trak");
        tracks.find_map(|(_, track)| {
            let media = inside(track, &[b"mdia"])?;
            let tables = inside(media, &[b"minf", b"stbl"])?;
            if !is(media) {
                return None;
            }
            let head = inside(media, &[b"mdhd"])?;
            let timescale = match head.first()? {
                1 => word(head, 20)?,
                _ => word(head, 12)?,
            };
            let sizes = inside(tables, &[b"stsz"])?;
            let chunks = match inside(tables, &[b"co64"]) {
                None => {
                    let places = table(inside(tables, &[b"stco"])?, 4, 1);
                    places.into_iter().map(u64::from).collect()
                }
                Some(long) => {
                    let words = table(long, 4, 2);
                    let (pairs, _) = words.as_chunks::<2>();
                    let pair = |[a, b]: &[u32; 2]| u64::from(*a) << 32 | u64::from(*b);
                    pairs.iter().map(pair).collect()
                }
            };
            Some(Movie {
                // A calendar of the last century is not set.
                created: created.filter(|secs| CALENDAR.contains(secs)).unwrap_or(0),
                timescale: u64::from(timescale).max(1),
                sizes: match word(sizes, 4)? {
                    0 => Ok(table(sizes, 8, 1)),
                    all => Err((all, word(sizes, 8)?)),
                },
                chunks,
                runs: table(inside(tables, &[b"stsc"])?, 4, 3),
                lengths: table(inside(tables, &[b"stts"])?, 4, 2),
                next: Next::default(),
            })
        })
    }

    /// Number of payloads that it states.
    pub(crate) fn said(&self) -> u64 {
        match &self.sizes {
            Ok(sizes) => sizes.len() as u64,
            Err((_, count)) => u64::from(*count),
        }
    }

    /// Number of payloads that it has given.
    pub(crate) fn told(&self) -> u64 {
        self.next.sample as u64
    }

    /// Time from which its samples count, ns since 1970; a second after that where it is not stated.
    pub(crate) fn begins(&self) -> u64 {
        self.created.max(1) * super::SECOND
    }

    fn nanos(&self, time: u64) -> u64 {
        let nanos = u128::from(time) * 1_000_000_000 / u128::from(self.timescale);
        u64::try_from(nanos).unwrap_or(u64::MAX)
    }
}

impl Iterator for Movie {
    type Item = Sample;

    /// The next payload; `None` at the end, and where the tables do not say where it lies.
    fn next(&mut self) -> Option<Sample> {
        let mut next = self.next;
        let size = match &self.sizes {
            Ok(sizes) => *sizes.get(next.sample)?,
            Err((size, count)) => Some(*size).filter(|_| next.sample < *count as usize)?,
        };
        if next.in_chunk == 0 {
            next.offset = *self.chunks.get(next.chunk)?;
        }
        let run = |nth: usize| self.runs.get(3 * nth..3 * nth + 2);
        while let Some([first, _]) = run(next.run + 1)
            && *first as usize <= next.chunk + 1
        {
            next.run += 1;
        }
        let per_chunk = run(next.run)
            .and_then(|run| run.get(1))
            .filter(|n| **n > 0)?;
        let (lasts, alike) = loop {
            match self.lengths.get(2 * next.length..2 * next.length + 2) {
                Some([count, lasts]) if next.used < *count => break (*lasts, *count),
                Some(_) => (next.length, next.used) = (next.length + 1, 0),
                // Those without a length are as far apart as the last.
                None => break (self.lengths.last().copied()?, 0),
            }
        };
        let (at, end) = (next.time, next.time.saturating_add(u64::from(lasts)));
        let found = Sample {
            offset: next.offset,
            size: u64::from(size),
            at: self.nanos(at),
            lasts: match (alike, self.nanos(end).saturating_sub(self.nanos(at))) {
                (0, _) => Lasts::Unsaid,
                (1, lasts) => Lasts::Own(lasts),
                (_, lasts) => Lasts::Alike(lasts),
            },
        };
        next.time = end;
        next.used = next.used.saturating_add(1);
        next.sample += 1;
        next.offset = next.offset.saturating_add(u64::from(size));
        next.in_chunk += 1;
        if next.in_chunk >= *per_chunk {
            (next.chunk, next.in_chunk) = (next.chunk + 1, 0);
        }
        self.next = next;
        Some(found)
    }
}
