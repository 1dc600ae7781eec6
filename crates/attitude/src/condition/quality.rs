//! RawSample -> what can be said about the recording. Pure.
//!
//! A stage of its own, beside the conditioner and before it, because advice about units, axes
//! and clocks must come from the samples as they were recorded, before any setting was applied.

mod gravity;
mod summary;

pub use super::broken::{AxisFault, BrokenAxes};
pub use super::frozen::FrozenAxis;
pub use super::rails::Clipped;
pub use super::wrapped::WrappedAxis;
pub use gravity::GyroAgainstGravity;
pub use summary::{AxisStats, GravityAxis, OffsetStats, SpacingStats};

use super::clock::{Clock, Turns};
use super::histogram::Histogram;
use super::lone_zeros::LoneZeros;
use super::rails::Rails;
use super::regularise::{Lines, Uneven};
use super::report::Wraps;
use crate::record::{Nanos, RawSample};
pub(super) use gravity::GravityTrack;
use nalgebra::Vector3;
use summary::{Axis, Offset};

/// Samples from which the step is learnt that jitter is measured against.
const PRIMING: usize = 64;
/// Length of the windows in which the quietest is looked for, and fewest samples in one.
const WINDOW_NANOS: i64 = 500_000_000;
const WINDOW_SAMPLES: u64 = 8;
/// A step longer than an hour, nanoseconds, is a clock that was set, or another recording: no samples are missing in
/// it.
pub const LONGEST_GAP_NANOS: i64 = 3_600_000_000_000;

/// Above this no gyro is in rad/s (11,500 deg/s; the widest range sold is 4000 to 20,000 deg/s on
/// single-axis spin sensors, 2000 to 4000 on three-axis ones).
const DEGREES_ABOVE: f64 = 200.0;
/// Lengths of one g in g, of a body that moves.
const NEAR_ONE: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// Everything `info` prints about one topic. What is counted is counted here; what is computed of sums at the end is
/// filled in by [`Quality::summary`].
#[derive(Clone, PartialEq, Debug, Default)]
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
    /// Wraps of the counter behind the stamps; what else is said of stamps is so of those that go on.
    pub wraps: Option<Wraps>,
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
    /// Number of these amid a rotation.
    pub lone_zero_rows: u64,
    /// Samples with a rate that no gyro reaches in rad/s, below nonsense.
    pub fast_rows: u64,
    /// Samples with exactly their predecessor's gyro.
    pub repeated_rows: u64,
    /// x, y, z.
    pub axes: [AxisStats; 3],
    /// End of the range at which each was clipped, where its unit is rad/s, and where it is deg/s.
    pub clipped: [[Option<Clipped>; 3]; 2],
    /// Faults of each, for the same two units.
    pub broken: [[AxisFault; 3]; 2],
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
    /// Straight lines through the stamps, where they were laid.
    pub lines: Option<Result<Lines, Uneven>>,
}

