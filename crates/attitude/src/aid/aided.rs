//! Propagator and filter together: corrected rates in, corrected attitudes out. Pure.

mod headings;
mod innovations;

use super::beside::VectorPairing;
use super::calibration::CorrectionMatrices;
use super::filter::{Filter, Innovation, Measured};
use super::other_class::OtherClass;
use super::outside_heading::OutsideHeadings;
use super::settings::Settings;
use super::world::World;
use crate::frames::{Body, In, Nav};
use crate::propagate::{self, Method, Propagator, Sequential, SettingsError};
use crate::quaternion::{BodyRate, Quaternion};
use crate::record::{AttitudeSample, Join, Nanos, RateSample, SampleKind, Status};
use nalgebra::Matrix3;
use std::collections::VecDeque;

/// Least sigma of the tilt of an attitude that was saved, rad.
const TILT_RESUMED: f64 = 0.02;

/// Knowledge of the attitude at the first sample.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Start {
    /// Nothing: it is levelled by the first specific force.
    Level,
    /// The mean specific force at the first sample (m/s^2), by which it is levelled: a single one may be of
    /// a body that shakes. After a reset it is levelled by the first that comes.
    LevelBy(In<Body>),
    /// Attitude of the propagator's settings.
    Known {
        /// Standard deviation of its tilt, rad.
        tilt: f64,
        /// Sigma of its heading.
        heading: f64,
    },
}

/// A propagator whose attitude does not drift: level, and with gyro errors that are learned on the way.
///
/// The bits that come out do not depend on how the stream is cut into pushes.
///
/// # Example
/// ```
/// use strapd_attitude::aid::{self, AidedPropagator, Start};
/// use strapd_attitude::frames::In;
/// use strapd_attitude::propagate;
/// use strapd_attitude::quaternion::BodyRate;
/// use strapd_attitude::record::{Join, Measured, Nanos, RateSample, Status};
///
/// let mut aided = AidedPropagator::new(propagate::Settings::default(), aid::Settings::default(), Start::Level)?;
/// // At rest for ten seconds, tilted by 0.1 rad; a gyro with a bias of 0.6 deg/s.
/// let samples: Vec<RateSample> = (0..=1000)
///     .map(|i| RateSample {
///         stamp: Nanos(i * 10_000_000),
///         start: Nanos(i * 10_000_000),
///         gyro: Measured::Rate(BodyRate([0.01, 0.0, 0.0].into())),
///         accel: Some(In::assume([0.0, 9.81 * 0.1_f64.sin(), 9.81 * 0.1_f64.cos()].into())),
///         join: if i == 0 { Join::Start } else { Join::Continuous },
///         status: Status::OK,
///         log: Nanos(i * 10_000_000),
///     })
///     .collect();
/// let mut attitudes = Vec::new();
/// aided.push(&samples, &mut attitudes);
/// aided.finish(&mut attitudes);
/// let roll = attitudes[1000].q_nb.yaw_pitch_roll().roll;
/// assert!((roll - 0.1).abs() < 1e-3);
/// assert!((aided.filter().calibration().bias.x - 0.01).abs() < 1e-4);
/// # Ok::<(), strapd_attitude::propagate::SettingsError>(())
/// ```
#[derive(Clone, Debug)]
pub struct AidedPropagator {
    pub(super) propagator: Propagator,
    pub(super) filter: Filter,
    start: Start,
    /// Knowledge of the attitude at the beginning, and of where the next reset leads.
    begins: Start,
    anew: Option<Start>,
    /// The next sample has this heading, rad: what was asked of it.
    heading: Option<f64>,
    /// The attitude is not that of this stream's beginning, but one that was saved.
    pub(super) is_resumed: bool,
    pub(super) stream: StreamState,
    /// Samples that go into the propagator at once, and what comes out of it.
    corrected: Vec<RateSample>,
    scratch: Vec<AttitudeSample>,
    /// Innovations, if somebody looks at them.
    innovations: Option<Vec<(Nanos, Innovation)>>,
    /// Whether attitudes carry the acceleration without gravity.
    gives_acceleration: bool,
}

