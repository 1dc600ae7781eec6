//! State of the filter: what it knows after each sample, and a restarted process goes on from. Pure.
//!
//! Apart from the settings because this is what is saved, as it is: a new field is added here alone, with
//! `serde(default)`, since older files do not have it, and with its bound in `is_plausible` of the
//! [memory](super::memory).

use super::calibration::Calibration;
use super::covariance::Covariance;
use super::drift::Drift;
use super::filter::Report;
use super::interval::Interval;
use super::plausibility::Plausibility;
use super::residuals::Residuals;
use super::rest::Rest;
use super::surroundings::Surroundings;
use super::vertical::Vertical;
use crate::clipped_run::ClippedRun;
use crate::frames::Nav;
use crate::quaternion::Quaternion;
use nalgebra::Vector3;

/// State of a [`Filter`](super::Filter).
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct State {
    /// Whether tilt and heading have begun.
    pub(super) is_started: bool,
    pub(super) calibration: Calibration,
    pub(super) covariance: Covariance,
    /// Rotation of the propagator's attitude, from the left.
    #[cfg_attr(feature = "serde", serde(with = "crate::quaternion::numbers"))]
    pub(super) correction: Quaternion<Nav, Nav>,
    /// Velocity and position of the motion, horizontal, m/s and m.
    pub(super) velocity: [f64; 2],
    pub(super) position: [f64; 2],
    /// Disturbance of the field's heading, rad.
    pub(super) disturbance: f64,
    pub(super) interval: Interval,
    pub(super) rest: Rest,
    pub(super) residuals: Residuals,
    pub(super) mean_acceleration: Vector3<f64>,
    /// Usual length of the mean force, m/s^2, 0 before the first: gravity as this accelerometer reads it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) usual_length: f64,
    /// The vertical in the interval before, body axes.
    pub(super) last_up: Option<Vector3<f64>>,
    /// Nothing seen in a file that is older than these two fields.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) vertical: Vertical,
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) drift: Drift,
    pub(super) surroundings: Surroundings,
    /// Whether a gap has been too long for the tilt to be known.
    pub(super) wants_level: bool,
    /// Time between samples, s; 0 before it is known.
    pub(super) nominal: f64,
    pub(super) gaps_in_a_row: u32,
    pub(super) last_rate: Vector3<f64>,
    /// The last specific force, earth axes, and how long ago it was, s.
    pub(super) last_force: Option<Vector3<f64>>,
    pub(super) since_force: f64,
    pub(super) plausibility: Plausibility,
    /// Samples at the end of the gyro's range, up to now.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) clipped: ClippedRun,
    /// Whether the gyro was found to be none of its class, and its scale and axes are looked for farther off.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) is_widened: bool,
    /// Logarithm of how many times likelier the sensor is of the [other class](super::OtherClass).
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) class_log: f64,
    pub(super) report: Report,
}
