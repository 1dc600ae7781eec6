//! Blocks in their order -> gravity that leaps from one to the next, and the gyro reads no such rotation. Pure.
//!
//! Apart from the bank because gyro and accelerometer agree on either side: a sensor that was mounted anew, restarted with
//! other axes, or joined from two recordings is another body from one sample on, and no map of the gyro tells. A body
//! turns by no such angle in no time, and accelerations neither begin in one sample nor keep gravity's length and place
//! on both sides of it.

use super::blocks::Block;
use super::segment::half_turn;
use crate::record::Nanos;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::VecDeque;

/// Length of either side, ns, and its least number of blocks.
const SIDE_NANOS: i64 = 900_000_000;
const SHORTEST_NANOS: i64 = 800_000_000;
const LEAST_BLOCKS: usize = 15;
/// Most blocks of both sides, which are 20 ms and more.
const MOST_BLOCKS: usize = 96;
/// Blocks next to the leap that hold nearly all of it.
const NEXT: usize = 3;
/// Least leap of the mean force in the integrated frame, g: 20 degrees.
const LEAST: f64 = 0.35;
/// Share of it that the next blocks hold. Of vibration they hold more than all.
const SHARP: std::ops::Range<f64> = 0.7..1.4;
/// Scatter of the force on either side about its mean, by the leap: 0.38 and more of 24 recordings as recorded, 0.01 to
/// 0.24 of axes that change on hands, arms, drones, cars, and of what rests.
const LARGEST_RATIO: f64 = 0.25;
/// Mean force on either side by gravity.
const GRAVITY: std::ops::Range<f64> = 0.8..1.25;
/// Largest rotation in the block of the leap, rad, and longest of the blocks about it, s: of a pause more is unseen.
const TURN: f64 = 0.5;
const LONGEST_SECS: f64 = 0.1;
/// Least time between two leaps, ns.
const APART_NANOS: i64 = 1_000_000_000;

/// Leap of gravity that the gyro does not read.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GravityLeap {
    /// Middle of the block in which it happens.
    pub at: Nanos,
    /// Angle between gravity before it and behind, rad.
    pub angle: f64,
    /// Scatter of the force about its mean on either side, g.
    pub scatter: f64,
    /// Number of leaps up to now, of which this is the first.
    pub count: usize,
}

/// Watch over leaps.
#[derive(Clone, Debug, Default)]
pub(super) struct Leaps {
    /// Forces of the newest blocks of the run, in the frame of its first.
    forces: VecDeque<Vector3<f64>>,
    /// Rotation to that frame at the end of the newest, and when that is.
    attitude: Quaternion<f64>,
    end: Option<Nanos>,
    first: Option<(GravityLeap, f64)>,
    last: Option<Nanos>,
}

impl Leaps {
    /// Leap that was seen first.
    pub(super) fn found(&self) -> Option<GravityLeap> {
        self.first.map(|(leap, _)| leap)
    }

    /// Looks at the end of a run of blocks whose force is `gravity` long at rest.
    pub(super) fn look(&mut self, run: &[Block], gravity: f64) {
        self.follow(run);
        let Some((leap, ratio)) = leap(run, &self.forces, gravity) else {
            return;
        };
        let is_another = |last: Nanos| leap.at.since(last) >= APART_NANOS;
        match &mut self.first {
            None => self.first = Some((leap, ratio)),
            Some((first, _)) if self.last.is_none_or(is_another) => first.count += 1,
            // The same leap, seen from the next block: its own block parts the sides best.
            Some((first, least)) if first.count == 1 && ratio < *least => {
                (*first, *least) = (leap, ratio);
            }
            Some(_) => return,
        }
        self.last = Some(leap.at);
    }

    /// Turns the force of the newest block into the frame of the run.
    fn follow(&mut self, run: &[Block]) {
        let Some(newest) = run.last() else { return };
        let before = run.len().checked_sub(2).and_then(|at| run.get(at));
        if before.is_none_or(|block| self.end != Some(block.end)) {
            self.forces.clear();
            self.attitude = Quaternion::identity();
        }
        let half = half_turn(&newest.angle);
        self.attitude *= half;
        let force = UnitQuaternion::new_unchecked(self.attitude) * newest.force;
        self.attitude *= half;
        self.forces.push_back(force);
        while self.forces.len() > run.len().min(MOST_BLOCKS) {
            self.forces.pop_front();
        }
        self.end = Some(newest.end);
    }
}

/// Leap in the block that lies one side's length before the end of the run, and the scatter of both sides by it; of
/// the last blocks also the forces in one frame.
fn leap(
    run: &[Block],
    forces: &VecDeque<Vector3<f64>>,
    gravity: f64,
) -> Option<(GravityLeap, f64)> {
    let run = run.get(run.len().checked_sub(forces.len())?..)?;
    let end = run.last()?.end;
    let behind_from = run.partition_point(|block| end.since(block.end) >= SIDE_NANOS);
    let middle = behind_from.checked_sub(1)?;
    let (own, earlier, later) = (
        run.get(middle)?,
        run.get(middle.checked_sub(1)?)?,
        run.get(behind_from)?,
    );
    let part = |from: usize, to: usize| forces.range(from..to).map(|force| force / gravity);
    let close = middle.checked_sub(NEXT)?;
    let far = (behind_from + NEXT).min(run.len());
    let next = mean(part(behind_from, far)) - mean(part(close, middle));
    if next.norm() < SHARP.start * LEAST {
        return None;
    }
    let before_from = run.partition_point(|block| own.start.since(block.start) > SIDE_NANOS);
    let is_close = |block: &Block| block.secs() <= LONGEST_SECS;
    let is_whole = middle
        .saturating_sub(before_from)
        .min(run.len() - behind_from)
        >= LEAST_BLOCKS
        && own.start.since(run.get(before_from)?.start) >= SHORTEST_NANOS
        && [own, earlier, later].into_iter().all(is_close)
        && own.angle.norm() <= TURN;
    if !is_whole {
        return None;
    }
    let (before, behind) = (
        || part(before_from, middle),
        || part(behind_from, run.len()),
    );
    let (mean_before, mean_behind) = (mean(before()), mean(behind()));
    let by = mean_behind - mean_before;
    let size = by.norm();
    let squares = |all: &mut dyn Iterator<Item = Vector3<f64>>, mean: Vector3<f64>| -> f64 {
        all.map(|force| (force - mean).norm_squared()).sum()
    };
    let sum = squares(&mut before(), mean_before) + squares(&mut behind(), mean_behind);
    let count = middle - before_from + run.len() - behind_from;
    let scatter = (sum / count as f64).sqrt();
    let is_leap = size >= LEAST
        && scatter <= LARGEST_RATIO * size
        && SHARP.contains(&(next.dot(&by) / (size * size)))
        && GRAVITY.contains(&mean_before.norm())
        && GRAVITY.contains(&mean_behind.norm());
    let leap = GravityLeap {
        at: Nanos(own.start.0.midpoint(own.end.0)),
        angle: mean_before.angle(&mean_behind),
        scatter,
        count: 1,
    };
    is_leap.then_some((leap, scatter / size))
}

fn mean(all: impl Iterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let (sum, n) = all.fold((Vector3::zeros(), 0.0), |(sum, n), v| (sum + v, n + 1.0));
    sum / f64::max(n, 1.0)
}
