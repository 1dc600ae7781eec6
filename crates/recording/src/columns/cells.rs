//! A row -> its cells. Pure.

use std::borrow::Cow;
use std::str::FromStr;

/// Delimiter between two cells.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Delimiter {
    /// Single byte.
    Byte(u8),
    /// Any number of blanks and tabs.
    Blanks,
}

/// Names that can be written in a shell without quotes.
const NAMED: [(&str, Delimiter); 6] = [
    ("tab", Delimiter::Byte(b'\t')),
    ("semicolon", Delimiter::Byte(b';')),
    ("comma", Delimiter::Byte(b',')),
    ("pipe", Delimiter::Byte(b'|')),
    ("blanks", Delimiter::Blanks),
    ("space", Delimiter::Blanks),
];

impl Delimiter {
    /// Delimiters that are tried, in this order: what comes first may hold what comes later.
    pub(crate) const TRIED: [Delimiter; 5] = [
        Delimiter::Byte(b'\t'),
        Delimiter::Byte(b';'),
        Delimiter::Byte(b','),
        Delimiter::Byte(b'|'),
        Delimiter::Blanks,
    ];

    /// Name for `--delimiter`.
    #[must_use]
    pub fn name(self) -> String {
        let named = NAMED.iter().find(|(_, known)| *known == self);
        match (named, self) {
            (Some((name, _)), _) => (*name).to_owned(),
            (None, Delimiter::Byte(byte)) => char::from(byte).to_string(),
            (None, Delimiter::Blanks) => "blanks".to_owned(),
        }
    }

    /// A line without its end, and without what is beside its cells.
    pub(crate) fn row(self, line: &[u8]) -> &[u8] {
        match self {
            Delimiter::Blanks => line.trim_ascii(),
            Delimiter::Byte(byte) => {
                let is_end = |b: &u8| matches!(b, b'\r' | b'\n' | b' ') && *b != byte;
                let end = line.iter().rposition(|b| !is_end(b)).map_or(0, |at| at + 1);
                line.get(..end).unwrap_or_default()
            }
        }
    }

    /// The cells of a row: a cell in quotes with all that is in it.
    pub(crate) fn cells(self, row: &[u8]) -> Cells<'_> {
        Cells {
            delimiter: self,
            rest: Some(row),
        }
    }
}

impl FromStr for Delimiter {
    type Err = String;

    fn from_str(text: &str) -> Result<Delimiter, String> {
        if let Some((_, known)) = NAMED.iter().find(|(name, _)| *name == text) {
            return Ok(*known);
        }
        match text.as_bytes() {
            [b'\\', b't'] => Ok(Delimiter::Byte(b'\t')),
            [b' '] => Ok(Delimiter::Blanks),
            [byte] if byte.is_ascii_punctuation() && !b"\"'.+-_".contains(byte) => {
                Ok(Delimiter::Byte(*byte))
            }
            [b'\t'] => Ok(Delimiter::Byte(b'\t')),
            _ => Err(
                "one of tab, semicolon, comma, pipe, blanks, or a single punctuation mark that is in no number"
                    .to_owned(),
            ),
        }
    }
}

/// See [`Delimiter::cells`].
pub(crate) struct Cells<'a> {
    delimiter: Delimiter,
    rest: Option<&'a [u8]>,
}

impl<'a> Iterator for Cells<'a> {
    type Item = Cow<'a, [u8]>;

    #[inline]
    fn next(&mut self) -> Option<Cow<'a, [u8]>> {
        let text = self.rest?;
        let byte = match self.delimiter {
            Delimiter::Blanks => {
                let text = text.trim_ascii_start();
                let end = text.iter().position(u8::is_ascii_whitespace);
                let (cell, behind) = text.split_at(end.unwrap_or(text.len()));
                self.rest = Some(behind.trim_ascii_start()).filter(|rest| !rest.is_empty());
                return Some(Cow::Borrowed(cell));
            }
            Delimiter::Byte(byte) => byte,
        };
        let start = text.iter().position(|b| *b != b' ').unwrap_or(text.len());
        if text.get(start) == Some(&b'"') {
            let (cell, behind) = quoted(text.get(start + 1..).unwrap_or_default(), byte);
            self.rest = behind;
            return Some(Cow::Owned(cell));
        }
        let end = memchr::memchr(byte, text);
        self.rest = end.and_then(|end| text.get(end + 1..));
        let cell = text.get(..end.unwrap_or(text.len())).unwrap_or_default();
        Some(Cow::Borrowed(cell))
    }
}

/// The cell behind an opening quote, and the cells after it. Two quotes are one.
fn quoted(text: &[u8], delimiter: u8) -> (Vec<u8>, Option<&[u8]>) {
    let mut cell = Vec::new();
    let mut at = 0;
    while let Some(byte) = text.get(at) {
        at += 1;
        if *byte != b'"' {
            cell.push(*byte);
        } else if text.get(at) == Some(&b'"') {
            cell.push(b'"');
            at += 1;
        } else {
            break;
        }
    }
    let behind = text.get(at..).unwrap_or_default();
    let next = behind.iter().position(|b| *b == delimiter);
    (cell, next.and_then(|next| behind.get(next + 1..)))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn cells(delimiter: &str, line: &str) -> Vec<String> {
        let delimiter: Delimiter = delimiter.parse().unwrap();
        let row = delimiter.row(line.as_bytes());
        let text = |cell: Cow<'_, [u8]>| String::from_utf8_lossy(&cell).trim().to_owned();
        delimiter.cells(row).map(text).collect()
    }

    #[test]
    fn cells_are_cut_where_they_end_and_what_is_quoted_is_whole() {
        assert_eq!(cells("comma", "1, 2 ,,4\r\n"), ["1", "2", "", "4"]);
        assert_eq!(cells("tab", "\t1\t\t3\t\r\n"), ["", "1", "", "3", ""]);
        assert_eq!(cells(";", "\"a;\"\"b\"\"\";1,5 ;"), ["a;\"b\"", "1,5", ""]);
        assert_eq!(cells("blanks", "  1 \t 2  3 \n"), ["1", "2", "3"]);
        assert_eq!(cells(",", "\"never closed,1"), ["never closed,1"]);
        for bad in ["", "ab", "1", ".", "-", "\""] {
            assert!(bad.parse::<Delimiter>().is_err(), "{bad}");
        }
    }
}
