//! Leaves -> rows, each put together from the pages it lies in. Pure, but for who has the pages.
//!
//! Apart from the tree because leaves also come from elsewhere: where a page above them is lost.

use super::page::{Cell, Page};
use super::tree::{Span, Tree, TreeItem};
use super::{Pages, Row, Seen};
use std::collections::VecDeque;
use std::io;

/// The rows of a table, under way.
#[derive(Debug)]
pub(crate) struct Table {
    tree: Option<Tree>,
    /// Leaves that come before the tree goes on.
    first: VecDeque<u32>,
    number: u32,
    leaf: Vec<u8>,
    next: usize,
    cells: usize,
    /// Places of rows in the leaf, and the number of each in it, to see a place that is named twice; `are_apart`
    /// where none is.
    places: Vec<(usize, usize)>,
    are_apart: bool,
    /// A row that lies in several pages.
    joined: Vec<u8>,
    overflow: Vec<u8>,
    /// Longest row that is put together, bytes.
    longest: u64,
}

/// Item that comes next.
#[derive(Debug)]
pub(crate) enum TableItem<'a> {
    Row {
        page: u32,
        rowid: i64,
        row: Row<'a>,
    },
    /// A row that cannot be read.
    LostRow {
        page: u32,
        why: &'static str,
    },
    /// A page with these rows that cannot be read.
    LostPage {
        page: u32,
        why: &'static str,
        rows: Span,
    },
    End,
}

impl Table {
    /// The table with this root; rows longer than `longest` are lost.
    pub(crate) fn of(root: Option<u32>, longest: u64) -> Table {
        Table {
            tree: root.map(Tree::of),
            first: VecDeque::new(),
            number: 0,
            leaf: Vec::new(),
            next: 0,
            cells: 0,
            places: Vec::new(),
            are_apart: false,
            joined: Vec::new(),
            overflow: Vec::new(),
            longest,
        }
    }

    /// The page of the row before.
    pub(crate) fn page(&self) -> u32 {
        self.number
    }

    /// Leaves whose rows come next.
    pub(crate) fn put_first(&mut self, leaves: impl Iterator<Item = u32>) {
        self.first.extend(leaves);
    }

    /// The next row, or what is lost in its place.
    ///
    /// # Errors
    /// Only when the input itself cannot be read.
    pub(crate) fn next(
        &mut self,
        pages: &mut dyn Pages,
        seen: &mut Seen,
    ) -> io::Result<TableItem<'_>> {
        while self.next >= self.cells {
            if let Some(lost) = self.turn(pages, seen)? {
                return Ok(lost);
            }
        }
        let (page, nth) = (self.number, self.next);
        self.next += 1;
        let lost = |why| Ok(TableItem::LostRow { page, why });
        let Ok(leaf) = Page::of(page, &self.leaf) else {
            self.cells = 0;
            return lost("its page is none of a table");
        };
        let Some(place) = leaf.place(nth) else {
            return lost("it does not lie in its page");
        };
        if !self.are_apart {
            let first = self.places.partition_point(|known| *known < (place, 0));
            if self.places.get(first) != Some(&(place, nth)) {
                return lost("another row lies in its place");
            }
        }
        let Some(cell) = leaf.cell(nth) else {
            return lost("it does not end in its page");
        };
        let rowid = cell.rowid;
        let bytes = if cell.overflow == 0 {
            cell.local
        } else {
            match join(
                &cell,
                self.longest,
                pages,
                seen,
                &mut self.joined,
                &mut self.overflow,
            )? {
                Ok(()) => &self.joined,
                Err(why) => return lost(why),
            }
        };
        match Row::of(bytes) {
            Some(row) => Ok(TableItem::Row { page, rowid, row }),
            None => lost("its values do not end in it"),
        }
    }

    /// Turns to the next leaf; or what comes instead.
    fn turn(
        &mut self,
        pages: &mut dyn Pages,
        seen: &mut Seen,
    ) -> io::Result<Option<TableItem<'static>>> {
        (self.next, self.cells) = (0, 0);
        self.number = match self.first.pop_front() {
            Some(number) if seen.mark(number) && pages.page(number, &mut self.leaf)? => number,
            Some(_) => return Ok(None),
            None => {
                let Some(tree) = &mut self.tree else {
                    return Ok(Some(TableItem::End));
                };
                match tree.next(pages, seen, &mut self.leaf)? {
                    TreeItem::Leaf(number) => number,
                    TreeItem::Lost { page, why, rows } => {
                        return Ok(Some(TableItem::LostPage { page, why, rows }));
                    }
                    TreeItem::End => return Ok(Some(TableItem::End)),
                }
            }
        };
        self.places.clear();
        if let Ok(page) = Page::of(self.number, &self.leaf) {
            self.cells = page.cells;
            let places = (0..page.cells).filter_map(|nth| Some((page.place(nth)?, nth)));
            self.places.extend(places);
            // Rows that were only added lie one before the other.
            self.are_apart = self.places.is_sorted_by(|(a, _), (b, _)| a > b);
            if !self.are_apart {
                self.places.sort_unstable();
                self.are_apart = self.places.is_sorted_by(|(a, _), (b, _)| a < b);
            }
        }
        Ok(None)
    }
}

/// Puts a row together, or says why that cannot be done.
fn join(
    cell: &Cell<'_>,
    longest: u64,
    pages: &mut dyn Pages,
    seen: &mut Seen,
    joined: &mut Vec<u8>,
    page: &mut Vec<u8>,
) -> io::Result<Result<(), &'static str>> {
    joined.clear();
    joined.extend_from_slice(cell.local);
    if cell.length > longest {
        return Ok(Err("it is longer than the limit"));
    }
    let mut next = cell.overflow;
    let mut left = cell.length.saturating_sub(cell.local.len() as u64);
    while left > 0 {
        if next == 0 || next > pages.count() {
            return Ok(Err("it goes on in a page that is not there"));
        }
        if !seen.mark(next) {
            return Ok(Err("it goes on in a page that another place has, too"));
        }
        if !pages.page(next, page)? {
            return Ok(Err("it goes on in a page that is not there"));
        }
        let Some((number, data)) = page.split_first_chunk() else {
            return Ok(Err("it goes on in a page that is not there"));
        };
        next = u32::from_be_bytes(*number);
        let taken = usize::try_from(left).unwrap_or(usize::MAX).min(data.len());
        joined.extend_from_slice(data.get(..taken).unwrap_or(data));
        left = left.saturating_sub(taken as u64);
    }
    Ok(if next == 0 {
        Ok(())
    } else {
        Err("it goes on behind its end")
    })
}
