//! Samples of a live sensor -> findings, by the rules of recordings. Pure.
//!
//! Apart from the rules because a stream has no end at which it could be judged: the watch goes along with it in bounded
//! memory, and what was once certain is certain from then on.

use super::orientation::Witness;
use super::samples::{self, Seen};
use super::{Finding, Severity, axes, magnetometer, run, sensors, stream};
use crate::field_watch::FieldWatch;
use crate::finding::{
    ACCEL_UNIT_CHANGE, GRAVITY_LEAP, GYRO_AXES_CHANGE, GYRO_DEAD, GYRO_EULER_RATES,
    GYRO_UNIT_CHANGE, MIXED,
};
use crate::inspection::{Aids, Inspection};
use strapd_attitude::condition::quality::Quality;
use strapd_attitude::condition::{Clock, ClockSpeed, GyroUnit, SpeedPass};
use strapd_attitude::consistency::Consistency;
use strapd_attitude::estimate::{EstimationSettings, Estimator, Meaning, Prepared, speed_message};
use strapd_attitude::record::{RawSample, SampleKind};
use strapd_recording::recording::payload_type::PayloadType;

/// Codes of findings that stay true of a sensor until its settings change.
const LASTING: [&str; 21] = [
    GYRO_DEAD,
    "gyro-axes",
    "gyro-scale",
    "gyro-turned",
    "gyro-against-gravity",
    "mag-axes",
    "mag-iron",
    "saturated",
    "stuck",
    "wrapped",
    axes::DEAD,
    "field-frozen",
    "field-saturated",
    "field-axis-dead",
    "field-empty",
    MIXED,
    GYRO_UNIT_CHANGE,
    ACCEL_UNIT_CHANGE,
    GYRO_AXES_CHANGE,
    GRAVITY_LEAP,
    GYRO_EULER_RATES,
];
/// Codes of those about gyro and gravity.
const OF_GYRO: [&str; 6] = [
    GYRO_DEAD,
    "gyro-axes",
    "gyro-scale",
    "gyro-turned",
    "gyro-against-gravity",
    GYRO_EULER_RATES,
];
/// Segments with a field after which it is judged after every fourth alone.
const OFTEN: usize = 24;
/// Speeds of a stamp clock by arrival that are judged: beyond, a recording is sent, or the unit is another.
const SPEEDS: std::ops::Range<f64> = 0.2..5.0;
/// Time of arrival before the first judgement of it, and between two, ns; samples for the first, and for one pass.
const SPEED_LEAST: i64 = 8_000_000_000;
const SPEED_PACE: i64 = 60_000_000_000;
const SPEED_SAMPLES: u64 = 320;
const SPEED_MOST: u64 = 1 << 15;
/// Difference of two stretches in a row up to which they tell of one clock. A sender that falls behind slows down.
const SPEED_AGREES: f64 = 0.02;
/// Addition to what a recording is told of its clock.
const PLAYED: &str = "; a recording that is sent faster or slower than it ran looks the same";
/// Scatter of a field, as a share of it, from which on it is worth a look at axes and iron: 0.01 of healthy sensors.
const WANDERS: f64 = 0.03;
/// Fields of zero after which they are no beginning of a driver.
const FIELDS: u64 = 100;

/// Watch over the samples of a live sensor.
#[derive(Debug)]
pub struct SensorWatch {
    looked: Inspection,
    quality: Quality,
    field: FieldWatch,
    has_field: bool,
    /// Whether settings map axes or scale of a sensor.
    is_mapped: bool,
    /// Segments with which the field was judged last, and the finding.
    judged: usize,
    of_field: Option<Finding>,
    /// Stamps against arrivals; `None` where the stamps are those of arrival, or to be left as they are.
    speed: Option<SpeedWatch>,
}

/// Speed of the stamp clock by that of arrival.
#[derive(Debug, Default)]
struct SpeedWatch {
    pass: SpeedPass,
    samples: u64,
    first: Option<i64>,
    last: i64,
    /// Arrival at which it was judged last, and the finding.
    judged: i64,
    found: Option<Finding>,
    /// Speed of a stretch that was wrong; the next one is to confirm it.
    suspected: Option<f64>,
}

