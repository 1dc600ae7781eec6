//! Rows of a summary -> text, JSON. Pure.
//!
//! One list, of which the command's text, its JSON, the page and Python's dict are made: a figure is named and put
//! into words once.

use serde_json::{Map, Value};
use std::fmt::Write as _;

/// One row of a summary: a value under a key for machines, lines under a label for people, or both.
#[derive(Clone, PartialEq, Debug)]
pub struct Row {
    /// Key in JSON, ending in the unit of the value; empty: for people alone.
    key: &'static str,
    value: Value,
    /// Label in text; empty: the lines go on from those above.
    label: &'static str,
    /// Lines; none: for machines alone, or not worth a word in this run.
    lines: Vec<String>,
}

impl Row {
    /// A value under its key, without words.
    #[must_use]
    pub(crate) fn value(key: &'static str, value: impl Into<Value>) -> Row {
        Row {
            key,
            value: value.into(),
            label: "",
            lines: Vec::new(),
        }
    }

    /// An angle, rad, under its key: in degrees.
    #[must_use]
    pub(crate) fn angle(key: &'static str, radians: impl Into<Option<f64>>) -> Row {
        Row::value(key, radians.into().map(f64::to_degrees))
    }

    /// Words alone.
    #[must_use]
    pub(crate) fn words(label: &'static str, lines: impl IntoIterator<Item = String>) -> Row {
        Row::value("", Value::Null).told(label, lines)
    }

    /// The same with words: no lines, and people do not see it.
    #[must_use]
    pub(crate) fn told(
        mut self,
        label: &'static str,
        lines: impl IntoIterator<Item = String>,
    ) -> Row {
        self.label = label;
        self.lines.extend(lines);
        self
    }

    /// Key in JSON; empty for words alone.
    #[must_use]
    pub fn key(&self) -> &'static str {
        self.key
    }

    /// Lines for people, each with its label: that of the row for the first, none for those that follow.
    pub fn lines(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let parts = self.lines.iter().flat_map(|line| line.lines());
        parts.enumerate().map(|(i, part)| match i {
            0 => (self.label, part.trim_start()),
            _ => ("", part.trim_start()),
        })
    }
}

/// Text for people: a line for each of the rows' lines.
pub(crate) fn text(rows: &[Row], out: &mut String) {
    for (label, line) in rows.iter().flat_map(Row::lines) {
        let _ = writeln!(out, "  {label:<8} {line}");
    }
}

/// JSON for machines: one object.
#[must_use]
pub(crate) fn json(rows: Vec<Row>) -> Value {
    let with_key = rows.into_iter().filter(|row| !row.key.is_empty());
    let pairs: Map<String, Value> = with_key
        .map(|row| (row.key.to_owned(), row.value))
        .collect();
    Value::Object(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_in_the_text_and_in_the_json_by_being_in_the_list() {
        let toy = |turns: Option<u32>| {
            let words = turns.map(|n| format!("{n} whole turns\nof the body"));
            vec![
                Row::value("topic", "/imu"),
                Row::value("whole_turns", turns).told("turns", words),
                Row::angle("tilt_deg", std::f64::consts::PI),
                Row::words("note", ["a toy".to_owned()]),
            ]
        };
        let mut out = String::new();
        text(&toy(Some(3)), &mut out);
        assert_eq!(
            out,
            "  turns    3 whole turns\n           of the body\n  note     a toy\n"
        );
        let object = serde_json::json!({ "topic": "/imu", "whole_turns": 3, "tilt_deg": 180.0 });
        assert_eq!(json(toy(Some(3))), object);
        // Machines find every key in every run, people no line about what was not there.
        let mut out = String::new();
        text(&toy(None), &mut out);
        assert_eq!(out, "  note     a toy\n");
        assert!(
            json(toy(None))
                .get("whole_turns")
                .is_some_and(Value::is_null)
        );
    }
}
