//! RateSample -> rests: when the body stood still, and what the gyro and the accelerometer read. Pure.
//!
//! A stage of its own because bias and level are only worth having from a body at rest, and the
//! decision that it is at rest must refuse when in doubt: a slow turn taken for a bias is worse
//! than no bias.
//!
//! A body that turns slowly, steadily and about the vertical cannot be told from a gyro bias by
//! an IMU; beside [`Limits::max_mean_rate`] there is only what biases are like ([`Rests::less_turns`]). About any
//! other axis gravity turns with it.

mod estimate;
mod swing;
mod turns;

pub(crate) use estimate::rest_at_start;
pub use estimate::{BiasEstimate, NoRest, accel_at_start, estimate_bias, level};
pub(crate) use swing::Swing;
pub(crate) use turns::{
    ALONG, BEYOND_CLASS, FEW_SECS, SAME, SHORT_MOST, SHORT_SECS, about_vertical, is_solely_vertical,
};

use crate::frames::{Body, In};
use crate::quaternion::BodyRate;
use crate::record::{Join, Nanos, RateSample};
use nalgebra::Vector3;

/// Number of rests kept; later ones are only counted.
pub const RESTS_KEPT: usize = 1000;

/// Limits of stillness. The defaults fit MEMS gyros from phone to industrial grade; measured on the
/// recordings of six devices, resting windows have a gyro deviation of 0.0015 to 0.02 rad/s, moving ones
/// of 0.04 and more.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limits {
    /// Window length, s. Two in a row make a rest.
    pub window_secs: f64,
    /// Largest standard deviation of a gyro axis in a window, rad/s.
    pub max_gyro_deviation: f64,
    /// Largest mean rate about any axis that can still be a bias, rad/s (3 deg/s).
    pub max_mean_rate: f64,
    /// Largest standard deviation of an accelerometer axis in a window, as a share of its mean
    /// magnitude, so that m/s^2, g and mg are all served.
    pub max_accel_deviation: f64,
    /// Largest change of the acceleration's direction from window to window, rad (1 deg).
    pub max_tilt: f64,
    /// Floor of a bias' sigma, rad/s: what white noise averages down to is not what the bias will
    /// be later. 10 deg/h, the bias instability of consumer MEMS (Xsens MTi-1 data sheet).
    pub bias_instability: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            window_secs: 0.5,
            max_gyro_deviation: 0.025,
            max_mean_rate: 0.052,
            max_accel_deviation: 0.03,
            max_tilt: 0.0175,
            bias_instability: 4.8e-5,
        }
    }
}

/// Fewest samples that make a window, whatever its length.
const MIN_SAMPLES: u32 = 8;
/// Shortest rest: "the first still second".
const MIN_REST_SECS: f64 = 1.0;
/// Largest change of the force's length from window to window, beyond its noise, as a share.
const MOST_HEAVE: f64 = 2e-3;
/// A window may end a little early: the stamps jitter.
const SLACK: f64 = 0.9;

/// A stretch of time in which the body stood still.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Rest {
    /// Stamp of the first sample.
    pub start: Nanos,
    /// Stamp of the last sample.
    pub end: Nanos,
    /// Mean rate: the gyro's bias (what is left of it after `--bias`).
    pub mean_rate: BodyRate,
    /// One standard deviation of `mean_rate`, rad/s: the larger of what the noise within windows and
    /// the scatter between windows say, and never below the bias instability.
    pub sigma: Vector3<f64>,
    /// Mean specific force, in the recording's unit; `None` where there is no
    /// accelerometer.
    pub mean_accel: Option<In<Body>>,
    /// One standard deviation of its direction, rad, by the scatter between windows: a body that is held, or begins to
    /// move, is not quite still. 0 without an accelerometer.
    pub tilt_sigma: f64,
    /// Samples in it.
    pub samples: u64,
}

