//! Joint motion, gravity, a force at the tool -> joint torques; mass matrix and energies. Pure.

use super::error::bounded;
use super::joints::{JOINTS, SeedTorques, TableJoints, TableMotion};
use super::recursion::Moving;
use super::{Arm, ArmError, Base, Tool};
use crate::inertia::RigidBody;
use nalgebra::{Matrix3, SMatrix, Vector3};
use strapd_attitude::frames::In;

/// Wrench of the tool on the world: force in N and moment about the tool point in N m, tool axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Wrench {
    force: In<Tool>,
    moment: In<Tool>,
}

impl Wrench {
    /// Force in N and moment about the tool point in N m that the tool exerts.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`]; [`ArmError::TooLarge`] beyond 1e9.
    pub fn new(force: In<Tool>, moment: In<Tool>) -> Result<Self, ArmError> {
        let (f, n) = (force.as_vector(), moment.as_vector());
        bounded(
            "force or moment at the tool",
            [f.x, f.y, f.z, n.x, n.y, n.z],
            1e9,
        )?;
        Ok(Self { force, moment })
    }
}

/// Energy of the arm, J; potential from the height of the base frame's origin.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Energy {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Potential energy in the field of gravity.
    pub potential: f64,
}

/// Torque that a motor and gear add to a joint: `I_a qdd + f_v qd + f_c sign(qd) + offset`.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Actuator {
    /// Rotor inertia seen through the gear, kg m^2.
    pub inertia: f64,
    /// Viscous friction, N m s.
    pub viscous: f64,
    /// Dry friction, N m; none at rest.
    pub coulomb: f64,
    /// Constant, N m.
    pub offset: f64,
}

impl Actuator {
    /// The motor's torque, at the joint, for a torque `tau` of the links.
    #[must_use]
    pub fn torque(&self, tau: f64, qd: f64, qdd: f64) -> f64 {
        let sign = if qd == 0.0 { 0.0 } else { qd.signum() };
        self.inertia * qdd + tau + self.viscous * qd + self.coulomb * sign + self.offset
    }
}

/// An arm with the masses of its links, under gravity.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Dynamics {
    arm: Arm,
    links: [Mass; JOINTS],
    g_b: Vector3<f64>,
}

/// One link's body, unpacked for the loops.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Mass {
    m: f64,
    /// Vectors from the link frame's origin to the centre of mass, and from the frame before; link axes.
    c: Vector3<f64>,
    from_joint: Vector3<f64>,
    inertia: Matrix3<f64>,
}

impl Dynamics {
    /// Makes it from an arm, its five links and gravity in m/s^2, base axes: (0, 0, -9.81) on a level floor.
    /// Each link's origin and axes are those of its link frame, its inertia about its centre of mass.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`]; [`ArmError::TooLarge`] beyond 1e6 kg, 1 km, 1e6 m/s^2.
    pub fn new(arm: Arm, links: [RigidBody; JOINTS], g_b: In<Base>) -> Result<Self, ArmError> {
        let g_b = *g_b.as_vector();
        bounded("gravity (m/s^2)", [g_b.x, g_b.y, g_b.z], 1e6)?;
        for link in &links {
            let r = link.r_og_b();
            bounded("mass of a link (kg)", [link.mass()], 1e6)?;
            bounded("centre of mass of a link (m)", [r.x, r.y, r.z], 1e3)?;
            bounded(
                "inertia of a link (kg m^2)",
                [link.inertia_cg().amax()],
                1e9,
            )?;
        }
        let mut joint = 0;
        let links = links.map(|body| {
            let reach = arm.links()[joint].reach();
            joint += 1;
            Mass {
                m: body.mass(),
                c: body.r_og_b(),
                from_joint: reach + body.r_og_b(),
                inertia: body.inertia_cg(),
            }
        });
        Ok(Self { arm, links, g_b })
    }

    /// The arm.
    #[must_use]
    pub fn arm(&self) -> &Arm {
        &self.arm
    }

    /// Joint torques for a motion: inertia, Coriolis, gravity (recursive Newton-Euler).
    ///
    /// # Accuracy
    /// 1e-13 N m at the arm's own rates; against pinocchio, see `tests/oracles/youbot_dynamics.py`.
    ///
    /// # Source
    /// Luh, Walker, Paul 1980; Craig, chapter 6. Tensors about the centre of mass, as the source document
    /// has them.
    #[must_use]
    pub fn torques(&self, motion: &TableMotion) -> SeedTorques {
        let zero = Vector3::zeros();
        self.newton_euler(motion, &zero, &zero)
    }

