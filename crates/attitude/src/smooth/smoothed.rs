//! A smoothed recording: what was found, and how sure. Pure.
//!
//! Apart from the work because this is what is left of it: nodes, constants, their covariance.

use super::border::Constants;
use super::factors::Node;
use super::planar::HeldBias;
use super::result::{Bias, Calibration, Counts, Outcome, Section};
use super::segments::Segment;
use super::settings::Settings;
use super::solver::Marginal;
use super::survey::Survey;
use crate::record::Nanos;
use nalgebra::{Matrix3, Vector3};

/// A heading that may be any: of a uniform distribution, rad.
pub(super) const ANY_HEADING: f64 = 104.0_f64.to_radians();
/// Sigma of a heading turned north but not solved with the field, rad.
const TURNED: f64 = 10.0_f64.to_radians();
/// Factor by which the heading's sigma is too small without a field.
const WITHOUT_FIELD: f64 = 2.0;

/// A smoothed recording: nodes in memory, attitudes on a further pass ([`Smoothed::attitudes`]).
#[derive(Debug)]
pub struct Smoothed {
    pub(super) survey: Survey,
    pub(super) settings: Settings,
    pub(super) segments: Vec<Segment>,
    pub(super) nodes: Vec<Node>,
    pub(super) constants: Constants,
    pub(super) marginals: Vec<Marginal>,
    pub(super) first: i64,
    pub(super) sections: Vec<Section>,
    pub(super) outcome: Outcome,
    pub(super) calibration: Calibration,
    pub(super) bound: [f64; 2],
    pub(super) held: Option<HeldBias>,
    pub(super) counts: Counts,
}

impl Smoothed {
    /// Origin of the attitudes.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        self.outcome
    }

    /// The sensor by this log.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Parts of the log between breaks.
    #[must_use]
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The motion bound: sigma of velocity (m/s) and position (m) over a second.
    #[must_use]
    pub fn bound(&self) -> [f64; 2] {
        self.bound
    }

    /// The bias that was held, where motion does not tell it: one axis of the body stays vertical, and no field tells
    /// the heading.
    #[must_use]
    pub fn held(&self) -> Option<HeldBias> {
        self.held
    }

    /// Counts of the samples.
    #[must_use]
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// The gyro's bias over time.
    pub fn biases(&self) -> impl Iterator<Item = Bias> {
        let stamps =
            std::iter::once(self.first).chain(self.segments.iter().map(|segment| segment.stamp));
        stamps
            .zip(&self.nodes)
            .zip(&self.marginals)
            .map(|((stamp, node), marginal)| Bias {
                stamp: Nanos(stamp),
                value: node.bias,
                sigma: Vector3::from(marginal.bias.map(|variance| variance.max(0.0).sqrt())),
            })
    }

    /// Covariance of the attitude between two nodes, a share of the way from one to the other.
    pub(super) fn covariance_at(
        &self,
        (from, to): (usize, usize),
        share: f64,
        rate: &Vector3<f64>,
        section: usize,
    ) -> Matrix3<f64> {
        let turn = |node: usize| self.marginals[node].turn + self.marginals[node].by_class;
        let (a, b) = (turn(from), turn(to));
        let mut covariance = a * (1.0 - share) + b * share;
        let has_north = self
            .sections
            .get(section)
            .is_some_and(|section| section.has_north);
        let is_turned = matches!(self.outcome, Outcome::Filter(_));
        if is_turned && has_north {
            covariance[(2, 2)] += TURNED * TURNED;
        }
        if !has_north {
            covariance.row_mut(2).scale_mut(WITHOUT_FIELD);
            covariance.column_mut(2).scale_mut(WITHOUT_FIELD);
            if section > 0 || self.counts_on_north() {
                covariance[(2, 2)] += ANY_HEADING * ANY_HEADING;
            }
        }
        let floor = super::output::floor(rate);
        covariance + Matrix3::from_diagonal_element(floor)
    }

    /// Some section has a north, so that heading is not that of the beginning.
    fn counts_on_north(&self) -> bool {
        self.sections.iter().any(|section| section.has_north)
    }
}
