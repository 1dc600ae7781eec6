//! A reference that is set anew now and then -> the parts between. Pure.
//!
//! Apart from the tracks because it is no property of the attitude: an estimator that resets its heading (EKF2 when it
//! finds north, or GNSS corrects it) goes on in another world, and no gyro turned there.

use super::Stamped;
use super::matching::Track;
use crate::record::Nanos;
use std::borrow::Cow;

/// A recorded attitude, and when it was set anew.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Reference<'a> {
    /// The attitudes, in any order.
    pub rows: &'a [Stamped],
    /// Instants at which another world begins: each part is aligned by itself, and nothing is compared across.
    pub cuts: &'a [Nanos],
}

impl<'a, T: AsRef<[Stamped]> + ?Sized> From<&'a T> for Reference<'a> {
    fn from(rows: &'a T) -> Reference<'a> {
        Reference {
            rows: rows.as_ref(),
            cuts: &[],
        }
    }
}

impl Track<'_> {
    /// The stretches between the cuts, at least one; what was no attitude counts to the first.
    pub(super) fn parts(&self, cuts: &[Nanos]) -> Vec<Track<'_>> {
        let mut cuts = cuts.to_vec();
        cuts.sort_unstable();
        let mut rest: &[Stamped] = &self.rows;
        let mut stretches = Vec::new();
        for cut in cuts {
            let (before, after) = rest.split_at(rest.partition_point(|(stamp, _)| *stamp < cut));
            stretches.extend((!before.is_empty()).then_some(before));
            rest = after;
        }
        if !rest.is_empty() || stretches.is_empty() {
            stretches.push(rest);
        }
        stretches
            .into_iter()
            .enumerate()
            .map(|(nth, rows)| Track {
                rows: Cow::Borrowed(rows),
                bad: if nth == 0 { self.bad } else { 0 },
                spacing: self.spacing,
            })
            .collect()
    }

    /// Counts the rows that are not after an instant.
    pub(super) fn until(&self, instant: Nanos) -> usize {
        self.rows.partition_point(|(stamp, _)| *stamp <= instant)
    }
}
