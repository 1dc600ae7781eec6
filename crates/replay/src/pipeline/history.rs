//! Samples and attitudes of a run -> what a report draws of them. Pure.
//!
//! Beside the outlet because it sees every attitude, but keeps few: see [`Traces`].

use crate::summary::series::{Drawn, Elapsed, Mark};
use crate::summary::trace::Traces;
use std::collections::VecDeque;
use strapd_attitude::aid::Innovation;
use strapd_attitude::condition::Clock;
use strapd_attitude::record::{AttitudeSample, Counts, Nanos, RawSample, Status, Verdict};

/// Rejected samples that wait for the attitude after them to find their place.
const WAITING: usize = 1 << 16;

/// Series of a run that are kept to be drawn.
#[derive(Debug)]
pub(super) struct History {
    clock: Clock,
    drawn: Drawn,
    lost: u64,
    not_finite: u64,
    last_raw: Option<Nanos>,
    rejected: VecDeque<(Nanos, Mark)>,
}

impl History {
    /// Makes it for stamps of `clock`, in at most `stretches` stretches of time.
    #[must_use]
    pub(super) fn new(clock: Clock, stretches: usize) -> History {
        History {
            clock,
            drawn: Drawn {
                stretches,
                series: Traces::new(stretches),
                innovations: Traces::new(stretches),
                marks: Mark::ALL.map(|_| Traces::new(stretches)).to_vec(),
                elapsed: Elapsed::default(),
                errors: None,
            },
            lost: 0,
            not_finite: 0,
            last_raw: None,
            rejected: VecDeque::new(),
        }
    }

    /// A sample (`None` = one that could not be decoded) was taken; `counts` are those after it.
    pub(super) fn took(&mut self, raw: Option<&RawSample>, counts: &Counts) {
        let stamp = raw.and_then(|raw| match self.clock {
            Clock::Header => raw.header,
            Clock::Log => Some(raw.log),
            Clock::Publish => Some(raw.publish),
            Clock::Index { .. } => None,
        });
        let lost = counts.lost();
        if lost == self.lost {
            self.last_raw = stamp.or(self.last_raw);
            return;
        }
        self.lost = lost;
        let not_finite = counts.get(Verdict::NotFinite);
        let mark = if not_finite > self.not_finite {
            self.last_raw = stamp.or(self.last_raw);
            Mark::NotFinite
        } else {
            // Its stamp may be what is wrong with it.
            Mark::Lost
        };
        self.not_finite = not_finite;
        if self.rejected.len() < WAITING {
            let at = self.last_raw.or(stamp).unwrap_or_default();
            self.rejected.push_back((at, mark));
        }
    }

    /// Takes attitudes, in order.
    pub(super) fn add(&mut self, samples: &[AttitudeSample]) {
        for sample in samples {
            self.add_one(sample);
        }
    }

    /// Takes what corrected the attitudes added so far.
    pub(super) fn corrected(&mut self, innovations: &[(Nanos, Innovation)]) {
        for (stamp, innovation) in innovations {
            let [(x, sigma), (y, _)] = innovation.gravity;
            let (heading, of_heading) = innovation.heading;
            let at = self.drawn.elapsed.at(*stamp);
            let values = [x, y, 3.0 * sigma, heading, 3.0 * of_heading];
            self.drawn.innovations.push(at, values.map(f64::to_degrees));
        }
    }

    fn add_one(&mut self, sample: &AttitudeSample) {
        let before = self.drawn.elapsed.x();
        let at = self.drawn.elapsed.advance(sample.stamp);
        while let Some((stamp, mark)) = self.rejected.front().copied()
            && stamp <= sample.stamp
        {
            self.rejected.pop_front();
            let place = self.drawn.elapsed.at(stamp).clamp(before, at);
            self.mark(mark, place, 0);
        }
        let status = sample.status;
        if status != Status::OK {
            let gap = at - before;
            for (bit, mark, from, length) in [
                (Status::BRIDGED, Mark::Bridged, before, gap),
                (Status::HELD, Mark::Held, before, gap),
                (Status::RESET, Mark::Reset, before, gap),
                (Status::SATURATED, Mark::Saturated, at, 0),
                (Status::UNDERSAMPLED, Mark::Saturated, at, 0),
                (Status::REORDERED, Mark::Moved, at, 0),
                (Status::RESTAMPED, Mark::Moved, at, 0),
            ] {
                if status.has(bit) {
                    self.mark(mark, from, length);
                }
            }
            if status.has(Status::HELD.with(Status::RESET)) {
                self.drawn.series.interrupt();
            }
        }
        let angles = sample.q_nb.yaw_pitch_roll();
        let [x, y, z]: [f64; 3] = sample.rate.into();
        let p = sample.covariance.in_navigation_axes(&sample.q_nb);
        self.drawn.series.push(
            at,
            [
                x,
                y,
                z,
                angles.roll,
                angles.pitch,
                angles.yaw,
                p.m11.max(p.m22).sqrt(),
                p.m33.sqrt(),
            ]
            .map(f64::to_degrees),
        );
    }

    fn mark(&mut self, mark: Mark, at: i64, length: i64) {
        if let Some(marks) = self.drawn.marks.get_mut(mark as usize) {
            marks.push(at, [length as f64]);
        }
    }

    /// Ends it: no more samples.
    #[must_use]
    pub(super) fn finish(mut self) -> Drawn {
        let end = self.drawn.elapsed.x();
        while let Some((_, mark)) = self.rejected.pop_front() {
            self.mark(mark, end, 0);
        }
        self.drawn
    }
}
