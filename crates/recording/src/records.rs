//! Records as MCAP has them, for whoever writes or reads them: their kinds, their fields, and one after another. Pure.
//!
//! Below the readers: ULog and bags are transcribed to records here, which the reader of MCAP then takes.

mod bytes;
pub mod cdr;
pub(crate) mod cut;
pub mod imu;
pub(crate) mod problem;
pub mod record;
pub(crate) mod transcript;
pub(crate) mod walk;

pub use bytes::HEAD;
pub(crate) use bytes::{Bytes, head_at};

/// The eight bytes at both ends of an MCAP.
pub const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// Record opcodes.
#[allow(missing_docs)]
pub mod op {
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const MESSAGE_INDEX: u8 = 0x07;
    pub const CHUNK_INDEX: u8 = 0x08;
    pub const ATTACHMENT: u8 = 0x09;
    pub const ATTACHMENT_INDEX: u8 = 0x0A;
    pub const STATISTICS: u8 = 0x0B;
    pub const METADATA: u8 = 0x0C;
    pub const METADATA_INDEX: u8 = 0x0D;
    pub const SUMMARY_OFFSET: u8 = 0x0E;
    pub const DATA_END: u8 = 0x0F;
}
