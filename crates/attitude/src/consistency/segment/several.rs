//! Segment under several maps side by side -> its scatter under each. Pure.
//!
//! Apart from the scatter under one map because the bank asks for many factors: the arithmetic of each lane is that
//! of [`Segment::scatter`] without directions and without a bias, in the same order, so that no bit differs.

use super::{SHORT, Scatter, Segment, WINDOWS, half_turn, without_lever_arm};
use crate::lanes::{Lanes, Triple};
use nalgebra::{Matrix3, SMatrix, Vector3};
use std::array::from_fn;

/// Columns of a matrix for each lane.
pub(super) type Columns<const N: usize> = [Triple<N>; 3];

/// A quaternion for each lane.
#[derive(Clone, Copy)]
pub(super) struct Turn<const N: usize> {
    w: Lanes<N>,
    v: Triple<N>,
}

/// Turn of a piece that is made of several, rad.
const FARTHEST: f64 = 0.1;
/// Maps that are judged side by side: as many as a vector register of any machine holds.
const ABREAST: usize = 2;

impl Segment {
    /// Scatter of gravity under each map of the recorded rates; `p` is the bias left, rad/s of the true rate.
    pub(in crate::consistency) fn scatters_under<'a>(
        &self,
        maps: impl Iterator<Item = &'a Matrix3<f64>>,
    ) -> Vec<Scatter<3>> {
        let maps: Vec<_> = maps.copied().collect();
        let each = maps.chunks(ABREAST).flat_map(|some| self.abreast(some));
        each.collect()
    }

    /// Scatter of gravity under each of these times the recorded rates, to some mrad and mg: neighbours are taken for one
    /// piece while they turn by so little.
    pub(in crate::consistency) fn scatters_times(&self, factors: &[f64]) -> Vec<Scatter<3>> {
        let each = factors.chunks(ABREAST).flat_map(|some| {
            let largest = some.iter().copied().fold(0.0, f64::max);
            let maps: Vec<_> = some
                .iter()
                .map(|factor| Matrix3::from_diagonal_element(*factor))
                .collect();
            self.joined(FARTHEST / largest).abreast(&maps)
        });
        each.collect()
    }

    /// Scatter under each of so many maps, or fewer.
    fn abreast(&self, maps: &[Matrix3<f64>]) -> impl Iterator<Item = Scatter<3>> + use<> {
        // The last of too few once more.
        let all: [_; ABREAST] = from_fn(|i| maps[i.min(maps.len() - 1)]);
        self.side_by_side(all).into_iter().take(maps.len())
    }

    fn side_by_side<const N: usize>(&self, maps: [Matrix3<f64>; N]) -> [Scatter<3>; N] {
        let maps: Columns<N> =
            from_fn(|column| Triple::of_lanes(|i| vector(maps[i].column(column).into_owned())));
        let mut attitude = Turn::identity();
        let mut turned_by = [Triple::ZERO; 3];
        let mut force = [Triple::ZERO; WINDOWS];
        let mut lever = [[Triple::ZERO; 3]; WINDOWS];
        let mut slope = [[Triple::ZERO; 3]; WINDOWS];
        for piece in &self.pieces {
            let half = half_turns(times(&maps, &piece.angle));
            attitude = attitude.then(&half);
            let c = attitude.columns();
            let f = times(&c, &piece.force);
            let mut crossed = [Triple::ZERO; 3];
            for ((turned, crossed), c) in turned_by.iter_mut().zip(&mut crossed).zip(&c) {
                let step = *c * piece.secs;
                *crossed = (*turned + step * 0.5).cross(f);
                *turned = *turned + step;
            }
            for k in (0..WINDOWS).filter(|k| piece.weight[*k] != 0.0) {
                let (weight, curvature) = (piece.weight[k], piece.curvature[k]);
                force[k] = force[k] + f * weight;
                for i in 0..3 {
                    lever[k][i] = lever[k][i] + c[i] * curvature;
                    slope[k][i] = slope[k][i] + crossed[i] * weight;
                }
            }
            attitude = attitude.then(&half);
        }
        from_fn(|i| {
            let of = |triple: &Triple<N>| Vector3::from(<[f64; 3]>::from(triple.lane(i)));
            let matrix =
                |columns: &[Triple<N>; 3]| SMatrix::from_columns(&columns.each_ref().map(of));
            without_lever_arm::<3>(
                force.each_ref().map(of),
                lever.each_ref().map(matrix),
                slope.each_ref().map(matrix),
            )
        })
    }
}

fn vector(vector: Vector3<f64>) -> Triple<1> {
    <[f64; 3]>::from(vector).into()
}

/// Matrix of each lane times the one vector.
#[inline(always)]
pub(super) fn times<const N: usize>(columns: &Columns<N>, vector: &Vector3<f64>) -> Triple<N> {
    columns[0] * vector.x + columns[1] * vector.y + columns[2] * vector.z
}

/// Rotation by half of each vector.
#[inline(always)]
pub(super) fn half_turns<const N: usize>(angle: Triple<N>) -> Turn<N> {
    let quarter = angle * 0.25;
    let square = quarter.norm_squared();
    if !square.0.iter().all(|square| *square <= SHORT) {
        return each_half_turn(&angle);
    }
    let (w, by) = series(square);
    Turn {
        w,
        v: quarter.times(by),
    }
}