/// State of an [`AidedPropagator`] beside those of its propagator and its filter: what is on its way between them.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct StreamState {
    /// Samples given to the propagator, whose attitudes have not come out yet.
    pub(super) given: VecDeque<Given>,
    pub(super) last: Option<Nanos>,
    /// The last attitude, w, x, y, z.
    pub(super) last_out: Option<[f64; 4]>,
    /// Specific forces that do not come with the gyro samples.
    pub(super) forces: Option<VectorPairing>,
    pub(super) fields: VectorPairing,
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) world: World,
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "OutsideHeadings::is_unused")
    )]
    pub(super) headings: OutsideHeadings,
}

/// A sample and what it was corrected by.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Given {
    stamp: Nanos,
    measured: Measured,
    applied: CorrectionMatrices,
    join: Join,
    /// Heading that was asked of it, rad.
    #[cfg_attr(feature = "serde", serde(default))]
    heading: Option<f64>,
}

impl AidedPropagator {
    /// Ready for the first sample.
    ///
    /// # Errors
    /// As [`Propagator::new`].
    pub fn new(
        propagation: propagate::Settings,
        settings: Settings,
        start: Start,
    ) -> Result<AidedPropagator, SettingsError> {
        let is_instant = propagation.kind == SampleKind::Rate;
        let _ = propagation.checked()?;
        // The filter says how well the attitude is known.
        let propagator = Propagator::new(propagate::Settings {
            noise: propagate::Noise::default(),
            ..propagation
        })?;
        Ok(AidedPropagator {
            filter: Filter::new(settings, is_instant, propagation.world_rate),
            propagator,
            start,
            begins: start,
            anew: None,
            heading: None,
            is_resumed: false,
            stream: StreamState {
                given: VecDeque::new(),
                last: None,
                last_out: None,
                forces: None,
                fields: VectorPairing::with_repeats(),
                world: World::default(),
                headings: OutsideHeadings::default(),
            },
            corrected: Vec::new(),
            scratch: Vec::new(),
            innovations: None,
            gives_acceleration: false,
        })
    }

    /// The same where specific forces come by [`AidedPropagator::take_force`], and not with the gyro samples.
    #[must_use]
    pub fn with_forces_beside(mut self) -> AidedPropagator {
        self.expect_forces_beside();
        self
    }

    /// The same where the sensor may be of another class than the settings have it.
    #[must_use]
    pub(crate) fn or_of(mut self, other: Option<OtherClass>) -> AidedPropagator {
        if let Some(other) = other {
            self.filter.may_be_of(other);
        }
        self
    }

    /// The same where attitudes carry the acceleration without gravity, of samples that a specific force goes with, or
    /// do not.
    #[must_use]
    pub fn with_linear_acceleration(mut self, is_given: bool) -> AidedPropagator {
        self.gives_acceleration = is_given;
        self
    }

    /// Whether they do.
    pub(crate) fn gives_acceleration(&self) -> bool {
        self.gives_acceleration
    }

    /// Whether specific forces come by [`AidedPropagator::take_force`].
    pub(crate) fn has_forces_beside(&self) -> bool {
        self.stream.forces.is_some()
    }

    /// Expects forces on a topic of their own from now on, as after [`AidedPropagator::with_forces_beside`].
    pub fn expect_forces_beside(&mut self) {
        self.stream.forces.get_or_insert_default();
    }

    /// Takes a specific force (m/s^2) measured at `stamp`: it is used at the first gyro sample at or
    /// after that, turned on by the rate. One that is half a second from any is counted and not used.
    pub fn take_force(&mut self, stamp: Nanos, force: In<Body>) {
        if let Some(forces) = &mut self.stream.forces {
            forces.take(stamp, *force.as_vector());
        }
    }

    /// The same for a magnetic field, any linear unit.
    pub fn take_field(&mut self, stamp: Nanos, field: In<Body>) {
        self.stream.fields.take(stamp, *field.as_vector());
    }

    /// The filter, for what it has learned.
    #[must_use]
    pub fn filter(&self) -> &Filter {
        &self.filter
    }

    /// See [`Propagator::report`].
    #[must_use]
    pub fn propagation(&self) -> propagate::Report {
        self.propagator.report()
    }

    /// See [`Propagator::method`].
    #[must_use]
    pub fn method(&self) -> Method {
        self.propagator.method()
    }

    /// See [`Propagator::resume`].
    ///
    /// # Errors
    /// As there.
    pub fn resume(&mut self, last: &AttitudeSample) -> Result<(), SettingsError> {
        self.propagator.resume(last)?;
        self.stream.world = World::default();
        self.is_resumed = true;
        Ok(())
    }

