//! One line -> what it asks for; what is to be said -> one line (in `answers`). Pure.
//!
//! Samples go through the same [`LineDecoder`] as a replay of lines, attitudes through the same
//! encoder as its output: here are only the objects of the conversation around them
//! (`docs/protocol.md`).

mod answers;
mod heading;
mod packing;
mod rate_shape;
mod reference;
mod resetting;

pub(in crate::serve) use answers::error_object;
pub use answers::{error, gap, heartbeat, note, playback, status, version, watching};
pub use heading::MeasuredHeading;
pub use packing::{broken_packed, packed_stream, unreadable};
pub use reference::{Reference, stream as reference_stream};
pub use resetting::{Beginning, Reset, Sensors, posted_reset, reset_answer};

use super::filter::{Class as Stream, Filter};
use super::position::Action;
use crate::serve::guard::fault::{Fault, Kind};
use serde::Deserialize;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::attitude_line::sensor_of_truth;
use strapd_recording::decode::packed::Form;
use strapd_recording::decode::{Class, Line, LineDecoder, MAX_LINE, Undecodable, exact_name};
use strapd_recording::json_fault::JsonFault;
use strapd_recording::text::printable;

/// The name of a sensor that gives none.
pub const NAMELESS: &str = "imu";
/// Version of the protocol.
pub const PROTO: u32 = 1;
/// Longest name of a sensor, in bytes.
pub const MAX_ID: usize = 255;

/// Most sensors one `WATCH` can name: as many as there are, unless more are allowed.
pub const MAX_WATCHED: usize = 1024;

/// Request of a line.
#[derive(Debug, PartialEq)]
pub enum Message {
    /// Samples of one sensor: they are in the buffer given.
    Samples(Line),
    /// Packed samples of this number are of this sensor from now on, and mean this.
    Packed(u32, Line),
    /// Start (or with `None` stop) the attitudes.
    Watch(Option<Filter>),
    /// Tell the state.
    Poll,
    /// Be elsewhere in a replay.
    Playback(Action),
    /// Begin a sensor's attitude anew; or why that cannot be, which is no fault of samples.
    Reset(Result<Reset, Fault>),
    /// Heading of a sensor, measured by something else; or why it is none, which is no fault of samples.
    Heading(Result<MeasuredHeading, Fault>),
    /// Reference against which the sensors are compared.
    Reference(Box<Reference>),
    /// Here is the token.
    Auth(String),
}

#[derive(Deserialize)]
struct WatchObject {
    #[serde(default = "yes")]
    enable: bool,
    streams: Option<Vec<String>>,
    id: Option<Ids>,
    ids: Option<Ids>,
    rate_hz: Option<f64>,
    #[serde(default)]
    packed: bool,
    #[serde(default = "yes")]
    last: bool,
}

#[derive(Deserialize)]
struct PlaybackObject {
    action: String,
    at: Option<StampObject>,
    speed: Option<f64>,
}

#[derive(Deserialize)]
struct StampObject {
    sec: i64,
    #[serde(default)]
    nsec: u32,
}

impl StampObject {
    fn nanos(self) -> Nanos {
        Nanos::from_sec_nanosec(self.sec, self.nsec)
    }
}

#[derive(Deserialize)]
struct AuthObject {
    token: String,
}

/// One name or several.
#[derive(Deserialize)]
#[serde(untagged)]
enum Ids {
    One(String),
    Several(Vec<String>),
}

fn yes() -> bool {
    true
}

/// Reads one line; samples are appended to `samples`, and only where the answer is
/// [`Message::Samples`].
///
/// # Errors
/// The [`Fault`] to answer with.
pub fn read(
    decoder: &LineDecoder,
    line: &[u8],
    received: Nanos,
    samples: &mut Vec<RawSample>,
) -> Result<Message, Fault> {
    read_from(decoder, line, received, false, samples)
}

/// Whether all there are come from other sensors than the gyro.
#[must_use]
pub fn are_beside(samples: &[RawSample]) -> bool {
    !samples.is_empty() && samples.iter().all(|s| s.is_beside)
}

