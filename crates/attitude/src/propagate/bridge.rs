//! Samples on both sides of missing ones -> the rate between them, and how well it is known. Pure.
//!
//! A polynomial of what order? Too low and the motion is cut short, too high and noise is multiplied. What the
//! samples around are like says more than how many are missing: how far they vary, over what time, and how
//! much of it is noise. Each axis of the rate is taken for a Gaussian process of unknown constant mean with
//! Matérn's covariance of order 7/2, or the Gaussian one where there is too little noise to hide the
//! difference; shape, scale of time and share of noise are those under which the samples are most
//! likely. The rate between them is then their best linear combination, and its uncertainty comes with it,
//! from the same numbers.
//!
//! # Source
//! Rasmussen & Williams, Gaussian Processes for Machine Learning (2006), 2.2, 2.7 (unknown mean), 4.2.1 (Matérn),
//! 5.4.1 (likelihood); the variance is profiled out. Polynomials are the limit of long scales without noise,
//! and exacter there: see `window::careful`.
//!
//! # Accuracy
//! On recordings, bursts of 1 to 50 samples cut out: docs/accuracy.md, "Missing samples".

use super::lagrange::Quadrature;
use super::magnus::MOMENTS;
use crate::lanes::Triple;

/// Samples looked at, on both sides together. More tell nothing more (docs/accuracy.md).
pub(crate) const NEIGHBOURS: usize = 12;

/// Scales of time tried, in ordinary steps: from noise-like to nearly a parabola.
const SCALES: [f64; 17] = [
    1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0, 45.0, 64.0, 90.0, 128.0, 180.0,
    256.0,
];
/// Shares of noise tried: its variance over that of the motion.
const NOISES: [f64; 7] = [1e-13, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0];

/// The largest of them that lets one see whether a motion is as smooth as can be.
const QUIET: usize = 3;

/// A mean from three instants: place in spreads from the middle, weight (Gauss).
const OF_MEAN: [(f64, f64); 3] = [(-1.0, 5.0 / 18.0), (0.0, 4.0 / 9.0), (1.0, 5.0 / 18.0)];

/// A sample: the rate at an instant, or its mean over an interval around it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    /// The instant, or the middle of the interval, in ordinary steps from the middle of the gap.
    pub(crate) at: f64,
    /// Distance from the middle of the outer two of the three instants whose mean stands for that of the interval
    /// (Gauss); 0 at an instant.
    pub(crate) spread: f64,
    /// Rate, rad/s.
    pub(crate) rate: Triple<1>,
}

impl Observation {
    /// A place to be filled.
    pub(crate) const NONE: Observation = Observation {
        at: 0.0,
        spread: 0.0,
        rate: Triple::ZERO,
    };
}

/// The rate within a gap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bridge {
    /// Rates at the nodes of the quadrature, rad/s.
    pub(crate) values: [Triple<1>; MOMENTS],
    /// Variance of their mean over the gap against that of the samples that are missing, about each axis,
    /// (rad/s)^2.
    pub(crate) variance: f64,
    /// The samples show no noise above their own rounding.
    pub(crate) noiseless: bool,
}

/// Bridges a gap of `length` ordinary steps in which `missing` samples would have been, from `around` (at most
/// [`NEIGHBOURS`]); `None` of fewer than two.
pub(crate) fn across(
    around: &[Observation],
    length: f64,
    missing: f64,
    quadrature: &Quadrature,
) -> Option<Bridge> {
    let n = around.len().min(NEIGHBOURS);
    let around = around.get(..n).filter(|around| around.len() > 1)?;
    // Only differences from a rate nearby meet rounding.
    let reference = around[n / 2].rate;
    let mut model = Model::new(around, reference);
    let noise = model.likeliest()?;
    let (values, variance) = model.between(0.5 * length, quadrature);
    let of_sample = model.variance * NOISES[noise];
    Some(Bridge {
        values: values.map(|value| value + reference),
        variance: variance + of_sample * missing / (length * length),
        noiseless: noise == 0,
    })
}

/// Lower triangle of a matrix over the samples.
type Matrix = [[f64; NEIGHBOURS]; NEIGHBOURS];

/// The samples under one scale and one noise.
struct Model<'a> {
    around: &'a [Observation],
    /// Rates less the reference, by sample and axis.
    rates: [[f64; 3]; NEIGHBOURS],
    /// Process of the motion under the scale tried last.
    process: Process,
    /// Covariances of the samples then, of a motion of variance 1.
    covariance: Matrix,
    scale: usize,
    /// Cholesky's factor L of them with noise.
    factor: Matrix,
    /// L^-1 times ones, and its square.
    ones: [f64; NEIGHBOURS],
    information: f64,
    /// L^-1 times the rates less their mean.
    whitened: [[f64; 3]; NEIGHBOURS],
    mean: [f64; 3],
    /// Variance of the motion, (rad/s)^2.
    variance: f64,
}

