//! Segments and a map -> the map that makes gravity stand still best, with its sigma. Pure.
//!
//! A stage of its own because a bank has steps of a quarter, and advice needs a percent.

use super::segment::{Scatter, Segment};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Most steps of Gauss and Newton, and the length, in prior sigmas, of one that is the last.
const STEPS: usize = 4;
const SHORT: f64 = 1e-4;
/// Longest step of a parameter.
const LONGEST: f64 = 0.5;
/// Prior sigma of a parameter, and weight of the priors.
const PRIOR: f64 = 0.7;
const PRIOR_WEIGHT: f64 = 0.05;
/// Scatter of gravity beside which a segment counts fully, g^2.
const FLOOR: f64 = 2.5e-4;

/// A refined map.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refined<const P: usize> {
    /// True rates by recorded ones.
    pub(super) map: Matrix3<f64>,
    /// Bias of the recorded rates that is left, rad/s, its sign such that it is added.
    pub(super) bias: Vector3<f64>,
    /// One standard deviation of the bias (rad/s) and of the shares of the directions, by a sandwich of the segments' own scatter.
    pub(super) sigma: SVector<f64, P>,
    /// Median scatter of gravity that is left, g.
    pub(super) left: f64,
}

/// Refines `start` along `directions`, of which there are P - 3, each times `start`. `None` where the segments say
/// nothing.
pub(super) fn refine<'a, const P: usize>(
    segments: impl Iterator<Item = &'a Segment> + Clone,
    start: &Matrix3<f64>,
    directions: &[Matrix3<f64>],
) -> Option<Refined<P>> {
    let directions: Vec<Matrix3<f64>> = directions.iter().map(|b| b * start).collect();
    let sigma = segments.clone().next()?.bias_sigma;
    let prior: SMatrix<f64, P, P> = SMatrix::from_diagonal(&SVector::from_fn(|i, _| {
        PRIOR_WEIGHT / if i < 3 { sigma } else { PRIOR }.powi(2)
    }));
    let (mut map, mut x) = (*start, SVector::<f64, P>::zeros());
    for _ in 0..STEPS {
        let (normal, slope, _) = sums(&scatters(segments.clone(), &map, &directions, &x), &prior);
        let mut step = normal.try_inverse()? * (slope - prior * x);
        let largest = step
            .iter()
            .skip(3)
            .fold(0.0_f64, |most, p| most.max(p.abs()));
        step *= (LONGEST / largest.max(1e-9)).min(1.0);
        x += step;
        for (direction, p) in directions.iter().zip(step.iter().skip(3)) {
            map += direction * *p;
        }
        let squares = step.component_mul(&step).component_mul(&prior.diagonal());
        if squares.max() < PRIOR_WEIGHT * SHORT * SHORT {
            break;
        }
    }
    let all = scatters(segments, &map, &directions, &x);
    let (normal, _, [outer, inner]) = sums(&all, &prior);
    let inverse = normal.try_inverse()?;
    let covariance = inverse * (outer * 2.0 + inner * 0.5) * inverse;
    let mut left: Vec<f64> = all.iter().map(|found| found.s).collect();
    left.sort_by(f64::total_cmp);
    Some(Refined {
        map,
        bias: bias_of(&map, &x),
        sigma: covariance.diagonal().map(f64::sqrt),
        left: left.get(left.len() / 2)?.max(0.0).sqrt(),
    })
}

/// Scatter of each segment about a map with the bias of `x`.
fn scatters<'a, const P: usize>(
    segments: impl Iterator<Item = &'a Segment>,
    map: &Matrix3<f64>,
    directions: &[Matrix3<f64>],
    x: &SVector<f64, P>,
) -> Vec<Scatter<P>> {
    let bias = bias_of(map, x);
    segments
        .map(|segment| segment.scatter(map, directions, &bias))
        .collect()
}

/// Bias of the recorded rates, to be added, from the one of the true rates at the head of `x`.
fn bias_of<const P: usize>(map: &Matrix3<f64>, x: &SVector<f64, P>) -> Vector3<f64> {
    let recorded = map.pseudo_inverse(1e-3 * map.norm());
    recorded.map_or_else(
        |_| Vector3::zeros(),
        |recorded| recorded * Vector3::new(x[0], x[1], x[2]),
    )
}

type Square<const P: usize> = SMatrix<f64, P, P>;

/// Normal matrix, slope, and the two parts of the sandwich: the segments' own, and what a perfect fit would leave.
fn sums<const P: usize>(
    all: &[Scatter<P>],
    prior: &Square<P>,
) -> (Square<P>, SVector<f64, P>, [Square<P>; 2]) {
    let (mut inner, mut outer) = (Square::zeros(), Square::zeros());
    let mut slope = SVector::zeros();
    for found in all {
        let weight = 1.0 / (found.s + FLOOR);
        let own = found.b * weight;
        inner += found.a * weight;
        outer += own * own.transpose();
        slope += own;
    }
    (inner + prior, slope, [outer, inner])
}
