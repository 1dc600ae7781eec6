//! Elliptic integrals (Carlson's symmetric forms) and Jacobi's functions. Pure.
//!
//! A stage of its own because two bodies need it whose motion has a closed form: the heavy symmetric
//! top and the free triaxial body.
//!
//! # Convention
//! Parameter `m = k^2`, never the modulus. Where 1 - m matters it is asked for as `mc`, because near
//! m = 1 the subtraction would lose what the caller knows exactly.
//!
//! # Accuracy
//! A few units in the last place (tests beside the code) for `0 <= m < 1`, arguments within one
//! quarter period; `n < 1` for the third kind.
//!
//! # Source
//! Carlson, Numerical Algorithms 10 (1995) 13, algorithms for R_F, R_C, R_J. Abramowitz, Stegun,
//! Handbook of Mathematical Functions (1964), 16.4: Jacobi's functions by the arithmetic-geometric mean.

use super::double_double::DoubleDouble;

/// `sn`, `cn`, `dn` and the amplitude at one argument.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jacobi {
    pub(crate) sn: f64,
    pub(crate) cn: f64,
    pub(crate) dn: f64,
    pub(crate) am: f64,
}

/// Steps of the mean: it converges quadratically, from any `mc` an `f64` can hold.
const STEPS: usize = 12;

/// Jacobi's functions of `u` within a quarter period of zero, for parameter `1 - mc`.
pub(crate) fn jacobi(u: f64, m: f64, mc: f64) -> Jacobi {
    if mc <= 0.0 {
        let (cn, sn) = (1.0 / u.cosh(), u.tanh());
        return Jacobi {
            sn,
            cn,
            dn: cn,
            am: u.sinh().atan(),
        };
    }
    let mut a = 1.0;
    let mut b = mc.sqrt();
    let mut ratios = [0.0; STEPS];
    let mut scale = 1.0;
    let mut used = 0;
    let mut c = m.sqrt();
    while used < STEPS && c > 1e-17 * a {
        c = 0.5 * (a - b);
        let mean = 0.5 * (a + b);
        b = (a * b).sqrt();
        a = mean;
        scale *= 2.0;
        ratios[used] = c / a;
        used += 1;
    }
    let mut am = scale * a * u;
    for ratio in ratios[..used].iter().rev() {
        am = 0.5 * (am + (ratio * am.sin()).clamp(-1.0, 1.0).asin());
    }
    let (sn, cn) = am.sin_cos();
    Jacobi {
        sn,
        cn,
        // The sum of two positive numbers for any m.
        dn: (mc + m * cn * cn).sqrt(),
        am,
    }
}

/// The quarter period K of parameter `1 - mc`, in 32 digits; `mc > 0`.
pub(crate) fn quarter_period(mc: DoubleDouble) -> DoubleDouble {
    let mut a = DoubleDouble::ONE;
    let mut b = mc.sqrt();
    for _ in 0..STEPS {
        let mean = (a + b) * 0.5;
        b = (a * b).sqrt();
        a = mean;
    }
    DoubleDouble::PI * 0.5 / a
}

/// The integral of the first kind at amplitude `phi` within a quarter turn, parameter m.
pub(crate) fn first_kind(phi: f64, m: f64) -> f64 {
    let (s, c) = phi.sin_cos();
    s * rf(c * c, 1.0 - m * s * s, 1.0)
}

/// The integral of the third kind, `∫ dθ / ((1 - n sin²θ) sqrt(1 - m sin²θ))`, from zero to an
/// amplitude within a quarter turn whose sine, cosine and dn are given; `n < 1`.
pub(crate) fn third_kind(n: f64, at: &Jacobi) -> f64 {
    let (s2, c2, d2) = (at.sn * at.sn, at.cn * at.cn, at.dn * at.dn);
    at.sn * (rf(c2, d2, 1.0) + n * s2 / 3.0 * rj(c2, d2, 1.0, 1.0 - n * s2))
}

