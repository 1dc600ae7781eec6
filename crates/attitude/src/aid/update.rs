//! Update every tenth of a second: covariance on, measurements, correction. Pure.

use super::calibration::CorrectionMatrices;
use super::covariance::{
    BIAS, CROSS, Correction, FIELD, FORCE_BIAS, HEADING, IRON, LEAD, POSITION, SCALE, TILT,
    Transition, VELOCITY, WIDTH,
};
use super::filter::{COLOURED, Filter, Innovation};
use super::gravity::Force;
use super::interval::Interval;
use super::rest;
use super::start::{POSITION_START, VELOCITY_START};
use crate::condition::stillness::{BEYOND_CLASS, about_vertical};
use crate::frames::Nav;
use crate::quaternion::{Quaternion, RotationVector};
use crate::record::AttitudeCovariance;
use nalgebra::{Matrix3, Vector3};

impl Filter {
    /// Corrects by what has been added up.
    pub(super) fn update(&mut self) {
        let settings = self.settings;
        if self.state.report.updates == 0 && settings.prior.lead_sigma.is_none() {
            self.state
                .covariance
                .add(LEAD, (settings.lead_share * self.state.nominal).powi(2));
        }
        self.state.report.updates += 1;
        self.derived.innovation = Innovation::NONE;
        let force = self.mean_force();
        let is_levelled = force.is_some_and(|force| self.judge_tilt(&force));
        self.predict(force.as_ref());
        let mut correction: Correction = [0.0; WIDTH];
        if let Some(force) = force.filter(|_| !is_levelled && !self.state.wants_level) {
            self.use_gravity_and_watch(&force, &mut correction);
        }
        self.use_rest(&mut correction);
        if self.state.interval.fields > 0.0 {
            self.use_field(&mut correction);
        }
        self.use_outside_heading(&mut correction);
        self.inject(&correction);
        self.widen();
        self.find_class();
        self.state.interval = Interval::default();
        let attitude = self.state.correction.wxyz();
        if !self.state.covariance.is_sound() || !attitude.iter().all(|c| c.is_finite()) {
            self.state.report.failures += 1;
            self.forget_calibration();
            self.reset();
        }
    }

    /// The measurement of tilt, and what it makes of the bias.
    fn use_gravity_and_watch(&mut self, force: &Force, correction: &mut Correction) {
        let variance =
            |filter: &Filter| Vector3::from_fn(|i, _| filter.state.covariance.variance(BIAS + i));
        let before = variance(self);
        self.use_gravity(force, correction);
        let after = variance(self);
        let by = Vector3::from_fn(|i, _| correction[BIAS + i]);
        let secs = self.state.interval.secs;
        self.state.drift.take(&by, &(before - after), secs);
        let sigma = after.map(|v| v.max(0.0).sqrt());
        let bias = self.state.calibration.bias + by;
        self.state.drift.know(&bias, &sigma);
    }

    /// The measurement of the gyro's bias, where the body rests.
    fn use_rest(&mut self, correction: &mut Correction) {
        let secs = self.state.interval.secs;
        // What the gyro reads of a world that turns is no bias.
        let of_world = self.state.interval.attitude.transpose() * self.world_rate;
        let mean = (self.state.interval.rate - of_world) / secs;
        let up = self.state.interval.attitude.row(2).transpose();
        let off = mean - self.state.calibration.bias;
        let is_turn = about_vertical(&off, &up).is_some_and(|turn| {
            let up = up.normalize();
            let now = self.variance_of_bias(&up);
            let of_class = self.settings.bias_class.powi(2);
            let variance = now.max(self.prior_of_bias(&up)).min(of_class);
            turn * turn > BEYOND_CLASS * BEYOND_CLASS * variance
        });
        let is_at_rest = self.rests();
        let rest = &mut self.state.rest;
        if is_turn {
            rest.interrupt();
            return;
        }
        let interval = rest::Interval {
            mean,
            off,
            up,
            secs,
        };
        let Some(rate) = rest.take_interval(&interval, is_at_rest, &self.settings) else {
            return;
        };
        for axis in 0..3 {
            let innovation = rate.mean[axis] - self.state.calibration.bias[axis];
            self.state.covariance.measure(
                &[(BIAS + axis, 1.0)],
                innovation,
                rate.variance[axis],
                correction,
            );
        }
    }

