//! Normal equations, block tridiagonal with a border -> corrections, covariance. Pure.
//!
//! Nodes are eliminated in order, each by the Cholesky factor of what is left of its block; what the way back needs
//! is kept, half a dozen kilobytes a node. The right side is the last column of every border block.

use super::border::ALL;
use super::factors::STATES;
use nalgebra::Matrix3;

type Square = [[f64; STATES]; STATES];

/// An eliminated node: `L` of its block, and `L^-1` times the block to the next node and to the border.
#[derive(Clone)]
struct Eliminated<const W: usize> {
    factor: [f64; STATES * (STATES + 1) / 2],
    next: Square,
    border: [[f64; W]; STATES],
}

/// The nodes so far, and what they leave.
pub(super) struct Solver<const W: usize> {
    nodes: Vec<Eliminated<W>>,
    /// Upper half; the last column is the right side.
    pub(super) border: Box<[[f64; W]; W]>,
    is_definite: bool,
}

/// Corrections of the nodes and of the border.
pub(super) struct Solution {
    pub(super) nodes: Vec<[f64; STATES]>,
    pub(super) border: Vec<f64>,
}

/// Marginal of two blocks of a node: rotation (3x3, rad^2), and one variance of each axis of its bias.
#[derive(Clone, Copy, Debug)]
pub(super) struct Marginal {
    pub(super) turn: Matrix3<f64>,
    pub(super) bias: [f64; 3],
    /// Covariance that the rotation has more by a class that the sensor may be of instead, rad^2.
    pub(super) by_class: Matrix3<f64>,
}

