//! Findings -> their part of the page. Pure.

use super::markup::{escaped, sentence};
use crate::report::findings::{Finding, Severity, findings};
use serde_json::Value;
use std::fmt::Write as _;
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::estimate::{Bias, EstimationSettings};
use strapd_attitude::setting::GYRO_UNIT;
use strapd_replay::inspection::Checked;

/// Most findings written out; the worst come first.
const SHOWN: usize = 200;

/// A finding, and the flag of this run that deals with it already.
#[derive(Clone, PartialEq, Debug)]
pub struct FindingRow {
    /// Finding.
    pub finding: Finding,
    /// The flag; `None` = nothing was done about it.
    pub answered: Option<&'static str>,
}

impl FindingRow {
    /// Everything that is found about a log examined by `plan`.
    #[must_use]
    pub fn all(checked: &Checked, plan: &EstimationSettings) -> Vec<FindingRow> {
        let row = |finding: Finding| FindingRow {
            answered: answered(&finding, plan),
            finding,
        };
        findings(checked).into_iter().map(row).collect()
    }

    /// Whether it is as bad as `severity`, and nothing was done about it.
    #[must_use]
    pub fn is_open(&self, severity: Severity) -> bool {
        self.answered.is_none() && self.finding.severity == severity
    }

    /// JSON for machines.
    #[must_use]
    pub fn json(&self) -> Value {
        let mut value = self.finding.json();
        if let Some(object) = value.as_object_mut() {
            object.insert("answered_by".to_owned(), self.answered.into());
        }
        value
    }
}

/// The flag of this run that deals with a finding about the samples as recorded.
fn answered(finding: &Finding, plan: &EstimationSettings) -> Option<&'static str> {
    // A unit that was given is no answer to a finding that it is another.
    let mut advised = finding.help.iter().flatten();
    let unit = advised.find(|choice| choice.setting == GYRO_UNIT);
    let is_another = |given: GyroUnit| unit.is_some_and(|unit| unit.value != given.name());
    let has_unit = plan.unit.is_some_and(|given| !is_another(given));
    let (is_given, flag) = match finding.code {
        "unit-degrees" => (has_unit, "--gyro-unit"),
        "unit-unknown" => (plan.gyro_scale != [1.0; 3], "--gyro-scale"),
        "unit-against-gravity" if has_unit => (true, "--gyro-unit"),
        "looks-frd" if plan.is_accel_kinematic => (true, "--accel-sign"),
        "unit-against-gravity" | "looks-frd" => (plan.body.is_some(), "--body"),
        "mounted-on-side" => (plan.mount.is_some(), "--mount"),
        "bias" => (!matches!(plan.bias, Bias::Unsaid | Bias::None), "--bias"),
        "jitter" => (plan.regularise_stamps, "--regularise-stamps"),
        "sample-kind-unknown" => (plan.kind.is_some(), "--sample-kind"),
        _ => (false, ""),
    };
    is_given.then_some(flag)
}

