//! The first lines of a table -> what its columns hold. Pure.
//!
//! Apart from the rows because here, once, it is decided and said what numbers mean: nothing of it is guessed in
//! silence, and what cannot be told ends with the flag that tells it.

mod candidates;
mod chosen;
mod header;
mod increments;
mod instants;
mod refusal;
mod roles;
mod sensor_log;
mod sensors;

use super::column::{Column, is_comment};
use super::preamble::Preamble;
use super::rows::{LOST, Table};
use crate::columns::{Columns, Delimiter, RowFilter, RowSelection};
use crate::columns::{Meant, Name, Quantity, Unit};
use crate::decode::{Options, Wanted};
use crate::text::printable;
use crate::text::without_mark;
use header::{File, header_in, names_in};
use roles::Roles;
use std::collections::BTreeMap;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::DELIMITER;

pub(crate) use header::{is_header, is_text_of_cells, may_be_table};

/// Lines, and bytes of them, in which the header is looked for.
pub(crate) const MOST_HEAD_LINES: usize = 200;
const MOST_HEAD: usize = 64 << 10;
/// Rows that are looked at before the first one is read.
const OPENING: usize = 24;
/// A line of more cells is no header.
const MOST_COLUMNS: usize = 1024;

/// A column's number, from 1.
fn number(column: &str) -> Option<usize> {
    let is_number = column.bytes().all(|b| b.is_ascii_digit());
    column.parse().ok().filter(|n| is_number && *n > 0)
}

/// The first lines of a table, as they come.
#[derive(Debug)]
pub(crate) struct Opening {
    given: Option<Columns>,
    delimiter: Option<Delimiter>,
    /// Rows that are read.
    filters: Vec<RowFilter>,
    /// Name of the file, without its ending.
    stem: String,
    wanted: Wanted,
    are_stamps_unread: bool,
    lines: Vec<Vec<u8>>,
    /// Number of times that a line followed itself, by its place.
    repeated: BTreeMap<usize, u64>,
    bytes: usize,
    found: Option<HeaderLine>,
    rows: usize,
}

/// A line that was looked at, once or several times the same.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct SampledLine {
    /// The number of the first, from 1.
    pub(crate) number: u64,
    pub(crate) line: Vec<u8>,
    pub(crate) times: u64,
}

/// Header that was found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct HeaderLine {
    /// Line of the header; of a table without one, its first row.
    at: usize,
    delimiter: Delimiter,
    is_header: bool,
    is_own: bool,
}

impl Opening {
    pub(crate) fn new(options: &Options, stem: &str) -> Opening {
        Opening {
            given: options.columns.clone(),
            delimiter: options.delimiter,
            filters: options.rows.clone(),
            stem: stem.to_owned(),
            wanted: options.wanted,
            are_stamps_unread: options.are_stamps_unread,
            lines: Vec::new(),
            repeated: BTreeMap::new(),
            bytes: 0,
            found: None,
            rows: 0,
        }
    }

    /// Takes the next line, blank ones too. Whether there must be more.
    pub(crate) fn take(&mut self, line: &[u8]) -> bool {
        let is_blank = line.iter().all(u8::is_ascii_whitespace);
        if self.found.is_some() && line.starts_with(LOST) {
            // A group of rows that is lost tells nothing of those that are not.
            match self.lines.last() {
                Some(last) if last == line => {
                    *self.repeated.entry(self.lines.len() - 1).or_default() += 1;
                }
                _ => self.lines.push(line.to_owned()),
            }
            return true;
        }
        self.bytes += line.len();
        if self.found.is_none() && !is_blank {
            self.found = self.header(line);
        } else if !is_blank {
            self.rows += 1;
        }
        self.lines.push(line.to_owned());
        match self.found {
            Some(found) => !found.is_own && self.rows < OPENING,
            None => self.lines.len() < MOST_HEAD_LINES && self.bytes < MOST_HEAD,
        }
    }

    /// Whether the header, or of a table without one the first row, was found.
    pub(crate) fn has_header(&self) -> bool {
        self.found.is_some()
    }

    /// Number of lines before it.
    pub(crate) fn before_header(&self) -> usize {
        self.found.map_or(self.lines.len(), |found| found.at)
    }

