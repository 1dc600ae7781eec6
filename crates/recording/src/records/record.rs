//! The layout of each record of MCAP, once: its body -> its fields, borrowed; and its fields -> its bytes. Pure.
//!
//! A stage of its own because layouts are facts of the MCAP specification and nothing else
//! (<https://mcap.dev/spec>): what a field is worth is judged by the callers. Bytes after the
//! last known field are ignored, as the specification asks. Readers, transcribers and the writer of outputs share it;
//! `docs/design.md` says why it is not that of the crate `mcap`.

use super::bytes::{Bytes, HEAD};
use super::op;

/// Value in a record, as it lies there: little-endian, texts and bytes behind their length.
pub(crate) trait Field<'a>: Sized {
    /// Most entries of an array of these.
    const MOST: usize = usize::MAX;

    fn read(from: &mut Bytes<'a>) -> Option<Self>;
    fn write(&self, out: &mut Vec<u8>);
}

macro_rules! numbers {
    ($($number:ident)*) => {
        $(impl Field<'_> for $number {
            fn read(from: &mut Bytes<'_>) -> Option<Self> {
                from.$number()
            }
            fn write(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
        })*
    };
}

numbers!(u8 u16 u32 u64);

impl<'a> Field<'a> for &'a [u8] {
    fn read(from: &mut Bytes<'a>) -> Option<Self> {
        from.blob()
    }
    fn write(&self, out: &mut Vec<u8>) {
        length_of(self.len()).write(out);
        out.extend_from_slice(self);
    }
}

impl<'a> Field<'a> for &'a str {
    /// Each takes several times the memory of its bytes, and what is in use has a few dozen.
    const MOST: usize = 1 << 16;

    fn read(from: &mut Bytes<'a>) -> Option<Self> {
        from.text()
    }
    fn write(&self, out: &mut Vec<u8>) {
        self.as_bytes().write(out);
    }
}

/// Pairs, behind their length in bytes.
impl<'a, A: Field<'a>, B: Field<'a>> Field<'a> for Vec<(A, B)> {
    fn read(from: &mut Bytes<'a>) -> Option<Self> {
        let mut left = A::MOST;
        from.entries(|entry| {
            left = left.checked_sub(1)?;
            Some((A::read(entry)?, B::read(entry)?))
        })
    }
    fn write(&self, out: &mut Vec<u8>) {
        let start = out.len();
        0_u32.write(out);
        for (a, b) in self {
            a.write(out);
            b.write(out);
        }
        let length = length_of(out.len() - start - 4);
        if let Some(slot) = out.get_mut(start..start + 4) {
            slot.copy_from_slice(&length.to_le_bytes());
        }
    }
}

/// Bytes of a file carried in a log, behind a length of eight bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Carried<'a>(pub &'a [u8]);

impl<'a> Field<'a> for Carried<'a> {
    fn read(from: &mut Bytes<'a>) -> Option<Self> {
        from.long_blob().map(Carried)
    }
    fn write(&self, out: &mut Vec<u8>) {
        (self.0.len() as u64).write(out);
        out.extend_from_slice(self.0);
    }
}

/// Pairs of log time and offset, as they lie in an index.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Entries<'a>(pub &'a [u8]);

impl Entries<'_> {
    /// Bytes of a pair.
    pub const LEN: usize = 16;
}

impl<'a> Field<'a> for Entries<'a> {
    fn read(from: &mut Bytes<'a>) -> Option<Self> {
        let all = from.blob()?;
        all.len()
            .is_multiple_of(Entries::LEN)
            .then_some(Entries(all))
    }
    fn write(&self, out: &mut Vec<u8>) {
        self.0.write(out);
    }
}

