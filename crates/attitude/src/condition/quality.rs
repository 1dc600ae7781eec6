//! RawSample -> what can be said about the recording. Pure.
//!
//! A stage of its own, beside the conditioner and before it, because advice about units, axes
//! and clocks must come from the samples as they were recorded, before any setting was applied.

mod advice;
mod gravity;
mod summary;

pub use advice::Advice;
pub use gravity::GyroAgainstGravity;
pub use summary::{AxisStats, GravityAxis, OffsetStats, QualitySummary, SpacingStats};

use super::clock::Clock;
use super::histogram::Histogram;
use crate::record::{Nanos, RawSample};
use advice::NEAR_ONE;
use gravity::GravityTrack;
use nalgebra::Vector3;

/// Samples from which the step is learnt that jitter is measured against.
const PRIMING: usize = 64;
/// Length of the windows in which the quietest is looked for, and fewest samples in one.
const WINDOW_NANOS: i64 = 500_000_000;
const WINDOW_SAMPLES: u64 = 8;
/// A step longer than an hour, nanoseconds, is a clock that was set, or another recording: no samples are missing in
/// it.
pub const LONGEST_GAP_NANOS: i64 = 3_600_000_000_000;

/// Streaming statistics of one topic, in the units and axes of the source. Bounded memory (about
/// 70 kB), and the same numbers however the samples come in blocks.
#[derive(Clone, Debug)]
pub struct Quality {
    clock: Clock,
    count: u64,
    no_stamp: u64,
    first: Option<Nanos>,
    last: Option<Nanos>,
    high: Option<Nanos>,
    primer: Vec<i64>,
    nominal: Option<i64>,
    spacing: Histogram,
    jitter: Histogram,
    duplicates: u64,
    /// Number of these with other data.
    collisions: u64,
    /// Different samples on the newest stamp.
    sharing: i64,
    disorder: u64,
    gaps: u64,
    missing: u64,
    longest_gap: i64,
    /// The newest hole: between which stamps, and how many samples are still missing in it.
    hole: Option<(Nanos, Nanos, u64)>,
    no_gyro: u64,
    not_finite: u64,
    zero_rows: u64,
    /// Number of these between two that are not.
    lone_zero_rows: u64,
    last_row_lone_zero: bool,
    repeated_rows: u64,
    /// Samples above [`advice::DEGREES_ABOVE`] and below nonsense.
    fast_rows: u64,
    axes: [Axis; 3],
    previous: Option<[f64; 3]>,
    accel_count: u64,
    accel_not_finite: u64,
    /// Number of lengths near 1, and near 1000.
    near_one: u64,
    near_thousand: u64,
    orientations: u64,
    first_orientation: Option<[f64; 4]>,
    orientation_varies: bool,
    intervals: u64,
    offset: Offset,
    window: Window,
    gravity: GravityTrack,
    quietest: Option<Quiet>,
}

/// One gyro axis, over finite samples.
#[derive(Clone, Copy, Debug)]
struct Axis {
    min: f64,
    max: f64,
    sum: f64,
    sum_squares: f64,
    count: u64,
    /// Samples at the largest magnitude so far, the longest run of them while the other axes moved,
    /// and the run under way.
    at_peak: u64,
    longest_at_peak: u64,
    run_at_peak: u64,
    peak: f64,
    /// Samples in a row with this value, and the longest such run.
    run: u64,
    longest_run: u64,
    last: f64,
}

impl Axis {
    const EMPTY: Axis = Axis {
        min: f64::INFINITY,
        max: f64::NEG_INFINITY,
        sum: 0.0,
        sum_squares: 0.0,
        count: 0,
        at_peak: 0,
        longest_at_peak: 0,
        run_at_peak: 0,
        peak: 0.0,
        run: 0,
        longest_run: 0,
        last: f64::NAN,
    };

    /// `held`: the whole row repeats the one before, so nothing moved.
    fn push(&mut self, v: f64, held: bool) {
        self.min = self.min.min(v);
        self.max = self.max.max(v);
        self.sum += v;
        self.sum_squares += v * v;
        self.count += 1;
        let size = v.abs();
        if size > self.peak {
            self.peak = size;
            self.at_peak = 1;
            self.run_at_peak = 1;
            self.longest_at_peak = 1;
        } else if size == self.peak {
            self.at_peak += 1;
            self.run_at_peak = match (v == self.last, held) {
                (true, false) => self.run_at_peak + 1,
                (true, true) => self.run_at_peak,
                (false, _) => 1,
            };
            self.longest_at_peak = self.longest_at_peak.max(self.run_at_peak);
        } else {
            self.run_at_peak = 0;
        }
        self.run = if v == self.last { self.run + 1 } else { 1 };
        self.longest_run = self.longest_run.max(self.run);
        self.last = v;
    }
}