impl<'a> Model<'a> {
    fn new(around: &'a [Observation], reference: Triple<1>) -> Self {
        let mut rates = [[0.0; 3]; NEIGHBOURS];
        for (rate, sample) in rates.iter_mut().zip(around) {
            let w = sample.rate - reference;
            *rate = [w.x.0[0], w.y.0[0], w.z.0[0]];
        }
        Model {
            around,
            rates,
            process: Process {
                shape: Shape::Matern,
                scale: SCALES[0],
            },
            covariance: [[0.0; NEIGHBOURS]; NEIGHBOURS],
            scale: usize::MAX,
            factor: [[0.0; NEIGHBOURS]; NEIGHBOURS],
            ones: [0.0; NEIGHBOURS],
            information: 0.0,
            whitened: [[0.0; 3]; NEIGHBOURS],
            mean: [0.0; 3],
            variance: 0.0,
        }
    }

    /// Leaves the model at the shape, scale and noise under which the samples are most likely, and says which
    /// noise. `None` where no number says so.
    fn likeliest(&mut self) -> Option<usize> {
        let (rough, mut scale, mut noise) = self.likeliest_scale(Shape::Matern);
        // How smooth a motion is shows only below the noise.
        if noise <= QUIET {
            let (smooth, of_smooth, noise_of_smooth) = self.likeliest_scale(Shape::Gaussian);
            if smooth > rough {
                (scale, noise) = (of_smooth, noise_of_smooth);
            } else {
                self.shape(Shape::Matern);
            }
        }
        self.likelihood(scale, noise).is_finite().then_some(noise)
    }

    fn shape(&mut self, shape: Shape) {
        self.process.shape = shape;
        self.scale = usize::MAX;
    }

    /// The largest likelihood under one shape, uphill from the middle, and the scale and noise there.
    fn likeliest_scale(&mut self, shape: Shape) -> (f64, usize, usize) {
        self.shape(shape);
        let start = SCALES.len() / 2;
        let mut scale = start;
        let (mut best, mut noise) = self.likeliest_noise(start, NOISES.len() / 2);
        for next in start + 1..SCALES.len() {
            let (likelihood, under) = self.likeliest_noise(next, noise);
            if likelihood <= best {
                break;
            }
            (best, scale, noise) = (likelihood, next, under);
        }
        if scale == start {
            for next in (0..start).rev() {
                let (likelihood, under) = self.likeliest_noise(next, noise);
                if likelihood <= best {
                    break;
                }
                (best, scale, noise) = (likelihood, next, under);
            }
        }
        (best, scale, noise)
    }

    /// The largest likelihood under one scale, uphill from a noise, and the noise there.
    fn likeliest_noise(&mut self, scale: usize, from: usize) -> (f64, usize) {
        let mut best = (self.likelihood(scale, from), from);
        for noise in from + 1..NOISES.len() {
            let likelihood = self.likelihood(scale, noise);
            if likelihood <= best.0 {
                break;
            }
            best = (likelihood, noise);
        }
        if best.1 == from {
            for noise in (0..from).rev() {
                let likelihood = self.likelihood(scale, noise);
                if likelihood <= best.0 {
                    break;
                }
                best = (likelihood, noise);
            }
        }
        best
    }

    /// Logarithm of how likely the samples are, but for a constant; leaves the model at this scale and noise.
    fn likelihood(&mut self, scale: usize, noise: usize) -> f64 {
        let n = self.around.len();
        if scale != self.scale {
            self.scale = scale;
            self.process.scale = SCALES[scale];
            for (i, a) in self.around.iter().enumerate() {
                for (j, b) in self.around[..=i].iter().enumerate() {
                    self.covariance[i][j] = self.process.between_means(a, b);
                }
            }
        }
        let mut determinant = 1.0;
        for i in 0..n {
            for j in 0..=i {
                let mut sum = self.covariance[i][j];
                if i == j {
                    sum += NOISES[noise];
                }
                for k in 0..j {
                    sum -= self.factor[i][k] * self.factor[j][k];
                }
                self.factor[i][j] = if i == j {
                    sum.sqrt()
                } else {
                    sum / self.factor[j][j]
                };
            }
            // At most twelve factors, none below 3e-7 by much.
            determinant *= self.factor[i][i];
            if determinant.is_nan() || determinant <= 0.0 {
                return f64::NEG_INFINITY;
            }
        }
        let mut ones = [1.0; NEIGHBOURS];
        self.solve(&mut ones);
        let mut whitened = self.rates;
        self.solve_all(&mut whitened);
        self.information = ones[..n].iter().map(|u| u * u).sum();
        let mut squares = 0.0;
        for axis in 0..3 {
            let product: f64 = (0..n).map(|i| ones[i] * whitened[i][axis]).sum();
            self.mean[axis] = product / self.information;
            for i in 0..n {
                whitened[i][axis] -= self.mean[axis] * ones[i];
                squares += whitened[i][axis] * whitened[i][axis];
            }
        }
        (self.ones, self.whitened) = (ones, whitened);
        let freedom = (n - 1) as f64;
        self.variance = squares / (3.0 * freedom);
        // Samples that are all equal are as likely under any scale.
        let spread = self.variance.max(f64::MIN_POSITIVE);
        -0.5 * (freedom * spread.ln() + 2.0 * determinant.ln() + self.information.ln())
    }

