//! Requests as NDJSON on standard input -> answers on standard output, one line each, in order. I/O.
//!
//! The loop every model shares. A request is a JSON object read into a type of the model's own
//! (`serde`, unknown fields refused by name); an answer is a JSON object. What cannot be answered is
//! `{"error": ".."}` on its line, and the loop goes on.

use crate::cli::Outcome;
use crate::error::{Error, Result};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, IsTerminal, Read, Write};
use std::path::PathBuf;
use strapd_recording::json_fault::JsonFault;

/// Longest request that is read: a composite of some thousand bodies.
const LONGEST: u64 = 1 << 20;

/// Why a request has no answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Refusal {
    /// Error in words, with the numbers.
    pub(super) error: String,
    /// The kind of reason, for programs, where a model has several.
    pub(super) reason: Option<&'static str>,
}

impl From<String> for Refusal {
    fn from(error: String) -> Refusal {
        Refusal {
            error,
            reason: None,
        }
    }
}

/// Answers every request on standard input.
///
/// # Errors
/// Standard input cannot be read or standard output not be written.
pub(super) fn run<R: DeserializeOwned>(
    answer: impl FnMut(R) -> std::result::Result<Value, Refusal>,
) -> Result<Outcome> {
    run_as(answer, |value: &Value| value.to_string())
}

/// Runs as [`run`], with answers written otherwise than as a line of JSON.
///
/// # Errors
/// As [`run`].
pub(super) fn run_as<R: DeserializeOwned>(
    answer: impl FnMut(R) -> std::result::Result<Value, Refusal>,
    write: impl Fn(&Value) -> String,
) -> Result<Outcome> {
    let input = std::io::stdin();
    if input.is_terminal() {
        tracing::info!("reading requests: one JSON object a line, Ctrl-D ends them");
    }
    let refused = answer_all(
        &mut BufReader::with_capacity(1 << 16, input),
        &mut std::io::stdout().lock(),
        answer,
        write,
    )?;
    if refused > 0 {
        tracing::warn!("{refused} requests were refused; each says why on its line");
        return Ok(Outcome::Lossy);
    }
    Ok(Outcome::Done)
}

/// The loop; returns how many requests were refused.
fn answer_all<R: DeserializeOwned>(
    input: &mut BufReader<impl Read>,
    out: &mut impl Write,
    mut answer: impl FnMut(R) -> std::result::Result<Value, Refusal>,
    write: impl Fn(&Value) -> String,
) -> Result<u64> {
    let mut line = Vec::new();
    let mut written = Vec::new();
    let mut refused = 0;
    for number in 1_u64.. {
        let (read, whole) = next_line(input, &mut line)?;
        if read == 0 {
            break;
        }
        if line.iter().all(u8::is_ascii_whitespace) && whole {
            continue;
        }
        let answered = if whole {
            request(&line)
                .map_err(|e| format!("line {number}: {e}").into())
                .and_then(&mut answer)
                .and_then(finite)
        } else {
            Err(format!("line {number}: longer than {LONGEST} bytes").into())
        };
        let value = answered.unwrap_or_else(|refusal| {
            refused += 1;
            let mut value = json!({ "error": refusal.error });
            if let Some(reason) = refusal.reason {
                value["reason"] = reason.into();
            }
            value
        });
        written.extend_from_slice(write(&value).as_bytes());
        written.push(b'\n');
        // Whoever asks one thing at a time waits for its answer; a file of requests does not.
        if input.buffer().is_empty() || written.len() > 1 << 16 {
            put(out, &mut written)?;
        }
    }
    put(out, &mut written)?;
    Ok(refused)
}

fn put(out: &mut impl Write, bytes: &mut Vec<u8>) -> Result<()> {
    out.write_all(bytes)
        .and_then(|()| out.flush())
        .map_err(|e| Error::writing("stdout", e))?;
    bytes.clear();
    Ok(())
}

