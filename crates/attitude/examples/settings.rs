//! The table of settings -> the page of `docs/`, and the types of the Python package.
//!
//! ```sh
//! cargo run -p strapd-attitude --example settings > docs/settings.md
//! cargo run -p strapd-attitude --example settings -- python > python/python/strapd/_settings.py
//! ```
//! `tests/commands/settings.rs` holds both files against it.
#![allow(clippy::print_stdout)]

use strapd_attitude::estimate::settings::{Default, ROWS, Row, Takes};
use strapd_attitude::setting::{AID, METHOD, RATE_HZ, SAMPLE_KIND, SMOOTH, TIME};

#[allow(dead_code, reason = "the test takes the texts alone")]
fn main() {
    match std::env::args().nth(1).as_deref() {
        Some("python") => print!("{}", python()),
        _ => print!("{}", page()),
    }
}

const HEAD: &str = "\
# Settings

The reference of every setting of an estimation: `strapd replay`, `serve`, `check`, `report`, `calibrate`, and the functions of the Python package. What they do in
practice is in [estimation.md](estimation.md). Made from the library's table by `cargo run -p strapd-attitude --example settings`; a test holds it.

A setting has one name. `max_gap` is the flag `--max-gap`, the key `max-gap` of `serve --config` and the keyword `max_gap` in Python (`sample_kind` of arrays is
`kind`). A flag comes before the environment, that before a file, and that before the default. The words are taken in any case.
";

/// Text of `docs/settings.md`.
pub(crate) fn page() -> String {
    let mut page = HEAD.to_owned();
    for row in &ROWS {
        page.push_str(&section(row));
    }
    page
}

fn quoted(text: &str) -> String {
    text.replace(['{', '}'], "`")
}

fn section(row: &Row) -> String {
    let mut text = format!("\n## {}\n\n{}.\n", row.name(), quoted(row.meaning));
    if !row.effect.is_empty() {
        text.push_str(&format!("{}\n", quoted(row.effect)));
    }
    let default = match row.default {
        Default::Value(value) => format!("`{value}`"),
        Default::Unset(then) => then.to_owned(),
    };
    text.push_str(&format!("\n- Default: {default}\n"));
    if row.words.is_empty() || !matches!(row.takes, Takes::Words) {
        text.push_str(&format!("- Takes: {}\n", row.expected()));
    }
    if !row.takes.unit().is_empty() {
        text.push_str(&format!("- Unit: {}\n", row.takes.unit()));
    }
    if let Some(variable) = row.environment {
        text.push_str(&format!("- Environment: `{variable}`\n"));
    }
    if !row.words.is_empty() {
        text.push_str("\n| word | |\n|---|---|\n");
        for word in row.words {
            text.push_str(&format!("| `{}` | {} |\n", word.name, quoted(word.meaning)));
        }
    }
    text
}

const PYTHON: &str = "\
\"\"\"Settings of an estimation. Made from the library's table by ``cargo run -p strapd-attitude --example settings -- python``; a test holds it.\"\"\"

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Literal, Optional, TypedDict, Union

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from collections.abc import Sequence

Vector = Union[\"Sequence[float]\", npt.NDArray[np.float64]]
";

/// Text of `python/python/strapd/_settings.py`.
pub(crate) fn python() -> String {
    let mut text = PYTHON.to_owned();
    for (name, setting) in [("Kind", SAMPLE_KIND), ("Aid", AID)] {
        for row in ROWS.iter().filter(|row| row.setting == setting) {
            text.push_str(&format!("{name} = {}\n", literal(row)));
        }
    }
    text.push_str("\n\nclass Settings(TypedDict, total=False):\n");
    text.push_str("    \"\"\"What can be said of a sensor and of the run, under the names of the command's flags (``docs/settings.md``).\"\"\"\n\n");
    // Those that functions have as arguments of their own, and what arrays say by their stamps, are no part of it.
    let own = [TIME, RATE_HZ, METHOD, SAMPLE_KIND, AID, SMOOTH];
    for row in ROWS.iter().filter(|row| !own.contains(&row.setting)) {
        text.push_str(&format!("    {}: {}\n", row.name(), annotation(row)));
    }
    text.push_str("\n\n#: Names of all settings, as the functions of a log take them.\nSETTINGS = frozenset(\n    (\n");
    for row in &ROWS {
        text.push_str(&format!("        \"{}\",\n", row.name()));
    }
    text.push_str("    )\n)\n\n#: Those that the environment may say too, with its variables.\nENVIRONMENT = {\n");
    for row in &ROWS {
        if let Some(variable) = row.environment {
            text.push_str(&format!("    \"{}\": \"{variable}\",\n", row.name()));
        }
    }
    text + "}\n"
}

fn literal(row: &Row) -> String {
    let words: Vec<String> = row
        .words
        .iter()
        .map(|w| format!("\"{}\"", w.name))
        .collect();
    format!("Literal[{}]", words.join(", "))
}

fn annotation(row: &Row) -> String {
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    let own = match row.takes {
        Takes::Words if row.words.iter().any(|word| is_number(word.name)) => "int, str",
        Takes::Words => "",
        Takes::Switch(_) => "bool",
        Takes::Number { .. } => "float",
        Takes::Count(_) => "int",
        Takes::Rate(_) | Takes::Mounting(_) | Takes::Attitude(_) => "Vector",
        Takes::Factors(_) => "float, Vector",
        Takes::Text { .. } => "str",
        Takes::Figures(_) => "str, dict[str, Any]",
        Takes::Calibration(_) => "str, os.PathLike[str], dict[str, Any]",
    };
    let words = match (row.words.is_empty() || own.contains("str"), own) {
        (true, _) => own.to_owned(),
        (false, "") => literal(row),
        (false, own) => format!("{}, {own}", literal(row)),
    };
    match words.contains("], ") || own.contains(", ") {
        true => format!("Union[{words}, None]"),
        false => format!("Optional[{words}]"),
    }
}
