//! The Foxglove WebSocket protocol: messages of a viewer -> what it asks for; what it is told -> messages. Pure.
//!
//! Written here, on our own WebSocket: Foxglove's SDK brings 156 crates, checks no `Origin`, and has a
//! queue of its own; our limits are to hold for viewers too. The wire is that of
//! `foxglove/ws-protocol` (docs/spec.md) and, for playback, of the SDK (`protocol/common`).

pub mod frames;

use super::chunk::Dropped;
use super::position::{Action, Mode, Position};
use crate::sink::payload::Topic;
use bytes::{BufMut, Bytes};
use frames::{BINARY, TEXT, TRANSFORMS, framed, unsigned};
use serde::Deserialize;
use serde_json::{Value, json};
use strapd_attitude::record::Nanos;
use strapd_recording::json_fault::JsonFault;
use strapd_recording::text::printable;

/// The sub-protocols: that of the SDK, and the one before it.
pub const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// Most subscriptions one viewer can have.
pub const MAX_SUBSCRIPTIONS: usize = 4096;
/// Longest name of a request that is repeated.
const MAX_REQUEST_ID: usize = 256;
/// Request of a viewer.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Messages of channels: subscription and channel.
    Subscribe(Vec<(u32, u32)>),
    /// Request for no more messages.
    Unsubscribe(Vec<u32>),
    /// Playback, and the request's name.
    Playback(Vec<Action>, String),
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct TextRequest {
    op: String,
    subscriptions: Option<Vec<Subscription>>,
    subscription_ids: Option<Vec<u32>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Subscription {
    id: u32,
    channel_id: u32,
}

/// Reads a text message.
///
/// # Errors
/// What to answer with, in words.
pub fn read_text(text: &[u8]) -> Result<Request, String> {
    let request: TextRequest = serde_json::from_slice(text)
        .map_err(|why| format!("no request: {}", JsonFault::from(why).what))?;
    match (
        request.op.as_str(),
        request.subscriptions,
        request.subscription_ids,
    ) {
        ("subscribe", Some(list), _) => Ok(Request::Subscribe(
            list.iter().map(|s| (s.id, s.channel_id)).collect(),
        )),
        ("unsubscribe", _, Some(list)) => Ok(Request::Unsubscribe(list)),
        ("subscribe", None, _) => Err("subscribe: `subscriptions` is missing".to_owned()),
        ("unsubscribe", _, None) => Err("unsubscribe: `subscriptionIds` is missing".to_owned()),
        (other, ..) => Err(format!(
            "`{}` is not offered here: messages can be subscribed to, nothing else",
            strapd_recording::text::snippet(other.as_bytes())
        )),
    }
}

/// Reads a binary message.
///
/// # Errors
/// What to answer with, in words.
pub fn read_binary(bytes: &[u8]) -> Result<Request, String> {
    match bytes.split_first() {
        Some((3, rest)) => playback(rest)
            .ok_or_else(|| "playback: the message is cut short or holds no command".to_owned()),
        Some((op, _)) => Err(format!(
            "binary message {op:#04x} is not offered here: nothing can be published, no service called"
        )),
        None => Err("an empty message".to_owned()),
    }
}

/// Command, speed, whether there is a seek, its time, length of the name, the name.
fn playback(rest: &[u8]) -> Option<Request> {
    let (command, rest) = rest.split_first()?;
    let (speed, rest) = rest.split_first_chunk()?;
    let (had_seek, rest) = rest.split_first()?;
    let (seek, rest) = rest.split_first_chunk()?;
    let (length, rest) = rest.split_first_chunk()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    let name = rest
        .get(..length)
        .filter(|name| name.len() <= MAX_REQUEST_ID)?;
    let command = match command {
        0 => Action::Play,
        1 => Action::Pause,
        _ => return None,
    };
    let mut actions = Vec::new();
    if *had_seek != 0 {
        let seek = i64::try_from(u64::from_le_bytes(*seek)).unwrap_or(i64::MAX);
        actions.push(Action::Seek(Nanos(seek)));
    }
    // A speed of 0 comes with pauses and means none.
    let speed = f64::from(f32::from_le_bytes(*speed));
    if speed != 0.0 {
        actions.push(Action::Speed(speed));
    }
    actions.push(command);
    Some(Request::Playback(
        actions,
        printable(&String::from_utf8_lossy(name)),
    ))
}

fn text(value: &Value) -> Bytes {
    let text = value.to_string();
    framed(TEXT, text.as_bytes())
}

/// Message of who we are and what can be done. `place`: where the replay is; `controls`: whether the viewer is one
/// that can move it.
#[must_use]
pub fn server_info(session: &str, place: Option<&Position>, controls: bool) -> Bytes {
    let mut info = json!({
        "op": "serverInfo", "name": concat!("strapd ", env!("CARGO_PKG_VERSION")),
        "capabilities": [], "supportedEncodings": [], "metadata": {}, "sessionId": session,
    });
    if let (Some(place), Some(fields)) = (place, info.as_object_mut()) {
        let mut capabilities = vec!["time"];
        if let (true, Some(start), Some(end)) = (controls, place.start, place.end) {
            capabilities.push("playbackControl");
            for (name, at) in [("dataStartTime", start), ("dataEndTime", end)] {
                let (sec, nsec) = at.to_sec_nanosec();
                fields.insert(name.to_owned(), json!({"sec": sec.max(0), "nsec": nsec}));
            }
        }
        fields.insert("capabilities".to_owned(), json!(capabilities));
    }
    text(&info)
}

/// Message that these channels can be subscribed to.
pub(crate) fn advertise(channels: impl Iterator<Item = (u32, Topic)>) -> Bytes {
    let channels: Vec<Value> = channels
        .map(|(id, topic)| {
            json!({
                "id": id, "topic": topic.name, "encoding": "cdr", "schemaName": topic.schema_name,
                "schemaEncoding": "ros2msg", "schema": topic.schema,
            })
        })
        .collect();
    text(&json!({"op": "advertise", "channels": channels}))
}

/// The channels with these topics; the first advertisement has the transforms, too, where there are some.
pub(crate) fn channels(topics: impl Iterator<Item = (u32, Topic)>, with_transforms: bool) -> Bytes {
    let first = with_transforms.then(|| (TRANSFORMS, Topic::transforms()));
    advertise(first.into_iter().chain(topics))
}

/// Message that these channels are no more.
#[must_use]
pub fn withdrawn(channels: &[u32]) -> Bytes {
    text(&json!({"op": "unadvertise", "channelIds": channels}))
}

/// Severity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Good to know.
    Warning = 1,
    /// Something was not done.
    Error = 2,
}

