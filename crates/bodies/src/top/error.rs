//! Everything a top, a case or a method refuses, with its numbers. Pure.

use crate::inertia::InertiaError;
use crate::motion_error::MotionError;
use crate::rigid_body::NotConverged;
use std::fmt;

/// Reason why a top, a case or a method is refused.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum TopError {
    /// A quantity that must be above zero (or at least a number) is not.
    OutOfRange {
        /// Name of the parameter.
        what: &'static str,
        /// Value as given.
        value: f64,
    },
    /// The body has no axis of symmetry along z through the origin.
    NotATop {
        /// Largest entry that should be zero or a difference that should be, kg m^2 or kg m.
        defect: f64,
    },
    /// Spin too slow for steady precession at this tilt.
    NoSteadyPrecession {
        /// Body rate about the axis, rad/s.
        w3: f64,
        /// The least that has steady precession, rad/s.
        needed: f64,
    },
    /// The Euler angles have no rates there: the axis stands upright or hangs. Use the exact method.
    Singular {
        /// Nutation, rad.
        nutation: f64,
        /// Time, s.
        t: f64,
    },
    /// The top turns more than half a turn from sample to sample.
    RateTooLow {
        /// Rate as given, Hz.
        rate_hz: f64,
        /// The least that follows the rotation.
        needed_hz: f64,
    },
    /// A step of an implicit method has no solution.
    NotConverged(NotConverged),
    /// The inertia is not one.
    Inertia(InertiaError),
}

impl fmt::Display for TopError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { what, value } => write!(f, "{what} cannot be {value}"),
            Self::NotATop { defect } => write!(
                f,
                "not a symmetric top: its axis must be z through the origin, and is off by {defect:e}"
            ),
            Self::NoSteadyPrecession { w3, needed } => write!(
                f,
                "no steady precession: the spin is {w3} rad/s, and at this tilt it takes {needed} rad/s"
            ),
            Self::Singular { nutation, t } => write!(
                f,
                "the Euler angles are singular at nutation {nutation} rad, t = {t} s: use the exact method"
            ),
            Self::RateTooLow { rate_hz, needed_hz } => write!(
                f,
                "at {rate_hz} Hz the top turns more than half a turn a sample: it takes more than {needed_hz} Hz"
            ),
            Self::NotConverged(e) => write!(f, "{e}"),
            Self::Inertia(e) => write!(f, "{e}"),
        }
    }
}

impl std::error::Error for TopError {}

impl From<InertiaError> for TopError {
    fn from(e: InertiaError) -> Self {
        Self::Inertia(e)
    }
}
impl From<MotionError> for TopError {
    fn from(e: MotionError) -> Self {
        Self::OutOfRange {
            what: e.what,
            value: e.value,
        }
    }
}
impl From<NotConverged> for TopError {
    fn from(e: NotConverged) -> Self {
        Self::NotConverged(e)
    }
}
