//! Two attitudes -> how far apart, under the names of `strapd compare --json`. Pure but for Python's objects.

use crate::refusal::{self, argument};
use crate::samples::{Rows, Times};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use strapd_attitude::compare::{
    self as comparing, Align, Consistency, ErrorStats, Stamped, UncertainAttitude, WithinSigma,
    consistency,
};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{AttitudeCovariance, Nanos};
use strapd_attitude::worlds::{Convention, World};

/// Compares an estimate with a reference, each stamps, rows of w, x, y, z, and the world they are in.
#[pyfunction]
#[pyo3(name = "compare", signature = (t, q, world, cov, ref_t, ref_q, ref_world, align, /))]
#[allow(clippy::too_many_arguments)]
pub fn compare<'py>(
    py: Python<'py>,
    t: Times<'py>,
    q: Rows<'py>,
    world: &str,
    cov: Option<Rows<'py>>,
    ref_t: Times<'py>,
    ref_q: Rows<'py>,
    ref_world: &str,
    align: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let align: Align = align
        .parse()
        .map_err(|e| argument(Diagnostic::from(&e).at(format_args!("align: {align:?}"))))?;
    let from = convention("world", world)?;
    let estimate = stamped("a", &t, &q, from)?;
    let reference = stamped("b", &ref_t, &ref_q, convention("ref_world", ref_world)?)?;
    let known = cov.map(|cov| known(&estimate, &cov, from)).transpose()?;
    let (found, within) = py.detach(|| {
        let within = known.and_then(|known| consistency(&known, &reference, align, |_| {}));
        (comparing::compare(&estimate, &reference, align), within)
    });
    if found.errors.is_none() {
        return Err(refusal::run(
            py,
            "no_match",
            Diagnostic::new("no instant in common with the reference")
                .help("are both on the same clock?"),
        ));
    }
    let dict = PyDict::new(py);
    dict.set_item("samples", found.samples)?;
    dict.set_item("span_s", found.span.map(|(a, b)| b.secs_since(a)))?;
    let left_out = PyDict::new(py);
    left_out.set_item("bad_estimates", found.left_out.bad_estimates)?;
    left_out.set_item("bad_references", found.left_out.bad_references)?;
    left_out.set_item("outside", found.left_out.outside)?;
    left_out.set_item("in_gap", found.left_out.in_gap)?;
    dict.set_item("left_out", left_out)?;
    if let Some(errors) = &found.errors {
        dict.set_item("total", stats(py, &errors.total)?)?;
        dict.set_item("heading", stats(py, &errors.heading)?)?;
        dict.set_item("inclination", stats(py, &errors.inclination)?)?;
    }
    let drift = found.drift.map(|drift| {
        let part = PyDict::new(py);
        part.set_item("total", drift.total_deg_per_hour())?;
        part.set_item("heading", drift.heading_deg_per_hour())?;
        Ok::<_, PyErr>(part)
    });
    dict.set_item("drift_deg_per_h", drift.transpose()?)?;
    let relative = found.relative_1s.map(|relative| {
        let part = PyDict::new(py);
        part.set_item("median_deg", relative.median.to_degrees())?;
        part.set_item("p95_deg", relative.p95.to_degrees())?;
        part.set_item("pairs", relative.count)?;
        Ok::<_, PyErr>(part)
    });
    dict.set_item("relative_1s", relative.transpose()?)?;
    dict.set_item(
        "sigma",
        within.map(|within| sigma(py, &within)).transpose()?,
    )?;
    dict.set_item("align", align.name())?;
    Ok(dict)
}

/// World and body of a label; start and level are FLU bodies in a world with z up.
pub(crate) fn convention(name: &str, world: &str) -> PyResult<Convention> {
    let world: World = world
        .parse()
        .map_err(|e| argument(Diagnostic::from(&e).at(name)))?;
    Ok(world.convention().unwrap_or(Convention::EnuFlu))
}

/// Stamped attitudes of arrays, to FLU.
pub(crate) fn stamped(
    name: &str,
    t: &Times<'_>,
    q: &Rows<'_>,
    from: Convention,
) -> PyResult<Vec<Stamped>> {
    let rows = rows(name, t, q)?;
    Ok(rows.map(|(t, q)| (t, in_flu(from, q))).collect())
}

