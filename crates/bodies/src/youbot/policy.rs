//! A pose five joints cannot take -> which nearby pose is meant. Pure.

/// Part to keep of a target that is off every plane through the base axis. The residual is always
/// returned; poses in a plane are the same under every policy.
///
/// Of random poses in space none can be taken exactly: the reachable set has five dimensions.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Policy {
    /// Refuse unless position (m) and approach (rad) are in a plane to these tolerances. The plane is
    /// the one they are least off, each measured by its tolerance.
    Reject {
        /// Distance of the tool point from the plane, m.
        position: f64,
        /// Angle of the approach out of the plane, rad.
        angle: f64,
    },
    /// Keep the position; turn the gripper by the smallest angle that brings the approach into the plane.
    ///
    /// # Source
    /// The projection of Sharma et al. 2012.
    KeepPosition,
    /// Keep the orientation; move the tool point square to the arm's plane.
    KeepApproach,
    /// Minimise `(distance / length)^2 + sin^2(angle)`; both change.
    Weighted {
        /// The distance in m that counts as much as a radian; 0.3 is about the size of the arm.
        length: f64,
    },
}

impl Default for Policy {
    fn default() -> Self {
        Self::Reject {
            position: 1e-9,
            angle: 1e-9,
        }
    }
}
