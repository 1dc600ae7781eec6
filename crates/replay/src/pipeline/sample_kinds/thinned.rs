//! Entries of any number -> at most so many of them, evenly. Pure.
//!
//! Apart from the comparison because it bounds the memory of a log of any length, whatever is kept of it.

/// Most attitudes kept per track; beyond, every second one goes, again and again, so that memory
/// stays bounded on any log.
pub(super) const MOST: usize = 1 << 17;

/// A track that halves itself when it grows too long.
#[derive(Debug)]
pub(super) struct Thinned<T> {
    pub(super) entries: Vec<T>,
    pub(super) most: usize,
    pub(super) stride: u64,
    seen: u64,
}

impl<T> Thinned<T> {
    pub(super) fn new() -> Thinned<T> {
        Thinned {
            entries: Vec::new(),
            most: MOST,
            stride: 1,
            seen: 0,
        }
    }

    pub(super) fn push(&mut self, entry: T) {
        if self.seen.is_multiple_of(self.stride) {
            if self.entries.len() >= self.most {
                let mut keep = false;
                self.entries.retain(|_| {
                    keep = !keep;
                    keep
                });
                self.stride *= 2;
            }
            if self.seen.is_multiple_of(self.stride) {
                self.entries.push(entry);
            }
        }
        self.seen += 1;
    }
}
