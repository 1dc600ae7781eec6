//! Sums -> numbers for people. Pure.
//!
//! A stage of its own so that counting, which runs per sample, stays apart from dividing, which
//! runs once.

use super::advice::{Advice, advise};
use super::{Axis, GyroAgainstGravity, Quality};
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
    /// Number of times the largest magnitude occurs.
    pub at_peak: u64,
    /// Longest run of samples at that magnitude while the other axes moved.
    pub longest_at_peak: u64,
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

/// Everything `info` prints about one topic.
#[derive(Clone, PartialEq, Debug)]
pub struct QualitySummary {
    /// Samples seen.
    pub count: u64,
    /// Samples without a stamp of the chosen clock.
    pub no_stamp: u64,
    /// First stamp, in order of arrival.
    pub first: Option<Nanos>,
    /// Newest stamp.
    pub newest: Option<Nanos>,
    /// Newest minus first, s.
    pub duration_secs: f64,
    /// Steps and jitter; `None` below two stamps that advance.
    pub spacing: Option<SpacingStats>,
    /// Deviations from the ordinary step: `from..to` in ns, by octave, and how many.
    pub jitter: Vec<(f64, f64, u64)>,
    /// Steps with samples missing.
    pub gaps: u64,
    /// Samples missing in them, by the ordinary step.
    pub missing: u64,
    /// The longest, s.
    pub longest_gap_secs: f64,
    /// Samples with their predecessor's stamp.
    pub duplicates: u64,
    /// Number of these with other data than it.
    pub collisions: u64,
    /// Samples older than one before them.
    pub disorder: u64,
    /// Header minus log time; `None` without header stamps.
    pub offset: Option<OffsetStats>,
    /// Samples without a gyro.
    pub no_gyro: u64,
    /// Samples with NaN or infinity in the gyro.
    pub not_finite: u64,
    /// Samples with a gyro of exactly (0, 0, 0).
    pub zero_rows: u64,
    /// Number of these, alone between two that are not.
    pub lone_zero_rows: u64,
    /// Samples with exactly their predecessor's gyro.
    pub repeated_rows: u64,
    /// x, y, z.
    pub axes: [AxisStats; 3],
    /// Samples with an acceleration.
    pub with_accel: u64,
    /// Number of these with NaN or infinity.
    pub accel_not_finite: u64,
    /// Number of these with a length of 0.8 to 1.25, as of gravity in g.
    pub accel_near_one: u64,
    /// Number of these with a length of 800 to 1250, as of gravity in mg.
    pub accel_near_thousand: u64,
    /// Samples with an orientation.
    pub with_orientation: u64,
    /// Whether any of these is another than the first: some drivers fill the field with one.
    pub orientation_varies: bool,
    /// Samples that state their own integration interval.
    pub with_interval: u64,
    /// Start of the quietest half second.
    pub quietest_at: Option<Nanos>,
    /// Largest gyro deviation in it, source's unit.
    pub quietest_deviation: Option<f64>,
    /// Mean rate in it, source's unit: the bias, if it is a rest.
    pub quietest_rate: Option<Vector3<f64>>,
    /// Magnitude of the mean acceleration in it, source's unit.
    pub accel_at_rest: Option<f64>,
    /// The axis that holds at least 0.8 of it.
    pub gravity: Option<GravityAxis>,
    /// Whether the gyro's unit and signs agree with the turning of gravity; `None` where gravity turned too little.
    pub gyro_against_gravity: Option<GyroAgainstGravity>,
    /// Advice that follows.
    pub advice: Vec<Advice>,
}

pub(super) fn summarise(quality: &Quality) -> QualitySummary {
    let secs = |nanos: i64| nanos as f64 * 1e-9;
    let newest = quality.high;
    let duration_secs = match (quality.first, newest) {
        (Some(first), Some(newest)) => newest.secs_since(first),
        _ => 0.0,
    };
    let gravity = quality.quietest.and_then(|q| q.accel).and_then(gravity);
    let mut summary = QualitySummary {
        count: quality.count,
        no_stamp: quality.no_stamp,
        first: quality.first,
        newest,
        duration_secs,
        spacing: quality.nominal.map(|_| spacing(quality)),
        jitter: quality.jitter.octaves(),
        gaps: quality.gaps,
        missing: quality.missing,
        longest_gap_secs: secs(quality.longest_gap),
        duplicates: quality.duplicates,
        collisions: quality.collisions,
        disorder: quality.disorder,
        offset: offset(quality, duration_secs),
        no_gyro: quality.no_gyro,
        not_finite: quality.not_finite,
        zero_rows: quality.zero_rows,
        lone_zero_rows: quality.lone_zero_rows,
        repeated_rows: quality.repeated_rows,
        axes: quality.axes.map(axis),
        with_accel: quality.accel_count,
        accel_not_finite: quality.accel_not_finite,
        accel_near_one: quality.near_one,
        accel_near_thousand: quality.near_thousand,
        with_orientation: quality.orientations,
        orientation_varies: quality.orientation_varies,
        with_interval: quality.intervals,
        quietest_at: quality.quietest.map(|q| q.start),
        quietest_deviation: quality.quietest.map(|q| q.deviation),
        quietest_rate: quality.quietest.map(|q| q.mean),
        accel_at_rest: quality.quietest.and_then(|q| q.accel).map(|a| a.norm()),
        gravity,
        gyro_against_gravity: quality.gravity.result(),
        advice: Vec::new(),
    };
    summary.advice = advise(&summary, quality.quietest.as_ref(), quality.fast_rows);
    summary
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
        at_peak: axis.at_peak,
        longest_at_peak: axis.longest_at_peak,
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
