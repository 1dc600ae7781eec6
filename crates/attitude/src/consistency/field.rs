//! Rates and fields -> whether gyro and magnetometer speak of the same body, and the iron beside it. Pure.
//!
//! A stage of its own because the field has what gravity lacks: no acceleration disturbs it, so one segment decides more,
//! and what turns with the sensor is iron. With the attitude `R` of the gyro, `R (D m - h)` stands still; that is linear
//! in `D` and `h`, so 78 numbers of a segment judge every map and every iron.
//!
//! ```text
//! FieldReading -> pieces (20 ms) -> segment (4 s: second moments) -> maps (evidence for each) -> iron (one solve)
//! ```
//!
//! Differences alone count, no length does: hard iron as large as the field hides nothing. Theory: "Magnetometer"
//! in `docs/theory/consistency.md`.

mod iron;
mod maps;
#[cfg(test)]
mod tests;

pub use self::iron::FieldIron;
pub use self::maps::FieldDisagreement;

use super::HOP_NANOS;
use super::segment::SEGMENT_SECS;
use crate::quaternion::{BodyRate, DeltaAngle};
use crate::record::{Measured, Nanos};
use nalgebra::{Quaternion, SMatrix, Vector3};
use std::f64::consts::PI;

/// Unknowns: nine of a matrix, three of hard iron.
pub(super) const UNKNOWNS: usize = 12;
/// Windows in a segment, half overlapped, and half the width of one, s.
pub(super) const WINDOWS: usize = 3;
const HALF_WIDTH: f64 = SEGMENT_SECS / (WINDOWS + 1) as f64;
/// Length of a segment, ns, less a jitter of the stamps.
const SEGMENT_NANOS: i64 = (SEGMENT_SECS * 1e9) as i64 - 1_000;
/// Shortest piece, ns, and longest time without a rate, and without a field, within a run.
const PIECE_NANOS: i64 = 19_980_000;
const LONGEST_STEP_NANOS: i64 = 250_000_000;
const LONGEST_WAIT_NANOS: i64 = 500_000_000;
/// Least rotation of a segment that tells something, and the most that is believed, rad.
const TURNED: std::ops::Range<f64> = 0.35..1e3;
/// Segments that are kept; of a longer recording every second, every fourth one.
const KEPT: usize = 128;
/// The newest segments, which are kept of a stream without an end.
const KEPT_LIVE: usize = 24;

/// A rate with the field and the force that belong to it, in one set of axes.
#[derive(Clone, Copy, Debug)]
pub struct FieldReading {
    /// Instant of the rate, or end of its interval.
    pub stamp: Nanos,
    /// Rate, rad/s, or rotation since the reading before, rad.
    pub gyro: Measured,
    /// Field in any unit, where one was measured.
    pub field: Option<Vector3<f64>>,
    /// Specific force, up at rest, in any unit, where one was measured.
    pub force: Option<Vector3<f64>>,
}

/// Mean field over 20 ms and more, at the attitude that it was measured at.
#[derive(Clone, Copy, Debug)]
struct Piece {
    stamp: Nanos,
    attitude: Quaternion<f64>,
    field: Vector3<f64>,
    /// Force in the integrated frame, zero where there was none.
    up: Vector3<f64>,
    /// Rotation since the beginning of the run, rad.
    turned: f64,
}

/// Sums of a piece that is not full.
#[derive(Clone, Copy, Debug, Default)]
struct Open {
    nanos: i64,
    attitude: [f64; 4],
    field: Vector3<f64>,
    up: Vector3<f64>,
    count: f64,
}

/// Second moments of four seconds.
#[derive(Clone, Debug)]
pub(super) struct FieldSegment {
    /// Scatter of `R (D m - h)` as a quadratic of the unknowns.
    pub(super) gram: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    /// Mean of the same, linear in them.
    pub(super) mean: SMatrix<f64, 3, UNKNOWNS>,
    /// Sum of the forces in the integrated frame.
    pub(super) up: Vector3<f64>,
    /// Mean square of the field.
    pub(super) square: f64,
}

/// Watches gyro and magnetometer of one stream. Memory is bounded, 200 kB.
#[derive(Clone, Debug, Default)]
pub struct FieldConsistency {
    last: Option<(Nanos, Measured)>,
    attitude: Quaternion<f64>,
    turned: f64,
    start: Nanos,
    last_field: Option<Nanos>,
    open: Open,
    run: Vec<Piece>,
    kept: Vec<FieldSegment>,
    /// Number of segments passed over after one that is kept.
    stride: usize,
    passed: usize,
    /// Whether it runs beside a stream without an end, of which the newest segments are kept.
    is_live: bool,
    /// Segments so far.
    closed: usize,
}

