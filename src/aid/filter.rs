//! The filter: start, samples, corrections, gaps. Pure.

use super::calibration::{Applied, Calibration};
use super::covariance::{
    BIAS, CROSS, Correction, Covariance, FIELD, FORCE_BIAS, HEADING, LEAD, POSITION, SCALE, TILT,
    Transition, VELOCITY, WIDTH,
};
use super::gravity::{Force, Residuals};
use super::heading::Surroundings;
use super::interval::Interval;
use super::rest::Rest;
use super::settings::Settings;
use crate::condition::stillness::level;
use crate::model::attitude::{Quaternion, RotationVector};
use crate::model::frames::{Body, Dcm, In, Nav};
use crate::record::AttitudeCovariance;
use nalgebra::{Matrix3, Vector3};

/// A specific force beyond this (each component, m/s^2) is none.
const LARGEST_FORCE: f64 = 1000.0;
/// A field beyond this (each component, whatever its unit) is none.
const LARGEST_FIELD: f64 = 1e6;
/// Variances of velocity and position where the reference starts, (m/s)^2, m^2.
const VELOCITY_START: f64 = 0.01;
const POSITION_START: f64 = 1e-4;
/// Sigma of the heading where the first sample has no field, rad.
const HEADING_UNKNOWN: f64 = 3.0;
/// What may be wrong with a bias after a reset, rad/s.
const BIAS_AFTER_RESET: f64 = 8.7e-4;
/// After so many gaps in a row the sensor has become slower.
const GAPS_IN_A_ROW: u32 = 20;
/// Accelerations are not white, which makes errors larger than they are thought to be.
const COLOURED: f64 = 2.0;
/// Delay of a sensor's own filters, s.
const DELAY: f64 = 2e-3;
/// Between the axes of sensor and case, rad.
const CASE: f64 = 3.5e-3;

/// One sample as it was measured, and the attitude it led to.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Since the sample before, s.
    pub secs: f64,
    /// The gyro, rad/s, body axes: at the instant or its mean since the sample before.
    pub rate: Vector3<f64>,
    /// Specific force at the instant, m/s^2, body axes; up at rest.
    pub force: Option<Vector3<f64>>,
    /// Magnetic field at the instant, any linear unit, body axes. One that was measured only once comes once.
    pub field: Option<Vector3<f64>>,
}

/// What happened.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Report {
    /// Corrections made.
    pub updates: u64,
    /// Velocity references given up: the body travels.
    pub restarts: u64,
    /// Times the attitude was levelled at once: a tilt too wrong to be corrected.
    pub levelled: u64,
    /// Gaps passed over.
    pub gaps: u64,
    /// Specific forces that are none: not finite, or beyond what there is.
    pub forces_rejected: u64,
    /// Fields that were doubted or not used.
    pub fields_rejected: u64,
    /// Samples at the gyro's range.
    pub saturated: u64,
    /// Full starts because the numbers had become impossible.
    pub failures: u64,
}

/// Corrects what a propagator integrates. See the [module](crate::aid).
#[derive(Clone, Debug)]
pub struct Filter {
    pub(super) settings: Settings,
    /// A rate is that at its instant, not the mean since the one before.
    is_instant: bool,
    /// Rate of the world, rad/s, earth axes.
    world_rate: Vector3<f64>,
    /// Whether tilt and heading have begun.
    is_started: bool,
    pub(super) covariance: Covariance,
    calibration: Calibration,
    known: Applied,
    /// What the propagator's attitude is turned by, from the left.
    correction: Quaternion<Nav, Nav>,
    /// Of the motion, horizontal, m/s and m.
    pub(super) velocity: [f64; 2],
    pub(super) position: [f64; 2],
    /// Of the field's heading, rad.
    pub(super) disturbance: f64,
    pub(super) interval: Interval,
    pub(super) rest: Rest,
    pub(super) residuals: Residuals,
    pub(super) mean_acceleration: Vector3<f64>,
    pub(super) surroundings: Surroundings,
    /// A gap has been too long for the tilt to be known.
    pub(super) wants_level: bool,
    /// Time between samples, s; 0 before it is known.
    nominal: f64,
    gaps_in_a_row: u32,
    last_rate: Vector3<f64>,
    /// The last specific force, earth axes, and how long ago it was, s.
    last_force: Option<Vector3<f64>>,
    since_force: f64,
    pub(super) report: Report,
}

