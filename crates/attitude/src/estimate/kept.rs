//! Samples as they came in, rates and auxiliary vectors -> the same again, as often as it is asked for.
//!
//! Apart from the smoother because a recording of ten hours does not fit in memory: what does not is written to a file
//! that is lent. Every number keeps its bits.

use crate::frames::{Body, In};
use crate::record::{Join, Measured, Nanos, RateSample, SampleKind, Status};
use nalgebra::Vector3;
use std::fmt;
use std::io::{self, Read, Seek, SeekFrom, Write};

/// Bytes that are held in memory before the rest, and they, go to the file: about a million and a half samples.
const IN_MEMORY: u64 = 128 << 20;
/// Bytes that are read and written at once.
const PIECE: usize = 1 << 20;
/// Longest event.
const LONGEST: usize = 128;

/// A place for what does not fit in memory: a file of nobody else, written from its beginning.
pub trait Spool: Read + Write + Seek + Send + Sync {}

// By its name: the vtable of every one of them would hold code that prints all its fields.
impl fmt::Debug for dyn Spool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Spool")
    }
}

impl<T: Read + Write + Seek + Send + Sync> Spool for T {}

/// A [`Spool`] that failed: the disk is full, say.
#[derive(Debug)]
pub struct SpoolError(pub io::Error);

impl fmt::Display for SpoolError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "samples of a recording that does not fit in memory could not be kept in a temporary file: {}",
            self.0
        )
    }
}

impl std::error::Error for SpoolError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&self.0)
    }
}

/// Something that an estimator of conditioned samples is given.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Event {
    Rate(RateSample),
    /// Specific force, m/s^2.
    Force(Nanos, In<Body>),
    /// Magnetic field.
    Field(Nanos, In<Body>),
    /// Mark that forces come by themselves from here on.
    ForcesBeside,
}

/// Events in the order in which they came.
#[derive(Debug)]
pub(super) struct SampleStore {
    filling: Vec<u8>,
    /// Pieces in memory, while there are few.
    pieces: Vec<Vec<u8>>,
    /// Lengths of those in the file.
    spooled: Vec<usize>,
    spool: Option<Box<dyn Spool>>,
    most: u64,
    bytes: u64,
    failure: Option<io::Error>,
}

impl Default for SampleStore {
    fn default() -> SampleStore {
        SampleStore {
            filling: Vec::new(),
            pieces: Vec::new(),
            spooled: Vec::new(),
            spool: None,
            most: IN_MEMORY,
            bytes: 0,
            failure: None,
        }
    }
}

impl SampleStore {
    /// Makes one with so many bytes in memory.
    #[cfg(test)]
    pub(super) fn of_at_most(most: u64) -> SampleStore {
        SampleStore {
            most,
            ..SampleStore::default()
        }
    }

    /// Goes to `spool` what does not fit.
    pub(super) fn spool_to(&mut self, spool: Box<dyn Spool>) {
        self.spool = Some(spool);
    }

    /// Bytes in the file, 0 where all is in memory.
    pub(super) fn spooled_bytes(&self) -> u64 {
        self.spooled.iter().map(|length| *length as u64).sum()
    }

    pub(super) fn push(&mut self, event: &Event) {
        if self.failure.is_some() {
            return;
        }
        encode(event, &mut self.filling);
        if self.filling.len() + LONGEST > PIECE
            && let Err(error) = self.put_away()
        {
            self.failure = Some(error);
        }
    }

    fn put_away(&mut self) -> io::Result<()> {
        self.bytes += self.filling.len() as u64;
        match self.spool.as_mut().filter(|_| self.bytes > self.most) {
            None => {
                let next = Vec::with_capacity(PIECE);
                self.pieces.push(std::mem::replace(&mut self.filling, next));
            }
            Some(spool) => {
                let filling = std::iter::once(&self.filling);
                for piece in self.pieces.iter().chain(filling) {
                    spool.write_all(piece)?;
                    self.spooled.push(piece.len());
                }
                self.pieces = Vec::new();
                self.filling.clear();
            }
        }
        Ok(())
    }