    /// See [`Propagator::continue_counts_of`].
    pub fn continue_counts_of(&mut self, resets: u32) {
        self.stream.world = World::default();
        self.propagator.continue_counts_of(resets);
    }

    /// The next sample that says [`Join::Reset`] begins with this attitude, of which `start` is known; what was
    /// learned of the sensor stays known as well as it is.
    pub fn begin_anew(&mut self, attitude: &Quaternion<Nav, Body>, start: Start) {
        self.propagator.begin_anew(attitude);
        self.anew = Some(start);
        self.heading = None;
    }

    /// Takes samples in and appends the attitudes that are ready.
    pub fn push(&mut self, samples: &[RateSample], out: &mut Vec<AttitudeSample>) {
        let mut left = samples;
        while !left.is_empty() {
            let (now, later) = left.split_at(self.alike(left));
            let mut corrected = std::mem::take(&mut self.corrected);
            corrected.extend(now.iter().map(|sample| self.give(sample)));
            self.propagator
                .push(&corrected, &Sequential, &mut self.scratch);
            corrected.clear();
            self.corrected = corrected;
            self.correct(out);
            left = later;
        }
    }

    /// Number of these samples, one at least, that are corrected by what is known now: those that come before the
    /// attitude at which the filter will know more is out. Several at once cost the propagator less than one by one.
    fn alike(&self, samples: &[RateSample]) -> usize {
        let latency = self.propagator.latency();
        // The first of a run comes out at once.
        if !self.filter.is_started() || (latency > 0 && self.stream.given.is_empty()) {
            return 1;
        }
        let mut last = self.stream.last;
        let new = samples.iter().map(|sample| {
            let before = last.replace(sample.stamp).unwrap_or(sample.stamp);
            sample.stamp.secs_since(before)
        });
        let given = self.stream.given.iter().map(|given| given.measured.secs);
        let mut due = self.filter.due();
        // The attitude of each comes out no earlier than when so many samples more have been given.
        let waits = self.stream.given.len();
        let known = given
            .chain(new)
            .position(|secs| due.comes(secs))
            .map_or(usize::MAX, |at| (at + 1 + latency).saturating_sub(waits));
        let breaks = |sample: &RateSample| !matches!(sample.join, Join::Continuous | Join::Bridge);
        let most = known.clamp(1, samples.len());
        let run = samples.iter().take(most).position(breaks);
        run.unwrap_or(most).max(1)
    }

    /// The stream has ended: appends the attitudes still waiting.
    pub fn finish(&mut self, out: &mut Vec<AttitudeSample>) {
        self.propagator.finish(&Sequential, &mut self.scratch);
        self.correct(out);
        self.stream.fields.finish();
        self.stream.headings.finish();
        if let Some(forces) = &mut self.stream.forces {
            forces.finish();
        }
        self.filter
            .count_beside(self.stream.forces.as_ref(), &self.stream.fields);
    }

    /// The sample as the propagator is to have it.
    fn give(&mut self, sample: &RateSample) -> RateSample {
        let applied = self.filter.applied();
        let secs = self
            .stream
            .last
            .map_or(0.0, |last| sample.stamp.secs_since(last));
        self.stream.last = Some(sample.stamp);
        let BodyRate(rate) = sample.mean_rate();
        let turning = applied.corrected(rate, 1.0);
        let force = match &mut self.stream.forces {
            None => sample.accel.map(|force| *force.as_vector()),
            Some(forces) => forces.at(sample.stamp, &turning),
        };
        let field = self.stream.fields.at(sample.stamp, &turning);
        self.filter
            .count_beside(self.stream.forces.as_ref(), &self.stream.fields);
        self.stream.given.push_back(Given {
            stamp: sample.stamp,
            measured: Measured {
                secs,
                rate,
                force,
                field,
                is_saturated: sample.status.has(Status::SATURATED),
            },
            applied,
            join: sample.join,
            heading: self.heading.take(),
        });
        RateSample {
            gyro: sample
                .gyro
                .with(applied.corrected(*sample.gyro.as_vector(), sample.own_secs())),
            // The propagator carries it to the attitude, whatever topic it came by.
            accel: match self.gives_acceleration {
                true => force.map(In::assume),
                false => sample.accel,
            },
            ..*sample
        }
    }

