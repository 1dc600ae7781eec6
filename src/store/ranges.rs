//! Ranges of bytes that are there, and which to fetch together. Pure.

use std::collections::BTreeMap;
use std::ops::Range;

/// Stretches nearer to each other than this are fetched as one: a request costs as much.
const NEAR: u64 = 256 << 10;
/// The least that is fetched at a time where there is more, and half of the most.
const PIECE: u64 = 4 << 20;

/// Bytes, as stretches that do not touch.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Ranges {
    /// Start -> end.
    by_start: BTreeMap<u64, u64>,
}

impl Ranges {
    pub(super) fn add(&mut self, range: Range<u64>) {
        let Range { mut start, mut end } = range;
        if start >= end {
            return;
        }
        while let Some((&before, &its_end)) = self.by_start.range(..=end).next_back() {
            if its_end < start {
                break;
            }
            self.by_start.remove(&before);
            start = start.min(before);
            end = end.max(its_end);
        }
        self.by_start.insert(start, end);
    }

    /// The first byte of `range` that is not there.
    pub(super) fn first_gap(&self, range: &Range<u64>) -> Option<u64> {
        let before = self.by_start.range(..=range.start).next_back();
        let at = match before {
            Some((_, &end)) if end > range.start => end,
            _ => range.start,
        };
        (at < range.end).then_some(at)
    }

    /// Range from `at`, which is not there, to the next byte that is, or to `end`.
    pub(super) fn gap(&self, at: u64, end: u64) -> Range<u64> {
        let next = self.by_start.range(at..).next();
        at..next.map_or(end, |(&start, _)| start.min(end))
    }

    /// End of the last stretch before `at`.
    pub(super) fn end_before(&self, at: u64) -> u64 {
        let before = self.by_start.range(..=at).next_back();
        before.map_or(0, |(_, &end)| end.min(at))
    }
}

/// Pieces to fetch at a time, for what is to be read in that order.
pub(super) fn pieces(ranges: &[Range<u64>], size: u64) -> Vec<Range<u64>> {
    let mut joined: Vec<Range<u64>> = Vec::new();
    for range in ranges {
        let range = range.start.min(size)..range.end.min(size);
        match joined.last_mut() {
            _ if range.is_empty() => {}
            Some(last)
                if range.start >= last.start && range.start <= last.end.saturating_add(NEAR) =>
            {
                last.end = last.end.max(range.end);
            }
            _ => joined.push(range),
        }
    }
    let mut pieces = Vec::new();
    for range in joined {
        let length = range.end - range.start;
        let parts = (length / PIECE).max(1);
        let (each, mut start) = (length / parts, range.start);
        for part in 1..=parts {
            let end = match part == parts {
                true => range.end,
                false => start + each,
            };
            pieces.push(start..end);
            start = end;
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_grow_together_and_what_is_missing_is_known() {
        let mut have = Ranges::default();
        for range in [10..20, 30..40, 50..60, 20..30, 45..50, 7..7] {
            have.add(range);
        }
        let of: Vec<(u64, u64)> = have.by_start.iter().map(|(&s, &e)| (s, e)).collect();
        assert_eq!(of, [(10, 40), (45, 60)]);
        for (range, gap) in [
            (10..40, None),
            (15..41, Some(40)),
            (0..5, Some(0)),
            (40..45, Some(40)),
            (45..60, None),
            (60..61, Some(60)),
        ] {
            assert_eq!(have.first_gap(&range), gap, "{range:?}");
        }
        assert_eq!(have.gap(40, 100), 40..45);
        assert_eq!(have.gap(60, 100), 60..100);
        assert_eq!(have.end_before(44), 40);
        assert_eq!(have.end_before(5), 0);
        have.add(0..100);
        assert_eq!(have.by_start.len(), 1);
    }

    #[test]
    fn what_is_near_is_fetched_together_and_what_is_long_in_parts() {
        let mib = 1 << 20;
        let near = [0..10, 200_000..200_010, 900_000..900_010];
        assert_eq!(pieces(&near, mib), [0..200_010, 900_000..900_010]);
        let long = pieces(std::slice::from_ref(&(0..25 * mib)), 25 * mib);
        assert_eq!(long.len(), 6);
        assert!(
            long.iter()
                .all(|p| (4 * mib..8 * mib).contains(&(p.end - p.start)))
        );
        assert_eq!(long.last().map(|p| p.end), Some(25 * mib));
        let cut = pieces(std::slice::from_ref(&(0..25 * mib)), 5);
        assert_eq!((cut.first(), cut.len()), (Some(&(0..5)), 1));
        let end = u64::MAX;
        let last = [end - 20..end - 10, end - 5..end];
        let whole = end - 20..end;
        assert_eq!(pieces(&last, end), std::slice::from_ref(&whole));
        // Another order is kept.
        assert_eq!(
            pieces(&[mib..2 * mib, 0..10], 2 * mib),
            [mib..2 * mib, 0..10]
        );
    }
}
