//! Sums of axes, steps and clocks -> numbers for people. Pure.
//!
//! A stage of its own so that counting, which runs per sample, stays apart from dividing, which
//! runs once.

use super::{Quality, QualitySummary};
use crate::record::Nanos;
use nalgebra::Vector3;

/// Distances between successive stamps that advance, and their jitter.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct SpacingStats {
    /// Median step, s; within 3 %, exact where steps agree.
    pub median_secs: f64,
    /// 1 / median.
    pub rate_hz: f64,
    /// Median deviation from the ordinary step, s. Steps with samples missing are not jitter.
    pub jitter_p50_secs: f64,
    /// 99th percentile of the same.
    pub jitter_p99_secs: f64,
    /// Largest of the same.
    pub jitter_max_secs: f64,
    /// 99th percentile of the steps, gaps included, s.
    pub p99_secs: f64,
    /// Longest step, s.
    pub max_secs: f64,
}

/// Header stamp minus log time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OffsetStats {
    /// Mean, s.
    pub mean_secs: f64,
    /// Smallest, s.
    pub min_secs: f64,
    /// Largest, s.
    pub max_secs: f64,
    /// Speed of the header's clock over the recorder's, parts per million (least squares).
    pub drift_ppm: f64,
}

/// One gyro axis in the source's unit, over finite samples.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct AxisStats {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// Longest run of one and the same value.
    pub longest_run: u64,
}

/// Direction of gravity in the quietest half second.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GravityAxis {
    /// 0 = x, 1 = y, 2 = z.
    pub axis: usize,
    /// Whether the reading is positive: +z means z points up (FLU), -z that it points down (FRD).
    pub positive: bool,
}

impl std::fmt::Display for GravityAxis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = ["x", "y", "z"].get(self.axis).copied().unwrap_or("?");
        write!(f, "{}{name}", if self.positive { "+" } else { "-" })
    }
}

/// One gyro axis, over finite samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    min: f64,
    max: f64,
    sum: f64,
    sum_squares: f64,
    count: u64,
    /// Samples in a row with this value, and the longest such run.
    run: u64,
    longest_run: u64,
    last: f64,
}

impl Axis {
    pub(super) const EMPTY: Axis = Axis {
        min: f64::INFINITY,
        max: f64::NEG_INFINITY,
        sum: 0.0,
        sum_squares: 0.0,
        count: 0,
        run: 0,
        longest_run: 0,
        last: f64::NAN,
    };

    pub(super) fn push(&mut self, v: f64) {
        self.min = self.min.min(v);
        self.max = self.max.max(v);
        self.sum += v;
        self.sum_squares += v * v;
        self.count += 1;
        self.run = if v == self.last { self.run + 1 } else { 1 };
        self.longest_run = self.longest_run.max(self.run);
        self.last = v;
    }
}

/// Least squares of (clock - log time) against log time, both from the first sample, in seconds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Offset {
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
    pub(super) fn push(&mut self, stamp: Nanos, log: Nanos) {
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

/// Fills in what is computed of the sums of `quality`.
pub(super) fn summarise(quality: &Quality) -> QualitySummary {
    let secs = |nanos: i64| nanos as f64 * 1e-9;
    let so_far = quality.so_far.clone();
    let duration_secs = match (so_far.first, so_far.newest) {
        (Some(first), Some(newest)) => newest.secs_since(first),
        _ => 0.0,
    };
    let quietest = quality.quietest.as_ref();
    let accel = quietest.and_then(|q| q.accel);
    QualitySummary {
        duration_secs,
        spacing: quality.nominal.map(|_| spacing(quality)),
        jitter: quality.jitter.octaves(),
        longest_gap_secs: secs(quality.longest_gap),
        offset: offset(quality, duration_secs),
        axes: quality.axes.map(axis),
        clipped: [1.0, 1.0_f64.to_degrees()].map(|rad| quality.rails.clipped(rad)),
        broken: quality.broken.map(|axes| axes.found()),
        quietest_at: quietest.map(|q| q.start),
        quietest_deviation: quietest.map(|q| q.deviation),
        quietest_rate: quietest.map(|q| q.mean),
        accel_at_rest: accel.map(|a| a.norm()),
        gravity: accel.and_then(gravity),
        gyro_against_gravity: quality.gravity.result(),
        lone_zero_rows: quality.zeros.count(),
        ..so_far
    }
}

fn spacing(quality: &Quality) -> SpacingStats {
    let median_secs = quality.spacing.quantile(0.5) * 1e-9;
    SpacingStats {
        median_secs,
        rate_hz: if median_secs > 0.0 {
            1.0 / median_secs
        } else {
            0.0
        },
        jitter_p50_secs: quality.jitter.quantile(0.5) * 1e-9,
        jitter_p99_secs: quality.jitter.quantile(0.99) * 1e-9,
        jitter_max_secs: quality.jitter.max() as f64 * 1e-9,
        p99_secs: quality.spacing.quantile(0.99) * 1e-9,
        max_secs: quality.spacing.max() as f64 * 1e-9,
    }
}

fn offset(quality: &Quality, duration_secs: f64) -> Option<OffsetStats> {
    let offset = &quality.offset;
    let (_, first) = offset.origin?;
    // Below a minute of data a drift is dominated by the jitter of the log times.
    let enough = offset.n > 2.0 && offset.tt > 0.0 && duration_secs > 0.0;
    Some(OffsetStats {
        mean_secs: first as f64 * 1e-9 + offset.mean_d,
        min_secs: offset.min as f64 * 1e-9,
        max_secs: offset.max as f64 * 1e-9,
        drift_ppm: if enough {
            offset.td / offset.tt * 1e6
        } else {
            0.0
        },
    })
}

fn axis(axis: Axis) -> AxisStats {
    if axis.count == 0 {
        return AxisStats::default();
    }
    let n = axis.count as f64;
    AxisStats {
        min: axis.min,
        max: axis.max,
        mean: axis.sum / n,
        rms: (axis.sum_squares / n).sqrt(),
        longest_run: axis.longest_run,
    }
}

fn gravity(accel: Vector3<f64>) -> Option<GravityAxis> {
    let axis = accel.iamax();
    let largest = accel[axis];
    (largest.abs() >= 0.8 * accel.norm() && largest != 0.0).then_some(GravityAxis {
        axis,
        positive: largest > 0.0,
    })
}
