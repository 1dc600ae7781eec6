//! All an aided propagator needs to go on exactly, beside what the propagator knows <-> plain numbers. Pure.
//!
//! Apart from the filter because it is read by another process: nothing in it is believed unseen.

use super::aided::{AidedPropagator, StreamState};
use super::beside::VectorPairing;
use super::calibration::CorrectionMatrices;
use super::state::State;
use crate::plausible::{are_numbers, is_amount, is_unit};
use crate::propagate;

/// Most samples that wait for their attitude: no window looks further ahead.
const MOST_GIVEN: usize = 64;
/// Largest errors of a sensor: rad/s, of 1, m/s^2, s.
const BIAS: f64 = 10.0;
const SCALE: f64 = 0.5;
const FORCE_BIAS: f64 = 100.0;
const LEAD: f64 = 1.0;

/// State of an [`AidedPropagator`] at one moment; [`AidedPropagator::recall`] restores it. Of a method without latency
/// some 9 kB of text, 4 more with samples that wait or at rest.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Memory {
    #[cfg_attr(feature = "serde", serde(flatten))]
    filter: State,
    #[cfg_attr(feature = "serde", serde(flatten))]
    stream: StreamState,
}

impl AidedPropagator {
    /// States of it and of its propagator; `None` before the first sample of a run.
    #[must_use]
    pub fn memory(&self) -> Option<(propagate::Memory, Memory)> {
        let propagation = self.propagator.memory()?;
        let memory = Memory {
            filter: self.filter.state.clone(),
            stream: self.stream.clone(),
        };
        Some((propagation, memory))
    }

    /// Goes on as the one would have that knew this. `false`, and it is as before, where no filter can have
    /// known it.
    #[must_use]
    pub fn recall(&mut self, (propagation, memory): (&propagate::Memory, &Memory)) -> bool {
        let has_forces = self.stream.forces.is_some() == memory.has_forces_beside()
            && self.filter.state.covariance.has_iron() == memory.filter.covariance.has_iron();
        if !memory.is_plausible() || !has_forces || !self.propagator.recall(propagation) {
            return false;
        }
        self.filter.state = memory.filter.clone();
        self.filter.derived.known = CorrectionMatrices::of(&memory.filter.calibration);
        self.filter.weigh_classes();
        self.stream = memory.stream.clone();
        self.is_resumed = false;
        true
    }
}

impl Memory {
    /// Whether specific forces came in messages of their own.
    #[must_use]
    pub fn has_forces_beside(&self) -> bool {
        self.stream.forces.is_some()
    }

