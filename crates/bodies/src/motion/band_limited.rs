//! A seed and a bandwidth -> rates that are sums of sines, and the attitude they lead to. Pure.
//!
//! The everyday case: no axis preferred, no symmetry to help an algorithm, and a highest frequency
//! that is known exactly.

use super::coning::secs;
use super::{FASTEST, MotionError, within};
use crate::double_double::DoubleDouble;
use crate::rigid_body::{self, Rates, Spin, Trajectory};
use nalgebra::Vector3;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::quaternion::kernel as quat;

/// One sine of one component of the body rate: `amplitude sin(2 pi frequency t + phase)`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sine {
    /// rad/s
    pub amplitude: f64,
    /// Hz
    pub frequency_hz: f64,
    /// rad
    pub phase: f64,
}

/// Body rates that are sums of sines.
///
/// # Accuracy
/// Rate and delta angle to a few roundings of their sums; attitude within 1e-15 rad over a minute
/// of the exact integral of those rates (`crates/bodies/tests/bodies/top.rs`).
#[derive(Clone, Debug)]
pub struct BandLimited {
    axes: [Vec<rigid_body::Sine>; 3],
    trajectory: Trajectory,
}

impl BandLimited {
    /// Most sines an axis takes.
    pub const MOST_SINES: usize = 1000;

    /// Makes it from an attitude at zero and the sines about x, y and z.
    ///
    /// # Errors
    /// [`MotionError`] for numbers that are not, frequencies or summed amplitudes above 1e5 rad/s,
    /// more than [`Self::MOST_SINES`] sines.
    pub fn new(start: Quaternion<Nav, Body>, axes: &[Vec<Sine>; 3]) -> Result<Self, MotionError> {
        for sines in axes {
            within(
                "number of sines",
                sines.len() as f64,
                Self::MOST_SINES as f64,
            )?;
            let total = sines.iter().map(|s| s.amplitude.abs()).sum();
            within("sum of amplitudes (rad/s)", total, FASTEST)?;
            for s in sines {
                within(
                    "frequency (rad/s)",
                    s.frequency_hz * std::f64::consts::TAU,
                    FASTEST,
                )?;
                within("phase (rad)", s.phase, 1e9)?;
            }
        }
        let axes: [Vec<_>; 3] = std::array::from_fn(|i| {
            axes[i]
                .iter()
                .map(|s| rigid_body::Sine {
                    amplitude: s.amplitude,
                    omega: s.frequency_hz * std::f64::consts::TAU,
                    phase: s.phase,
                })
                .collect()
        });
        let q = quat::normalised(&start.wxyz());
        let trajectory = Trajectory::new(Rates::Sines(axes.clone()), &q, &Vector3::zeros());
        Ok(Self { axes, trajectory })
    }

    /// `sines` sines an axis, frequencies spread evenly at random up to `highest_hz`, phases at
    /// random, root mean square `rms` rad/s about each axis. The same seed is the same motion
    /// everywhere.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn random(seed: u64, rms: f64, highest_hz: f64, sines: usize) -> Result<Self, MotionError> {
        within("number of sines", sines as f64, Self::MOST_SINES as f64)?;
        let mut random = SplitMix(seed);
        // Each sine has half the square of its amplitude in it.
        let amplitude = rms * (2.0 / sines.max(1) as f64).sqrt();
        let axes = std::array::from_fn(|_| {
            (0..sines)
                .map(|_| Sine {
                    amplitude,
                    frequency_hz: highest_hz * random.unit(),
                    phase: std::f64::consts::TAU * random.unit(),
                })
                .collect()
        });
        Self::new(Quaternion::identity(), &axes)
    }

    /// Attitude and body rate at `nanos` nanoseconds.
    pub fn at_nanos(&mut self, nanos: u64) -> Spin {
        let (q, w_nb_b) = self.trajectory.at(DoubleDouble::from_nanos(nanos));
        Spin {
            q_nb: Quaternion::assume_unit(q),
            w_nb_b,
        }
    }

    /// Rate of change of the body rate, rad/s^2.
    #[must_use]
    pub fn rate_change(&self, nanos: u64) -> Vector3<f64> {
        let t = DoubleDouble::from_nanos(nanos);
        Vector3::from_fn(|i, _| {
            self.axes[i]
                .iter()
                .map(|s| {
                    let phase = t * s.omega + DoubleDouble::from(s.phase);
                    s.amplitude * s.omega * phase.sin_cos().1
                })
                .sum()
        })
    }

    /// Integral of the body rate, rad.
    #[must_use]
    pub fn delta_angle(&self, from: u64, to: u64) -> Vector3<f64> {
        let middle = (DoubleDouble::from_nanos(from) + DoubleDouble::from_nanos(to)) * 0.5;
        let dt = secs(from, to);
        Vector3::from_fn(|i, _| {
            self.axes[i]
                .iter()
                .map(|s| {
                    let half = 0.5 * s.omega * dt;
                    // sin(x)/x, which a frequency of zero has too.
                    let sinc = if half == 0.0 { 1.0 } else { half.sin() / half };
                    let phase = middle * s.omega + DoubleDouble::from(s.phase);
                    s.amplitude * dt * sinc * phase.sin_cos().0
                })
                .sum()
        })
    }
}

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): integer arithmetic only, so every platform agrees.
pub(super) struct SplitMix(pub(super) u64);

impl SplitMix {
    /// Random number in `[0, 1)`, 53 bits.
    pub(super) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 53) as f64
    }
}
