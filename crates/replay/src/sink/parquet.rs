//! AttitudeSample (and, from a synthetic gyro, RawSample) -> a table in Parquet. Pure.
//!
//! A stage of its own because columns cannot be written sample by sample: a row group is gathered, and packed column
//! by column when it is full. What is read back is the numbers' own bits, unless single precision was asked for.
//!
//! The names of the columns are those that tables are read by.

mod column;

use super::batch::Batch;
use super::form::{Form, Opening, Precision, Slot};
use super::stream::{Content, Provenance, Stream};
use super::text::{ACCELERATIONS, TEMPERATURE, accelerations};
use column::{Clock, Column, Values};
use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{WriterProperties, WriterVersion};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::sync::Arc;
use strapd_attitude::record::{AttitudeSample, RawSample, Status};

/// Rows of a group: 23 MB while it is gathered, and as much again at most while it is packed.
const GROUP_ROWS: usize = 1 << 18;

/// A stamp that can be a date: 2000-01-01 or later.
const Y2000_NANOS: i64 = 946_684_800 * 1_000_000_000;

/// Kind of the rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Rows {
    Attitudes,
    Samples,
}

/// A table that is being written.
#[derive(Debug)]
struct Table {
    rows: Rows,
    columns: Vec<Column>,
    names: Vec<ByteArray>,
    about: Vec<KeyValue>,
    /// Rows that wait.
    waiting: usize,
    /// Writer from the first row on: what its stamp is decides the type of the column.
    writer: Option<SerializedFileWriter<Vec<u8>>>,
}

/// Begins a table. Nothing stands before the first group.
pub(super) fn begin(opening: &Opening<'_>, _: &mut Vec<u8>) -> crate::error::Result<Box<dyn Form>> {
    let Opening {
        options,
        streams,
        provenance,
        ..
    } = opening;
    let table = Table::new(streams, provenance, options.precision);
    Ok(Box::new(table))
}

impl Form for Table {
    /// Rows are gathered, and so packed where batches are written in order.
    fn encode(&self, _: &mut Slot) {}

    fn in_order<'s>(&mut self, slot: &'s mut Slot) -> std::io::Result<[&'s [u8]; 3]> {
        slot.text = self.push(&slot.batch)?;
        Ok([&slot.text, &[], &[]])
    }

    /// The rows that wait, and the footer: without it nothing reads the file.
    fn closing(&mut self) -> std::io::Result<Vec<u8>> {
        let mut out = Vec::new();
        if self.waiting > 0 || self.writer.is_none() {
            self.pack(&mut out).map_err(std::io::Error::other)?;
        }
        if let Some(writer) = self.writer.take() {
            out.append(&mut writer.into_inner().map_err(std::io::Error::other)?);
        }
        Ok(out)
    }

    fn leaves_out(&self, stream: &Stream) -> bool {
        let is_samples = matches!(stream.content, Content::Samples(_));
        is_samples != (self.rows == Rows::Samples)
    }
}

impl Table {
    /// An empty table for `streams`.
    fn new(streams: &[Stream], provenance: &Provenance, precision: Precision) -> Table {
        let samples = |s: &Stream| matches!(s.content, Content::Samples(_));
        let (rows, columns) = match streams.iter().any(samples) {
            true => (Rows::Samples, sample_columns(precision)),
            false => (Rows::Attitudes, attitude_columns(streams, precision)),
        };
        Table {
            rows,
            columns,
            names: streams.iter().map(|s| s.id.as_str().into()).collect(),
            about: about(rows, streams, provenance),
            waiting: 0,
            writer: None,
        }
    }

    /// Takes a batch; the bytes of what became full by it.
    ///
    /// # Errors
    /// It cannot be packed.
    fn push(&mut self, batch: &Batch) -> std::io::Result<Vec<u8>> {
        let mut out = Vec::new();
        let mut rest = batch.samples.as_slice();
        while !rest.is_empty() {
            let room = GROUP_ROWS.saturating_sub(self.waiting);
            let (now, later) = rest.split_at(room.min(rest.len()));
            self.push_attitudes(batch.stream, now);
            self.pack_when_full(&mut out)?;
            rest = later;
        }
        for sample in &batch.raw {
            self.push_sample(batch.stream, sample);
            self.pack_when_full(&mut out)?;
        }
        Ok(out)
    }