    /// Whether a filter can have known it, whatever its settings.
    pub(crate) fn is_plausible(&self) -> bool {
        let Memory { filter, stream } = self;
        let calibration = &filter.calibration;
        let scalars = [
            filter.disturbance,
            filter.since_force,
            filter.class_log,
            filter.usual_length,
        ];
        let vectors = [&filter.mean_acceleration, &filter.last_rate];
        let unseen = [&filter.last_force, &filter.last_up];
        let mut beside = stream.forces.iter().chain([&stream.fields]);
        calibration.bias.amax() <= BIAS
            && calibration.scale.amax().max(calibration.cross.amax()) <= SCALE
            && calibration.force_bias.amax() <= FORCE_BIAS
            && calibration.lead.abs() <= LEAD
            && are_numbers(&calibration.hard_iron)
            && filter.covariance.is_plausible()
            && is_unit(&filter.correction.wxyz())
            && stream.last_out.iter().all(is_unit)
            && are_numbers(
                scalars
                    .iter()
                    .chain(&filter.velocity)
                    .chain(&filter.position),
            )
            && vectors.into_iter().all(are_numbers)
            && unseen.into_iter().flatten().all(are_numbers)
            && is_amount(filter.nominal)
            && filter.interval.is_plausible()
            && filter.residuals.is_plausible()
            && filter.surroundings.is_plausible()
            && filter.plausibility.is_plausible()
            && filter.clipped.is_plausible()
            && stream.given.len() <= MOST_GIVEN
            && filter.rest.is_bounded()
            && filter.vertical.is_plausible()
            && stream.world.is_plausible()
            && filter.drift.is_plausible()
            && stream.headings.is_bounded()
            && beside.all(VectorPairing::is_bounded)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::aid::covariance::Covariance;
    use crate::aid::{Settings, Start};
    #[cfg(feature = "serde")]
    use crate::aid::{drift::Drift, vertical::Vertical};
    use crate::frames::In;
    use crate::propagate::{Method, Order};
    use crate::quaternion::{BodyRate, Quaternion};
    use crate::record::{AttitudeSample, Join, Measured, Nanos, RateSample, Status};
    use nalgebra::Vector3;

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

    fn aided(method: Method) -> AidedPropagator {
        aided_with(method, 0.0)
    }

    fn aided_with(method: Method, hard_iron: f64) -> AidedPropagator {
        let propagation = propagate::Settings {
            method,
            ..propagate::Settings::default()
        };
        let settings = Settings {
            has_field: true,
            hard_iron,
            ..Settings::default()
        };
        AidedPropagator::new(propagation, settings, Start::Level).unwrap()
    }

    fn fed(aided: &mut AidedPropagator, samples: std::ops::Range<i64>) -> Vec<AttitudeSample> {
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
        // Values are counted, not letters: how many digits one has is chance. What iron there is, and each sample that
        // waits with what it was corrected by, come on top.
        let iron = if memory.filter.covariance.has_iron() {
            80
        } else {
            0
        };
        let (values, waiting) = (text.split(',').count(), memory.stream.given.len());
        assert!(values < 412 + iron + 26 * waiting, "{values} {waiting}");
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
        for later in ["vertical", "drift", "class_log"] {
            assert!(text.as_object_mut().unwrap().remove(later).is_some());
        }
        let rest = text["rest"].as_object_mut().unwrap();
        assert!(rest.remove("is_certain").is_some());
        let older: Memory = serde_json::from_value(text).unwrap();
        assert_eq!(older.filter.vertical, Vertical::default());
        assert_eq!(older.filter.drift, Drift::default());
        assert_eq!(older.filter.class_log, 0.0);
        let mut other = aided(Method::Auto);
        assert!(other.recall((&propagation, &older)));
        assert_eq!(fed(&mut other, 500..600).len(), 100);
    }

    /// A key that is renamed is one that an older file does not have; a new one is added here, and is read with
    /// `serde(default)`.
    #[cfg(feature = "serde")]
    #[test]
    fn the_keys_of_a_state_file_stay_and_others_are_refused() {
        let mut whole = aided(Method::Auto);
        let _ = fed(&mut whole, 0..50);
        let (propagation, memory) = whole.memory().unwrap();
        let of_filter = "calibration class_log clipped correction covariance disturbance drift fields forces gaps_in_a_row given interval \
                         is_started is_widened last last_force last_out last_rate last_up mean_acceleration nominal \
                         plausibility position report residuals rest since_force surroundings usual_length velocity vertical \
                         wants_level world";
        let of_propagator = "added attitude before covariance excess initial last next now open rates resets samples \
                             sum waiting world_since";
        let texts = [
            (serde_json::to_value(&memory).unwrap(), of_filter),
            (serde_json::to_value(&propagation).unwrap(), of_propagator),
        ];
        for (mut text, all) in texts {
            let keys: Vec<&String> = text.as_object().unwrap().keys().collect();
            assert_eq!(keys, all.split_whitespace().collect::<Vec<_>>());
            text["of_a_later_release"] = 1.into();
            let whys = [
                serde_json::from_value::<Memory>(text.clone()).unwrap_err(),
                serde_json::from_value::<propagate::Memory>(text).unwrap_err(),
            ];
            let unknown = |why: &serde_json::Error| {
                why.to_string()
                    .contains("unknown field `of_a_later_release`")
            };
            assert!(whys.iter().any(unknown), "{whys:?}");
        }
    }

    #[test]
    fn what_no_filter_can_have_known_is_refused_and_changes_nothing() {
        let mut whole = aided(Method::Auto);
        let _ = fed(&mut whole, 0..500);
        let (propagation, good) = whole.memory().unwrap();
        let spoil: [fn(&mut Memory); 10] = [
            |m| m.filter.correction = Quaternion::assume_unit([2.0, 0.0, 0.0, 0.0]),
            |m| m.filter.calibration.bias.x = 1e3,
            |m| m.filter.covariance = Covariance::try_from(vec![-1.0; 231]).unwrap(),
            // With hard iron, where none is looked for.
            |m| m.filter.covariance = Covariance::try_from(vec![1e-9; 300]).unwrap(),
            |m| m.filter.calibration.hard_iron.y = f64::NAN,
            |m| m.filter.velocity[1] = f64::NAN,
            |m| m.filter.nominal = -1.0,
            |m| m.filter.class_log = f64::NAN,
            |m| m.filter.vertical.take(&Vector3::z(), -50.0, 0.05),
            |m| m.stream.forces = Some(VectorPairing::default()),
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