impl Filter {
    /// For a gyro whose samples are rates at their instants (`is_instant`) or means since the sample before, in
    /// a world that turns at `world_rate` (rad/s).
    #[must_use]
    pub fn new(settings: Settings, is_instant: bool, world_rate: In<Nav>) -> Filter {
        let calibration = Calibration::default();
        let mut filter = Filter {
            settings,
            is_instant,
            world_rate: *world_rate.as_vector(),
            is_started: false,
            covariance: Covariance::zero(),
            calibration,
            known: Applied::of(&calibration),
            correction: Quaternion::identity(),
            velocity: [0.0; 2],
            position: [0.0; 2],
            disturbance: 0.0,
            interval: Interval::new(),
            rest: Rest::new(Vector3::zeros()),
            residuals: Residuals::new(&settings),
            mean_acceleration: Vector3::zeros(),
            surroundings: Surroundings::default(),
            wants_level: false,
            nominal: 0.0,
            gaps_in_a_row: 0,
            last_rate: Vector3::zeros(),
            last_force: None,
            since_force: 0.0,
            report: Report::default(),
        };
        filter.forget_calibration();
        filter
    }

    /// What is known of the sensor by now.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// One standard deviation of each number of the calibration.
    #[must_use]
    pub fn calibration_sigma(&self) -> Calibration {
        let three = |first: usize| {
            Vector3::from_fn(|i, _| self.covariance.variance(first + i).max(0.0).sqrt())
        };
        Calibration {
            bias: three(BIAS),
            scale: three(SCALE),
            cross: three(CROSS),
            force_bias: three(FORCE_BIAS),
            lead: self.covariance.variance(LEAD).max(0.0).sqrt(),
        }
    }

    /// What the rates that come now are to be corrected by.
    pub(crate) fn applied(&self) -> Applied {
        self.known
    }

    /// What happened so far.
    #[must_use]
    pub fn report(&self) -> Report {
        self.report
    }

