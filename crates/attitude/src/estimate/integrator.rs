//! Conditioned rates, and vectors beside them -> attitudes, whatever corrects them. Pure.
//!
//! Apart from the estimator because what integrates is chosen once, and everything around it is the same.

use super::anew::RestartRequest;
use super::kept::{Spool, SpoolError};
use super::smoothing::{Recording, Smoothing};
use crate::aid::{self, AidedPropagator, OutsideHeading, OutsideHeadingCounts};
use crate::diagnostic::Diagnostic;
use crate::frames::{Body, In};
use crate::propagate::{self, Executor, Method, Propagator};
use crate::record::{AttitudeSample, Nanos, RateSample};

/// Measurement beside the gyro.
#[derive(Clone, Copy, Debug)]
pub(super) enum Auxiliary {
    /// Specific force, m/s^2.
    Force(In<Body>),
    /// Magnetic field.
    Field(In<Body>),
    /// Heading from outside; with no stamp it is of the next sample.
    Heading {
        is_stamped: bool,
        measured: OutsideHeading,
    },
}

/// Rates -> attitudes.
#[derive(Debug)]
pub(super) enum Integrator {
    Alone(Box<Propagator>),
    Aided(Box<AidedPropagator>),
    /// All at the end; of nothing else than a whole recording.
    Smoothed(Box<Smoothing>),
}

impl Integrator {
    pub(super) fn push(
        &mut self,
        rates: &[RateSample],
        exec: &impl Executor,
        out: &mut Vec<AttitudeSample>,
    ) {
        match self {
            Integrator::Alone(propagator) => propagator.push(rates, exec, out),
            // What a sample is corrected by hangs on those before it.
            Integrator::Aided(aided) => aided.push(rates, out),
            Integrator::Smoothed(smoothing) => smoothing.push(rates, out),
        }
    }

    pub(super) fn take_beside(&mut self, stamp: Nanos, beside: Auxiliary) {
        match (self, beside) {
            (Integrator::Alone(_), _) => {}
            (Integrator::Aided(aided), Auxiliary::Force(force)) => aided.take_force(stamp, force),
            (Integrator::Aided(aided), Auxiliary::Field(field)) => aided.take_field(stamp, field),
            (
                Integrator::Aided(aided),
                Auxiliary::Heading {
                    is_stamped,
                    measured,
                },
            ) => {
                aided.take_heading(is_stamped.then_some(stamp), measured);
            }
            (Integrator::Smoothed(smoothing), Auxiliary::Force(force)) => {
                smoothing.take_force(stamp, force);
            }
            (Integrator::Smoothed(smoothing), Auxiliary::Field(field)) => {
                smoothing.take_field(stamp, field);
            }
            // Not offered: see `takes_headings`.
            (Integrator::Smoothed(_), Auxiliary::Heading { .. }) => {}
        }
    }

    /// Whether headings from outside correct anything: there is a vertical to turn about, and no recording to smooth.
    pub(super) fn takes_headings(&self) -> bool {
        matches!(self, Integrator::Aided(_))
    }

    /// Counts of them.
    pub(super) fn outside_headings(&self) -> OutsideHeadingCounts {
        match self {
            Integrator::Aided(aided) => aided.outside_headings(),
            Integrator::Alone(_) | Integrator::Smoothed(_) => OutsideHeadingCounts::default(),
        }
    }

    pub(super) fn expect_forces_beside(&mut self) {
        match self {
            Integrator::Alone(_) => {}
            Integrator::Aided(aided) => aided.expect_forces_beside(),
            Integrator::Smoothed(smoothing) => smoothing.expect_forces_beside(),
        }
    }

    /// Sets the spool for what does not fit in memory of a whole recording.
    pub(super) fn spool_to(&mut self, spool: Box<dyn Spool>) {
        if let Integrator::Smoothed(smoothing) = self {
            smoothing.spool_to(spool);
        }
    }

    /// Gives what is in `out`, and the rest after it, in pieces.
    ///
    /// # Errors
    /// Of the spool.
    pub(super) fn finish(
        &mut self,
        exec: &impl Executor,
        out: &mut Vec<AttitudeSample>,
        give: &mut dyn FnMut(&mut [AttitudeSample]),
    ) -> Result<(), SpoolError> {
        match self {
            Integrator::Alone(propagator) => propagator.finish(exec, out),
            Integrator::Aided(aided) => aided.finish(out),
            Integrator::Smoothed(smoothing) => return smoothing.finish(exec, out, give),
        }
        give(out);
        Ok(())
    }

    /// Goes on from an attitude that was saved.
    ///
    /// # Errors
    /// In words.
    pub(super) fn resume(&mut self, last: &AttitudeSample) -> Result<(), Diagnostic> {
        match self {
            Integrator::Alone(propagator) => propagator.resume(last),
            Integrator::Aided(aided) => aided.resume(last),
            Integrator::Smoothed(_) => {
                return Err("a smoothed recording has no attitude to go on from".into());
            }
        }
        .map_err(|e| Diagnostic::from(&e))
    }

