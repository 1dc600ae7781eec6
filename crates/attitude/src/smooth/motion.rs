//! Velocities and positions of the nodes -> how far a body like this one strays. Pure.
//!
//! A stage of its own because it stands for a low pass of the acceleration: a hand, a machine, a gait do not
//! accelerate away forever, and how far they go is learned from the log itself.
//!
//! Position about its centre is a stationary process of Matern's covariance with `nu` 3/2, each axis by itself:
//! `s^2 (1 + l t) exp(-l t)`, whose velocity has the variance `(l s)^2` (state and transition: Hartikainen, Sarkka
//! 2010, section 3.1). Nodes that were each held to the centre by themselves would count one excursion many times.
//!
//! The process has no preferred direction, so what it says of a body that leans is stated in axes that turn with the
//! heading: see `rows`.

use super::border;
use super::factors::{HEADING, Node, POSITION, Row, STATES, VELOCITY};
use super::segments::Segment;
use super::settings::MotionModel;
use nalgebra::Vector3;

/// Ratio of the sigma to the root mean square.
const WIDTH: f64 = 3.0;
/// The same of a body that leans and never rests: a wider bound lets its positions wander, which widens the bound, until
/// gravity says nothing of the attitude.
const LEANING_WIDTH: f64 = 1.25;
/// Never less, m/s and m.
const LEAST: [f64; 2] = [0.05, 0.02];
/// Beyond so many sigmas a node counts less (Cauchy's distribution).
const ROBUST: f64 = 3.0;
/// The process is flat to so many times the motion's own rate, velocity over position, 1/s: where the body rests, and
/// where it never does. There what drifts is not told from what moves, and less is taken for known.
const BAND: [f64; 2] = [3.0, 1.5];
/// Slowest process, 1/s.
const SLOWEST: f64 = 0.01;
/// Least of a variance beside that of the whole process.
const ROUNDING: f64 = 1e-12;

/// Sigmas of velocity and position, and what each node's count by.
#[derive(Clone)]
pub(super) struct Bound {
    motion: MotionModel,
    /// m/s, m.
    pub(super) sigma: [f64; 2],
    weights: Vec<[f64; 2]>,
    /// Pace of the process: `l` above, 1/s.
    pace: f64,
    /// Whether no axis of the body stays upright, so that gravity tells the gyro's bias about all of them.
    pub(super) is_leaning: bool,
}

/// Transition of the state of a node, position and velocity, to that of the next: `x' = A x + e`, `e` of variance `Q`.
struct Transition {
    /// `A`.
    by: [[f64; 2]; 2],
    /// Variance of the velocity's part of `e`, and of the position's once that is known.
    variance: [f64; 2],
    /// Part that the position shares with the velocity, s.
    shared: f64,
}

impl Transition {
    fn new([speed, place]: [f64; 2], pace: f64, secs: f64) -> Transition {
        let x = pace * secs;
        let e = (-x).exp();
        let by = [[e * (1.0 + x), e * secs], [-e * pace * x, e * (1.0 - x)]];
        let [p, v] = [place * place, speed * speed];
        let left = |i: usize, j: usize| by[i][0] * by[j][0] * p + by[i][1] * by[j][1] * v;
        let speed_left = (v - left(1, 1)).max(ROUNDING * v);
        let shared = -left(0, 1) / speed_left;
        let place_left = p - left(0, 0) + left(0, 1) * shared;
        Transition {
            by,
            variance: [speed_left, place_left.max(ROUNDING * p)],
            shared,
        }
    }
}

impl Bound {
    pub(super) fn new(motion: MotionModel, nodes: usize) -> Bound {
        Bound {
            motion,
            sigma: [0.5, 1.0],
            weights: vec![[1.0; 2]; nodes],
            pace: BAND[0] * 0.5,
            is_leaning: false,
        }
    }

    /// Spread of velocity and position of the process, m/s and m.
    fn spread(&self) -> [f64; 2] {
        [self.pace * self.sigma[1], self.sigma[1]]
    }

