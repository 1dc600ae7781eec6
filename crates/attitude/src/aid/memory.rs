//! All an aided propagator needs to go on exactly, beside what the propagator knows <-> plain numbers. Pure.
//!
//! Apart from the filter because it is read by another process: nothing in it is believed unseen.

use super::aided::{Aided, Given};
use super::beside::Beside;
use super::bounds::LARGEST;
use super::calibration::{Applied, Calibration};
use super::covariance::Covariance;
use super::filter::{Filter, Report};
use super::interval::Interval;
use super::plausibility::Plausibility;
use super::residuals::Residuals;
use super::rest::Rest;
use super::surroundings::Surroundings;
use super::vertical::Vertical;
use crate::propagate;
use crate::quaternion::Quaternion;
use crate::record::Nanos;
use nalgebra::Vector3;

/// Most samples that wait for their attitude: no window looks further ahead.
const MOST_GIVEN: usize = 64;
/// Largest errors of a sensor: rad/s, of 1, m/s^2, s.
const BIAS: f64 = 10.0;
const SCALE: f64 = 0.5;
const FORCE_BIAS: f64 = 100.0;
const LEAD: f64 = 1.0;

/// State of an [`Aided`] at one moment; [`Aided::recall`] restores it. Of a method without latency
/// some 8 kB of text, 4 more at rest.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Memory {
    is_started: bool,
    calibration: Calibration,
    covariance: Covariance,
    /// Turn from the left of the propagator's attitude, w, x, y, z.
    correction: [f64; 4],
    velocity: [f64; 2],
    position: [f64; 2],
    disturbance: f64,
    interval: Interval,
    rest: Rest,
    residuals: Residuals,
    mean_acceleration: Vector3<f64>,
    last_up: Option<Vector3<f64>>,
    /// The vertical; as if nothing had been seen in a file that is older than this field.
    #[cfg_attr(feature = "serde", serde(default))]
    vertical: Vertical,
    surroundings: Surroundings,
    wants_level: bool,
    nominal: f64,
    gaps_in_a_row: u32,
    last_rate: Vector3<f64>,
    last_force: Option<Vector3<f64>>,
    since_force: f64,
    plausibility: Plausibility,
    #[cfg_attr(feature = "serde", serde(default))]
    is_widened: bool,
    report: Report,
    given: Vec<Given>,
    last: Option<Nanos>,
    /// The last attitude, w, x, y, z.
    last_out: Option<[f64; 4]>,
    forces: Option<Beside>,
    fields: Beside,
}

impl Aided {
    /// States of it and of its propagator; `None` before the first sample of a run.
    #[must_use]
    pub fn memory(&self) -> Option<(propagate::Memory, Memory)> {
        let propagation = self.propagator.memory()?;
        let filter = &self.filter;
        let memory = Memory {
            is_started: filter.is_started,
            calibration: filter.calibration,
            covariance: filter.covariance.clone(),
            correction: filter.correction.wxyz(),
            velocity: filter.velocity,
            position: filter.position,
            disturbance: filter.disturbance,
            interval: filter.interval.clone(),
            rest: filter.rest.clone(),
            residuals: filter.residuals.clone(),
            mean_acceleration: filter.mean_acceleration,
            last_up: filter.last_up,
            vertical: filter.vertical,
            surroundings: filter.surroundings.clone(),
            wants_level: filter.wants_level,
            nominal: filter.nominal,
            gaps_in_a_row: filter.gaps_in_a_row,
            last_rate: filter.last_rate,
            last_force: filter.last_force,
            since_force: filter.since_force,
            plausibility: filter.plausibility,
            is_widened: filter.is_widened,
            report: filter.report,
            given: self.given.iter().copied().collect(),
            last: self.last,
            last_out: self.last_out.map(|q| q.wxyz()),
            forces: self.forces.clone(),
            fields: self.fields.clone(),
        };
        Some((propagation, memory))
    }

