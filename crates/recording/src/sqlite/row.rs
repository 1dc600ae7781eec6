//! The bytes of a row -> its values. Pure.
//!
//! Apart from the page because a long row lies in several.

use super::page::varint;

/// A value of a row.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Value<'a> {
    Null,
    Integer(i64),
    Real(f64),
    Text(&'a [u8]),
    Blob(&'a [u8]),
}

impl<'a> Value<'a> {
    pub(crate) fn integer(self) -> Option<i64> {
        match self {
            Value::Integer(value) => Some(value),
            _ => None,
        }
    }

    pub(crate) fn text(self) -> Option<&'a [u8]> {
        match self {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    pub(crate) fn blob(self) -> Option<&'a [u8]> {
        match self {
            Value::Blob(bytes) => Some(bytes),
            _ => None,
        }
    }
}

/// The values of a row, one after the other; what cannot be read ends them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<'a> {
    kinds: &'a [u8],
    body: &'a [u8],
}

impl<'a> Row<'a> {
    pub(crate) fn of(bytes: &'a [u8]) -> Option<Row<'a>> {
        let (length, used) = varint(bytes)?;
        let length = usize::try_from(length).ok()?;
        let (head, body) = bytes.split_at_checked(length)?;
        Some(Row {
            kinds: head.get(used..)?,
            body,
        })
    }

    /// Whether all of its bytes are those of its values.
    pub(crate) fn is_exact(mut self) -> bool {
        while self.next().is_some() {}
        self.kinds.is_empty() && self.body.is_empty()
    }
}

impl<'a> Iterator for Row<'a> {
    type Item = Value<'a>;

    #[inline]
    fn next(&mut self) -> Option<Value<'a>> {
        let (kind, used) = varint(self.kinds)?;
        let length = match kind {
            0 | 8 | 9 => 0,
            1..=4 => kind,
            5 => 6,
            6 | 7 => 8,
            // Of no version that there is.
            10 | 11 => return None,
            _ => (kind - 12) / 2,
        };
        let (bytes, body) = self.body.split_at_checked(usize::try_from(length).ok()?)?;
        let value = match kind {
            0 => Value::Null,
            7 => Value::Real(f64::from_bits(integer(bytes).cast_unsigned())),
            8 => Value::Integer(0),
            9 => Value::Integer(1),
            1..=6 => Value::Integer(integer(bytes)),
            _ if kind.is_multiple_of(2) => Value::Blob(bytes),
            _ => Value::Text(bytes),
        };
        self.kinds = self.kinds.get(used..)?;
        self.body = body;
        Some(value)
    }
}

/// Reads at most eight bytes, the greatest first, with a sign.
#[inline]
fn integer(bytes: &[u8]) -> i64 {
    if let Ok(whole) = <[u8; 8]>::try_from(bytes) {
        return i64::from_be_bytes(whole);
    }
    let first = bytes.first().map_or(0, |b| i64::from(b.cast_signed()));
    let rest = bytes.get(1..).unwrap_or(&[]);
    rest.iter()
        .fold(first, |value, byte| value << 8 | i64::from(*byte))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn values_of_every_kind_are_read_and_a_row_that_is_cut_ends_them() {
        let bytes = [
            &[12, 0, 1, 2, 3, 5, 6, 7, 8, 9, 14, 17][..],
            &[0xff],
            &[0x01, 0x00],
            &[0xff, 0xff, 0xfe],
            &[0, 0, 0, 0, 1, 2],
            &i64::MIN.to_be_bytes(),
            &1.5_f64.to_be_bytes(),
            b"b",
            b"/t",
        ]
        .concat();
        let row = Row::of(&bytes).unwrap();
        let expected = [
            Value::Null,
            Value::Integer(-1),
            Value::Integer(256),
            Value::Integer(-2),
            Value::Integer(258),
            Value::Integer(i64::MIN),
            Value::Real(1.5),
            Value::Integer(0),
            Value::Integer(1),
            Value::Blob(b"b"),
            Value::Text(b"/t"),
        ];
        assert_eq!(row.collect::<Vec<_>>(), expected);
        assert!(row.is_exact());
        let cut = Row::of(&bytes[..bytes.len() - 1]).unwrap();
        assert_eq!(cut.count(), 10);
        assert!(!cut.is_exact());
        assert!(Row::of(&bytes[..5]).is_none());
    }
}
