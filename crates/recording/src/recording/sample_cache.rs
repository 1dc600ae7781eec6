//! Samples of a text, read once -> the same again, as often as the text is walked. I/O: a file without a name.
//!
//! Apart from the log in a text because of two things to the same end: to make numbers of a row takes longer than all
//! that is done with them, and so each row is read once, and whoever walks the log again gets what was kept of it,
//! every number with its bits.

use super::input;
use super::line_reader;
use crate::decode::Undecodable;
use crate::error::Error;
use crate::records::Bytes;
use std::io::{self, BufRead, BufReader, BufWriter, Seek, Write};
use std::ops::ControlFlow;
use std::sync::Mutex;
use strapd_attitude::record::{Nanos, RawSample};
use tempfile::SpooledTempFile;

/// Content of a line of a text that is read again.
type LineEvent<'s> = line_reader::LineEvent<'s, input::Bytes>;

/// Bytes in memory, about a million samples; all of a longer text are in a file.
pub(super) const IN_MEMORY: u64 = 64 << 20;
/// Bytes that are kept. A text of more is read again.
pub(super) const MOST: u64 = 2 << 30;
/// Lines without samples that are kept.
const MOST_LOST: usize = 1 << 16;
/// Bytes that are read and written at once.
const BLOCK: usize = 1 << 16;

/// Samples on their way into a cache.
#[derive(Debug)]
pub(super) struct CacheWriter {
    /// `None` once something did not fit.
    out: Option<BufWriter<SpooledTempFile>>,
    room: u64,
    event: Vec<u8>,
    lost: Vec<(u64, Undecodable)>,
}

/// Samples as they were read, and the lines that held none.
#[derive(Debug)]
pub(super) struct SampleCache {
    kept: Mutex<SpooledTempFile>,
    lost: Vec<(u64, Undecodable)>,
}

impl CacheWriter {
    /// Makes a cache of at most so many bytes.
    pub(super) fn new(most: u64) -> CacheWriter {
        let kept = SpooledTempFile::new(usize::try_from(IN_MEMORY).unwrap_or(usize::MAX));
        CacheWriter {
            out: Some(BufWriter::with_capacity(BLOCK, kept)),
            room: most,
            event: Vec::new(),
            lost: Vec::new(),
        }
    }

    /// Keeps what a line held.
    pub(super) fn push(&mut self, event: LineEvent<'_>) {
        let Some(out) = &mut self.out else { return };
        self.event.clear();
        let mut place = |place: usize| {
            // There are at most 1024 of them.
            let place = u16::try_from(place).unwrap_or(u16::MAX);
            self.event.extend(place.to_le_bytes());
        };
        match event {
            LineEvent::Samples(at, samples) if !samples.is_empty() => {
                place(at);
                samples.iter().for_each(|raw| put(raw, &mut self.event));
            }
            LineEvent::Undecodable(at, number, why) => {
                place(at);
                self.lost.push((number, why));
            }
            _ => return,
        }
        let room = self.room.checked_sub((LENGTH + self.event.len()) as u64);
        let length = u32::try_from(self.event.len());
        let written = room.zip(length.ok()).and_then(|(room, length)| {
            self.room = room;
            out.write_all(&length.to_le_bytes()).ok()?;
            out.write_all(&self.event).ok()
        });
        if written.is_none() || self.lost.len() > MOST_LOST {
            (self.out, self.lost) = (None, Vec::new());
        }
    }

    /// Ends the text; `None` where something did not fit.
    pub(super) fn finish(self) -> Option<SampleCache> {
        Some(SampleCache {
            kept: Mutex::new(self.out?.into_inner().ok()?),
            lost: self.lost,
        })
    }
}

