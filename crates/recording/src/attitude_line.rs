//! A line that says an attitude (`ATT`) -> numbers. Pure. Nothing in it is trusted: names are made fit for a
//! terminal, and a number that is absent or `null` is NaN.
//!
//! Apart from the samples of lines because it is read for itself: what a daemon says, and what was written to be
//! compared.

use crate::text::printable;
use serde::Deserialize;
use strapd_attitude::record::Nanos;

/// Id in lines of the true attitude of simulated samples: a reference to hold estimates against, and no sample.
pub const TRUTH_ID: &str = "truth";

/// Id of the true attitude of the sensor `id`.
#[must_use]
pub fn truth_of(id: &str) -> String {
    format!("{id} {TRUTH_ID}")
}

/// Sensor whose true attitude has this id: [`TRUTH_ID`] alone is of whatever sensor there is. `None`: it is no truth's.
#[must_use]
pub fn sensor_of_truth(id: &str) -> Option<&str> {
    let sensor = id.strip_suffix(TRUTH_ID)?;
    match sensor.strip_suffix(' ') {
        Some("") => None,
        Some(sensor) => Some(sensor),
        None => Some(sensor).filter(|sensor| sensor.is_empty()),
    }
}

/// One attitude as a line says it.
#[derive(Clone, Debug, PartialEq)]
pub struct Attitude {
    /// Id of the sensor.
    pub id: String,
    /// Number.
    pub seq: u64,
    /// Stamp; an attitude at no time is none to compare with.
    pub stamp: Option<Nanos>,
    /// `[w, x, y, z]`, sensor (or body) to world.
    pub q: [f64; 4],
    /// Body rate, rad/s.
    pub rate: [f64; 3],
    /// 1 sigma about the body axes, degrees.
    pub sigma_deg: [f64; 3],
    /// Status words.
    pub status: Vec<String>,
    /// Holds and resets so far.
    pub reset: u64,
    /// Axes of the world.
    pub world: String,
    /// Axes of the body.
    pub body: String,
}

/// Head that is looked at before the rest is read: other classes have other values under the same names.
#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    class: String,
    /// gpsd's attitudes have none.
    q: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
struct Object {
    #[serde(default)]
    id: String,
    #[serde(default)]
    seq: u64,
    stamp: Option<Stamp>,
    q: Quaternion,
    #[serde(default)]
    rate: [Option<f64>; 3],
    #[serde(default)]
    sigma_deg: [Option<f64>; 3],
    #[serde(default)]
    status: Vec<String>,
    #[serde(default)]
    reset: u64,
    #[serde(default)]
    world: String,
    #[serde(default)]
    body: String,
}

#[derive(Deserialize)]
struct Stamp {
    sec: i64,
    #[serde(default)]
    nsec: i64,
}

#[derive(Deserialize)]
struct Quaternion {
    w: Option<f64>,
    x: Option<f64>,
    y: Option<f64>,
    z: Option<f64>,
}

impl Attitude {
    /// Reads a line; `None` where it is something else than an attitude with a quaternion.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn read(line: &[u8]) -> Result<Option<Attitude>, String> {
        let wrong = |e: serde_json::Error| printable(&e.to_string());
        let head: Head = serde_json::from_slice(line).map_err(wrong)?;
        if head.class != "ATT" || head.q.is_none() {
            return Ok(None);
        }
        let object: Object = serde_json::from_slice(line).map_err(wrong)?;
        let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let Quaternion { w, x, y, z } = object.q;
        let instant = |s: Stamp| Nanos(s.sec.saturating_mul(1_000_000_000).saturating_add(s.nsec));
        Ok(Some(Attitude {
            id: printable(&object.id),
            seq: object.seq,
            stamp: object.stamp.map(instant),
            q: [w, x, y, z].map(number),
            rate: object.rate.map(number),
            sigma_deg: object.sigma_deg.map(number),
            status: object
                .status
                .iter()
                .take(16)
                .map(|s| printable(s))
                .collect(),
            reset: object.reset,
            world: printable(&object.world),
            body: printable(&object.body),
        }))
    }

    /// Whether it is no news, but the last there was before we came.
    #[must_use]
    pub fn is_last(&self) -> bool {
        self.status.iter().any(|s| s == "last")
    }
}
