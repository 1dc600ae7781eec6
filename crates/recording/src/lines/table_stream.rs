//! Lines that come one by one -> a table once its header is known, and then its rows. Pure, sans-I/O.
//!
//! Apart from [`Lines`](super::Lines) because a connection brings lines when it likes: nothing is waited for here. Which
//! columns there are is decided as of a file, by the same first rows ([`Opening`]), so a table over a socket gives the
//! samples of the file. Until then at most [`MOST_HEAD_LINES`] lines and [`MOST_HELD`] bytes are held.

use crate::decode::{Line, Options, Undecodable};
use crate::delimited::{MOST_HEAD_LINES, Opening, Table};
use crate::text::snippet;
use std::collections::VecDeque;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_attitude::setting::COLUMNS;

/// Bytes of lines that are held until the columns are known.
const MOST_HELD: usize = 64 << 10;
/// Rows of numbers in a row after which no header is waited for.
const MOST_NUMBERS: usize = 24;
/// First lines that an error shows.
const SHOWN: usize = 3;

/// Row that was held, with its number and its time of arrival.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct HeldRow {
    /// Number of its line.
    pub number: u64,
    /// Time at which it was received.
    pub received: Nanos,
    /// Row itself.
    pub line: Vec<u8>,
}

/// Lines of a connection, read as a table of which the header may yet come.
#[derive(Debug)]
pub struct TableStream {
    state: State,
    /// Number and arrival of each line that the opening holds.
    places: VecDeque<(u64, Nanos)>,
    /// First lines, as an error shows them.
    first: Vec<String>,
    bytes: usize,
    /// Rows of numbers since the last line that is none.
    numbers: usize,
    /// Whether the first line may be the rest of one: the bytes are joined midway.
    is_midway: bool,
}

#[derive(Debug)]
enum State {
    /// Header or first rows that are looked for.
    Opening(Box<Opening>),
    /// Table whose columns are known.
    Rows(Box<Table>),
}

impl TableStream {
    /// Makes one at the start of a connection; `is_midway` if its bytes may begin within a line.
    #[must_use]
    pub fn new(options: &Options, is_midway: bool) -> TableStream {
        TableStream {
            state: State::Opening(Box::new(Opening::new(options, ""))),
            places: VecDeque::new(),
            first: Vec::new(),
            bytes: 0,
            numbers: 0,
            is_midway,
        }
    }

    /// The table, once its columns are known.
    #[must_use]
    pub fn table(&self) -> Option<&Table> {
        match &self.state {
            State::Opening(_) => None,
            State::Rows(table) => Some(table),
        }
    }

    /// Whether a header was found.
    #[must_use]
    pub fn has_header(&self) -> bool {
        match &self.state {
            State::Opening(opening) => opening.has_header(),
            State::Rows(_) => true,
        }
    }

    /// Number of lines so far that are no rows: those before the header.
    #[must_use]
    pub fn skipped(&self) -> u64 {
        match &self.state {
            State::Opening(opening) => opening.before_header() as u64,
            State::Rows(_) => 0,
        }
    }

