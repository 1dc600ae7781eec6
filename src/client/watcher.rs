//! Lines of a daemon -> attitudes, state, complaints. I/O.

use super::link::{Heard, Link};
use super::numbers::Numbers;
use super::remote::Remote;
use crate::client::secret::Secret;
use serde::Deserialize;
use std::borrow::Cow;
use strapd_recording::attitude_line::Attitude;
use strapd_recording::decode::framing::{Framed, Framer};
use strapd_recording::decode::packed::Form;
use strapd_recording::text::printable;

/// Longest line that is read: the `STATUS` of a thousand sensors.
const MAX_LINE: usize = 4 << 20;

/// Meaning of one line.
#[derive(Debug, PartialEq)]
pub enum Said<'a> {
    /// An attitude: the line as it came.
    Attitude(&'a [u8]),
    /// An attitude that came packed.
    Packed(Attitude),
    /// We were too slow for so many attitudes of a sensor.
    Gap {
        /// Id of the sensor.
        id: String,
        /// Number dropped.
        dropped: u64,
    },
    /// The answer to `POLL`: the line as it came.
    Status(&'a [u8]),
    /// Something is wrong, in words.
    Complaint(String),
}

/// Somebody who watches.
#[derive(Debug)]
pub struct Watcher {
    link: Link,
    framer: Framer,
    buffer: Vec<u8>,
    numbers: Numbers,
    /// Last complaint of the daemon: why it closes, if it does.
    complaint: Option<String>,
}

#[derive(Deserialize)]
struct Object<'a> {
    #[serde(borrow, default)]
    class: Cow<'a, str>,
    #[serde(borrow, default)]
    code: Cow<'a, str>,
    #[serde(borrow, default)]
    message: Cow<'a, str>,
}

#[derive(Deserialize)]
struct Gap {
    #[serde(default)]
    id: String,
    #[serde(default)]
    dropped: u64,
}

/// The request for the attitudes of `ids` (all when there are none), thinned to `rate_hz`.
#[must_use]
pub fn request(ids: &[String], rate_hz: Option<f64>, form: Form) -> String {
    let mut request = serde_json::json!({"class": "WATCH", "streams": ["ATT"]});
    if let Some(fields) = request.as_object_mut() {
        if form == Form::Packed {
            fields.insert("packed".to_owned(), true.into());
        }
        if !ids.is_empty() {
            fields.insert("ids".to_owned(), ids.into());
        }
        if let Some(rate_hz) = rate_hz {
            fields.insert("rate_hz".to_owned(), rate_hz.into());
        }
    }
    request.to_string()
}

impl Watcher {
    /// Connects and asks, where asking is possible.
    ///
    /// # Errors
    /// In words.
    pub async fn connect(
        remote: &Remote,
        token: Option<&Secret>,
        request: &str,
    ) -> Result<Watcher, String> {
        let mut watcher = Watcher::open(remote, token).await?;
        if watcher.link.is_two_way() {
            let asked = watcher.link.send(request).await;
            asked.map_err(|e| e.to_string())?;
        }
        Ok(watcher)
    }

    /// Connects, shows the token where one is given, and asks for nothing.
    ///
    /// # Errors
    /// In words.
    pub(super) async fn open(remote: &Remote, token: Option<&Secret>) -> Result<Watcher, String> {
        let link = Link::connect(remote, token.map(Secret::reveal), MAX_LINE).await?;
        let mut watcher = Watcher {
            link,
            framer: Framer::with_limit(MAX_LINE),
            buffer: Vec::new(),
            numbers: Numbers::default(),
            complaint: None,
        };
        let is_web = matches!(remote, Remote::WebSocket { .. });
        if let Some(token) = token.filter(|_| !is_web && watcher.link.is_two_way()) {
            let auth = serde_json::json!({"class": "AUTH", "token": token.reveal()});
            let shown = watcher.link.send(&auth.to_string()).await;
            shown.map_err(|e| e.to_string())?;
        }
        Ok(watcher)
    }

