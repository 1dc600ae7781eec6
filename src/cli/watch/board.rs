//! Messages of a daemon -> what is known of every sensor. Pure: time is given.

use crate::client::watcher::Said;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::time::Instant;
use strapd_recording::attitude_line::Attitude;
use strapd_recording::text::printable;

/// Most sensors that are shown; a daemon has no more.
const MAX_SENSORS: usize = 1024;

/// Everything that is known.
#[derive(Debug)]
pub(super) struct Board {
    /// Name that the user asked for.
    pub(super) name: String,
    /// The sensors the user asked for; none: all.
    ids: Vec<String>,
    pub(super) link: LinkState,
    pub(super) sensors: BTreeMap<String, Sensor>,
    /// Last complaint of the daemon.
    pub(super) complaint: Option<String>,
}

/// State of the connection.
#[derive(Debug)]
pub(super) enum LinkState {
    Connecting,
    Connected(Instant),
    /// Lost: since when, and why.
    Lost(Instant, String),
}

/// Knowledge of one sensor.
#[derive(Debug, Default)]
pub(super) struct Sensor {
    pub(super) attitude: Option<Attitude>,
    /// Time of the last attitude.
    pub(super) heard: Option<Instant>,
    /// Attitudes we were too slow for.
    pub(super) dropped: u64,
    pub(super) health: Health,
}

/// Health of a sensor's samples, by the daemon.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct Health {
    #[serde(default)]
    id: String,
    /// Class of the samples of which a stream that is no sensor's is made.
    class: Option<String>,
    #[serde(default)]
    pub(super) samples: u64,
    #[serde(default)]
    pub(super) lost: u64,
    #[serde(default)]
    pub(super) missing: u64,
    #[serde(default)]
    pub(super) gaps: u64,
    pub(super) rate_hz: Option<f64>,
    pub(super) jitter_s: Option<f64>,
    pub(super) attitude: Option<Knowledge>,
    aid: Option<Aid>,
}

/// Knowledge of an attitude that is not the gyro's alone, by the daemon.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Knowledge {
    /// Measurements by which it is corrected.
    pub(super) aided: Option<String>,
    pub(super) rest: bool,
    pub(super) sigma_deg: Tilt,
}

/// One sigma of tilt and heading, degrees.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Tilt {
    pub(super) tilt: Option<f64>,
    pub(super) heading: Option<f64>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
struct Aid {
    learned: LearnedBias,
    sigma: LearnedBias,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
struct LearnedBias {
    gyro_bias_rad_s: [Option<f64>; 3],
}

impl Health {
    /// The gyro's bias and its sigma, rad/s, where the daemon learns it.
    pub(super) fn bias(&self) -> Option<([f64; 3], [f64; 3])> {
        let aid = self.aid.as_ref()?;
        let whole = |learned: LearnedBias| learned.gyro_bias_rad_s.map(|v| v.unwrap_or(f64::NAN));
        Some((whole(aid.learned), whole(aid.sigma)))
    }
}

#[derive(Deserialize)]
struct Status {
    #[serde(default)]
    sources: Vec<Health>,
}

impl Board {
    pub(super) fn new(name: String, ids: &[String]) -> Board {
        Board {
            name,
            ids: ids.iter().map(|id| printable(id)).collect(),
            link: LinkState::Connecting,
            sensors: BTreeMap::new(),
            complaint: None,
        }
    }

    pub(super) fn connected(&mut self, now: Instant) {
        self.link = LinkState::Connected(now);
        self.complaint = None;
    }

    pub(super) fn lost(&mut self, why: String, now: Instant) {
        let since = match self.link {
            LinkState::Lost(since, _) => since,
            _ => now,
        };
        self.link = LinkState::Lost(since, why);
    }

    fn sensor(&mut self, id: &str) -> Option<&mut Sensor> {
        if !self.sensors.contains_key(id) && self.sensors.len() >= MAX_SENSORS {
            return None;
        }
        Some(self.sensors.entry(id.to_owned()).or_default())
    }

    fn attitude(&mut self, attitude: Attitude, now: Instant) {
        if let Some(sensor) = self.sensor(&attitude.id) {
            // One of before we came: when it was made, nobody says.
            if !attitude.is_last() {
                sensor.heard = Some(now);
            }
            sensor.attitude = Some(attitude);
        }
    }

    pub(super) fn take(&mut self, said: Said<'_>, now: Instant) {
        match said {
            Said::Attitude(line) => match Attitude::read(line) {
                Ok(None) => self.complaint = Some("an attitude without a quaternion".to_owned()),
                Ok(Some(attitude)) => self.attitude(attitude, now),
                Err(why) => self.complaint = Some(format!("an attitude that is none: {why}")),
            },
            Said::Packed(attitude) => self.attitude(attitude, now),
            Said::Gap { id, dropped } => {
                if let Some(sensor) = self.sensor(&id) {
                    sensor.dropped = sensor.dropped.saturating_add(dropped);
                }
            }
            Said::Status(line) => {
                if let Ok(status) = serde_json::from_slice::<Status>(line) {
                    for health in status.sources {
                        // Also those that have been silent since we came; not those nobody asked for.
                        let id = printable(&health.id);
                        let is_shown = self.ids.is_empty() || self.ids.contains(&id);
                        let is_rate = health.class.as_deref() == Some("RATE");
                        if is_shown
                            && !is_rate
                            && let Some(sensor) = self.sensor(&id)
                        {
                            sensor.health = health;
                        }
                    }
                }
            }
            Said::Complaint(what) => self.complaint = Some(what),
        }
    }
}
