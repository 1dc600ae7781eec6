//! Sums -> numbers for people, and advice with the flag that helps. Pure.
//!
//! A stage of its own because the thresholds of advice are opinions, and opinions should lie in
//! one place, apart from the counting.

use super::{Axis, GyroAgainstGravity, Quality, Quiet};
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
    /// How much faster the header's clock runs than the recorder's, parts per million (least squares).
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
    /// How often the largest magnitude occurs.
    pub at_peak: u64,
    /// Longest run of one and the same value.
    pub longest_run: u64,
}

/// Where gravity is felt in the quietest half second.
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

/// Something to do about a recording; the text names the flag.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Advice {
    /// No gyro turns that fast in rad/s.
    RatesLookLikeDegrees {
        /// Largest magnitude of any axis.
        peak: f64,
    },
    /// Gravity turns in the accelerometer by another factor than the gyro says.
    GravityTurnsOtherwise {
        /// What was found.
        found: GyroAgainstGravity,
        /// The value of `--gyro-unit` that it fits, if any.
        unit: Option<&'static str>,
    },
    /// The acceleration at rest is one g, but not in m/s^2.
    AccelNotInMetres {
        /// Magnitude in the quietest half second.
        magnitude: f64,
        /// The unit it is plausible in.
        unit: &'static str,
    },
    /// Gravity reads negative on z: the body is front-right-down.
    LooksLikeFrd,
    /// Gravity lies on x or y: the sensor is mounted on its side.
    MountedOnSide {
        /// Where it lies.
        gravity: GravityAxis,
    },
    /// A gyro axis spends many samples at exactly its largest reading.
    Saturated {
        /// 0 = x, 1 = y, 2 = z.
        axis: usize,
        /// The reading.
        at: f64,
        /// How many samples.
        samples: u64,
    },
    /// A gyro axis repeats one value for long while others move.
    Stuck {
        /// 0 = x, 1 = y, 2 = z.
        axis: usize,
        /// Longest run, samples.
        samples: u64,
    },
    /// All stamps are zero or equal.
    StampsStandStill,
    /// Stamps jitter by more than a tenth of the step.
    StampsJitter {
        /// 99th percentile over the median step.
        share: f64,
    },
    /// The two clocks drift apart.
    ClocksDrift {
        /// Parts per million.
        ppm: f64,
    },
    /// Samples are missing.
    SamplesMissing {
        /// How many, by the ordinary step.
        missing: u64,
        /// Longest gap, s.
        longest_secs: f64,
    },
    /// The body is never still: no bias can be had from this recording.
    NeverStill,
}

