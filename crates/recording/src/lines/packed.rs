//! Packed objects between the lines -> what a line of each would say. Pure.
//!
//! What a daemon is sent, or sends, may be kept as it is and replayed: the lines `PACKED` say what the numbers mean.

use crate::decode::packed::{self, Object};
use crate::decode::{Class, Decoded, Line, Undecodable};
use std::collections::BTreeMap;
use strapd_attitude::record::{Nanos, RawSample};

/// Numbers that are remembered: as many as a daemon may have sensors.
const MOST: usize = 100_000;

/// Meaning of the numbers of packed streams.
#[derive(Debug, Default)]
pub(super) struct Numbers(BTreeMap<u32, Line>);

impl Numbers {
    /// Learns from a line that was read from these bytes what a number holds from now on.
    ///
    /// # Errors
    /// It is about one, and does not say which or what; there are too many.
    pub(super) fn learn(&mut self, line: &Line, bytes: &[u8]) -> Result<(), Undecodable> {
        if !matches!(&line.class, Class::Other(class) if class == "PACKED") {
            return Ok(());
        }
        let (number, head) =
            packed::binding(bytes).map_err(|why| Undecodable::Unbound(Box::new(why)))?;
        if self.0.len() >= MOST && !self.0.contains_key(&number) {
            return Err(Undecodable::TooManyStreams { limit: MOST as u64 });
        }
        self.0.insert(number, head);
        Ok(())
    }

    /// Line that would hold the same.
    ///
    /// # Errors
    /// It is no packed object, or no line has said what its number means.
    pub(super) fn decode(
        &self,
        object: &[u8],
        samples: &mut Vec<RawSample>,
    ) -> Result<Line, Undecodable> {
        let read = packed::read(object, Nanos(0)).map_err(Undecodable::Packed)?;
        let (number, class, seq, sample) = match read {
            Object::Rate {
                stream,
                seq,
                sample,
            } => (stream, Class::Rate, seq, sample),
            Object::Att { stream, attitude } => {
                let sample = attitude.as_sample(Nanos(0));
                (stream, Class::Att, Some(attitude.seq), sample)
            }
        };
        let head = self.0.get(&number);
        let head = head.ok_or(Undecodable::UnknownStream { number })?.clone();
        samples.push(sample);
        Ok(Line {
            class,
            seq,
            decoded: Decoded {
                samples: 1,
                ..Decoded::default()
            },
            ..head
        })
    }
}
