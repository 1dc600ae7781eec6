//! Bytes of a log, in any cut -> records, and what was wrong. Pure.
//!
//! Apart from the frames because it alone decides where one begins: a frame is believed by its checksum, or, where
//! that cannot be known, if another follows it.

use super::frame::{Checked, Frame, LONGEST, STAMP, begins, frame};
use super::message::{self, Content};
use super::sequence::{Sequences, topic};
use crate::decode::known_definition;
use crate::records::imu;
use crate::records::problem::{ProblemKind, Problems};
use crate::records::transcript::{ReadProgress, Transcribe, Transcript};
use crate::records::walk::Walk;
use std::collections::{BTreeMap, BTreeSet};

/// Bytes looked at to believe a frame, and to find one.
const WINDOW: usize = 3 * LONGEST;
/// Frames that must follow one of a capture which is none that is read: its marks are two bytes.
const CHAIN: usize = 2;

/// Sender of a sample: system, component, name of the message, sensor.
type Sender = (u8, u8, &'static str, u8);

/// A log under way.
#[derive(Debug, Default)]
pub(crate) struct Transcriber {
    walk: Walk,
    /// Whether no time stands before a frame.
    is_bare: bool,
    sequences: Sequences,
    channels: BTreeMap<Sender, (u16, u32)>,
    schemas: BTreeSet<u16>,
    /// The first that sent a sample, by its schema: its topics have plain names. A camera's mount that sends its attitude
    /// before the vehicle's sensors are heard takes no name from them.
    first: BTreeMap<u16, (u8, u8)>,
    message: Vec<u8>,
}

impl Transcribe for Transcriber {
    fn step(&mut self, ahead: &[u8], is_end: bool, to: &mut Transcript) -> ReadProgress {
        if ahead.len() < WINDOW && !is_end {
            return ReadProgress::Need(WINDOW);
        }
        let stamp = self.stamp();
        let used = match frame(ahead, stamp) {
            Ok(found) if is_believed(&found, ahead, stamp) => {
                self.walk.found();
                self.count(&found);
                match found.checked {
                    Checked::Wrong => {
                        self.walk.fault(ProblemKind::Checksum, Some(1));
                        self.walk.skip(found.total as u64);
                    }
                    Checked::Right => self.tell(&found, to),
                    Checked::Unknown => {}
                }
                found.total
            }
            // The end, unless another frame begins within it.
            Err(Some(need)) if is_end && !has_frame(ahead, stamp) => {
                self.walk.truncated(need, ahead.len());
                ahead.len()
            }
            _ => {
                // What could begin a time is looked at again with what follows it.
                let most = if is_end { ahead.len() } else { ahead.len() - 9 };
                self.walk.lose(ahead, most, |rest| begins(rest, stamp))
            }
        };
        self.walk.go_on(used, is_end && used == ahead.len());
        ReadProgress::Used(used)
    }

    fn finish(self: Box<Self>) -> (String, Problems) {
        (String::new(), self.walk.into_problems())
    }

    fn run(&self) -> usize {
        256 << 10
    }
}

impl Transcriber {
    /// Begins with captured bytes of a link.
    pub(crate) fn of_capture() -> Transcriber {
        Transcriber {
            is_bare: true,
            ..Transcriber::default()
        }
    }

    fn stamp(&self) -> usize {
        if self.is_bare { 0 } else { STAMP }
    }

    /// Counts the frames that a sender of a capture has numbered and that are not there. A log of a ground station may
    /// hold several links, each with a part of them.
    fn count(&mut self, found: &Frame<'_>) {
        if !self.is_bare {
            return;
        }
        let missing = self.sequences.missing(found);
        if missing > 0 {
            let count = u64::from(missing);
            self.walk
                .fault(ProblemKind::FramesMissing { count }, Some(count));
        }
    }

    fn tell(&mut self, found: &Frame<'_>, to: &mut Transcript) {
        let Some(known) = message::of(found.message) else {
            return;
        };
        let Some(sample) = known.sample(found.payload) else {
            return;
        };
        let own = (found.system, found.component);
        let sender = (own.0, own.1, known.name, sample.sensor);
        let (schema, of) = match sample.content {
            Content::Imu { .. } => (1, imu::TYPE),
            Content::Attitude(_) => (2, imu::ATTITUDE_TYPE),
        };
        let first = *self.first.entry(schema).or_insert(own);
        let next = self.channels.len();
        let (channel, count) = match self.channels.get_mut(&sender) {
            Some(known) => known,
            None => {
                let Some(number) = u16::try_from(next).ok().filter(|n| *n < u16::MAX) else {
                    return self.walk.fault(ProblemKind::TooManyDefinitions, None);
                };
                if self.schemas.insert(schema) {
                    let text = known_definition(of).unwrap_or_default();
                    to.schema(schema, of, "ros2msg", text.as_bytes());
                }
                let topic = topic(known.name, sample.sensor, own, first);
                let said = known.assumed().map(|unit| ("unit", unit));
                to.channel(number, schema, &topic, "cdr", said.as_slice());
                self.channels.entry(sender).or_insert((number, 0))
            }
        };
        // A capture has no clock but the vehicle's.
        let time = match self.is_bare {
            true => sample.time,
            false => found.time.saturating_mul(1000),
        };
        let stamp = (sample.time, "vehicle");
        match sample.content {
            Content::Imu { rate, force } => {
                imu::imu(&mut self.message, stamp, rate, Some(force));
            }
            Content::Attitude(q) => imu::attitude(&mut self.message, stamp, q),
        }
        to.message(*channel, *count, time, &self.message);
        *count = count.wrapping_add(1);
    }
}

/// Whether it is a frame: by its checksum, or because another follows, or nothing.
fn is_believed(found: &Frame<'_>, ahead: &[u8], stamp: usize) -> bool {
    let rest = ahead.get(found.total..).unwrap_or(&[]);
    found.checked == Checked::Right
        || rest.is_empty()
        || (begins(rest, stamp) && (stamp > 0 || follow(rest)))
}

/// Whether frames follow each other in a capture, as many as are believed; what is cut at the end counts.
fn follow(mut rest: &[u8]) -> bool {
    for _ in 0..CHAIN {
        match frame(rest, 0) {
            Ok(found) if found.checked == Checked::Right => return true,
            Ok(found) if found.checked == Checked::Unknown => {
                rest = rest.get(found.total..).unwrap_or(&[]);
            }
            Ok(_) | Err(None) => return false,
            Err(Some(_)) => return true,
        }
        if rest.is_empty() {
            return true;
        }
    }
    true
}

/// Whether a frame begins in these bytes behind the first.
fn has_frame(ahead: &[u8], stamp: usize) -> bool {
    (1..ahead.len()).any(|at| {
        let rest = ahead.get(at..).unwrap_or(&[]);
        frame(rest, stamp).is_ok_and(|found| is_believed(&found, rest, stamp))
    })
}

#[cfg(test)]
mod tests;
