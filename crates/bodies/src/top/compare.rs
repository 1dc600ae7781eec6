//! A top and a sample rate -> attitudes by methods A, B, C, and their errors against D. Pure.
//!
//! The source document's figure 10, as numbers. The table it leads to is in `docs/top.md`.

use super::{EulerState, SymmetricTop, TopError};
use crate::rigid_body::{HeldRate, Method, Rotor, Spin, gauss_legendre6};
use nalgebra::Vector3;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::quaternion::kernel as quat;

/// Method by which the attitude of the top is found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TopMethod {
    /// A: Euler's equations with the torque held over the step, and one rotation a step.
    Live(HeldRate),
    /// B: differential equation of the Euler angles.
    EulerAngles,
    /// C: true rates at the samples, and one rotation a sample.
    Gyro(HeldRate),
}

impl TopMethod {
    /// All seven, in the order of the table.
    pub const ALL: [Self; 7] = [
        Self::Live(HeldRate::Left),
        Self::Live(HeldRate::Right),
        Self::Live(HeldRate::Mean),
        Self::EulerAngles,
        Self::Gyro(HeldRate::Left),
        Self::Gyro(HeldRate::Right),
        Self::Gyro(HeldRate::Mean),
    ];

    /// The name at the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Live(HeldRate::Left) => "live-left",
            Self::Live(HeldRate::Right) => "live-right",
            Self::Live(HeldRate::Mean) => "live-mean",
            Self::EulerAngles => "euler-angles",
            Self::Gyro(HeldRate::Left) => "gyro-left",
            Self::Gyro(HeldRate::Right) => "gyro-right",
            Self::Gyro(HeldRate::Mean) => "gyro-mean",
        }
    }

    /// Finds a method by its name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name)
    }
}

/// One method's way through the samples.
#[derive(Clone, Debug)]
pub struct TopRun {
    method: TopMethod,
    top: SymmetricTop,
    rotor: Rotor,
    h: f64,
    steps: u64,
    spin: Spin,
    euler: EulerState,
}

