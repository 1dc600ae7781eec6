//! Delimited text -> samples, whoever wrote it. Pure.
//!
//! ```text
//! first lines -> preamble, header -> names, units -> layout -> table
//! row         -> cells            -> table        -> RawSample
//! ```
//!
//! A stage of its own because a table has no names but those of its first rows, and everybody calls them otherwise:
//! what each column holds, in which unit, is decided once, from the names and the first rows, and said; what cannot be
//! told is refused with the flag that says it ([`Columns`]).

mod clock;
mod column;
mod layout;
mod own;
mod preamble;
mod rows;
mod time_of_day;

pub use crate::columns::{Columns, Delimiter, RowFilter};
pub use rows::Table;

#[cfg(feature = "parquet")]
pub(crate) use own::is_own_column;
#[cfg(feature = "parquet")]
pub(crate) use rows::LOST;

pub(crate) use layout::{
    MOST_HEAD_LINES, Opening, SampledLine, is_header, is_text_of_cells, may_be_table,
};
