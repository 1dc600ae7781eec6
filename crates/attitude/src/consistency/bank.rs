//! Segments -> evidence for each of a bank of maps; what may be said by it is the verdict's. Pure.
//!
//! A stage of its own because all maps are judged by the same segments, each with the bias that suits it best so far.

mod verdict;

#[cfg(test)]
pub(super) use self::verdict::WANDERS;
pub(super) use self::verdict::{Answer, LEAST_IDENTITY_LESS, LEAST_SEGMENTS, LEAST_SHARE, Verdict};
use super::euler::UPS;
use super::segment::{Scatter, Segment};
use crate::record::Nanos;
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;
use std::sync::LazyLock;

/// Signed axis maps in the bank: all there are, the identity first.
pub(super) const MAPS: usize = 48;
/// Factors are powers of this, of these exponents without 0.
const RATIO: f64 = 1.25;
const EXPONENTS: std::ops::RangeInclusive<i32> = -41..=10;
/// Factor that stands for no rotation at all: of the counts of a range of 250 deg/s it is still none.
const NOTHING: f64 = 1e-6;
/// Counts per deg/s, and ranges in deg/s, of common sensors: InvenSense and Bosch, then ST by its mdps per count.
pub const CHIPS: [(f64, u32); 8] = [
    (16.4, 2000),
    (32.8, 1000),
    (65.5, 500),
    (131.0, 250),
    (1000.0 / 70.0, 2000),
    (1000.0 / 35.0, 1000),
    (1000.0 / 17.5, 500),
    (1000.0 / 8.75, 250),
];
/// Factors that units and ranges make, beside the counts of chips: a hand turns ten rad in a segment, of which the 12 %
/// between two powers leave nothing that stands still.
const UNITS: [f64; 5] = [DEGREE, 1.0 / DEGREE, 1e-3, 0.5, 2.0];
pub(super) const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Sigma of a factor that is taken for a unit's, as a share: no factor near it is told apart from it.
pub(super) const OF_UNIT: f64 = 0.04;
/// Hypotheses in the bank.
const HYPOTHESES: usize = MAPS + 51 + UNITS.len() + CHIPS.len();
/// Least mean force of what stands still, g: rates of any other size turn gravity until nothing of it is left, and
/// nothing does not wander.
pub(super) const LEAST_GRAVITY: f64 = 0.5;
/// Segments that count: what came before is forgotten.
const MEMORY: usize = 64;
/// Scatter of gravity that is none, g^2.
pub(super) const FLOOR: f64 = 4e-4;
/// Most that one segment says.
const CLIP: f64 = 3.0;
/// Evidence below which a hypothesis is judged by every fourth segment alone: eight have spoken against it. Of a sound
/// sensor that is nearly all of them.
const HOPELESS: f64 = -8.0 * CLIP;
const SELDOM: usize = 4;
/// Scatter as recorded, g^2, of a segment by which all are judged: axes may be others from here on.
const UNUSUAL: f64 = 0.01;
/// Evidence of a segment that tells something.
pub(super) const TELLING: f64 = 0.3;

/// Turn, rad, of a segment in which the gyro turned by next to nothing.
const UNTURNED: f64 = 0.1;
/// Rate as recorded, rad/s, that is beyond the range of nearly every gyro of three axes (2000 deg/s are 35 rad/s, 4000
/// are 70): of a swing to and fro no rotation at all makes gravity stand still as well as the right unit does, and rates
/// like these tell the two apart.
const BEYOND: f64 = 40.0;
/// Place of degrees in the bank, behind the powers.
const DEGREES: usize = HYPOTHESES - UNITS.len() - CHIPS.len();

/// A map from recorded to true rates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hypothesis {
    pub(super) map: Matrix3<f64>,
    /// Factor, where it is one.
    pub(super) factor: Option<f64>,
    /// Distance from what was recorded: of those that explain the same, the nearest is named.
    cost: f64,
}

/// The bank: maps, then factors, of which the first stands for no rotation at all.
pub(super) static BANK: LazyLock<Vec<Hypothesis>> = LazyLock::new(bank);

/// Factors of units, ranges and chips.
pub(super) fn units() -> impl Iterator<Item = f64> {
    let chips = CHIPS.map(|(counts, _)| DEGREE / counts);
    UNITS.into_iter().chain(chips)
}

