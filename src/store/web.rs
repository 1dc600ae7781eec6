//! A range of what is at an `http` or `https` address. I/O.
//!
//! By requests of our own and not by those of `object_store`, whose store for HTTP is one for WebDAV: it asks for the
//! size by HEAD, which an
//! address signed for GET refuses, and takes the query from an address, which is where the signature is.

use super::answer::{Body, Part, Reply, Version};
use super::client;
use super::fault::{Fault, asked};
use super::patience::Patience;
use futures_util::StreamExt;
use reqwest::header::{
    ACCEPT_ENCODING, CONTENT_ENCODING, CONTENT_RANGE, ETAG, HeaderMap, HeaderName, LAST_MODIFIED,
    RANGE,
};
use reqwest::{Client, Response, StatusCode, Url};
use std::ops::Range;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::address::Address;

/// An address, and who asks.
pub(super) struct Web {
    url: Url,
    client: Client,
    patience: Patience,
}

/// Debug text without what is secret in the address.
impl std::fmt::Debug for Web {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Web({})", Address::from(self.url.as_str()))
    }
}

impl Web {
    pub(super) fn of(address: &Address, patience: Patience) -> Result<Web, Diagnostic> {
        let url = Url::parse(address.typed())
            .map_err(|e| Diagnostic::new(format!("is no address: {e}")))?;
        Ok(Web {
            client: client::of_web(url.scheme() == "http", &patience)?,
            url,
            patience,
        })
    }

    pub(super) async fn get(&self, range: Range<u64>) -> Result<Reply, Fault> {
        let last = range.end.saturating_sub(1);
        let request = self
            .client
            .get(self.url.clone())
            .header(RANGE, format!("bytes={}-{last}", range.start))
            .header(ACCEPT_ENCODING, "identity");
        let reply = request.send().await;
        let reply = reply.map_err(|e| client::fault(&e, &self.patience))?;
        let headers = reply.headers();
        let tag = text(headers, &ETAG).or_else(|| text(headers, &LAST_MODIFIED));
        match reply.status() {
            StatusCode::PARTIAL_CONTENT => {
                is_plain(headers)?;
                let (start, size) = text(headers, &CONTENT_RANGE)
                    .as_deref()
                    .and_then(content_range)
                    .ok_or_else(|| no_range("it does not say which part of how much it sends"))?;
                if start != range.start {
                    return Err(no_range("it sends another part than it was asked for"));
                }
                Ok(Reply::Part(Part {
                    version: Version { size, tag },
                    start,
                    body: self.body(reply),
                }))
            }
            StatusCode::OK => {
                is_plain(headers)?;
                Ok(Reply::All {
                    size: reply.content_length(),
                    body: self.body(reply),
                })
            }
            StatusCode::RANGE_NOT_SATISFIABLE => {
                let of = text(headers, &CONTENT_RANGE);
                let of = of.as_deref().and_then(|of| of.strip_prefix("bytes */"));
                match of.and_then(|size| size.trim().parse().ok()) {
                    // It is shorter than where it was to be read.
                    Some(size) => Ok(Reply::Part(Part {
                        version: Version { size, tag },
                        start: range.start,
                        body: futures_util::stream::empty().boxed(),
                    })),
                    None => Err(Fault::Refused(reply.status().as_u16())),
                }
            }
            status => Err(Fault::status(status, asked(headers))),
        }
    }

    fn body(&self, reply: Response) -> Body {
        let patience = self.patience;
        reply
            .bytes_stream()
            .map(move |bytes| bytes.map_err(|e| client::fault(&e, &patience)))
            .boxed()
    }
}

fn text(headers: &HeaderMap, name: &HeaderName) -> Option<String> {
    Some(headers.get(name)?.to_str().ok()?.to_owned())
}

/// A packed answer has other bytes than the object.
fn is_plain(headers: &HeaderMap) -> Result<(), Fault> {
    match text(headers, &CONTENT_ENCODING).as_deref() {
        None | Some("" | "identity") => Ok(()),
        Some(_) => Err(no_range("it sends it packed, though it was asked not to")),
    }
}

/// Beginning of a part, and its size, of `bytes 0-99/1000`.
fn content_range(text: &str) -> Option<(u64, u64)> {
    let (part, size) = text.strip_prefix("bytes ")?.split_once('/')?;
    let (start, end) = part.split_once('-')?;
    let (start, end): (u64, u64) = (start.trim().parse().ok()?, end.trim().parse().ok()?);
    let size: u64 = size.trim().parse().ok()?;
    (start <= end && end < size).then_some((start, size))
}

fn no_range(what: &str) -> Fault {
    Diagnostic::new(format!("the server cannot be read from: {what}"))
        .help("save it to a file first")
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_believed_where_it_is_one() {
        for (text, read) in [
            ("bytes 0-99/1000", Some((0, 1000))),
            ("bytes 999-999/1000", Some((999, 1000))),
            ("bytes 5-4/1000", None),
            ("bytes 0-1000/1000", None),
            ("bytes 0-99/*", None),
            ("0-99/1000", None),
            ("bytes */1000", None),
        ] {
            assert_eq!(content_range(text), read, "{text}");
        }
    }
}
