//! Recorded rates -> whether their driver cut them towards zero, and the cure. Pure.
//!
//! A stage of its own because it needs no truth: a cast to an integer cuts towards zero, so the bin about zero is
//! twice as wide as the others. At rest the mean is then off by up to half a step, in motion it is not, and a bias
//! found at rest is wrong for the motion (0.03 deg/s at 2000 deg/s in 16 bits: 4 degrees in two minutes).
//! Values that were rounded have bins of one width; values that were averaged or filtered after that have none:
//! both are left as they are.

/// Steps looked for are smaller, rad/s (2 deg/s).
const LARGEST_STEP: f64 = 0.034_906_585;
/// And larger, rad/s.
const SMALLEST_STEP: f64 = 5e-6;
/// Values are told apart to this, rad/s.
const RESOLUTION: f64 = 1e-6;
/// Fewest differences that say something.
const FEWEST: usize = 1000;
/// Number of samples before and after one that tell whether it only passes through zero.
const AROUND: usize = 8;
/// A zero bin so many times as wide as the others is that of truncation: 2 is exact, 1 is rounding.
const WIDE: f64 = 1.5;

/// Grid on which recorded rates lie.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Grid {
    /// The step they count in, rad/s.
    pub step: f64,
    /// Width of the bin about zero by the width of the others; `None` where too few rates pass through zero.
    pub zero_bin: Option<f64>,
}

impl Grid {
    /// The grid of consecutive rates (rad/s, sensor axes); `None` where there is none.
    ///
    /// Work grows with the samples; steps are looked for between 3e-4 and 2 deg/s.
    #[must_use]
    pub fn of(rates: &[[f64; 3]]) -> Option<Grid> {
        let step = step(rates)?;
        Some(Grid {
            step,
            zero_bin: zero_bin(rates, step),
        })
    }

    /// Whether the rates were cut towards zero.
    #[must_use]
    pub(crate) fn is_truncated(&self) -> bool {
        self.zero_bin.is_some_and(|ratio| ratio > WIDE)
    }
}

/// A rate in the middle of what its driver cut to it; the step in the rate's own unit.
#[must_use]
#[inline]
pub fn undone(rate: f64, step: f64) -> f64 {
    if rate.abs() >= 0.5 * step {
        rate + 0.5 * step.copysign(rate)
    } else {
        rate
    }
}

fn step(rates: &[[f64; 3]]) -> Option<f64> {
    let differences: Vec<f64> = rates
        .windows(2)
        .filter_map(|pair| match pair {
            [a, b] => Some([0, 1, 2].map(|axis| (b[axis] - a[axis]).abs())),
            _ => None,
        })
        .flatten()
        .filter(|d| *d > 0.0 && *d < LARGEST_STEP)
        .collect();
    if differences.len() < FEWEST {
        return None;
    }
    let mut counts = vec![0_usize; (LARGEST_STEP / RESOLUTION) as usize + 2];
    for difference in &differences {
        if let Some(count) = counts.get_mut((difference / RESOLUTION).round() as usize) {
            *count += 1;
        }
    }
    let often = 20.max(differences.len() / 500);
    let smallest = (SMALLEST_STEP / RESOLUTION).round() as usize;
    let first = (smallest..counts.len()).find(|at| counts.get(*at) >= Some(&often))?;
    let mut step = first as f64 * RESOLUTION;
    for _ in 0..2 {
        let (mut near, mut on, mut product, mut square) = (0, 0, 0.0, 0.0);
        for x in differences.iter().filter(|d| **d < 8.5 * step) {
            near += 1;
            let z = (x / step).round();
            if z > 0.0 && (x / step - z).abs() < 0.1 {
                on += 1;
                product += x * z;
                square += z * z;
            }
        }
        if near < 500 || on * 10 < near * 7 {
            return None;
        }
        step = product / square;
    }
    Some(step)
}

