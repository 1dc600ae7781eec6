//! The way from one rest to the next with least jerk, for joints and for bodies. Pure.

/// The way from one rest to the next: `s(x) = 10 x^3 - 15 x^4 + 6 x^5`, least jerk, rate and
/// acceleration zero at both ends. Fraction of the way and its two derivatives over `duration` s.
pub(crate) fn rest_to_rest(secs: f64, duration: f64) -> [f64; 3] {
    let x = (secs / duration).clamp(0.0, 1.0);
    let y = 1.0 - x;
    [
        x * x * x * (10.0 - x * (15.0 - 6.0 * x)),
        30.0 * x * x * y * y / duration,
        60.0 * x * y * (1.0 - 2.0 * x) / (duration * duration),
    ]
}

/// Peak of the derivative of [`rest_to_rest`] over one second.
pub(crate) const PEAK: f64 = 15.0 / 8.0;
