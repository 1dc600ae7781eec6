//! Segments -> maps that are not in the bank: another unit and other axes at once, a factor of one axis, a gyro turned
//! against its accelerometer. Pure.
//!
//! A stage of its own because it is dear and seldom: it is asked only where gravity wanders and the bank has no answer.

use super::bank::{
    Answer, BANK, Evidence, FLOOR, LEAST_GRAVITY, LEAST_IDENTITY_LESS, LEAST_SHARE, MAPS, Verdict,
    evidence, units,
};
use super::refine::refine;
use super::segment::{Scatter, Segment};
use super::{Cause, Disagreement};
use crate::frames::AxisMap;
use crate::median::median;
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Scatter of gravity, g, that leaves nothing to explain.
const WELL: f64 = 0.01;
/// Scatter of gravity that is better than another, as a share of it.
const BETTER: f64 = 0.6;
/// Median scatter as recorded, g, from which units with other axes are tried.
const LEAST_OF_UNITS: f64 = 0.12;
/// Segments by which a beginning is chosen.
const BEGUN_BY: usize = 8;
/// Segments by which units with other axes are tried, the last ones.
const TRIED_BY: usize = 16;
/// Segments after which a unit of which no map says so much is given up.
const SOON: usize = 6;
const LEAST_SOON: f64 = 3.0;
/// Factors of each axis and turns (rad) about single ones from which a refinement starts.
const FACTORS: [f64; 3] = [1.0, 0.5, 2.0];
const TURNS: [f64; 2] = [-0.8, 0.8];
/// Largest scatter that a few segments may have under their best map, by the largest of a map that is found, and their
/// least evidence and share: what only accelerates has more, and less.
const HOPEFUL: f64 = 1.3;
const HOPEFUL_EVIDENCE: f64 = 1.0;
const HOPEFUL_SHARE: f64 = 0.5;
/// Rounds of refinement of a turn: directions are straight, and a turn is not.
const ROUNDS: usize = 3;
/// Evidence of a segment that tells something about a refined map, and how many such there must be.
const TELLING: f64 = 0.2;
const LEAST_SEGMENTS: usize = 4;
/// Least evidence for a refined map against the bias alone.
const LEAST_EVIDENCE: f64 = 8.0;
/// Largest sigma of a parameter, and least size of it by its sigma.
const LARGEST_SIGMA: f64 = 0.08;
const SIGMAS: f64 = 5.0;
/// Largest scatter of gravity under a refined map, g, and by that of the bias alone.
const LARGEST_FOUND: f64 = 0.03;
const LARGEST_RATIO: f64 = 0.75;
/// Least singular value of a map: gravity that turns less than the body may be physics.
const LEAST_SINGULAR: f64 = 0.6;
/// The same where gravity stands still, which the recorded rates do not let it do; so much it must fall.
const LEAST_SINGULAR_CLEAR: f64 = 0.3;
const CLEAR: f64 = 0.3;

/// A map that explains what the bank does not.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Finer {
    pub(super) kind: Kind,
    /// True rates by recorded ones.
    pub(super) map: Matrix3<f64>,
    /// Largest standard deviation of a parameter: a share, or rad.
    pub(super) sigma: f64,
    /// Median scatter of gravity as recorded, and under the map, g.
    pub(super) recorded: f64,
    pub(super) found: f64,
    /// Segments that tell.
    pub(super) segments: usize,
}

/// Kind of map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Kind {
    /// Another unit, or range, and other axes; recorded axes whose place is decided.
    UnitAndAxes { axes: AxisMap, decided: [bool; 3] },
    /// A rotation of the gyro against the accelerometer.
    Turn,
    /// A factor of each axis.
    Axes,
}

impl Finer {
    /// Whether it explains these segments, which need not tell it by themselves, better than what was recorded.
    pub(super) fn holds(&self, segments: &[&Segment]) -> bool {
        let recorded = scatters(segments, &Matrix3::identity());
        let found = scatters(segments, &self.map);
        let told = recorded.zip(found).map(|(recorded, found)| {
            let all = recorded.iter().zip(&found);
            all.map(|(other, own)| evidence(other + FLOOR, own + FLOOR))
                .sum::<f64>()
        });
        told.is_some_and(|evidence| evidence > 0.0)
    }