    /// Notes for the reader of its rows: how they are read first.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let Some(table) = self.table() else {
            return Vec::new();
        };
        let read_as = match table.assumed() {
            "" => "rows as strapd writes them".to_owned(),
            assumed => format!("rows read as {COLUMNS} '{assumed}'"),
        };
        let notes = table.notes().iter().cloned();
        std::iter::once(read_as).chain(notes).collect()
    }

    /// Warning to give if nobody states the unit of its rates.
    #[must_use]
    pub fn doubt_of_unit(&self) -> Option<String> {
        self.table().and_then(Table::doubt_of_unit)
    }

    /// Beginnings of the first lines, for an error.
    #[must_use]
    pub fn shown(&self) -> String {
        self.first.join("`, `")
    }

    /// Takes a line while the columns are not known. Returns the rows so far, and how many lines before them were
    /// skipped, once they are.
    ///
    /// # Errors
    /// The lines are of no table, or of one whose columns cannot be told.
    pub fn push(
        &mut self,
        number: u64,
        received: Nanos,
        line: &[u8],
    ) -> Result<Option<(Vec<HeldRow>, u64)>, Diagnostic> {
        let State::Opening(opening) = &mut self.state else {
            return Ok(None);
        };
        if self.first.len() < SHOWN {
            self.first.push(snippet(line));
        }
        // Noise of a line that was not yet there, or of another rate, is neither header nor row.
        let is_text = !line.iter().any(|b| *b < b' ' && *b != b'\t');
        let is_rest = std::mem::take(&mut self.is_midway) && has_number(line);
        let line: &[u8] = if is_text && !is_rest { line } else { b"#" };
        self.bytes = self.bytes.saturating_add(line.len());
        self.numbers = match is_row_of_numbers(line) {
            true => self.numbers + 1,
            false => 0,
        };
        self.places.push_back((number, received));
        let wants_more = opening.take(line);
        let is_found = opening.has_header();
        if wants_more && !is_found && self.numbers >= MOST_NUMBERS {
            return Err(headless(line));
        }
        if wants_more && self.bytes < MOST_HELD && self.places.len() < 2 * MOST_HEAD_LINES {
            return Ok(None);
        }
        self.open().map(Some)
    }

    /// Ends the wait for more rows. Returns those so far, as [`TableStream::push`]; none where no header came.
    ///
    /// # Errors
    /// As [`TableStream::push`].
    pub fn finish(&mut self) -> Result<Option<(Vec<HeldRow>, u64)>, Diagnostic> {
        match &self.state {
            State::Opening(opening) if opening.has_header() => self.open().map(Some),
            _ => Ok(None),
        }
    }

    fn open(&mut self) -> Result<(Vec<HeldRow>, u64), Diagnostic> {
        let State::Opening(opening) = &mut self.state else {
            return Ok((Vec::new(), 0));
        };
        let skipped = opening.before_header() as u64;
        let opening = std::mem::replace(opening.as_mut(), Opening::new(&Options::default(), ""));
        let (table, rows) = opening.finish()?;
        let places = std::mem::take(&mut self.places);
        let place = |number: u64| {
            let at = usize::try_from(number).unwrap_or(usize::MAX);
            places.get(at.saturating_sub(1)).copied()
        };
        let held = rows.into_iter().filter_map(|row| {
            let (number, received) = place(row.number)?;
            Some(HeldRow {
                number,
                received,
                line: row.line,
            })
        });
        let held = held.collect();
        self.state = State::Rows(Box::new(table));
        Ok((held, skipped))
    }

    /// Reads a row, and pushes its sample, received at `received`.
    ///
    /// # Errors
    /// As [`Table::decode`]; columns that are not known.
    pub fn decode(
        &mut self,
        line: &[u8],
        received: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<Line, Undecodable> {
        let State::Rows(table) = &mut self.state else {
            return Err(Undecodable::OtherTable);
        };
        let before = out.len();
        let read = table.decode(line, out)?;
        for sample in out.iter_mut().skip(before) {
            (sample.log, sample.publish) = (received, received);
        }
        Ok(read)
    }
}

fn cells(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let cells = line.split(|b| b",;\t| ".contains(b));
    cells
        .map(<[u8]>::trim_ascii)
        .filter(|cell| !cell.is_empty())
}

fn is_number(cell: &[u8]) -> bool {
    std::str::from_utf8(cell).is_ok_and(|text| text.parse::<f64>().is_ok())
}

fn has_number(line: &[u8]) -> bool {
    cells(line).any(is_number)
}

fn is_row_of_numbers(line: &[u8]) -> bool {
    cells(line).take(3).count() == 3 && cells(line).all(is_number)
}

