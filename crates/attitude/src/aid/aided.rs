//! Propagator and filter together: corrected rates in, corrected attitudes out. Pure.

use super::calibration::Applied;
use super::filter::{Filter, Measured};
use super::settings::Settings;
use crate::propagate::{self, Method, Propagator, Sequential, SettingsError};
use crate::record::{AttitudeSample, Join, Nanos, RateSample, SampleKind};
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Of an attitude that was saved, rad: it is never known better.
const TILT_RESUMED: f64 = 0.02;

/// What is known of the attitude at the first sample.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Start {
    /// Nothing: it is levelled by the first specific force.
    Level,
    /// That of the propagator's settings.
    Known {
        /// Standard deviation of its tilt, rad.
        tilt: f64,
        /// Of its heading.
        heading: f64,
    },
}

/// A propagator whose attitude does not drift: level, and with gyro errors that are learned on the way.
///
/// The bits that come out do not depend on how the stream is cut into pushes.
///
/// # Example
/// ```
/// use strapd_attitude::aid::{self, Aided, Start};
/// use strapd_attitude::propagate;
/// use strapd_attitude::record::{Join, Nanos, RateSample, Status};
///
/// let mut aided = Aided::new(propagate::Settings::default(), aid::Settings::default(), Start::Level)?;
/// // At rest for ten seconds, tilted by 0.1 rad; a gyro with a bias of 0.6 deg/s.
/// let samples: Vec<RateSample> = (0..=1000)
///     .map(|i| RateSample {
///         stamp: Nanos(i * 10_000_000),
///         start: Nanos(i * 10_000_000),
///         value: [0.01, 0.0, 0.0].into(),
///         accel: Some([0.0, 9.81 * 0.1_f64.sin(), 9.81 * 0.1_f64.cos()].into()),
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
#[derive(Debug)]
pub struct Aided {
    propagator: Propagator,
    filter: Filter,
    kind: SampleKind,
    start: Start,
    /// The attitude is not that of this stream's beginning, but one that was saved.
    is_resumed: bool,
    /// Given to the propagator, whose attitudes have not come out yet.
    given: VecDeque<Given>,
    last: Option<Nanos>,
    /// What comes out of the propagator for one sample.
    scratch: Vec<AttitudeSample>,
    last_out: Option<AttitudeSample>,
}

/// A sample and what it was corrected by.
#[derive(Clone, Copy, Debug)]
struct Given {
    stamp: Nanos,
    measured: Measured,
    applied: Applied,
    join: Join,
}

impl Aided {
    /// Ready for the first sample.
    ///
    /// # Errors
    /// As [`Propagator::new`].
    pub fn new(
        propagation: propagate::Settings,
        settings: Settings,
        start: Start,
    ) -> Result<Aided, SettingsError> {
        let is_instant = propagation.kind == SampleKind::Rate;
        Ok(Aided {
            filter: Filter::new(settings, is_instant, propagation.world_rate),
            propagator: Propagator::new(propagation)?,
            kind: propagation.kind,
            start,
            is_resumed: false,
            given: VecDeque::new(),
            last: None,
            scratch: Vec::new(),
            last_out: None,
        })
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
        self.is_resumed = true;
        Ok(())
    }

    /// See [`Propagator::succeed`].
    pub fn succeed(&mut self, resets: u32) {
        self.propagator.succeed(resets);
    }

    /// Takes samples in and appends the attitudes that are ready.
    pub fn push(&mut self, samples: &[RateSample], out: &mut Vec<AttitudeSample>) {
        for sample in samples {
            let corrected = self.give(sample);
            self.propagator
                .push(&[corrected], &Sequential, &mut self.scratch);
            self.correct(out);
        }
    }

    /// The stream has ended: appends the attitudes still waiting.
    pub fn finish(&mut self, out: &mut Vec<AttitudeSample>) {
        self.propagator.finish(&Sequential, &mut self.scratch);
        self.correct(out);
    }

    /// The sample as the propagator is to have it.
    fn give(&mut self, sample: &RateSample) -> RateSample {
        let applied = self.filter.applied();
        let secs = self.last.map_or(0.0, |last| sample.stamp.secs_since(last));
        self.last = Some(sample.stamp);
        let own = match self.kind {
            SampleKind::Rate => 1.0,
            SampleKind::Average | SampleKind::DeltaAngle => sample.stamp.secs_since(sample.start),
        };
        let rate = if own > 0.0 {
            sample.value / own
        } else {
            Vector3::zeros()
        };
        self.given.push_back(Given {
            stamp: sample.stamp,
            measured: Measured {
                secs,
                rate,
                force: sample.accel,
                field: None,
            },
            applied,
            join: sample.join,
        });
        RateSample {
            value: applied.corrected(sample.value, own),
            ..*sample
        }
    }

    /// Corrects what came out of the propagator. Each sample comes out once, in order; some of them, when
    /// asked for, a second time for good.
    fn correct(&mut self, out: &mut Vec<AttitudeSample>) {
        let mut scratch = std::mem::take(&mut self.scratch);
        for sample in &scratch {
            let is_first = self
                .given
                .front()
                .is_some_and(|given| given.stamp == sample.stamp);
            if is_first && let Some(given) = self.given.pop_front() {
                self.take(&given, sample);
            }
            let mut q_nb = self.filter.corrected(&sample.q_nb);
            if let Some(last) = &self.last_out {
                q_nb = q_nb.same_sign_as(&last.q_nb);
            }
            let corrected = AttitudeSample {
                q_nb,
                covariance: self.filter.attitude_covariance(&q_nb, &sample.rate),
                ..*sample
            };
            self.last_out = Some(corrected);
            out.push(corrected);
        }
        scratch.clear();
        self.scratch = scratch;
    }

    fn take(&mut self, given: &Given, propagated: &AttitudeSample) {
        let (measured, attitude) = (&given.measured, &propagated.q_nb);
        if given.join == Join::Reset {
            self.filter.reset();
        }
        if !self.filter.is_started() {
            match self.start_at(propagated) {
                Start::Level => self.filter.begin(measured, attitude),
                Start::Known { tilt, heading } => {
                    self.filter.begin_known(measured, tilt, heading);
                }
            }
        } else if matches!(given.join, Join::Hold | Join::Start) {
            self.filter.hold(measured);
        } else if measured.secs > 0.0 {
            self.filter.take(measured, &given.applied, attitude);
        }
    }

    /// What is known at a first sample: of an attitude that was saved, what the propagator says of it by now.
    fn start_at(&mut self, propagated: &AttitudeSample) -> Start {
        if !std::mem::take(&mut self.is_resumed) {
            return self.start;
        }
        let earth = propagated.covariance.in_navigation_axes(&propagated.q_nb);
        Start::Known {
            tilt: earth[(0, 0)].max(earth[(1, 1)]).sqrt().max(TILT_RESUMED),
            heading: earth[(2, 2)].sqrt(),
        }
    }
}
