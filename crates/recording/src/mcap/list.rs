//! A log -> every record in it, in file order. I/O.
//!
//! A stage of its own because salvage and conformance need what a walk leaves out: attachments,
//! metadata, indexes and the summary. One thread, no order made, chunks opened in place.

use super::block::Buffers;
use super::container::scan;
use super::scan::{Item, OtherRecords};
use super::workers::place;
use super::{Facts, Reader, read_error};
use crate::error::Result;
use crate::records::problem::{ProblemKind, Problems};
use crate::records::record::Record;
use crate::records::{HEAD, head_at};
use std::ops::ControlFlow;

/// One record and where it is.
#[derive(Clone, PartialEq, Debug)]
pub struct Listed<'a> {
    /// Offset in the file of its chunk, or of itself when it is in none.
    pub offset: u64,
    /// Offset in the unpacked chunk; `None` when it is in none.
    pub inner: Option<u64>,
    /// The record.
    pub record: Record<'a>,
    /// Body as it was written, for copying.
    pub body: &'a [u8],
}

/// Visits every record that can be read, those inside chunks included; chunks themselves are not
/// visited, nor are attachments longer than the limit.
///
/// # Errors
/// [`crate::error::Error::Read`] when the input itself fails; damage is in the [`Problems`].
pub fn list(
    reader: Reader,
    mut visit: impl FnMut(Listed<'_>) -> ControlFlow<()>,
) -> Result<(Facts, Problems)> {
    let name = reader.name().to_owned();
    let mut scanner = scan(reader, OtherRecords::Everything);
    let mut buffers = Buffers::default();
    let mut problems = Problems::default();
    loop {
        let item = scanner.next();
        let item = item.map_err(|e| read_error(&name, scanner.position(), e))?;
        let flow = match item {
            None => break,
            Some(Item::Other {
                opcode,
                offset,
                body,
            }) => {
                let body = body.as_slice();
                match Record::parse(opcode, body) {
                    Some(record) => visit(Listed {
                        offset,
                        inner: None,
                        record,
                        body,
                    }),
                    None => {
                        let length = body.len() as u64;
                        problems.add(offset, ProblemKind::InnerRecord { at: 0, length }, None);
                        ControlFlow::Continue(())
                    }
                }
            }
            Some(Item::Block(block)) => {
                let place = place(&block);
                let opened = buffers
                    .open(&block)
                    .map_err(|e| read_error(&name, place.offset, e))?;
                let flow = match opened {
                    Ok(records) => each(records, |at, opcode, body| {
                        let (offset, inner) = match place.chunked {
                            true => (place.offset, Some(at as u64)),
                            false => (place.offset + at as u64, None),
                        };
                        match body.and_then(|body| Some((Record::parse(opcode, body)?, body))) {
                            Some((record, body)) => visit(Listed {
                                offset,
                                inner,
                                record,
                                body,
                            }),
                            None => {
                                let at = at as u64;
                                let length = body.map_or(0, |b| b.len() as u64);
                                let kind = match opcode {
                                    0 => ProblemKind::NoInnerRecord { at },
                                    _ => ProblemKind::InnerRecord { at, length },
                                };
                                problems.add(place.offset, kind, None);
                                ControlFlow::Continue(())
                            }
                        }
                    }),
                    Err(kind) => {
                        problems.add(place.offset, kind, block.indexed());
                        ControlFlow::Continue(())
                    }
                };
                scanner.recycle(block.payload);
                flow
            }
        };
        if flow.is_break() {
            break;
        }
    }
    let (facts, found) = scanner.finish();
    problems.merge(found);
    Ok((facts, problems))
}

/// Calls `see` with offset, opcode and body of each record; one that runs over the end, or has the
/// opcode 0 that no record has, has no body and is the last.
fn each(
    records: &[u8],
    mut see: impl FnMut(usize, u8, Option<&[u8]>) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let mut at = 0;
    while at < records.len() {
        let Some((opcode, length)) = head_at(records, at) else {
            return see(at, 0, None);
        };
        let end = usize::try_from(length)
            .ok()
            .and_then(|n| (at + HEAD).checked_add(n));
        let body = end.and_then(|end| records.get(at + HEAD..end));
        let body = body.filter(|_| opcode != 0);
        see(at, opcode, body)?;
        let Some(body) = body else { break };
        at += HEAD + body.len();
    }
    ControlFlow::Continue(())
}
