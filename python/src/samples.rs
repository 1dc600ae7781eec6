//! Arrays, one row a sample -> raw samples. Pure but for Python's objects.
//!
//! The Python half has made them float64 and int64, C-contiguous, of one length; all of that is checked again here,
//! where it counts.

use crate::refusal::argument;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use strapd_attitude::record::{Nanos, RawSample};

/// Rows of one array.
pub type Rows<'py> = PyReadonlyArray2<'py, f64>;
/// Nanoseconds.
pub type Times<'py> = PyReadonlyArray1<'py, i64>;

/// Borrowed arrays of one length: nothing is copied.
#[derive(Clone, Copy)]
pub struct Samples<'a> {
    t: &'a [i64],
    gyr: &'a [[f64; 3]],
    acc: Option<&'a [[f64; 3]]>,
    mag: Option<&'a [[f64; 3]]>,
    orientation: Option<&'a [[f64; 4]]>,
    dt: Option<&'a [i64]>,
}

fn rows<'a, const N: usize>(name: &str, array: &'a Rows<'_>, n: usize) -> PyResult<&'a [[f64; N]]> {
    if array.shape() != [n, N] {
        return Err(argument(format!(
            "{name}: of shape {:?}, and ({n}, {N}) is needed",
            array.shape()
        )));
    }
    let flat = array
        .as_slice()
        .map_err(|_| argument(format!("{name}: not C-contiguous")))?;
    let (rows, _) = flat.as_chunks::<N>();
    Ok(rows)
}

fn times<'a>(name: &str, array: &'a Times<'_>, n: usize) -> PyResult<&'a [i64]> {
    let times = array
        .as_slice()
        .map_err(|_| argument(format!("{name}: not C-contiguous")))?;
    if times.len() != n {
        return Err(argument(format!(
            "{name}: {} of them for {n} samples",
            times.len()
        )));
    }
    Ok(times)
}

impl<'a> Samples<'a> {
    /// Makes them of these arrays.
    pub fn new(
        gyr: &'a Rows<'_>,
        t: &'a Times<'_>,
        (acc, mag): (Option<&'a Rows<'_>>, Option<&'a Rows<'_>>),
        orientation: Option<&'a Rows<'_>>,
        dt: Option<&'a Times<'_>>,
    ) -> PyResult<Samples<'a>> {
        let n = gyr.shape().first().copied().unwrap_or(0);
        Ok(Samples {
            t: times("t", t, n)?,
            gyr: rows("gyr", gyr, n)?,
            acc: acc.map(|a| rows("acc", a, n)).transpose()?,
            mag: mag.map(|a| rows("mag", a, n)).transpose()?,
            orientation: orientation.map(|a| rows("orientation", a, n)).transpose()?,
            dt: dt.map(|a| times("dt", a, n)).transpose()?,
        })
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.gyr.len()
    }

    /// Samples of a range, in order.
    pub fn part(self, from: usize, to: usize) -> impl Iterator<Item = RawSample> + Clone {
        (from..to.min(self.len())).filter_map(move |i| self.get(i))
    }

    fn get(self, i: usize) -> Option<RawSample> {
        let stamp = Nanos(*self.t.get(i)?);
        Some(sample(
            stamp,
            *self.gyr.get(i)?,
            self.acc.and_then(|rows| rows.get(i).copied()),
            self.mag.and_then(|rows| rows.get(i).copied()),
            self.orientation.and_then(|rows| rows.get(i).copied()),
            self.dt.and_then(|dt| dt.get(i).copied()),
        ))
    }
}

/// One sample. A vector of which a number is NaN is absent, but for the rate: that is a bad sample, and counted.
pub fn sample(
    stamp: Nanos,
    gyr: [f64; 3],
    acc: Option<[f64; 3]>,
    mag: Option<[f64; 3]>,
    orientation: Option<[f64; 4]>,
    dt: Option<i64>,
) -> RawSample {
    let is_there = |v: &[f64; 3]| !v.iter().any(|x| x.is_nan());
    RawSample {
        header: Some(stamp),
        log: stamp,
        publish: stamp,
        gyro: Some(gyr),
        accel: acc.filter(is_there),
        mag: mag.filter(is_there),
        orientation: orientation.filter(|q| !q.iter().any(|x| x.is_nan())),
        orientation_resets: None,
        interval_nanos: dt.filter(|dt| *dt > 0),
        temperature: None,
        is_beside: false,
    }
}