/// The same of somebody we connected to: where that is a daemon, the rates of its attitudes are
/// samples (`is_source`).
///
/// # Errors
/// As [`read`].
pub fn read_from(
    decoder: &LineDecoder,
    line: &[u8],
    received: Nanos,
    is_source: bool,
    samples: &mut Vec<RawSample>,
) -> Result<Message, Fault> {
    let before = samples.len();
    // Who cuts the lines keeps them short; the object of a body may be longer.
    let head = decoder
        .decode_object(line, received, samples)
        .map_err(|why| undecodable(&why))?;
    if head.class == Class::Rate {
        // What says that it is of the gyro is, with a rate or without.
        for sample in samples.iter_mut().skip(before) {
            sample.is_beside = false;
        }
    }
    let new = samples.get(before..).unwrap_or_default();
    let has_rate = new.iter().any(|s| s.gyro.is_some());
    let class = match &head.class {
        // A sample of our own whose rate is null was one with NaN: it is counted, not passed over.
        Class::Rate if samples.len() > before => return Ok(Message::Samples(head)),
        Class::None | Class::Imu if has_rate => return Ok(Message::Samples(head)),
        Class::None if are_beside(new) => return Ok(Message::Samples(head)),
        Class::Att if is_source && has_rate => return Ok(Message::Samples(head)),
        Class::Other(class) => Some(class.clone()),
        Class::Att => Some("ATT".to_owned()),
        Class::None | Class::Imu | Class::Rate => None,
    };
    samples.truncate(before);
    if let (None, Some(sensor)) = (&class, &head.sensor)
        && sensor.starts_with("android.")
        && !sensor.contains("gyro")
    {
        return Err(Fault::new(
            "other_sensor",
            format!("`{sensor}` brings no body rate; it is passed over"),
        )
        .of(Kind::OtherSensor));
    }
    let request = |fault: Fault| fault.of(Kind::Request);
    match class.as_deref() {
        Some("PACKED") => packing::read(line).map(|(stream, head)| Message::Packed(stream, head)),
        // What a source says of itself is no request.
        Some(other) if is_source => {
            Err(Fault::new("unknown_class", other.to_owned()).of(Kind::UnknownClass))
        }
        Some("WATCH") => watch(line).map(Message::Watch).map_err(request),
        Some("POLL") => Ok(Message::Poll),
        Some("HEADING") => Ok(Message::Heading(heading::read(line))),
        Some("RESET") => Ok(Message::Reset(resetting::read(line))),
        Some("PLAYBACK") => playback_action(line).map(Message::Playback).map_err(request),
        Some("ATT") if head.id.as_deref().and_then(sensor_of_truth).is_some() => {
            let id = head.id.as_deref().unwrap_or_default();
            reference::read(id, line).map(|found| Message::Reference(Box::new(found)))
        }
        Some("AUTH") => {
            object::<AuthObject>(line, "bad_auth", "{\"class\":\"AUTH\",\"token\":\"...\"}")
                .map(|auth| Message::Auth(auth.token))
                .map_err(request)
        }
        Some(other) => Err(Fault::new(
            "unknown_class",
            format!(
                "class `{other}` is none a client sends; known: RATE, PACKED, WATCH, POLL, RESET, HEADING, PLAYBACK, AUTH"
            ),
        )
        .of(Kind::UnknownClass)),
        None => heading::bare(line).map(Message::Heading).ok_or_else(|| {
            let lacks = "the line holds no body rate and no class".to_owned();
            let what = rate_shape::of_rate(line).unwrap_or(lacks);
            Fault::new(
                "no_rate",
                format!("{what}; expected like {{\"class\":\"RATE\",\"id\":\"imu0\",\"stamp\":{{\"sec\":1,\"nsec\":0}},\"gyro\":[0.1,0,0]}}"),
            )
        }),
    }
}

fn object<'a, T: Deserialize<'a>>(
    line: &'a [u8],
    code: &'static str,
    expected: &str,
) -> Result<T, Fault> {
    serde_json::from_slice(line).map_err(|why| {
        let JsonFault { what, column } = why.into();
        Fault {
            column: Some(column),
            ..Fault::new(code, format!("{what}; expected {expected}"))
        }
    })
}

fn playback_action(line: &[u8]) -> Result<Action, Fault> {
    let bad = |message: String| Fault::new("bad_playback", message);
    let asked: PlaybackObject = object(
        line,
        "bad_playback",
        "like {\"class\":\"PLAYBACK\",\"action\":\"seek\",\"at\":{\"sec\":1,\"nsec\":0}}",
    )?;
    match (asked.action.as_str(), asked.at, asked.speed) {
        ("play", ..) => Ok(Action::Play),
        ("pause", ..) => Ok(Action::Pause),
        ("seek", Some(at), _) => Ok(Action::Seek(at.nanos())),
        ("speed", _, Some(speed)) => Ok(Action::Speed(speed)),
        ("seek", None, _) => Err(bad("seek needs `at`: {\"sec\":1,\"nsec\":0}".to_owned())),
        ("speed", _, None) => Err(bad("`speed` is missing: a factor such as 2.0".to_owned())),
        (other, ..) => Err(bad(format!(
            "there is no action `{}`; there are: play, pause, seek, speed",
            printable(other)
        ))),
    }
}

