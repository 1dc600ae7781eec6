//! Evidence of segments for a bank of maps -> what may be said by it. Pure.
//!
//! Apart from how evidence is gathered because this is the rule: what is said must hold in nearly all segments, be seen
//! to be better than no rotation at all, and stand by a residual as small as that of healthy sensors.

use super::super::euler::UPS;
use super::{BANK, DEGREES, Evidence, MAPS, Row, TELLING};
use crate::median::median;
use nalgebra::Matrix3;

/// Least evidence, telling segments, and share of them that agree.
const LEAST_EVIDENCE: f64 = 8.0;
pub(in crate::consistency) const LEAST_SEGMENTS: usize = 6;
pub(in crate::consistency) const LEAST_SHARE: f64 = 0.85;
/// Largest scatter of the map that is found, g, and by that of the identity.
const LARGEST_FOUND: f64 = 0.06;
const LARGEST_RATIO: f64 = 0.6;
/// The same of what is moved about hard, whose own accelerations scatter: a map that has a peak stands out by more.
const LARGEST_FOUND_SHAKEN: f64 = 0.15;
const LARGEST_RATIO_SHAKEN: f64 = 0.4;
/// Median scatter as recorded, g, that no body makes which is moved about: twice the most of 14 recordings of BROAD, 7
/// others and simulated hands, drones, cars, boats, runners and circles (0.084). A gyro that reads nothing has 0.18 to 0.5.
pub(in crate::consistency) const WANDERS: f64 = 0.17;
/// Least scatter of the identity, g; where physics makes gravity turn less than the body.
const LEAST_IDENTITY: f64 = 0.05;
pub(in crate::consistency) const LEAST_IDENTITY_LESS: f64 = 0.09;
/// Least scatter of the force in the body, g, by which roll and pitch are told from the lean of a curve: 0.35 to 0.59 of
/// hands, arms and what tumbles, 0.06 at most of cars.
const LEAST_TURNS: f64 = 0.2;
/// A factor below this is a unit.
const UNIT_BELOW: f64 = 0.1;
/// Share of the segments that hold rates beyond the range of nearly every gyro.
const BEYOND_SHARE: f64 = 0.5;

/// Answer of the bank.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(in crate::consistency) enum Answer {
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
pub(in crate::consistency) struct Verdict {
    pub(in crate::consistency) answer: Answer,
    /// Place in the bank.
    pub(in crate::consistency) hypothesis: usize,
    /// Logarithm of how much better it is.
    pub(in crate::consistency) evidence: f64,
    /// Median scatter of gravity as recorded, and under the hypothesis, g.
    pub(in crate::consistency) identity: f64,
    pub(in crate::consistency) found: f64,
    /// Scatter as recorded, g, with what is missing of gravity where another map has it.
    pub(in crate::consistency) recorded: f64,
    /// Share of the telling segments that agree, and their number.
    pub(in crate::consistency) share: f64,
    pub(in crate::consistency) segments: usize,
}

impl Evidence {
    /// Whether gravity stands still as recorded from this row on.
    pub(in crate::consistency) fn is_still_from(&self, cut: usize) -> bool {
        let scatters = self.rows.iter().skip(cut).map(|row| &row.wanders);
        median_scatter(scatters) <= LARGEST_FOUND_SHAKEN
    }

    /// Verdict by now; `None` where nothing may be said.
    pub(in crate::consistency) fn verdict(&self) -> Option<Verdict> {
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
    pub(in crate::consistency) fn unexplained(&self) -> Option<Verdict> {
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
    pub(in crate::consistency) fn later(&self) -> Option<(usize, Verdict)> {
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