impl SampleCache {
    /// Gives all of it, in order, until `take` has enough or fails. `None` while another walk is under way, which has
    /// the file.
    ///
    /// # Errors
    /// The file cannot be read; as `take`.
    pub(super) fn walk<E: From<Error>>(
        &self,
        take: impl FnMut(LineEvent<'_>) -> Result<ControlFlow<()>, E>,
    ) -> Option<Result<(), E>> {
        let mut kept = self.kept.try_lock().ok()?;
        Some(self.give(&mut kept, take))
    }

    fn give<E: From<Error>>(
        &self,
        kept: &mut SpooledTempFile,
        mut take: impl FnMut(LineEvent<'_>) -> Result<ControlFlow<()>, E>,
    ) -> Result<(), E> {
        let mut offset = 0;
        let failed = |offset, source| Error::Read {
            path: std::env::temp_dir(),
            offset,
            source,
        };
        kept.rewind().map_err(|why| failed(0, why))?;
        let mut from = BufReader::with_capacity(BLOCK, kept);
        let (mut lost, mut bytes, mut samples) = (self.lost.iter(), Vec::new(), Vec::new());
        while next(&mut from, &mut bytes).map_err(|why| failed(offset, why))? {
            let not_ours = || failed(offset, io::ErrorKind::InvalidData.into());
            let place = event_of(&bytes, &mut samples).ok_or_else(not_ours)?;
            let event = match samples.as_slice() {
                [] => {
                    let (number, why) = lost.next().ok_or_else(not_ours)?;
                    LineEvent::Undecodable(place, *number, why.clone())
                }
                samples => LineEvent::Samples(place, samples),
            };
            if take(event)?.is_break() {
                break;
            }
            offset += (LENGTH + bytes.len()) as u64;
        }
        Ok(())
    }
}

/// Bytes of an event's length.
const LENGTH: usize = 4;

/// Reads the bytes of the next event; `false` at the end.
fn next(from: &mut impl BufRead, bytes: &mut Vec<u8>) -> io::Result<bool> {
    if from.fill_buf()?.is_empty() {
        return Ok(false);
    }
    let mut length = [0; LENGTH];
    from.read_exact(&mut length)?;
    bytes.resize(u32::from_le_bytes(length) as usize, 0);
    from.read_exact(bytes)?;
    Ok(true)
}

/// Returns the place of an event's sensor, and its samples: none of a line that held none.
fn event_of(bytes: &[u8], samples: &mut Vec<RawSample>) -> Option<usize> {
    let mut bytes = Bytes::new(bytes);
    let place = bytes.u16()?;
    samples.clear();
    while !bytes.is_empty() {
        samples.push(sample_of(&mut bytes)?);
    }
    Some(usize::from(place))
}

/// Writes a sample: which of its values there are, and these.
fn put(raw: &RawSample, out: &mut Vec<u8>) {
    let RawSample {
        header,
        log,
        publish,
        gyro,
        accel,
        mag,
        orientation,
        orientation_resets,
        interval_nanos,
        temperature,
        is_beside,
    } = raw;
    let has = [
        header.is_some(),
        *log != header.unwrap_or_default(),
        publish != log,
        interval_nanos.is_some(),
        orientation_resets.is_some(),
        gyro.is_some(),
        accel.is_some(),
        mag.is_some(),
        orientation.is_some(),
        *is_beside,
        temperature.is_some(),
    ];
    let bits = has.iter().rev();
    let bits = bits.fold(0u16, |bits, has| (bits << 1) | u16::from(*has));
    out.extend(bits.to_le_bytes());
    let integers = [
        header.map(|t| t.0),
        has[1].then_some(log.0),
        has[2].then_some(publish.0),
        *interval_nanos,
    ];
    for value in integers.into_iter().flatten() {
        out.extend(value.to_le_bytes());
    }
    out.extend(orientation_resets);
    let vectors = [gyro, accel, mag].into_iter().flatten().flatten();
    for value in vectors.chain(orientation.iter().flatten()) {
        out.extend(value.to_bits().to_le_bytes());
    }
    if let Some(value) = temperature {
        out.extend(value.to_bits().to_le_bytes());
    }
}

/// Reads a sample as [`put`] wrote it.
fn sample_of(from: &mut Bytes<'_>) -> Option<RawSample> {
    let bits = from.u16()?;
    let mut flags = (0..).map(|bit| bits >> bit & 1 == 1);
    let mut integer = |from: &mut Bytes<'_>| match flags.next()? {
        true => Some(Some(from.u64()?.cast_signed())),
        false => Some(None),
    };
    let header = integer(from)?.map(Nanos);
    let log = integer(from)?.map_or(header.unwrap_or_default(), Nanos);
    let publish = integer(from)?.map_or(log, Nanos);
    let interval_nanos = integer(from)?;
    let orientation_resets = match flags.next()? {
        true => Some(from.u8()?),
        false => None,
    };
    Some(RawSample {
        header,
        log,
        publish,
        interval_nanos,
        orientation_resets,
        gyro: numbers(flags.next()?, from)?,
        accel: numbers(flags.next()?, from)?,
        mag: numbers(flags.next()?, from)?,
        orientation: numbers(flags.next()?, from)?,
        is_beside: flags.next()?,
        temperature: match flags.next()? {
            true => Some(f32::from_bits(from.u32()?)),
            false => None,
        },
    })
}

fn numbers<const N: usize>(are_there: bool, from: &mut Bytes<'_>) -> Option<Option<[f64; N]>> {
    if !are_there {
        return Some(None);
    }
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = f64::from_bits(from.u64()?);
    }
    Some(Some(numbers))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Every set of values a sample can have, with numbers that only their bits tell apart.
    fn samples() -> Vec<RawSample> {
        let vector = |n: u16| [f64::from(n).sin(), -0.0, f64::NAN.copysign(-1.0)];
        (0..2048u16)
            .map(|n| {
                let has = |bit: u16| n >> bit & 1 == 1;
                let header = has(0).then_some(Nanos(i64::MIN + i64::from(n)));
                let log = match has(1) {
                    true => Nanos(i64::from(n)),
                    false => header.unwrap_or_default(),
                };
                RawSample {
                    header,
                    log,
                    publish: if has(2) { Nanos(i64::MAX) } else { log },
                    gyro: has(3).then(|| vector(n)),
                    accel: has(4).then(|| vector(n + 1)),
                    mag: has(5).then(|| vector(n + 2)),
                    orientation: has(6).then_some([1.0, f64::INFINITY, 5e-324, -1.0]),
                    orientation_resets: has(7).then_some(255),
                    interval_nanos: has(8).then_some(-1),
                    is_beside: has(9),
                    temperature: has(10).then_some(-0.1),
                }
            })
            .collect()
    }

