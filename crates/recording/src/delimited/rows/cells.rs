//! Cells of a row -> the numbers, the stamps and the names in them. Pure.
//!
//! Apart from the rows because here one cell alone is read: what its row is, and whether that is a sample, shows only in
//! all of them.

use super::super::clock::Clock;
use super::super::column::Column;
use crate::columns::bits;
use crate::decimal;
use strapd_attitude::record::{Nanos, SampleKind};

/// Contents of a row.
#[derive(Default)]
pub(super) struct Read {
    pub(super) stamp: Option<Nanos>,
    pub(super) day: Option<Nanos>,
    pub(super) log: Option<Nanos>,
    pub(super) interval: Option<i64>,
    pub(super) kind: Option<SampleKind>,
    pub(super) id: Option<String>,
    pub(super) gyro: [Option<f64>; 3],
    pub(super) accel: [Option<f64>; 3],
    pub(super) mag: [Option<f64>; 3],
    pub(super) orientation: [Option<f64>; 4],
    pub(super) turn: [Option<f64>; 4],
    pub(super) matrix: [Option<f64>; 9],
    pub(super) temperature: Option<f64>,
    /// Numbers of gyro, accel and mag that a word says are not there.
    nulls: [u8; 3],
}

impl Read {
    /// Drops the vectors of which a word says that they are not there, in a row that has a number of another sensor:
    /// joined tables have rows of each.
    #[inline]
    pub(super) fn without_nulls(mut self) -> Read {
        let mut vectors = [&mut self.gyro, &mut self.accel, &mut self.mag];
        let is_there = |vector: &&mut [Option<f64>; 3]| {
            let is_number = |value: &Option<f64>| value.is_some_and(|value| !value.is_nan());
            vector.iter().all(is_number)
        };
        if vectors.iter().any(is_there) {
            for (vector, nulls) in vectors.iter_mut().zip(self.nulls) {
                if nulls == 3 {
                    **vector = [None; 3];
                }
            }
        }
        self
    }

    #[inline]
    pub(super) fn take(
        &mut self,
        column: Column,
        cell: &[u8],
        commas: bool,
        clock: &mut Clock,
    ) -> Result<(), &'static str> {
        if cell.is_empty() {
            return Ok(());
        }
        if let Some(value) = bits::read(cell) {
            if let Some(place) = self.place_of(column) {
                *place = Some(value);
                return Ok(());
            }
            return self.take(column, &bits::spelled(cell), commas, clock);
        }
        if let Some(value) = decimal::alone(cell)
            && let Some(place) = self.place_of(column)
        {
            *place = Some(value);
            return Ok(());
        }
        let mut pointed = [0; MOST_DIGITS];
        let cell = match commas && cell.contains(&b',') {
            true => with_point(cell, &mut pointed).ok_or("is no number")?,
            false => cell,
        };
        let text = std::str::from_utf8(cell).map_err(|_| "is not UTF-8")?;
        let whole = || text.parse::<i64>().map_err(|_| "is no whole number");
        if let Some(place) = self.place_of(column) {
            *place = match column {
                // No sample is lost for want of one.
                Column::Temperature => number(text).ok(),
                _ => Some(number(text)?),
            };
            if is_null(text) {
                self.count_null(column);
            }
            return Ok(());
        }
        match column {
            Column::Stamp if is_absent(text) => {}
            Column::Stamp => self.stamp = Some(clock.read(text)?),
            Column::Date if is_absent(text) => {}
            Column::Date => self.day = Some(clock.day(text)?),
            Column::Log => self.log = Some(Nanos(whole()?)),
            Column::Interval => self.interval = Some(whole()?),
            Column::Kind => {
                let kind = SampleKind::named(text);
                self.kind = Some(kind.ok_or("is none of rate, average, delta-angle, rotation")?);
            }
            // Where several columns name it, by all of them.
            Column::Id => {
                self.id = Some(match self.id.take() {
                    Some(before) => format!("{before}/{text}"),
                    None => text.to_owned(),
                });
            }
            // A number, which has a place.
            _ => {}
        }
        Ok(())
    }

    fn count_null(&mut self, column: Column) {
        let [gyro, accel, mag] = &mut self.nulls;
        match column {
            Column::Gyro(_) => *gyro += 1,
            Column::Accel(_) => *accel += 1,
            Column::Mag(_) => *mag += 1,
            _ => {}
        }
    }

    /// Place of the number in a column, if the column holds plain numbers.
    #[inline]
    fn place_of(&mut self, column: Column) -> Option<&mut Option<f64>> {
        match column {
            Column::Gyro(axis) => self.gyro.get_mut(axis),
            Column::Accel(axis) => self.accel.get_mut(axis),
            Column::Mag(axis) => self.mag.get_mut(axis),
            Column::Orientation(part) => self.orientation.get_mut(part),
            Column::Turn(part) => self.turn.get_mut(part),
            Column::Matrix(part) => self.matrix.get_mut(part),
            Column::Temperature => Some(&mut self.temperature),
            _ => None,
        }
    }
}

/// Digits of a number with a decimal comma.
const MOST_DIGITS: usize = 64;

/// The number with a point where it has its comma.
fn with_point<'b>(cell: &[u8], buffer: &'b mut [u8; MOST_DIGITS]) -> Option<&'b [u8]> {
    let out = buffer.get_mut(..cell.len())?;
    for (to, from) in out.iter_mut().zip(cell) {
        *to = if *from == b',' { b'.' } else { *from };
    }
    Some(out)
}

/// Words for a number that is not there. Of a vector it is one that is not finite: it is counted, not passed over.
fn is_absent(text: &str) -> bool {
    is_null(text) || text.eq_ignore_ascii_case("nan")
}

/// Words for no number, which is another thing than one that is none.
fn is_null(text: &str) -> bool {
    ["null", "-", "NA", "N/A", "n/a", "None"].contains(&text)
}

#[inline]
fn number(text: &str) -> Result<f64, &'static str> {
    text.parse::<f64>().or_else(|_| match is_absent(text) {
        true => Ok(f64::NAN),
        false => Err("is no number"),
    })
}
