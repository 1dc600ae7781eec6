//! Covariance of the error states: a step on, a scalar measurement, a restart. Pure.

use crate::plausible::LARGEST;
use nalgebra::{Matrix3, Vector3};

/// Error states: tilt x, y and heading (rad, earth axes), velocity x, y, position x, y, gyro bias, scale, cross,
/// accelerometer bias, its lead, disturbance of the field's heading (nothing without a magnetometer).
pub(super) const STATES: usize = 21;
/// Width of a row with hard iron, if it is asked for. Rows are as long in any case: a multiple of what a vector
/// register holds.
pub(super) const WIDTH: usize = 24;
/// Number of states, the first ones, that change by themselves.
const MOVING: usize = 7;

pub(super) const TILT: usize = 0;
pub(super) const HEADING: usize = 2;
pub(super) const VELOCITY: usize = 3;
pub(super) const POSITION: usize = 5;
pub(super) const BIAS: usize = 7;
pub(super) const SCALE: usize = 10;
pub(super) const CROSS: usize = 13;
pub(super) const FORCE_BIAS: usize = 16;
pub(super) const LEAD: usize = 19;
pub(super) const FIELD: usize = 20;
pub(super) const IRON: usize = 21;

/// A correction of the error states, and of nothing beyond them.
pub(super) type Correction = [f64; WIDTH];

/// Columns of the rows of a [`Transition`] that are not zero, in order: what tilt and heading, velocity and position
/// hang on.
const COLUMNS: [&[usize]; MOVING] = [
    &BY_GYRO,
    &BY_GYRO,
    &BY_GYRO,
    &[TILT + 1, 16, 17, 18, LEAD],
    &[TILT, 16, 17, 18, LEAD],
    &[TILT + 1, VELOCITY, 16, 17, 18, LEAD],
    &[TILT, VELOCITY + 1, 16, 17, 18, LEAD],
];
const BY_GYRO: [usize; 9] = [7, 8, 9, 10, 11, 12, 13, 14, 15];
/// States that a measurement may be kept from.
const WITHHELD: [usize; 4] = [HEADING, BIAS, BIAS + 1, BIAS + 2];
/// Number of elements of a row that are summed up at once.
const LANES: usize = 8;

/// Rows of the transition from one update to the next that are not those of the identity, less those of it. Only the
/// [`COLUMNS`] count.
#[derive(Clone, Debug)]
pub(super) struct Transition(pub(super) [[f64; STATES]; MOVING]);

impl Transition {
    pub(super) fn none() -> Transition {
        Transition([[0.0; STATES]; MOVING])
    }
}

/// Symmetric to the bit, positive definite where a state is not known exactly.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(into = "Vec<f64>", try_from = "Vec<f64>")
)]
pub(super) struct Covariance {
    rows: [[f64; WIDTH]; WIDTH],
    /// Number of states: [`STATES`], or all.
    states: usize,
}

impl Default for Covariance {
    /// Every state known.
    fn default() -> Covariance {
        Covariance::zero(false)
    }
}

/// The rows of its lower half, one after the other.
impl From<Covariance> for Vec<f64> {
    fn from(covariance: Covariance) -> Vec<f64> {
        let rows = covariance.rows.iter().take(covariance.states).enumerate();
        rows.flat_map(|(i, row)| row[..=i].to_vec()).collect()
    }
}

impl TryFrom<Vec<f64>> for Covariance {
    type Error = String;

    fn try_from(half: Vec<f64>) -> Result<Covariance, String> {
        let has_iron = match [STATES, WIDTH].map(|n| half.len() == n * (n + 1) / 2) {
            [true, _] => false,
            [_, true] => true,
            _ => return Err(format!("a covariance of {} numbers", half.len())),
        };
        let mut covariance = Covariance::zero(has_iron);
        let mut numbers = half.into_iter();
        for i in 0..covariance.states {
            for j in 0..=i {
                let number = numbers.next().unwrap_or(f64::NAN);
                covariance.rows[i][j] = number;
                covariance.rows[j][i] = number;
            }
        }
        Ok(covariance)
    }
}

impl Covariance {
    /// Every state known, with or without those of hard iron.
    pub(super) fn zero(has_iron: bool) -> Covariance {
        Covariance {
            rows: [[0.0; WIDTH]; WIDTH],
            states: if has_iron { WIDTH } else { STATES },
        }
    }

    /// Whether it has states of hard iron.
    pub(super) fn has_iron(&self) -> bool {
        self.states > STATES
    }

