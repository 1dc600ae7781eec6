//! JSON text -> tokens, one pass, nothing allocated. Pure.
//!
//! Our own scanner rather than serde's, for two things serde does not give: a number's text (decimal
//! seconds keep their nanoseconds) and a stop at what is wanted. A test compares what it accepts
//! with serde_json. Beyond RFC 8259 it takes the `NaN`, `Infinity` and `-Infinity` that Python
//! writes: such a sample is then counted as not finite, not as undecodable.

use crate::decimal;
use crate::decode::Undecodable;
use std::borrow::Cow;

/// Deepest nesting.
pub(crate) const MAX_DEPTH: u32 = 64;

/// A place in a text.
#[derive(Debug, Clone)]
pub(crate) struct Scanner<'a> {
    text: &'a str,
    pos: usize,
}

type Scan<T> = Result<T, Undecodable>;

impl<'a> Scanner<'a> {
    /// Begins at the start of `bytes`.
    pub(crate) fn new(bytes: &'a [u8]) -> Scan<Self> {
        match std::str::from_utf8(bytes) {
            Ok(text) => Ok(Scanner { text, pos: 0 }),
            Err(error) => Err(Undecodable::Json {
                offset: error.valid_up_to() as u64,
                what: "not UTF-8",
            }),
        }
    }

    /// The byte it is at.
    pub(crate) fn position(&self) -> usize {
        self.pos
    }

