//! Points -> their spread, the line through most of them. Pure.
//!
//! Apart from the stages that use it because each of them has outliers on one side: messages come late, never early.

use crate::median::median;

/// Points to which a line is fitted at most; of more, evenly chosen ones.
const MOST: usize = 200;
/// Standard deviations of a normal distribution in its median absolute deviation.
const SIGMAS: f64 = 1.4826;

/// Median of whole numbers, the mean of the middle two rounded down; 0 of none. Sorted here.
pub(crate) fn median_of(values: &mut [i64]) -> i64 {
    values.sort_unstable();
    let middle = values.len() / 2;
    match (values.len() % 2, values.get(middle), middle.checked_sub(1)) {
        (1, Some(value), _) => *value,
        (_, Some(high), Some(low)) => {
            let low = values.get(low).copied().unwrap_or(*high);
            // In two halves, so that nothing overflows.
            low / 2 + high / 2 + (low % 2 + high % 2) / 2
        }
        _ => 0,
    }
}

/// Spread as a standard deviation, by the median absolute deviation; 0 of none.
pub(crate) fn spread(values: &[f64]) -> f64 {
    let centre = median(&mut values.to_vec());
    let mut off: Vec<f64> = values.iter().map(|v| (v - centre).abs()).collect();
    SIGMAS * median(&mut off)
}

/// Slope and offset of the line through most points `(x, y)`: the median slope of pairs a third of their number and more
/// apart (Theil 1950, Sen 1968), and the median offset. Slope 0 of fewer than two.
pub(crate) fn robust_line(points: &[(f64, f64)]) -> (f64, f64) {
    let thinned: Vec<(f64, f64)> = if points.len() > MOST {
        let share = (points.len() - 1) as f64 / (MOST - 1) as f64;
        (0..MOST)
            .filter_map(|i| points.get((i as f64 * share).round_ties_even() as usize))
            .copied()
            .collect()
    } else {
        points.to_vec()
    };
    let apart = (thinned.len() / 3).max(1);
    let mut slopes: Vec<f64> = thinned
        .iter()
        .enumerate()
        .flat_map(|(i, a)| {
            let others = thinned.get(i + apart..).unwrap_or_default();
            others.iter().filter_map(move |b| {
                let run = b.0 - a.0;
                (run > 0.0).then(|| (b.1 - a.1) / run)
            })
        })
        .collect();
    let slope = median(&mut slopes);
    let mut offsets: Vec<f64> = thinned.iter().map(|(x, y)| y - slope * x).collect();
    (slope, median(&mut offsets))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_does_not_follow_a_quarter_of_late_points() {
        let points: Vec<(f64, f64)> = (0..1000)
            .map(|i| {
                let late = if i % 4 == 1 {
                    500.0 + f64::from(i)
                } else {
                    0.0
                };
                (f64::from(i), 7.0 + 0.25 * f64::from(i) + late)
            })
            .collect();
        let (slope, offset) = robust_line(&points);
        assert!((slope - 0.25).abs() < 1e-3, "{slope}");
        assert!((offset - 7.0).abs() < 1.0, "{offset}");
    }

    #[test]
    fn medians_of_even_and_odd_numbers_and_of_none() {
        assert_eq!(median_of(&mut [3, 1, 2]), 2);
        assert_eq!(median_of(&mut [4, 1, 2, 3]), 2);
        assert_eq!(median_of(&mut [i64::MAX, i64::MAX]), i64::MAX);
        assert_eq!(median_of(&mut []), 0);
        assert!((spread(&[1.0, 2.0, 3.0]) - SIGMAS).abs() < 1e-12);
    }
}
