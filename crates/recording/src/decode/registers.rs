//! Registers that a walk through a payload fills -> [`RawSample`]. Pure.
//!
//! Every decoder fills the same registers, so that absence, covariance marks and stamps are read
//! in one place and mean the same in every encoding.

use super::Decoded;
use super::stamp::{from_count, from_float};
use strapd_attitude::record::TimeUnit;
use strapd_attitude::record::{Nanos, RawSample};

/// Slot of a number of a message. Three, three and four in a row are vectors and a quaternion.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub(crate) struct Slot(pub(crate) u8);

impl Slot {
    /// x of the gyro; y, z follow.
    pub(crate) const GYRO: Slot = Slot(0);
    /// x of the specific force.
    pub(crate) const ACCEL: Slot = Slot(3);
    /// w of the orientation; x, y, z follow.
    pub(crate) const ORIENTATION: Slot = Slot(6);
    /// First element of the gyro's covariance.
    pub(crate) const GYRO_MARK: Slot = Slot(10);
    /// First element of the specific force's covariance.
    pub(crate) const ACCEL_MARK: Slot = Slot(11);
    /// First element of the orientation's covariance.
    pub(crate) const ORIENTATION_MARK: Slot = Slot(12);
    /// A stamp that is a floating-point number.
    pub(crate) const STAMP_FLOAT: Slot = Slot(13);
    /// The integration interval.
    pub(crate) const INTERVAL: Slot = Slot(14);
    /// The interval of a delta velocity.
    pub(crate) const ACCEL_INTERVAL: Slot = Slot(15);
    /// x of the magnetic field; y, z follow.
    pub(crate) const MAG: Slot = Slot(16);
    /// First element of its covariance.
    pub(crate) const MAG_MARK: Slot = Slot(19);
    /// A stamp's seconds, or its only integer.
    pub(crate) const STAMP: Slot = Slot(20);
    /// A stamp's nanoseconds.
    pub(crate) const STAMP_NANOS: Slot = Slot(21);
    /// Count of the orientation's resets.
    pub(crate) const RESETS: Slot = Slot(22);
    /// Temperature of the sensor, degrees Celsius.
    pub(crate) const TEMPERATURE: Slot = Slot(23);

    /// The slot `n` further on.
    pub(crate) fn plus(self, n: u8) -> Slot {
        Slot(self.0 + n)
    }

    /// Whether it takes integers exactly.
    pub(crate) fn is_integer(self) -> bool {
        self == Slot::STAMP || self == Slot::STAMP_NANOS
    }

    /// Bits of this slot and the `n - 1` after it.
    pub(crate) fn bits(self, n: u32) -> u32 {
        ((1 << n) - 1) << self.0
    }
}

/// Places for floating-point numbers: a power of two, so that a mask is the bound.
const FLOATS: usize = 32;

/// The numbers themselves, and which of them the payload had.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Registers {
    floats: [f64; FLOATS],
    integers: [i64; 2],
    /// One bit for each slot.
    pub(crate) seen: u32,
}

impl Registers {
    /// Puts a floating-point number.
    #[inline]
    pub(crate) fn float(&mut self, slot: Slot, value: f64) {
        // The mask is the bound: slots are made by this crate, and lower here.
        self.floats[usize::from(slot.0) & (FLOATS - 1)] = value;
        self.seen |= 1 << (slot.0 & 31);
    }

    /// Puts floating-point numbers in a row.
    #[inline]
    pub(crate) fn floats<const N: usize>(&mut self, slot: Slot, values: [f64; N]) {
        let from = usize::from(slot.0) & (FLOATS - 1);
        if let Some(row) = self.floats.get_mut(from..from + N) {
            row.copy_from_slice(&values);
            self.seen |= slot.bits(N as u32);
        }
    }

    /// Puts an integer.
    #[inline]
    pub(crate) fn integer(&mut self, slot: Slot, value: i64) {
        if slot.is_integer() {
            self.integers[usize::from(slot.0 & 1)] = value;
            self.seen |= 1 << (slot.0 & 31);
        } else {
            self.float(slot, value as f64);
        }
    }

    /// Takes from `other` every slot that is empty here.
    pub(crate) fn fill_from(&mut self, other: &Registers) {
        let fresh = other.seen & !self.seen;
        for (n, (own, new)) in self.floats.iter_mut().zip(other.floats).enumerate() {
            if fresh & (1 << n) != 0 {
                *own = new;
            }
        }
        self.seen |= fresh;
    }

    /// Whether the payload had all of `n` slots from `slot`.
    #[inline]
    pub(crate) fn has(&self, slot: Slot, n: u32) -> bool {
        let bits = slot.bits(n);
        self.seen & bits == bits
    }

    #[inline]
    fn get(&self, slot: Slot) -> f64 {
        self.floats[usize::from(slot.0) & (FLOATS - 1)]
    }

    #[inline]
    fn vector(&self, slot: Slot) -> Option<[f64; 3]> {
        self.has(slot, 3).then(|| {
            [
                self.get(slot),
                self.get(slot.plus(1)),
                self.get(slot.plus(2)),
            ]
        })
    }
}

