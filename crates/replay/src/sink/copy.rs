//! Records of another MCAP -> the output, unchanged. I/O.
//!
//! A stage of its own because nothing here is a sample: `--copy-input` and `recover` carry channels,
//! messages, attachments and metadata over as they were found. Messages keep their order; a chunk of
//! them is closed at a fixed size, so the bytes depend on the calls alone.

use super::mcap::file::McapFile;
use super::mcap::{self, Attachment, InputChannel, InputMessage, Mcap};
use super::output::{Flow, Output};
use super::{MAX_BATCHES, Options, Sink, Target};
use crate::error::{Error, Result};
use rayon::ThreadPool;
use std::collections::BTreeMap;
use std::path::PathBuf;
use strapd_attitude::diagnostic::Diagnostic;

/// Uncompressed size at which a chunk of copied messages is closed.
const COPY_CHUNK_BYTES: usize = 1 << 20;

/// Copied messages can be large; so many bytes of them are written without waiting for more.
pub(super) const MAX_QUEUED_COPIES: usize = MAX_BATCHES * COPY_CHUNK_BYTES;

/// A channel declared by [`Sink::copy_channel`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CopiedChannel(u16);

impl Sink {
    /// Opens `target` for nothing but a copy of another MCAP, to begin with [`Sink::copy_header`].
    ///
    /// # Errors
    /// As [`Sink::create`]; [`Error::Usage`] when the target is no MCAP.
    pub fn create_copy(target: &Target, inputs: &[PathBuf], options: Options) -> Result<Sink> {
        if target.format() != Some(super::Format::Mcap) {
            return Err(Error::usage(
                Diagnostic::new("a copy of an MCAP is an MCAP")
                    .help("give -o a name that ends in .mcap"),
            ));
        }
        let output = Output::open(target, inputs, options.force)?;
        let mcap = Mcap {
            compression: options.compression,
            ..Mcap::default()
        };
        Sink::begin(output, Some(Box::new(mcap)), &[], &[])
    }

    /// Writes the head of the file, with the profile of the other.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn copy_header(&mut self, profile: &str) -> Result<Flow> {
        let mut head = Vec::new();
        if let Some(file) = self.mcap() {
            file.push_header(&mut head, profile);
        }
        self.put(&head)
    }

    /// Declares a channel whose messages [`Sink::copy`] will bring. Anything but an MCAP has no place
    /// for them and ignores both.
    ///
    /// # Errors
    /// [`Error::Write`]; [`Error::Usage`] when there are more than MCAP can number.
    pub fn copy_channel(&mut self, channel: &InputChannel<'_>) -> Result<CopiedChannel> {
        let is_open = self.is_open()?;
        let Some(file) = self.mcap().filter(|_| is_open) else {
            return Ok(CopiedChannel(0));
        };
        // The declaration is written at once, so it stands before every chunk that needs it.
        let mut records = Vec::new();
        let id = mcap::declare_copy(file, &mut records, channel)?;
        let _ = self.put(&records)?;
        Ok(CopiedChannel(id))
    }

    /// Copies a message of the input.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn copy(
        &mut self,
        channel: CopiedChannel,
        message: &InputMessage<'_>,
        pool: &ThreadPool,
    ) -> Result<Flow> {
        if self.mcap().is_none() {
            return Ok(Flow::Continue);
        }
        if !self.is_open()? {
            return Ok(Flow::Closed);
        }
        mcap::copy(&mut self.copies, channel.0, message);
        if self.copies.plain_len() >= COPY_CHUNK_BYTES {
            self.queue_copies();
            return self.make_room(pool);
        }
        Ok(Flow::Continue)
    }

    /// Copies an attachment behind what has been copied so far. Anything but an MCAP has no place for it.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn copy_attachment(
        &mut self,
        attachment: &Attachment<'_>,
        pool: &ThreadPool,
    ) -> Result<Flow> {
        self.copy_record(pool, |file, out| file.push_attachment(out, attachment))
    }

    /// Copies a metadata record, likewise.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn copy_metadata(
        &mut self,
        name: &str,
        map: &BTreeMap<String, String>,
        pool: &ThreadPool,
    ) -> Result<Flow> {
        self.copy_record(pool, |file, out| file.push_metadata(out, name, map))
    }

    fn copy_record(
        &mut self,
        pool: &ThreadPool,
        push: impl FnOnce(&mut McapFile, &mut Vec<u8>),
    ) -> Result<Flow> {
        if self.mcap().is_none() {
            return Ok(Flow::Continue);
        }
        if self.flush(pool)? == Flow::Closed {
            return Ok(Flow::Closed);
        }
        let mut records = Vec::new();
        if let Some(file) = self.mcap() {
            push(file, &mut records);
        }
        self.put(&records)
    }

    fn mcap(&mut self) -> Option<&mut McapFile> {
        self.form.as_mut()?.mcap()
    }

    /// Moves the copied messages into the queue.
    pub(super) fn queue_copies(&mut self) {
        let full = std::mem::take(&mut self.copies);
        self.queued_copies += full.plain_len();
        let slot = self.next_slot();
        slot.batch.samples.clear();
        slot.batch.raw.clear();
        let mut empty = std::mem::replace(&mut slot.chunk, full);
        empty.clear();
        self.copies = empty;
    }
}