/// Stamps and w, x, y, z as they are.
pub(crate) fn rows<'a>(
    name: &str,
    t: &'a Times<'_>,
    q: &'a Rows<'_>,
) -> PyResult<impl Iterator<Item = (Nanos, [f64; 4])> + use<'a>> {
    let (t, flat) = match (t.as_slice(), q.as_slice()) {
        (Ok(t), Ok(q)) => (t, q),
        _ => return Err(argument(format!("{name}: not C-contiguous"))),
    };
    if q.shape() != [t.len(), 4] {
        return Err(argument(format!(
            "{name}: {} stamps and quaternions of shape {:?}",
            t.len(),
            q.shape()
        )));
    }
    let (rows, _) = flat.as_chunks::<4>();
    Ok(t.iter().zip(rows).map(|(t, q)| (Nanos(*t), *q)))
}

/// Converts to FLU. A row that is no rotation stays what it is, and the comparison counts it.
fn in_flu(from: Convention, wxyz: [f64; 4]) -> Quaternion<Nav, Body> {
    Quaternion::<Nav, Body>::try_from_wxyz(wxyz).map_or_else(
        |_| Quaternion::assume_unit(wxyz),
        |q| Quaternion::assume_unit(from.convert(Convention::EnuFlu, q).wxyz()),
    )
}

fn known(
    estimate: &[Stamped],
    cov: &Rows<'_>,
    from: Convention,
) -> PyResult<Vec<UncertainAttitude>> {
    let covariances = covariances(estimate.len(), cov, from)?;
    let all = estimate.iter().zip(covariances);
    let all = all.map(|((stamp, q_nb), covariance)| UncertainAttitude {
        stamp: *stamp,
        q_nb: *q_nb,
        covariance,
    });
    Ok(all.collect())
}

/// Covariances of `rows` attitudes, about the axes of an FLU body.
pub(crate) fn covariances(
    rows: usize,
    cov: &Rows<'_>,
    from: Convention,
) -> PyResult<Vec<AttitudeCovariance>> {
    if cov.shape() != [rows, 6] {
        return Err(argument(format!(
            "cov: of shape {:?} for {rows} attitudes",
            cov.shape()
        )));
    }
    let flat = cov
        .as_slice()
        .map_err(|_| argument("cov: not C-contiguous"))?;
    let (uppers, _) = flat.as_chunks::<6>();
    let all = uppers.iter().map(|upper| {
        let covariance = AttitudeCovariance::from_upper(*upper);
        match from {
            Convention::EnuFlu => covariance,
            other => covariance.relabelled(|v| other.convert_body(Convention::EnuFlu, v)),
        }
    });
    Ok(all.collect())
}

fn stats<'py>(py: Python<'py>, stats: &ErrorStats) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("rms_deg", stats.rms.to_degrees())?;
    dict.set_item("p95_deg", stats.p95.to_degrees())?;
    dict.set_item("max_deg", stats.max.to_degrees())?;
    dict.set_item("mean_deg", stats.mean.to_degrees())?;
    Ok(dict)
}

fn sigma<'py>(py: Python<'py>, found: &Consistency) -> PyResult<Bound<'py, PyDict>> {
    let part = |part: &WithinSigma| {
        let dict = PyDict::new(py);
        dict.set_item("within_3_sigma", part.inside)?;
        dict.set_item("rms_deg", part.rms.to_degrees())?;
        dict.set_item("sigma_rms_deg", part.sigma.to_degrees())?;
        dict.set_item("worst_in_sigma", part.worst)?;
        Ok::<_, PyErr>(dict)
    };
    let dict = PyDict::new(py);
    dict.set_item("samples", found.samples)?;
    dict.set_item("tilt", part(&found.tilt)?)?;
    dict.set_item("heading", part(&found.heading)?)?;
    dict.set_item("beyond_3_sigma", found.is_beyond())?;
    dict.set_item("align", found.align.name())?;
    dict.set_item("leaning_deg", found.leaning.map(f64::to_degrees))?;
    dict.set_item("reference_noise_deg", found.reference_noise.to_degrees())?;
    Ok(dict)
}
