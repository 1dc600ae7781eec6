//! TOML <-> the calibration of a sensor (`--calibration`, `--save-calibration`). Pure.
//!
//! Written by hand: every key that is not known, every number that is none, is an error with its line.

use std::fmt::Write as _;
use std::ops::Range;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{CalibrationTerm, SensorCalibration};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Version that this release writes.
const FORMAT: u32 = 1;
/// A name, a date.
const LONGEST_TEXT: usize = 4096;
/// Recordings a calibration comes from.
const MOST_SOURCES: usize = 64;
/// The keys there are.
const KEYS: &str = "strapd_calibration, sensor, date, sources, bias, G, ba, A, lead, h, S, mag_lead, truncation_step, and in each of the last nine value, sigma, observed";

/// Fault at a place in the text.
struct Wrong {
    at: Range<usize>,
    what: Diagnostic,
}

type Read<T> = std::result::Result<T, Wrong>;

fn wrong<T>(at: &Range<usize>, what: impl Into<Diagnostic>) -> Read<T> {
    Err(Wrong {
        at: at.clone(),
        what: what.into(),
    })
}

/// The calibration in a text.
///
/// # Errors
/// In words, with the line and the key.
pub fn parse(text: &str) -> std::result::Result<SensorCalibration, Diagnostic> {
    let document = DeTable::parse(text).map_err(|e| e.to_string().trim_end().to_owned())?;
    let known = table(document.get_ref()).map_err(|e| {
        let before = text.get(..e.at.start).unwrap_or_default();
        let line = 1 + before.bytes().filter(|b| *b == b'\n').count();
        e.what.at(format_args!("line {line}"))
    })?;
    known.check()?;
    Ok(known)
}

fn table(document: &DeTable<'_>) -> Read<SensorCalibration> {
    let mut known = SensorCalibration::default();
    for (key, value) in document {
        let name = key.get_ref().as_ref();
        match name {
            "strapd_calibration" => {
                let format = value.get_ref().as_integer().map(|i| i.as_str().parse());
                if format != Some(Ok(FORMAT)) {
                    return wrong(
                        &value.span(),
                        format!("`{name}`: another format than {FORMAT}, which this release reads"),
                    );
                }
            }
            "sensor" => known.sensor = Some(text(name, value)?),
            "date" => known.date = Some(text(name, value)?),
            "sources" => known.sources = texts(name, value)?,
            "bias" => known.bias = Some(self::known(name, value)?),
            "G" => known.gyro = Some(self::known(name, value)?),
            "ba" => known.force_bias = Some(self::known(name, value)?),
            "A" => known.force = Some(self::known(name, value)?),
            "lead" => known.lead = Some(self::known(name, value)?),
            "h" => known.hard_iron = Some(self::known(name, value)?),
            "S" => known.soft_iron = Some(self::known(name, value)?),
            "mag_lead" => known.field_lead = Some(self::known(name, value)?),
            "truncation_step" => known.truncation_step = Some(self::known(name, value)?),
            _ => return unknown(&key.span(), name),
        }
    }
    Ok(known)
}

fn unknown<T>(at: &Range<usize>, name: &str) -> Read<T> {
    let name = strapd_recording::text::printable(name);
    wrong(
        at,
        Diagnostic::new(format!("unknown key `{name}`")).help(format!("there are {KEYS}")),
    )
}

type Value<'a, 'i> = &'a Spanned<DeValue<'i>>;

fn text(name: &str, value: Value<'_, '_>) -> Read<String> {
    let text = match value.get_ref() {
        DeValue::String(text) => text.to_string(),
        DeValue::Datetime(date) => date.to_string(),
        other => {
            return wrong(
                &value.span(),
                format!("`{name}`: a text is expected, not a {}", other.type_str()),
            );
        }
    };
    if text.len() > LONGEST_TEXT {
        return wrong(
            &value.span(),
            format!("`{name}`: longer than {LONGEST_TEXT} bytes"),
        );
    }
    Ok(text)
}

fn list<'a, 'i>(
    name: &str,
    value: Value<'a, 'i>,
    length: usize,
) -> Read<&'a [Spanned<DeValue<'i>>]> {
    match value.get_ref().as_array() {
        Some(list) if list.len() == length => Ok(list),
        Some(list) => wrong(
            &value.span(),
            format!("`{name}`: {} where {length} are expected", list.len()),
        ),
        None => wrong(
            &value.span(),
            format!(
                "`{name}`: a list of {length} is expected, not a {}",
                value.get_ref().type_str()
            ),
        ),
    }
}

fn texts(name: &str, value: Value<'_, '_>) -> Read<Vec<String>> {
    match value.get_ref().as_array() {
        Some(list) if list.len() <= MOST_SOURCES => list.iter().map(|v| text(name, v)).collect(),
        _ => wrong(
            &value.span(),
            format!("`{name}`: a list of at most {MOST_SOURCES} texts is expected"),
        ),
    }
}

/// The N values of one thing: itself, a list of 3, or 3 lists of 3.
fn leaves<'a, 'i, const N: usize>(name: &str, value: Value<'a, 'i>) -> Read<[Value<'a, 'i>; N]> {
    let mut all = [value; N];
    match N {
        1 => {}
        3 => all
            .iter_mut()
            .zip(list(name, value, 3)?)
            .for_each(|(to, from)| *to = from),
        _ => {
            for (row, value) in all.chunks_exact_mut(3).zip(list(name, value, 3)?) {
                row.iter_mut()
                    .zip(list(name, value, 3)?)
                    .for_each(|(to, from)| *to = from);
            }
        }
    }
    Ok(all)
}

