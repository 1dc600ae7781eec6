//! One topic's samples under each meaning -> error against the recorded orientation. Pure.
//!
//! What a sample means in time matters more than the order of the integrator and is written in no
//! log; where an orientation was recorded too, it can be seen.

mod thinned;

use self::thinned::{MOST, Thinned};
use super::attitude_track::{Track, cut};
use crate::summary::series::{ErrorTrace, Errors};
use crate::summary::trace::Traces;
use crate::summary::{Against, Recorded};
use std::collections::HashMap;
use strapd_attitude::compare::{
    Align, Consistency, Reference, Stamped, UncertainAttitude, compare, consistency, fit_body_axes,
    fit_constant_bias, fit_time_shift, for_each_error, turn_ratio,
};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::Estimator;
use strapd_attitude::estimate::{
    EstimationSettings, Initial, KindChoice, KindReason, Meaning, Prepared,
};
use strapd_attitude::frames::AxisMap;
use strapd_attitude::propagate::{Executor, Method};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample, SampleKind, Status};
use strapd_attitude::worlds::{Convention, World};

/// Comparisons at once for which there is that much room; more share it.
const ROOMY: usize = 8;

/// Attitudes kept while the samples have brought no orientation yet.
const BEFORE: usize = 1024;

/// The meanings tried: name, words, kind, and the method where it is not the run's own.
const MEANINGS: [(&str, &str, SampleKind, Option<Method>); 4] = [
    ("rate", "the rate at its stamp", SampleKind::Rate, None),
    (
        "average",
        "the mean over the interval ending at its stamp",
        SampleKind::Average,
        None,
    ),
    (
        "held",
        "held over the interval after its stamp (method dcm-left)",
        SampleKind::Rate,
        Some(Method::DcmLeft),
    ),
    (
        "delta-angle",
        "the angle turned over the interval ending at its stamp",
        SampleKind::DeltaAngle,
        None,
    ),
];

/// A comparison under way.
#[derive(Debug)]
pub(super) struct AgainstRecorded {
    resolved: Meaning,
    /// Scale of the rates that was asked for.
    gyro_scale: [f64; 3],
    /// Map of the accelerometer's axes that was asked for.
    accel_axes: AxisMap,
    clock: strapd_attitude::condition::Clock,
    own_reference: bool,
    estimators: Vec<Estimator>,
    tracks: Vec<Thinned<Stamped>>,
    reference: Thinned<Stamped>,
    /// Count of its resets that its last message stated, and the instants of those that were seen.
    resets: Option<u8>,
    cuts: Vec<Nanos>,
    /// Attitudes that the run itself put out, in the world it was asked for, with their stated error.
    own: Thinned<UncertainAttitude>,
    world: World,
    /// Alignment of its world to the reference's, by what it claims of it.
    align: Align,
    /// The bias that was removed, rad/s.
    removed: [f64; 3],
    /// Times at which the samples of the recorded orientations were received, as they lie in `reference`; and where
    /// samples that were given another stamp went.
    received: Vec<Nanos>,
    moved: HashMap<Nanos, Nanos>,
    unusable: u64,
}

/// The kinds samples are taken for.
pub(super) fn kinds() -> impl Iterator<Item = SampleKind> {
    MEANINGS.iter().map(|(_, _, kind, _)| *kind)
}

/// A kind that is tried, where samples are `stated` to be of another: whole turns are angles of their own kind.
fn among_tried(kind: SampleKind, stated: SampleKind) -> SampleKind {
    match (kind, stated) {
        (SampleKind::DeltaAngle, SampleKind::Rotation) => stated,
        _ => kind,
    }
}

