//! (index, stamp) -> straight lines, and where one line no longer fits. Pure.
//!
//! A stage of its own because it is ordinary statistics. Points are gathered in blocks; a block
//! joins the segment before it unless one line through both fits worse than one through each, by
//! more than jitter explains.

use super::count::Counted;

/// Samples of a block.
const BLOCK: usize = 256;
/// Fewest samples at a segment's end that are judged by themselves.
const FEWEST: usize = 32;
/// Chow's statistic above which two blocks are two lines. With two and many degrees of freedom an even
/// clock with independent jitter reaches it once in 3e6 blocks; two lines that are apart by a
/// third of the jitter's rms over a block reach it.
const TWO_LINES: f64 = 15.0;
/// Jitter below this part of the step, and below a nanosecond, is none: rounding must not part lines.
const NO_JITTER: f64 = 1e-5;
/// Indices a line spans: beyond, sums would lose digits, and no crystal keeps one rate for 16 million samples.
const LONGEST: i64 = 1 << 24;

/// Least squares: value at index 0, and slope. `None` below two points apart.
pub(super) fn through(points: &[(i64, i64)]) -> Option<(f64, f64)> {
    let mut all = Moments::default();
    for (n, t) in points {
        all.push(*n as f64, *t as f64);
    }
    (all.nn > 0.0).then(|| {
        let slope = all.nd / all.nn;
        (all.d - slope * all.n, slope)
    })
}

/// The same through the points that lie within `limit` of it, found by leaving out what is far off
/// three times over: one stamp that is late by ten steps would tilt a line through thirty.
pub(super) fn near(points: &[(i64, i64)], limit: f64) -> Option<(f64, f64)> {
    let mut kept = points.to_vec();
    let mut found = through(&kept)?;
    for _ in 0..3 {
        let (at, slope) = found;
        let off = |(n, t): &(i64, i64)| *t as f64 - at - slope * *n as f64;
        let rms = (kept.iter().map(|p| off(p).powi(2)).sum::<f64>() / kept.len() as f64).sqrt();
        kept.retain(|p| off(p).abs() <= limit.max(3.0 * rms));
        found = through(&kept)?;
    }
    Some(found)
}

/// Means and central moments of points (Welford 1962, merged as Chan, Golub, LeVeque 1979).
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    count: f64,
    n: f64,
    d: f64,
    nn: f64,
    nd: f64,
    dd: f64,
}

impl Moments {
    fn push(&mut self, n: f64, d: f64) {
        self.count += 1.0;
        let (dn, dd) = (n - self.n, d - self.d);
        self.n += dn / self.count;
        self.d += dd / self.count;
        self.nn += dn * (n - self.n);
        self.nd += dn * (d - self.d);
        self.dd += dd * (d - self.d);
    }

    fn merged(&self, other: &Moments) -> Moments {
        let count = self.count + other.count;
        if self.count == 0.0 || other.count == 0.0 {
            return if self.count == 0.0 { *other } else { *self };
        }
        let (dn, dd) = (other.n - self.n, other.d - self.d);
        let weight = self.count * other.count / count;
        Moments {
            count,
            n: self.n + dn * other.count / count,
            d: self.d + dd * other.count / count,
            nn: self.nn + other.nn + dn * dn * weight,
            nd: self.nd + other.nd + dn * dd * weight,
            dd: self.dd + other.dd + dd * dd * weight,
        }
    }

    /// Sum of squared distances from the line.
    fn rest(&self) -> f64 {
        if self.nn > 0.0 {
            (self.dd - self.nd * self.nd / self.nn).max(0.0)
        } else {
            self.dd
        }
    }
}

/// A straight line through stamps.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Line {
    /// Samples before the first it holds for, in the whole stream.
    pub(super) from: u64,
    /// Sample from which its index is counted.
    pub(super) first: i64,
    /// Whole nanoseconds its stamps are counted from.
    pub(super) origin: i64,
    /// Stamp at `first`, after `origin`.
    pub(super) at: f64,
    /// Nanoseconds per index; 0 where there were too few samples for a line.
    pub(super) step: f64,
    /// Samples it was laid through.
    pub(super) samples: u64,
    /// Sum of their squared distances from it, ns^2.
    pub(super) rest: f64,
}

