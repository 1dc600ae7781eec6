//! Velocities and positions of the nodes -> how far a body like this one strays. Pure.
//!
//! A stage of its own because it stands for a low pass of the acceleration: a hand, a machine, a gait do not
//! accelerate away for ever, and how far they go is learned from the log itself.

use super::border;
use super::factors::{Node, POSITION, STATES, VELOCITY};
use super::segments::Segment;
use nalgebra::Vector3;

/// So many times the root mean square is the sigma.
const WIDTH: f64 = 3.0;
/// Never less, m/s and m.
const LEAST: [f64; 2] = [0.05, 0.02];
/// Beyond so many sigmas a node counts less (Cauchy's distribution).
const ROBUST: f64 = 3.0;
/// Nearest to 1 that a correlation is taken for.
const MOST_ALIKE: f64 = 0.98;

/// Sigmas of velocity and position over one second, and what each node's count by.
#[derive(Clone)]
pub(super) struct Bound {
    pub(super) sigma: [f64; 2],
    weights: Vec<[f64; 2]>,
    /// Of positions, before colour widens it, m.
    pub(super) reach: f64,
}

impl Bound {
    pub(super) fn new(nodes: usize) -> Bound {
        Bound {
            sigma: [0.5, 1.0],
            weights: vec![[1.0; 2]; nodes],
            reach: 0.0,
        }
    }

    /// Adds the bound of node `k` to its equations: centre among the constants. Returns the weighted square.
    pub(super) fn add<const W: usize>(
        &self,
        (k, node): (usize, &Node),
        centre: &Vector3<f64>,
        segments: &[Segment],
        own: &mut [[f64; STATES]; STATES],
        border: &mut [[f64; W]; STATES],
        corner: &mut [[f64; W]; W],
    ) -> f64 {
        let secs_of = |i: Option<usize>| {
            i.and_then(|i| segments.get(i))
                .filter(|segment| !segment.is_break)
                .map_or(0.0, |segment| segment.secs)
        };
        let secs = 0.5 * (secs_of(k.checked_sub(1)) + secs_of(Some(k)));
        let [v, p] =
            [0, 1].map(|what| self.weights[k][what] * secs / (self.sigma[what] * self.sigma[what]));
        let last = W - 1;
        let off = node.position - centre;
        for i in 0..3 {
            own[VELOCITY + i][VELOCITY + i] += v;
            border[VELOCITY + i][last] -= v * node.velocity[i];
            own[POSITION + i][POSITION + i] += p;
            border[POSITION + i][last] -= p * off[i];
            let c = border::CENTRE + i;
            border[POSITION + i][c] -= p;
            corner[c][c] += p;
            corner[c][last] += p * off[i];
        }
        v * node.velocity.norm_squared() + p * off.norm_squared()
    }

    /// Learns it anew; velocity and position each wider where neighbours resemble each other, if that is asked for.
    pub(super) fn learn(
        &mut self,
        nodes: &[Node],
        centre: &Vector3<f64>,
        segments: &[Segment],
        is_coloured: [bool; 2],
    ) {
        let moves = |i: usize| {
            segments
                .get(i)
                .is_some_and(|segment| !segment.is_still && !segment.is_break)
        };
        let moving: Vec<usize> = (0..nodes.len())
            .filter(|k| moves(*k) || k.checked_sub(1).is_some_and(moves))
            .collect();
        if !moving.is_empty() {
            for what in 0..2 {
                let off = |k: usize| match what {
                    0 => nodes[k].velocity,
                    _ => nodes[k].position - centre,
                };
                let (mut sum, mut weight) = (0.0, 0.0);
                for k in &moving {
                    sum += self.weights[*k][what] * off(*k).norm_squared();
                    weight += self.weights[*k][what];
                }
                let colour = if is_coloured[what] {
                    colour(&moving, off)
                } else {
                    1.0
                };
                let reach = WIDTH * (sum / weight / 3.0).sqrt();
                if what == 1 {
                    self.reach = reach;
                }
                self.sigma[what] = (colour * reach).max(LEAST[what]);
            }
        }
        for (k, weight) in self.weights.iter_mut().enumerate() {
            let squares = [
                nodes[k].velocity.norm_squared(),
                (nodes[k].position - centre).norm_squared(),
            ];
            for what in 0..2 {
                let scale = ROBUST * self.sigma[what];
                weight[what] = 1.0 / (1.0 + squares[what] / (scale * scale));
            }
        }
    }

    /// Of the sigmas, once for each node that moves: what a wider bound costs.
    pub(super) fn log_norm(&self, segments: &[Segment]) -> f64 {
        let moving = segments
            .iter()
            .filter(|segment| !segment.is_still && !segment.is_break)
            .count();
        6.0 * moving as f64 * (self.sigma[0].ln() + self.sigma[1].ln())
    }
}

/// By how much a mean of values that resemble their neighbours is known worse than one of as many that do not.
fn colour(moving: &[usize], value: impl Fn(usize) -> Vector3<f64>) -> f64 {
    let mean = moving.iter().map(|k| value(*k)).sum::<Vector3<f64>>() / moving.len() as f64;
    let square = moving
        .iter()
        .map(|k| (value(*k) - mean).norm_squared())
        .sum::<f64>()
        / moving.len() as f64;
    let neighbours = || moving.windows(2).filter(|pair| pair[1] == pair[0] + 1);
    let count = neighbours().count();
    if count == 0 {
        return 1.0;
    }
    let product: f64 = neighbours()
        .map(|pair| (value(pair[0]) - mean).dot(&(value(pair[1]) - mean)))
        .sum();
    let alike = (product / count as f64 / square.max(3e-12)).clamp(0.0, MOST_ALIKE);
    ((1.0 + alike) / (1.0 - alike)).sqrt()
}
