//! Rows of the CSV that strapd writes -> samples and what each row says of itself. Pure.
//!
//! Apart from the lines of JSON because a row has no names of its own: the first one says what the others hold. Units and
//! axes are those of `strapd cat`: rad/s (delta angles in rad), m/s^2, x forward, y left, z up.

use crate::decode::{Class, GyroUnit, Line, MAX_LINE, Undecodable, exact_name};
use crate::format::without_mark;
use crate::text::{printable, snippet};
use std::borrow::Cow;
use strapd_attitude::record::{Nanos, RawSample, SampleKind};

/// What a column holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Column {
    Stamp,
    Log,
    Interval,
    Kind,
    Id,
    Gyro(usize),
    Accel(usize),
    Orientation(usize),
}

/// The columns that are read, by name. Those of a rate behind an attitude, and a quaternion's without their `q`, are in
/// tables of attitudes.
const COLUMNS: [(&str, Column); 23] = [
    ("stamp_ns", Column::Stamp),
    ("log_ns", Column::Log),
    // Of a synthetic gyro.
    ("true_ns", Column::Log),
    ("interval_ns", Column::Interval),
    ("sample_kind", Column::Kind),
    ("id", Column::Id),
    ("gyro_x", Column::Gyro(0)),
    ("gyro_y", Column::Gyro(1)),
    ("gyro_z", Column::Gyro(2)),
    ("wx", Column::Gyro(0)),
    ("wy", Column::Gyro(1)),
    ("wz", Column::Gyro(2)),
    ("accel_x", Column::Accel(0)),
    ("accel_y", Column::Accel(1)),
    ("accel_z", Column::Accel(2)),
    ("qw", Column::Orientation(0)),
    ("qx", Column::Orientation(1)),
    ("qy", Column::Orientation(2)),
    ("qz", Column::Orientation(3)),
    // As they were called at first.
    ("w", Column::Orientation(0)),
    ("x", Column::Orientation(1)),
    ("y", Column::Orientation(2)),
    ("z", Column::Orientation(3)),
];

/// Columns that make a table one of samples or of attitudes.
const GYRO: [Column; 3] = [Column::Gyro(0), Column::Gyro(1), Column::Gyro(2)];
const ORIENTATION: [Column; 4] = [
    Column::Orientation(0),
    Column::Orientation(1),
    Column::Orientation(2),
    Column::Orientation(3),
];

/// A table, by its first row.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Table {
    header: Vec<u8>,
    /// What each cell of a row is, and what its column is called.
    columns: Vec<(Option<Column>, String)>,
    is_of_attitudes: bool,
}

impl Table {
    /// Whether a line names the columns of such a table.
    #[must_use]
    pub fn is_header(line: &[u8]) -> bool {
        Table::new(line).is_ok()
    }

    /// A table under this first row.
    ///
    /// # Errors
    /// What is missing, in words.
    pub fn new(header: &[u8]) -> Result<Table, String> {
        let header = without_mark(header).trim_ascii();
        let mut columns: Vec<(Option<Column>, String)> = Vec::new();
        for cell in cells(header) {
            let name = printable(&String::from_utf8_lossy(cell.trim_ascii()));
            let known = COLUMNS.iter().find(|(known, _)| *known == name);
            // Of two that say the same, the first.
            let column = known
                .map(|(_, column)| *column)
                .filter(|column| columns.iter().all(|(before, _)| *before != Some(*column)));
            columns.push((column, name));
        }
        let has = |column: &Column| {
            columns
                .iter()
                .any(|(known, _)| known.as_ref() == Some(column))
        };
        if !has(&Column::Stamp) {
            return Err("it has no column stamp_ns".to_owned());
        }
        for (all, names) in [
            (GYRO.as_slice(), "gyro_x, gyro_y, gyro_z (or wx, wy, wz)"),
            (ORIENTATION.as_slice(), "qw, qx, qy, qz"),
        ] {
            if all.iter().any(has) && !all.iter().all(has) {
                return Err(format!("of the columns {names} not all are there"));
            }
        }
        if !has(&Column::Gyro(0)) && !has(&Column::Orientation(0)) {
            return Err(
                "it has neither columns gyro_x, gyro_y, gyro_z nor qw, qx, qy, qz".to_owned(),
            );
        }
        Ok(Table {
            is_of_attitudes: columns.iter().all(|(_, name)| name != "gyro_x"),
            header: header.to_owned(),
            columns,
        })
    }

    /// Whether rows have a place for an orientation.
    #[must_use]
    pub fn has_orientation(&self) -> bool {
        let is_one = |(column, _): &(Option<Column>, String)| *column == Some(ORIENTATION[0]);
        self.columns.iter().any(is_one)
    }

