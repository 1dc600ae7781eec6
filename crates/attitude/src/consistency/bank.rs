//! Segments -> evidence for each of a bank of maps, and what may be said by it. Pure.
//!
//! A stage of its own because it is a rule of evidence: what is said must hold in nearly all segments, be seen to be
//! better than no rotation at all, and stand by a residual as small as that of healthy sensors.

use super::euler::UPS;
use super::segment::{Scatter, Segment};
use crate::median::median;
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

/// Least evidence, telling segments, and share of them that agree.
const LEAST_EVIDENCE: f64 = 8.0;
pub(super) const LEAST_SEGMENTS: usize = 6;
pub(super) const LEAST_SHARE: f64 = 0.85;
/// Largest scatter of the map that is found, g, and by that of the identity.
const LARGEST_FOUND: f64 = 0.06;
const LARGEST_RATIO: f64 = 0.6;
/// The same of what is moved about hard, whose own accelerations scatter: a map that has a peak stands out by more.
const LARGEST_FOUND_SHAKEN: f64 = 0.15;
const LARGEST_RATIO_SHAKEN: f64 = 0.4;
/// Median scatter as recorded, g, that no body makes which is moved about: twice the most of 14 recordings of BROAD, 7
/// others and simulated hands, drones, cars, boats, runners and circles (0.084). A gyro that reads nothing has 0.18 to 0.5.
pub(super) const WANDERS: f64 = 0.17;
/// Turn, rad, of a segment in which the gyro turned by next to nothing.
const UNTURNED: f64 = 0.1;
/// Least scatter of the identity, g; where physics makes gravity turn less than the body.
const LEAST_IDENTITY: f64 = 0.05;
pub(super) const LEAST_IDENTITY_LESS: f64 = 0.09;
/// Least scatter of the force in the body, g, by which roll and pitch are told from the lean of a curve: 0.35 to 0.59 of
/// hands, arms and what tumbles, 0.06 at most of cars.
const LEAST_TURNS: f64 = 0.2;
/// A factor below this is a unit.
const UNIT_BELOW: f64 = 0.1;
/// Rate as recorded, rad/s, that is beyond the range of nearly every gyro of three axes (2000 deg/s are 35 rad/s, 4000
/// are 70): of a swing to and fro no rotation at all makes gravity stand still as well as the right unit does, and rates
/// like these tell the two apart.
const BEYOND: f64 = 40.0;
/// Share of the segments that hold such rates.
const BEYOND_SHARE: f64 = 0.5;
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

/// Answer of the bank.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Answer {
    /// The true rates are a signed map of the recorded ones; recorded axes whose place is decided.
    Map([bool; 3]),
    /// The true rates are about this factor of them.
    Factor,
    /// The recorded rates are faster than a gyro's, and in deg/s gravity stands still; how still, no factor near it
    /// changes.
    Degrees,
    /// The rates are the derivatives of roll, pitch and yaw.
    EulerRates,
    /// The gyro reads no rotation where gravity turns.
    Unturned,
    /// Lack of any map: no rotation at all makes gravity stand still as well.
    Contradiction,
}

