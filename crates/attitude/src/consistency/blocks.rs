//! Readings -> blocks of 20 ms, and the bias of the quietest second. Pure.
//!
//! A stage of its own because everything behind it costs the same at 10 kHz as at 100 Hz.

use super::Reading;
use crate::quaternion::{BodyRate, DeltaAngle};
use crate::record::{Measured, Nanos};
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Shortest block, ns: 20 ms, less a jitter of the stamps.
const BLOCK_NANOS: i64 = 19_980_000;
/// Longest step within a run of blocks, ns.
const LONGEST_STEP_NANOS: i64 = 250_000_000;
/// Time over which a bias is taken, ns.
const REST_NANOS: i64 = 999_999_000;
/// Scatter of a force that is steady, and distance between the means of its halves, g.
const STEADY: f64 = 0.03;
const HALVES: f64 = 0.01;
/// Deviation and mean of a quiet rate, as shares of the rms rate: no unit is assumed.
const QUIET: f64 = 0.1;
const SLOW: f64 = 0.3;

/// Integral of the rate and mean of the force over a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Beginning.
    pub(super) start: Nanos,
    /// End.
    pub(super) end: Nanos,
    /// Integral of the rate, rad as recorded.
    pub(super) angle: Vector3<f64>,
    /// Mean force, m/s^2 or any unit.
    pub(super) force: Vector3<f64>,
}

impl Block {
    /// Length, s.
    pub(super) fn secs(&self) -> f64 {
        self.end.secs_since(self.start)
    }
}

/// Outcome of one more reading.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    /// A block that is not full.
    Open,
    /// The run of blocks is broken.
    Broken,
    /// A block.
    Full(Block),
}

/// Readings of a run that are no block yet.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    last: Option<Reading>,
    start: Nanos,
    angle: Vector3<f64>,
    impulse: Vector3<f64>,
}

impl Blocks {
    /// Takes a reading. A step that is too long, or back in time, breaks the run.
    pub(super) fn push(&mut self, reading: &Reading) -> Step {
        let Some(last) = self.last.replace(*reading) else {
            self.begin(reading.stamp);
            return Step::Open;
        };
        let nanos = reading.stamp.since(last.stamp);
        if !(1..=LONGEST_STEP_NANOS).contains(&nanos) {
            self.begin(reading.stamp);
            return Step::Broken;
        }
        let secs = nanos as f64 * 1e-9;
        self.angle += match (reading.gyro, last.gyro) {
            (Measured::Rate(BodyRate(now)), Measured::Rate(BodyRate(then))) => {
                (now + then) * (0.5 * secs)
            }
            (Measured::Rate(BodyRate(now)), Measured::Increment(_)) => now * secs,
            (Measured::Increment(DeltaAngle(angle)), _) => angle,
        };
        self.impulse += (reading.force + last.force) * (0.5 * secs);
        if reading.stamp.since(self.start) < BLOCK_NANOS {
            return Step::Open;
        }
        let block = Block {
            start: self.start,
            end: reading.stamp,
            angle: self.angle,
            force: self.impulse / reading.stamp.secs_since(self.start),
        };
        self.begin(reading.stamp);
        Step::Full(block)
    }

    /// The next reading does not follow the last.
    pub(super) fn interrupt(&mut self) {
        self.last = None;
    }

    fn begin(&mut self, start: Nanos) {
        self.start = start;
        self.angle = Vector3::zeros();
        self.impulse = Vector3::zeros();
    }
}

/// Bias of the gyro: the mean rate of the quietest second of a steady force.
#[derive(Clone, Debug, Default)]
pub(super) struct Rest {
    /// Rate, force in g, and length of the blocks of the last second.
    window: VecDeque<(Vector3<f64>, Vector3<f64>, i64)>,
    nanos: i64,
    count: f64,
    squares: f64,
    quietest: Option<(f64, Vector3<f64>)>,
}

impl Rest {
    /// Takes a block whose force is `gravity` long at rest.
    pub(super) fn push(&mut self, block: &Block, gravity: f64) {
        let rate = block.angle / block.secs();
        self.count += 1.0;
        self.squares += rate.norm_squared();
        let nanos = block.end.since(block.start);
        self.window.push_back((rate, block.force / gravity, nanos));
        self.nanos += nanos;
        if self.nanos < REST_NANOS {
            return;
        }
        let rates = mean_and_scatter(self.window.iter().map(|(rate, ..)| *rate));
        let forces = || self.window.iter().map(|(_, force, _)| *force);
        let half = self.window.len() / 2;
        let apart =
            mean_and_scatter(forces().take(half)).0 - mean_and_scatter(forces().skip(half)).0;
        let is_steady = mean_and_scatter(forces()).1 < STEADY && apart.norm() < HALVES;
        let is_quieter = self.quietest.is_none_or(|(least, _)| rates.1 < least);
        if is_steady && is_quieter {
            self.quietest = Some((rates.1, rates.0));
        }
        for (.., nanos) in self.window.drain(..half) {
            self.nanos -= nanos;
        }
    }

    /// The bias, rad/s, where the rate was quiet beside what it is on the whole.
    pub(super) fn bias(&self) -> Option<Vector3<f64>> {
        let (deviation, mean) = self.quietest?;
        let rms = (self.squares / self.count).sqrt() + 1e-12;
        (deviation < QUIET * rms && mean.norm() < SLOW * rms).then_some(mean)
    }
}

/// Mean, and the root of the summed variances, of some vectors.
fn mean_and_scatter(all: impl Iterator<Item = Vector3<f64>> + Clone) -> (Vector3<f64>, f64) {
    let n = all.clone().count().max(1) as f64;
    let mean = all.clone().fold(Vector3::zeros(), |sum, v| sum + v) / n;
    let squares = all.fold(0.0, |sum, v| sum + (v - mean).norm_squared());
    (mean, (squares / n).sqrt())
}
