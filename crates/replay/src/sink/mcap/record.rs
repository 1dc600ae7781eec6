//! Fields -> MCAP records, byte by byte. Pure.
//!
//! The container is little-endian records `opcode u8, length u64, body`; the layouts are those of
//! the MCAP specification, version 0. Written here because the `mcap` crate's writer takes single
//! messages only and costs several times what a chunk built in one go does; the crate is the oracle
//! in the tests.

use std::collections::BTreeMap;
pub(super) use strapd_recording::mcap::MAGIC;
pub(super) use strapd_recording::mcap::op::{
    ATTACHMENT, ATTACHMENT_INDEX, CHANNEL, CHUNK, CHUNK_INDEX, DATA_END, FOOTER, HEADER, MESSAGE,
    MESSAGE_INDEX, METADATA, METADATA_INDEX, SCHEMA, STATISTICS, SUMMARY_OFFSET,
};

/// Bytes before a record's body: opcode and length.
pub(super) const PREFIX: usize = 9;
/// Bytes of a message record before its payload.
pub(super) const MESSAGE_HEAD: usize = PREFIX + 2 + 4 + 8 + 8;

/// A record being written at the end of a buffer; its length is filled in by [`Body::end`].
pub(super) struct Body<'a> {
    out: &'a mut Vec<u8>,
    start: usize,
}

impl<'a> Body<'a> {
    pub(super) fn begin(out: &'a mut Vec<u8>, opcode: u8) -> Body<'a> {
        out.push(opcode);
        out.extend_from_slice(&[0; 8]);
        let start = out.len();
        Body { out, start }
    }
    pub(super) fn u16(self, v: u16) -> Self {
        self.bytes(&v.to_le_bytes())
    }
    pub(super) fn u32(self, v: u32) -> Self {
        self.bytes(&v.to_le_bytes())
    }
    pub(super) fn u64(self, v: u64) -> Self {
        self.bytes(&v.to_le_bytes())
    }
    pub(super) fn bytes(self, v: &[u8]) -> Self {
        self.out.extend_from_slice(v);
        self
    }
    /// Bytes behind their length. Every caller's input is below 4 GiB: names are cut, schemas and
    /// metadata are checked when they are registered.
    pub(super) fn sized(self, v: &[u8]) -> Self {
        self.u32(v.len() as u32).bytes(v)
    }
    pub(super) fn string(self, v: &str) -> Self {
        self.sized(v.as_bytes())
    }
    pub(super) fn strings(self, map: &BTreeMap<String, String>) -> Self {
        let length: usize = map.iter().map(|(k, v)| 8 + k.len() + v.len()).sum();
        map.iter().fold(self.u32(length as u32), |body, (k, v)| {
            body.string(k).string(v)
        })
    }
    /// Channel to a 64-bit number.
    pub(super) fn numbers(self, map: &BTreeMap<u16, u64>) -> Self {
        map.iter()
            .fold(self.u32(map.len() as u32 * 10), |body, (k, v)| {
                body.u16(*k).u64(*v)
            })
    }
    pub(super) fn end(self) {
        let length = (self.out.len() - self.start) as u64;
        self.out[self.start - 8..self.start].copy_from_slice(&length.to_le_bytes());
    }
}

/// Fields of a channel.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    pub(super) id: u16,
    /// 0: none.
    pub(super) schema: u16,
    pub(super) topic: String,
    pub(super) encoding: String,
    pub(super) metadata: BTreeMap<String, String>,
}

impl Channel {
    pub(super) fn push(&self, out: &mut Vec<u8>) {
        Body::begin(out, CHANNEL)
            .u16(self.id)
            .u16(self.schema)
            .string(&self.topic)
            .string(&self.encoding)
            .strings(&self.metadata)
            .end();
    }
}

/// Fields of a schema.
#[derive(Clone, Debug)]
pub(super) struct Schema {
    pub(super) id: u16,
    pub(super) name: String,
    pub(super) encoding: String,
    pub(super) text: Vec<u8>,
}

impl Schema {
    pub(super) fn push(&self, out: &mut Vec<u8>) {
        Body::begin(out, SCHEMA)
            .u16(self.id)
            .string(&self.name)
            .string(&self.encoding)
            .sized(&self.text)
            .end();
    }
}

/// The head of a message record with `payload` bytes to follow.
pub(super) fn message_head(
    channel: u16,
    sequence: u32,
    log_time: u64,
    publish_time: u64,
    payload: usize,
) -> [u8; MESSAGE_HEAD] {
    let mut head = [0; MESSAGE_HEAD];
    head[0] = MESSAGE;
    head[1..9].copy_from_slice(&((MESSAGE_HEAD - PREFIX + payload) as u64).to_le_bytes());
    head[9..11].copy_from_slice(&channel.to_le_bytes());
    head[11..15].copy_from_slice(&sequence.to_le_bytes());
    head[15..23].copy_from_slice(&log_time.to_le_bytes());
    head[23..31].copy_from_slice(&publish_time.to_le_bytes());
    head
}
