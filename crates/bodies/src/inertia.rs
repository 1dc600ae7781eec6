//! Mass, centre of gravity, moments of inertia -> 6x6 mass matrices and the motion they cause. Pure.
//!
//! A stage of its own because every other model leans on it: the top takes its pivot inertia from
//! here, the arm its links, the payload its composite. A [`RigidBody`] can only hold values some
//! arrangement of matter could have; everything else stops at the constructor with its numbers.
//!
//! # Convention
//! - O (CO) is the origin of the body axes b, G (CG) the centre of gravity, `r_og_b` from O to G.
//! - Tensors are matrices: `[[Ixx, -Ixy, -Ixz], ...]` with `Ixy = +∫xy dm` (Fossen). URDF, MuJoCo and
//!   pinocchio store the matrix entry `ixy = -∫xy dm`; each habit has its own constructor.
//! - `nu = [v; w]`: velocity of O in m/s and body rate in rad/s, both in body axes.
//!   `tau = [f; n]`: force in N and moment about O in N m.
//!
//! Nothing here knows which way is down: "CG 0.3 m below" is `z = +0.3` only where z points down.
//!
//! # Source
//! Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control (2011), chapter 3. The seed
//! document's product of inertia, parallel axes and `C_RB` are wrong where `crates/bodies/tests/bodies/inertia.rs`
//! says so.

mod composite;
mod coriolis;
mod spatial;
mod validity;

pub use coriolis::{AddedMass, CoriolisForm};
pub use spatial::{
    Decomposition, mass_matrix_at_cg, mass_matrix_at_origin, rotated_mass_matrix, skew,
    system_transform,
};
pub use validity::InertiaError;
pub(crate) use validity::symmetric;

use nalgebra::{Matrix3, Matrix4, Vector3};

/// Products of inertia with the sign of mechanics: `xy = +∫xy dm`, kg m^2.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ProductsOfInertia {
    /// `+∫xy dm`
    pub xy: f64,
    /// `+∫yz dm`
    pub yz: f64,
    /// `+∫xz dm`
    pub xz: f64,
}

/// The six numbers of a URDF `<inertia>` element: entries of the matrix, `ixy = -∫xy dm`, kg m^2.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct TensorEntries {
    /// Entry (1,1).
    pub ixx: f64,
    /// Entry (1,2), that is `-∫xy dm`.
    pub ixy: f64,
    /// Entry (1,3), that is `-∫xz dm`.
    pub ixz: f64,
    /// Entry (2,2).
    pub iyy: f64,
    /// Entry (2,3), that is `-∫yz dm`.
    pub iyz: f64,
    /// Entry (3,3).
    pub izz: f64,
}

/// Mass properties some arrangement of matter could have: positive mass, symmetric positive
/// moments, no principal moment above the sum of the other two.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RigidBody {
    mass: f64,
    r_og_b: Vector3<f64>,
    inertia_cg: Matrix3<f64>,
}

impl RigidBody {
    /// Makes it from mass in kg, centre of gravity in m and the inertia tensor about it in kg m^2.
    ///
    /// # Errors
    /// [`InertiaError`] with the reason and its numbers. Asymmetry up to 1e-12 of the largest entry
    /// is taken for rounding and averaged away; a flat plate (`l1 + l2 = l3`) may miss by as much.
    pub fn new(
        mass: f64,
        r_og_b: Vector3<f64>,
        inertia_cg: Matrix3<f64>,
    ) -> Result<Self, InertiaError> {
        let inertia_cg = validity::physical(mass, &r_og_b, &inertia_cg)?;
        Ok(Self {
            mass,
            r_og_b,
            inertia_cg,
        })
    }

    /// Makes it from the tensor about the origin O instead of the centre of gravity.
    ///
    /// # Accuracy
    /// Loses `m r^2 / I_cg` of relative precision: a small body far out has no digits left.
    ///
    /// # Errors
    /// As [`RigidBody::new`].
    pub(crate) fn from_inertia_at_origin(
        mass: f64,
        r_og_b: Vector3<f64>,
        inertia_o: Matrix3<f64>,
    ) -> Result<Self, InertiaError> {
        Self::new(
            mass,
            r_og_b,
            inertia_o - spatial::parallel_axes(mass, &r_og_b),
        )
    }

