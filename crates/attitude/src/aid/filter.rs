//! The filter: what it holds, what a sample adds, what a gap leaves unknown. Pure.

mod learned;

use super::beside::VectorPairing;
use super::calibration::{Calibration, CorrectionMatrices};
use super::covariance::{BIAS, TILT};
use super::interval::Interval;
use super::other_class::ClassDoubt;
use super::settings::Settings;
use super::state::State;
use super::vertical::Vertical;
use crate::frames::{Body, In, Nav};
use crate::quaternion::Quaternion;
use crate::record::Status;
use nalgebra::{Matrix3, Vector3};

/// Accelerations are not white, which makes errors larger than they are thought to be.
pub(super) const COLOURED: f64 = 2.0;
/// A specific force beyond this (each component, m/s^2) is none.
const LARGEST_FORCE: f64 = 1000.0;
/// A field beyond this (each component, whatever its unit) is none.
const LARGEST_FIELD: f64 = 1e6;
/// Time for which a specific force counts for the present, s.
const FORCE_SECS: f64 = 0.5;
/// One sigma of the scale, and of the angles between the axes (rad), of a gyro that is none of its class.
pub(super) const WIDE: f64 = 0.01;
/// Sigma of tilt, rad, from which one that was clipped is levelled: what a correction does not know of the heading is lost.
const CLIPPED_LEVEL: f64 = 1.0;
/// Number of gaps in a row after which the sensor has become slower.
const GAPS_IN_A_ROW: u32 = 20;

/// One sample as it was measured, and the attitude it led to.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Measured {
    /// Time since the sample before, s.
    pub secs: f64,
    /// The gyro, rad/s, body axes: at the instant or its mean since the sample before.
    pub rate: Vector3<f64>,
    /// Specific force at the instant, m/s^2, body axes; up at rest.
    pub force: Option<Vector3<f64>>,
    /// Magnetic field at the instant, any linear unit, body axes. One that was measured only once comes once.
    pub field: Option<Vector3<f64>>,
    /// Whether the gyro was at the end of its range.
    #[cfg_attr(feature = "serde", serde(default))]
    pub is_saturated: bool,
}

/// Counts of what happened.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    /// Specific forces with stamps of their own that are no numbers, or that no gyro sample was near.
    pub forces_unpaired: u64,
    /// Fields that reached a gyro sample.
    pub fields: u64,
    /// Fields that were doubted or not used.
    pub fields_rejected: u64,
    /// Fields that are no numbers, or that no gyro sample was near: another clock, or a gap.
    pub fields_unpaired: u64,
    /// Samples at the gyro's range.
    pub saturated: u64,
    /// Full starts because the numbers had become impossible.
    pub failures: u64,
}

/// Innovation: measured less expected, with one sigma of that, rad; NaN where nothing was measured.
/// Its sigma follows the accelerations that are seen, so it is the mean that tells a wrong model: it should be nothing.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Innovation {
    /// Innovation of gravity, as the tilt it would be: the specific force along x and y of the world, over gravity.
    pub gravity: [(f64, f64); 2],
    /// Innovation of the heading by the field.
    pub heading: (f64, f64),
}

impl Innovation {
    pub(super) const NONE: Innovation = Innovation {
        gravity: [(f64::NAN, f64::NAN); 2],
        heading: (f64::NAN, f64::NAN),
    };
}

/// Corrects what a propagator integrates. See the [module](crate::aid).
#[derive(Clone, Debug)]
pub struct Filter {
    pub(super) settings: Settings,
    /// A rate is that at its instant, not the mean since the one before.
    pub(super) is_instant: bool,
    /// Rate of the world, rad/s, earth axes.
    pub(super) world_rate: Vector3<f64>,
    pub(super) state: State,
    pub(super) derived: Derived,
}

/// Values that follow from the state, or are of the last sample alone: none of them is saved.
#[derive(Clone, Debug)]
pub(super) struct Derived {
    /// The calibration, as rates are corrected by it.
    pub(super) known: CorrectionMatrices,
    /// Whether it was levelled since the sample before.
    pub(super) has_levelled: bool,
    /// Innovation of the last correction.
    pub(super) innovation: Innovation,
    /// The class that the sensor may be of instead.
    pub(super) doubt: Option<ClassDoubt>,
}

impl Filter {
    /// Makes one for a gyro whose samples are rates at their instants (`is_instant`) or means since the sample
    /// before, in a world that turns at `world_rate` (rad/s).
    #[must_use]
    pub(crate) fn new(settings: Settings, is_instant: bool, world_rate: In<Nav>) -> Filter {
        let mut filter = Filter {
            settings,
            is_instant,
            world_rate: *world_rate.as_vector(),
            state: State::default(),
            derived: Derived {
                known: CorrectionMatrices::of(&Calibration::default()),
                has_levelled: false,
                innovation: Innovation::NONE,
                doubt: None,
            },
        };
        filter.forget_calibration();
        filter
    }

