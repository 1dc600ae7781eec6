//! Channels and sealed chunks -> the frame of an MCAP file around them. Pure.
//!
//! Keeps what the summary at the end needs. Schemas and channels stand outside the chunks, before
//! the first message that uses them: a damaged or lost chunk takes only its own messages with it.

use super::chunk::{Chunk, Compression};
use super::record::{
    ATTACHMENT, ATTACHMENT_INDEX, Body, CHANNEL, CHUNK_INDEX, Channel, DATA_END, FOOTER, HEADER,
    MAGIC, METADATA, METADATA_INDEX, PREFIX, SCHEMA, STATISTICS, SUMMARY_OFFSET, Schema,
};

use std::collections::BTreeMap;

/// A file carried inside another log, for a copy of it.
#[derive(Clone, Copy, Debug)]
pub struct Attachment<'a> {
    /// Time at which it was recorded, ns.
    pub log_time: u64,
    /// Time at which it was made, ns.
    pub create_time: u64,
    /// Name.
    pub name: &'a str,
    /// Media type.
    pub media_type: &'a str,
    /// Bytes.
    pub data: &'a [u8],
}

/// The bookkeeping of a file being written.
#[derive(Debug, Default)]
pub(in crate::sink) struct McapFile {
    offset: u64,
    crc: crc32fast::Hasher,
    schemas: Vec<Schema>,
    /// Places in `schemas` by CRC-32 and length of the text: a log may have thousands, and each is asked for.
    schemas_by_text: BTreeMap<(u32, usize), Vec<usize>>,
    channels: Vec<Channel>,
    messages: BTreeMap<u16, u64>,
    times: Option<(u64, u64)>,
    chunks: u32,
    /// Chunk index records, ready for the summary.
    chunk_index: Vec<u8>,
    attachments: u32,
    attachment_index: Vec<u8>,
    metadata: u32,
    metadata_index: Vec<u8>,
}

impl McapFile {
    /// Counts bytes that have been handed to the file.
    pub(in crate::sink) fn account(&mut self, bytes: &[u8]) {
        self.offset += bytes.len() as u64;
        self.crc.update(bytes);
    }

    /// Messages so far.
    pub(in crate::sink) fn messages(&self) -> u64 {
        self.messages.values().sum()
    }

    /// The magic and the header.
    pub(in crate::sink) fn push_header(&self, out: &mut Vec<u8>, profile: &str) {
        out.extend_from_slice(&MAGIC);
        Body::begin(out, HEADER)
            .string(profile)
            .string(concat!("strapd ", env!("CARGO_PKG_VERSION")))
            .end();
    }

    /// A metadata record, `out` being what is written next.
    pub(in crate::sink) fn push_metadata(
        &mut self,
        out: &mut Vec<u8>,
        name: &str,
        map: &BTreeMap<String, String>,
    ) {
        let at = out.len();
        Body::begin(out, METADATA).string(name).strings(map).end();
        self.metadata = self.metadata.saturating_add(1);
        Body::begin(&mut self.metadata_index, METADATA_INDEX)
            .u64(self.offset + at as u64)
            .u64((out.len() - at) as u64)
            .string(name)
            .end();
    }

    /// An attachment record, `out` being what is written next.
    pub(in crate::sink) fn push_attachment(
        &mut self,
        out: &mut Vec<u8>,
        attachment: &Attachment<'_>,
    ) {
        let at = out.len();
        // At once: growing would hold it twice.
        out.reserve(attachment.data.len() + 1024);
        Body::begin(out, ATTACHMENT)
            .u64(attachment.log_time)
            .u64(attachment.create_time)
            .string(attachment.name)
            .string(attachment.media_type)
            .u64(attachment.data.len() as u64)
            .bytes(attachment.data)
            .u32(0)
            .end();
        // The checksum covers the body up to itself.
        let covered = out.len() - 4;
        let crc = crc32fast::hash(&out[at + PREFIX..covered]);
        out[covered..].copy_from_slice(&crc.to_le_bytes());
        self.attachments = self.attachments.saturating_add(1);
        Body::begin(&mut self.attachment_index, ATTACHMENT_INDEX)
            .u64(self.offset + at as u64)
            .u64((out.len() - at) as u64)
            .u64(attachment.log_time)
            .u64(attachment.create_time)
            .u64(attachment.data.len() as u64)
            .string(attachment.name)
            .string(attachment.media_type)
            .end();
    }

    /// The identifier of a schema, with its record in `out` if it is new. `None`: no more fit.
    pub(super) fn schema(
        &mut self,
        out: &mut Vec<u8>,
        name: &str,
        encoding: &str,
        text: &[u8],
    ) -> Option<u16> {
        let key = (crc32fast::hash(text), text.len());
        let alike = self.schemas_by_text.entry(key).or_default();
        if let Some(known) = alike
            .iter()
            .filter_map(|at| self.schemas.get(*at))
            .find(|s| s.name == name && s.encoding == encoding && s.text == text)
        {
            return Some(known.id);
        }
        // Zero means "no schema".
        let id = u16::try_from(self.schemas.len() + 1).ok()?;
        let schema = Schema {
            id,
            name: name.to_owned(),
            encoding: encoding.to_owned(),
            text: text.to_vec(),
        };
        schema.push(out);
        alike.push(self.schemas.len());
        self.schemas.push(schema);
        Some(id)
    }

