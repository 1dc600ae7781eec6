//! Attitudes -> columns -> numpy arrays over their memory. Pure but for Python's objects.
//!
//! Columns, because numpy wants one array a quantity; each number is written once, and its memory handed to numpy.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use strapd_attitude::estimate::Noise;
use strapd_attitude::record::AttitudeSample;

/// Numbers of an acceleration: three components and six of a covariance.
const NUMBERS: usize = 9;

/// Attitudes, a column a quantity.
#[derive(Debug)]
pub struct Columns {
    /// Stamps, ns.
    pub t: Vec<i64>,
    /// w, x, y, z of each.
    pub q: Vec<f64>,
    /// Rate about body axes, rad/s.
    pub rate: Vec<f64>,
    /// Upper triangle of the covariance, body axes, rad^2: xx, xy, xz, yy, yz, zz; `None` where none is carried.
    pub cov: Option<Vec<f64>>,
    /// Acceleration without gravity, body axes, m/s^2, and the upper triangle of its covariance, where the first attitude
    /// or a later one carries it; NaN of those that do not.
    pub linear_acceleration: Vec<f64>,
    /// Temperature of the sensor, degrees Celsius, where the first attitude or a later one carries it; NaN of those that
    /// do not.
    pub temperature: Vec<f32>,
    /// Bits of the status.
    pub status: Vec<u16>,
    /// Resets and holds so far.
    pub reset: Vec<u32>,
}

impl Columns {
    /// Makes them with room for so many attitudes of a gyro of this noise.
    pub fn with_room(n: usize, noise: &Noise) -> Columns {
        Columns {
            t: Vec::with_capacity(n),
            q: Vec::with_capacity(4 * n),
            rate: Vec::with_capacity(3 * n),
            cov: (!noise.is_none()).then(|| Vec::with_capacity(6 * n)),
            linear_acceleration: Vec::new(),
            temperature: Vec::new(),
            status: Vec::with_capacity(n),
            reset: Vec::with_capacity(n),
        }
    }

    /// Appends attitudes.
    pub fn extend(&mut self, samples: &[AttitudeSample]) {
        let all = || samples.iter();
        self.t.extend(all().map(|sample| sample.stamp.0));
        self.q.extend(all().flat_map(|sample| sample.q_nb.wxyz()));
        let rates = all().map(|sample| <[f64; 3]>::from(sample.rate.0));
        self.rate.extend(rates.flatten());
        if let Some(cov) = &mut self.cov {
            cov.extend(all().flat_map(|sample| sample.covariance.upper()));
        }
        if all().any(|sample| sample.linear_acceleration.is_some()) {
            let before = NUMBERS * self.status.len();
            self.linear_acceleration.resize(before, f64::NAN);
            for sample in samples {
                match &sample.linear_acceleration {
                    Some(of) => {
                        self.linear_acceleration.extend(of.body.as_vector());
                        self.linear_acceleration.extend(of.covariance);
                    }
                    None => self.linear_acceleration.extend([f64::NAN; NUMBERS]),
                }
            }
        }
        if all().any(|sample| sample.temperature.is_some()) {
            self.temperature.resize(self.status.len(), f32::NAN);
            let temperatures = all().map(|sample| sample.temperature.unwrap_or(f32::NAN));
            self.temperature.extend(temperatures);
        }
        self.status.extend(all().map(|sample| sample.status.0));
        self.reset.extend(all().map(|sample| sample.reset_count));
    }

    /// Converts to numpy arrays; the memory is theirs from here on.
    pub fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("t", self.t.into_pyarray(py))?;
        dict.set_item("q", rows(py, self.q, 4)?)?;
        dict.set_item("rate", rows(py, self.rate, 3)?)?;
        if let Some(cov) = self.cov {
            dict.set_item("cov", rows(py, cov, 6)?)?;
        }
        if !self.linear_acceleration.is_empty() {
            let mut accelerations = self.linear_acceleration;
            accelerations.resize(NUMBERS * self.status.len(), f64::NAN);
            dict.set_item("linear_acceleration", rows(py, accelerations, NUMBERS)?)?;
        }
        if !self.temperature.is_empty() {
            let mut temperature = self.temperature;
            temperature.resize(self.status.len(), f32::NAN);
            dict.set_item("temperature", temperature.into_pyarray(py))?;
        }
        dict.set_item("status", self.status.into_pyarray(py))?;
        dict.set_item("reset", self.reset.into_pyarray(py))?;
        Ok(dict)
    }
}

/// A flat vector as rows of `width`.
pub fn rows(py: Python<'_>, flat: Vec<f64>, width: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let n = flat.len() / width;
    let array: Bound<'_, PyArray1<f64>> = flat.into_pyarray(py);
    array.reshape([n, width])
}
