//! Headings from outside the sensor -> a stream of attitudes: asked of its world, or measured. Pure.

use super::super::integrator::Auxiliary;
use super::super::open_kind::Event;
use super::Estimator;
use crate::aid::{OutsideHeading, OutsideHeadingCounts};
use crate::propagate::Sequential;
use crate::record::Nanos;

impl Estimator {
    /// Turns the world so that the next sample has this heading (rad), and says [`Status::RESET`]: see
    /// [`AidedPropagator::turn_heading`]. `false`, and nothing changes, of a gyro alone: it has no vertical.
    ///
    /// [`Status::RESET`]: crate::record::Status::RESET
    /// [`AidedPropagator::turn_heading`]: crate::aid::AidedPropagator::turn_heading
    pub fn turn_heading(&mut self, heading: f64) -> bool {
        self.note(|| Event::Heading(heading));
        self.retaking.note_heading(heading);
        self.integrator.turn_heading(heading)
    }

    /// Does the same by a heading (rad) in the world of the attitudes that are given.
    pub fn set_heading(&mut self, heading: f64) -> bool {
        self.turn_heading(self.asked.own_heading(heading))
    }

    /// Takes a heading that something else than the sensor has measured: a course of GNSS, a compass, another tracker, as
    /// the yaw of the attitudes in their own world; see [`AidedPropagator::take_heading`]. `stamp` is on the clock of the
    /// samples. `false`, and nothing changes, where nothing can use it: a gyro alone has no vertical to turn about, and a
    /// smoother takes none.
    ///
    /// [`AidedPropagator::take_heading`]: crate::aid::AidedPropagator::take_heading
    pub fn take_heading(&mut self, stamp: Option<Nanos>, measured: OutsideHeading) -> bool {
        if !self.integrator.takes_headings() {
            return false;
        }
        self.note(|| Event::OutsideHeading(stamp, measured));
        let own = OutsideHeading {
            heading: self.asked.own_heading(measured.heading),
            ..measured
        };
        let is_stamped = stamp.is_some();
        let stamp = stamp.map_or(Nanos(0), |stamp| self.conditioner.of_auxiliary(stamp));
        let heading = Auxiliary::Heading {
            is_stamped,
            measured: own,
        };
        self.beside.push((self.rates.len(), stamp, heading));
        // However many come before the next sample, they are bounded where they wait.
        self.make(&Sequential);
        true
    }

    /// Counts of such headings.
    #[must_use]
    pub fn outside_headings(&self) -> OutsideHeadingCounts {
        self.integrator.outside_headings()
    }
}
