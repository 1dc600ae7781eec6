//! Attitudes as computed <-> attitudes as asked for: world, north, instant. Pure.

use super::plan::{EstimationSettings, Initial};
use super::preparation::Prepared;
use crate::aid;
use crate::frames::{Body, In, Nav};
use crate::quaternion::{BodyRate, Quaternion, RotationVector};
use crate::record::{AttitudeSample, LinearAcceleration};
use crate::worlds::{Convention, World};
use nalgebra::Vector3;

/// Output frame of attitudes: in which world, of which instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct OutputFrame {
    /// Delay of the sensor's own filters, s.
    pub(super) delay: f64,
    pub(super) world: World,
    /// True north to the axes of the filter, whose north is magnetic; `None` = the same.
    pub(super) north: Option<Quaternion<Nav, Nav>>,
    /// Gravity, m/s^2, where the acceleration without it is asked of an attitude that nothing corrects.
    pub(super) gravity: Option<f64>,
}

impl OutputFrame {
    /// The frame that was asked for, by what was prepared.
    pub(super) fn of(plan: &EstimationSettings, prepared: &Prepared) -> OutputFrame {
        let is_aided = prepared.aiding.is_some();
        let is_level = prepared.world != World::Start || plan.initial == Initial::Gravity;
        OutputFrame {
            delay: plan.sensor_delay_secs,
            world: prepared.world,
            north: (plan.declination != 0.0 && is_aided).then(|| turned_north(plan.declination)),
            gravity: (plan.linear_acceleration && !is_aided && is_level)
                .then(|| aid::Settings::default().gravity),
        }
    }

    /// Converts from the convention everything is computed in (ENU or start, FLU) to the one asked for: world and
    /// body change together.
    pub(super) fn apply(&self, out: &mut [AttitudeSample]) {
        let to = self
            .world
            .convention()
            .filter(|to| *to != Convention::EnuFlu);
        for sample in out {
            if let Some((force, gravity)) = sample.accel.zip(self.gravity) {
                let force = force.as_vector();
                sample.linear_acceleration = Some(LinearAcceleration::at(
                    &sample.q_nb,
                    &sample.covariance,
                    force,
                    &Vector3::zeros(),
                    gravity,
                ));
            }
            // What a sensor measured late has happened at the stamp already.
            if self.delay != 0.0 {
                let turn = sample.rate.held_for(self.delay).about_fixed_axis();
                sample.q_nb = sample.q_nb.advanced(&turn).normalised();
            }
            if let Some(north) = &self.north {
                sample.q_nb = (*north * sample.q_nb).normalised();
            }
            if let Some(to) = to {
                *sample = relabelled(sample, Convention::EnuFlu, to);
            }
        }
    }

    /// Heading (rad) of a body in the world asked for, as it is computed.
    pub(super) fn own_heading(&self, asked: f64) -> f64 {
        let turn = RotationVector(Vector3::z() * asked);
        let mut level = Quaternion::<Nav, Body>::from_rotation_vector(&turn);
        if let Some(from) = self.world.convention() {
            level = from.convert(Convention::EnuFlu, level);
        }
        if let Some(north) = &self.north {
            level = north.inverse() * level;
        }
        level.yaw_pitch_roll().yaw
    }

    /// An attitude that was asked for, as it was computed.
    pub(super) fn undone(&self, given: &AttitudeSample) -> AttitudeSample {
        let mut sample = *given;
        if let Some(from) = self.world.convention() {
            sample = relabelled(&sample, from, Convention::EnuFlu);
        }
        if let Some(north) = &self.north {
            sample.q_nb = (north.inverse() * sample.q_nb).normalised();
        }
        if self.delay != 0.0 {
            let back = sample.rate.held_for(-self.delay).about_fixed_axis();
            sample.q_nb = sample.q_nb.advanced(&back).normalised();
        }
        sample
    }
}

/// True north in axes whose north is magnetic: what a magnetic attitude is turned by, from the left.
pub(super) fn turned_north(declination: f64) -> Quaternion<Nav, Nav> {
    Quaternion::from_rotation_vector(&RotationVector(Vector3::z() * -declination))
}

/// The same attitude between other axes: world and body change together.
fn relabelled(sample: &AttitudeSample, from: Convention, to: Convention) -> AttitudeSample {
    AttitudeSample {
        q_nb: from.convert(to, sample.q_nb),
        rate: BodyRate(from.convert_body(to, sample.rate.0)),
        covariance: sample.covariance.relabelled(|v| from.convert_body(to, v)),
        accel: sample
            .accel
            .map(|a| In::assume(from.convert_body(to, *a.as_vector()))),
        linear_acceleration: sample
            .linear_acceleration
            .map(|a| a.relabelled(|v| from.convert_body(to, v))),
        ..*sample
    }
}
