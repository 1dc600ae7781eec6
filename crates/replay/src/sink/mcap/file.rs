//! Channels and sealed chunks -> the frame of an MCAP file around them. Pure.
//!
//! Keeps what the summary at the end needs. Schemas and channels stand outside the chunks, before
//! the first message that uses them: a damaged or lost chunk takes only its own messages with it.

use super::chunk::{Chunk, Compression};
use std::collections::BTreeMap;
use std::ops::Range;
use strapd_recording::mcap::{
    AttachmentIndex, AttachmentRecord, Carried, ChannelRecord, ChunkIndex, DataEnd, Footer, HEAD,
    HeaderRecord, MAGIC, MetadataIndex, MetadataRecord, SchemaRecord, Statistics, SummaryOffset,
    op,
};

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

fn pairs(map: &BTreeMap<String, String>) -> Vec<(&str, &str)> {
    map.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect()
}

/// The bookkeeping of a file being written.
#[derive(Debug, Default)]
pub(in crate::sink) struct McapFile {
    offset: u64,
    crc: crc32fast::Hasher,
    /// Schema records as they are in the file: the summary has them again.
    schemas: Vec<u8>,
    schema_count: u16,
    /// Ids of schemas and the places of their fields behind it, by the CRC-32 of these: a log may have thousands, and
    /// each is asked for.
    schemas_by_fields: BTreeMap<u32, Vec<(u16, Range<usize>)>>,
    /// Channel records, likewise.
    channels: Vec<u8>,
    channel_count: u16,
    messages: BTreeMap<u16, u64>,
    times: Option<(u64, u64)>,
    chunks: u32,
    /// Chunk index records, ready for the summary.
    chunk_index: Vec<u8>,
    attachments: u32,
    attachment_index: Vec<u8>,
    metadata: u32,
    metadata_index: Vec<u8>,
    /// Channel of our own transforms, in CDR.
    pub(super) transform_channel: Option<u16>,
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
        let header = HeaderRecord {
            profile,
            library: concat!("strapd ", env!("CARGO_PKG_VERSION")),
        };
        header.push(out);
    }

    /// A metadata record, `out` being what is written next.
    pub(in crate::sink) fn push_metadata(
        &mut self,
        out: &mut Vec<u8>,
        name: &str,
        map: &BTreeMap<String, String>,
    ) {
        let at = out.len();
        let metadata = pairs(map);
        MetadataRecord { name, metadata }.push(out);
        self.metadata = self.metadata.saturating_add(1);
        let index = MetadataIndex {
            offset: self.offset + at as u64,
            length: (out.len() - at) as u64,
            name,
        };
        index.push(&mut self.metadata_index);
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
        let record = AttachmentRecord {
            log_time: attachment.log_time,
            create_time: attachment.create_time,
            name: attachment.name,
            media_type: attachment.media_type,
            data: Carried(attachment.data),
            crc: 0,
        };
        record.push(out);
        // The checksum covers the body up to itself.
        let covered = out.len() - 4;
        let crc = crc32fast::hash(&out[at + HEAD..covered]);
        out[covered..].copy_from_slice(&crc.to_le_bytes());
        self.attachments = self.attachments.saturating_add(1);
        let index = AttachmentIndex {
            offset: self.offset + at as u64,
            length: (out.len() - at) as u64,
            log_time: attachment.log_time,
            create_time: attachment.create_time,
            data_size: attachment.data.len() as u64,
            name: attachment.name,
            media_type: attachment.media_type,
        };
        index.push(&mut self.attachment_index);
    }

    /// The identifier of a schema, with its record in `out` if it is new. `None`: no more fit.
    pub(super) fn schema(
        &mut self,
        out: &mut Vec<u8>,
        name: &str,
        encoding: &str,
        text: &[u8],
    ) -> Option<u16> {
        // Zero means "no schema".
        let id = self.schema_count.saturating_add(1);
        let start = self.schemas.len();
        let record = SchemaRecord {
            id,
            name,
            encoding,
            data: text,
        };
        record.push(&mut self.schemas);
        let fields = start + HEAD + size_of_val(&id)..self.schemas.len();
        let fields_of = |at: &Range<usize>| self.schemas.get(at.clone());
        let own = fields_of(&fields)?;
        let alike = self.schemas_by_fields.entry(crc32fast::hash(own));
        let alike = alike.or_default();
        let known = alike.iter().find(|(_, at)| fields_of(at) == Some(own));
        if known.is_some() || id == self.schema_count {
            self.schemas.truncate(start);
            return known.map(|(id, _)| *id);
        }
        alike.push((id, fields));
        out.extend_from_slice(&self.schemas[start..]);
        self.schema_count = id;
        Some(id)
    }

    /// A new channel's identifier, its record in `out`. `None`: no more fit.
    pub(super) fn channel(
        &mut self,
        out: &mut Vec<u8>,
        schema: u16,
        topic: &str,
        encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Option<u16> {
        let id = self.channel_count.checked_add(1)?;
        let start = self.channels.len();
        let record = ChannelRecord {
            id,
            schema_id: schema,
            topic,
            message_encoding: encoding,
            metadata: pairs(metadata),
        };
        record.push(&mut self.channels);
        out.extend_from_slice(&self.channels[start..]);
        self.channel_count = id;
        Some(id)
    }

    /// Books a sealed chunk that begins at the present offset.
    pub(in crate::sink) fn book(&mut self, chunk: &Chunk, compression: Compression) {
        let sealed = chunk.sealed();
        let [head, data, tail] = chunk.parts();
        let (start, end) = chunk.times();
        let record_len = (head.len() + data.len()) as u64;
        let behind = self.offset + record_len;
        let offsets = sealed.index.iter();
        let index = ChunkIndex {
            message_start_time: start,
            message_end_time: end,
            chunk_start_offset: self.offset,
            chunk_length: record_len,
            message_index_offsets: offsets.map(|(id, at, _)| (*id, behind + at)).collect(),
            message_index_length: tail.len() as u64,
            compression: compression.in_file(),
            compressed_size: data.len() as u64,
            uncompressed_size: chunk.plain_len() as u64,
        };
        index.push(&mut self.chunk_index);
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
        let data_section_crc = self.crc.clone().finalize();
        DataEnd { data_section_crc }.push(&mut out);
        let summary = out.len();
        let mut groups: Vec<(u8, usize, usize)> = Vec::new();
        let mut group = |out: &mut Vec<u8>, opcode: u8, write: &dyn Fn(&mut Vec<u8>)| {
            let at = out.len();
            write(out);
            if out.len() > at {
                groups.push((opcode, at, out.len() - at));
            }
        };
        group(&mut out, op::SCHEMA, &|out| {
            out.extend_from_slice(&self.schemas);
        });
        group(&mut out, op::CHANNEL, &|out| {
            out.extend_from_slice(&self.channels);
        });
        group(&mut out, op::STATISTICS, &|out| self.push_statistics(out));
        group(&mut out, op::CHUNK_INDEX, &|out| {
            out.extend_from_slice(&self.chunk_index);
        });
        group(&mut out, op::ATTACHMENT_INDEX, &|out| {
            out.extend_from_slice(&self.attachment_index);
        });
        group(&mut out, op::METADATA_INDEX, &|out| {
            out.extend_from_slice(&self.metadata_index);
        });

        let offsets = out.len();
        let absolute = |at: usize| self.offset + at as u64;
        for (group_opcode, at, length) in groups {
            let offset = SummaryOffset {
                group_opcode,
                group_start: absolute(at),
                group_length: length as u64,
            };
            offset.push(&mut out);
        }
        // The summary's checksum covers the footer up to itself: length and both offsets included.
        let footer = Footer {
            summary_start: absolute(summary),
            summary_offset_start: absolute(offsets),
            summary_crc: 0,
        };
        footer.push(&mut out);
        let covered = out.len() - 4;
        let crc = crc32fast::hash(&out[summary..covered]);
        out.truncate(covered);
        out.extend_from_slice(&crc.to_le_bytes());
        out.extend_from_slice(&MAGIC);
        out
    }

    /// The shortest end there can be, without a summary: for a disk that has no room for one.
    pub(super) fn shortest_closing() -> Vec<u8> {
        let mut out = Vec::new();
        let data_section_crc = 0;
        DataEnd { data_section_crc }.push(&mut out);
        let footer = Footer {
            summary_start: 0,
            summary_offset_start: 0,
            summary_crc: 0,
        };
        footer.push(&mut out);
        out.extend_from_slice(&MAGIC);
        out
    }

    fn push_statistics(&self, out: &mut Vec<u8>) {
        let (start, end) = self.times.unwrap_or_default();
        let statistics = Statistics {
            message_count: self.messages(),
            schema_count: self.schema_count,
            channel_count: self.channel_count.into(),
            attachment_count: self.attachments,
            metadata_count: self.metadata,
            chunk_count: self.chunks,
            message_start_time: start,
            message_end_time: end,
            channel_message_counts: self.messages.iter().map(|(id, n)| (*id, *n)).collect(),
        };
        statistics.push(out);
    }
}
