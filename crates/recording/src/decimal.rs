//! Digits of a short decimal -> the number. Pure.
//!
//! Apart from the readers because lines of JSON and rows of tables have such numbers alike, and nearly all that a sensor
//! says is short.

/// Most digits that an integer of 53 bits holds, whatever they are.
const EXACT_DIGITS: usize = 15;
/// Powers of ten up to [`EXACT_DIGITS`], each exact.
const TENS: [f64; EXACT_DIGITS + 1] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
];

/// Value and length of a decimal of few digits without an exponent, in one pass: its digits and the power of ten under
/// them are exact, so that their quotient is correctly rounded (Clinger 1990). `None` for every other text.
#[inline]
pub(crate) fn short(text: &[u8]) -> Option<(f64, usize)> {
    let is_negative = text.first() == Some(&b'-');
    let start = usize::from(is_negative);
    // One more than is exact, and the point: what is longer is not begun, and no sum of so few overflows.
    let most = text.len().min(start + EXACT_DIGITS + 2);
    let body = text.get(start..most)?;
    let (sum, whole) = digits(body, 0);
    let (sum, decimals, length) = match body.get(whole) {
        Some(b'.') => {
            let (sum, decimals) = digits(body.get(whole + 1..)?, sum);
            (sum, decimals, whole + 1 + decimals)
        }
        _ => (sum, 0, whole),
    };
    let is_end = matches!(
        text.get(start + length),
        None | Some(b',' | b']' | b'}' | b' ' | b'\t' | b'\r' | b'\n')
    );
    // `.5`, `5.` and `05` are no JSON, and more digits are not exact.
    let has_leading_zero = whole > 1 && body.first() == Some(&b'0');
    let has_bare_point = length == whole + 1;
    let is_exact = whole + decimals <= EXACT_DIGITS;
    if !is_end || whole == 0 || has_leading_zero || has_bare_point || !is_exact {
        return None;
    }
    let value = sum as f64 / TENS.get(decimals)?;
    Some((if is_negative { -value } else { value }, start + length))
}

/// Digits at the beginning, put behind those of `sum`, and their number.
#[inline]
fn digits(text: &[u8], mut sum: u64) -> (u64, usize) {
    let mut count = 0;
    for byte in text {
        let value = byte.wrapping_sub(b'0');
        if value > 9 {
            break;
        }
        sum = sum * 10 + u64::from(value);
        count += 1;
    }
    (sum, count)
}

/// Value of a text that is such a decimal and nothing else.
#[inline]
pub(crate) fn alone(text: &[u8]) -> Option<f64> {
    // A sign, a point and the digits: what is longer is none, and need not be begun.
    let text = (text.len() <= EXACT_DIGITS + 2).then_some(text)?;
    let (value, length) = short(text)?;
    (length == text.len()).then_some(value)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        #[test]
        fn a_short_decimal_is_read_as_rust_reads_it(text in "-?(0|[1-9][0-9]{0,12})([.][0-9]{1,14})?", end in "[],} ]?") {
            let digits = text.bytes().filter(u8::is_ascii_digit).count();
            let read = short(format!("{text}{end}").as_bytes());
            prop_assert_eq!(read.is_some(), digits <= EXACT_DIGITS);
            if let Some((value, length)) = read {
                prop_assert_eq!(value.to_bits(), text.parse::<f64>().unwrap().to_bits());
                prop_assert_eq!(length, text.len());
            }
        }
    }

    #[test]
    fn what_only_looks_like_a_short_decimal_is_none() {
        for text in [
            "-,", ".5,", "5.,", "05,", "-00.5]", "1.2.3,", "1e5,", "", "NaN,", "--1,", ",",
        ] {
            assert_eq!(short(text.as_bytes()), None, "{text}");
        }
        assert_eq!((alone(b"1 2"), alone(b"1.25")), (None, Some(1.25)));
        let zero = short(b"-0.0,").unwrap();
        assert!(zero.0 == 0.0 && zero.0.is_sign_negative() && zero.1 == 4);
    }
}
