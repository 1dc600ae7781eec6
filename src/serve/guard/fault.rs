//! Fault of a line, as its sender is answered. Pure: below all that reads or answers.

/// Fault of a line.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Fault {
    /// A name for programs.
    pub code: &'static str,
    /// A sentence for people.
    pub message: String,
    /// Byte of the line, from 1.
    pub column: Option<u64>,
    /// Id of the sensor, if one is concerned.
    pub id: Option<String>,
}

impl Fault {
    /// Stamps are in another unit than their name says.
    pub(in crate::serve) const STAMP_UNIT: &'static str = "stamp_unit";

    /// Makes one without a place.
    #[must_use]
    pub fn new(code: &'static str, message: impl Into<String>) -> Fault {
        Fault {
            code,
            message: message.into(),
            ..Fault::default()
        }
    }

    /// More sensors than one connection may send.
    #[must_use]
    pub fn too_many_sensors(most: usize) -> Fault {
        Fault::new(
            "too_many_sensors",
            format!("one connection sends at most {most} sensors"),
        )
    }
}
