//! An error of `serde_json` about one line -> what is wrong and in which column. Pure.
//!
//! Apart because `serde_json` says all of it in one text: what, and then the line, which is the first of one. Who reads
//! lines knows which of all it is.

use crate::text::printable;

/// Fault in a line of JSON.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct JsonFault {
    /// Description of what is wrong, fit for a terminal.
    pub what: String,
    /// Column at which it was met, from 1; 0 where there is none.
    pub column: u64,
}

impl From<serde_json::Error> for JsonFault {
    fn from(why: serde_json::Error) -> JsonFault {
        let text = why.to_string();
        let place = format!(" at line {} column {}", why.line(), why.column());
        JsonFault {
            what: printable(text.strip_suffix(&place).unwrap_or(&text)),
            column: why.column() as u64,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn what_a_sender_wrote_is_not_taken_for_the_place() {
        let why = serde_json::from_str::<u32>(r#""x at line 7""#).unwrap_err();
        let found = JsonFault::from(why);
        assert_eq!(
            found.what,
            "invalid type: string \"x at line 7\", expected u32"
        );
        assert_eq!(found.column, 13);
    }
}
