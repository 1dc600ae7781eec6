//! Rates that are exactly zero about all axes amid a rotation: what a driver without data says. Pure.
//!
//! Apart from the statistics because a check counts them, and a run.

/// Rate, rad/s, of a body that a single sample does not bring to rest: beyond what noise, vibration or a coarse gyro read
/// beside an exact zero at rest.
const MOVES: f64 = 0.05;
/// Rate of one that several do not.
const TURNS: f64 = 0.3;

/// Count of samples that are zero about all axes, alone or several in a row, while the body turns before them and behind.
#[derive(Clone, Copy, Debug, Default)]
pub struct LoneZeros {
    count: u64,
    /// Zeros in a row by now, and the largest rate of the sample before them or of the last, rad/s.
    run: u64,
    before: Option<f64>,
}

impl LoneZeros {
    /// Takes rates, rad/s. Behind what is no number a count begins anew.
    pub fn push(&mut self, rates: &[f64; 3]) {
        if !rates.iter().all(|rate| rate.is_finite()) {
            (self.run, self.before) = (0, None);
            return;
        }
        let largest = rates
            .iter()
            .fold(0.0, |most: f64, rate| most.max(rate.abs()));
        if largest == 0.0 {
            self.run += 1;
            return;
        }
        let run = std::mem::take(&mut self.run);
        let least = if run == 1 { MOVES } else { TURNS };
        if let Some(before) = self.before.replace(largest)
            && before.min(largest) > least
        {
            self.count += run;
        }
    }

    /// Number by now.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_amid_a_rotation_are_counted_and_those_of_a_rest_are_not() {
        let count = |rates: &[f64]| {
            let mut zeros = LoneZeros::default();
            rates.iter().for_each(|rate| zeros.push(&[*rate, 0.0, 0.0]));
            zeros.count()
        };
        assert_eq!(count(&[1.0, 0.0, 0.0, 0.0, 1.2, 0.0, 1.1]), 4);
        // One that slows down, one that begins, one that ends.
        assert_eq!(count(&[0.4, 0.1, 0.0, 0.0, 0.0, 0.6]), 0);
        assert_eq!(count(&[0.0, 0.0, 1.0, 1.0, 0.0, 0.0]), 0);
        // A gyro in steps of 1 deg/s at rest, and a motion so slow that the noise goes through zero.
        assert_eq!(count(&[0.01745, 0.0, 0.01745, 0.0, -0.01745]), 0);
        assert_eq!(count(&[0.1, 0.0, 0.1]), 1);
        // What is no number is no zero, and nothing is known of its neighbours.
        assert_eq!(count(&[1.0, f64::NAN, 1.0, f64::NAN, 0.0, 1.0]), 0);
    }
}