    /// Column by column: what a column holds is asked once for all rows.
    fn push_attitudes(&mut self, stream: usize, samples: &[AttitudeSample]) {
        let sigmas: Vec<_> = samples.iter().map(|s| s.covariance.sigma()).collect();
        for (place, column) in self.columns.iter_mut().enumerate() {
            match place {
                0 => column.extend_whole(samples.iter().map(|s| s.stamp.0)),
                1..=4 => column.extend(samples.iter().map(|s| s.q_nb.wxyz()[place - 1])),
                5..=7 => column.extend(samples.iter().map(|s| s.rate.0[place - 5])),
                8..=10 => column.extend(sigmas.iter().map(|sigma| sigma[place - 8])),
                11 => column.extend_whole(samples.iter().map(|s| i64::from(s.status.0))),
                12 => column.extend_whole(samples.iter().map(|s| i64::from(s.reset_count))),
                13 => column.extend_whole(samples.iter().map(|_| stream as i64)),
                _ if column.name == TEMPERATURE => {
                    for sample in samples {
                        column.push(sample.temperature.map(f64::from));
                    }
                }
                _ => {
                    for sample in samples {
                        column.push(accelerations(sample).map(|of| of[place - 14]));
                    }
                }
            }
        }
        self.waiting += samples.len();
    }

    fn push_sample(&mut self, stream: usize, sample: &RawSample) {
        let vectors = [sample.gyro, sample.accel].map(|v| v.map_or([None; 3], |v| v.map(Some)));
        let orientation = sample.orientation.map_or([None; 4], |q| q.map(Some));
        let numbers = vectors.into_iter().flatten().chain(orientation);
        let whole = [
            Some(sample.header.unwrap_or(sample.log).0),
            Some(sample.log.0),
            sample.interval_nanos,
            Some(stream as i64),
        ];
        let (wholes, rest) = self.columns.split_at_mut(whole.len());
        for (value, column) in whole.into_iter().zip(wholes) {
            column.push_whole(value);
        }
        for (value, column) in numbers.zip(rest) {
            column.push(value);
        }
        self.waiting += 1;
    }

    fn pack_when_full(&mut self, out: &mut Vec<u8>) -> std::io::Result<()> {
        match self.waiting {
            GROUP_ROWS.. => self.pack(out).map_err(std::io::Error::other),
            _ => Ok(()),
        }
    }

    /// Packs the rows that wait as a group.
    fn pack(&mut self, out: &mut Vec<u8>) -> Result<()> {
        let writer = match &mut self.writer {
            Some(writer) => writer,
            empty => empty.insert(begin_file(&self.columns, std::mem::take(&mut self.about))?),
        };
        if self.waiting > 0 {
            let mut group = writer.next_row_group()?;
            for column in &mut self.columns {
                let mut of = group.next_column()?.ok_or_else(|| {
                    ParquetError::General("the schema has fewer columns than the table".to_owned())
                })?;
                column.write(of.untyped(), &self.names)?;
                of.close()?;
            }
            group.close()?;
            self.waiting = 0;
        }
        writer.flush()?;
        out.append(writer.inner_mut());
        Ok(())
    }
}

fn begin_file(columns: &[Column], about: Vec<KeyValue>) -> Result<SerializedFileWriter<Vec<u8>>> {
    let clock = match columns.first().and_then(Column::first_whole) {
        Some(Y2000_NANOS..) => Clock::Unix,
        _ => Clock::Own,
    };
    let fields = columns
        .iter()
        .map(|c| c.field(clock))
        .collect::<Result<_>>()?;
    let schema = Type::group_type_builder("schema")
        .with_fields(fields)
        .build()?;
    let version = env!("CARGO_PKG_VERSION");
    let properties = WriterProperties::builder()
        .set_writer_version(WriterVersion::PARQUET_1_0)
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(1)?))
        .set_dictionary_enabled(false)
        .set_max_row_group_row_count(Some(GROUP_ROWS))
        .set_created_by(format!("strapd version {version}"))
        .set_key_value_metadata(Some(about));
    let properties = columns
        .iter()
        .fold(properties, |p, column| column.packed(p));
    SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties.build()))
}