    /// Reads one row, without or with its line end, and pushes its sample. The first row once more, as where tables were
    /// put one behind the other, is no row. A row without `log_ns` was received at its stamp.
    ///
    /// # Errors
    /// A row with more or fewer cells than columns, or a cell that is no number where there must be one.
    pub fn decode(&self, row: &[u8], out: &mut Vec<RawSample>) -> Result<Line, Undecodable> {
        if row.len() > MAX_LINE {
            return Err(Undecodable::LongLine {
                have: row.len() as u64,
                limit: MAX_LINE as u64,
            });
        }
        let row = row.trim_ascii();
        if without_mark(row).trim_ascii_start() == self.header {
            return Ok(Line {
                class: Class::Other("header".to_owned()),
                ..Line::default()
            });
        }
        let mut read = Read::default();
        let mut have = 0;
        for (n, cell) in cells(row).enumerate() {
            have = n + 1;
            if let Some((Some(column), name)) = self.columns.get(n) {
                let cell = cell.trim_ascii();
                read.take(*column, cell).map_err(|why| Undecodable::Cell {
                    column: name.clone(),
                    near: snippet(cell),
                    why,
                })?;
            }
        }
        if have != self.columns.len() {
            return Err(Undecodable::Row {
                have: have as u64,
                need: self.columns.len() as u64,
            });
        }
        self.line(read, out)
    }

    fn line(&self, read: Read, out: &mut Vec<RawSample>) -> Result<Line, Undecodable> {
        // Before the sample: a row that is refused leaves none.
        let id = read.id.as_deref().map(exact_name).transpose()?;
        let gyro = self.whole(read.gyro, Column::Gyro)?;
        let log = read.log.or(read.stamp).unwrap_or_default();
        out.push(RawSample {
            header: read.stamp,
            log,
            publish: log,
            gyro,
            accel: self.whole(read.accel, Column::Accel)?,
            orientation: self.whole(read.orientation, Column::Orientation)?,
            interval_nanos: read.interval,
            ..RawSample::default()
        });
        let mut line = Line {
            class: if self.is_of_attitudes {
                Class::Att
            } else {
                Class::Rate
            },
            id,
            sample_kind: read.kind,
            gyro_unit: gyro.map(|_| GyroUnit::Rad),
            ..Line::default()
        };
        line.decoded.samples = 1;
        Ok(line)
    }

    /// A vector of which all cells are filled, or none.
    fn whole<const N: usize>(
        &self,
        found: [Option<f64>; N],
        column: fn(usize) -> Column,
    ) -> Result<Option<[f64; N]>, Undecodable> {
        let mut all = [0.0; N];
        for (place, value) in all.iter_mut().zip(found) {
            *place = value.unwrap_or(f64::NAN);
        }
        match found.iter().position(Option::is_none) {
            None => Ok(Some(all)),
            Some(_) if found.iter().all(Option::is_none) => Ok(None),
            Some(empty) => {
                let is_it = |(known, _): &&(Option<Column>, String)| *known == Some(column(empty));
                let name = self.columns.iter().find(is_it);
                Err(Undecodable::Cell {
                    column: name.map(|(_, name)| name.clone()).unwrap_or_default(),
                    near: String::new(),
                    why: "is empty, but those beside it are not",
                })
            }
        }
    }
}

/// What a row holds.
#[derive(Default)]
struct Read {
    stamp: Option<Nanos>,
    log: Option<Nanos>,
    interval: Option<i64>,
    kind: Option<SampleKind>,
    id: Option<String>,
    gyro: [Option<f64>; 3],
    accel: [Option<f64>; 3],
    orientation: [Option<f64>; 4],
}

impl Read {
    fn take(&mut self, column: Column, cell: &[u8]) -> Result<(), &'static str> {
        if cell.is_empty() {
            return Ok(());
        }
        let text = std::str::from_utf8(cell).map_err(|_| "is not UTF-8")?;
        let whole = || text.parse::<i64>().map_err(|_| "is no whole number");
        let number = || text.parse::<f64>().map_err(|_| "is no number");
        let put = |place: Option<&mut Option<f64>>| {
            let value = number()?;
            if let Some(place) = place {
                *place = Some(value);
            }
            Ok::<(), &'static str>(())
        };
        match column {
            Column::Stamp => self.stamp = Some(Nanos(whole()?)),
            Column::Log => self.log = Some(Nanos(whole()?)),
            Column::Interval => self.interval = Some(whole()?),
            Column::Kind => {
                let kind = SampleKind::named(text);
                self.kind = Some(kind.ok_or("is none of rate, average, delta-angle")?);
            }
            Column::Id => self.id = Some(text.to_owned()),
            Column::Gyro(axis) => put(self.gyro.get_mut(axis))?,
            Column::Accel(axis) => put(self.accel.get_mut(axis))?,
            Column::Orientation(part) => put(self.orientation.get_mut(part))?,
        }
        Ok(())
    }
}