pub(super) fn section(rows: &[FindingRow], out: &mut String) {
    out.push_str("<section id=\"findings\"><h2>Quality of the input</h2>\n");
    if rows.is_empty() {
        out.push_str("<p>Nothing was found.</p>\n");
    }
    let topics = |rows: &[FindingRow]| {
        let mut names: Vec<&str> = rows.iter().map(|t| t.finding.topic.as_str()).collect();
        names.retain(|name| !name.is_empty());
        names.sort_unstable();
        names.dedup();
        names.len()
    };
    let several = topics(rows) > 1;
    for one in rows.iter().take(SHOWN) {
        let finding = &one.finding;
        let answered = one.answered.map_or("", |_| " answered");
        let _ = write!(
            out,
            "<div class=\"finding {0}{answered}\"><p><b>{0}</b> <code>{1}</code>",
            finding.severity.name(),
            finding.code
        );
        if several && !finding.topic.is_empty() {
            let _ = write!(out, " {}", escaped(&finding.topic));
        }
        let _ = write!(
            out,
            "</p><p>{}.</p>",
            escaped(&sentence(finding.what.trim_end_matches('.')))
        );
        let advice = match (finding.advice.as_str(), finding.flags().as_str()) {
            ("", "") => String::new(),
            (advice, "") => escaped(&sentence(advice)),
            ("", flags) => format!("<code>{}</code>", escaped(flags)),
            (advice, flags) => format!(
                "{}: <code>{}</code>",
                escaped(&sentence(advice)),
                escaped(flags)
            ),
        };
        if let Some(flag) = one.answered {
            let _ = write!(
                out,
                "<p class=\"small\">Of the samples as recorded; dealt with by <code>{flag}</code> here.</p>"
            );
        } else if !advice.is_empty() {
            let _ = write!(out, "<p>&rarr; {advice}</p>");
        }
        let evidence = evidence(finding);
        if !evidence.is_empty() {
            let _ = write!(out, "<p class=\"small\">{}</p>", escaped(&evidence));
        }
        out.push_str("</div>\n");
    }
    if rows.len() > SHOWN {
        let _ = writeln!(
            out,
            "<p>And {} more; all are in the JSON block.</p>",
            rows.len() - SHOWN
        );
    }
    out.push_str("</section>\n");
}

/// Endings of keys, and the units that they stand for.
const UNITS: [(&str, &str); 5] = [
    ("_deg_per_h", " deg/h"),
    ("_deg", " deg"),
    ("_hz", " Hz"),
    ("_ms", " ms"),
    ("_s", " s"),
];

/// The numbers behind it, in one line.
fn evidence(finding: &Finding) -> String {
    let parts = finding.evidence.iter();
    let parts = parts.filter_map(|(key, value)| named(key, ": ", value));
    parts.collect::<Vec<String>>().join("; ")
}

/// A value with its name and unit; nothing of one that is not there.
fn named(key: &str, between: &str, value: &Value) -> Option<String> {
    if value.is_null() {
        return None;
    }
    let unit =
        |(end, unit): &(&str, &'static str)| Some((key.strip_suffix(end)?.to_owned(), *unit));
    let found = UNITS.iter().find_map(unit).filter(|_| value.is_number());
    let (name, unit) = found.unwrap_or_else(|| (key.to_owned(), ""));
    Some(format!(
        "{}{between}{}{unit}",
        name.replace('_', " "),
        short(value)
    ))
}

fn short(value: &Value) -> String {
    match value {
        Value::Number(n) if n.is_f64() => n
            .as_f64()
            .map_or_else(String::new, |v| crate::report::summary::significant(v, 4)),
        Value::String(text) => text.clone(),
        Value::Array(all) => all.iter().map(short).collect::<Vec<_>>().join(", "),
        Value::Object(all) => {
            // What is said in words, and whether it was: the sentence has it.
            let parts = all.iter().filter(|(_, value)| !value.is_boolean());
            let parts = parts.filter_map(|(key, value)| match value {
                Value::Object(_) => Some(format!("{key} ({})", short(value))),
                _ => named(key, " ", value),
            });
            parts.collect::<Vec<String>>().join(", ")
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn evidence_has_units_and_nothing_of_what_is_not_there() {
        let finding = Finding {
            evidence: [
                ("first_at_s", json!(1.5)),
                (
                    "sigma",
                    json!({"heading": {"rms_deg": 2.64}, "is_beyond": true, "leaning_deg": null}),
                ),
                ("topics_s", json!(["a", "b"])),
                ("unit_deg", Value::Null),
            ]
            .map(|(key, value)| (key.to_owned(), value))
            .into_iter()
            .collect(),
            severity: Severity::Note,
            code: "code",
            topic: String::new(),
            what: String::new(),
            advice: String::new(),
            help: Vec::new(),
        };
        let said = "first at: 1.500 s; sigma: heading (rms 2.640 deg); topics s: a, b";
        assert_eq!(evidence(&finding), said);
    }
}
