//! Names of a table's columns, the delimiter between them, and what a user states of them. Pure.
//!
//! Below the decoders, whose options hold it, and the tables, which are read by it.

pub(crate) mod bits;
mod cells;
mod given;
mod increments;
mod names;
mod rows;
mod temperatures;
mod units;

pub use cells::Delimiter;
pub use given::Columns;
pub(crate) use given::{Given, Role};
pub(crate) use names::{Kind, Meant, Name, words};
pub use rows::RowFilter;
pub(crate) use rows::RowSelection;
pub(crate) use units::{DAY, Quantity, Unit};
