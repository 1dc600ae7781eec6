//! Segments in their order -> axes of the gyro that are others from one moment on. Pure.
//!
//! Apart from the bank because its rule is about order: a sensor that was mounted anew, or a driver that was started with
//! other axes, is right on one side of a moment and wrong on the other. Of a whole recording neither map explains enough,
//! or the advice cures one half and spoils the other. It is said where each side, judged by itself, rules out the map of
//! the other.

use super::bank::{
    Answer, BANK, Evidence, FLOOR, LEAST_SEGMENTS, LEAST_SHARE, TELLING, Verdict, evidence,
};
use super::blocks::Block;
use super::segment::Segment;
use crate::frames::AxisMap;
use crate::record::Nanos;
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;

/// Sound segments that are kept, 1 kB each, and blocks of which one of theirs is made.
const MOST: usize = 8;
const COARSER: usize = 5;
/// Least scatter of the force in the body, g, of a segment that can tell maps apart.
const ROTATES: f64 = 0.1;

/// Axes of the gyro that are others from one moment on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct AxesChange {
    /// End of the last segment before it, and beginning of the first behind it; seconds apart, in either order.
    pub between: (Nanos, Nanos),
    /// True rates by recorded ones, on that side of it on which they are not as recorded.
    pub map: AxisMap,
    /// Recorded axes whose place the motion decides.
    pub decided: [bool; 3],
    /// Whether rates are as recorded before it, and not behind it.
    pub is_first_right: bool,
    /// Segments of four seconds by which the side before it, and the one behind, are judged.
    pub segments: (usize, usize),
}

impl AxesChange {
    /// The moment.
    #[must_use]
    pub fn at(&self) -> Nanos {
        let (before, behind) = self.between;
        Nanos(before.0.midpoint(behind.0))
    }
}

/// Segments in which gravity stood still as recorded, as much of them as tells which maps it would not have.
#[derive(Clone, Debug, Default)]
pub(super) struct Sound {
    kept: VecDeque<Coarse>,
}

/// Segment in coarse blocks.
#[derive(Clone, Debug)]
struct Coarse {
    start: Nanos,
    end: Nanos,
    gravity: f64,
    bias: Option<Vector3<f64>>,
    bias_sigma: f64,
    blocks: Box<[CoarseBlock]>,
}

#[derive(Clone, Copy, Debug)]
struct CoarseBlock {
    nanos: u32,
    angle: [f32; 3],
    force: [f32; 3],
}

/// Opinions of segments about two maps.
#[derive(Clone, Copy, Debug, Default)]
struct Opinions {
    telling: usize,
    agree: usize,
}

impl Opinions {
    fn add(&mut self, evidence: f64) {
        self.telling += usize::from(evidence.abs() > TELLING);
        self.agree += usize::from(evidence > TELLING);
    }

    fn are_clear(&self) -> bool {
        self.telling >= LEAST_SEGMENTS && self.agree as f64 >= LEAST_SHARE * self.telling as f64
    }
}

impl Sound {
    /// Keeps a segment that `blocks` made, if gravity rotates in it; bias and its sigma are those of the segment.
    pub(super) fn push(
        &mut self,
        blocks: &[Block],
        segment: &Segment,
        gravity: f64,
        bias: Option<Vector3<f64>>,
    ) {
        let (Some(first), Some(last)) = (blocks.first(), blocks.last()) else {
            return;
        };
        if segment.force_scatter() < ROTATES {
            return;
        }
        if self.kept.len() == MOST {
            self.kept.pop_front();
        }
        self.kept.push_back(Coarse {
            start: first.start,
            end: last.end,
            gravity,
            bias,
            bias_sigma: segment.bias_sigma,
            blocks: blocks.chunks(COARSER).map(CoarseBlock::of).collect(),
        });
    }

    /// Beginnings and ends of the segments, with the evidence of each for rates as recorded against `map`.
    fn evidence(&self, map: &Matrix3<f64>) -> impl Iterator<Item = (Nanos, Nanos, f64)> {
        self.kept.iter().map(|kept| {
            let segment = kept.segment();
            let scatter = |map: &Matrix3<f64>| {
                let found = segment.scatter::<3>(map, &[], &Vector3::zeros());
                let prior = Matrix3::from_diagonal_element(1e-4 / segment.bias_sigma.powi(2));
                let inverse = (found.a + prior).try_inverse();
                let bias = inverse.map_or_else(Vector3::zeros, |inverse| inverse * found.b);
                found.at(&bias).max(0.0) + FLOOR
            };
            let for_recorded = evidence(scatter(map), scatter(&Matrix3::identity()));
            (kept.start, kept.end, for_recorded)
        })
    }
}

