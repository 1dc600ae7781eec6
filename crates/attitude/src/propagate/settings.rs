//! Settings of a run of the propagator, checked once. Pure.

use super::covariance::Noise;
use super::method::Method;
use crate::diagnostic::Diagnostic;
use crate::frames::{Body, In, Nav};
use crate::quaternion::Quaternion;
use crate::record::SampleKind;
use crate::setting::{EARTH_RATE, INIT, NOISE, WINDOW};
use nalgebra::Vector3;
use std::fmt;

/// Settings of a propagator.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Method by which samples become turns.
    pub method: Method,
    /// Meaning of the samples.
    pub kind: SampleKind,
    /// Attitude at the first sample, and after a reset.
    pub initial: Quaternion<Nav, Body>,
    /// Rate of the world relative to inertial space, w_in^n in rad/s, constant: Earth's for a fixed
    /// site ([`Convention::earth_rate`](crate::worlds::Convention::earth_rate)). Zero for a
    /// world that stands still, which changes no bit of the result.
    pub world_rate: In<Nav>,
    /// Noise, for the uncertainty that goes with every attitude; zeros for none.
    pub noise: Noise,
}

/// Settings that cannot be.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum SettingsError {
    /// The window is not in `smallest ..= largest` samples.
    Window {
        /// Number as given.
        given: usize,
        /// Smallest number possible: two rates, one increment.
        smallest: usize,
        /// [`LARGEST_WINDOW`](super::LARGEST_WINDOW).
        largest: usize,
    },
    /// The initial attitude is no rotation.
    Initial {
        /// Components `[w, x, y, z]`.
        wxyz: [f64; 4],
    },
    /// The world's rate is not finite, or faster than anything turns.
    WorldRate {
        /// w_in^n, rad/s.
        rate: [f64; 3],
    },
    /// A noise figure is negative, not finite, or absurd.
    Noise {
        /// Name of the term.
        name: &'static str,
        /// Value of the term.
        value: f64,
    },
}

impl From<&SettingsError> for Diagnostic {
    fn from(error: &SettingsError) -> Diagnostic {
        match error {
            SettingsError::Window {
                given,
                smallest,
                largest,
            } => Diagnostic::new(format!("a window of {given} samples cannot be used"))
                .help(format!("{WINDOW} takes {smallest} to {largest}")),
            SettingsError::Initial { wxyz } => Diagnostic::new(format!(
                "the initial attitude {wxyz:?} (w, x, y, z) is not a unit quaternion"
            ))
            .help(format!("{INIT} q=w,x,y,z with norm 1")),
            SettingsError::WorldRate { rate } => {
                Diagnostic::new(format!("the world cannot turn at {rate:?} rad/s")).help(format!(
                    "{EARTH_RATE} takes a latitude in degrees, -90 to 90"
                ))
            }
            SettingsError::Noise { name, value } => {
                Diagnostic::new(format!("noise {name} = {value} cannot be"))
                    .help(format!("{NOISE} takes numbers from 0 up, in SI units"))
            }
        }
    }
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for SettingsError {}

impl Default for Settings {
    /// Rates, the default method, from identity, no noise, a world that stands still.
    fn default() -> Self {
        Settings {
            method: Method::Auto,
            kind: SampleKind::Rate,
            initial: Quaternion::identity(),
            world_rate: In::assume(Vector3::zeros()),
            noise: Noise::default(),
        }
    }
}

/// Fastest world, rad/s: a turntable is no world, but a test may put one on it.
const FASTEST_WORLD: f64 = 10.0;

impl Settings {
    /// The initial attitude, to the last bit of norm 1.
    pub(crate) fn checked(&self) -> Result<[f64; 4], SettingsError> {
        let wxyz = self.initial.wxyz();
        let norm = wxyz.iter().map(|c| c * c).sum::<f64>().sqrt();
        if (norm - 1.0).abs() > 1e-6 || norm.is_nan() {
            return Err(SettingsError::Initial { wxyz });
        }
        let rate = self.world_rate.as_vector();
        if !rate.iter().all(|w| w.abs() <= FASTEST_WORLD) {
            return Err(SettingsError::WorldRate {
                rate: (*rate).into(),
            });
        }
        if let Some((name, value)) = self.noise.fault() {
            return Err(SettingsError::Noise { name, value });
        }
        Ok(wxyz.map(|c| c / norm))
    }
}