/// Least squares of (clock - log time) against log time, both from the first sample, in seconds.
#[derive(Clone, Copy, Debug, Default)]
struct Offset {
    origin: Option<(i64, i64)>,
    n: f64,
    mean_t: f64,
    mean_d: f64,
    tt: f64,
    td: f64,
    min: i64,
    max: i64,
}

impl Offset {
    fn push(&mut self, stamp: Nanos, log: Nanos) {
        let difference = stamp.since(log);
        let (log0, difference0) = *self.origin.get_or_insert((log.0, difference));
        if self.n == 0.0 {
            self.min = difference;
            self.max = difference;
        }
        self.min = self.min.min(difference);
        self.max = self.max.max(difference);
        let t = log.since(Nanos(log0)) as f64 * 1e-9;
        let d = difference.saturating_sub(difference0) as f64 * 1e-9;
        self.n += 1.0;
        let dt = t - self.mean_t;
        self.mean_t += dt / self.n;
        let dd = d - self.mean_d;
        self.mean_d += dd / self.n;
        self.tt += dt * (t - self.mean_t);
        self.td += dt * (d - self.mean_d);
    }
}

/// Sums over half a second.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    start: Option<Nanos>,
    n: u64,
    mean: Vector3<f64>,
    m2: Vector3<f64>,
    accel_n: u64,
    accel: Vector3<f64>,
}

/// The quietest half second so far.
#[derive(Clone, Copy, Debug)]
struct Quiet {
    start: Nanos,
    deviation: f64,
    mean: Vector3<f64>,
    accel: Option<Vector3<f64>>,
}

impl Quality {
    /// Statistics with time taken from `clock`.
    #[must_use]
    pub fn new(clock: Clock) -> Self {
        Quality {
            clock,
            count: 0,
            no_stamp: 0,
            first: None,
            last: None,
            high: None,
            primer: Vec::new(),
            nominal: None,
            spacing: Histogram::new(),
            jitter: Histogram::new(),
            duplicates: 0,
            collisions: 0,
            sharing: 1,
            disorder: 0,
            gaps: 0,
            missing: 0,
            longest_gap: 0,
            hole: None,
            no_gyro: 0,
            not_finite: 0,
            zero_rows: 0,
            lone_zero_rows: 0,
            last_row_lone_zero: false,
            repeated_rows: 0,
            fast_rows: 0,
            axes: [Axis::EMPTY; 3],
            previous: None,
            accel_count: 0,
            accel_not_finite: 0,
            near_one: 0,
            near_thousand: 0,
            orientations: 0,
            first_orientation: None,
            orientation_varies: false,
            intervals: 0,
            offset: Offset::default(),
            window: Window::default(),
            gravity: GravityTrack::default(),
            quietest: None,
        }
    }

    /// Takes the next sample, in order of arrival.
    pub fn push(&mut self, raw: &RawSample) {
        let index = self.count;
        self.count += 1;
        if let Some(orientation) = raw.orientation {
            self.orientations += 1;
            let first = *self.first_orientation.get_or_insert(orientation);
            self.orientation_varies |= first != orientation;
        }
        self.intervals += u64::from(raw.interval_nanos.is_some());
        let stamp = match self.clock {
            Clock::Index { rate_hz } => Some(Nanos((index as f64 * 1e9 / rate_hz) as i64)),
            clock => clock.read(raw),
        };
        match stamp {
            Some(stamp) => {
                self.push_stamp(stamp, raw.gyro);
                if let Some(header) = raw.header.filter(|h| h.0 != 0) {
                    self.offset.push(header, raw.log);
                }
            }
            None => self.no_stamp += 1,
        }
        let accel = self.push_accel(raw.accel);
        if let Some(gyro) = self.push_gyro(raw.gyro)
            && let Some(stamp) = stamp
        {
            self.push_window(stamp, &gyro, accel);
        }
    }

    fn push_stamp(&mut self, stamp: Nanos, gyro: Option<[f64; 3]>) {
        self.first.get_or_insert(stamp);
        if self.last == Some(stamp) {
            self.duplicates += 1;
            if gyro != self.previous {
                self.collisions += 1;
                self.sharing += i64::from(self.high == Some(stamp));
            }
        }
        self.last = Some(stamp);
        match self.high {
            Some(high) if stamp > high => {
                self.high = Some(stamp);
                // n samples on one stamp and then a step are n samples in that step.
                let sharing = std::mem::replace(&mut self.sharing, 1);
                let step = stamp.since(high) / sharing;
                let missing = self.push_step(step);
                if missing > 0 {
                    self.hole = Some((high, stamp, missing));
                }
            }
            Some(high) if stamp < high => {
                self.disorder += 1;
                self.fill_hole(stamp);
            }
            Some(_) => {}
            None => self.high = Some(stamp),
        }
    }

    /// A sample that was overtaken was not missing.
    fn fill_hole(&mut self, stamp: Nanos) {
        if let Some((from, to, missing)) = &mut self.hole
            && (*from..=*to).contains(&stamp)
            && *missing > 0
        {
            *missing -= 1;
            self.missing = self.missing.saturating_sub(1);
            self.gaps -= u64::from(*missing == 0).min(self.gaps);
        }
    }

