//! A Parquet file -> the rows of a table, as text. I/O: seeks and reads.
//!
//! A stage of its own, and text again, because what a column means, in which unit, and what is refused is decided for
//! rows of
//! text already: a table says the same whichever way it is stored. Numbers have the fewest digits that are their bits.

use super::MAGIC;
use super::column::{Column, read_at};
use super::footer::{Footer, Group, Leaf, Meaning, Stored};
use crate::columns::{Columns, Meant, Name, bits};
use crate::delimited::{LOST, is_own_column};
use std::fmt::{self, Write as _};
use std::io::{self, Read, Seek, Write as _};
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;

/// Bytes of a footer.
const MOST_FOOTER: u64 = 64 << 20;
/// Rows that a byte of the file may stand for, and those that any file may have: runs of one value cost nothing.
const ROWS_A_BYTE: u64 = 256;
const ROWS_OF_ANY: u64 = 1 << 20;
/// Bytes of pages and dictionaries that are held at once, of all columns.
const MOST_HELD: u64 = 512 << 20;
/// Rows whose numbers are written with digits: those by which columns are judged. The bits of the others are handed on
/// ([`bits`]).
const SPELLED: u64 = 64;
/// Bytes of text that are made at once.
const AHEAD: usize = 1 << 16;

/// Why a file is no table that is read.
#[derive(Debug)]
pub(crate) enum Trouble {
    /// Failure to read it.
    Read(io::Error),
    /// Refusal of its contents.
    Not(Diagnostic),
}

/// The rows of a Parquet file, as the bytes of a table.
pub struct Rows<S> {
    source: S,
    /// The place of each column, of those that are read.
    read: Vec<Option<Leaf>>,
    delimiter: u8,
    /// Text at the end of each row.
    behind: String,
    groups: std::vec::IntoIter<Group>,
    /// Offset of the footer.
    end: u64,
    now: Vec<Option<Column>>,
    left: u64,
    /// Rows so far, those that are lost left out, and how many of them are written with digits.
    rows: u64,
    spelled: u64,
    why: Option<Arc<str>>,
    text: Vec<u8>,
    given: usize,
}

impl<S> fmt::Debug for Rows<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Rows").finish_non_exhaustive()
    }
}

impl<S: Read + Seek> Rows<S> {
    /// Reads the footer; `given` is what the user says of columns.
    ///
    /// # Errors
    /// It cannot be read; it has no footer, or one that cannot be; it is encrypted.
    pub(crate) fn open(mut source: S, given: Option<&Columns>) -> Result<Rows<S>, Trouble> {
        let not = |what: String| Trouble::Not(Diagnostic::new(what));
        let length = source.seek(io::SeekFrom::End(0)).map_err(Trouble::Read)?;
        let last = read_at(&mut source, length.saturating_sub(8), 8).map_err(Trouble::Read)?;
        let (size, mark) = last.split_at_checked(4).unwrap_or_default();
        if mark == b"PARE" {
            return Err(not("an encrypted Parquet file".to_owned()));
        }
        if mark != MAGIC || length < 12 {
            let what = "a Parquet file that is cut, or was never closed: its index stands at its end, and without it nothing can be read";
            return Err(Trouble::Not(Diagnostic::new(what).help(
                "bring the whole file; MCAP is the form of which a cut file is read to the cut",
            )));
        }
        let size = size
            .iter()
            .rev()
            .fold(0u64, |sum, b| sum << 8 | u64::from(*b));
        if size > MOST_FOOTER || size > length - 12 {
            return Err(not(format!(
                "its index is said to have {size} bytes, of {length}"
            )));
        }
        let end = length - 8 - size;
        let footer = read_at(&mut source, end, size).map_err(Trouble::Read)?;
        let footer = Footer::parse(&footer).map_err(not)?;
        let rows = footer
            .groups
            .iter()
            .fold(0u64, |sum, g| sum.saturating_add(g.rows));
        if rows
            > length
                .saturating_mul(ROWS_A_BYTE)
                .saturating_add(ROWS_OF_ANY)
        {
            return Err(not(format!(
                "it is said to have {rows} rows, in {length} bytes"
            )));
        }
        let mut rows = Rows {
            source,
            read: Vec::new(),
            delimiter: if footer.is_own { b',' } else { b'\t' },
            behind: String::new(),
            groups: Vec::new().into_iter(),
            end,
            now: Vec::new(),
            left: 0,
            rows: 0,
            spelled: u64::MAX,
            why: None,
            text: Vec::new(),
            given: 0,
        };
        rows.name(&footer, given);
        rows.groups = footer.groups.into_iter();
        Ok(rows)
    }

