//! Numbers -> text with so many significant digits. Pure.

/// `value` with about `digits` significant digits, without an exponent where that is short.
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() || value == 0.0 {
        return format!("{value}");
    }
    let exponent = value.abs().log10().floor() as i64;
    if !(-4..7).contains(&exponent) {
        return format!("{value:.*e}", digits.saturating_sub(1));
    }
    let decimals = usize::try_from(digits as i64 - 1 - exponent).unwrap_or(0);
    format!("{value:.decimals$}")
}