/// The cells of a row: between commas, a cell in quotes with all that is in it.
fn cells(row: &[u8]) -> impl Iterator<Item = Cow<'_, [u8]>> {
    let mut rest = Some(row);
    std::iter::from_fn(move || {
        let text = rest?;
        if text.first() == Some(&b'"') {
            let (cell, behind) = quoted(text.get(1..).unwrap_or_default());
            rest = behind;
            return Some(Cow::Owned(cell));
        }
        let end = text.iter().position(|b| *b == b',');
        rest = end.and_then(|end| text.get(end + 1..));
        Some(Cow::Borrowed(
            text.get(..end.unwrap_or(text.len())).unwrap_or_default(),
        ))
    })
}

/// The cell behind an opening quote, and the cells after it. Two quotes are one.
fn quoted(text: &[u8]) -> (Vec<u8>, Option<&[u8]>) {
    let mut cell = Vec::new();
    let mut at = 0;
    while let Some(byte) = text.get(at) {
        at += 1;
        if *byte != b'"' {
            cell.push(*byte);
        } else if text.get(at) == Some(&b'"') {
            cell.push(b'"');
            at += 1;
        } else {
            break;
        }
    }
    let behind = text.get(at..).unwrap_or_default();
    let comma = behind.iter().position(|b| *b == b',');
    (cell, comma.and_then(|comma| behind.get(comma + 1..)))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const OURS: &[u8] = b"stamp_ns,log_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,qw,qx,qy,qz,interval_ns,sample_kind\r\n";

    fn row(table: &Table, row: &str) -> Result<(Line, RawSample), Undecodable> {
        let mut samples = Vec::new();
        let line = table.decode(row.as_bytes(), &mut samples)?;
        Ok((line, samples.first().copied().unwrap_or_default()))
    }

    #[test]
    fn a_row_is_read_to_the_last_bit_and_what_is_empty_is_absent() {
        let table = Table::new(OURS).unwrap();
        let (line, sample) =
            row(&table, "5,7,0.1,-2e-300,nan,,,,1,0,0,0,4000000,average\r\n").unwrap();
        assert_eq!(
            (line.class, line.sample_kind),
            (Class::Rate, Some(SampleKind::Average))
        );
        assert_eq!((sample.header, sample.log), (Some(Nanos(5)), Nanos(7)));
        let gyro = sample.gyro.unwrap();
        assert_eq!(
            [gyro[0].to_bits(), gyro[1].to_bits()],
            [0.1f64.to_bits(), (-2e-300f64).to_bits()]
        );
        assert!(gyro[2].is_nan());
        assert_eq!(
            (sample.accel, sample.interval_nanos),
            (None, Some(4_000_000))
        );
        assert_eq!(sample.orientation, Some([1.0, 0.0, 0.0, 0.0]));
    }

    #[test]
    fn what_is_no_row_of_the_table_says_which_cell() {
        let table = Table::new(b"stamp_ns,gyro_x,gyro_y,gyro_z").unwrap();
        for (bad, words) in [
            ("1,2,3", "3 cells, but 4 columns"),
            ("1,2,3,4,5", "5 cells, but 4 columns"),
            ("1,2,,4", "`gyro_y`"),
            ("1,2,x\u{1b}[2J,4", "`gyro_y`"),
            ("1.5,2,3,4", "`stamp_ns`"),
        ] {
            let why = row(&table, bad).unwrap_err().to_string();
            assert!(
                why.contains(words) && !why.contains('\u{1b}'),
                "{bad}: {why}"
            );
        }
        let long = "7".repeat(MAX_LINE + 1);
        assert!(matches!(
            row(&table, &long),
            Err(Undecodable::LongLine { .. })
        ));
    }

    #[test]
    fn a_name_in_quotes_may_hold_commas_and_the_first_row_may_come_again() {
        let table = Table::new(b"\xef\xbb\xbfid,stamp_ns,w,x,y,z,wx,wy,wz,status").unwrap();
        let (line, sample) = row(
            &table,
            "\"a \"\"b\"\", c\",9,1,0,0,0,0.1,0.2,0.3,\"held,x\"",
        )
        .unwrap();
        assert_eq!(line.id.as_deref(), Some("a \"b\", c"));
        assert_eq!(
            (line.class, sample.gyro),
            (Class::Att, Some([0.1, 0.2, 0.3]))
        );
        let (again, _) = row(&table, "id,stamp_ns,w,x,y,z,wx,wy,wz,status\n").unwrap();
        assert_eq!(again.decoded.samples, 0);
    }

    #[test]
    fn a_table_of_somebody_else_is_none_of_ours() {
        for other in [
            "timestamp,x,y,z",
            "stamp_ns,temperature",
            "stamp_ns,gyro_x,gyro_y",
            "time,gyro_x,gyro_y,gyro_z",
            "",
        ] {
            assert!(!Table::is_header(other.as_bytes()), "{other}");
        }
    }
}
