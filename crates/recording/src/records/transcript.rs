//! Contents of another container -> the records MCAP has for it. Pure.
//!
//! A stage of its own so that ULog and bags need no second way through the house: their readers write schemas,
//! channels and messages here, and what follows (definitions, workers, order, counting) cannot tell.

use super::op;
use crate::records::problem::Problems;
use std::fmt::Debug;

/// Records one after another, as they would lie in a chunk.
#[derive(Debug, Default)]
pub(crate) struct Transcript {
    pub(crate) bytes: Vec<u8>,
}

/// Outcome for the bytes that a reader of another container was given.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Step {
    /// Number of bytes that were used.
    Used(usize),
    /// Number of bytes that are needed; none were used.
    Need(usize),
}

/// Transcriber of a log that is read from its front to its end. Bytes come in any cut; what comes out depends on the
/// bytes alone.
pub(crate) trait Transcribe: Debug {
    /// Uses one record, or what stands in its place, of `ahead`: the bytes behind those used so far, and whether the log
    /// ends with them.
    fn step(&mut self, ahead: &[u8], is_end: bool, to: &mut Transcript) -> Step;

    /// Software or system that wrote the log, and what was wrong with it.
    fn finish(self: Box<Self>) -> (String, Problems);

    /// Bytes read, and bytes of records worked on, together.
    fn run(&self) -> usize {
        1 << 20
    }

    /// Steps until there are [`Transcribe::run`] bytes of records: how many bytes were used, and how many are needed to
    /// go on.
    fn steps(&mut self, ahead: &[u8], is_end: bool, to: &mut Transcript) -> (usize, usize) {
        let (mut rest, mut need) = (ahead, 1);
        while !rest.is_empty() && to.bytes.len() < self.run() {
            match self.step(rest, is_end, to) {
                Step::Used(n) => rest = rest.get(n..).unwrap_or(&[]),
                Step::Need(n) => {
                    need = n.max(rest.len() + 1);
                    break;
                }
            }
        }
        (ahead.len() - rest.len(), need)
    }
}

impl Transcript {
    /// A layout of payloads; `id` is not 0.
    pub(crate) fn schema(&mut self, id: u16, name: &str, encoding: &str, data: &[u8]) {
        self.record(op::SCHEMA, |body| {
            body.extend(id.to_le_bytes());
            blob(name.as_bytes(), body);
            blob(encoding.as_bytes(), body);
            blob(data, body);
        });
    }

    /// A stream of messages; a `schema_id` of 0 names none.
    pub(crate) fn channel(
        &mut self,
        id: u16,
        schema_id: u16,
        topic: &str,
        message_encoding: &str,
        metadata: &[(&str, &str)],
    ) {
        self.record(op::CHANNEL, |body| {
            body.extend(id.to_le_bytes());
            body.extend(schema_id.to_le_bytes());
            blob(topic.as_bytes(), body);
            blob(message_encoding.as_bytes(), body);
            let of = |(key, value): &(&str, &str)| 8 + key.len() + value.len();
            let length: usize = metadata.iter().map(of).sum();
            body.extend(length_of(length));
            for (key, value) in metadata {
                blob(key.as_bytes(), body);
                blob(value.as_bytes(), body);
            }
        });
    }

    /// A message, recorded and published at `time`.
    pub(crate) fn message(&mut self, channel: u16, sequence: u32, time: u64, data: &[u8]) {
        self.record(op::MESSAGE, |body| {
            body.extend(channel.to_le_bytes());
            body.extend(sequence.to_le_bytes());
            body.extend(time.to_le_bytes());
            body.extend(time.to_le_bytes());
            body.extend_from_slice(data);
        });
    }

    /// Stands for a message that cannot be read.
    pub(crate) fn unreadable(&mut self) {
        self.record(op::MESSAGE, |_| {});
    }

    /// The rest, of which `length` bytes are no record: whoever reads this stops here and says so.
    pub(crate) fn broken(&mut self, length: u64) {
        self.bytes.push(op::MESSAGE);
        self.bytes.extend(length.max(1).to_le_bytes());
    }

    fn record(&mut self, opcode: u8, write: impl FnOnce(&mut Vec<u8>)) {
        self.bytes.push(opcode);
        let length_at = self.bytes.len();
        self.bytes.extend([0; 8]);
        write(&mut self.bytes);
        let length = (self.bytes.len() - length_at - 8) as u64;
        if let Some(slot) = self.bytes.get_mut(length_at..length_at + 8) {
            slot.copy_from_slice(&length.to_le_bytes());
        }
    }
}

fn blob(bytes: &[u8], body: &mut Vec<u8>) {
    body.extend(length_of(bytes.len()));
    body.extend_from_slice(bytes);
}

/// Nothing that is written here comes near what a `u32` holds: records of the inputs are bounded.
fn length_of(n: usize) -> [u8; 4] {
    u32::try_from(n).unwrap_or(u32::MAX).to_le_bytes()
}
