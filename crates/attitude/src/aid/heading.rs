//! Mean magnetic field of an interval -> heading. Pure.
//!
//! One scalar: the heading of the horizontal field. Indoors it is off by degrees over tens of seconds, so a
//! state of its own stands for the disturbance. A field whose norm or dip is another than before counts less,
//! and a heading far from the expected one too, until it has lasted long enough to be the truth.

use super::covariance::{Correction, FIELD, HEADING, IRON, TILT};
use super::filter::Filter;
use super::surroundings::Field;
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// Time constant of the mean of another field, s.
const OTHER_SECS: f64 = 5.0;
/// Time constant of the mean deviation, s.
const DEVIATION_SECS: f64 = 3.0;
/// Time constant of the mean norm that hard iron is judged by, s, and how far the norm is off by itself, as a share.
const NORM_SECS: f64 = 30.0;
const NORM_SIGMA: f64 = 0.03;
/// A field steeper than this (horizontal share) has no heading.
const STEEPEST: f64 = 0.1;

/// The magnetic field that headings are taken from.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FieldQuality {
    /// Length, in the unit of the measurements.
    pub norm: f64,
    /// Dip, downwards from horizontal, rad.
    pub dip: f64,
    /// Root mean square deviation of norm (as a share) and dip (rad) over the last seconds, per horizontal share:
    /// of the size of the heading's error by it, rad.
    pub deviation: f64,
}

impl Filter {
    /// Quality of the field; `None` before the first.
    #[must_use]
    pub fn field(&self) -> Option<FieldQuality> {
        let Field { norm, dip } = self.state.surroundings.reference?;
        Some(FieldQuality {
            norm,
            dip,
            deviation: self.state.surroundings.deviation.max(0.0).sqrt(),
        })
    }

    /// A field without what is known of hard iron, whose uncertainty begins with the first.
    pub(super) fn less_iron(&mut self, field: Vector3<f64>) -> Vector3<f64> {
        if !self.state.covariance.has_iron() {
            return field;
        }
        if self.state.covariance.variance(IRON) == 0.0 {
            let sigma = self.settings.hard_iron * field.norm();
            for axis in 0..3 {
                self.state.covariance.restart(IRON + axis, sigma * sigma);
            }
        }
        field - self.state.calibration.hard_iron
    }

    /// Adds a heading from outside, by which that of the attitude is off by `off` (rad), of this variance (rad^2).
    pub(super) fn add_outside_heading(&mut self, off: f64, variance: f64) {
        let [sum, weight] = &mut self.state.interval.outside;
        (*sum, *weight) = (*sum + off / variance, *weight + 1.0 / variance);
    }

    /// The measurement of heading by what came from outside, where it did.
    pub(super) fn use_outside_heading(&mut self, correction: &mut Correction) {
        let [sum, weight] = self.state.interval.outside;
        if weight > 0.0 {
            let (off, variance) = (sum / weight, 1.0 / weight);
            self.state
                .covariance
                .measure(&[(HEADING, 1.0)], off, variance, correction);
        }
    }

    /// The heading is known to this variance (rad^2), and has nothing in common with what else is known.
    pub(super) fn know_heading(&mut self, variance: f64) {
        self.state.covariance.restart(HEADING, variance);
        self.state.interval.outside = [0.0; 2];
    }

    /// Variance of the heading, rad^2.
    pub(super) fn heading_variance(&self) -> f64 {
        self.state.covariance.variance(HEADING)
    }

    /// Hard iron makes the norm of the field change with the attitude.
    fn use_norm(&mut self, correction: &mut Correction) {
        let secs = self.state.interval.secs;
        let field = self.state.interval.field_in_body / self.state.interval.fields;
        let norm = field.norm();
        let mean = &mut self.state.surroundings.mean_norm;
        if *mean == 0.0 {
            *mean = norm;
        }
        *mean += secs / (NORM_SECS + secs) * (norm - *mean);
        if norm.is_nan() || norm <= 0.0 {
            return;
        }
        let (off, white) = (norm - *mean, NORM_SIGMA * *mean);
        let sigmas = off.abs() / white;
        let robust = (0.5 * sigmas).max(1.0).powi(2);
        let by_iron = |axis: usize| (IRON + axis, -field[axis] / norm);
        self.state.covariance.measure(
            &[by_iron(0), by_iron(1), by_iron(2)],
            -off,
            white * white * 2.0 * self.settings.field_secs / secs * robust,
            correction,
        );
    }