impl Rest {
    /// Returns it as the only rest.
    #[must_use]
    pub fn alone(&self) -> Rests {
        Rests {
            kept: vec![*self],
            count: 1,
            secs: self.secs(),
            first: Some(self.start),
            stillest: None,
            has_moved: false,
        }
    }

    /// Duration, s.
    #[must_use]
    pub fn secs(&self) -> f64 {
        self.end.secs_since(self.start)
    }
}

/// Every rest of a stream.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Rests {
    /// The first [`RESTS_KEPT`], in order of time.
    pub kept: Vec<Rest>,
    /// Number of rests.
    pub count: u64,
    /// Seconds of rest in all.
    pub secs: f64,
    /// First stamp of the stream.
    pub first: Option<Nanos>,
    /// Smallest gyro deviation of any window (largest axis), rad/s: how still it ever was.
    pub stillest: Option<f64>,
    /// Whether there was a window in which the body did not rest.
    pub has_moved: bool,
}

/// Streaming mean and variance of three axes (Welford 1962).
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    n: u32,
    mean: Vector3<f64>,
    /// Sum of squared deviations.
    m2: Vector3<f64>,
}

impl Moments {
    fn push(&mut self, v: &Vector3<f64>) {
        self.n += 1;
        let before = v - self.mean;
        self.mean += before / f64::from(self.n);
        self.m2 += before.component_mul(&(v - self.mean));
    }

    fn variance(&self) -> Vector3<f64> {
        self.m2 / f64::from(self.n.saturating_sub(1).max(1))
    }

    fn deviation(&self) -> f64 {
        self.variance().max().max(0.0).sqrt()
    }

    /// Sigma of the mean's direction, rad; 0 if there is no mean.
    fn direction_sigma(&self) -> f64 {
        let sigma = self.deviation() / f64::from(self.n).sqrt() / self.mean.norm();
        if sigma.is_finite() { sigma } else { 0.0 }
    }
}

#[derive(Clone, Copy, Debug)]
struct Window {
    start: Nanos,
    end: Nanos,
    gyro: Moments,
    accel: Moments,
}

/// A rest under way.
#[derive(Clone, Copy, Debug)]
struct Growing {
    start: Nanos,
    end: Nanos,
    /// One entry per window: its mean rate.
    windows: Moments,
    /// Sum of the windows' variances.
    variance: Vector3<f64>,
    accel: Moments,
    last_rate: Vector3<f64>,
    last_accel: Option<Vector3<f64>>,
    swing: Swing,
    samples: u64,
}

/// Finds rests in a stream of conditioned samples.
#[derive(Clone, Debug)]
pub struct Stillness {
    limits: Limits,
    window: Option<Window>,
    growing: Option<Growing>,
    rests: Rests,
}

impl Stillness {
    /// A detector that has seen nothing.
    #[must_use]
    pub fn new(limits: Limits) -> Self {
        Stillness {
            limits,
            window: None,
            growing: None,
            rests: Rests::default(),
        }
    }

    /// Takes the next sample.
    pub fn push(&mut self, sample: &RateSample) {
        self.rests.first.get_or_insert(sample.stamp);
        if matches!(sample.join, Join::Start | Join::Hold | Join::Reset) {
            // What was begun before a place of unknown length does not go on behind it.
            self.window = None;
            self.close();
        }
        if sample.own_secs() <= 0.0 {
            return;
        }
        let BodyRate(rate) = sample.mean_rate();
        let window = self.window.get_or_insert(Window {
            start: sample.stamp,
            end: sample.stamp,
            gyro: Moments::default(),
            accel: Moments::default(),
        });
        window.end = sample.stamp;
        window.gyro.push(&rate);
        if let Some(accel) = &sample.accel {
            window.accel.push(accel.as_vector());
        }
        if window.gyro.n >= MIN_SAMPLES
            && window.end.secs_since(window.start) >= SLACK * self.limits.window_secs
        {
            let window = *window;
            self.window = None;
            self.judge(&window);
        }
    }

    /// The stream has ended.
    #[must_use]
    pub fn finish(mut self) -> Rests {
        self.close();
        self.rests
    }

