//! Time -> the slowly varying bias: flicker, Gauss-Markov, random walk, ramp. Pure.
//!
//! Flicker is a sum of Gauss-Markov processes with correlation times tau_min r^i, r = sqrt(10), and
//! variances (B^2 / pi) ln r each: between the ends the sum of their spectra is B^2 / (2 pi |f|)
//! within 1 %. A process much slower than the sampling is drawn at knots tau/30 apart and joined by
//! straight lines, so that a sample costs about five normal numbers an axis instead of seventeen.
//!
//! # Source
//! Sum of relaxations: M. J. Buckingham, "Noise in Electronic Devices and Systems", 1983, 6.2;
//! Gauss-Markov recursion exact over any interval: IEEE Std 952-1997, C.1.1.

use super::ImuError;
use super::normal::{Purpose, Stream, vector};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Steps of the flicker's correlation times.
const RATIO: f64 = 3.162_277_660_168_379_5;
/// Longest correlation time unless given, s.
const LONGEST: f64 = 1e5;
/// Knots of a slow process per correlation time.
const KNOTS: f64 = 30.0;

/// The slowly varying bias of three axes.
#[derive(Clone, Debug)]
pub(super) struct Drift {
    error: ImuError,
    /// Seconds since the first interval's beginning.
    clock: f64,
    flicker: Vec<Relaxation>,
    flicker_streams: [Stream; 3],
    gauss_markov: Option<Relaxation>,
    gauss_markov_streams: [Stream; 3],
    walk: Vector3<f64>,
    walk_streams: [Stream; 3],
}

impl Drift {
    /// Begins at the stationary distribution; the random walk and the ramp begin at zero.
    /// `interval` is the first sampling interval, s, > 0.
    pub(super) fn new(error: &ImuError, interval: f64, seed: u64) -> Drift {
        let mut flicker_streams = Stream::axes(seed, Purpose::Flicker);
        let mut gauss_markov_streams = Stream::axes(seed, Purpose::GaussMarkov);
        let mut flicker = Vec::new();
        if error.bias_instability > 0.0 {
            let [least, most] = error
                .flicker_tau
                .unwrap_or([interval, LONGEST.max(10.0 * interval)]);
            let sigma = error.bias_instability * (libm::log(RATIO) / PI).sqrt();
            let mut tau = least;
            while tau < most * RATIO.sqrt() {
                // Knots pay once they are some samples apart.
                let spacing = tau / KNOTS;
                let spacing = if spacing > 2.0 * interval {
                    spacing
                } else {
                    0.0
                };
                flicker.push(Relaxation::new(sigma, tau, spacing, &mut flicker_streams));
                tau *= RATIO;
            }
        }
        let gauss_markov = (error.gm_sigma > 0.0)
            .then(|| Relaxation::new(error.gm_sigma, error.gm_tau, 0.0, &mut gauss_markov_streams));
        Drift {
            error: *error,
            clock: 0.0,
            flicker,
            flicker_streams,
            gauss_markov,
            gauss_markov_streams,
            walk: Vector3::zeros(),
            walk_streams: Stream::axes(seed, Purpose::RandomWalk),
        }
    }

    /// The bias now, rad/s.
    pub(super) fn value(&self) -> Vector3<f64> {
        let mut sum = self.walk + Vector3::repeat(self.error.rate_ramp * self.clock);
        for process in self.flicker.iter().chain(&self.gauss_markov) {
            sum += process.at(self.clock);
        }
        sum
    }

    /// Moves on by `secs` >= 0.
    pub(super) fn advance(&mut self, secs: f64) {
        self.clock += secs;
        for process in &mut self.flicker {
            process.advance(self.clock, &mut self.flicker_streams);
        }
        if let Some(process) = &mut self.gauss_markov {
            process.advance(self.clock, &mut self.gauss_markov_streams);
        }
        if self.error.rrw > 0.0 {
            self.walk += self.error.rrw * secs.sqrt() * vector(&mut self.walk_streams);
        }
    }
}

/// One Gauss-Markov process on three axes: exact at its knots, a straight line between them.
#[derive(Clone, Debug)]
struct Relaxation {
    sigma: f64,
    tau: f64,
    /// Spacing of knots, s; 0 = a knot at every sample.
    spacing: f64,
    from: f64,
    to: f64,
    start: Vector3<f64>,
    slope: Vector3<f64>,
    end: Vector3<f64>,
    /// The last step, what it keeps, and the deviation it adds.
    step: f64,
    keep: f64,
    add: f64,
}

impl Relaxation {
    fn new(sigma: f64, tau: f64, spacing: f64, streams: &mut [Stream; 3]) -> Relaxation {
        let start = sigma * vector(streams);
        Relaxation {
            sigma,
            tau,
            spacing,
            from: 0.0,
            to: 0.0,
            start,
            slope: Vector3::zeros(),
            end: start,
            step: 0.0,
            keep: 1.0,
            add: 0.0,
        }
    }

    fn at(&self, clock: f64) -> Vector3<f64> {
        self.start + self.slope * (clock - self.from)
    }

    #[inline]
    fn advance(&mut self, clock: f64, streams: &mut [Stream; 3]) {
        if clock < self.to {
            return;
        }
        if self.spacing == 0.0 || clock >= self.to + self.spacing {
            // A knot at this very instant, however far it is.
            let step = clock - self.to;
            self.next(step, streams);
            self.from = clock;
            self.to = clock;
            self.start = self.end;
            self.slope = Vector3::zeros();
        }
        if self.spacing > 0.0 {
            self.start = self.end;
            self.next(self.spacing, streams);
            self.from = self.to;
            self.to += self.spacing;
            self.slope = (self.end - self.start) / self.spacing;
        }
    }

    /// Moves `end` on by `step` seconds, exactly in distribution.
    fn next(&mut self, step: f64, streams: &mut [Stream; 3]) {
        if step != self.step {
            let x = step / self.tau;
            self.step = step;
            self.keep = libm::exp(-x);
            self.add = self.sigma * (-libm::expm1(-2.0 * x)).sqrt();
        }
        self.end = self.keep * self.end + self.add * vector(streams);
    }
}