    pub(super) fn disagreement(&self) -> Disagreement {
        let cause = match self.kind {
            Kind::UnitAndAxes { axes, decided } => Cause::Axes {
                map: axes,
                decided,
                scale: Some((self.map.norm() / 3_f64.sqrt(), self.sigma)),
            },
            Kind::Turn => Cause::Turned {
                by: self.map,
                angle: turn_of(&self.map),
                sigma: self.sigma,
            },
            Kind::Axes => Cause::Scales {
                factors: self.map.diagonal().into(),
                sigma: self.sigma,
            },
        };
        Disagreement {
            cause,
            recorded: self.recorded,
            cured: self.found,
            segments: self.segments,
        }
    }
}

/// The map that explains these segments, better than the bank's that is settled; `None` where there is none.
pub(super) fn finer(segments: &[&Segment], settled: Option<&Verdict>) -> Option<Finer> {
    let known = settled.and_then(|verdict| explained(segments, verdict));
    if known.is_some_and(|known| known <= WELL) {
        return None;
    }
    let is_better = |finer: &Finer| known.is_none_or(|known| finer.found <= BETTER * known);
    let recorded = scatters(segments, &Matrix3::identity())?;
    let wanders = wanders(&recorded);
    // Another unit leaves nothing of gravity, other axes wander far: what is moved about hard has less.
    let is_far = wanders >= LEAST_OF_UNITS;
    let of_axes = is_far.then(|| units_with_axes(segments, wanders)).flatten();
    let of_axes = of_axes.filter(is_better);
    let found = of_axes
        .into_iter()
        .chain(refined(segments, &recorded).filter(is_better));
    found.min_by(|some, other| some.found.total_cmp(&other.found))
}

/// The map near the recorded one that explains these segments, whose median scatter is at least so much, g.
pub(super) fn nearby(segments: &[&Segment], least: f64) -> Option<Finer> {
    let recorded = scatters(segments, &Matrix3::identity())?;
    (wanders(&recorded) >= least)
        .then(|| refined(segments, &recorded))
        .flatten()
}

/// Median scatter, g.
fn wanders(squares: &[f64]) -> f64 {
    median(&mut squares.to_vec()).sqrt()
}

/// Scatter of gravity in these segments under what the bank has settled on, g.
fn explained(segments: &[&Segment], settled: &Verdict) -> Option<f64> {
    let map = BANK.get(settled.hypothesis)?.map;
    let of = segments.iter().copied();
    match settled.answer {
        Answer::Map(_) => Some(refine::<3>(of, &map, &[])?.left),
        Answer::Factor | Answer::Degrees => {
            Some(refine::<4>(of, &map, &[Matrix3::identity()])?.left)
        }
        Answer::EulerRates => Some(settled.found),
        Answer::Unturned | Answer::Contradiction => None,
    }
}

/// Units and ranges with the maps of the bank, each judged as the bank judges the unit it is given; `recorded`: the median
/// scatter as recorded, g.
fn units_with_axes(segments: &[&Segment], recorded: f64) -> Option<Finer> {
    let last = &segments[segments.len().saturating_sub(TRIED_BY)..];
    let judged = units().filter_map(|unit| {
        let mut evidence = Evidence::of(MAPS + 1);
        for (n, segment) in last.iter().enumerate() {
            if n == SOON && evidence.most() < LEAST_SOON {
                return None;
            }
            evidence.push(&segment.times(unit));
        }
        let verdict = evidence.verdict()?;
        let Answer::Map(decided) = verdict.answer else {
            return None;
        };
        Some((unit, decided, verdict))
    });
    let best = judged.min_by(|(_, _, some), (_, _, other)| some.found.total_cmp(&other.found));
    let (unit, decided, verdict) = best?;
    let axes = BANK.get(verdict.hypothesis)?.map;
    let start = axes * unit;
    let of = || segments.iter().copied();
    let found = refine::<4>(of(), &start, &[Matrix3::identity()])?;
    let factor = found.map.norm() / axes.norm();
    let sigma = found.sigma[3] * unit / factor;
    let is_sound = sigma.is_finite() && found.left < LARGEST_FOUND.max(verdict.found);
    // Swings as long as a segment come back whatever their size, and leave little of gravity.
    let has_gravity = || gravity(segments, &found.map).is_some_and(|g| g >= LEAST_GRAVITY);
    let is_unit = || {
        units().any(|unit| {
            let alone = scatters(last, &Matrix3::from_diagonal_element(unit));
            alone.is_some_and(|alone| wanders(&alone) <= verdict.found)
        })
    };
    (is_sound && has_gravity() && !is_unit()).then_some(Finer {
        kind: Kind::UnitAndAxes {
            axes: AxisMap::from_matrix(&axes)?,
            decided,
        },
        map: axes * factor,
        sigma,
        recorded,
        found: found.left,
        segments: verdict.segments,
    })
}

