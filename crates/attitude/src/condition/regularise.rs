//! RateSample -> RateSample with evenly spaced stamps, on request (`--regularise-stamps`). Pure.
//!
//! A stage of its own because it replaces what was recorded by what must have been: a sensor with a
//! clock of its own samples evenly, and what jitters is how its samples were stamped. Then a straight
//! line through the stamps is worth a factor of thousands (5 % of a step of stamp noise: 7000 arcsec
//! after a minute whatever the integrator's order, 0.2 behind the line; `docs/theory/attitude.md` 6.4).
//! Where the sampling itself jitters and the stamps are true, the same line does that harm. No
//! statistic of the stamps tells the two apart, so this is never done unasked.
//!
//! ```text
//! recorded: RateSample -> count -> line (a pass over the whole log) -> Lines
//!           RateSample -> count -> Lines -> RateSample              (the next pass)
//! live:     RateSample -> tracker -> RateSample                     (causal: nothing waits)
//! ```
//!
//! A segment ends where conditioning holds or resets (gaps beyond `max_gap`, clock jumps), where
//! eight stamps in a row are more than half a step off (a changed rate, a lost count), and, offline,
//! where one line no longer fits: Chow's test on blocks of 256 samples (`line`). Memory:
//! 56 bytes per segment, at most a hundred thousand of them.

mod count;
mod line;
mod survey;
mod tracker;

pub use self::survey::{Lines, Survey, Uneven};
use super::histogram::Histogram;
use crate::record::{Join, Nanos, RateSample, SampleKind};
use count::{Counted, Counter};
use std::sync::Arc;
use tracker::Tracker;

/// Segments reported one by one.
const SEGMENTS_KEPT: usize = 1000;
/// Jitter, as rms over the step, above which samples cannot be counted by their stamps. A stamp is
/// believed within half a step of its instant, so that jitter of any size is measured as 0.29 at most
/// (even over the step).
const TOO_MUCH_JITTER: f64 = 0.25;
/// Part of the samples that may be more than half a step off, or doubtfully counted. Normal
/// jitter of a quarter step has 4.6 % there.
const TOO_MANY_DOUBTS: f64 = 0.05;
/// Fewest samples that can be found uneven.
const ENOUGH: u64 = 64;
/// Live: samples after which a stamp half a step off is one, and so many in a row a lost count.
const SETTLED: u32 = 16;
const LOST: u32 = 8;

/// Meaning of a sample's value when its interval changes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Value {
    /// A rate at an instant: it has no interval.
    Rate,
    /// An angle the sensor measured over its own interval: it stays.
    Angle,
    /// A mean rate times the interval between two stamps: it goes with that.
    MeanTimesInterval,
}

impl Value {
    /// Meaning for samples of a kind; `states_interval` = the messages say how long they integrated.
    #[must_use]
    pub fn of(kind: SampleKind, states_interval: bool) -> Value {
        match kind {
            SampleKind::Rate => Value::Rate,
            SampleKind::Average if !states_interval => Value::MeanTimesInterval,
            SampleKind::Average | SampleKind::DeltaAngle | SampleKind::Rotation => Value::Angle,
        }
    }
}

/// A stretch of constant rate, as regularised.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Segment {
    /// First new stamp.
    pub start: Nanos,
    /// Samples in it.
    pub samples: u64,
    /// Hz; live: the newest estimate. `None` where there were too few samples for one.
    pub rate_hz: Option<f64>,
}

/// Report of what was done.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Report {
    /// Samples that went through.
    pub samples: u64,
    /// Stretches of constant rate; all are counted, the first thousand kept.
    pub segments: u64,
    /// The first of them.
    pub kept: Vec<Segment>,
    /// Jitter removed (recorded minus new stamp), rms, ns.
    pub rms_nanos: f64,
    /// 99th percentile of the moves, ns (3 %).
    pub p99_nanos: f64,
    /// The largest, ns.
    pub max_nanos: i64,
    /// rms over the step.
    pub jitter: f64,
    /// Samples that could belong to another instant.
    pub ambiguous: u64,
}

