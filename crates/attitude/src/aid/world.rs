//! World of a filter's attitudes -> the world in which they are told, turned about the vertical when asked. Pure.
//!
//! Apart from the filter because nothing that it knows changes: tilt, bias and their covariances stay as they are, and
//! the rotation of the Earth stays in the filter's own world.

use crate::frames::{Body, Nav};
use crate::quaternion::{Quaternion, RotationVector};
use crate::record::{AttitudeSample, Nanos};
use nalgebra::Vector3;

/// Rotation about the vertical from the filter's world to the one that is told.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct World {
    /// Rotation now, rad.
    yaw: f64,
    /// Rotation before the last turn, rad.
    before: f64,
    /// Stamp of the first attitude after the last turn.
    since: Option<Nanos>,
    /// Number of turns.
    turns: u32,
}

impl World {
    /// Turns the world so that `attitude`, in the filter's world at `stamp`, has this heading (rad).
    pub(super) fn set_heading(
        &mut self,
        stamp: Nanos,
        attitude: &Quaternion<Nav, Body>,
        heading: f64,
    ) {
        let yaw = heading - attitude.yaw_pitch_roll().yaw;
        (self.before, self.yaw) = (self.yaw, yaw);
        self.since = Some(stamp);
        self.turns = self.turns.saturating_add(1);
    }

    /// A heading of the filter's world, as it is told now, rad.
    pub(super) fn heading(&self, yaw: f64) -> f64 {
        yaw + self.yaw
    }

    /// Returns to the filter's own world, in which an attitude begins anew; the turns stay counted.
    pub(super) fn begin_anew(&mut self) {
        (self.yaw, self.before, self.since) = (0.0, 0.0, None);
    }

    /// An attitude of the filter's world as it is told.
    pub(super) fn told(&self, sample: AttitudeSample) -> AttitudeSample {
        let is_before = self.since.is_some_and(|since| sample.stamp < since);
        let (yaw, turns) = match is_before {
            true => (self.before, self.turns.saturating_sub(1)),
            false => (self.yaw, self.turns),
        };
        let q_nb = match yaw == 0.0 {
            // To the bit.
            true => sample.q_nb,
            false => {
                let turn = RotationVector(Vector3::z() * yaw);
                let turn = Quaternion::<Nav, Nav>::from_rotation_vector(&turn);
                (turn * sample.q_nb).normalised()
            }
        };
        AttitudeSample {
            q_nb,
            reset_count: sample.reset_count.saturating_add(turns),
            ..sample
        }
    }

    /// Whether it can have come about.
    pub(super) fn is_plausible(&self) -> bool {
        // A heading and a yaw of half a turn each, whoever gave them.
        let is_turn = |yaw: f64| yaw.abs() <= 8.0;
        is_turn(self.yaw) && is_turn(self.before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quaternion::BodyRate;
    use crate::record::{AttitudeCovariance, Status};

    fn sample(stamp: i64, yaw: f64) -> AttitudeSample {
        let about = |axis: Vector3<f64>| RotationVector(axis);
        let lean =
            Quaternion::<Nav, Body>::from_rotation_vector(&about(Vector3::new(0.4, 0.0, 0.0)));
        let turn = Quaternion::<Nav, Nav>::from_rotation_vector(&about(Vector3::z() * yaw));
        AttitudeSample {
            stamp: Nanos(stamp),
            q_nb: turn * lean,
            rate: BodyRate(Vector3::zeros()),
            accel: None,
            linear_acceleration: None,
            covariance: AttitudeCovariance::default(),
            status: Status::OK,
            reset_count: 3,
            log: Nanos(0),
            temperature: None,
        }
    }

    #[test]
    fn only_what_comes_after_a_turn_is_turned_and_tilt_never() {
        let mut world = World::default();
        assert_eq!(world.told(sample(5, 0.7)), sample(5, 0.7));
        world.set_heading(Nanos(10), &sample(10, 0.7).q_nb, -2.0);
        // What is given for good of before the turn belongs to the world before.
        assert_eq!(world.told(sample(9, 0.7)), sample(9, 0.7));
        for (stamp, heading) in [(10, 0.7), (20, 1.7)] {
            let told = world.told(sample(stamp, heading));
            let angles = told.q_nb.yaw_pitch_roll();
            assert!((angles.yaw - (heading - 2.7)).abs() < 1e-12, "{angles:?}");
            assert!((angles.roll - 0.4).abs() < 1e-12, "{angles:?}");
            assert_eq!(told.reset_count, 4);
        }
        world.set_heading(Nanos(30), &sample(30, 3.0).q_nb, 3.0);
        assert!(world.is_plausible());
        assert_eq!(world.told(sample(30, 3.0)).q_nb, sample(30, 3.0).q_nb);
        assert_eq!(world.told(sample(20, 1.7)).reset_count, 4);
    }
}
