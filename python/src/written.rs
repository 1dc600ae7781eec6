//! The bytes of an MCAP that the command writes, uncompressed -> attitudes. Pure but for Python's objects.
//!
//! Not a reader of MCAP: it knows what `strapd replay -o X.mcap --compression none` writes (`sensor_msgs/msg/Imu` in
//! CDR), takes it from a pipe as it comes, and refuses everything else in words. What a user's log holds is read by
//! the command.

use crate::columns::Columns;
use crate::refusal;
use nalgebra::Matrix3;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;

const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const DATA_END: u8 = 0x0F;
const IMU: &str = "sensor_msgs/msg/Imu";
/// No record of ours is longer.
const LONGEST: u64 = 64 << 20;

/// Little-endian numbers and texts from the front of bytes.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(taken)
    }
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }
    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }
    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }
    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }
    fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut all = [0.0; N];
        for value in &mut all {
            *value = f64::from_le_bytes(self.array()?);
        }
        Some(all)
    }
    fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()?;
        std::str::from_utf8(self.take(length as usize)?).ok()
    }
}

/// What has been read.
#[derive(Default)]
struct Read {
    /// Names of schemas.
    schemas: BTreeMap<u16, String>,
    /// Topics of channels that hold attitudes, and these.
    topics: BTreeMap<u16, (String, Columns)>,
    /// A stamp that the messages can not hold.
    is_clipped: bool,
    is_whole: bool,
}

impl Read {
    /// Takes a record.
    fn record(&mut self, kind: u8, body: &[u8]) -> Result<(), String> {
        let done = match kind {
            SCHEMA => self.schema(body),
            CHANNEL => self.channel(body),
            MESSAGE => self.message(body),
            CHUNK => return self.chunk(body),
            DATA_END => {
                self.is_whole = true;
                Some(())
            }
            _ => Some(()),
        };
        done.ok_or_else(|| format!("a record of kind {kind:#04x} can not be read"))
    }

    fn schema(&mut self, body: &[u8]) -> Option<()> {
        let mut bytes = Bytes(body);
        let (id, name) = (bytes.u16()?, bytes.text()?);
        self.schemas.insert(id, name.to_owned());
        Some(())
    }

    fn channel(&mut self, body: &[u8]) -> Option<()> {
        let mut bytes = Bytes(body);
        let (id, schema, topic) = (bytes.u16()?, bytes.u16()?, bytes.text()?);
        if self.schemas.get(&schema).is_some_and(|name| name == IMU) {
            let entry = || (topic.to_owned(), Columns::default());
            self.topics.entry(id).or_insert_with(entry);
        }
        Some(())
    }

    fn message(&mut self, body: &[u8]) -> Option<()> {
        let mut bytes = Bytes(body);
        let channel = bytes.u16()?;
        let Some((_, columns)) = self.topics.get_mut(&channel) else {
            return Some(());
        };
        // Sequence, log time, publish time; then the encapsulation of little-endian CDR.
        bytes.take(4 + 8 + 8)?;
        if bytes.array()? != [0, 1, 0, 0] {
            return None;
        }
        let (sec, nanosec, frame) = (bytes.u32()? as i32, bytes.u32()?, bytes.u32()?);
        let name = frame as usize;
        bytes.take(name)?;
        // Numbers are aligned to 8, counted from behind the encapsulation.
        bytes.take((12 + name).next_multiple_of(8) - (12 + name))?;
        let [x, y, z, w] = bytes.f64s()?;
        let covariance: [f64; 9] = bytes.f64s()?;
        let rate: [f64; 3] = bytes.f64s()?;
        self.is_clipped |= matches!((sec, nanosec), (i32::MAX, 999_999_999) | (i32::MIN, 0));
        columns
            .t
            .push(i64::from(sec) * 1_000_000_000 + i64::from(nanosec));
        columns.q.extend_from_slice(&[w, x, y, z]);
        columns.rate.extend_from_slice(&rate);
        columns
            .cov
            .extend_from_slice(&in_body(&covariance, [w, x, y, z]));
        Some(())
    }

