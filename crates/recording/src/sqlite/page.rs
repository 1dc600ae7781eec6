//! One page -> its cells. Pure.
//!
//! Apart from the tree because a page is judged by itself: all that it says of where its cells lie is held against its
//! size.

/// Kind of a page of a table.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// Numbers of other pages.
    Interior,
    /// Rows.
    Leaf,
}

/// A page of the tree of a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Page<'a> {
    /// Usable bytes.
    bytes: &'a [u8],
    /// Offset of its own header: behind that of the database on page 1.
    head: usize,
    pub(crate) kind: Kind,
    pub(crate) cells: usize,
}

/// A row as it lies in its page.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Cell<'a> {
    pub(crate) rowid: i64,
    /// Bytes of the row.
    pub(crate) length: u64,
    /// Bytes of the payload on this page, not on overflow pages.
    pub(crate) local: &'a [u8],
    /// The page with those that follow; 0 for none.
    pub(crate) overflow: u32,
}

/// An unsigned number of one to nine bytes, and how many.
#[inline]
pub(crate) fn varint(bytes: &[u8]) -> Option<(u64, usize)> {
    // Nearly all are short.
    match *bytes {
        [a, ..] if a < 0x80 => Some((u64::from(a), 1)),
        [a, b, ..] if b < 0x80 => Some((u64::from(a & 0x7f) << 7 | u64::from(b), 2)),
        _ => long_varint(bytes),
    }
}

fn long_varint(bytes: &[u8]) -> Option<(u64, usize)> {
    let mut value = 0;
    for (at, byte) in bytes.iter().take(8).enumerate() {
        value = value << 7 | u64::from(byte & 0x7f);
        if byte & 0x80 == 0 {
            return Some((value, at + 1));
        }
    }
    bytes.get(8).map(|last| (value << 8 | u64::from(*last), 9))
}

fn word(bytes: &[u8]) -> Option<u32> {
    bytes.first_chunk().map(|bytes| u32::from_be_bytes(*bytes))
}

impl<'a> Page<'a> {
    /// The page of this number.
    ///
    /// # Errors
    /// Why it is none of a table, in words.
    pub(crate) fn of(number: u32, bytes: &'a [u8]) -> Result<Page<'a>, &'static str> {
        let head = if number == 1 { super::HEADER } else { 0 };
        let kind = match bytes.get(head) {
            Some(0x05) => Kind::Interior,
            Some(0x0d) => Kind::Leaf,
            _ => return Err("it is no page of a table"),
        };
        let cells = bytes.get(head + 3..).and_then(<[u8]>::first_chunk);
        let cells = cells.map_or(0, |bytes| usize::from(u16::from_be_bytes(*bytes)));
        let page = Page {
            bytes,
            head,
            kind,
            cells,
        };
        if page.pointers() + 2 * cells > bytes.len() {
            return Err("it counts more rows than have room");
        }
        Ok(page)
    }

    /// Offset of the places of the cells.
    fn pointers(&self) -> usize {
        match self.kind {
            Kind::Interior => self.head + 12,
            Kind::Leaf => self.head + 8,
        }
    }

    /// Offset of a cell.
    pub(crate) fn place(&self, nth: usize) -> Option<usize> {
        let at = self.pointers() + 2 * nth;
        let place = self.bytes.get(at..).and_then(<[u8]>::first_chunk)?;
        let place = usize::from(u16::from_be_bytes(*place));
        let first = self.pointers() + 2 * self.cells;
        (nth < self.cells && (first..self.bytes.len()).contains(&place)).then_some(place)
    }

    /// The page with the rows up to a number, of an interior page; behind its cells the last one, without a number.
    pub(crate) fn child(&self, nth: usize) -> Option<(u32, Option<i64>)> {
        if nth == self.cells {
            return Some((word(self.bytes.get(self.head + 8..)?)?, None));
        }
        let cell = self.bytes.get(self.place(nth)?..)?;
        let (key, _) = varint(cell.get(4..)?)?;
        Some((word(cell)?, Some(key.cast_signed())))
    }

    /// A row of a leaf.
    #[inline]
    pub(crate) fn cell(&self, nth: usize) -> Option<Cell<'a>> {
        let cell = self.bytes.get(self.place(nth)?..)?;
        let (length, used) = varint(cell)?;
        let rest = cell.get(used..)?;
        let (rowid, used) = varint(rest)?;
        let rest = rest.get(used..)?;
        let here = local(length, self.bytes.len());
        let (local, after) = rest.split_at_checked(here)?;
        let overflow = match length == here as u64 {
            true => 0,
            false => word(after)?,
        };
        Some(Cell {
            rowid: rowid.cast_signed(),
            length,
            local,
            overflow,
        })
    }
}

/// Bytes of a row of `length` that lie in its page, of which `usable` bytes can be used.
fn local(length: u64, usable: usize) -> usize {
    let most = usable.saturating_sub(35);
    match usize::try_from(length) {
        Ok(length) if length <= most => length,
        _ => {
            let least = (usable.saturating_sub(12) * 32 / 255).saturating_sub(23);
            let rest = length.saturating_sub(least as u64) % (usable as u64).saturating_sub(4);
            let some = least + usize::try_from(rest).unwrap_or(0);
            if some <= most { some } else { least }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn numbers_of_one_to_nine_bytes_are_read() {
        for (bytes, value) in [
            (&[0x7f][..], 127),
            (&[0x81, 0x00], 128),
            (&[0xff, 0xff, 0xff, 0x7f], (1 << 28) - 1),
            (&[0xff; 9], u64::MAX),
        ] {
            assert_eq!(varint(bytes), Some((value, bytes.len())));
            assert_eq!(varint(&bytes[..bytes.len() - 1]), None);
        }
    }

    #[test]
    fn what_a_page_says_of_its_cells_is_held_against_its_size() {
        let mut bytes = vec![0; 512];
        bytes[0] = 0x0d;
        bytes[4] = 1;
        bytes[8..10].copy_from_slice(&500_u16.to_be_bytes());
        bytes[500..506].copy_from_slice(&[3, 9, 2, 1, 7, 0]);
        let page = Page::of(2, &bytes).unwrap();
        let cell = page.cell(0).unwrap();
        assert_eq!((cell.rowid, cell.local), (9, &[2, 1, 7][..]));
        assert_eq!(page.cell(1), None);
        for place in [0_u16, 9, 511, 512] {
            bytes[8..10].copy_from_slice(&place.to_be_bytes());
            assert_eq!(Page::of(2, &bytes).unwrap().cell(0), None, "{place}");
        }
        bytes[3] = 1;
        assert!(Page::of(2, &bytes).is_err());
        bytes[0] = 0x0a;
        assert!(Page::of(2, &bytes).is_err());
    }
}