    /// Bytes passed since `start`.
    pub(crate) fn since(&self, start: usize) -> &'a [u8] {
        let bytes = self.text.as_bytes();
        bytes.get(start..self.pos).unwrap_or_default()
    }

    #[cold]
    fn broken<T>(&self, what: &'static str) -> Scan<T> {
        Err(Undecodable::Json {
            offset: self.pos as u64,
            what,
        })
    }

    #[inline]
    fn byte(&self) -> Option<u8> {
        self.text.as_bytes().get(self.pos).copied()
    }

    /// The next byte that is no white space.
    #[inline]
    pub(crate) fn peek(&mut self) -> Option<u8> {
        loop {
            match self.byte() {
                Some(b' ' | b'\t' | b'\n' | b'\r') => self.pos += 1,
                other => return other,
            }
        }
    }

    fn expect(&mut self, byte: u8, what: &'static str) -> Scan<()> {
        if self.peek() != Some(byte) {
            return self.broken(what);
        }
        self.pos += 1;
        Ok(())
    }

    /// Goes into an object or array whose opening bracket [`Scanner::peek`] has shown.
    #[inline]
    pub(crate) fn enter(&mut self) {
        self.pos += 1;
    }

    /// The next key of an object; `None` at its end.
    #[inline]
    pub(crate) fn key(&mut self, first: &mut bool) -> Scan<Option<Cow<'a, str>>> {
        if !self.item(b'}', first)? {
            return Ok(None);
        }
        if self.peek() != Some(b'"') {
            return self.broken("expected a key in quotes");
        }
        let key = self.string()?;
        self.expect(b':', "expected `:`")?;
        Ok(Some(key))
    }

    /// Whether an array goes on; at its end it is left.
    #[inline]
    pub(crate) fn element(&mut self, first: &mut bool) -> Scan<bool> {
        self.item(b']', first)
    }

    #[inline]
    fn item(&mut self, close: u8, first: &mut bool) -> Scan<bool> {
        match self.peek() {
            Some(b) if b == close => {
                self.pos += 1;
                Ok(false)
            }
            Some(_) if *first => {
                *first = false;
                Ok(true)
            }
            Some(b',') => {
                self.pos += 1;
                Ok(true)
            }
            Some(_) => self.broken("expected `,`"),
            None => self.broken("ends in the middle"),
        }
    }

    /// A string, whose opening quote [`Scanner::peek`] has shown.
    #[inline]
    pub(crate) fn string(&mut self) -> Scan<Cow<'a, str>> {
        let start = self.pos + 1;
        let escaped = self.skip_string()?;
        let raw = self.text.get(start..self.pos - 1).unwrap_or("");
        Ok(if escaped {
            Cow::Owned(unescape(raw))
        } else {
            Cow::Borrowed(raw)
        })
    }

    /// Goes over a string; whether it holds an escape.
    #[inline]
    fn skip_string(&mut self) -> Scan<bool> {
        self.pos += 1;
        let mut escaped = false;
        loop {
            match self.byte() {
                Some(b'"') => {
                    self.pos += 1;
                    return Ok(escaped);
                }
                Some(b'\\') => {
                    escaped = true;
                    self.escape()?;
                }
                Some(0..=0x1f) => return self.broken("a control character in a string"),
                Some(_) => self.pos += 1,
                None => return self.broken("ends inside a string"),
            }
        }
    }

    /// Goes over one escape; a surrogate must come in a pair.
    fn escape(&mut self) -> Scan<()> {
        self.pos += 1;
        match self.byte() {
            Some(b'"' | b'\\' | b'/' | b'b' | b'f' | b'n' | b'r' | b't') => self.pos += 1,
            Some(b'u') => {
                let unit = self.hex()?;
                if (0xdc00..0xe000).contains(&unit) {
                    return self.broken("half a surrogate pair");
                }
                if (0xd800..0xdc00).contains(&unit) {
                    if self.text.as_bytes().get(self.pos..self.pos + 2) != Some(b"\\u") {
                        return self.broken("half a surrogate pair");
                    }
                    self.pos += 1;
                    if !(0xdc00..0xe000).contains(&self.hex()?) {
                        return self.broken("half a surrogate pair");
                    }
                }
            }
            _ => return self.broken("no such escape"),
        }
        Ok(())
    }

    /// Four hexadecimal digits behind a `u`.
    fn hex(&mut self) -> Scan<u32> {
        let digits = self.text.as_bytes().get(self.pos + 1..self.pos + 5);
        let value = digits.and_then(|digits| {
            digits
                .iter()
                .try_fold(0, |sum, b| Some(sum * 16 + char::from(*b).to_digit(16)?))
        });
        let Some(value) = value else {
            return self.broken("expected four hexadecimal digits");
        };
        self.pos += 5;
        Ok(value)
    }

    /// A number as its text; `None` when the value is something else, which is gone over.
    #[inline]
    pub(crate) fn number(&mut self) -> Scan<Option<&'a str>> {
        let first = self.peek();
        let start = self.pos;
        match first {
            Some(b'-' | b'0'..=b'9') => self.skip_number()?,
            Some(b'N') => self.literal("NaN")?,
            Some(b'I') => self.literal("Infinity")?,
            _ => {
                self.skip(0)?;
                return Ok(None);
            }
        }
        Ok(self.text.get(start..self.pos))
    }

    /// A number as `f64`, correctly rounded; `None` when the value is something else.
    #[inline]
    pub(crate) fn float(&mut self) -> Scan<Option<f64>> {
        self.peek();
        if let Some((value, len)) =
            decimal::short(self.text.as_bytes().get(self.pos..).unwrap_or_default())
        {
            self.pos += len;
            return Ok(Some(value));
        }
        // Rust reads `NaN`, `Infinity` and `-Infinity` as meant, and what is beyond as infinite.
        Ok(self.number()?.and_then(|text| text.parse().ok()))
    }

    fn skip_number(&mut self) -> Scan<()> {
        if self.byte() == Some(b'-') {
            self.pos += 1;
            if self.byte() == Some(b'I') {
                return self.literal("Infinity");
            }
        }
        match self.byte() {
            Some(b'0') => self.pos += 1,
            Some(b'1'..=b'9') => self.digits(),
            _ => return self.broken("expected a digit"),
        }
        if self.byte() == Some(b'.') {
            self.pos += 1;
            self.some_digits()?;
        }
        if matches!(self.byte(), Some(b'e' | b'E')) {
            self.pos += 1;
            if matches!(self.byte(), Some(b'+' | b'-')) {
                self.pos += 1;
            }
            self.some_digits()?;
        }
        Ok(())
    }

    #[inline]
    fn digits(&mut self) {
        while matches!(self.byte(), Some(b'0'..=b'9')) {
            self.pos += 1;
        }
    }

    fn some_digits(&mut self) -> Scan<()> {
        let start = self.pos;
        self.digits();
        if self.pos == start {
            return self.broken("expected a digit");
        }
        Ok(())
    }

    fn literal(&mut self, word: &'static str) -> Scan<()> {
        let rest = self.text.as_bytes().get(self.pos..).unwrap_or(&[]);
        if !rest.starts_with(word.as_bytes()) {
            return self.broken("expected a value");
        }
        self.pos += word.len();
        Ok(())
    }

    /// Goes over any value, checking it.
    pub(crate) fn skip(&mut self, depth: u32) -> Scan<()> {
        if depth > MAX_DEPTH {
            return self.broken("nested too deep");
        }
        match self.peek() {
            Some(b'"') => self.skip_string().map(|_| ()),
            Some(b'-' | b'0'..=b'9') => self.skip_number(),
            Some(b'{') => {
                self.enter();
                let mut first = true;
                while self.key(&mut first)?.is_some() {
                    self.skip(depth + 1)?;
                }
                Ok(())
            }
            Some(b'[') => {
                self.enter();
                let mut first = true;
                while self.element(&mut first)? {
                    self.skip(depth + 1)?;
                }
                Ok(())
            }
            Some(b't') => self.literal("true"),
            Some(b'f') => self.literal("false"),
            Some(b'n') => self.literal("null"),
            Some(b'N') => self.literal("NaN"),
            Some(b'I') => self.literal("Infinity"),
            Some(_) => self.broken("expected a value"),
            None => self.broken("ends in the middle"),
        }
    }

    /// Nothing but white space may follow.
    pub(crate) fn end(&mut self) -> Scan<()> {
        match self.peek() {
            None => Ok(()),
            Some(_) => self.broken("something follows the value"),
        }
    }
}