    fn mean_force(&self) -> Option<Force> {
        let sums = &self.state.interval;
        if sums.force_secs <= 0.5 * sums.secs {
            return None;
        }
        let mean = sums.force / sums.force_secs;
        let lead = sums.lead / sums.force_secs;
        let by_calibration = [0, 1].map(|i| {
            let bias = |j: usize| -sums.attitude[(i, j)] / sums.secs;
            [bias(0), bias(1), bias(2), lead[i]]
        });
        Some(Force {
            acceleration: mean - Vector3::z() * self.settings.gravity,
            up: mean.z,
            by_calibration,
        })
    }

    /// Takes the covariance over the interval.
    fn predict(&mut self, force: Option<&Force>) {
        let settings = self.settings;
        let secs = self.state.interval.secs;
        let half_square = 0.5 * secs * secs;
        let mut transition = Transition::none();
        let rows = &mut transition.0;
        let by_bias = self.state.interval.attitude * self.derived.known.matrix;
        for axis in 0..3 {
            for j in 0..3 {
                rows[axis][BIAS + j] = -by_bias[(axis, j)];
                rows[axis][SCALE + j] = self.state.interval.scaled[axis][j];
                rows[axis][CROSS + j] = self.state.interval.scaled[axis][3 + j];
            }
        }
        for i in 0..2 {
            rows[POSITION + i][VELOCITY + i] = secs;
        }
        if let Some(force) = force {
            for i in 0..2 {
                for (j, by) in force.by_calibration[i].iter().enumerate() {
                    rows[VELOCITY + i][FORCE_BIAS + j] = secs * by;
                    rows[POSITION + i][FORCE_BIAS + j] = half_square * by;
                }
            }
            rows[VELOCITY][TILT + 1] = secs * force.up;
            rows[VELOCITY + 1][TILT] = -secs * force.up;
            rows[POSITION][TILT + 1] = half_square * force.up;
            rows[POSITION + 1][TILT] = -half_square * force.up;
        }
        self.state.covariance.step(&transition);
        let turned = settings.rate_noise.powi(2) * self.state.interval.turned_squared() / 9.0;
        self.state
            .covariance
            .add_to_attitude(settings.gyro_noise.powi(2) * secs + turned);
        let up = self.state.interval.up();
        let tilted = self
            .state
            .last_up
            .map_or(0.0, |last| (up - last).norm_squared());
        self.state.last_up = Some(up);
        self.state.vertical.take(&up, secs, settings.lean_believed);
        self.let_biases_wander(secs, tilted);
        for i in 0..2 {
            self.state
                .covariance
                .add(VELOCITY + i, settings.velocity_walk.powi(2) * secs);
        }
        if self.state.covariance.variance(FIELD) > 0.0 {
            let left = (-secs / settings.field_secs).exp();
            self.state.covariance.fade(FIELD, left);
            self.state
                .covariance
                .add(FIELD, settings.field_sigma.powi(2) * (1.0 - left * left));
            self.state.disturbance *= left;
        }
    }

    /// Makes the biases of gyro and accelerometer less known after an interval of `secs` in which the vertical has
    /// moved by the square root of `tilted` in the body.
    fn let_biases_wander(&mut self, secs: f64, tilted: f64) {
        let settings = &self.settings;
        let drift = self.state.drift.excess(settings.bias_drift);
        let walk = (settings.bias_walk.powi(2) + drift) * secs;
        let bias = walk + settings.bias_by_tilt.powi(2) * tilted;
        for axis in 0..3 {
            self.state.covariance.add(BIAS + axis, bias);
            self.state
                .covariance
                .add(FORCE_BIAS + axis, settings.force_bias_walk.powi(2) * secs);
        }
    }

