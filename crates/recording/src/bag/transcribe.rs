//! The records of an unpacked chunk -> the records MCAP has for them. Pure.
//!
//! Apart from the walk because it is what workers do. It needs nothing that came before: a connection's number is its
//! channel's.

use super::record::{Head, head, op};
use crate::records::Bytes;
use crate::records::transcript::Transcript;

/// The end of the record at `at`; `Err(true)` where none can begin, `Err(false)` where it goes on behind `data`.
pub(crate) fn next_record(data: &[u8], at: usize) -> Result<usize, bool> {
    match head(data.get(at..).unwrap_or(&[])) {
        Ok(head) => match at.checked_add(head.total()) {
            Some(end) if end <= data.len() => Ok(end),
            _ => Err(false),
        },
        Err(need) => Err(need.is_none()),
    }
}

/// Tells the records of a chunk; where one runs over the end, or is none, it is the last. `is_cut`: the chunk is known
/// to be cut, so that this need not be told.
pub(crate) fn transcribe(data: &[u8], is_cut: bool, to: &mut Transcript) {
    let mut rest = data;
    while !rest.is_empty() {
        let record = head(rest).ok();
        let split = record.and_then(|head| Some((head, rest.split_at_checked(head.total())?)));
        let Some((head, (record, after))) = split else {
            if !is_cut {
                to.broken(rest.len() as u64);
            }
            return;
        };
        rest = after;
        let data = record.get(head.data_at..).unwrap_or(&[]);
        let is_told = match head.op {
            op::MESSAGE => message(&head, data, to),
            op::CONNECTION => connection(&head, data, to),
            _ => None,
        };
        if is_told.is_none() {
            to.unreadable();
        }
    }
}

/// The channel of a connection: those beyond what an id can say have none.
fn channel(head: &Head<'_>) -> Option<u16> {
    u16::try_from(head.conn?).ok()
}

fn message(head: &Head<'_>, data: &[u8], to: &mut Transcript) -> Option<()> {
    to.message(channel(head)?, 0, head.time?, data);
    Some(())
}

/// Tells a connection: its schema under its own number, and its channel.
pub(crate) fn connection(head: &Head<'_>, data: &[u8], to: &mut Transcript) -> Option<()> {
    let id = channel(head).filter(|id| *id < u16::MAX)?;
    let (mut kind, mut definition) = ("", &b""[..]);
    let (mut topic, mut node, mut latching) = (head.topic, "", "");
    let mut rest = Bytes::new(data);
    while !rest.is_empty() {
        let field = rest.blob()?;
        let at = memchr::memchr(b'=', field)?;
        let (name, value) = (field.get(..at)?, field.get(at + 1..)?);
        let text = || std::str::from_utf8(value).unwrap_or("");
        match name {
            b"type" => kind = text(),
            b"message_definition" => definition = value,
            b"callerid" => node = text(),
            b"latching" => latching = text(),
            b"topic" if topic.is_none() => topic = Some(text()),
            _ => {}
        }
    }
    to.schema(id + 1, kind, "ros1msg", definition);
    let said = [("callerid", node), ("latching", latching)];
    let said: Vec<(&str, &str)> = said.into_iter().filter(|(_, v)| !v.is_empty()).collect();
    to.channel(id, id + 1, topic?, "ros1", &said);
    Some(())
}
