//! Tables in Parquet, whoever wrote them -> the rows of a table as text. I/O.
//!
//! ```text
//! last bytes -> thrift -> footer -> columns that are read
//! pages      -> header -> unpack -> encoding -> column -> rows -> text, as of a CSV
//! ```
//!
//! A room of its own, and not another's crate, because those panic on damaged files: here no length, place or count is
//! believed before it is checked, a page costs at most 64 MiB, and one that cannot be read costs its own rows, which
//! are counted.

mod column;
mod encoding;
mod footer;
mod header;
mod rows;
mod thrift;
mod unpack;

pub(crate) use rows::Rows;
pub(crate) use rows::Trouble;

/// The four bytes at both ends.
pub(crate) const MAGIC: [u8; 4] = *b"PAR1";
