//! Values of one column of a row group -> its pages. Pure.
//!
//! Apart from the table because how numbers are packed is decided here, and what they mean is not known here. Floats
//! of a motion are packed best byte by byte (the first bytes of neighbours are alike), stamps as differences.

use parquet::basic::{Encoding, LogicalType, Repetition, TimeUnit, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result};
use parquet::file::properties::{EnabledStatistics, WriterPropertiesBuilder};
use parquet::schema::types::{ColumnPath, Type, TypePtr};
use std::sync::Arc;

/// Origin from which a stamp counts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Clock {
    /// 1970: readers show dates.
    Unix,
    /// Anything else, such as when a board was switched on: readers show integers.
    Own,
}

/// Values that wait to be written.
#[derive(Debug)]
pub(super) enum Values {
    /// Nanoseconds of a clock.
    Stamp(Vec<i64>),
    Long(Vec<i64>),
    Int(Vec<i32>),
    Double(Vec<f64>),
    Single(Vec<f32>),
    /// One of a few names, by its number.
    Name(Vec<u32>),
}

/// One column of the table.
#[derive(Debug)]
pub(super) struct Column {
    pub(super) name: &'static str,
    values: Values,
    /// Presence of a value in each row; `None`: all have one.
    present: Option<Vec<i16>>,
}

impl Column {
    pub(super) fn new(name: &'static str, values: Values) -> Column {
        Column {
            name,
            values,
            present: None,
        }
    }

    /// One whose cells may be empty.
    pub(super) fn optional(name: &'static str, values: Values) -> Column {
        Column {
            present: Some(Vec::new()),
            ..Column::new(name, values)
        }
    }

    /// Appends numbers to a column that has no empty cells.
    pub(super) fn extend(&mut self, numbers: impl Iterator<Item = f64>) {
        match &mut self.values {
            Values::Double(values) => values.extend(numbers),
            Values::Single(values) => values.extend(numbers.map(|value| value as f32)),
            Values::Stamp(_) | Values::Long(_) | Values::Int(_) | Values::Name(_) => {}
        }
    }

    /// Appends whole numbers to a column that has no empty cells, cut to what it holds.
    pub(super) fn extend_whole(&mut self, numbers: impl Iterator<Item = i64>) {
        match &mut self.values {
            Values::Stamp(values) | Values::Long(values) => values.extend(numbers),
            Values::Int(values) => {
                values.extend(numbers.map(|value| i32::try_from(value).unwrap_or(i32::MAX)));
            }
            Values::Name(values) => {
                values.extend(numbers.map(|value| u32::try_from(value).unwrap_or_default()));
            }
            Values::Double(_) | Values::Single(_) => {}
        }
    }

    /// Appends a cell of a number.
    pub(super) fn push(&mut self, value: Option<f64>) {
        if let Some(present) = &mut self.present {
            present.push(i16::from(value.is_some()));
        }
        let value = match (value, &self.present) {
            (Some(value), _) => value,
            (None, Some(_)) => return,
            (None, None) => f64::NAN,
        };
        match &mut self.values {
            Values::Double(values) => values.push(value),
            Values::Single(values) => values.push(value as f32),
            Values::Stamp(_) | Values::Long(_) | Values::Int(_) | Values::Name(_) => {}
        }
    }

    /// Appends a cell of a whole number, cut to what the column holds.
    pub(super) fn push_whole(&mut self, value: Option<i64>) {
        if let Some(present) = &mut self.present {
            present.push(i16::from(value.is_some()));
        }
        let Some(value) = value else { return };
        match &mut self.values {
            Values::Stamp(values) | Values::Long(values) => values.push(value),
            Values::Int(values) => values.push(i32::try_from(value).unwrap_or(i32::MAX)),
            Values::Name(values) => values.push(u32::try_from(value).unwrap_or_default()),
            Values::Double(_) | Values::Single(_) => {}
        }
    }

