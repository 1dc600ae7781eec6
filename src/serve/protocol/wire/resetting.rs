//! `RESET` lines -> what is asked, and its answer. Pure.

use super::answers::line;
use super::{Fault, NAMELESS, name, object};
use crate::config::parse_initial;
use bytes::Bytes;
use serde::Deserialize;
use serde_json::json;
use std::collections::BTreeSet;
use strapd_attitude::estimate::Initial;
use strapd_recording::text::printable;

/// Longest text of an initial attitude: four numbers with all their digits, and room.
const MAX_INIT: usize = 256;

/// Attitudes of sensors are to begin anew.
#[derive(Clone, PartialEq, Debug)]
pub struct Reset {
    /// Sensors that are meant.
    pub sensors: Sensors,
    /// Beginning of the attitude.
    pub beginning: Beginning,
}

/// Sensors that a `RESET` is for.
#[derive(Clone, PartialEq, Debug)]
pub enum Sensors {
    /// One, by its id; `None` = the one without a name.
    One(Option<String>),
    /// Several, at one instant: all of them, or none.
    These(BTreeSet<String>),
    /// Every sensor that there is and that can begin so, at one instant.
    All,
}

/// Beginning that is asked for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Beginning {
    /// Attitude of the daemon's `--init`; where that is none, heading 0.
    Unsaid,
    /// An attitude.
    At(Initial),
    /// The heading of this attitude, which is level; the tilt stays as it is.
    Heading(Initial),
}

#[derive(Deserialize)]
struct ResetObject {
    id: Option<String>,
    ids: Option<Vec<String>>,
    #[serde(default)]
    all: bool,
    init: Option<String>,
    heading: Option<f64>,
    #[serde(default)]
    tare: bool,
}

impl Sensors {
    /// Id that a fault names; `None` where more than one is meant.
    #[must_use]
    pub fn only(&self) -> Option<&str> {
        match self {
            Sensors::One(id) => Some(id.as_deref().unwrap_or(NAMELESS)),
            Sensors::These(_) | Sensors::All => None,
        }
    }
}

/// Reads what a `RESET` line asks for.
pub(super) fn read(text: &[u8]) -> Result<Reset, Fault> {
    let asked: ResetObject = object(
        text,
        "bad_reset",
        "like {\"class\":\"RESET\",\"id\":\"imu0\",\"init\":\"rpy=0,0,90\"}",
    )?;
    let id = asked.id.filter(|id| !id.is_empty());
    let id = id.as_deref().map(name).transpose()?;
    let bad = |what: String| Fault {
        id: id.clone(),
        ..Fault::new("bad_reset", what)
    };
    let heading = match (asked.tare, asked.heading) {
        (true, Some(_)) => {
            return Err(bad(
                "`tare` and `heading`: a tare is the heading 0; one of them".to_owned(),
            ));
        }
        (true, None) => Some(0.0),
        (false, heading) => heading,
    };
    let beginning = beginning(asked.init.as_deref(), heading).map_err(bad)?;
    let sensors = match (asked.ids, asked.all) {
        (None, false) => Sensors::One(id),
        (Some(ids), false) if id.is_none() && !ids.is_empty() => {
            Sensors::These(ids.iter().map(|id| name(id)).collect::<Result<_, _>>()?)
        }
        (None, true) if id.is_none() => Sensors::All,
        _ => {
            return Err(bad(
                "`id` of one sensor, `ids` of at least one, or `all`: one of them".to_owned(),
            ));
        }
    };
    Ok(Reset { sensors, beginning })
}

/// Reads where it is to begin.
fn beginning(init: Option<&str>, heading: Option<f64>) -> Result<Beginning, String> {
    match (init, heading) {
        (None, None) => Ok(Beginning::Unsaid),
        (Some(_), Some(_)) => {
            Err("`init` and `heading`: a heading leaves the tilt as it is, an init does not; one of them".to_owned())
        }
        (None, Some(heading)) => match parse_initial(&format!("rpy=0,0,{heading}")) {
            Ok(level) => Ok(Beginning::Heading(level)),
            Err(why) => Err(format!("`heading`: {}", printable(&why.to_string()))),
        },
        (Some(long), None) if long.len() > MAX_INIT => Err(format!(
            "`init` has {} bytes; at most {MAX_INIT} can mean something",
            long.len()
        )),
        (Some(init), None) => match parse_initial(init) {
            Ok(Initial::FirstOrientation) => Err(
                "`init`: there is no first orientation in the middle of a run; identity, gravity, q=w,x,y,z or rpy=roll,pitch,yaw".to_owned(),
            ),
            Ok(initial) => Ok(Beginning::At(initial)),
            Err(why) => Err(format!("`init`: {}", printable(&why.to_string()))),
        },
    }
}

/// The answer: it is taken, and holds from the sensor's next sample on.
#[must_use]
pub fn reset_answer(asked: &Reset, done: &[(String, &'static str)]) -> Bytes {
    match (&asked.sensors, done) {
        (Sensors::One(_), [(id, from)]) => line(&json!({"class": "RESET", "id": id, "from": from})),
        _ => {
            let each = done
                .iter()
                .map(|(id, from)| json!({"id": id, "from": from}));
            line(&json!({"class": "RESET", "sensors": each.collect::<Vec<_>>()}))
        }
    }
}

/// Reads a `RESET` without its class, as it is posted.
///
/// # Errors
/// The fault to answer with.
pub fn posted_reset(body: &[u8]) -> Result<Reset, Fault> {
    read(body)
}
