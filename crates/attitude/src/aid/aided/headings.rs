//! Headings that are asked for, or measured outside -> the world, and the filter, of an aided propagator. Pure.
//!
//! Apart from the samples' way because few streams have any: a heading turns the world, or corrects what is propagated in it.

use super::super::heading::wrapped;
use super::super::outside_heading::{Now, OutsideHeading, OutsideHeadingCounts, Use};
use super::AidedPropagator;
use crate::frames::{Body, Nav};
use crate::quaternion::Quaternion;
use crate::record::{AttitudeSample, Nanos};
use nalgebra::{Matrix3, Vector3};

impl AidedPropagator {
    /// Takes a heading that something else has measured at `stamp`; without one, at the next sample. It is compared
    /// there, up to three seconds later. Where no magnetic field tells the heading, the first one, and later ones that
    /// contradict it for ten seconds, turn the world, which says [`Status::RESET`]; all others correct the heading, and
    /// by it the bias. Those beyond four sigmas are counted and not used.
    ///
    /// [`Status::RESET`]: crate::record::Status::RESET
    pub fn take_heading(&mut self, stamp: Option<Nanos>, measured: OutsideHeading) {
        self.stream.headings.take(stamp, measured);
    }

    /// Counts of such headings.
    #[must_use]
    pub fn outside_headings(&self) -> OutsideHeadingCounts {
        self.stream.headings.counts
    }

    /// Turns the world about the vertical, so that the next sample has this heading (rad, in (-pi, pi]), and says
    /// [`Status::RESET`]; tilt and what was learned of the sensor stay as they are. Where a magnetic field tells the
    /// heading, that is found anew by the field, whatever `heading` is.
    ///
    /// [`Status::RESET`]: crate::record::Status::RESET
    pub fn turn_heading(&mut self, heading: f64) {
        self.heading = Some(heading);
    }

    /// The attitude at `stamp` is asked to have this heading.
    pub(super) fn set_heading(
        &mut self,
        stamp: Nanos,
        attitude: &Quaternion<Nav, Body>,
        heading: f64,
    ) {
        let has_field = self.filter.has_field();
        let heading = match has_field {
            true => attitude.yaw_pitch_roll().yaw,
            false => heading,
        };
        self.stream.world.set_heading(stamp, attitude, heading);
        self.stream.headings.begin_anew();
        self.filter.restart_heading();
    }

    /// Compares the headings from outside up to this sample, whose corrected attitude and matrix are these. Whether the
    /// world has turned.
    pub(super) fn use_outside_headings(
        &mut self,
        sample: &AttitudeSample,
        attitude: &Quaternion<Nav, Body>,
        r: &Matrix3<f64>,
    ) -> bool {
        if !self.filter.is_started() {
            return false;
        }
        let yaw = attitude.yaw_pitch_roll().yaw;
        let level = r[(0, 0)].powi(2) + r[(1, 0)].powi(2);
        // Of the body's x axis, seen from above.
        let nose = r * sample.rate.0.cross(&Vector3::x());
        let now = Now {
            stamp: sample.stamp,
            heading: self.stream.world.heading(yaw),
            rate: (r[(0, 0)] * nose.y - r[(1, 0)] * nose.x) / level.max(1e-9),
            steepness: r[(2, 0)],
            variance: self.filter.heading_variance(),
            is_free: !self.filter.has_field(),
        };
        let mut asked = Vec::new();
        self.stream.headings.at(&now, &mut asked);
        let mut has_turned = false;
        for wanted in asked {
            match wanted {
                Use::Correct(off, variance) => self.filter.add_outside_heading(off, variance),
                Use::Turn(off, variance) => {
                    let heading = wrapped(now.heading + off);
                    self.stream
                        .world
                        .set_heading(sample.stamp, attitude, heading);
                    self.filter.know_heading(variance);
                    has_turned = true;
                }
            }
        }
        has_turned
    }
}
