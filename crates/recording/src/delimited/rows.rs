//! Rows of a table -> samples and what each row says of itself. Pure.
//!
//! Apart from the layout because that is decided once, and this is done for every row.

mod cells;
mod facts;

use super::clock::Clock;
use super::column::{Column, is_comment};
use super::layout;
use super::own;
use super::preamble;
use crate::columns::{Columns, Delimiter, RowSelection, bits};
use crate::decode::{Class, Line, MAX_LINE, Undecodable, exact_name};
use crate::text::{printable, snippet, without_mark};
use cells::Read;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use std::borrow::Cow;
use std::sync::Arc;
use strapd_attitude::frames::Sensor;
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{Declared, RawSample};

/// Columns that make a table one of samples or of attitudes.
const GYRO: [Column; 3] = [Column::Gyro(0), Column::Gyro(1), Column::Gyro(2)];
const ORIENTATION: [Column; 4] = [
    Column::Orientation(0),
    Column::Orientation(1),
    Column::Orientation(2),
    Column::Orientation(3),
];

/// Mark of a line that stands for a row that was lost before it was text; the reason follows it.
pub(crate) const LOST: &[u8] = b"\0lost ";

/// Factors by which the numbers of a role are multiplied before anything is made of them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Scales {
    pub(super) gyro: f64,
    pub(super) accel: f64,
    pub(super) mag: f64,
    /// Unit of a temperature: degrees Celsius in one of it, and where it has its zero.
    pub(super) temperature: [f64; 2],
}

impl Default for Scales {
    fn default() -> Scales {
        Scales {
            gyro: 1.0,
            accel: 1.0,
            mag: 1.0,
            temperature: [1.0, 0.0],
        }
    }
}

/// Origin of a table.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Whose {
    /// Table of samples, written by strapd.
    Own,
    /// Table of attitudes, written by strapd.
    OwnAttitudes,
    Others,
}

/// A table, by its first rows.
#[derive(Clone, PartialEq, Debug)]
pub struct Table {
    header: Vec<u8>,
    /// Meaning of each cell of a row, and the name of its column.
    columns: Vec<(Option<Column>, String)>,
    whose: Whose,
    pub(super) delimiter: Delimiter,
    pub(super) has_decimal_comma: bool,
    pub(super) clock: Clock,
    pub(super) scales: Scales,
    /// The sensor whose samples are named as those of a table of one.
    pub(super) usual_sensor: Option<String>,
    /// Interval of its increments, ns.
    pub(super) interval: Option<i64>,
    /// Meaning of its numbers that its names declare.
    pub(super) declared: Declared,
    /// The `--columns` that say the same.
    pub(super) assumed: String,
    /// Notes for its reader.
    pub(super) notes: Vec<String>,
    /// Rows so far.
    row: u64,
    /// Rows that are read.
    pub(super) selection: RowSelection,
    /// Columns that the user named, by which another table's header is recognised.
    pub(super) given: Option<Columns>,
    /// Another table has begun, whose rows are none of this.
    is_elsewhere: bool,
    /// Words for the row that was lost last, as they came and as they are shown: millions are lost for one reason.
    lost: Option<(Vec<u8>, Arc<str>)>,
}

impl Table {
    /// Reason why a row was lost, fit to be shown.
    fn lost(&mut self, why: &[u8]) -> Arc<str> {
        let known = self.lost.take().filter(|(before, _)| before == why);
        let shown = || Arc::from(snippet(why.trim_ascii_end()));
        let (before, shown) = known.unwrap_or_else(|| (why.to_vec(), shown()));
        self.lost = Some((before, Arc::clone(&shown)));
        shown
    }

    /// Whether a line names the columns of a table of strapd's own.
    #[must_use]
    pub(crate) fn is_own_header(line: &[u8]) -> bool {
        Table::own(line).is_ok()
    }