    /// Same as [`Dynamics::torques`], while the tool presses on the world.
    #[must_use]
    pub fn torques_with_tip(&self, motion: &TableMotion, tip: &Wrench) -> SeedTorques {
        self.newton_euler(motion, tip.force.as_vector(), tip.moment.as_vector())
    }

    /// Torques that hold the arm still.
    #[must_use]
    pub fn gravity_torques(&self, q: &TableJoints) -> SeedTorques {
        self.torques(&q.at_rest())
    }

    fn newton_euler(
        &self,
        motion: &TableMotion,
        force: &Vector3<f64>,
        moment: &Vector3<f64>,
    ) -> SeedTorques {
        let rotations = self.arm.rotations(motion.q());
        let (qd, qdd) = (motion.qd(), motion.qdd());
        let mut before = Moving::base(-self.g_b);
        let mut forces = [Vector3::zeros(); JOINTS];
        let mut moments = [Vector3::zeros(); JOINTS];
        for (joint, link) in self.links.iter().enumerate() {
            before = self
                .arm
                .step(joint, &rotations[joint], &before, qd[joint], qdd[joint]);
            (forces[joint], moments[joint]) = link.wrench(&before);
        }
        SeedTorques(self.backward(&rotations, &forces, &moments, force, moment))
    }

    /// Backward recursion from the tool inwards: the wrench that each joint passes on.
    fn backward(
        &self,
        rotations: &[Matrix3<f64>; JOINTS],
        forces: &[Vector3<f64>; JOINTS],
        moments: &[Vector3<f64>; JOINTS],
        force: &Vector3<f64>,
        moment: &Vector3<f64>,
    ) -> [f64; JOINTS] {
        let mut tau = [0.0; JOINTS];
        // Resolved in the link's own axes, about its own origin.
        let (mut f, mut n) = (*force, *moment);
        for joint in (0..JOINTS).rev() {
            let link = &self.arm.links()[joint];
            n += link.reach().cross(&f) + moments[joint];
            f += forces[joint];
            tau[joint] = n.dot(&link.axis());
            let r = &rotations[joint];
            (f, n) = (r * f, r * n);
        }
        tau
    }

    /// The mass matrix, kg m^2: symmetric to the bit, positive definite.
    /// Column j holds the torques of unit acceleration of joint j alone, without gravity.
    #[must_use]
    pub fn mass_matrix(&self, q: &TableJoints) -> SMatrix<f64, JOINTS, JOINTS> {
        let rotations = self.arm.rotations(q);
        let mut m = SMatrix::zeros();
        let zero = Vector3::zeros();
        for column in 0..JOINTS {
            // What lies before joint `column` stands still.
            let mut before = Moving::base(zero);
            let mut forces = [zero; JOINTS];
            let mut moments = [zero; JOINTS];
            for joint in column..JOINTS {
                let qdd = if joint == column { 1.0 } else { 0.0 };
                before = self.arm.step(joint, &rotations[joint], &before, 0.0, qdd);
                (forces[joint], moments[joint]) = self.links[joint].wrench(&before);
            }
            let tau = self.backward(&rotations, &forces, &moments, &zero, &zero);
            for (row, t) in tau.into_iter().enumerate().take(column + 1) {
                m[(row, column)] = t;
                m[(column, row)] = t;
            }
        }
        m
    }

    /// Kinetic and potential energy.
    #[must_use]
    pub fn energy(&self, motion: &TableMotion) -> Energy {
        let poses = self.arm.link_poses(motion.q());
        let motions = self.arm.link_motions(motion);
        let mut energy = Energy {
            kinetic: 0.0,
            potential: 0.0,
        };
        for ((mass, pose), moving) in self.links.iter().zip(poses).zip(motions) {
            let w = moving.rate.as_vector();
            let v = moving.velocity.as_vector() + w.cross(&mass.c);
            energy.kinetic += 0.5 * (mass.m * v.norm_squared() + w.dot(&(mass.inertia * w)));
            let height = pose.point(In::assume(mass.c));
            energy.potential -= mass.m * self.g_b.dot(height.as_vector());
        }
        energy
    }
}

impl Mass {
    /// Force the link needs, and its moment about the frame before; link axes.
    #[inline]
    fn wrench(&self, link: &Moving) -> (Vector3<f64>, Vector3<f64>) {
        let (w, wd) = (&link.w, &link.wd);
        let a = link.a + wd.cross(&self.c) + w.cross(&w.cross(&self.c));
        let force = a * self.m;
        let spin = self.inertia * wd + w.cross(&(self.inertia * w));
        (force, self.from_joint.cross(&force) + spin)
    }
}