const fn at(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

impl<const W: usize> Solver<W> {
    /// Makes one for so many nodes; `before` is emptied and its memory taken over.
    pub(super) fn new(nodes: usize, before: Option<Solver<W>>) -> Solver<W> {
        let mut kept = before.map(|solver| solver.nodes).unwrap_or_default();
        kept.clear();
        kept.reserve_exact(nodes);
        Solver {
            nodes: kept,
            border: Box::new([[0.0; W]; W]),
            is_definite: true,
        }
    }

    /// Adds a part of the border's block.
    pub(super) fn add_border(&mut self, part: &[[f64; W]; W]) {
        for (row, part) in self.border.iter_mut().zip(part) {
            for (sum, x) in row.iter_mut().zip(part) {
                *sum += x;
            }
        }
    }

    /// Eliminates the next node: its block, that to the node after it, that to the border. They are left as what the
    /// node takes away from the blocks of the one after it: `own` and `border` of that one are to be added.
    pub(super) fn eliminate(
        &mut self,
        own: &mut Square,
        next: &Square,
        border: &mut [[f64; W]; STATES],
    ) {
        let mut node = Eliminated {
            factor: [0.0; 78],
            next: *next,
            border: *border,
        };
        self.is_definite &= factorise(own, &mut node.factor);
        forward(&node.factor, &mut node.next);
        forward(&node.factor, &mut node.border);
        *own = [[0.0; STATES]; STATES];
        *border = [[0.0; W]; STATES];
        for i in 0..STATES {
            for a in 0..STATES {
                let x = node.next[i][a];
                for b in 0..STATES {
                    own[a][b] -= x * node.next[i][b];
                }
                for b in 0..W {
                    border[a][b] -= x * node.border[i][b];
                }
            }
        }
        for a in 0..W {
            let row = &mut self.border[a];
            for four in node.border.chunks_exact(4) {
                let [x, y, z, w] = [four[0][a], four[1][a], four[2][a], four[3][a]];
                // From an even column on: pairs of numbers stay whole.
                for b in (a & !1)..W {
                    row[b] -= x * four[0][b] + y * four[1][b] + z * four[2][b] + w * four[3][b];
                }
            }
        }
        self.nodes.push(node);
    }

    /// Corrections of all unknowns; `None` where the equations do not determine them.
    pub(super) fn solve(&self) -> Option<Solution> {
        let last = W - 1;
        let factor = self.border_factor()?;
        let mut c: Vec<f64> = (0..last).map(|i| self.border[i][last]).collect();
        solve_in_place(&factor, &mut c);
        let mut nodes = vec![[0.0; STATES]; self.nodes.len()];
        let mut after = [0.0; STATES];
        for (x, node) in nodes.iter_mut().zip(&self.nodes).rev() {
            let mut right: [f64; STATES] = std::array::from_fn(|i| {
                let by_border: f64 = node.border[i][..last]
                    .iter()
                    .zip(&c)
                    .map(|(b, c)| b * c)
                    .sum();
                let by_next: f64 = node.next[i].iter().zip(&after).map(|(u, x)| u * x).sum();
                node.border[i][last] - by_border - by_next
            });
            backward(&node.factor, &mut right);
            *x = right;
            after = right;
        }
        let is_finite =
            c.iter().all(|c| c.is_finite()) && nodes.iter().flatten().all(|x| x.is_finite());
        is_finite.then_some(Solution { nodes, border: c })
    }

    fn border_factor(&self) -> Option<Vec<Vec<f64>>> {
        if !self.is_definite {
            return None;
        }
        let last = W - 1;
        let mut factor = vec![vec![0.0; last]; last];
        for i in 0..last {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                let rest = self.border[j][i] - sum;
                if i == j {
                    if rest.is_nan() || rest <= 0.0 {
                        return None;
                    }
                    factor[i][i] = rest.sqrt();
                } else {
                    factor[i][j] = rest / factor[j][j];
                }
            }
        }
        Some(factor)
    }

    /// Covariance of the border, and of the nodes what is asked of them. `doubt` is what the border's unknowns may be
    /// farther off than was assumed, between two factors of what was assumed (`Priors::doubt`).
    pub(super) fn covariance(
        &self,
        doubt: Option<&[[f64; ALL]]>,
    ) -> Option<(Vec<Vec<f64>>, Vec<Marginal>)> {
        let last = W - 1;
        let factor = self.border_factor()?;
        let constants: Vec<Vec<f64>> = (0..last)
            .map(|i| {
                let mut column = vec![0.0; last];
                column[i] = 1.0;
                solve_in_place(&factor, &mut column);
                column
            })
            .collect();
        let mut marginals = Vec::with_capacity(self.nodes.len());
        // Of the node after: its covariance, and that of it with the border.
        let mut p: Square = [[0.0; STATES]; STATES];
        let mut x = [[0.0; W]; STATES];
        for (place, node) in self.nodes.iter().enumerate().rev() {
            let mut inverse: Square =
                std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
            forward(&node.factor, &mut inverse);
            backward_rows(&node.factor, &mut inverse);
            let mut z = node.border;
            backward_rows(&node.factor, &mut z);
            let mut zc = [[0.0; W]; STATES];
            for i in 0..STATES {
                for (k, row) in constants.iter().enumerate() {
                    for (sum, c) in zc[i][..last].iter_mut().zip(row) {
                        *sum += z[i][k] * c;
                    }
                }
            }
            let mut now = inverse;
            let mut cross = [[0.0; W]; STATES];
            for i in 0..STATES {
                for b in 0..last {
                    cross[i][b] = -zc[i][b];
                }
            }
            let by_border = |a: &[f64; W], b: &[f64; W]| -> f64 {
                a[..last].iter().zip(&b[..last]).map(|(a, b)| a * b).sum()
            };
            for i in 0..STATES {
                for j in 0..STATES {
                    now[i][j] += by_border(&zc[i], &z[j]);
                }
            }
            if place + 1 < self.nodes.len() {
                let mut w = node.next;
                backward_rows(&node.factor, &mut w);
                let mut wp = [[0.0; STATES]; STATES];
                let mut wx = [[0.0; W]; STATES];
                for i in 0..STATES {
                    for k in 0..STATES {
                        for j in 0..STATES {
                            wp[i][j] += w[i][k] * p[k][j];
                        }
                        for b in 0..last {
                            wx[i][b] += w[i][k] * x[k][b];
                        }
                    }
                }
                for i in 0..STATES {
                    for j in 0..STATES {
                        let by_next: f64 = (0..STATES).map(|k| wp[i][k] * w[j][k]).sum();
                        now[i][j] += by_next + by_border(&wx[i], &z[j]) + by_border(&wx[j], &z[i]);
                    }
                    for b in 0..last {
                        cross[i][b] -= wx[i][b];
                    }
                }
            }
            p = now;
            x = cross;
            marginals.push(Marginal {
                turn: Matrix3::from_fn(|i, j| 0.5 * (p[i][j] + p[j][i])),
                bias: [9, 10, 11].map(|i| p[i][i]),
                by_class: doubt.map_or_else(Matrix3::zeros, |doubt| doubted(&x, doubt)),
            });
        }
        marginals.reverse();
        Some((constants, marginals))
    }
}

