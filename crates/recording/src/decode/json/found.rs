//! Contents of one JSON object, and how the finds of nested objects join. Pure.

use super::super::registers::{Form, Registers, Slot};
use super::super::stamp::{self, Bare, from_decimal, from_rfc3339};
use super::super::{Decoded, FieldRole, GyroUnit};
use std::borrow::Cow;
use strapd_attitude::record::TimeUnit;
use strapd_attitude::record::{Nanos, RawSample, SampleKind};

/// A stamp as it was written; its unit may depend on keys that come later.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Written<'a> {
    /// A number, as text.
    Number(&'a str, TimeUnit),
    /// A string: decimal or RFC 3339.
    Text(Cow<'a, str>, TimeUnit),
    /// Seconds and nanoseconds.
    Pair(&'a str, &'a str),
}

/// Instant at which a sample was taken, as far as one message tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Instant {
    /// Then.
    At(Nanos),
    /// A number whose unit only its stream tells.
    Bare(Bare),
}

/// Rule by which a stamp is chosen if an object and one inside it both have one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StampRule {
    /// The one that `--field` names, wherever it lies.
    Given,
    /// The outermost.
    Outer,
    /// The one nearest to the sample.
    Nested,
}

/// Quantity that a phone's sensor of this name measures. An accelerometer only where gravity is in it, and in the
/// direction of a
/// specific force: Android's, and Sensor Logger's `totalacceleration` and `accelerometeruncalibrated` (what it calls
/// `accelerometer` is without gravity).
fn measured_by(sensor: &str) -> Option<Slot> {
    let name = sensor.to_ascii_lowercase();
    match &*name {
        "android.sensor.accelerometer" | "totalacceleration" | "accelerometeruncalibrated" => {
            Some(Slot::ACCEL)
        }
        "android.sensor.magnetic_field" | "magnetometer" => Some(Slot::MAG),
        _ if name.contains("gyro") => Some(Slot::GYRO),
        _ => None,
    }
}

/// Contents of one object.
#[derive(Debug, Clone, Default)]
pub(crate) struct ObjectFields<'a> {
    pub(crate) registers: Registers,
    /// Weakness of the gyro's name; a lower one displaces it.
    pub(crate) gyro_rank: Option<u8>,
    pub(crate) stamp: Option<(u8, Written<'a>)>,
    pub(crate) kind: Option<SampleKind>,
    pub(crate) unit: Option<GyroUnit>,
    pub(crate) interval: TimeUnit,
    pub(crate) accel_interval: TimeUnit,
    /// A body rate is named, if without a value: a sample that lacks it.
    pub(crate) names_gyro: bool,
    /// Numbers under `values`, whose meaning only a sensor's name tells.
    pub(crate) values: Option<[f64; 3]>,
    pub(crate) sensor: Option<Cow<'a, str>>,
    pub(crate) frame: Option<Cow<'a, str>>,
    pub(crate) child: Option<Cow<'a, str>>,
    /// The specific force is a delta velocity, and means nothing without its interval.
    pub(crate) delta_velocity: bool,
    /// A PX4 message: an unlabelled integer stamp is in microseconds.
    pub(crate) px4: bool,
    /// An object and one inside it both have a stamp.
    pub(crate) has_rival_stamps: bool,
    /// Contents of objects inside this one; joined last, so that the order of keys does not matter.
    pub(crate) nested: Option<Box<ObjectFields<'a>>>,
    /// Samples of an array inside.
    pub(crate) batch: Vec<ObjectFields<'a>>,
}

impl<'a> ObjectFields<'a> {
    /// Puts a body rate unless one of a better name is there.
    pub(crate) fn gyro(
        &mut self,
        rank: u8,
        unit: Option<GyroUnit>,
        kind: Option<SampleKind>,
        vector: [f64; 3],
    ) {
        if self.gyro_rank.is_some_and(|old| old <= rank) {
            return;
        }
        self.gyro_rank = Some(rank);
        self.unit = unit;
        self.kind = kind.or(self.kind);
        self.vector(Slot::GYRO, vector);
    }

