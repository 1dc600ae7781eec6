//! Motion of one frame relative to another -> relative to a third, resolved in a fourth. Pure.
//!
//! The document's appendix A: a velocity is *of* one frame, *relative to* another, *resolved in* a
//! third, and its components depend on all three. Here the first two are type parameters and the
//! third is the parameter of [`In`].

use super::Transform;
use nalgebra::Vector3;
use std::fmt;
use std::ops::Mul;
use strapd_attitude::frames::{Dcm, In, tag};

/// Motion of `Of` as an observer riding on `RelativeTo` sees it.
///
/// # Convention
/// Velocity is that of the origin of `Of`, its rate of change in `RelativeTo` axes; rate is that of
/// `Of` against `RelativeTo` (`w_ab` in the order relative-to, of). Both are kept resolved in
/// `RelativeTo`. An observer who turns sees what stands still move: composition holds the `w x r`.
///
/// # Units
/// m, m/s, rad/s.
pub struct RelativeMotion<RelativeTo, Of> {
    pose: Transform<RelativeTo, Of>,
    v: In<RelativeTo>,
    w: In<RelativeTo>,
}

// Written out, not derived: a derive would ask the tags for the same traits.
impl<A, B> Clone for RelativeMotion<A, B> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<A, B> Copy for RelativeMotion<A, B> {}
impl<A, B> PartialEq for RelativeMotion<A, B> {
    fn eq(&self, other: &Self) -> bool {
        self.pose == other.pose && self.v == other.v && self.w == other.w
    }
}
impl<A, B> fmt::Debug for RelativeMotion<A, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (a, b) = (tag::<A>(), tag::<B>());
        write!(
            f,
            "RelativeMotion<{a}, {b}>{{{:?}, v: {:?}, w: {:?}}}",
            self.pose, self.v, self.w
        )
    }
}

impl<A, B> RelativeMotion<A, B> {
    /// Makes it from the pose of B in A, the velocity of B's origin in m/s and the rate of B in rad/s, both
    /// relative to A and resolved in A.
    #[must_use]
    pub fn new(pose: Transform<A, B>, v: In<A>, w: In<A>) -> Self {
        Self { pose, v, w }
    }

    /// B stands still in A.
    #[must_use]
    pub fn at_rest(pose: Transform<A, B>) -> Self {
        Self::new(
            pose,
            In::assume(Vector3::zeros()),
            In::assume(Vector3::zeros()),
        )
    }

    /// Pose of B in A.
    #[must_use]
    pub fn pose(&self) -> Transform<A, B> {
        self.pose
    }

    /// Velocity of B relative to A, resolved in A, m/s.
    #[must_use]
    pub fn velocity(&self) -> In<A> {
        self.v
    }

    /// Angular rate of B relative to A, resolved in A, rad/s.
    #[must_use]
    pub fn rate(&self) -> In<A> {
        self.w
    }

    /// Velocity of B relative to A, resolved in any F, m/s.
    #[must_use]
    pub fn velocity_in<F>(&self, c_fa: Dcm<F, A>) -> In<F> {
        c_fa * self.v
    }

    /// Angular rate of B relative to A, resolved in any F, rad/s.
    #[must_use]
    pub(crate) fn rate_in<F>(&self, c_fa: Dcm<F, A>) -> In<F> {
        c_fa * self.w
    }

    /// Motion of A as seen from B. Not just the negative: B may rotate.
    #[must_use]
    pub fn inverse(&self) -> RelativeMotion<B, A> {
        let back = self.pose.inverse();
        let c_ba = back.rotation();
        let (v, w) = (self.v.as_vector(), self.w.as_vector());
        // r_ba = -C_ba r_ab; its derivative in B.
        let seen = w.cross(self.pose.translation().as_vector()) - v;
        RelativeMotion::new(back, c_ba * In::assume(seen), c_ba * In::assume(-w))
    }
}

impl<A, B, C> Mul<RelativeMotion<B, C>> for RelativeMotion<A, B> {
    type Output = RelativeMotion<A, C>;
    fn mul(self, right: RelativeMotion<B, C>) -> RelativeMotion<A, C> {
        let c_ab = self.pose.rotation();
        let arm = c_ab * right.pose.translation();
        let w = self.w.as_vector();
        let v = self.v.as_vector() + w.cross(arm.as_vector()) + (c_ab * right.v).as_vector();
        let w = w + (c_ab * right.w).as_vector();
        RelativeMotion::new(self.pose * right.pose, In::assume(v), In::assume(w))
    }
}
