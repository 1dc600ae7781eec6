//! One pass over a JSON message, taking what its keys say is wanted. Pure.
//!
//! Long because it is one machine: a key decides how its value is read, and every kind of value comes back to the keys
//! inside it.

use super::Program;
use super::found::{ObjectFields, Written};
use super::scan::{MAX_DEPTH, Scanner};
use super::trie::Target;
use crate::decode::fields::FieldRole;
use crate::decode::registers::Slot;
use crate::decode::select::names::{Meaning, Px4, interval_unit, is_nanos, is_seconds, meaning};
use crate::decode::{MAX_BATCH, Undecodable, Wanted};
use std::borrow::Cow;
use strapd_attitude::record::SampleKind;
use strapd_attitude::record::TimeUnit;

/// Greatest depth of an object whose keys are looked at by name.
pub(super) const MAX_SEARCH: u32 = 6;

type Scan<T> = Result<T, Undecodable>;

/// Reads one message.
#[derive(Debug)]
pub(crate) struct Seeker<'a, 'p> {
    scanner: Scanner<'a>,
    plan: &'p Program,
    auto_gyro: bool,
    auto_accel: bool,
    auto_mag: bool,
    auto_orientation: bool,
    auto_stamp: bool,
    auto_interval: bool,
    auto_temperature: bool,
    /// Samples in arrays so far, wherever in the message.
    batched: usize,
    /// The strings and numbers of the outermost object that a line protocol needs.
    pub(crate) class: Option<Cow<'a, str>>,
    pub(crate) id: Option<Cow<'a, str>>,
    pub(crate) seq: Option<u64>,
    /// Log time, ns.
    pub(crate) log: Option<i64>,
    pub(crate) kind: Option<Cow<'a, str>>,
    /// The sensor the outermost object is of, named there or assumed.
    pub(crate) sensor: Option<Cow<'a, str>>,
}

impl<'a, 'p> Seeker<'a, 'p> {
    pub(crate) fn new(plan: &'p Program, scanner: Scanner<'a>) -> Self {
        let auto = |role| !plan.trie.gives(role);
        Seeker {
            scanner,
            plan,
            auto_gyro: auto(FieldRole::Gyro),
            auto_accel: auto(FieldRole::Accel),
            auto_mag: auto(FieldRole::Mag),
            auto_orientation: auto(FieldRole::Orientation),
            auto_stamp: auto(FieldRole::Stamp),
            auto_interval: auto(FieldRole::Interval),
            auto_temperature: auto(FieldRole::Temperature),
            batched: 0,
            class: None,
            id: None,
            seq: None,
            log: None,
            kind: None,
            sensor: None,
        }
    }

