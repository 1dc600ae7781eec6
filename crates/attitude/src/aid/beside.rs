//! Vectors measured beside the gyro, at stamps of their own -> what belongs to the next gyro sample. Pure.
//!
//! Apart from the filter because a magnetometer, and an accelerometer in messages of its own, are slower or
//! faster than the gyro, come late, or run on another clock; the filter is to see what fits and nothing else.

use crate::frames::Body;
use crate::plausible::are_numbers;
use crate::quaternion::{Quaternion, RotationVector};
use crate::record::Nanos;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// A vector this much older than a gyro sample does not belong to it, ns.
const APART: i64 = 500_000_000;
/// Vectors that wait for a gyro sample: seconds of the fastest sensors.
const MOST: usize = 4096;

/// Vectors on their way to gyro samples.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct VectorPairing {
    waiting: VecDeque<(Nanos, Vector3<f64>)>,
    last: Option<Vector3<f64>>,
    /// Whether one that equals the one before it is that one again.
    has_repeats: bool,
    /// Number of those that no gyro sample was near.
    pub(super) unpaired: u64,
    pub(super) paired: u64,
    /// Number of those that are no numbers.
    pub(super) not_finite: u64,
}

impl VectorPairing {
    /// Makes it for a sensor whose messages may state the same measurement several times.
    pub(crate) fn with_repeats() -> VectorPairing {
        VectorPairing {
            has_repeats: true,
            ..VectorPairing::default()
        }
    }

    /// Takes a vector, body axes.
    pub(crate) fn take(&mut self, stamp: Nanos, vector: Vector3<f64>) {
        if !vector.iter().all(|v| v.is_finite()) {
            self.not_finite += 1;
            return;
        }
        if self.has_repeats && self.last.replace(vector) == Some(vector) {
            return;
        }
        // A stamp far ahead of one that comes after it is none, or the clock was set back.
        while self
            .waiting
            .back()
            .is_some_and(|(last, _)| last.since(stamp) > APART)
        {
            self.waiting.pop_back();
            self.unpaired += 1;
        }
        if self.waiting.len() >= MOST {
            self.waiting.pop_front();
            self.unpaired += 1;
        }
        self.waiting.push_back((stamp, vector));
    }

    /// Whether it can have come about.
    pub(super) fn is_bounded(&self) -> bool {
        self.waiting.len() <= MOST && self.waiting.iter().all(|(_, vector)| are_numbers(vector))
    }

    /// Ends it: no gyro sample follows.
    pub(super) fn finish(&mut self) {
        self.unpaired += self.waiting.len() as u64;
        self.waiting.clear();
    }

    /// The mean of those that belong to the gyro sample at `stamp`, each turned on by `rate` (rad/s, body axes)
    /// from its own stamp: as the body would have seen it then.
    pub(crate) fn at(&mut self, stamp: Nanos, rate: &Vector3<f64>) -> Option<Vector3<f64>> {
        let (mut sum, mut n) = (Vector3::zeros(), 0.0);
        while let Some((own, vector)) = self.waiting.front() {
            let ago = stamp.since(*own);
            if ago < 0 {
                break;
            }
            if ago <= APART {
                sum += if ago == 0 {
                    *vector
                } else {
                    let turn = RotationVector(rate * (-1e-9 * ago as f64));
                    let turn = Quaternion::<Body, Body>::from_rotation_vector(&turn);
                    turn.to_dcm().as_matrix() * vector
                };
                n += 1.0;
                self.paired += 1;
            } else {
                self.unpaired += 1;
            }
            self.waiting.pop_front();
        }
        (n > 0.0).then(|| sum / n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: Vector3<f64> = Vector3::new(1.0, 0.0, 0.0);

    #[test]
    fn a_vector_waits_for_the_gyro_sample_at_or_after_it_and_is_turned_there() {
        let mut beside = VectorPairing::default();
        beside.take(Nanos(10_000_000), X);
        let rate = Vector3::new(0.0, 0.0, 2.0);
        assert_eq!(beside.at(Nanos(9_000_000), &rate), None);
        // The body turned by 0.2 rad to the left meanwhile: the vector is seen further right.
        let seen = beside.at(Nanos(110_000_000), &rate).unwrap_or_default();
        let (sin, cos) = 0.2_f64.sin_cos();
        assert!(
            (seen - Vector3::new(cos, -sin, 0.0)).norm() < 1e-15,
            "{seen}"
        );
        assert_eq!((beside.paired, beside.unpaired), (1, 0));
    }

    #[test]
    fn what_is_half_a_second_off_belongs_to_no_sample_and_blocks_none() {
        let mut beside = VectorPairing::default();
        let still = Vector3::zeros();
        beside.take(Nanos(0), X);
        beside.take(Nanos(9_000_000_000), X);
        beside.take(Nanos(600_000_000), X);
        assert_eq!(beside.at(Nanos(599_000_000), &still), None);
        assert_eq!(beside.at(Nanos(700_000_000), &still), Some(X));
        assert_eq!((beside.paired, beside.unpaired), (1, 2));
    }

    #[test]
    fn a_measurement_said_again_is_none_and_those_that_nobody_takes_are_bounded() {
        let mut beside = VectorPairing::with_repeats();
        for i in 0..3 {
            beside.take(Nanos(i), X);
        }
        assert_eq!(beside.waiting.len(), 1);
        for i in 0..2 * MOST as i64 {
            beside.take(Nanos(i), X * i as f64);
        }
        assert_eq!(beside.waiting.len(), MOST);
        assert_eq!(beside.unpaired, MOST as u64 + 1);
    }
}
