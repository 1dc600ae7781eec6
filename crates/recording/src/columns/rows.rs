//! `--where device=left` -> the rows of a table that are read. Pure.
//!
//! Apart from the roles of columns because it says nothing of what they mean: rows of another value are left out and
//! counted.

use super::bits;
use super::cells::Delimiter;
use crate::text::{named_few, printable};
use std::collections::BTreeSet;
use std::str::FromStr;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::WHERE;

/// Values of a column that are remembered to be named.
const NAMED: usize = 16;

/// Column of a table and the value that rows must have in it to be read.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RowFilter {
    /// Name of the column, or its number from 1.
    pub column: String,
    /// Value, as it stands in the cell; numbers are compared as numbers.
    pub value: String,
}

impl FromStr for RowFilter {
    type Err = String;

    fn from_str(text: &str) -> Result<RowFilter, String> {
        match text.split_once('=') {
            Some((column, value)) if !column.trim().is_empty() => Ok(RowFilter {
                column: column.trim().to_owned(),
                value: value.trim().to_owned(),
            }),
            _ => Err(format!(
                "`{}` is no COLUMN=VALUE; for example device=left",
                printable(text)
            )),
        }
    }
}

/// Column by which rows are selected.
#[derive(Clone, PartialEq, Debug)]
struct Selector {
    place: usize,
    name: String,
    /// Values of which a row must have one.
    values: Vec<String>,
    /// Other values, the first few.
    others: BTreeSet<String>,
}

/// Selection of the rows of one table.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct RowSelection {
    selectors: Vec<Selector>,
    kept: u64,
    left_out: u64,
}

impl RowSelection {
    /// Makes that of a table with columns of these names; where it `is_beside` the samples, a column that it has not is
    /// no error.
    ///
    /// # Errors
    /// A column that is not there, with those that are.
    pub(crate) fn of(
        filters: &[RowFilter],
        names: &[&str],
        is_beside: bool,
    ) -> Result<RowSelection, Diagnostic> {
        let mut selectors: Vec<Selector> = Vec::new();
        for filter in filters {
            let Some(place) = place(names, &filter.column) else {
                if is_beside {
                    continue;
                }
                let shown: Vec<String> = names.iter().map(|name| printable(name)).collect();
                return Err(Diagnostic::new(format!(
                    "{WHERE}: there is no column `{}`",
                    printable(&filter.column)
                ))
                .help(format!("the columns are {}", named_few(&shown))));
            };
            match selectors.iter_mut().find(|of| of.place == place) {
                Some(known) => known.values.push(filter.value.clone()),
                None => selectors.push(Selector {
                    place,
                    name: names.get(place).map_or_else(String::new, |n| printable(n)),
                    values: vec![filter.value.clone()],
                    others: BTreeSet::new(),
                }),
            }
        }
        Ok(RowSelection {
            selectors,
            ..RowSelection::default()
        })
    }

    /// Whether a row of these cells is read; nothing is counted.
    pub(crate) fn has(&self, row: &[String]) -> bool {
        self.selectors.iter().all(|of| {
            let cell = row.get(of.place);
            cell.is_none_or(|cell| of.has(cell.trim()))
        })
    }

    /// Whether a row is read; counted. A row that is too short is, so that it is counted as such.
    pub(crate) fn takes(&mut self, row: &[u8], delimiter: Delimiter) -> bool {
        if self.selectors.is_empty() {
            return true;
        }
        let mut is_taken = true;
        for of in &mut self.selectors {
            let Some(cell) = delimiter.cells(row).nth(of.place) else {
                continue;
            };
            let cell = bits::spelled(cell.trim_ascii());
            let cell = String::from_utf8_lossy(&cell);
            if !of.has(&cell) {
                is_taken = false;
                if of.others.len() < NAMED && !of.others.contains(cell.as_ref()) {
                    of.others.insert(cell.into_owned());
                }
            }
        }
        let count = match is_taken {
            true => &mut self.kept,
            false => &mut self.left_out,
        };
        *count += 1;
        is_taken
    }

