//! A number <-> its bits as a cell of text. Pure.
//!
//! Apart from the rows because tables that are stored by columns have numbers already: written with digits and read again
//! they would cost most of what reading such a table costs.

use std::borrow::Cow;

/// Mark of a cell that holds the bits of a number; in no text that a person writes.
const MARK: u8 = 1;
/// Bytes of a cell: the mark, and six bits in each of the others.
const LENGTH: usize = 12;
/// Byte for six bits of zero: from there on nothing is a delimiter, a blank or a quote.
const ZERO: u8 = b'0';

/// Appends the cell of a number.
#[cfg(any(feature = "parquet", test))]
#[inline]
pub(crate) fn put(value: f64, out: &mut Vec<u8>) {
    let bits = value.to_bits();
    let mut cell = [MARK; LENGTH];
    for (n, byte) in cell.iter_mut().skip(1).enumerate() {
        *byte = ZERO + (bits >> (6 * n) & 63) as u8;
    }
    out.extend_from_slice(&cell);
}

/// Returns the number of a cell; `None` of one that does not hold bits.
#[inline]
pub(crate) fn read(cell: &[u8]) -> Option<f64> {
    let [MARK, digits @ ..]: &[u8; LENGTH] = cell.try_into().ok()? else {
        return None;
    };
    let bits = digits.iter().rev().fold(0u64, |bits, byte| {
        bits << 6 | u64::from(byte.wrapping_sub(ZERO) & 63)
    });
    Some(f64::from_bits(bits))
}

/// Returns the cell with digits, the fewest that are its bits.
pub(crate) fn spelled(cell: &[u8]) -> Cow<'_, [u8]> {
    match read(cell) {
        Some(value) => Cow::Owned(format!("{value:e}").into_bytes()),
        None => Cow::Borrowed(cell),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_comes_back_with_its_bits_and_its_cell_is_one_of_a_table() {
        for value in [
            0.0,
            -0.0,
            1.5,
            f64::MIN_POSITIVE,
            -1e300,
            f64::INFINITY,
            f64::NAN,
        ] {
            let mut cell = Vec::new();
            put(value, &mut cell);
            assert_eq!(read(&cell).map(f64::to_bits), Some(value.to_bits()));
            let is_plain = |byte: &u8| !b" \t\n\r\",".contains(byte);
            assert!(cell.iter().all(is_plain), "{cell:?}");
        }
        for text in [&b"1.5"[..], b"", b"\x01", b"000000000000"] {
            assert_eq!((read(text), spelled(text).as_ref()), (None, text));
        }
    }
}
