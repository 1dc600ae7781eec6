//! An address -> requests for ranges of what is there. I/O.
//!
//! Apart from who speaks to which store because whoever downloads sees one thing: a range, what it is of, and its
//! bytes.

use super::answer::Reply;
use super::cloud::Cloud;
use super::fault::Fault;
use super::patience::Patience;
use super::web::Web;
use std::ops::Range;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::address::Address;

/// Largest object that is believed: what is counted from what a server claims must not overflow.
const MOST: u64 = 1 << 50;

fn too_large(size: u64) -> Fault {
    Diagnostic::new(format!(
        "the server says that the object has {size} bytes, and no store takes one of more than {MOST}"
    ))
    .into()
}

/// Place of an object.
#[derive(Debug)]
pub(super) enum Place {
    Web(Web),
    Cloud(Cloud),
}

impl Place {
    /// Finds the place of what is at an address.
    pub(super) fn of(address: &Address, patience: &Patience) -> Result<Place, Diagnostic> {
        Ok(match address.scheme().as_str() {
            "http" | "https" => Place::Web(Web::of(address, *patience)?),
            _ => Place::Cloud(Cloud::of(address, *patience)?),
        })
    }

    /// Asks for a range.
    pub(super) async fn get(&self, range: Range<u64>) -> Result<Reply, Fault> {
        let reply = match self {
            Place::Web(web) => web.get(range).await,
            Place::Cloud(cloud) => cloud.get(range).await,
        }?;
        match &reply {
            Reply::Part(part) if part.version.size > MOST => Err(too_large(part.version.size)),
            Reply::All {
                size: Some(size), ..
            } if *size > MOST => Err(too_large(*size)),
            _ => Ok(reply),
        }
    }

    /// Help for an answer with this status.
    pub(super) fn help(&self, status: u16) -> String {
        match self {
            Place::Web(_) => match status {
                401 | 403 => {
                    "a signed address holds all that is needed, until it expires; others: save it to a file first"
                        .to_owned()
                }
                _ => String::new(),
            },
            Place::Cloud(cloud) => cloud.help(status),
        }
    }
}
