//! One thing that was noticed about a log, a run or a sensor: how bad, on what evidence, what to do. Pure.
//!
//! The type alone: the rules are in [`crate::findings`], which know a run; a run's summary holds what they found.

use serde_json::{Map, Value, json};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::Choice;

/// Codes of a stream that is no single sensor in one unit.
pub(crate) const MIXED: &str = "two-sensors";
pub(crate) const GYRO_UNIT_CHANGE: &str = "gyro-unit-change";
pub(crate) const ACCEL_UNIT_CHANGE: &str = "accel-unit-change";
pub(crate) const GYRO_AXES_CHANGE: &str = "gyro-axes-change";
pub(crate) const GYRO_BIAS_CHANGE: &str = "gyro-bias-change";
pub(crate) const GRAVITY_LEAP: &str = "gravity-leap";
/// Code of rates that are derivatives of roll, pitch and yaw.
pub(crate) const GYRO_EULER_RATES: &str = "gyro-euler-rates";
/// Code of a gyro that reads nothing where gravity turns.
pub(crate) const GYRO_DEAD: &str = "gyro-dead";
/// Code of what a stage said of how it read or prepared the data, and has no name of its own.
pub(crate) const AS_READ: &str = "preparation";
/// Codes of a sensor that is read in wrong axes, by a wrong factor or in a wrong unit: the data show the right one.
const MISREAD: [&str; 8] = [
    GYRO_DEAD,
    GYRO_EULER_RATES,
    "gyro-axes",
    "gyro-scale",
    "gyro-turned",
    "unit-degrees",
    "unit-unknown",
    "mag-axes",
];

/// Severity of a finding.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Severity {
    /// Nothing is wrong; something to know, or to choose.
    Note,
    /// The attitude may be worse than it need be.
    Warning,
    /// Data is lost, or the attitude will be wrong.
    Error,
}

impl Severity {
    /// Name in text and JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
}

/// One thing that was noticed.
#[derive(Clone, PartialEq, Debug)]
pub struct Finding {
    /// Severity.
    pub severity: Severity,
    /// Stable name.
    pub code: &'static str,
    /// The topic, empty = the file.
    pub topic: String,
    /// Observation with its numbers.
    pub what: String,
    /// The same numbers for machines.
    pub evidence: Map<String, Value>,
    /// Advice.
    pub advice: String,
    /// The settings that do it, where settings do: one of these, each of some that are set together.
    pub help: Vec<Vec<Choice>>,
}

impl Finding {
    pub(crate) fn new(severity: Severity, code: &'static str, what: impl Into<String>) -> Finding {
        Finding {
            severity,
            code,
            topic: String::new(),
            what: what.into(),
            evidence: Map::new(),
            advice: String::new(),
            help: Vec::new(),
        }
    }

    /// Makes one of a stage's diagnostic, its help as the advice.
    pub(crate) fn said(severity: Severity, code: &'static str, said: &Diagnostic) -> Finding {
        Finding::new(severity, code, said.what()).advise(said.helping().unwrap_or_default())
    }

    pub(crate) fn with(mut self, name: &str, value: impl Into<Value>) -> Finding {
        self.evidence.insert(name.to_owned(), value.into());
        self
    }

    pub(crate) fn advise(mut self, advice: impl Into<String>) -> Finding {
        self.advice = advice.into();
        self
    }

    /// Whether a sensor is read otherwise than the data show to be right.
    pub(crate) fn is_misread(&self) -> bool {
        MISREAD.contains(&self.code)
    }

    /// Whether the attitude is wrong by more than its sigma, which knows nothing of it.
    pub(crate) fn is_beyond_sigma(&self) -> bool {
        let no_sensor = [
            MIXED,
            GYRO_UNIT_CHANGE,
            ACCEL_UNIT_CHANGE,
            GYRO_AXES_CHANGE,
            GRAVITY_LEAP,
        ];
        let is_no_sensor = no_sensor.contains(&self.code);
        self.severity == Severity::Error && (is_no_sensor || self.is_misread())
    }

    /// Settings that help; called again, others that do as well.
    pub(crate) fn help<C: Into<Choice>>(mut self, set: impl IntoIterator<Item = C>) -> Finding {
        let set: Vec<Choice> = set.into_iter().map(Into::into).collect();
        if !set.is_empty() {
            self.help.push(set);
        }
        self
    }

    /// The settings that help, as this program names them: `--time log, or --time index --rate-hz HZ`.
    #[must_use]
    pub fn flags(&self) -> String {
        let said = |set: &Vec<Choice>| {
            let each: Vec<String> = set.iter().map(ToString::to_string).collect();
            each.join(" ")
        };
        let sets: Vec<String> = self.help.iter().map(said).collect();
        sets.join(", or ")
    }

    /// The same for a program that sets them: `[{"time": "log"}, {"time": "index", "rate_hz": "HZ"}]`.
    fn settings(&self) -> Value {
        let object = |set: &Vec<Choice>| {
            let value = |choice: &Choice| match choice.value.as_str() {
                "" => Value::Bool(true),
                value => value.into(),
            };
            let each = set.iter().map(|c| (c.setting.name().to_owned(), value(c)));
            Value::Object(each.collect())
        };
        self.help.iter().map(object).collect()
    }

    /// Observation and advice, in one line.
    #[must_use]
    pub fn line(&self) -> String {
        let mut line = self.what.clone();
        for (separator, part) in [("; ", &self.advice), (": ", &self.flags())] {
            if !part.is_empty() {
                line.push_str(separator);
                line.push_str(part);
            }
        }
        line
    }

    /// JSON for machines.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({
            "severity": self.severity.name(),
            "code": self.code,
            "topic": self.topic,
            "what": self.what,
            "evidence": self.evidence,
            "advice": self.advice,
            "flags": self.flags(),
            "settings": self.settings(),
        })
    }
}
