//! Numbers -> the middle one. Pure.
//!
//! A file of its own because clocks, rests and evidence all ask for it, and none of them for the others.

/// Median, of an even number the mean of the middle two; 0 of none. Sorted here.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    match (values.get(n.saturating_sub(1) / 2), values.get(n / 2)) {
        (Some(a), Some(b)) => 0.5 * (a + b),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_numbers_in_any_order() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]).to_bits(), 2_f64.to_bits());
        assert_eq!(
            median(&mut [4.0, 1.0, 3.0, 2.0]).to_bits(),
            2.5_f64.to_bits()
        );
        assert_eq!(median(&mut []).to_bits(), 0);
        // NaN stands behind all numbers.
        assert_eq!(median(&mut [f64::NAN, 1.0, 2.0]).to_bits(), 2_f64.to_bits());
    }
}
