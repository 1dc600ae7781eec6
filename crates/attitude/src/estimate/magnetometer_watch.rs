//! RawSample, RateSample -> FieldReading: the magnetometer of a stream, held against its gyro. Pure.
//!
//! Apart from the estimator because it changes no attitude, and looks at fields whether they are asked for or not: in the
//! axes of the magnetometer, where an exchanged axis is one.

use super::meaning::Meaning;
use crate::aid::VectorPairing;
use crate::condition::Clock;
use crate::consistency::{FieldConsistency, FieldReading};
use crate::frames::{Body, In};
use crate::record::{Join, Nanos, RateSample, RawSample};
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;

/// Longest time for which a force that came in a message of its own holds, ns.
const HELD_NANOS: i64 = 25_000_000;
/// Fields that wait for their rate: those of some batches of samples.
const MOST: usize = 1 << 16;
/// Time, ns, by which rates are looked at later than they come, and the most that wait: a field that is logged after
/// its rate belongs to it, however the samples are cut into batches.
const LATER_NANOS: i64 = 100_000_000;
const MOST_RATES: usize = 4096;

/// Watch over the magnetometer of a stream.
#[derive(Clone, Debug)]
pub(super) struct MagnetometerWatch {
    consistency: FieldConsistency,
    waiting: VecDeque<(Nanos, Vector3<f64>)>,
    pairing: VectorPairing,
    rates: VecDeque<RateSample>,
    /// Whether a field has come at all.
    has_field: bool,
    clock: Clock,
    resolved: Meaning,
    /// Body axes to those of the magnetometer.
    to_sensor: Matrix3<f64>,
    /// The last force of its own.
    force: Option<(Nanos, In<Body>)>,
}

impl MagnetometerWatch {
    /// Watch over samples understood as `resolved`, timed by `clock`.
    pub(super) fn new(
        resolved: &Meaning,
        clock: Clock,
        consistency: FieldConsistency,
    ) -> MagnetometerWatch {
        MagnetometerWatch {
            consistency,
            waiting: VecDeque::new(),
            pairing: VectorPairing::with_repeats(),
            rates: VecDeque::new(),
            has_field: false,
            clock,
            resolved: resolved.clone(),
            to_sensor: resolved.field_to_body().transpose(),
            force: None,
        }
    }

    /// Takes the field of a sample, whose stamp `timed` follows into the time of the rates.
    pub(super) fn take_field(&mut self, raw: &RawSample, timed: impl Fn(Nanos) -> Nanos) {
        let Some((field, stamp)) = raw.mag.zip(self.clock.read(raw)) else {
            return;
        };
        self.has_field = true;
        let (field, lead) = self.resolved.field(field);
        let stamp = timed(stamp).0.saturating_add((lead * 1e9).round() as i64);
        if self.waiting.len() >= MOST {
            self.waiting.pop_front();
        }
        let field = self.to_sensor * field.as_vector();
        self.waiting.push_back((Nanos(stamp), field));
    }

    /// Takes a force that came in a message of its own.
    pub(super) fn take_force(&mut self, stamp: Nanos, force: In<Body>) {
        self.force = Some((stamp, force));
    }

    /// Takes conditioned samples.
    pub(super) fn push(&mut self, samples: &[RateSample]) {
        if !self.has_field {
            return self.wait(samples);
        }
        for sample in samples {
            self.rates.push_back(self.with_force(sample));
            while let Some(first) = self.rates.front().copied() {
                if !is_over(self.rates.len(), sample.stamp, first.stamp) {
                    break;
                }
                self.rates.pop_front();
                self.look_at(&first);
            }
        }
    }

    /// Keeps of samples, while no field has come, those that one still to come may belong to.
    fn wait(&mut self, samples: &[RateSample]) {
        if self.consistency.is_live() {
            return;
        }
        let held = self.rates.len();
        // Most of many samples are over before the last has come, and never kept.
        let mut gone = 0;
        for (n, sample) in samples.iter().enumerate() {
            let first = |gone: usize| match gone.checked_sub(held) {
                None => self.rates.get(gone),
                Some(of_these) => samples.get(of_these).filter(|_| of_these <= n),
            };
            while first(gone).is_some_and(|s| is_over(held + n + 1 - gone, sample.stamp, s.stamp)) {
                gone += 1;
            }
        }
        self.rates.drain(..gone.min(held));
        let kept = samples.get(gone.saturating_sub(held)..).unwrap_or_default();
        for sample in kept {
            self.rates.push_back(self.with_force(sample));
        }
    }

    /// The sample, with the last force of its own where it has none and that still holds.
    fn with_force(&self, sample: &RateSample) -> RateSample {
        let held = self
            .force
            .filter(|(stamp, _)| (0..=HELD_NANOS).contains(&sample.stamp.since(*stamp)));
        RateSample {
            accel: sample.accel.or(held.map(|(_, force)| force)),
            ..*sample
        }
    }

    fn look_at(&mut self, sample: &RateSample) {
        while let Some((stamp, field)) = self.waiting.front().copied() {
            if stamp > sample.stamp {
                break;
            }
            self.pairing.take(stamp, field);
            self.waiting.pop_front();
        }
        if matches!(sample.join, Join::Hold | Join::Reset) {
            self.consistency.interrupt();
        }
        let turned = self.to_sensor * sample.mean_rate().0;
        self.consistency.push(&FieldReading {
            stamp: sample.stamp,
            gyro: sample.gyro.with(self.to_sensor * sample.gyro.as_vector()),
            field: self.pairing.at(sample.stamp, &turned),
            force: sample.accel.map(|force| self.to_sensor * force.as_vector()),
        });
    }

    /// Gyro against magnetometer as far as was seen.
    pub(super) fn consistency(&self) -> &FieldConsistency {
        &self.consistency
    }
}

/// Whether the `first` of so many samples has waited long enough for its field, at the stamp of the last.
fn is_over(count: usize, last: Nanos, first: Nanos) -> bool {
    last.since(first) >= LATER_NANOS || count > MOST_RATES
}