    fn chunk(&mut self, body: &[u8]) -> Result<(), String> {
        let wrong = || "a chunk can not be read".to_owned();
        let mut bytes = Bytes(body);
        bytes.take(8 + 8 + 8 + 4).ok_or_else(wrong)?;
        if !bytes.text().ok_or_else(wrong)?.is_empty() {
            return Err("a chunk is compressed".to_owned());
        }
        let length = bytes.u64().ok_or_else(wrong)?;
        if length != bytes.0.len() as u64 {
            return Err(wrong());
        }
        while let Some((kind, body)) = record(&mut bytes) {
            self.record(kind, body)?;
        }
        if bytes.0.is_empty() {
            Ok(())
        } else {
            Err(wrong())
        }
    }
}

/// The next whole record.
fn record<'a>(bytes: &mut Bytes<'a>) -> Option<(u8, &'a [u8])> {
    let mut ahead = Bytes(bytes.0);
    let [kind] = ahead.array()?;
    let length = usize::try_from(ahead.u64()?).ok()?;
    let body = ahead.take(length)?;
    *bytes = ahead;
    Some((kind, body))
}

/// A covariance about the world's axes, as messages have it, about the body's.
fn in_body(about_world: &[f64; 9], wxyz: [f64; 4]) -> [f64; 6] {
    let q: Quaternion<Nav, Body> = Quaternion::assume_unit(wxyz);
    let c_nb = *q.to_dcm().as_matrix();
    let p = c_nb.transpose() * Matrix3::from_row_slice(about_world) * c_nb;
    [p.m11, p.m12, p.m13, p.m22, p.m23, p.m33]
}

/// Attitudes from bytes that come in pieces.
#[pyclass(module = "strapd._strapd")]
#[derive(Default)]
pub struct Written {
    waiting: Vec<u8>,
    has_begun: bool,
    read: Read,
}

impl Written {
    fn take(&mut self, piece: &[u8]) -> Result<(), String> {
        self.waiting.extend_from_slice(piece);
        let mut bytes = Bytes(&self.waiting);
        if !self.has_begun {
            match bytes.array::<8>() {
                None => return Ok(()),
                Some(MAGIC) => self.has_begun = true,
                Some(_) => return Err("the command wrote something else than attitudes".to_owned()),
            }
        }
        if !self.read.is_whole {
            while let Some((kind, body)) = record(&mut bytes) {
                self.read.record(kind, body)?;
                if self.read.is_whole {
                    break;
                }
            }
            let length = bytes
                .0
                .get(1..9)
                .and_then(|b| b.try_into().ok())
                .map(u64::from_le_bytes);
            if length.is_some_and(|length| length > LONGEST) && !self.read.is_whole {
                return Err("a record is too long".to_owned());
            }
        }
        let rest = bytes.0.len();
        let read = self.waiting.len() - rest;
        // Behind the data an index follows, which is of no use here.
        self.waiting.drain(
            ..if self.read.is_whole {
                read + rest
            } else {
                read
            },
        );
        Ok(())
    }
}

#[pymethods]
impl Written {
    #[new]
    fn new() -> Written {
        Written::default()
    }

    /// Takes the next piece.
    fn push(&mut self, py: Python<'_>, piece: &[u8]) -> PyResult<()> {
        py.detach(|| self.take(piece))
            .map_err(|what| refusal::run(py, "protocol", &what))
    }

    /// Attitudes by topic; an error where the end is missing.
    fn finish<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let read = std::mem::take(&mut self.read);
        if !read.is_whole {
            return Err(refusal::run(
                py,
                "protocol",
                "the attitudes of the command are cut short",
            ));
        }
        if read.is_clipped {
            return Err(refusal::run(
                py,
                "protocol",
                "stamps before 1901 or behind 2038 can not be handed over",
            ));
        }
        let all = PyDict::new(py);
        for (topic, columns) in read.topics.into_values() {
            all.set_item(topic, columns.into_dict(py)?)?;
        }
        Ok(all)
    }
}