impl SpeedWatch {
    #[inline]
    fn take(&mut self, stamp: i64, arrival: i64) {
        if self.samples >= SPEED_MOST {
            *self = SpeedWatch {
                found: self.found.take(),
                suspected: self.suspected,
                judged: arrival,
                ..SpeedWatch::default()
            };
        }
        self.samples += 1;
        self.first.get_or_insert(arrival);
        self.last = arrival;
        self.pass.push(stamp, arrival);
    }

    fn finding(&mut self) -> Option<Finding> {
        let span = self.last.saturating_sub(self.first.unwrap_or(self.last));
        let since = self
            .last
            .saturating_sub(self.judged.max(self.first.unwrap_or_default()));
        let pace = match (self.judged, self.suspected) {
            (0, _) | (_, Some(_)) => SPEED_LEAST,
            _ => SPEED_PACE,
        };
        if span >= SPEED_LEAST && self.samples >= SPEED_SAMPLES && since >= pace {
            self.judge();
        }
        self.found.clone()
    }

    /// Judges the stretch since the last one that was wrong, or since the beginning; a wrong one begins the next.
    fn judge(&mut self) {
        let found = self.pass.finish().filter(is_a_clock);
        let said = found.as_ref().and_then(speed_message);
        let speed = found.filter(|_| said.is_some()).map(|found| found.speed);
        let confirmed = speed
            .zip(self.suspected)
            .is_some_and(|(now, then)| (now / then - 1.0).abs() <= SPEED_AGREES);
        let finding = said.map(|said| {
            let mut finding = Finding::said(Severity::Warning, "clock-speed", &said);
            finding.advice += PLAYED;
            finding
        });
        *self = SpeedWatch {
            found: finding.filter(|_| confirmed),
            suspected: speed,
            judged: self.last,
            ..match speed {
                Some(_) => SpeedWatch::default(),
                None => std::mem::take(self),
            }
        };
    }
}

/// Whether it is that of a clock, and not of a sender who sends as fast as it can.
fn is_a_clock(found: &ClockSpeed) -> bool {
    SPEEDS.contains(&found.speed)
}

/// Findings of one moment.
#[derive(Clone, Default, Debug)]
pub struct LiveFindings {
    /// Everything there is to report, the worst first.
    pub now: Vec<Finding>,
    /// Findings that stay true of the sensor, though its samples say nothing of them for a while.
    pub lasting: Vec<Finding>,
    /// Whether gyro and gravity agreed for so long that what was reported of them before is over.
    pub is_gyro_sound: bool,
}

impl SensorWatch {
    /// Watch over samples understood as `resolved`; `estimator` is watched from now on, too.
    #[must_use]
    pub fn new(resolved: &Meaning, prepared: &Prepared, estimator: &mut Estimator) -> SensorWatch {
        estimator.watch_sensors_live(resolved, prepared);
        let each = Some([1.0, 2.0, 3.0]);
        let probe = RawSample {
            gyro: each,
            accel: each,
            mag: each,
            ..RawSample::default()
        };
        SensorWatch {
            quality: Quality::without_steps(prepared.clock),
            looked: inspection(resolved, prepared),
            field: FieldWatch::new(resolved.kind),
            has_field: false,
            is_mapped: resolved.remapped(&probe) != probe,
            judged: 0,
            of_field: None,
            speed: (prepared.has_arrival && prepared.clock == Clock::Header)
                .then(SpeedWatch::default),
        }
    }

    /// Takes the next sample, as it came.
    pub fn take(&mut self, raw: &RawSample) {
        let resolved = &self.looked.resolved;
        let raw = match self.is_mapped {
            true => &resolved.remapped(raw),
            false => raw,
        };
        let (rate, force) = (resolved.unit.to_rad(), resolved.accel_scale.abs());
        let gyro = raw.gyro.map(|v| v.map(|v| v * rate));
        self.has_field |= raw.mag.is_some();
        if let Some(stamp) = self.looked.clock.read(raw).filter(|_| self.has_field) {
            let field = &mut self.field;
            raw.mag.iter().for_each(|mag| field.take_field(*mag, stamp));
            let gyro = gyro.filter(|_| !raw.is_beside);
            gyro.iter().for_each(|gyro| field.take_rate(*gyro, stamp));
        }
        if let (Some(speed), Some(stamp), false) = (&mut self.speed, raw.header, raw.is_beside) {
            speed.take(stamp.0, raw.log.0);
        }
        // The rules are about rates; of angles their intervals would have to be known.
        let is_rate = matches!(resolved.kind, SampleKind::Rate | SampleKind::Average);
        if raw.is_beside || !is_rate {
            return;
        }
        self.quality.push(&RawSample {
            gyro,
            accel: raw.accel.map(|v| v.map(|v| v * force)),
            ..*raw
        });
    }