impl FieldConsistency {
    /// Watch over a stream without an end: the newest segments alone are kept, 60 kB.
    #[must_use]
    pub fn live() -> FieldConsistency {
        FieldConsistency {
            is_live: true,
            ..FieldConsistency::default()
        }
    }

    /// Whether it was made by [`FieldConsistency::live`].
    pub(crate) fn is_live(&self) -> bool {
        self.is_live
    }

    /// Number of segments of four seconds so far that told something.
    #[must_use]
    pub fn segments(&self) -> usize {
        self.closed
    }

    /// Median scatter of the field in the integrated frame as recorded, as a share of it; `None` before the first segment.
    /// A few operations, unlike [`FieldConsistency::disagreement`] and [`FieldConsistency::iron`].
    #[must_use]
    pub fn scatter(&self) -> Option<f64> {
        const DIAGONAL: [usize; 3] = [0, 4, 8];
        let of = |segment: &FieldSegment| {
            let row = |i: usize| DIAGONAL.into_iter().map(move |j| segment.gram[(i, j)]);
            DIAGONAL.into_iter().flat_map(row).sum::<f64>() / segment.square
        };
        let mut all: Vec<f64> = self.kept.iter().map(of).collect();
        (!all.is_empty()).then(|| crate::median::median(&mut all).max(0.0).sqrt())
    }

    /// Takes the next reading; a rate without numbers is passed over, and so is a field of zero.
    pub fn push(&mut self, reading: &FieldReading) {
        if !reading.gyro.as_vector().iter().all(|rate| rate.is_finite()) {
            return;
        }
        let Some((then, gyro)) = self.last.replace((reading.stamp, reading.gyro)) else {
            return self.begin(reading.stamp);
        };
        let nanos = reading.stamp.since(then);
        if !(1..=LONGEST_STEP_NANOS).contains(&nanos) {
            return self.begin(reading.stamp);
        }
        let secs = nanos as f64 * 1e-9;
        let angle = match (reading.gyro, gyro) {
            (Measured::Rate(BodyRate(now)), Measured::Rate(BodyRate(then))) => {
                (now + then) * (0.5 * secs)
            }
            (Measured::Rate(BodyRate(now)), Measured::Increment(_)) => now * secs,
            (Measured::Increment(DeltaAngle(angle)), _) => angle,
        };
        self.attitude *= rotation(&angle);
        self.turned += angle.norm();
        let is_field = |field: &Vector3<f64>| {
            let size = field.norm_squared();
            size.is_finite() && size > 0.0
        };
        if let Some(field) = reading.field.filter(is_field) {
            self.take(reading, field);
        }
        let waits_since = self.last_field.unwrap_or(self.start);
        if reading.stamp.since(waits_since) > LONGEST_WAIT_NANOS {
            self.begin(reading.stamp);
        }
    }

    /// Breaks the run: what comes next does not follow.
    pub fn interrupt(&mut self) {
        self.last = None;
    }

    /// Disagreement of gyro and magnetometer about their axes; `None` where there is none, or where the motion leaves
    /// more than one map.
    #[must_use]
    pub fn disagreement(&self) -> Option<FieldDisagreement> {
        maps::disagreement(&self.kept)
    }

    /// Iron that turns with the sensor; `None` where gyro and magnetometer disagree about their axes, or too little was
    /// seen.
    #[must_use]
    pub fn iron(&self) -> Option<FieldIron> {
        iron::found(&self.kept)
    }

    fn begin(&mut self, stamp: Nanos) {
        self.attitude = Quaternion::identity();
        (self.start, self.last_field) = (stamp, None);
        self.turned = 0.0;
        self.open = Open::default();
        self.run.clear();
    }

    fn take(&mut self, reading: &FieldReading, field: Vector3<f64>) {
        let since = self.last_field.unwrap_or(self.start);
        let up = reading
            .force
            .filter(|force| force.iter().all(|f| f.is_finite()));
        let up = up.map_or_else(Vector3::zeros, |force| {
            let turned = self.attitude * Quaternion::from_imag(force) * self.attitude.conjugate();
            turned.imag()
        });
        let open = &mut self.open;
        open.nanos = open.nanos.saturating_add(reading.stamp.since(since));
        self.last_field = Some(reading.stamp);
        let q = self.attitude.coords;
        let all = open.attitude.iter_mut().zip(q.iter());
        all.for_each(|(sum, part)| *sum += part);
        open.field += field;
        open.up += up;
        open.count += 1.0;
        if open.nanos < PIECE_NANOS {
            return;
        }
        let share = 1.0 / open.count;
        let [x, y, z, w] = open.attitude;
        let mean = Quaternion::new(w, x, y, z);
        let piece = Piece {
            stamp: reading.stamp,
            attitude: mean / mean.norm(),
            field: open.field * share,
            up: open.up * share,
            turned: self.turned,
        };
        self.open = Open::default();
        // Products of many rotations wander off the unit sphere.
        self.attitude /= self.attitude.norm();
        self.run.push(piece);
        let Some(start) = self.run.first().map(|first| first.stamp) else {
            return;
        };
        if piece.stamp.since(start) >= SEGMENT_NANOS {
            self.close();
            self.run
                .retain(|piece| piece.stamp.since(start) >= HOP_NANOS);
        }
    }