    /// Adds a step; returns how many samples are missing in it, as far as is known.
    fn push_step(&mut self, step: i64) -> u64 {
        if self.nominal.is_some() {
            return self.measure_step(step);
        }
        self.primer.push(step);
        if self.primer.len() == PRIMING {
            return self.prime();
        }
        0
    }

    fn prime(&mut self) -> u64 {
        let mut steps = std::mem::take(&mut self.primer);
        let in_order = steps.clone();
        steps.sort_unstable();
        self.nominal = steps.get(steps.len() / 2).copied();
        let missing = in_order.into_iter().map(|step| self.measure_step(step));
        missing.last().unwrap_or(0)
    }

    fn measure_step(&mut self, step: i64) -> u64 {
        let nominal = self.nominal.unwrap_or(step).max(1);
        self.spacing.add(step);
        if step > nominal.saturating_add(nominal / 2) {
            self.gaps += 1;
            if step > LONGEST_GAP_NANOS {
                return 0;
            }
            let whole = step.saturating_add(nominal / 2) / nominal;
            let missing = u64::try_from(whole - 1).unwrap_or(0);
            self.missing = self.missing.saturating_add(missing);
            self.longest_gap = self.longest_gap.max(step);
            missing
        } else {
            // A gap is not jitter.
            let off = step.saturating_sub(nominal).saturating_abs();
            self.jitter.add(off);
            0
        }
    }

    fn push_gyro(&mut self, gyro: Option<[f64; 3]>) -> Option<[f64; 3]> {
        let Some(gyro) = gyro else {
            self.no_gyro += 1;
            return None;
        };
        if gyro.iter().any(|v| !v.is_finite()) {
            self.not_finite += 1;
            return None;
        }
        self.zero_rows += u64::from(gyro == [0.0; 3]);
        let held = self.previous == Some(gyro);
        self.repeated_rows += u64::from(held);
        // A zero between readings that are none, and no rest: that takes two in a row.
        if self.last_row_lone_zero && gyro != [0.0; 3] {
            self.lone_zero_rows += 1;
        }
        self.last_row_lone_zero =
            gyro == [0.0; 3] && self.previous.is_some_and(|previous| previous != [0.0; 3]);
        self.previous = Some(gyro);
        let peak = gyro.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        self.fast_rows +=
            u64::from((advice::DEGREES_ABOVE..=super::gate::HUGE_RATE).contains(&peak));
        for (axis, v) in self.axes.iter_mut().zip(gyro) {
            axis.push(v, held);
        }
        Some(gyro)
    }

    fn push_accel(&mut self, accel: Option<[f64; 3]>) -> Option<Vector3<f64>> {
        let accel = accel?;
        self.accel_count += 1;
        if accel.iter().any(|v| !v.is_finite()) {
            self.accel_not_finite += 1;
            return None;
        }
        let accel = Vector3::from(accel);
        let length = accel.norm();
        self.near_one += u64::from(NEAR_ONE.contains(&length));
        self.near_thousand += u64::from(NEAR_ONE.contains(&(length * 1e-3)));
        Some(accel)
    }

    fn push_window(&mut self, stamp: Nanos, gyro: &[f64; 3], accel: Option<Vector3<f64>>) {
        let window = &mut self.window;
        let start = *window.start.get_or_insert(stamp);
        let gyro = Vector3::from(*gyro);
        window.n += 1;
        let before = gyro - window.mean;
        window.mean += before / window.n as f64;
        window.m2 += before.component_mul(&(gyro - window.mean));
        if let Some(accel) = accel {
            window.accel += accel;
            window.accel_n += 1;
            self.gravity.push(stamp, &gyro, &accel);
        }
        let span = stamp.since(start);
        if !(0..=4 * WINDOW_NANOS).contains(&span) {
            // A jump or a gap: what it spans is no half second.
            *window = Window::default();
        } else if span >= WINDOW_NANOS && window.n >= WINDOW_SAMPLES {
            let window = std::mem::take(window);
            let deviation = (window.m2 / (window.n - 1) as f64).max().max(0.0).sqrt();
            if self.quietest.is_none_or(|q| deviation < q.deviation) {
                self.quietest = Some(Quiet {
                    start,
                    deviation,
                    mean: window.mean,
                    accel: (window.accel_n > 0).then(|| window.accel / window.accel_n as f64),
                });
            }
        }
    }

    /// Summary of what has been seen so far.
    #[must_use]
    pub fn summary(&self) -> QualitySummary {
        if self.nominal.is_none() && !self.primer.is_empty() {
            // A short recording: judge with what there is.
            let mut primed = self.clone();
            primed.prime();
            return summary::summarise(&primed);
        }
        summary::summarise(self)
    }
}