    /// Findings by now, of samples that `estimator` has taken by `plan`.
    #[must_use]
    pub fn findings(&mut self, estimator: &Estimator, plan: &EstimationSettings) -> LiveFindings {
        self.looked.quality = self.quality.summary();
        let count = self.looked.quality.count;
        let mut now = samples::live(&Seen::of(&self.looked, count));
        // A range that was stated is not found out, and what reaches it is counted.
        now.retain(|finding| finding.code != "saturated" || plan.gyro_range.is_none());
        now.extend(self.speed.as_mut().and_then(SpeedWatch::finding));
        let frozen = self.field.frozen_so_far();
        now.extend(frozen.map(|frozen| run::field_frozen(estimator.conditioning(), frozen)));
        now.extend(self.field.saturated().map(run::field_saturated));
        now.extend(self.field.dead_axis().map(run::field_axis_dead));
        let empty = self.field.empty().filter(|n| *n >= FIELDS);
        now.extend(empty.map(field_empty));
        let gyro = estimator.consistency();
        let [faults, _] = &self.looked.quality.broken;
        let wanders = gyro.is_some_and(Consistency::wanders);
        now.extend(axes::broken(faults, wanders));
        let resolved = &self.looked.resolved;
        let first = estimator.conditioning().first;
        let changed = gyro.and_then(|gyro| stream::axes_changed(gyro, plan, first, true));
        let disagrees = || sensors::disagreement((gyro?, plan, resolved), Witness::default());
        now.extend(changed.or_else(disagrees));
        now.extend(gyro.and_then(|gyro| stream::gravity_leap(gyro, first, true)));
        let is_sound = gyro.is_none_or(Consistency::agrees);
        if let Some(field) = estimator.field_consistency()
            && is_sound
            && frozen.is_none()
        {
            let segments = field.segments();
            if segments > self.judged && (segments < OFTEN || segments % 4 == 0) {
                self.judged = segments;
                let wanders = field.scatter().is_some_and(|scatter| scatter > WANDERS);
                let found = || magnetometer::finding(field, plan);
                self.of_field = wanders.then(found).flatten();
            }
            now.extend(self.of_field.clone());
        }
        now.extend(stream::find(estimator.conditioning(), true));
        stream::settle(&mut now);
        let lasting = now.iter().filter(|f| LASTING.contains(&f.code));
        let lasting = lasting.cloned().collect();
        sensors::settle(&mut now);
        now.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        LiveFindings {
            now,
            lasting,
            is_gyro_sound: gyro.is_some_and(Consistency::is_sound),
        }
    }
}

/// Whether a finding that lasts, of this code, is over where gyro and gravity agree.
#[must_use]
pub fn is_of_gyro(code: &str) -> bool {
    OF_GYRO.contains(&code)
}

/// Whether `found` says what a lasting finding of this code says.
#[must_use]
pub fn says(found: &Finding, code: &str) -> bool {
    found.code == code || (is_of_gyro(code) && sensors::is_guess(found.code))
}

fn field_empty(n: u64) -> Finding {
    Finding::new(
        Severity::Warning,
        "field-empty",
        format!("each of the {n} magnetic fields is zero, or no number"),
    )
    .with("count", n)
    .advise("no heading comes of it: the magnetometer or its driver is off")
}

fn inspection(resolved: &Meaning, prepared: &Prepared) -> Inspection {
    Inspection {
        topic: String::new(),
        of: String::new(),
        described: PayloadType::default(),
        frame: String::new(),
        resolved: resolved.clone(),
        quality: Default::default(),
        quality_unit: GyroUnit::Rad,
        rests: Default::default(),
        bias: None,
        counts: Default::default(),
        clock_set: None,
        clocks: Default::default(),
        undecodable: 0,
        clock: prepared.clock,
        clock_warning: None,
        aid: Aids {
            force_scale: prepared.aiding.map_or(1.0, |aiding| aiding.force_scale),
            ..Aids::default()
        },
        is_likely: true,
        has_reference: false,
    }
}
