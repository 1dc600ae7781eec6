//! Two recordings of one attitude -> how far apart they are. Pure.
//!
//! A stage of its own because a number is only worth what its definition is: which world they were
//! put into ([`Align`]), how instants were matched, what was left out. The command line prints
//! these numbers; nothing of the comparison happens there.
//!
//! - **Absolute errors**: at every reference sample, against the estimate interpolated between its
//!   neighbours (great arc), after one constant rotation of the world.
//! - **Relative error over 1 s**: rotation from t to t + 1 s, which no choice of world changes.
//!
//! References carry NaN where the cameras lost the body; such rows are left out and counted.
//! Everything is O(n log n) in time and O(n) in memory, linear when the input is in time order.

mod align;
mod body_axes;
mod consistency;
mod constant_bias;
pub(crate) mod matching;
mod reference;
mod relative;
mod statistics;
mod time_shift;
mod turn_ratio;

pub use align::{Align, ParseAlignError};
pub use body_axes::{BodyAxesFit, fit_body_axes};
pub use consistency::{BoundedError, Consistency, UncertainAttitude, WithinSigma, consistency};
pub use constant_bias::{BiasFit, fit_constant_bias};
pub use reference::Reference;
pub use relative::RelativeError;
pub use statistics::{Drift, ErrorStats};
pub use time_shift::{TimeShift, fit_time_shift};
pub use turn_ratio::{TurnRatio, turn_ratio};

use crate::frames::{Body, Nav};
use crate::quaternion::{Quaternion, RotationVector};
use crate::record::Nanos;
use matching::{Track, for_each_match};
use statistics::DriftFit;

/// An attitude at an instant.
pub type Stamped = (Nanos, Quaternion<Nav, Body>);

/// Comparison of an estimate with a reference. All angles in rad.
#[derive(Clone, PartialEq, Debug)]
pub struct Comparison {
    /// Reference samples that found an estimate.
    pub samples: usize,
    /// Instants of the first and the last of them.
    pub span: Option<(Nanos, Nanos)>,
    /// The constant rotation from the world of the estimate to that of the reference, of its first part.
    pub alignment: Quaternion<Nav, Nav>,
    /// Parts of the reference that were aligned each by itself, from one [cut](Reference::cuts) to the next.
    pub parts: usize,
    /// Absolute errors; `None` without a match.
    pub errors: Option<Errors>,
    /// Straight-line growth of the error; `None` with fewer than two instants.
    pub drift: Option<Drift>,
    /// Error of the rotation over 1 s; `None` when no two reference samples are 1 s apart.
    pub relative_1s: Option<RelativeError>,
    /// Rows that were left out.
    pub left_out: LeftOut,
}

/// Absolute errors after alignment, in rad.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Errors {
    /// Angle of the rotation between the two attitudes.
    pub total: ErrorStats,
    /// Part about the vertical (z of the world), as an absolute value.
    pub heading: ErrorStats,
    /// The rest: the angle between the two verticals.
    pub inclination: ErrorStats,
}

/// Rows that took no part in the absolute errors.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LeftOut {
    /// Estimates that are no attitude (NaN, norm outside 0.5 to 2).
    pub bad_estimates: usize,
    /// Reference rows that are no attitude.
    pub bad_references: usize,
    /// Reference samples before the first or after the last estimate.
    pub outside: usize,
    /// Reference samples in a gap of the estimate, longer than four of its median spacings.
    pub in_gap: usize,
}

/// The error at one reference sample, for plots. Angles in rad.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ErrorAt {
    /// Stamp.
    pub stamp: Nanos,
    /// Angle of the rotation between the two attitudes, 0..=pi.
    pub total: f64,
    /// Part about the vertical, signed, -pi..=pi: positive when the estimate is ahead, turned
    /// too far about z.
    pub heading: f64,
    /// Angle between the two verticals, 0..=pi.
    pub inclination: f64,
}

/// Compares an estimate with a reference.
///
/// Any order of rows is accepted; equal stamps are accepted. Never panics: with nothing in
/// common, everything is `None` and counted.
///
/// # Source
/// Heading and inclination: Laidig, Caruso, Cereatti, Seel, "BROAD", Data 6(7), 2021, section 4.1.
#[must_use]
pub fn compare<'r>(
    estimate: &[Stamped],
    reference: impl Into<Reference<'r>>,
    align: Align,
) -> Comparison {
    let Reference { rows, cuts } = reference.into();
    let (estimate, reference) = (Track::new(estimate), Track::new(rows));
    let parts = reference.parts(cuts);
    let mut total = Vec::new();
    let mut heading = Vec::new();
    let mut inclination = Vec::new();
    let mut span: Option<(Nanos, Nanos)> = None;
    let mut drift = DriftFit::default();
    let (mut alignment, mut left_out) = (None, LeftOut::default());
    for part in &parts {
        let mut of_part = DriftFit::default();
        let (turn, left) = each_error(&estimate, part, align, |at, error| {
            let (first, _) = *span.get_or_insert((at.stamp, at.stamp));
            span = Some((first, at.stamp));
            total.push(at.total);
            heading.push(at.heading.abs());
            inclination.push(at.inclination);
            of_part.add(at.stamp.secs_since(first), error);
        });
        drift = drift.pooled(of_part);
        alignment.get_or_insert(turn);
        left_out = LeftOut {
            bad_estimates: left.bad_estimates,
            bad_references: left_out.bad_references + left.bad_references,
            outside: left_out.outside + left.outside,
            in_gap: left_out.in_gap + left.in_gap,
        };
    }
    let samples = total.len();
    let errors = ErrorStats::of(&mut total)
        .zip(ErrorStats::of(&mut heading))
        .zip(ErrorStats::of(&mut inclination))
        .map(|((total, heading), inclination)| Errors {
            total,
            heading,
            inclination,
        });
    Comparison {
        samples,
        span,
        alignment: alignment.unwrap_or(Quaternion::identity()),
        parts: parts.len(),
        errors,
        drift: drift.finish(),
        relative_1s: relative::over_one_second(&estimate, &parts),
        left_out,
    }
}

/// The errors behind [`Comparison::errors`], one by one, in time order.
pub fn for_each_error<'r>(
    estimate: &[Stamped],
    reference: impl Into<Reference<'r>>,
    align: Align,
    mut visit: impl FnMut(&ErrorAt),
) {
    let Reference { rows, cuts } = reference.into();
    let (estimate, reference) = (Track::new(estimate), Track::new(rows));
    for part in reference.parts(cuts) {
        each_error(&estimate, &part, align, |at, _| visit(&at));
    }
}

fn each_error(
    estimate: &Track<'_>,
    reference: &Track<'_>,
    align: Align,
    mut visit: impl FnMut(ErrorAt, RotationVector),
) -> (Quaternion<Nav, Nav>, LeftOut) {
    let alignment = align.rotation(estimate, reference);
    let back = alignment.inverse();
    let left_out = for_each_match(estimate, reference, |stamp, q_ref_est, _| {
        let error = (q_ref_est * back).inverse();
        let error = error.same_sign_as(&Quaternion::identity());
        let [w, x, y, z] = error.wxyz();
        let at = ErrorAt {
            stamp,
            total: 2.0 * x.hypot(y).hypot(z).atan2(w),
            heading: 2.0 * z.atan2(w),
            inclination: 2.0 * x.hypot(y).atan2(w.hypot(z)),
        };
        visit(at, error.rotation_vector());
        std::ops::ControlFlow::Continue(())
    });
    (alignment, left_out)
}

#[cfg(test)]
mod tests;
