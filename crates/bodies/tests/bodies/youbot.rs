//! The youBot's arm: against vectors of an independent oracle (`golden/youbot_golden.json`), against
//! itself on random poses, and against the source document, each of whose errors is refuted by name.
// Prints what it measured, for `--nocapture`.

#[allow(unreachable_pub)]
mod bad_input;
mod dynamics;
mod errata;
mod frames;
mod golden;
mod gyro;
mod paths;
mod random;

use nalgebra::{Matrix3, Vector3};
use rand::{Rng, RngExt};
use strapd_attitude::frames::{Dcm, In};
use strapd_bodies::dh::Transform;
use strapd_bodies::youbot::{Arm, Base, Parameters, TableJoints, Tool};

/// Gravity on a level floor, m/s^2.
fn level() -> In<Base> {
    In::assume(Vector3::new(0.0, 0.0, -9.81))
}

fn pose(p: Vector3<f64>, r: Matrix3<f64>) -> Transform<Base, Tool> {
    Transform::new(Dcm::assume(r), In::assume(p))
}

fn degrees(q: [f64; 5]) -> TableJoints {
    TableJoints::from_degrees(q).unwrap()
}

/// Distance in m and angle in rad between two poses; exact for close ones.
fn apart(a: &Transform<Base, Tool>, b: &Transform<Base, Tool>) -> (f64, f64) {
    let distance = (a.translation().as_vector() - b.translation().as_vector()).norm();
    let (ra, rb) = (a.rotation(), b.rotation());
    let (ra, rb) = (ra.as_matrix(), rb.as_matrix());
    // Not R_a^T R_b: its rounding is that of 1, not of the difference.
    let d = ra.transpose() * (rb - ra);
    let axis = Vector3::new(
        d[(2, 1)] - d[(1, 2)],
        d[(0, 2)] - d[(2, 0)],
        d[(1, 0)] - d[(0, 1)],
    ) * 0.5;
    let cosine = 1.0 + 0.5 * d.trace();
    (distance, axis.norm().atan2(cosine))
}

/// Joints between their stops, evenly.
fn in_limits(arm: &Arm, rng: &mut impl Rng) -> TableJoints {
    let limits = arm.limits();
    let mut q = limits.min();
    for (angle, hi) in q.iter_mut().zip(limits.max()) {
        *angle = rng.random_range(*angle..hi);
    }
    TableJoints::new(q).unwrap()
}

/// An arm no table lists.
fn odd_arm() -> Arm {
    Arm::new(Parameters {
        a1: 0.05,
        a2: 0.11,
        a3: 0.17,
        a4: -0.012,
        d1: 0.2,
        d5: 0.09,
        theta_offset: [0.3, 1.0, -0.2, 0.4, 0.1],
        ..Parameters::published()
    })
    .unwrap()
}