/// Cosine of an angle, and its sine by it, by the square of the angle, [`SHORT`] at most.
#[inline(always)]
pub(super) fn series<const N: usize>(square: Lanes<N>) -> (Lanes<N>, Lanes<N>) {
    let one = Lanes::splat(1.0);
    let factor = |[a, b, c, d]: [f64; 4]| {
        let inner = one - square / c * (one - square / d);
        one - square / a * (one - square / b * inner)
    };
    (
        factor([2.0, 12.0, 30.0, 56.0]),
        factor([6.0, 20.0, 42.0, 72.0]),
    )
}

/// The same lane by lane, where a series is too short for one of them.
#[cold]
fn each_half_turn<const N: usize>(angle: &Triple<N>) -> Turn<N> {
    let each: [_; N] = from_fn(|i| half_turn(&Vector3::from(<[f64; 3]>::from(angle.lane(i)))));
    Turn {
        w: Lanes(from_fn(|i| each[i].w)),
        v: Triple::of_lanes(|i| Triple::new(each[i].i, each[i].j, each[i].k)),
    }
}

impl<const N: usize> Turn<N> {
    pub(super) fn identity() -> Turn<N> {
        Turn {
            w: Lanes::splat(1.0),
            v: Triple::ZERO,
        }
    }

    /// Hamilton's product, `other` first in the body.
    #[inline(always)]
    pub(super) fn then(&self, other: &Turn<N>) -> Turn<N> {
        let (a, b) = (&self.v, &other.v);
        Turn {
            w: self.w * other.w - a.x * b.x - a.y * b.y - a.z * b.z,
            v: Triple {
                x: self.w * b.x + a.x * other.w + a.y * b.z - a.z * b.y,
                y: self.w * b.y - a.x * b.z + a.y * other.w + a.z * b.x,
                z: self.w * b.z + a.x * b.y - a.y * b.x + a.z * other.w,
            },
        }
    }

    /// Columns of its matrix.
    #[inline(always)]
    pub(super) fn columns(&self) -> Columns<N> {
        let (w, Triple { x, y, z }) = (self.w, self.v);
        let one = Lanes::splat(1.0);
        [
            Triple {
                x: one - (y * y + z * z) * 2.0,
                y: (x * y + w * z) * 2.0,
                z: (x * z - w * y) * 2.0,
            },
            Triple {
                x: (x * y - w * z) * 2.0,
                y: one - (x * x + z * z) * 2.0,
                z: (y * z + w * x) * 2.0,
            },
            Triple {
                x: (x * z + w * y) * 2.0,
                y: (y * z - w * x) * 2.0,
                z: one - (x * x + y * y) * 2.0,
            },
        ]
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::indexing_slicing)]
pub(super) mod tests {
    use super::*;
    use crate::consistency::bank::BANK;
    use crate::consistency::blocks::Block;
    use crate::record::Nanos;

    /// Four seconds of a motion, `rate` rad/s at most.
    pub(in crate::consistency::segment) fn segment(rate: f64) -> Segment {
        let blocks: Vec<Block> = (0..200_i64)
            .map(|n| {
                let phase = n as f64 * 0.07;
                let at = |k: f64| (k * phase).sin();
                Block {
                    start: Nanos(n * 20_000_000),
                    end: Nanos((n + 1) * 20_000_000 + n % 3),
                    angle: Vector3::new(at(1.0), at(1.3), at(0.4)) * (0.02 * rate),
                    force: Vector3::new(at(0.2), at(0.9) - 0.3, 9.5 + at(2.1)),
                }
            })
            .collect();
        Segment::new(&blocks, 9.806_65, None, 0.1)
    }

    #[test]
    fn fewer_pieces_leave_the_scatter_under_a_factor() {
        let factors: Vec<f64> = BANK.iter().filter_map(|h| h.factor).collect();
        for rate in [0.3, 2.0, 9.0] {
            let segment = segment(rate);
            let joined = segment.joined(FARTHEST);
            assert!(joined.pieces.len() < segment.pieces.len(), "{rate}");
            let secs = |segment: &Segment| segment.pieces.iter().map(|p| p.secs).sum::<f64>();
            assert!((secs(&joined) - secs(&segment)).abs() < 1e-9);
            for (found, factor) in segment.scatters_times(&factors).iter().zip(&factors) {
                let map = Matrix3::from_diagonal_element(*factor);
                let all = segment.scatter::<3>(&map, &[], &Vector3::zeros());
                let off = (found.s.sqrt() - all.s.sqrt()).abs();
                assert!(
                    off < 3e-3,
                    "{rate}, {factor}: {off} g of {} g",
                    all.s.sqrt()
                );
            }
        }
        // Whoever turns farther than that in every block keeps all of them.
        let (fast, each) = (segment(40.0), 40.0 * 0.02);
        let joined = fast.joined(0.1 * each).pieces.len();
        assert!(joined > fast.pieces.len() * 3 / 4, "{joined}");
    }

    #[test]
    fn each_of_several_maps_has_the_bits_of_one_alone() {
        // Beyond the series, within it, and on both sides of it in one pair of maps.
        for rate in [0.3, 9.0, 40.0] {
            let segment = segment(rate);
            let maps = || BANK.iter().map(|hypothesis| &hypothesis.map);
            let found = segment.scatters_under(maps());
            assert_eq!(found.len(), BANK.len());
            assert_eq!(segment.scatters_under(maps().take(3)).len(), 3);
            for (found, map) in found.iter().zip(maps()) {
                let alone = segment.scatter::<3>(map, &[], &Vector3::zeros());
                assert_eq!(found.s.to_bits(), alone.s.to_bits(), "{rate} {map}");
                assert_eq!((found.a, found.b), (alone.a, alone.b), "{rate} {map}");
                assert_eq!(found.gravity.to_bits(), alone.gravity.to_bits());
            }
        }
    }
}
