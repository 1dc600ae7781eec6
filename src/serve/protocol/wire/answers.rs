//! Answers and notices -> one line each. Pure.
//!
//! Apart from what a line asks for because nothing is read here: who says it has the numbers, and only their names in
//! the object are of the protocol.

use super::{PROTO, Stream};
use crate::serve::guard::fault::Fault;
use crate::serve::protocol::chunk::{Dropped, MAX_QUEUED};
use crate::serve::protocol::filter::Filter;
use crate::serve::protocol::position::Position;
use bytes::Bytes;
use serde_json::{Value, json};
use std::time::Duration;
use strapd_attitude::record::Nanos;
use strapd_recording::decode::MAX_LINE;
use strapd_recording::decode::packed::Form;
use strapd_recording::text::snippet;

pub(super) fn line(value: &Value) -> Bytes {
    let mut text = value.to_string();
    text.push('\n');
    text.into()
}

/// The greeting.
#[must_use]
pub fn version(session: &str) -> Bytes {
    line(&json!({
        "class": "VERSION", "proto": PROTO, "release": env!("CARGO_PKG_VERSION"),
        "session": session, "max_line": MAX_LINE,
    }))
}

/// The answer to `WATCH`.
#[must_use]
pub fn watching(filter: Option<&Filter>, offered: &[Stream]) -> Bytes {
    let mut answer = json!({"class": "WATCH", "enable": filter.is_some()});
    if let (Some(filter), Some(fields)) = (filter, answer.as_object_mut()) {
        let wanted = |class: &&Stream| filter.classes.as_ref().is_none_or(|c| c.contains(*class));
        let names: Vec<_> = offered.iter().filter(wanted).map(|c| c.name()).collect();
        fields.insert("streams".into(), json!(names));
        fields.insert("queue_bytes".into(), json!(MAX_QUEUED));
        fields.insert("policy".into(), json!("drop_oldest"));
        if let Some(ids) = &filter.ids {
            fields.insert("ids".into(), json!(ids));
        }
        if let Some(rate_hz) = filter.rate_hz {
            fields.insert("rate_hz".into(), json!(rate_hz));
        }
        if filter.form == Form::Packed {
            fields.insert("packed".into(), json!(true));
        }
        if !filter.last {
            fields.insert("last".into(), json!(false));
        }
    }
    line(&answer)
}

/// A notice to a client, which is no fault.
#[must_use]
pub fn note(what: &Fault) -> Bytes {
    line(&json!({"class": "NOTE", "code": what.code, "id": what.id, "message": what.message}))
}

/// The question whether a watcher that has ended its side is still there, after so long without anything to send: its
/// system answers with a reset if it is not.
#[must_use]
pub fn heartbeat(quiet: Duration) -> Bytes {
    note(&Fault::new(
        "heartbeat",
        format!(
            "nothing to send for {} s; you have ended your side, and this line finds out whether you still read",
            quiet.as_secs_f64()
        ),
    ))
}

/// The notice that attitudes of `id` were dropped.
#[must_use]
pub fn gap(id: &str, dropped: &Dropped) -> Bytes {
    line(&json!({
        "class": "GAP", "id": id, "dropped": dropped.count,
        "first_seq": dropped.first_seq, "last_seq": dropped.last_seq,
    }))
}

/// Line of where a replay is.
#[must_use]
pub fn playback(place: &Position, session: &str) -> Bytes {
    let stamp = |at: Option<Nanos>| {
        at.map(|at| {
            let (sec, nsec) = at.to_sec_nanosec();
            json!({"sec": sec, "nsec": nsec})
        })
    };
    line(&json!({
        "class": "PLAYBACK", "state": place.mode.name(), "at": stamp(place.at),
        "start": stamp(place.start), "end": stamp(place.end), "speed": place.speed,
        "file": place.file, "session": session, "overview": place.has_overview,
    }))
}

/// The state; `fields` are those of the hub.
#[must_use]
pub fn status(fields: Value) -> Bytes {
    let mut fields = fields;
    if let Some(object) = fields.as_object_mut() {
        object.insert("class".into(), json!("STATUS"));
    }
    line(&fields)
}

/// Line of a fault: of line `number` (0 = none), which begins like `near`; `suppressed` more were
/// not said since the last.
#[must_use]
pub fn error(fault: &Fault, number: u64, near: &[u8], suppressed: u64) -> Bytes {
    line(&error_object(fault, number, near, suppressed))
}

/// The same as an object.
pub(in crate::serve) fn error_object(
    fault: &Fault,
    number: u64,
    near: &[u8],
    suppressed: u64,
) -> Value {
    let mut answer = json!({"class": "ERROR", "code": fault.code, "message": fault.message});
    if let Some(fields) = answer.as_object_mut() {
        if let Some(id) = &fault.id {
            fields.insert("id".into(), json!(id));
        }
        if number > 0 {
            fields.insert("line".into(), json!(number));
        }
        if let Some(column) = fault.column {
            fields.insert("column".into(), json!(column));
        }
        if !near.is_empty() {
            fields.insert("near".into(), json!(snippet(near)));
        }
        if suppressed > 0 {
            fields.insert("suppressed".into(), json!(suppressed));
        }
    }
    answer
}
