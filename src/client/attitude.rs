//! An `ATT` object -> numbers. Pure. Nothing in it is trusted: names are made fit for a terminal, and
//! a number that is absent or `null` is NaN.

use serde::Deserialize;
use strapd_attitude::record::Nanos;
use strapd_recording::text::printable;

/// One attitude as a daemon says it.
#[derive(Clone, Debug, PartialEq)]
pub struct Attitude {
    /// Which sensor.
    pub id: String,
    /// Its number.
    pub seq: u64,
    /// When.
    pub stamp: Nanos,
    /// `[w, x, y, z]`, sensor (or body) to world.
    pub q: [f64; 4],
    /// Body rate, rad/s.
    pub rate: [f64; 3],
    /// 1 sigma about the body axes, degrees.
    pub sigma_deg: [f64; 3],
    /// What there is to say of it.
    pub status: Vec<String>,
    /// Holds and resets so far.
    pub reset: u64,
    /// Axes of the world.
    pub world: String,
    /// Axes of the body.
    pub body: String,
}

#[derive(Deserialize)]
struct Object {
    #[serde(default)]
    id: String,
    #[serde(default)]
    seq: u64,
    #[serde(default)]
    stamp: Stamp,
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

#[derive(Deserialize, Default)]
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
    /// Reads a line.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn read(line: &[u8]) -> Result<Attitude, String> {
        let object: Object = serde_json::from_slice(line).map_err(|e| printable(&e.to_string()))?;
        let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let Quaternion { w, x, y, z } = object.q;
        let nanos = object
            .stamp
            .sec
            .saturating_mul(1_000_000_000)
            .saturating_add(object.stamp.nsec);
        Ok(Attitude {
            id: printable(&object.id),
            seq: object.seq,
            stamp: Nanos(nanos),
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
        })
    }

    /// Whether it is no news, but the last there was before we came.
    #[must_use]
    pub fn is_last(&self) -> bool {
        self.status.iter().any(|s| s == "last")
    }

    /// Roll, pitch and yaw in degrees, turned about z, then y, then x.
    #[must_use]
    pub fn roll_pitch_yaw_deg(&self) -> [f64; 3] {
        crate::sink::roll_pitch_yaw(self.q).map(f64::to_degrees)
    }
}