    /// The first whole number that waits.
    pub(super) fn first_whole(&self) -> Option<i64> {
        match &self.values {
            Values::Stamp(values) | Values::Long(values) => values.first().copied(),
            _ => None,
        }
    }

    /// The column in the schema.
    pub(super) fn field(&self, clock: Clock) -> Result<TypePtr> {
        let (physical, logical) = match &self.values {
            Values::Stamp(_) if clock == Clock::Unix => (
                Physical::INT64,
                Some(LogicalType::timestamp(true, TimeUnit::NANOS)),
            ),
            Values::Stamp(_) | Values::Long(_) => (Physical::INT64, None),
            Values::Int(_) => (Physical::INT32, None),
            Values::Double(_) => (Physical::DOUBLE, None),
            Values::Single(_) => (Physical::FLOAT, None),
            Values::Name(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let repetition = match self.present {
            Some(_) => Repetition::OPTIONAL,
            None => Repetition::REQUIRED,
        };
        Type::primitive_type_builder(self.name, physical)
            .with_repetition(repetition)
            .with_logical_type(logical)
            .build()
            .map(Arc::new)
    }

    /// Compression of its pages.
    pub(super) fn packed(&self, properties: WriterPropertiesBuilder) -> WriterPropertiesBuilder {
        let path = ColumnPath::from(self.name);
        let without_statistics = |properties: WriterPropertiesBuilder| {
            properties.set_column_statistics_enabled(path.clone(), EnabledStatistics::None)
        };
        match &self.values {
            Values::Stamp(_) | Values::Long(_) | Values::Int(_) => {
                properties.set_column_encoding(path, Encoding::DELTA_BINARY_PACKED)
            }
            // Their least and greatest would be in an order that the readers of today pass over.
            Values::Double(_) | Values::Single(_) => without_statistics(properties)
                .set_column_encoding(path.clone(), Encoding::BYTE_STREAM_SPLIT),
            // By number of the name.
            Values::Name(_) => {
                without_statistics(properties).set_column_dictionary_enabled(path.clone(), true)
            }
        }
    }

    /// Writes what is waiting, and empties it.
    pub(super) fn write(
        &mut self,
        writer: &mut ColumnWriter<'_>,
        names: &[ByteArray],
    ) -> Result<()> {
        let present = self.present.as_deref();
        match (&mut self.values, writer) {
            (Values::Stamp(v) | Values::Long(v), ColumnWriter::Int64ColumnWriter(w)) => {
                w.write_batch(v, present, None)?;
                v.clear();
            }
            (Values::Int(v), ColumnWriter::Int32ColumnWriter(w)) => {
                w.write_batch(v, present, None)?;
                v.clear();
            }
            (Values::Double(v), ColumnWriter::DoubleColumnWriter(w)) => {
                w.write_batch(v, present, None)?;
                v.clear();
            }
            (Values::Single(v), ColumnWriter::FloatColumnWriter(w)) => {
                w.write_batch(v, present, None)?;
                v.clear();
            }
            (Values::Name(v), ColumnWriter::ByteArrayColumnWriter(w)) => {
                let mut named = Vec::with_capacity(NAMES_AT_ONCE.min(v.len()));
                for numbers in v.chunks(NAMES_AT_ONCE) {
                    named.clear();
                    let name = |number: &u32| names.get(*number as usize).cloned();
                    named.extend(
                        numbers
                            .iter()
                            .map(|n| name(n).unwrap_or_else(|| ByteArray::from(""))),
                    );
                    w.write_batch(&named, present, None)?;
                }
                v.clear();
            }
            _ => {
                return Err(ParquetError::General(format!(
                    "the column {} has another type than the schema says",
                    self.name
                )));
            }
        }
        if let Some(present) = &mut self.present {
            present.clear();
        }
        Ok(())
    }
}

/// Names handed over in one call: each costs some 40 bytes on the way.
const NAMES_AT_ONCE: usize = 4096;
