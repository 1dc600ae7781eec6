//! Fields and rates of a topic -> whether what comes as a magnetic field is one. Pure.
//!
//! Apart from the run because a live sensor is watched by it, too: a field of zero, or one that stands still while the body
//! rotates, is none.

use crate::summary::aid::Frozen;
use nalgebra::Vector3;
use strapd_attitude::condition::Rails;
use strapd_attitude::record::{Nanos, SampleKind};

/// A field that is the same to the bit is frozen once the body has rotated it by so much, rad...
const ROTATED: f64 = 0.5;
/// ... within so long: slower, and it may be the bias of a gyro at rest; ns.
const WINDOW: i64 = 5_000_000_000;
/// A slow magnetometer repeats itself for less, ns.
const REPEATED: i64 = 2_000_000_000;
/// A field that has been the same for less is one that changes: no rotation is followed, ns.
const FOLLOWED: i64 = 250_000_000;
/// Fields at one reading, as large as any, below which it is no end of a range.
const LEAST_AT_END: u64 = 20;
/// Different fields after which an axis that reads but one value is dead, if another one changed by so much of their
/// length.
const LEAST_FIELDS: u64 = 100;
const TURNED: f64 = 0.3;
/// Across a longer step between rates, ns, nothing is known of the rotation.
const STEP: i64 = 500_000_000;

/// Watches whether what comes as a magnetic field is one.
#[derive(Clone, Debug)]
pub(crate) struct FieldWatch {
    kind: SampleKind,
    /// Fields, and those of them that are nothing but zero, or no numbers.
    count: u64,
    empty: u64,
    /// Different fields, one after the other.
    changes: u64,
    field: Option<Vector3<f64>>,
    /// Time since which it is the same.
    since: Nanos,
    /// The direction that it would have by now, and from when on.
    turned: Vector3<f64>,
    anchor: Nanos,
    last: Option<Nanos>,
    is_frozen: bool,
    frozen: Option<Frozen>,
    rails: Rails,
    /// Lowest and highest reading of each axis.
    range: [Vector3<f64>; 2],
}

/// Axis of a magnetometer at the end of its range.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Saturated {
    pub(crate) axis: usize,
    /// Reading, in the unit of the source.
    pub(crate) level: f64,
    /// Different fields with it, and all.
    pub(crate) samples: u64,
    pub(crate) of: u64,
}

impl FieldWatch {
    /// Makes one for rates of this kind.
    pub(crate) fn new(kind: SampleKind) -> FieldWatch {
        FieldWatch {
            kind,
            count: 0,
            empty: 0,
            changes: 0,
            field: None,
            since: Nanos(0),
            turned: Vector3::zeros(),
            anchor: Nanos(0),
            last: None,
            is_frozen: false,
            frozen: None,
            rails: Rails::new(),
            range: [Vector3::repeat(f64::MAX), Vector3::repeat(f64::MIN)],
        }
    }

    /// Takes a field, sensor axes.
    pub(crate) fn take_field(&mut self, field: [f64; 3], stamp: Nanos) {
        let field = Vector3::from(field);
        self.count += 1;
        if field == Vector3::zeros() || !field.iter().all(|v| v.is_finite()) {
            self.empty += 1;
            return;
        }
        if self.field == Some(field) {
            return;
        }
        self.thaw(stamp);
        self.changes += 1;
        self.rails.push(&field.into());
        let [lowest, highest] = &self.range;
        self.range = [lowest.inf(&field), highest.sup(&field)];
        self.field = Some(field);
        (self.since, self.anchor) = (stamp, stamp);
    }

    /// Takes what a sample says of the rotation, in the axes of the field: rad/s, or rad.
    pub(crate) fn take_rate(&mut self, gyro: [f64; 3], stamp: Nanos) {
        let step = self.last.replace(stamp).map_or(0, |last| stamp.since(last));
        let Some(field) = self.field else { return };
        if stamp.since(self.since) < FOLLOWED {
            self.anchor = self.since;
            return;
        }
        if self.anchor <= self.since {
            return self.restart(stamp);
        }
        let gyro = Vector3::from(gyro);
        if !(0..=STEP).contains(&step) || !gyro.iter().all(|v| v.is_finite()) {
            self.restart(stamp);
            return;
        }
        let turn = match self.kind {
            SampleKind::Rate | SampleKind::Average => gyro * (step as f64 * 1e-9),
            SampleKind::DeltaAngle | SampleKind::Rotation => gyro,
        };
        let turned = self.turned - turn.cross(&self.turned);
        self.turned = turned.try_normalize(0.0).unwrap_or(turned);
        if self.turned.angle(&field) > ROTATED && stamp.since(self.since) >= REPEATED {
            self.is_frozen = true;
        }
        if stamp.since(self.anchor) > WINDOW {
            self.restart(stamp);
        }
    }

    fn restart(&mut self, stamp: Nanos) {
        self.turned = self.field.unwrap_or_default().normalize();
        self.anchor = stamp;
    }

    /// The field changes, or ends, at `stamp`.
    fn thaw(&mut self, stamp: Nanos) {
        if std::mem::take(&mut self.is_frozen) {
            let secs = stamp.secs_since(self.since).max(0.0);
            let frozen = self.frozen.get_or_insert(Frozen {
                secs: 0.0,
                from: self.since,
            });
            frozen.secs += secs;
        }
    }