    pub(super) fn memory(&self) -> Option<(propagate::Memory, Option<aid::Memory>)> {
        match self {
            Integrator::Alone(propagator) => Some((propagator.memory()?, None)),
            Integrator::Aided(aided) => {
                let (propagation, aiding) = aided.memory()?;
                Some((propagation, Some(aiding)))
            }
            Integrator::Smoothed(_) => None,
        }
    }

    /// Whether it goes on as the one that knew this; if not, it is as before.
    pub(super) fn recall(
        &mut self,
        propagation: &propagate::Memory,
        aiding: Option<&aid::Memory>,
    ) -> bool {
        match (self, aiding) {
            (Integrator::Alone(propagator), None) => propagator.recall(propagation),
            (Integrator::Aided(aided), Some(aiding)) => aided.recall((propagation, aiding)),
            _ => false,
        }
    }

    /// State by now, to go back to; `None` of a recording, whose samples are repaired before they come here.
    pub(super) fn checkpoint(&mut self) -> Option<Integrator> {
        match self {
            Integrator::Alone(propagator) => Some(Integrator::Alone(propagator.clone())),
            Integrator::Aided(aided) => Some(Integrator::Aided(Box::new(aided.checkpoint()))),
            Integrator::Smoothed(_) => None,
        }
    }

    /// Goes on as `other`, which was a checkpoint of this.
    pub(super) fn go_on_as(&mut self, mut other: Integrator) {
        if let (Integrator::Aided(aided), Integrator::Aided(before)) = (&mut other, &mut *self) {
            aided.keep_innovations_of(before);
        }
        *self = other;
    }

    pub(super) fn continue_counts_of(&mut self, resets: u32) {
        match self {
            Integrator::Alone(propagator) => propagator.continue_counts_of(resets),
            Integrator::Aided(aided) => aided.continue_counts_of(resets),
            Integrator::Smoothed(_) => {}
        }
    }

    pub(super) fn begin_anew(&mut self, anew: &RestartRequest) {
        match self {
            Integrator::Alone(propagator) => propagator.begin_anew(&anew.attitude),
            Integrator::Aided(aided) => aided.begin_anew(&anew.attitude, anew.start),
            Integrator::Smoothed(_) => {}
        }
    }

    /// Whether attitudes carry the acceleration without gravity: it was asked for, and they are corrected.
    pub(super) fn gives_acceleration(&self) -> bool {
        let is_given =
            |aided: &AidedPropagator| aided.gives_acceleration() && aided.filter().is_started();
        self.aided().is_some_and(is_given)
    }

    /// Returns whether there is a vertical to turn the world about.
    pub(super) fn turn_heading(&mut self, heading: f64) -> bool {
        let Integrator::Aided(aided) = self else {
            return false;
        };
        aided.turn_heading(heading);
        true
    }

    pub(super) fn keep_innovations(&mut self) {
        if let Integrator::Aided(aided) = self {
            aided.keep_innovations();
        }
    }

    pub(super) fn keeps_innovations(&self) -> bool {
        matches!(self, Integrator::Aided(aided) if aided.keeps_innovations())
    }

    pub(super) fn innovations(&mut self) -> Vec<(Nanos, aid::Innovation)> {
        match self {
            Integrator::Alone(_) | Integrator::Smoothed(_) => Vec::new(),
            Integrator::Aided(aided) => aided.innovations(),
        }
    }

    /// Filter that corrects, or runs along with the smoother.
    fn aided(&self) -> Option<&AidedPropagator> {
        match self {
            Integrator::Alone(_) => None,
            Integrator::Aided(aided) => Some(aided),
            Integrator::Smoothed(smoothing) => Some(smoothing.aided()),
        }
    }

    pub(super) fn filter(&self) -> Option<&aid::Filter> {
        self.aided().map(AidedPropagator::filter)
    }

    /// `None` where nobody asked for a smoother, or the end has not come.
    pub(super) fn smoothed(&self) -> Option<Result<&Recording, &Diagnostic>> {
        match self {
            Integrator::Smoothed(smoothing) => smoothing.result(),
            Integrator::Alone(_) | Integrator::Aided(_) => None,
        }
    }

    pub(super) fn propagation(&self) -> propagate::Report {
        match (self, self.aided()) {
            (Integrator::Alone(propagator), _) => propagator.report(),
            (_, aided) => aided.map(AidedPropagator::propagation).unwrap_or_default(),
        }
    }

    pub(super) fn method(&self) -> Method {
        match (self, self.aided()) {
            (Integrator::Alone(propagator), _) => propagator.method(),
            (_, aided) => aided.map_or(Method::Auto, AidedPropagator::method),
        }
    }
}