/// Refusal of rows that no header came before.
fn headless(line: &[u8]) -> Diagnostic {
    Diagnostic::new(format!(
        "rows of {} numbers without a header: what they are cannot be told (`{}`)",
        cells(line).count(),
        snippet(line)
    ))
    .help(format!(
        "{COLUMNS} gyro=5:6:7:deg/s,accel=2:3:4,stamp=1:ms names them by number; or send a header line first"
    ))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const HEADER: &str = "ms,ax,ay,az,gx (deg/s),gy (deg/s),gz (deg/s)";

    fn rows(n: u64) -> Vec<String> {
        (0..n)
            .map(|i| format!("{},0,0,9.81,{i},0,0.5", 10 * i))
            .collect()
    }

    fn stream(columns: &str, is_midway: bool) -> TableStream {
        let options = Options {
            columns: (!columns.is_empty()).then(|| columns.parse().unwrap()),
            ..Options::default()
        };
        TableStream::new(&options, is_midway)
    }

    /// Lines pushed one by one: the samples, and the number of the line of each.
    fn read(stream: &mut TableStream, lines: &[String]) -> Result<Vec<(u64, RawSample)>, String> {
        let (mut out, mut all) = (Vec::new(), Vec::new());
        let mut one = |stream: &mut TableStream, row: &HeldRow| {
            out.clear();
            let _ = stream.decode(&row.line, row.received, &mut out);
            all.extend(out.iter().map(|raw| (row.number, *raw)));
        };
        for (number, line) in (1..).zip(lines) {
            let received = Nanos(number as i64);
            let row = HeldRow {
                number,
                received,
                line: line.clone().into_bytes(),
            };
            if stream.table().is_some() {
                one(stream, &row);
                continue;
            }
            let opened = stream.push(number, received, line.as_bytes());
            let opened = opened.map_err(|why| why.to_string())?;
            opened
                .iter()
                .flat_map(|(rows, _)| rows)
                .for_each(|row| one(stream, row));
        }
        let opened = stream.finish().map_err(|why| why.to_string())?;
        opened
            .iter()
            .flat_map(|(rows, _)| rows)
            .for_each(|row| one(stream, row));
        Ok(all)
    }

    #[test]
    fn rows_before_and_behind_the_decision_keep_their_number_and_their_arrival() {
        let boot = ["rst:0x1 (POWERON_RESET)", "ets Jun  8 2016", ".01,9.8"].map(String::from);
        let lines = [&boot[..], &[HEADER.to_owned()], &rows(100)].concat();
        let mut of = stream("", false);
        let read = read(&mut of, &lines).unwrap();
        assert_eq!(read.len(), 100);
        for (n, (number, raw)) in read.iter().enumerate() {
            assert_eq!((*number, raw.log), (n as u64 + 5, Nanos(n as i64 + 5)));
            assert_eq!(raw.header, Some(Nanos(n as i64 * 10_000_000)));
        }
        let few = [&[HEADER.to_owned()][..], &rows(3)].concat();
        assert_eq!(
            super::tests::read(&mut stream("", false), &few)
                .unwrap()
                .len(),
            3
        );
    }

    #[test]
    fn columns_by_number_need_no_header_and_half_a_first_line_is_no_row() {
        let columns = "gyro=5:6:7:deg/s,accel=2:3:4,stamp=1:ms";
        let lines = [&["90,0,0,9.81,1,0,0.5".to_owned()][..], &rows(40)].concat();
        let all = read(&mut stream(columns, false), &lines).unwrap();
        let midway = read(&mut stream(columns, true), &lines).unwrap();
        assert_eq!((all.len(), midway.len()), (41, 40));
        assert_eq!(midway[..], all[1..]);
    }

    #[test]
    fn what_is_no_table_ends_soon_with_what_it_looked_like() {
        let why = read(&mut stream("", false), &rows(1000)).unwrap_err();
        assert!(
            why.contains("7 numbers") && why.contains("0,0,9.81"),
            "{why}"
        );
        let garbage: Vec<String> = (0..100_000)
            .map(|n| format!("x{n} \u{fffd}\u{1}"))
            .collect();
        let mut of = stream("", false);
        assert!(read(&mut of, &garbage).is_err());
        assert!(of.shown().starts_with("x0 "), "{}", of.shown());
        assert!(of.places.len() <= MOST_HEAD_LINES);
    }

    #[test]
    fn little_is_held_whatever_comes_behind_a_header() {
        let long = format!("1,{}", "9".repeat(60_000));
        let mut of = stream("", false);
        let lines = [HEADER.to_owned(), long.clone(), long.clone(), long];
        let held = (1..)
            .zip(&lines)
            .find_map(|(n, line)| of.push(n, Nanos(0), line.as_bytes()).transpose());
        assert!(held.is_some(), "decided before the fourth");
    }
}