    /// A table of strapd's own under this first row.
    ///
    /// # Errors
    /// What is missing, in words.
    pub fn own(header: &[u8]) -> Result<Table, String> {
        let header = without_mark(header).trim_ascii();
        let mut columns: Vec<(Option<Column>, String)> = Vec::new();
        for cell in Delimiter::Byte(b',').cells(header) {
            let name = printable(&String::from_utf8_lossy(cell.trim_ascii()));
            let known = own::COLUMNS.iter().find(|(known, _)| *known == name);
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
        let is_of_attitudes = columns.iter().all(|(_, name)| name != "gyro_x");
        let mut table = Table::of_columns(header, columns, Delimiter::Byte(b','));
        table.whose = match is_of_attitudes {
            true => Whose::OwnAttitudes,
            false => Whose::Own,
        };
        table.clock = Clock::Nanos;
        Ok(table)
    }

    /// A table of somebody else's; what its numbers mean is set by the layout.
    pub(super) fn of_columns(
        header: &[u8],
        columns: Vec<(Option<Column>, String)>,
        delimiter: Delimiter,
    ) -> Table {
        Table {
            header: header.to_owned(),
            columns,
            whose: Whose::Others,
            delimiter,
            has_decimal_comma: false,
            clock: Clock::Nothing,
            scales: Scales::default(),
            usual_sensor: None,
            interval: None,
            declared: Declared::default(),
            assumed: String::new(),
            notes: Vec::new(),
            row: 0,
            lost: None,
            selection: RowSelection::default(),
            given: None,
            is_elsewhere: false,
        }
    }

    /// The names of its columns.
    pub(super) fn names(&self) -> Vec<&str> {
        self.columns.iter().map(|(_, name)| name.as_str()).collect()
    }

    pub(super) fn has(&self, column: Column) -> bool {
        self.columns.iter().any(|(known, _)| *known == Some(column))
    }

    /// Reads one row, without or with its line end, and pushes its sample. The first row once more, as where tables were
    /// put one behind the other, is no row, and neither is a comment; what stands under another first row is not of
    /// this table. A row without `log_ns` was received at its stamp.
    ///
    /// # Errors
    /// A row with more or fewer cells than columns, or a cell that is no number where there must be one.
    pub fn decode(&mut self, line: &[u8], out: &mut Vec<RawSample>) -> Result<Line, Undecodable> {
        if line.len() > MAX_LINE {
            self.row += 1;
            return Err(Undecodable::LongLine {
                have: line.len() as u64,
                limit: MAX_LINE as u64,
            });
        }
        if let Some(why) = line.strip_prefix(LOST) {
            self.row += 1;
            return Err(Undecodable::Lost(self.lost(why)));
        }
        let row = self.delimiter.row(without_mark(line));
        if row.first() == self.header.first() && row == self.header {
            self.is_elsewhere = false;
            return Ok(no_row("header"));
        }
        if self.whose == Whose::Others && is_comment(row) {
            // What says another rate is the head of another table.
            let other = |hz: f64| {
                self.declared_period()
                    .is_some_and(|p| (1e9 / hz - p).abs() > 1.0)
            };
            if layout::is_header(row, self.given.as_ref())
                || preamble::rate(row).is_some_and(|rate| other(rate.hz))
            {
                self.is_elsewhere = true;
            }
            return Ok(no_row("comment"));
        }
        if self.is_elsewhere {
            self.row += 1;
            return Err(self.explained(row, Undecodable::OtherTable));
        }
        if !self.selection.takes(row, self.delimiter) {
            return Ok(no_row("left out"));
        }
        let sum = self.clock.sum();
        let read = self.cells(row).and_then(|read| self.line(read, out));
        self.row += 1;
        read.map_err(|why| {
            let why = self.explained(row, why);
            if let Some(before) = sum {
                self.pass(row, before, &why);
            }
            why
        })
    }

    /// Passes over a row that is none: adds the step since the row before, if it is where it should be.
    fn pass(&mut self, row: &[u8], before: i64, why: &Undecodable) {
        let is_step = |(column, _): &(Option<Column>, String)| *column == Some(Column::Stamp);
        let place = self.columns.iter().position(is_step);
        let place = place.filter(|_| matches!(why, Undecodable::Cell { .. }));
        let cell = place.and_then(|place| self.delimiter.cells(row).nth(place));
        let cell = cell.map(|cell| {
            let cell = bits::spelled(&cell);
            String::from_utf8_lossy(&cell).trim().replace(',', ".")
        });
        self.clock.pass(before, cell.as_deref());
    }

    fn declared_period(&self) -> Option<f64> {
        match self.clock {
            Clock::Counter { period, .. } | Clock::Rows { period } => Some(period),
            _ => None,
        }
    }

    /// Explains what is no row because another table begins with it.
    fn explained(&mut self, row: &[u8], why: Undecodable) -> Undecodable {
        // In a header nothing is a number, which tells most rows at once.
        let is_data = |cell: Cow<'_, [u8]>| {
            let cell = cell.trim_ascii();
            let text = std::str::from_utf8(cell).unwrap_or_default();
            bits::read(cell).is_some() || text.parse::<f64>().is_ok()
        };
        let is_header = self.whose == Whose::Others
            && !self.delimiter.cells(row).any(is_data)
            && layout::is_header(row, self.given.as_ref());
        if !is_header {
            let (have, need) = (self.delimiter.cells(row).count(), self.columns.len());
            // What stands in the wrong place is not the point then.
            return match why {
                Undecodable::Cell { .. } if have != need => Undecodable::Row {
                    have: have as u64,
                    need: need as u64,
                },
                why => why,
            };
        }
        self.is_elsewhere = true;
        Undecodable::OtherTable
    }