    /// The other end, for who says more than a request.
    pub(super) fn link(&mut self) -> &mut Link {
        &mut self.link
    }

    /// Peer at the other end.
    #[must_use]
    pub fn peer(&self) -> &str {
        self.link.peer()
    }

    /// Asks for the state; the answer comes with [`Watcher::next`].
    ///
    /// # Errors
    /// The daemon has gone, in words.
    pub async fn poll(&mut self) -> Result<(), String> {
        if !self.link.is_two_way() {
            return Ok(());
        }
        self.link
            .send(r#"{"class":"POLL"}"#)
            .await
            .map_err(|e| e.to_string())
    }

    /// Waits for what comes next and hands it over; `take` says whether to go on. May be dropped and
    /// called again: nothing is lost.
    ///
    /// # Errors
    /// The daemon has gone, in words.
    pub async fn next(&mut self, take: &mut impl FnMut(Said<'_>) -> bool) -> Result<bool, String> {
        let heard = match self.link.read(&mut self.buffer).await {
            Ok(heard) => heard,
            Err(why) => return Err(self.ended(&why.to_string())),
        };
        let (complaint, numbers) = (&mut self.complaint, &mut self.numbers);
        let mut goes_on = true;
        let mut framed = |framed: Framed<'_>| {
            let said = match framed {
                Framed::Line(_, line) => understood(line, numbers),
                Framed::Packed(_, object) => Some(match numbers.attitude(object) {
                    Ok(attitude) => Said::Packed(attitude),
                    Err(why) => Said::Complaint(why),
                }),
                Framed::TooLong(..) => Some(Said::Complaint(format!(
                    "it says a line of more than {MAX_LINE} bytes; skipped"
                ))),
                Framed::Broken(_) => Some(Said::Complaint(
                    "a packed object without a length; skipped up to the next line end".to_owned(),
                )),
            };
            if let Some(said) = said {
                if let Said::Complaint(what) = &said {
                    *complaint = Some(what.clone());
                }
                goes_on = take(said);
            }
            goes_on
        };
        self.framer.feed(&self.buffer, &mut framed);
        match heard {
            Heard::Bytes => {}
            Heard::Message => self.framer.finish(&mut framed),
            Heard::Closed(words) => {
                self.framer.finish(&mut framed);
                if goes_on {
                    return Err(self.ended(&words.map_or_else(
                        || "it has closed the connection".to_owned(),
                        |w| format!("it has closed the connection: {w}"),
                    )));
                }
            }
        }
        Ok(goes_on)
    }

    /// Text of how it ended, with the daemon's last complaint.
    pub(super) fn ended(&self, how: &str) -> String {
        match &self.complaint {
            Some(complaint) => format!("{how}; it said {complaint}"),
            None => how.to_owned(),
        }
    }
}

/// Meaning of a line; `None` for what is of no use to a watcher.
fn understood<'a>(line: &'a [u8], numbers: &mut Numbers) -> Option<Said<'a>> {
    let object: Object<'_> = match serde_json::from_slice(line) {
        Ok(object) => object,
        Err(_) => {
            return Some(Said::Complaint(format!(
                "a line that is no JSON object: {}",
                strapd_recording::text::snippet(line)
            )));
        }
    };
    match &*object.class {
        "ATT" => Some(Said::Attitude(line)),
        "STATUS" => Some(Said::Status(line)),
        "GAP" => serde_json::from_slice::<Gap>(line)
            .ok()
            .map(|gap| Said::Gap {
                id: printable(&gap.id),
                dropped: gap.dropped,
            }),
        "PACKED" => numbers.learn(line).err().map(Said::Complaint),
        "ERROR" => Some(Said::Complaint(printable(&format!(
            "{}: {}",
            object.code, object.message
        )))),
        _ => None,
    }
}
