//! An answer -> text for people. Pure.

use serde_json::{Map, Value};
use std::fmt::Write;

/// Names and numbers in columns; an empty line ends it.
pub(super) fn text(answer: &Value) -> String {
    let mut out = String::new();
    if let Value::Object(fields) = answer {
        for (name, value) in fields {
            field(&mut out, name, value);
        }
    }
    out
}

fn field(out: &mut String, name: &str, value: &Value) {
    match value {
        Value::Array(items) if items.iter().all(Value::is_object) && !items.is_empty() => {
            let _ = writeln!(out, "{name}");
            objects(out, items);
        }
        Value::Array(items) if items.iter().all(Value::is_array) && !items.is_empty() => {
            for (i, row) in items.iter().enumerate() {
                let label = if i == 0 { name } else { "" };
                let _ = writeln!(out, "{label:<16}{}", cells(row));
            }
        }
        _ => {
            let _ = writeln!(out, "{name:<16}{}", cells(value));
        }
    }
}

/// One row each, a header above.
fn objects(out: &mut String, items: &[Value]) {
    let rows: Vec<&Map<String, Value>> = items.iter().filter_map(Value::as_object).collect();
    let Some(first) = rows.first() else { return };
    let names: Vec<&String> = first.keys().collect();
    let mut columns: Vec<(&str, Vec<String>)> = Vec::new();
    for name in names {
        let column = rows
            .iter()
            .map(|r| r.get(name).map_or(String::new(), cells));
        columns.push((name, column.collect()));
    }
    let width = |(name, cells): &(&str, Vec<String>)| {
        let longest = cells.iter().map(|c| c.chars().count()).max();
        longest.unwrap_or(0).max(name.len())
    };
    // Time and labels first, whatever their names.
    columns.sort_by_key(width);
    let widths: Vec<usize> = columns.iter().map(width).collect();
    let mut line = |cells: &mut dyn Iterator<Item = &str>| {
        let mut text = String::from("  ");
        for (cell, width) in cells.zip(&widths) {
            let _ = write!(text, "{cell:<width$}  ");
        }
        let _ = writeln!(out, "{}", text.trim_end());
    };
    line(&mut columns.iter().map(|(name, _)| *name));
    for row in 0..rows.len() {
        line(
            &mut columns
                .iter()
                .map(|(_, cells)| cells.get(row).map_or("", |c| c)),
        );
    }
}

fn cells(value: &Value) -> String {
    match value {
        Value::Number(n) if n.is_f64() => number(n.as_f64().unwrap_or_default()),
        Value::String(text) => text.clone(),
        Value::Array(items) => items.iter().map(cells).collect::<Vec<_>>().join(" "),
        Value::Object(fields) => fields
            .iter()
            .map(|(name, value)| format!("{name} {}", cells(value)))
            .collect::<Vec<_>>()
            .join("  "),
        other => other.to_string(),
    }
}

/// Six decimals; what they would hide, with an exponent.
fn number(x: f64) -> String {
    // Rounding noise of a true zero is no number to show people.
    if x != 0.0 && (x.abs() < 1e-6 && x.abs() > 1e-12 || x.abs() >= 1e6) {
        format!("{x:>11.3e}")
    } else {
        // Adding zero turns -0 into 0.
        let rounded = (x * 1e6).round() / 1e6 + 0.0;
        format!("{rounded:>11.6}")
    }
}