/// Reads a line; says how many bytes, and whether they are all of it. The rest of a longer one is
/// skipped.
fn next_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> Result<(usize, bool)> {
    let fail = |source| strapd_recording::Error::Read {
        path: PathBuf::from("standard input"),
        offset: 0,
        source,
    };
    line.clear();
    let read = Read::take(&mut *input, LONGEST + 1)
        .read_until(b'\n', line)
        .map_err(fail)?;
    let whole = read as u64 <= LONGEST || line.ends_with(b"\n");
    if !whole {
        input.skip_until(b'\n').map_err(fail)?;
    }
    Ok((read, whole))
}

/// The request, or what of it was not understood and where.
fn request<R: DeserializeOwned>(line: &[u8]) -> std::result::Result<R, String> {
    // An array would be taken for the fields in their order.
    if line.trim_ascii_start().first() == Some(&b'[') {
        return Err("column 1: a request is one JSON object".to_owned());
    }
    serde_json::from_slice(line).map_err(|e| {
        let JsonFault { what, column } = e.into();
        format!("column {column}: {what}")
    })
}

/// JSON writes NaN and infinity as null; no answer of ours means either.
fn finite(answer: Value) -> std::result::Result<Value, Refusal> {
    fn has_null(value: &Value) -> bool {
        match value {
            Value::Null => true,
            Value::Array(items) => items.iter().any(has_null),
            Value::Object(fields) => fields.values().any(has_null),
            Value::Bool(_) | Value::Number(_) | Value::String(_) => false,
        }
    }
    if has_null(&answer) {
        Err(
            "the numbers are so large or small that the answer is not finite"
                .to_owned()
                .into(),
        )
    } else {
        Ok(answer)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Root {
        of: f64,
    }

    fn answers(input: &[u8]) -> (Vec<Value>, u64) {
        let mut out = Vec::new();
        let refused = answer_all(
            &mut BufReader::new(input),
            &mut out,
            |r: Root| {
                if r.of < 0.0 {
                    return Err(format!("{} has no root", r.of).into());
                }
                Ok(json!({ "root": r.of.sqrt(), "inverse": 1.0 / r.of }))
            },
            Value::to_string,
        )
        .unwrap();
        let lines = String::from_utf8(out).unwrap();
        let answers = lines.lines().map(|l| serde_json::from_str(l).unwrap());
        (answers.collect(), refused)
    }

    #[test]
    fn one_answer_a_request_in_order_and_the_last_line_needs_no_end() {
        let (got, refused) = answers(b"{\"of\":4}\n\n  \r\n{\"of\":9}\r\n{\"of\":16}");
        let roots: Vec<f64> = got.iter().map(|a| a["root"].as_f64().unwrap()).collect();
        assert_eq!((roots, refused), (vec![2.0, 3.0, 4.0], 0));
    }

    #[test]
    fn what_is_no_request_is_said_on_its_line_and_the_next_is_answered() {
        let (got, refused) = answers(
            b"{\"of\":4,\"off\":1}\n{\"of\":\"4\"}\nnonsense\n\xff\n{}\n[4]\n{\"of\":1}\n{\"of\":-1}\n{\"of\":0}\n",
        );
        assert_eq!((got.len(), refused), (9, 8));
        let error = |k: usize| got[k]["error"].as_str().unwrap();
        assert!(
            error(0).contains("line 1") && error(0).contains("`off`") && error(0).contains("`of`"),
            "{}",
            error(0)
        );
        assert!(error(1).contains("column"), "{}", error(1));
        assert!(error(4).contains("missing field `of`"), "{}", error(4));
        assert_eq!(got[6]["root"], 1.0);
        assert!(error(7).contains("-1 has no root"), "{}", error(7));
        assert!(error(8).contains("not finite"), "{}", error(8));
    }

    #[test]
    fn a_request_too_long_to_hold_is_skipped_and_the_next_answered() {
        let mut input = vec![b' '; 3 * LONGEST as usize];
        input.extend_from_slice(b"\n{\"of\":1}\n");
        let (got, refused) = answers(&input);
        assert_eq!((got.len(), refused), (2, 1));
        assert!(got[0]["error"].as_str().unwrap().contains("longer than"));
    }
}