impl Report {
    /// Whether this was no even clock after all (a stream is judged by its beginning only).
    #[must_use]
    pub fn is_uneven(&self) -> bool {
        self.samples >= ENOUGH
            && (self.jitter > TOO_MUCH_JITTER
                || self.ambiguous as f64 > TOO_MANY_DOUBTS * self.samples as f64)
    }
}

/// Gives samples their new stamps.
#[derive(Clone, Debug)]
pub struct Regulariser {
    value: Value,
    how: How,
    counted: Vec<Counted>,
    /// Recorded and new stamp of the sample before.
    before: Option<(Nanos, Nanos)>,
    report: Report,
    sum_squares: f64,
    sum_relative: f64,
    moved: Histogram,
}

#[derive(Clone, Debug)]
enum How {
    Lines {
        lines: Arc<Lines>,
        counter: Counter,
        current: usize,
        number: u64,
    },
    Causal {
        tracker: Option<Tracker>,
        astray: u32,
    },
}

impl Regulariser {
    /// Makes one that uses the lines a [`Survey`] of the very same samples found.
    #[must_use]
    pub fn by_lines(lines: Arc<Lines>, value: Value) -> Regulariser {
        Regulariser::new(
            value,
            How::Lines {
                lines,
                counter: Counter::default(),
                current: 0,
                number: 0,
            },
        )
    }

    /// Makes one for stamps as they come: a new stamp depends on those before it alone, and nothing waits.
    #[must_use]
    pub fn causal(value: Value) -> Regulariser {
        Regulariser::new(
            value,
            How::Causal {
                tracker: None,
                astray: 0,
            },
        )
    }

    fn new(value: Value, how: How) -> Regulariser {
        Regulariser {
            value,
            how,
            counted: Vec::new(),
            before: None,
            report: Report::default(),
            sum_squares: 0.0,
            sum_relative: 0.0,
            moved: Histogram::new(),
        }
    }

    /// Whether nothing waits.
    #[must_use]
    pub(crate) fn is_causal(&self) -> bool {
        matches!(self.how, How::Causal { .. })
    }

    /// Takes the next conditioned samples and appends those that are ready.
    pub fn push(&mut self, samples: &[RateSample], out: &mut Vec<RateSample>) {
        for sample in samples {
            match &mut self.how {
                How::Lines { counter, .. } => {
                    counter.push(sample, &mut self.counted);
                    self.place(out);
                }
                How::Causal { .. } => self.follow(sample, out),
            }
        }
    }

    /// The stream has ended.
    pub fn finish(&mut self, out: &mut Vec<RateSample>) {
        if let How::Lines { counter, .. } = &mut self.how {
            counter.close(&mut self.counted);
            self.place(out);
        }
    }

    /// Report of what was done so far.
    #[must_use]
    pub fn report(&self) -> Report {
        let n = self.report.samples.max(1) as f64;
        Report {
            rms_nanos: (self.sum_squares / n).sqrt(),
            jitter: (self.sum_relative / n).sqrt(),
            p99_nanos: self.moved.quantile(0.99),
            max_nanos: self.moved.max(),
            ..self.report.clone()
        }
    }

    /// Offline: puts counted samples on their lines.
    fn place(&mut self, out: &mut Vec<RateSample>) {
        let mut counted = std::mem::take(&mut self.counted);
        for counted in counted.drain(..) {
            let How::Lines {
                lines,
                current,
                number,
                ..
            } = &mut self.how
            else {
                return;
            };
            let mut begins = *number == 0;
            while lines
                .lines
                .get(*current + 1)
                .is_some_and(|next| next.from <= *number)
            {
                *current += 1;
                begins = true;
            }
            *number += 1;
            let line = lines.lines.get(*current);
            let step = line.map(|l| l.step).filter(|step| *step > 0.0);
            let stamp = line.and_then(|l| l.stamp(counted.index));
            self.report.ambiguous += u64::from(counted.is_doubtful);
            self.retime(&counted.sample, stamp, begins, step, out);
        }
        self.counted = counted;
    }

