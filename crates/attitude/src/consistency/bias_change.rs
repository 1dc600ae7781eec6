//! Segments in their order -> a bias of the gyro that is another from one moment on. Pure.
//!
//! Apart from the bank because no map is wrong: of a gyro that was switched off and on, heated or knocked, one bias
//! suits what came before and another what came behind, and gravity wanders under either of them and under their mean.

use super::bank::{FLOOR, evidence};
use super::segment::{Scatter, Segment};
use crate::median::median;
use crate::record::Nanos;
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;

/// Segments that are kept, and after how many new ones they are judged.
const MEMORY: usize = 64;
const PACE: usize = 16;
/// Least segments on either side.
const SIDE: usize = 6;
/// Least segments of a side in which gravity rotates in the body by this scatter, g, or least scatter of their mean
/// forces: the lean of a curve looks like a bias, and leaves the force where it is in the body.
const ROTATING: usize = 4;
const ROTATES: f64 = 0.1;
const POSES: f64 = 0.25;
/// Prior sigma of a bias, rad/s, weight of the prior, and scatter beside which a segment counts fully, g^2.
const PRIOR: f64 = 0.1;
const PRIOR_WEIGHT: f64 = 0.05;
const FULL: f64 = 2.5e-4;
/// Evidence of a segment that tells, the least of all (1.7 at most of hands, arms and 18 recordings with one bias), least
/// share of telling segments that agree, and least number of them.
const TELLING: f64 = 0.2;
const LEAST_EVIDENCE: f64 = 6.0;
const LEAST_SHARE: f64 = 0.75;
const LEAST_TELLING: usize = 6;
/// Least change by its sigma (1.9 at most of the same), and in rad/s: a degree per second.
const SIGMAS: f64 = 4.0;
const LEAST_CHANGE: f64 = 0.0175;
/// Largest scatter of gravity under two biases, g, and by that under one.
const LARGEST_FOUND: f64 = 0.04;
const LARGEST_RATIO: f64 = 0.8;

/// Change of the gyro's bias.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BiasChange {
    /// Beginning of the first segment behind it; known to a few seconds.
    pub at: Nanos,
    /// Change, rad/s as recorded.
    pub by: Vector3<f64>,
    /// Largest standard deviation of it about an axis, rad/s.
    pub sigma: f64,
    /// Median scatter of gravity under one bias, g.
    pub recorded: f64,
    /// The same under two.
    pub cured: f64,
    /// Segments that tell.
    pub segments: usize,
}

/// Watch over the bias.
#[derive(Clone, Debug, Default)]
pub(super) struct BiasWatch {
    rows: VecDeque<Row>,
    new: usize,
    found: Option<BiasChange>,
}

/// Segment with its scatter by the bias of the gyro.
#[derive(Clone, Copy, Debug)]
struct Row {
    start: Nanos,
    scatter: Scatter<3>,
    /// Mean force in the body, g.
    force: Vector3<f64>,
    rotates: bool,
}

/// The bias that suits some segments.
struct Fit {
    bias: Vector3<f64>,
    covariance: Matrix3<f64>,
    /// Scatter that is left of each, g^2.
    left: Vec<f64>,
}

impl BiasWatch {
    /// Takes a segment that moves, with the bias that was taken from its rates, and its scatter about that.
    pub(super) fn push(&mut self, segment: &Segment, taken: Vector3<f64>, mut scatter: Scatter<3>) {
        // Biases taken differ from segment to segment: all are counted from none.
        scatter.s = scatter.at(&taken);
        scatter.b -= scatter.a * taken;
        self.rows.push_back(Row {
            start: segment.span.0,
            scatter,
            force: segment.mean_force(),
            rotates: segment.force_scatter() >= ROTATES,
        });
        if self.rows.len() > MEMORY {
            self.rows.pop_front();
        }
        self.new += 1;
        if self.new >= PACE {
            self.new = 0;
            self.found = self.found.or_else(|| self.judge());
        }
    }

    /// Change that was seen first.
    pub(super) fn found(&self) -> Option<BiasChange> {
        self.found.or_else(|| self.judge())
    }