/// A string's text without its escapes, which have been checked.
fn unescape(raw: &str) -> String {
    let mut out = String::with_capacity(raw.len());
    let mut rest = raw;
    while let Some((plain, escape)) = rest.split_once('\\') {
        out.push_str(plain);
        let (c, len) = match escape.as_bytes().first() {
            Some(b'b') => ('\u{8}', 1),
            Some(b'f') => ('\u{c}', 1),
            Some(b'n') => ('\n', 1),
            Some(b'r') => ('\r', 1),
            Some(b't') => ('\t', 1),
            Some(b'u') => {
                let unit = |at: usize| {
                    let digits = escape.get(at..at + 4)?;
                    u16::from_str_radix(digits, 16).ok()
                };
                let units = [unit(1), unit(7)].into_iter().flatten();
                let c = char::decode_utf16(units).next().and_then(Result::ok);
                let len = if c.is_some_and(|c| c.len_utf16() == 2) {
                    11
                } else {
                    5
                };
                (c.unwrap_or(char::REPLACEMENT_CHARACTER), len)
            }
            Some(other) => (char::from(*other), 1),
            None => break,
        };
        out.push(c);
        rest = escape.get(len..).unwrap_or("");
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use proptest::prelude::*;

    fn accepts(bytes: &[u8]) -> bool {
        Scanner::new(bytes)
            .and_then(|mut s| s.skip(0).and_then(|()| s.end()))
            .is_ok()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        #[test]
        fn it_accepts_what_serde_json_accepts(text in r#"[\[\]{}:,"\\ux0-9eE+. truefalsnD8Cd-]{0,24}"#) {
            // serde_json alone knows limits to numbers; they are not the scanner's business.
            let serde = serde_json::from_str::<serde::de::IgnoredAny>(&text);
            prop_assert_eq!(accepts(text.as_bytes()), serde.is_ok(), "{}: {:?}", text, serde);
        }

        #[test]
        fn a_string_comes_out_as_serde_json_wrote_it(text in "\\PC{0,20}[\u{0}-\u{20}\"\\\\]{0,4}\\PC{0,4}") {
            let quoted = serde_json::to_string(&text).unwrap();
            let mut scanner = Scanner::new(quoted.as_bytes()).unwrap();
            prop_assert_eq!(scanner.string().unwrap(), text);
        }

        #[test]
        fn a_float_comes_out_bit_for_bit(bits: u64) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            let text = serde_json::to_string(&value).unwrap();
            let read = Scanner::new(text.as_bytes()).unwrap().float().unwrap().unwrap();
            prop_assert_eq!(read.to_bits(), bits);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        #[test]
        fn a_short_decimal_is_read_as_rust_reads_it(text in "-?(0|[1-9][0-9]{0,12})([.][0-9]{1,14})?", end in "[],} ]") {
            let whole = format!("{text}{end}");
            let wanted: f64 = text.parse().unwrap();
            let mut scanner = Scanner::new(whole.as_bytes()).unwrap();
            let read = scanner.float().unwrap().unwrap();
            prop_assert_eq!(read.to_bits(), wanted.to_bits());
            prop_assert_eq!(scanner.position(), text.len());
        }
    }

    #[test]
    fn surrogates_come_in_pairs() {
        let mut scanner = Scanner::new(br#""\ud83d\ude00\u0041""#).unwrap();
        assert_eq!(scanner.string().unwrap(), "\u{1f600}A");
        for bad in [
            &br#""\ud83d""#[..],
            br#""\ud83dx""#,
            br#""\ude00""#,
            br#""\ud83d\u0041""#,
            br#""\u00g0""#,
            br#""\u00""#,
        ] {
            assert!(!accepts(bad), "{}", String::from_utf8_lossy(bad));
        }
    }

    #[test]
    fn pythons_nan_is_a_number_and_deep_nesting_is_refused() {
        assert!(
            Scanner::new(b"NaN")
                .unwrap()
                .float()
                .unwrap()
                .unwrap()
                .is_nan()
        );
        assert_eq!(
            Scanner::new(b"-Infinity").unwrap().float().unwrap(),
            Some(f64::NEG_INFINITY)
        );
        assert_eq!(Scanner::new(b"null").unwrap().float().unwrap(), None);
        let deep = |n: usize| format!("{}{}", "[".repeat(n), "]".repeat(n));
        assert!(accepts(deep(60).as_bytes()));
        assert!(!accepts(deep(100_000).as_bytes()));
    }
}