impl std::fmt::Display for Advice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let axis_name = |axis: &usize| ["x", "y", "z"].get(*axis).copied().unwrap_or("?");
        match self {
            Advice::RatesLookLikeDegrees { peak } => write!(
                f,
                "rates reach {peak:.1}: no gyro measures that in rad/s; deg/s would be plausible: --gyro-unit deg"
            ),
            Advice::GravityTurnsOtherwise {
                found,
                unit: Some(unit),
            } => write!(
                f,
                "gravity turns by {:.4} of what the gyro says (correlation {:.2}): the rates look like {unit}/s: --gyro-unit {unit}",
                found.factor, found.correlation
            ),
            Advice::GravityTurnsOtherwise { found, unit: None } => write!(
                f,
                "gravity turns by {:.2} of what the gyro says (correlation {:.2}): gyro and accelerometer disagree about axes, signs or unit",
                found.factor, found.correlation
            ),
            Advice::AccelNotInMetres { magnitude, unit } => write!(
                f,
                "acceleration at rest is {magnitude:.3}: plausible in {unit}, not in m/s^2"
            ),
            Advice::LooksLikeFrd => write!(
                f,
                "gravity reads negative on z at rest: z points down, looks like --body frd"
            ),
            Advice::MountedOnSide { gravity } => write!(
                f,
                "gravity is on {gravity} at rest: the sensor is mounted on its side: --mount q=w,x,y,z or an axis map in --body"
            ),
            Advice::Saturated { axis, at, samples } => write!(
                f,
                "gyro {} reads exactly {at} in {samples} samples: looks saturated; --gyro-range {:.4} flags them",
                axis_name(axis),
                at.abs()
            ),
            Advice::Stuck { axis, samples } => write!(
                f,
                "gyro {} repeats one value {samples} times in a row while the others move: stuck?",
                axis_name(axis)
            ),
            Advice::StampsStandStill => write!(
                f,
                "the stamps do not advance: --time log, or --time index --rate-hz HZ"
            ),
            Advice::StampsJitter { share } => write!(
                f,
                "stamps jitter by {:.0} % of the step (p99): if the sensor samples evenly, --regularise-stamps",
                share * 100.0
            ),
            Advice::ClocksDrift { ppm } => write!(
                f,
                "header and log time drift apart by {ppm:.0} ppm: one of the clocks is wrong; --time chooses"
            ),
            Advice::SamplesMissing {
                missing,
                longest_secs,
            } => write!(
                f,
                "{missing} samples are missing, at most {longest_secs:.3} s at a time: --max-gap, --on-gap decide what happens there"
            ),
            Advice::NeverStill => write!(
                f,
                "the body is never still for half a second: --bias auto will refuse; --bias x,y,z gives one"
            ),
        }
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
    /// Steps with samples missing.
    pub gaps: u64,
    /// Samples missing in them, by the ordinary step.
    pub missing: u64,
    /// The longest, s.
    pub longest_gap_secs: f64,
    /// Samples with their predecessor's stamp.
    pub duplicates: u64,
    /// Of these, with other data than it.
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
    /// Samples with exactly their predecessor's gyro.
    pub repeated_rows: u64,
    /// x, y, z.
    pub axes: [AxisStats; 3],
    /// Samples with an acceleration.
    pub with_accel: u64,
    /// Of these, with NaN or infinity in it.
    pub accel_not_finite: u64,
    /// Samples with an orientation.
    pub with_orientation: u64,
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
    /// What to do about it.
    pub advice: Vec<Advice>,
}

/// Above this no gyro is in rad/s (11,500 deg/s; the widest range sold is 4000 to 20,000 deg/s on
/// single-axis spin sensors, 2000 to 4000 on three-axis ones).
pub(super) const DEGREES_ABOVE: f64 = 200.0;
/// Rates above this that stay this even are a saturation, not a rest, in rad/s or deg/s.
const SATURATION_FLOOR: f64 = 1.0;
const SATURATED_SAMPLES: u64 = 5;
/// A rest in rad/s is below this; in deg/s, a rest is below it times 57.
const STILL_DEVIATION: f64 = 0.025;
/// Longest credible run of one value from a moving, quantised sensor.
const STUCK_SAMPLES: u64 = 100;
const DRIFT_PPM: f64 = 200.0;
/// Below this correlation the accelerometer reads too much besides gravity.
const MIN_CORRELATION: f64 = 0.7;
/// Factors within 2.5 of a unit's belong to it; accelerations make them vary.
const UNIT_FACTOR: f64 = 2.5;

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
        repeated_rows: quality.repeated_rows,
        axes: quality.axes.map(axis),
        with_accel: quality.accel_count,
        accel_not_finite: quality.accel_not_finite,
        with_orientation: quality.orientations,
        with_interval: quality.intervals,
        quietest_at: quality.quietest.map(|q| q.start),
        quietest_deviation: quality.quietest.map(|q| q.deviation),
        quietest_rate: quality.quietest.map(|q| q.mean),
        accel_at_rest: quality.quietest.and_then(|q| q.accel).map(|a| a.norm()),
        gravity,
        gyro_against_gravity: quality.gravity.result(),
        advice: Vec::new(),
    };
    summary.advice = advice(&summary, quality.quietest.as_ref(), quality.fast_rows);
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