    /// Number of rows that were left out.
    pub(crate) fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Note about the rows that were left out; `None` where none was.
    pub(crate) fn note(&self) -> Option<String> {
        let rows = self.kept + self.left_out;
        (self.left_out > 0).then(|| {
            format!(
                "{} of {rows} rows were left out by {WHERE} {}: they have {}",
                self.left_out,
                self.stated(),
                self.values()
            )
        })
    }

    /// Refusal where no row was read at all.
    pub(crate) fn nothing(&self) -> Option<Diagnostic> {
        (self.kept == 0 && self.left_out > 0).then(|| {
            let what = format!(
                "none of {} rows is selected by {WHERE} {}",
                self.left_out,
                self.stated()
            );
            Diagnostic::new(what).help(format!("they have {}", self.values()))
        })
    }

    fn stated(&self) -> String {
        let each = self.selectors.iter().flat_map(|of| {
            let value = |value: &String| format!("{}={}", of.name, printable(value));
            of.values.iter().map(value)
        });
        each.collect::<Vec<String>>().join(&format!(" {WHERE} "))
    }

    fn values(&self) -> String {
        let each = self.selectors.iter().filter(|of| !of.others.is_empty());
        let each = each.map(|of| {
            let others: Vec<String> = of.others.iter().map(|value| printable(value)).collect();
            format!("{} {}", of.name, named_few(&others))
        });
        each.collect::<Vec<String>>().join(", ")
    }
}

impl Selector {
    fn has(&self, cell: &str) -> bool {
        let number = |text: &str| text.parse::<f64>().ok();
        let is_same = |value: &String| {
            value == cell
                || number(value).is_some_and(|value| number(cell).is_some_and(|cell| cell == value))
        };
        self.values.iter().any(is_same)
    }
}

/// Place of a column by its name, in any case, or its number from 1.
fn place(names: &[&str], column: &str) -> Option<usize> {
    let by_name = |is: &dyn Fn(&str) -> bool| names.iter().position(|name| is(name.trim()));
    by_name(&|name| name == column)
        .or_else(|| by_name(&|name| name.eq_ignore_ascii_case(column)))
        .or_else(|| {
            let number: usize = column.parse().ok()?;
            number.checked_sub(1).filter(|place| *place < names.len())
        })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn selected(filters: &[&str]) -> Result<RowSelection, Diagnostic> {
        let filters: Vec<RowFilter> = filters.iter().map(|f| f.parse().unwrap()).collect();
        RowSelection::of(&filters, &["time", "device", "I"], false)
    }

    #[test]
    fn rows_of_another_value_are_left_out_and_counted() {
        let mut of = selected(&["device=left", "i=1", "3=2"]).unwrap();
        let rows = ["0,left,1", "0,left,2.0", "0,left,3", "0,right,1", "0"];
        let comma = Delimiter::Byte(b',');
        let taken = rows.map(|row| of.takes(row.as_bytes(), comma));
        assert_eq!(taken, [true, true, false, false, true]);
        let note = of.note().unwrap();
        assert!(
            note.contains("2 of 5 rows") && note.contains("they have device right"),
            "{note}"
        );
        assert_eq!(of.nothing(), None);
    }

    #[test]
    fn a_column_that_is_not_there_and_a_value_that_no_row_has_are_named_with_what_is() {
        let why = selected(&["mac=1"]).unwrap_err().to_string();
        assert!(
            why.contains("`mac`") && why.contains("time, device, I"),
            "{why}"
        );
        let mut of = selected(&["device=top"]).unwrap();
        assert!(!of.takes(b"0,left,1", Delimiter::Byte(b',')));
        let why = of.nothing().unwrap().to_string();
        assert!(why.contains("device=top") && why.contains("left"), "{why}");
        for text in ["device", "=left", ""] {
            assert!(text.parse::<RowFilter>().is_err(), "{text}");
        }
    }
}
