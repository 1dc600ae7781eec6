//! Blocks of four seconds -> how much gravity is seen to wander under a map of the gyro. Pure.
//!
//! A stage of its own because it is the whole measurement: a map of the gyro is integrated, forces are averaged in the
//! integrated frame, and what their means differ by is no gravity. What a lever arm explains is taken out.
//!
//! The derivation is in `docs/theory/consistency.md`.

mod axes;
mod several;

use super::blocks::Block;
use super::euler::body_angles;
use crate::lanes::Lanes;
use crate::record::Nanos;
use nalgebra::{Matrix3, Quaternion, SMatrix, SVector, Vector3};
use std::f64::consts::PI;

/// Length of a segment, s.
pub(super) const SEGMENT_SECS: f64 = 4.0;
/// Windows in a segment, half overlapped.
const WINDOWS: usize = 3;
/// Half the width of a window, s.
const HALF_WIDTH: f64 = SEGMENT_SECS / (WINDOWS + 1) as f64;
/// Standard gravity, m/s^2.
const GRAVITY: f64 = 9.806_65;
/// Scatter of a window's force, g, and prior of a lever arm, m.
const SIGMA_FORCE: f64 = 0.03;
const SIGMA_LEVER: f64 = 0.5;
/// Least turn, rad, and least scatter of the force, g, of a segment that moves.
const LEAST_TURN: f64 = 0.35;
const LEAST_SCATTER: f64 = 0.05;
/// Longest piece that is made of several, s.
const LONGEST: f64 = 0.081;
/// Turn (rad in whatever unit) and squared scatter that no sensor makes.
const MOST: f64 = 1e6;
/// Rows of the residual.
const ROWS: usize = 3 * WINDOWS;

/// A block with its weights in the windows.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// Integral of the rate, bias of rest taken out, rad.
    angle: Vector3<f64>,
    secs: f64,
    /// Mean force, g.
    force: Vector3<f64>,
    /// Share in the mean of each window.
    weight: [f64; WINDOWS],
    /// Second derivative of the same by gravity, 1/m.
    curvature: [f64; WINDOWS],
}

impl Piece {
    /// Takes what follows it in.
    fn join(&mut self, next: &Piece) {
        let secs = self.secs + next.secs;
        self.force = (self.force * self.secs + next.force * next.secs) / secs;
        self.angle += next.angle;
        self.secs = secs;
        for k in 0..WINDOWS {
            self.weight[k] += next.weight[k];
            self.curvature[k] += next.curvature[k];
        }
    }
}

/// Four seconds of a run.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    pieces: Vec<Piece>,
    /// Beginning and end.
    pub(super) span: (Nanos, Nanos),
    /// Sigma of what is left of the bias, rad/s.
    pub(super) bias_sigma: f64,
}

/// Scatter of gravity as a quadratic of what is not known: `s - 2 b p + p A p`, g^2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter<const P: usize> {
    /// Value at zero.
    pub(super) s: f64,
    /// Half the slope, negative.
    pub(super) b: SVector<f64, P>,
    /// Curvature.
    pub(super) a: SMatrix<f64, P, P>,
    /// Length of the mean force in the integrated frame, g.
    pub(super) gravity: f64,
}

impl<const P: usize> Scatter<P> {
    /// Value at `p`.
    pub(super) fn at(&self, p: &SVector<f64, P>) -> f64 {
        self.s - 2.0 * self.b.dot(p) + p.dot(&(self.a * p))
    }
}

impl Segment {
    /// Segment of `blocks`, whose force is `gravity` long at rest, and of a gyro with this bias.
    pub(super) fn new(
        blocks: &[Block],
        gravity: f64,
        bias: Option<Vector3<f64>>,
        bias_sigma: f64,
    ) -> Segment {
        let origin = blocks
            .first()
            .map_or_else(Default::default, |block| block.start);
        let taken = bias.unwrap_or_else(Vector3::zeros);
        let mut pieces: Vec<Piece> = blocks
            .iter()
            .map(|block| Piece {
                angle: block.angle - taken * block.secs(),
                secs: block.secs(),
                force: block.force / gravity,
                weight: [0.0; WINDOWS],
                curvature: [0.0; WINDOWS],
            })
            .collect();
        let middle =
            |block: &Block| 0.5 * (block.start.secs_since(origin) + block.end.secs_since(origin));
        let middles: Vec<f64> = blocks.iter().map(middle).collect();
        (0..WINDOWS).for_each(|k| weigh(&mut pieces, &middles, k));
        Segment {
            pieces,
            span: (origin, blocks.last().map_or(origin, |block| block.end)),
            bias_sigma,
        }
    }

