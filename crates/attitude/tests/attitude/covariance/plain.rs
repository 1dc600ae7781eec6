//! The 6x6 recursion written down as it stands in docs/theory/attitude.md 8, with exponentials as power series. White noise
//! comes half before and half after the turn: the same where the axes are equal, second order where not.

use nalgebra::{Matrix3, Matrix6, Vector3};
use strapd_attitude::propagate::covariance::Noise;

pub struct Plain {
    pub p: Matrix6<f64>,
    arw: Matrix3<f64>,
    rrw: Matrix3<f64>,
    tau: Option<f64>,
}

/// `sum (-[phi x])^k / (k + shift)!`: exp of -phi for no shift, the right Jacobian of phi for one.
fn series(phi: Vector3<f64>, shift: usize) -> Matrix3<f64> {
    let cross = -phi.cross_matrix();
    let (mut sum, mut term) = (Matrix3::identity(), Matrix3::identity());
    for k in 1..40 {
        term = term * cross / (k + shift) as f64;
        sum += term;
    }
    sum
}

fn squares(axes: [f64; 3]) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::from(axes.map(|v| v * v)))
}

impl Plain {
    pub fn new(noise: &Noise) -> Plain {
        let mut p = Matrix6::zeros();
        p.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&squares(noise.initial));
        p.fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&squares(noise.bias));
        Plain {
            p,
            arw: squares(noise.arw),
            rrw: squares(noise.rrw),
            tau: noise.bias_tau,
        }
    }

    pub fn step(&mut self, phi: Vector3<f64>, h: f64) {
        let alpha = self.tau.map_or(1.0, |tau| (-h / tau).exp());
        let driven = self.tau.map_or(h, |tau| 0.5 * tau * (1.0 - alpha * alpha));
        let mut f = Matrix6::zeros();
        f.fixed_view_mut::<3, 3>(0, 0).copy_from(&series(phi, 0));
        f.fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&(series(phi, 1) * (-0.5 * h * (1.0 + alpha))));
        f.fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&(Matrix3::identity() * alpha));
        let mut q = Matrix6::zeros();
        q.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(self.arw * (0.5 * h) + self.rrw * (h * h * h / 3.0)));
        let across = self.rrw * (-0.5 * h * h);
        q.fixed_view_mut::<3, 3>(0, 3).copy_from(&across);
        q.fixed_view_mut::<3, 3>(3, 0).copy_from(&across);
        q.fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&(self.rrw * driven));
        for i in 0..3 {
            self.p[(i, i)] += 0.5 * h * self.arw[(i, i)];
        }
        self.p = f * self.p * f.transpose() + q;
    }
}
