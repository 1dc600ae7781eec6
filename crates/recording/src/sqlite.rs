//! An SQLite database, whole or damaged -> the rows of its tables. Pure: who has the bytes is [`Pages`].
//!
//! A stage of its own because a recorder that is killed leaves a database SQLite itself may refuse, and stops reading
//! at
//! the first bad page of. Here each page is looked at once, whatever the others say of it; what cannot be read costs
//! its own rows, and is told.
//!
//! ```text
//! pages -> header (sizes) -> page (cells) -> tree (leaves in order) -> table (rows) -> row (values)
//!          wal (pages that are committed, and not yet in the file)    definition (names of columns)
//! ```
//!
//! Nothing is written, no index is used, and no statement is understood but the names of columns.
//!
//! Layouts: <https://www.sqlite.org/fileformat2.html>.

mod definition;
mod header;
mod page;
mod row;
mod seen;
mod table;
mod tree;
pub(crate) mod wal;

pub(crate) use definition::{Definition, definitions};
pub(crate) use header::{Encoding, HEADER, Header};
pub(crate) use page::{Kind, Page};
pub(crate) use row::{Row, Value};
pub(crate) use seen::Seen;
pub(crate) use table::{Table, TableItem};
pub(crate) use tree::TWICE;

/// The first bytes of a database.
pub(crate) const MAGIC: [u8; 16] = *b"SQLite format 3\0";

use std::io;

/// Pages of a database, numbered from 1.
pub(crate) trait Pages {
    /// The greatest number of one that is there.
    fn count(&self) -> u32;

    /// The next that is there behind this number: not every number up to [`Pages::count`] is.
    fn following(&self, number: u32) -> Option<u32>;

    /// Copies a page, without the bytes reserved at its end, in place of what is in `into`; whether it is there as a
    /// whole.
    ///
    /// # Errors
    /// Only when the input itself cannot be read.
    fn page(&mut self, number: u32, into: &mut Vec<u8>) -> io::Result<bool>;
}