    /// Corrects attitude and all else by what the measurements have found.
    fn inject(&mut self, correction: &Correction) {
        let tilt = Vector3::new(correction[TILT], correction[TILT + 1], 0.0);
        let heading = Vector3::z() * correction[HEADING];
        let turn =
            |phi: Vector3<f64>| Quaternion::<Nav, Nav>::from_rotation_vector(&RotationVector(phi));
        self.state.correction = (turn(heading) * (turn(tilt) * self.state.correction)).normalised();
        let three = |first: usize| {
            Vector3::from_fn(|i, _| correction.get(first + i).copied().unwrap_or(0.0))
        };
        for i in 0..2 {
            self.state.velocity[i] += correction[VELOCITY + i];
            self.state.position[i] += correction[POSITION + i];
        }
        let calibration = &mut self.state.calibration;
        calibration.bias += three(BIAS);
        calibration.scale += three(SCALE);
        calibration.cross += three(CROSS);
        calibration.force_bias += three(FORCE_BIAS);
        calibration.lead += correction[LEAD];
        calibration.hard_iron += three(IRON);
        self.state.disturbance += correction[FIELD];
        self.derived.known = CorrectionMatrices::of(calibration);
        // The earth axes of the estimate have turned.
        let (sin, cos) = correction[HEADING].sin_cos();
        self.state.covariance.turn(cos, sin);
        for pair in [&mut self.state.velocity, &mut self.state.position] {
            let [x, y] = *pair;
            *pair = [cos * x - sin * y, sin * x + cos * y];
        }
    }

    /// Turns the attitude the short way so that `force` (earth axes) is vertical. `false`, and nothing is done,
    /// where that is no gravity.
    pub(super) fn level(&mut self, force: Vector3<f64>) -> bool {
        let length = force.norm() / self.settings.gravity;
        if !(0.5..=1.5).contains(&length) {
            return false;
        }
        let across = force.x.hypot(force.y);
        let phi = if across > 1e-9 {
            Vector3::new(force.y, -force.x, 0.0) * (across.atan2(force.z) / across)
        } else if force.z < 0.0 {
            Vector3::x() * std::f64::consts::PI
        } else {
            Vector3::zeros()
        };
        let turn = Quaternion::<Nav, Nav>::from_rotation_vector(&RotationVector(phi));
        self.state.correction = (turn * self.state.correction).normalised();
        for axis in [TILT, TILT + 1] {
            let variance = self.settings.tilt_start.powi(2);
            self.state.covariance.restart(axis, variance);
        }
        self.restart_reference(VELOCITY_START, POSITION_START);
        self.state.mean_acceleration = Vector3::zeros();
        self.state.report.levelled += 1;
        self.derived.has_levelled = true;
        true
    }

    /// Covariance of the error of the attitude with the matrix `r` at the corrected `rate`, rad^2, body axes. More than
    /// the filter's own: accelerations are not white, sensors are late, and their axes are not those of their case.
    #[must_use]
    pub(crate) fn attitude_covariance(
        &self,
        r: &Matrix3<f64>,
        rate: &Vector3<f64>,
    ) -> AttitudeCovariance {
        if !self.state.is_started {
            return AttitudeCovariance::from_sigma(Vector3::repeat(std::f64::consts::PI));
        }
        let settings = &self.settings;
        let white = settings.gyro_noise.powi(2) * self.state.interval.secs;
        let mut earth = self.state.covariance.attitude();
        for axis in 0..3 {
            earth[(axis, axis)] += white;
        }
        earth *= COLOURED;
        if let Some(more) = self.by_other_class() {
            earth += more;
        }
        let carried = r.transpose() * earth;
        let (late, case) = (settings.delay.powi(2), settings.case.powi(2));
        let upper = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|(i, j)| {
            let of_filter: f64 = (0..3).map(|k| carried[(i, k)] * r[(k, j)]).sum();
            of_filter + rate[i] * rate[j] * late + if i == j { case } else { 0.0 }
        });
        AttitudeCovariance::from_upper(upper)
    }

    /// Variances of tilt about east and north and of heading as the filter has them, rad^2: less than what
    /// [`Filter::attitude_covariance`] says.
    #[cfg(test)]
    pub(super) fn earth_variances(&self) -> [f64; 3] {
        [TILT, TILT + 1, HEADING].map(|state| self.state.covariance.variance(state))
    }
}
