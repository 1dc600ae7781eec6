//! Samples as they come -> attitudes. Pure but for Python's objects.
//!
//! Begins as the daemon does: by its first sample alone, since its attitude must not wait.

use crate::batch::{Outcome, Signals, outcome};
use crate::columns::Columns;
use crate::refusal::{self, argument};
use crate::samples::{Rows, Samples, Times, sample};
use crate::settings;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use strapd_attitude::aid::OutsideHeading;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{EstimationSettings, Estimator, Meaning, Prepared, at_once};
use strapd_attitude::propagate::Sequential;
use strapd_attitude::record::{AttitudeSample, Declared, Nanos, RawSample};
use strapd_replay::pipeline::samples::so_far;

/// Samples between two looks for Ctrl-C.
const BLOCK: usize = 4096;

/// Refusal of a heading that nothing can use.
const NO_VERTICAL: &str = "heading: a number is expected, of a sensor whose vertical is known (a specific force, and aid other than \"none\")";

/// An attitude as it is told at once: `(t, (w, x, y, z))`.
type AttitudeTuple = (i64, (f64, f64, f64, f64));

/// A live estimator of one sensor.
#[pyclass(subclass, module = "strapd._strapd")]
pub struct Live {
    plan: EstimationSettings,
    meaning: Meaning,
    running: Option<(Estimator, Prepared)>,
    last: Option<AttitudeSample>,
    /// Samples a second, where stamps are counted.
    rate_hz: Option<f64>,
    taken: u64,
    /// Attitudes that were given.
    given: u64,
    is_closed: bool,
}

impl Live {
    /// The estimator, which begins with this sample.
    fn running(&mut self, first: &RawSample) -> Result<&mut Estimator, Diagnostic> {
        if self.running.is_none() {
            let prepared = at_once(&self.plan, &self.meaning, std::slice::from_ref(first))?;
            let estimator = Estimator::live(&self.plan, &self.meaning, &prepared)?;
            self.running = Some((estimator, prepared));
        }
        match &mut self.running {
            Some((estimator, _)) => Ok(estimator),
            None => Err("no estimator".into()),
        }
    }

    /// The estimator, once a sample has come.
    fn begun(&mut self, py: Python<'_>) -> PyResult<&mut Estimator> {
        self.check_open(py)?;
        match &mut self.running {
            Some((estimator, _)) => Ok(estimator),
            None => Err(argument(
                "heading: no sample has come yet, whose it could be",
            )),
        }
    }

    fn check_open(&self, py: Python<'_>) -> PyResult<()> {
        if self.is_closed {
            return Err(refusal::run(
                py,
                "closed",
                Diagnostic::new("the estimator is finished").help("a new one begins anew"),
            ));
        }
        Ok(())
    }

    /// The stamp of the next sample.
    fn stamp(&mut self, t: Option<&Bound<'_, PyAny>>) -> PyResult<Nanos> {
        let n = self.taken;
        self.taken += 1;
        match (t, self.rate_hz) {
            (Some(t), None) => nanos(t),
            (None, Some(rate_hz)) => Ok(Nanos(counted(n, rate_hz))),
            (None, None) => Err(argument(
                "t: needed, unless the estimator was made with rate_hz",
            )),
            (Some(_), Some(_)) => Err(argument(
                "t: the estimator was made with rate_hz and counts",
            )),
        }
    }
}

/// The stamp of the n-th of samples that are counted. Whole nanoseconds of the period and the rest apart, so that
/// n periods lose nothing.
fn counted(n: u64, rate_hz: f64) -> i64 {
    let period = 1e9 / rate_hz;
    n as i64 * period as i64 + (n as f64 * period.fract() + 0.5).floor() as i64
}

/// Integer nanoseconds, or seconds as a float.
fn nanos(t: &Bound<'_, PyAny>) -> PyResult<Nanos> {
    if let Ok(nanos) = t.extract::<i64>() {
        return Ok(Nanos(nanos));
    }
    let secs: f64 = t
        .extract()
        .map_err(|_| argument("t: integer nanoseconds or float seconds are expected"))?;
    // 292 years, less a little.
    if !secs.is_finite() || secs.abs() > 9.2e9 {
        return Err(argument(format!("t: {secs} s is no time")));
    }
    let whole = secs.floor();
    Ok(Nanos(
        whole as i64 * 1_000_000_000 + ((secs - whole) * 1e9).round_ties_even() as i64,
    ))
}

fn vector(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    value
        .extract()
        .map_err(|_| argument(format!("{name}: three numbers are expected")))
}

#[pymethods]
impl Live {
    #[new]
    #[pyo3(signature = (settings, rate_hz=None, /))]
    fn new(settings: &Bound<'_, PyDict>, rate_hz: Option<f64>) -> PyResult<Live> {
        if let Some(rate) = rate_hz.filter(|rate| !rate.is_finite() || *rate <= 0.0 || *rate > 1e9)
        {
            return Err(argument(format!("rate_hz: {rate} is no sample rate")));
        }
        let plan = settings::plan(settings)?;
        if plan.smooth {
            return Err(argument(
                Diagnostic::new("smooth: only a whole recording can be smoothed")
                    .help("estimate(.., smooth=True), of samples that are all there"),
            ));
        }
        if plan.mend {
            return Err(argument(
                Diagnostic::new("mend: what a recording tells as a whole, a live stream cannot")
                    .help("estimate(.., mend=True), of samples that are all there"),
            ));
        }
        Ok(Live {
            meaning: Meaning::new(&plan, &Declared::default()),
            plan,
            running: None,
            last: None,
            rate_hz,
            taken: 0,
            given: 0,
            is_closed: false,
        })
    }

