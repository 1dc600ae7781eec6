//! Numbers about a recording -> what they give away, as data. Pure.
//!
//! A stage of its own because thresholds of advice are opinions, and opinions should lie in
//! one place, apart from the counting.

use super::summary::{GravityAxis, QualitySummary};
use super::{GyroAgainstGravity, Quiet};
use crate::condition::regularise::{Lines, Uneven};

/// Something to do about a recording: what was seen, with its numbers. Its words belong to whoever says it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Advice {
    /// Rates too fast for rad/s.
    RatesLookLikeDegrees {
        /// Largest magnitude of any axis.
        peak: f64,
    },
    /// Gravity turns in the accelerometer by another factor than the gyro says.
    GravityTurnsOtherwise {
        /// Agreement that was found.
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
    /// Most accelerations of a recording have the length of one g, but not in m/s^2.
    AccelMostlyOneG {
        /// Share of them, 0 to 1.
        share: f64,
        /// The unit they are plausible in.
        unit: &'static str,
    },
    /// Gravity reads negative on z: the body is front-right-down.
    LooksLikeFrd,
    /// Gravity lies on x or y: the sensor is mounted on its side.
    MountedOnSide {
        /// Direction of gravity.
        gravity: GravityAxis,
    },
    /// A gyro axis spends many samples at exactly its largest reading.
    Saturated {
        /// 0 = x, 1 = y, 2 = z.
        axis: usize,
        /// The reading.
        at: f64,
        /// Number of samples.
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
    /// Stamps jitter by more than a tenth of the step, and nobody has laid lines through them.
    StampsJitter {
        /// 99th percentile over the median step.
        share: f64,
    },
    /// Stamps jitter about straight lines. Whether the sensor samples evenly, they cannot tell.
    StampsJitterEvenly {
        /// rms distance from the lines over the step.
        jitter: f64,
        /// Number of lines.
        segments: usize,
    },
    /// Stamps jitter, and about no line.
    StampsUneven {
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
        /// Number of missing samples, by the ordinary step.
        missing: u64,
        /// Longest gap, s.
        longest_secs: f64,
    },
    /// The body is never still: no bias can be had from this recording.
    NeverStill,
}

/// Above this no gyro is in rad/s (11,500 deg/s; the widest range sold is 4000 to 20,000 deg/s on
/// single-axis spin sensors, 2000 to 4000 on three-axis ones).
pub(super) const DEGREES_ABOVE: f64 = 200.0;
/// Rates above this that stay this even are a saturation, not a rest, in rad/s or deg/s.
const SATURATION_FLOOR: f64 = 1.0;
const SATURATED_SAMPLES: u64 = 5;
/// Turning over, a sampled sine stands at its largest value for two samples at most.
const SATURATED_RUN: u64 = 3;
/// A rest in rad/s is below this; in deg/s, a rest is below it times 57.
const STILL_DEVIATION: f64 = 0.025;
/// Longest credible run of one value from a moving, quantised sensor.
const STUCK_SAMPLES: u64 = 100;
const DRIFT_PPM: f64 = 200.0;
/// Part of a step, rms, above which stamp noise is worth a flag: 1750 arcsec a minute of lively motion
/// (`docs/theory/attitude.md` 6.4). What carries its own intervals is nearly immune.
const NOISY_STAMPS: f64 = 0.01;
/// Below this correlation the accelerometer reads too much besides gravity.
const MIN_CORRELATION: f64 = 0.7;
/// Factors within 2.5 of a unit's belong to it; accelerations make them vary.
const UNIT_FACTOR: f64 = 2.5;

impl QualitySummary {
    /// Judges by lines through the stamps instead of single steps.
    pub fn judge_lines(&mut self, found: &Result<Lines, Uneven>) {
        let says_its_intervals = self.with_interval > 0 && self.with_interval == self.count;
        let at = self
            .advice
            .iter()
            .position(|a| matches!(a, Advice::StampsJitter { .. }));
        let new = match (found, at.and_then(|at| self.advice.get(at))) {
            (Ok(lines), _) if lines.jitter() >= NOISY_STAMPS && !says_its_intervals => {
                Advice::StampsJitterEvenly {
                    jitter: lines.jitter(),
                    segments: lines.len(),
                }
            }
            (Err(_), Some(Advice::StampsJitter { share })) => {
                Advice::StampsUneven { share: *share }
            }
            _ => return,
        };
        match at.and_then(|at| self.advice.get_mut(at)) {
            Some(old) => *old = new,
            None => self.advice.push(new),
        }
    }
}

pub(super) fn advise(
    summary: &QualitySummary,
    quietest: Option<&Quiet>,
    fast_rows: u64,
) -> Vec<Advice> {
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
    let at_rest = still.and(summary.accel_at_rest);
    let in_g = |magnitude| accel_unit(magnitude).map(|unit| (magnitude, unit));
    match at_rest.and_then(in_g) {
        Some((magnitude, unit)) => advice.push(Advice::AccelNotInMetres { magnitude, unit }),
        // Who is never at rest has gravity in most of his accelerations.
        None => advice.extend(mostly_one_g(summary)),
    }
    if at_rest.is_some() {
        match summary.gravity {
            Some(GravityAxis {
                axis: 2,
                positive: true,
            }) => {}
            Some(GravityAxis { axis: 2, .. }) => advice.push(Advice::LooksLikeFrd),
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
        if at.abs() > SATURATION_FLOOR * unit
            && stats.at_peak >= SATURATED_SAMPLES
            && stats.longest_at_peak >= SATURATED_RUN
            && stats.min < stats.max
        {
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
        // One that never reads anything else is not there, or not turned about.
        if stats.longest_run >= STUCK_SAMPLES && others_move && stats.min < stats.max {
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
    if summary.missing > 0 && lacks(summary) {
        advice.push(Advice::SamplesMissing {
            missing: summary.missing,
            longest_secs: summary.longest_gap_secs,
        });
    }
    advice
}

/// Whether the log is short of the samples its long steps seem to lack: where stamps jitter by more
/// than half a step, a long step is made up for by short ones.
fn lacks(summary: &QualitySummary) -> bool {
    let Some(spacing) = &summary.spacing else {
        return true;
    };
    // Then a step and a half is a gap and nothing else.
    if spacing.jitter_p99_secs < 0.3 * spacing.median_secs {
        return true;
    }
    let by_time = summary.duration_secs / spacing.median_secs.max(1e-9) + 1.0;
    let distinct = summary.count.saturating_sub(summary.duplicates);
    by_time - distinct as f64 > 0.5 * summary.missing as f64
}

/// Lengths of one g in g, of a body that moves.
pub(super) const NEAR_ONE: std::ops::RangeInclusive<f64> = 0.8..=1.25;
/// Fewer accelerations tell nothing of their unit.
const FEWEST: u64 = 20;

/// Accelerations without gravity are as long, too, where somebody walks, but not for most of the time: lengths of a
/// normal spread about nothing lie within [`NEAR_ONE`] in 38 of 100 cases at most.
fn mostly_one_g(summary: &QualitySummary) -> Option<Advice> {
    let finite = summary.with_accel.saturating_sub(summary.accel_not_finite);
    let units = [
        (summary.accel_near_one, "g"),
        (summary.accel_near_thousand, "mg"),
    ];
    let is_most = |near: u64| finite >= FEWEST && near > finite / 2;
    let (near, unit) = units.into_iter().find(|(near, _)| is_most(*near))?;
    Some(Advice::AccelMostlyOneG {
        share: near as f64 / finite as f64,
        unit,
    })
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
