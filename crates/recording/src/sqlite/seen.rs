//! Numbers of pages -> which were used. Pure.
//!
//! Apart because it is what keeps the work in bounds: a page belongs to one place of one tree, so the second that
//! names it is wrong, and no circle can be walked.

use std::collections::BTreeMap;

/// A bit for each page that was used; memory grows with those, and not with the greatest number.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    words: BTreeMap<u32, u64>,
    last: u32,
}

impl Seen {
    /// Makes one for pages up to this number.
    pub(crate) fn up_to(pages: u32) -> Seen {
        Seen {
            words: BTreeMap::new(),
            last: pages,
        }
    }

    /// Marks a page; false where it was marked, or is none.
    pub(crate) fn mark(&mut self, page: u32) -> bool {
        if page == 0 || page > self.last {
            return false;
        }
        let word = self.words.entry(page / 64).or_default();
        let bit = 1 << (page % 64);
        let is_new = *word & bit == 0;
        *word |= bit;
        is_new
    }

    pub(crate) fn has(&self, page: u32) -> bool {
        let word = self.words.get(&(page / 64));
        page > self.last || word.is_some_and(|word| word & (1 << (page % 64)) != 0)
    }
}
