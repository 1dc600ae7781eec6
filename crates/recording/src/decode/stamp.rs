//! A stamp as a message writes it -> integer nanoseconds. Pure.
//!
//! Apart from the decoders because messages agree on nothing but that there is a time: seconds and
//! nanoseconds, one integer of some unit, decimal seconds, RFC 3339. Decimal text is never turned
//! into an `f64` on the way: at today's epoch one step of it is 2.4e-7 s.

mod unit;

pub use unit::{Ambiguous, Bare, MOST_WAITING, unit_of};
pub(crate) use unit::{
    OUR_TIME, SHORTEST_STEP, UnitEvidence, unit_in_log, units_of_steps, units_that_fit,
};

use strapd_attitude::record::{Nanos, TimeUnit};

/// An integer count of `unit`.
pub(crate) fn from_count(count: i64, unit: TimeUnit) -> Nanos {
    Nanos(count.saturating_mul(unit.nanos(count as f64)))
}

/// A floating-point count of `unit`; `None` for NaN and infinity. The fraction is split off before
/// scaling, so the error is that of the `f64` itself.
pub(crate) fn from_float(count: f64, unit: TimeUnit) -> Option<Nanos> {
    if !count.is_finite() {
        return None;
    }
    let scale = unit.nanos(count);
    let whole = count.floor();
    let fraction = ((count - whole) * scale as f64).round();
    Some(Nanos(
        (whole as i64)
            .saturating_mul(scale)
            .saturating_add(fraction as i64),
    ))
}

/// Decimal text (`1700000000.123456789`, `-3`, `1.7e9`), exact to the nanosecond and rounded half
/// away from zero below it. `None` when it is not a number.
pub(crate) fn from_decimal(text: &str, unit: TimeUnit) -> Option<Nanos> {
    saturated(scaled(text, |magnitude| unit.nanos(magnitude))?)
}

fn saturated(nanos: i128) -> Option<Nanos> {
    let beyond = if nanos < 0 { -i64::MAX } else { i64::MAX };
    Some(Nanos(i64::try_from(nanos).unwrap_or(beyond)))
}

/// Decimal text times whole nanoseconds: exact, rounded half away from zero. `None` when it is not a number.
pub(crate) fn decimal_in_steps(text: &str, nanos: i64) -> Option<Nanos> {
    saturated(scaled(text, |_| nanos)?)
}

/// Decimal text whose unit nobody says. `None` when it is not a number.
pub(crate) fn bare(text: &str) -> Option<Bare> {
    scaled(text, |_| 1_000_000_000).map(Bare)
}

/// Numbers below this take one digit more in 64 bits.
const MOST_FEW: u64 = 10_u64.pow(18);

/// Decimal text times `scale` of its magnitude, to the nearest whole number; saturating.
fn scaled(text: &str, scale: impl Fn(f64) -> i64) -> Option<i128> {
    let (negative, digits) = match text.as_bytes() {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        rest => (false, rest),
    };
    let mut mantissa: i128 = 0;
    // Digits as long as they are few, which they nearly always are: half the cost of wide ones.
    let mut few: u64 = 0;
    // Decimal exponent of the mantissa's last digit.
    let mut exponent: i64 = 0;
    let mut any = false;
    let mut fraction = false;
    let mut rest = digits.iter();
    while let Some(&byte) = rest.next() {
        match byte {
            b'0'..=b'9' => {
                any = true;
                if mantissa == 0 && few < MOST_FEW {
                    few = few * 10 + u64::from(byte - b'0');
                    exponent -= i64::from(fraction);
                    continue;
                }
                mantissa = mantissa.max(i128::from(few));
                // 28 digits are beyond any stamp, and times a billion still a number; further ones move
                // only the exponent.
                if mantissa < 10_i128.pow(27) {
                    mantissa = mantissa * 10 + i128::from(byte - b'0');
                    exponent -= i64::from(fraction);
                } else {
                    exponent += i64::from(!fraction);
                }
            }
            b'.' if !fraction => fraction = true,
            b'e' | b'E' if any => {
                let power: i64 = std::str::from_utf8(rest.as_slice()).ok()?.parse().ok()?;
                exponent = exponent.saturating_add(power);
                break;
            }
            _ => return None,
        }
    }
    if !any {
        return None;
    }
    mantissa = mantissa.max(i128::from(few));
    let power = |n: i64| 10_f64.powi(i32::try_from(n).unwrap_or(i32::MAX));
    let scale = scale(mantissa as f64 * power(exponent.clamp(-400, 400)));
    let mut nanos = mantissa.saturating_mul(i128::from(scale));
    match exponent {
        0 => {}
        1..=30 => nanos = nanos.saturating_mul(10_i128.pow(exponent as u32)),
        -38..=-1 => {
            let places = exponent.unsigned_abs() as u32;
            nanos = match 10_i64.checked_pow(places) {
                Some(divisor) if scale % divisor == 0 => {
                    mantissa.saturating_mul(i128::from(scale / divisor))
                }
                _ => {
                    let divisor = 10_i128.pow(places);
                    nanos.saturating_add(divisor / 2) / divisor
                }
            };
        }
        n if n < 0 || mantissa == 0 => nanos = 0,
        _ => nanos = i128::MAX,
    }
    Some(if negative { -nanos } else { nanos })
}

