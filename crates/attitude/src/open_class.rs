//! Two classes, one of them likely to so much -> how wide three sigmas must be to hold what they promise. Pure.
//!
//! Apart from the filter and the smoother because both doubt the class of a sensor. A variance alone is too small: with
//! one class in ten four times as wide, the variance of the mixture is 2.5 times that of the narrow one, and one
//! error in 42, not one in 370, is beyond three of its sigmas.

/// Share of a Gaussian beyond three sigmas, on either side.
const BEYOND_THREE: f64 = 1.35e-3;

/// Share of the variance of a class that holds with `probability` by which three sigmas are passed as seldom as those of a
/// Gaussian, 0 to 1: nothing where the class is less likely than that.
///
/// The Gaussian's quantile by Hastings, "Approximations for Digital Computers" (1955), as in Abramowitz and Stegun
/// (1964), 26.2.23: within 4.5e-4 of a sigma.
pub(crate) fn share_of_variance(probability: f64) -> f64 {
    let beyond = BEYOND_THREE / probability;
    if !(0.0..0.5).contains(&beyond) {
        return 0.0;
    }
    let t = (-2.0 * beyond.ln()).sqrt();
    let above = 2.515517 + t * (0.802853 + t * 0.010328);
    let below = 1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308));
    let sigmas = (t - above / below).clamp(0.0, 3.0);
    sigmas * sigmas / 9.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_sigmas_hold_what_they_promise_whatever_the_probability() {
        // Quantiles of the Gaussian: one side of 0.00135, 0.0027, 0.0135, 0.135.
        let known = [
            (1.0, 2.99998),
            (0.5, 2.78222),
            (0.1, 2.21148),
            (0.01, 1.10306),
        ];
        for (probability, sigmas) in known {
            let found = 3.0 * share_of_variance(probability).sqrt();
            assert!((found - sigmas).abs() < 6e-4, "{probability} {found}");
        }
    }

    #[test]
    fn a_class_that_is_hardly_possible_adds_nothing() {
        for probability in [0.0, 1e-300, 2.7e-3, f64::NAN, -1.0] {
            assert_eq!(share_of_variance(probability), 0.0, "{probability}");
        }
        assert!(share_of_variance(2.8e-3) < 1e-3);
    }
}
