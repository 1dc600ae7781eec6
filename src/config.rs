//! What a run is: arguments as text -> values, parsed once and validated once. Pure.

use crate::error::{Error, Result};
use nalgebra::Vector3;
use strapd_attitude::condition::{self, Clock, GyroUnit, OnGap};
use strapd_attitude::frames::{Body, BodyAxes, Nav};
use strapd_attitude::propagate::{self, Method, Propagator};
use strapd_attitude::quaternion::{Quaternion, YawPitchRoll};
use strapd_attitude::record::SampleKind;
use strapd_attitude::worlds::World;
use strapd_recording::decode;

/// How the samples of a run are to be understood and integrated: the estimation flags, checked.
/// `None` = the format decides where it states it, else the default.
#[derive(Clone, Debug)]
pub struct Plan {
    /// `--topic`.
    pub topic: Option<String>,
    /// `--field`, `--ignore-covariance-flag`.
    pub decode: decode::Options,
    /// `--method`, `--window`, `--order`.
    pub method: Method,
    /// `--sample-kind`.
    pub kind: Option<SampleKind>,
    /// `--gyro-unit`.
    pub unit: Option<GyroUnit>,
    /// `--body`.
    pub body: Option<BodyAxes>,
    /// `--world`.
    pub world: World,
    /// `--mount`: C_bs as `[w, x, y, z]`.
    pub mount: Option<[f64; 4]>,
    /// `--time`, `--rate-hz`.
    pub clock: Clock,
    /// `--init`, in the convention of `world`.
    pub initial: Initial,
    /// `--bias`.
    pub bias: Bias,
    /// `--max-gap`.
    pub max_gap_secs: f64,
    /// `--on-gap`.
    pub on_gap: OnGap,
    /// `--earth-rate`: latitude of a fixed site whose turning with the Earth is taken out. In degrees,
    /// as given, so that it is repeated as given.
    pub latitude_deg: Option<f64>,
    /// `--regularise-stamps`.
    pub regularise_stamps: bool,
    /// `--gyro-range`, rad/s.
    pub gyro_range: Option<f64>,
    /// `--noise`.
    pub noise: Noise,
    /// `--aid`.
    pub aid: Aid,
    /// `--undo-truncation`.
    pub truncation: Truncation,
    /// `--sensor-delay`, s.
    pub sensor_delay_secs: f64,
    /// `--start`, s.
    pub start: Option<f64>,
    /// `--until`, s.
    pub until: Option<f64>,
}

/// No sensor's own filters take longer, s.
const LONGEST_DELAY: f64 = 0.1;

/// `--aid`: what corrects the attitude of the gyro.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum Aid {
    /// Nothing.
    #[default]
    None,
    /// The direction of gravity, from the accelerometer.
    Gravity,
}

/// `--undo-truncation`: what becomes of rates that their driver cut towards zero.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Truncation {
    /// Decided by the data of a file where the attitude is aided; otherwise they stay.
    #[default]
    Unsaid,
    /// Decided by the data of a file.
    Auto,
    /// It was; the data say in which steps.
    On,
    /// In these steps, rad/s.
    Steps(f64),
    /// They stay.
    Off,
}

impl Truncation {
    /// # Errors
    /// [`Error::Usage`] for anything but `auto`, `on`, `on=STEP`, `off`.
    pub fn parse(text: &str) -> Result<Truncation> {
        Ok(match text {
            "auto" => Truncation::Auto,
            "on" => Truncation::On,
            "off" => Truncation::Off,
            _ => text
                .strip_prefix("on=")
                .and_then(|step| step.parse().ok())
                .filter(|step: &f64| *step > 0.0 && *step < 1.0)
                .map(Truncation::Steps)
                .ok_or_else(|| {
                    Error::Usage(format!(
                        "--undo-truncation: `{text}` is none\n  help: auto, on, on=STEP in rad/s (below 1), or off"
                    ))
                })?,
        })
    }
}

