//! Numbers of pages -> which were used. Pure.
//!
//! Apart because it is what keeps the work in bounds: a page belongs to one place of one tree, so the second that names it
//! is wrong, and no circle can be walked.

/// A bit for each page.
#[derive(Debug, Default)]
pub(crate) struct Seen(Vec<u64>);

impl Seen {
    /// For pages up to this number.
    pub(crate) fn up_to(pages: u32) -> Seen {
        Seen(vec![0; pages as usize / 64 + 1])
    }

    /// Marks a page; false where it was marked, or is none.
    pub(crate) fn mark(&mut self, page: u32) -> bool {
        let bit = 1 << (page % 64);
        match self.0.get_mut(page as usize / 64) {
            Some(word) if page > 0 && *word & bit == 0 => {
                *word |= bit;
                true
            }
            _ => false,
        }
    }

    pub(crate) fn has(&self, page: u32) -> bool {
        let word = self.0.get(page as usize / 64);
        word.is_none_or(|word| word & (1 << (page % 64)) != 0)
    }
}
