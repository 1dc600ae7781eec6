//! Rates of one topic -> what is broken about single axes. Pure.
//!
//! Apart from the statistics of a recording because a run watches for the same, and has no others.

use super::frozen::{FrozenAxes, FrozenAxis};
use super::wrapped::{WrappedAxes, WrappedAxis};

/// Fault of one axis.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct AxisFault {
    /// Reading that it hung at.
    pub frozen: Option<FrozenAxis>,
    /// Reading that is the only one, though another axis moved.
    pub dead: Option<f64>,
    /// Range at which its numbers wrap.
    pub wrapped: Option<WrappedAxis>,
    /// Whether it hung at the end of what it reads, as a clipped one does.
    pub is_at_end: bool,
}

/// Watch over three axes.
#[derive(Clone, Copy, Debug)]
pub struct BrokenAxes {
    frozen: FrozenAxes,
    wrapped: WrappedAxes,
}

/// Reading from which an axis is at its end, as a share of its largest.
const AT_END: f64 = 0.98;

impl BrokenAxes {
    /// Watch over rates of which `rad` are one rad/s.
    #[must_use]
    pub fn new(rad: f64) -> BrokenAxes {
        BrokenAxes {
            frozen: FrozenAxes::new(rad),
            wrapped: WrappedAxes::new(rad),
        }
    }

    /// Takes the next rates; those that are not finite are passed over.
    #[inline]
    pub fn push(&mut self, gyro: &[f64; 3]) {
        if gyro.iter().all(|rate| rate.is_finite()) {
            self.frozen.push(gyro);
            self.wrapped.push(gyro);
        }
    }

    /// Faults of each axis so far.
    #[must_use]
    pub fn found(&self) -> [AxisFault; 3] {
        let (frozen, dead) = (self.frozen.found(), self.frozen.dead());
        let (wrapped, largest) = (self.wrapped.found(), self.wrapped.largest());
        std::array::from_fn(|axis| AxisFault {
            frozen: frozen[axis],
            dead: dead[axis],
            wrapped: wrapped[axis],
            is_at_end: frozen[axis]
                .is_some_and(|frozen| frozen.reading.abs() >= AT_END * largest[axis]),
        })
    }
}