    /// Takes one sample; the newest attitude, when there is a new one.
    #[pyo3(signature = (gyr, acc=None, mag=None, t=None))]
    fn push_one(
        &mut self,
        py: Python<'_>,
        gyr: &Bound<'_, PyAny>,
        acc: Option<&Bound<'_, PyAny>>,
        mag: Option<&Bound<'_, PyAny>>,
        t: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Option<AttitudeTuple>> {
        self.check_open(py)?;
        let gyr = vector("gyr", gyr)?;
        let acc = acc.map(|v| vector("acc", v)).transpose()?;
        let mag = mag.map(|v| vector("mag", v)).transpose()?;
        let raw = sample(self.stamp(t)?, gyr, acc, mag, None, None);
        let estimator = self
            .running(&raw)
            .map_err(|what| refusal::run(py, "refused", what))?;
        estimator.take(&raw);
        let known = estimator.attitudes(&Sequential);
        let (newest, given) = (known.last().copied(), known.len() as u64);
        self.last = newest.or(self.last);
        self.given += given;
        Ok(newest.map(|newest| {
            let [w, x, y, z] = newest.q_nb.wxyz();
            (newest.stamp.0, (w, x, y, z))
        }))
    }

    /// Takes samples; the attitudes that are known by then.
    #[pyo3(signature = (gyr, t, acc, mag, dt, /))]
    fn push_rows<'py>(
        &mut self,
        py: Python<'py>,
        gyr: Rows<'py>,
        t: Times<'py>,
        acc: Option<Rows<'py>>,
        mag: Option<Rows<'py>>,
        dt: Option<Times<'py>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.check_open(py)?;
        let samples = Samples::new(&gyr, &t, (acc.as_ref(), mag.as_ref()), None, dt.as_ref())?;
        let mut columns = Columns::with_room(samples.len(), &self.plan.noise);
        if let Some(first) = samples.part(0, 1).next() {
            self.running(&first)
                .map_err(|what| refusal::run(py, "refused", what))?;
        }
        self.taken += samples.len() as u64;
        let (running, last, given) = (&mut self.running, &mut self.last, &mut self.given);
        let mut signals = Signals::new();
        py.detach(|| {
            let Some((estimator, _)) = running else {
                return Ok(());
            };
            for from in (0..samples.len()).step_by(BLOCK) {
                for raw in samples.part(from, from + BLOCK) {
                    estimator.take(&raw);
                }
                let known = estimator.attitudes(&Sequential);
                *last = known.last().copied().or(*last);
                *given += known.len() as u64;
                columns.extend(known);
                signals.look()?;
            }
            Ok::<_, PyErr>(())
        })?;
        columns.into_dict(py)
    }

    /// Ends it: returns the attitudes that waited for more samples.
    fn finish_rows<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.check_open(py)?;
        self.is_closed = true;
        let mut columns = Columns::with_room(0, &self.plan.noise);
        if let Some((estimator, _)) = &mut self.running {
            let rest = estimator.finish(&Sequential);
            self.last = rest.last().copied().or(self.last);
            self.given += rest.len() as u64;
            columns.extend(&rest);
        }
        columns.into_dict(py)
    }

    /// Sets the heading of the next sample, degrees; tilt and what was learned stay.
    fn set_heading(&mut self, py: Python<'_>, heading: f64) -> PyResult<()> {
        let estimator = self.begun(py)?;
        if estimator.filter().is_some_and(|filter| filter.has_field()) {
            return Err(argument("heading: the magnetic field tells it"));
        }
        if !heading.is_finite() || !estimator.set_heading(heading.to_radians()) {
            return Err(argument(NO_VERTICAL));
        }
        Ok(())
    }

    /// Takes a heading that something else has measured, degrees.
    #[pyo3(signature = (heading, sigma, t=None))]
    fn measure_heading(
        &mut self,
        py: Python<'_>,
        heading: f64,
        sigma: f64,
        t: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let stamp = t.map(nanos).transpose()?;
        let estimator = self.begun(py)?;
        let measured = OutsideHeading {
            heading: heading.to_radians(),
            sigma: sigma.to_radians(),
        };
        if !measured.is_plausible() {
            return Err(argument(
                "heading, sigma: degrees are expected, ten turns at most, and a sigma above 0 and 360 at most",
            ));
        }
        if !estimator.take_heading(stamp, measured) {
            return Err(argument(NO_VERTICAL));
        }
        Ok(())
    }

    /// Counts of measured headings: used, doubted, unpaired, turns.
    fn heading_counts(&self) -> [u64; 4] {
        let counts = match &self.running {
            Some((estimator, _)) => estimator.outside_headings(),
            None => Default::default(),
        };
        [counts.used, counts.doubted, counts.unpaired, counts.turns]
    }

    /// Number of samples that came.
    #[getter]
    fn taken(&self) -> u64 {
        self.taken
    }

    /// Outcome of the samples so far; `None` before the first.
    fn outcome<'py>(&self, py: Python<'py>) -> PyResult<Option<Outcome<'py>>> {
        let Some((estimator, prepared)) = &self.running else {
            return Ok(None);
        };
        let of = (&self.plan, &self.meaning, prepared);
        let summary = so_far(of, estimator, self.given, self.last.as_ref());
        outcome(py, &summary).map(Some)
    }

    /// The newest attitude as columns of one row, or none.
    fn last_rows<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mut columns = Columns::with_room(0, &self.plan.noise);
        columns.extend(self.last.as_slice());
        columns.into_dict(py)
    }
}