fn advice(summary: &QualitySummary, quietest: Option<&Quiet>, fast_rows: u64) -> Vec<Advice> {
    let mut advice = Vec::new();
    let peak = summary
        .axes
        .iter()
        .map(|a| a.max.abs().max(a.min.abs()))
        .fold(0.0, f64::max);
    // One in ten thousand may be a spike; a flipped bit is no unit.
    let mut degrees = fast_rows > summary.count / 10_000 + 2;
    if degrees {
        advice.push(Advice::RatesLookLikeDegrees { peak });
    }
    if let Some(found) = summary.gyro_against_gravity
        && found.correlation.abs() > MIN_CORRELATION
        && !(1.0 / UNIT_FACTOR..=UNIT_FACTOR).contains(&found.factor)
    {
        let fits =
            |factor: f64| (1.0 / UNIT_FACTOR..=UNIT_FACTOR).contains(&(found.factor / factor));
        let unit = if fits(std::f64::consts::PI / 180.0) {
            Some("deg")
        } else if fits(1e-3) {
            Some("mrad")
        } else {
            None
        };
        degrees |= unit == Some("deg");
        advice.push(Advice::GravityTurnsOtherwise { found, unit });
    }
    if summary.count > 2 && summary.spacing.is_none() {
        advice.push(Advice::StampsStandStill);
    }
    let unit = if degrees { 57.3 } else { 1.0 };
    let still = quietest.filter(|q| q.deviation <= STILL_DEVIATION * unit);
    if quietest.is_some() && still.is_none() {
        advice.push(Advice::NeverStill);
    }
    if let Some(magnitude) = still.and(summary.accel_at_rest) {
        advice
            .extend(accel_unit(magnitude).map(|unit| Advice::AccelNotInMetres { magnitude, unit }));
        match summary.gravity {
            Some(GravityAxis { axis: 2, positive }) => {
                if !positive {
                    advice.push(Advice::LooksLikeFrd);
                }
            }
            Some(gravity) => advice.push(Advice::MountedOnSide { gravity }),
            None => {}
        }
    }
    for (axis, stats) in summary.axes.iter().enumerate() {
        let at = if stats.max.abs() >= stats.min.abs() {
            stats.max
        } else {
            stats.min
        };
        if at.abs() > SATURATION_FLOOR * unit && stats.at_peak >= SATURATED_SAMPLES {
            advice.push(Advice::Saturated {
                axis,
                at,
                samples: stats.at_peak,
            });
            // A clipped axis repeats one value too, for another reason.
            continue;
        }
        let others_move = summary
            .axes
            .iter()
            .enumerate()
            .any(|(i, other)| i != axis && other.longest_run * 10 < stats.longest_run);
        if stats.longest_run >= STUCK_SAMPLES && others_move {
            advice.push(Advice::Stuck {
                axis,
                samples: stats.longest_run,
            });
        }
    }
    if let Some(spacing) = &summary.spacing {
        let share = spacing.jitter_p99_secs / spacing.median_secs.max(1e-9);
        if share > 0.1 {
            advice.push(Advice::StampsJitter { share });
        }
    }
    if let Some(offset) = &summary.offset
        && summary.duration_secs >= 60.0
        && offset.drift_ppm.abs() > DRIFT_PPM
    {
        advice.push(Advice::ClocksDrift {
            ppm: offset.drift_ppm,
        });
    }
    if summary.missing > 0 {
        advice.push(Advice::SamplesMissing {
            missing: summary.missing,
            longest_secs: summary.longest_gap_secs,
        });
    }
    advice
}

/// The unit in which this is one g, when it is not m/s^2. Gravity is 9.78 to 9.83 m/s^2; scale and
/// bias of a cheap accelerometer make that 5 %.
fn accel_unit(magnitude: f64) -> Option<&'static str> {
    let near = |g: f64| (magnitude / g - 1.0).abs() < 0.05;
    if near(1.0) {
        Some("g")
    } else if near(1000.0) {
        Some("mg")
    } else {
        None
    }
}
