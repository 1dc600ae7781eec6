//! RateSample -> Reading: the gyro of a stream, held against its accelerometer. Pure.
//!
//! Apart from the estimator because it changes no attitude: it looks at what was conditioned, in the axes of the sensor,
//! where an exchanged axis is one.

use crate::consistency::{Consistency, Reading};
use crate::frames::{Body, In};
use crate::record::{Join, Nanos, RateSample};
use nalgebra::Matrix3;

/// Longest time for which a force that came in a message of its own holds, ns.
const HELD_NANOS: i64 = 25_000_000;

/// Watch over the gyro of a stream.
#[derive(Clone, Debug)]
pub(super) struct GyroWatch {
    consistency: Consistency,
    /// Body axes to those of the sensor.
    to_sensor: Matrix3<f64>,
    /// The last force of its own.
    force: Option<(Nanos, In<Body>)>,
}

impl GyroWatch {
    /// Watch over a sensor whose columns `to_body` takes to body axes.
    pub(super) fn new(to_body: &Matrix3<f64>, consistency: Consistency) -> GyroWatch {
        GyroWatch {
            consistency,
            to_sensor: to_body.transpose(),
            force: None,
        }
    }

    /// Takes conditioned samples; one for which there is no force breaks the run.
    pub(super) fn push(&mut self, samples: &[RateSample]) {
        for sample in samples {
            if matches!(sample.join, Join::Hold | Join::Reset) {
                self.consistency.interrupt();
            }
            let held = self
                .force
                .filter(|(stamp, _)| (0..=HELD_NANOS).contains(&sample.stamp.since(*stamp)));
            let Some(force) = sample.accel.or(held.map(|(_, force)| force)) else {
                self.consistency.interrupt();
                continue;
            };
            let gyro = sample.gyro;
            self.consistency.push(&Reading {
                stamp: sample.stamp,
                gyro: gyro.with(self.to_sensor * gyro.as_vector()),
                force: self.to_sensor * force.as_vector(),
            });
        }
    }

    /// Takes a force that came in a message of its own.
    pub(super) fn take_force(&mut self, stamp: Nanos, force: In<Body>) {
        self.force = Some((stamp, force));
    }

    /// Gyro against accelerometer as far as was seen.
    pub(super) fn consistency(&self) -> &Consistency {
        &self.consistency
    }
}