    /// Corrects what came out of the propagator. Each sample comes out once, in order; some of them, when
    /// asked for, a second time for good.
    fn correct(&mut self, out: &mut Vec<AttitudeSample>) {
        let mut scratch = std::mem::take(&mut self.scratch);
        for sample in &scratch {
            // Of one that was recalled: what its propagator does not know belongs to nothing.
            while self
                .stream
                .given
                .front()
                .is_some_and(|g| g.stamp < sample.stamp)
            {
                self.stream.given.pop_front();
            }
            let is_first = self
                .stream
                .given
                .front()
                .is_some_and(|given| given.stamp == sample.stamp);
            let (mut q_nb, mut r) = self.filter.corrected(&sample.q_nb);
            let mut status = sample.status;
            if is_first && let Some(given) = self.stream.given.pop_front() {
                if self.take(&given, sample, &r) {
                    (q_nb, r) = self.filter.corrected(&sample.q_nb);
                }
                if let Some(heading) = given.heading {
                    self.set_heading(sample.stamp, &q_nb, heading);
                    status = status.with(Status::RESET);
                }
                if !self.stream.headings.is_unused() && self.use_outside_headings(sample, &q_nb, &r)
                {
                    status = status.with(Status::RESET);
                }
            }
            let force = sample.accel.filter(|_| self.gives_acceleration);
            let mut told = self.stream.world.told(AttitudeSample {
                q_nb,
                linear_acceleration: force.and_then(|force| {
                    let force = force.as_vector();
                    self.filter.linear_acceleration(force, &sample.rate.0, &r)
                }),
                status: status.with(self.filter.status()),
                covariance: self.filter.attitude_covariance(&r, &sample.rate.0),
                ..*sample
            });
            if let Some(last) = self.stream.last_out {
                told.q_nb = told.q_nb.same_sign_as(&Quaternion::assume_unit(last));
            }
            self.stream.last_out = Some(told.q_nb.wxyz());
            out.push(told);
        }
        scratch.clear();
        self.scratch = scratch;
    }

    /// Takes what was measured at an attitude, which with the correction so far has the matrix `r`. Whether that is
    /// another now.
    fn take(&mut self, given: &Given, propagated: &AttitudeSample, r: &Matrix3<f64>) -> bool {
        let (measured, attitude) = (&given.measured, &propagated.q_nb);
        if given.join == Join::Reset {
            self.stream.world.begin_anew();
            self.stream.headings.begin_anew();
            match self.anew.take() {
                // Asked for: nothing has happened to the sensor.
                Some(start) => {
                    self.filter.begin_anew();
                    self.begins = start;
                    self.is_resumed = false;
                }
                None => {
                    self.filter.reset();
                    self.begins = match self.start {
                        Start::LevelBy(_) => Start::Level,
                        start => start,
                    };
                }
            }
        }
        if !self.filter.is_started() {
            match self.start_at(propagated) {
                Start::Level => self.filter.begin(measured, attitude),
                Start::LevelBy(force) => {
                    let force = Some(*force.as_vector());
                    self.filter
                        .begin(&Measured { force, ..*measured }, attitude);
                }
                Start::Known { tilt, heading } => {
                    self.filter.begin_known(measured, tilt, heading);
                }
            }
            return true;
        }
        if matches!(given.join, Join::Hold | Join::Start) {
            self.filter.hold(measured);
            return false;
        }
        let has_corrected = measured.secs > 0.0 && self.filter.take(measured, &given.applied, r);
        if let Some(innovations) = &mut self.innovations
            && has_corrected
        {
            innovations.push((given.stamp, self.filter.derived.innovation));
        }
        has_corrected
    }

    /// Knowledge at a first sample: of an attitude that was saved, what the propagator says of it by now.
    fn start_at(&mut self, propagated: &AttitudeSample) -> Start {
        if !std::mem::take(&mut self.is_resumed) {
            return self.begins;
        }
        let earth = propagated.covariance.in_navigation_axes(&propagated.q_nb);
        Start::Known {
            tilt: earth[(0, 0)].max(earth[(1, 1)]).sqrt().max(TILT_RESUMED),
            heading: earth[(2, 2)].sqrt(),
        }
    }
}
