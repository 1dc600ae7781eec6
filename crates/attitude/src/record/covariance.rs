//! Uncertainty of an attitude: the 3x3 that travels with every output. Pure.

use crate::frames::{Body, Nav};
use crate::quaternion::Quaternion;
use nalgebra::{Matrix3, Vector3};

/// Covariance of the error of an attitude, rad^2, resolved in body axes.
///
/// # Convention
/// The error is the small rotation from the estimated to the true body axes:
/// `q_true = q_est exp(error)`. Symmetric, so six numbers hold it. All zeros: no noise was stated.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct AttitudeCovariance {
    /// About x.
    pub xx: f64,
    /// Covariance of x and y.
    pub xy: f64,
    /// Covariance of x and z.
    pub xz: f64,
    /// About y.
    pub yy: f64,
    /// Covariance of y and z.
    pub yz: f64,
    /// About z.
    pub zz: f64,
}

impl AttitudeCovariance {
    /// Errors about the three axes that have nothing to do with each other, from one standard
    /// deviation each, rad.
    #[must_use]
    pub fn from_sigma(sigma: Vector3<f64>) -> AttitudeCovariance {
        AttitudeCovariance {
            xx: sigma.x * sigma.x,
            yy: sigma.y * sigma.y,
            zz: sigma.z * sigma.z,
            ..AttitudeCovariance::default()
        }
    }

    /// Makes it from the upper triangle, row by row: xx, xy, xz, yy, yz, zz.
    #[must_use]
    #[inline(always)]
    pub fn from_upper([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> AttitudeCovariance {
        AttitudeCovariance {
            xx,
            xy,
            xz,
            yy,
            yz,
            zz,
        }
    }

    /// The upper triangle, row by row.
    #[must_use]
    pub fn upper(&self) -> [f64; 6] {
        [self.xx, self.xy, self.xz, self.yy, self.yz, self.zz]
    }

    /// One standard deviation about each body axis, rad.
    #[must_use]
    pub fn sigma(&self) -> Vector3<f64> {
        Vector3::new(self.xx.sqrt(), self.yy.sqrt(), self.zz.sqrt())
    }

    /// The whole matrix.
    #[must_use]
    pub fn matrix(&self) -> Matrix3<f64> {
        let [xx, xy, xz, yy, yz, zz] = self.upper();
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }

    /// The upper triangle of a symmetric matrix.
    pub(super) fn of(m: &Matrix3<f64>) -> AttitudeCovariance {
        AttitudeCovariance {
            xx: m.m11,
            xy: m.m12,
            xz: m.m13,
            yy: m.m22,
            yz: m.m23,
            zz: m.m33,
        }
    }

    /// The same error resolved in navigation axes: `C_nb P C_nb^T`. Its last diagonal element is the
    /// variance of the heading when z is vertical.
    #[must_use]
    pub fn in_navigation_axes(&self, q_nb: &Quaternion<Nav, Body>) -> Matrix3<f64> {
        let c_nb = *q_nb.to_dcm().as_matrix();
        let p = c_nb * self.matrix() * c_nb.transpose();
        // Symmetric to the last bit, whichever half is read.
        AttitudeCovariance::of(&p).matrix()
    }

    /// Makes it from that of an error resolved in navigation axes, the inverse of
    /// [`AttitudeCovariance::in_navigation_axes`].
    pub(crate) fn of_navigation_axes(
        p: &Matrix3<f64>,
        q_nb: &Quaternion<Nav, Body>,
    ) -> AttitudeCovariance {
        let c_nb = *q_nb.to_dcm().as_matrix();
        AttitudeCovariance::of(&(c_nb.transpose() * p * c_nb))
    }

    /// The same error about other body axes: `change` gives the new components of a body vector.
    #[must_use]
    pub fn relabelled(&self, change: impl Fn(Vector3<f64>) -> Vector3<f64>) -> AttitudeCovariance {
        let columns = |m: Matrix3<f64>| {
            Matrix3::from_columns(&[0, 1, 2].map(|i| change(m.column(i).into_owned())))
        };
        AttitudeCovariance::of(&columns(columns(self.matrix()).transpose()))
    }
}