/// Verdict of the bank.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Verdict {
    pub(super) answer: Answer,
    /// Place in the bank.
    pub(super) hypothesis: usize,
    /// Logarithm of how much better it is.
    pub(super) evidence: f64,
    /// Median scatter of gravity as recorded, and under the hypothesis, g.
    pub(super) identity: f64,
    pub(super) found: f64,
    /// Scatter as recorded, g, with what is missing of gravity where another map has it.
    pub(super) recorded: f64,
    /// Share of the telling segments that agree, and their number.
    pub(super) share: f64,
    pub(super) segments: usize,
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

    /// Whether gravity stands still as recorded from this row on.
    pub(super) fn is_still_from(&self, cut: usize) -> bool {
        let scatters = self.rows.iter().skip(cut).map(|row| &row.wanders);
        median_scatter(scatters) <= LARGEST_FOUND_SHAKEN
    }

    /// Verdict by now; `None` where nothing may be said.
    pub(super) fn verdict(&self) -> Option<Verdict> {
        self.euler_rates()
            .or_else(|| self.verdict_from(0, &self.sums))
    }

    /// Verdict that the rates are derivatives of roll, pitch and yaw: by the rule of the bank, and better than all of it.
    fn euler_rates(&self) -> Option<Verdict> {
        let sum =
            |up: usize| -> f64 { self.rows.iter().map(|row| row.evidence_of_euler(up)).sum() };
        let sums = (0..UPS.len()).map(|up| (up, sum(up)));
        let (up, evidence) = sums.max_by(|(_, some), (_, other)| some.total_cmp(other))?;
        let best = self.sums.iter().copied().fold(0.0, f64::max);
        let stands_out = is_peak(evidence, best);
        // In a curve the force tilts, and yaw about the tilted force leaves it where it is: as no rotation does.
        let is_curve = self.sums.get(MAPS).is_none_or(|nothing| *nothing > 0.0);
        if evidence < LEAST_EVIDENCE || !stands_out || is_curve {
            return None;
        }
        let of = |row: &&Row| row.evidence_of_euler(up);
        let telling: Vec<&Row> = self
            .rows
            .iter()
            .filter(|row| of(row).abs() > TELLING)
            .collect();
        let agree = telling.iter().filter(|row| of(row) > 0.0).count();
        let share = agree as f64 / telling.len().max(1) as f64;
        let identity = median_scatter(telling.iter().map(|row| &row.wanders));
        let found = median_scatter(telling.iter().filter_map(|row| row.of_euler.get(up)));
        let mut turns: Vec<f64> = telling.iter().map(|row| row.force_scatter).collect();
        let is_clear = telling.len() >= LEAST_SEGMENTS
            && share >= LEAST_SHARE
            && median(&mut turns) >= LEAST_TURNS
            && identity >= LEAST_IDENTITY
            && found <= LARGEST_FOUND
            && found <= LARGEST_RATIO * identity;
        is_clear.then_some(Verdict {
            answer: Answer::EulerRates,
            hypothesis: 0,
            evidence,
            identity,
            recorded: identity,
            found,
            share,
            segments: telling.len(),
        })
    }

    /// Verdict about gravity that wanders as it does of no body that is moved about, where no map is clear.
    pub(super) fn unexplained(&self) -> Option<Verdict> {
        let wanders = median_scatter(self.rows.iter().map(|row| &row.wanders));
        if self.rows.len() < LEAST_SEGMENTS || wanders < WANDERS {
            return None;
        }
        let unturned = self.rows.iter().filter(|row| row.is_unturned).count() as f64;
        let share = unturned / self.rows.len() as f64;
        Some(Verdict {
            answer: match share >= LEAST_SHARE {
                true => Answer::Unturned,
                false => Answer::Contradiction,
            },
            hypothesis: 0,
            evidence: 0.0,
            identity: wanders,
            found: wanders,
            recorded: wanders,
            share,
            segments: self.rows.len(),
        })
    }

    /// Verdict by the last segments alone, and their first, where a map explains those and not the ones before.
    pub(super) fn later(&self) -> Option<(usize, Verdict)> {
        let (mut cut, mut most) = (0, f64::NEG_INFINITY);
        for h in 1..MAPS {
            let (mut sum, mut least, mut from) = (0.0, 0.0, 0);
            for (n, row) in self.rows.iter().enumerate() {
                sum += row.evidence(h);
                if sum < least {
                    (least, from) = (sum, n + 1);
                }
            }
            if sum - least > most {
                (most, cut) = (sum - least, from);
            }
        }
        if most < LEAST_EVIDENCE {
            return None;
        }
        let mut sums = vec![0.0; self.sums.len()];
        for row in self.rows.iter().skip(cut) {
            for (h, sum) in sums.iter_mut().enumerate() {
                *sum += row.evidence(h);
            }
        }
        Some((cut, self.verdict_from(cut, &sums)?))
    }

    /// Verdict by the rows from this one on, whose evidence is `sums`.
    fn verdict_from(&self, from: usize, sums: &[f64]) -> Option<Verdict> {
        let best = sums.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let count = self.rows.len().saturating_sub(from);
        if count < LEAST_SEGMENTS || best < LEAST_EVIDENCE || !best.is_finite() {
            return None;
        }
        let near = near(sums, best);
        let rows = || self.rows.iter().skip(from);
        let beyond = rows().filter(|row| row.is_beyond).count() as f64;
        let (simplest, nothing) = (simplest(sums, &near)?, sums[MAPS]);
        let has_peak = is_peak(sums[simplest], nothing);
        let is_beyond = beyond >= BEYOND_SHARE * count as f64;
        let is_in_degrees = !has_peak && is_beyond && near.contains(&DEGREES);
        let chosen = if is_in_degrees { DEGREES } else { simplest };
        let telling: Vec<&Row> = rows()
            .filter(|row| row.evidence(chosen).abs() > TELLING)
            .collect();
        if telling.len() < LEAST_SEGMENTS {
            return None;
        }
        let agree = telling
            .iter()
            .filter(|row| row.evidence(chosen) > 0.0)
            .count();
        let scatter_of = |h: usize| median_scatter(telling.iter().filter_map(|row| row.of.get(h)));
        let found = scatter_of(chosen);
        let share = agree as f64 / telling.len() as f64;
        let evidence = sums[chosen];
        let has_peak = has_peak || is_in_degrees;
        let wanders = median_scatter(telling.iter().map(|row| &row.wanders));
        let identity = if has_peak { scatter_of(0) } else { wanders };
        let factor = BANK.get(chosen)?.factor;
        let least = match factor {
            _ if is_in_degrees => 0.0,
            None => LEAST_IDENTITY,
            Some(factor) if factor > 1.0 || (factor < UNIT_BELOW && has_peak) => LEAST_IDENTITY,
            Some(_) => LEAST_IDENTITY_LESS,
        };
        let stands_still = found <= LARGEST_FOUND && found <= LARGEST_RATIO * identity;
        let stands_out = found <= LARGEST_FOUND_SHAKEN && found <= LARGEST_RATIO_SHAKEN * identity;
        let is_clear = evidence >= LEAST_EVIDENCE
            && share >= LEAST_SHARE
            && (stands_still || (has_peak && stands_out))
            && identity >= least;
        is_clear.then(|| Verdict {
            answer: match (has_peak, factor) {
                _ if is_in_degrees => Answer::Degrees,
                (false, _) => Answer::Contradiction,
                (true, Some(_)) => Answer::Factor,
                (true, None) => decided(&near, chosen).map_or(Answer::Contradiction, Answer::Map),
            },
            hypothesis: chosen,
            evidence,
            identity: wanders,
            recorded: identity,
            found,
            share,
            segments: telling.len(),
        })
    }
}

