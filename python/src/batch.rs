//! All samples at once -> attitudes. Pure but for Python's objects.
//!
//! The run of a replay of a file, by the crate that the command has it from (`strapd-replay`).

use crate::calibration;
use crate::columns::Columns;
use crate::refusal;
use crate::samples::{Rows, Samples, Times};
use crate::settings;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::time::{Duration, Instant};
use strapd_replay::pipeline::samples::{Stop, estimate as run};
use strapd_replay::summary::TopicSummary;

/// Longest wait for Ctrl-C, beside the samples between two looks.
const PATIENCE: Duration = Duration::from_millis(100);

/// Asks Python for signals, ten times a second.
pub struct Signals {
    last: Instant,
}

impl Signals {
    pub fn new() -> Signals {
        Signals {
            last: Instant::now(),
        }
    }

    /// # Errors
    /// What a handler has raised: `KeyboardInterrupt`.
    pub fn look(&mut self) -> PyResult<()> {
        if self.last.elapsed() < PATIENCE {
            return Ok(());
        }
        self.last = Instant::now();
        Python::attach(|py| py.check_signals())
    }
}

/// Summary as JSON, its warnings with arguments in the place of flags, and the calibration.
pub type Outcome<'py> = (String, Vec<String>, Bound<'py, PyDict>);

/// Makes the outcome of a summary.
pub fn outcome<'py>(py: Python<'py>, summary: &TopicSummary) -> PyResult<Outcome<'py>> {
    let warnings = summary.warnings();
    Ok((
        summary.json().to_string(),
        warnings.iter().map(|w| refusal::in_python(w)).collect(),
        calibration::write(py, &summary.calibration)?,
    ))
}

/// Attitudes of samples that are all there, and what became of them.
#[pyfunction]
#[pyo3(signature = (gyr, t, acc, mag, orientation, dt, settings, /))]
#[allow(clippy::too_many_arguments)]
pub fn estimate<'py>(
    py: Python<'py>,
    gyr: Rows<'py>,
    t: Times<'py>,
    acc: Option<Rows<'py>>,
    mag: Option<Rows<'py>>,
    orientation: Option<Rows<'py>>,
    dt: Option<Times<'py>>,
    settings: &Bound<'py, PyDict>,
) -> PyResult<(Bound<'py, PyDict>, Outcome<'py>)> {
    let plan = settings::plan(settings)?;
    let samples = Samples::new(
        &gyr,
        &t,
        (acc.as_ref(), mag.as_ref()),
        orientation.as_ref(),
        dt.as_ref(),
    )?;
    let (columns, done) = py.detach(|| {
        let mut signals = Signals::new();
        let mut columns = Columns::with_room(samples.len(), &plan.noise);
        let done = run(&plan, samples.part(0, samples.len()), |attitudes| {
            columns.extend(attitudes);
            signals.look()
        });
        (columns, done)
    });
    let done = done.map_err(|stop| match stop {
        Stop::Refused(what) => refusal::run(py, "refused", what),
        Stop::Ended(error) => error,
    })?;
    Ok((columns.into_dict(py)?, outcome(py, &done)?))
}