    /// Adds what is known of node `k` by itself to its equations: centre among the constants. Returns the weighted
    /// square.
    pub(super) fn add<const W: usize>(
        &self,
        (k, node): (usize, &Node),
        centre: &Vector3<f64>,
        segments: &[Segment],
        own: &mut [[f64; STATES]; STATES],
        border: &mut [[f64; W]; STATES],
        corner: &mut [[f64; W]; W],
    ) -> f64 {
        let joined = |i: Option<usize>| {
            i.and_then(|i| segments.get(i))
                .filter(|segment| !segment.is_break)
                .map_or(0.0, |segment| segment.secs)
        };
        let before = joined(k.checked_sub(1));
        let (sigma, share) = match self.motion {
            MotionModel::Independent => (self.sigma, 0.5 * (before + joined(Some(k)))),
            // A section's first; the others follow from it.
            MotionModel::Process if before == 0.0 => (self.spread(), 1.0),
            MotionModel::Process => return 0.0,
        };
        let [v, p] = [0, 1].map(|what| self.weights[k][what] * share / (sigma[what] * sigma[what]));
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

    /// The rows of a segment that moves: velocity, and position less what it shares with that, by axis.
    ///
    /// Of a body that leans the residuals count in axes that turn with the heading of node `k`. Their squares are the
    /// same, but a path that turns as a whole changes none of them, as it should: in fixed axes each residual, to first
    /// order, grows by the angle times the one across, and the equations take that for knowledge of the heading.
    pub(super) fn rows<const W: usize>(
        &self,
        (k, segment): (usize, &Segment),
        [a, b]: [&Node; 2],
        centre: &Vector3<f64>,
    ) -> Option<[Row<W>; 6]> {
        if self.motion == MotionModel::Independent || segment.is_break || segment.is_still {
            return None;
        }
        let Transition {
            by,
            variance,
            shared,
        } = Transition::new(self.spread(), self.pace, segment.secs);
        let weight =
            0.25 * (self.weights[k].iter().sum::<f64>() + self.weights[k + 1].iter().sum::<f64>());
        let (p, v) = (a.position - centre, a.velocity);
        let speed = b.velocity - (p * by[1][0] + v * by[1][1]);
        let place = b.position - centre - (p * by[0][0] + v * by[0][1]) - speed * shared;
        let by_heading = |residual: &Vector3<f64>| match self.is_leaning {
            true => residual.cross(&Vector3::z()),
            false => Vector3::zeros(),
        };
        let (speed_turns, place_turns) = (by_heading(&speed), by_heading(&place));
        Some(std::array::from_fn(|at| {
            let i = at % 3;
            let (residual, turns, from, variance, next, second) = if at < 3 {
                (
                    speed[i],
                    speed_turns[i],
                    by[1],
                    variance[0],
                    VELOCITY + i,
                    None,
                )
            } else {
                let from = [by[0][0] - shared * by[1][0], by[0][1] - shared * by[1][1]];
                let second = Some((VELOCITY + i, -shared));
                (
                    place[i],
                    place_turns[i],
                    from,
                    variance[1],
                    POSITION + i,
                    second,
                )
            };
            let mut row = Row::new(residual, weight / variance, Some(next));
            row.second = second;
            row.own[HEADING] = turns;
            row.own[POSITION + i] = -from[0];
            row.own[VELOCITY + i] = -from[1];
            let whole = if at < 3 { 0.0 } else { 1.0 };
            row.border[border::CENTRE + i] = from[0] - whole;
            row.span = border::CENTRE + 3;
            row
        }))
    }

    /// Learns it anew.
    pub(super) fn learn(&mut self, nodes: &[Node], centre: &Vector3<f64>, segments: &[Segment]) {
        let moves = |i: usize| {
            segments
                .get(i)
                .is_some_and(|segment| !segment.is_still && !segment.is_break)
        };
        let moving: Vec<usize> = (0..nodes.len())
            .filter(|k| moves(*k) || k.checked_sub(1).is_some_and(moves))
            .collect();
        let squares = |k: usize| {
            let off = nodes[k].position - centre;
            [nodes[k].velocity.norm_squared(), off.norm_squared()]
        };
        let rests = segments.iter().any(|segment| segment.is_still);
        let width = match self.is_leaning && !rests {
            true => LEANING_WIDTH,
            false => WIDTH,
        };
        if !moving.is_empty() {
            for what in 0..2 {
                let (mut sum, mut weight) = (0.0, 0.0);
                for k in &moving {
                    sum += self.weights[*k][what] * squares(*k)[what];
                    weight += self.weights[*k][what];
                }
                self.sigma[what] = (width * (sum / weight / 3.0).sqrt()).max(LEAST[what]);
            }
            let band = BAND[usize::from(!rests)];
            self.pace = (band * self.sigma[0] / self.sigma[1]).max(SLOWEST);
        }
        for (k, weight) in self.weights.iter_mut().enumerate() {
            let squares = squares(k);
            for what in 0..2 {
                let scale = ROBUST * self.sigma[what];
                weight[what] = 1.0 / (1.0 + squares[what] / (scale * scale));
            }
        }
    }

    /// Twice the logarithm of the sigmas, once for each node that moves: what a wider bound costs.
    pub(super) fn log_norm(&self, segments: &[Segment]) -> f64 {
        let moving = segments
            .iter()
            .filter(|segment| !segment.is_still && !segment.is_break);
        let each = moving.map(|segment| match self.motion {
            MotionModel::Independent => 6.0 * (self.sigma[0].ln() + self.sigma[1].ln()),
            MotionModel::Process => {
                let [v, p] = Transition::new(self.spread(), self.pace, segment.secs).variance;
                3.0 * (v.ln() + p.ln())
            }
        });
        each.sum()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Bound, Transition};
    use crate::smooth::border::NARROW;
    use crate::smooth::factors::{BIAS, HEADING, Node, POSITION, Row, STATES, VELOCITY};
    use crate::smooth::segments::Segment;
    use crate::smooth::settings::MotionModel;
    use nalgebra::Vector3;

    #[test]
    fn a_stationary_process_stays_what_it_is() {
        for (pace, secs) in [(0.01, 0.005), (0.3, 0.5), (2.0, 0.5), (9.0, 2.0)] {
            let place = 0.7_f64;
            let speed = pace * place;
            let Transition {
                by,
                variance,
                shared,
            } = Transition::new([speed, place], pace, secs);
            let start = [place * place, speed * speed];
            let noise = [
                [
                    variance[1] + shared * shared * variance[0],
                    shared * variance[0],
                ],
                [shared * variance[0], variance[0]],
            ];
            for i in 0..2 {
                for j in 0..2 {
                    let after = by[i][0] * by[j][0] * start[0]
                        + by[i][1] * by[j][1] * start[1]
                        + noise[i][j];
                    let wanted = if i == j { start[i] } else { 0.0 };
                    let scale = (start[i] * start[j]).sqrt();
                    assert!(
                        (after - wanted).abs() < 1e-11 * scale,
                        "{pace} {secs} {i} {j}: {after}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_path_that_turns_as_a_whole_says_nothing_of_the_heading() {
        let node = |velocity: [f64; 3], position: [f64; 3]| Node {
            q: [1.0, 0.0, 0.0, 0.0],
            velocity: velocity.into(),
            position: position.into(),
            bias: Vector3::zeros(),
        };
        let nodes = [
            node([0.3, -0.2, 0.1], [0.4, 0.1, -0.2]),
            node([-0.1, 0.5, 0.2], [0.2, 0.6, 0.3]),
        ];
        let centre = Vector3::new(0.1, -0.3, 0.0);
        let segment = Segment::moving();
        for is_leaning in [true, false] {
            let mut bound = Bound::new(MotionModel::Process, 2);
            bound.is_leaning = is_leaning;
            let rows = bound.rows::<NARROW>((0, &segment), [&nodes[0], &nodes[1]], &centre);
            // Change of each row by a radian about the centre.
            let turned = nodes.map(|node| {
                let about = |x: Vector3<f64>| Vector3::z().cross(&x);
                let (v, p) = (about(node.velocity), about(node.position - centre));
                let mut turned = [0.0; STATES];
                turned[HEADING] = 1.0;
                turned[VELOCITY..POSITION].copy_from_slice(v.as_slice());
                turned[POSITION..BIAS].copy_from_slice(p.as_slice());
                turned
            });
            let change = |row: &Row<NARROW>| {
                let own = row.own.iter().zip(&turned[0]).map(|(by, x)| by * x);
                let next = row.next.map_or(0.0, |next| turned[1][next]);
                let second = row.second.map_or(0.0, |(at, by)| by * turned[1][at]);
                own.sum::<f64>() + next + second
            };
            let changes = rows.unwrap().map(|row| change(&row).abs());
            let most = changes.into_iter().fold(0.0, f64::max);
            assert_eq!(most < 1e-12, is_leaning, "{changes:?}");
        }
    }

    #[test]
    fn a_short_step_is_integrated_white_noise() {
        // Derivative of the acceleration's noise: 4 l^3 s^2 of velocity a second, a third of its cube of position.
        let (pace, place, secs) = (1.5_f64, 0.4_f64, 1e-3_f64);
        let density = 4.0 * pace.powi(3) * place * place;
        let Transition {
            variance, shared, ..
        } = Transition::new([pace * place, place], pace, secs);
        assert!((variance[0] / (density * secs) - 1.0).abs() < 5e-3);
        assert!((shared / (0.5 * secs) - 1.0).abs() < 5e-3);
        let left = density * secs.powi(3) / 12.0;
        assert!(
            (variance[1] / left - 1.0).abs() < 2e-2,
            "{}",
            variance[1] / left
        );
    }
}