    fn header(&self, line: &[u8]) -> Option<HeaderLine> {
        let at = self.lines.len();
        let found = |at, delimiter, is_header, is_own| HeaderLine {
            at,
            delimiter,
            is_header,
            is_own,
        };
        if self.given.is_none() && self.delimiter.is_none() && Table::is_own_header(line) {
            return Some(found(at, Delimiter::Byte(b','), true, true));
        }
        let first = self.lines.first().map(Vec::as_slice);
        let file = File {
            stem: &self.stem,
            wanted: self.wanted,
            maker: Preamble::of(first.into_iter()).maker,
        };
        let named = header_in(line, self.delimiter, self.given.as_ref(), &file);
        if let Some(delimiter) = named {
            return Some(found(at, delimiter, true, false));
        }
        // Columns by number: the first line in which they are numbers, under a header or not.
        let numbers: Option<Vec<usize>> = self
            .given
            .iter()
            .flat_map(Columns::all)
            .flat_map(|given| &given.columns)
            .map(|column| number(column))
            .collect();
        let numbers = numbers.filter(|numbers| !numbers.is_empty())?;
        let tried = Delimiter::TRIED.iter().copied();
        let mut tried = self.delimiter.into_iter().chain(tried);
        let cells =
            |line: &[u8], delimiter: Delimiter| -> Vec<String> { text_cells(line, delimiter) };
        let delimiter = tried.find(|delimiter| {
            let cells = cells(line, *delimiter);
            numbers
                .iter()
                .all(|n| cells.get(n - 1).is_some_and(|cell| is_number(cell)))
        })?;
        let before = self.lines.last().map(|before| cells(before, delimiter));
        let is_under_header = before.is_some_and(|before| {
            before.len() == cells(line, delimiter).len()
                && !before.iter().any(|cell| is_number(cell))
        });
        Some(match is_under_header {
            true => found(at - 1, delimiter, true, false),
            false => found(at, delimiter, false, false),
        })
    }

    /// The table, and its rows so far with the numbers of their lines, from 1.
    ///
    /// # Errors
    /// What is missing or cannot be told, in words with their help.
    pub(crate) fn finish(self) -> Result<(Table, Vec<SampledLine>), Diagnostic> {
        let Some(found) = self.found else {
            return Err(self.nothing());
        };
        let line = self.lines.get(found.at).map_or(&[][..], Vec::as_slice);
        let first_row = found.at + usize::from(found.is_header);
        let mut behind = self.lines.iter().enumerate().skip(first_row);
        if found.is_own {
            let mut table = Table::own(line)?;
            table.selection = RowSelection::of(&self.filters, &table.names(), false)?;
            return Ok((table, numbered(behind, &self.repeated)));
        }
        let preamble = self.lines.iter().take(found.at).map(Vec::as_slice);
        let preamble = Preamble::of(preamble);
        let row = found.delimiter.row(without_mark(line));
        let mut names = match found.is_header {
            true => names_in(line, found.delimiter),
            false => numbers_as_names(found.delimiter.cells(row).count()),
        };
        let is_row = |line: &[u8]| {
            !line.iter().all(u8::is_ascii_whitespace) && !is_comment(line.trim_ascii())
        };
        let mut rows: Vec<Vec<String>> = self
            .lines
            .iter()
            .skip(first_row)
            .filter(|line| is_row(line))
            .map(|line| text_cells(line, found.delimiter))
            .collect();
        if !rows.iter().all(|row| why_lost(row).is_some()) {
            rows.retain(|row| why_lost(row).is_none());
        }
        // Rows of units, and of what else is said of columns (Shimmer), before the first numbers.
        let mut above = 0;
        while let Some(row) = rows.first().filter(|row| says_units(row, &names)) {
            for (name, cell) in names.iter_mut().zip(row) {
                name.add_unit(cell);
            }
            rows.remove(0);
            above += 1;
        }
        while above > 0 && behind.len() > 0 {
            let line = behind.next();
            above -= usize::from(line.is_some_and(|(_, line)| is_row(line)));
        }
        check_lengths(&rows, &names, found.delimiter)?;
        let selection = self.selected(&names, &mut rows)?;
        let header = if found.is_header { row } else { &[] };
        let roles = Roles {
            names: &names,
            rows: &rows,
            preamble: &preamble,
            given: self.given.as_ref(),
            stem: &self.stem,
            wanted: self.wanted,
            are_stamps_unread: self.are_stamps_unread,
        };
        let mut table = roles.table(header, found.delimiter)?;
        table.given = self.given;
        table.selection = selection;
        Ok((table, numbered(behind, &self.repeated)))
    }

    /// Rows that are read of a table with these columns; the first ones, by which it is told how, are those.
    ///
    /// # Errors
    /// A column that is not there.
    fn selected(
        &self,
        names: &[Name],
        first: &mut Vec<Vec<String>>,
    ) -> Result<RowSelection, Diagnostic> {
        let names: Vec<&str> = names.iter().map(|name| name.text.as_str()).collect();
        let selection = RowSelection::of(&self.filters, &names, self.wanted != Wanted::Rates)?;
        if first.iter().any(|row| selection.has(row)) {
            first.retain(|row| selection.has(row));
        }
        Ok(selection)
    }
}

/// Names of columns without a header: their numbers, from 1.
fn numbers_as_names(columns: usize) -> Vec<Name> {
    let name = |n: usize| Name {
        text: n.to_string(),
        meant: Meant::Nothing,
        unit: None,
    };
    (1..=columns).map(name).collect()
}

