//! Account of what corrected the attitude and what it learned -> words, JSON. Pure.

use super::significant;
use crate::finding::{Finding, Severity};
use nalgebra::Vector3;
use serde_json::{Value, json};
use strapd_attitude::aid::{Calibration, Filter, Report};
use strapd_attitude::record::Nanos;
use strapd_attitude::setting::{AID, BIAS, NOISE};

/// The filter at the end of a run.
#[derive(Clone, Copy, Debug)]
pub struct FilterSummary {
    started: bool,
    has_field: bool,
    is_implausible: bool,
    is_beyond_class: bool,
    is_bias_unobserved: bool,
    moved_from: Option<Vector3<f64>>,
    is_at_rest: bool,
    report: Report,
    calibration: Calibration,
    sigma: Calibration,
}

/// Stretch for which a magnetic field stood still while the body rotated.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Frozen {
    /// Total time, s.
    pub(crate) secs: f64,
    /// Beginning of the first.
    pub(crate) from: Nanos,
}

/// Parts in a million.
const PPM: f64 = 1e6;

impl FilterSummary {
    /// Makes it of `filter` as it is now.
    #[must_use]
    pub fn of(filter: &Filter) -> FilterSummary {
        FilterSummary {
            started: filter.is_started(),
            has_field: filter.has_field(),
            is_implausible: filter.is_force_implausible(),
            is_beyond_class: filter.is_beyond_class(),
            is_bias_unobserved: filter.is_bias_unobserved(),
            moved_from: filter.bias_moved_from(),
            is_at_rest: filter.is_at_rest(),
            report: filter.report(),
            calibration: *filter.calibration(),
            sigma: filter.calibration_sigma(),
        }
    }

