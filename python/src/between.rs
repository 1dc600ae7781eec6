//! Attitudes of a run -> attitudes at other instants, as numpy arrays. Pure but for Python's objects.

use crate::compared::rows;
use crate::samples::{Rows, Times};
use nalgebra::Vector3;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, Status};
use strapd_attitude::resample::{CUTS, Resampler};

/// Computes the attitudes at instants in any order: rows of w, x, y, z, NaN where there is none, the number of instants
/// outside the run and of those in gaps.
#[pyfunction]
#[pyo3(signature = (t, q, status, instants, /))]
pub fn at<'py>(
    py: Python<'py>,
    t: Times<'py>,
    q: Rows<'py>,
    status: PyReadonlyArray1<'py, u16>,
    instants: Times<'py>,
) -> PyResult<(Bound<'py, PyArray2<f64>>, usize, usize)> {
    let rows = rows("att", &t, &q)?;
    let (status, instants) = (status.as_array(), instants.as_array());
    let samples: Vec<AttitudeSample> = rows
        .zip(&status)
        .map(|((stamp, q), status)| AttitudeSample {
            stamp,
            q_nb: Quaternion::assume_unit(q),
            rate: BodyRate(Vector3::zeros()),
            accel: None,
            linear_acceleration: None,
            covariance: AttitudeCovariance::default(),
            // What is provisional is all there is.
            status: Status(status & CUTS.0),
            reset_count: 0,
            log: stamp,
            temperature: None,
        })
        .collect();
    let mut ordered: Vec<(usize, Nanos)> =
        instants.iter().map(|at| Nanos(*at)).enumerate().collect();
    let (numbers, left) = py.detach(|| {
        ordered.sort_by_key(|(_, instant)| *instant);
        let mut found = Vec::with_capacity(ordered.len());
        let mut resampler = Resampler::new(ordered.iter().map(|(_, at)| *at).collect::<Vec<_>>());
        resampler.push(&samples, &mut found);
        resampler.finish(&mut found);
        let mut numbers = vec![f64::NAN; 4 * ordered.len()];
        let mut found = found.iter().peekable();
        for (place, instant) in &ordered {
            if let Some(attitude) = found.next_if(|attitude| attitude.stamp == *instant)
                && let Some(row) = numbers.get_mut(4 * place..4 * place + 4)
            {
                row.copy_from_slice(&attitude.q_nb.wxyz());
            }
        }
        (numbers, resampler.left())
    });
    let rows = numbers.into_pyarray(py).reshape([ordered.len(), 4])?;
    Ok((rows, left.outside, left.in_gaps))
}
