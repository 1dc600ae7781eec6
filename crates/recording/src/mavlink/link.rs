//! Bytes of a living link, in any cut -> lines of samples, as a daemon reads them. Pure.
//!
//! Apart from the logs because nothing waits here: a frame is used when its last byte has come. One whose checksum is wrong,
//! or cannot be known and stands before something else, costs a byte, and the search goes on behind that.

use super::frame::{Checked, Frame, begins, frame};
use super::message::{self, Content};
use super::sequence::{Sequences, topic};
use crate::records::imu;

/// Reader of a link.
#[derive(Debug, Default)]
pub struct Link {
    /// Beginning of a frame whose end has not come.
    partial: Vec<u8>,
    sequences: Sequences,
    /// The first that sent a sample: its sensors have plain names.
    first: Option<(u8, u8)>,
    frames: u64,
    missing: u64,
}

impl Link {
    /// Takes the next bytes, and appends a line for each sample in them; `prefix` goes before the names of sensors.
    pub fn push(&mut self, bytes: &[u8], prefix: Option<&str>, lines: &mut Vec<u8>) {
        let mut partial = std::mem::take(&mut self.partial);
        partial.extend_from_slice(bytes);
        let mut rest = partial.as_slice();
        while !rest.is_empty() {
            let used = match frame(rest, 0) {
                Err(Some(_)) => break,
                Err(None) => 1,
                Ok(found) => {
                    let behind = rest.get(found.total..).unwrap_or(&[]);
                    let is_whole = match found.checked {
                        Checked::Right => true,
                        Checked::Wrong => false,
                        Checked::Unknown => behind.is_empty() || begins(behind, 0),
                    };
                    if is_whole {
                        self.take(&found, prefix, lines);
                        found.total
                    } else {
                        1
                    }
                }
            };
            rest = rest.get(used..).unwrap_or(&[]);
        }
        let left = partial.len() - rest.len();
        partial.drain(..left);
        self.partial = partial;
    }

    /// Number of frames so far, and of those that their senders have numbered and that did not come.
    #[must_use]
    pub fn counts(&self) -> (u64, u64) {
        (self.frames, self.missing)
    }

    fn take(&mut self, found: &Frame<'_>, prefix: Option<&str>, lines: &mut Vec<u8>) {
        self.frames += 1;
        self.missing += u64::from(self.sequences.missing(found));
        let spec = message::of(found.message);
        let Some((spec, sample)) = spec.and_then(|spec| Some((spec, spec.sample(found.payload)?)))
        else {
            return;
        };
        // An attitude is none of strapd's own, and its sender names no sensor.
        let Content::Imu { rate, force } = sample.content else {
            return;
        };
        let own = (found.system, found.component);
        let first = *self.first.get_or_insert(own);
        let mut id = topic(spec.name, sample.sensor, own, first);
        if let Some(prefix) = prefix {
            id = format!("{prefix}/{id}");
        }
        if rate.iter().chain(&force).any(|value| !value.is_finite()) {
            return;
        }
        let vectors = [("gyro", Some(rate)), ("accel", Some(force))];
        imu::line(lines, (&id, Some(sample.time)), &vectors, None);
    }
}
