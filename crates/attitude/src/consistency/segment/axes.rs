//! Segment -> its scatter under each signed axis map, by two integrations. Pure.
//!
//! Apart from the scatter under any map because there are 48 of these and they share nearly all: a map is a rotation R times
//! a sign s. If C is the attitude by the rates s w, the one under the map is R C R', and the force there R C R' f. Its
//! outer R turns the world, of which no scatter depends; the inner one puts signs before the products of columns of C and
//! entries of f and exchanges them. So their sums are taken once for each sign.

use super::several::{Columns, Turn, half_turns, times};
use super::{Scatter, Segment, WINDOWS, without_lever_arm};
use crate::lanes::Triple;
use nalgebra::{Matrix3, SMatrix, Vector3};
use std::array::from_fn;

/// Signs of the rates, one in each lane.
const SIGNS: [f64; 2] = [1.0, -1.0];
/// Lanes: one for each sign.
const N: usize = SIGNS.len();

/// Sums over a window by its weights, c the columns of the attitude C.
#[derive(Clone, Copy)]
struct Sums {
    /// `c[j] f[l]`.
    force: [[Triple<N>; 3]; 3],
    /// `c[j]` by the second derivative of the weight.
    lever: Columns<N>,
    /// `(b[m] x c[j]) f[l]`, b the columns of the integral of C.
    slope: [[[Triple<N>; 3]; 3]; 3],
}

const ZERO: Sums = Sums {
    force: [[Triple::ZERO; 3]; 3],
    lever: [Triple::ZERO; 3],
    slope: [[[Triple::ZERO; 3]; 3]; 3],
};

/// Sums by which the scatter of a segment under any signed axis map is told.
pub(in crate::consistency) struct AxisSums([Sums; WINDOWS]);

impl Segment {
    /// Sums by which the scatter under any signed axis map is told.
    pub(in crate::consistency) fn axis_sums(&self) -> AxisSums {
        let signs: Columns<N> = from_fn(|column| {
            Triple::of_lanes(|i| {
                let entry = |row| if row == column { SIGNS[i] } else { 0.0 };
                Triple::new(entry(0), entry(1), entry(2))
            })
        });
        let mut attitude = Turn::identity();
        let mut turned_by = [Triple::ZERO; 3];
        let mut sums = [ZERO; WINDOWS];
        for piece in &self.pieces {
            let half = half_turns(times(&signs, &piece.angle));
            attitude = attitude.then(&half);
            let c = attitude.columns();
            let mut crossed = [[Triple::ZERO; 3]; 3];
            for ((turned, crossed), own) in turned_by.iter_mut().zip(&mut crossed).zip(&c) {
                let step = *own * piece.secs;
                let middle = *turned + step * 0.5;
                *crossed = c.map(|c| middle.cross(c));
                *turned = *turned + step;
            }
            let windows = sums.iter_mut().zip(piece.weight).zip(piece.curvature);
            for ((sums, weight), curvature) in windows.filter(|((_, weight), _)| *weight != 0.0) {
                let force: [f64; 3] = (piece.force * weight).into();
                for (sum, c) in sums.lever.iter_mut().zip(&c) {
                    *sum = *sum + *c * curvature;
                }
                add_products(&mut sums.force, &c, &force);
                for (sums, crossed) in sums.slope.iter_mut().zip(&crossed) {
                    add_products(sums, crossed, &force);
                }
            }
            attitude = attitude.then(&half);
        }
        AxisSums(sums)
    }
}

/// Adds each of `columns` times each of `factors`.
#[inline(always)]
fn add_products(sums: &mut [[Triple<N>; 3]; 3], columns: &Columns<N>, factors: &[f64; 3]) {
    for (sums, column) in sums.iter_mut().zip(columns) {
        for (sum, factor) in sums.iter_mut().zip(factors) {
            *sum = *sum + *column * *factor;
        }
    }
}

impl AxisSums {
    /// Scatter of gravity under a signed axis map of the recorded rates; `p` is the bias left, rad/s of the true rate.
    pub(in crate::consistency) fn under(&self, map: &Matrix3<f64>) -> Scatter<3> {
        let is_mirror = map.determinant() < 0.0;
        let lane = usize::from(is_mirror);
        let rotation = map * SIGNS[lane];
        // Of each row the column that is not zero, and its sign.
        let rows: [(usize, f64); 3] = from_fn(|row| {
            let column = rotation.row(row).iamax_full().1;
            (column, rotation[(row, column)])
        });
        let of = |triple: &Triple<N>| Vector3::from(<[f64; 3]>::from(triple.lane(lane)));
        let turned = |sums: &[[Triple<N>; 3]; 3]| -> Vector3<f64> {
            let entries = rows.iter().enumerate();
            entries.map(|(l, (j, sign))| of(&sums[*j][l]) * *sign).sum()
        };
        without_lever_arm::<3>(
            self.0.each_ref().map(|sums| turned(&sums.force)),
            self.0.each_ref().map(|sums| {
                SMatrix::from_columns(&rows.map(|(j, sign)| of(&sums.lever[j]) * sign))
            }),
            self.0.each_ref().map(|sums| {
                SMatrix::from_columns(&rows.map(|(m, sign)| turned(&sums.slope[m]) * sign))
            }),
        )
    }
}

#[cfg(test)]
mod tests {
    use crate::consistency::bank::{BANK, MAPS};
    use crate::consistency::segment::several::tests::segment;
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn each_axis_map_has_the_scatter_of_its_own_integration() {
        for rate in [0.3, 9.0, 40.0] {
            let segment = segment(rate);
            let sums = segment.axis_sums();
            for hypothesis in BANK.iter().take(MAPS) {
                let map = &hypothesis.map;
                let (found, alone) = (
                    sums.under(map),
                    segment.scatter::<3>(map, &[], &Vector3::zeros()),
                );
                let is_near = |found: f64, alone: f64, size: f64| {
                    assert!(
                        (found - alone).abs() <= 1e-12 * size,
                        "{rate} {map} {found} {alone}"
                    );
                };
                is_near(found.s, alone.s, 1.0);
                is_near(found.gravity, alone.gravity, 1.0);
                is_near((found.b - alone.b).norm(), 0.0, 1.0);
                let size = alone.a.norm();
                is_near((found.a - alone.a).norm(), 0.0, 1.0 + size);
            }
        }
        assert_eq!(BANK[0].map, Matrix3::identity());
    }
}
