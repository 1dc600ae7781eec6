//! A topic's summary -> the words and objects of its rows, where a row is more than its number. Pure.
//!
//! Apart from the summary because no figure is found or named here: what is said of one, at length or in brief, is.

use super::{NO_SIGMA, TopicSummary};
use crate::summary::significant;
use crate::summary::smoothing::Smoothing;
use serde_json::{Map, Value, json};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{EstimationSettings, Mended};
use strapd_attitude::frames::AxisMap;
use strapd_attitude::propagate::Method;
use strapd_attitude::record::{SampleKind, Verdict};
use strapd_attitude::setting::{
    ACCEL_AXES, ACCEL_SCALE, AID, GYRO_AXES, GYRO_SCALE, MAG_AXES, MAG_MOUNT, MEND, MOUNT,
};
use strapd_attitude::worlds::EARTH_RATE;

impl TopicSummary {
    /// Label and lines about what corrected the attitude.
    pub(super) fn correction(&self) -> (&'static str, Vec<String>) {
        match (self.smoothing(), &self.aided) {
            (Some(smoothing), _) => ("smooth", smoothing.lines()),
            (None, Some(aided)) => ("aid", aided.lines()),
            (None, None) => (
                "aid",
                vec![format!(
                    "none: the gyro alone, which drifts ({AID} gravity corrects tilt by the accelerometer)"
                )],
            ),
        }
    }

    pub(super) fn samples_text(&self) -> String {
        let rate = self
            .rate_hz
            .map_or_else(String::new, |hz| format!(" at {} Hz", significant(hz, 5)));
        format!(
            "{} in, {} used; {:.3} s{rate}, {} clock",
            self.counts.total(),
            self.counts.used(),
            self.duration_secs,
            self.clock
        )
    }

    pub(super) fn counts_json(&self) -> Value {
        json!({
            "total": self.counts.total(),
            "used": self.counts.used(),
            "lost": self.counts.lost(),
            "by_verdict": Verdict::ALL.iter()
                .map(|v| (v.name().to_owned(), json!(self.counts.get(*v))))
                .collect::<Map<_, _>>(),
        })
    }

    pub(super) fn frames_text(&self) -> String {
        format!(
            "input {} -> body {} -> world {}; initial attitude: {}",
            self.input_axes, self.body, self.world, self.initial
        )
    }

    pub(super) fn bias_text(&self) -> String {
        if self.bias == [0.0; 3] {
            return format!("{} removed", self.bias_origin);
        }
        let [x, y, z] = self.bias;
        format!(
            "({x:.6}, {y:.6}, {z:.6}) rad/s removed, {}",
            self.bias_origin
        )
    }

    pub(super) fn bias_json(&self) -> Value {
        let [x, y, z] = self.bias;
        json!({ "x": x, "y": y, "z": z, "origin": self.bias_origin })
    }

    pub(super) fn turned_text(&self) -> String {
        format!(
            "{:.1} deg in all, at most {:.3} deg in one step",
            self.turned.to_degrees(),
            self.largest_step.to_degrees()
        )
    }

    pub(super) fn final_text(&self) -> String {
        if !self.has_attitude() {
            return "no attitude: no sample was used".to_owned();
        }
        let [w, x, y, z] = self.final_wxyz;
        let [yaw, pitch, roll] = self.final_ypr.map(f64::to_degrees);
        format!(
            "roll {roll:.3}  pitch {pitch:.3}  yaw {yaw:.3} deg   q w {w:.6}  x {x:.6}  y {y:.6}  z {z:.6}"
        )
    }

    pub(super) fn final_json(&self) -> Value {
        let [w, x, y, z] = self.final_wxyz;
        let [yaw, pitch, roll] = self.final_ypr.map(f64::to_degrees);
        json!({
            "q": { "w": w, "x": x, "y": y, "z": z },
            "roll_deg": roll, "pitch_deg": pitch, "yaw_deg": yaw,
            "sigma_deg": self.final_sigma.map(f64::to_degrees),
        })
    }

    pub(super) fn drift_deg_per_h(&self) -> f64 {
        self.drift.to_degrees() * 3600.0
    }

    /// Whether no noise was stated: zeros are no certainty.
    pub(super) fn has_no_sigma(&self) -> bool {
        self.has_attitude() && self.final_sigma == [0.0; 3] && self.drift == 0.0
    }

    /// Text of the sigma at the end, and what it is of: that of what corrects the attitude, else of the drift.
    pub(super) fn sigma_text(&self) -> String {
        if self.has_no_sigma() {
            return NO_SIGMA.to_owned();
        }
        let [x, y, z] = self.final_sigma.map(|v| significant(v.to_degrees(), 2));
        let of = match (self.smoothing(), &self.aided) {
            (Some(smoothing), _) => smoothing.sigma_text().to_owned(),
            (None, Some(aided)) => aided.sigma_text().to_owned(),
            (None, None) => format!(
                "drift of about {} deg/h to be expected ({} noise)",
                significant(self.drift_deg_per_h(), 2),
                self.noise
            ),
        };
        format!("{x}, {y}, {z} deg about x, y, z at the end; {of}")
    }

