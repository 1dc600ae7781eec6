//! Five numbers -> joint angles, rates and torques that know their convention. Pure.
//!
//! Types of their own because the two conventions differ by sign and by up to 192.5 degrees, and
//! both are "the joint angles of the youBot" (erratum Y21).

use super::ArmError;
use super::error::bounded;

/// Number of joints.
pub const JOINTS: usize = 5;

/// The largest angle taken, rad: 160,000 turns.
const LARGEST_ANGLE: f64 = 1e6;
/// The largest rate, rad/s, and acceleration, rad/s^2.
const LARGEST_RATE: f64 = 1e5;
const LARGEST_ACCELERATION: f64 = 1e9;

/// Joint angles q of the document's table 2.1, rad; always finite.
///
/// Zero: the upper arm and forearm upright, the gripper level and forward. `theta = q + (0, pi/2, 0, 0, 0)`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TableJoints([f64; JOINTS]);

/// Joint angles u of the encoders, the youBot driver, ROS and the URDF, rad; always finite.
///
/// Zero: folded, against the stops. `q = driver_zero - u`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DriverJoints([f64; JOINTS]);

/// Angles, rates (rad/s) and accelerations (rad/s^2) in the document's convention; always finite.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TableMotion {
    q: TableJoints,
    qd: [f64; JOINTS],
    qdd: [f64; JOINTS],
}

/// Angles, rates (rad/s) and accelerations (rad/s^2) in the driver's convention; always finite.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DriverMotion {
    u: DriverJoints,
    ud: [f64; JOINTS],
    udd: [f64; JOINTS],
}

/// Joint torques that go with [`TableJoints`], N m: positive drives q up.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SeedTorques(pub [f64; JOINTS]);

/// Joint torques that go with [`DriverJoints`], N m: positive drives u up.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DriverTorques(pub [f64; JOINTS]);

impl TableJoints {
    /// All joints at zero: the document's figure 2.1a.
    pub const ZERO: Self = Self([0.0; JOINTS]);

    /// Makes them from angles in rad.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`]; [`ArmError::TooLarge`] beyond 1e6 rad. Limits are not looked at here.
    pub fn new(q: [f64; JOINTS]) -> Result<Self, ArmError> {
        bounded("joint angle (rad)", q, LARGEST_ANGLE).map(Self)
    }

    /// Makes them from angles in degrees.
    ///
    /// # Errors
    /// As [`TableJoints::new`].
    pub fn from_degrees(q: [f64; JOINTS]) -> Result<Self, ArmError> {
        Self::new(q.map(f64::to_radians))
    }

    /// Angles the library computed itself: finite by construction.
    pub(super) fn computed(q: [f64; JOINTS]) -> Self {
        Self(q)
    }

    /// The angles, rad.
    #[must_use]
    pub fn angles(&self) -> [f64; JOINTS] {
        self.0
    }

    /// Standing still here.
    #[must_use]
    pub fn at_rest(self) -> TableMotion {
        TableMotion {
            q: self,
            qd: [0.0; JOINTS],
            qdd: [0.0; JOINTS],
        }
    }
}

impl DriverJoints {
    /// Makes them from angles in rad.
    ///
    /// # Errors
    /// As [`TableJoints::new`].
    pub fn new(u: [f64; JOINTS]) -> Result<Self, ArmError> {
        bounded("joint angle (rad)", u, LARGEST_ANGLE).map(Self)
    }

    /// Makes them from angles in degrees.
    ///
    /// # Errors
    /// As [`TableJoints::new`].
    pub fn from_degrees(u: [f64; JOINTS]) -> Result<Self, ArmError> {
        Self::new(u.map(f64::to_radians))
    }

    /// The angles, rad.
    #[must_use]
    pub fn angles(&self) -> [f64; JOINTS] {
        self.0
    }

    /// The same arm in the other convention: `q = zero - u`.
    #[must_use]
    pub fn to_seed(&self, driver_zero: &[f64; JOINTS]) -> TableJoints {
        TableJoints(less(driver_zero, &self.0))
    }
}