impl Coarse {
    fn segment(&self) -> Segment {
        let mut start = self.start;
        let blocks: Vec<Block> = self
            .blocks
            .iter()
            .map(|block| {
                let end = Nanos(start.0.saturating_add(i64::from(block.nanos)));
                let made = Block {
                    start,
                    end,
                    angle: Vector3::from(block.angle.map(f64::from)),
                    force: Vector3::from(block.force.map(f64::from)),
                };
                start = end;
                made
            })
            .collect();
        Segment::new(&blocks, self.gravity, self.bias, self.bias_sigma)
    }
}

impl CoarseBlock {
    fn of(blocks: &[Block]) -> CoarseBlock {
        let nanos = |block: &Block| block.end.since(block.start);
        let all: i64 = blocks.iter().map(nanos).sum();
        let zero = (Vector3::zeros(), Vector3::zeros());
        let (angle, impulse) = blocks.iter().fold(zero, |(angle, impulse), block| {
            (
                angle + block.angle,
                impulse + block.force * nanos(block) as f64,
            )
        });
        let narrow = |v: Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
        CoarseBlock {
            nanos: u32::try_from(all).unwrap_or(u32::MAX),
            angle: narrow(angle),
            force: narrow(impulse / all.max(1) as f64),
        }
    }
}

/// Change to axes that are not as recorded: segments kept before the bank ran and rows of it before the cut say that
/// they were, those behind it which they are.
pub(super) fn away(bank: &Evidence, sound: &Sound) -> Option<AxesChange> {
    let (cut, verdict) = bank.later()?;
    let (map, decided) = named(&verdict)?;
    let h = verdict.hypothesis;
    let mut behind = bank.rows().skip(cut);
    let first = behind.find(|(.., row)| row.evidence(h) > TELLING)?.0;
    let (mut before, mut last) = (Opinions::default(), None);
    let is_no_row = |start: Nanos| bank.rows().all(|(of_row, ..)| of_row != start);
    let kept = sound.evidence(&BANK.get(h)?.map);
    let kept = kept.filter(|(start, ..)| *start < first && is_no_row(*start));
    let rows = bank.rows().take(cut);
    let rows = rows.map(|(start, end, row)| (start, end, -row.evidence(h)));
    for (_, end, evidence) in kept.chain(rows) {
        before.add(evidence);
        if evidence > TELLING {
            last = Some(end);
        }
    }
    before.are_clear().then_some(AxesChange {
        between: (last?, first),
        map,
        decided,
        is_first_right: true,
        segments: (before.telling, verdict.segments),
    })
}

/// Change back to axes as recorded from those of `settled`.
pub(super) fn back(bank: &Evidence, settled: &Verdict) -> Option<AxesChange> {
    let (map, decided) = named(settled)?;
    let h = settled.hypothesis;
    // The cut that parts those for the map from those against it best.
    let (mut sum, mut most, mut cut) = (0.0, 0.0, 0);
    for (n, (.., row)) in bank.rows().enumerate() {
        sum += row.evidence(h);
        if sum > most {
            (most, cut) = (sum, n + 1);
        }
    }
    let (mut before, mut behind) = (Opinions::default(), Opinions::default());
    let (mut last, mut first) = (None, None);
    for (n, (start, end, row)) in bank.rows().enumerate() {
        let evidence = row.evidence(h);
        if n < cut {
            before.add(evidence);
            last = if evidence > TELLING { Some(end) } else { last };
        } else {
            behind.add(-evidence);
            first = first.or((evidence < -TELLING).then_some(start));
        }
    }
    let is_said = before.are_clear() && behind.are_clear() && bank.is_still_from(cut);
    is_said.then_some(AxesChange {
        between: (last?, first?),
        map,
        decided,
        is_first_right: false,
        segments: (before.telling, behind.telling),
    })
}

fn named(verdict: &Verdict) -> Option<(AxisMap, [bool; 3])> {
    let Answer::Map(decided) = verdict.answer else {
        return None;
    };
    let map = BANK.get(verdict.hypothesis)?.map;
    Some((AxisMap::from_matrix(&map)?, decided))
}