    /// The same for whoever reads the numbers of all but the first rows by their bits.
    pub(crate) fn with_bits(self) -> Rows<S> {
        Rows {
            spelled: SPELLED,
            ..self
        }
    }

    /// The row of names, and which columns are read.
    fn name(&mut self, footer: &Footer, given: Option<&Columns>) {
        let names: Vec<Name> = footer
            .leaves
            .iter()
            .map(|l| Name::of(l.name.as_bytes()))
            .collect();
        let is_time = |leaf: &&Leaf| matches!(leaf.meaning, Meaning::Time(_)) && !leaf.is_repeated;
        let is_stamped = names.iter().any(|name| name.meant == Meant::Stamp);
        let is_given = |n: usize, said: &str| {
            let given = given.map(Columns::all).unwrap_or_default();
            let mut columns = given.iter().flat_map(|given| &given.columns);
            let number = (n + 1).to_string();
            columns.any(|column| *column == said || *column == number)
        };
        // An index of pandas has a name of its own.
        let only_time = match footer.leaves.iter().filter(is_time).count() {
            1 if !is_stamped => footer.leaves.iter().position(|leaf| is_time(&leaf)),
            _ => None,
        };
        let only_time = only_time.filter(|n| {
            let leaf = footer.leaves.get(*n);
            leaf.is_some_and(|leaf| !is_given(*n, &leaf.name))
        });
        let mut head = String::new();
        for (n, (leaf, name)) in footer.leaves.iter().zip(&names).enumerate() {
            let mut said = leaf.name.clone();
            if footer.is_own {
                said = match said.as_str() {
                    "stamp" => "stamp_ns".to_owned(),
                    "true_stamp" => "true_ns".to_owned(),
                    _ => said,
                };
            } else if let Meaning::Time(unit) = leaf.meaning {
                if only_time == Some(n) {
                    said = "stamp".to_owned();
                }
                if name.unit.is_none() {
                    let _ = write!(said, " [{unit}]");
                }
            }
            let is_wanted = match footer.is_own {
                true => is_own_column(&said),
                false => {
                    let by_name = !matches!(name.meant, Meant::Nothing | Meant::Aside { .. });
                    by_name
                        || leaf.name.len() == 1
                        || only_time == Some(n)
                        || is_given(n, &leaf.name)
                        || is_given(n, &said)
                }
            };
            let may_be_text = footer.is_own
                || matches!(
                    name.meant,
                    Meant::Stamp | Meant::Clock | Meant::Date | Meant::Sensor { .. }
                );
            let is_read = is_wanted && is_readable(leaf, may_be_text);
            self.read.push(is_read.then(|| leaf.clone()));
            if n > 0 {
                head.push(char::from(self.delimiter));
            }
            head.extend(said.chars().map(|c| match c {
                '"' => '\'',
                c if c.is_control() => ' ',
                c if c == char::from(self.delimiter) => ' ',
                c => c,
            }));
        }
        if footer.is_own {
            self.repeat(footer, &mut head);
        }
        head.push('\n');
        self.text = head.into_bytes();
    }

    /// Adds the column that a table of text of our own repeats in every row.
    fn repeat(&mut self, footer: &Footer, head: &mut String) {
        let has_samples = footer.leaves.iter().any(|leaf| leaf.name == "gyro_x");
        let (name, said) = match has_samples {
            true => (",sample_kind", &footer.sample_kind),
            false => (",world", &footer.world),
        };
        if let Some(said) = said {
            head.push_str(name);
            self.behind = format!(",{}", said.replace([',', '"'], " "));
        }
    }

