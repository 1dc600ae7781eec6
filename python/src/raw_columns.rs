//! Samples as recorded -> columns -> numpy arrays over their memory. Pure but for Python's objects.
//!
//! The way back of [`crate::samples`]: what a log holds, or a simulation makes, in the form that `strapd.estimate`
//! takes.

use crate::columns::rows;
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use strapd_attitude::record::{Nanos, RawSample};

/// Stamp of a sample that counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Time {
    /// Stamp of the sensor, where the sample has one; else as recorded.
    Header,
    /// Time at which it was recorded.
    Log,
    /// Time at which it was sent.
    Publish,
}

/// Vectors that may be absent: NaN in the rows of samples that have none.
#[derive(Debug, Default)]
struct Vectors {
    flat: Vec<f64>,
    is_there: bool,
}

impl Vectors {
    fn push<const N: usize>(&mut self, vector: Option<[f64; N]>) {
        self.is_there |= vector.is_some();
        self.flat
            .extend_from_slice(&vector.unwrap_or([f64::NAN; N]));
    }

    /// Rows, or `None` where nothing was ever there.
    fn into_rows(self, py: Python<'_>, width: usize) -> PyResult<Option<Bound<'_, PyAny>>> {
        let rows = self.is_there.then(|| rows(py, self.flat, width));
        Ok(rows.transpose()?.map(Bound::into_any))
    }
}

/// Readings with stamps of their own.
#[derive(Debug, Default)]
struct Apart {
    t: Vec<i64>,
    flat: Vec<f64>,
}

impl Apart {
    fn push(&mut self, at: Nanos, vector: [f64; 3]) {
        self.t.push(at.0);
        self.flat.extend_from_slice(&vector);
    }
}

/// Samples, a column a quantity.
#[derive(Debug)]
pub struct RawColumns {
    time: Time,
    t: Vec<i64>,
    log: Vec<i64>,
    gyr: Vectors,
    acc: Vectors,
    mag: Vectors,
    orientation: Vectors,
    dt: Vec<i64>,
    has_dt: bool,
    forces: Apart,
    fields: Apart,
}

impl RawColumns {
    /// Makes an empty set.
    pub fn new(time: Time) -> RawColumns {
        RawColumns {
            time,
            t: Vec::new(),
            log: Vec::new(),
            gyr: Vectors::default(),
            acc: Vectors::default(),
            mag: Vectors::default(),
            orientation: Vectors::default(),
            dt: Vec::new(),
            has_dt: false,
            forces: Apart::default(),
            fields: Apart::default(),
        }
    }

    /// Appends a sample.
    pub fn push(&mut self, raw: &RawSample) {
        let at = match self.time {
            Time::Header => raw.header.unwrap_or(raw.log),
            Time::Log => raw.log,
            Time::Publish => raw.publish,
        };
        if raw.is_beside {
            for (apart, vector) in [(&mut self.forces, raw.accel), (&mut self.fields, raw.mag)] {
                if let Some(vector) = vector {
                    apart.push(at, vector);
                }
            }
            return;
        }
        self.t.push(at.0);
        self.log.push(raw.log.0);
        self.gyr.push(raw.gyro);
        self.acc.push(raw.accel);
        self.mag.push(raw.mag);
        self.orientation.push(raw.orientation);
        let dt = raw.interval_nanos.unwrap_or(0);
        self.has_dt |= dt > 0;
        self.dt.push(dt);
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Converts to numpy arrays; what no sample has is `None`. A vector with stamps of its own has them under `..._t`.
    pub fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("t", self.t.into_pyarray(py))?;
        dict.set_item("log_t", self.log.into_pyarray(py))?;
        dict.set_item("gyr", rows(py, self.gyr.flat, 3)?)?;
        for (name, stamps, own, apart) in [
            ("acc", "acc_t", self.acc, self.forces),
            ("mag", "mag_t", self.mag, self.fields),
        ] {
            let own = own.into_rows(py, 3)?;
            if own.is_none() && !apart.t.is_empty() {
                dict.set_item(name, rows(py, apart.flat, 3)?)?;
                dict.set_item(stamps, apart.t.into_pyarray(py))?;
            } else {
                dict.set_item(name, own)?;
                dict.set_item(stamps, py.None())?;
            }
        }
        dict.set_item("orientation", self.orientation.into_rows(py, 4)?)?;
        let dt = self.has_dt.then(|| self.dt.into_pyarray(py));
        dict.set_item("dt", dt)?;
        Ok(dict)
    }
}
