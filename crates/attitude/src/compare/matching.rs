//! Two stamped tracks -> pairs at the same instants. Pure.
//!
//! Apart from `compare` because what counts as "the same instant" decides every number after it.

use super::{LeftOut, Stamped};
use crate::frames::{Body, Nav};
use crate::quaternion::Quaternion;
use crate::record::Nanos;
use std::borrow::Cow;
use std::ops::ControlFlow;

/// Longest bridge, in median spacings: estimates further apart are not interpolated.
const LONGEST_BRIDGE: i64 = 4;

/// A track in time order, attitudes only.
pub(crate) struct Track<'a> {
    pub(super) rows: Cow<'a, [Stamped]>,
    /// Number of rows that were no attitude.
    pub(super) bad: usize,
    /// Median distance of successive distinct stamps, in nanoseconds; 0 when there are none.
    pub(super) spacing: i64,
}

impl<'a> Track<'a> {
    pub(crate) fn new(given: &'a [Stamped]) -> Track<'a> {
        let is_attitude =
            |(_, q): &Stamped| Quaternion::<Nav, Body>::try_from_wxyz(q.wxyz()).is_ok();
        let in_order = given.is_sorted_by_key(|(stamp, _)| *stamp);
        let rows = if in_order && given.iter().all(is_attitude) {
            Cow::Borrowed(given)
        } else {
            let mut kept: Vec<Stamped> = given.iter().copied().filter(is_attitude).collect();
            kept.sort_by_key(|(stamp, _)| *stamp); // stable: equal stamps stay in their order
            Cow::Owned(kept)
        };
        Track {
            bad: given.len() - rows.len(),
            spacing: median_spacing(&rows),
            rows,
        }
    }
}

/// Why there is no attitude at an instant.
pub(crate) enum Missing {
    Outside,
    InGap,
}

impl Track<'_> {
    /// The attitude at an instant, interpolated, by the place of the first row after it.
    pub(crate) fn at(&self, stamp: Nanos, after: usize) -> Result<Quaternion<Nav, Body>, Missing> {
        let before = after.checked_sub(1).and_then(|i| self.rows.get(i));
        match (before, self.rows.get(after)) {
            (Some((t, q)), _) if *t == stamp => Ok(q.normalised()),
            (Some((t0, q0)), Some((t1, q1))) => {
                let gap = t1.since(*t0);
                if gap > self.spacing.saturating_mul(LONGEST_BRIDGE) {
                    return Err(Missing::InGap);
                }
                // t0 < stamp < t1, so gap > 0.
                let t = stamp.since(*t0) as f64 / gap as f64;
                Ok(q0.normalised().slerp(&q1.normalised(), t))
            }
            _ => Err(Missing::Outside),
        }
    }
}

fn median_spacing(rows: &[Stamped]) -> i64 {
    let mut spacings: Vec<i64> = rows
        .windows(2)
        .filter_map(|pair| match pair {
            [(a, _), (b, _)] => Some(b.since(*a)),
            _ => None,
        })
        .filter(|spacing| *spacing > 0)
        .collect();
    if spacings.is_empty() {
        return 0;
    }
    let middle = spacings.len() / 2;
    *spacings.select_nth_unstable(middle).1
}

/// Visits every reference sample inside the estimate, in time order, with the rotation from the
/// world of the estimate to that of the reference, `q_ref q_est*`, the estimate interpolated, and the place of the
/// first estimate that is not before it.
pub(super) fn for_each_match(
    estimate: &Track<'_>,
    reference: &Track<'_>,
    mut visit: impl FnMut(Nanos, Quaternion<Nav, Nav>, usize) -> ControlFlow<()>,
) -> LeftOut {
    let mut left_out = LeftOut {
        bad_estimates: estimate.bad,
        bad_references: reference.bad,
        ..LeftOut::default()
    };
    // The first estimate later than the reference sample.
    let mut after = reference
        .rows
        .first()
        .map_or(0, |(stamp, _)| estimate.until(*stamp));
    for (stamp, q_ref) in reference.rows.iter() {
        while estimate.rows.get(after).is_some_and(|(t, _)| t <= stamp) {
            after += 1;
        }
        let q_est = match estimate.at(*stamp, after) {
            Ok(q_est) => q_est,
            Err(Missing::InGap) => {
                left_out.in_gap += 1;
                continue;
            }
            Err(Missing::Outside) => {
                left_out.outside += 1;
                continue;
            }
        };
        let before = after.saturating_sub(1);
        let is_at = estimate.rows.get(before).is_some_and(|(t, _)| t == stamp);
        let place = if is_at { before } else { after };
        if visit(*stamp, q_ref.normalised() * q_est.inverse(), place).is_break() {
            break;
        }
    }
    left_out
}