    /// Goes on as the one would have that knew this. `false`, and it is as before, where no filter can have
    /// known it.
    #[must_use]
    pub fn recall(&mut self, (propagation, memory): (&propagate::Memory, &Memory)) -> bool {
        let has_forces = self.forces.is_some() == memory.forces.is_some()
            && self.filter.covariance.has_iron() == memory.covariance.has_iron();
        if !memory.is_plausible() || !has_forces || !self.propagator.recall(propagation) {
            return false;
        }
        let memory = memory.clone();
        self.filter = Filter {
            is_started: memory.is_started,
            known: Applied::of(&memory.calibration),
            calibration: memory.calibration,
            covariance: memory.covariance,
            correction: Quaternion::assume_unit(memory.correction),
            velocity: memory.velocity,
            position: memory.position,
            disturbance: memory.disturbance,
            interval: memory.interval,
            rest: memory.rest,
            residuals: memory.residuals,
            mean_acceleration: memory.mean_acceleration,
            last_up: memory.last_up,
            vertical: memory.vertical,
            surroundings: memory.surroundings,
            wants_level: memory.wants_level,
            nominal: memory.nominal,
            gaps_in_a_row: memory.gaps_in_a_row,
            last_rate: memory.last_rate,
            last_force: memory.last_force,
            since_force: memory.since_force,
            plausibility: memory.plausibility,
            is_widened: memory.is_widened,
            report: memory.report,
            ..self.filter.clone()
        };
        self.is_resumed = false;
        self.given = memory.given.into();
        self.last = memory.last;
        self.last_out = memory.last_out.map(Quaternion::assume_unit);
        self.forces = memory.forces;
        self.fields = memory.fields;
        true
    }
}

impl Memory {
    /// Whether specific forces came in messages of their own.
    #[must_use]
    pub fn has_forces_beside(&self) -> bool {
        self.forces.is_some()
    }

