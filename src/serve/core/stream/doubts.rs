//! Samples of a sensor -> findings about them, those of recordings, as soon as they are certain. Pure.
//!
//! Apart from the stream because nothing of the attitude depends on it. What is certain of a sensor stays so: through a
//! `RESET`, a new run and a restart, until its settings are others, or a minute of motion shows nothing of it.

use crate::report::findings::{Finding, SensorWatch, Severity, is_of_gyro, says};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use strapd_attitude::estimate::{EstimationSettings, Estimator, Meaning, Prepared};
use strapd_attitude::record::{Nanos, RawSample};

/// Time of the sensor between two judgements, ns: as often as a segment of motion ends.
const PACE: i64 = 2_000_000_000;
/// Most findings that are kept of a sensor, and the longest as text: what a state file holds may be anything.
const MOST: usize = 32;
const LONGEST: usize = 4096;

/// Findings that outlive a daemon.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub(in crate::serve::core) struct Lasting {
    /// Number of the settings under which they were found.
    settings: u64,
    /// The findings, by code and axis.
    found: BTreeMap<String, Value>,
}

impl Lasting {
    /// Whether a daemon can have saved it.
    pub(in crate::serve::core) fn is_plausible(&self) -> bool {
        let is_finding = |found: &Value| {
            let is_text = |key| found.get(key).is_some_and(Value::is_string);
            ["severity", "code", "what", "advice", "flags"]
                .into_iter()
                .all(is_text)
                && found.to_string().len() <= LONGEST
        };
        self.found.len() <= MOST && self.found.values().all(is_finding)
    }
}

/// Findings about the samples of one sensor.
#[derive(Debug)]
pub(super) struct Doubts {
    watch: SensorWatch,
    judged: Option<Nanos>,
    now: Vec<Finding>,
    lasting: Lasting,
    /// Findings that were logged in this run, and lines still to be.
    said: BTreeSet<String>,
    unsaid: Vec<String>,
}

impl Doubts {
    /// Watches samples that `estimator` takes, and goes on from what was found before, if the settings are the same.
    pub(super) fn new(
        resolved: &Meaning,
        prepared: &Prepared,
        estimator: &mut Estimator,
        before: Option<&Lasting>,
    ) -> Doubts {
        let settings = estimator.settings_fingerprint();
        let before = before.filter(|before| before.settings == settings);
        Doubts {
            watch: SensorWatch::new(resolved, prepared, estimator),
            judged: None,
            now: Vec::new(),
            lasting: Lasting {
                settings,
                found: before.map_or_else(BTreeMap::new, |before| before.found.clone()),
            },
            said: BTreeSet::new(),
            unsaid: Vec::new(),
        }
    }

    /// Begins a run of the same sensor, of which `estimator` takes the samples.
    pub(super) fn begin(
        &mut self,
        resolved: &Meaning,
        prepared: &Prepared,
        estimator: &mut Estimator,
    ) {
        self.watch = SensorWatch::new(resolved, prepared, estimator);
        self.judged = None;
        self.now.clear();
        self.said.clear();
    }

    /// Forgets what was found before of samples that `estimator` reads in another way.
    pub(super) fn forget(&mut self, estimator: &Estimator) {
        self.lasting = Lasting {
            settings: estimator.settings_fingerprint(),
            found: BTreeMap::new(),
        };
    }

    /// Takes the next sample, as it came.
    #[inline]
    pub(super) fn take(&mut self, raw: &RawSample) {
        self.watch.take(raw);
    }

    /// Judges by all samples so far, of which `last` is the newest, if it is time.
    pub(super) fn judge(&mut self, last: Nanos, estimator: &Estimator, plan: &EstimationSettings) {
        let judged = *self.judged.get_or_insert(last);
        if (0..PACE).contains(&last.since(judged)) {
            return;
        }
        self.judged = Some(last);
        let found = self.watch.findings(estimator, plan);
        if found.is_gyro_sound {
            let is_over = |finding: &Value| is_of_gyro(text(finding, "code"));
            self.lasting.found.retain(|_, finding| !is_over(finding));
        }
        for finding in &found.lasting {
            let is_known = self.lasting.found.contains_key(&key(finding));
            if is_known || self.lasting.found.len() < MOST {
                self.lasting.found.insert(key(finding), finding.json());
            }
        }
        for finding in &found.now {
            if finding.severity > Severity::Note && self.said.insert(key(finding)) {
                self.unsaid.push(finding.line());
            }
        }
        self.now = found.now;
    }

    /// Lines for the log that were not there yet.
    pub(super) fn news(&mut self) -> Vec<String> {
        std::mem::take(&mut self.unsaid)
    }

    /// Findings for `STATUS`.
    pub(super) fn findings(&self) -> Vec<Value> {
        let is_shown = |lasting: &&Value| {
            let code = text(lasting, "code");
            !self.now.iter().any(|found| says(found, code))
        };
        let lasting = self.lasting.found.values().filter(is_shown).cloned();
        self.now.iter().map(Finding::json).chain(lasting).collect()
    }

    /// Findings that a daemon after this one is to know.
    pub(super) fn lasting(&self) -> Option<Lasting> {
        (!self.lasting.found.is_empty()).then(|| self.lasting.clone())
    }
}

/// Place of a finding among those of a sensor.
fn key(finding: &Finding) -> String {
    match finding.evidence.get("axis").and_then(Value::as_str) {
        Some(axis) => format!("{} {axis}", finding.code),
        None => finding.code.to_owned(),
    }
}

fn text<'a>(finding: &'a Value, key: &str) -> &'a str {
    finding.get(key).and_then(Value::as_str).unwrap_or_default()
}

/// Place of a severity, the worst first.
pub(super) fn rank(finding: &Value) -> usize {
    let name = text(finding, "severity");
    let worst_first = [Severity::Error, Severity::Warning, Severity::Note];
    let place = worst_first
        .iter()
        .position(|severity| severity.name() == name);
    place.unwrap_or(worst_first.len())
}
