//! Diagnostic -> the exception that carries it. Pure but for the classes, which are Python's.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use strapd_attitude::diagnostic::Diagnostic;

/// An argument that cannot be: `ValueError`, which names it.
pub fn argument(what: impl Into<Diagnostic>) -> PyErr {
    PyValueError::new_err(in_python(&what.into().to_string()))
}

/// A run that cannot be carried out: `strapd.Error` of this kind.
pub fn run(py: Python<'_>, kind: &str, what: impl Into<Diagnostic>) -> PyErr {
    raised(py, kind, &what.into(), in_python)
}

/// Raises it: the text is all of it, `help` what helps alone.
fn raised(py: Python<'_>, kind: &str, what: &Diagnostic, named: fn(&str) -> String) -> PyErr {
    let text = named(&what.to_string());
    let help = what.helping().map(named);
    let error = py
        .import("strapd._errors")
        .and_then(|errors| errors.getattr("Error"))
        .and_then(|class| class.call1((text, kind, help)));
    error.map_or_else(|failure| failure, PyErr::from_value)
}

/// [`argument`] of a function that takes a log.
pub fn argument_of_log(what: &Diagnostic) -> PyErr {
    PyValueError::new_err(of_log(&what.to_string()))
}

/// [`run`] over a log.
pub fn run_of_log(py: Python<'_>, kind: &str, what: &Diagnostic) -> PyErr {
    raised(py, kind, what, of_log)
}

/// Settings are named as flags in this process (`lib.rs`), which a text shows by their dashes; here they are
/// arguments: `--max-gap` is `max_gap`. Of arrays `--time` is `t`, the stamps themselves.
pub fn in_python(what: &str) -> String {
    named(what, &[("sample-kind", "kind"), ("time", "t")])
}

/// The same of what takes a log, whose arguments have the flags' names.
pub fn of_log(what: &str) -> String {
    named(what, &[])
}

fn named(what: &str, others: &[(&str, &str)]) -> String {
    let mut out = String::with_capacity(what.len());
    let mut rest = what;
    while let Some(at) = rest.find("--") {
        let (before, flag) = (&rest[..at], &rest[at + 2..]);
        out.push_str(before);
        let end = flag
            .find(|c: char| !c.is_ascii_lowercase() && c != '-')
            .unwrap_or(flag.len());
        let name = flag[..end].trim_end_matches('-');
        if name.is_empty() {
            out.push_str("--");
            rest = flag;
            continue;
        }
        match others.iter().find(|(flag, _)| *flag == name) {
            Some((_, argument)) => out.push_str(argument),
            None => out.push_str(&name.replace('-', "_")),
        }
        rest = &flag[name.len()..];
    }
    out + rest
}
