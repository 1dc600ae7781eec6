//! Segments whose scatter is that of a body at rest -> those of them that are rests. Pure.
//!
//! A stage of its own because a body that turns steadily about the vertical scatters as little as one that rests. What
//! tells them apart is seen in runs of such segments: a bias does not drift within seconds, is the same in every rest,
//! and points anywhere; a turn that leaves gravity where it is points along it.

use super::segments::{STILL_MEAN, STILL_RATE, Segment, median_of, median_rate};
use crate::condition::stillness::{
    ALONG, BEYOND_CLASS, FEW_SECS, SAME, SHORT_MOST, SHORT_SECS, about_vertical, is_solely_vertical,
};
use nalgebra::Vector3;
use std::ops::Range;

/// Runs up to this long must not drift, s.
const LONGEST_JUDGED: f64 = 20.0;
/// A body has moved whose rate was another by this, rad/s (2 deg/s).
const MOVES: f64 = 0.0349;

/// Segments one after the other that scatter like a body at rest.
pub(super) struct Run {
    segments: Range<usize>,
    secs: f64,
    /// Mean rate, rad/s, and one standard deviation of each axis.
    pub(super) rate: Vector3<f64>,
    sigma: Vector3<f64>,
    up: Vector3<f64>,
    /// Whether the gyro scatters in it by more than a quiet one does.
    pub(super) is_noisy: bool,
}

/// The runs of the chosen segments.
fn runs_of(segments: &[Segment], is_chosen: impl Fn(usize) -> bool) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut first = 0;
    for i in 0..=segments.len() {
        if segments.get(i).is_some_and(|s| !s.is_break) && is_chosen(i) {
            continue;
        }
        if first < i {
            runs.push(Run::of(segments, first..i));
        }
        first = i + 1;
    }
    runs
}

/// The rests: runs of segments marked still.
pub(super) fn rests(segments: &[Segment]) -> Vec<Run> {
    runs_of(segments, |i| segments[i].is_still)
}

impl Run {
    fn of(segments: &[Segment], of: Range<usize>) -> Run {
        let all = &segments[of.clone()];
        let secs: f64 = all.iter().map(|segment| segment.secs).sum();
        let mean = |of: &dyn Fn(&Segment) -> Vector3<f64>| -> Vector3<f64> {
            let sum: Vector3<f64> = all.iter().map(|s| of(s) * s.secs).sum();
            sum / secs.max(f64::MIN_POSITIVE)
        };
        let one = scatter(all);
        Run {
            segments: of,
            secs,
            rate: mean(&|segment| segment.mean_rate),
            sigma: one / (all.len() as f64).sqrt(),
            up: mean(&|segment| segment.mean_force)
                .try_normalize(0.0)
                .unwrap_or_default(),
            is_noisy: all.iter().any(|segment| segment.spread[0] > STILL_RATE),
        }
    }

    fn along(&self) -> f64 {
        self.rate.dot(&self.up).abs()
    }

    /// Whether it points along gravity, as the rate of a turn does that leaves gravity where it is.
    fn is_along(&self) -> bool {
        about_vertical(&self.rate, &self.up).is_some()
    }

    /// Whether it is a turn about the vertical by its direction alone, since the body has done nothing else.
    fn is_turn_of_all(&self, segments: &[Segment]) -> bool {
        let moves = |s: &Segment| !s.is_break && (s.mean_rate - self.rate).norm() > MOVES;
        is_solely_vertical(&self.rate, &self.up) && !segments.iter().any(moves)
    }

    /// Whether two can be the rate of one bias.
    fn is_as(&self, other: &Run) -> bool {
        let off = self.rate - other.rate;
        (0..3).all(|i| off[i].abs() <= SAME + 3.0 * self.sigma[i].hypot(other.sigma[i]))
    }

