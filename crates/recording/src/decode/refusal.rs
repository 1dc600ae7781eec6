//! Why a channel or a payload could not be decoded. Pure.
//!
//! Apart from the decoders so that every one of them refuses in the same words: what, where, why,
//! and the flag that helps.

use crate::text::{printable, snippet};
use strapd_attitude::diagnostic::Diagnostic;

/// A channel this crate cannot decode: named, explained, with the flag that helps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unsupported {
    /// Topic of the channel, control characters escaped.
    pub topic: String,
    /// Message type.
    pub type_name: String,
    /// Message encoding, and schema encoding after a slash if there is one.
    pub encoding: String,
    /// Why not.
    pub why: String,
    /// Remedy; empty when there is none.
    pub help: String,
}

/// Why a type is not read whose definition is not there.
pub(super) const UNDEFINED: &str =
    "its schema text is empty, and the type is none of the well-known ones";

/// Help for a recording that holds no definition of `kind`.
pub(crate) fn defining(kind: &str) -> String {
    let package = kind.split('/').next().unwrap_or_default();
    format!(
        "ROS 2 before Iron wrote no definitions; where {package} is installed, this writes an MCAP that has them: echo '{{output_bags: [{{uri: defined, storage_id: mcap, all: true, all_topics: true}}]}}' > defined.yaml && ros2 bag convert -i RECORDING -o defined.yaml"
    )
}

impl Unsupported {
    /// Whether nothing says what its messages hold, so that no field of them has a name. Those of `std_msgs` have none
    /// that could be a rate.
    #[must_use]
    pub(crate) fn is_undefined(&self) -> bool {
        self.why == UNDEFINED && !self.type_name.starts_with("std_msgs/")
    }
}

impl From<&Unsupported> for Diagnostic {
    fn from(error: &Unsupported) -> Diagnostic {
        let named = |text: &str, none| {
            if text.is_empty() {
                none
            } else {
                text.to_owned()
            }
        };
        let type_name = named(&error.type_name, "no type name".to_owned());
        let encoding = named(&error.encoding, "no encoding".to_owned());
        Diagnostic::new(format!(
            "{} ({type_name}, {encoding}): {}",
            error.topic, error.why
        ))
        .help(error.help.as_str())
    }
}

impl std::fmt::Display for Unsupported {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for Unsupported {}

/// A payload that is not what its channel says. It is counted
/// ([`strapd_attitude::record::Verdict::Undecodable`]); the first one of a run is shown.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Undecodable {
    /// The payload ends inside a field.
    #[error("{have} bytes, need {need}, at {field}")]
    Short {
        /// Bytes there are.
        have: u64,
        /// Bytes there would have to be, at least.
        need: u64,
        /// The field that does not fit.
        field: String,
    },
    /// The payload goes on after its last field by more than padding.
    #[error(
        "{have} bytes, but the schema ends after {used}: this is not the schema it was written with"
    )]
    Long {
        /// Bytes there are.
        have: u64,
        /// Bytes the schema accounts for.
        used: u64,
    },
    /// A line beyond what one may be.
    #[error("a line of {have} bytes, over the limit of {limit}")]
    LongLine {
        /// Bytes there are.
        have: u64,
        /// The most there may be.
        limit: u64,
    },
    /// A row that was lost where it was stored.
    #[error("lost: {0}")]
    Lost(std::sync::Arc<str>),
    /// A line that binds no packed stream.
    #[error("{0}")]
    Unbound(Box<super::packed::Unbound>),
    /// More packed streams than are remembered.
    #[error("at most {limit} packed streams are told apart in one recording")]
    TooManyStreams {
        /// The most there may be.
        limit: u64,
    },
    /// A packed object that says nothing.
    #[error("{0}")]
    Packed(super::packed::Unreadable),
    /// A packed object of a stream that no line has spoken of.
    #[error(
        "packed stream {number}: no line before says which sensor it is, like {{\"class\":\"PACKED\",\"stream\":{number},\"id\":\"imu0\"}}"
    )]
    UnknownStream {
        /// Number of the kind.
        number: u32,
    },
    /// A CDR encapsulation this crate does not read.
    #[error("CDR encapsulation {:02x} {:02x} is {what}; only plain CDR (00 00, 00 01) is read", found[0], found[1])]
    Encapsulation {
        /// The first two bytes.
        found: [u8; 2],
        /// Meaning of the numbers.
        what: &'static str,
    },
    /// More samples in one message than a message may hold.
    #[error("more than {limit} samples in one message, at {field}")]
    TooMany {
        /// The most there may be.
        limit: u64,
        /// The repeated field.
        field: String,
    },
    /// A sensor's name that, made fit for a terminal, would be another's.
    #[error(
        "`id` {near}: a sensor's name has at most 255 bytes, and no control or invisible characters"
    )]
    Name {
        /// Beginning of the text, fit for a terminal.
        near: String,
    },
    /// Fault of a file that is read beside the samples' own.
    #[error("{file}, line {line}: {why}")]
    Beside {
        /// Name of the file, fit for a terminal.
        file: String,
        /// Number of the line, from 1.
        line: u64,
        /// Fault in it.
        why: Box<Undecodable>,
    },
    /// A row that has not the cells of its table.
    #[error("{have} cells, but {need} columns")]
    Row {
        /// Cells there are.
        have: u64,
        /// Columns of the table.
        need: u64,
    },
    /// A row under the header of another table.
    #[error("another table begins here, with other columns: put it into a file of its own")]
    OtherTable,
    /// A cell that is not what its column holds.
    #[error("column `{column}`: `{near}` {why}")]
    Cell {
        /// Name of the column.
        column: String,
        /// Beginning of the cell, fit for a terminal.
        near: String,
        /// Description of the fault.
        why: &'static str,
    },
    /// Not JSON.
    #[error("JSON, byte {offset}: {what}")]
    Json {
        /// Offset from the start of the payload.
        offset: u64,
        /// Element that was expected there.
        what: &'static str,
    },
    /// Not the protobuf wire format.
    #[error("protobuf, byte {offset}: {what}")]
    Protobuf {
        /// Offset from the start of the payload.
        offset: u64,
        /// Description of the fault.
        what: &'static str,
    },
}

/// A sensor's name as it is given: what would have to be cut or escaped for a terminal could be taken
/// for another's.
///
/// # Errors
/// [`Undecodable::Name`].
pub fn exact_name(text: &str) -> Result<String, Undecodable> {
    let shown = printable(text);
    if shown != text {
        return Err(Undecodable::Name {
            near: snippet(text.as_bytes()),
        });
    }
    Ok(shown)
}
