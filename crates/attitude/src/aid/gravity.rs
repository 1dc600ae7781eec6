//! Mean specific force of an interval -> tilt, and what of the sensor made it wrong. Pure.
//!
//! A body that is held, worn or carried stays in a place: its velocity and position are bounded. So
//! `a + 2 damping frequency v + frequency^2 p` is taken for white noise, not `a` itself, and low frequencies,
//! where tilt lives, weigh far more than they would otherwise. How strong the noise is, the residual says.

use super::covariance::{Correction, FORCE_BIAS, LEAD, POSITION, TILT, VELOCITY};
use super::filter::Filter;
use nalgebra::Vector3;

/// Time constant of the mean acceleration that tells a wrong tilt, s.
const MEAN_SECS: f64 = 2.0;

/// Change of the usual length of gravity, as a share a second; the share in an update, times those since the beginning.
const LENGTH_RATE: f64 = 2e-3;
const LENGTH_START: f64 = 0.02;
/// Share of the lengths below it over that of those above: a body that travels makes forces longer, never shorter.
const LENGTH_BELOW: f64 = 0.25;
/// Farthest that it comes to lie from gravity, as a share.
const LENGTH_FARTHEST: f64 = 0.1;

/// The mean specific force of an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Force {
    /// Less gravity, m/s^2, earth axes.
    pub(super) acceleration: Vector3<f64>,
    /// Vertical component, gravity included, m/s^2.
    pub(super) up: f64,
    /// Change for an accelerometer bias of 1 m/s^2 (three columns) and a time offset of 1 s.
    pub(super) by_calibration: [[f64; 4]; 2],
}

impl Filter {
    /// Mean acceleration over the last seconds. Levels where that says that down is up.
    pub(super) fn judge_tilt(&mut self, force: &Force) -> bool {
        let secs = self.state.interval.secs;
        self.state.mean_acceleration +=
            (force.acceleration - self.state.mean_acceleration) * (secs / (MEAN_SECS + secs));
        let gravity = Vector3::z() * self.settings.gravity;
        self.watch_length((self.state.mean_acceleration + gravity).norm(), secs);
        let is_known = !self.state.interval.is_clipped;
        if self.state.wants_level && is_known && self.level(force.acceleration + gravity) {
            self.state.wants_level = false;
            return true;
        }
        let mean = self.state.mean_acceleration + gravity;
        // The linear correction has a false equilibrium upside down.
        mean.z < 0.0 && self.level(mean)
    }

    /// Follows the usual length of the mean force, which a fifth of the lengths are below.
    fn watch_length(&mut self, length: f64, secs: f64) {
        let (gravity, usual) = (self.settings.gravity, self.state.usual_length);
        let far = LENGTH_FARTHEST * gravity;
        let updates = self.state.report.updates.max(1) as f64;
        let step = (LENGTH_RATE * secs).max(LENGTH_START / updates) * gravity;
        let next = match usual > 0.0 {
            true => usual + (length - usual).clamp(-step, LENGTH_BELOW * step),
            false => length,
        };
        self.state.usual_length = next.clamp(gravity - far, gravity + far);
    }

