//! A line `PACKED` -> the number of a stream, and what a line of each of its samples would say. Pure.
//!
//! Apart from the other lines because it holds no sample: what it says holds for objects that come after it.

use crate::decode::{Class, GyroUnit, Line, Undecodable, exact_name};
use crate::json_fault::JsonFault;
use crate::text::printable;
use serde::Deserialize;
use strapd_attitude::record::SampleKind;

#[derive(Deserialize)]
struct PackedObject {
    stream: u32,
    id: Option<String>,
    sample_kind: Option<String>,
    gyro_unit: Option<String>,
}

/// Why such a line binds nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unbound {
    /// Object that is not the one it should be.
    #[error(
        "{what}; expected like {{\"class\":\"PACKED\",\"stream\":1,\"id\":\"imu0\",\"sample_kind\":\"rate\"}}"
    )]
    Object {
        /// Description of the fault, fit for a terminal.
        what: String,
        /// Column, in bytes from 1.
        column: u64,
    },
    /// A word in it is not known.
    #[error("there is no {field} `{word}`; there are: {known}")]
    Word {
        /// Name of the field.
        field: &'static str,
        /// The word, fit for a terminal.
        word: String,
        /// Names that exist.
        known: String,
    },
    /// The name of its sensor is none.
    #[error(transparent)]
    Name(#[from] Undecodable),
}

/// The number of a stream of packed samples, and what each of them says as a line would.
///
/// # Errors
/// [`Unbound`].
pub fn binding(line: &[u8]) -> Result<(u32, Line), Unbound> {
    let said: PackedObject = serde_json::from_slice(line).map_err(|why| {
        let JsonFault { what, column } = why.into();
        Unbound::Object { what, column }
    })?;
    let kinds = SampleKind::ALL.map(|kind| (kind.name(), kind));
    let units = GyroUnit::ALL.map(|unit| (unit.name(), unit));
    let head = Line {
        class: Class::Rate,
        id: said.id.as_deref().map(exact_name).transpose()?,
        sample_kind: named("sample_kind", said.sample_kind.as_deref(), &kinds)?,
        // That of a RATE line that does not say.
        gyro_unit: named("gyro_unit", said.gyro_unit.as_deref(), &units)?.or(Some(GyroUnit::Rad)),
        ..Line::default()
    };
    Ok((said.stream, head))
}

/// The one of `all` that is called `word`.
fn named<T: Copy>(
    field: &'static str,
    word: Option<&str>,
    all: &[(&'static str, T)],
) -> Result<Option<T>, Unbound> {
    let Some(word) = word else { return Ok(None) };
    let found = all.iter().find(|(known, _)| *known == word);
    let found = found.ok_or_else(|| Unbound::Word {
        field,
        word: printable(word),
        known: all
            .iter()
            .map(|(known, _)| *known)
            .collect::<Vec<_>>()
            .join(", "),
    })?;
    Ok(Some(found.1))
}
