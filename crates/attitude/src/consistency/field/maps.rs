//! Segments -> evidence for each axis map of the magnetometer, with a hard iron of its own. Pure.
//!
//! A stage of its own because it is a rule of evidence, as the gyro's bank is. A mirrored magnetometer turns like the
//! proper map of the opposite sign, so 24 maps are judged; which of the two it is the dip against gravity tells, to
//! whoever knows the hemisphere.

use super::super::bank::{BANK, MAPS};
use super::{FieldSegment, UNKNOWNS, normalised};
use crate::frames::AxisMap;
use crate::median::median;
use nalgebra::{Matrix3, SVector, Vector3};

/// Scatter of the field that is none, as a square share of it.
const FLOOR: f64 = 9e-4;
/// Most that one segment says.
const CLIP: f64 = 3.0;
/// Information of the prior of hard iron: as large as the field.
const PRIOR: f64 = 1e-3;
/// Rounds in which hard iron is weighted anew.
const ROUNDS: usize = 6;
/// Least segments, evidence, share of them that agree, and distance to the next map.
const LEAST_SEGMENTS: usize = 6;
const LEAST_EVIDENCE: f64 = 10.0;
const LEAST_SHARE: f64 = 0.8;
const LEAST_LEAD: f64 = 4.0;
const LEAST_LEAD_SHARE: f64 = 0.1;
/// Least scatter as recorded, largest of the map, and by that of the recorded.
const LEAST_RECORDED: f64 = 0.06;
const LARGEST_CURED: f64 = 0.1;
const LARGEST_RATIO: f64 = 0.6;

/// Disagreement of gyro and magnetometer about their axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FieldDisagreement {
    /// Proper map that makes the field stand still: true fields by those that were given.
    pub map: AxisMap,
    /// Scatter of the field in the integrated frame as recorded, as a share of it: 0.01 of healthy sensors.
    pub recorded: f64,
    /// The same with the map.
    pub cured: f64,
    /// Angle of the mapped field above the horizon, rad, where gravity was seen: negative north of the equator.
    pub elevation: Option<f64>,
    /// Segments of four seconds in which it shows.
    pub segments: usize,
}

/// A map with the hard iron that suits it, and what it leaves of each segment.
pub(super) struct Judged {
    pub(super) unknowns: SVector<f64, UNKNOWNS>,
    pub(super) costs: Vec<f64>,
}

impl Judged {
    pub(super) fn scatter(&self) -> f64 {
        median(&mut self.costs.clone()).max(0.0).sqrt()
    }
}

/// Evidence, share of the segments that agree, map, and what it leaves.
type Candidate = (f64, f64, Matrix3<f64>, Judged);

/// Unknowns of a map and a hard iron.
fn unknowns(map: &Matrix3<f64>, iron: &Vector3<f64>) -> SVector<f64, UNKNOWNS> {
    SVector::from_fn(|i, _| match i {
        0..9 => map[(i / 3, i % 3)],
        _ => iron[i - 9],
    })
}

/// A map with its hard iron, by segments in units of the field.
pub(super) fn judged(segments: &[FieldSegment], map: &Matrix3<f64>) -> Judged {
    let entries = unknowns(map, &Vector3::zeros());
    let parts: Vec<(f64, Vector3<f64>, Matrix3<f64>)> = segments
        .iter()
        .map(|segment| {
            let by = segment.gram * entries;
            let slope = Vector3::new(by[9], by[10], by[11]);
            let normal = segment.gram.fixed_view::<3, 3>(9, 9).into_owned();
            (entries.dot(&by), slope, normal)
        })
        .collect();
    let cost = |(square, slope, normal): &(f64, Vector3<f64>, Matrix3<f64>), h: &Vector3<f64>| {
        (square + 2.0 * slope.dot(h) + h.dot(&(normal * h))).max(0.0)
    };
    let mut iron = Vector3::zeros();
    for round in 0..ROUNDS {
        let mut normal = Matrix3::from_diagonal_element(PRIOR);
        let mut right = Vector3::zeros();
        for part in &parts {
            // The first round weighs all the same: hard iron may be as large as the field.
            let weight = match round {
                0 => 1.0,
                _ => 1.0 / (cost(part, &iron) + FLOOR),
            };
            normal += part.2 * weight;
            right -= part.1 * weight;
        }
        iron = normal.try_inverse().map_or(iron, |inverse| inverse * right);
    }
    Judged {
        unknowns: unknowns(map, &iron),
        costs: parts.iter().map(|part| cost(part, &iron)).collect(),
    }
}

/// Proper maps with their place in the bank; the identity is the first.
fn proper() -> impl Iterator<Item = Matrix3<f64>> {
    let maps = BANK.iter().take(MAPS).map(|hypothesis| hypothesis.map);
    maps.filter(|map| map.determinant() > 0.0)
}

/// Disagreement that the segments show.
pub(super) fn disagreement(kept: &[FieldSegment]) -> Option<FieldDisagreement> {
    if kept.len() < LEAST_SEGMENTS {
        return None;
    }
    let (segments, _) = normalised(kept)?;
    let recorded = judged(&segments, &Matrix3::identity());
    if recorded.scatter() < LEAST_RECORDED {
        return None;
    }
    let mut best: Option<Candidate> = None;
    let mut next = 0.0_f64;
    for map in proper().skip(1) {
        let found = judged(&segments, &map);
        let said = recorded.costs.iter().zip(&found.costs);
        let said: Vec<f64> = said
            .map(|(was, is)| ((was + FLOOR) / (is + FLOOR)).ln().clamp(-CLIP, CLIP))
            .collect();
        let evidence: f64 = said.iter().sum();
        let share = said.iter().filter(|e| **e > 0.0).count() as f64 / said.len() as f64;
        if best.as_ref().is_none_or(|(most, ..)| evidence > *most) {
            next = best.as_ref().map_or(next, |(most, ..)| next.max(*most));
            best = Some((evidence, share, map, found));
        } else {
            next = next.max(evidence);
        }
    }
    let (evidence, share, map, found) = best?;
    let (was, is) = (recorded.scatter(), found.scatter());
    let is_alone = evidence - next >= LEAST_LEAD.max(LEAST_LEAD_SHARE * evidence);
    let is_told = evidence >= LEAST_EVIDENCE && share >= LEAST_SHARE && is_alone;
    let is_cured = is <= LARGEST_CURED && is <= LARGEST_RATIO * was;
    if !(is_told && is_cured) {
        return None;
    }
    Some(FieldDisagreement {
        map: AxisMap::from_matrix(&map)?,
        recorded: was,
        cured: is,
        elevation: elevation(&segments, &found.unknowns),
        segments: segments.len(),
    })
}

/// Angle of the field above the horizon, the median of the segments.
pub(super) fn elevation(
    segments: &[FieldSegment],
    unknowns: &SVector<f64, UNKNOWNS>,
) -> Option<f64> {
    let of = |segment: &FieldSegment| {
        let field = segment.mean * unknowns;
        let sine = field.dot(&segment.up) / (field.norm() * segment.up.norm());
        sine.is_finite().then(|| sine.clamp(-1.0, 1.0).asin())
    };
    let mut all: Vec<f64> = segments.iter().filter_map(of).collect();
    (!all.is_empty()).then(|| median(&mut all))
}