fn bank() -> Vec<Hypothesis> {
    let signs = [1.0, -1.0];
    let mut maps = Vec::with_capacity(HYPOTHESES);
    for order in [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ] {
        for (a, b, c) in signs
            .into_iter()
            .flat_map(|a| signs.map(|b| (a, b)))
            .flat_map(|(a, b)| signs.map(|c| (a, b, c)))
        {
            let mut map = Matrix3::zeros();
            for (row, (column, sign)) in order.into_iter().zip([a, b, c]).enumerate() {
                map[(row, column)] = sign;
            }
            let changed: f64 = (map - Matrix3::identity())
                .iter()
                .map(|e: &f64| e.abs())
                .sum();
            maps.push(Hypothesis {
                map,
                factor: None,
                cost: if changed == 0.0 { 0.0 } else { 1.0 + changed },
            });
        }
    }
    maps.sort_by(|some, other| some.cost.total_cmp(&other.cost));
    let powers = EXPONENTS
        .filter(|k| *k != 0)
        .map(|k| match k == *EXPONENTS.start() {
            true => NOTHING,
            false => RATIO.powi(k),
        });
    maps.extend(powers.chain(units()).map(|factor| Hypothesis {
        map: Matrix3::from_diagonal_element(factor),
        factor: Some(factor),
        cost: 1.5 + 0.5 * factor.ln().abs(),
    }));
    maps
}

/// Scatter of gravity in a segment, g^2.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// Scatter under each hypothesis, with what is missing of gravity.
    of: Vec<f64>,
    /// Scatter as recorded, without that: what spins about itself has a force that is mostly no gravity.
    wanders: f64,
    /// Whether it holds rates that hardly a gyro has.
    is_beyond: bool,
    /// Whether the gyro turned by next to nothing.
    is_unturned: bool,
    /// Scatter of rates that are derivatives of roll, pitch and yaw.
    of_euler: [f64; UPS.len()],
    /// Scatter of the force in the body, g.
    force_scatter: f64,
    /// Beginning and end of the segment.
    span: (Nanos, Nanos),
}

impl Row {
    /// Scatter as recorded, g.
    pub(super) fn as_recorded(&self) -> f64 {
        self.of.first().map_or(0.0, |s| s.sqrt())
    }

    /// Evidence for a hypothesis against the identity.
    pub(super) fn evidence(&self, h: usize) -> f64 {
        let of = |h: usize| self.of.get(h).copied().unwrap_or(f64::NAN) + FLOOR;
        evidence(of(0), of(h))
    }

    /// Evidence for derivatives of roll, pitch and yaw against the identity.
    fn evidence_of_euler(&self, up: usize) -> f64 {
        let identity = self.of.first().copied().unwrap_or(f64::NAN);
        let found = self.of_euler.get(up).copied().unwrap_or(f64::NAN);
        evidence(identity + FLOOR, found + FLOOR)
    }
}

/// Bias and scatter of some hypotheses, segment after segment.
#[derive(Clone, Debug)]
pub(super) struct Residuals {
    normal: Vec<Matrix3<f64>>,
    slope: Vec<Vector3<f64>>,
    count: usize,
    /// Scatter of the last segment under the first hypothesis.
    pub(super) last: Option<Scatter<3>>,
}

impl Residuals {
    pub(super) fn new(hypotheses: usize) -> Residuals {
        Residuals {
            normal: vec![Matrix3::zeros(); hypotheses],
            slope: vec![Vector3::zeros(); hypotheses],
            count: 0,
            last: None,
        }
    }