    /// A new channel's identifier, its record in `out`. `None`: no more fit.
    pub(super) fn channel(
        &mut self,
        out: &mut Vec<u8>,
        schema: u16,
        topic: &str,
        encoding: &str,
        metadata: BTreeMap<String, String>,
    ) -> Option<u16> {
        let id = u16::try_from(self.channels.len() + 1).ok()?;
        let channel = Channel {
            id,
            schema,
            topic: topic.to_owned(),
            encoding: encoding.to_owned(),
            metadata,
        };
        channel.push(out);
        self.channels.push(channel);
        Some(id)
    }

    /// Books a sealed chunk that begins at the present offset.
    pub(in crate::sink) fn book(&mut self, chunk: &Chunk, compression: Compression) {
        let sealed = chunk.sealed();
        let [head, data, tail] = chunk.parts();
        let (start, end) = chunk.times();
        let record_len = (head.len() + data.len()) as u64;
        let behind = self.offset + record_len;
        let offsets: BTreeMap<u16, u64> = sealed
            .index
            .iter()
            .map(|(channel, at, _)| (*channel, behind + at))
            .collect();
        Body::begin(&mut self.chunk_index, CHUNK_INDEX)
            .u64(start)
            .u64(end)
            .u64(self.offset)
            .u64(record_len)
            .numbers(&offsets)
            .u64(tail.len() as u64)
            .string(match compression {
                Compression::None => "",
                other => other.name(),
            })
            .u64(data.len() as u64)
            .u64(chunk.plain_len() as u64)
            .end();
        self.chunks = self.chunks.saturating_add(1);
        for (channel, _, messages) in &sealed.index {
            *self.messages.entry(*channel).or_default() += messages;
        }
        self.times = Some(match self.times {
            Some((first, last)) => (first.min(start), last.max(end)),
            None => (start, end),
        });
    }

    /// Everything behind the last chunk: the end of the data, the summary, the footer.
    pub(in crate::sink) fn closing(&self) -> Vec<u8> {
        let mut out = Vec::new();
        Body::begin(&mut out, DATA_END)
            .u32(self.crc.clone().finalize())
            .end();
        let summary = out.len();
        let mut groups: Vec<(u8, usize, usize)> = Vec::new();
        let mut group = |out: &mut Vec<u8>, opcode: u8, write: &dyn Fn(&mut Vec<u8>)| {
            let at = out.len();
            write(out);
            if out.len() > at {
                groups.push((opcode, at, out.len() - at));
            }
        };
        group(&mut out, SCHEMA, &|out| {
            self.schemas.iter().for_each(|s| s.push(out));
        });
        group(&mut out, CHANNEL, &|out| {
            self.channels.iter().for_each(|c| c.push(out));
        });
        group(&mut out, STATISTICS, &|out| self.push_statistics(out));
        group(&mut out, CHUNK_INDEX, &|out| {
            out.extend_from_slice(&self.chunk_index);
        });
        group(&mut out, ATTACHMENT_INDEX, &|out| {
            out.extend_from_slice(&self.attachment_index);
        });
        group(&mut out, METADATA_INDEX, &|out| {
            out.extend_from_slice(&self.metadata_index);
        });

        let offsets = out.len();
        let absolute = |at: usize| self.offset + at as u64;
        for (opcode, at, length) in groups {
            Body::begin(&mut out, SUMMARY_OFFSET)
                .bytes(&[opcode])
                .u64(absolute(at))
                .u64(length as u64)
                .end();
        }
        // The summary's checksum covers the footer up to itself: length and both offsets included.
        let footer = out.len();
        Body::begin(&mut out, FOOTER)
            .u64(absolute(summary))
            .u64(absolute(offsets))
            .u32(0)
            .end();
        let covered = footer + PREFIX + 16;
        let crc = crc32fast::hash(&out[summary..covered]);
        out.truncate(covered);
        out.extend_from_slice(&crc.to_le_bytes());
        out.extend_from_slice(&MAGIC);
        out
    }

    /// The shortest end there can be, without a summary: for a disk that has no room for one.
    pub(super) fn shortest_closing() -> Vec<u8> {
        let mut out = Vec::new();
        Body::begin(&mut out, DATA_END).u32(0).end();
        Body::begin(&mut out, FOOTER).u64(0).u64(0).u32(0).end();
        out.extend_from_slice(&MAGIC);
        out
    }

    fn push_statistics(&self, out: &mut Vec<u8>) {
        let (start, end) = self.times.unwrap_or_default();
        Body::begin(out, STATISTICS)
            .u64(self.messages())
            .u16(self.schemas.len() as u16)
            .u32(self.channels.len() as u32)
            .u32(self.attachments)
            .u32(self.metadata)
            .u32(self.chunks)
            .u64(start)
            .u64(end)
            .numbers(&self.messages)
            .end();
    }
}
