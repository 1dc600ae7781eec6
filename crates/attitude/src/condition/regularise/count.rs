//! RateSample -> at which multiple of an even step it belongs. Pure.
//!
//! A stage of its own because counting is what can go wrong: a line through wrongly counted samples
//! is worse than the stamps it replaces. A sample follows its predecessor by one step unless
//! conditioning found samples missing between them; then the stamp decides, against the phase of all
//! samples so far and not of one jittery predecessor. A stamp more than half a step off its instant
//! tells nothing; so many of them in a row that the count or the rate must have been lost
//! begin a new segment.

use super::tracker::Tracker;
use super::{line, nanos};
use crate::record::{Join, RateSample};

/// Samples from which a segment's step is first known.
const OPENING: usize = 32;
/// Stamps in a row, each more than half a step off, after which the count was lost.
const LOST: usize = 8;
/// Off by more of a step, a stamp beside missing samples could belong to a neighbouring instant.
pub(super) const DOUBTFUL: f64 = 0.3;
/// Off by more of a step, a stamp tells nothing about its instant.
pub(super) const ASTRAY: f64 = 0.5;

/// A sample and its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Counted {
    pub(super) sample: RateSample,
    /// Whether a segment begins with it.
    pub(super) begins: bool,
    /// Steps since the segment's first sample.
    pub(super) index: i64,
    /// Whether its stamp is near enough to its instant to take part in a fit.
    pub(super) tells: bool,
    /// Whether it could belong to another index.
    pub(super) is_doubtful: bool,
}

/// Counts the samples of one stream. Each comes out once, in order, at most `OPENING + LOST` later.
#[derive(Clone, Debug, Default)]
pub(super) struct Counter {
    opening: Vec<RateSample>,
    tracker: Option<Tracker>,
    index: i64,
    /// Off by more than half a step, with their steps.
    astray: Vec<(RateSample, i64)>,
    last: Option<i64>,
}

impl Counter {
    pub(super) fn push(&mut self, sample: &RateSample, out: &mut Vec<Counted>) {
        let breaks = matches!(sample.join, Join::Start | Join::Hold | Join::Reset)
            || self.last.is_none_or(|last| sample.stamp.0 <= last);
        self.last = Some(sample.stamp.0);
        if breaks {
            self.close(out);
        }
        match self.tracker {
            None => {
                self.opening.push(*sample);
                if self.opening.len() == OPENING {
                    self.open(out);
                }
            }
            Some(tracker) => self.follow(tracker, sample, out),
        }
    }

    /// Closes the segment: no more samples, or none of this segment.
    pub(super) fn close(&mut self, out: &mut Vec<Counted>) {
        self.open(out);
        self.release(out);
        self.tracker = None;
    }

    /// The first samples of a segment: the line through them, counted by their typical step.
    fn open(&mut self, out: &mut Vec<Counted>) {
        let opening = std::mem::take(&mut self.opening);
        let Some(first) = opening.first() else {
            return;
        };
        let mut steps: Vec<i64> = opening
            .windows(2)
            .filter(|pair| pair[1].join != Join::Bridge)
            .map(|pair| pair[1].stamp.since(pair[0].stamp))
            .collect();
        let middle = steps.len() / 2;
        let step = match steps.is_empty() {
            true => 1,
            false => *steps.select_nth_unstable(middle).1,
        };
        let step = step.max(1) as f64;
        let mut index = 0;
        let mut before = first.stamp;
        let mut points = Vec::with_capacity(opening.len());
        for (i, sample) in opening.iter().enumerate() {
            let steps = sample.stamp.since(before) as f64 / step;
            let ahead = match sample.join {
                _ if i == 0 => 0,
                Join::Bridge => whole(steps),
                _ => 1,
            };
            index += ahead;
            before = sample.stamp;
            points.push((index, sample.stamp.since(first.stamp)));
            out.push(Counted {
                sample: *sample,
                begins: i == 0,
                index,
                tells: true,
                is_doubtful: ahead > 1 && (steps - ahead as f64).abs() > DOUBTFUL,
            });
        }
        let (at, slope) = line::near(&points, ASTRAY * step).unwrap_or((0.0, step));
        let seen = u32::try_from(points.len()).unwrap_or(u32::MAX);
        let from = out.len() - points.len();
        for (counted, (index, t)) in out.iter_mut().skip(from).zip(&points) {
            let off = *t as f64 - at - slope * *index as f64;
            counted.tells = off.abs() <= ASTRAY * step;
            counted.is_doubtful |= !counted.tells;
        }
        let phase = at + slope * index as f64;
        let slope = if slope > 0.0 { slope } else { step };
        self.index = index;
        self.tracker = Some(Tracker::on_line(first.stamp.0, phase, slope, seen));
    }

    fn follow(&mut self, mut tracker: Tracker, sample: &RateSample, out: &mut Vec<Counted>) {
        let behind: i64 = self.astray.iter().map(|(_, ahead)| ahead).sum();
        let ahead = match sample.join {
            Join::Bridge => (whole(tracker.steps_to(sample.stamp.0)).saturating_sub(behind)).max(1),
            _ => 1,
        };
        let off = tracker.off(sample.stamp.0, behind + ahead);
        if off.abs() > ASTRAY * tracker.step() {
            self.astray.push((*sample, ahead));
            if self.astray.len() == LOST {
                self.opening = self.astray.drain(..).map(|(sample, _)| sample).collect();
                self.tracker = None;
            }
            return;
        }
        self.release(out);
        tracker.advance(off, behind + ahead);
        // A step that is none cannot be counted in.
        if tracker.step() > 0.0 {
            self.tracker = Some(tracker);
        }
        self.index += ahead;
        out.push(Counted {
            sample: *sample,
            begins: false,
            index: self.index,
            tells: true,
            is_doubtful: sample.join == Join::Bridge && off.abs() > DOUBTFUL * tracker.step(),
        });
    }

    /// Releases those astray: the ones after them are where they should be.
    fn release(&mut self, out: &mut Vec<Counted>) {
        for (sample, ahead) in self.astray.drain(..) {
            self.index += ahead;
            out.push(Counted {
                sample,
                begins: false,
                index: self.index,
                tells: false,
                is_doubtful: true,
            });
        }
    }
}

/// The nearest whole number of steps, at least one.
fn whole(steps: f64) -> i64 {
    nanos(steps).max(1)
}
