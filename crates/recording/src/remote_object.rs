//! An address -> what is read there as a file is: its size, and its bytes by ranges. I/O, by whoever knows the way.
//!
//! Apart from the inputs because this crate knows no way itself: to ask a server takes a runtime and a client, which
//! a reader
//! of recordings has no other use for. A program that has them says so once, at its start ([`reach_by`]); without one
//! an address is refused, with what helps.

use crate::address::Address;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::sync::{Arc, OnceLock};
use strapd_attitude::diagnostic::Diagnostic;

/// Schemes of addresses that are read.
pub const SCHEMES: [&str; 5] = ["http", "https", "s3", "gs", "az"];

/// Bytes that are somewhere else. All calls may come from any thread, and wait.
pub trait Object: Send + Sync {
    /// Number of bytes, for as long as this is read.
    fn size(&self) -> u64;

    /// Fills `into` from `offset` on; less only at the end.
    ///
    /// # Errors
    /// They cannot be had, or are others by now.
    fn read_at(&self, into: &mut [u8], offset: u64) -> io::Result<usize>;

    /// Says what will be read from now on, in this order, so that it is fetched before it is asked for, and at most
    /// `ahead` bytes before. What is read beside it is fetched by itself, and little more than that.
    fn expect(&self, ranges: Vec<Range<u64>>, ahead: u64);
}

// By its name: the vtable of every one of them would hold code that prints all its fields.
impl std::fmt::Debug for dyn Object {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Object")
    }
}

/// Object or listing at an address.
pub enum RemoteSource {
    /// Something that can be read anywhere.
    Object(Arc<dyn Object>),
    /// Something that comes once, from its beginning to its end.
    Stream(Box<dyn Read + Send>),
}

impl std::fmt::Debug for RemoteSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            RemoteSource::Object(object) => write!(f, "Found({object:?})"),
            RemoteSource::Stream(_) => f.write_str("Found(a stream)"),
        }
    }
}

/// Way to an address: what is there, or why it cannot be had. The text does not begin with the address, and holds no
/// part of it that is not printed.
pub type Way = fn(&Address) -> Result<RemoteSource, Diagnostic>;

static WAY: OnceLock<Way> = OnceLock::new();

/// Says how addresses are reached, once for this process.
///
/// # Errors
/// It was said before.
pub fn reach_by(way: Way) -> Result<(), Way> {
    WAY.set(way)
}

/// The address that a text is, if it is one that is read.
#[must_use]
pub fn meant(text: &str) -> Option<Address> {
    let address = Address::from(text);
    SCHEMES
        .contains(&address.scheme().as_str())
        .then_some(address)
}

/// Finds what is at an address.
///
/// # Errors
/// It names a user; nobody knows the way; whatever the way finds.
pub(crate) fn find(address: &Address) -> Result<RemoteSource, Diagnostic> {
    if address.names_a_user() {
        return Err(
            Diagnostic::new("an address with a user or a password is not taken").help(
                "leave out what stands before the @; the environment of a cloud has its credentials",
            ),
        );
    }
    let Some(way) = WAY.get() else {
        return Err(no_way(address));
    };
    way(address)
}

/// Refusal of an address without a way there.
fn no_way(address: &Address) -> Diagnostic {
    let place = address.place();
    let pipe = match address.scheme().as_str() {
        "s3" => format!("aws s3 cp {place} - | strapd replay -"),
        "gs" => format!("gcloud storage cat {place} | strapd replay -"),
        "az" => "azcopy brings it to a file".to_owned(),
        _ => format!("curl -s {place} | strapd replay -"),
    };
    Diagnostic::new("addresses are read by a build with the feature object-store")
        .help(format!("build it with that feature; or {pipe}"))
}

/// All of an object.
pub(crate) fn whole(object: &dyn Object) -> Vec<Range<u64>> {
    vec![Range {
        start: 0,
        end: object.size(),
    }]
}

/// An object, read as a file is.
#[derive(Clone, Debug)]
pub struct ObjectBytes {
    object: Arc<dyn Object>,
    at: u64,
}

impl ObjectBytes {
    /// Begins at the first byte.
    #[must_use]
    pub fn new(object: Arc<dyn Object>) -> ObjectBytes {
        ObjectBytes { object, at: 0 }
    }
}

impl Read for ObjectBytes {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.object.read_at(into, self.at)?;
        self.at = self.at.saturating_add(read as u64);
        Ok(read)
    }
}

impl Seek for ObjectBytes {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => self.object.size().checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = at.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn what_is_no_address_stays_a_name() {
        for (text, is_meant) in [
            ("https://h/a.mcap", true),
            ("S3://b/a.mcap", true),
            ("tcp://h:1", false),
            ("a.mcap", false),
            ("./http:/a.mcap", false),
            ("-", false),
        ] {
            assert_eq!(meant(text).is_some(), is_meant, "{text}");
        }
    }

    #[test]
    fn without_a_way_the_help_has_one_and_no_secret() {
        let said = find(&Address::from("https://h/a.mcap?key=s3cret")).err();
        let said = said.unwrap().to_string();
        assert!(said.contains("feature object-store"), "{said}");
        assert!(
            said.contains("curl -s https://h/a.mcap | strapd replay -"),
            "{said}"
        );
        assert!(!said.contains("s3cret"), "{said}");
        let said = find(&Address::from("https://ada:s3cret@h/a.mcap")).err();
        let said = said.unwrap().to_string();
        assert!(said.contains("password is not taken"), "{said}");
        assert!(!said.contains("s3cret"), "{said}");
    }
}