    /// The next rows, until there is some text; none at the end.
    fn fill(&mut self) -> io::Result<()> {
        self.text.clear();
        self.given = 0;
        while self.text.len() < AHEAD {
            if self.left == 0 {
                let Some(group) = self.groups.next() else {
                    return Ok(());
                };
                self.begin(&group);
                continue;
            }
            self.turn()?;
            self.left -= 1;
            let begun = self.text.len();
            let mut lost = self.why.clone();
            let put = match self.rows < self.spelled {
                true => spell,
                false => bits::put,
            };
            for (n, column) in self.now.iter_mut().enumerate() {
                if n > 0 {
                    self.text.push(self.delimiter);
                }
                if let Some(column) = column {
                    let why = column.write(&mut self.text, put)?;
                    lost = lost.or(why);
                }
            }
            match lost {
                None => {
                    self.text.extend_from_slice(self.behind.as_bytes());
                    self.rows += 1;
                }
                Some(why) => {
                    self.text.truncate(begun);
                    self.text.extend_from_slice(LOST);
                    self.text.extend_from_slice(why.as_bytes());
                }
            }
            self.text.push(b'\n');
        }
        Ok(())
    }

    /// Brings every column to the page of the next row.
    fn turn(&mut self) -> io::Result<()> {
        let is_over = |column: &Option<Column>| column.as_ref().is_some_and(Column::is_over);
        while let Some(n) = self.now.iter().position(is_over) {
            let held: u64 = self.now.iter().flatten().map(Column::held).sum();
            if let Some(Some(column)) = self.now.get_mut(n) {
                column.turn(&mut self.source, MOST_HELD.saturating_sub(held))?;
            }
        }
        Ok(())
    }

    fn begin(&mut self, group: &Group) {
        self.left = group.rows;
        self.now.clear();
        self.why = None;
        if group.chunks.len() != self.read.len() {
            self.why = Some("a group of rows without all of its columns".into());
            self.left = group.stated_by_columns().min(group.rows);
            return;
        }
        for (leaf, chunk) in self.read.iter().zip(&group.chunks) {
            let why = match leaf {
                None => None,
                Some(_) if chunk.is_elsewhere => Some("is in another file, or encrypted"),
                Some(_) if chunk.values != group.rows => Some("has more or fewer values than rows"),
                Some(_)
                    if chunk.offset < MAGIC.len() as u64
                        || chunk.offset >= self.end
                        || chunk.length > self.end - chunk.offset =>
                {
                    Some("lies outside of the file")
                }
                Some(_) => None,
            };
            if let (Some(leaf), Some(why)) = (leaf, why) {
                let name = crate::text::printable(&leaf.name);
                self.why = self
                    .why
                    .take()
                    .or(Some(format!("column {name} {why}").into()));
            }
            let column = leaf
                .as_ref()
                .map(|leaf| Column::new(leaf, chunk, group.rows));
            self.now.push(column);
        }
        if self.why.is_some() {
            self.now.clear();
            // Who changes the one number changes not all: sixty rows said to be millions are no more than sixty.
            self.left = group.stated_by_columns().min(group.rows);
        }
    }
}

impl<S: Read + Seek> Read for Rows<S> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.given >= self.text.len() {
            self.fill()?;
        }
        let rest = self.text.get(self.given..).unwrap_or_default();
        let count = rest.len().min(into.len());
        if let (Some(to), Some(from)) = (into.get_mut(..count), rest.get(..count)) {
            to.copy_from_slice(from);
        }
        self.given += count;
        Ok(count)
    }
}

/// Appends a number with the fewest digits that are its bits.
fn spell(value: f64, out: &mut Vec<u8>) {
    // A vector takes all that is written.
    let _ = write!(out, "{value:e}");
}

/// Whether the values of a column can be read as numbers, or as text where it may hold text.
fn is_readable(leaf: &Leaf, may_be_text: bool) -> bool {
    let is_stored = match leaf.stored {
        Stored::Boolean | Stored::Fixed(_) => false,
        Stored::Bytes => may_be_text,
        _ => true,
    };
    is_stored && !leaf.is_repeated && leaf.meaning != Meaning::Other
}