    /// Settings.
    pub(crate) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Calibration by which the rates that come now are to be corrected.
    pub(crate) fn applied(&self) -> CorrectionMatrices {
        self.derived.known
    }

    /// Whether a magnetometer is to tell the heading.
    #[must_use]
    pub fn has_field(&self) -> bool {
        self.settings.has_field
    }

    /// Report of what happened so far.
    #[must_use]
    pub fn report(&self) -> Report {
        self.state.report
    }

    /// Counts vectors that were measured on topics of their own.
    pub(super) fn count_beside(&mut self, forces: Option<&VectorPairing>, fields: &VectorPairing) {
        self.state.report.fields = fields.paired;
        self.state.report.fields_unpaired = fields.unpaired + fields.not_finite;
        self.state.report.forces_unpaired =
            forces.map_or(0, |forces| forces.unpaired + forces.not_finite);
    }

    /// Whether the sensor has been at rest for long enough to say so.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        self.state.is_started && self.rests()
    }

    /// The same for the filter itself, which asks only when it has begun.
    pub(super) fn rests(&self) -> bool {
        self.state.rest.is_quiet(&self.settings) && self.state.since_force <= FORCE_SECS
    }

    /// Whether what was taken for a specific force was found to be none: nothing is corrected by it.
    #[must_use]
    pub fn is_force_implausible(&self) -> bool {
        self.state.plausibility.is_denied()
    }

    /// Status of an attitude, which is that of the last sample it took.
    pub(crate) fn status(&self) -> Status {
        if !self.state.is_started || self.is_force_implausible() {
            return Status::OK;
        }
        let mut status = Status::AIDED;
        if self.rests() {
            status = status.with(Status::REST);
        }
        if self.derived.has_levelled {
            status = status.with(Status::LEVELLED);
        }
        status
    }

    /// Whether tilt is known: a specific force has come.
    #[must_use]
    pub fn is_started(&self) -> bool {
        self.state.is_started
    }

    /// The attitude that the propagator's is, and its matrix.
    #[must_use]
    #[inline]
    pub(crate) fn corrected(
        &self,
        propagated: &Quaternion<Nav, Body>,
    ) -> (Quaternion<Nav, Body>, Matrix3<f64>) {
        let attitude = self.state.correction * *propagated;
        (attitude.normalised(), *attitude.to_dcm().as_matrix())
    }

    /// Time of the next correction.
    pub(crate) fn due(&self) -> Due {
        Due {
            secs: self.state.interval.secs,
            update_secs: self.settings.update_secs,
        }
    }

    /// Takes the next sample after it has begun, whose rate the propagator was given corrected by `known`. `r` is the
    /// matrix of its attitude, corrected, at the sample's instant. Whether that has been corrected further.
    pub(crate) fn take(
        &mut self,
        sample: &Measured,
        known: &CorrectionMatrices,
        r: &Matrix3<f64>,
    ) -> bool {
        let secs = sample.secs;
        self.derived.has_levelled = false;
        let is_gap =
            self.state.nominal > 0.0 && secs > self.settings.gap_factor * self.state.nominal;
        let rate = if is_gap || self.is_instant {
            0.5 * (sample.rate + self.state.last_rate)
        } else {
            sample.rate
        };
        self.state.interval.turn(secs, r, &rate, known);
        let at_instant = if self.is_instant { sample.rate } else { rate };
        let force = self.add_force(sample, r, known.corrected(at_instant, 1.0), is_gap);
        if let Some(field) = sample.field.filter(is_field) {
            let field = self.less_iron(field);
            self.state.interval.field += r * field;
            if self.state.covariance.has_iron() {
                self.state.interval.field_in_body += field;
                self.state.interval.by_iron += r.row(0).transpose();
            }
            self.state.interval.fields += 1.0;
        }
        let sigma = |axis: usize| self.state.covariance.variance(BIAS + axis).max(0.0).sqrt();
        let bias = (&self.state.calibration.bias, sigma);
        self.state
            .rest
            .take(secs, &rate, force.as_ref(), bias, &self.settings);
        self.doubt_turn(sample, is_gap, r);
        self.state.last_rate = sample.rate;
        if !is_gap {
            self.state.gaps_in_a_row = 0;
            self.state.nominal = if self.state.nominal > 0.0 {
                self.state.nominal + 0.05 * (secs - self.state.nominal)
            } else {
                secs
            };
        } else {
            self.state.gaps_in_a_row += 1;
            if self.state.gaps_in_a_row >= GAPS_IN_A_ROW {
                self.state.nominal = secs;
                self.state.gaps_in_a_row = 0;
            }
        }
        let is_due = is_due(self.state.interval.secs, secs, self.settings.update_secs);
        if is_due {
            self.update();
        }
        is_due
    }

    /// The propagator held the attitude over `secs` of which nothing is known.
    pub(crate) fn hold(&mut self, sample: &Measured) {
        self.state.interval = Interval::default();
        self.state.last_force = None;
        self.derived.has_levelled = false;
        // A clock that was set back does not say how long it was.
        let secs = sample.secs.max(0.0);
        let walk = self.settings.bias_walk.powi(2) * secs;
        for axis in 0..3 {
            self.state.covariance.add(BIAS + axis, walk);
        }
        self.lose_sight(sample, secs);
        self.state.last_rate = sample.rate;
    }

    /// The force of a sample in the sums; what of it can be used.
    fn add_force(
        &mut self,
        sample: &Measured,
        r: &Matrix3<f64>,
        rate: Vector3<f64>,
        is_gap: bool,
    ) -> Option<Vector3<f64>> {
        self.state.since_force += sample.secs;
        let measured = sample.force?;
        if self.state.plausibility.is_denied() {
            return None;
        }
        if !self.is_force(&measured) {
            self.state.report.forces_rejected += 1;
            return None;
        }
        // It stands for the time since the one before it.
        let secs = self
            .state
            .since_force
            .min(sample.secs.max(self.settings.update_secs));
        self.state.since_force = 0.0;
        if self
            .state
            .plausibility
            .denies(secs, &(r * measured), self.settings.gravity)
        {
            self.give_gravity_up();
            return None;
        }
        let turning = rate.cross(&measured);
        let force = r
            * (measured - self.state.calibration.force_bias
                + turning * self.state.calibration.lead);
        let mean = match self.state.last_force {
            Some(last) if is_gap => 0.5 * (force + last),
            _ => force,
        };
        self.state.last_force = Some(force);
        self.state.interval.force += mean * secs;
        self.state.interval.lead += r * turning * secs;
        self.state.interval.force_secs += secs;
        Some(measured)
    }

    /// Adds what a gap, a jump or the end of the gyro's range leaves unknown of a rotation.
    fn doubt_turn(&mut self, sample: &Measured, is_gap: bool, r: &Matrix3<f64>) {
        let secs = sample.secs;
        let jump = sample.rate - self.state.last_rate;
        if is_gap {
            let jump = jump.norm();
            self.state.report.gaps += 1;
            self.state
                .covariance
                .add_to_attitude(jump * jump * secs * secs / 36.0);
            if secs > self.settings.gap_secs {
                self.lose_sight(sample, secs - self.settings.gap_secs);
            }
        }
        let ordinary = if is_gap || self.state.nominal <= 0.0 {
            secs
        } else {
            self.state.nominal
        };
        let most = self.settings.jerk * ordinary;
        let change = jump.norm_squared();
        if change > most * most {
            let excess = jump.norm() - most;
            self.state
                .covariance
                .add_to_attitude((excess * secs).powi(2));
        }
        self.state.report.saturated += u64::from(sample.is_saturated);
        let unknown = self
            .state
            .clipped
            .add(sample.is_saturated, &sample.rate, change, secs);
        for (axis, variance) in unknown.iter().enumerate().filter(|(_, v)| **v > 0.0) {
            let axis = r.column(axis).into_owned();
            self.state.covariance.add_about(&axis, *variance);
            self.state.interval.is_clipped = true;
            self.want_level(CLIPPED_LEVEL);
        }
    }

    /// Nothing is known of what the body did for `secs`.
    fn lose_sight(&mut self, sample: &Measured, secs: f64) {
        let fastest = |i: usize| sample.rate[i].powi(2).max(self.state.last_rate[i].powi(2));
        let squared: f64 = (0..3).map(fastest).sum();
        let unknown = ((squared / 3.0 + 0.01) * secs * secs).min(3.0);
        self.state.covariance.add_to_attitude(unknown);
        self.want_level(self.settings.level_sigma);
        self.restart_reference(1.0, 1.0);
        self.state.rest.interrupt();
        self.state.vertical = Vertical::default();
    }

    /// Asks for levelling where the tilt is known to no more than `sigma`, rad: a correction is linear.
    fn want_level(&mut self, sigma: f64) {
        let tilts = [TILT, TILT + 1].map(|axis| self.state.covariance.variance(axis));
        self.state.wants_level |= tilts[0].max(tilts[1]) > sigma * sigma;
    }

    pub(super) fn is_force(&self, force: &Vector3<f64>) -> bool {
        force.iter().all(|f| f.abs() <= LARGEST_FORCE)
    }
}

/// Whether `secs` of an interval, the last step of which took `step`, are enough for a correction.
fn is_due(secs: f64, step: f64, update_secs: f64) -> bool {
    secs >= update_secs - 0.25 * step
}

/// Time until the next correction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Due {
    secs: f64,
    update_secs: f64,
}

impl Due {
    /// Whether it comes with the next sample, `step` s after the one before.
    pub(crate) fn comes(&mut self, step: f64) -> bool {
        self.secs += step.max(0.0);
        is_due(self.secs, step.max(0.0), self.update_secs)
    }
}

pub(super) fn is_field(field: &Vector3<f64>) -> bool {
    field.iter().all(|m| m.abs() <= LARGEST_FIELD) && field.norm_squared() > 0.0
}
