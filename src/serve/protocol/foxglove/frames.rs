//! Messages of the Foxglove protocol <-> stretches of bytes, and the numbers of their channels. Pure.
//!
//! One stretch of bytes in an outbox holds whole messages, each behind its kind and length
//! ([`messages`]).

use bytes::{BufMut, Bytes};
use strapd_attitude::record::Nanos;

/// The channel of the transforms; those of streams come behind it.
pub const TRANSFORMS: u32 = 1;

pub(super) const TEXT: u8 = 1;
pub(super) const BINARY: u8 = 2;

/// Number of the first channel of stream `number`, from 1; the second has the next one.
#[must_use]
pub fn channel_of(number: u32) -> u32 {
    number.saturating_mul(2)
}

/// The stream a channel is of.
#[must_use]
pub fn stream_of(channel: u32) -> u32 {
    channel / 2
}

pub(super) fn framed(kind: u8, message: &[u8]) -> Bytes {
    let mut out = Vec::with_capacity(message.len() + 5);
    out.put_u8(kind);
    out.put_u32_le(message.len() as u32);
    out.extend_from_slice(message);
    out.into()
}

pub(super) fn unsigned(at: Nanos) -> u64 {
    at.0.max(0) as u64
}

/// Appends the head of a message with data; the payload follows. [`close`] it.
pub fn open(out: &mut Vec<u8>, subscription: u32, time: Nanos) -> usize {
    let from = out.len();
    out.put_u8(BINARY);
    out.put_u32_le(0);
    out.put_u8(1);
    out.put_u32_le(subscription);
    out.put_u64_le(unsigned(time));
    from
}

/// Ends what [`open`] began.
pub fn close(out: &mut [u8], from: usize) {
    let length = (out.len() - from - 5) as u32;
    if let Some(place) = out.get_mut(from + 1..from + 5) {
        place.copy_from_slice(&length.to_le_bytes());
    }
}

/// Message of the time in the data.
#[must_use]
pub fn time(at: Nanos) -> Bytes {
    let mut message = vec![2];
    message.put_u64_le(unsigned(at));
    framed(BINARY, &message)
}

/// A message, as it goes into a WebSocket.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Framed {
    /// UTF-8.
    Text(Bytes),
    /// Anything.
    Binary(Bytes),
}

/// The messages in a stretch of bytes; they share its memory.
pub fn messages(stretch: &Bytes) -> impl Iterator<Item = Framed> {
    let mut rest = stretch.clone();
    std::iter::from_fn(move || {
        let (kind, length) = (*rest.first()?, rest.get(1..5)?);
        let length = u32::from_le_bytes(length.try_into().ok()?) as usize;
        let end = length.checked_add(5).filter(|end| *end <= rest.len())?;
        let message = rest.slice(5..end);
        rest = rest.slice(end..);
        Some(if kind == TEXT {
            Framed::Text(message)
        } else {
            Framed::Binary(message)
        })
    })
}