impl Default for Plan {
    /// What the command line's defaults say.
    fn default() -> Plan {
        Plan {
            topic: None,
            decode: decode::Options::default(),
            method: Method::Auto,
            kind: None,
            unit: None,
            body: None,
            world: World::Start,
            mount: None,
            clock: Clock::Header,
            initial: Initial::Identity,
            bias: Bias::None,
            max_gap_secs: 0.5,
            on_gap: OnGap::Hold,
            latitude_deg: None,
            regularise_stamps: false,
            gyro_range: None,
            noise: Noise::preset(&NOISE_PRESETS[0]),
            aid: Aid::None,
            truncation: Truncation::Unsaid,
            sensor_delay_secs: 0.0,
            start: None,
            until: None,
        }
    }
}

impl Plan {
    /// Whether a step of so many nanoseconds is integrated across.
    #[must_use]
    pub fn bridges(&self, nanos: i64) -> bool {
        self.on_gap == OnGap::Bridge || nanos as f64 <= self.max_gap_secs * 1e9
    }

    /// Checks what can be judged without the data.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the flag.
    pub fn check(&self) -> Result<()> {
        let conditioning = condition::Settings {
            clock: self.clock,
            max_gap_secs: self.max_gap_secs,
            on_gap: self.on_gap,
            bias: match self.bias {
                Bias::Given(bias) => bias,
                Bias::None | Bias::Auto => Vector3::zeros(),
            },
            gyro_range: self.gyro_range,
            start: self.start,
            until: self.until,
            ..condition::Settings::default()
        };
        conditioning
            .validate()
            .map_err(|e| Error::Usage(e.to_string()))?;
        if self.sensor_delay_secs.is_nan() || self.sensor_delay_secs.abs() > LONGEST_DELAY {
            return Err(Error::Usage(format!(
                "--sensor-delay: {} s is no delay of a sensor\n  help: seconds, at most {LONGEST_DELAY}: 0.0023 for 2.3 ms",
                self.sensor_delay_secs
            )));
        }
        self.check_earth_rate()?;
        if self.regularise_stamps && matches!(self.clock, Clock::Index { .. }) {
            return Err(Error::Usage(
                "--regularise-stamps: the stamps of --time index are even already\n  help: leave one of the two out".to_owned(),
            ));
        }
        Propagator::new(propagate::Settings {
            method: self.method,
            // Where the format decides, the kind with the wider choice: the rest is said by topic.
            kind: self.kind.unwrap_or(SampleKind::Average),
            initial: Quaternion::identity(),
            noise: self.noise.with_bias(self.noise.unremoved_bias()),
            ..propagate::Settings::default()
        })
        .map_err(|e| Error::Usage(e.to_string()))?;
        Ok(())
    }

    /// `--earth-rate` needs a latitude that is one, and a world in which the Earth's axis has a place.
    fn check_earth_rate(&self) -> Result<()> {
        let Some(latitude) = self.latitude_deg else {
            return Ok(());
        };
        if !(-90.0..=90.0).contains(&latitude) {
            return Err(Error::Usage(format!(
                "--earth-rate {latitude}: a latitude lies between -90 and 90 degrees, north positive"
            )));
        }
        if self.world == World::Start {
            return Err(Error::Usage(
                "--earth-rate: in --world start nobody knows where north and up are, and so not how the Earth turns\n  help: --world enu (or ned, nwu) with --init first-orientation, q=w,x,y,z, rpy=roll,pitch,yaw, or gravity where the heading is 0".to_owned(),
            ));
        }
        Ok(())
    }
}

/// `--init`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Initial {
    /// World = body at the first sample.
    Identity,
    /// Roll and pitch from the accelerometer at rest; yaw 0.
    Gravity,
    /// The first recorded orientation.
    FirstOrientation,
    /// Given: `[w, x, y, z]`, unit norm.
    Given([f64; 4]),
}

/// `--bias`, rad/s in body axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Bias {
    /// Nothing is subtracted.
    None,
    /// From detected rest; refused when there is none.
    Auto,
    /// Given.
    Given(Vector3<f64>),
}

