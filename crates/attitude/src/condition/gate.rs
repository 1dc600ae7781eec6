//! RawSample -> Entry: finite, plausible, SI, body axes. Pure.
//!
//! A stage of its own because it looks at one sample alone: what comes behind it compares
//! samples with each other and may rely on every number being finite and every stamp subtractable.

use super::settings::Settings;
use super::truncation::undone;
use crate::record::{Nanos, RawSample, SampleKind, Status, Verdict};
use nalgebra::{Matrix3, Vector3};

/// Largest rate that is believed, rad/s: a hundred times the widest range sold, and so much that counts of 16 bits, whose
/// factor nobody has stated, are held against gravity.
pub(super) const HUGE_RATE: f64 = 4e4;
/// Largest angle of one sample that is believed, rad.
const HUGE_ANGLE: f64 = 1e3;
/// Longest integration interval believed of a message, nanoseconds.
const MAX_INTERVAL_NANOS: i64 = 10_000_000_000;
/// Stamps beyond this (146 years from the epoch either way) are not stamps; within it any two
/// can be subtracted without overflow.
pub(super) const MAX_STAMP: i64 = i64::MAX / 2;

/// A sample that passed the gate; its stamp may still be out of order.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "Row", into = "Row")
)]
pub(super) struct Entry {
    pub(super) stamp: Nanos,
    pub(super) log: Nanos,
    /// Rate in rad/s, or delta angle in rad; body axes; bias not yet removed.
    pub(super) value: Vector3<f64>,
    /// NaN where there is none.
    pub(super) accel: Vector3<f64>,
    /// The message's own interval; 0 where there is none.
    pub(super) interval: i64,
    /// Place in the stream.
    pub(super) index: u64,
    /// Stretch of the stream between two jumps back of the clock.
    pub(super) epoch: u32,
    pub(super) status: Status,
}

/// An entry as it is saved: stamp, log time, value, specific force, interval (0: none), epoch, status bits.
type Row = (i64, i64, [f64; 3], Option<[f64; 3]>, i64, u32, u16);

impl From<Entry> for Row {
    fn from(entry: Entry) -> Row {
        (
            entry.stamp.0,
            entry.log.0,
            entry.value.into(),
            finite_accel(&entry.accel).map(Into::into),
            entry.interval,
            entry.epoch,
            entry.status.0,
        )
    }
}

/// The same measurement as far as it is saved, with or without a specific force.
impl PartialEq for Entry {
    fn eq(&self, other: &Entry) -> bool {
        Row::from(*self) == Row::from(*other)
    }
}

impl From<Row> for Entry {
    fn from((stamp, log, value, accel, interval, epoch, status): Row) -> Entry {
        Entry {
            stamp: Nanos(stamp),
            log: Nanos(log),
            value: Vector3::from(value),
            accel: accel.map_or(NO_ACCEL, Vector3::from),
            interval: interval.max(0),
            index: 0,
            epoch,
            status: Status(status),
        }
    }
}

impl Entry {
    /// The same measurement, bit for bit.
    pub(super) fn same_data(&self, other: &Entry) -> bool {
        let bits = |v: &Vector3<f64>| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()];
        bits(&self.value) == bits(&other.value)
            && bits(&self.accel) == bits(&other.accel)
            && self.interval == other.interval
    }
}

/// Units, axes and the gates, fixed before the first sample.
#[derive(Clone, Debug)]
pub(super) struct Gate {
    kind: SampleKind,
    /// mount * axes * unit; `None` when that changes nothing, so that values keep their bits.
    gyro: Option<Matrix3<f64>>,
    accel: Option<Matrix3<f64>>,
    accel_bias: Vector3<f64>,
    /// Recorded rates to rad/s, by axis as recorded.
    to_rad: Vector3<f64>,
    /// Step of truncation in the source's unit, by axis as recorded.
    cut: Option<Vector3<f64>>,
    huge: f64,
    range: f64,
    /// Recorded rates of one rad/s, by axis as recorded.
    rad: [f64; 3],
}

