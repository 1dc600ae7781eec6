//! A column that names the sensor of a row -> whose samples a row holds. Pure.
//!
//! Apart from the other roles because a name alone does not tell: `id` is the sensor in one table and the number of the
//! row in another, and which it is shows in the first rows. Two bodies in one table are never mixed.

use super::super::column::Column;
use super::candidates::place;
use super::roles::{RoleColumns, Roles};
use crate::columns::{Meant, Role};
use std::collections::BTreeSet;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::COLUMNS;

/// Columns that name the sensor of a row.
#[derive(Default)]
pub(super) struct Whose {
    pub(super) columns: Vec<usize>,
    /// The sensor of all first rows: its samples are named as those of a table of one.
    pub(super) usual: Option<String>,
    /// The `--columns` that say the same.
    pub(super) said: Option<String>,
}

impl Whose {
    /// The columns with what they are.
    pub(super) fn placed(&self) -> impl Iterator<Item = (usize, Column)> + '_ {
        self.columns.iter().map(|at| (*at, Column::Id))
    }
}

/// Contents of one column in the first rows.
struct Values {
    distinct: usize,
    rows: usize,
    /// A value comes again after another one.
    is_interleaved: bool,
    /// All are whole numbers.
    is_counted: bool,
    /// One is a number with a fraction: that is a measurement.
    is_measured: bool,
}

impl Roles<'_> {
    /// Finds the columns that name the sensor of a row; `rate` are those of its rate.
    ///
    /// # Errors
    /// A column that is given and not there.
    pub(super) fn whose(&self, rate: Option<&RoleColumns>) -> Result<Whose, Diagnostic> {
        if let Some(given) = self.given_of(Role::Sensor) {
            let places = given.columns.iter().map(|name| place(self.names, name));
            let columns: Result<Vec<usize>, String> = places.collect();
            let columns = columns.map_err(|why| format!("{COLUMNS} sensor: {why}"))?;
            return Ok(Whose {
                said: Some(match columns.first() {
                    Some(at) => format!("sensor={}", self.reference(*at)),
                    None => "sensor=none".to_owned(),
                }),
                columns,
                usual: None,
            });
        }
        let Some(rate) = rate else {
            return Ok(Whose::default());
        };
        let mut columns = Vec::new();
        let mut varies = false;
        for (at, name) in self.names.iter().enumerate() {
            let Meant::Sensor { is_clear } = name.meant else {
                continue;
            };
            let values = self.values(at, rate);
            // A running number, or one of batches, names no sensor.
            let is_many = values.distinct * 2 > values.rows;
            let is_counter = values.is_counted && !values.is_interleaved;
            let is_other = values.is_measured || values.distinct == 0;
            let is_taken = match values.distinct {
                1 => is_clear,
                _ => !is_many && (is_clear || !is_counter),
            };
            if is_taken && !is_other {
                columns.push(at);
                varies |= values.distinct > 1;
            }
        }
        let usual = self
            .rows
            .iter()
            .find(|row| self.has_rate(row, rate))
            .filter(|_| !varies && !columns.is_empty())
            .map(|row| {
                let cells: Vec<&str> = columns
                    .iter()
                    .filter_map(|at| row.get(*at).map(String::as_str))
                    .collect();
                cells.join("/")
            });
        let said = match columns.as_slice() {
            [one] if varies => Some(format!("sensor={}", self.reference(*one))),
            _ => None,
        };
        Ok(Whose {
            columns,
            usual,
            said,
        })
    }

    fn has_rate(&self, row: &[String], rate: &RoleColumns) -> bool {
        let is_filled = |at: &usize| row.get(*at).is_some_and(|cell| !cell.is_empty());
        rate.columns.iter().all(is_filled)
    }

    /// Values of a column in those of the first rows that hold a rate: of others it may name the kind of a row.
    fn values(&self, at: usize, rate: &RoleColumns) -> Values {
        let rows = self.rows.iter().filter(|row| self.has_rate(row, rate));
        let cells: Vec<&str> = rows
            .filter_map(|row| row.get(at))
            .map(String::as_str)
            .filter(|cell| !cell.is_empty())
            .collect();
        let mut seen = BTreeSet::new();
        let mut before = "";
        let mut is_interleaved = false;
        for cell in &cells {
            is_interleaved |= !seen.insert(*cell) && *cell != before;
            before = cell;
        }
        let is_whole = |cell: &&str| cell.bytes().all(|b| b.is_ascii_digit());
        let is_fraction = |cell: &&str| cell.contains(['.', ',']) && super::is_number(cell);
        Values {
            distinct: seen.len(),
            rows: cells.len(),
            is_interleaved,
            is_counted: cells.iter().all(is_whole),
            is_measured: cells.iter().any(is_fraction),
        }
    }
}