/// Form by which the numbers in the stamp's slots make an instant.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum StampForm {
    /// The message has none.
    #[default]
    None,
    /// Seconds and nanoseconds.
    SecNanos,
    /// One integer.
    Count(TimeUnit),
    /// One floating-point number.
    Float(TimeUnit),
}

/// Form by which registers become a sample: the same for every message of a channel.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Form {
    pub(crate) stamp: StampForm,
    pub(crate) interval: TimeUnit,
    pub(crate) accel_interval: TimeUnit,
    pub(crate) ignore_covariance_flag: bool,
    /// The stamp lies outside the batch: it is put in when the walk has ended.
    pub(crate) stamp_outside: bool,
}

impl Form {
    /// The stamp in the registers, and whether its nanoseconds carried over.
    pub(crate) fn stamp(&self, registers: &Registers, outcome: &mut Decoded) -> Option<Nanos> {
        match self.stamp {
            StampForm::None => None,
            StampForm::SecNanos => {
                // proto3 leaves out zeros: either half is enough.
                (registers.seen & Slot::STAMP.bits(2) != 0).then(|| {
                    let [sec, nanos] = registers.integers;
                    outcome.stamps_carried += usize::from(!(0..1_000_000_000).contains(&nanos));
                    Nanos(sec.saturating_mul(1_000_000_000).saturating_add(nanos))
                })
            }
            StampForm::Count(unit) => registers
                .has(Slot::STAMP, 1)
                .then(|| from_count(registers.integers[0], unit)),
            StampForm::Float(unit) => registers
                .has(Slot::STAMP_FLOAT, 1)
                .then(|| from_float(registers.get(Slot::STAMP_FLOAT), unit))
                .flatten(),
        }
    }

    /// The sample the registers hold.
    pub(crate) fn sample(
        &self,
        registers: &Registers,
        log: Nanos,
        publish: Nanos,
        outcome: &mut Decoded,
    ) -> RawSample {
        let marked = |slot: Slot| registers.has(slot, 1) && is_mark(registers.get(slot));
        let gyro = registers
            .vector(Slot::GYRO)
            .and_then(|gyro| self.gyro(gyro, marked(Slot::GYRO_MARK), outcome));
        let mut accel = registers.vector(Slot::ACCEL);
        if marked(Slot::ACCEL_MARK) && !self.ignore_covariance_flag {
            accel = None;
        }
        if registers.has(Slot::ACCEL_INTERVAL, 1) {
            let secs =
                registers.get(Slot::ACCEL_INTERVAL) * self.accel_interval.nanos(0.0) as f64 * 1e-9;
            accel = accel.filter(|_| secs > 0.0).map(|v| v.map(|c| c / secs));
        }
        let header = if self.stamp_outside {
            None
        } else {
            self.stamp(registers, outcome)
        };
        RawSample {
            header,
            log,
            publish,
            gyro,
            accel,
            mag: registers
                .vector(Slot::MAG)
                .filter(|_| !marked(Slot::MAG_MARK) || self.ignore_covariance_flag),
            orientation: registers
                .has(Slot::ORIENTATION, 4)
                .then_some(())
                .and_then(|()| {
                    let q = [6, 7, 8, 9].map(|n| registers.get(Slot(n)));
                    self.orientation(q, marked(Slot::ORIENTATION_MARK))
                }),
            is_beside: false,
            temperature: registers
                .has(Slot::TEMPERATURE, 1)
                .then(|| registers.get(Slot::TEMPERATURE) as f32),
            orientation_resets: registers
                .has(Slot::RESETS, 1)
                .then(|| (registers.get(Slot::RESETS) as i64) as u8),
            interval_nanos: registers.has(Slot::INTERVAL, 1).then(|| {
                let unit = match self.interval {
                    // An interval is no instant: without a stated unit it is seconds.
                    TimeUnit::ByMagnitude => TimeUnit::Second,
                    unit => unit,
                };
                (registers.get(Slot::INTERVAL) * unit.nanos(0.0) as f64).round() as i64
            }),
        }
    }

    /// The body rate unless it is marked as absent, which is counted either way.
    #[inline]
    pub(crate) fn gyro(
        &self,
        gyro: [f64; 3],
        marked: bool,
        outcome: &mut Decoded,
    ) -> Option<[f64; 3]> {
        outcome.gyro_marked_absent += usize::from(marked);
        (!marked || self.ignore_covariance_flag).then_some(gyro)
    }

    /// The orientation, when it is one: drivers without one write zeros, NaN or the mark.
    #[inline]
    pub(crate) fn orientation(&self, q: [f64; 4], marked: bool) -> Option<[f64; 4]> {
        let square: f64 = q.iter().map(|c| c * c).sum();
        // NaN compares false, so a quaternion with one is none.
        (square >= 0.25 && (!marked || self.ignore_covariance_flag)).then_some(q)
    }
}

/// Whether the first element of a covariance marks its datum as absent (Imu.msg).
#[inline]
pub(crate) fn is_mark(covariance: f64) -> bool {
    covariance == -1.0
}
