//! Rate -> rate behind a second-order low-pass. Pure.
//!
//! `y'' + 2 zeta w y' + w^2 y = w^2 u`, solved exactly for an input that is a parabola over each
//! interval: the one with the interval's end rates and its delta angle.

use nalgebra::Vector3;

/// The rate over one interval: a parabola given by its ends and its mean, rad/s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    pub(super) start: Vector3<f64>,
    pub(super) end: Vector3<f64>,
    pub(super) mean: Vector3<f64>,
}

impl Course {
    /// Value in the middle of the interval.
    pub(super) fn middle(&self) -> Vector3<f64> {
        1.5 * self.mean - 0.25 * (self.start + self.end)
    }

    /// Coefficients of 1, t, t^2, with t in seconds from the start.
    fn coefficients(&self, secs: f64) -> [Vector3<f64>; 3] {
        let slope = (6.0 * self.mean - 4.0 * self.start - 2.0 * self.end) / secs;
        let bend = 3.0 * (self.start + self.end - 2.0 * self.mean) / (secs * secs);
        [self.start, slope, bend]
    }
}

/// State of the filter on three axes.
#[derive(Clone, Debug)]
pub(super) struct LowPass {
    w: f64,
    zeta: f64,
    rate: Vector3<f64>,
    slope: Vector3<f64>,
    /// The interval the transition below belongs to, s.
    secs: f64,
    /// Free motion over it: (rate, slope) at its end from (rate, slope) at its start.
    transition: [[f64; 2]; 2],
}

impl LowPass {
    /// Begins as if the first interval's line had been running forever: without a transient.
    pub(super) fn new(hz: f64, zeta: f64, first: &Course, secs: f64) -> LowPass {
        let w = 2.0 * std::f64::consts::PI * hz;
        let slope = (first.end - first.start) / secs;
        LowPass {
            w,
            zeta,
            rate: first.start - slope * (2.0 * zeta / w),
            slope,
            secs: f64::NAN,
            transition: [[1.0, 0.0], [0.0, 1.0]],
        }
    }

    /// The filtered course over the next interval.
    pub(super) fn pass(&mut self, input: &Course, secs: f64) -> Course {
        if secs != self.secs {
            self.secs = secs;
            self.transition = transition(self.w, self.zeta, secs);
        }
        // The parabola that satisfies the equation, and the free motion of the rest.
        let lag = 2.0 * self.zeta / self.w;
        let [u0, u1, u2] = input.coefficients(secs);
        let p2 = u2;
        let p1 = u1 - p2 * (2.0 * lag);
        let p0 = u0 - p1 * lag - p2 * (2.0 / (self.w * self.w));
        let (rate, slope) = (self.rate - p0, self.slope - p1);
        let [[a, b], [c, d]] = self.transition;
        let end = a * rate + b * slope + p0 + p1 * secs + p2 * (secs * secs);
        let end_slope = c * rate + d * slope + p1 + p2 * (2.0 * secs);
        // The equation itself, integrated once.
        let mean = input.mean
            - ((end - self.rate) * lag + (end_slope - self.slope) / (self.w * self.w)) / secs;
        let course = Course {
            start: self.rate,
            end,
            mean,
        };
        self.rate = end;
        self.slope = end_slope;
        course
    }
}

/// Free motion over `secs`.
fn transition(w: f64, zeta: f64, secs: f64) -> [[f64; 2]; 2] {
    let decay = zeta * w;
    let split = w * (1.0 - zeta * zeta).abs().sqrt();
    // f = e^{-decay t} {sin, sinh, t} / split and g = e^{-decay t} {cos, cosh, 1}.
    let (f, g) = if split * secs < 1e-6 {
        let e = libm::exp(-decay * secs);
        (e * secs, e)
    } else if zeta < 1.0 {
        let e = libm::exp(-decay * secs);
        (
            e * libm::sin(split * secs) / split,
            e * libm::cos(split * secs),
        )
    } else {
        let slow = libm::exp((split - decay) * secs);
        let fast = libm::exp(-(split + decay) * secs);
        (0.5 * (slow - fast) / split, 0.5 * (slow + fast))
    };
    [[g + decay * f, f], [-w * w * f, g - decay * f]]
}