    fn cells(&mut self, row: &[u8]) -> Result<Read, Undecodable> {
        let mut read = Read::default();
        let mut have = 0;
        let mut is_longer = false;
        let commas = self.has_decimal_comma;
        for (n, cell) in self.delimiter.cells(row).enumerate() {
            let cell = cell.trim_ascii();
            match self.columns.get(n) {
                Some((Some(column), name)) => {
                    read.take(*column, cell, commas, &mut self.clock)
                        .map_err(|why| Undecodable::Cell {
                            column: name.clone(),
                            near: snippet(cell),
                            why,
                        })?;
                }
                Some((None, _)) => {}
                // A delimiter at the end of every row.
                None => is_longer |= !cell.is_empty() || self.is_own(),
            }
            have = n + 1;
        }
        let need = self.columns.len();
        if have < need || is_longer {
            return Err(Undecodable::Row {
                have: have as u64,
                need: need as u64,
            });
        }
        Ok(read)
    }

    fn line(&self, read: Read, out: &mut Vec<RawSample>) -> Result<Line, Undecodable> {
        // Before the sample: a row that is refused leaves none.
        let id = read.id.as_deref().filter(|id| !self.is_usual(id, &read));
        let id = id.map(exact_name).transpose()?;
        let scaled = |vector: Option<[f64; 3]>, by: f64| match by {
            1.0 => vector,
            _ => vector.map(|v| v.map(|value| value * by)),
        };
        let read = match self.whose {
            Whose::Others => read.without_nulls(),
            Whose::Own | Whose::OwnAttitudes => read,
        };
        let gyro = scaled(self.whole(read.gyro, Column::Gyro)?, self.scales.gyro);
        let turn = self.whole(read.turn, Column::Turn)?;
        let gyro = gyro.or_else(|| turn.map(rotation_vector));
        let accel = scaled(self.whole(read.accel, Column::Accel)?, self.scales.accel);
        let mag = scaled(self.whole(read.mag, Column::Mag)?, self.scales.mag);
        let matrix = self.whole(read.matrix, Column::Matrix)?;
        let orientation = self
            .whole(read.orientation, Column::Orientation)?
            .or_else(|| matrix.map(|rows| quaternion(&rows)));
        let stamp = self.clock.instant(read.stamp, read.day);
        let stamp = stamp.or_else(|| self.clock.of_row(self.row));
        let log = read.log.or(stamp).unwrap_or_default();
        // In tables of several sensors each has rows of its own.
        let is_others = self.whose == Whose::Others
            && gyro.is_none()
            && (accel.is_some() || mag.is_some() || orientation.is_some());
        out.push(RawSample {
            header: stamp,
            log,
            publish: log,
            gyro,
            accel,
            mag,
            orientation,
            orientation_resets: None,
            interval_nanos: read.interval.or(self.interval),
            temperature: read.temperature.map(|value| {
                let [scale, zero] = self.scales.temperature;
                (value * scale + zero) as f32
            }),
            is_beside: is_others && orientation.is_none(),
        });
        let mut line = Line {
            class: match self.whose {
                Whose::OwnAttitudes => Class::Att,
                Whose::Others if is_others => Class::None,
                Whose::Own | Whose::Others => Class::Rate,
            },
            id,
            sample_kind: read.kind.or(self.declared.sample_kind),
            gyro_unit: match self.whose {
                Whose::Others => self.declared.gyro_unit,
                _ => gyro.map(|_| crate::decode::GyroUnit::Rad),
            },
            accel_unit: self.declared.accel_unit,
            stamp_unit: self.clock.unit(),
            ..Line::default()
        };
        line.decoded.samples = 1;
        Ok(line)
    }