impl Line {
    /// The stamp at an index; `None` where there is no line.
    pub(super) fn stamp(&self, index: i64) -> Option<i64> {
        let after = self.at + index.saturating_sub(self.first) as f64 * self.step;
        (self.step > 0.0).then(|| self.origin.saturating_add(super::nanos(after)))
    }
}

/// A segment being fitted. Distances are taken from a line that is nearly it already, so that sums of
/// squares keep their digits.
#[derive(Clone, Debug)]
struct Segment {
    from: u64,
    first: i64,
    origin: i64,
    step: f64,
    all: Moments,
}

impl Segment {
    /// Begins a segment with its first block, which begins with sample `from` of the stream.
    fn new(from: u64, points: &[(u64, i64, i64)]) -> Option<Segment> {
        let (_, first, origin) = *points.first()?;
        let shifted: Vec<(i64, i64)> = points
            .iter()
            .map(|(_, n, t)| (n - first, t.saturating_sub(origin)))
            .collect();
        let step = through(&shifted).map_or(0.0, |(_, step)| step);
        let mut segment = Segment {
            from,
            first,
            origin,
            step,
            all: Moments::default(),
        };
        segment.all = segment.moments(points);
        Some(segment)
    }

    fn moments(&self, points: &[(u64, i64, i64)]) -> Moments {
        let mut moments = Moments::default();
        for (_, n, t) in points {
            let n = n - self.first;
            let t = t.saturating_sub(self.origin) as f64;
            moments.push(n as f64, t - n as f64 * self.step);
        }
        moments
    }

    /// Whether one line fits both this segment and the block (Chow, Econometrica 28 (1960) 591).
    fn goes_on_with(&self, block: &Moments) -> bool {
        let together = self.all.merged(block).rest();
        let apart = self.all.rest() + block.rest();
        let freedom = (self.all.count + block.count - 4.0).max(1.0);
        let variance = (apart / freedom).max(1.0 + (NO_JITTER * self.step).powi(2));
        (together - apart) / 2.0 <= TWO_LINES * variance
    }

    fn line(&self) -> Line {
        let slope = if self.all.nn > 0.0 {
            self.all.nd / self.all.nn
        } else {
            0.0
        };
        let enough = self.all.count >= 3.0 && self.step > 0.0;
        Line {
            from: self.from,
            first: self.first,
            origin: self.origin,
            at: self.all.d - slope * self.all.n,
            step: if enough { self.step + slope } else { 0.0 },
            samples: self.all.count as u64,
            rest: self.all.rest(),
        }
    }
}

/// Lays lines through counted samples.
#[derive(Clone, Debug, Default)]
pub(super) struct Fitter {
    segment: Option<Segment>,
    /// (number in the stream, index, stamp)
    block: Vec<(u64, i64, i64)>,
    /// First sample of the segment that the block may begin.
    from: u64,
    seen: u64,
    pub(super) lines: Vec<Line>,
}

impl Fitter {
    pub(super) fn push(&mut self, counted: &Counted) {
        let number = self.seen;
        self.seen += 1;
        if counted.begins {
            self.close();
            self.from = number;
        }
        if self.block.is_empty() && self.segment.is_some() {
            self.from = number;
        }
        if counted.tells {
            self.block
                .push((number, counted.index, counted.sample.stamp.0));
        }
        if self.block.len() == BLOCK {
            self.end_block();
        }
    }

    fn end_block(&mut self) {
        let block = std::mem::take(&mut self.block);
        let Some(last) = block.last() else { return };
        match &mut self.segment {
            Some(segment) => {
                let moments = segment.moments(&block);
                let is_short = last.1.saturating_sub(segment.first) < LONGEST;
                if block.len() < FEWEST || (is_short && segment.goes_on_with(&moments)) {
                    segment.all = segment.all.merged(&moments);
                } else {
                    self.lines.push(segment.line());
                    self.segment = Segment::new(self.from, &block);
                }
            }
            None => self.segment = Segment::new(self.from, &block),
        }
        self.block = block;
        self.block.clear();
    }

    pub(super) fn close(&mut self) {
        self.end_block();
        if let Some(segment) = self.segment.take() {
            self.lines.push(segment.line());
        }
    }
}
