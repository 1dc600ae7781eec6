//! Subjects and keys of brokers <-> sessions and outboxes. I/O.
//!
//! | file | arrow | |
//! |---|---|---|
//! | [`nats`] | subjects of a broker: samples from there, attitudes to there (feature `nats`) | I/O |
//! | [`zenoh`] | keys of a router, ROS 2 among them: likewise (feature `zenoh`) | I/O |
//! | `query` | what stands behind the `?` of an address -> values, files of secrets read | pure, but for the files |
//! | this | what both have in common: chunks of an outbox -> one piece a sensor | pure |

#[cfg(feature = "nats")]
pub mod nats;
mod query;
#[cfg(feature = "zenoh")]
pub mod zenoh;

use crate::serve::core::outgoing::Outgoing;
use crate::serve::guard::log_throttle;
use crate::serve::protocol::chunk::Chunk;
use bytes::{Bytes, BytesMut};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A longer payload is refused: what brokers allow by themselves.
const MAX_PAYLOAD: usize = 1 << 20;
/// Bytes taken from an outbox at once.
const TAKE: usize = 64 << 10;

/// The connection of a source is not there; it is tried again.
fn lost(outgoing: &Outgoing, why: &str) {
    outgoing.lost(why);
    let name = outgoing.name();
    log_throttle::warn(
        &format!("{name} lost"),
        &format!("{name}: {why}; trying again until it is there"),
    );
}

/// The same of an output.
fn warn(name: &str, why: &str) {
    let name = format!("-o {name}");
    log_throttle::warn(&name, &format!("{name}: {why}; trying again"));
}

/// Attitudes that one sensor has to publish.
type Batch = (Arc<str>, Bytes);

/// The attitudes of each sensor in one piece, in their order.
fn gathered(chunks: Vec<Chunk>) -> Vec<Batch> {
    let mut all: BTreeMap<Arc<str>, BytesMut> = BTreeMap::new();
    for chunk in chunks {
        all.entry(chunk.id)
            .or_default()
            .extend_from_slice(&chunk.bytes);
    }
    all.into_iter()
        .map(|(id, bytes)| (id, bytes.freeze()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_attitudes_of_a_sensor_keep_their_order() {
        let chunk = |id: &str, text: &str| Chunk {
            id: id.into(),
            first_seq: 0,
            count: 1,
            bytes: Bytes::copy_from_slice(text.as_bytes()),
            label: None,
        };
        let all = gathered(vec![
            chunk("b", "1\n"),
            chunk("a", "2\n"),
            chunk("b", "3\n"),
        ]);
        let text: Vec<_> = all.iter().map(|(id, bytes)| (&**id, &bytes[..])).collect();
        assert_eq!(text, [("a", &b"2\n"[..]), ("b", b"1\n3\n")]);
    }
}
