//! The body of one record -> its fields, borrowed. Pure.
//!
//! A stage of its own because layouts are facts of the MCAP specification and nothing else
//! (<https://mcap.dev/spec>): what a field is worth is judged by the callers. Bytes after the
//! last known field are ignored, as the specification asks.

use crate::records::Bytes;

pub use crate::records::{MAGIC, op};

/// One record, borrowed from the bytes it was read from. Times are nanoseconds, offsets and
/// lengths bytes; field names are the specification's.
#[derive(Clone, PartialEq, Debug)]
#[allow(missing_docs)]
pub enum Record<'a> {
    Header {
        profile: &'a str,
        library: &'a str,
    },
    Footer(Footer),
    Schema(SchemaRecord<'a>),
    Channel(ChannelRecord<'a>),
    Message(MessageRecord<'a>),
    Chunk(ChunkHead<'a>),
    MessageIndex {
        channel_id: u16,
        entries: Vec<(u64, u64)>,
    },
    ChunkIndex(ChunkIndex<'a>),
    Attachment(AttachmentRecord<'a>),
    AttachmentIndex(AttachmentIndex<'a>),
    Statistics(Statistics),
    Metadata {
        name: &'a str,
        metadata: Vec<(&'a str, &'a str)>,
    },
    MetadataIndex {
        offset: u64,
        length: u64,
        name: &'a str,
    },
    SummaryOffset {
        group_opcode: u8,
        group_start: u64,
        group_length: u64,
    },
    DataEnd {
        data_section_crc: u32,
    },
    Unknown {
        opcode: u8,
        data: &'a [u8],
    },
}

/// Place of the summary.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub struct Footer {
    pub summary_start: u64,
    pub summary_offset_start: u64,
    pub summary_crc: u32,
}

/// Layout of the payloads of a channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub struct SchemaRecord<'a> {
    pub id: u16,
    pub name: &'a str,
    pub encoding: &'a str,
    pub data: &'a [u8],
}

/// A stream of messages.
#[derive(Clone, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub struct ChannelRecord<'a> {
    pub id: u16,
    pub schema_id: u16,
    pub topic: &'a str,
    pub message_encoding: &'a str,
    pub metadata: Vec<(&'a str, &'a str)>,
}

/// One message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub struct MessageRecord<'a> {
    pub channel_id: u16,
    pub sequence: u32,
    pub log_time: u64,
    pub publish_time: u64,
    pub data: &'a [u8],
}

/// Fields before the records of a chunk.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub struct ChunkHead<'a> {
    pub message_start_time: u64,
    pub message_end_time: u64,
    pub uncompressed_size: u64,
    /// CRC-32 of the uncompressed records; 0 where the writer made none.
    pub uncompressed_crc: u32,
    pub compression: &'a str,
    pub compressed_size: u64,
}

/// The summary's word about one chunk.
#[derive(Clone, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub struct ChunkIndex<'a> {
    pub message_start_time: u64,
    pub message_end_time: u64,
    pub chunk_start_offset: u64,
    pub chunk_length: u64,
    pub message_index_offsets: Vec<(u16, u64)>,
    pub message_index_length: u64,
    pub compression: &'a str,
    pub compressed_size: u64,
    pub uncompressed_size: u64,
}

/// A file carried inside the log.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub struct AttachmentRecord<'a> {
    pub log_time: u64,
    pub create_time: u64,
    pub name: &'a str,
    pub media_type: &'a str,
    pub data: &'a [u8],
    pub crc: u32,
}

/// The summary's word about one attachment.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub struct AttachmentIndex<'a> {
    pub offset: u64,
    pub length: u64,
    pub log_time: u64,
    pub create_time: u64,
    pub data_size: u64,
    pub name: &'a str,
    pub media_type: &'a str,
}

/// The summary's counts.
#[derive(Clone, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub struct Statistics {
    pub message_count: u64,
    pub schema_count: u16,
    pub channel_count: u32,
    pub attachment_count: u32,
    pub metadata_count: u32,
    pub chunk_count: u32,
    pub message_start_time: u64,
    pub message_end_time: u64,
    pub channel_message_counts: Vec<(u16, u64)>,
}