    /// Gives all of them to `take`, in order.
    ///
    /// # Errors
    /// Of the file, also where it could not be written before.
    pub(super) fn give(&mut self, mut take: impl FnMut(Event)) -> Result<(), SpoolError> {
        if let Some(failure) = &self.failure {
            let again = io::Error::new(failure.kind(), failure.to_string());
            return Err(SpoolError(again));
        }
        let mut give = |piece: &[u8]| {
            let mut rest = Bytes(piece);
            while !rest.0.is_empty() {
                take(decode(&mut rest).ok_or(SpoolError(io::ErrorKind::InvalidData.into()))?);
            }
            Ok(())
        };
        if let Some(spool) = self.spool.as_mut().filter(|_| !self.spooled.is_empty()) {
            spool.seek(SeekFrom::Start(0)).map_err(SpoolError)?;
            let mut piece = Vec::with_capacity(PIECE);
            for length in &self.spooled {
                piece.resize(*length, 0);
                spool.read_exact(&mut piece).map_err(SpoolError)?;
                give(&piece)?;
            }
        }
        self.pieces.iter().try_for_each(|piece| give(piece))?;
        give(&self.filling)
    }
}

const RATE: u8 = 0;
const FORCE: u8 = 1;
const FIELD: u8 = 2;
const FORCES_BESIDE: u8 = 3;
/// Flags of a rate: it has a specific force; its interval, and its log time, differ from its stamp; it is an increment.
const HAS_FORCE: u8 = 1 << 2;
const HAS_START: u8 = 1 << 3;
const HAS_LOG: u8 = 1 << 4;
const IS_INCREMENT: u8 = 1 << 5;
const KIND: u8 = 3;

const JOINS: [Join; 5] = [
    Join::Start,
    Join::Continuous,
    Join::Bridge,
    Join::Hold,
    Join::Reset,
];

fn encode(event: &Event, out: &mut Vec<u8>) {
    let mut beside = |kind: u8, stamp: &Nanos, vector: &In<Body>| {
        out.push(kind);
        out.extend(stamp.0.to_le_bytes());
        put(vector.as_vector(), out);
    };
    match event {
        Event::ForcesBeside => out.push(FORCES_BESIDE),
        Event::Force(stamp, force) => beside(FORCE, stamp, force),
        Event::Field(stamp, field) => beside(FIELD, stamp, field),
        Event::Rate(rate) => {
            let flag = |is_set: bool, bit: u8| if is_set { bit } else { 0 };
            let (start, log) = (rate.start != rate.stamp, rate.log != rate.stamp);
            out.push(
                RATE | flag(rate.accel.is_some(), HAS_FORCE)
                    | flag(start, HAS_START)
                    | flag(log, HAS_LOG)
                    | flag(matches!(rate.gyro, Measured::Increment(_)), IS_INCREMENT),
            );
            let join = JOINS.iter().position(|join| *join == rate.join);
            out.push(join.and_then(|join| u8::try_from(join).ok()).unwrap_or(1));
            out.extend(rate.status.0.to_le_bytes());
            out.extend(rate.stamp.0.to_le_bytes());
            if start {
                out.extend(rate.start.0.to_le_bytes());
            }
            if log {
                out.extend(rate.log.0.to_le_bytes());
            }
            put(rate.gyro.as_vector(), out);
            if let Some(force) = &rate.accel {
                put(force.as_vector(), out);
            }
        }
    }
}

fn put(vector: &Vector3<f64>, out: &mut Vec<u8>) {
    for value in vector.iter() {
        out.extend(value.to_le_bytes());
    }
}

/// Rest of a piece.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn next<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*head)
    }

    fn stamp(&mut self) -> Option<Nanos> {
        Some(Nanos(i64::from_le_bytes(self.next()?)))
    }

    fn vector(&mut self) -> Option<Vector3<f64>> {
        let mut value = || Some(f64::from_le_bytes(self.next()?));
        Some(Vector3::new(value()?, value()?, value()?))
    }
}