    /// The measurement of tilt.
    pub(super) fn use_gravity(&mut self, force: &Force, correction: &mut Correction) {
        let settings = self.settings;
        let secs = self.state.interval.secs;
        for i in 0..2 {
            self.state.position[i] +=
                secs * self.state.velocity[i] + 0.5 * secs * secs * force.acceleration[i];
            self.state.velocity[i] += secs * force.acceleration[i];
        }
        if self.reference_is_left() && self.leave_reference() {
            return;
        }
        let by_velocity = 2.0 * settings.motion_damping * settings.motion_frequency;
        let by_position = settings.motion_frequency * settings.motion_frequency;
        let residual = [0, 1].map(|i| {
            force.acceleration[i]
                + by_velocity * self.state.velocity[i]
                + by_position * self.state.position[i]
        });
        let turn = (self.turned_about_vertical(), self.state.vertical.upright());
        let gravity = settings.gravity;
        let up = if settings.tilt_by_gravity {
            gravity
        } else {
            force.up
        };
        let rows = [0, 1].map(|i| {
            let [x, y, z, lead] = force.by_calibration[i];
            // A tilt about y makes gravity seem to point along x, one about x against y.
            let (tilt, by_tilt) = [(TILT + 1, up), (TILT, -up)][i];
            [
                (tilt, by_tilt),
                (FORCE_BIAS, x),
                (FORCE_BIAS + 1, y),
                (FORCE_BIAS + 2, z),
                (LEAD, lead),
                (VELOCITY + i, by_velocity),
                (POSITION + i, by_position),
            ]
        });
        // What stays upright drives in curves, or sways with a swell: there a wrong tilt explains too much.
        let leans = 1.0 - self.state.vertical.known_upright();
        let share = settings.force_explained * leans * leans;
        let of_axis = rows.map(|h| self.state.covariance.variance_of_sum(&h));
        let explained = share * 0.5 * (of_axis[0] + of_axis[1]);
        let mut variance = self.state.residuals.variance(
            secs,
            residual,
            explained,
            &force.acceleration,
            turn,
            &settings,
        );
        if self.rests() {
            let (ax, ay) = (force.acceleration.x, force.acceleration.y);
            let square = ax * ax + ay * ay;
            let tilt =
                self.state.covariance.variance(TILT) + self.state.covariance.variance(TILT + 1);
            let floor = settings.force_floor / secs;
            if square > 9.0 * (force.up * force.up * tilt + 2.0 * floor + 0.09) {
                // A wrong tilt at rest is found in a second.
                let unknown = 0.1 * square / settings.gravity.powi(2);
                self.state.covariance.add(TILT, unknown);
                self.state.covariance.add(TILT + 1, unknown);
                variance = floor + 0.01;
            }
        }
        for i in 0..2 {
            let (left, sigma) = self.state.covariance.measure_withholding(
                &rows[i],
                -residual[i],
                variance,
                self.state.vertical.withheld(),
                correction,
            );
            self.derived.innovation.gravity[i] = (left / gravity, sigma / gravity);
        }
    }

    /// Angle that the body has turned about the vertical in this interval, rad.
    fn turned_about_vertical(&self) -> f64 {
        let sums = &self.state.interval;
        sums.up()
            .dot(&(sums.rate - self.state.calibration.bias * sums.secs))
    }

    fn reference_is_left(&self) -> bool {
        let limit = self.settings.reference_limit.powi(2);
        let squared = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
        squared(self.state.velocity) > limit || squared(self.state.position) > limit
    }

    /// Velocity or position are beyond what a held body has: either the tilt is wrong (the mean specific force
    /// is as long as gravity as this accelerometer reads it), or it really travels. Whether it was levelled.
    fn leave_reference(&mut self) -> bool {
        let gravity = self.settings.gravity;
        let usual = self.state.usual_length;
        let mean = self.state.mean_acceleration;
        let across = mean.x.hypot(mean.y);
        let force = mean + Vector3::z() * gravity;
        let length = force.norm();
        let of_travel = usual.hypot(across);
        let is_tilt = across > self.settings.level_force
            && length > 0.9 * usual
            && length < 0.5 * (usual + of_travel);
        if is_tilt && self.level(force) {
            return true;
        }
        self.restart_reference(1.0, 1.0);
        false
    }

    /// A velocity and position that are known to these variances and nothing more.
    pub(super) fn restart_reference(&mut self, velocity: f64, position: f64) {
        self.state.report.restarts += 1;
        (self.state.velocity, self.state.position) = ([0.0; 2], [0.0; 2]);
        for i in 0..2 {
            self.state.covariance.restart(VELOCITY + i, velocity);
            self.state.covariance.restart(POSITION + i, position);
        }
        self.state.residuals.restart();
    }
}
