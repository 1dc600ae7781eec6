//! Why a recording was not smoothed at all. Pure.

use crate::diagnostic::Diagnostic;
use std::fmt;

/// Why there is no result.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum SmoothError<E> {
    /// The samples could not be read.
    Read(E),
    /// Fewer than two samples could be used, of so many; `forceless` had no specific force.
    TooFew {
        /// Number of samples that came.
        samples: u64,
        /// Number without a force.
        forceless: u64,
    },
    /// A setting cannot be.
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Value of the setting.
        value: f64,
    },
}

impl<E: fmt::Display> From<&SmoothError<E>> for Diagnostic {
    fn from(error: &SmoothError<E>) -> Diagnostic {
        match error {
            SmoothError::Read(error) => Diagnostic::new(error.to_string()),
            SmoothError::TooFew { samples, forceless } => Diagnostic::new(format!(
                "{samples} samples, of which fewer than 2 can be used; {forceless} have no specific force"
            ))
            .help("a smoother needs the accelerometer: without it, integrate the gyro alone"),
            SmoothError::Setting { name, value } => {
                Diagnostic::new(format!("{name} = {value} cannot be"))
            }
        }
    }
}

impl<E: fmt::Display> fmt::Display for SmoothError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl<E: fmt::Debug + fmt::Display> std::error::Error for SmoothError<E> {}
