//! A segment and its nodes -> its share of the normal equations. Pure.
//!
//! A row is `residual + J_k dx_k + J_{k+1} dx_{k+1} + J_c dc` with a weight of one over its variance. The residual
//! travels as one more column of the border, with its sign turned: right sides come out of the same sums.

use super::border::{self, Constants};
use super::segments::Segment;
use super::sweep::{GRAVITY, Swept};
use crate::quaternion::Quaternion;
use crate::quaternion::kernel::{conjugate, product};
use nalgebra::Vector3;

/// Unknowns of a node: rotation (earth axes), velocity, position, gyro bias.
pub(super) const STATES: usize = 12;
/// The rotation about the vertical.
pub(super) const HEADING: usize = 2;
pub(super) const VELOCITY: usize = 3;
pub(super) const POSITION: usize = 6;
pub(super) const BIAS: usize = 9;

/// Noise of the gyro, rad/sqrt(s), of its bias, rad/s/sqrt(s), of the accelerometer with all that is no model,
/// m/s^2/sqrt(Hz).
pub(super) const TURN_NOISE: f64 = 0.01_f64.to_radians();
pub(super) const BIAS_NOISE: f64 = 0.0015_f64.to_radians();
pub(super) const FORCE_NOISE: f64 = 0.02;
/// Sigmas at rest: rotation (rad), way (m), velocity (m/s).
const STILL_TURN: f64 = 0.02_f64.to_radians();
const STILL_WAY: f64 = 0.005;
const STILL_VELOCITY: f64 = 0.02;
/// Sigmas of attitude (rad) and of velocity and position (m/s, m) after a break.
const BROKEN_TURN: f64 = 2.0;
const BROKEN_WAY: f64 = 100.0;

/// A node's unknowns.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Node {
    pub q: [f64; 4],
    pub velocity: Vector3<f64>,
    pub position: Vector3<f64>,
    pub bias: Vector3<f64>,
}

/// Contribution of a segment. Of the later node's own block only the diagonal, and position by velocity: a row holds
/// one of its unknowns, by 1, and at most a velocity beside a position.
#[derive(Clone)]
pub(super) struct Blocks<const W: usize> {
    pub own: [[f64; STATES]; STATES],
    pub next: [[f64; STATES]; STATES],
    pub own_border: [[f64; W]; STATES],
    pub next_own: [f64; STATES],
    /// Velocity by position of the same axis.
    pub next_across: [f64; 3],
    pub next_border: [[f64; W]; STATES],
    /// Residual of the field, uT^2; 0 without.
    pub field_residual: f64,
}

impl<const W: usize> Blocks<W> {
    pub(super) fn zero() -> Blocks<W> {
        Blocks {
            own: [[0.0; STATES]; STATES],
            next: [[0.0; STATES]; STATES],
            own_border: [[0.0; W]; STATES],
            next_own: [0.0; STATES],
            next_across: [0.0; 3],
            next_border: [[0.0; W]; STATES],
            field_residual: 0.0,
        }
    }
}

/// One row: what it holds of the earlier node, and of the border in the first `span` columns and the last.
pub(super) struct Row<const W: usize> {
    pub own: [f64; STATES],
    pub border: [f64; W],
    pub span: usize,
    pub weight: f64,
    /// Index of the unknown of the later node that it holds, by 1.
    pub next: Option<usize>,
    /// Index and factor of that axis' velocity, beside a position.
    pub second: Option<(usize, f64)>,
}

impl<const W: usize> Row<W> {
    pub(super) fn new(residual: f64, weight: f64, next: Option<usize>) -> Row<W> {
        let mut border = [0.0; W];
        border[W - 1] = -residual;
        Row {
            own: [0.0; STATES],
            border,
            span: 0,
            weight,
            next,
            second: None,
        }
    }