/// `--noise`: what the covariance is made of. 1 sigma, about the body axes x, y, z.
#[derive(Clone, PartialEq, Debug)]
pub struct Noise {
    /// As named on the command line, for the summary.
    pub name: String,
    /// Angle random walk N, rad/sqrt(s).
    pub arw: [f64; 3],
    /// Bias instability B, rad/s; taken as the uncertainty of a constant bias that no estimate removes.
    pub bias_instability: [f64; 3],
    /// Rate random walk K, rad/s/sqrt(s).
    pub rrw: [f64; 3],
    /// Turn-on bias, rad/s: unknown as long as no bias is removed.
    pub turn_on_bias: [f64; 3],
    /// Uncertainty of the initial attitude, rad.
    pub initial: [f64; 3],
}

const DEG: f64 = std::f64::consts::PI / 180.0;

/// Named noise presets: name, ARW in deg/sqrt(h), bias instability in deg/h, an example.
/// Sources: `docs/theory/attitude.md` 9 (Bosch BMI088 class, ADIS16465, STIM300, HG9900 class).
pub const NOISE_PRESETS: [(&str, f64, f64); 4] = [
    ("consumer", 0.84, 5.0),
    ("industrial", 0.15, 2.0),
    ("tactical", 0.15, 0.5),
    ("navigation", 0.002, 0.01),
];

impl Noise {
    fn preset((name, arw, bias): &(&str, f64, f64)) -> Noise {
        Noise {
            name: (*name).to_owned(),
            arw: [arw * DEG / 60.0; 3],
            bias_instability: [bias * DEG / 3600.0; 3],
            rrw: [0.0; 3],
            turn_on_bias: [0.0; 3],
            initial: [0.0; 3],
        }
    }

    /// `consumer`, ..., or `arw=..` and any of `bias-instability`, `rrw`, `turn-on-bias`, `initial`,
    /// in SI; each one number, or three joined by `/` for the body axes x, y, z.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the part that is wrong.
    pub fn parse(text: &str) -> Result<Noise> {
        if let Some(preset) = NOISE_PRESETS.iter().find(|(name, ..)| *name == text) {
            return Ok(Noise::preset(preset));
        }
        let wrong = |what: String| {
            let names: Vec<&str> = NOISE_PRESETS.iter().map(|p| p.0).collect();
            Error::Usage(format!(
                "--noise {text}: {what}\n  help: a preset ({}), or arw=RAD_PER_SQRT_S[,bias-instability=RAD_S][,rrw=RAD_S_PER_SQRT_S][,turn-on-bias=RAD_S][,initial=RAD], each one number or three x/y/z",
                names.join(", ")
            ))
        };
        let mut given: [Option<[f64; 3]>; NOISE_KEYS.len()] = [None; NOISE_KEYS.len()];
        for part in text.split(',') {
            let (key, value) = part.split_once('=').unwrap_or((part, ""));
            let key = key.trim();
            let Some((slot, _)) = given
                .iter_mut()
                .zip(NOISE_KEYS)
                .find(|(_, name)| *name == key)
            else {
                return Err(wrong(format!(
                    "`{key}` is no preset and no figure of noise"
                )));
            };
            if slot.is_some() {
                return Err(wrong(format!("{key} is given twice")));
            }
            *slot = Some(by_axis(value).ok_or_else(|| {
                wrong(format!(
                    "{key}={value} is neither one number nor three x/y/z, from 0 up"
                ))
            })?);
        }
        let [arw, bias_instability, rrw, turn_on_bias, initial] = given;
        let Some(arw) = arw else {
            return Err(wrong("arw is missing".to_owned()));
        };
        Ok(Noise {
            name: text.to_owned(),
            arw,
            bias_instability: bias_instability.unwrap_or_default(),
            rrw: rrw.unwrap_or_default(),
            turn_on_bias: turn_on_bias.unwrap_or_default(),
            initial: initial.unwrap_or_default(),
        })
    }

    /// What is not known of the bias, rad/s, when none is removed: turn-on bias and instability.
    #[must_use]
    pub fn unremoved_bias(&self) -> [f64; 3] {
        let [x, y, z] = self.turn_on_bias;
        let [u, v, w] = self.bias_instability;
        [x.hypot(u), y.hypot(v), z.hypot(w)]
    }