    /// Whether the sensor has been at rest for long enough to say so.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        self.is_started && self.rest.is_at_rest(&self.settings)
    }

    /// Whether tilt is known: a specific force has come.
    #[must_use]
    pub fn is_started(&self) -> bool {
        self.is_started
    }

    /// The attitude that the propagator's is.
    #[must_use]
    pub fn corrected(&self, propagated: &Quaternion<Nav, Body>) -> Quaternion<Nav, Body> {
        (self.correction * *propagated).normalised()
    }

    /// Begins at a first sample: level by its specific force and with the heading of the propagator's attitude,
    /// or north by its field. Without a force the attitude is the propagator's for now.
    pub fn begin(&mut self, first: &Measured, propagated: &Quaternion<Nav, Body>) {
        self.last_rate = first.rate;
        self.last_force = None;
        self.since_force = 0.0;
        self.interval = Interval::new();
        let Some(force) = first.force.filter(|f| self.is_force(f) && f.norm() > 0.0) else {
            return;
        };
        let field = first.field.filter(is_field);
        let up = force.normalize();
        let north =
            field.filter(|field| field.cross(&up).norm_squared() > 1e-4 * field.norm_squared());
        let attitude = match north {
            Some(north) => {
                let east = north.cross(&up).normalize();
                let rows = [east, up.cross(&east), up].map(|axis| axis.transpose());
                Quaternion::from_dcm(&Dcm::assume(Matrix3::from_rows(&rows)))
            }
            None => {
                let tilted = level(&force).unwrap_or_else(Quaternion::identity);
                let yaw = Vector3::z() * propagated.yaw_pitch_roll().yaw;
                Quaternion::<Nav, Nav>::from_rotation_vector(&RotationVector(yaw)) * tilted
            }
        };
        let heading = match (field, north) {
            (_, Some(_)) => self.settings.heading_start,
            (Some(_), None) => HEADING_UNKNOWN,
            (None, _) => 0.0,
        };
        self.start(attitude * propagated.inverse(), heading * heading, force);
    }

    /// Begins with the attitude as the propagator has it, known to `tilt` and `heading` (rad).
    pub fn begin_known(&mut self, first: &Measured, tilt: f64, heading: f64) {
        self.last_rate = first.rate;
        self.last_force = None;
        self.since_force = 0.0;
        let force = first
            .force
            .filter(|f| self.is_force(f))
            .unwrap_or(Vector3::z() * self.settings.gravity);
        self.start(Quaternion::identity(), heading * heading, force);
        for axis in [TILT, TILT + 1] {
            self.covariance.restart(axis, tilt * tilt);
        }
    }

    /// What a new start keeps: the calibration, known a little less.
    pub fn reset(&mut self) {
        self.is_started = false;
        self.correction = Quaternion::identity();
        for axis in 0..3 {
            self.covariance
                .add(BIAS + axis, BIAS_AFTER_RESET * BIAS_AFTER_RESET);
        }
    }

    fn start(&mut self, correction: Quaternion<Nav, Nav>, heading: f64, force: Vector3<f64>) {
        let settings = &self.settings;
        self.correction = correction.normalised();
        self.covariance
            .restart(TILT, settings.tilt_start * settings.tilt_start);
        self.covariance
            .restart(TILT + 1, settings.tilt_start * settings.tilt_start);
        self.covariance.restart(HEADING, heading);
        for i in 0..2 {
            self.covariance.restart(VELOCITY + i, VELOCITY_START);
            self.covariance.restart(POSITION + i, POSITION_START);
        }
        let disturbed = if heading > 0.0 {
            settings.field_sigma * settings.field_sigma
        } else {
            0.0
        };
        self.covariance.restart(FIELD, disturbed);
        (self.velocity, self.position, self.disturbance) = ([0.0; 2], [0.0; 2], 0.0);
        self.interval = Interval::new();
        self.rest = Rest::new(force);
        self.residuals = Residuals::new(settings);
        self.mean_acceleration = Vector3::zeros();
        self.surroundings = Surroundings::default();
        self.wants_level = false;
        self.is_started = true;
    }

    /// The sensor as it was switched on.
    fn forget_calibration(&mut self) {
        let settings = self.settings;
        self.calibration = Calibration::default();
        self.known = Applied::of(&self.calibration);
        self.covariance = Covariance::zero();
        for (first, sigma) in [
            (BIAS, settings.bias_prior),
            (SCALE, settings.scale_prior),
            (CROSS, settings.cross_prior),
            (FORCE_BIAS, settings.force_bias_prior),
        ] {
            for axis in 0..3 {
                self.covariance.add(first + axis, sigma * sigma);
            }
        }
        self.covariance
            .add(LEAD, settings.lead_prior * settings.lead_prior);
    }

    /// Takes the next sample, whose rate the propagator was given corrected by `known`. `propagated` is its
    /// attitude at the sample's instant.
    pub(crate) fn take(
        &mut self,
        sample: &Measured,
        known: &Applied,
        propagated: &Quaternion<Nav, Body>,
    ) {
        if !self.is_started {
            self.begin(sample, propagated);
            return;
        }
        let secs = sample.secs;
        let is_gap = self.nominal > 0.0 && secs > self.settings.gap_factor * self.nominal;
        let rate = if is_gap || self.is_instant {
            0.5 * (sample.rate + self.last_rate)
        } else {
            sample.rate
        };
        let attitude = self.correction * *propagated;
        let r = *attitude.to_dcm().as_matrix();
        self.interval.turn(secs, &r, &rate, known);
        let at_instant = if self.is_instant { sample.rate } else { rate };
        let force = self.add_force(sample, &r, known.corrected(at_instant, 1.0), is_gap);
        if let Some(field) = sample.field.filter(is_field) {
            self.interval.field += r * field;
            self.interval.fields += 1.0;
        }
        let sigma = Vector3::from_fn(|i, _| self.covariance.variance(BIAS + i).max(0.0).sqrt());
        let bias = self.calibration.bias;
        self.rest
            .take(secs, &rate, force.as_ref(), (&bias, &sigma), &self.settings);
        self.doubt_turn(sample, is_gap);
        self.last_rate = sample.rate;
        if !is_gap {
            self.gaps_in_a_row = 0;
            self.nominal = if self.nominal > 0.0 {
                self.nominal + 0.05 * (secs - self.nominal)
            } else {
                secs
            };
        } else {
            self.gaps_in_a_row += 1;
            if self.gaps_in_a_row >= GAPS_IN_A_ROW {
                self.nominal = secs;
                self.gaps_in_a_row = 0;
            }
        }
        if self.interval.secs >= self.settings.update_secs - 0.25 * secs {
            self.update();
        }
    }

    /// The propagator held the attitude over `secs` of which nothing is known.
    pub(crate) fn hold(&mut self, sample: &Measured, propagated: &Quaternion<Nav, Body>) {
        if !self.is_started {
            self.begin(sample, propagated);
            return;
        }
        self.interval = Interval::new();
        self.last_force = None;
        let walk = self.settings.bias_walk.powi(2) * sample.secs;
        for axis in 0..3 {
            self.covariance.add(BIAS + axis, walk);
        }
        self.lose_sight(sample, sample.secs);
        self.last_rate = sample.rate;
    }

    /// The force of a sample in the sums; what of it can be used.
    fn add_force(
        &mut self,
        sample: &Measured,
        r: &Matrix3<f64>,
        rate: Vector3<f64>,
        is_gap: bool,
    ) -> Option<Vector3<f64>> {
        self.since_force += sample.secs;
        let measured = sample.force?;
        if !self.is_force(&measured) {
            self.report.forces_rejected += 1;
            return None;
        }
        // It stands for the time since the one before it.
        let secs = self
            .since_force
            .min(sample.secs.max(self.settings.update_secs));
        self.since_force = 0.0;
        let turning = rate.cross(&measured);
        let force = r * (measured - self.calibration.force_bias + turning * self.calibration.lead);
        let mean = match self.last_force {
            Some(last) if is_gap => 0.5 * (force + last),
            _ => force,
        };
        self.last_force = Some(force);
        self.interval.force += mean * secs;
        self.interval.lead += r * turning * secs;
        self.interval.force_secs += secs;
        Some(measured)
    }

    /// What a gap, a jump or the end of the gyro's range leaves unknown of a turn.
    fn doubt_turn(&mut self, sample: &Measured, is_gap: bool) {
        let secs = sample.secs;
        let jump = (sample.rate - self.last_rate).norm();
        if is_gap {
            self.report.gaps += 1;
            self.covariance
                .add_to_attitude(jump * jump * secs * secs / 36.0);
            if secs > self.settings.gap_secs {
                self.lose_sight(sample, secs - self.settings.gap_secs);
            }
        }
        let ordinary = if is_gap || self.nominal <= 0.0 {
            secs
        } else {
            self.nominal
        };
        let excess = jump - self.settings.jerk * ordinary;
        if excess > 0.0 {
            self.covariance.add_to_attitude((excess * secs).powi(2));
        }
        let range = self.settings.gyro_range;
        if range > 0.0 && sample.rate.amax() >= range {
            self.report.saturated += 1;
            for rate in sample.rate.iter().filter(|rate| rate.abs() >= range) {
                self.covariance.add_to_attitude((0.5 * rate * secs).powi(2));
            }
        }
    }

    /// Nothing is known of what the body did for `secs`.
    fn lose_sight(&mut self, sample: &Measured, secs: f64) {
        let fastest = |i: usize| sample.rate[i].powi(2).max(self.last_rate[i].powi(2));
        let squared: f64 = (0..3).map(fastest).sum();
        let unknown = ((squared / 3.0 + 0.01) * secs * secs).min(3.0);
        self.covariance.add_to_attitude(unknown);
        self.wants_level |= self.covariance.variance(TILT) > self.settings.level_sigma.powi(2);
        self.restart_reference(1.0, 1.0);
        self.rest.interrupt();
    }

    fn is_force(&self, force: &Vector3<f64>) -> bool {
        force.iter().all(|f| f.abs() <= LARGEST_FORCE)
    }

    /// Corrects by what has been added up.
    fn update(&mut self) {
        let settings = self.settings;
        let secs = self.interval.secs;
        if self.report.updates == 0 {
            self.covariance
                .add(LEAD, (settings.lead_share * self.nominal).powi(2));
        }
        self.report.updates += 1;
        let force = self.mean_force();
        let is_levelled = force.is_some_and(|force| self.judge_tilt(&force));
        self.predict(force.as_ref());
        let mut correction: Correction = [0.0; WIDTH];
        if let Some(force) = force.filter(|_| !is_levelled && !self.wants_level) {
            self.use_gravity(&force, &mut correction);
        }
        if self.rest.is_at_rest(&settings) {
            // What the gyro reads of a world that turns is no bias.
            let of_world = self.interval.attitude.transpose() * self.world_rate;
            let mean = (self.interval.rate - of_world) / secs;
            for axis in 0..3 {
                let innovation = mean[axis] - self.calibration.bias[axis];
                self.covariance.measure(
                    &[(BIAS + axis, 1.0)],
                    innovation,
                    settings.rest_noise.powi(2) / secs,
                    &mut correction,
                );
            }
        }
        if self.interval.fields > 0.0 {
            self.use_field(&mut correction);
        }
        self.inject(&correction);
        self.interval = Interval::new();
        let attitude = self.correction.wxyz();
        if !self.covariance.is_sound() || !attitude.iter().all(|c| c.is_finite()) {
            self.report.failures += 1;
            self.forget_calibration();
            self.reset();
        }
    }

    fn mean_force(&self) -> Option<Force> {
        let sums = &self.interval;
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
        let secs = self.interval.secs;
        let half_square = 0.5 * secs * secs;
        let mut transition = Transition::none();
        let rows = &mut transition.0;
        let by_bias = self.interval.attitude * self.known.matrix;
        for axis in 0..3 {
            for j in 0..3 {
                rows[axis][BIAS + j] = -by_bias[(axis, j)];
                rows[axis][SCALE + j] = self.interval.scaled[axis][j];
                rows[axis][CROSS + j] = self.interval.scaled[axis][3 + j];
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
        self.covariance.step(&transition);
        let turned = settings.rate_noise.powi(2) * self.interval.turned_squared() / 9.0;
        self.covariance
            .add_to_attitude(settings.gyro_noise.powi(2) * secs + turned);
        for axis in 0..3 {
            self.covariance
                .add(BIAS + axis, settings.bias_walk.powi(2) * secs);
            self.covariance
                .add(FORCE_BIAS + axis, settings.force_bias_walk.powi(2) * secs);
        }
        for i in 0..2 {
            self.covariance
                .add(VELOCITY + i, settings.velocity_walk.powi(2) * secs);
        }
        if self.covariance.variance(FIELD) > 0.0 {
            let left = (-secs / settings.field_secs).exp();
            self.covariance.fade(FIELD, left);
            self.covariance
                .add(FIELD, settings.field_sigma.powi(2) * (1.0 - left * left));
            self.disturbance *= left;
        }
    }

    /// Corrects attitude and all else by what the measurements have found.
    fn inject(&mut self, correction: &Correction) {
        let tilt = Vector3::new(correction[TILT], correction[TILT + 1], 0.0);
        let heading = Vector3::z() * correction[HEADING];
        let turn =
            |phi: Vector3<f64>| Quaternion::<Nav, Nav>::from_rotation_vector(&RotationVector(phi));
        self.correction = (turn(heading) * (turn(tilt) * self.correction)).normalised();
        let three = |first: usize| {
            Vector3::from_fn(|i, _| correction.get(first + i).copied().unwrap_or(0.0))
        };
        for i in 0..2 {
            self.velocity[i] += correction[VELOCITY + i];
            self.position[i] += correction[POSITION + i];
        }
        let calibration = &mut self.calibration;
        calibration.bias += three(BIAS);
        calibration.scale += three(SCALE);
        calibration.cross += three(CROSS);
        calibration.force_bias += three(FORCE_BIAS);
        calibration.lead += correction[LEAD];
        self.disturbance += correction[FIELD];
        self.known = Applied::of(calibration);
        // The earth axes of the estimate have turned.
        let (sin, cos) = correction[HEADING].sin_cos();
        self.covariance.turn(cos, sin);
        for pair in [&mut self.velocity, &mut self.position] {
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
        self.correction = (turn * self.correction).normalised();
        for axis in [TILT, TILT + 1] {
            let variance = self.settings.tilt_start.powi(2);
            self.covariance.restart(axis, variance);
        }
        self.restart_reference(VELOCITY_START, POSITION_START);
        self.mean_acceleration = Vector3::zeros();
        self.report.levelled += 1;
        true
    }

    /// Covariance of the error of the attitude `q_nb` at the corrected `rate`, rad^2, body axes. More than the
    /// filter's own: accelerations are not white, sensors are late, and their axes are not those of their case.
    #[must_use]
    pub fn attitude_covariance(
        &self,
        q_nb: &Quaternion<Nav, Body>,
        rate: &Vector3<f64>,
    ) -> AttitudeCovariance {
        if !self.is_started {
            return AttitudeCovariance::from_sigma(Vector3::repeat(std::f64::consts::PI));
        }
        let r = *q_nb.to_dcm().as_matrix();
        let white = self.settings.gyro_noise.powi(2) * self.interval.secs;
        let mut earth = self.covariance.attitude();
        for axis in 0..3 {
            earth[(axis, axis)] += white;
        }
        let body = r.transpose() * earth * r * COLOURED + rate * rate.transpose() * (DELAY * DELAY);
        let [xx, xy, xz, yy, yz, zz] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
            .map(|(i, j)| body[(i, j)] + if i == j { CASE * CASE } else { 0.0 });
        AttitudeCovariance {
            xx,
            xy,
            xz,
            yy,
            yz,
            zz,
        }
    }

    /// Variances of tilt about east and north and of heading as the filter has them, rad^2: less than what
    /// [`Filter::attitude_covariance`] says.
    #[must_use]
    pub fn earth_variances(&self) -> [f64; 3] {
        [TILT, TILT + 1, HEADING].map(|state| self.covariance.variance(state))
    }
}

fn is_field(field: &Vector3<f64>) -> bool {
    field.iter().all(|m| m.abs() <= LARGEST_FIELD) && field.norm_squared() > 0.0
}
