//! A table -> what is known of it as a whole: who wrote it, what it has, what its reader is told. Pure.
//!
//! Apart from the rows because its reader asks for this of a table, not of each row.

use super::super::clock::Clock;
use super::super::column::Column;
use super::{GYRO, Table, Whose};
use crate::columns::RowSelection;
use strapd_attitude::record::Declared;
use strapd_attitude::setting::{GYRO_SCALE, GYRO_UNIT};

impl Table {
    /// Whether strapd wrote it.
    #[inline]
    #[must_use]
    pub fn is_own(&self) -> bool {
        self.whose != Whose::Others
    }

    /// The `--columns` that say how it is read; empty of strapd's own.
    #[must_use]
    pub fn assumed(&self) -> &str {
        &self.assumed
    }

    /// Rows that are read, and the count of those that are not.
    #[must_use]
    pub(crate) fn selection(&self) -> &RowSelection {
        &self.selection
    }

    /// Name of the columns that tell the sensors of a table apart; `None` where there are none.
    #[must_use]
    pub(crate) fn sensor_column(&self) -> Option<String> {
        let columns = self.columns.iter();
        let named: Vec<&str> = columns
            .filter(|(column, _)| *column == Some(Column::Id))
            .map(|(_, name)| name.as_str())
            .collect();
        (!named.is_empty()).then(|| named.join(", "))
    }

    /// Notes for its reader: what was taken for granted, what is not used.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Warning to give if nobody states the unit of its rates.
    #[must_use]
    pub(crate) fn doubt_of_unit(&self) -> Option<String> {
        let is_open = !self.is_own() && self.has_rate() && self.declared.gyro_unit.is_none();
        is_open.then(|| {
            format!("the unit of the rates is not stated, and taken for rad/s: {GYRO_UNIT} or {GYRO_SCALE} states another")
        })
    }

    /// Meaning of its numbers that its names declare.
    #[must_use]
    pub fn declared(&self) -> &Declared {
        &self.declared
    }

    /// Whether anything says when its rows were measured.
    #[must_use]
    pub(crate) fn has_stamps(&self) -> bool {
        self.clock != Clock::Nothing
    }

    /// Whether rows have a place for a rate.
    #[must_use]
    pub fn has_rate(&self) -> bool {
        self.has(GYRO[0]) || self.has(Column::Turn(0))
    }

    /// Whether rows have a place for a specific force.
    #[must_use]
    pub fn has_force(&self) -> bool {
        self.has(Column::Accel(0))
    }

    /// Whether rows have a place for a magnetic field.
    #[must_use]
    pub fn has_field(&self) -> bool {
        self.has(Column::Mag(0))
    }

    /// Whether rows have a place for an orientation.
    #[must_use]
    pub(crate) fn has_orientation(&self) -> bool {
        self.has(Column::Orientation(0))
    }
}