fn zero_bin(rates: &[[f64; 3]], step: f64) -> Option<f64> {
    let last = rates.len().checked_sub(1)?;
    let (mut zero, mut others) = (0_u32, 0_u32);
    for (i, rate) in rates.iter().enumerate() {
        let before = rates.get(i.saturating_sub(AROUND))?;
        let after = rates.get((i + AROUND).min(last))?;
        for axis in 0..3 {
            let r = rate[axis] / step;
            let passes = (after[axis] - before[axis]).abs() > 8.0 * step;
            if !passes || r.abs() >= 4.5 || (r - r.round()).abs() >= 0.05 {
                continue;
            }
            match r.round().abs() as u32 {
                0 => zero += 1,
                1 => (),
                _ => others += 1,
            }
        }
    }
    // Six bins of the others: 2 to 4 on both sides.
    (zero + others > 100 && others > 0).then(|| 6.0 * f64::from(zero) / f64::from(others))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const STEP: f64 = 0.001_065;

    /// Nine minutes of a hand's motion about three axes at 286 Hz, brought to a grid.
    fn rates(on_grid: impl Fn(f64) -> f64) -> Vec<[f64; 3]> {
        (0..150_000)
            .map(|k| {
                let t = f64::from(k) * 0.0035;
                [
                    (1.3 * t).sin() + 0.4 * (7.1 * t).sin(),
                    0.8 * (1.9 * t).cos(),
                    0.5 * (3.3 * t).sin() - 0.3 * (0.7 * t).cos(),
                ]
                .map(|w| on_grid(w / STEP) * STEP)
            })
            .collect()
    }

    #[test]
    fn what_was_cut_towards_zero_is_known_by_its_zero_bin() {
        let grid = Grid::of(&rates(f64::trunc)).unwrap();
        assert!((grid.step / STEP - 1.0).abs() < 1e-6, "{grid:?}");
        let ratio = grid.zero_bin.unwrap();
        assert!((ratio - 2.0).abs() < 0.2, "{ratio}");
        assert!(grid.is_truncated());
    }

    #[test]
    fn rounded_and_floored_and_smooth_rates_are_left_alone() {
        for (name, on_grid) in [
            ("round", f64::round as fn(f64) -> f64),
            ("floor", f64::floor),
        ] {
            let grid = Grid::of(&rates(on_grid)).unwrap();
            let ratio = grid.zero_bin.unwrap();
            assert!((ratio - 1.0).abs() < 0.2, "{name} {ratio}");
            assert!(!grid.is_truncated(), "{name}");
        }
        assert_eq!(Grid::of(&rates(|w| w)), None);
        // Means of two have half the step, and no wide bin.
        let means: Vec<[f64; 3]> = rates(f64::trunc)
            .chunks(2)
            .map(|pair| [0, 1, 2].map(|axis| 0.5 * (pair[0][axis] + pair[1][axis])))
            .collect();
        assert!(Grid::of(&means).is_none_or(|grid| !grid.is_truncated()));
    }

    #[test]
    fn too_little_says_nothing() {
        assert_eq!(Grid::of(&[]), None);
        assert_eq!(Grid::of(&[[0.0; 3]]), None);
        assert_eq!(Grid::of(&[[f64::NAN; 3]; 5000]), None);
        assert_eq!(Grid::of(&[[0.01; 3]; 5000]), None);
        assert_eq!(Grid::of(&rates(f64::trunc)[..300]), None);
    }

    #[test]
    fn undoing_takes_half_a_step_out_of_the_mean() {
        for step in [STEP, 0.061] {
            assert_eq!(undone(0.0, step), 0.0);
            assert_eq!(undone(step, step), 1.5 * step);
            assert_eq!(undone(-3.0 * step, step), -3.5 * step);
        }
        let mut worst = 0.0_f64;
        for (cut, exact) in rates(f64::trunc).iter().zip(rates(|w| w)) {
            for axis in 0..3 {
                worst = worst.max((undone(cut[axis], STEP) - exact[axis]).abs());
            }
        }
        // About zero a whole step, elsewhere half of one.
        assert!(worst < STEP);
        let offset = |f: &dyn Fn(f64) -> f64| {
            let above: Vec<f64> = rates(f64::trunc)
                .iter()
                .zip(rates(|w| w))
                .filter(|(cut, _)| cut[0] > 0.0)
                .map(|(cut, exact)| f(cut[0]) - exact[0])
                .collect();
            above.iter().sum::<f64>() / above.len() as f64 / STEP
        };
        assert!((offset(&|w| w) + 0.5).abs() < 0.02);
        assert!(offset(&|w| undone(w, STEP)).abs() < 0.02);
    }
}
