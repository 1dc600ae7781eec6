//! Rational turns -> sine and cosine, the same bits on every machine. Pure.
//!
//! A stage of its own because fixtures are compared byte for byte, and the sines of two C libraries
//! differ in the last bit. The angle is reduced exactly, in integers; a Taylor series in
//! double-double follows, which needs only IEEE sums, products and fused multiply-adds.

/// 2 pi as an unevaluated sum of two doubles, good to 2^-104.
const TAU: DoubleDouble = DoubleDouble(std::f64::consts::TAU, 2.449_293_598_294_706_4e-16);

/// An unevaluated sum `hi + lo` with `|lo| <= ulp(hi) / 2` (Dekker 1971).
#[derive(Clone, Copy)]
struct DoubleDouble(f64, f64);

impl DoubleDouble {
    fn renormalised(hi: f64, lo: f64) -> Self {
        let sum = hi + lo;
        DoubleDouble(sum, lo - (sum - hi))
    }

    fn plus(self, other: Self) -> Self {
        let sum = self.0 + other.0;
        let part = sum - self.0;
        let error = (self.0 - (sum - part)) + (other.0 - part);
        Self::renormalised(sum, error + self.1 + other.1)
    }

    fn times(self, other: Self) -> Self {
        let product = self.0 * other.0;
        let error = self.0.mul_add(other.0, -product);
        Self::renormalised(product, error + (self.0 * other.1 + self.1 * other.0))
    }

    fn over(self, divisor: f64) -> Self {
        let quotient = self.0 / divisor;
        let remainder = (-quotient).mul_add(divisor, self.0) + self.1;
        Self::renormalised(quotient, remainder / divisor)
    }
}

/// `(sin, cos)` of `numerator / denominator` turns.
///
/// # Accuracy
/// Summed to about 2^-100 and rounded once, so the nearest double but where two are all but equally near;
/// swept against the platform's sine in `tests/commands/fixtures.rs`.
///
/// # Panics
/// When `denominator` is not in `1..=2^50`: a mistake in a recipe.
pub(crate) fn sin_cos(numerator: i64, denominator: i64) -> (f64, f64) {
    assert!((1..=1 << 50).contains(&denominator), "{denominator}");
    let fraction = numerator.rem_euclid(denominator);
    // The nearest quarter turn, and what is left: at most an eighth of a turn, exactly known.
    let quarter = (8 * fraction + denominator).div_euclid(2 * denominator);
    let left = 4 * fraction - quarter * denominator;
    let angle = TAU
        .times(DoubleDouble(left as f64, 0.0))
        .over((4 * denominator) as f64);
    let (sin, cos) = sin_cos_series(angle);
    match quarter.rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Taylor series about zero for angles up to pi/4; the first term left out is below 2^-120.
fn sin_cos_series(angle: DoubleDouble) -> (f64, f64) {
    let square = angle.times(angle);
    let series = |mut term: DoubleDouble, first: u32| {
        let mut sum = term;
        for k in (first..first + 32).step_by(2) {
            term = term.times(square).over(-f64::from(k * (k + 1)));
            sum = sum.plus(term);
        }
        sum.0
    };
    (series(angle, 2), series(DoubleDouble(1.0, 0.0), 1))
}