    /// Ends it: no more comes.
    pub(crate) fn finish(&mut self) {
        if let Some(last) = self.last {
            self.thaw(last);
        }
    }

    /// Stretch for which it stood still.
    pub(crate) fn frozen(&self) -> Option<Frozen> {
        self.frozen
    }

    /// The same, with a stretch that has not ended.
    pub(crate) fn frozen_so_far(&self) -> Option<Frozen> {
        let mut now = self.clone();
        now.finish();
        now.frozen
    }

    /// The axis that reads the end of its range the most.
    pub(crate) fn saturated(&self) -> Option<Saturated> {
        let clipped = self.rails.clipped_anywhere();
        let found = clipped.iter().enumerate().filter_map(|(axis, clipped)| {
            let clipped = clipped.filter(|clipped| clipped.samples >= LEAST_AT_END)?;
            Some(Saturated {
                axis,
                level: clipped.level,
                samples: clipped.samples,
                of: self.changes,
            })
        });
        found.max_by_key(|found| found.samples)
    }

    /// The axis that reads but one value, and that, though the field turned about the others.
    pub(crate) fn dead_axis(&self) -> Option<(usize, f64)> {
        let [lowest, highest] = &self.range;
        let spans = highest - lowest;
        let length = self.field.unwrap_or_default().norm();
        let turned = self.changes >= LEAST_FIELDS && spans.amax() > TURNED * length;
        let dead = (0..3).find(|axis| spans[*axis] == 0.0).filter(|_| turned)?;
        Some((dead, lowest[dead]))
    }

    /// Number of fields, if none of them is more than zero.
    pub(crate) fn empty(&self) -> Option<u64> {
        (self.count > 0 && self.empty == self.count).then_some(self.count)
    }

    /// Why no heading comes of it, where `paired` reached a sample.
    pub(crate) fn no_field(&self, paired: u64) -> Option<String> {
        let n = self.count;
        let field = self.field.unwrap_or_default();
        let numbers = || format!("({}, {}, {})", field.x, field.y, field.z);
        if n == 0 {
            return Some("no sample carries a magnetic field".to_owned());
        }
        if self.empty().is_some() {
            return Some(format!(
                "each of the {n} magnetic fields is zero, or no number"
            ));
        }
        if self.changes == 1 && self.frozen.is_some() {
            return Some(format!(
                "the magnetic field is {} in all {n} samples of it while the body rotates: it is frozen, and no field",
                numbers()
            ));
        }
        (paired == 0).then(|| {
            format!("none of the {n} magnetic fields is within 0.5 s of a sample: they are of another clock")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten seconds at 100 Hz of a body that rotates by `rate` about x while the field is `field(i)`.
    fn watched(rate: f64, field: impl Fn(i64) -> [f64; 3]) -> FieldWatch {
        let mut watch = FieldWatch::new(SampleKind::Rate);
        for i in 0..1000 {
            let stamp = Nanos(i * 10_000_000);
            watch.take_field(field(i), stamp);
            watch.take_rate([rate, 0.0, 0.0], stamp);
        }
        watch.finish();
        watch
    }

    #[test]
    fn a_field_is_frozen_only_where_the_body_rotates_it() {
        let still = |_| [0.0, 20.0, -45.0];
        assert!(watched(0.5, still).no_field(1).is_some());
        // A rest, with the bias of a bad gyro.
        assert_eq!(watched(0.08, still).no_field(1), None);
        // About the field itself.
        assert_eq!(watched(0.5, |_| [30.0, 0.0, 0.0]).no_field(1), None);
        // A compass that says the same for a second.
        let slow = watched(1.0, |i| {
            let (sin, cos) = (-(i / 100) as f64).sin_cos();
            [0.0, 20.0 * cos, 20.0 * sin]
        });
        assert_eq!((slow.no_field(10), slow.frozen()), (None, None));
        // It froze on the way.
        let froze = watched(1.0, |i| {
            let (sin, cos) = (-0.01 * i.min(500) as f64).sin_cos();
            [0.0, 20.0 * cos, 20.0 * sin]
        });
        assert_eq!(froze.no_field(500), None);
        let frozen = froze.frozen().unwrap_or(Frozen {
            secs: 0.0,
            from: Nanos(0),
        });
        assert_eq!(frozen.from, Nanos(5_000_000_000));
        assert!((frozen.secs - 4.99).abs() < 1e-9, "{frozen:?}");
        assert!(watched(0.5, |_| [0.0; 3]).no_field(1000).is_some());
        // About an axis that reads nothing, by a field that turns; of one that hardly turns it may be so.
        let about_x = |by: f64| {
            move |i: i64| {
                let (sin, cos) = (by * i as f64).sin_cos();
                [0.0, 20.0 * cos, 20.0 * sin]
            }
        };
        assert_eq!(watched(1.0, about_x(-0.01)).dead_axis(), Some((0, 0.0)));
        assert_eq!(watched(1.0, about_x(-1e-4)).dead_axis(), None);
        let noisy = |i: i64| {
            [
                0.1 * (i % 3) as f64,
                20.0 + 0.01 * (i % 7) as f64,
                (i % 50) as f64,
            ]
        };
        let noisy = watched(1.0, noisy);
        assert_eq!(noisy.dead_axis(), None);
        assert!(watched(0.5, |_| [f64::NAN; 3]).no_field(0).is_some());
    }
}