/// RFC 3339 (`2023-11-14T22:13:20.5Z`, `2023-11-14 22:13:20+01:00`); a missing offset is read as
/// UTC, as gpsd means it. Leap seconds count as the second after.
pub(crate) fn from_rfc3339(text: &str) -> Option<Nanos> {
    let number = |from: usize, to: usize| -> Option<i64> {
        let digits = text.get(from..to)?;
        digits
            .bytes()
            .all(|b| b.is_ascii_digit())
            .then(|| digits.parse().ok())?
    };
    let is =
        |at: usize, allowed: &[u8]| text.as_bytes().get(at).is_some_and(|b| allowed.contains(b));
    if !(is(4, b"-") && is(7, b"-") && is(10, b"Tt ") && is(13, b":") && is(16, b":")) {
        return None;
    }
    let (year, month, day) = (number(0, 4)?, number(5, 7)?, number(8, 10)?);
    let (hour, minute, second) = (number(11, 13)?, number(14, 16)?, number(17, 19)?);
    let ranges = (1..=12).contains(&month)
        && (1..=31).contains(&day)
        && hour <= 23
        && minute <= 59
        && second <= 60;
    if !ranges {
        return None;
    }
    let mut at = 19;
    let mut nanos = 0_i64;
    if is(at, b".") {
        at += 1;
        let mut scale = 100_000_000;
        while let Some(digit) = text.as_bytes().get(at).filter(|b| b.is_ascii_digit()) {
            nanos += i64::from(digit - b'0') * scale;
            scale /= 10;
            at += 1;
        }
    }
    let offset = match text.get(at..)? {
        "" | "Z" | "z" => 0,
        _ if is(at, b"+-") && is(at + 3, b":") && text.len() == at + 6 => {
            let minutes = number(at + 1, at + 3)? * 60 + number(at + 4, at + 6)?;
            if is(at, b"-") { -minutes } else { minutes }
        }
        _ => return None,
    };
    let secs = days_since_1970(year, month, day) * 86_400 + hour * 3_600 + minute * 60 + second
        - offset * 60;
    Some(Nanos(secs.checked_mul(1_000_000_000)?.checked_add(nanos)?))
}