/// `None`: the file is not what was written to it.
fn decode(from: &mut Bytes<'_>) -> Option<Event> {
    let [kind] = from.next()?;
    Some(match kind & KIND {
        FORCES_BESIDE => Event::ForcesBeside,
        FORCE => Event::Force(from.stamp()?, In::assume(from.vector()?)),
        FIELD => Event::Field(from.stamp()?, In::assume(from.vector()?)),
        _ => {
            let [join] = from.next()?;
            let status = Status(u16::from_le_bytes(from.next()?));
            let stamp = from.stamp()?;
            let mut other = |bit: u8| {
                if kind & bit == 0 {
                    Some(stamp)
                } else {
                    from.stamp()
                }
            };
            let (start, log) = (other(HAS_START)?, other(HAS_LOG)?);
            Event::Rate(RateSample {
                stamp,
                start,
                gyro: Measured::assume(
                    match kind & IS_INCREMENT {
                        0 => SampleKind::Rate,
                        _ => SampleKind::DeltaAngle,
                    },
                    from.vector()?,
                ),
                accel: match kind & HAS_FORCE {
                    0 => None,
                    _ => Some(In::assume(from.vector()?)),
                },
                join: JOINS.get(usize::from(join)).copied()?,
                status,
                log,
            })
        }
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn events(n: u32) -> Vec<Event> {
        let vector = |i: u32| Vector3::new(f64::from(i).sin(), -0.0, f64::NAN.copysign(-1.0));
        (0..n)
            .map(|i| {
                let stamp = Nanos(i64::from(i) * 1_000_003 - 7);
                match i % 7 {
                    0 => Event::Force(stamp, In::assume(vector(i))),
                    1 => Event::Field(stamp, In::assume(vector(i))),
                    2 => Event::ForcesBeside,
                    kind => Event::Rate(RateSample {
                        stamp,
                        start: if kind == 3 { stamp } else { Nanos(i64::MIN) },
                        gyro: Measured::assume(
                            match i % 2 {
                                0 => SampleKind::Rate,
                                _ => SampleKind::DeltaAngle,
                            },
                            vector(i),
                        ),
                        accel: (kind > 4).then(|| In::assume(vector(i + 1))),
                        join: JOINS[i as usize % 5],
                        status: Status(i as u16),
                        log: if kind == 6 { stamp } else { Nanos(i64::MAX) },
                    }),
                }
            })
            .collect()
    }

    /// Bits and not values: NaN is one, and zero has a sign.
    fn bits(events: &[Event]) -> Vec<u8> {
        let mut out = Vec::new();
        events.iter().for_each(|event| encode(event, &mut out));
        out
    }

    fn given(kept: &mut SampleStore) -> Vec<Event> {
        let mut out = Vec::new();
        kept.give(|event| out.push(event)).unwrap();
        out
    }

    #[test]
    fn events_come_back_with_their_bits_from_memory_and_from_a_file_as_often_as_asked() {
        let events = events(60_000);
        let (mut held, mut spooled) = (SampleStore::default(), SampleStore::of_at_most(1 << 20));
        spooled.spool_to(Box::new(Cursor::new(Vec::new())));
        for event in &events {
            held.push(event);
            spooled.push(event);
        }
        assert_eq!(held.spooled_bytes(), 0);
        assert!(spooled.spooled_bytes() > 1 << 20);
        for kept in [&mut held, &mut spooled] {
            for _ in 0..2 {
                let back = given(kept);
                assert_eq!(back.len(), events.len());
                assert!(bits(&back) == bits(&events));
            }
        }
    }

    #[test]
    fn the_longest_event_fits_where_room_is_left_for_one() {
        let longest = events(70).iter().map(|e| bits(&[*e]).len()).max();
        assert!(longest.is_some_and(|longest| (60..LONGEST).contains(&longest)));
    }

    /// A disk that is full after so many bytes.
    #[derive(Debug)]
    struct Full(Cursor<Vec<u8>>, usize);

    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.0.get_ref().len() + bytes.len() > self.1 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.0.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Read for Full {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            self.0.read(bytes)
        }
    }

    impl Seek for Full {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.0.seek(to)
        }
    }

    #[test]
    fn a_full_disk_is_an_error_and_not_a_shorter_recording() {
        let mut kept = SampleStore::of_at_most(0);
        kept.spool_to(Box::new(Full(Cursor::default(), 3 << 20)));
        events(100_000).iter().for_each(|event| kept.push(event));
        for _ in 0..2 {
            let mut given = 0;
            let error = kept.give(|_| given += 1).unwrap_err();
            assert_eq!((error.0.kind(), given), (io::ErrorKind::StorageFull, 0));
        }
    }
}
