//! Line without a body rate -> why the one it names is none. Pure.
//!
//! Apart from the decoding, which takes what has the shape of a rate and passes over the rest: what it passed over is
//! looked at again only for the answer.

use serde_json::{Map, Value};
use strapd_recording::decode::is_rate_name;
use strapd_recording::text::printable;

/// Shape of the first value that a line names as a body rate; `None` where it names none, or is no object.
pub(super) fn of_rate(line: &[u8]) -> Option<String> {
    let object: Map<String, Value> = serde_json::from_slice(line).ok()?;
    let (key, value) = object.iter().find(|(key, _)| is_rate_name(key))?;
    let shape = match value {
        Value::Array(all) if all.len() == 3 => match all.iter().find(|value| !value.is_number()) {
            Some(other) => format!("holds {} beside its numbers", kind(other)),
            None => return None,
        },
        Value::Array(all) => format!("is a list of {}, not of 3 numbers", all.len()),
        Value::Object(_) => "is an object without the numbers x, y and z".to_owned(),
        Value::Number(_) => "is one number: three are needed, for x, y and z".to_owned(),
        other => format!("is {}, not a list of 3 numbers", kind(other)),
    };
    Some(format!("`{}` {shape}", printable(key)))
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "a text (numbers stand without quotes)",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

#[cfg(test)]
mod tests {
    use super::of_rate;

    #[test]
    fn a_rate_of_another_shape_is_described() {
        for (line, shape) in [
            (r#"{"gyro":[0,0]}"#, "`gyro` is a list of 2"),
            (r#"{"id":"a","gyro":[0,null,0]}"#, "`gyro` holds null"),
            (r#"{"gyro":["0.1",0,0]}"#, "without quotes"),
            (
                r#"{"angular_velocity":{"x":1}}"#,
                "without the numbers x, y and z",
            ),
            (r#"{"gx":1,"gy":2}"#, "`gx` is one number"),
            (r#"{"gyro":"1,2,3"}"#, "is a text"),
        ] {
            let said = of_rate(line.as_bytes()).unwrap_or_default();
            assert!(said.contains(shape), "{line}: {said}");
        }
        for line in [r#"{"gyro":[1,2,3]}"#, r#"{"a":1}"#, "[1]", "{"] {
            assert_eq!(of_rate(line.as_bytes()), None, "{line}");
        }
    }
}
