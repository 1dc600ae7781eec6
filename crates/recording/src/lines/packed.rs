//! Packed objects between the lines -> what a line of each would say. Pure.
//!
//! What a daemon is sent, or sends, may be kept as it is and replayed: the lines `PACKED` say what the numbers mean.

use crate::decode::packed::{self, Object};
use crate::decode::{Class, Decoded, GyroUnit, Line, Undecodable};
use serde::Deserialize;
use std::collections::BTreeMap;
use strapd_attitude::record::{Nanos, RawSample};

/// Numbers that are remembered: as many as a daemon may have sensors.
const MOST: usize = 100_000;

/// What the numbers of packed streams mean.
#[derive(Debug, Default)]
pub(super) struct Numbers(BTreeMap<u32, Line>);

#[derive(Deserialize)]
struct Number {
    stream: u32,
}

impl Numbers {
    /// From now on what `line`, which was read from these bytes, says of a number holds, if it does.
    pub(super) fn learn(&mut self, line: &Line, bytes: &[u8]) {
        if !matches!(&line.class, Class::Other(class) if class == "PACKED") {
            return;
        }
        let Ok(Number { stream }) = serde_json::from_slice(bytes) else {
            return;
        };
        if self.0.len() < MOST || self.0.contains_key(&stream) {
            let head = Line {
                class: Class::Rate,
                id: line.id.clone(),
                sample_kind: line.sample_kind,
                // That of a RATE line that does not say.
                gyro_unit: line.gyro_unit.or(Some(GyroUnit::Rad)),
                ..Line::default()
            };
            self.0.insert(stream, head);
        }
    }

    /// What the line would hold that says the same.
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
                let sample = RawSample {
                    header: Some(attitude.stamp),
                    gyro: packed::some_vector(attitude.rate),
                    orientation: Some(attitude.q),
                    ..RawSample::default()
                };
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
