//! What corrected the attitude and what it learned -> words, JSON. Pure.

use super::summary::significant;
use nalgebra::Vector3;
use serde_json::{Value, json};
use strapd_attitude::aid::{Calibration, Filter, Report};

/// The filter at the end of a run.
#[derive(Clone, Copy, Debug)]
pub struct Aided {
    started: bool,
    report: Report,
    calibration: Calibration,
    sigma: Calibration,
}

/// Parts in a million.
const PPM: f64 = 1e6;

impl Aided {
    /// As `filter` is now.
    #[must_use]
    pub fn of(filter: &Filter) -> Aided {
        Aided {
            started: filter.is_started(),
            report: filter.report(),
            calibration: *filter.calibration(),
            sigma: filter.calibration_sigma(),
        }
    }

    /// For people: what it did, then what it learned.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        if !self.started {
            return vec!["gravity, but no specific force came: the gyro alone".to_owned()];
        }
        let Report {
            updates,
            levelled,
            restarts,
            forces_rejected,
            saturated,
            failures,
            ..
        } = self.report;
        let mut did = format!(
            "gravity: tilt corrected {updates} times, heading the gyro's (--aid none: the gyro alone)"
        );
        for (n, what) in [
            (levelled, "times levelled anew"),
            (restarts, "times taken to travel"),
            (forces_rejected, "forces rejected"),
            (saturated, "samples at the gyro's range"),
            (failures, "FULL RESTARTS"),
        ] {
            if n > 0 {
                did += &format!(", {n} {what}");
            }
        }
        let deg = |v: &Vector3<f64>| triple(&v.map(f64::to_degrees));
        vec![
            did,
            format!(
                "learned: bias {} +- {} deg/s, scale {} +- {} %, lead {} ms",
                deg(&self.calibration.bias),
                deg(&self.sigma.bias),
                triple(&(self.calibration.scale * 100.0)),
                triple(&(self.sigma.scale * 100.0)),
                significant(self.calibration.lead * 1e3, 2)
            ),
        ]
    }

    /// For machines.
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
            })
        };
        json!({
            "by": "gravity",
            "started": self.started,
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
