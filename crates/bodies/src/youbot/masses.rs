//! Published masses and inertias -> links of an arm. Pure.

use super::Arm;
use super::joints::JOINTS;
use crate::inertia::{InertiaError, RigidBody};
use nalgebra::{Matrix3, Vector3};

/// The five links as the URDF has them: 1.390, 1.318, 0.821, 0.769, 0.687 kg, 4.985 kg together. The
/// data sheet's 5.3 kg (erratum Y17) fits no published sum and is used nowhere.
///
/// # Convention
/// Origin and axes of each link are those of its link frame, so the numbers depend on the arm's `a4`
/// and `d5`. Without the gripper; see [`gripper`].
///
/// # Source
/// Numbers of mas-group/youbot_description, commit 65489aa, resolved in standard link frames. Every
/// tensor passes the triangle inequality (radii of gyration 10 to 66 mm). The older youbot-ros-pkg
/// has centres of mass in axes that are not its links' and is not used.
///
/// # Errors
/// None for an [`Arm`] of sane lengths: [`RigidBody::new`] is asked all the same.
pub fn published_links(arm: &Arm) -> Result<[RigidBody; JOINTS], InertiaError> {
    let p = arm.parameters();
    let link = |mass, [x, y, z]: [f64; 3], [xx, yy, zz]: [f64; 3]| {
        let tensor = Matrix3::from_diagonal(&Vector3::new(xx, yy, zz));
        RigidBody::new(mass, Vector3::new(x, y, z), tensor)
    };
    Ok([
        link(
            1.390,
            [-0.018_11, -0.016_87, -0.002_13],
            [2.952_5e-3, 5.882_1e-3, 6.009_1e-3],
        )?,
        link(
            1.318,
            [-0.069_03, -0.010_53, 0.030_70],
            [3.163_1e-3, 3.114_5e-3, 5.843e-4],
        )?,
        link(
            0.821,
            [-0.063_93, -0.000_10, -0.020_70],
            [1.846_8e-3, 1.727_67e-3, 4.196_7e-4],
        )?,
        link(
            0.769,
            [-0.000_11 - p.a4, 0.020_00, 0.050_19],
            [6.764e-4, 1.057_3e-3, 6.610e-4],
        )?,
        link(
            0.687,
            [0.0, -0.001_15, 0.113_17 - p.d5],
            [1.934e-4, 1.602e-4, 6.89e-5],
        )?,
    ])
}

/// The two-finger gripper in the tool frame of `arm`: palm 0.1 kg, fingers 0.01 kg each, homogeneous
/// boxes. Weld it to link 5 with [`RigidBody::with_payload`].
///
/// # Source
/// Masses of mas-group/youbot_description. Its tensors are placeholders of 0.01 kg m^2 (the fingers
/// would be rings of 1 m radius). The boxes here are this library's own estimate: palm 80 x 60 x 40 mm
/// ending 48 mm short of the finger tips, fingers 10 x 12 x 48 mm, 30 mm apart.
///
/// # Errors
/// None for an [`Arm`] of sane lengths.
pub fn gripper(arm: &Arm) -> Result<RigidBody, InertiaError> {
    // The finger tips are 88 mm beyond arm_link_5, whatever the arm takes for its tool point.
    let tips = 0.218 - arm.parameters().d5;
    let cuboid = |mass: f64, [x, y, z]: [f64; 3], [a, b, c]: [f64; 3]| {
        let third = mass / 12.0;
        let tensor = Matrix3::from_diagonal(&Vector3::new(
            third * (b * b + c * c),
            third * (a * a + c * c),
            third * (a * a + b * b),
        ));
        RigidBody::new(mass, Vector3::new(x, y, z), tensor)
    };
    let finger = |side: f64| {
        let at = [0.0, side * 0.015, tips - 0.024];
        cuboid(0.01, at, [0.010, 0.012, 0.048])
    };
    let palm = cuboid(0.1, [0.0, 0.0, tips - 0.068], [0.060, 0.080, 0.040])?;
    RigidBody::combined(&[palm, finger(1.0)?, finger(-1.0)?])
}