    /// Puts one axis of a body rate.
    pub(crate) fn gyro_axis(&mut self, axis: u8, rank: u8, unit: Option<GyroUnit>, value: f64) {
        match self.gyro_rank {
            Some(old) if old < rank => return,
            Some(old) if old == rank => {}
            _ => self.registers.seen &= !Slot::GYRO.bits(3),
        }
        self.gyro_rank = Some(rank);
        self.unit = unit;
        self.registers.float(Slot::GYRO.plus(axis), value);
    }

    pub(crate) fn vector(&mut self, slot: Slot, vector: [f64; 3]) {
        for (n, value) in (0_u8..).zip(vector) {
            self.registers.float(slot.plus(n), value);
        }
    }

    pub(crate) fn stamp(&mut self, rank: u8, stamp: Written<'a>) {
        if self.stamp.as_ref().is_none_or(|(old, _)| rank < *old) {
            self.stamp = Some((rank, stamp));
        }
    }

    pub(crate) fn has_gyro(&self) -> bool {
        self.registers.has(Slot::GYRO, 3)
    }

    /// Whether the object has what fills the role.
    pub(crate) fn has(&self, role: FieldRole) -> bool {
        match role {
            FieldRole::Gyro => self.has_gyro(),
            FieldRole::Accel => self.registers.has(Slot::ACCEL, 3),
            FieldRole::Mag => self.registers.has(Slot::MAG, 3),
            FieldRole::Orientation => self.has_orientation(),
            FieldRole::Stamp => self.stamp.is_some(),
            FieldRole::Interval => self.registers.has(Slot::INTERVAL, 1),
            FieldRole::Temperature => self.registers.has(Slot::TEMPERATURE, 1),
        }
    }

    /// Whether it is of an accelerometer or magnetometer that sends by itself.
    pub(crate) fn is_beside(&self) -> bool {
        let has = |slot| self.registers.has(slot, 3);
        !self.has_gyro()
            && !self.names_gyro
            && !self.has_orientation()
            && (has(Slot::ACCEL) || has(Slot::MAG))
    }

    pub(crate) fn has_orientation(&self) -> bool {
        self.registers.has(Slot::ORIENTATION, 4)
    }

    /// Keeps what an object inside this one held, until all keys have been seen.
    pub(crate) fn nest(&mut self, mut inner: ObjectFields<'a>, rule: StampRule) {
        self.names_gyro |= inner.names_gyro;
        // That of a battery is none of the sensor's.
        if !inner.has_gyro() {
            inner.registers.seen &= !Slot::TEMPERATURE.bits(1);
        }
        if inner.registers.seen == 0 && inner.batch.is_empty() && inner.stamp.is_none() {
            return;
        }
        match &mut self.nested {
            Some(nested) => nested.join(inner, rule),
            // An empty one joins first, as any other: a stamp alone must not come in by itself.
            None => {
                let mut nested = ObjectFields::default();
                nested.join(inner, rule);
                self.nested = Some(Box::new(nested));
            }
        }
    }

    /// All keys have been seen: joins what lay inside, and reads `values` as a body rate when the
    /// sensor's name says so.
    pub(crate) fn settle(&mut self, rule: StampRule) {
        if self.delta_velocity && !self.registers.has(Slot::ACCEL_INTERVAL, 1) {
            self.registers.seen &= !Slot::ACCEL.bits(3);
        }
        if let (Some(values), Some(sensor)) = (self.values, &self.sensor)
            && let Some(slot) = measured_by(sensor)
        {
            let sensor_is_android = sensor.starts_with("android.");
            if slot == Slot::GYRO {
                self.gyro(4, Some(GyroUnit::Rad), None, values);
            } else if !self.registers.has(slot, 3) {
                self.vector(slot, values);
            }
            // Android stamps its events in nanoseconds since boot.
            if let (true, Some((_, Written::Number(_, unit @ TimeUnit::ByMagnitude)))) =
                (sensor_is_android, &mut self.stamp)
            {
                *unit = TimeUnit::Nano;
            }
        }
        if let Some(nested) = self.nested.take() {
            self.join(*nested, rule);
        }
    }

