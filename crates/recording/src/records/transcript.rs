//! Contents of another container -> the records MCAP has for it. Pure.
//!
//! A stage of its own so that ULog and bags need no second way through the house: their readers write schemas,
//! channels and messages here, and what follows (definitions, workers, order, counting) cannot tell.

use super::op;
use super::problem::Problems;
use super::record::{ChannelRecord, MessageRecord, SchemaRecord};

/// Bytes by which a format is known: the first line of a table is shorter.
pub const HEAD: usize = 4096;

/// Records one after another, as they would lie in a chunk.
#[derive(Debug, Default)]
pub(crate) struct Transcript {
    pub(crate) bytes: Vec<u8>,
}

/// Outcome for the bytes that a reader of another container was given.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum ReadProgress {
    /// Number of bytes that were used.
    Used(usize),
    /// Number of bytes that are needed; none were used.
    Need(usize),
}

/// Transcriber of a log that is read from its front to its end. Bytes come in any cut; what comes out depends on the
/// bytes alone.
pub(crate) trait Transcribe {
    /// Uses one record, or what stands in its place, of `ahead`: the bytes behind those used so far, and whether the log
    /// ends with them.
    fn step(&mut self, ahead: &[u8], is_end: bool, to: &mut Transcript) -> ReadProgress;

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
                ReadProgress::Used(n) => rest = rest.get(n..).unwrap_or(&[]),
                ReadProgress::Need(n) => {
                    need = n.max(rest.len() + 1);
                    break;
                }
            }
        }
        (ahead.len() - rest.len(), need)
    }
}

// By its name: the vtable of every one of them would hold code that prints all its fields.
impl std::fmt::Debug for dyn Transcribe {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Transcribe")
    }
}

impl Transcript {
    /// A layout of payloads; `id` is not 0.
    pub(crate) fn schema(&mut self, id: u16, name: &str, encoding: &str, data: &[u8]) {
        let schema = SchemaRecord {
            id,
            name,
            encoding,
            data,
        };
        schema.push(&mut self.bytes);
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
        let channel = ChannelRecord {
            id,
            schema_id,
            topic,
            message_encoding,
            metadata: metadata.to_vec(),
        };
        channel.push(&mut self.bytes);
    }

    /// A message, recorded and published at `time`.
    pub(crate) fn message(&mut self, channel: u16, sequence: u32, time: u64, data: &[u8]) {
        let head = MessageRecord::head(channel, sequence, (time, time), data.len());
        self.bytes.extend_from_slice(&head);
        self.bytes.extend_from_slice(data);
    }

    /// Stands for a message that cannot be read.
    pub(crate) fn unreadable(&mut self) {
        self.bytes.push(op::MESSAGE);
        self.bytes.extend([0; 8]);
    }

    /// The rest, of which `length` bytes are no record: whoever reads this stops here and says so.
    pub(crate) fn broken(&mut self, length: u64) {
        self.bytes.push(op::MESSAGE);
        self.bytes.extend(length.max(1).to_le_bytes());
    }
}