    /// Cures that were applied, in one line.
    pub(crate) fn mended_text(&self) -> Option<String> {
        let settings = self.mended.iter().flat_map(|mended| &mended.settings);
        let settings: Vec<String> = settings.map(ToString::to_string).collect();
        let first = self.mended.first()?;
        Some(format!("{} ({MEND}): {}", settings.join(" "), first.what))
    }

    /// Doubt about sigma, where there is one.
    pub(crate) fn sigma_doubt(&self) -> Option<String> {
        let found = self.contradiction()?;
        Some(format!(
            "it does not hold: {} ({}), and what that does to the attitude is not in it; cure that first",
            found.what, found.code
        ))
    }

    pub(super) fn error_text(&self) -> String {
        self.integration_error.map_or_else(
            || "integration error not estimated for this method".to_owned(),
            |error| {
                format!(
                    "integration error at most about {} deg, estimated by comparison with a shorter window{}",
                    significant(error.to_degrees(), 2),
                    self.gaps.not_in_the_error()
                )
            },
        )
    }

    pub(super) fn lost_text(&self, is_damaged: bool) -> String {
        let parts: Vec<String> = Verdict::ALL
            .iter()
            .filter(|v| !matches!(v, Verdict::Accepted) && self.counts.get(**v) > 0)
            .map(|v| format!("{} {}", self.counts.get(*v), v.name().replace('_', " ")))
            .collect();
        match (parts.is_empty(), is_damaged) {
            (true, true) => "nothing of what could be read, but the file is damaged:".to_owned(),
            (true, false) => "nothing".to_owned(),
            _ => format!(
                "{} of {} samples ({})",
                self.counts.lost(),
                self.counts.total(),
                parts.join(", ")
            ),
        }
    }
}

pub(super) fn mended_json(mended: &Mended) -> Value {
    let settings = mended.settings.iter();
    let settings: Map<String, Value> = settings
        .map(|choice| {
            (
                choice.setting.name().to_owned(),
                choice.value.as_str().into(),
            )
        })
        .collect();
    json!({ "what": mended.what, "settings": settings })
}

/// Maps and factors of single sensors that differ from nothing.
pub(super) fn sensor_maps(plan: &EstimationSettings) -> Option<String> {
    let axes = [
        (GYRO_AXES, plan.gyro_axes),
        (ACCEL_AXES, plan.accel_axes),
        (MAG_AXES, plan.mag_axes),
    ];
    let maps = axes.iter().filter(|(_, map)| *map != AxisMap::IDENTITY);
    let maps = maps.map(|(setting, map)| match map.mirrors() {
        true => format!("{setting} {map} (mirrors)"),
        false => format!("{setting} {map}"),
    });
    let scales = [
        (GYRO_SCALE, plan.gyro_scale),
        (ACCEL_SCALE, plan.accel_scale),
    ];
    let scales = scales.iter().filter(|(_, factors)| *factors != [1.0; 3]);
    let scales = scales.map(|(setting, [x, y, z])| match x == y && y == z {
        true => format!("{setting} {x}"),
        false => format!("{setting} {x},{y},{z}"),
    });
    let mounts = [(MOUNT, plan.mount), (MAG_MOUNT, plan.mag_mount)];
    let mounts = mounts.iter().filter_map(|(setting, mount)| {
        let angles = mount.as_ref()?.yaw_pitch_roll();
        let [roll, pitch, yaw] =
            [angles.roll, angles.pitch, angles.yaw].map(|angle| significant(angle.to_degrees(), 4));
        Some(format!("{setting} rpy={roll},{pitch},{yaw}"))
    });
    let all: Vec<String> = maps.chain(scales).chain(mounts).collect();
    (!all.is_empty()).then(|| all.join(", "))
}

pub(super) fn smoothed_json(smoothed: &Result<Smoothing, Diagnostic>) -> Value {
    match smoothed {
        Ok(smoothing) => smoothing.json(),
        Err(why) => json!({ "outcome": "filter", "why": why.to_string() }),
    }
}

pub(super) fn earth_json(latitude_deg: f64) -> Value {
    json!({ "latitude_deg": latitude_deg, "rad_s": EARTH_RATE })
}

pub(super) fn earth_text(latitude_deg: f64) -> String {
    format!(
        "rotation taken out for latitude {latitude_deg} deg, {:.3} deg/h; rates stay relative to inertial space",
        EARTH_RATE.to_degrees() * 3600.0
    )
}

/// The method, `auto` with what it stands for.
pub(super) fn method_words(method: Method, kind: SampleKind) -> String {
    match (method, kind) {
        (Method::Auto, SampleKind::Rate) => "auto: centred window of 16 samples, exact".to_owned(),
        (Method::Auto, _) => "auto: centred window of 15 increments, exact".to_owned(),
        (other, _) => other.to_string(),
    }
}
