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
    /// Attitude at which it begins; `None` = as the daemon's `--init` states.
    pub initial: Option<Initial>,
}

#[derive(Deserialize)]
struct ResetObject {
    id: Option<String>,
    init: Option<String>,
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
    let initial = match asked.init.as_deref() {
        None => None,
        Some(long) if long.len() > MAX_INIT => {
            return Err(bad(format!(
                "`init` has {} bytes; at most {MAX_INIT} can mean something",
                long.len()
            )));
        }
        Some(init) => match parse_initial(init) {
            Ok(Initial::FirstOrientation) => {
                return Err(bad(
                    "`init`: there is no first orientation in the middle of a run; identity, gravity, q=w,x,y,z or rpy=roll,pitch,yaw".to_owned(),
                ));
            }
            Ok(initial) => Some(initial),
            Err(why) => return Err(bad(format!("`init`: {}", printable(&why.to_string())))),
        },
    };
    Ok(Reset { id, initial })
}

/// The answer: it is taken, and holds from the sensor's next sample on.
#[must_use]
pub fn reset_answer(asked: &Reset, origin: &str) -> Bytes {
    line(&json!({"class": "RESET", "id": asked.sensor(), "from": origin}))
}
