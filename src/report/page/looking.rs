//! Charts that can be looked into: their numbers beside the picture, and the script that draws them. Pure.
//!
//! The plots of the live page, joined to one script. The page says its hash and allows no other, and no connection;
//! without scripts the pictures stand.

use super::charts::Time;
use crate::report::plot::{Series, SeriesStyle};
use crate::web;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

/// Parts in the order in which they need each other.
const PARTS: [&str; 8] = [
    "numbers.js",
    "clock.js",
    "scale.js",
    "track.js",
    "surface.js",
    "plot.js",
    "timeview.js",
    "report.js",
];

/// Digits of an instant and of a value that a screen can show, zoomed in as far as one may.
const DIGITS: (usize, usize) = (8, 5);

/// The numbers of a chart over time, as an element beside its picture.
pub(super) fn numbers(time: Time, title: &str, unit: &str, series: &[Series]) -> String {
    let secs = time.nanos * 1e-9;
    let lines = series.iter().enumerate().map(|(index, series)| {
        let (mut t, mut v, mut breaks) = (Vec::new(), Vec::new(), Vec::new());
        for [x, y] in &series.points {
            if x.is_nan() {
                breaks.push(t.len());
            } else {
                t.push(rounded(x * secs, DIGITS.0));
                v.push(rounded(*y, DIGITS.1));
            }
        }
        breaks.retain(|at| *at < t.len());
        json!({
            "name": series.name, "color": series.color.unwrap_or(index), "dashed": series.look == SeriesStyle::Dashed,
            "t": t, "v": v, "breaks": breaks,
        })
    });
    let wraps = title.starts_with("Attitude");
    let data = json!({
        "title": format!("{title}, {unit}"), "wraps": wraps, "lines": lines.collect::<Vec<_>>(),
    });
    format!(
        "<script type=\"application/json\" class=\"lines\">{}</script>",
        inert(&data)
    )
}

/// The value to so many digits after the first; not a number is null.
fn rounded(value: f64, digits: usize) -> Value {
    let text = format!("{value:.digits$e}");
    text.parse::<f64>().map_or(Value::Null, Value::from)
}

/// JSON that can stand in an element of HTML. The only character that could end it, or begin a comment, is written as
/// an escape; so are those that end a line of a script.
pub(super) fn inert(data: &Value) -> String {
    let text = data.to_string();
    text.replace('<', "\\u003c")
        .replace('\u{2028}', "\\u2028")
        .replace('\u{2029}', "\\u2029")
}

/// The script.
pub(super) fn script() -> String {
    let mut script = String::new();
    for line in PARTS
        .iter()
        .filter_map(|part| web::text(part))
        .flat_map(str::lines)
    {
        if line.starts_with("import ") || line.starts_with("//") {
            continue;
        }
        script += line.strip_prefix("export ").unwrap_or(line);
        script.push('\n');
    }
    script
}

/// Hash by which a policy names it.
pub(super) fn hash(script: &str) -> String {
    format!(
        "'sha256-{}'",
        STANDARD.encode(Sha256::digest(script.as_bytes()))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_script_is_one_piece_and_ends_no_element() {
        let script = script();
        for word in [
            "</script",
            "<!--",
            "import ",
            "export ",
            "fetch(",
            "XMLHttpRequest",
            "WebSocket",
            "eval(",
        ] {
            assert!(!script.contains(word), "{word}");
        }
        // What is declared twice would stop all of it.
        let mut names: Vec<&str> = script
            .lines()
            .filter_map(|line| {
                let words = ["const ", "let ", "function ", "class "];
                let rest = words.iter().find_map(|word| line.strip_prefix(word))?;
                rest.split(|c: char| !c.is_alphanumeric() && c != '_')
                    .next()
            })
            .filter(|name| !name.is_empty())
            .collect();
        names.sort_unstable();
        let twice: Vec<_> = names.windows(2).filter(|two| two[0] == two[1]).collect();
        assert!(twice.is_empty(), "{twice:?}");
    }

    #[test]
    fn nothing_a_log_says_leaves_its_element() {
        let text = inert(&json!({ "name": "</script><!--\u{2028}\u{2029}\"'" }));
        assert!(!text.contains(['<', '\u{2028}', '\u{2029}']), "{text}");
        let read: Value = serde_json::from_str(&text).unwrap_or_default();
        assert_eq!(read["name"], "</script><!--\u{2028}\u{2029}\"'");
    }
}