impl<'a> Record<'a> {
    /// The fields of a record, or `None` where the body is too short, its lengths do not add up, or it has
    /// more than 65,536 pairs of text.
    #[must_use]
    pub fn parse(opcode: u8, body: &'a [u8]) -> Option<Record<'a>> {
        let mut b = Bytes::new(body);
        Some(match opcode {
            op::HEADER => Record::Header {
                profile: b.text()?,
                library: b.text()?,
            },
            op::FOOTER => Record::Footer(Footer::parse(body)?),
            op::SCHEMA => Record::Schema(SchemaRecord::parse(body)?),
            op::CHANNEL => Record::Channel(ChannelRecord::parse(body)?),
            op::MESSAGE => Record::Message(MessageRecord::parse(body)?),
            op::CHUNK => Record::Chunk(ChunkHead::parse(body)?.0),
            op::MESSAGE_INDEX => Record::MessageIndex {
                channel_id: b.u16()?,
                entries: b.entries(|e| Some((e.u64()?, e.u64()?)))?,
            },
            op::CHUNK_INDEX => Record::ChunkIndex(ChunkIndex {
                message_start_time: b.u64()?,
                message_end_time: b.u64()?,
                chunk_start_offset: b.u64()?,
                chunk_length: b.u64()?,
                message_index_offsets: b.entries(|e| Some((e.u16()?, e.u64()?)))?,
                message_index_length: b.u64()?,
                compression: b.text()?,
                compressed_size: b.u64()?,
                uncompressed_size: b.u64()?,
            }),
            op::ATTACHMENT => Record::Attachment(AttachmentRecord {
                log_time: b.u64()?,
                create_time: b.u64()?,
                name: b.text()?,
                media_type: b.text()?,
                data: b.long_blob()?,
                crc: b.u32()?,
            }),
            op::ATTACHMENT_INDEX => Record::AttachmentIndex(AttachmentIndex {
                offset: b.u64()?,
                length: b.u64()?,
                log_time: b.u64()?,
                create_time: b.u64()?,
                data_size: b.u64()?,
                name: b.text()?,
                media_type: b.text()?,
            }),
            op::STATISTICS => Record::Statistics(Statistics {
                message_count: b.u64()?,
                schema_count: b.u16()?,
                channel_count: b.u32()?,
                attachment_count: b.u32()?,
                metadata_count: b.u32()?,
                chunk_count: b.u32()?,
                message_start_time: b.u64()?,
                message_end_time: b.u64()?,
                channel_message_counts: b.entries(|e| Some((e.u16()?, e.u64()?)))?,
            }),
            op::METADATA => Record::Metadata {
                name: b.text()?,
                metadata: pairs(&mut b)?,
            },
            op::METADATA_INDEX => Record::MetadataIndex {
                offset: b.u64()?,
                length: b.u64()?,
                name: b.text()?,
            },
            op::SUMMARY_OFFSET => Record::SummaryOffset {
                group_opcode: b.u8()?,
                group_start: b.u64()?,
                group_length: b.u64()?,
            },
            op::DATA_END => Record::DataEnd {
                data_section_crc: b.u32()?,
            },
            _ => Record::Unknown { opcode, data: body },
        })
    }
}

/// Most pairs of text a record may have: each takes several times the memory of its bytes, and what is in
/// use has a few dozen.
const MAX_PAIRS: usize = 1 << 16;

fn pairs<'a>(b: &mut Bytes<'a>) -> Option<Vec<(&'a str, &'a str)>> {
    let mut left = MAX_PAIRS;
    b.entries(|e| {
        left = left.checked_sub(1)?;
        Some((e.text()?, e.text()?))
    })
}

impl Footer {
    /// Length of a footer's body.
    pub(super) const LEN: u64 = 20;

    pub(super) fn parse(body: &[u8]) -> Option<Footer> {
        let mut b = Bytes::new(body);
        Some(Footer {
            summary_start: b.u64()?,
            summary_offset_start: b.u64()?,
            summary_crc: b.u32()?,
        })
    }
}

impl<'a> SchemaRecord<'a> {
    pub(super) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut b = Bytes::new(body);
        Some(SchemaRecord {
            id: b.u16()?,
            name: b.text()?,
            encoding: b.text()?,
            data: b.blob()?,
        })
    }
}

impl<'a> ChannelRecord<'a> {
    pub(super) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut b = Bytes::new(body);
        Some(ChannelRecord {
            id: b.u16()?,
            schema_id: b.u16()?,
            topic: b.text()?,
            message_encoding: b.text()?,
            metadata: pairs(&mut b)?,
        })
    }
}

/// Bytes of a message record before the payload.
const MESSAGE_HEAD: usize = 22;

impl<'a> MessageRecord<'a> {
    #[inline]
    pub(super) fn parse(body: &'a [u8]) -> Option<Self> {
        // One length check for all four fields: this is the inner loop of the walk.
        let (head, data) = body.split_first_chunk::<MESSAGE_HEAD>()?;
        let mut b = Bytes::new(head);
        Some(MessageRecord {
            channel_id: b.u16()?,
            sequence: b.u32()?,
            log_time: b.u64()?,
            publish_time: b.u64()?,
            data,
        })
    }
}

impl<'a> ChunkHead<'a> {
    /// The fields, and what follows them in `body`.
    pub(super) fn parse(body: &'a [u8]) -> Option<(Self, &'a [u8])> {
        let mut b = Bytes::new(body);
        let head = ChunkHead {
            message_start_time: b.u64()?,
            message_end_time: b.u64()?,
            uncompressed_size: b.u64()?,
            uncompressed_crc: b.u32()?,
            compression: b.text()?,
            compressed_size: b.u64()?,
        };
        Some((head, b.rest()))
    }

    /// Bytes from the start of the record's body to its packed records.
    pub(super) fn len(&self) -> u64 {
        40 + self.compression.len() as u64
    }
}
