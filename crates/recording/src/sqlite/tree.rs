//! The root of a table -> its leaves, in the order of their rows. Pure, but for who has the pages.
//!
//! Apart from the rows because a page that cannot be read is a hole between two numbers of rows here, which others may
//! fill.

use super::page::{Kind, Page};
use super::{Pages, Seen};
use std::io;

/// Levels of a tree: SQLite itself has no more.
const MAX_DEPTH: usize = 20;

/// Why a page that was used already is lost here.
pub(crate) const TWICE: &str = "another place has it, too";

/// Rows by number: those above the first, up to and with the last.
pub(crate) type Span = (i64, i64);

/// A tree under way.
#[derive(Debug)]
pub(crate) struct Tree {
    root: Option<u32>,
    open: Vec<Level>,
    /// Memory of pages that were used.
    spare: Vec<Vec<u8>>,
}

/// An interior page.
#[derive(Debug)]
struct Level {
    number: u32,
    bytes: Vec<u8>,
    next: usize,
    rows: Span,
}

/// Step that comes next.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum TreeItem {
    /// A leaf, whose bytes were copied.
    Leaf(u32),
    /// A page with these rows that cannot be used.
    Lost {
        page: u32,
        why: &'static str,
        rows: Span,
    },
    End,
}

impl Tree {
    pub(crate) fn of(root: u32) -> Tree {
        Tree {
            root: Some(root),
            open: Vec::new(),
            spare: Vec::new(),
        }
    }

    /// The next leaf, into `leaf`.
    ///
    /// # Errors
    /// Only when the input itself cannot be read.
    pub(crate) fn next(
        &mut self,
        pages: &mut dyn Pages,
        seen: &mut Seen,
        leaf: &mut Vec<u8>,
    ) -> io::Result<TreeItem> {
        loop {
            let (page, rows) = match self.root.take() {
                Some(root) => (root, (i64::MIN, i64::MAX)),
                None => match self.child() {
                    None => return Ok(TreeItem::End),
                    Some(Ok(found)) => found,
                    Some(Err(step)) => return Ok(step),
                },
            };
            let lost = |why| Ok(TreeItem::Lost { page, why, rows });
            if page == 0 || page > pages.count() {
                return lost("it is not there");
            }
            if !seen.mark(page) {
                return lost(TWICE);
            }
            let mut bytes = self.spare.pop().unwrap_or_default();
            if !pages.page(page, &mut bytes)? {
                return lost("it is not there");
            }
            match Page::of(page, &bytes).map(|page| page.kind) {
                Err(why) => return lost(why),
                Ok(Kind::Leaf) => {
                    std::mem::swap(leaf, &mut bytes);
                    self.spare.push(bytes);
                    return Ok(TreeItem::Leaf(page));
                }
                Ok(Kind::Interior) if self.open.len() >= MAX_DEPTH => {
                    return lost("the tree is too deep");
                }
                Ok(Kind::Interior) => self.open.push(Level {
                    number: page,
                    bytes,
                    next: 0,
                    rows,
                }),
            }
        }
    }

    /// The next page of the innermost level that has one; `None` at the end.
    fn child(&mut self) -> Option<Result<(u32, Span), TreeItem>> {
        loop {
            let level = self.open.last_mut()?;
            let page = Page::of(level.number, &level.bytes).ok()?;
            if level.next > page.cells {
                if let Some(done) = self.open.pop() {
                    self.spare.push(done.bytes);
                }
                continue;
            }
            let (low, high) = level.rows;
            let found = page.child(level.next);
            level.next += 1;
            let Some((child, key)) = found else {
                return Some(Err(TreeItem::Lost {
                    page: level.number,
                    why: "a place in it is none",
                    rows: level.rows,
                }));
            };
            // A number that is out of order is not believed.
            let key = key.filter(|key| *key >= low && *key <= high);
            if let Some(key) = key {
                level.rows.0 = key;
            }
            return Some(Ok((child, (low, key.unwrap_or(high)))));
        }
    }
}