    /// The rates at the nodes in a gap from -half to half, less the reference, and the variance of their mean.
    fn between(&self, half: f64, quadrature: &Quadrature) -> ([Triple<1>; MOMENTS], f64) {
        let n = self.around.len();
        // L^-T L^-1 (rates - mean).
        let mut weighted = self.whitened;
        for i in (0..n).rev() {
            for axis in 0..3 {
                let sum: f64 = (i + 1..n)
                    .map(|k| self.factor[k][i] * weighted[k][axis])
                    .sum();
                weighted[i][axis] = (weighted[i][axis] - sum) / self.factor[i][i];
            }
        }
        let nodes = quadrature.nodes();
        let weights = quadrature.mean_weights();
        let mut values = [Triple::ZERO; MOMENTS];
        let mut of_mean = [0.0; NEIGHBOURS];
        for (value, (g, weight)) in values.iter_mut().zip(nodes.iter().zip(weights)) {
            let mut rate = self.mean;
            for (i, sample) in self.around.iter().enumerate() {
                let covariance = self.process.with_instant(sample, half * g);
                of_mean[i] += weight * covariance;
                for axis in 0..3 {
                    rate[axis] += covariance * weighted[i][axis];
                }
            }
            *value = Triple::new(rate[0], rate[1], rate[2]);
        }
        self.solve(&mut of_mean);
        let explained: f64 = of_mean[..n].iter().map(|v| v * v).sum();
        let product: f64 = (0..n).map(|i| self.ones[i] * of_mean[i]).sum();
        let mean_unknown = (1.0 - product) * (1.0 - product) / self.information;
        let own = self.process.variance_of_mean(half, quadrature);
        let unknown = (own - explained).max(0.0) + mean_unknown;
        (values, self.variance * unknown)
    }

    /// L^-1 times a column.
    fn solve(&self, column: &mut [f64; NEIGHBOURS]) {
        for i in 0..self.around.len() {
            let sum: f64 = (0..i).map(|k| self.factor[i][k] * column[k]).sum();
            column[i] = (column[i] - sum) / self.factor[i][i];
        }
    }

    /// L^-1 times three columns.
    fn solve_all(&self, columns: &mut [[f64; 3]; NEIGHBOURS]) {
        for i in 0..self.around.len() {
            let mut column = columns[i];
            for k in 0..i {
                for axis in 0..3 {
                    column[axis] -= self.factor[i][k] * columns[k][axis];
                }
            }
            columns[i] = column.map(|v| v / self.factor[i][i]);
        }
    }
}

/// Shape of the motion's covariance over the distance in time.
#[derive(Clone, Copy, Debug)]
enum Shape {
    /// Matérn's of order 7/2: three times differentiable, as shaken and carried sensors are.
    Matern,
    /// Smoothest shape: limited in band.
    Gaussian,
}

/// A motion of variance 1.
#[derive(Clone, Copy, Debug)]
struct Process {
    shape: Shape,
    /// Scale in ordinary steps.
    scale: f64,
}

impl Process {
    /// Covariance at a distance in time.
    fn covariance(&self, distance: f64) -> f64 {
        match self.shape {
            Shape::Matern => {
                let a = 7f64.sqrt() * distance.abs() / self.scale;
                (1.0 + a * (1.0 + a * (0.4 + a / 15.0))) * (-a).exp()
            }
            Shape::Gaussian => (-0.5 * (distance / self.scale).powi(2)).exp(),
        }
    }

    fn between_means(&self, a: &Observation, b: &Observation) -> f64 {
        let apart = a.at - b.at;
        if a.spread + b.spread == 0.0 {
            return self.covariance(apart);
        }
        OF_MEAN
            .iter()
            .map(|(place, weight)| weight * self.with_instant(a, b.at + place * b.spread))
            .sum()
    }

    fn with_instant(&self, a: &Observation, t: f64) -> f64 {
        let apart = a.at - t;
        if a.spread == 0.0 {
            return self.covariance(apart);
        }
        let at = |(place, weight): &(f64, f64)| weight * self.covariance(apart + place * a.spread);
        OF_MEAN.iter().map(at).sum()
    }

    /// Variance of the mean from -half to half.
    fn variance_of_mean(&self, half: f64, quadrature: &Quadrature) -> f64 {
        let nodes = quadrature.nodes();
        let weights = quadrature.mean_weights();
        let mut of_nodes = 0.0;
        for (a, wa) in nodes.iter().zip(weights) {
            for (b, wb) in nodes.iter().zip(weights) {
                of_nodes += wa * wb * self.covariance(half * (a - b));
            }
        }
        // Where the motion changes between two nodes they see it too rarely: by distance instead, over what
        // distance there is covariance.
        let reach = (2.0 * half).min(8.0 * self.scale);
        let mut by_distance = 0.0;
        for (g, weight) in nodes.iter().zip(weights) {
            let apart = 0.5 * reach * (1.0 + g);
            by_distance += weight * (1.0 - apart / (2.0 * half)) * self.covariance(apart);
        }
        of_nodes.min(by_distance * reach / half)
    }
}
