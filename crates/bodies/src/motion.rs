//! A motion in closed form (or as good as) -> attitude, rate and delta angle at any instant. Pure.
//!
//! A stage of its own because an integrator can only be judged by motions whose truth no integrator
//! made. Each motion gives three things that belong together: the exact attitude, the exact body
//! rate and the exact integral of the rate over an interval (what an integrating gyro puts out, and
//! not yet a rotation). Tests integrate each from its rates by an independent method and compare.
//!
//! | motion | attitude | delta angle |
//! |---|---|---|
//! | [`ConstantRate`] | closed form | closed form |
//! | [`Coning`] | closed form | closed form |
//! | [`BandLimited`] | power series in 32 digits | closed form |
//! | [`FreeBody`] | Jacobi's functions | closed form |
//! | [`HeavyBody`] (the top) | power series in 32 digits | power series |
//! | [`Gripper`] (the youBot's arm) | closed form | Gauss's rule to rounding |
//! | [`Carried`] (gaits, vehicles, machines, hands) | closed form | Gauss's rule to rounding |
//!
//! Time is integer nanoseconds since the start.

mod band_limited;
mod carried;
mod carriers;
mod coning;
mod course;
mod free_body;
mod jet;
mod specific_force;

pub use band_limited::{BandLimited, Sine};
pub use carried::Carried;
pub use carriers::{Carrier, Worn};
pub use coning::{Coning, ConstantRate};
pub use free_body::FreeBody;
pub use specific_force::Accelerometer;

pub use crate::kinematics::Kinematics;
pub use crate::motion_error::MotionError;
pub(crate) use crate::motion_error::{FASTEST, within};

use super::rigid_body::{HeavyBody, Spin};
use super::youbot::Gripper;
use nalgebra::Vector3;

/// Any of the motions.
#[derive(Clone, Debug)]
pub enum Motion {
    /// One axis, one rate.
    ConstantRate(ConstantRate),
    /// The axis runs round a cone: the worst case of attitude integration.
    Coning(Coning),
    /// Sums of sines about each axis.
    BandLimited(Box<BandLimited>),
    /// A free body with three different moments of inertia.
    FreeBody(Box<FreeBody>),
    /// A top, or any body about a fixed point under gravity.
    HeavyBody(Box<HeavyBody>),
    /// An IMU on the gripper of the youBot's arm.
    Gripper(Box<Gripper>),
    /// Carried by somebody or something that accelerates.
    Carried(Box<Carried>),
}

impl Motion {
    /// Attitude and body rate at `nanos` nanoseconds.
    pub fn at_nanos(&mut self, nanos: u64) -> Spin {
        match self {
            Self::ConstantRate(m) => m.at_nanos(nanos),
            Self::Coning(m) => m.at_nanos(nanos),
            Self::BandLimited(m) => m.at_nanos(nanos),
            Self::FreeBody(m) => m.at_nanos(nanos),
            Self::HeavyBody(m) => m.at_nanos(nanos),
            Self::Gripper(m) => m.at_nanos(nanos),
            Self::Carried(m) => m.at_nanos(nanos),
        }
    }

    /// Integral of the body rate over `from..to` in nanoseconds, rad.
    pub fn delta_angle(&mut self, from: u64, to: u64) -> Vector3<f64> {
        match self {
            Self::ConstantRate(m) => m.delta_angle(from, to),
            Self::Coning(m) => m.delta_angle(from, to),
            Self::BandLimited(m) => m.delta_angle(from, to),
            Self::FreeBody(m) => m.delta_angle(from, to),
            Self::HeavyBody(m) => m.delta_angle(from, to),
            Self::Gripper(m) => m.delta_angle(from, to).0,
            Self::Carried(m) => m.delta_angle(from, to),
        }
    }

    /// All that is felt at `nanos` nanoseconds. What is neither held by an arm nor carried turns about a
    /// point that stays where it is.
    pub fn kinematics(&mut self, nanos: u64) -> Kinematics {
        let (spin, rate_change) = match self {
            Self::Gripper(m) => return m.kinematics(nanos),
            Self::Carried(m) => return m.at(nanos, 0.0),
            Self::ConstantRate(m) => (m.at_nanos(nanos), Vector3::zeros()),
            Self::Coning(m) => (m.at_nanos(nanos), m.rate_change(nanos)),
            Self::BandLimited(m) => (m.at_nanos(nanos), m.rate_change(nanos)),
            Self::FreeBody(m) => {
                let spin = m.at_nanos(nanos);
                (spin, m.rate_change(&spin.w_nb_b))
            }
            Self::HeavyBody(m) => {
                let spin = m.at_nanos(nanos);
                (spin, m.rate_change(&spin))
            }
        };
        Kinematics {
            spin,
            rate_change,
            acceleration_n: Vector3::zeros(),
        }
    }
}