    fn judge(&mut self, window: &Window) {
        let deviation = window.gyro.deviation();
        let stillest = self.rests.stillest.get_or_insert(deviation);
        *stillest = stillest.min(deviation);
        let rate = window.gyro.mean;
        let accel = (window.accel.n >= MIN_SAMPLES).then_some(window.accel.mean);
        let shakes = accel.is_some_and(|mean| {
            window.accel.deviation() > self.limits.max_accel_deviation * mean.norm()
        });
        if deviation > self.limits.max_gyro_deviation
            || rate.amax() > self.limits.max_mean_rate
            || shakes
        {
            self.rests.has_moved = true;
            return self.close();
        }
        if let Some(growing) = self.growing
            && self.parts(&growing, window, accel)
        {
            self.close();
        }
        let growing = self.growing.get_or_insert(Growing {
            start: window.start,
            end: window.end,
            windows: Moments::default(),
            variance: Vector3::zeros(),
            accel: Moments::default(),
            last_rate: rate,
            last_accel: accel,
            swing: Swing::default(),
            samples: 0,
        });
        if let (Some(from), Some(to)) = (&growing.last_accel, &accel) {
            let secs = window.end.secs_since(growing.end);
            growing.swing.take([from, to], &rate, secs);
        }
        growing.end = window.end;
        growing.windows.push(&rate);
        growing.variance += window.gyro.variance() / f64::from(window.gyro.n);
        growing.last_rate = rate;
        growing.samples += u64::from(window.gyro.n);
        if let Some(accel) = accel {
            growing.accel.push(&accel);
            growing.last_accel = Some(accel);
        }
    }

    /// Whether the window is still, but not in the pose or at the rate of the rest before it.
    fn parts(&mut self, growing: &Growing, window: &Window, accel: Option<Vector3<f64>>) -> bool {
        let noise = (window.gyro.variance() / f64::from(window.gyro.n))
            .max()
            .sqrt();
        // Five sigma of a difference of two means, and a bias' own wander.
        let allowed = 5.0 * std::f64::consts::SQRT_2 * noise + 10.0 * self.limits.bias_instability;
        let turned = match (growing.last_accel, accel) {
            (Some(a), Some(b)) => a.angle(&b) > self.limits.max_tilt,
            _ => false,
        };
        // A boat at the turn of its swing: the rate and the direction stand, the force does not.
        let heaves = match (growing.last_accel, accel) {
            (Some(a), Some(b)) => {
                let noise = window.accel.deviation() / f64::from(window.accel.n).sqrt();
                let allowed = 5.0 * std::f64::consts::SQRT_2 * noise + MOST_HEAVE * b.norm();
                (b.norm() - a.norm()).abs() > allowed
            }
            _ => false,
        };
        self.rests.has_moved |= turned || heaves;
        turned || heaves || (window.gyro.mean - growing.last_rate).amax() > allowed
    }

    fn close(&mut self) {
        let Some(growing) = self.growing.take() else {
            return;
        };
        let secs = growing.end.secs_since(growing.start);
        if secs < SLACK * MIN_REST_SECS || growing.swing.is_turn() {
            return;
        }
        let n = f64::from(growing.windows.n);
        // Noise within windows if it is white; scatter between windows if it is not.
        let white = growing.variance / (n * n);
        let scatter = growing.windows.variance() / n;
        let sigma = white
            .zip_map(&scatter, f64::max)
            .map(|v| v.max(0.0).sqrt().max(self.limits.bias_instability));
        self.rests.count += 1;
        self.rests.secs += secs;
        if self.rests.kept.len() < RESTS_KEPT {
            self.rests.kept.push(Rest {
                start: growing.start,
                end: growing.end,
                mean_rate: BodyRate(growing.windows.mean),
                sigma,
                mean_accel: (growing.accel.n > 0).then(|| In::assume(growing.accel.mean)),
                tilt_sigma: growing.accel.direction_sigma(),
                samples: growing.samples,
            });
        }
    }
}
