//! The body of a header, attachment or metadata record -> its fields, if it is what was written. Pure.
//!
//! A stage of its own because these records lie outside the chunks, whose checksums do not cover them:
//! an attachment carries its own, a metadata record has none and is judged by its lengths.

use crate::records::op;
use crate::records::problem::ProblemKind;
use crate::records::record::{AttachmentRecord, Record};

/// Bytes of an attachment's fields but for name, media type and data: two times, two lengths of
/// four bytes and one of eight, and behind them the CRC.
const FIXED: usize = 8 + 8 + 4 + 4 + 8;

/// The record, or why it cannot be copied.
pub(super) fn intact(opcode: u8, body: &[u8]) -> Result<Record<'_>, ProblemKind> {
    let what = match opcode {
        op::ATTACHMENT => "attachment",
        op::METADATA => "metadata",
        _ => "header",
    };
    let Some(record) = Record::parse(opcode, body) else {
        let why = "its lengths do not add up, or it has more than 65536 entries";
        return Err(ProblemKind::Attached { what, why });
    };
    if let Record::Attachment(attachment) = &record
        && attachment.crc != 0
        && attachment.crc != crc_of(body, attachment)
    {
        let why = "its CRC is wrong";
        return Err(ProblemKind::Attached { what, why });
    }
    Ok(record)
}

/// CRC-32 of everything before the field that holds it; 0 means "none", and is not checked.
fn crc_of(body: &[u8], attachment: &AttachmentRecord<'_>) -> u32 {
    let AttachmentRecord {
        name,
        media_type,
        data,
        ..
    } = attachment;
    let covered = FIXED + name.len() + media_type.len() + data.0.len();
    crc32fast::hash(body.get(..covered).unwrap_or(body))
}