/// Covariance that a rotation has more, where `cross` is that of a node with the border.
fn doubted<const W: usize>(cross: &[[f64; W]; STATES], doubt: &[[f64; ALL]]) -> Matrix3<f64> {
    let through: [Vec<f64>; 3] = [0, 1, 2].map(|i| {
        let row = &cross[i][..W - 1];
        let by = |b: usize| row.iter().zip(doubt).map(|(x, m)| x * m[b]).sum();
        (0..W - 1).map(by).collect()
    });
    Matrix3::from_fn(|i, j| through[i].iter().zip(&cross[j]).map(|(a, b)| a * b).sum())
}

/// Cholesky's factor by rows; whether there is one.
fn factorise(block: &Square, factor: &mut [f64; 78]) -> bool {
    for i in 0..STATES {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| factor[at(i, k)] * factor[at(j, k)]).sum();
            let rest = block[i][j] - sum;
            factor[at(i, j)] = if i == j {
                if rest.is_nan() || rest <= 0.0 {
                    return false;
                }
                rest.sqrt()
            } else {
                rest / factor[at(j, j)]
            };
        }
    }
    true
}

/// `L^-1` times rows.
fn forward<const N: usize>(factor: &[f64; 78], rows: &mut [[f64; N]; STATES]) {
    for i in 0..STATES {
        let (done, rest) = rows.split_at_mut(i);
        let row = &mut rest[0];
        for (j, known) in done.iter().enumerate() {
            let l = factor[at(i, j)];
            for (x, k) in row.iter_mut().zip(known) {
                *x -= l * k;
            }
        }
        let share = 1.0 / factor[at(i, i)];
        row.iter_mut().for_each(|x| *x *= share);
    }
}

/// `L^-T` times rows.
fn backward_rows<const N: usize>(factor: &[f64; 78], rows: &mut [[f64; N]; STATES]) {
    for i in (0..STATES).rev() {
        let (head, done) = rows.split_at_mut(i + 1);
        let row = &mut head[i];
        for (j, known) in (i + 1..STATES).zip(done.iter()) {
            let l = factor[at(j, i)];
            for (x, k) in row.iter_mut().zip(known) {
                *x -= l * k;
            }
        }
        let share = 1.0 / factor[at(i, i)];
        row.iter_mut().for_each(|x| *x *= share);
    }
}

/// `L^-T` times a column.
fn backward(factor: &[f64; 78], x: &mut [f64; STATES]) {
    for i in (0..STATES).rev() {
        let sum: f64 = (i + 1..STATES).map(|j| factor[at(j, i)] * x[j]).sum();
        x[i] = (x[i] - sum) / factor[at(i, i)];
    }
}

/// Solves by the border's factor, both ways.
fn solve_in_place(factor: &[Vec<f64>], x: &mut [f64]) {
    let n = x.len();
    for i in 0..n {
        let sum: f64 = (0..i).map(|k| factor[i][k] * x[k]).sum();
        x[i] = (x[i] - sum) / factor[i][i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| factor[k][i] * x[k]).sum();
        x[i] = (x[i] - sum) / factor[i][i];
    }
}
