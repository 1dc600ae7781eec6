//! Messages -> the bytes of an MCAP file. Pure (into memory).
//!
//! A stage of its own because one place decides what makes a fixture deterministic: the library name is
//! ours and not the `mcap` crate's, the compressor runs on this thread, maps are ordered.

use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, McapResult, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::io::Cursor;

/// Storage of messages.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Storage {
    /// Chunks of about 64 KiB, so that a short recording has several and a cut or a flipped bit leaves some.
    Chunks(Option<Compression>),
    /// Messages straight in the data section.
    NoChunks,
}

/// An MCAP file being written to memory.
pub(crate) struct Log {
    writer: Writer<Cursor<Vec<u8>>>,
    sequences: BTreeMap<u16, u32>,
}

impl Log {
    /// An empty log of the given profile (`ros2`, `ros1` or none).
    pub(crate) fn new(profile: &str, storage: Storage) -> McapResult<Log> {
        let options = WriteOptions::new()
            .profile(profile)
            .library("strapd make_fixtures")
            .compression_threads(0)
            .chunk_size(Some(64 * 1024));
        let options = match storage {
            Storage::Chunks(compression) => options.compression(compression),
            Storage::NoChunks => options.use_chunks(false),
        };
        Ok(Log {
            writer: options.create(Cursor::new(Vec::new()))?,
            sequences: BTreeMap::new(),
        })
    }

    /// Adds a topic; `schema` is name, encoding, text.
    pub(crate) fn topic(
        &mut self,
        topic: &str,
        message_encoding: &str,
        schema: (&str, &str, &str),
        metadata: &[(&str, &str)],
    ) -> McapResult<u16> {
        let schema_id = self
            .writer
            .add_schema(schema.0, schema.1, schema.2.as_bytes())?;
        let metadata = metadata
            .iter()
            .map(|&(key, value)| (key.to_owned(), value.to_owned()))
            .collect();
        self.writer
            .add_channel(schema_id, topic, message_encoding, &metadata)
    }

    /// Appends a message that was received and published at `log_nanos`.
    pub(crate) fn write(&mut self, channel: u16, log_nanos: i64, payload: &[u8]) -> McapResult<()> {
        let sequence = self.sequences.entry(channel).or_insert(0);
        let header = MessageHeader {
            channel_id: channel,
            sequence: *sequence,
            log_time: log_nanos.unsigned_abs(),
            publish_time: log_nanos.unsigned_abs(),
        };
        *sequence += 1;
        self.writer.write_to_known_channel(&header, payload)
    }

    /// Ends the file with a metadata record that says where the data come from.
    pub(crate) fn finish(mut self, origin: &[(&str, &str)]) -> McapResult<Vec<u8>> {
        let metadata = origin
            .iter()
            .map(|&(key, value)| (key.to_owned(), value.to_owned()))
            .collect();
        self.writer.write_metadata(&Metadata {
            name: "origin".to_owned(),
            metadata,
        })?;
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner())
    }
}
