//! Keyword arguments -> a checked plan. Pure but for Python's objects.
//!
//! The rows of the library's table of settings, in Python's own types: a number is a number and a vector a sequence.

use crate::calibration;
use crate::refusal::argument;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::estimate::settings::{ROWS, Row, Takes, Value, defaults};
use strapd_attitude::propagate::Method;
use strapd_attitude::setting::{RATE_HZ, SAMPLE_KIND, TIME};

/// Name of the one setting that no flag has: whether final attitudes follow.
const FINALS: &str = "finals";

/// Keyword of a row; `None` where arrays bring what it says.
fn keyword(row: &Row) -> Option<&'static str> {
    match row.setting {
        SAMPLE_KIND => Some("kind"),
        TIME | RATE_HZ => None,
        _ => Some(row.name()),
    }
}

/// The plan that these settings make, checked; `None` is the same as absent.
pub fn plan(settings: &Bound<'_, PyDict>) -> PyResult<EstimationSettings> {
    let known: Vec<&str> = ROWS.iter().filter_map(keyword).chain([FINALS]).collect();
    for name in settings.keys() {
        let name = name.extract::<String>()?;
        if !known.contains(&name.as_str()) {
            return Err(PyTypeError::new_err(format!(
                "there is no setting {name:?}; there are {}",
                known.join(", ")
            )));
        }
    }
    let given = |name: &str| Ok::<_, PyErr>(settings.get_item(name)?.filter(|v| !v.is_none()));
    let mut plan = defaults();
    for row in &ROWS {
        if let Some(value) = keyword(row).map(given).transpose()?.flatten() {
            put(row, &mut plan, &value)?;
        }
    }
    if let Method::Live { finals, .. } | Method::CommitProvisional { finals, .. } = &mut plan.method
        && let Some(value) = given(FINALS)?
    {
        *finals = value.extract()?;
    }
    plan.check().map_err(argument)?;
    Ok(plan)
}

fn put(row: &Row, plan: &mut EstimationSettings, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let (text, numbers, figures);
    let value = if let Takes::Calibration(_) = row.takes {
        Value::Calibration(Arc::new(calibration::read(value)?))
    } else if let Ok(dict) = value.cast::<PyDict>() {
        figures = named_figures(dict)?;
        Value::Figures(&figures)
    } else if let Ok(is_on) = value.extract::<bool>() {
        Value::Switch(is_on)
    } else if let Ok(number) = value.extract::<f64>() {
        Value::Number(number)
    } else if let Ok(several) = value.extract::<Vec<f64>>() {
        numbers = several;
        Value::Numbers(&numbers)
    } else {
        text = value.str()?.to_string();
        Value::Text(&text)
    };
    row.apply(plan, &value).map_err(argument)
}

/// Figures in the units of data sheets, each one number or three about the body axes.
fn named_figures(dict: &Bound<'_, PyDict>) -> PyResult<Vec<(String, [f64; 3])>> {
    let figure = |(key, figure): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let key = key
            .extract::<String>()
            .map_err(|_| argument("noise: the figures have names"))?;
        let axes = match figure.extract::<f64>() {
            Ok(all) => [all; 3],
            Err(_) => figure.extract().map_err(|_| {
                argument(format!(
                    "noise: '{key}' is one number or three about the body axes, from 0 up"
                ))
            })?,
        };
        Ok::<_, PyErr>((key, axes))
    };
    dict.iter().map(figure).collect()
}

/// Checks settings without data.
#[pyfunction]
pub fn check_settings(settings: &Bound<'_, PyDict>) -> PyResult<()> {
    plan(settings).map(drop)
}