fn numbers(
    names: &[&'static str],
    precision: Precision,
) -> impl Iterator<Item = (&'static str, Values)> {
    names.iter().map(move |name| {
        let values = match precision {
            Precision::Double => Values::Double(Vec::new()),
            Precision::Single => Values::Single(Vec::new()),
        };
        (*name, values)
    })
}

fn attitude_columns(streams: &[Stream], precision: Precision) -> Vec<Column> {
    let column = |(name, values)| Column::new(name, values);
    let mut columns = vec![Column::new("stamp", Values::Stamp(Vec::new()))];
    columns.extend(numbers(&["qw", "qx", "qy", "qz", "wx", "wy", "wz"], precision).map(column));
    // Three digits of a sigma are more than anybody knows.
    columns.extend(numbers(&["sigma_x", "sigma_y", "sigma_z"], Precision::Single).map(column));
    columns.push(Column::new("status", Values::Int(Vec::new())));
    columns.push(Column::new("reset", Values::Int(Vec::new())));
    columns.push(Column::new("id", Values::Name(Vec::new())));
    if streams.iter().any(|s| s.has_linear_acceleration) {
        let optional = |(name, values)| Column::optional(name, values);
        let (body_and_world, sigma) = ACCELERATIONS.split_at(6);
        columns.extend(numbers(body_and_world, precision).map(optional));
        columns.extend(numbers(sigma, Precision::Single).map(optional));
    }
    if streams.iter().any(|s| s.has_temperature) {
        columns.push(Column::optional(TEMPERATURE, Values::Single(Vec::new())));
    }
    columns
}

fn sample_columns(precision: Precision) -> Vec<Column> {
    let mut columns = vec![
        Column::new("stamp", Values::Stamp(Vec::new())),
        Column::new("true_stamp", Values::Stamp(Vec::new())),
        Column::optional("interval_ns", Values::Long(Vec::new())),
        Column::new("id", Values::Name(Vec::new())),
    ];
    let names = [
        "gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z", "qw", "qx", "qy", "qz",
    ];
    columns.extend(numbers(&names, precision).map(|(name, v)| Column::optional(name, v)));
    columns
}

/// Metadata that a reader must be able to find later.
fn about(rows: Rows, streams: &[Stream], provenance: &Provenance) -> Vec<KeyValue> {
    let units = match rows {
        Rows::Attitudes => {
            "stamp: ns; qw, qx, qy, qz: unit quaternion, scalar first; wx, wy, wz: rad/s about the axes of the body, relative to inertial space, bias taken off; sigma_x, sigma_y, sigma_z: rad about the axes of the body; reset: attitudes with another number are not to be differenced; linear_acceleration: without gravity, m/s^2 along the axes of the body, of the world with world_ before it"
        }
        Rows::Samples => {
            "stamp, true_stamp: ns; gyro_x, gyro_y, gyro_z: rad/s (delta angles: rad); accel_x, accel_y, accel_z: specific force, m/s^2; qw, qx, qy, qz: unit quaternion, scalar first, the truth; interval_ns: what a mean or a delta angle is over"
        }
    };
    let quaternion = "v_world = q v_body q*, Hamilton";
    let bits = (0..u16::BITS)
        .flat_map(|bit| Status(1 << bit).names().map(move |name| (bit, name)))
        .map(|(bit, name)| format!("{}={name}", 1u32 << bit))
        .collect::<Vec<_>>()
        .join(" ");
    let mut about: Vec<KeyValue> = Vec::new();
    let mut put = |key: &str, value: &str| {
        about.push(KeyValue::new(format!("strapd.{key}"), value.to_owned()));
    };
    for (key, value) in &provenance.metadata {
        put(key, value);
    }
    put("columns", units);
    put("quaternion", quaternion);
    if rows == Rows::Attitudes {
        put("status", &bits);
    }
    for stream in streams {
        put(
            &format!("frames {}", stream.id),
            &format!(
                "{}: frame {} with axes {}, in the world {} with axes {}",
                stream.rotates,
                stream.frame_id,
                stream.body_axes,
                stream.world_frame,
                stream.world_axes
            ),
        );
    }
    about
}