    /// Lines for people: what it did, then what it learned.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        if !self.started {
            return vec!["gravity, but no specific force came: the gyro alone".to_owned()];
        }
        let Report {
            updates,
            fields,
            fields_rejected,
            fields_unpaired,
            forces_unpaired,
            levelled,
            restarts,
            forces_rejected,
            saturated,
            failures,
            ..
        } = self.report;
        let mut did = if self.has_field {
            format!(
                "gravity and field: {updates} gravity updates, heading by {fields} fields of the magnetometer ({AID} gravity: without)"
            )
        } else {
            format!(
                "gravity: {updates} gravity updates, heading the gyro's ({AID} none: the gyro alone)"
            )
        };
        if self.is_implausible {
            did +=
                "; GIVEN UP: what the accelerometer says has no gravity in it (force_implausible)";
        }
        if self.has_field && fields == 0 {
            did += "; NO FIELD belonged to a sample";
        }
        for (n, what) in [
            (restarts, "acceleration rejected"),
            (levelled, "re-initialised"),
        ] {
            match n {
                0 => {}
                1 => did += &format!(", {what} once"),
                _ => did += &format!(", {what} {n} times"),
            }
        }
        for (n, what) in [
            (
                fields_unpaired,
                "fields half a second off every sample, or no numbers",
            ),
            (
                forces_unpaired,
                "forces half a second off every sample, or no numbers",
            ),
            (fields_rejected, "corrections by the field doubted"),
            (forces_rejected, "forces not finite or too large"),
            (saturated, "samples at the gyro's range"),
            (failures, "FULL RESTARTS"),
        ] {
            if n > 0 {
                did += &format!(", {n} {what}");
            }
        }
        let deg = |v: &Vector3<f64>| triple(&v.map(f64::to_degrees));
        let mut lines = vec![
            did,
            format!(
                "learned: bias {} +- {} deg/s, scale {} +- {} %, accelerometer time offset {} ms",
                deg(&self.calibration.bias),
                deg(&self.sigma.bias),
                triple(&(self.calibration.scale * 100.0)),
                triple(&(self.sigma.scale * 100.0)),
                significant(self.calibration.lead * 1e3, 2)
            ),
        ];
        if self.is_bias_unobserved {
            lines.push(format!(
                "the bias is not observed: the body turns about its vertical axis only and does not rest, so its heading drifts as the gyro's ({BIAS} x,y,z gives the bias)"
            ));
        }
        if let Some(from) = &self.moved_from {
            lines.push(format!(
                "the bias moved on the way, from {} to {} deg/s: a gyro that warms up does so, and the filter followed it",
                deg(from),
                deg(&self.calibration.bias)
            ));
        }
        if self.has_iron() {
            lines.push(format!(
                "hard iron {} +- {}, in the unit of the field",
                triple(&self.calibration.hard_iron),
                triple(&self.sigma.hard_iron)
            ));
        }
        lines
    }

    /// Whether hard iron was looked for, in fields that came.
    fn has_iron(&self) -> bool {
        self.sigma.hard_iron.x > 0.0
    }

    /// The gyro's bias that was learned, beside what was removed before, rad/s.
    #[must_use]
    pub fn bias(&self) -> Vector3<f64> {
        self.calibration.bias
    }

    /// Rows of what was learned: what and in which unit, about x, y, z, and one sigma of each; `None` where no
    /// force came.
    #[must_use]
    pub fn learned(&self) -> Option<Vec<Vec<String>>> {
        let (found, sigma) = (&self.calibration, &self.sigma);
        let three = |name: &str, value: Vector3<f64>, sigma: Vector3<f64>| {
            let numbers = value.iter().chain(sigma.iter());
            let said = numbers.map(|v| significant(*v, 3));
            std::iter::once(name.to_owned()).chain(said).collect()
        };
        let one = |name: &str, value: f64, sigma: f64| {
            let mut row = vec![String::new(); 7];
            for (cell, said) in row.iter_mut().step_by(3).zip([
                name.to_owned(),
                significant(value, 3),
                significant(sigma, 3),
            ]) {
                *cell = said;
            }
            row.swap(3, 1);
            row.swap(6, 4);
            row
        };
        let deg = f64::to_degrees;
        self.started.then(|| {
            vec![
                three("gyro bias, deg/s", found.bias.map(deg), sigma.bias.map(deg)),
                three("gyro scale, %", found.scale * 100.0, sigma.scale * 100.0),
                three(
                    "gyro misalignment, deg",
                    found.cross.map(deg),
                    sigma.cross.map(deg),
                ),
                three(
                    "accelerometer bias, m/s^2",
                    found.force_bias,
                    sigma.force_bias,
                ),
                one(
                    "accelerometer time offset, ms",
                    found.lead * 1e3,
                    sigma.lead * 1e3,
                ),
            ]
        })
    }

    /// Finding for forces that turn out to have no gravity in them.
    #[must_use]
    pub fn given_up(&self) -> Option<Finding> {
        (self.started && self.is_implausible).then(|| {
            Finding::new(
                Severity::Warning,
                "force-implausible",
                "gravity was given up on the way: what the accelerometer says does not turn as the gyro does, or is no gravity (force_implausible)",
            )
            .advise("look at the unit and the axes of both")
        })
    }

    /// Finding for a sensor that is farther off than those of its class, `noise`, are.
    #[must_use]
    pub fn doubt(&self, noise: &str) -> Option<Finding> {
        let largest = |v: &Vector3<f64>, scale: f64| significant(v.amax() * scale, 2);
        let found = || {
            Finding::new(
                Severity::Warning,
                "beyond-class",
                format!(
                    "the sensor is farther off than those of class {noise} are (scale {} %, misalignment {} deg, accelerometer {} m/s^2): sigma was too small until that was seen",
                    largest(&self.calibration.scale, 100.0),
                    largest(&self.calibration.cross, 1f64.to_degrees()),
                    largest(&self.calibration.force_bias, 1.0),
                ),
            )
            .with("noise", noise)
        };
        (self.started && self.is_beyond_class).then(|| match noise {
            "uncalibrated" => found().advise(format!("give its sizes to {NOISE} as a list")),
            _ => found()
                .advise("a class expects that")
                .help([NOISE.to("uncalibrated")]),
        })
    }

    /// Text of what the sigma of the attitude is of.
    #[must_use]
    pub fn sigma_text(&self) -> &'static str {
        if self.has_field {
            "of tilt and of heading from north, as the filter knows them"
        } else {
            "of tilt and of heading relative to the start, as the filter knows them"
        }
    }

    /// JSON for machines.
    #[must_use]
    pub fn json(&self) -> Value {
        let list = |v: &Vector3<f64>| json!([v.x, v.y, v.z]);
        let numbers = |c: &Calibration| {
            json!({
                "gyro_bias_rad_s": list(&c.bias),
                "gyro_scale_ppm": list(&(c.scale * PPM)),
                "gyro_cross_rad": list(&c.cross),
                "accel_bias_m_s2": list(&c.force_bias),
                "accel_lead_s": c.lead,
                "mag_hard_iron": self.has_iron().then(|| list(&c.hard_iron)),
            })
        };
        json!({
            "by": if self.has_field { "gravity+mag" } else { "gravity" },
            "force_implausible": self.is_implausible,
            "beyond_class": self.is_beyond_class,
            "bias_unobserved": self.is_bias_unobserved,
            "bias_moved_from_rad_s": self.moved_from.as_ref().map(list),
            "fields": self.report.fields,
            "fields_doubted": self.report.fields_rejected,
            "fields_unpaired": self.report.fields_unpaired,
            "forces_unpaired": self.report.forces_unpaired,
            "started": self.started,
            "at_rest": self.is_at_rest,
            "corrections": self.report.updates,
            "levelled": self.report.levelled,
            "reference_restarts": self.report.restarts,
            "gaps": self.report.gaps,
            "forces_rejected": self.report.forces_rejected,
            "saturated": self.report.saturated,
            "full_restarts": self.report.failures,
            "learned": numbers(&self.calibration),
            "sigma": numbers(&self.sigma),
        })
    }
}

fn triple(v: &Vector3<f64>) -> String {
    format!(
        "({}, {}, {})",
        significant(v.x, 2),
        significant(v.y, 2),
        significant(v.z, 2)
    )
}
