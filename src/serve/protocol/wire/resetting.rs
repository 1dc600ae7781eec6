//! `RESET` lines -> what is asked, and its answer. Pure.

use super::{Fault, NAMELESS, line, name, object};
use crate::config::parse_initial;
use bytes::Bytes;
use serde::Deserialize;
use serde_json::json;
use strapd_attitude::estimate::Initial;
use strapd_recording::text::printable;

/// Longest text of an initial attitude: four numbers with all their digits, and room.
const MAX_INIT: usize = 256;

/// A sensor's attitude is to begin anew.
#[derive(Clone, PartialEq, Debug)]
pub struct Reset {
    /// Id of the sensor; `None` = the one without a name.
    pub id: Option<String>,
    /// Beginning of the attitude.
    pub beginning: Beginning,
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
    init: Option<String>,
    heading: Option<f64>,
}

impl Reset {
    /// The sensor's name.
    #[must_use]
    pub fn sensor(&self) -> &str {
        self.id.as_deref().unwrap_or(NAMELESS)
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
    let beginning = beginning(asked.init.as_deref(), asked.heading).map_err(bad)?;
    Ok(Reset { id, beginning })
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
pub fn reset_answer(asked: &Reset, origin: &str) -> Bytes {
    line(&json!({"class": "RESET", "id": asked.sensor(), "from": origin}))
}
