//! A recorded log -> attitudes as numpy arrays, and what became of the run. I/O.
//!
//! The run of `strapd replay`, by the crate that the command has it from (`strapd-replay`), with somebody who puts attitudes into
//! columns in the place of an output: the same bits, and nothing in between.

use crate::calibration;
use crate::columns::Columns;
use crate::errand::{self, Stopped};
use crate::noted::noted;
use crate::refusal;
use crate::words::Words;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::pool::Pool;
use strapd_replay::error::{Error, Result};
use strapd_replay::pipeline::request::ReplayRequest;
use strapd_replay::summary::RunSummary;

/// Attitudes there is room for at first; a log says how many it has when it has been read.
const FIRST_ROOM: usize = 1 << 14;

/// An error of the readers, as Python's.
pub fn raised(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::Usage(what) => refusal::argument_of_log(what),
        Error::Recording(strapd_recording::Error::Topic { .. }) => {
            refusal::run_of_log(py, "refused", &Diagnostic::from(error))
        }
        _ => refusal::run_of_log(py, "failed", &Diagnostic::from(error)),
    }
}

/// `threads` workers; 0 = one per core.
///
/// # Errors
/// The system gives none.
pub fn pool(threads: usize) -> Result<Pool> {
    // A number that no machine has is asked for by mistake.
    if threads > 1024 {
        return Err(Error::usage(format!(
            "threads: {threads} are more than 1024"
        )));
    }
    Ok(Pool::new(threads)?)
}

/// Attitudes by topic (a list of name, columns), the summary as JSON, the calibrations by topic, what was lost in words, and what
/// else was warned of.
type Replayed<'py> = (
    Bound<'py, PyList>,
    String,
    Bound<'py, PyList>,
    Vec<String>,
    Vec<String>,
);

/// Replays the log at `path`; `words` are the command's flags by name, `known` a calibration.
#[pyfunction]
#[pyo3(signature = (path, words, known, /))]
pub fn replay<'py>(
    py: Python<'py>,
    path: PathBuf,
    words: BTreeMap<String, Vec<String>>,
    known: Option<&Bound<'py, PyDict>>,
) -> PyResult<Replayed<'py>> {
    let known = known.map(|dict| calibration::read(dict)).transpose()?;
    let words = Words::new(words);
    let request = words.request(path, known);
    let threads = words.parsed("threads");
    let (request, threads) = request
        .and_then(|request| Ok((request, threads?.unwrap_or(0))))
        .map_err(|error| raised(py, &error))?;
    let noise = request.plan.noise.clone();
    let (done, said) = errand::run(py, move |stopped| {
        noted(|| run(&request, threads, stopped.clone()))
    })?;
    let (columns, summary) = done.map_err(|error| raised(py, &error))?;
    let topics = PyList::empty(py);
    let calibrations = PyList::empty(py);
    let mut columns = columns.into_iter();
    for topic in &summary.topics {
        // A topic without a single attitude has begun nothing.
        let columns = columns
            .next()
            .unwrap_or_else(|| Columns::with_room(0, &noise))
            .into_dict(py)?;
        topics.append((&topic.topic, columns))?;
        calibrations.append(calibration::write(py, &topic.calibration)?)?;
    }
    let lost = match summary.is_lossy() {
        true => losses(&summary),
        false => Vec::new(),
    };
    let said = said.iter().map(|line| refusal::of_log(line)).collect();
    Ok((topics, summary.json().to_string(), calibrations, lost, said))
}

fn run(
    request: &ReplayRequest,
    threads: usize,
    stopped: Stopped,
) -> Result<(Vec<Columns>, RunSummary)> {
    let pool = pool(threads)?;
    let kept = Arc::new(Mutex::new(Vec::<Columns>::new()));
    let taken = kept.clone();
    let noise = request.plan.noise.clone();
    let summary = request.each_attitude(&pool, move |streams, topic, samples| {
        let mut all = taken.lock().unwrap_or_else(PoisonError::into_inner);
        if all.is_empty() {
            all.extend(
                streams
                    .iter()
                    .map(|_| Columns::with_room(FIRST_ROOM, &noise)),
            );
        }
        if let Some(columns) = all.get_mut(topic) {
            columns.extend(samples);
        }
        match stopped.is_set() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    })?;
    let columns = std::mem::take(&mut *kept.lock().unwrap_or_else(PoisonError::into_inner));
    Ok((columns, summary))
}

/// Why the command would end with 3, and its warnings, in the words that `--quiet` leaves.
fn losses(summary: &RunSummary) -> Vec<String> {
    let source = &summary.source;
    let mut said = Vec::new();
    for topic in &summary.topics {
        let (lost, total) = (topic.counts.lost(), topic.counts.total());
        if lost > 0 {
            said.push(format!(
                "{source}: {}: lost {lost} of {total} samples",
                topic.topic
            ));
        }
        let breaks = topic.gaps.held + topic.gaps.resets;
        if breaks > 0 {
            said.push(format!(
                "{source}: {}: {breaks} gaps were not integrated over, {:.3} s in all",
                topic.topic, topic.gaps.held_secs
            ));
        }
        for warning in topic.warnings() {
            said.push(format!(
                "{source}: {}: {}",
                topic.topic,
                refusal::of_log(&warning)
            ));
        }
    }
    for problem in &summary.file_problems {
        said.push(format!("{source}: {problem}"));
    }
    said
}
