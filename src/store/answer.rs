//! Answer of a server to one request. Pure.

use super::fault::Fault;
use bytes::Bytes;
use futures_util::stream::BoxStream;

/// Bytes as they come.
pub(super) type Body = BoxStream<'static, Result<Bytes, Fault>>;

/// Version of an object, which tells it from one that was written over it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Version {
    pub(super) size: u64,
    /// ETag, or the time when it was written.
    pub(super) tag: Option<String>,
}

/// A part of an object.
pub(super) struct Part {
    pub(super) version: Version,
    /// Offset at which `body` begins.
    pub(super) start: u64,
    pub(super) body: Body,
}

/// Reply of a server.
pub(super) enum Reply {
    Part(Part),
    /// Whole object: it knows no ranges.
    All {
        size: Option<u64>,
        body: Body,
    },
}
