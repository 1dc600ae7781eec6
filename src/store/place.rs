//! An address -> requests for ranges of what is there. I/O.
//!
//! Apart from who speaks to which store because whoever downloads sees one thing: a range, what it is of, and its bytes.

use super::answer::Reply;
use super::cloud::Cloud;
use super::fault::Fault;
use super::patience::Patience;
use super::web::Web;
use std::ops::Range;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::address::Address;

/// Where an object is.
#[derive(Debug)]
pub(super) enum Place {
    Web(Web),
    Cloud(Cloud),
}

impl Place {
    /// Who is to be asked for what is at an address.
    pub(super) fn of(address: &Address, patience: &Patience) -> Result<Place, Diagnostic> {
        Ok(match address.scheme().as_str() {
            "http" | "https" => Place::Web(Web::of(address, *patience)?),
            _ => Place::Cloud(Cloud::of(address, *patience)?),
        })
    }

    /// Asks for a range.
    pub(super) async fn get(&self, range: Range<u64>) -> Result<Reply, Fault> {
        match self {
            Place::Web(web) => web.get(range).await,
            Place::Cloud(cloud) => cloud.get(range).await,
        }
    }

    /// What helps where the server says this.
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
