//! A line -> whether it names the columns of a table, and the delimiter by which it does. Pure.
//!
//! Apart from the layout because any line may be asked, of a text that is no table and of one within which another table
//! begins; nothing is decided here of what numbers mean.

use super::super::preamble::Maker;
use super::candidates::{axes_of_maker, bare_axes, candidates, place};
use super::{MOST_COLUMNS, number};
use crate::columns::{Columns, Delimiter, Kind, Name, Role};
use crate::decode::Wanted;
use crate::text::without_mark;

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
pub(super) fn names_in(line: &[u8], delimiter: Delimiter) -> Vec<Name> {
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
pub(super) struct File<'f> {
    /// Name, without the ending.
    pub(super) stem: &'f str,
    /// Purpose of its reading.
    pub(super) wanted: Wanted,
    pub(super) maker: Maker,
}

/// Delimiter by which a line is a header.
pub(super) fn header_in(
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
    let are_there = columns().all(|column| place(names, column).is_ok());
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
            || axes_of_maker(names, file.maker, Kind::Gyro).is_some()
            || kinds.iter().any(|kind| {
                !candidates(names, *kind).is_empty() || bare_axes(names, file.stem, *kind).is_some()
            }))
}
