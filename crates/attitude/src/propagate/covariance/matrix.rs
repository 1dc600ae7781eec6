//! One turn -> how it carries errors on; products of 3x3 arrays. Pure.
//!
//! Arrays and not `nalgebra`, because this runs once for every sample: the compiler keeps them in
//! registers and the symmetric products compute six numbers, not nine.

/// Rows of a 3x3 matrix.
pub(super) type Rows = [[f64; 3]; 3];
/// Upper triangle `xx, xy, xz, yy, yz, zz` of a symmetric one.
pub(super) type Triangle = [f64; 6];

pub(super) const ZERO: Rows = [[0.0; 3]; 3];
/// Row and column of each number of a [`Triangle`].
pub(super) const PLACES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Transition of errors in body axes by one turn, `[cos(a/2) - 1, v]` with v = sin(a/2) axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transition {
    /// `exp([phi x])^T`: from the body axes before to those after.
    pub(super) back: Rows,
    /// `J_r(phi) = I - (1 - cos a)/a^2 [phi x] + (a - sin a)/a^3 [phi x]^2`, the right Jacobian of the
    /// rotation group: the mean over the turn of what `back` is from each instant on.
    pub(super) mean: Rows,
}

/// `sin^2(a/2)` up to which the sums below are exact to 1e-12.
const SMALL: f64 = 0.01;

impl Transition {
    /// # Source
    /// docs/theory/attitude.md 8. In terms of v: `[phi x] = [v x] a/s`, so the coefficients become `2 s/a` and
    /// `(1 - sin a / a)/s^2`, both even and smooth in s = sin(a/2).
    #[inline(always)]
    pub(super) fn of([c, x, y, z]: [f64; 4]) -> Transition {
        let w = 1.0 + c;
        let s2 = x * x + (y * y + z * z);
        let (first, second) = if s2 <= SMALL && w > 0.0 {
            (
                1.0 - s2
                    * (1.0 / 6.0
                        + s2 * (17.0 / 360.0
                            + s2 * (367.0 / 15120.0 + s2 * (27859.0 / 1_814_400.0)))),
                2.0 / 3.0
                    + s2 * (4.0 / 45.0
                        + s2 * (8.0 / 189.0 + s2 * (368.0 / 14175.0 + s2 * (8416.0 / 467_775.0)))),
            )
        } else {
            large(w, s2)
        };
        Transition {
            back: rodrigues([x, y, z], s2, 2.0 * w, 2.0),
            mean: rodrigues([x, y, z], s2, first, second),
        }
    }
}

/// The two coefficients of the mean for a large angle; for a whole turn, whose axis v does not tell,
/// those of none.
#[cold]
fn large(w: f64, s2: f64) -> (f64, f64) {
    let s = s2.sqrt();
    let a = 2.0 * s.atan2(w);
    if s < 1e-6 {
        return (1.0, 2.0 / 3.0);
    }
    (2.0 * s / a, (1.0 - a.sin() / a) / s2)
}

/// `I - first [v x] + second [v x]^2`.
#[inline(always)]
fn rodrigues([x, y, z]: [f64; 3], s2: f64, first: f64, second: f64) -> Rows {
    let diagonal = 1.0 - second * s2;
    let (fx, fy, fz) = (first * x, first * y, first * z);
    let (sx, sy) = (second * x, second * y);
    let (xy, xz, yz) = (sx * y, sx * z, sy * z);
    [
        [diagonal + sx * x, xy + fz, xz - fy],
        [xy - fz, diagonal + sy * y, yz + fx],
        [xz + fy, yz - fx, diagonal + second * z * z],
    ]
}

#[inline(always)]
pub(super) fn product(a: &Rows, b: &Rows) -> Rows {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| a[i][0] * b[0][j] + (a[i][1] * b[1][j] + a[i][2] * b[2][j]))
    })
}

/// `a b^T`.
#[inline(always)]
pub(super) fn product_transposed(a: &Rows, b: &Rows, place: (usize, usize)) -> f64 {
    let (i, j) = place;
    a[i][0] * b[j][0] + (a[i][1] * b[j][1] + a[i][2] * b[j][2])
}

/// Every column times its own number.
#[inline(always)]
pub(super) fn columns_times(a: &Rows, [x, y, z]: [f64; 3]) -> Rows {
    a.map(|[ax, ay, az]| [ax * x, ay * y, az * z])
}

/// `a diag(d) a^T`.
#[inline(always)]
pub(super) fn congruent_diagonal(a: &Rows, d: [f64; 3]) -> Triangle {
    let scaled = columns_times(a, d);
    PLACES.map(|place| product_transposed(&scaled, a, place))
}

/// `a p a^T` of a symmetric p.
#[inline(always)]
pub(super) fn congruent(a: &Rows, p: &Triangle) -> Triangle {
    let [xx, xy, xz, yy, yz, zz] = *p;
    let full = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let left = product(a, &full);
    PLACES.map(|place| product_transposed(&left, a, place))
}
