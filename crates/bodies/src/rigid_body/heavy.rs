//! A rigid body about a fixed point in uniform gravity -> its motion, exactly. Pure.

use super::taylor::{Heavy, Rates, Trajectory};
use super::{Rotor, Spin};
use crate::double_double::DoubleDouble;
use crate::motion_error::{FASTEST, MotionError, within};
use nalgebra::Vector3;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::quaternion::kernel as quat;

/// A body, symmetric or not, free or heavy, turning about a fixed point (its pivot, or its centre of
/// gravity when nothing holds it): attitude, rate and delta angle at any instant from zero on.
///
/// # Accuracy
/// Over 60 s at 20 turns a second attitude and closed form differ by 1.3e-14 rad at most, and energy
/// and momenta keep to 1e-13 (`crates/bodies/tests/bodies/top.rs`). Delta angles are good to 1e-15 rad
/// (`crates/bodies/tests/bodies/motions.rs`, by quadrature).
///
/// # Cost
/// Forward 0.9 us a sample at 100 samples a turn, 0.3 us at 500; time grows with the turns made up to
/// the instant asked for. An instant more than one segment (some tenths of a turn) back starts again
/// from zero; the answer is the same to the last bit.
#[derive(Clone, Debug)]
pub struct HeavyBody {
    rotor: Rotor,
    moment: Vector3<f64>,
    gravity_n: Vector3<f64>,
    trajectory: Trajectory,
}

impl HeavyBody {
    /// `mass_times_r` is mass times the vector from the fixed point to the centre of gravity, kg m,
    /// body axes (zero for a free body); `gravity_n` in m/s^2, navigation axes.
    ///
    /// # Errors
    /// [`MotionError`] for numbers that are not, or that can reach rates above 1e5 rad/s, ten times
    /// what any gyro reads.
    pub fn new(
        rotor: Rotor,
        mass_times_r: Vector3<f64>,
        gravity_n: Vector3<f64>,
        start: Spin,
    ) -> Result<Self, MotionError> {
        let q = start.q_nb.wxyz();
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        for (what, value) in [
            ("mass times arm (kg m)", mass_times_r.norm()),
            ("gravity (m/s^2)", gravity_n.norm()),
            ("body rate (rad/s)", start.w_nb_b.norm()),
            ("norm of the quaternion", norm),
        ] {
            within(what, value, f64::MAX)?;
        }
        // Energy bounds the rate: all of it, and the deepest fall, in the weakest axis.
        let fall = 2.0 * mass_times_r.norm() * gravity_n.norm();
        let energy = rotor.kinetic_energy(&start.w_nb_b) + fall;
        let fastest = (2.0 * energy * rotor.inverse().norm()).sqrt();
        within("largest possible body rate (rad/s)", fastest, FASTEST)?;
        let heavy = Heavy::new(rotor.inertia(), &mass_times_r, &gravity_n);
        let q = quat::normalised(&q);
        Ok(Self {
            rotor,
            moment: mass_times_r,
            gravity_n,
            trajectory: Trajectory::new(Rates::Heavy(Box::new(heavy)), &q, &start.w_nb_b),
        })
    }

    /// Attitude (sign continuous with t = 0) and body rate at `nanos` nanoseconds.
    pub fn at_nanos(&mut self, nanos: u64) -> Spin {
        self.at(DoubleDouble::from_nanos(nanos))
    }

    /// Attitude and body rate at sample `n` of a stream of `rate_hz` that began at zero.
    pub(crate) fn at_sample(&mut self, n: u64, rate_hz: f64) -> Spin {
        self.at(DoubleDouble::from(n as f64) / DoubleDouble::from(rate_hz))
    }

    fn at(&mut self, t: DoubleDouble) -> Spin {
        let (q, w_nb_b) = self.trajectory.at(t);
        Spin {
            q_nb: Quaternion::assume_unit(q),
            w_nb_b,
        }
    }

    /// Integral of the body rate over `from..to` in nanoseconds, rad: what an ideal integrating gyro
    /// puts out.
    pub fn delta_angle(&mut self, from: u64, to: u64) -> Vector3<f64> {
        self.trajectory
            .delta_angle(DoubleDouble::from_nanos(from), DoubleDouble::from_nanos(to))
    }

    /// Rotor: the inertia about the fixed point.
    #[must_use]
    pub fn rotor(&self) -> &Rotor {
        &self.rotor
    }

    /// Torque of gravity about the fixed point in body axes, N m: `m r x (C_nb^T g_n)`.
    #[must_use]
    pub fn torque(&self, q_nb: &Quaternion<Nav, Body>) -> Vector3<f64> {
        self.moment
            .cross(&(quat::matrix(&q_nb.wxyz()).transpose() * self.gravity_n))
    }

    /// Rate of change of the body rate, by Euler's equations, rad/s^2.
    #[must_use]
    pub fn rate_change(&self, spin: &Spin) -> Vector3<f64> {
        self.rotor
            .angular_acceleration(&spin.w_nb_b, &self.torque(&spin.q_nb))
    }

    /// Kinetic plus potential energy, J; zero height is that of the fixed point.
    #[must_use]
    pub fn energy(&self, spin: &Spin) -> f64 {
        let lever_n = quat::matrix(&spin.q_nb.wxyz()) * self.moment;
        self.rotor.kinetic_energy(&spin.w_nb_b) - lever_n.dot(&self.gravity_n)
    }
}
