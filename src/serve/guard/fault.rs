//! Fault of a line, as its sender is answered. Pure: below all that reads or answers.

use strapd_recording::text::printable;

/// Kind of a fault, where more follows from it than its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kind {
    /// Samples, or a line that should have brought some, that are not used.
    #[default]
    Loss,
    /// The line is no JSON object.
    NoObject,
    /// The line has a class that no client sends.
    UnknownClass,
    /// The line is of a sensor that brings no body rate.
    OtherSensor,
    /// A request that is not done: it would have brought no samples.
    Request,
    /// Another connection sends the sensor's samples.
    InUse,
    /// The sensor has just given way to another.
    GaveWay,
}

/// Fault of a line.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Fault {
    /// Kind.
    pub kind: Kind,
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
    /// Stamps do not go on.
    pub(in crate::serve) const STILL_STAMPS: &'static str = "still_stamps";

    /// Makes one without a place.
    #[must_use]
    pub fn new(code: &'static str, message: impl Into<String>) -> Fault {
        Fault {
            code,
            message: message.into(),
            ..Fault::default()
        }
    }

    /// Makes it one of this kind.
    #[must_use]
    pub fn of(self, kind: Kind) -> Fault {
        Fault { kind, ..self }
    }

    /// Whether a line with it should have brought samples.
    #[must_use]
    pub fn is_loss(&self) -> bool {
        !matches!(
            self.kind,
            Kind::UnknownClass | Kind::OtherSensor | Kind::Request
        )
    }

    /// Code and message, for the log.
    #[must_use]
    pub fn in_words(&self) -> String {
        printable(&format!("{}: {}", self.code, self.message))
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
