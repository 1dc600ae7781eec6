//! Name or numbers of a class of sensors -> noise by which sigma grows, in SI units. Pure.
//!
//! Apart from the settings because the classes have the units of data sheets, and what is left of a bias is a rule of
//! its own.

use super::super::noise_presets::{NOISE_PRESETS, NoisePreset};
use crate::propagate;
use crate::smooth::BIAS_SIGMA;

/// Noise that the covariance is made of: 1 sigma, about the body axes x, y, z.
#[derive(Clone, PartialEq, Debug)]
pub struct Noise {
    /// Name as it was given, for the summary.
    pub name: String,
    /// Angle random walk N, rad/sqrt(s).
    pub arw: [f64; 3],
    /// Bias instability B, rad/s; 1.7 of it is taken as the uncertainty of a constant bias that no estimate removes.
    pub bias_instability: [f64; 3],
    /// Rate random walk K, rad/s/sqrt(s).
    pub rrw: [f64; 3],
    /// Turn-on bias, rad/s: unknown as long as no bias is removed.
    pub turn_on_bias: [f64; 3],
    /// Uncertainty of the initial attitude, rad.
    pub initial: [f64; 3],
    /// Error of the scale factors, as a share.
    pub scale: f64,
    /// Angles between the axes, rad.
    pub misalignment: f64,
    /// Error of an attitude levelled by the accelerometer, rad.
    pub tilt: f64,
    /// Delay of its filters that nobody has taken out, s.
    pub delay: f64,
    /// Sensitivity of the gyro to acceleration, rad/s per g; 0: nothing is said.
    pub sensitivity: f64,
}

const DEG: f64 = std::f64::consts::PI / 180.0;

/// Deviation of a bias of instability B after an hour or so, in B: its flicker has the Allan floor 0.664 B, and
/// 1.6 to 1.8 B of standard deviation over the decades of time a run has (`docs/theory/attitude.md` 9).
const FLICKER: f64 = 1.7;

/// Share of a turn-on bias that is left once it was measured at rest. Chosen on 14 recordings of BROAD
/// (`docs/estimation.md`): without it one of them has 80 % of its errors within three sigma, with it every one all.
const LEFT: f64 = 0.03;

/// Name of the class that is found: the first of [`NOISE_PRESETS`] where the data of a file do not clearly tell that
/// nobody calibrated the sensor.
pub const CLASS_BY_DATA: &str = "auto";

/// Name of noise of which nothing is stated.
pub(in crate::estimate) const NO_NOISE: &str = "none";

impl Noise {
    /// Noise of the default class, which the data of a file may replace.
    #[must_use]
    pub fn by_data() -> Noise {
        Noise {
            name: CLASS_BY_DATA.to_owned(),
            ..Noise::preset(&NOISE_PRESETS[0])
        }
    }

    /// Noise of which nothing is stated: no covariance is carried.
    #[must_use]
    pub fn none() -> Noise {
        Noise {
            name: NO_NOISE.to_owned(),
            arw: [0.0; 3],
            bias_instability: [0.0; 3],
            rrw: [0.0; 3],
            turn_on_bias: [0.0; 3],
            initial: [0.0; 3],
            scale: 0.0,
            misalignment: 0.0,
            tilt: 0.0,
            delay: 0.0,
            sensitivity: 0.0,
        }
    }

    /// Whether nothing is stated of it.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.name == NO_NOISE
    }

    /// Whether the data of a file may replace it.
    pub(in crate::estimate) fn is_by_data(&self) -> bool {
        self.name == CLASS_BY_DATA
    }

    /// The same under the name of the class that it is.
    pub(in crate::estimate) fn taken(&self) -> Noise {
        if self.is_by_data() {
            Noise::preset(&NOISE_PRESETS[0])
        } else {
            self.clone()
        }
    }

    /// Noise of the class of this name, [`CLASS_BY_DATA`] included; `None` where there is none.
    #[must_use]
    pub fn named(name: &str) -> Option<Noise> {
        if name == CLASS_BY_DATA {
            return Some(Noise::by_data());
        }
        let class = NOISE_PRESETS.iter().find(|class| class.name == name);
        class.map(Noise::preset)
    }

    /// Noise of a class.
    #[must_use]
    pub fn preset(class: &NoisePreset) -> Noise {
        Noise {
            name: class.name.to_owned(),
            arw: [class.arw * DEG / 60.0; 3],
            bias_instability: [class.bias_instability * DEG / 3600.0; 3],
            rrw: [0.0; 3],
            turn_on_bias: [class.turn_on_bias * DEG; 3],
            initial: [0.0; 3],
            scale: class.scale,
            misalignment: class.misalignment,
            tilt: class.tilt,
            delay: class.delay,
            sensitivity: class.sensitivity * DEG,
        }
    }

    /// Bias left after removal, rad/s: flicker in full, and a share of the turn-on bias, since
    /// that of a body at rest is not that of one in motion (temperature, acceleration, what drivers cut off).
    #[must_use]
    pub fn unstable_bias(&self) -> [f64; 3] {
        let ([x, y, z], [u, v, w]) = (self.flicker(), self.left_of_turn_on());
        [x.hypot(u), y.hypot(v), z.hypot(w)]
    }

    /// The part of it that is flicker.
    #[must_use]
    pub fn flicker(&self) -> [f64; 3] {
        self.bias_instability.map(|b| FLICKER * b)
    }

    /// The part of it that is the turn-on bias.
    #[must_use]
    pub fn left_of_turn_on(&self) -> [f64; 3] {
        self.turn_on_bias.map(|b| LEFT * b)
    }

    /// Sigma of the bias, rad/s, when none is removed: turn-on bias and instability.
    #[must_use]
    pub fn unremoved_bias(&self) -> [f64; 3] {
        let [x, y, z] = self.turn_on_bias;
        let [u, v, w] = self.unstable_bias();
        [x.hypot(u), y.hypot(v), z.hypot(w)]
    }

    /// One standard deviation of the bias after switching on, rad/s; that of the default class where nothing is said.
    pub(in crate::estimate) fn bias_of_class(&self) -> f64 {
        match self.turn_on_bias.into_iter().fold(0.0, f64::max) {
            0.0 => BIAS_SIGMA,
            class => class,
        }
    }

    /// The same for an attitude that begins level by the accelerometer at a rest that tells the vertical to
    /// `scatter`, rad.
    #[must_use]
    pub fn levelled(&self, scatter: f64) -> Noise {
        let tilt = self.tilt.hypot(scatter);
        Noise {
            initial: self.initial.map(|sigma| sigma.hypot(tilt)),
            ..self.clone()
        }
    }

    /// Noise for the propagator, when `bias` (rad/s) is not known of the bias.
    #[must_use]
    pub fn with_bias(&self, bias: [f64; 3]) -> propagate::Noise {
        if self.is_none() {
            return propagate::Noise::default();
        }
        propagate::Noise {
            initial: self.initial,
            arw: self.arw,
            bias,
            rrw: self.rrw,
            scale: self.scale,
            misalignment: self.misalignment,
            bias_tau: None,
        }
    }
}
