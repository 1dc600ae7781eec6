//! State of a live estimator -> a dict, under the names of `strapd replay --json`. Pure but for Python's objects.
//!
//! Apart from the summary of a replay because it is asked for with every few samples.

use crate::calibration;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use strapd_attitude::aid::{Calibration, Filter};
use strapd_attitude::estimate::{Estimator, Meaning, Plan, Prepared, learned};
use strapd_attitude::record::Verdict;

/// Makes the dict of an estimator as it is now.
pub fn of<'py>(
    py: Python<'py>,
    plan: &Plan,
    meaning: &Meaning,
    prepared: &Prepared,
    estimator: &Estimator,
) -> PyResult<Bound<'py, PyDict>> {
    let (report, propagation) = (estimator.conditioning(), estimator.propagation());
    let facts = PyDict::new(py);
    let by_verdict = PyDict::new(py);
    for verdict in Verdict::ALL {
        by_verdict.set_item(verdict.name(), report.counts.get(verdict))?;
    }
    let samples = PyDict::new(py);
    samples.set_item("total", report.counts.total())?;
    samples.set_item("used", report.counts.used())?;
    samples.set_item("lost", report.counts.lost())?;
    samples.set_item("by_verdict", by_verdict)?;
    facts.set_item("samples", samples)?;
    let gaps = PyDict::new(py);
    gaps.set_item("bridged", propagation.bridged)?;
    gaps.set_item("held", propagation.holds)?;
    gaps.set_item("resets", propagation.resets)?;
    gaps.set_item("total_s", report.gaps.total_nanos as f64 * 1e-9)?;
    gaps.set_item(
        "not_integrated_s",
        report.gaps.not_bridged_nanos.0 as f64 * 1e-9,
    )?;
    gaps.set_item("longest_s", report.gaps.longest_nanos.max(0) as f64 * 1e-9)?;
    facts.set_item("gaps", gaps)?;
    let (world, body) = meaning.labels(prepared.world);
    facts.set_item("world", world)?;
    facts.set_item("body", body)?;
    facts.set_item("sample_kind", meaning.kind.name())?;
    facts.set_item("method", estimator.method().to_string())?;
    facts.set_item("clock", prepared.clock.name())?;
    facts.set_item("initial", &prepared.initial_origin)?;
    facts.set_item("noise", &plan.noise.name)?;
    facts.set_item(
        "rate_hz",
        report
            .spacing_nanos
            .filter(|n| *n > 0)
            .map(|n| 1e9 / n as f64),
    )?;
    let secs = report
        .first
        .zip(report.last)
        .map(|(first, last)| last.secs_since(first));
    facts.set_item("duration_s", secs)?;
    facts.set_item(
        "integration_error_deg",
        propagation.integration_error.map(f64::to_degrees),
    )?;
    facts.set_item("turned_deg", propagation.angle_turned.to_degrees())?;
    facts.set_item("largest_step_deg", propagation.largest_step.to_degrees())?;
    facts.set_item("undersampled_steps", propagation.undersampled)?;
    let bias = PyDict::new(py);
    for (name, value) in ["x", "y", "z"].iter().zip(prepared.bias.0.iter()) {
        bias.set_item(name, value)?;
    }
    bias.set_item("origin", &prepared.bias_origin)?;
    facts.set_item("bias_rad_s", bias)?;
    facts.set_item("bias_sigma_rad_s", <[f64; 3]>::from(prepared.bias_sigma))?;
    facts.set_item(
        "aid",
        estimator
            .filter()
            .map(|filter| aid(py, filter))
            .transpose()?,
    )?;
    let warnings: Vec<String> = prepared
        .warnings
        .iter()
        .map(|w| crate::refusal::in_python(&w.to_string()))
        .collect();
    facts.set_item("warnings", warnings)?;
    let known = learned((plan, meaning, prepared), estimator.filter(), None);
    facts.set_item("calibration", calibration::write(py, &known)?)?;
    Ok(facts)
}

fn aid<'py>(py: Python<'py>, filter: &Filter) -> PyResult<Bound<'py, PyDict>> {
    let (report, dict) = (filter.report(), PyDict::new(py));
    dict.set_item(
        "by",
        if filter.has_field() {
            "gravity+mag"
        } else {
            "gravity"
        },
    )?;
    dict.set_item("started", filter.is_started())?;
    dict.set_item("at_rest", filter.is_at_rest())?;
    dict.set_item("beyond_class", filter.is_beyond_class())?;
    dict.set_item("force_implausible", filter.is_force_implausible())?;
    for (name, count) in [
        ("corrections", report.updates),
        ("fields", report.fields),
        ("fields_doubted", report.fields_rejected),
        ("fields_unpaired", report.fields_unpaired),
        ("forces_unpaired", report.forces_unpaired),
        ("levelled", report.levelled),
        ("reference_restarts", report.restarts),
        ("gaps", report.gaps),
        ("forces_rejected", report.forces_rejected),
        ("saturated", report.saturated),
        ("full_restarts", report.failures),
    ] {
        dict.set_item(name, count)?;
    }
    dict.set_item("learned", numbers(py, filter.calibration())?)?;
    dict.set_item("sigma", numbers(py, &filter.calibration_sigma())?)?;
    Ok(dict)
}

fn numbers<'py>(py: Python<'py>, known: &Calibration) -> PyResult<Bound<'py, PyDict>> {
    const PPM: f64 = 1e6;
    let dict = PyDict::new(py);
    dict.set_item("gyro_bias_rad_s", <[f64; 3]>::from(known.bias))?;
    dict.set_item("gyro_scale_ppm", <[f64; 3]>::from(known.scale * PPM))?;
    dict.set_item("gyro_cross_rad", <[f64; 3]>::from(known.cross))?;
    dict.set_item("accel_bias_m_s2", <[f64; 3]>::from(known.force_bias))?;
    dict.set_item("accel_lead_s", known.lead)?;
    dict.set_item("mag_hard_iron", <[f64; 3]>::from(known.hard_iron))?;
    Ok(dict)
}
