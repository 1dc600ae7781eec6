//! What the smoother reads, as often as it needs to. Pure.
//!
//! Apart from [`record`](crate::record) because a log of ten hours does not fit in memory: nodes are held, samples
//! are read again in each pass, from wherever they are.

use crate::record::Nanos;
use nalgebra::Vector3;
use std::convert::Infallible;

/// One sample of a sensor, body axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sample {
    /// The instant of force and field, and the end of the interval that a mean rate is of.
    pub stamp: Nanos,
    /// Rate, rad/s; of a delta angle: divided by its interval. Its meaning is
    /// [`SampleModel`](super::SampleModel)'s.
    pub rate: Vector3<f64>,
    /// Specific force, m/s^2: +9.81 along the axis that points up at rest. Without one, that
    /// between its neighbours' is taken, a quarter of a second apart at most; otherwise the sample is left out.
    pub force: Option<Vector3<f64>>,
    /// Magnetic field, uT. One that was measured only once comes once.
    pub field: Option<Vector3<f64>>,
}

/// Samples that can be read from the beginning, again and again.
pub trait Samples {
    /// What can go wrong when they are read.
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
