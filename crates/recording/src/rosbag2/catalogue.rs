//! All pages of a damaged database -> leaves with messages that no tree reaches. Pure, but for who has the pages.
//!
//! Apart from the walk because it is made once, when the first page is lost, and looked at again and again: a page
//! above hundreds of leaves costs none of their rows.

use crate::sqlite::{Header, Page, Pages, Seen};
use std::collections::BTreeSet;
use std::io;
use std::ops::Bound;

/// Most leaves that are kept: those of 16 GiB in pages of 4 kB.
const MOST: usize = 4 << 20;

/// Leaves by the number of their first row.
#[derive(Debug, Default)]
pub(super) struct Catalogue {
    leaves: BTreeSet<(i64, u32)>,
    /// Whether there were more than are kept.
    pub(super) is_full: bool,
}

impl Catalogue {
    /// Looks at every page that was not seen. `first` tells the first row of one that is wanted.
    ///
    /// # Errors
    /// Only when the input itself cannot be read.
    pub(super) fn of(
        pages: &mut dyn Pages,
        seen: &Seen,
        header: &Header,
        first: impl Fn(&Page<'_>) -> Option<i64>,
    ) -> io::Result<Catalogue> {
        let free = free(pages, header)?;
        let mut found = Catalogue::default();
        let mut bytes = Vec::new();
        let mut last = 0;
        while let Some(number) = pages.following(last) {
            last = number;
            if seen.has(number) || free.has(number) || !pages.page(number, &mut bytes)? {
                continue;
            }
            let page = Page::of(number, &bytes).ok();
            let Some(row) = page.and_then(|page| first(&page)) else {
                continue;
            };
            found.is_full = found.leaves.len() >= MOST;
            if found.is_full {
                break;
            }
            found.leaves.insert((row, number));
        }
        Ok(found)
    }

    /// Takes out those whose first row is above the first, and no more than the last: each is given once, however often
    /// its rows are missed.
    pub(super) fn take(&mut self, (low, high): (i64, i64)) -> Vec<u32> {
        let from = match low {
            i64::MIN => Bound::Unbounded,
            _ => Bound::Excluded((low, u32::MAX)),
        };
        let to = Bound::Included((high.max(low), u32::MAX));
        let mut taken = Vec::new();
        while let Some(leaf) = self.leaves.range((from, to)).next().copied() {
            self.leaves.remove(&leaf);
            taken.push(leaf.1);
        }
        taken
    }
}

/// Pages that were given back: what is in them is no longer the recording's.
fn free(pages: &mut dyn Pages, header: &Header) -> io::Result<Seen> {
    let mut free = Seen::up_to(pages.count());
    let mut next = header.free;
    let mut bytes = Vec::new();
    while next > 0 && free.mark(next) && pages.page(next, &mut bytes)? {
        let (words, _) = bytes.as_chunks::<4>();
        let mut words = words.iter().map(|word| u32::from_be_bytes(*word));
        next = words.next().unwrap_or(0);
        let count = words.next().unwrap_or(0);
        for number in words.take(count as usize) {
            free.mark(number);
        }
    }
    Ok(free)
}