fn numbered<'l>(
    lines: impl Iterator<Item = (usize, &'l Vec<u8>)>,
    repeated: &BTreeMap<usize, u64>,
) -> Vec<SampledLine> {
    let mut before = 0;
    let held = |(at, line): (usize, &Vec<u8>)| {
        let again = repeated.get(&at).copied().unwrap_or(0);
        let number = at as u64 + 1 + before;
        before += again;
        SampledLine {
            number,
            line: line.clone(),
            times: 1 + again,
        }
    };
    lines.map(held).collect()
}

/// The cells of a row as text, for what is looked at only once.
fn text_cells(line: &[u8], delimiter: Delimiter) -> Vec<String> {
    let row = delimiter.row(without_mark(line));
    let cells = delimiter.cells(row).take(MOST_COLUMNS + 1);
    cells
        .map(|cell| String::from_utf8_lossy(cell.trim_ascii()).into_owned())
        .collect()
}

/// Whether a cell is a number, with a decimal point or comma.
fn is_number(cell: &str) -> bool {
    let is_part = |b: u8| b.is_ascii_digit() || b"+-.,eE".contains(&b);
    cell.bytes().any(|b| b.is_ascii_digit()) && cell.bytes().all(is_part)
}

/// Whether a row says what the columns above are measured in, or how they came to be.
fn says_units(row: &[String], names: &[Name]) -> bool {
    let of_roles = || {
        let cells = row.iter().zip(names);
        cells.filter(|(_, name)| name.quantity().is_some())
    };
    let is_word = |cell: &str| ["cal", "raw", "uncal"].contains(&cell.to_lowercase().as_str());
    let is_unit = |(cell, name): (&String, &Name)| {
        let quantity = name.quantity();
        is_word(cell) || quantity.is_some_and(|quantity| Unit::of(quantity, cell).is_some())
    };
    of_roles().any(is_unit) && !of_roles().any(|(cell, _)| is_number(cell))
}

/// Why a row was lost before it came here.
fn why_lost(row: &[String]) -> Option<&str> {
    row.first()?.strip_prefix("\0lost ")
}

/// All of the first rows are longer or shorter than the header: the one or the other is cut wrongly.
fn check_lengths(
    rows: &[Vec<String>],
    names: &[Name],
    delimiter: Delimiter,
) -> Result<(), Diagnostic> {
    let need = names.len();
    let fits = |row: &Vec<String>| {
        row.len() >= need && row.iter().skip(need).all(|cell| cell.trim().is_empty())
    };
    let Some(first) = rows.first() else {
        return Ok(());
    };
    if rows.iter().any(fits) {
        return Ok(());
    }
    if let Some(why) = why_lost(first) {
        return Err(format!("none of its first rows could be read: {}", printable(why)).into());
    }
    let what = format!("its rows have {} cells under {need} names", first.len());
    Err(match delimiter {
        Delimiter::Byte(b',') if first.len() + 2 > need * 2 => Diagnostic::new(format!(
            "{what}: decimal commas, and commas between the cells? What belongs together cannot be told"
        ))
        .help("export it with semicolons or tabs between the cells, or with decimal points"),
        _ => Diagnostic::new(what)
            .help(format!("{DELIMITER} says what stands between the cells")),
    })
}

impl Name {
    /// Quantity of which its unit is one.
    fn quantity(&self) -> Option<Quantity> {
        match &self.meant {
            Meant::Part { kind, .. } => kind.quantity(),
            Meant::Stamp | Meant::Step => Some(Quantity::Time),
            Meant::Temperature(_) => Some(Quantity::Temperature),
            Meant::Aside { .. }
            | Meant::Clock
            | Meant::Date
            | Meant::Counter
            | Meant::Sensor { .. }
            | Meant::Nothing => None,
        }
    }

    /// A row below the header says its unit.
    fn add_unit(&mut self, cell: &str) {
        if ["raw", "uncal"].contains(&cell.to_lowercase().as_str()) {
            if let Meant::Part { kind, .. } = self.meant {
                self.meant = Meant::Aside {
                    kind,
                    why: "is not calibrated",
                };
            }
            return;
        }
        if let Some(quantity) = self.quantity()
            && !cell.is_empty()
            && !cell.eq_ignore_ascii_case("cal")
        {
            self.unit = Some(Unit::of(quantity, cell).ok_or_else(|| printable(cell)));
        }
    }
}

/// The columns of a table with these roles.
fn columns(names: &[Name], of: &[(usize, Column)]) -> Vec<(Option<Column>, String)> {
    let column = |at: usize| of.iter().find(|(place, _)| *place == at);
    let each = names.iter().enumerate();
    each.map(|(at, name)| (column(at).map(|(_, column)| *column), name.text.clone()))
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::indexing_slicing)]
mod tests;
