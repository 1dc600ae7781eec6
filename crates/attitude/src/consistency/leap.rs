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

/// Length of either side, ns, and its least number of blocks.
const SIDE_NANOS: i64 = 900_000_000;
const SHORTEST_NANOS: i64 = 800_000_000;
const LEAST_BLOCKS: usize = 15;
/// Blocks next to the leap that hold nearly all of it.
const NEXT: usize = 3;
/// Least difference of two forces about a block, g, that is worth a look.
const COARSE: f64 = 0.2;
/// Least leap of the mean force in the integrated frame, g: 20 degrees.
const LEAST: f64 = 0.35;
/// Share of it that the next blocks hold. Of vibration they hold more than all.
const SHARP: std::ops::Range<f64> = 0.7..1.4;
/// Scatter of the force on either side about its mean, by the leap: 0.40 and more of 24 recordings as recorded, 0.01 to
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
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Leaps {
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
        let Some((leap, ratio)) = leap(run, gravity) else {
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
}

/// Leap in the block that lies one side's length before the end of the run, and the scatter of both sides by it.
fn leap(run: &[Block], gravity: f64) -> Option<(GravityLeap, f64)> {
    let end = run.last()?.end;
    let behind_from = run.partition_point(|block| end.since(block.end) >= SIDE_NANOS);
    let middle = behind_from.checked_sub(1)?;
    let (before, behind) = (run.get(..middle)?, run.get(behind_from..)?);
    let (own, earlier, later) = (run.get(middle)?, before.last()?, behind.first()?);
    if (later.force - earlier.force).norm_squared() < (COARSE * gravity).powi(2) {
        return None;
    }
    let from = before.partition_point(|block| own.start.since(block.start) > SIDE_NANOS);
    let before = before.get(from..)?;
    let is_close = |block: &Block| block.secs() <= LONGEST_SECS;
    let is_whole = before.len().min(behind.len()) >= LEAST_BLOCKS
        && own.start.since(before.first()?.start) >= SHORTEST_NANOS
        && [own, earlier, later].into_iter().all(is_close)
        && own.angle.norm() <= TURN;
    if !is_whole {
        return None;
    }
    let mut attitude = Quaternion::identity();
    let mut in_one_frame = |block: &Block| {
        let half = half_turn(&block.angle);
        attitude *= half;
        let force = UnitQuaternion::new_unchecked(attitude) * block.force / gravity;
        attitude *= half;
        force
    };
    let before: Vec<Vector3<f64>> = before.iter().map(&mut in_one_frame).collect();
    in_one_frame(own);
    let behind: Vec<Vector3<f64>> = behind.iter().map(&mut in_one_frame).collect();
    let (mean_before, mean_behind) = (mean(before.iter()), mean(behind.iter()));
    let by = mean_behind - mean_before;
    let size = by.norm();
    let next = mean(behind.iter().take(NEXT)) - mean(before.iter().rev().take(NEXT));
    let squares = |all: &[Vector3<f64>], mean: Vector3<f64>| -> f64 {
        all.iter().map(|force| (force - mean).norm_squared()).sum()
    };
    let sum = squares(&before, mean_before) + squares(&behind, mean_behind);
    let scatter = (sum / (before.len() + behind.len()) as f64).sqrt();
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

fn mean<'a>(all: impl Iterator<Item = &'a Vector3<f64>>) -> Vector3<f64> {
    let (sum, n) = all.fold((Vector3::zeros(), 0.0), |(sum, n), v| (sum + v, n + 1.0));
    sum / f64::max(n, 1.0)
}
