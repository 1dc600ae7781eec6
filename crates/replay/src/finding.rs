//! One thing that was noticed about a log, a run or a sensor: how bad, on what evidence, what to do. Pure.
//!
//! The type alone: the rules are in [`crate::findings`], which know a run; a run's summary holds what they found.

use serde_json::{Map, Value, json};

/// How bad a finding is.
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
    /// In text and JSON.
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
    /// How bad it is.
    pub severity: Severity,
    /// Its stable name.
    pub code: &'static str,
    /// The topic, empty = the file.
    pub topic: String,
    /// What was seen, with its numbers.
    pub what: String,
    /// The same numbers for machines.
    pub evidence: Map<String, Value>,
    /// What to do about it.
    pub advice: String,
    /// The exact flags that do it, where flags do.
    pub flags: String,
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
            flags: String::new(),
        }
    }

    pub(crate) fn with(mut self, name: &str, value: impl Into<Value>) -> Finding {
        self.evidence.insert(name.to_owned(), value.into());
        self
    }

    pub(crate) fn advise(mut self, advice: impl Into<String>) -> Finding {
        self.advice = advice.into();
        self
    }

    pub(crate) fn flags(mut self, flags: impl Into<String>) -> Finding {
        self.flags = flags.into();
        self
    }

    /// What was seen and what helps, in one line.
    #[must_use]
    pub fn line(&self) -> String {
        let mut line = self.what.clone();
        for (separator, part) in [("; ", &self.advice), (": ", &self.flags)] {
            if !part.is_empty() {
                line.push_str(separator);
                line.push_str(part);
            }
        }
        line
    }

    /// For machines.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({
            "severity": self.severity.name(),
            "code": self.code,
            "topic": self.topic,
            "what": self.what,
            "evidence": self.evidence,
            "advice": self.advice,
            "flags": self.flags,
        })
    }
}