/// Streaming statistics of one topic, in the units and axes of the source. Bounded memory (about
/// 70 kB), and the same numbers however the samples come in blocks.
#[derive(Clone, Debug)]
pub struct Quality {
    clock: Clock,
    /// Counts, in the place where they are read.
    so_far: QualitySummary,
    turns: Turns,
    last: Option<Nanos>,
    primer: Vec<i64>,
    nominal: Option<i64>,
    spacing: Histogram,
    jitter: Histogram,
    /// Different samples on the newest stamp.
    sharing: i64,
    longest_gap: i64,
    /// The newest hole: between which stamps, and how many samples are still missing in it.
    hole: Option<(Nanos, Nanos, u64)>,
    zeros: LoneZeros,
    was_fast: bool,
    axes: [Axis; 3],
    rails: Rails,
    broken: [BrokenAxes; 2],
    previous: Option<[f64; 3]>,
    first_orientation: Option<[f64; 4]>,
    offset: Offset,
    window: Window,
    gravity: GravityTrack,
    quietest: Option<Quiet>,
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
            so_far: QualitySummary::default(),
            turns: Turns::default(),
            last: None,
            primer: Vec::new(),
            nominal: None,
            spacing: Histogram::new(),
            jitter: Histogram::new(),
            sharing: 1,
            longest_gap: 0,
            hole: None,
            zeros: LoneZeros::default(),
            was_fast: false,
            axes: [Axis::EMPTY; 3],
            rails: Rails::new(),
            broken: [1.0, 1.0_f64.to_degrees()].map(BrokenAxes::new),
            previous: None,
            first_orientation: None,
            offset: Offset::default(),
            window: Window::default(),
            gravity: GravityTrack::default(),
            quietest: None,
        }
    }

    /// The same without percentiles of steps, in 5 kB: of one of many live streams.
    #[must_use]
    pub fn without_steps(clock: Clock) -> Self {
        Quality {
            spacing: Histogram::without_bins(),
            jitter: Histogram::without_bins(),
            ..Quality::new(clock)
        }
    }

    /// Takes the next sample, in order of arrival.
    pub fn push(&mut self, raw: &RawSample) {
        let index = self.so_far.count;
        self.so_far.count += 1;
        if let Some(orientation) = raw.orientation {
            self.so_far.with_orientation += 1;
            let first = *self.first_orientation.get_or_insert(orientation);
            self.so_far.orientation_varies |= first != orientation;
        }
        self.so_far.with_interval += u64::from(raw.interval_nanos.is_some());
        let stamp = match self.clock {
            Clock::Index { rate_hz } => Some(Nanos((index as f64 * 1e9 / rate_hz) as i64)),
            clock => clock.read(raw).map(|stamp| self.followed(stamp)),
        };
        match stamp {
            Some(stamp) => {
                self.push_stamp(stamp, raw.gyro);
                if let Some(header) = raw.header.filter(|h| h.0 != 0) {
                    self.offset.push(header, raw.log);
                }
            }
            None => self.so_far.no_stamp += 1,
        }
        let accel = self.push_accel(raw.accel);
        if let Some(gyro) = self.push_gyro(raw.gyro)
            && let Some(stamp) = stamp
        {
            self.push_window(stamp, &gyro, accel);
        }
    }

    /// The stamp on the turn of its counter.
    fn followed(&mut self, stamp: Nanos) -> Nanos {
        let (followed, wrap) = self.turns.push(stamp.0);
        let followed = Nanos(followed);
        if let Some(period) = wrap {
            self.so_far.wraps = Some(Wraps::after(self.so_far.wraps, period, followed));
        }
        followed
    }

    fn push_stamp(&mut self, stamp: Nanos, gyro: Option<[f64; 3]>) {
        self.so_far.first.get_or_insert(stamp);
        if self.last == Some(stamp) {
            self.so_far.duplicates += 1;
            if gyro != self.previous {
                self.so_far.collisions += 1;
                self.sharing += i64::from(self.so_far.newest == Some(stamp));
            }
        }
        self.last = Some(stamp);
        match self.so_far.newest {
            Some(high) if stamp > high => {
                self.so_far.newest = Some(stamp);
                // n samples on one stamp and then a step are n samples in that step.
                let sharing = std::mem::replace(&mut self.sharing, 1);
                let step = stamp.since(high) / sharing;
                let missing = self.push_step(step);
                if missing > 0 {
                    self.hole = Some((high, stamp, missing));
                }
            }
            Some(high) if stamp < high => {
                self.so_far.disorder += 1;
                self.fill_hole(stamp);
            }
            Some(_) => {}
            None => self.so_far.newest = Some(stamp),
        }
    }

    /// A sample that was overtaken was not missing.
    fn fill_hole(&mut self, stamp: Nanos) {
        if let Some((from, to, missing)) = &mut self.hole
            && (*from..=*to).contains(&stamp)
            && *missing > 0
        {
            *missing -= 1;
            self.so_far.missing = self.so_far.missing.saturating_sub(1);
            self.so_far.gaps -= u64::from(*missing == 0).min(self.so_far.gaps);
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
            self.so_far.gaps += 1;
            if step > LONGEST_GAP_NANOS {
                return 0;
            }
            let whole = step.saturating_add(nominal / 2) / nominal;
            let missing = u64::try_from(whole - 1).unwrap_or(0);
            self.so_far.missing = self.so_far.missing.saturating_add(missing);
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
            self.so_far.no_gyro += 1;
            return None;
        };
        if gyro.iter().any(|v| !v.is_finite()) {
            self.so_far.not_finite += 1;
            return None;
        }
        self.so_far.zero_rows += u64::from(gyro == [0.0; 3]);
        let held = self.previous == Some(gyro);
        self.so_far.repeated_rows += u64::from(held);
        self.zeros.push(&gyro);
        self.previous = Some(gyro);
        let peak = gyro.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        // A motion goes on, and is no word for nothing on every axis (-999, 655.35).
        let is_word = gyro == [gyro[0]; 3];
        let is_fast = !is_word && (DEGREES_ABOVE..=super::gate::HUGE_RATE).contains(&peak);
        self.so_far.fast_rows += u64::from(is_fast && self.was_fast);
        self.was_fast = is_fast;
        for (axis, v) in self.axes.iter_mut().zip(gyro) {
            axis.push(v);
        }
        self.rails.push(&gyro);
        self.broken.iter_mut().for_each(|axes| axes.push(&gyro));
        Some(gyro)
    }

    fn push_accel(&mut self, accel: Option<[f64; 3]>) -> Option<Vector3<f64>> {
        let accel = accel?;
        self.so_far.with_accel += 1;
        if accel.iter().any(|v| !v.is_finite()) {
            self.so_far.accel_not_finite += 1;
            return None;
        }
        let accel = Vector3::from(accel);
        let length = accel.norm();
        self.so_far.accel_near_one += u64::from(NEAR_ONE.contains(&length));
        self.so_far.accel_near_thousand += u64::from(NEAR_ONE.contains(&(length * 1e-3)));
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
