//! Failure of a request -> whether to try again, and the words for it. Pure.
//!
//! Words are our own throughout: what a server or a client says of a request repeats its address, and what is secret
//! in it.

use reqwest::StatusCode;
use std::time::Duration;
use strapd_attitude::diagnostic::Diagnostic;

/// A request that brought nothing, or less than it should have.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Fault {
    /// Failure that may pass; the server may have stated when.
    Passing {
        what: String,
        asked: Option<Duration>,
    },
    /// The server said no.
    Refused(u16),
    /// Failure that stays.
    Lasting(Diagnostic),
}

/// Text for an object that is another than at first.
const CHANGED: &str = "the object changed while it was read";

impl Fault {
    pub(super) fn passing(what: impl Into<String>) -> Fault {
        Fault::Passing {
            what: what.into(),
            asked: None,
        }
    }

    pub(super) fn changed() -> Fault {
        Diagnostic::new(CHANGED)
            .help("read it when nobody writes it, or save it to a file first")
            .into()
    }

    /// An answer that brings nothing of the object.
    pub(super) fn status(status: StatusCode, asked: Option<Duration>) -> Fault {
        let is_passing = status.is_server_error()
            || status == StatusCode::TOO_MANY_REQUESTS
            || status == StatusCode::REQUEST_TIMEOUT;
        match is_passing {
            true => Fault::Passing {
                what: in_words(status.as_u16()),
                asked,
            },
            false => Fault::Refused(status.as_u16()),
        }
    }

    /// Diagnostic for whoever asked; `help` has what helps where the server states a status.
    pub(super) fn told(self, help: impl Fn(u16) -> String) -> Diagnostic {
        match self {
            Fault::Passing { what, .. } => Diagnostic::new(what),
            Fault::Lasting(what) => what,
            Fault::Refused(status) => {
                let said = Diagnostic::new(in_words(status));
                match help(status) {
                    help if help.is_empty() => said,
                    help => said.help(help),
                }
            }
        }
    }
}

impl From<Diagnostic> for Fault {
    fn from(what: Diagnostic) -> Fault {
        Fault::Lasting(what)
    }
}

/// `404 Not Found`.
fn in_words(status: u16) -> String {
    let name = StatusCode::from_u16(status).ok();
    match name.and_then(|status| status.canonical_reason()) {
        Some(name) => format!("the server says {status} {name}"),
        None => format!("the server says {status}"),
    }
}

/// `Retry-After` in seconds; a date is not looked at.
pub(super) fn asked(headers: &reqwest::header::HeaderMap) -> Option<Duration> {
    let value = headers.get(reqwest::header::RETRY_AFTER)?.to_str().ok()?;
    value.trim().parse().ok().map(Duration::from_secs)
}
