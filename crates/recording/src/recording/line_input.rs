//! Lines of JSON or rows of a table: opened, described, and what is wrong with them in words.

use super::payload_type::PayloadType;
use crate::decode::{Ambiguous, Options, Undecodable};
use crate::delimited::Table;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::lines::Lines;
use std::io::Read;
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::{COLUMNS, DELIMITER, FIELD, WHERE};

/// Begins to read lines or rows.
///
/// # Errors
/// They cannot be read; `--field` for a table, whose columns have names.
pub(super) fn open<R: Read>(
    path: &Path,
    format: Format,
    input: R,
    options: &Options,
) -> Result<Lines<R>> {
    if format.is_table() && !options.fields.is_empty() {
        return Err(Error::Unsupported {
            path: path.to_owned(),
            what: Diagnostic::new(format!("{FIELD} is for messages, and this is a table")).help(
                format!("{COLUMNS} gyro=NAME:NAME:NAME,stamp=NAME:UNIT says what its columns are"),
            ),
        });
    }
    if !format.is_table() {
        only_for_tables(path, format, options)?;
    }
    Lines::new(path, format, input, options)
}

/// Refuses `--columns`, `--delimiter` and `--where` for anything but a table.
///
/// # Errors
/// One of them is given.
pub(super) fn only_for_tables(path: &Path, format: Format, options: &Options) -> Result<()> {
    if options.columns.is_none() && options.delimiter.is_none() && options.rows.is_empty() {
        return Ok(());
    }
    Err(Error::Unsupported {
        path: path.to_owned(),
        what: Diagnostic::new(format!(
            "{COLUMNS}, {DELIMITER} and {WHERE} are for tables of text, and this is {}",
            format.name()
        ))
        .help(format!("{FIELD} says where values lie in messages")),
    })
}

/// Stamps whose unit cannot be told.
pub(super) fn unclear(path: &Path, what: &Ambiguous) -> Error {
    Error::Unsupported {
        path: path.to_owned(),
        what: Diagnostic::new(what.to_string()).help(format!(
            "{FIELD} stamp=NAME:ns (or us, ms, s) says it for a name as it is"
        )),
    }
}

/// Returns whether stamps that state their unit are held against their steps. Tables of other makers were,
/// by their first rows; a unit that the user states is believed.
pub(super) fn are_judged(lines: &Lines<impl Read>, options: &Options) -> bool {
    let is_stated = options.are_stamps_unread || options.states_stamp_unit();
    !is_stated && lines.table().is_none_or(Table::is_own)
}

/// Error for what begins with no line of samples.
pub(super) fn no_samples(path: &Path, lines: &Lines<impl Read>, why: &Undecodable) -> Error {
    let help = match lines.format() {
        format if format.is_table() => {
            format!(
                "one row per sample under a row of names, as strapd writes a CSV; {COLUMNS} says what they are"
            )
        }
        _ => "one JSON object per line, with gyro and stamp; or an MCAP".to_owned(),
    };
    Error::Unsupported {
        path: path.to_owned(),
        what: Diagnostic::new(format!("line {}: {why}", lines.number())).help(help),
    }
}

/// Error for a text without any rate, `or_else` something else that was looked for.
pub(super) fn no_rates(path: &Path, format: Format, or_else: &str) -> Error {
    let (line, help) = match format.is_table() {
        true => (
            "row",
            format!("columns gyro_x, gyro_y, gyro_z, in rad/s, or {COLUMNS} gyro=NAME:NAME:NAME"),
        ),
        false => (
            "line",
            format!(
                "{{\"class\":\"RATE\",\"stamp\":{{\"sec\":1,\"nsec\":0}},\"gyro\":[0.1,0,0]}}, or {FIELD} gyro=PATH"
            ),
        ),
    };
    Error::Unsupported {
        path: path.to_owned(),
        what: Diagnostic::new(format!("no {line} carries a body rate{or_else}")).help(help),
    }
}

/// Rows that are none before the first that is one: beyond, none follows. Of a table that is stored by columns a page
/// of lost rows.
const MOST_EARLY: usize = 1000;
const MOST_EARLY_BY_COLUMNS: usize = 1 << 18;

/// Whether what could not be read so far, before anything that could, may still be of a table: its header is known.
pub(super) fn is_sure(lines: &Lines<impl Read>, early: usize) -> bool {
    match lines.format() {
        Format::Parquet => early <= MOST_EARLY_BY_COLUMNS,
        _ => early <= MOST_EARLY && lines.table().is_some_and(|table| !table.is_own()),
    }
}

/// Text of how a table is read, so that it can be pasted and changed, with the format's name; of anything else that
/// alone.
pub(super) fn described(lines: &Lines<impl Read>) -> PayloadType {
    let besides = match lines.table().map(Table::assumed).unwrap_or_default() {
        "" => String::new(),
        assumed => format!("{COLUMNS} '{assumed}'"),
    };
    PayloadType::of_text(lines.format(), &besides)
}