    fn add(&self, blocks: &mut Blocks<W>, border: &mut [[f64; W]; W]) {
        let (span, last) = (self.span, W - 1);
        let columns = &self.border[..span];
        for a in 0..STATES {
            let x = self.own[a] * self.weight;
            if x == 0.0 {
                continue;
            }
            for b in 0..STATES {
                blocks.own[a][b] += x * self.own[b];
            }
            if let Some(next) = self.next {
                blocks.next[a][next] += x;
            }
            if let Some((second, by)) = self.second {
                blocks.next[a][second] += x * by;
            }
            for (sum, j) in blocks.own_border[a][..span].iter_mut().zip(columns) {
                *sum += x * j;
            }
            blocks.own_border[a][last] += x * self.border[last];
        }
        let held = [self.next.map(|next| (next, 1.0)), self.second];
        for (next, by) in held.into_iter().flatten() {
            let weight = self.weight * by;
            blocks.next_own[next] += weight * by;
            let row = &mut blocks.next_border[next];
            for (sum, j) in row[..span].iter_mut().zip(columns) {
                *sum += weight * j;
            }
            row[last] += weight * self.border[last];
        }
        if let Some((second, by)) = self.second {
            blocks.next_across[second - VELOCITY] += self.weight * by;
        }
        for a in 0..span {
            let x = self.border[a] * self.weight;
            if x == 0.0 {
                continue;
            }
            for (sum, j) in border[a][a..span].iter_mut().zip(&columns[a..]) {
                *sum += x * j;
            }
            border[a][last] += x * self.border[last];
        }
        border[last][last] += self.weight * self.border[last] * self.border[last];
    }
}

/// The rotation vector from `a` to `b`, earth axes.
pub(super) fn difference(b: &[f64; 4], a: &[f64; 4]) -> Vector3<f64> {
    let q: Quaternion<(), ()> = Quaternion::assume_unit(product(b, &conjugate(a)));
    q.rotation_vector().0
}

/// Derivative by a turn `theta` of `theta x f`.
fn by_turn(f: &Vector3<f64>) -> [[f64; 3]; 3] {
    [[0.0, f.z, -f.y], [-f.z, 0.0, f.x], [f.y, -f.x, 0.0]]
}

/// The rows of the integrated sensors: turn, velocity, position, bias.
pub(super) fn inertial<const W: usize>(
    segment: &Segment,
    swept: &Swept,
    [k, next]: [&Node; 2],
) -> [Row<W>; STATES] {
    let secs = swept.secs;
    let (velocity, position) = (Vector3::from(swept.velocity), Vector3::from(swept.position));
    let turn = difference(&next.q, &swept.q);
    let speed = next.velocity - k.velocity - velocity;
    let way = next.position - k.position - k.velocity * secs - position;
    let walk = next.bias - k.bias;
    let up = Vector3::z() * GRAVITY;
    let by_speed = by_turn(&(velocity + up * secs));
    let by_way = by_turn(&(position + up * (0.5 * secs * secs)));
    let force = FORCE_NOISE * FORCE_NOISE;
    let known = if segment.is_break { 0.0 } else { 1.0 };
    let turned = TURN_NOISE * TURN_NOISE * secs + segment.doubt[0];
    let weights = [
        known / (force * secs + segment.doubt[1]),
        known / (force * secs.powi(3) / 3.0 + segment.doubt[1] * secs * secs),
        1.0 / (BIAS_NOISE * BIAS_NOISE * secs),
    ];
    std::array::from_fn(|i| {
        let (kind, r) = (i / 3, i % 3);
        let residual = [turn[r], speed[r], way[r], walk[r]][kind];
        let weight = match kind {
            0 => known / (turned + swept.clipped[r]),
            kind => weights[kind - 1],
        };
        let mut row = Row::new(residual, weight, Some(i));
        row.own[i] = -1.0;
        match kind {
            0 => {
                for j in 0..3 {
                    row.own[BIAS + j] = -swept.by_turn[r][j];
                }
                for (to, from) in row.border.iter_mut().zip(&swept.by_turn[r][3..]) {
                    *to = -from;
                }
                row.span = border::FORCE_BIAS;
            }
            1 | 2 => {
                let (by, columns) = match kind {
                    1 => (&by_speed, &swept.by_velocity[r]),
                    _ => (&by_way, &swept.by_position[r]),
                };
                for j in 0..3 {
                    row.own[j] = -by[r][j];
                    row.own[BIAS + j] = -columns[j];
                }
                for (to, from) in row.border[..border::CENTRE].iter_mut().zip(&columns[3..]) {
                    *to = -from;
                }
                row.span = border::CENTRE;
                if kind == 2 {
                    row.own[VELOCITY + r] = -secs;
                }
            }
            _ => (),
        }
        row
    })
}

