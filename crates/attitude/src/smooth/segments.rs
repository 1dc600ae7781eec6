//! Prepared samples -> nodes, the segments between them, and which of those are at rest. Pure.
//!
//! A stage of its own because the unknowns of the problem are its nodes, and a standstill is decided by segment.

use super::prepared::Prepared;
use super::rests;
use crate::median::median;
use nalgebra::Vector3;

/// Fewer samples than this after the last node do not get one.
const FEWEST: usize = 5;
/// Largest deviation at rest: of the rate (rad/s), of the force (m/s^2), and of the mean rate from the median one.
pub(super) const STILL_RATE: f64 = 0.5_f64.to_radians();
/// Largest deviation at rest of a rate of which no more than [`STILL_RATE`] is slower than a block, rad/s: white noise,
/// and lines above some Hz, turn a body by nothing. Moving bodies had 0.04 and more, resting ones 0.02 at most (`condition::stillness`).
const NOISY_RATE: f64 = 0.025;
/// Length of a block, s.
const BLOCK_SECS: f64 = 0.125;
const STILL_FORCE: f64 = 0.2;
pub(super) const STILL_MEAN: f64 = 0.5_f64.to_radians();
/// A log without noise has thresholds of nothing.
const SLACK: f64 = 1e-9;

/// Samples from one node to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    pub samples: usize,
    /// Time between its nodes, s.
    pub secs: f64,
    /// Stamp of its last sample.
    pub stamp: i64,
    /// Nothing is known of the motion.
    pub is_break: bool,
    pub is_still: bool,
    /// Variance left by gaps and by what is faster than the samples, of attitude and of velocity.
    pub doubt: [f64; 2],
    pub mean_rate: Vector3<f64>,
    pub mean_force: Vector3<f64>,
    /// Largest standard deviation of an axis: rate, force.
    pub spread: [f64; 2],
    /// Standard deviation of the rate without what is faster than a block, rad/s.
    pub slow: f64,
}

#[cfg(test)]
impl Segment {
    /// Half a second of motion, whatever was measured in it.
    pub(super) fn moving() -> Segment {
        Segment {
            samples: 50,
            secs: 0.5,
            stamp: 0,
            is_break: false,
            is_still: false,
            doubt: [0.0; 2],
            mean_rate: Vector3::zeros(),
            mean_force: Vector3::zeros(),
            spread: [0.0; 2],
            slow: 0.0,
        }
    }
}

/// Mean and sum of squares about it.
#[derive(Clone, Copy)]
struct Moments {
    count: usize,
    mean: Vector3<f64>,
    square: Vector3<f64>,
}

impl Moments {
    fn none() -> Moments {
        Moments {
            count: 0,
            mean: Vector3::zeros(),
            square: Vector3::zeros(),
        }
    }

    fn take(&mut self, value: &Vector3<f64>) {
        self.count += 1;
        let off = value - self.mean;
        self.mean += off * (1.0 / self.count as f64);
        self.square += off.component_mul(&(value - self.mean));
    }

    /// Moments of both together (Chan, Golub, LeVeque 1979).
    fn with(mut self, later: &Moments) -> Moments {
        if later.count == 0 {
            return self;
        }
        let (n, m) = (self.count as f64, later.count as f64);
        let off = later.mean - self.mean;
        self.square += later.square + off.component_mul(&off) * (n * m / (n + m));
        self.mean += off * (m / (n + m));
        self.count += later.count;
        self
    }

    /// Largest standard deviation of an axis.
    fn spread(&self) -> f64 {
        let count = self.count.max(1) as f64;
        (self.square.max() / count).max(0.0).sqrt()
    }
}

/// Sums over the samples of a segment.
#[derive(Clone, Copy)]
struct Sums {
    secs: f64,
    stamp: i64,
    doubt: [f64; 2],
    rate: Moments,
    force: Moments,
    /// The current block of rates, its number, and the means of those before it.
    block: Moments,
    number: f64,
    blocks: Moments,
}

impl Sums {
    fn none() -> Sums {
        Sums {
            secs: 0.0,
            stamp: 0,
            doubt: [0.0; 2],
            rate: Moments::none(),
            force: Moments::none(),
            block: Moments::none(),
            number: 0.0,
            blocks: Moments::none(),
        }
    }

    /// Takes a sample of the block of this number.
    fn take(&mut self, sample: &Prepared, number: f64) {
        self.rate.take(&sample.rate);
        self.force.take(&sample.force);
        if number != self.number {
            self.end_block();
            self.number = number;
        }
        self.block.take(&sample.rate);
        self.secs += sample.secs;
        self.stamp = sample.stamp;
        self.doubt[0] += sample.doubt[0];
        self.doubt[1] += sample.doubt[1];
    }

    fn end_block(&mut self) {
        if self.block.count > 0 {
            self.blocks.take(&self.block.mean);
        }
        self.block = Moments::none();
    }

    /// Sums of both together.
    fn with(mut self, later: &Sums) -> Sums {
        self.rate = self.rate.with(&later.rate);
        self.force = self.force.with(&later.force);
        self.end_block();
        self.blocks = self.blocks.with(&later.blocks);
        self.block = later.block;
        self.secs += later.secs;
        self.stamp = later.stamp;
        self.doubt[0] += later.doubt[0];
        self.doubt[1] += later.doubt[1];
        self
    }

    fn segment(mut self) -> Segment {
        self.end_block();
        Segment {
            samples: self.rate.count,
            secs: self.secs,
            stamp: self.stamp,
            is_break: false,
            is_still: false,
            doubt: self.doubt,
            mean_rate: self.rate.mean,
            mean_force: self.force.mean,
            spread: [self.rate.spread(), self.force.spread()],
            slow: self.slow(),
        }
    }

