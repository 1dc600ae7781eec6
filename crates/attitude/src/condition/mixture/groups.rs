//! Sixteen vectors in a row -> two groups of them that are tight and far apart. Pure.

use nalgebra::Vector3;

/// Samples of a window.
pub(super) const WINDOW: usize = 16;
/// Distance of two groups, in times of the scatter within them.
const TIGHT: f64 = 5.0;
/// Fewest samples of a group, and fewest changes from one to the other.
const FEWEST: u32 = 4;
const CHANGES: u32 = 4;
/// Passes of the search for groups.
const PASSES: usize = 4;
/// Every other sample.
const EVERY_OTHER: u16 = 0xaaaa;
/// Difference of the steps from one group to the other and back, by their mean, that stamps show, and in sigmas.
const STEPS_APART: f64 = 0.2;
const SIGMAS: f64 = 4.0;

/// Two groups of vectors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Groups {
    centres: [Vector3<f64>; 2],
    /// Members of the second group, the first sample in the lowest bit.
    second: u16,
}

impl Groups {
    /// The groups that are in these, if there are two.
    pub(super) fn of(values: &[Vector3<f64>; WINDOW]) -> Option<Groups> {
        let in_turn = Groups::moving(values);
        in_turn
            .or_else(|| Groups::resting(values))
            .or_else(|| Groups::in_halves(values))
    }

    /// Every other sample of each half: of a motion that no line follows for longer.
    fn in_halves(values: &[Vector3<f64>; WINDOW]) -> Option<Groups> {
        let (first, last) = values.split_at(WINDOW / 2);
        let [first, last] = [Groups::moving(first)?, Groups::moving(last)?];
        let ([a, b], [c, d]) = (first.centres, last.centres);
        Some(Groups {
            centres: [(a + c) * 0.5, (b + d) * 0.5],
            second: EVERY_OTHER,
        })
    }

    /// Distance of their centres.
    pub(super) fn apart(&self) -> f64 {
        let [a, b] = &self.centres;
        (a - b).norm()
    }

    /// Angle between their centres, rad.
    pub(super) fn angle(&self) -> f64 {
        let [a, b] = &self.centres;
        a.angle(b)
    }

    /// Length of each centre.
    pub(super) fn lengths(&self) -> [f64; 2] {
        self.centres.map(|centre| centre.norm())
    }

    /// Whether the steps of `stamps` from the first group to the second are others than those back.
    pub(super) fn alternate_by(&self, stamps: &[i64; WINDOW]) -> bool {
        let mut steps = [(0.0, 0.0, 0.0); 2];
        for (n, pair) in stamps.windows(2).enumerate() {
            let [from, to] = [self.is_second(n), self.is_second(n + 1)];
            if let ([before, after], true, Some(sums)) =
                (pair, from != to, steps.get_mut(usize::from(to)))
            {
                let step = after.saturating_sub(*before) as f64;
                *sums = (sums.0 + 1.0, sums.1 + step, sums.2 + step * step);
            }
        }
        let [(n, there, there_squared), (m, back, back_squared)] = steps;
        if n < 3.0 || m < 3.0 {
            return false;
        }
        let (there, back) = (there / n, back / m);
        let variance = (there_squared / n - there * there).max(0.0) / n
            + (back_squared / m - back * back).max(0.0) / m;
        let apart = (there - back).abs();
        apart > STEPS_APART * 0.5 * (there.abs() + back.abs()) && apart > SIGMAS * variance.sqrt()
    }

    fn is_second(&self, n: usize) -> bool {
        self.second >> n & 1 == 1
    }

    /// Every other of an even number of samples, each group moving along a line of its own.
    fn moving(values: &[Vector3<f64>]) -> Option<Groups> {
        let second = EVERY_OTHER;
        let middle = (values.len() as f64 - 1.0) * 0.5;
        let zero = Vector3::<f64>::zeros();
        let mut sums = [(0.0, 0.0, 0.0, zero, zero); 2];
        for (n, value) in values.iter().enumerate() {
            let t = n as f64 - middle;
            if let Some(sum) = sums.get_mut(usize::from(second >> n & 1)) {
                *sum = (
                    sum.0 + 1.0,
                    sum.1 + t,
                    sum.2 + t * t,
                    sum.3 + value,
                    sum.4 + value * t,
                );
            }
        }
        // Both lines at the middle of the window.
        let lines = sums.map(|(n, t, tt, sum, moment)| {
            let determinant = n * tt - t * t;
            let centre = (sum * tt - moment * t) / determinant;
            (centre, (moment * n - sum * t) / determinant)
        });
        let scatter: f64 = values
            .iter()
            .enumerate()
            .map(|(n, value)| {
                let [first, other] = lines;
                let (centre, slope) = if second >> n & 1 == 1 { other } else { first };
                (value - centre - slope * (n as f64 - middle)).norm_squared()
            })
            .sum();
        Groups {
            centres: lines.map(|(centre, _)| centre),
            second,
        }
        .if_tight(scatter / (values.len() as f64 - 4.0))
    }

    /// Groups by value, in any order.
    fn resting(values: &[Vector3<f64>; WINDOW]) -> Option<Groups> {
        let farthest = |from: &Vector3<f64>| {
            let distance = |v: &Vector3<f64>| (v - from).norm_squared();
            values
                .iter()
                .max_by(|a, b| distance(a).total_cmp(&distance(b)))
                .copied()
                .unwrap_or_default()
        };
        let one = farthest(&values[0]);
        let mut groups = Groups {
            centres: [one, farthest(&one)],
            second: 0,
        };
        for pass in 0..PASSES {
            let before = groups.second;
            groups = groups.regrouped(values)?;
            if pass > 0 && groups.second == before {
                // The same groups have the same centres again.
                break;
            }
        }
        let members = groups.second.count_ones();
        let changes = (groups.second ^ groups.second >> 1) & 0x7fff;
        let is_mixed =
            (FEWEST..=WINDOW as u32 - FEWEST).contains(&members) && changes.count_ones() >= CHANGES;
        let tight = || groups.if_tight(groups.scatter(values) / (WINDOW as f64 - 2.0));
        is_mixed.then(tight).flatten()
    }

    fn regrouped(&self, values: &[Vector3<f64>; WINDOW]) -> Option<Groups> {
        let [a, b] = &self.centres;
        let mut sums = [(0.0, Vector3::zeros()); 2];
        let mut second = 0_u16;
        for (n, value) in values.iter().enumerate() {
            let is_second = (value - b).norm_squared() < (value - a).norm_squared();
            second |= u16::from(is_second) << n;
            if let Some((count, sum)) = sums.get_mut(usize::from(is_second)) {
                (*count, *sum) = (*count + 1.0, *sum + value);
            }
        }
        let [(n, first), (m, other)] = sums;
        let centres = [first / n, other / m];
        (n > 0.0 && m > 0.0).then_some(Groups { centres, second })
    }

    /// Sum of the squares of the members' distances from their centres.
    fn scatter(&self, values: &[Vector3<f64>; WINDOW]) -> f64 {
        let [a, b] = &self.centres;
        let centre = |n: usize| if self.is_second(n) { b } else { a };
        let squares = values.iter().enumerate();
        squares
            .map(|(n, value)| (value - centre(n)).norm_squared())
            .sum()
    }

    fn if_tight(self, variance: f64) -> Option<Groups> {
        (self.apart() > TIGHT * variance.sqrt()).then_some(self)
    }
}