/// Length of what is written: every caller's input is below 4 GiB, since records of inputs are bounded, names of
/// outputs are cut, and schemas are checked when they are registered.
fn length_of(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// Writes a record whose body is made by `write`, and goes on for `more` bytes behind it.
fn push(out: &mut Vec<u8>, opcode: u8, more: u64, write: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.push(opcode);
    out.extend_from_slice(&[0; HEAD - 1]);
    write(out);
    let length = ((out.len() - start - HEAD) as u64).saturating_add(more);
    if let Some(slot) = out.get_mut(start + 1..start + HEAD) {
        slot.copy_from_slice(&length.to_le_bytes());
    }
}

/// Types of records, with their fields in the order in which these lie; and the record of any type.
macro_rules! layouts {
    ($($(#[$about:meta])* $opcode:ident $variant:ident($name:ident $(<$life:lifetime>)?) {
        $($(#[$of:meta])* $field:ident: $type:ty,)*
    })*) => {
        $(
            $(#[$about])*
            #[derive(Clone, PartialEq, Eq, Debug)]
            #[allow(missing_docs)]
            pub struct $name $(<$life>)? {
                $($(#[$of])* pub $field: $type,)*
            }

            impl $(<$life>)? $name $(<$life>)? {
                /// Writes the record.
                pub fn push(&self, out: &mut Vec<u8>) {
                    self.push_with(0, out);
                }

                /// Writes the record, whose body goes on for `more` bytes behind what is written.
                pub fn push_with(&self, more: u64, out: &mut Vec<u8>) {
                    push(out, op::$opcode, more, |out| {
                        $(self.$field.write(out);)*
                    });
                }
            }

            impl<'a> Body<'a> for layouts!(@of 'a $name $(<$life>)?) {
                fn read(from: &mut Bytes<'a>) -> Option<Self> {
                    Some($name { $($field: Field::read(from)?,)* })
                }
            }
        )*

        /// One record, borrowed from the bytes it was read from. Times are nanoseconds, offsets and
        /// lengths bytes; field names are the specification's.
        #[derive(Clone, PartialEq, Debug)]
        #[allow(missing_docs)]
        pub enum Record<'a> {
            $($variant(layouts!(@of 'a $name $(<$life>)?)),)*
            Message(MessageRecord<'a>),
            Unknown { opcode: u8, data: &'a [u8] },
        }

        impl<'a> Record<'a> {
            /// The fields of a record, or `None` where the body is too short, its lengths do not add up, or it has
            /// more than 65,536 pairs of text.
            #[must_use]
            pub fn parse(opcode: u8, body: &'a [u8]) -> Option<Record<'a>> {
                Some(match opcode {
                    $(op::$opcode => Record::$variant($name::parse(body)?),)*
                    op::MESSAGE => Record::Message(MessageRecord::parse(body)?),
                    _ => Record::Unknown { opcode, data: body },
                })
            }
        }
    };
    (@of $a:lifetime $name:ident <$life:lifetime>) => { $name<$a> };
    (@of $a:lifetime $name:ident) => { $name };
}

/// Fields at the beginning of a record's body.
pub(crate) trait Body<'a>: Sized {
    fn read(from: &mut Bytes<'a>) -> Option<Self>;

    /// The fields, or `None` where the body is too short or its lengths do not add up.
    fn parse(body: &'a [u8]) -> Option<Self> {
        Self::read(&mut Bytes::new(body))
    }
}

layouts! {
    /// Beginning of a log.
    HEADER Header(HeaderRecord<'a>) {
        profile: &'a str,
        library: &'a str,
    }
    /// Place of the summary.
    #[derive(Copy)]
    FOOTER Footer(Footer) {
        summary_start: u64,
        summary_offset_start: u64,
        summary_crc: u32,
    }
    /// Layout of the payloads of a channel.
    #[derive(Copy)]
    SCHEMA Schema(SchemaRecord<'a>) {
        id: u16,
        name: &'a str,
        encoding: &'a str,
        data: &'a [u8],
    }
    /// A stream of messages.
    CHANNEL Channel(ChannelRecord<'a>) {
        id: u16,
        schema_id: u16,
        topic: &'a str,
        message_encoding: &'a str,
        metadata: Vec<(&'a str, &'a str)>,
    }
    /// Fields before the records of a chunk.
    #[derive(Copy)]
    CHUNK Chunk(ChunkHead<'a>) {
        message_start_time: u64,
        message_end_time: u64,
        uncompressed_size: u64,
        /// CRC-32 of the uncompressed records; 0 where the writer made none.
        uncompressed_crc: u32,
        compression: &'a str,
        compressed_size: u64,
    }
    /// Places of the messages of a channel in the chunk before.
    #[derive(Copy)]
    MESSAGE_INDEX MessageIndex(MessageIndex<'a>) {
        channel_id: u16,
        entries: Entries<'a>,
    }
    /// The summary's word about one chunk.
    CHUNK_INDEX ChunkIndex(ChunkIndex<'a>) {
        message_start_time: u64,
        message_end_time: u64,
        chunk_start_offset: u64,
        chunk_length: u64,
        message_index_offsets: Vec<(u16, u64)>,
        message_index_length: u64,
        compression: &'a str,
        compressed_size: u64,
        uncompressed_size: u64,
    }
    /// A file carried inside the log.
    #[derive(Copy)]
    ATTACHMENT Attachment(AttachmentRecord<'a>) {
        log_time: u64,
        create_time: u64,
        name: &'a str,
        media_type: &'a str,
        data: Carried<'a>,
        crc: u32,
    }
    /// The summary's word about one attachment.
    #[derive(Copy)]
    ATTACHMENT_INDEX AttachmentIndex(AttachmentIndex<'a>) {
        offset: u64,
        length: u64,
        log_time: u64,
        create_time: u64,
        data_size: u64,
        name: &'a str,
        media_type: &'a str,
    }
    /// The summary's counts.
    STATISTICS Statistics(Statistics) {
        message_count: u64,
        schema_count: u16,
        channel_count: u32,
        attachment_count: u32,
        metadata_count: u32,
        chunk_count: u32,
        message_start_time: u64,
        message_end_time: u64,
        channel_message_counts: Vec<(u16, u64)>,
    }
    /// Pairs of text under a name.
    METADATA Metadata(MetadataRecord<'a>) {
        name: &'a str,
        metadata: Vec<(&'a str, &'a str)>,
    }
    /// The summary's word about one metadata record.
    #[derive(Copy)]
    METADATA_INDEX MetadataIndex(MetadataIndex<'a>) {
        offset: u64,
        length: u64,
        name: &'a str,
    }
    /// Place of the records of one type in the summary.
    #[derive(Copy)]
    SUMMARY_OFFSET SummaryOffset(SummaryOffset) {
        group_opcode: u8,
        group_start: u64,
        group_length: u64,
    }
    /// End of the data.
    #[derive(Copy)]
    DATA_END DataEnd(DataEnd) {
        data_section_crc: u32,
    }
}

impl Footer {
    /// Length of a footer's body.
    pub(crate) const LEN: u64 = 20;
}

impl ChunkHead<'_> {
    /// Bytes from the start of the record's body to its packed records.
    pub(crate) fn len(&self) -> u64 {
        40 + self.compression.len() as u64
    }
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

/// Bytes of a message record's body before the payload.
const MESSAGE_FIELDS: usize = 22;

impl<'a> MessageRecord<'a> {
    /// Bytes of the record before its payload.
    pub const HEAD: usize = HEAD + MESSAGE_FIELDS;

    #[inline]
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        // One length check for all four fields: this is the inner loop of the walk.
        let (head, data) = body.split_first_chunk::<MESSAGE_FIELDS>()?;
        let mut b = Bytes::new(head);
        Some(MessageRecord {
            channel_id: b.u16()?,
            sequence: b.u32()?,
            log_time: b.u64()?,
            publish_time: b.u64()?,
            data,
        })
    }

    /// The record up to its payload, of which there are `payload` bytes.
    #[inline]
    #[must_use]
    pub fn head(
        channel_id: u16,
        sequence: u32,
        times: (u64, u64),
        payload: usize,
    ) -> [u8; MessageRecord::HEAD] {
        let mut head = [0; MessageRecord::HEAD];
        head[0] = op::MESSAGE;
        head[1..9].copy_from_slice(&((MESSAGE_FIELDS + payload) as u64).to_le_bytes());
        head[9..11].copy_from_slice(&channel_id.to_le_bytes());
        MessageRecord::number(&mut head, sequence, times);
        head
    }

    /// Writes sequence number and times into a record that has been written: log time, publish time.
    #[inline]
    pub fn number(
        head: &mut [u8; MessageRecord::HEAD],
        sequence: u32,
        (log_time, publish_time): (u64, u64),
    ) {
        head[11..15].copy_from_slice(&sequence.to_le_bytes());
        head[15..23].copy_from_slice(&log_time.to_le_bytes());
        head[23..31].copy_from_slice(&publish_time.to_le_bytes());
    }
}

#[cfg(test)]
mod tests;