/// The simplest refined map that says about the most; `recorded`: the scatter of each segment as recorded, g^2.
fn refined(segments: &[&Segment], recorded: &[f64]) -> Option<Finer> {
    let near = [Matrix3::identity()];
    let unit = |axis: usize| Vector3::ith(axis, 1.0);
    let factors = FACTORS.map(|x| FACTORS.map(|y| FACTORS.map(|z| Vector3::new(x, y, z))));
    let turns = (0..3).flat_map(|axis| TURNS.map(|by| rotation(&(unit(axis) * by))));
    let turn: Vec<Matrix3<f64>> = near.into_iter().chain(turns).collect();
    let factors = factors.as_flattened().as_flattened();
    let axes: Vec<Matrix3<f64>> = factors.iter().map(Matrix3::from_diagonal).collect();
    let skew = [0, 1, 2].map(|axis| unit(axis).cross_matrix());
    let single = [0, 1, 2].map(|axis| Matrix3::from_diagonal(&unit(axis)));
    let turned =
        |of: &[&Segment], starts: &[_]| Judged::of::<6>(of, starts, &skew, Some(nearest_rotation));
    let single = |of: &[&Segment], starts: &[_]| Judged::of::<6>(of, starts, &single, None);
    // First by a few: where the body only accelerates no map makes gravity stand still, and all are not tried by all.
    let few: Vec<&Segment> = begun_by(segments).collect();
    let of_few: Vec<f64> = begun_by(recorded).collect();
    let begun = [turned(&few, &turn), single(&few, &axes)];
    let is_hopeful = |judged: &Judged| {
        let told = judged.against(&of_few);
        told.is_some_and(|told| {
            told.found <= HOPEFUL * LARGEST_FOUND.min(LARGEST_RATIO * told.recorded)
                && told.evidence >= HOPEFUL_EVIDENCE
                && told.share >= HOPEFUL_SHARE
        })
    };
    if !begun.iter().flatten().any(is_hopeful) {
        return None;
    }
    let [of_turn, of_axes] = begun.map(|judged| judged.map(|judged| judged.map));
    let best = [
        Judged::of::<4>(segments, &near, &[Matrix3::identity()], None),
        of_turn.and_then(|start| turned(segments, &[start])),
        of_axes.and_then(|start| single(segments, &[start])),
    ];
    let best = best.map(|judged| {
        let judged = judged?;
        let told = judged.against(recorded)?;
        Some((judged, told))
    });
    let most = best.iter().flatten().map(|(_, told)| told.evidence);
    let most = most.fold(f64::NEG_INFINITY, f64::max);
    let least = most - (0.1 * most).max(2.0);
    // A factor of all is the bank's own to say.
    let kinds = [None, Some(Kind::Turn), Some(Kind::Axes)];
    let (first, kind) = best
        .into_iter()
        .zip(kinds)
        .find(|(found, _)| matches!(found, Some((_, told)) if told.evidence >= least))?;
    let ((judged, told), kind) = (first?, kind?);
    let size = match kind {
        Kind::Turn => turn_of(&judged.map),
        _ => (judged.map - Matrix3::identity()).abs().max(),
    };
    let least_size = if kind == Kind::Turn { 0.12 } else { 0.2 };
    let is_clear = told.evidence >= LEAST_EVIDENCE
        && told.segments >= LEAST_SEGMENTS
        && told.share >= LEAST_SHARE
        && judged.sigma <= LARGEST_SIGMA
        && size >= (SIGMAS * judged.sigma).max(least_size)
        && told.found <= LARGEST_FOUND
        && told.found <= LARGEST_RATIO * told.recorded
        && is_no_physics(&judged.map, &told);
    is_clear.then_some(Finer {
        kind,
        map: judged.map,
        sigma: judged.sigma,
        recorded: told.recorded,
        found: told.found,
        segments: told.segments,
    })
}

/// About so many of all as a beginning takes.
fn begun_by<T: Copy>(all: &[T]) -> impl Iterator<Item = T> {
    let every = all.len().div_ceil(BEGUN_BY).max(1);
    all.iter().step_by(every).copied()
}

/// Whether gravity that turns less than the body tells of the gyro: little less, or clearly.
fn is_no_physics(map: &Matrix3<f64>, told: &Told) -> bool {
    let least = map.singular_values().min();
    let is_clear = told.recorded >= LEAST_IDENTITY_LESS && told.found <= CLEAR * told.recorded;
    least >= LEAST_SINGULAR || (least >= LEAST_SINGULAR_CLEAR && is_clear)
}

/// Map to the nearest one of a kind.
type Projection = fn(&Matrix3<f64>) -> Matrix3<f64>;

