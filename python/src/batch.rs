//! All samples at once -> attitudes. Pure but for Python's objects.
//!
//! The steps of a replay of a file: the samples are looked at once as far as is needed to know clock, bias, initial
//! attitude and lines through stamps, then integrated.

use crate::columns::Columns;
use crate::facts;
use crate::refusal;
use crate::samples::{Rows, Samples, Times};
use crate::settings;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::time::{Duration, Instant};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{
    Aid, Estimator, Meaning, Patience, Plan, Preparation, Prepared, StampPass,
};
use strapd_attitude::propagate::Sequential;
use strapd_attitude::record::Declared;

/// Samples between two looks at the clock.
const BLOCK: usize = 4096;
/// How long Ctrl-C waits at most, beside one block.
const PATIENCE: Duration = Duration::from_millis(100);

/// Why there is no attitude.
enum Stop {
    /// In words.
    Refused(Diagnostic),
    /// Python wants to be asked: Ctrl-C.
    Interrupted(PyErr),
}

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
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let plan = settings::plan(settings, Aid::Auto)?;
    let samples = Samples::new(
        &gyr,
        &t,
        (acc.as_ref(), mag.as_ref()),
        orientation.as_ref(),
        dt.as_ref(),
    )?;
    let meaning = Meaning::new(&plan, &Declared::default());
    let computed = py.detach(|| compute(&plan, &meaning, samples));
    let (columns, prepared, estimator) = computed.map_err(|stop| match stop {
        Stop::Refused(what) => refusal::run(py, "refused", what),
        Stop::Interrupted(error) => error,
    })?;
    let facts = facts::of(py, &plan, &meaning, &prepared, &estimator)?;
    Ok((columns.into_dict(py)?, facts))
}

fn compute(
    plan: &Plan,
    meaning: &Meaning,
    samples: Samples<'_>,
) -> Result<(Columns, Prepared, Estimator), Stop> {
    let mut signals = Signals::new();
    let mut look = || signals.look().map_err(Stop::Interrupted);
    let blocks = || {
        (0..samples.len())
            .step_by(BLOCK)
            .map(|from| (from, from + BLOCK))
    };
    let mut preparation = Preparation::new(plan, meaning, Patience::WholeLog)
        .with_stamps(StampPass::new(plan, meaning, []));
    for (from, to) in blocks() {
        for raw in samples.part(from, to) {
            preparation.take(&raw).map_err(Stop::Refused)?;
        }
        if !preparation.wants_more() {
            break;
        }
        look()?;
    }
    let prepared = preparation.decide().map_err(Stop::Refused)?;
    let mut estimator = Estimator::new(plan, meaning, &prepared).map_err(Stop::Refused)?;
    let mut columns = Columns::with_room(samples.len());
    for (from, to) in blocks() {
        for raw in samples.part(from, to) {
            estimator.take(&raw);
        }
        columns.extend(estimator.attitudes(&Sequential));
        look()?;
    }
    columns.extend(&estimator.finish(&Sequential));
    Ok((columns, prepared, estimator))
}