    #[inline]
    pub(super) fn variance(&self, state: usize) -> f64 {
        self.rows[state][state]
    }

    #[inline]
    pub(super) fn between(&self, a: usize, b: usize) -> f64 {
        self.rows[a][b]
    }

    /// Variance of a sum of states, each times its factor.
    pub(super) fn variance_of_sum(&self, h: &[(usize, f64)]) -> f64 {
        let with = |a: usize| -> f64 { h.iter().map(|(b, by)| by * self.rows[a][*b]).sum() };
        h.iter().map(|(a, by)| by * with(*a)).sum()
    }

    /// Sets the covariance of two states, at the start.
    pub(super) fn set(&mut self, a: usize, b: usize, covariance: f64) {
        self.rows[a][b] = covariance;
        self.rows[b][a] = covariance;
    }

    /// More is unknown of a state.
    #[inline]
    pub(super) fn add(&mut self, state: usize, variance: f64) {
        self.rows[state][state] += variance;
    }

    /// More is unknown of tilt and heading.
    #[inline]
    pub(super) fn add_to_attitude(&mut self, variance: f64) {
        for axis in 0..3 {
            self.rows[axis][axis] += variance;
        }
    }

    /// More is unknown of the rotation about this axis of the world, unit or longer.
    pub(super) fn add_about(&mut self, axis: &Vector3<f64>, variance: f64) {
        let about = variance * axis * axis.transpose();
        for i in 0..3 {
            for j in 0..3 {
                self.rows[i][j] += about[(i, j)];
            }
        }
    }

    /// A state known to `variance`, and with no other in common.
    pub(super) fn restart(&mut self, state: usize, variance: f64) {
        for other in 0..self.states {
            self.rows[state][other] = 0.0;
            self.rows[other][state] = 0.0;
        }
        self.rows[state][state] = variance;
    }

    /// Every row and column of a state, times `factor`.
    pub(super) fn fade(&mut self, state: usize, factor: f64) {
        for other in 0..self.states {
            self.rows[state][other] *= factor;
            self.rows[other][state] *= factor;
        }
    }

    /// `F P F^T`.
    pub(super) fn step(&mut self, by: &Transition) {
        let mut moved = [[0.0; WIDTH]; MOVING];
        for (a, row) in moved.iter_mut().enumerate() {
            for first in (0..WIDTH).step_by(LANES) {
                let mut sum: [f64; LANES] = std::array::from_fn(|i| self.rows[a][first + i]);
                for &k in COLUMNS[a] {
                    let (f, from) = (by.0[a][k], &self.rows[k]);
                    for (i, sum) in sum.iter_mut().enumerate() {
                        *sum += f * from[first + i];
                    }
                }
                row[first..first + LANES].copy_from_slice(&sum);
            }
        }
        let mut square = [[0.0; MOVING]; MOVING];
        for (out, row) in square.iter_mut().zip(&moved) {
            for (b, sum) in out.iter_mut().enumerate() {
                *sum = row[b];
                for &k in COLUMNS[b] {
                    *sum += by.0[b][k] * row[k];
                }
            }
        }
        for a in 0..MOVING {
            for k in MOVING..self.states {
                self.rows[a][k] = moved[a][k];
                self.rows[k][a] = moved[a][k];
            }
            for b in 0..MOVING {
                self.rows[a][b] = 0.5 * (square[a][b] + square[b][a]);
            }
        }
    }

    /// One scalar measurement `h . error = innovation` of a variance; what has been corrected so far is in
    /// `correction`, and what it adds, too. What was left to explain comes back, with one sigma of what was expected.
    pub(super) fn measure(
        &mut self,
        h: &[(usize, f64)],
        innovation: f64,
        variance: f64,
        correction: &mut Correction,
    ) -> (f64, f64) {
        let nothing = (&Vector3::zeros(), 0.0);
        self.measure_withholding(h, innovation, variance, nothing, correction)
    }

