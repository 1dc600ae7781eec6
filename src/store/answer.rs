//! What a server answers to one request. Pure.

use super::fault::Fault;
use bytes::Bytes;
use futures_util::stream::BoxStream;

/// Bytes as they come.
pub(super) type Body = BoxStream<'static, Result<Bytes, Fault>>;

/// What tells an object from one that was written over it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Version {
    pub(super) size: u64,
    /// Its ETag, or when it was written.
    pub(super) tag: Option<String>,
}

/// A part of an object.
pub(super) struct Part {
    pub(super) version: Version,
    /// Where `body` begins.
    pub(super) start: u64,
    pub(super) body: Body,
}

/// What a server answers.
pub(super) enum Reply {
    Part(Part),
    /// It knows no ranges.
    All {
        size: Option<u64>,
        body: Body,
    },
}