fn watch(line: &[u8]) -> Result<Option<Filter>, Fault> {
    let bad = |message: String| Fault::new("bad_watch", message);
    let asked: WatchObject = object(
        line,
        "bad_watch",
        "like {\"class\":\"WATCH\",\"enable\":true,\"streams\":[\"ATT\"],\"ids\":[\"imu0\"],\"rate_hz\":50}",
    )?;
    let classes = asked.streams.as_ref().map(|names| {
        names
            .iter()
            .map(|name| {
                [Stream::Att, Stream::Rate]
                    .into_iter()
                    .find(|class| class.name() == name)
                    .ok_or_else(|| {
                        bad(format!(
                            "there is no stream `{}`; there is: ATT, and RATE where a simulation is served",
                            printable(name)
                        ))
                    })
            })
            .collect::<Result<_, _>>()
    });
    let classes = classes.transpose()?;
    if let Some(rate_hz) = asked.rate_hz
        && crate::sink::Decimator::new(rate_hz).is_none()
    {
        return Err(bad(format!("rate_hz {rate_hz} is not a rate above 0")));
    }
    let ids = asked.ids.or(asked.id);
    if let Some(Ids::Several(ids)) = &ids
        && ids.len() > MAX_WATCHED
    {
        return Err(bad(format!(
            "{} ids; at most {MAX_WATCHED} can be named, and a WATCH without `ids` is for all sensors",
            ids.len()
        )));
    }
    let nothing = asked.streams.as_ref().is_some_and(Vec::is_empty);
    let ids = match ids {
        None => None,
        Some(Ids::One(id)) => Some([name(&id)?].into()),
        Some(Ids::Several(ids)) => Some(ids.iter().map(|id| name(id)).collect::<Result<_, _>>()?),
    };
    Ok((asked.enable && !nothing).then_some(Filter {
        classes,
        ids,
        rate_hz: asked.rate_hz,
        form: if asked.packed {
            Form::Packed
        } else {
            Form::Lines
        },
        last: asked.last,
    }))
}

/// A sensor's name, as a line gives it.
fn name(text: &str) -> Result<String, Fault> {
    exact_name(text).map_err(|why| undecodable(&why))
}

/// The fault of a line that cannot be decoded.
#[must_use]
pub fn undecodable(why: &Undecodable) -> Fault {
    match why {
        Undecodable::Json { offset, what } => Fault {
            column: Some(offset + 1),
            kind: Kind::NoObject,
            ..Fault::new("bad_json", format!("{what}, at column {}", offset + 1))
        },
        Undecodable::LongLine { .. } => too_long(),
        Undecodable::Name { .. } => Fault::new("bad_id", why.to_string()),
        other => Fault::new("undecodable", other.to_string()),
    }
}

/// The fault of a line that is too long.
#[must_use]
pub fn too_long() -> Fault {
    Fault::new(
        "line_too_long",
        format!("a line of more than {MAX_LINE} bytes; it is skipped up to its end"),
    )
}

/// The fault of samples where none are taken.
#[must_use]
pub fn samples_not_taken() -> Fault {
    Fault::new(
        "samples_not_taken",
        "this is a replay or a simulation: it has its own samples; strapd serve takes yours",
    )
}

/// The fault of a conversation that does not begin with an object, but like `beginning`.
#[must_use]
pub fn no_object(beginning: &[u8], takes_samples: bool) -> Fault {
    let what = match beginning {
        _ if is_http(beginning) => "this is HTTP",
        [0x16, 0x03, ..] => "this is TLS, which is not spoken here",
        [b'[', ..] => "the first line is an array, which only later ones may be",
        _ => "the first line is no JSON object",
    };
    let where_to = if takes_samples {
        "samples by HTTP go to POST /samples at a ws-listen:// address (http://127.0.0.1:8765/samples unless --listen says otherwise)"
    } else {
        "HTTP is answered at a ws-listen:// address"
    };
    Fault::new(
        "not_an_object",
        format!(
            "{what}; a connection begins with one JSON object on a line, or with the header of a table; {where_to}"
        ),
    )
}

/// Whether a request of HTTP begins so: a method, and where to.
fn is_http(beginning: &[u8]) -> bool {
    let method = beginning.iter().take_while(|b| b.is_ascii_uppercase());
    let letters = method.count();
    letters > 0 && beginning.get(letters) == Some(&b' ')
}

/// Whether a whole line is the first of a request of HTTP: of a browser it always is.
#[must_use]
pub fn is_request(line: &[u8]) -> bool {
    const METHODS: [&str; 10] = [
        "GET", "POST", "HEAD", "PUT", "OPTIONS", "DELETE", "PATCH", "CONNECT", "TRACE", "PRI",
    ];
    let line = line.trim_ascii();
    let first = line.split(|b| *b == b' ').next().unwrap_or_default();
    let is_method = METHODS.iter().any(|method| method.as_bytes() == first);
    (is_method && is_http(line)) || line.windows(6).any(|part| part == b" HTTP/")
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
