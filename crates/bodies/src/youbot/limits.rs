//! Joint ranges -> whether a joint vector lies in them, and which turn of an angle does. Pure.

use super::joints::{JOINTS, TableJoints};
use super::{ArmError, error::bounded};
use std::f64::consts::{PI, TAU};

/// Rounding allowed to an angle at its stop, rad.
const SLACK: f64 = 1e-9;

/// Range of every joint, rad, seed convention.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limits {
    min: [f64; JOINTS],
    max: [f64; JOINTS],
    middle: [f64; JOINTS],
}

impl Limits {
    /// Makes them from lower and upper stops, rad.
    ///
    /// # Errors
    /// Not finite, not in order, or a range of a full turn or more: a pose would then have more
    /// joint vectors than are searched.
    pub fn new(min: [f64; JOINTS], max: [f64; JOINTS]) -> Result<Self, ArmError> {
        bounded("joint limit (rad)", min, 2.0 * TAU)?;
        bounded("joint limit (rad)", max, 2.0 * TAU)?;
        for (lo, hi) in min.iter().zip(max) {
            if *lo >= hi || hi - lo >= TAU {
                return Err(ArmError::Impossible {
                    what: "a joint's range must be above zero and below a full turn (rad)",
                    value: hi - lo,
                });
            }
        }
        Ok(Self::of(min, max))
    }

    fn of(min: [f64; JOINTS], max: [f64; JOINTS]) -> Self {
        let mut middle = min;
        for (m, hi) in middle.iter_mut().zip(max) {
            *m = 0.5 * (*m + hi);
        }
        Self { min, max, middle }
    }

    /// The stops: KUKA's A1 ±169, A2 -65..90, A3 -146..151, A4 ±102.5, A5 ±167.5 degrees, turned
    /// into the document's convention (opposite signs; A4 = 0 is q4 = 90).
    ///
    /// # Source
    /// URDF limits of mas-group/youbot_description 65489aa and youbot/youbot-ros-pkg 432570a. KUKA's
    /// drawing prints -150 for A3.
    #[must_use]
    pub fn stops() -> Self {
        Self::of(
            [-169.0, -90.0, -146.0, -12.5, -167.5].map(f64::to_radians),
            [169.0, 65.0, 151.0, 192.5, 167.5].map(f64::to_radians),
        )
    }

    /// The narrower ranges at which youbot_driver stops an arm.
    ///
    /// # Source
    /// youbot_driver 814989d, `youbot-manipulator.cfg`: encoder ticks over 4000 and the gear ratio,
    /// as driver angles u, subtracted from the zero of [`super::Parameters`].
    #[must_use]
    pub fn driver(driver_zero: &[f64; JOINTS]) -> Self {
        let low = [0.010_07, 0.010_07, -5.026_55, 0.022_12, 0.110_62];
        let high = [5.840_14, 2.617_99, -0.015_71, 3.429_20, 5.641_59];
        let (mut min, mut max) = (*driver_zero, *driver_zero);
        for (m, u) in min.iter_mut().zip(high) {
            *m -= u;
        }
        for (m, u) in max.iter_mut().zip(low) {
            *m -= u;
        }
        Self::of(min, max)
    }

    /// Lower stops, rad.
    #[must_use]
    pub fn min(&self) -> [f64; JOINTS] {
        self.min
    }

    /// Upper stops, rad.
    #[must_use]
    pub fn max(&self) -> [f64; JOINTS] {
        self.max
    }

    /// Whether every joint is between its stops, 1e-9 rad allowed for rounding.
    #[must_use]
    pub fn contain(&self, q: &TableJoints) -> bool {
        self.excess(&q.angles()).iter().all(|e| *e <= SLACK)
    }

    /// The joint furthest past a stop.
    ///
    /// # Errors
    /// [`ArmError::Limit`] with the joint, its angle and its range.
    pub fn check(&self, q: &TableJoints) -> Result<(), ArmError> {
        let q = q.angles();
        let mut worst = (SLACK, None);
        for (joint, excess) in self.excess(&q).into_iter().enumerate() {
            if excess > worst.0 {
                worst = (excess, Some(joint));
            }
        }
        match worst.1 {
            None => Ok(()),
            Some(joint) => Err(ArmError::Limit {
                joint: joint + 1,
                value: q[joint],
                min: self.min[joint],
                max: self.max[joint],
            }),
        }
    }

    /// Distance of each joint past a stop, rad; negative inside.
    pub(super) fn excess(&self, q: &[f64; JOINTS]) -> [f64; JOINTS] {
        let mut out = [0.0; JOINTS];
        for (joint, o) in out.iter_mut().enumerate() {
            *o = (q[joint] - self.max[joint]).max(self.min[joint] - q[joint]);
        }
        out
    }

    /// The turn of the angle within half a turn of the middle of the joint's range, upper end
    /// included (erratum Y14: without it a fifth of the reachable poses is lost).
    ///
    /// For angles of a few turns; a far one would take long.
    pub(super) fn turned_in(&self, joint: usize, mut angle: f64) -> f64 {
        let middle = self.middle[joint];
        while angle > middle + PI {
            angle -= TAU;
        }
        while angle <= middle - PI {
            angle += TAU;
        }
        angle
    }
}
