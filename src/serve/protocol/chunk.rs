//! Content of an outbox: attitudes of one stream as bytes, and notices of those that were dropped.

use bytes::Bytes;
use std::sync::Arc;
use strapd_attitude::record::AttitudeSample;
use strapd_recording::decode::packed::Form;

/// Most bytes of attitudes waiting for one client, what is being written included.
pub const MAX_QUEUED: usize = 256 << 10;
/// The stream of notes, which are no attitudes.
pub(in crate::serve) const NOTE: &str = "";

/// Attitudes of one stream, encoded once and shared by every client that takes them all.
#[derive(Clone, Debug)]
pub struct Chunk {
    /// Id of the stream.
    pub id: Arc<str>,
    /// Number of the first in its stream.
    pub first_seq: u64,
    /// Number of attitudes.
    pub count: u64,
    /// Whole lines, or whole packed objects.
    pub bytes: Bytes,
    /// Number of the stream and the line that says what it is, where it is packed.
    pub label: Option<(u32, Bytes)>,
}

/// Encodes some attitudes of a stream, at least one, with their numbers.
pub type Encode<'a> = dyn Fn(Form, &[(u64, AttitudeSample)]) -> Chunk + 'a;

impl Chunk {
    /// Whether it is a note, which is no attitude.
    #[must_use]
    pub fn is_note(&self) -> bool {
        self.count == 0
    }
}

/// Attitudes that were dropped, to be said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dropped {
    /// Number of attitudes.
    pub count: u64,
    /// Number of the first.
    pub first_seq: u64,
    /// Number of the last.
    pub last_seq: u64,
}
