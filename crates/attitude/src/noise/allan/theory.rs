//! Noise terms -> Allan variance. Pure.

use crate::noise::sensor_error::ImuError;
use std::f64::consts::{LN_2, PI};

/// Allan variance at `tau` seconds of the noise of `error`, (rad/s)^2: quantisation, angle random walk,
/// flicker (without ends), rate random walk, ramp, Gauss-Markov. Constant errors add nothing.
///
/// # Source
/// IEEE Std 952-1997, annex C, equations C.7 to C.28.
#[must_use]
pub fn variance(error: &ImuError, tau: f64) -> f64 {
    let terms = [
        error.quantization,
        error.arw,
        error.bias_instability,
        error.rrw,
        error.rate_ramp,
    ];
    let powers: f64 = terms
        .iter()
        .zip(per_square(tau))
        .map(|(c, f)| c * c * f)
        .sum();
    powers + gauss_markov(error.gm_sigma, error.gm_tau, tau)
}

/// Allan variance at `tau` per square of the coefficient: Q, N, B, K, R.
pub(super) fn per_square(tau: f64) -> [f64; 5] {
    [
        3.0 / (tau * tau),
        1.0 / tau,
        2.0 * LN_2 / PI,
        tau / 3.0,
        0.5 * tau * tau,
    ]
}

fn gauss_markov(sigma: f64, time: f64, tau: f64) -> f64 {
    if sigma == 0.0 || time == 0.0 {
        return 0.0;
    }
    let x = tau / time;
    // 1 - (3 - 4 e^-x + e^-2x) / (2x), which cancels where x is small.
    let bracket = if x < 1e-2 {
        x * x * (1.0 / 3.0 - x * (0.25 - x * (7.0 / 60.0 - x / 24.0)))
    } else {
        1.0 + (4.0 * (-x).exp_m1() - (-2.0 * x).exp_m1()) / (2.0 * x)
    };
    2.0 * sigma * sigma / x * bracket
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gauss_markov_process_peaks_where_ieee_952_says() {
        let sigma = |x: f64| gauss_markov(1.0, 1.0, x).sqrt();
        let peak = (1..4000)
            .map(|i| f64::from(i) * 1e-3)
            .max_by(|a, b| sigma(*a).total_cmp(&sigma(*b)))
            .unwrap_or(0.0);
        assert!((peak - 1.89).abs() < 0.01, "{peak}");
        assert!((sigma(peak) - 0.617).abs() < 1e-3);
        // The series and the closed form meet.
        let (below, above) = (sigma(0.01 * (1.0 - 1e-9)), sigma(0.01 * (1.0 + 1e-9)));
        assert!((below / above - 1.0).abs() < 1e-8, "{below} {above}");
    }
}