    fn kept(most: u64, in_memory: usize) -> Option<SampleCache> {
        let mut cache = CacheWriter::new(most);
        cache.out = Some(BufWriter::new(SpooledTempFile::new(in_memory)));
        let samples = samples();
        for (n, some) in samples.chunks(3).enumerate() {
            cache.push(LineEvent::Samples(n, some));
            cache.push(LineEvent::Samples(n, &[]));
            if n % 50 == 7 {
                let number = n as u64;
                cache.push(LineEvent::Undecodable(n, number, lost(number)));
            }
        }
        cache.finish()
    }

    fn lost(number: u64) -> Undecodable {
        Undecodable::LongLine {
            have: number,
            limit: 1,
        }
    }

    #[test]
    fn every_sample_comes_back_with_its_bits_as_often_as_asked_from_memory_and_from_a_file() {
        for in_memory in [usize::MAX, 100] {
            let cache = kept(u64::MAX, in_memory).unwrap();
            assert_eq!(cache.kept.lock().unwrap().is_rolled(), in_memory == 100);
            for _ in 0..2 {
                let (mut back, mut places, mut bad) = (Vec::new(), Vec::new(), Vec::new());
                let walked = cache.walk::<Error>(|event| {
                    match event {
                        LineEvent::Samples(place, some) => {
                            places.push(place);
                            back.extend_from_slice(some);
                        }
                        LineEvent::Undecodable(place, number, why) => {
                            assert_eq!((place as u64, why), (number, lost(number)));
                            bad.push((place, places.len()));
                        }
                        _ => unreachable!(),
                    }
                    Ok(ControlFlow::Continue(()))
                });
                walked.unwrap().unwrap();
                // As text, which has NaN equal and shows its sign and that of zero.
                let (was, is) = (format!("{:?}", samples()), format!("{back:?}"));
                assert!(was == is);
                assert!(places.iter().copied().eq(0..683));
                // Each in its place between the samples.
                assert_eq!(bad.first(), Some(&(7, 8)));
                assert_eq!(bad.len(), 14);
            }
        }
    }

    #[test]
    fn a_walk_ends_where_it_is_told_and_none_begins_within_another() {
        let cache = kept(u64::MAX, usize::MAX).unwrap();
        let mut met = 0;
        let walked = cache.walk::<Error>(|_| {
            met += 1;
            assert!(cache.walk::<Error>(|_| unreachable!()).is_none());
            Ok(match met {
                5 => ControlFlow::Break(()),
                _ => ControlFlow::Continue(()),
            })
        });
        walked.unwrap().unwrap();
        assert_eq!(met, 5);
    }

    #[test]
    fn what_does_not_fit_is_not_kept_in_part() {
        let length = |cache: &SampleCache| cache.kept.lock().unwrap().seek(io::SeekFrom::End(0));
        let whole = length(&kept(u64::MAX, usize::MAX).unwrap()).unwrap();
        assert!(kept(whole, usize::MAX).is_some());
        assert!(kept(whole - 1, usize::MAX).is_none());
        let mut cache = CacheWriter::new(u64::MAX);
        for number in 0..=MOST_LOST as u64 {
            cache.push(LineEvent::Undecodable(0, number, lost(number)));
        }
        assert!(cache.finish().is_none());
    }

    #[test]
    fn a_file_that_was_changed_is_an_error() {
        let cache = kept(u64::MAX, usize::MAX).unwrap();
        {
            let mut kept = cache.kept.lock().unwrap();
            kept.seek(io::SeekFrom::Start(LENGTH as u64 + 2)).unwrap();
            kept.write_all(&[0xff; 2]).unwrap();
        }
        let walked = cache.walk::<Error>(|_| Ok(ControlFlow::Continue(())));
        assert!(matches!(walked, Some(Err(Error::Read { offset: 0, .. }))));
    }
}