    /// What the propagator is told, when `bias` (rad/s) is not known of the bias.
    #[must_use]
    pub fn with_bias(&self, bias: [f64; 3]) -> propagate::Noise {
        propagate::Noise {
            initial: self.initial,
            arw: self.arw,
            bias,
            rrw: self.rrw,
            bias_tau: None,
        }
    }
}

/// What `--noise` takes, in the order of the fields.
const NOISE_KEYS: [&str; 5] = ["arw", "bias-instability", "rrw", "turn-on-bias", "initial"];

/// One number for all axes, or three joined by `/`; finite and not negative.
fn by_axis(text: &str) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = text
        .split('/')
        .map(|part| part.trim().parse::<f64>().ok())
        .map(|v| v.filter(|v| v.is_finite() && *v >= 0.0))
        .collect();
    match numbers?.as_slice() {
        [all] => Some([*all; 3]),
        [x, y, z] => Some([*x, *y, *z]),
        _ => None,
    }
}

impl Initial {
    /// `identity`, `gravity`, `first-orientation`, `q=w,x,y,z`, `rpy=roll,pitch,yaw` (degrees).
    ///
    /// # Errors
    /// [`Error::Usage`] for anything else, a quaternion that is not near unit norm included.
    pub fn parse(text: &str) -> Result<Initial> {
        match text {
            "identity" => return Ok(Initial::Identity),
            "gravity" => return Ok(Initial::Gravity),
            "first-orientation" => return Ok(Initial::FirstOrientation),
            _ => {}
        }
        if let Some(list) = text.strip_prefix("q=") {
            return Ok(Initial::Given(unit_quaternion("--init", list)?));
        }
        if let Some(list) = text.strip_prefix("rpy=") {
            let [roll, pitch, yaw] = numbers::<3>("--init rpy", list)?.map(f64::to_radians);
            let q: Quaternion<Nav, Body> =
                Quaternion::from_yaw_pitch_roll(&YawPitchRoll { yaw, pitch, roll });
            return Ok(Initial::Given(q.wxyz()));
        }
        Err(Error::Usage(format!(
            "--init {text}: expected identity, gravity, first-orientation, q=w,x,y,z or rpy=roll,pitch,yaw (degrees)"
        )))
    }
}

impl Bias {
    /// `none`, `auto`, or `x,y,z` in rad/s.
    ///
    /// # Errors
    /// [`Error::Usage`] for anything else.
    pub fn parse(text: &str) -> Result<Bias> {
        match text {
            "none" => Ok(Bias::None),
            "auto" => Ok(Bias::Auto),
            list => numbers::<3>("--bias", list)
                .map(|b| Bias::Given(Vector3::from(b)))
                .map_err(|_| {
                    Error::Usage(format!(
                        "--bias {text}: expected none, auto, or three numbers x,y,z in rad/s"
                    ))
                }),
        }
    }
}

/// `--mount q=w,x,y,z` (the `q=` may be left out).
///
/// # Errors
/// [`Error::Usage`] when it is not four finite numbers of about unit norm.
pub fn parse_mount(text: &str) -> Result<[f64; 4]> {
    unit_quaternion("--mount", text.strip_prefix("q=").unwrap_or(text))
}

/// `--shard i/n`: this process takes inputs i, i + n, i + 2n, ... of the list, i from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shard {
    /// Which share, from 0.
    pub index: usize,
    /// Of how many.
    pub of: usize,
}

impl Shard {
    /// `i/n` with `0 <= i < n`.
    ///
    /// # Errors
    /// [`Error::Usage`] otherwise.
    pub fn parse(text: &str) -> Result<Shard> {
        text.split_once('/')
            .and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)))
            .filter(|(i, n)| i < n)
            .map(|(index, of)| Shard { index, of })
            .ok_or_else(|| {
                Error::Usage(format!(
                    "--shard {text}: expected i/n with 0 <= i < n, for example --shard 0/4"
                ))
            })
    }

    /// Whether the input at `position` of the list is this share's.
    #[must_use]
    pub fn takes(self, position: usize) -> bool {
        position % self.of == self.index
    }
}