    /// Takes in what an object inside this one held.
    fn join(&mut self, mut inner: ObjectFields<'a>, rule: StampRule) {
        let nearer = inner.has_gyro() || (inner.has_orientation() && !self.has_gyro());
        let wanted = (inner.has_gyro() && !self.has_gyro())
            || (inner.has_orientation() && !self.has_orientation());
        if rule == StampRule::Given
            && let Some((rank, stamp)) = inner.stamp.clone()
        {
            self.stamp(rank, stamp);
        }
        if self.batch.is_empty() {
            self.batch = std::mem::take(&mut inner.batch);
        }
        let loose = inner.registers.seen & !self.registers.seen != 0;
        if !wanted && !loose {
            return;
        }
        if nearer && wanted {
            self.has_rival_stamps |=
                inner.has_rival_stamps || (self.stamp.is_some() && inner.stamp.is_some());
            let wins = match rule {
                StampRule::Given => false,
                StampRule::Outer => self.stamp.is_none(),
                StampRule::Nested => true,
            };
            if wins && inner.stamp.is_some() {
                self.stamp = inner.stamp.take();
            }
            self.frame = inner.frame.take().or(self.frame.take());
            self.child = inner.child.take().or(self.child.take());
        }
        if inner.has_gyro() && !self.has_gyro() {
            self.gyro_rank = inner.gyro_rank;
            self.unit = inner.unit;
            self.kind = inner.kind;
            self.interval = inner.interval;
            self.accel_interval = inner.accel_interval;
            self.px4 |= inner.px4;
            // Half a body rate out here must not mix with the whole one from inside.
            self.registers.seen &= !Slot::GYRO.bits(3);
        }
        self.registers.fill_from(&inner.registers);
    }

    /// The instant, once every key has been seen.
    pub(crate) fn instant(
        &self,
        settled: Option<TimeUnit>,
        outcome: &mut Decoded,
    ) -> Option<Instant> {
        let number = |text: &str, named: TimeUnit| {
            let unit = match (named, settled) {
                (TimeUnit::ByMagnitude, _) if self.px4 => TimeUnit::Micro,
                (TimeUnit::ByMagnitude, Some(settled)) => settled,
                (TimeUnit::ByMagnitude, None) => return stamp::bare(text).map(Instant::Bare),
                (named, _) => named,
            };
            from_decimal(text, unit).map(Instant::At)
        };
        match &self.stamp.as_ref()?.1 {
            Written::Number(text, named) => number(text, *named),
            Written::Text(text, named) => from_rfc3339(text)
                .map(Instant::At)
                .or_else(|| number(text, *named)),
            Written::Pair(sec, nanos) => {
                let sec = from_decimal(sec, TimeUnit::Second)?;
                let nanos = from_decimal(nanos, TimeUnit::Nano)?;
                outcome.stamps_carried += usize::from(!(0..1_000_000_000).contains(&nanos.0));
                Some(Instant::At(Nanos(sec.0.saturating_add(nanos.0))))
            }
        }
    }

    /// The unit that the name of its stamp states; of samples in an array the first one's.
    pub(crate) fn stamp_unit(&self) -> Option<TimeUnit> {
        let own = self.batch.iter().find_map(|found| found.stamp.as_ref());
        match own.or(self.stamp.as_ref())?.1 {
            Written::Number(_, TimeUnit::ByMagnitude) if self.px4 => Some(TimeUnit::Micro),
            Written::Number(_, unit) | Written::Text(_, unit) => {
                Some(unit).filter(|unit| *unit != TimeUnit::ByMagnitude)
            }
            Written::Pair(..) => None,
        }
    }

    /// The number behind an unlabelled stamp.
    pub(crate) fn unlabelled(&self) -> Option<Bare> {
        match self.instant(None, &mut Decoded::default()) {
            Some(Instant::Bare(bare)) => Some(bare),
            _ => None,
        }
    }

    /// The sample.
    pub(crate) fn sample(
        &self,
        form: &Form,
        header: Option<Nanos>,
        log: Nanos,
        publish: Nanos,
        outcome: &mut Decoded,
    ) -> RawSample {
        let form = Form {
            interval: self.interval,
            accel_interval: self.accel_interval,
            ..*form
        };
        let sample = form.sample(&self.registers, log, publish, outcome);
        RawSample { header, ..sample }
    }
}