    /// The same with rates of another unit: `factor` times those that were taken.
    pub(super) fn times(&self, factor: f64) -> Segment {
        let scaled = |piece: &Piece| Piece {
            angle: piece.angle * factor,
            ..*piece
        };
        Segment {
            pieces: self.pieces.iter().map(scaled).collect(),
            ..*self
        }
    }

    /// The same with fewer pieces: neighbours are one while they turn by so little, rad as recorded.
    fn joined(&self, farthest: f64) -> Segment {
        let mut pieces: Vec<Piece> = Vec::with_capacity(self.pieces.len());
        // Way of the last piece, rad: of its parts one by one.
        let mut way = 0.0;
        for piece in &self.pieces {
            let more = piece.angle.norm();
            match pieces.last_mut() {
                Some(last) if last.secs + piece.secs <= LONGEST && way + more <= farthest => {
                    last.join(piece);
                    way += more;
                }
                _ => {
                    pieces.push(*piece);
                    way = more;
                }
            }
        }
        Segment { pieces, ..*self }
    }

    /// The same where what was recorded are the derivatives of roll, pitch and yaw; `up` is the sign of the body's z that is
    /// up where they are zero.
    pub(super) fn of_euler_rates(&self, up: f64) -> Segment {
        let steps: Vec<_> = self
            .pieces
            .iter()
            .map(|piece| (piece.angle, piece.force))
            .collect();
        let angles = body_angles(&steps, up);
        let taken = |(piece, angle): (&Piece, Vector3<f64>)| Piece { angle, ..*piece };
        Segment {
            pieces: self.pieces.iter().zip(angles).map(taken).collect(),
            ..*self
        }
    }

    /// Whether the gyro turned, or the force changed, enough to say something.
    pub(super) fn moves(&self) -> bool {
        let (turned, scatter) = (self.turned(), self.force_scatter());
        let is_believed = turned < MOST && scatter * scatter < MOST;
        is_believed && (turned > LEAST_TURN || scatter > LEAST_SCATTER)
    }

    /// Sum of all it turned, rad in whatever unit.
    pub(super) fn turned(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.angle.norm()).sum()
    }

    /// Largest mean rate of a block, rad/s as recorded.
    pub(super) fn fastest(&self) -> f64 {
        let pieces = self.pieces.iter();
        pieces.fold(0.0, |most, piece| most.max(piece.angle.norm() / piece.secs))
    }

    /// Mean force in the body, g.
    pub(super) fn mean_force(&self) -> Vector3<f64> {
        let sum: Vector3<f64> = self.pieces.iter().map(|piece| piece.force).sum();
        sum / self.pieces.len().max(1) as f64
    }

    /// Scatter of the means of the force in the body, g.
    pub(super) fn force_scatter(&self) -> f64 {
        let mean_of = |k: usize| {
            let pieces = self.pieces.iter();
            pieces.fold(Vector3::zeros(), |sum, piece| {
                sum + piece.force * piece.weight[k]
            })
        };
        let means: [Vector3<f64>; WINDOWS] = std::array::from_fn(mean_of);
        let mean = means.iter().sum::<Vector3<f64>>() / WINDOWS as f64;
        let squares: f64 = means.iter().map(|m| (m - mean).norm_squared()).sum();
        (squares / WINDOWS as f64).sqrt()
    }

    /// Scatter of gravity where the true rate is `map` times the recorded one and `bias` (rad/s as recorded); `p` is
    /// the bias left, rad/s of the true rate, and a share of each of `directions`, of which there are P - 3.
    pub(super) fn scatter<const P: usize>(
        &self,
        map: &Matrix3<f64>,
        directions: &[Matrix3<f64>],
        bias: &Vector3<f64>,
    ) -> Scatter<P> {
        let mut attitude = Quaternion::identity();
        // Columns one by one: of matrices of any width the compiler makes loops.
        let mut turned_by = [Vector3::zeros(); P];
        let mut force = [Vector3::zeros(); WINDOWS];
        let mut lever = [Matrix3::zeros(); WINDOWS];
        let mut slope = [[Vector3::zeros(); P]; WINDOWS];
        for piece in &self.pieces {
            let angle = piece.angle + bias * piece.secs;
            let half = half_turn(&(map * angle));
            attitude *= half;
            let c = matrix(&attitude);
            let f = c * piece.force;
            let mut crossed = [Vector3::zeros(); P];
            for (i, (turned, crossed)) in turned_by.iter_mut().zip(&mut crossed).enumerate() {
                let step = match i.checked_sub(3) {
                    None => c.column(i) * piece.secs,
                    Some(i) => c * (directions[i] * angle),
                };
                *crossed = (*turned + step * 0.5).cross(&f);
                *turned += step;
            }
            for k in (0..WINDOWS).filter(|k| piece.weight[*k] != 0.0) {
                let weight = piece.weight[k];
                force[k] += f * weight;
                lever[k] += c * piece.curvature[k];
                for (slope, crossed) in slope[k].iter_mut().zip(&crossed) {
                    *slope += crossed * weight;
                }
            }
            attitude *= half;
        }
        let slope = slope.map(|columns| SMatrix::from_columns(&columns));
        without_lever_arm(force, lever, slope)
    }
}