    /// Scatter of the means over blocks less what white noise leaves of it; of all samples where a block holds but one.
    fn slow(&self) -> f64 {
        let (spread, held) = (self.rate.spread(), self.rate.count as f64);
        let held = held / self.blocks.count.max(1) as f64;
        if held < 2.0 {
            return spread;
        }
        let left = self.blocks.spread().powi(2) - spread * spread / held;
        left.max(0.0).sqrt()
    }
}

/// Cuts a stream into segments.
pub(super) struct Cutter {
    spacing: f64,
    /// Stamp of the first sample of all.
    origin: Option<i64>,
    slot: f64,
    segments: Vec<Segment>,
    /// The last that is complete, of this section.
    complete: Option<Sums>,
    current: Sums,
}

impl Cutter {
    pub(super) fn new(spacing: f64) -> Cutter {
        Cutter {
            spacing,
            origin: None,
            slot: 0.0,
            segments: Vec::new(),
            complete: None,
            current: Sums::none(),
        }
    }

    pub(super) fn take(&mut self, sample: &Prepared) {
        let Some(origin) = self.origin else {
            self.origin = Some(sample.stamp);
            return;
        };
        let secs = sample.stamp.saturating_sub(origin) as f64 * 1e-9;
        let slot = (secs / self.spacing + 1e-9).floor();
        // A segment holds its last node's sample: so does a block.
        let block = (secs / BLOCK_SECS - 1e-9).ceil();
        if sample.is_after_break {
            self.end_section();
            let mut gap = Sums::none();
            gap.take(sample, block);
            self.segments.push(Segment {
                is_break: true,
                ..gap.segment()
            });
        } else {
            self.current.take(sample, block);
            if slot > self.slot {
                self.segments
                    .extend(self.complete.take().map(|sums| sums.segment()));
                self.complete = Some(std::mem::replace(&mut self.current, Sums::none()));
            }
        }
        self.slot = slot;
    }

    fn end_section(&mut self) {
        let current = std::mem::replace(&mut self.current, Sums::none());
        match self.complete.take() {
            Some(complete) if current.rate.count > 0 && current.rate.count < FEWEST => {
                self.segments.push(complete.with(&current).segment());
            }
            complete => {
                self.segments.extend(complete.map(|sums| sums.segment()));
                if current.rate.count > 0 {
                    self.segments.push(current.segment());
                }
            }
        }
    }

    /// All segments, and the stamp of the first node.
    pub(super) fn finish(mut self) -> (Vec<Segment>, i64) {
        self.end_section();
        (self.segments, self.origin.unwrap_or(0))
    }
}

/// Marks the segments at rest; the gyro's bias by them, rad/s, where there are any.
pub(super) fn find_standstill(segments: &mut [Segment]) -> Option<Vector3<f64>> {
    let moving = |what: usize| -> Vec<f64> {
        segments
            .iter()
            .filter(|segment| !segment.is_break)
            .map(|segment| segment.spread[what])
            .collect()
    };
    let rate = (2.0 * fifth_percentile(moving(0))?).min(NOISY_RATE) + SLACK;
    let force = (1.6 * fifth_percentile(moving(1))?).min(STILL_FORCE) + SLACK;
    let mut quiet: Vec<bool> = segments
        .iter()
        .map(|segment| {
            let slow = segment.spread[0].min(segment.slow);
            let is_steady = segment.spread[0] < rate && slow < STILL_RATE + SLACK;
            !segment.is_break && is_steady && segment.spread[1] < force
        })
        .collect();
    let bias = rests::rate_of(segments, &quiet)?;
    for (quiet, segment) in quiet.iter_mut().zip(segments.iter()) {
        *quiet &= (segment.mean_rate - bias).norm() < STILL_MEAN;
    }
    // The log's ends and breaks have no neighbour on one side, and need the other.
    let beside = |i: Option<usize>| {
        i.and_then(|i| segments.get(i).filter(|s| !s.is_break).map(|_| quiet[i]))
    };
    let still: Vec<bool> = (0..segments.len())
        .map(|i| {
            let (before, after) = (beside(i.checked_sub(1)), beside(i.checked_add(1)));
            quiet[i] && before.or(after).is_some() && before != Some(false) && after != Some(false)
        })
        .collect();
    for (segment, still) in segments.iter_mut().zip(still) {
        segment.is_still = still;
    }
    median_rate(segments, |i| segments[i].is_still)
}

/// Median of the mean rates of the chosen segments, each axis.
pub(super) fn median_rate(
    segments: &[Segment],
    is_chosen: impl Fn(usize) -> bool,
) -> Option<Vector3<f64>> {
    let chosen: Vec<Vector3<f64>> = segments
        .iter()
        .enumerate()
        .filter(|(i, _)| is_chosen(*i))
        .map(|(_, segment)| segment.mean_rate)
        .collect();
    median_of(&chosen)
}

/// Median of each axis.
pub(super) fn median_of(vectors: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    if vectors.is_empty() {
        return None;
    }
    Some(Vector3::from_fn(|axis, _| {
        let mut values: Vec<f64> = vectors.iter().map(|vector| vector[axis]).collect();
        median(&mut values)
    }))
}

/// Fifth percentile, between the two nearest ranks in proportion.
fn fifth_percentile(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let place = 0.05 * (values.len().checked_sub(1)?) as f64;
    let (low, share) = (place.floor() as usize, place.fract());
    let a = *values.get(low)?;
    let b = *values.get(low + 1).unwrap_or(&a);
    Some(a + share * (b - a))
}
