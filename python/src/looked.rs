//! A recorded log -> what is in it, and what may spoil its attitude, as JSON. I/O.
//!
//! What `strapd info --json` and `strapd check --json` say, of the same numbers (`strapd-replay`); a test holds both
//! beside each other.

use crate::errand;
use crate::noted::noted;
use crate::recorded::{pool, raised};
use crate::refusal;
use pyo3::prelude::*;
use serde_json::json;
use std::path::PathBuf;
use strapd_recording::Recording;
use strapd_recording::decode::Options;
use strapd_recording::recording::opened::problems;
use strapd_replay::error::Result;
use strapd_replay::findings::{Finding, Severity, findings};
use strapd_replay::info::Overview;
use strapd_replay::pipeline::check;
use strapd_replay::pipeline::inspection::look;
use strapd_replay::pipeline::opening;

/// Contents of the log at `path`: JSON, and warnings.
#[pyfunction]
#[pyo3(signature = (path, /))]
pub fn info(py: Python<'_>, path: PathBuf) -> PyResult<(String, Vec<String>)> {
    let work = move || {
        let pool = pool(0)?;
        let options = Options::default();
        let input = opening::open(&path)?;
        let log = Recording::told_apart(&input, None, &options, &pool)?;
        let looks = look(&log, None, &options, &pool)?;
        let info = Overview {
            input: &input,
            made_before: log.made_before(),
            survey: &looks.survey,
            problems: problems(&looks.survey),
            channels: &log.channels,
            looked: &looks.topics,
            left_out: &looks.left_out,
        };
        Ok(info.json().to_string())
    };
    answered(py, work)
}

/// Everything in the log at `path` that may spoil the attitude: JSON, and what was warned of.
#[pyfunction]
#[pyo3(signature = (path, topic, /))]
pub fn check_log(
    py: Python<'_>,
    path: PathBuf,
    topic: Option<String>,
) -> PyResult<(String, Vec<String>)> {
    let work = move || {
        let pool = pool(0)?;
        let input = opening::open(&path)?;
        let checked = check::check(&input, topic.as_deref(), &Options::default(), &pool)?;
        let found = findings(&checked);
        let worst = found.iter().map(|f| f.severity).max();
        let answer = json!({
            "file": input.name().display().to_string(),
            "findings": found.iter().map(Finding::json).collect::<Vec<_>>(),
            "worst": worst.map(Severity::name),
        });
        Ok(answer.to_string())
    };
    answered(py, work)
}

fn answered(
    py: Python<'_>,
    work: impl FnOnce() -> Result<String> + Send + 'static,
) -> PyResult<(String, Vec<String>)> {
    let (done, said) = errand::run(py, move |_| noted(work))?;
    let answer = done.map_err(|error| raised(py, &error))?;
    Ok((
        answer,
        said.iter().map(|line| refusal::of_log(line)).collect(),
    ))
}