/// Puts in the weights of window `k`: Hann, of sum 1, and its second derivative, of sum 0.
fn weigh(pieces: &mut [Piece], middles: &[f64], k: usize) {
    let place = |middle: f64| (middle - (k + 1) as f64 * HALF_WIDTH) / HALF_WIDTH;
    let within = |(_, middle): &(&mut Piece, &f64)| place(**middle).abs() < 1.0;
    let mut sum = 0.0;
    for (piece, middle) in pieces.iter_mut().zip(middles).filter(within) {
        let cos = (PI * place(*middle)).cos();
        piece.weight[k] = 0.5 + 0.5 * cos;
        piece.curvature[k] = -0.5 * (PI / HALF_WIDTH).powi(2) * cos;
        sum += piece.weight[k];
    }
    let (mut curvature, mut n) = (0.0, 0.0);
    for (piece, _) in pieces.iter_mut().zip(middles).filter(within) {
        piece.weight[k] /= sum;
        piece.curvature[k] /= sum * GRAVITY;
        curvature += piece.curvature[k];
        n += 1.0;
    }
    for (piece, _) in pieces.iter_mut().zip(middles).filter(within) {
        piece.curvature[k] -= curvature / n;
    }
}

/// Square of a quarter of a turn up to which a series has all digits: 16 rad/s in a block.
const SHORT: f64 = 0.0064;

/// Rotation by half of the vector.
pub(super) fn half_turn(angle: &Vector3<f64>) -> Quaternion<f64> {
    let quarter = angle / 4.0;
    let square = quarter.norm_squared();
    let (cos, by) = if square <= SHORT {
        let (cos, by) = several::series(Lanes([square]));
        (cos.0[0], by.0[0])
    } else {
        let length = square.sqrt();
        (length.cos(), length.sin() / length)
    };
    Quaternion::from_parts(cos, quarter * by)
}

fn matrix(q: &Quaternion<f64>) -> Matrix3<f64> {
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    Matrix3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
}

/// Means of the windows less their mean, less what a lever arm explains.
fn without_lever_arm<const P: usize>(
    force: [Vector3<f64>; WINDOWS],
    lever: [Matrix3<f64>; WINDOWS],
    slope: [SMatrix<f64, 3, P>; WINDOWS],
) -> Scatter<P> {
    let share = 1.0 / WINDOWS as f64;
    let mean_force = force.iter().sum::<Vector3<f64>>() * share;
    let mean_lever = lever.iter().sum::<Matrix3<f64>>() * share;
    let mean_slope = slope.iter().sum::<SMatrix<f64, 3, P>>() * share;
    let mut r: SVector<f64, ROWS> = SVector::zeros();
    let mut d: SMatrix<f64, ROWS, 3> = SMatrix::zeros();
    let mut j: SMatrix<f64, ROWS, P> = SMatrix::zeros();
    for k in 0..WINDOWS {
        r.fixed_rows_mut::<3>(3 * k)
            .copy_from(&(force[k] - mean_force));
        d.fixed_rows_mut::<3>(3 * k)
            .copy_from(&(lever[k] - mean_lever));
        j.fixed_rows_mut::<3>(3 * k)
            .copy_from(&(mean_slope - slope[k]));
    }
    let prior = (SIGMA_FORCE / SIGMA_LEVER).powi(2);
    let normal = d.transpose() * d + Matrix3::from_diagonal_element(prior);
    let (mut s, mut b, mut a) = (r.norm_squared(), j.transpose() * r, j.transpose() * j);
    // Positive definite by its diagonal; a number that is none leaves all as it is, and is none itself.
    if let Some(inverse) = normal.try_inverse() {
        let (by_force, by_slope) = (d.transpose() * r, d.transpose() * j);
        s -= by_force.dot(&(inverse * by_force));
        b -= by_slope.transpose() * (inverse * by_force);
        a -= by_slope.transpose() * (inverse * by_slope);
    }
    Scatter {
        s: s * share,
        b: b * share,
        a: a * share,
        gravity: mean_force.norm(),
    }
}