    /// Keeps the segment that the run of pieces makes.
    fn close(&mut self) {
        let (Some(first), Some(last)) = (self.run.first(), self.run.last()) else {
            return;
        };
        if !TURNED.contains(&(last.turned - first.turned)) {
            return;
        }
        self.passed += 1;
        if self.passed <= self.stride {
            return;
        }
        let Some(segment) = FieldSegment::new(&self.run) else {
            return;
        };
        self.passed = 0;
        self.closed += 1;
        if self.is_live && self.kept.len() >= KEPT_LIVE {
            self.kept.remove(0);
        }
        self.kept.push(segment);
        if self.kept.len() > KEPT {
            let mut n = 0;
            self.kept.retain(|_| {
                n += 1;
                n % 2 == 1
            });
            self.stride = 2 * self.stride + 1;
        }
    }
}

impl FieldSegment {
    fn new(run: &[Piece]) -> Option<FieldSegment> {
        let start = run.first()?.stamp;
        let mut windows = [SMatrix::<f64, 3, UNKNOWNS>::zeros(); WINDOWS];
        let mut weights = [0.0; WINDOWS];
        let (mut up, mut square) = (Vector3::zeros(), 0.0);
        for piece in run {
            let c = piece.attitude;
            let c = nalgebra::Unit::new_unchecked(c).to_rotation_matrix();
            let c = c.matrix();
            let mut rows = SMatrix::<f64, 3, UNKNOWNS>::zeros();
            for b in 0..3 {
                for k in 0..3 {
                    rows.set_column(3 * b + k, &(c.column(b) * piece.field[k]));
                }
                rows.set_column(9 + b, &(-c.column(b)));
            }
            let at = piece.stamp.secs_since(start);
            for (k, (window, sum)) in windows.iter_mut().zip(&mut weights).enumerate() {
                let place = (at - (k + 1) as f64 * HALF_WIDTH) / HALF_WIDTH;
                if place.abs() < 1.0 {
                    let weight = 0.5 + 0.5 * (PI * place).cos();
                    *window += rows * weight;
                    *sum += weight;
                }
            }
            up += piece.up;
            square += piece.field.norm_squared();
        }
        if weights.iter().any(|weight| *weight < 0.5) {
            return None;
        }
        for (window, weight) in windows.iter_mut().zip(weights) {
            *window /= weight;
        }
        let share = 1.0 / WINDOWS as f64;
        let mean = windows.iter().sum::<SMatrix<f64, 3, UNKNOWNS>>() * share;
        let mut gram = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
        for window in &windows {
            let off = window - mean;
            gram += off.transpose() * off * share;
        }
        let segment = FieldSegment {
            gram,
            mean,
            up,
            square: square / run.len() as f64,
        };
        segment
            .gram
            .iter()
            .all(|g| g.is_finite())
            .then_some(segment)
    }

    /// The same in a field of this length.
    fn by(&self, unit: f64) -> FieldSegment {
        let mut scaled = self.clone();
        for i in 0..9 {
            scaled.gram.row_mut(i).scale_mut(1.0 / unit);
            scaled.gram.column_mut(i).scale_mut(1.0 / unit);
            scaled.mean.column_mut(i).scale_mut(1.0 / unit);
        }
        scaled
    }
}

/// Segments in units of the median length of their fields, and that length.
fn normalised(kept: &[FieldSegment]) -> Option<(Vec<FieldSegment>, f64)> {
    let mut lengths: Vec<f64> = kept.iter().map(|segment| segment.square.sqrt()).collect();
    let unit = crate::median::median(&mut lengths);
    (unit.is_finite() && unit > 0.0)
        .then(|| (kept.iter().map(|segment| segment.by(unit)).collect(), unit))
}

/// Rotation by a vector, rad.
fn rotation(angle: &Vector3<f64>) -> Quaternion<f64> {
    let half = angle.norm() / 2.0;
    let by = match half > 1e-4 {
        true => half.sin() / half,
        false => 1.0 - half * half / 6.0,
    };
    Quaternion::from_parts(half.cos(), angle * (0.5 * by))
}