impl TopRun {
    /// Ready at the start.
    ///
    /// # Errors
    /// [`TopError::OutOfRange`] for a rate that is not positive, [`TopError::RateTooLow`] when the
    /// start alone turns more than half a turn a sample, [`TopError::Singular`] for the Euler angles
    /// of an upright top.
    pub fn new(
        method: TopMethod,
        top: &SymmetricTop,
        start: &EulerState,
        rate_hz: f64,
    ) -> Result<Self, TopError> {
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return Err(TopError::OutOfRange {
                what: "sample rate (Hz)",
                value: rate_hz,
            });
        }
        let spin = start.spin();
        let needed_hz = spin.w_nb_b.norm() / std::f64::consts::PI;
        let follows = needed_hz < rate_hz;
        if !follows {
            return Err(TopError::RateTooLow { rate_hz, needed_hz });
        }
        let run = Self {
            method,
            top: *top,
            rotor: top.rotor()?,
            h: 1.0 / rate_hz,
            steps: 0,
            spin,
            euler: *start,
        };
        if !matches!(method, TopMethod::Live(_)) {
            run.regular()?;
        }
        Ok(run)
    }

    /// The attitude after one more sample interval.
    ///
    /// # Errors
    /// [`TopError::Singular`] when the Euler angles run into the vertical.
    pub fn advance(&mut self) -> Result<Quaternion<Nav, Body>, TopError> {
        let t = self.steps as f64 * self.h;
        self.steps += 1;
        match self.method {
            TopMethod::Live(rate) => {
                let (arm, weight) = (
                    Vector3::new(0.0, 0.0, self.top.arm()),
                    Vector3::new(0.0, 0.0, -self.top.mass() * self.top.gravity()),
                );
                self.spin = self.rotor.step(
                    Method::HeldTorque(rate),
                    t,
                    &self.spin,
                    self.h,
                    |_, q, _| arm.cross(&(quat::matrix(&q.wxyz()).transpose() * weight)),
                )?;
                Ok(self.spin.q_nb)
            }
            TopMethod::EulerAngles => {
                self.advance_angles(t)?;
                Ok(self.euler.angles.quaternion())
            }
            TopMethod::Gyro(rate) => {
                let before = self.euler.body_rate();
                self.advance_angles(t)?;
                let phi = rate.of(&before, &self.euler.body_rate()) * self.h;
                let q = quat::product(&self.spin.q_nb.wxyz(), &quat::exp(&phi));
                self.spin.q_nb = Quaternion::assume_unit(quat::normalised(&q));
                Ok(self.spin.q_nb)
            }
        }
    }

    /// One step of Hasbun's equations, by Gauss-Legendre collocation.
    fn advance_angles(&mut self, t: f64) -> Result<(), TopError> {
        let (i1, i3) = (self.top.transverse(), self.top.axial());
        let (torque, w3) = (self.top.largest_torque(), self.euler.w3);
        let mut derivative = |_: f64, y: &[f64; 5]| {
            let [_, nutation, _, p, nutation_rate] = *y;
            let (s, c) = nutation.sin_cos();
            [
                p,
                nutation_rate,
                w3 - p * c,
                (i3 * w3 - 2.0 * i1 * p * c) * nutation_rate / (i1 * s),
                (i1 * p * p * c - i3 * w3 * p + torque) * s / i1,
            ]
        };
        let e = self.euler;
        let y = [
            e.angles.precession,
            e.angles.nutation,
            e.angles.spin,
            e.precession_rate,
            e.nutation_rate,
        ];
        // Near the vertical the equations are stiff before they are singular.
        let y =
            gauss_legendre6(&mut derivative, t, &y, self.h).map_err(|_| TopError::Singular {
                nutation: e.angles.nutation,
                t,
            })?;
        self.euler.angles.precession = y[0];
        self.euler.angles.nutation = y[1];
        self.euler.angles.spin = y[2];
        self.euler.precession_rate = y[3];
        self.euler.nutation_rate = y[4];
        self.regular()
    }

    /// Whether the Euler angles still have rates: nutation 1e-6 rad clear of upright and hanging.
    fn regular(&self) -> Result<(), TopError> {
        let nutation = self.euler.angles.nutation;
        if nutation.sin().abs() > 1e-6 {
            Ok(())
        } else {
            Err(TopError::Singular {
                nutation,
                t: self.steps as f64 * self.h,
            })
        }
    }
}

/// The worst of one method over a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MethodError {
    /// Method.
    pub method: TopMethod,
    /// Largest angle between the axes of symmetry, rad.
    pub axis_max: f64,
    /// Largest angle of the rotation between the attitudes, rad.
    pub attitude_max: f64,
}

/// Each method against the exact motion over `samples` intervals.
///
/// # Errors
/// The first method's that refuses ([`TopRun`]), or [`SymmetricTop::exact`]'s.
pub fn compare(
    methods: &[TopMethod],
    top: &SymmetricTop,
    start: &EulerState,
    rate_hz: f64,
    samples: u64,
) -> Result<Vec<MethodError>, TopError> {
    let mut exact = top.exact(start)?;
    let mut rows = Vec::with_capacity(methods.len());
    for method in methods {
        let run = TopRun::new(*method, top, start, rate_hz)?;
        rows.push((run, 0.0_f64, 0.0_f64));
    }
    for n in 1..=samples {
        let truth = exact.at_sample(n, rate_hz).q_nb.wxyz();
        for (run, axis, attitude) in &mut rows {
            let q = run.advance()?.wxyz();
            *axis = axis.max(quat::angle_between_z_axes(&truth, &q));
            *attitude = attitude.max(quat::angle_between(&truth, &q));
        }
    }
    Ok(rows
        .into_iter()
        .map(|(run, axis_max, attitude_max)| MethodError {
            method: run.method,
            axis_max,
            attitude_max,
        })
        .collect())
}
