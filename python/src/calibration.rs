//! The calibration of a sensor <-> a dict, under the names of its file (`docs/calibration.md`). Pure but for Python's
//! objects.

use crate::refusal::argument;
use pyo3::BoundObject;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{CalibrationTerm, SensorCalibration};

/// The keys of a calibration that hold text.
const TEXTS: [&str; 4] = ["strapd_calibration", "sensor", "date", "sources"];

/// Reads one from a dict.
pub fn read(value: &Bound<'_, PyAny>) -> PyResult<SensorCalibration> {
    let dict = value
        .cast::<PyDict>()
        .map_err(|_| argument("calibration: a dict is expected, or the name of a file"))?;
    let mut known = SensorCalibration::default();
    for (key, value) in dict.iter() {
        let key: String = key
            .extract()
            .map_err(|_| argument("calibration: its keys are names"))?;
        if value.is_none() || TEXTS.contains(&key.as_str()) {
            if key == "sensor" && !value.is_none() {
                known.sensor = value.extract().ok();
            }
            continue;
        }
        match key.as_str() {
            "bias" => known.bias = Some(part(&key, &value)?),
            "G" => known.gyro = Some(part(&key, &value)?),
            "ba" => known.force_bias = Some(part(&key, &value)?),
            "A" => known.force = Some(part(&key, &value)?),
            "lead" => known.lead = Some(part(&key, &value)?),
            "h" => known.hard_iron = Some(part(&key, &value)?),
            "S" => known.soft_iron = Some(part(&key, &value)?),
            "mag_lead" => known.field_lead = Some(part(&key, &value)?),
            "truncation_step" => known.truncation_step = Some(part(&key, &value)?),
            _ => {
                return Err(argument(Diagnostic::new(format!("calibration: there is no '{key}'")).help("bias, G, ba, A, lead, h, S, mag_lead, truncation_step, sensor, date, sources")));
            }
        }
    }
    Ok(known)
}

/// N numbers: one, a list of 3, or 3 lists of 3.
fn leaves<'py, const N: usize>(
    key: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<[Bound<'py, PyAny>; N]> {
    let wrong = || argument(format!("calibration: '{key}' has not {N} values"));
    let mut all = Vec::with_capacity(N);
    match N {
        1 => all.push(value.clone()),
        3 => all.extend(
            value
                .extract::<[Bound<'py, PyAny>; 3]>()
                .map_err(|_| wrong())?,
        ),
        _ => {
            for row in value
                .extract::<[Bound<'py, PyAny>; 3]>()
                .map_err(|_| wrong())?
            {
                all.extend(
                    row.extract::<[Bound<'py, PyAny>; 3]>()
                        .map_err(|_| wrong())?,
                );
            }
        }
    }
    all.try_into().map_err(|_| wrong())
}

fn numbers<const N: usize>(key: &str, value: &Bound<'_, PyAny>) -> PyResult<[f64; N]> {
    let mut out = [0.0; N];
    for (to, from) in out.iter_mut().zip(leaves::<N>(key, value)?) {
        *to = from.extract().map_err(|_| {
            argument(format!(
                "calibration: '{key}' holds something that is no number"
            ))
        })?;
    }
    Ok(out)
}

fn part<const N: usize>(key: &str, value: &Bound<'_, PyAny>) -> PyResult<CalibrationTerm<N>> {
    let Ok(dict) = value.cast::<PyDict>() else {
        return Ok(CalibrationTerm {
            value: numbers(key, value)?,
            sigma: None,
            observed: [true; N],
        });
    };
    let get = |name: &str| Ok::<_, PyErr>(dict.get_item(name)?.filter(|v| !v.is_none()));
    let value =
        get("value")?.ok_or_else(|| argument(format!("calibration: '{key}' has no value")))?;
    let observed = match get("observed")? {
        None => [true; N],
        Some(all) => match all.extract::<bool>() {
            Ok(all) => [all; N],
            Err(_) => {
                let mut out = [true; N];
                for (to, from) in out.iter_mut().zip(leaves::<N>(key, &all)?) {
                    *to = from.extract().map_err(|_| {
                        argument(format!(
                            "calibration: 'observed' of '{key}' is True or False"
                        ))
                    })?;
                }
                out
            }
        },
    };
    Ok(CalibrationTerm {
        value: numbers(key, &value)?,
        sigma: get("sigma")?
            .map(|sigma| numbers(key, &sigma))
            .transpose()?,
        observed,
    })
}

/// Writes a dict that [`read`] takes.
pub fn write<'py>(py: Python<'py>, known: &SensorCalibration) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    if let Some(sensor) = &known.sensor {
        dict.set_item("sensor", sensor)?;
    }
    put(&dict, "bias", known.bias.as_ref())?;
    put(&dict, "G", known.gyro.as_ref())?;
    put(&dict, "ba", known.force_bias.as_ref())?;
    put(&dict, "A", known.force.as_ref())?;
    put(&dict, "lead", known.lead.as_ref())?;
    put(&dict, "h", known.hard_iron.as_ref())?;
    put(&dict, "S", known.soft_iron.as_ref())?;
    put(&dict, "mag_lead", known.field_lead.as_ref())?;
    put(&dict, "truncation_step", known.truncation_step.as_ref())?;
    Ok(dict)
}

fn put<const N: usize>(
    dict: &Bound<'_, PyDict>,
    key: &str,
    known: Option<&CalibrationTerm<N>>,
) -> PyResult<()> {
    let Some(known) = known else {
        return Ok(());
    };
    let py = dict.py();
    let part = PyDict::new(py);
    part.set_item("value", shaped(py, &known.value)?)?;
    if let Some(sigma) = &known.sigma {
        part.set_item("sigma", shaped(py, sigma)?)?;
    }
    part.set_item("observed", shaped(py, &known.observed)?)?;
    dict.set_item(key, part)
}

/// One value alone, three as a list, nine as lists of rows.
fn shaped<'py, T: Copy + IntoPyObject<'py>, const N: usize>(
    py: Python<'py>,
    all: &[T; N],
) -> PyResult<Bound<'py, PyAny>> {
    let list = |part: &[T]| PyList::new(py, part.iter().copied());
    Ok(match (N, all.first()) {
        (1, Some(one)) => (*one)
            .into_pyobject(py)
            .map_err(Into::into)?
            .into_bound()
            .into_any(),
        (9, _) => {
            let rows: Vec<Bound<'py, PyList>> = all.chunks(3).map(list).collect::<PyResult<_>>()?;
            PyList::new(py, rows)?.into_any()
        }
        _ => list(all)?.into_any(),
    })
}