    /// The same, but that of what it says of heading and of the bias along a unit vector (body axes) a share is taken
    /// back, 0 none and 1 all: the partial update of Schmidt's filter. The covariance is at least that of the gain
    /// used.
    pub(super) fn measure_withholding(
        &mut self,
        h: &[(usize, f64)],
        innovation: f64,
        variance: f64,
        (along, share): (&Vector3<f64>, f64),
        correction: &mut Correction,
    ) -> (f64, f64) {
        let mut ph = [0.0; WIDTH];
        for (state, factor) in h {
            for (out, p) in ph.iter_mut().zip(&self.rows[*state]) {
                *out += factor * p;
            }
        }
        let (mut spread, mut left) = (variance, innovation);
        for (state, factor) in h {
            spread += factor * ph[*state];
            left -= factor * correction[*state];
        }
        let inverse = 1.0 / spread;
        // A product of two equals that of the two in another order: the matrix stays symmetric to the bit.
        let root = inverse.sqrt();
        let scaled = ph.map(|p| p * root);
        for state in 0..self.states {
            correction[state] += ph[state] * inverse * left;
            for (p, other) in self.rows[state].iter_mut().zip(&scaled) {
                *p -= scaled[state] * other;
            }
        }
        if share > 0.0 {
            let bias = Vector3::new(scaled[BIAS], scaled[BIAS + 1], scaled[BIAS + 2]);
            let back = along * along.dot(&bias);
            let back = [scaled[HEADING], back.x, back.y, back.z];
            for (a, one) in WITHHELD.into_iter().zip(back) {
                correction[a] -= share * one * root * left;
                for (b, other) in WITHHELD.into_iter().zip(back) {
                    self.rows[a][b] += share * (one * other);
                }
            }
        }
        (left, spread.sqrt())
    }

    /// The earth axes of the estimate have turned about the vertical: the states in them turn back.
    pub(super) fn turn(&mut self, cos: f64, sin: f64) {
        for first in [TILT, VELOCITY, POSITION] {
            for k in 0..WIDTH {
                let (u, v) = (self.rows[first][k], self.rows[first + 1][k]);
                self.rows[first][k] = cos * u - sin * v;
                self.rows[first + 1][k] = sin * u + cos * v;
            }
            for k in 0..self.states {
                let (u, v) = (self.rows[k][first], self.rows[k][first + 1]);
                self.rows[k][first] = cos * u - sin * v;
                self.rows[k][first + 1] = sin * u + cos * v;
            }
            let mean = 0.5 * (self.rows[first][first + 1] + self.rows[first + 1][first]);
            self.rows[first][first + 1] = mean;
            self.rows[first + 1][first] = mean;
        }
    }

    /// Covariance of tilt and heading, rad^2, earth axes.
    pub(super) fn attitude(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.rows[i][j])
    }

    /// Whether it can be one: every variance a number above zero, or zero where a state is known.
    pub(super) fn is_sound(&self) -> bool {
        (0..self.states).all(|i| self.rows[i][i].is_finite() && self.rows[i][i] >= 0.0)
    }

    /// Whether no correlation is more than one, beside what makes it [sound](Covariance::is_sound): what a file
    /// says may be anything.
    pub(super) fn is_plausible(&self) -> bool {
        let within = |i: usize, j: usize| {
            self.rows[i][j].powi(2) <= self.rows[i][i] * self.rows[j][j] * (1.0 + 1e-9)
        };
        let is_small = |i: usize| self.rows[i][i] <= LARGEST;
        self.is_sound()
            && (0..self.states).all(is_small)
            && (0..self.states).all(|i| (0..i).all(|j| within(i, j)))
    }

    /// Smallest pivot of the factor of the matrix scaled to ones on its diagonal, over the states that are not
    /// known exactly; not above 0 where it is not positive definite.
    #[cfg(test)]
    pub(super) fn smallest_pivot(&self) -> f64 {
        let open: Vec<usize> = (0..self.states)
            .filter(|i| self.rows[*i][*i] != 0.0)
            .collect();
        let scale = |i: usize| self.rows[i][i].sqrt();
        let mut a: Vec<Vec<f64>> = open
            .iter()
            .map(|i| {
                open.iter()
                    .map(|j| self.rows[*i][*j] / (scale(*i) * scale(*j)))
                    .collect()
            })
            .collect();
        let mut smallest = f64::INFINITY;
        for k in 0..open.len() {
            smallest = smallest.min(a[k][k]);
            for i in k + 1..open.len() {
                let f = a[i][k] / a[k][k];
                for j in k..open.len() {
                    a[i][j] -= f * a[k][j];
                }
            }
        }
        smallest
    }

    /// Largest difference between a pair of entries that should be equal, as a share of their sigmas.
    #[cfg(test)]
    pub(super) fn asymmetry(&self) -> f64 {
        let mut largest = 0.0_f64;
        for i in 0..self.states {
            for j in 0..self.states {
                let scale = (self.rows[i][i] * self.rows[j][j]).sqrt();
                if scale > 0.0 {
                    largest = largest.max((self.rows[i][j] - self.rows[j][i]).abs() / scale);
                }
            }
        }
        largest
    }
}