/// A sentence for whoever looks.
#[must_use]
pub fn status(level: Level, message: &str) -> Bytes {
    text(&json!({"op": "status", "level": level as u8, "message": message}))
}

/// Messages of a stream were dropped.
#[must_use]
pub fn gap(id: &str, dropped: &Dropped) -> Bytes {
    text(&json!({
        "op": "status", "level": Level::Warning as u8, "id": format!("gap {id}"),
        "message": format!("{id}: {} samples were dropped, number {} to {}: this viewer is too slow",
            dropped.count, dropped.first_seq, dropped.last_seq),
    }))
}

/// Message of where a replay is; `request`: the one that is answered.
#[must_use]
pub fn playback_state(place: &Position, did_seek: bool, request: &str) -> Bytes {
    let mut message = vec![
        5,
        match place.mode {
            Mode::Playing => 0,
            Mode::Paused => 1,
            Mode::Ended => 3,
        },
    ];
    message.put_u64_le(unsigned(place.at.unwrap_or_default()));
    message.put_f32_le(place.speed as f32);
    message.put_u8(u8::from(did_seek));
    message.put_u32_le(request.len() as u32);
    message.extend_from_slice(request.as_bytes());
    framed(BINARY, &message)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::frames::{Framed, close, messages, open, time};
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn requests_are_read_and_others_answered_in_words() {
        assert_eq!(
            read_text(br#"{"op":"subscribe","subscriptions":[{"id":7,"channelId":2}]}"#),
            Ok(Request::Subscribe(vec![(7, 2)]))
        );
        assert_eq!(
            read_text(br#"{"op":"unsubscribe","subscriptionIds":[7]}"#),
            Ok(Request::Unsubscribe(vec![7]))
        );
        for (text, words) in [
            (r#"{"op":"subscribe"}"#, "subscriptions"),
            (
                r#"{"op":"getParameters","parameterNames":[]}"#,
                "getParameters",
            ),
            (
                r#"{"op":"subscribe","subscriptions":[{"id":-1,"channelId":2}]}"#,
                "no request",
            ),
            ("[", "no request"),
            ("", "no request"),
        ] {
            assert!(
                read_text(text.as_bytes()).unwrap_err().contains(words),
                "{text}"
            );
        }
        assert!(read_binary(&[]).is_err());
        assert!(read_binary(&[1, 0, 0, 0, 0]).unwrap_err().contains("0x01"));
    }

    fn control(command: u8, speed: f32, seek: Option<u64>, name: &str) -> Vec<u8> {
        let mut message = vec![3, command];
        message.put_f32_le(speed);
        message.put_u8(u8::from(seek.is_some()));
        message.put_u64_le(seek.unwrap_or_default());
        message.put_u32_le(name.len() as u32);
        message.extend_from_slice(name.as_bytes());
        message
    }

    #[test]
    fn a_control_message_is_a_command_a_speed_and_perhaps_a_seek() {
        assert_eq!(
            read_binary(&control(0, 2.0, Some(5), "a")),
            Ok(Request::Playback(
                vec![Action::Seek(Nanos(5)), Action::Speed(2.0), Action::Play],
                "a".to_owned()
            ))
        );
        assert_eq!(
            read_binary(&control(1, 0.0, None, "")),
            Ok(Request::Playback(vec![Action::Pause], String::new()))
        );
        let whole = control(0, 1.0, None, "abc");
        for cut in 1..whole.len() {
            assert!(read_binary(&whole[..cut]).is_err(), "{cut}");
        }
        assert!(read_binary(&control(2, 1.0, None, "")).is_err());
        assert!(read_binary(&control(0, 1.0, None, &"x".repeat(300))).is_err());
    }

    #[test]
    fn what_is_framed_comes_apart_again() {
        let mut stretch = Vec::new();
        stretch.extend_from_slice(&status(Level::Error, "a \u{1b} b"));
        let from = open(&mut stretch, 9, Nanos(-5));
        stretch.extend_from_slice(b"payload");
        close(&mut stretch, from);
        stretch.extend_from_slice(&time(Nanos(258)));
        let found: Vec<Framed> = messages(&stretch.into()).collect();
        let Framed::Text(said) = &found[0] else {
            unreachable!("{found:?}")
        };
        let said: Value = serde_json::from_slice(said).unwrap();
        assert_eq!(
            said,
            json!({"op": "status", "level": 2, "message": "a \u{1b} b"})
        );
        let data = [&[1, 9, 0, 0, 0][..], &[0; 8], b"payload"].concat();
        assert_eq!(found[1], Framed::Binary(data.into()));
        assert_eq!(
            found[2],
            Framed::Binary(vec![2, 2, 1, 0, 0, 0, 0, 0, 0].into())
        );
        assert_eq!(found.len(), 3);
    }

    /// 200,000 messages changed at random: read or refused, and what is refused is said shortly.
    #[test]
    fn no_message_of_a_viewer_breaks_the_reader() {
        let seeds = [
            br#"{"op":"subscribe","subscriptions":[{"id":7,"channelId":2},{"id":8,"channelId":3}]}"#.to_vec(),
            br#"{"op":"unsubscribe","subscriptionIds":[7,8]}"#.to_vec(),
            br#"{"op":"setParameters","parameters":[{"name":"a","value":[1,{"b":null}]}]}"#.to_vec(),
            control(0, 1.5, Some(1_700_000_000_000_000_000), "request-1"),
            control(1, f32::NAN, None, ""),
            vec![1, 0, 0, 0, 0, 1, 2, 3],
        ];
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let mut refused = 0;
        for round in 0..200_000 {
            let mut message = seeds[round % seeds.len()].clone();
            for _ in 0..random.random_range(0..6) {
                let at = random.random_range(0..message.len().max(1));
                match random.random_range(0..4) {
                    0 if at < message.len() => message[at] ^= 1 << random.random_range(0..8),
                    1 => message.truncate(at),
                    2 => message.insert(at.min(message.len()), random.random()),
                    _ => {
                        let piece = seeds[random.random_range(0..seeds.len())].clone();
                        message.extend_from_slice(&piece[..at.min(piece.len())]);
                    }
                }
            }
            for read in [read_text(&message), read_binary(&message)] {
                if let Err(said) = read {
                    refused += 1;
                    assert!(said.len() < 1000 && !said.contains('\u{1b}'), "{said}");
                }
            }
        }
        assert!(refused > 200_000, "{refused}");
    }
}