impl Gate {
    pub(super) fn new(settings: &Settings) -> Self {
        let axes = settings.mount.as_matrix() * settings.axes.matrix();
        let to_rad = Vector3::from(settings.gyro_scale) * settings.unit.to_rad();
        let rad = to_rad.map(|to_rad| to_rad.recip().abs()).into();
        let scale = Matrix3::from_diagonal(&Vector3::from(settings.gyro_scale));
        let unless_identity = |m: Matrix3<f64>| (m != Matrix3::identity()).then_some(m);
        Gate {
            kind: settings.kind,
            gyro: unless_identity(axes * settings.gyro_matrix * scale * settings.unit.to_rad()),
            accel: unless_identity(axes * settings.accel_matrix * settings.accel_scale),
            accel_bias: axes * settings.accel_bias,
            to_rad,
            rad,
            cut: settings
                .truncation_step
                .map(|step| to_rad.map(|to_rad| step / to_rad)),
            huge: match settings.kind {
                SampleKind::DeltaAngle | SampleKind::Rotation => HUGE_ANGLE,
                SampleKind::Rate | SampleKind::Average => HUGE_RATE,
            },
            // A float32 full scale may come out one bit below the number on the data sheet.
            range: settings
                .gyro_range
                .map_or(f64::INFINITY, |r| r * (1.0 - 1e-6)),
        }
    }

    pub(super) fn rad(&self) -> &[f64; 3] {
        &self.rad
    }

    /// The sample in SI and body axes, or why it cannot be used. `spacing` is the ordinary step,
    /// needed only to see whether a delta angle without its own interval is saturated.
    #[inline(always)]
    pub(super) fn pass(
        &self,
        raw: &RawSample,
        stamp: Nanos,
        index: u64,
        spacing: Option<i64>,
    ) -> Result<Entry, Verdict> {
        let Some(gyro) = raw.gyro else {
            return Err(Verdict::NoGyro);
        };
        let gyro = Vector3::from(gyro);
        // max skips NaN; x * 0 is 0 for every finite x and NaN for the others.
        let in_rad = gyro.component_mul(&self.to_rad);
        let largest = in_rad.x.abs().max(in_rad.y.abs()).max(in_rad.z.abs());
        let finite = gyro.x * 0.0 + gyro.y * 0.0 + gyro.z * 0.0;
        if finite != 0.0 {
            return Err(Verdict::NotFinite);
        }
        if largest > self.huge {
            return Err(Verdict::Huge);
        }
        let interval = match (self.kind, raw.interval_nanos) {
            (SampleKind::Rate, _) | (_, None) => 0,
            (_, Some(nanos)) if (1..=MAX_INTERVAL_NANOS).contains(&nanos) => nanos,
            (_, Some(_)) => 0,
        };
        let mut status = Status::OK;
        if self.range.is_finite() && self.is_saturated(largest, interval, spacing) {
            status = status.with(Status::SATURATED);
        }
        let gyro = match self.cut {
            None => gyro,
            Some(steps) => gyro.zip_map(&steps, undone),
        };
        let accel = raw.accel.map_or(NO_ACCEL, Vector3::from);
        Ok(Entry {
            stamp,
            log: raw.log,
            value: match &self.gyro {
                None => gyro,
                Some(m) => m * gyro,
            },
            accel: match &self.accel {
                None => accel,
                Some(m) => m * accel,
            } - self.accel_bias,
            interval,
            index,
            epoch: 0,
            status,
        })
    }

    fn is_saturated(&self, largest: f64, interval: i64, spacing: Option<i64>) -> bool {
        let rate = match self.kind {
            SampleKind::Rate | SampleKind::Average => largest,
            SampleKind::DeltaAngle | SampleKind::Rotation => {
                let nanos = if interval > 0 {
                    Some(interval)
                } else {
                    spacing
                };
                nanos.map_or(0.0, |n| largest / (n as f64 * 1e-9))
            }
        };
        rate >= self.range
    }
}

pub(super) const NO_ACCEL: Vector3<f64> = Vector3::new(f64::NAN, f64::NAN, f64::NAN);

/// The acceleration, unless a component is not finite.
#[inline]
pub(super) fn finite_accel(accel: &Vector3<f64>) -> Option<Vector3<f64>> {
    let zero = accel.x * 0.0 + accel.y * 0.0 + accel.z * 0.0;
    (zero == 0.0).then_some(*accel)
}
