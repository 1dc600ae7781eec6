//! The gyro's bias against its temperature -> a line fitted to it, words, JSON. Pure.
//!
//! Apart from the filter's account because the filter knows no temperature: it learns the bias as it is, and here one is
//! held against the other.

use super::significant;
use nalgebra::Vector3;
use serde_json::{Value, json};

/// Pairs that are kept; beyond, every second one goes, again and again.
const MOST: usize = 400;
/// Wander of a bias beside its temperature, rad/s (0.02 deg/s): no pair weighs more.
const WANDER: f64 = 3.5e-4;
/// Sigma of a bias from which it is learned, rad/s (0.2 deg/s).
const LEARNED: f64 = 3.5e-3;
/// Least difference of temperatures, K, and least number of pairs by which a line is told.
const LEAST_SPAN: f64 = 2.0;
const LEAST_PAIRS: usize = 20;
/// Share of how the bias moved that its temperature explains from which that is said.
const EXPLAINS: f64 = 0.5;

/// A bias at a temperature.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BiasPair {
    /// Temperature, degrees Celsius.
    pub temperature: f64,
    /// Bias about the body's axes, rad/s.
    pub bias: Vector3<f64>,
    weight: f64,
}

/// The bias of a run against the temperature of its samples.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Warming {
    pairs: Vec<BiasPair>,
    stride: u64,
    seen: u64,
    range: Option<(f64, f64)>,
}

/// Line through a bias over its temperature.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct WarmingLine {
    /// Change of the bias per kelvin, rad/s/K, about the body's axes.
    pub slope: Vector3<f64>,
    /// Bias in the middle, rad/s.
    pub middle: Vector3<f64>,
    /// Temperature there, degrees Celsius.
    pub at: f64,
    /// Lowest and highest temperature of a bias that was learned, degrees Celsius.
    pub ends: [f64; 2],
    /// Share of how the bias moved that the line explains, 0 to 1.
    pub explained: f64,
}

impl Warming {
    /// Takes the temperature (degrees Celsius), the bias by then (rad/s, body axes) and one sigma of it.
    pub fn push(&mut self, temperature: f64, bias: Vector3<f64>, sigma: Vector3<f64>) {
        let (coldest, warmest) = self.range.unwrap_or((temperature, temperature));
        self.range = Some((coldest.min(temperature), warmest.max(temperature)));
        let sigma = sigma.amax();
        if sigma.is_nan() || sigma >= LEARNED {
            return;
        }
        let stride = self.stride.max(1);
        if self.seen.is_multiple_of(stride) {
            if self.pairs.len() >= MOST {
                let mut is_kept = false;
                self.pairs.retain(|_| {
                    is_kept = !is_kept;
                    is_kept
                });
                self.stride = stride * 2;
            }
            self.pairs.push(BiasPair {
                temperature,
                bias,
                weight: 1.0 / (sigma * sigma + WANDER * WANDER),
            });
        }
        self.seen += 1;
    }

    /// Lowest and highest temperature, degrees Celsius; `None` where there was none.
    #[must_use]
    pub fn range(&self) -> Option<(f64, f64)> {
        self.range
    }

    /// Pairs, in order of time.
    #[must_use]
    pub fn pairs(&self) -> &[BiasPair] {
        &self.pairs
    }

    /// The line of least squares, where temperatures differ enough.
    #[must_use]
    pub fn line(&self) -> Option<WarmingLine> {
        let temperatures = self.pairs.iter().map(|pair| pair.temperature);
        let ends = [
            temperatures.clone().fold(f64::MAX, f64::min),
            temperatures.fold(f64::MIN, f64::max),
        ];
        if self.pairs.len() < LEAST_PAIRS || ends[1] - ends[0] < LEAST_SPAN {
            return None;
        }
        let weights: f64 = self.pairs.iter().map(|pair| pair.weight).sum();
        let mean = |of: &dyn Fn(&BiasPair) -> f64| {
            self.pairs
                .iter()
                .map(|pair| pair.weight * of(pair))
                .sum::<f64>()
                / weights
        };
        let at = mean(&|pair| pair.temperature);
        let axis = |n: usize| mean(&|pair| pair.bias[n]);
        let middle = Vector3::new(axis(0), axis(1), axis(2));
        let spread = mean(&|pair| (pair.temperature - at).powi(2));
        let of = |n: usize| mean(&|pair| (pair.temperature - at) * (pair.bias[n] - middle[n]));
        let slope = Vector3::new(of(0), of(1), of(2)) / spread;
        let moved = mean(&|pair| (pair.bias - middle).norm_squared());
        let left =
            mean(&|pair| (pair.bias - middle - slope * (pair.temperature - at)).norm_squared());
        Some(WarmingLine {
            slope,
            middle,
            at,
            ends,
            explained: if moved > 0.0 { 1.0 - left / moved } else { 0.0 },
        })
    }