/// `N` finite numbers separated by commas.
pub(crate) fn numbers<const N: usize>(flag: &str, list: &str) -> Result<[f64; N]> {
    let parsed: Option<Vec<f64>> = list
        .split(',')
        .map(|part| part.trim().parse::<f64>().ok().filter(|v| v.is_finite()))
        .collect();
    parsed
        .and_then(|v| <[f64; N]>::try_from(v).ok())
        .ok_or_else(|| {
            Error::Usage(format!(
                "{flag} {list}: expected {N} finite numbers separated by commas"
            ))
        })
}

/// Four numbers of about unit norm, normalised. A norm off by more than 1 % is a mistake, not rounding.
fn unit_quaternion(flag: &str, list: &str) -> Result<[f64; 4]> {
    let q = numbers::<4>(flag, list)?;
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    if (norm - 1.0).abs() > 0.01 {
        return Err(Error::Usage(format!(
            "{flag} q={list}: a unit quaternion w,x,y,z is needed, this one has norm {norm}"
        )));
    }
    Ok(q.map(|v| v / norm))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_preset_is_in_radians_and_seconds() {
        // 0.84 deg/sqrt(h) = 0.014 deg/sqrt(s); 5 deg/h.
        let noise = Noise::parse("consumer").unwrap();
        assert!((noise.arw[0] - 0.014 * DEG).abs() < 1e-15);
        assert!((noise.bias_instability[2] - 5.0 * DEG / 3600.0).abs() < 1e-18);
    }

    #[test]
    fn given_noise_needs_its_angle_random_walk() {
        let noise = Noise::parse("arw=1e-4/2e-4/3e-4,bias-instability=2e-5").unwrap();
        assert_eq!(noise.arw, [1e-4, 2e-4, 3e-4]);
        assert_eq!(noise.bias_instability, [2e-5; 3]);
        for bad in [
            "arw=1/2",
            "arw=1/2/3/4",
            "arw=1//2",
            "arw=1e-4,arw=1e-4",
            "arw=1e-4,",
            "consumer,arw=1",
            "",
            "bias-instability=1e-5",
            "arw=-1",
            "arw=NaN",
            "arw=1e-4,x=2",
        ] {
            assert!(Noise::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn every_figure_of_noise_reaches_the_propagator() {
        let noise = Noise::parse("arw=1,rrw=2,turn-on-bias=3/0/0,bias-instability=4,initial=5/6/7");
        let noise = noise.unwrap();
        // 3 and 4 are independent: 5. An estimate removes the turn-on bias, and only that.
        assert_eq!(noise.unremoved_bias(), [5.0, 4.0, 4.0]);
        assert_eq!(
            noise.with_bias([8.0; 3]),
            propagate::Noise {
                initial: [5.0, 6.0, 7.0],
                arw: [1.0; 3],
                bias: [8.0; 3],
                rrw: [2.0; 3],
                bias_tau: None,
            }
        );
    }

    #[test]
    fn a_quaternion_that_is_no_rotation_is_refused() {
        assert!(matches!(
            Initial::parse("q=1,0,0,0"),
            Ok(Initial::Given([1.0, 0.0, 0.0, 0.0]))
        ));
        for bad in ["q=1,1,1,1", "q=0,0,0,0", "q=1,0,0", "q=NaN,0,0,1", "qq", ""] {
            assert!(Initial::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn shards_share_the_list_without_overlap() {
        let shards: Vec<Shard> = (0..3)
            .map(|i| Shard::parse(&format!("{i}/3")).unwrap())
            .collect();
        for position in 0..20 {
            assert_eq!(shards.iter().filter(|s| s.takes(position)).count(), 1);
        }
        for bad in ["3/3", "0/0", "1", "-1/2", "a/b"] {
            assert!(Shard::parse(bad).is_err(), "{bad}");
        }
    }
}
