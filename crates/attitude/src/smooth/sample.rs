//! Samples that the smoother reads, as often as it needs to. Pure.
//!
//! Apart from [`record`](crate::record) because a log of ten hours does not fit in memory: nodes are held, samples
//! are read again in each pass, from wherever they are.

use crate::frames::{Body, In};
use crate::quaternion::BodyRate;
use crate::record::Nanos;
use nalgebra::Vector3;
use std::convert::Infallible;

/// One sample of a sensor.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sample {
    /// The instant of force and field, and the end of the interval that a mean rate is of.
    pub stamp: Nanos,
    /// Rate; of a delta angle: divided by its interval. Its meaning in time is
    /// [`SampleModel`](super::SampleModel)'s.
    pub rate: BodyRate,
    /// Specific force, m/s^2: +9.81 along the axis that points up at rest. Without one, that
    /// between its neighbours' is taken, a quarter of a second apart at most; otherwise the sample is left out.
    pub force: Option<In<Body>>,
    /// Magnetic field, uT. One that was measured only once comes once.
    pub field: Option<In<Body>>,
    /// Whether the rate is that of the end of the gyro's range, and the true one beyond.
    pub is_saturated: bool,
}

/// The numbers of a [`Sample`], for the smoother's own arithmetic, which knows no other axes.
#[derive(Clone, Copy)]
pub(super) struct Numbers {
    pub(super) stamp: Nanos,
    pub(super) rate: Vector3<f64>,
    pub(super) force: Option<Vector3<f64>>,
    pub(super) field: Option<Vector3<f64>>,
    pub(super) is_saturated: bool,
}

impl From<&Sample> for Numbers {
    fn from(sample: &Sample) -> Numbers {
        let numbers = |vector: In<Body>| *vector.as_vector();
        Numbers {
            stamp: sample.stamp,
            rate: sample.rate.0,
            force: sample.force.map(numbers),
            field: sample.field.map(numbers),
            is_saturated: sample.is_saturated,
        }
    }
}

/// Samples that can be read from the beginning, again and again.
pub trait Samples {
    /// Error of reading them.
    type Error;

    /// Gives all of them to `take`, in order, in chunks of any size: the same ones each time this is called. The
    /// result does not depend on where they are cut.
    ///
    /// # Errors
    /// Those of whatever they are read from: the smoother stops and hands the error on.
    fn pass(&mut self, take: &mut dyn FnMut(&[Sample])) -> Result<(), Self::Error>;
}

/// Samples in memory.
impl Samples for &[Sample] {
    type Error = Infallible;

    fn pass(&mut self, take: &mut dyn FnMut(&[Sample])) -> Result<(), Infallible> {
        for chunk in self.chunks(4096) {
            take(chunk);
        }
        Ok(())
    }
}