/// A refined map with the scatter of each segment under it.
struct Judged {
    map: Matrix3<f64>,
    sigma: f64,
    scatters: Vec<f64>,
}

/// Evidence of a refined map against none.
struct Told {
    evidence: f64,
    segments: usize,
    share: f64,
    recorded: f64,
    found: f64,
}

impl Judged {
    /// The best refinement from one of `starts`; where straight directions leave the maps of its kind, `project` leads
    /// back.
    fn of<const P: usize>(
        segments: &[&Segment],
        starts: &[Matrix3<f64>],
        directions: &[Matrix3<f64>],
        project: Option<Projection>,
    ) -> Option<Judged> {
        let mut totals = vec![0.0; starts.len()];
        for segment in begun_by(segments) {
            let found = segment.scatters_under(starts.iter());
            for (total, found) in totals.iter_mut().zip(found) {
                *total += (found.s + FLOOR).ln();
            }
        }
        let by_total =
            |some: &(f64, Matrix3<f64>), other: &(f64, Matrix3<f64>)| some.0.total_cmp(&other.0);
        let totals = totals.into_iter().zip(starts.iter().copied());
        let (_, mut map) = totals.min_by(by_total)?;
        let mut sigma = f64::NAN;
        for _ in 0..project.map_or(1, |_| ROUNDS) {
            let found = refine::<P>(segments.iter().copied(), &map, directions)?;
            map = project.map_or(found.map, |project| project(&found.map));
            sigma = found.sigma.iter().skip(3).copied().fold(0.0, f64::max);
        }
        let scatters = scatters(segments, &map)?;
        Some(Judged {
            map,
            sigma,
            scatters,
        })
    }

    fn against(&self, reference: &[f64]) -> Option<Told> {
        let all = reference.iter().zip(&self.scatters);
        let told: Vec<(f64, f64, f64)> = all
            .map(|(other, own)| (evidence(other + FLOOR, own + FLOOR), *other, *own))
            .collect();
        let telling: Vec<_> = told.iter().filter(|(e, ..)| e.abs() > TELLING).collect();
        let agree = telling.iter().filter(|(e, ..)| *e > 0.0).count();
        let mut recorded: Vec<f64> = telling.iter().map(|(_, other, _)| *other).collect();
        let mut found: Vec<f64> = telling.iter().map(|(.., own)| *own).collect();
        let evidence = told.iter().map(|(e, ..)| e).sum::<f64>();
        evidence.is_finite().then(|| Told {
            evidence,
            segments: telling.len(),
            share: agree as f64 / telling.len().max(1) as f64,
            recorded: median(&mut recorded).sqrt(),
            found: median(&mut found).sqrt(),
        })
    }
}

/// Scatter of gravity in each segment under a map, with the bias that suits it best, g^2.
fn scatters(segments: &[&Segment], map: &Matrix3<f64>) -> Option<Vec<f64>> {
    each(segments, map, |found| {
        let missing = (LEAST_GRAVITY - found.gravity).max(0.0);
        found.s.max(0.0) + missing * missing
    })
}

/// View of gravity in each segment under a map, with the bias that suits it best.
fn each(
    segments: &[&Segment],
    map: &Matrix3<f64>,
    seen: impl Fn(&Scatter<3>) -> f64,
) -> Option<Vec<f64>> {
    let bias = refine::<3>(segments.iter().copied(), map, &[])?.bias;
    let of = |segment: &&Segment| seen(&segment.scatter::<3>(map, &[], &bias));
    Some(segments.iter().map(of).collect())
}

/// Median mean force under a map, g.
fn gravity(segments: &[&Segment], map: &Matrix3<f64>) -> Option<f64> {
    each(segments, map, |found| found.gravity).map(|mut found| median(&mut found))
}

fn rotation(by: &Vector3<f64>) -> Matrix3<f64> {
    nalgebra::Rotation3::new(*by).into_inner()
}

/// Nearest rotation (Arun, Huang, Blostein, 1987).
fn nearest_rotation(map: &Matrix3<f64>) -> Matrix3<f64> {
    let svd: nalgebra::SVD<f64, nalgebra::Const<3>, nalgebra::Const<3>> =
        SMatrix::svd(*map, true, true);
    match (svd.u, svd.v_t) {
        (Some(u), Some(v)) => {
            let sign = (u * v).determinant().signum();
            u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v
        }
        _ => *map,
    }
}

/// Angle of a rotation, rad.
fn turn_of(map: &Matrix3<f64>) -> f64 {
    (0.5 * (map.trace() - 1.0)).clamp(-1.0, 1.0).acos()
}