    /// Whether the rate of its first half is not that of its second.
    fn drifts(&self, segments: &[Segment]) -> bool {
        let half = self.segments.len() / 2;
        if half == 0 || self.secs > LONGEST_JUDGED {
            return false;
        }
        let (start, end) = (self.segments.start, self.segments.end);
        let [a, b] = [start..start + half, end - half..end].map(|of| Run::of(segments, of));
        // The scatter of the whole run: that of two or three segments is no scatter.
        let sigma = scatter(&segments[self.segments.clone()]) * (2.0 / half as f64).sqrt();
        let off = a.rate - b.rate;
        (0..3).any(|i| off[i].abs() > SAME + 3.0 * sigma[i])
    }
}

/// One standard deviation of a segment's mean rate: by the differences of neighbours, which a drift is not in, and no
/// less than the noise of the samples leaves.
fn scatter(all: &[Segment]) -> Vector3<f64> {
    let white = all
        .iter()
        .map(|s| s.spread[0] / (s.samples.max(1) as f64).sqrt());
    let white = white.sum::<f64>() / all.len().max(1) as f64;
    let squares: Vector3<f64> = all
        .windows(2)
        .map(|pair| (pair[1].mean_rate - pair[0].mean_rate).map(|d| d * d))
        .sum();
    let pairs = 2.0 * (all.len().saturating_sub(1)).max(1) as f64;
    squares.map(|square| (square / pairs).sqrt().max(white))
}

/// The rate at rest of quiet segments, rad/s: the median; that of the slowest run where the median is faster by a turn
/// about the vertical, as of a body that turns steadily for longer than it rests.
pub(super) fn rate_of(segments: &[Segment], quiet: &[bool]) -> Option<Vector3<f64>> {
    let median = median_rate(segments, |i| quiet[i])?;
    let joined = |i: usize| {
        let before = i.checked_sub(1).filter(|i| quiet[*i]);
        quiet[i]
            && before.is_none_or(|before| {
                (segments[i].mean_rate - segments[before].mean_rate).norm() < STILL_MEAN
            })
    };
    let slowest = runs_of(segments, joined)
        .into_iter()
        .filter(|run| run.secs >= SHORT_SECS)
        .min_by(|a, b| a.along().total_cmp(&b.along()));
    Some(match slowest {
        Some(run) => {
            let off = median - run.rate;
            let along = off.dot(&run.up);
            let is_turn = (off - run.up * along).norm() * ALONG < along.abs();
            let is_slower = median.dot(&run.up).abs() > run.along() + STILL_MEAN;
            if is_turn && is_slower {
                run.rate
            } else {
                median
            }
        }
        None => median,
    })
}

/// Leaves of the still segments those that rest. `bias_sigma`: of the gyro's bias in the sensor's class. The gyro's
/// bias by them, rad/s, where there are any.
pub(super) fn keep_rests(segments: &mut [Segment], bias_sigma: f64) -> Option<Vector3<f64>> {
    let (mut kept, mut dropped): (Vec<Run>, Vec<Run>) =
        rests(segments).into_iter().partition(|run| {
            let is_beyond = run.is_along() && run.along() > BEYOND_CLASS * bias_sigma;
            let is_turning = is_beyond || run.is_turn_of_all(segments);
            !run.drifts(segments) && !is_turning
        });
    let secs: f64 = kept.iter().map(|run| run.secs).sum();
    if secs < FEW_SECS {
        let is_rest = |run: &Run| {
            let is_slow = !run.is_along() && run.along() <= SHORT_MOST;
            run.secs >= SHORT_SECS || is_slow && kept.iter().all(|other| run.is_as(other))
        };
        let is_rest: Vec<bool> = kept.iter().map(is_rest).collect();
        let mut is_rest = is_rest.into_iter();
        dropped.extend(kept.extract_if(.., |_| !is_rest.next().unwrap_or(true)));
    }
    for segment in dropped.into_iter().flat_map(|run| run.segments) {
        segments[segment].is_still = false;
    }
    let rates: Vec<Vector3<f64>> = segments
        .iter()
        .filter(|segment| segment.is_still)
        .map(|segment| segment.mean_rate)
        .collect();
    median_of(&rates)
}
