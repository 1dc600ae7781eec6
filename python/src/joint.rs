//! Attitudes of two bodies -> one relative to the other, as numpy arrays. Pure but for Python's objects.

use crate::compared::{convention, covariances, stamped};
use crate::refusal::{self, argument};
use crate::samples::{Rows, Times};
use numpy::{IntoPyArray, PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::joint::{self as joints, HingeFit, RelativeHeading, Segment};

/// Computes the second body's attitude relative to the first's, each stamps, rows of w, x, y, z, the world they are in.
#[pyfunction]
#[pyo3(name = "relative", signature = (t, q, world, cov, second_t, second_q, second_world, second_cov, heading, /))]
#[allow(clippy::too_many_arguments)]
pub fn relative<'py>(
    py: Python<'py>,
    t: Times<'py>,
    q: Rows<'py>,
    world: &str,
    cov: Option<Rows<'py>>,
    second_t: Times<'py>,
    second_q: Rows<'py>,
    second_world: &str,
    second_cov: Option<Rows<'py>>,
    heading: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let heading: RelativeHeading = heading
        .parse()
        .map_err(|e: Diagnostic| argument(e.at(format_args!("heading: {heading:?}"))))?;
    let from = [
        convention("world", world)?,
        convention("second_world", second_world)?,
    ];
    let first = stamped("a", &t, &q, from[0])?;
    let second = stamped("b", &second_t, &second_q, from[1])?;
    let covariances = |cov: Option<Rows<'py>>, rows, from| {
        cov.map(|cov| covariances(rows, &cov, from)).transpose()
    };
    let of_first = covariances(cov, first.len(), from[0])?.unwrap_or_default();
    let of_second = covariances(second_cov, second.len(), from[1])?.unwrap_or_default();
    let found = py.detach(|| {
        let first = Segment {
            rows: &first,
            covariances: &of_first,
        };
        let second = Segment {
            rows: &second,
            covariances: &of_second,
        };
        joints::joint(first, second, heading)
    });
    let found = found.map_err(|why| refusal::run(py, "no_hinge", Diagnostic::from(&why)))?;
    if found.rows.is_empty() {
        return Err(refusal::run(
            py,
            "no_match",
            Diagnostic::new("no instant in common").help("are both on the same clock?"),
        ));
    }
    let rows = &found.rows;
    let column = |of: fn(&joints::JointAttitude) -> f64| -> Bound<'py, PyArray1<f64>> {
        rows.iter().map(of).collect::<Vec<f64>>().into_pyarray(py)
    };
    let quaternions: Vec<f64> = rows.iter().flat_map(|row| row.q_ab.wxyz()).collect();
    let dict = PyDict::new(py);
    let stamps: Vec<i64> = rows.iter().map(|row| row.stamp.0).collect();
    dict.set_item("t", stamps.into_pyarray(py))?;
    dict.set_item("q", quaternions.into_pyarray(py).reshape([rows.len(), 4])?)?;
    dict.set_item("angle", column(|row| row.angle))?;
    dict.set_item("off_axis", column(|row| row.off_axis))?;
    dict.set_item("sigma", column(|row| row.sigma.unwrap_or(f64::NAN)))?;
    dict.set_item("heading_offset", column(|row| row.heading_offset))?;
    dict.set_item("heading", found.heading.name())?;
    let fit = found.hinge.as_ref().ok();
    dict.set_item("hinge", fit.map(|fit| hinge(py, fit)).transpose()?)?;
    let why = found.hinge.as_ref().err();
    dict.set_item(
        "no_hinge",
        why.map(|why| Diagnostic::from(why).what().to_owned()),
    )?;
    Ok(dict)
}

fn hinge<'py>(py: Python<'py>, fit: &HingeFit) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("axis_first", <[f64; 3]>::from(fit.axis_first))?;
    dict.set_item("axis_second", <[f64; 3]>::from(fit.axis_second))?;
    dict.set_item("misfit_deg", fit.misfit.to_degrees())?;
    let (from, to) = fit.heading_offsets();
    dict.set_item("heading_offset_deg", [from.to_degrees(), to.to_degrees()])?;
    dict.set_item("heading_sigma_deg", fit.heading_sigma().to_degrees())?;
    Ok(dict)
}
