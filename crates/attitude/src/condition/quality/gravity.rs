//! Gyro against gravity -> the gyro's unit and sign. Pure.
//!
//! A stage of its own because it is the one witness inside a recording that a rate means what it
//! says: in body axes the direction of gravity u turns with du/dt = -w x u, whatever the motion, as long as
//! the accelerometer reads mostly gravity. The factor that fits best is 1 for rad/s, 0.01745 for
//! deg/s, 0.001 for mrad/s, and negative where gyro and accelerometer disagree about an axis.

use crate::record::Nanos;
use nalgebra::Vector3;

/// Length of the windows that are compared, and fewest samples in one.
const WINDOW_NANOS: i64 = 100_000_000;
const WINDOW_SAMPLES: u32 = 3;
/// Speed of the running median, per window.
const MEDIAN_STEP: f64 = 0.005;
/// A window whose magnitude is off by more, or varies by more, reads more than gravity.
const MAX_EXCESS: f64 = 0.05;
const MAX_SPREAD: f64 = 0.1;
/// The same where a ratio is compared with another of the same motion.
const LOOSE_EXCESS: f64 = 0.25;
const LOOSE_SPREAD: f64 = 0.3;

#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    n: u32,
    start: i64,
    /// Sum of stamps after `start`, ns.
    time: f64,
    gyro: Vector3<f64>,
    accel: Vector3<f64>,
    accel_squared: f64,
}

/// Streaming least squares of the turn of gravity against what the gyro predicts.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::condition) struct GravityTrack {
    mean: Mean,
    is_loose: bool,
    /// Running median of the windows' magnitudes: one g, in whatever unit.
    gravity: f64,
    /// Middle (ns), mean rate, direction of the window before.
    before: Option<(f64, i64, Vector3<f64>, Vector3<f64>)>,
    seen_predicted: f64,
    predicted: f64,
    seen: f64,
}

/// Rotation of gravity from one window to the next.
#[derive(Clone, Copy, Debug)]
pub(in crate::condition) struct GravityRotation {
    /// Stamp with which the first of the two windows begins.
    pub(in crate::condition) from: Nanos,
    /// Change of gravity's direction.
    pub(in crate::condition) seen: Vector3<f64>,
    /// Change by the rates of the gyro.
    pub(in crate::condition) by_gyro: Vector3<f64>,
}

/// Agreement of the gyro with the rotation of gravity.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GyroAgainstGravity {
    /// Multiply the recorded rates by this to get what gravity says, rad/s.
    pub factor: f64,
    /// Correlation of the two, -1 to 1.
    pub correlation: f64,
}

impl GravityTrack {
    /// Track that leaves out fewer windows of accelerated motion.
    pub(in crate::condition) fn loose() -> GravityTrack {
        GravityTrack {
            is_loose: true,
            ..GravityTrack::default()
        }
    }

    /// Takes the next sample; returns what a window that ends with it adds.
    #[inline]
    pub(in crate::condition) fn push(
        &mut self,
        stamp: Nanos,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
    ) -> Option<GravityRotation> {
        if self.mean.n == 0 {
            self.mean.start = stamp.0;
        }
        let after = stamp.0.saturating_sub(self.mean.start);
        if !(0..=3 * WINDOW_NANOS).contains(&after) {
            // A jump or a gap: nothing is known of the turn across it.
            *self = GravityTrack {
                mean: Mean::default(),
                before: None,
                ..*self
            };
            return None;
        }
        self.mean.n += 1;
        self.mean.time += after as f64;
        self.mean.gyro += gyro;
        self.mean.accel += accel;
        self.mean.accel_squared += accel.norm_squared();
        let is_full = after >= WINDOW_NANOS && self.mean.n >= WINDOW_SAMPLES;
        is_full.then(|| self.close()).flatten()
    }

    fn close(&mut self) -> Option<GravityRotation> {
        let mean = std::mem::take(&mut self.mean);
        let n = f64::from(mean.n);
        let middle = mean.time / n;
        let rate = mean.gyro / n;
        let norm = mean.accel.norm();
        if !(norm > 0.0 && norm.is_finite()) {
            self.before = None;
            return None;
        }
        let magnitude = norm / n;
        if self.gravity == 0.0 {
            self.gravity = magnitude;
        }
        self.gravity *= if magnitude > self.gravity {
            1.0 + MEDIAN_STEP
        } else {
            1.0 - MEDIAN_STEP
        };
        let spread = (mean.accel_squared / n - magnitude * magnitude)
            .max(0.0)
            .sqrt();
        let (excess, most) = match self.is_loose {
            true => (LOOSE_EXCESS, LOOSE_SPREAD),
            false => (MAX_EXCESS, MAX_SPREAD),
        };
        if (magnitude / self.gravity - 1.0).abs() > excess || spread > most * self.gravity {
            self.before = None;
            return None;
        }
        let up = mean.accel / norm;
        let mut rotation = None;
        if let Some((middle_before, start_before, rate_before, up_before)) = self.before {
            let apart = mean.start.saturating_sub(start_before) as f64 + middle - middle_before;
            if apart > 0.0 && apart < 3.0 * WINDOW_NANOS as f64 {
                let turn = (rate + rate_before) * (0.5e-9 * apart);
                let along = (up + up_before) * 0.5;
                let predicted = along.cross(&turn);
                let seen = up - up_before;
                self.seen_predicted += seen.dot(&predicted);
                self.predicted += predicted.norm_squared();
                self.seen += seen.norm_squared();
                rotation = Some(GravityRotation {
                    from: Nanos(start_before),
                    seen,
                    by_gyro: predicted,
                });
            }
        }
        self.before = Some((middle, mean.start, rate, up));
        rotation
    }

    /// `None` while gravity has not turned by enough to tell.
    pub(super) fn result(&self) -> Option<GyroAgainstGravity> {
        // 0.1 rad^2 is, for instance, fifty windows of 2.5 degrees each.
        (self.seen > 0.1 && self.predicted > 0.0 && self.predicted.is_finite()).then(|| {
            GyroAgainstGravity {
                factor: self.seen_predicted / self.predicted,
                correlation: self.seen_predicted / (self.predicted * self.seen).sqrt(),
            }
        })
    }
}
