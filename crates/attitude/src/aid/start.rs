//! Start of the filter, and its restart. Pure.

use super::calibration::CorrectionMatrices;
use super::covariance::{BIAS, FIELD, HEADING, POSITION, TILT, VELOCITY};
use super::drift::Drift;
use super::filter::{Filter, Measured, is_field};
use super::interval::Interval;
use super::residuals::Residuals;
use super::rest::Rest;
use super::surroundings::Surroundings;
use super::vertical::Vertical;
use crate::condition::stillness::level;
use crate::frames::{Body, Dcm, In, Nav};
use crate::quaternion::{Quaternion, RotationVector};
use nalgebra::{Matrix3, Vector3};

/// Variances of velocity and position where the reference starts, (m/s)^2, m^2.
pub(super) const VELOCITY_START: f64 = 0.01;
pub(super) const POSITION_START: f64 = 1e-4;
/// Sigma of the heading where the first sample has no field, rad.
const HEADING_UNKNOWN: f64 = 3.0;
/// Sigma of a tilt that nothing has told, rad.
const TILT_UNKNOWN: f64 = 1.5;
/// Error that a bias may have after a reset, rad/s.
const BIAS_AFTER_RESET: f64 = 8.7e-4;

impl Filter {
    /// Begins at a first sample: level by its specific force and with the heading of the propagator's attitude,
    /// or north by its field. Without a force the attitude is the propagator's for now.
    pub(crate) fn begin(&mut self, first: &Measured, propagated: &Quaternion<Nav, Body>) {
        self.state.last_rate = first.rate;
        self.state.last_force = None;
        self.state.since_force = 0.0;
        self.state.interval = Interval::default();
        let is_denied = self.is_force_implausible();
        let force = first.force.filter(|f| self.is_force(f) && f.norm() > 0.0);
        let Some(force) = force.filter(|_| !is_denied) else {
            return;
        };
        let field = first.field.filter(is_field);
        let field = field.map(|field| self.less_iron(field));
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
                let tilted = level(&In::assume(force)).unwrap_or_else(Quaternion::identity);
                let yaw = Vector3::z() * propagated.yaw_pitch_roll().yaw;
                Quaternion::<Nav, Nav>::from_rotation_vector(&RotationVector(yaw)) * tilted
            }
        };
        let heading = match (field, north) {
            (_, Some(_)) => self.settings.heading_start,
            (Some(_), None) => HEADING_UNKNOWN,
            (None, _) if self.settings.has_field => HEADING_UNKNOWN,
            (None, _) => 0.0,
        };
        self.start(attitude * propagated.inverse(), heading * heading, force);
    }

    /// Begins with the attitude as the propagator has it, known to `tilt` and `heading` (rad).
    pub(crate) fn begin_known(&mut self, first: &Measured, tilt: f64, heading: f64) {
        self.state.last_rate = first.rate;
        self.state.last_force = None;
        self.state.since_force = 0.0;
        let force = first
            .force
            .filter(|f| self.is_force(f))
            .unwrap_or(Vector3::z() * self.settings.gravity);
        self.start(Quaternion::identity(), heading * heading, force);
        for axis in [TILT, TILT + 1] {
            self.state.covariance.restart(axis, tilt * tilt);
        }
    }

    /// Gives gravity up: what levelled was no specific force, and nothing is known of the tilt but what the gyro says
    /// of its changes.
    pub(super) fn give_gravity_up(&mut self) {
        for axis in [TILT, TILT + 1] {
            self.state
                .covariance
                .restart(axis, TILT_UNKNOWN * TILT_UNKNOWN);
        }
        self.state.last_force = None;
        self.state.rest.interrupt();
    }

    /// Begins the heading anew, and leaves the tilt and the calibration: where no field tells it, it is what the world
    /// is turned by; else the next field tells it.
    pub(super) fn restart_heading(&mut self) {
        let heading = match self.settings.has_field {
            true => HEADING_UNKNOWN,
            false => 0.0,
        };
        self.state.covariance.restart(HEADING, heading * heading);
        if self.settings.has_field {
            let sigma = self.settings.field_sigma;
            self.state.covariance.restart(FIELD, sigma * sigma);
            self.state.disturbance = 0.0;
            self.state.surroundings = Surroundings::default();
        }
    }

    /// Resets, and keeps the calibration, known a little less.
    pub(crate) fn reset(&mut self) {
        self.begin_anew();
        for axis in 0..3 {
            self.state
                .covariance
                .add(BIAS + axis, BIAS_AFTER_RESET * BIAS_AFTER_RESET);
        }
    }

    /// The attitude is not known any more, the calibration as well as before.
    pub(crate) fn begin_anew(&mut self) {
        self.state.is_started = false;
        self.derived.has_levelled = false;
        self.state.correction = Quaternion::identity();
    }

    fn start(&mut self, correction: Quaternion<Nav, Nav>, heading: f64, force: Vector3<f64>) {
        let settings = &self.settings;
        self.state.correction = correction.normalised();
        self.state
            .covariance
            .restart(TILT, settings.tilt_start * settings.tilt_start);
        self.state
            .covariance
            .restart(TILT + 1, settings.tilt_start * settings.tilt_start);
        self.state.covariance.restart(HEADING, heading);
        for i in 0..2 {
            self.state.covariance.restart(VELOCITY + i, VELOCITY_START);
            self.state.covariance.restart(POSITION + i, POSITION_START);
        }
        let disturbed = if heading > 0.0 {
            settings.field_sigma * settings.field_sigma
        } else {
            0.0
        };
        self.state.covariance.restart(FIELD, disturbed);
        (
            self.state.velocity,
            self.state.position,
            self.state.disturbance,
        ) = ([0.0; 2], [0.0; 2], 0.0);
        self.state.interval = Interval::default();
        self.state.rest = Rest::new(force);
        self.state.residuals = Residuals::new(settings);
        self.state.mean_acceleration = Vector3::zeros();
        self.state.surroundings = Surroundings::default();
        self.state.wants_level = false;
        self.state.is_started = true;
    }

    /// The sensor as it was switched on.
    pub(super) fn forget_calibration(&mut self) {
        let settings = self.settings;
        (self.state.calibration, self.state.covariance) = settings.prior.begin(&settings);
        self.derived.known = CorrectionMatrices::of(&self.state.calibration);
        self.state.is_widened = false;
        self.state.vertical = Vertical::default();
        self.state.drift = Drift::default();
        self.forget_class();
    }
}