    /// Text for people; `None` where there was no temperature.
    #[must_use]
    pub fn text(&self) -> Option<String> {
        let (coldest, warmest) = self.range?;
        let range = format!(
            "{} to {} degC",
            significant(coldest, 4),
            significant(warmest, 4)
        );
        let Some(line) = self.line().filter(|line| line.explained > EXPLAINS) else {
            return Some(format!("{range}; the bias does not go with it"))
                .filter(|_| self.line().is_some())
                .or(Some(range));
        };
        let [x, y, z] = [line.slope.x, line.slope.y, line.slope.z]
            .map(|slope| significant(slope.to_degrees(), 2));
        Some(format!(
            "{range}; the bias goes with it by ({x}, {y}, {z}) deg/s per K, which explains {:.0} % of how it moved",
            line.explained * 100.0
        ))
    }

    /// JSON for machines; `null` where there was no temperature.
    #[must_use]
    pub fn json(&self) -> Value {
        let Some((coldest, warmest)) = self.range else {
            return Value::Null;
        };
        json!({
            "range_degc": [coldest, warmest],
            "bias": self.line().map(|line| json!({
                "slope_rad_s_k": [line.slope.x, line.slope.y, line.slope.z],
                "explained": line.explained,
            })),
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const SURE: Vector3<f64> = Vector3::new(1e-4, 1e-4, 1e-4);

    #[test]
    fn a_bias_that_goes_with_its_temperature_has_its_slope_and_others_have_none() {
        let mut all = Warming::default();
        let slope = Vector3::new(1e-4, -2e-4, 5e-5);
        // Before it is learned it tells nothing.
        all.push(5.0, Vector3::repeat(1.0), Vector3::repeat(0.02));
        for n in 0..10_000 {
            let temperature = 20.0 + f64::from(n) * 2e-3;
            all.push(temperature, slope * (temperature - 25.0), SURE);
        }
        assert!(all.pairs().len() <= MOST && all.pairs().len() > MOST / 4);
        let line = all.line().unwrap();
        assert!((line.slope - slope).norm() < 1e-12 && line.explained > 0.999_999);
        assert_eq!(all.range(), Some((5.0, 20.0 + 9999.0 * 2e-3)));
        let text = all.text().unwrap();
        assert!(
            text.contains("(0.0057, -0.011, 0.0029) deg/s per K"),
            "{text}"
        );
        let mut other = Warming::default();
        for n in 0..1000 {
            let n = f64::from(n);
            other.push(
                20.0 + n * 0.01,
                Vector3::repeat((n * 0.7).sin() * 1e-3),
                SURE,
            );
        }
        assert!(other.line().unwrap().explained < 0.1);
        assert!(other.text().unwrap().contains("does not go with it"));
    }

    #[test]
    fn of_few_pairs_or_one_temperature_no_line_is_told() {
        let mut all = Warming::default();
        assert_eq!((all.text(), all.json()), (None, Value::Null));
        for n in 0..1000 {
            all.push(30.0, Vector3::repeat(f64::from(n)), SURE);
        }
        assert_eq!(all.line(), None);
        assert_eq!(all.text().unwrap(), "30.00 to 30.00 degC");
        all.push(40.0, Vector3::zeros(), Vector3::repeat(f64::NAN));
        assert_eq!(all.line(), None);
    }
}