    /// Makes it from moments `[Ixx, Iyy, Izz]` and products of inertia with the plus sign (`+∫xy dm`),
    /// about the centre of gravity.
    ///
    /// # Errors
    /// As [`RigidBody::new`].
    pub fn from_products_of_inertia(
        mass: f64,
        r_og_b: Vector3<f64>,
        moments: [f64; 3],
        products: ProductsOfInertia,
    ) -> Result<Self, InertiaError> {
        let [xx, yy, zz] = moments;
        let ProductsOfInertia { xy, yz, xz } = products;
        Self::new(
            mass,
            r_og_b,
            Matrix3::new(xx, -xy, -xz, -xy, yy, -yz, -xz, -yz, zz),
        )
    }

    /// Makes it from the entries of the tensor as URDF, MuJoCo and pinocchio store them (`ixy = -∫xy dm`),
    /// about the centre of gravity.
    ///
    /// # Errors
    /// As [`RigidBody::new`].
    pub fn from_tensor_entries(
        mass: f64,
        r_og_b: Vector3<f64>,
        entries: TensorEntries,
    ) -> Result<Self, InertiaError> {
        let e = entries;
        Self::new(
            mass,
            r_og_b,
            Matrix3::new(
                e.ixx, e.ixy, e.ixz, e.ixy, e.iyy, e.iyz, e.ixz, e.iyz, e.izz,
            ),
        )
    }

    /// A homogeneous cylinder whose axis is parallel to z: a disk when short, a rod when slender.
    ///
    /// # Errors
    /// As [`RigidBody::new`]: mass and at least the radius must be positive.
    pub fn cylinder_along_z(
        mass: f64,
        r_og_b: Vector3<f64>,
        radius: f64,
        length: f64,
    ) -> Result<Self, InertiaError> {
        validity::finite("radius", radius)?;
        validity::finite("length", length)?;
        let transverse = mass * (0.25 * radius * radius + length * length / 12.0);
        let axial = 0.5 * mass * radius * radius;
        Self::new(
            mass,
            r_og_b,
            Matrix3::from_diagonal(&Vector3::new(transverse, transverse, axial)),
        )
    }

    /// Mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Vector from O to the centre of gravity, m, body axes.
    #[must_use]
    pub fn r_og_b(&self) -> Vector3<f64> {
        self.r_og_b
    }

    /// Tensor about the centre of gravity, kg m^2, body axes.
    #[must_use]
    pub fn inertia_cg(&self) -> Matrix3<f64> {
        self.inertia_cg
    }

    /// Tensor about O: `I_cg + m S(r)^T S(r)`. The parallel axes theorem takes the distance between
    /// the two parallel *axes*, not between the two points (erratum I3).
    #[must_use]
    pub fn inertia_at_origin(&self) -> Matrix3<f64> {
        self.inertia_cg + spatial::parallel_axes(self.mass, &self.r_og_b)
    }

    /// Principal moments about the centre of gravity, ascending, kg m^2.
    #[must_use]
    pub fn principal_moments(&self) -> [f64; 3] {
        validity::principal_moments(&self.inertia_cg)
    }

    /// The 4x4 pseudo-inertia about O, `[Σ, m r; (m r)^T, m]` with `Σ = ∫ x x^T dm`: positive
    /// semidefinite exactly for physical bodies (Wensing, Kim, Slotine 2018, eq. 8).
    #[must_use]
    pub fn pseudo_inertia(&self) -> Matrix4<f64> {
        let inertia_o = self.inertia_at_origin();
        let second = Matrix3::identity() * (0.5 * inertia_o.trace()) - inertia_o;
        let first = self.r_og_b * self.mass;
        let mut p = Matrix4::zeros();
        p.fixed_view_mut::<3, 3>(0, 0).copy_from(&second);
        p.fixed_view_mut::<3, 1>(0, 3).copy_from(&first);
        p.fixed_view_mut::<1, 3>(3, 0).copy_from(&first.transpose());
        p[(3, 3)] = self.mass;
        p
    }

    /// The same matter described from another origin P: `r_op_b` leads from O to P.
    ///
    /// # Errors
    /// [`InertiaError::NotFinite`] when the shift is.
    pub fn seen_from(&self, r_op_b: Vector3<f64>) -> Result<Self, InertiaError> {
        Self::new(self.mass, self.r_og_b - r_op_b, self.inertia_cg)
    }

    /// The same matter resolved in other axes a: `c_ab` takes b components to a components.
    ///
    /// # Errors
    /// [`InertiaError::NotRotation`] when `c_ab` is not orthonormal and right-handed to 1e-9.
    pub fn resolved_in(&self, c_ab: &Matrix3<f64>) -> Result<Self, InertiaError> {
        validity::rotation(c_ab)?;
        let turned = c_ab * self.inertia_cg * c_ab.transpose();
        Self::new(
            self.mass,
            c_ab * self.r_og_b,
            0.5 * (turned + turned.transpose()),
        )
    }
}