fn numbers<const N: usize>(name: &str, value: Value<'_, '_>) -> Read<[f64; N]> {
    let mut numbers = [0.0; N];
    for (to, from) in numbers.iter_mut().zip(leaves::<N>(name, value)?) {
        *to = number(name, from)?;
    }
    Ok(numbers)
}

fn number(name: &str, value: Value<'_, '_>) -> Read<f64> {
    let number = match value.get_ref() {
        DeValue::Float(number) => number.as_str().parse().ok(),
        DeValue::Integer(number) if number.radix() == 10 => number.as_str().parse().ok(),
        other => {
            return wrong(
                &value.span(),
                format!("`{name}`: a number is expected, not a {}", other.type_str()),
            );
        }
    };
    match number.filter(|number: &f64| number.is_finite()) {
        Some(number) => Ok(number),
        None => wrong(&value.span(), format!("`{name}`: is no finite number")),
    }
}

/// One for all, or each its own.
fn truths<const N: usize>(name: &str, value: Value<'_, '_>) -> Read<[bool; N]> {
    if let Some(all) = value.get_ref().as_bool() {
        return Ok([all; N]);
    }
    let mut truths = [false; N];
    for (to, from) in truths.iter_mut().zip(leaves::<N>(name, value)?) {
        *to = match from.get_ref().as_bool() {
            Some(truth) => truth,
            None => {
                return wrong(
                    &from.span(),
                    format!(
                        "`{name}`: true or false is expected, not a {}",
                        from.get_ref().type_str()
                    ),
                );
            }
        };
    }
    Ok(truths)
}

/// A table of value, sigma, observed; or the value alone.
fn known<const N: usize>(name: &str, value: Value<'_, '_>) -> Read<CalibrationTerm<N>> {
    let Some(table) = value.get_ref().as_table() else {
        return Ok(CalibrationTerm {
            value: numbers(name, value)?,
            sigma: None,
            observed: [false; N],
        });
    };
    let (mut numbers_of, mut sigma, mut observed) = (None, None, None);
    for (key, value) in table {
        let inner = key.get_ref().as_ref();
        let full = format!("{name}.{inner}");
        match inner {
            "value" => numbers_of = Some(numbers(&full, value)?),
            "sigma" => sigma = Some(numbers(&full, value)?),
            "observed" => observed = Some(truths(&full, value)?),
            _ => return unknown(&key.span(), &full),
        }
    }
    let Some(numbers) = numbers_of else {
        return wrong(&value.span(), format!("`{name}`: `value` is missing"));
    };
    Ok(CalibrationTerm {
        value: numbers,
        sigma,
        observed: observed.unwrap_or([sigma.is_some(); N]),
    })
}

/// The text of a calibration; read, it is that calibration to nine digits.
#[must_use]
pub fn text_of(known: &SensorCalibration) -> String {
    let quoted = |text: &str| toml::Value::from(text).to_string();
    let mut out =
        String::from("# Calibration of a sensor: its axes as recorded, SI. docs/calibration.md\n");
    let _ = writeln!(out, "strapd_calibration = {FORMAT}");
    for (key, text) in [("sensor", &known.sensor), ("date", &known.date)] {
        if let Some(text) = text {
            let _ = writeln!(out, "{key} = {}", quoted(text));
        }
    }
    let sources: Vec<String> = known.sources.iter().map(|s| quoted(s)).collect();
    let _ = writeln!(out, "sources = [{}]", sources.join(", "));
    section(&mut out, "bias", "gyro bias, rad/s", &known.bias);
    section(&mut out, "G", "rate = (I + G) (gyro - bias)", &known.gyro);
    section(
        &mut out,
        "ba",
        "accelerometer bias, m/s^2",
        &known.force_bias,
    );
    section(&mut out, "A", "force = (I + A) (accel - ba)", &known.force);
    let lead = "time offset, s: a force belongs to the attitude so long after its stamp";
    section(&mut out, "lead", lead, &known.lead);
    let iron = "hard iron, in the unit the field is recorded in";
    section(&mut out, "h", iron, &known.hard_iron);
    section(&mut out, "S", "field = (I + S) (mag - h)", &known.soft_iron);
    let lead = "time offset, s: a field belongs to the attitude so long after its stamp";
    section(&mut out, "mag_lead", lead, &known.field_lead);
    let step = "rad/s: in such steps the driver cuts the rates towards zero";
    section(&mut out, "truncation_step", step, &known.truncation_step);
    out
}

fn section<const N: usize>(
    out: &mut String,
    key: &str,
    what: &str,
    known: &Option<CalibrationTerm<N>>,
) {
    let Some(known) = known else { return };
    let _ = writeln!(out, "\n[{key}]  # {what}");
    let _ = writeln!(
        out,
        "value = {}",
        nested(&known.value.map(|n| rounded(n, 8)))
    );
    if let Some(sigma) = &known.sigma {
        let _ = writeln!(out, "sigma = {}", nested(&sigma.map(|n| rounded(n, 2))));
    }
    let observed = match known.observed.first() {
        Some(first) if known.observed.iter().all(|o| o == first) => first.to_string(),
        _ => nested(&known.observed.map(|o| o.to_string())),
    };
    let _ = writeln!(out, "observed = {observed}");
}

fn nested(all: &[String]) -> String {
    let list = |part: &[String]| format!("[{}]", part.join(", "));
    match all {
        [one] => one.clone(),
        [_, _, _] => list(all),
        _ => list(&all.chunks(3).map(list).collect::<Vec<_>>()),
    }
}

/// Rounds to so many digits behind the first, and then as short as it reads the same.
fn rounded(number: f64, digits: usize) -> String {
    let short: f64 = format!("{number:.digits$e}").parse().unwrap_or(number);
    // What has neither point nor exponent is no float in TOML.
    format!("{short:?}")
}
