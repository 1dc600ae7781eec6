//! The first lines of a table -> what its columns hold. Pure.
//!
//! Apart from the rows because here, once, it is decided and said what numbers mean: nothing of it is guessed in
//! silence, and what cannot be told ends with the flag that tells it.

mod increments;
mod instants;
mod roles;
mod sensor_log;
mod sensors;

use super::column::{Column, is_comment};
use super::preamble::{Maker, Preamble};
use super::rows::{LOST, Table};
use crate::columns::Delimiter;
use crate::columns::{Columns, Role, RowFilter, RowSelection};
use crate::columns::{Kind, Meant, Name};
use crate::columns::{Quantity, Unit};
use crate::decode::{Options, Wanted};
use crate::text::printable;
use crate::text::without_mark;
use roles::Roles;
use std::collections::BTreeMap;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::{COLUMNS, DELIMITER};

/// Lines, and bytes of them, in which the header is looked for.
pub(crate) const MOST_HEAD_LINES: usize = 200;
const MOST_HEAD: usize = 64 << 10;
/// Rows that are looked at before the first one is read.
const OPENING: usize = 24;
/// A line of more cells is no header.
const MOST_COLUMNS: usize = 1024;
/// Names that an error repeats.
const MOST_SAID: usize = 16;

/// Whether a line names the columns of a table of rates or orientations.
pub(crate) fn is_header(line: &[u8], given: Option<&Columns>) -> bool {
    header_in(line, None, given, &File::default()).is_some()
}

/// Whether it is text of which some line has three cells or more, and no lines of objects.
pub(crate) fn is_text_of_cells(first: &[u8]) -> bool {
    let cells = |line: &[u8]| {
        let of = |separator: u8| line.iter().filter(|b| **b == separator).count();
        b"\t,;|".iter().map(|separator| of(*separator)).max()
    };
    let mut lines = without_mark(first).split(|b| *b == b'\n');
    may_be_table(first) && lines.any(|line| cells(line) >= Some(2))
}

/// Whether it is text without lines of objects: the header of a table may yet come.
pub(crate) fn may_be_table(first: &[u8]) -> bool {
    let text = without_mark(first);
    let binary = |b: &u8| *b < b' ' && !b"\t\r\n".contains(b);
    let is_object = |line: &[u8]| matches!(line.trim_ascii_start().first(), Some(b'{' | b'['));
    !text.is_empty() && !text.iter().any(binary) && !text.split(|b| *b == b'\n').any(is_object)
}

/// The names of a line, cut by this delimiter; none of what can be no header.
fn names_in(line: &[u8], delimiter: Delimiter) -> Vec<Name> {
    let row = delimiter.row(without_mark(line));
    let binary = |b: &u8| *b < b' ' && *b != b'\t';
    let is_object = row.windows(2).any(|pair| pair == b"\":");
    if is_object || row.iter().any(binary) {
        return Vec::new();
    }
    // Between blanks a mark of comments would be a cell.
    let row = match (delimiter, row) {
        (Delimiter::Blanks, [b'#' | b'%', rest @ ..] | [b'/', b'/', rest @ ..]) => {
            rest.trim_ascii_start()
        }
        _ => row,
    };
    let mut names: Vec<Name> = Vec::new();
    for cell in delimiter.cells(row) {
        if names.len() == MOST_COLUMNS {
            return Vec::new();
        }
        names.push(Name::of(&cell));
    }
    while names.last().is_some_and(|name| name.text.is_empty()) {
        names.pop();
    }
    names
}

/// Facts about a file before its header.
#[derive(Default)]
struct File<'f> {
    /// Name, without the ending.
    stem: &'f str,
    /// Purpose of its reading.
    wanted: Wanted,
    maker: Maker,
}

/// Delimiter by which a line is a header.
fn header_in(
    line: &[u8],
    delimiter: Option<Delimiter>,
    given: Option<&Columns>,
    file: &File<'_>,
) -> Option<Delimiter> {
    let tried = delimiter.as_slice();
    let tried = if tried.is_empty() {
        &Delimiter::TRIED
    } else {
        tried
    };
    tried.iter().copied().find(|delimiter| {
        let names = names_in(line, *delimiter);
        names.len() >= 3 && names_something(&names, given, file)
    })
}