/// The complete integral of the third kind, in 32 digits; `mc = 1 - m > 0` and `nc = 1 - n > 0`.
///
/// It is what a motion gains each half period, over thousands of them.
///
/// # Source
/// Bulirsch, Numer. Math. 13 (1969) 305: `cel(sqrt(mc), nc, 1, 1)`, an arithmetic-geometric mean that
/// carries two sums along.
pub(crate) fn complete_third_kind(nc: DoubleDouble, mc: DoubleDouble) -> DoubleDouble {
    let mut kc = mc.sqrt();
    let mut product = kc;
    let mut mean = DoubleDouble::ONE;
    let mut p = nc.sqrt();
    let mut a = DoubleDouble::ONE;
    let mut b = DoubleDouble::ONE / p;
    for step in 0..STEPS {
        let before = a;
        a += b / p;
        let g = product / p;
        b = (b + before * g) * 2.0;
        p += g;
        mean += kc;
        if step + 1 < STEPS {
            kc = product.sqrt() * 2.0;
            product = kc * mean;
        }
    }
    DoubleDouble::PI * 0.5 * (b + a * mean) / (mean * (mean + p))
}

/// Duplications: each divides the spread by four, so 60 reach `f64` from any start it can hold.
const DUPLICATIONS: usize = 100;

/// R_F(x, y, z): at most one argument zero, none negative.
fn rf(x: f64, y: f64, z: f64) -> f64 {
    let (mut x, mut y, mut z) = (x, y, z);
    for _ in 0..DUPLICATIONS {
        let mean = (x + y + z) / 3.0;
        let spread = (mean - x).abs().max((mean - y).abs()).max((mean - z).abs());
        // The series below leaves out terms of spread^5 / 15.
        if spread < 1e-3 * mean {
            break;
        }
        let (sx, sy, sz) = (x.sqrt(), y.sqrt(), z.sqrt());
        let lambda = sx * (sy + sz) + sy * sz;
        x = 0.25 * (x + lambda);
        y = 0.25 * (y + lambda);
        z = 0.25 * (z + lambda);
    }
    let mean = (x + y + z) / 3.0;
    let (x, y) = ((mean - x) / mean, (mean - y) / mean);
    let z = -(x + y);
    let e2 = x * y - z * z;
    let e3 = x * y * z;
    let series = 1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0;
    series / mean.sqrt()
}

/// R_C(1, 1 + e), e > -1.
fn rc_one(e: f64) -> f64 {
    if e.abs() < 1e-3 {
        // 1 - e/3 + e^2/5 - ...: seven terms leave 1e-21.
        let mut sum = 0.0;
        for k in (0..7).rev() {
            sum = 1.0 / f64::from(2 * k + 1) - e * sum;
        }
        sum
    } else if e > 0.0 {
        let s = e.sqrt();
        s.atan() / s
    } else {
        let s = (-e).sqrt();
        s.atanh() / s
    }
}