    /// Whether a row is of the sensor of all first rows, or has no rate, where that tells the kind of a row.
    fn is_usual(&self, id: &str, read: &Read) -> bool {
        let Some(usual) = &self.usual_sensor else {
            return false;
        };
        let has_rate = read.gyro.iter().chain(&read.turn).any(Option::is_some);
        usual == id || !has_rate
    }

    /// A vector of which all cells are filled, or none.
    #[inline]
    fn whole<const N: usize>(
        &self,
        found: [Option<f64>; N],
        column: fn(usize) -> Column,
    ) -> Result<Option<[f64; N]>, Undecodable> {
        if found.iter().all(Option::is_none) {
            return Ok(None);
        }
        let mut all = [0.0; N];
        for (place, value) in all.iter_mut().zip(found) {
            *place = value.unwrap_or(f64::NAN);
        }
        let Some(empty) = found.iter().position(Option::is_none) else {
            return Ok(Some(all));
        };
        let is_it = |(known, _): &&(Option<Column>, String)| *known == Some(column(empty));
        let name = self.columns.iter().find(is_it);
        Err(Undecodable::Cell {
            column: name.map(|(_, name)| name.clone()).unwrap_or_default(),
            near: String::new(),
            why: "is empty, but those beside it are not",
        })
    }
}

/// A line that holds no sample, and is none that was lost.
fn no_row(what: &str) -> Line {
    Line {
        class: Class::Other(what.to_owned()),
        ..Line::default()
    }
}

/// A rotation matrix by rows as `[w, x, y, z]`; what is none stays not finite.
fn quaternion(rows: &[f64; 9]) -> [f64; 4] {
    let matrix = Matrix3::from_row_slice(rows);
    let is_rotation = (matrix * matrix.transpose() - Matrix3::identity()).norm() < 0.01
        && matrix.determinant() > 0.0;
    if !is_rotation {
        return [f64::NAN; 4];
    }
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    [q.w, q.i, q.j, q.k]
}

/// A turn of the sensor, `[w, x, y, z]`, as a rotation vector, rad; of what is none, not finite.
fn rotation_vector(wxyz: [f64; 4]) -> [f64; 3] {
    let turn = Quaternion::<Sensor, Sensor>::try_from_wxyz(wxyz);
    turn.map_or([f64::NAN; 3], |turn| turn.rotation_vector().0.into())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