    /// The measurement of heading, where there is one.
    pub(super) fn use_field(&mut self, correction: &mut Correction) {
        let settings = self.settings;
        let secs = self.state.interval.secs;
        let field: Vector3<f64> = self.state.interval.field / self.state.interval.fields;
        let level = field.x.hypot(field.y);
        let now = Field {
            norm: level.hypot(field.z),
            dip: (-field.z).atan2(level),
        };
        if now.norm.is_nan() || now.norm <= 0.0 {
            return;
        }
        let at_rest = self.rests();
        let around = &mut self.state.surroundings;
        let reference = around.reference.get_or_insert(now);
        let (norm_off, dip_off) = reference.off(&now);
        let fits = reference.is_like(&now, &settings);
        if fits {
            reference.approach(&now, secs / (settings.field_mean_secs + secs));
        }
        // Another homogeneous field is accepted in time, while the body moves.
        let other = around.other.get_or_insert(now);
        other.approach(&now, secs / (OTHER_SECS + secs));
        if !fits && other.is_like(&now, &settings) {
            if !at_rest {
                around.other_secs += secs;
            }
            if around.other_secs >= settings.field_new_secs {
                *reference = *other;
                around.other_secs = 0.0;
            }
        } else if fits {
            around.other_secs = 0.0;
        } else {
            around.other_secs = (around.other_secs - 2.0 * secs).max(0.0);
        }
        let has_iron = self.state.covariance.has_iron();
        if has_iron {
            self.use_norm(correction);
        }
        let around = &mut self.state.surroundings;
        let horizontal = level / now.norm;
        if horizontal < STEEPEST {
            self.state.report.fields_rejected += 1;
            return;
        }
        let deviation = (norm_off * norm_off + dip_off * dip_off) / (horizontal * horizontal);
        around.deviation += (deviation - around.deviation) * (secs / (DEVIATION_SECS + secs));
        let covariance = &mut self.state.covariance;
        let steep = field.z / level;
        let tilt = covariance.variance(TILT) + covariance.variance(TILT + 1);
        let white = settings.field_noise.powi(2);
        let mut variance = white / secs
            + settings.field_gate * deviation.max(around.deviation) * 2.0 * settings.field_secs
                / secs
            + steep * steep * tilt / (2.0 * secs);
        // The field is seen turned to the east by as much as the heading is off.
        let residual = wrapped(field.x.atan2(field.y) - self.state.disturbance);
        let expected = covariance.variance(HEADING)
            + covariance.variance(FIELD)
            + 2.0 * covariance.between(HEADING, FIELD);
        let sigmas = residual.abs() / (expected + white).sqrt();
        if sigmas > settings.field_robust {
            self.state.report.fields_rejected += 1;
            if fits {
                around.contradicted += secs;
            }
            if around.contradicted >= settings.field_new_secs {
                covariance.add(HEADING, residual * residual);
                around.contradicted = 0.0;
            } else {
                let excess = sigmas / settings.field_robust;
                variance += (expected + white) * excess * excess * settings.field_secs / secs;
            }
        } else {
            around.contradicted = (around.contradicted - 2.0 * secs).max(0.0);
        }
        let seen = self.state.interval.by_iron / (self.state.interval.fields * level);
        let h = [
            (HEADING, 1.0),
            (FIELD, 1.0),
            (IRON, seen.x),
            (IRON + 1, seen.y),
            (IRON + 2, seen.z),
        ];
        let h = if has_iron { &h[..] } else { &h[..2] };
        self.derived.innovation.heading = covariance.measure(h, residual, variance, correction);
    }
}

/// The same angle in -pi..=pi.
pub(super) fn wrapped(angle: f64) -> f64 {
    let turns = (angle / TAU).round();
    (angle - turns * TAU).clamp(-PI, PI)
}
