//! A batch of samples -> bytes, in the form of its output. Pure.
//!
//! A stage of its own because this is the part that runs on every thread at once: what a batch
//! becomes depends on nothing but the batch.

use super::Options;
use super::batch::Batch;
use super::json::Profile;
use super::mcap::chunk::Chunk;
use super::mcap::file::McapFile;
use super::stream::{Provenance, Stream};
use std::io;

/// Precision of the numbers of a table in Parquet.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Precision {
    /// Every bit.
    #[default]
    Double,
    /// 24 bits: attitudes to some 1e-7 rad, in half the size.
    Single,
}

/// Facts of a run that a form begins with.
#[derive(Debug)]
pub(super) struct Opening<'a> {
    pub(super) options: Options,
    pub(super) profile: Profile,
    pub(super) streams: &'a [Stream],
    pub(super) provenance: &'a Provenance,
}

/// Form in which batches become bytes.
pub(super) trait Form: Send + Sync {
    /// Makes bytes of a batch, whose text is empty. The parallel part: nothing here depends on any other batch.
    fn encode(&self, slot: &mut Slot);

    /// Bytes that an encoded batch puts into the output, in the order of the batches.
    ///
    /// # Errors
    /// They cannot be made.
    fn in_order<'s>(&mut self, slot: &'s mut Slot) -> io::Result<[&'s [u8]; 3]> {
        Ok([&slot.text, &[], &[]])
    }

    /// Bytes behind the last batch.
    ///
    /// # Errors
    /// They cannot be made.
    fn closing(&mut self) -> io::Result<Vec<u8>> {
        Ok(Vec::new())
    }

    /// Whether nothing of this stream has a place.
    fn leaves_out(&self, _: &Stream) -> bool {
        false
    }

    /// Counts bytes that were written.
    fn account(&mut self, _: &[u8]) {}

    /// Messages written, where these are others than its samples.
    fn messages(&self) -> Option<u64> {
        None
    }

    /// The MCAP it is, which takes records of another.
    fn mcap(&mut self) -> Option<&mut McapFile> {
        None
    }
}

// By its name: the vtable of every one of them would hold code that prints all its fields.
impl std::fmt::Debug for dyn Form {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Form")
    }
}

/// One batch on its way into bytes.
#[derive(Debug, Default)]
pub(super) struct Slot {
    /// Empty when the chunk holds copied messages already.
    pub(super) batch: Batch,
    pub(super) chunk: Chunk,
    pub(super) text: Vec<u8>,
    pub(super) outcome: Option<io::Error>,
}
