//! What the columns of a table are called, what stands between them, and what a user says of them. Pure.
//!
//! Below the decoders, whose options hold it, and the tables, which are read by it.

mod cells;
mod given;
mod increments;
mod names;
mod units;

pub use cells::Delimiter;
pub use given::Columns;
pub(crate) use given::{Given, Role};
pub(crate) use names::{Kind, Meant, Name};
pub(crate) use units::{Quantity, Unit};