/// Whether these names are those of a table of rates or orientations; of one beside such a table, of forces or fields.
fn names_something(names: &[Name], given: Option<&Columns>, file: &File<'_>) -> bool {
    let given = given.map(Columns::all).unwrap_or_default();
    let columns = || given.iter().flat_map(|given| &given.columns);
    // Numbers alone tell no header.
    if columns().next().is_some() && columns().all(|column| number(column).is_some()) {
        return false;
    }
    let are_there = columns().all(|column| roles::place(names, column).is_ok());
    let is_given = given.iter().any(|given| {
        matches!(
            given.role,
            Role::Of(Kind::Gyro | Kind::Turn | Kind::Orientation)
        ) && !given.columns.is_empty()
    });
    let kinds: &[Kind] = match file.wanted {
        Wanted::Rates => &[Kind::Gyro, Kind::Turn, Kind::Orientation, Kind::Matrix],
        Wanted::Forces | Wanted::Fields => &[Kind::Accel, Kind::Mag],
        Wanted::Temperatures => &[],
    };
    are_there
        && (is_given
            || roles::axes_of_maker(names, file.maker, Kind::Gyro).is_some()
            || kinds.iter().any(|kind| {
                !roles::candidates(names, *kind).is_empty()
                    || roles::bare_axes(names, file.stem, *kind).is_some()
            }))
}

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

    /// Refusal of a text without a header: what there is, and what would help.
    fn nothing(&self) -> Diagnostic {
        let start = self.lines.first().map_or(&[][..], Vec::as_slice);
        if self.lines.iter().flatten().any(|b| *b == 0) {
            return Diagnostic::new(
                "it holds bytes of zero: it is binary, or UTF-16 without its mark",
            )
            .help("iconv -f UTF-16LE -t UTF-8 FILE > log.csv, if it is text");
        }
        // The line with the most names.
        let texts = |names: &[Name]| names.iter().filter(|name| !is_number(&name.text)).count();
        let best = self
            .lines
            .iter()
            .filter_map(|line| {
                let mut tried = self.delimiter.into_iter().chain(Delimiter::TRIED);
                tried.find_map(|delimiter| {
                    Some(names_in(line, delimiter)).filter(|names| names.len() >= 3)
                })
            })
            .filter(|names| texts(names) > 0)
            .max_by_key(|names| texts(names));
        let Some(names) = best else {
            return Diagnostic::new(format!(
                "none of its first lines has three cells that could name columns; it begins with `{}`",
                crate::text::snippet(start)
            ))
            .help(format!(
                "a first row with names such as time_s, gyro_x, gyro_y, gyro_z; or {COLUMNS} gyro=2:3:4,stamp=1:s by numbers, and {DELIMITER}"
            ));
        };
        let all: Vec<&str> = names.iter().map(|name| name.text.as_str()).collect();
        let said = all
            .get(..all.len().min(MOST_SAID))
            .unwrap_or(&all)
            .join("`, `");
        self.unnamed(&names, &all, &said)
    }

    /// Refusal of columns with names of which none is a rate; `all` are the names, `said` as many as are quoted.
    fn unnamed(&self, names: &[Name], all: &[&str], said: &str) -> Diagnostic {
        if let Some(given) = self.given.as_ref().map(Columns::all) {
            let wrong = given.iter().flat_map(|given| &given.columns);
            let wrong: Vec<String> = wrong
                .filter_map(|column| roles::place(names, column).err())
                .collect();
            if let Some(first) = wrong.first() {
                return format!("{COLUMNS}: {first}; its columns are `{said}`").into();
            }
        }
        let axes = ["x", "y", "z"];
        if axes
            .iter()
            .all(|axis| all.iter().any(|name| name.eq_ignore_ascii_case(axis)))
        {
            return Diagnostic::new(
                "its columns x, y, z do not say of which sensor they are (they are rates where the file is called Gyroscope... or AngularVelocity)",
            )
            .help(format!(
                "{COLUMNS} gyro=x:y:z if they are rates"
            ));
        }
        let aside = names.iter().find_map(|name| match name.meant {
            Meant::Aside {
                kind: Kind::Gyro,
                why,
            } => Some(format!("; `{}` {why}", name.text)),
            _ => None,
        });
        Diagnostic::new(format!(
            "none of its columns names a rate about x, y and z, or a quaternion: `{said}`{}",
            aside.unwrap_or_default()
        ))
        .help(format!(
            "{COLUMNS} gyro=NAME:NAME:NAME,stamp=NAME:UNIT says which they are (or numbers, from 1); of attitudes orientation=W:X:Y:Z"
        ))
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
