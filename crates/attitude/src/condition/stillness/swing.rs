//! Directions of gravity in the body, and what the gyro reads between them -> whether it reads a turn. Pure.
//!
//! A stage of its own because both who looks for rests in a file and the filter on the way ask it: about any axis but
//! the vertical a steady turn takes gravity along, and a bias moves nothing.

use crate::plausible::{are_numbers, is_amount};
use nalgebra::Vector3;

/// Least angle that the gyro must have read for it to be judged, rad (0.25 deg).
const LEAST: f64 = 0.0044;
/// A rate across the vertical that is no matter, turn or not, rad/s (0.1 deg/s).
const SLOW: f64 = 0.0017;
/// Share of what the gyro reads from which gravity follows it.
const FOLLOWS: f64 = 0.5;
/// Square of the sigmas by which it must.
const SURE: f64 = 9.0;

/// Motion of gravity in the body against that by which the gyro's reading would move it: sums over steps.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Swing {
    /// Steps.
    steps: f64,
    /// Product of the two.
    seen: f64,
    /// Square of the one the gyro reads.
    read: f64,
    /// Square of the one that is seen.
    moved: f64,
}

impl Swing {
    /// Takes a step of `secs` in which gravity went from one direction to another (any length) and the gyro read
    /// `rate`, rad/s.
    pub(crate) fn take(&mut self, [from, to]: [&Vector3<f64>; 2], rate: &Vector3<f64>, secs: f64) {
        let (Some(from), Some(to)) = (from.try_normalize(0.0), to.try_normalize(0.0)) else {
            return;
        };
        let (read, seen) = (from.cross(rate) * secs, to - from);
        self.steps += 1.0;
        self.seen += read.dot(&seen);
        self.read += read.norm_squared();
        self.moved += seen.norm_squared();
    }

    /// Whether gravity follows the gyro by more than noise can: then what it reads is a turn.
    pub(crate) fn is_turn(&self) -> bool {
        let product = self.seen * self.seen;
        let left = (self.moved * self.read - product).max(0.0);
        self.read * self.steps > LEAST * LEAST
            && self.seen > FOLLOWS * self.read
            && product * (2.0 * self.steps - 1.0) > SURE * left
    }

    /// Whether steps of `secs` have not told yet whether a rate of this size is a turn.
    pub(crate) fn is_open(&self, secs: f64) -> bool {
        self.read * self.steps <= LEAST * LEAST && self.read > (SLOW * secs).powi(2) * self.steps
    }

    /// Whether it can have come about.
    pub(crate) fn is_plausible(&self) -> bool {
        let Swing {
            steps,
            seen,
            read,
            moved,
        } = *self;
        [steps, read, moved].into_iter().all(is_amount) && are_numbers(&[seen])
    }
}