    /// Whether a filter can have known it, whatever its settings.
    pub(crate) fn is_plausible(&self) -> bool {
        let calibration = &self.calibration;
        let is_unit = |q: &[f64; 4]| (q.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-9;
        let beside = self.forces.iter().chain([&self.fields]);
        let scalars = [
            self.disturbance,
            self.nominal,
            self.since_force,
            self.interval.secs,
        ];
        let vectors = [
            self.mean_acceleration,
            self.last_rate,
            self.last_force.unwrap_or_default(),
            self.last_up.unwrap_or_default(),
        ];
        let mut numbers = scalars
            .into_iter()
            .chain(vectors.iter().flat_map(|v| v.iter().copied()))
            .chain(self.velocity)
            .chain(self.position);
        calibration.bias.amax() <= BIAS
            && calibration.scale.amax().max(calibration.cross.amax()) <= SCALE
            && calibration.force_bias.amax() <= FORCE_BIAS
            && calibration.lead.abs() <= LEAD
            && calibration.hard_iron.iter().all(|h| h.abs() <= LARGEST)
            && self.covariance.is_plausible()
            && is_unit(&self.correction)
            && self.last_out.iter().all(is_unit)
            && numbers.all(|number| number.abs() <= LARGEST)
            && self.nominal >= 0.0
            && self.interval.is_plausible()
            && self.residuals.is_plausible()
            && self.surroundings.is_plausible()
            && self.plausibility.is_plausible()
            && self.given.len() <= MOST_GIVEN
            && self.rest.is_bounded()
            && self.vertical.is_plausible()
            && beside.into_iter().all(Beside::is_bounded)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::aid::{Settings, Start};
    use crate::frames::In;
    use crate::propagate::{Method, Order};
    use crate::quaternion::BodyRate;
    use crate::record::{AttitudeSample, Join, Measured, RateSample, Status};

    fn sample(i: i64) -> RateSample {
        let t = i as f64 * 0.01;
        let roll = 0.4 * (1.3 * t).sin();
        let stamp = Nanos(1_700_000_000_000_000_000 + i * 10_000_000);
        RateSample {
            stamp,
            start: stamp,
            gyro: Measured::Rate(BodyRate(Vector3::new(
                0.52 * (1.3 * t).cos() + 0.01,
                0.3 * (0.7 * t).sin(),
                -0.005,
            ))),
            accel: Some(In::assume(Vector3::new(
                0.2 * (9.0 * t).sin(),
                9.81 * roll.sin(),
                9.81 * roll.cos(),
            ))),
            join: if i == 0 {
                Join::Start
            } else {
                Join::Continuous
            },
            status: Status::OK,
            log: stamp,
        }
    }

    fn aided(method: Method) -> Aided {
        aided_with(method, 0.0)
    }

    fn aided_with(method: Method, hard_iron: f64) -> Aided {
        let propagation = propagate::Settings {
            method,
            ..propagate::Settings::default()
        };
        let settings = Settings {
            has_field: true,
            hard_iron,
            ..Settings::default()
        };
        Aided::new(propagation, settings, Start::Level).unwrap()
    }

    fn fed(aided: &mut Aided, samples: std::ops::Range<i64>) -> Vec<AttitudeSample> {
        let mut out = Vec::new();
        for i in samples {
            if i % 7 == 0 {
                let turn = f64::from(i as i32) * 1e-3;
                let field = Vector3::new(20.0 * turn.sin(), 20.0 * turn.cos(), -40.0);
                aided.take_field(Nanos(sample(i).stamp.0 + 3_000_000), In::assume(field));
            }
            aided.push(&[sample(i)], &mut out);
        }
        out
    }

    #[test]
    fn what_is_remembered_goes_on_to_the_bit_whenever_it_was_written() {
        let live = Method::Live {
            order: Order::Exact,
            finals: false,
        };
        for (method, iron) in [(live, 0.0), (Method::Auto, 0.0), (live, 0.05)] {
            let aided = |method| aided_with(method, iron);
            for cut in [1, 5, 333, 1507] {
                let mut whole = aided(method);
                let _ = fed(&mut whole, 0..cut);
                let (propagation, memory) = whole.memory().unwrap();
                let mut other = aided(method);
                let text = plain(&memory);
                assert!(other.recall((&propagation, &text)), "{cut}");
                assert_eq!(
                    fed(&mut other, cut..2000),
                    fed(&mut whole, cut..2000),
                    "{method:?} {cut}"
                );
                assert_eq!(other.filter().report(), whole.filter().report());
            }
        }
    }

    /// Through text and back, where the feature is on.
    #[cfg(feature = "serde")]
    fn plain(memory: &Memory) -> Memory {
        let text = serde_json::to_string(memory).unwrap();
        // Each sample that waits has what it was corrected by.
        let iron = if memory.covariance.has_iron() {
            1800
        } else {
            0
        };
        // The last four hundred are those of the vertical, fourteen numbers.
        let most = 8192 + 400 + iron + 700 * memory.given.len().saturating_sub(1);
        assert!(text.len() < most, "{} {}", text.len(), memory.given.len());
        serde_json::from_str(&text).unwrap()
    }

    #[cfg(not(feature = "serde"))]
    fn plain(memory: &Memory) -> Memory {
        memory.clone()
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_memory_from_before_the_vertical_was_remembered_goes_on_with_nothing_seen() {
        let mut whole = aided(Method::Auto);
        let _ = fed(&mut whole, 0..500);
        let (propagation, memory) = whole.memory().unwrap();
        let mut text = serde_json::to_value(&memory).unwrap();
        assert!(text.as_object_mut().unwrap().remove("vertical").is_some());
        let rest = text["rest"].as_object_mut().unwrap();
        assert!(rest.remove("is_certain").is_some());
        let older: Memory = serde_json::from_value(text).unwrap();
        assert_eq!(older.vertical, Vertical::default());
        let mut other = aided(Method::Auto);
        assert!(other.recall((&propagation, &older)));
        assert_eq!(fed(&mut other, 500..600).len(), 100);
    }

    #[test]
    fn what_no_filter_can_have_known_is_refused_and_changes_nothing() {
        let mut whole = aided(Method::Auto);
        let _ = fed(&mut whole, 0..500);
        let (propagation, good) = whole.memory().unwrap();
        let spoil: [fn(&mut Memory); 9] = [
            |m| m.correction[0] = 2.0,
            |m| m.calibration.bias.x = 1e3,
            |m| m.covariance = Covariance::try_from(vec![-1.0; 231]).unwrap(),
            // With hard iron, where none is looked for.
            |m| m.covariance = Covariance::try_from(vec![1e-9; 300]).unwrap(),
            |m| m.calibration.hard_iron.y = f64::NAN,
            |m| m.velocity[1] = f64::NAN,
            |m| m.nominal = -1.0,
            |m| m.vertical.take(&Vector3::z(), -50.0, 0.05),
            |m| m.forces = Some(Beside::default()),
        ];
        for (n, spoil) in spoil.into_iter().enumerate() {
            let mut bad = good.clone();
            spoil(&mut bad);
            let mut other = aided(Method::Auto);
            assert!(!other.recall((&propagation, &bad)), "{n}");
            assert_eq!(
                fed(&mut other, 0..50),
                fed(&mut aided(Method::Auto), 0..50),
                "{n}"
            );
        }
    }
}