    /// Live.
    fn follow(&mut self, sample: &RateSample, out: &mut Vec<RateSample>) {
        let How::Causal { tracker, astray } = &mut self.how else {
            return;
        };
        let stamp = sample.stamp.0;
        let goes_back = self.before.is_some_and(|(raw, _)| sample.stamp <= raw);
        let breaks = goes_back || matches!(sample.join, Join::Start | Join::Hold | Join::Reset);
        let mut begins = false;
        let mut doubtful = false;
        let now = match tracker {
            Some(now) if !breaks => {
                let ahead = match sample.join {
                    Join::Bridge if now.step() > 0.0 => nanos(now.steps_to(stamp)).max(1),
                    _ => 1,
                };
                let off = now.off(stamp, ahead);
                let is_astray = now.seen() >= SETTLED && off.abs() > count::ASTRAY * now.step();
                doubtful = is_astray
                    || (sample.join == Join::Bridge && off.abs() > count::DOUBTFUL * now.step());
                if !is_astray {
                    *astray = 0;
                    now.advance(off, ahead);
                } else if *astray + 1 < LOST {
                    *astray += 1;
                    now.coast(ahead);
                } else {
                    *astray = 0;
                    begins = true;
                    *now = Tracker::at(stamp);
                }
                *now
            }
            _ => {
                *astray = 0;
                begins = true;
                *tracker.insert(Tracker::at(stamp))
            }
        };
        self.report.ambiguous += u64::from(doubtful);
        let step = Some(now.step()).filter(|step| *step > 0.0);
        self.retime(sample, Some(now.instant()), begins, step, out);
    }

    /// Gives one sample its stamp, and its interval the start that goes with it.
    fn retime(
        &mut self,
        sample: &RateSample,
        stamp: Option<i64>,
        begins: bool,
        step: Option<f64>,
        out: &mut Vec<RateSample>,
    ) {
        let mut new = Nanos(stamp.unwrap_or(sample.stamp.0));
        let breaks = matches!(sample.join, Join::Start | Join::Hold | Join::Reset);
        // Lines that meet, and a young tracker, may differ by a little; time goes on all the same.
        // Behind a clock that was set back it does not.
        let goes_back = self.before.is_some_and(|(raw, _)| sample.stamp <= raw);
        let floor = self.before.filter(|_| !(breaks && goes_back));
        if let Some((_, before)) = floor {
            new = new.max(Nanos(before.0.saturating_add(1)));
        }
        let length = sample.stamp.since(sample.start);
        let start = match (self.value, self.before) {
            (Value::Rate, _) => new,
            (_, Some((raw, before))) if sample.start == raw && !breaks => before,
            _ => {
                let own = Nanos(new.0.saturating_sub(length));
                floor.map_or(own, |(_, before)| own.max(before))
            }
        };
        let gyro = match self.value {
            Value::MeanTimesInterval if length > 0 => sample
                .gyro
                .with(sample.gyro.as_vector() * (new.since(start) as f64 / length as f64)),
            _ => sample.gyro,
        };
        self.before = Some((sample.stamp, new));
        self.note(sample.stamp.since(new), new, begins, step);
        out.push(RateSample {
            stamp: new,
            start,
            gyro,
            ..*sample
        });
    }

    fn note(&mut self, moved: i64, new: Nanos, begins: bool, step: Option<f64>) {
        let report = &mut self.report;
        report.samples += 1;
        if begins {
            report.segments += 1;
            if report.kept.len() < SEGMENTS_KEPT {
                report.kept.push(Segment {
                    start: new,
                    samples: 0,
                    rate_hz: None,
                });
            }
        }
        if report.segments == report.kept.len() as u64
            && let Some(segment) = report.kept.last_mut()
        {
            segment.samples += 1;
            segment.rate_hz = step.map(|step| 1e9 / step);
        }
        self.moved.add(moved.saturating_abs());
        self.sum_squares += (moved as f64).powi(2);
        self.sum_relative += step.map_or(0.0, |step| (moved as f64 / step).powi(2));
    }
}

/// The nearest whole nanosecond (or step), saturating; 0 for NaN.
fn nanos(x: f64) -> i64 {
    x.round() as i64
}