    /// The whole payload: an object, or an array of them.
    pub(crate) fn message(&mut self) -> Scan<ObjectFields<'a>> {
        let found = match self.scanner.peek() {
            Some(b'[') => {
                let mut found = ObjectFields::default();
                self.array(Some(0), 0, &mut found)?;
                found.settle(self.plan.stamp_rule());
                found
            }
            Some(b'{') => self.object(Some(0), 0, false)?,
            _ => {
                return Err(Undecodable::Json {
                    offset: 0,
                    what: "expected an object",
                });
            }
        };
        self.scanner.end()?;
        Ok(found)
    }

    fn object(&mut self, at: Option<usize>, depth: u32, twist: bool) -> Scan<ObjectFields<'a>> {
        let mut found = ObjectFields {
            px4: self.plan.px4.is_some(),
            ..ObjectFields::default()
        };
        self.scanner.enter();
        let mut first = true;
        while let Some(key) = self.scanner.key(&mut first)? {
            match self.plan.trie.key(at, &key) {
                Some(node) => self.given(node, depth, &mut found)?,
                None => self.named(&key, depth, twist, &mut found)?,
            }
        }
        if depth == 0 {
            if found.sensor.is_none() {
                found.sensor = self.plan.sensor.clone().map(Cow::Owned);
            }
            self.sensor = found.sensor.clone();
        }
        found.settle(self.plan.stamp_rule());
        Ok(found)
    }

    /// A value on a path of `--field`.
    fn given(&mut self, node: usize, depth: u32, found: &mut ObjectFields<'a>) -> Scan<()> {
        match self.plan.trie.target(node) {
            None => self.inside(Some(node), depth, false, found),
            Some(Target::Stamp(unit)) => {
                if let Some(stamp) = self.stamp(unit, 1)? {
                    found.stamp(0, stamp);
                }
                Ok(())
            }
            Some(Target::Number(slot, unit)) => {
                if slot == Slot::INTERVAL {
                    found.interval = unit;
                }
                if let Some(value) = self.scanner.float()? {
                    found.registers.float(slot, value);
                }
                Ok(())
            }
            Some(Target::Whole(FieldRole::Orientation)) => self.quaternion(false, found),
            Some(Target::Whole(role)) => {
                let vector = self.vector(1, found)?;
                match (role, vector) {
                    (FieldRole::Gyro, Some(v)) => found.gyro(0, None, None, v),
                    (FieldRole::Mag, Some(v)) => found.vector(Slot::MAG, v),
                    (_, Some(v)) => found.vector(Slot::ACCEL, v),
                    _ => {}
                }
                Ok(())
            }
        }
    }

    /// A value whose key may say what it is.
    fn named(
        &mut self,
        key: &str,
        depth: u32,
        twist: bool,
        found: &mut ObjectFields<'a>,
    ) -> Scan<()> {
        match self.meaning(key, twist) {
            Some(Meaning::Gyro { rank, unit }) if self.auto_gyro => {
                found.names_gyro |= !self.is_null();
                if let Some(v) = self.vector(1, found)? {
                    found.gyro(rank, unit, None, v);
                }
            }
            Some(Meaning::DeltaAngle) if self.auto_gyro => {
                found.names_gyro |= !self.is_null();
                if let Some(v) = self.vector(1, found)? {
                    let unit = Some(crate::decode::GyroUnit::Rad);
                    found.gyro(1, unit, Some(SampleKind::DeltaAngle), v);
                }
            }
            Some(Meaning::GyroAxis { axis, rank, unit }) if self.auto_gyro => {
                found.names_gyro |= !self.is_null();
                if let Some(value) = self.scanner.float()? {
                    found.gyro_axis(axis, rank, unit, value);
                }
            }
            Some(accel @ (Meaning::Accel { .. } | Meaning::DeltaVelocity)) if self.auto_accel => {
                found.delta_velocity |= accel == Meaning::DeltaVelocity;
                if let Some(v) = self.vector(1, &mut ObjectFields::default())? {
                    found.vector(Slot::ACCEL, v);
                }
            }
            Some(Meaning::AccelAxis { axis }) if self.auto_accel => {
                if let Some(value) = self.scanner.float()? {
                    found.registers.float(Slot::ACCEL.plus(axis), value);
                }
            }
            Some(Meaning::Mag) if self.auto_mag => {
                if let Some(v) = self.vector(1, &mut ObjectFields::default())? {
                    found.vector(Slot::MAG, v);
                }
            }
            Some(Meaning::MagAxis { axis }) if self.auto_mag => {
                if let Some(value) = self.scanner.float()? {
                    found.registers.float(Slot::MAG.plus(axis), value);
                }
            }
            Some(Meaning::Orientation { .. }) if self.auto_orientation => {
                let w_first = self.plan.px4 == Some(Px4::VehicleAttitude);
                self.quaternion(w_first, found)?;
            }
            Some(Meaning::Stamp { rank, unit }) if self.auto_stamp => {
                if let Some(stamp) = self.stamp(unit, 1)? {
                    found.stamp(rank, stamp);
                }
            }
            Some(Meaning::Header) if self.scanner.peek() == Some(b'{') => {
                let header = self.object(None, depth + 1, false)?;
                if let (Some((rank, stamp)), true) = (header.stamp.clone(), self.auto_stamp) {
                    found.stamp(rank, stamp);
                }
                found.frame = header.frame.clone().or(found.frame.take());
                found.nest(header, self.plan.stamp_rule());
            }
            Some(Meaning::GyroInterval(unit)) if self.auto_interval => {
                found.px4 = true;
                found.kind.get_or_insert(SampleKind::Average);
                found.interval = self.interval(unit, Slot::INTERVAL, found)?;
            }
            Some(Meaning::Interval(unit)) if self.auto_interval => {
                found.interval = unit;
                self.number(Slot::INTERVAL, found)?;
            }
            Some(Meaning::AccelInterval(unit)) if self.auto_accel => {
                found.accel_interval = self.interval(unit, Slot::ACCEL_INTERVAL, found)?;
            }
            Some(Meaning::OrientationResets) if self.auto_orientation => {
                self.number(Slot::RESETS, found)?;
            }
            Some(Meaning::Temperature) if self.auto_temperature => {
                self.number(Slot::TEMPERATURE, found)?
            }
            _ => self.other(key, depth, found)?,
        }
        Ok(())
    }

    /// Whether the value is `null`, which is as if its key were not there.
    fn is_null(&mut self) -> bool {
        self.scanner.peek() == Some(b'n')
    }

    fn meaning(&self, key: &str, twist: bool) -> Option<Meaning> {
        let gyro = Some(Meaning::Gyro {
            rank: 5,
            unit: None,
        });
        match key {
            "angular" if twist => gyro,
            "vector" if self.plan.vector_stamped => match self.plan.wanted {
                Wanted::Rates => gyro,
                Wanted::Forces => Some(Meaning::Accel { rank: 5 }),
                Wanted::Fields => Some(Meaning::Mag),
                Wanted::Temperatures => None,
            },
            "xyz" if self.plan.px4 == Some(Px4::VehicleAngularVelocity) => gyro,
            _ => meaning(key),
        }
    }

    /// A key that means no quantity: a mark, a name, or something to look into.
    fn other(&mut self, key: &str, depth: u32, found: &mut ObjectFields<'a>) -> Scan<()> {
        let first = self.scanner.peek();
        match (key, first) {
            ("angular_velocity_covariance", Some(b'[')) => self.mark(Slot::GYRO_MARK, found),
            ("linear_acceleration_covariance", Some(b'[')) => self.mark(Slot::ACCEL_MARK, found),
            ("magnetic_field_covariance", Some(b'[')) => self.mark(Slot::MAG_MARK, found),
            ("orientation_covariance", Some(b'[')) => self.mark(Slot::ORIENTATION_MARK, found),
            ("values", Some(b'[' | b'{')) => {
                let values = match first {
                    Some(b'[') => self.leading_triple()?,
                    _ => self.vector(0, found)?,
                };
                found.values = values.or(found.values);
                Ok(())
            }
            (_, Some(b'"')) => {
                let text = self.scanner.string()?;
                let slot = match key {
                    "frame_id" => &mut found.frame,
                    "child_frame_id" => &mut found.child,
                    "type" | "name" | "sensor" => &mut found.sensor,
                    "class" if depth == 0 => &mut self.class,
                    "id" | "device" if depth == 0 => &mut self.id,
                    "sample_kind" if depth == 0 => &mut self.kind,
                    _ => return Ok(()),
                };
                slot.get_or_insert(text);
                Ok(())
            }
            ("seq", Some(b'0'..=b'9')) if depth == 0 => {
                self.seq = self.scanner.number()?.and_then(|n| n.parse().ok());
                Ok(())
            }
            ("log_ns", Some(b'-' | b'0'..=b'9')) if depth == 0 => {
                self.log = self.scanner.number()?.and_then(|n| n.parse().ok());
                Ok(())
            }
            (_, Some(b'{' | b'[')) => self.inside(None, depth, key == "twist", found),
            _ => self.scanner.skip(depth),
        }
    }

    /// Looks into an object or array.
    fn inside(
        &mut self,
        at: Option<usize>,
        depth: u32,
        twist: bool,
        found: &mut ObjectFields<'a>,
    ) -> Scan<()> {
        let limit = if at.is_some() { MAX_DEPTH } else { MAX_SEARCH };
        match self.scanner.peek() {
            Some(b'{') if depth < limit => {
                let inner = self.object(at, depth + 1, twist)?;
                found.nest(inner, self.plan.stamp_rule());
                Ok(())
            }
            Some(b'[') if depth < limit => self.array(at, depth, found),
            _ => self.scanner.skip(depth),
        }
    }

    fn array(&mut self, at: Option<usize>, depth: u32, found: &mut ObjectFields<'a>) -> Scan<()> {
        self.scanner.enter();
        let mut first = true;
        let mut index = 0_u32;
        while self.scanner.element(&mut first)? {
            let node = self.plan.trie.element(at, index);
            index = index.saturating_add(1);
            match (node, self.scanner.peek()) {
                (Some((node, false)), _) => self.given(node, depth + 1, found)?,
                (Some((node, true)), Some(b'{')) => {
                    let element = self.object(Some(node), depth + 1, false)?;
                    self.element(element, found)?;
                }
                (None, Some(b'{')) if depth < MAX_SEARCH => {
                    let element = self.object(None, depth + 1, false)?;
                    self.element(element, found)?;
                }
                _ => self.scanner.skip(depth + 1)?,
            }
        }
        Ok(())
    }

    /// One object of an array: a sample of a batch, or one transform among others.
    fn element(&mut self, element: ObjectFields<'a>, found: &mut ObjectFields<'a>) -> Scan<()> {
        if element.has_gyro() || (self.plan.takes_besides && element.is_beside()) {
            if self.batched >= MAX_BATCH {
                return Err(Undecodable::TooMany {
                    limit: MAX_BATCH as u64,
                    field: "an array of samples".to_owned(),
                });
            }
            self.batched += 1;
            found.batch.push(element);
        } else if element.has_orientation() && !found.has_orientation() {
            let wanted = match &self.plan.child {
                Some(child) => element.child.as_deref() == Some(child),
                None => true,
            };
            if wanted {
                found.nest(element, self.plan.stamp_rule());
            }
        }
        Ok(())
    }

    fn number(&mut self, slot: Slot, found: &mut ObjectFields<'a>) -> Scan<()> {
        if let Some(value) = self.scanner.float()? {
            found.registers.float(slot, value);
        }
        Ok(())
    }

    /// An interval under a name of PX4's, and its unit: JSON has no types, and none is shorter than a microsecond.
    fn interval(
        &mut self,
        named: TimeUnit,
        slot: Slot,
        found: &mut ObjectFields<'a>,
    ) -> Scan<TimeUnit> {
        let Some(value) = self.scanner.float()? else {
            return Ok(named);
        };
        found.registers.float(slot, value);
        Ok(interval_unit(named, value > 0.0 && value < 1.0))
    }

    /// The first number of an array.
    fn mark(&mut self, slot: Slot, found: &mut ObjectFields<'a>) -> Scan<()> {
        self.scanner.enter();
        let mut first = true;
        let mut index = 0;
        while self.scanner.element(&mut first)? {
            if index == 0 {
                self.number(slot, found)?;
            } else {
                self.scanner.skip(0)?;
            }
            index = 1;
        }
        Ok(())
    }

    /// Three numbers: an array of three, or an object with x, y, z, or one that wraps either; `null`
    /// in any place is none. A stamp inside the wrapper is the sample's own.
    fn vector(&mut self, wraps: u32, found: &mut ObjectFields<'a>) -> Scan<Option<[f64; 3]>> {
        match self.scanner.peek() {
            Some(b'[') => self.triple(),
            Some(b'{') => {
                let mut axes = [None; 3];
                let mut wrapped = None;
                self.scanner.enter();
                let mut first = true;
                while let Some(key) = self.scanner.key(&mut first)? {
                    match &*key {
                        "x" | "X" => axes[0] = self.scanner.float()?,
                        "y" | "Y" => axes[1] = self.scanner.float()?,
                        "z" | "Z" => axes[2] = self.scanner.float()?,
                        "vec" | "vector" | "value" | "values" | "data" | "xyz" if wraps > 0 => {
                            wrapped = self.vector(wraps - 1, found)?;
                        }
                        key => match meaning(key) {
                            Some(Meaning::Stamp { unit, .. }) if self.auto_stamp => {
                                if let Some(stamp) = self.stamp(unit, 1)? {
                                    found.stamp(0, stamp);
                                }
                            }
                            Some(Meaning::Header) if self.auto_stamp => {
                                if let Some(stamp) = self.stamp(TimeUnit::ByMagnitude, 1)? {
                                    found.stamp(0, stamp);
                                }
                            }
                            _ => self.scanner.skip(0)?,
                        },
                    }
                }
                Ok(match axes {
                    [Some(x), Some(y), Some(z)] => Some([x, y, z]),
                    _ => wrapped,
                })
            }
            _ => self.scanner.skip(0).map(|()| None),
        }
    }

    fn triple(&mut self) -> Scan<Option<[f64; 3]>> {
        Ok(self
            .numbers()?
            .and_then(|(v, count)| (count == 3).then_some(v)))
    }

    /// Three numbers, or six of which the last three say what is known of the first: the drift that
    /// Android's uncalibrated gyro estimates and does not remove.
    fn leading_triple(&mut self) -> Scan<Option<[f64; 3]>> {
        Ok(self
            .numbers()?
            .and_then(|(v, count)| matches!(count, 3 | 6).then_some(v)))
    }

    /// The first three numbers of an array, and how many elements it has.
    fn numbers(&mut self) -> Scan<Option<([f64; 3], usize)>> {
        let mut values = [None; 3];
        let mut count = 0_usize;
        self.scanner.enter();
        let mut first = true;
        while self.scanner.element(&mut first)? {
            let value = self.scanner.float()?;
            if let Some(slot) = values.get_mut(count) {
                *slot = value;
            }
            count += 1;
        }
        Ok(match values {
            [Some(x), Some(y), Some(z)] => Some(([x, y, z], count)),
            _ => None,
        })
    }

    /// An object with w, x, y, z. An array of four has no order of its own and is taken only from
    /// the one message that defines it (PX4: w first).
    fn quaternion(&mut self, w_first: bool, found: &mut ObjectFields<'a>) -> Scan<()> {
        let mut values = [None; 4];
        match self.scanner.peek() {
            Some(b'{') => {
                self.scanner.enter();
                let mut first = true;
                while let Some(key) = self.scanner.key(&mut first)? {
                    let slot = match &*key {
                        "w" => &mut values[0],
                        "x" => &mut values[1],
                        "y" => &mut values[2],
                        "z" => &mut values[3],
                        _ => {
                            self.scanner.skip(0)?;
                            continue;
                        }
                    };
                    *slot = self.scanner.float()?;
                }
            }
            Some(b'[') if w_first => {
                self.scanner.enter();
                let mut first = true;
                let mut count = 0_usize;
                while self.scanner.element(&mut first)? {
                    let value = self.scanner.float()?;
                    if let Some(slot) = values.get_mut(count) {
                        *slot = value;
                    }
                    count += 1;
                }
                if count != 4 {
                    return Ok(());
                }
            }
            _ => return self.scanner.skip(0),
        }
        if let [Some(w), Some(x), Some(y), Some(z)] = values {
            for (n, value) in (0_u8..).zip([w, x, y, z]) {
                found.registers.float(Slot::ORIENTATION.plus(n), value);
            }
        }
        Ok(())
    }

    /// A stamp: a number, a string, or an object of seconds and nanoseconds; a header around one.
    fn stamp(&mut self, unit: TimeUnit, wraps: u32) -> Scan<Option<Written<'a>>> {
        match self.scanner.peek() {
            Some(b'"') => Ok(Some(Written::Text(self.scanner.string()?, unit))),
            Some(b'{') => {
                let (mut sec, mut nanos, mut inner) = (None, None, None);
                self.scanner.enter();
                let mut first = true;
                while let Some(key) = self.scanner.key(&mut first)? {
                    if is_seconds(&key) {
                        sec = self.count()?;
                    } else if is_nanos(&key) {
                        nanos = self.count()?;
                    } else if let (Some(Meaning::Stamp { unit, .. }), 1..) = (meaning(&key), wraps)
                    {
                        inner = self.stamp(unit, wraps - 1)?;
                    } else {
                        self.scanner.skip(0)?;
                    }
                }
                Ok(match (sec, nanos) {
                    (None, None) => inner,
                    (sec, nanos) => Some(Written::Pair(sec.unwrap_or("0"), nanos.unwrap_or("0"))),
                })
            }
            _ => Ok(self
                .scanner
                .number()?
                .map(|text| Written::Number(text, unit))),
        }
    }

    /// A number, or one in quotes as protobuf's JSON writes 64-bit integers.
    fn count(&mut self) -> Scan<Option<&'a str>> {
        if self.scanner.peek() == Some(b'"') {
            return Ok(match self.scanner.string()? {
                Cow::Borrowed(text) => Some(text),
                Cow::Owned(_) => None,
            });
        }
        self.scanner.number()
    }
}
