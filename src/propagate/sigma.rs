//! Gyro noise and time -> how well the attitude is known. Pure.
//!
//! For equal noise on three axes the closed form of `attitude.md` 8 stays a multiple of the identity
//! however the body turns, so one number is carried. The turn-on bias is counted as if the body never
//! turned: an upper bound, and the right answer for most of a log.

use std::fmt;

/// Noise of the gyro, SI. What `--noise` states.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Noise {
    /// Uncertainty of the initial attitude about each axis, rad.
    pub initial: f64,
    /// Angle random walk, rad/sqrt(s).
    pub arw: f64,
    /// Uncertainty of the bias that remains after correction, rad/s.
    pub bias: f64,
    /// Rate random walk, rad/s/sqrt(s).
    pub rrw: f64,
}

impl Noise {
    /// The name and value of a number that can not be, if any.
    pub(crate) fn fault(&self) -> Option<(&'static str, f64)> {
        [
            ("initial", self.initial),
            ("arw", self.arw),
            ("bias", self.bias),
            ("rrw", self.rrw),
        ]
        .into_iter()
        .find(|(_, value)| !(0.0..1e6).contains(value))
    }
}

impl fmt::Display for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Noise {
            initial,
            arw,
            bias,
            rrw,
        } = self;
        write!(
            f,
            "arw={arw:e},bias={bias:e},rrw={rrw:e},initial={initial:e}"
        )
    }
}

/// Attitude uncertainty as it grows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sigma {
    noise: Noise,
    /// Integrated nanoseconds since the last reset.
    nanos: i64,
    /// Variance from bridges and holds, rad^2.
    extra: f64,
}

/// About any axis nothing is known: uniform over the circle has this standard deviation.
const LOST: f64 = std::f64::consts::PI;

impl Sigma {
    pub(crate) fn new(noise: Noise) -> Self {
        Sigma {
            noise,
            nanos: 0,
            extra: 0.0,
        }
    }

    pub(crate) fn reset(&mut self) {
        *self = Sigma::new(self.noise);
    }

    #[inline(always)]
    pub(crate) fn integrate(&mut self, nanos: i64) {
        self.nanos = self.nanos.saturating_add(nanos);
    }

    /// Adds what a bridged gap may hide: rad^2, and seconds of white noise.
    pub(crate) fn bridge(&mut self, variance: f64, noise_secs: f64) {
        self.extra += variance + self.noise.arw * self.noise.arw * noise_secs;
    }

    /// Adds what may have been turned in `secs` during which no sample was seen, were the rate kept.
    pub(crate) fn hold(&mut self, rate: f64, secs: f64) {
        let turned = (rate * secs.max(0.0)).min(LOST);
        self.extra += turned * turned;
    }

    /// One standard deviation about each body axis, rad; at most pi.
    #[inline(always)]
    pub(crate) fn value(&self) -> f64 {
        let Noise {
            initial,
            arw,
            bias,
            rrw,
        } = self.noise;
        let t = self.nanos as f64 * 1e-9;
        let drift = bias * t;
        let variance = initial * initial
            + arw * arw * t
            + drift * drift
            + rrw * rrw * (t * t * t) * (1.0 / 3.0)
            + self.extra;
        variance.sqrt().min(LOST)
    }
}
