//! Bytes -> the head of one record. Pure.
//!
//! Apart because fields are named text in any order: what is asked of a head is found once, here.

use crate::records::Bytes;

/// Record types.
pub(crate) mod op {
    pub(crate) const MESSAGE: u8 = 2;
    pub(crate) const BAG: u8 = 3;
    pub(crate) const INDEX: u8 = 4;
    pub(crate) const CHUNK: u8 = 5;
    pub(crate) const CHUNK_INFO: u8 = 6;
    pub(crate) const CONNECTION: u8 = 7;
}

/// Longest head that is believed; of those in use only a topic's name makes one longer than 100 bytes.
const MAX_HEAD: usize = 64 << 10;

/// Head of a record, as far as it is asked for; fields it has not are `None`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Head<'a> {
    pub(crate) op: u8,
    pub(crate) conn: Option<u32>,
    /// Time at which the message was received, ns.
    pub(crate) time: Option<u64>,
    pub(crate) topic: Option<&'a str>,
    pub(crate) compression: Option<&'a str>,
    /// Bytes of a chunk when unpacked.
    pub(crate) size: Option<u32>,
    /// Messages an index record counts; connections a chunk's.
    pub(crate) count: Option<u32>,
    /// Offset of the index; 0 when the recorder was killed.
    pub(crate) index_pos: Option<u64>,
    pub(crate) chunk_count: Option<u32>,
    /// Offset of the record's data, and their length.
    pub(crate) data_at: usize,
    pub(crate) data_len: usize,
}

impl Head<'_> {
    /// Length of the whole record.
    pub(crate) fn total(&self) -> usize {
        self.data_at.saturating_add(self.data_len)
    }
}

/// The head of the record that begins here. `Err` says how many bytes are needed to tell, or `None` that it is no
/// record.
pub(crate) fn head(data: &[u8]) -> Result<Head<'_>, Option<usize>> {
    let mut bytes = Bytes::new(data);
    let length = bytes.u32().ok_or(Some(4))? as usize;
    // The shortest says no more than its type.
    if !(8..=MAX_HEAD).contains(&length) {
        return Err(None);
    }
    let fields = bytes.take(length).ok_or(Some(length + 8))?;
    let mut head = parse(fields).ok_or(None)?;
    head.data_len = bytes.u32().ok_or(Some(length + 8))? as usize;
    head.data_at = length + 8;
    Ok(head)
}

fn parse(fields: &[u8]) -> Option<Head<'_>> {
    let mut head = Head::default();
    let mut rest = Bytes::new(fields);
    while !rest.is_empty() {
        let field = rest.blob()?;
        let at = memchr::memchr(b'=', field)?;
        let (name, value) = (field.get(..at)?, field.get(at + 1..)?);
        let mut number = Bytes::new(value);
        let text = || std::str::from_utf8(value).ok();
        match name {
            b"op" => head.op = number.u8().filter(|_| value.len() == 1)?,
            b"conn" => head.conn = Some(number.u32()?),
            b"time" => {
                let (secs, nanos) = (number.u32()?, number.u32()?);
                head.time = Some(u64::from(secs) * 1_000_000_000 + u64::from(nanos));
            }
            b"topic" => head.topic = text(),
            b"compression" => head.compression = text(),
            b"size" => head.size = Some(number.u32()?),
            b"count" => head.count = Some(number.u32()?),
            b"index_pos" => head.index_pos = Some(number.u64()?),
            b"chunk_count" => head.chunk_count = Some(number.u32()?),
            _ => {}
        }
    }
    (head.op != 0).then_some(head)
}

/// Mark of a chunk's type in its head.
const MARK: &[u8] = b"\x04\0\0\0op=\x05";
/// Longest head of a chunk: three fields.
const CHUNK_HEAD: usize = 64;

/// Offset of the first chunk in `data`, if one begins there whose head is whole; else from where on the next bytes may
/// complete one.
pub(crate) fn chunk_at(data: &[u8]) -> Result<usize, usize> {
    for mark in memchr::memmem::find_iter(data, MARK) {
        let is_chunk = |at: &usize| {
            let found = data.get(*at..).and_then(|data| head(data).ok());
            found.is_some_and(|head| {
                head.op == op::CHUNK
                    && head.compression.is_some()
                    && head.size.is_some()
                    && (*at + 4..*at + head.data_at).contains(&mark)
            })
        };
        let from = mark.saturating_sub(CHUNK_HEAD);
        if let Some(at) = (from..mark).find(is_chunk) {
            return Ok(at);
        }
    }
    Err(data.len().saturating_sub(2 * CHUNK_HEAD))
}