    fn judge(&self) -> Option<BiasChange> {
        let rows: Vec<Row> = self.rows.iter().copied().collect();
        let one = fit(&rows)?;
        let (before, behind) = rows.split_at_checked(cut(&rows, &one.left)?)?;
        if ![before, behind].into_iter().all(rotates) {
            return None;
        }
        let (first, second) = (fit(before)?, fit(behind)?);
        // What is fitted is added to the rates.
        let by = first.bias - second.bias;
        let covariance = first.covariance + second.covariance;
        let sigmas = by.dot(&(covariance.try_inverse()? * by)).sqrt();
        let left = first.left.iter().chain(&second.left);
        let told = one.left.iter().zip(left);
        let told: Vec<(f64, f64, f64)> = told
            .map(|(one, two)| (evidence(one + FLOOR, two + FLOOR), *one, *two))
            .collect();
        let evidence: f64 = told.iter().map(|(e, ..)| e).sum();
        let telling: Vec<_> = told.iter().filter(|(e, ..)| e.abs() > TELLING).collect();
        let agree = telling.iter().filter(|(e, ..)| *e > 0.0).count();
        let scatter = |of: fn(&(f64, f64, f64)) -> f64| {
            let mut all: Vec<f64> = telling.iter().map(|told| of(told)).collect();
            median(&mut all).sqrt()
        };
        let (recorded, cured) = (scatter(|(_, one, _)| *one), scatter(|(.., two)| *two));
        let is_clear = evidence >= LEAST_EVIDENCE
            && telling.len() >= LEAST_TELLING
            && agree as f64 >= LEAST_SHARE * telling.len() as f64
            && sigmas >= SIGMAS
            && by.norm() >= LEAST_CHANGE
            && cured <= LARGEST_FOUND
            && cured <= LARGEST_RATIO * recorded;
        is_clear.then_some(BiasChange {
            at: behind.first()?.start,
            by,
            sigma: covariance.diagonal().max().sqrt(),
            recorded,
            cured,
            segments: telling.len(),
        })
    }
}

/// Whether gravity takes several places in the body.
fn rotates(side: &[Row]) -> bool {
    let n = side.len().max(1) as f64;
    let mean = side.iter().map(|row| row.force).sum::<Vector3<f64>>() / n;
    let squares: f64 = side
        .iter()
        .map(|row| (row.force - mean).norm_squared())
        .sum();
    side.iter().filter(|row| row.rotates).count() >= ROTATING || (squares / n).sqrt() >= POSES
}

/// Normal matrix of a bias, and its right side.
type Normal = (Matrix3<f64>, Vector3<f64>);

/// Parts of segments of which so much is left, the less of it the more they weigh.
fn weighted(rows: &[Row], left: &[f64]) -> impl Iterator<Item = Normal> {
    rows.iter().zip(left).map(|(row, left)| {
        let weight = 1.0 / (left + FULL);
        (row.scatter.a * weight, row.scatter.b * weight)
    })
}

fn add((normal, slope): Normal, (other, by): &Normal) -> Normal {
    (normal + other, slope + by)
}

/// The cut by which two biases gain most on one under which `left` is left of each segment.
fn cut(rows: &[Row], left: &[f64]) -> Option<usize> {
    let all: Vec<Normal> = weighted(rows, left).collect();
    let none = (Matrix3::zeros(), Vector3::zeros());
    let (normal, slope) = all.iter().fold(none, add);
    let gain = |normal: Matrix3<f64>, slope: Vector3<f64>| -> Option<f64> {
        Some(slope.dot(&((normal + prior()).try_inverse()? * slope)))
    };
    let (mut before, mut best) = (none, None);
    for (n, row) in all.iter().enumerate() {
        before = add(before, row);
        let count = n + 1;
        if count < SIDE || count + SIDE > rows.len() {
            continue;
        }
        let both = gain(before.0, before.1)? + gain(normal - before.0, slope - before.1)?;
        if best.is_none_or(|(most, _)| both > most) {
            best = Some((both, count));
        }
    }
    best.map(|(_, count)| count)
}

fn prior() -> Matrix3<f64> {
    Matrix3::from_diagonal_element(PRIOR_WEIGHT / (PRIOR * PRIOR))
}

/// The bias of these segments, each weighted by what is left of it, with the covariance of a sandwich.
fn fit(rows: &[Row]) -> Option<Fit> {
    let left = |bias: &Vector3<f64>| -> Vec<f64> {
        rows.iter()
            .map(|row| row.scatter.at(bias).max(0.0))
            .collect()
    };
    let sums = |left: &[f64]| {
        let none = (Matrix3::zeros(), Vector3::zeros());
        weighted(rows, left).fold(none, |sum, part| add(sum, &part))
    };
    let mut bias = Vector3::zeros();
    for _ in 0..2 {
        let (normal, slope) = sums(&left(&bias));
        bias = (normal + prior()).try_inverse()? * slope;
    }
    let left = left(&bias);
    let (inner, _) = sums(&left);
    let outer = rows
        .iter()
        .zip(&left)
        .fold(Matrix3::zeros(), |sum, (row, left)| {
            let own = (row.scatter.b - row.scatter.a * bias) / (left + FULL);
            sum + own * own.transpose()
        });
    let inverse = (inner + prior()).try_inverse()?;
    // Segments overlap by half.
    let covariance = inverse * (outer * 2.0 + inner * 0.5) * inverse;
    let is_sound = covariance
        .iter()
        .chain(&bias)
        .all(|number| number.is_finite());
    is_sound.then_some(Fit {
        bias,
        covariance,
        left,
    })
}
