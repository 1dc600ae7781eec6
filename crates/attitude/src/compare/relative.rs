//! Two tracks -> error of the rotation over one second. Pure.
//!
//! Apart from the absolute errors because it asks another question: not where the attitude is, but how
//! well a second of motion was followed. No choice of world, bias of seconds ago or heading changes it.

use super::Stamped;
use super::matching::Track;
use super::statistics::quantile;
use crate::frames::Body;
use crate::quaternion::Quaternion;
use crate::record::Nanos;

const INTERVAL_NANOS: i64 = 1_000_000_000;

/// Error of the rotation over 1 s, in rad.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RelativeError {
    /// Half are below.
    pub median: f64,
    /// 95 % are below.
    pub p95: f64,
    /// Number of pairs of reference samples.
    pub count: usize,
}

/// Error over one second: for every reference sample at t with another at t + 1 s (the nearest, within half the median
/// spacing): the angle of `(q_ref(t)* q_ref(t+1))* (q_est(t)* q_est(t+1))`, estimates nearest to
/// the stamps of the two reference samples and not further than one median spacing.
///
/// Nothing is compared across the parts of the reference.
pub(super) fn over_one_second(estimate: &Track<'_>, parts: &[Track<'_>]) -> Option<RelativeError> {
    let mut errors = Vec::new();
    for reference in parts {
        each_second(estimate, reference, |truth, found| {
            errors.push(truth.angle_to(&found));
        });
    }
    Some(RelativeError {
        count: errors.len(),
        median: quantile(&mut errors, 0.5)?,
        p95: quantile(&mut errors, 0.95)?,
    })
}

/// Visits the rotations over 1 s, body to body, of the reference and of the estimate.
pub(super) fn each_second(
    estimate: &Track<'_>,
    reference: &Track<'_>,
    mut visit: impl FnMut(Quaternion<Body, Body>, Quaternion<Body, Body>),
) {
    let Some((first, _)) = reference.rows.first() else {
        return;
    };
    let mut later = Nearest::new(reference, *first);
    let mut estimate_at_start = Nearest::new(estimate, *first);
    let mut estimate_at_end = Nearest::new(estimate, *first);
    for (start, ref_start) in reference.rows.iter() {
        let end = Nanos(start.0.saturating_add(INTERVAL_NANOS));
        let Some((end, ref_end)) = later.find(end, 1) else {
            continue;
        };
        let Some((_, est_start)) = estimate_at_start.find(*start, 2) else {
            continue;
        };
        let Some((_, est_end)) = estimate_at_end.find(*end, 2) else {
            continue;
        };
        let truth = ref_start.inverse() * *ref_end;
        let found = est_start.inverse() * *est_end;
        visit(truth.normalised(), found.normalised());
    }
}

/// Nearest row to each of a rising series of instants; the earlier of two equally near.
struct Nearest<'a> {
    track: &'a Track<'a>,
    at: usize,
}

impl<'a> Nearest<'a> {
    /// Begins at the row before `first`, the earliest instant that will be asked for.
    fn new(track: &'a Track<'a>, first: Nanos) -> Nearest<'a> {
        let at = track.until(first).saturating_sub(1);
        Nearest { track, at }
    }

    /// `None` when it is further away than `half_spacings` halves of the median spacing.
    fn find(&mut self, instant: Nanos, half_spacings: i64) -> Option<&'a Stamped> {
        let rows = &self.track.rows;
        while rows.get(self.at + 1).is_some_and(|row| row.0 <= instant) {
            self.at += 1;
        }
        let distance = |row: &Stamped| row.0.since(instant).saturating_abs();
        let nearest = rows
            .iter()
            .skip(self.at)
            .take(2)
            .min_by_key(|row| distance(row))?;
        let limit = self.track.spacing.saturating_mul(half_spacings);
        (distance(nearest).saturating_mul(2) <= limit).then_some(nearest)
    }
}