impl TableJoints {
    /// The same arm in the other convention: `u = zero - q`.
    #[must_use]
    pub fn to_driver(&self, driver_zero: &[f64; JOINTS]) -> DriverJoints {
        DriverJoints(less(driver_zero, &self.0))
    }
}

impl TableMotion {
    /// Makes it from angles, rates in rad/s and accelerations in rad/s^2.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`]; [`ArmError::TooLarge`] beyond 1e5 rad/s or 1e9 rad/s^2.
    pub fn new(q: TableJoints, qd: [f64; JOINTS], qdd: [f64; JOINTS]) -> Result<Self, ArmError> {
        Ok(Self {
            q,
            qd: bounded("joint rate (rad/s)", qd, LARGEST_RATE)?,
            qdd: bounded("joint acceleration (rad/s^2)", qdd, LARGEST_ACCELERATION)?,
        })
    }

    /// A motion the library computed from bounded numbers: finite by construction.
    pub(super) fn computed(q: [f64; JOINTS], qd: [f64; JOINTS], qdd: [f64; JOINTS]) -> Self {
        Self {
            q: TableJoints(q),
            qd,
            qdd,
        }
    }

    /// Angles, rad.
    #[must_use]
    pub fn q(&self) -> &TableJoints {
        &self.q
    }

    /// Rates, rad/s.
    #[must_use]
    pub fn qd(&self) -> [f64; JOINTS] {
        self.qd
    }

    /// Accelerations, rad/s^2.
    #[must_use]
    pub fn qdd(&self) -> [f64; JOINTS] {
        self.qdd
    }

    /// The same motion in the other convention: `ud = -qd`.
    #[must_use]
    pub fn to_driver(&self, driver_zero: &[f64; JOINTS]) -> DriverMotion {
        DriverMotion {
            u: self.q.to_driver(driver_zero),
            ud: self.qd.map(|x| -x),
            udd: self.qdd.map(|x| -x),
        }
    }
}

impl DriverMotion {
    /// Makes it from angles, rates in rad/s and accelerations in rad/s^2.
    ///
    /// # Errors
    /// As [`TableMotion::new`].
    pub fn new(u: DriverJoints, ud: [f64; JOINTS], udd: [f64; JOINTS]) -> Result<Self, ArmError> {
        Ok(Self {
            u,
            ud: bounded("joint rate (rad/s)", ud, LARGEST_RATE)?,
            udd: bounded("joint acceleration (rad/s^2)", udd, LARGEST_ACCELERATION)?,
        })
    }

    /// Angles, rad.
    #[must_use]
    pub fn u(&self) -> &DriverJoints {
        &self.u
    }

    /// Rates, rad/s.
    #[must_use]
    pub fn ud(&self) -> [f64; JOINTS] {
        self.ud
    }

    /// Accelerations, rad/s^2.
    #[must_use]
    pub fn udd(&self) -> [f64; JOINTS] {
        self.udd
    }

    /// The same motion in the other convention: `qd = -ud`.
    #[must_use]
    pub fn to_seed(&self, driver_zero: &[f64; JOINTS]) -> TableMotion {
        TableMotion {
            q: self.u.to_seed(driver_zero),
            qd: self.ud.map(|x| -x),
            qdd: self.udd.map(|x| -x),
        }
    }
}

impl From<SeedTorques> for DriverTorques {
    fn from(tau: SeedTorques) -> Self {
        Self(tau.0.map(|x| -x))
    }
}

impl From<DriverTorques> for SeedTorques {
    fn from(tau: DriverTorques) -> Self {
        Self(tau.0.map(|x| -x))
    }
}

fn less(zero: &[f64; JOINTS], angles: &[f64; JOINTS]) -> [f64; JOINTS] {
    let mut out = *zero;
    for (o, a) in out.iter_mut().zip(angles) {
        *o -= a;
    }
    out
}