/// Hypotheses about as good as the best.
fn near(sums: &[f64], best: f64) -> Vec<usize> {
    let least = best - (0.05 * best).max(2.0);
    let sums = sums.iter().enumerate();
    sums.filter(|(_, sum)| **sum >= least)
        .map(|(h, _)| h)
        .collect()
}

/// The simplest of them; of factors the best there is.
fn simplest(sums: &[f64], near: &[usize]) -> Option<usize> {
    let order = |a: &usize, b: &usize| {
        let cost = |h: usize| {
            BANK.get(h)
                .map_or(f64::INFINITY, |hypothesis| hypothesis.cost)
        };
        let by_cost = cost(*a).total_cmp(&cost(*b));
        by_cost.then_with(|| sums[*b].total_cmp(&sums[*a]))
    };
    let chosen = near.iter().copied().min_by(order)?;
    if chosen < MAPS {
        return Some(chosen);
    }
    let mut best = MAPS;
    for h in MAPS..sums.len() {
        if sums[h] > sums[best] {
            best = h;
        }
    }
    Some(best)
}

/// Evidence of a segment for a map under which gravity scatters by `found` against one under which it does by `other`.
pub(super) fn evidence(other: f64, found: f64) -> f64 {
    (other / found).ln().clamp(-CLIP, CLIP)
}

/// Whether evidence stands out from that of another explanation: by 4, and by 15 %.
fn is_peak(evidence: f64, other: f64) -> bool {
    evidence - other >= (0.15 * evidence).max(4.0)
}

/// Median of some scatters, g.
fn median_scatter<'a>(squares: impl Iterator<Item = &'a f64>) -> f64 {
    let mut all: Vec<f64> = squares.copied().collect();
    median(&mut all).sqrt()
}

/// Recorded axes whose place is the same in all maps that are near; `None` where none of them is changed.
fn decided(near: &[usize], chosen: usize) -> Option<[bool; 3]> {
    let map_of = |h: &usize| BANK.get(*h).map(|hypothesis| hypothesis.map);
    let named = map_of(&chosen)?;
    let maps = || near.iter().filter(|h| **h < MAPS).filter_map(map_of);
    let is_decided = |axis: usize| maps().all(|map| map.column(axis) == named.column(axis));
    let decided = [0, 1, 2].map(is_decided);
    let is_changed = |axis: usize| named.column(axis) != Matrix3::<f64>::identity().column(axis);
    (0..3)
        .any(|axis| decided[axis] && is_changed(axis))
        .then_some(decided)
}