/// Days since 1970-01-01 in the proleptic Gregorian calendar: years are counted from March, so that
/// the leap day is the last of its year, and 400 of them have 146,097 days.
pub(crate) fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let month_from_march = (month + 9) % 12;
    let day_of_year = (153 * month_from_march + 2) / 5 + day - 1;
    let days = year * 365 + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    days + day_of_year - 719_468
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn decimal_seconds_keep_every_nanosecond_where_an_f64_would_not() {
        let exact = from_decimal("1700000000.123456789", TimeUnit::Second).unwrap();
        assert_eq!(exact, Nanos(1_700_000_000_123_456_789));
        let through_float = from_float(1_700_000_000.123_456_8, TimeUnit::Second).unwrap();
        assert_ne!(through_float, exact, "an f64 has steps of 238 ns here");
        assert!(through_float.since(exact).abs() < 240);
    }

    #[test]
    fn decimals_take_signs_exponents_and_absurd_lengths() {
        let ns = |text: &str| from_decimal(text, TimeUnit::Second).map(|n| n.0);
        assert_eq!(ns("-3.5"), Some(-3_500_000_000));
        assert_eq!(ns("1.7e9"), Some(1_700_000_000_000_000_000));
        assert_eq!(ns("15e-1"), Some(1_500_000_000));
        assert_eq!(ns("0.00000000049"), Some(0));
        assert_eq!(ns("0.0000000005"), Some(1));
        assert_eq!(ns("1e400"), Some(i64::MAX));
        assert_eq!(ns("1e-400"), Some(0));
        assert_eq!(ns("0e400"), Some(0));
        assert_eq!(ns(&format!("1.{}", "3".repeat(1000))), Some(1_333_333_333));
        assert_eq!(ns(&format!("9.{}", "3".repeat(1000))), Some(9_333_333_333));
        assert_eq!(ns(&"9".repeat(1000)), Some(i64::MAX));
        for bad in [
            "",
            "-",
            ".",
            "e5",
            "1e",
            "1x",
            "1.2.3",
            "1e99999999999999999999",
        ] {
            assert_eq!(ns(bad), None, "{bad}");
        }
    }

    #[test]
    fn an_unlabelled_instant_is_read_by_its_magnitude_and_by_the_recorders_clock() {
        for text in [
            "1700000000",
            "1700000000000",
            "1700000000000000",
            "1700000000000000000",
        ] {
            let read = from_decimal(text, TimeUnit::ByMagnitude).unwrap();
            assert_eq!(read, Nanos(1_700_000_000_000_000_000), "{text}");
            assert_eq!(
                from_count(text.parse().unwrap(), TimeUnit::ByMagnitude),
                read
            );
        }
        // A boot clock in microseconds: magnitude alone would say seconds.
        let log = Nanos(27_329_869_000);
        assert_eq!(TimeUnit::nearest(27_329_869.0, log), Some(TimeUnit::Micro));
        assert_eq!(
            TimeUnit::nearest(27_329_869.0, Nanos(1_700_000_000_000_000_000)),
            None
        );
        assert_eq!(
            TimeUnit::nearest(1.7e18, log),
            None,
            "an epoch beside a boot clock"
        );
        assert_eq!(TimeUnit::nearest(0.0, Nanos(0)), None);
    }

    #[test]
    fn rfc3339_agrees_with_known_instants() {
        // Instants by `date -u -d ... +%s`.
        for (text, secs) in [
            ("1970-01-01T00:00:00Z", 0),
            ("2000-02-29T12:00:00Z", 951_825_600),
            ("2023-11-14T22:13:20Z", 1_700_000_000),
            ("1969-12-31T23:59:59Z", -1),
            ("2100-03-01T00:00:00Z", 4_107_542_400),
            ("2023-11-14T23:13:20+01:00", 1_700_000_000),
            ("2023-11-14 16:43:20-05:30", 1_700_000_000),
        ] {
            assert_eq!(
                from_rfc3339(text),
                Some(Nanos(secs * 1_000_000_000)),
                "{text}"
            );
        }
        let fine = from_rfc3339("2023-11-14T22:13:20.000000005999Z");
        assert_eq!(fine, Some(Nanos(1_700_000_000_000_000_005)));
        for bad in [
            "",
            "2023-11-14",
            "2023-13-14T00:00:00Z",
            "2023-11-14T22:13:20?",
            "2023-11-14T22:1é:20Z",
        ] {
            assert_eq!(from_rfc3339(bad), None, "{bad}");
        }
    }
}