/// The rows of a body at rest: no turn, no way, no velocity at both ends.
pub(super) fn standstill<const W: usize>([k, next]: [&Node; 2]) -> [Row<W>; 12] {
    let turn = difference(&next.q, &k.q);
    let way = next.position - k.position;
    let velocity_weight = 0.5 / (STILL_VELOCITY * STILL_VELOCITY);
    std::array::from_fn(|i| {
        let (kind, r) = (i / 3, i % 3);
        match kind {
            0 | 1 => {
                let (residual, sigma, first) = if kind == 0 {
                    (turn[r], STILL_TURN, 0)
                } else {
                    (way[r], STILL_WAY, POSITION)
                };
                let mut row = Row::new(residual, 1.0 / (sigma * sigma), Some(first + r));
                row.own[first + r] = -1.0;
                row
            }
            2 => {
                let mut row = Row::new(k.velocity[r], velocity_weight, None);
                row.own[VELOCITY + r] = 1.0;
                row
            }
            _ => Row::new(next.velocity[r], velocity_weight, Some(VELOCITY + r)),
        }
    })
}

/// The rows of the mean field.
pub(super) fn field<const W: usize>(
    swept: &Swept,
    constants: &Constants,
    is_still: bool,
    weight: f64,
) -> [Row<W>; 3] {
    let means = &swept.field;
    let matrix = border::matrix(constants, border::FIELD);
    let iron = border::vector(constants, border::IRON);
    let time = constants[border::FIELD_TIME];
    let north = [0.0, constants[border::NORTH], constants[border::NORTH + 1]];
    let by_matrix: [[f64; 9]; 3] = std::array::from_fn(|r| {
        std::array::from_fn(|jl| means.rm[r][jl] - means.r[r][jl / 3] * iron[jl % 3])
    });
    let mean = Vector3::from_fn(|r, _| {
        let products = (0..9).map(|jl| matrix[(jl / 3, jl % 3)] * by_matrix[r][jl]);
        products.sum::<f64>() + time * means.by_time[r]
    });
    let by = by_turn(&mean);
    std::array::from_fn(|r| {
        let moving = if is_still {
            0.0
        } else {
            constants[border::MOVING + r]
        };
        let mut row = Row::new(mean[r] - north[r] - moving, weight, None);
        row.own[..3].copy_from_slice(&by[r]);
        for j in 0..3 {
            row.own[BIAS + j] = means.by_turn[r][j];
            row.border[border::IRON + j] =
                -(0..3).map(|i| means.r[r][i] * matrix[(i, j)]).sum::<f64>();
        }
        row.border[..border::FORCE_BIAS].copy_from_slice(&means.by_turn[r][3..]);
        row.border[border::FIELD..border::NORTH].copy_from_slice(&by_matrix[r]);
        if r > 0 {
            row.border[border::NORTH + r - 1] = -1.0;
        }
        row.border[border::FIELD_TIME] = means.by_time[r];
        if !is_still {
            row.border[border::MOVING + r] = -1.0;
        }
        row.span = W - 1;
        row
    })
}

/// All that a segment says of its nodes: into its blocks, and into the border.
pub(super) fn assemble<const W: usize>(
    segment: &Segment,
    swept: &Swept,
    nodes: [&Node; 2],
    constants: &Constants,
    motion: Option<[Row<W>; 6]>,
    field_weight: f64,
    (blocks, border): (&mut Blocks<W>, &mut [[f64; W]; W]),
) {
    *blocks = Blocks::zero();
    for row in motion.into_iter().flatten() {
        row.add(blocks, border);
    }
    for row in inertial(segment, swept, nodes) {
        if row.weight > 0.0 {
            row.add(blocks, border);
        }
    }
    if segment.is_break {
        for i in 0..BIAS {
            let sigma = if i < VELOCITY {
                BROKEN_TURN
            } else {
                BROKEN_WAY
            };
            blocks.next_own[i] += 1.0 / (sigma * sigma);
        }
        return;
    }
    if segment.is_still {
        for row in standstill(nodes) {
            row.add(blocks, border);
        }
    }
    if W == border::WIDE && swept.field.samples > 0.0 {
        for row in field::<W>(swept, constants, segment.is_still, field_weight) {
            blocks.field_residual += row.border[W - 1] * row.border[W - 1];
            row.add(blocks, border);
        }
    }
}