/// R_J(x, y, z, p), p > 0: Carlson 1995 with the R_C terms in the form of DLMF 19.36.
fn rj(x: f64, y: f64, z: f64, p: f64) -> f64 {
    let (x0, y0, z0, p0) = (x, y, z, p);
    let (mut x, mut y, mut z, mut p) = (x, y, z, p);
    let delta = (p0 - x0) * (p0 - y0) * (p0 - z0);
    let mut sum = 0.0;
    let mut scale = 1.0;
    for _ in 0..DUPLICATIONS {
        let mean = (x + y + z + 2.0 * p) / 5.0;
        let spread = (mean - x)
            .abs()
            .max((mean - y).abs())
            .max((mean - z).abs())
            .max((mean - p).abs());
        // As above: terms of spread^5 / 5 are left out.
        if spread < 1e-3 * mean {
            break;
        }
        let (sx, sy, sz, sp) = (x.sqrt(), y.sqrt(), z.sqrt(), p.sqrt());
        let lambda = sx * (sy + sz) + sy * sz;
        let d = (sp + sx) * (sp + sy) * (sp + sz);
        let e = scale * scale * scale * delta / (d * d);
        sum += scale / d * rc_one(e);
        x = 0.25 * (x + lambda);
        y = 0.25 * (y + lambda);
        z = 0.25 * (z + lambda);
        p = 0.25 * (p + lambda);
        scale *= 0.25;
    }
    let mean = (x + y + z + 2.0 * p) / 5.0;
    let (dx, dy, dz) = ((mean - x) / mean, (mean - y) / mean, (mean - z) / mean);
    let dp = -0.5 * (dx + dy + dz);
    let xyz = dx * dy * dz;
    let e2 = dx * dy + dx * dz + dy * dz - 3.0 * dp * dp;
    let e3 = xyz + 2.0 * e2 * dp + 4.0 * dp * dp * dp;
    let e4 = (2.0 * xyz + e2 * dp + 3.0 * dp * dp * dp) * dp;
    let series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0 - 3.0 * e4 / 22.0;
    scale * series / (mean * mean.sqrt()) + 6.0 * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Independent of Carlson and of the mean: the integrands, by the midpoint rule over a full
    /// period of a periodic analytic function, which converges faster than any power.
    fn complete_by_quadrature(n: f64, m: f64) -> f64 {
        let steps = 400;
        let h = std::f64::consts::PI / f64::from(steps);
        (0..steps)
            .map(|i| {
                let s = (h * (f64::from(i) + 0.5)).sin();
                0.5 * h / ((1.0 - n * s * s) * (1.0 - m * s * s).sqrt())
            })
            .sum()
    }

    #[test]
    fn complete_integrals_equal_their_quadrature() {
        for m in [0.0, 0.1, 0.5, 0.9] {
            let k = complete_by_quadrature(0.0, m);
            let mc = DoubleDouble::ONE - DoubleDouble::from(m);
            // 400 summands of the quadrature, a tenth of an ulp of 1 each.
            let tolerance = 2e-14;
            let ours = quarter_period(mc).to_f64();
            assert!((ours - k).abs() < tolerance, "{m} {ours} {k}");
            let ours = first_kind(std::f64::consts::FRAC_PI_2, m);
            assert!((ours - k).abs() < tolerance, "{m} {ours} {k}");
            for n in [-3.0, -0.1, 0.0, 0.3, 0.8] {
                let p = complete_by_quadrature(n, m);
                let nc = DoubleDouble::ONE - DoubleDouble::from(n);
                let ours = complete_third_kind(nc, mc).to_f64();
                assert!((ours - p).abs() < tolerance * p, "{n} {m} {ours} {p}");
            }
        }
    }

    #[test]
    fn jacobi_functions_satisfy_their_differential_equations() {
        // d am/du = dn, d sn/du = cn dn: a central difference of step 1e-3 with Richardson leaves
        // 1e-13 of cancellation and truncation.
        for m in [0.0, 0.2, 0.7, 0.999] {
            let mc = 1.0 - m;
            for u in [-1.3, -0.2, 0.0, 0.4, 1.1, 1.5] {
                let j = jacobi(u, m, mc);
                let d = |f: fn(&Jacobi) -> f64| {
                    let c =
                        |h: f64| (f(&jacobi(u + h, m, mc)) - f(&jacobi(u - h, m, mc))) / (2.0 * h);
                    (4.0 * c(1e-3) - c(2e-3)) / 3.0
                };
                assert!((d(|j| j.am) - j.dn).abs() < 1e-11, "{m} {u}");
                assert!((d(|j| j.sn) - j.cn * j.dn).abs() < 1e-11);
                assert!((j.sn * j.sn + j.cn * j.cn - 1.0).abs() < 4e-16);
                assert!((j.dn * j.dn + m * j.sn * j.sn - 1.0).abs() < 5e-16);
            }
        }
    }

    #[test]
    fn the_amplitude_inverts_the_first_kind() {
        for m in [0.0, 0.3, 0.95] {
            for phi in [-1.5, -0.3, 0.01, 1.0, 1.57] {
                let u = first_kind(phi, m);
                // Conditioned by dn, 0.22 at worst: five ulps.
                assert!((jacobi(u, m, 1.0 - m).am - phi).abs() < 2e-15, "{m} {phi}");
            }
        }
    }

    #[test]
    fn the_third_kind_adds_up_to_its_complete_value_and_to_a_closed_form() {
        for n in [-2.0_f64, 0.4, 0.9] {
            for phi in [0.2_f64, 1.0, 1.5] {
                // m = 0: elementary.
                let at = Jacobi {
                    sn: phi.sin(),
                    cn: phi.cos(),
                    dn: 1.0,
                    am: phi,
                };
                let r = (1.0 - n).sqrt();
                let exact = (r * phi.tan()).atan() / r;
                let ours = third_kind(n, &at);
                // A few ulps, at 1.5 those of a tangent of 14.
                assert!(
                    (ours - exact).abs() < 4e-15 * exact,
                    "{n} {phi} {ours} {exact}"
                );
            }
        }
    }

    #[test]
    fn the_incomplete_integral_reaches_the_complete_one() {
        let end = Jacobi {
            sn: 1.0,
            cn: 0.0,
            dn: 0.5_f64.sqrt(),
            am: std::f64::consts::FRAC_PI_2,
        };
        let half = DoubleDouble::from(0.5);
        for n in [-5.0, -0.2, 0.7] {
            let nc = DoubleDouble::ONE - DoubleDouble::from(n);
            let complete = complete_third_kind(nc, half).to_f64();
            // Two algorithms, a few ulps each.
            assert!((third_kind(n, &end) / complete - 1.0).abs() < 2e-15);
        }
    }

    #[test]
    fn the_series_of_carlson_hold_to_the_border_where_they_take_over() {
        // One more duplication makes the remainder 4^5 times smaller: what is compared is the series.
        let (x, y, z) = (1.000_9_f64, 0.999_5, 0.999_6);
        let lambda = (x * y).sqrt() + (y * z).sqrt() + (z * x).sqrt();
        let quarter = |a: f64| 0.25 * (a + lambda);
        let once = rf(quarter(x), quarter(y), quarter(z));
        assert!((rf(x, y, z) - once).abs() < 5e-16, "one ulp and the sums");
        let (x, y, z, p) = (1.000_9_f64, 0.999_4, 0.999_2, 1.000_1_f64);
        let lambda = (x * y).sqrt() + (y * z).sqrt() + (z * x).sqrt();
        let quarter = |a: f64| 0.25 * (a + lambda);
        let root = p.sqrt();
        let d = (root + x.sqrt()) * (root + y.sqrt()) * (root + z.sqrt());
        let e = (p - x) * (p - y) * (p - z) / (d * d);
        let rest = rj(quarter(x), quarter(y), quarter(z), quarter(p));
        let once = 0.25 * rest + 6.0 / d * rc_one(e);
        assert!(
            (rj(x, y, z, p) - once).abs() < 5e-15,
            "{:e}",
            rj(x, y, z, p) - once
        );
    }

    #[test]
    fn the_integrals_have_the_values_carlson_prints() {
        // Numerical Algorithms 10 (1995), section 3: 14 digits.
        assert!((rf(1.0, 2.0, 0.0) - 1.311_028_777_146_1).abs() < 1e-13);
        assert!((rf(2.0, 3.0, 4.0) - 0.584_082_841_677_15).abs() < 1e-14);
        assert!((rj(0.0, 1.0, 2.0, 3.0) - 0.776_886_237_785_82).abs() < 1e-14);
        assert!((rj(2.0, 3.0, 4.0, 5.0) - 0.142_975_796_671_57).abs() < 1e-14);
    }

    #[test]
    fn at_the_separatrix_the_functions_are_hyperbolic() {
        let near = jacobi(2.0, 1.0, 1e-20);
        let at = jacobi(2.0, 1.0, 0.0);
        // The difference is of the order of mc cosh^2.
        assert!((near.sn - at.sn).abs() < 1e-15 && (near.am - at.am).abs() < 1e-15);
        assert!((at.sn - 2.0_f64.tanh()).abs() < 1e-16);
    }
}