impl AgainstRecorded {
    /// Makes it for samples understood as `resolved`, but for their meaning.
    ///
    /// # Errors
    /// In words: settings that cannot be.
    pub(super) fn new(
        plan: &EstimationSettings,
        resolved: &Meaning,
        prepared: &Prepared,
    ) -> Result<Self, Diagnostic> {
        let mut prepared = prepared.clone();
        let world = prepared.world;
        let align = match &prepared.aiding {
            // Its north may be another's by a constant.
            Some(aiding) if aiding.settings.has_field => Align::Heading,
            Some(_) => Align::FirstHeading,
            None if plan.initial == Initial::Gravity => Align::FirstHeading,
            None => Align::First,
        };
        // The recorded attitude is brought to the convention everything is computed in.
        prepared.world = World::Start;
        // What a sample means shows over a second; what corrects the attitude would hide it.
        prepared.aiding = None;
        let estimators = MEANINGS
            .iter()
            .map(|(_, _, kind, method)| {
                let plan = EstimationSettings {
                    method: method.unwrap_or(plan.method),
                    ..plan.clone()
                };
                let resolved = resolved.with_kind(&KindChoice {
                    kind: among_tried(*kind, resolved.kind),
                    reason: KindReason::Setting,
                });
                Estimator::new(&plan, &resolved, &prepared)
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(AgainstRecorded {
            resolved: resolved.clone(),
            gyro_scale: plan.gyro_scale,
            accel_axes: plan.accel_axes,
            clock: prepared.clock,
            own_reference: true,
            tracks: estimators.iter().map(|_| Thinned::new()).collect(),
            estimators,
            reference: Thinned::new(),
            resets: None,
            cuts: Vec::new(),
            own: Thinned::new(),
            world,
            align,
            removed: prepared.bias.into(),
            received: Vec::new(),
            moved: HashMap::new(),
            unusable: 0,
        })
    }

    /// Bounds its room as one of so many comparisons at once: together they hold no more than a few would.
    pub(super) fn share_room(&mut self, comparisons: usize) {
        let most = MOST.min(ROOMY * MOST / comparisons.max(1));
        let tracks = self.tracks.iter_mut();
        tracks
            .chain([&mut self.reference])
            .for_each(|track| track.most = most);
        self.own.most = most;
    }

    /// Takes what the run put out.
    pub(super) fn take_estimates(&mut self, samples: &[AttitudeSample]) {
        let from = self.world.convention().unwrap_or(Convention::EnuFlu);
        for sample in samples {
            let turned = |v| from.convert_body(Convention::EnuFlu, v);
            self.own.push(UncertainAttitude {
                stamp: sample.stamp,
                q_nb: from.convert(Convention::EnuFlu, sample.q_nb),
                covariance: match from {
                    Convention::EnuFlu => sample.covariance,
                    _ => sample.covariance.relabelled(turned),
                },
            });
        }
        // As with the other tracks: nothing to compare with has come yet, and none may come.
        if self.own_reference && self.reference.entries.is_empty() {
            let useless = self.own.entries.len().saturating_sub(BEFORE);
            self.own.entries.drain(..useless);
        }
    }

    /// Whether the reference is not the samples' own.
    #[must_use]
    pub(super) fn is_held_against_another(&self) -> bool {
        !self.own_reference
    }

    /// The reference comes from a topic of its own, whose orientations are in `recorded`'s convention.
    pub(super) fn take_reference_from(&mut self, recorded: &Meaning) {
        self.own_reference = false;
        self.resolved.recorded = recorded.recorded;
    }

    /// The reference is this track, of the body whose attitude is estimated, and not in the log.
    pub(super) fn take_reference_track(&mut self, track: &Track) {
        self.own_reference = false;
        self.cuts.clone_from(&track.cuts);
        for (stamp, wxyz) in &track.entries {
            match Quaternion::try_from_wxyz(*wxyz) {
                Ok(attitude) => self.reference.push((*stamp, attitude)),
                Err(_) => self.unusable += 1,
            }
        }
    }

    /// Takes a sample, and the orientation in it unless the reference has a topic of its own.
    pub(super) fn take(&mut self, raw: &RawSample) {
        for estimator in &mut self.estimators {
            estimator.take(raw);
        }
        if self.own_reference {
            self.take_reference(raw);
        }
    }

    /// Takes a recorded orientation.
    pub(super) fn take_reference(&mut self, raw: &RawSample) {
        use strapd_attitude::condition::Clock;
        let stamp = match self.clock {
            Clock::Header => raw.header,
            Clock::Log | Clock::Index { .. } => Some(raw.log),
            Clock::Publish => Some(raw.publish),
        };
        let Some(recorded) = raw.orientation else {
            return;
        };
        if let Some(stamp) = stamp.filter(|_| self.cuts.len() < MOST) {
            self.cuts.extend(cut(&mut self.resets, raw, stamp));
        }
        match (stamp, self.resolved.recorded_attitude(recorded)) {
            (Some(stamp), Some(attitude)) if self.own_reference && self.received.len() < MOST => {
                self.reference.push((stamp, attitude));
                self.received.push(raw.log);
            }
            // So many that they are thinned out: stamps as they were recorded.
            (Some(stamp), Some(attitude)) => self.reference.push((stamp, attitude)),
            _ => self.unusable += 1,
        }
    }

    /// An orientation in a sample that was given another stamp belongs there, too.
    fn move_references(&mut self) {
        if self.moved.is_empty() || self.reference.stride > 1 {
            return;
        }
        for (entry, received) in self.reference.entries.iter_mut().zip(&self.received) {
            if let Some(stamp) = self.moved.get(received) {
                entry.0 = *stamp;
            }
        }
        self.reference.entries.sort_by_key(|(stamp, _)| *stamp);
        self.moved.clear();
    }

    /// Propagates what was taken.
    pub(super) fn advance(&mut self, exec: &impl Executor) {
        for (estimator, track) in self.estimators.iter_mut().zip(&mut self.tracks) {
            for sample in estimator.attitudes(exec) {
                track.push((sample.stamp, sample.q_nb));
                if self.own_reference
                    && sample.status.has(Status::RESTAMPED)
                    && self.moved.len() < MOST
                {
                    self.moved.insert(sample.log, sample.stamp);
                }
            }
            // Estimates long before the first reference are compared with nothing, and the samples
            // may carry none at all.
            if self.own_reference && self.reference.entries.is_empty() {
                let useless = track.entries.len().saturating_sub(BEFORE);
                track.entries.drain(..useless);
            }
        }
    }

    /// Ends it: no more samples.
    pub(super) fn finish(&mut self, exec: &impl Executor) {
        for (estimator, track) in self.estimators.iter_mut().zip(&mut self.tracks) {
            for sample in estimator.finish(exec) {
                track.push((sample.stamp, sample.q_nb));
                if self.own_reference && sample.status.has(Status::RESTAMPED) {
                    self.moved.insert(sample.log, sample.stamp);
                }
            }
        }
        self.move_references();
    }

    /// The reference, cut at its resets.
    fn referred(&self) -> Reference<'_> {
        Reference {
            rows: &self.reference.entries,
            cuts: &self.cuts,
        }
    }

    /// Recorded orientations that could be used.
    #[must_use]
    pub(super) fn references(&self) -> usize {
        self.reference.entries.len()
    }

    /// Description of the recorded orientation itself; `None` when there is none at all.
    #[must_use]
    pub(super) fn recorded(&self) -> Option<Recorded> {
        let entries = &self.reference.entries;
        let first = entries.first().map(|(_, q)| *q);
        if entries.is_empty() && self.unusable == 0 {
            return None;
        }
        // The meaning that fits best says most about the axes; but rates taken for angles, or angles for
        // rates, turn at random or hardly at all, and say nothing.
        let is_angle =
            |kind: SampleKind| matches!(kind, SampleKind::DeltaAngle | SampleKind::Rotation);
        let best = MEANINGS
            .iter()
            .zip(&self.tracks)
            .filter(|((_, _, kind, _), _)| is_angle(*kind) == is_angle(self.resolved.kind))
            .filter_map(|(_, track)| fit_body_axes(&track.entries, entries))
            .min_by(|a, b| a.turned.total_cmp(&b.turned));
        let (used, referred) = (self.used(), self.referred());
        let used = used.map(|track| track.entries.as_slice());
        Some(Recorded {
            usable: entries.len(),
            unusable: self.unusable,
            constant: entries.len() > 1
                && first.is_some_and(|first| entries.iter().all(|(_, q)| *q == first)),
            gyro_unit: self.resolved.unit,
            gyro_scale: self.gyro_scale,
            accel_axes: self.accel_axes,
            turn_ratio: used.and_then(|rows| turn_ratio(rows, referred)),
            shift: used.and_then(|rows| fit_time_shift(rows, referred)),
            axes: best,
            consistency: consistency(&self.own.entries, self.referred(), self.align, |_| {}),
            bias: used.and_then(|rows| fit_constant_bias(rows, referred)),
            removed: self.removed,
            resets: self.cuts.len(),
        })
    }

    /// The track of the meaning the run took.
    fn used(&self) -> Option<&Thinned<Stamped>> {
        let mut all = MEANINGS.iter().zip(&self.tracks);
        let found =
            all.find(|((_, _, kind, method), _)| method.is_none() && *kind == self.resolved.kind);
        found.map(|(_, track)| track)
    }

    /// Error and three sigma over time: tilt, three sigma of it, heading (signed), three sigma of it, deg.
    fn bounds(
        &self,
        stretches: usize,
        x: impl Fn(Nanos) -> i64,
    ) -> Option<(Consistency, Traces<4>)> {
        let mut trace = Traces::new(stretches);
        let mut last = i64::MIN;
        let found = consistency(&self.own.entries, self.referred(), self.align, |at| {
            last = last.max(x(at.stamp));
            let [tilt, heading] = [at.tilt, at.heading];
            trace.push(
                last,
                [tilt[0], tilt[1], heading[0], heading[1]].map(f64::to_degrees),
            );
        })?;
        Some((found, trace))
    }

    /// The errors over time after [`Align::First`], for each meaning that finds a reference: `x` places
    /// a stamp on the axis, `used` is the meaning the run took.
    #[must_use]
    pub(super) fn errors(
        &self,
        stretches: usize,
        used: SampleKind,
        x: impl Fn(Nanos) -> i64,
    ) -> Errors {
        let of = |((kind, meaning, sample_kind, method), track): (
            &(&'static str, &'static str, SampleKind, Option<Method>),
            &Thinned<Stamped>,
        )| {
            let reference = self.referred();
            let comparison = compare(&track.entries, reference, Align::First);
            comparison.errors?;
            let mut trace = Traces::new(stretches);
            let mut last = i64::MIN;
            let mut resets = 0;
            for_each_error(&track.entries, reference, Align::First, |at| {
                last = last.max(x(at.stamp));
                // No line leads across a reset of the reference.
                let before = self.cuts.partition_point(|cut| *cut <= at.stamp);
                if std::mem::replace(&mut resets, before) != before {
                    trace.interrupt();
                }
                trace.push(
                    last,
                    [at.total, at.heading, at.inclination].map(f64::to_degrees),
                );
            });
            Some(ErrorTrace {
                kind,
                meaning,
                is_used: method.is_none() && among_tried(*sample_kind, used) == used,
                comparison,
                trace,
            })
        };
        Errors {
            stride: self.tracks.iter().map(|t| t.stride).max().unwrap_or(1),
            usable: self.references(),
            unusable: self.unusable,
            resets: self.cuts.iter().map(|cut| x(*cut)).collect(),
            bounds: self.bounds(stretches, &x),
            traces: MEANINGS.iter().zip(&self.tracks).filter_map(of).collect(),
        }
    }

    /// The errors; empty when no two recorded orientations are 1 s apart.
    #[must_use]
    pub(super) fn rows(&self) -> Vec<Against> {
        MEANINGS
            .iter()
            .zip(&self.tracks)
            .filter_map(|((kind, meaning, ..), track)| {
                let found = compare(&track.entries, self.referred(), Align::First);
                found.relative_1s.map(|r| Against {
                    kind,
                    meaning,
                    median_deg: r.median.to_degrees(),
                    p95_deg: r.p95.to_degrees(),
                    pairs: r.count,
                })
            })
            .collect()
    }
}