    /// Scatter of gravity in a segment under each hypothesis with the bias that suits it best so far; one that is not
    /// `judged` has that of the identity.
    pub(super) fn push(&mut self, segment: &Segment, judged: impl Fn(usize) -> bool) -> Row {
        // What is older than the memory counts less and less: a bias changes.
        let kept = match self.count < MEMORY {
            true => 1.0,
            false => 1.0 - 1.0 / MEMORY as f64,
        };
        self.count += 1;
        let hypotheses = self.normal.len();
        let prior = Matrix3::from_diagonal_element(1e-4 / segment.bias_sigma.powi(2));
        let mut take = |h: usize, found: &Scatter<3>| -> (f64, f64) {
            let (normal, slope) = (&mut self.normal[h], &mut self.slope[h]);
            let weight = 1.0 / (1.0 + found.s / 1e-3);
            *normal = *normal * kept + found.a * weight;
            *slope = *slope * kept + found.b * weight;
            let inverse = (*normal + prior).try_inverse();
            let bias = inverse.map_or_else(Vector3::zeros, |inverse| inverse * *slope);
            let missing = (LEAST_GRAVITY - found.gravity).max(0.0);
            (found.at(&bias).max(1e-8), missing * missing)
        };
        let first = segment.scatter::<3>(&BANK[0].map, &[], &Vector3::zeros());
        let (wanders, missing) = take(0, &first);
        let as_recorded = wanders + missing;
        self.last = Some(first);
        let mut of = vec![as_recorded; hypotheses];
        let is_usual = as_recorded < UNUSUAL;
        let is_judged = |h: &usize| judged(*h) || !is_usual;
        let all = (1..hypotheses).filter(is_judged);
        let (maps, factors): (Vec<_>, Vec<_>) = all.partition(|h| BANK[*h].factor.is_none());
        let mut put = |h: usize, found: &Scatter<3>| {
            let (s, missing) = take(h, found);
            of[h] = s + missing;
        };
        if !maps.is_empty() {
            let sums = segment.axis_sums();
            maps.iter()
                .for_each(|h| put(*h, &sums.under(&BANK[*h].map)));
        }
        let of_them: Vec<f64> = factors.iter().filter_map(|h| BANK[*h].factor).collect();
        let found = segment.scatters_times(&of_them);
        factors
            .iter()
            .zip(&found)
            .for_each(|(h, found)| put(*h, found));
        Row {
            of,
            wanders,
            is_beyond: segment.fastest() > BEYOND,
            is_unturned: segment.turned() < UNTURNED,
            of_euler: [f64::NAN; UPS.len()],
            force_scatter: segment.force_scatter(),
            span: segment.span,
        }
    }
}

/// Evidence for each hypothesis against the identity.
#[derive(Clone, Debug)]
pub(super) struct Evidence {
    residuals: Residuals,
    of_euler: [Residuals; UPS.len()],
    rows: VecDeque<Row>,
    sums: Vec<f64>,
}

impl Evidence {
    pub(super) fn new() -> Evidence {
        Evidence::of(HYPOTHESES)
    }

    /// Evidence for the first so many hypotheses of the bank.
    pub(super) fn of(hypotheses: usize) -> Evidence {
        Evidence {
            residuals: Residuals::new(hypotheses),
            of_euler: UPS.map(|_| Residuals::new(1)),
            rows: VecDeque::new(),
            sums: vec![0.0; hypotheses],
        }
    }

    /// Takes a segment.
    pub(super) fn push(&mut self, segment: &Segment) {
        let (sums, is_whole) = (&self.sums, self.residuals.count.is_multiple_of(SELDOM));
        let judged = |h: usize| is_whole || sums[h] > HOPELESS;
        let mut row = self.residuals.push(segment, judged);
        let euler = self.of_euler.iter_mut().zip(UPS).zip(&mut row.of_euler);
        for ((residuals, up), found) in euler {
            *found = residuals
                .push(&segment.of_euler_rates(up), |_| true)
                .as_recorded()
                .powi(2);
        }
        for (h, sum) in self.sums.iter_mut().enumerate() {
            *sum += row.evidence(h);
        }
        self.rows.push_back(row);
        if self.rows.len() > MEMORY
            && let Some(oldest) = self.rows.pop_front()
        {
            for (h, sum) in self.sums.iter_mut().enumerate() {
                *sum -= oldest.evidence(h);
            }
        }
    }

    /// Evidence of the map that has most.
    pub(super) fn most(&self) -> f64 {
        let maps = self.sums.iter().take(MAPS).copied();
        maps.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Rows, the oldest first, with beginning and end of their segments.
    pub(super) fn rows(&self) -> impl Iterator<Item = (Nanos, Nanos, &Row)> {
        self.rows.iter().map(|row| (row.span.0, row.span.1, row))
    }
}

/// Evidence of a segment for a map under which gravity scatters by `found` against one under which it does by `other`.
pub(super) fn evidence(other: f64, found: f64) -> f64 {
    (other / found).ln().clamp(-CLIP, CLIP)
}
