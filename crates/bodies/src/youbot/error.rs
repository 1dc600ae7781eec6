//! Why the arm cannot: what, where, by how much. Pure.

use super::Singularity;
use crate::inertia::InertiaError;
use std::fmt;
use strapd_attitude::frames::NotARotation;

/// Distance that the wrist would have from the shoulder, and the range it can have; m.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Reach {
    /// Wanted, for theta1 and for theta1 + pi.
    pub wanted: [f64; 2],
    /// `|a2 - a3|`.
    pub nearest: f64,
    /// `a2 + a3`.
    pub farthest: f64,
}

impl Reach {
    /// Excess on each side, m; zero where it reaches.
    #[must_use]
    pub fn excess(&self) -> [f64; 2] {
        self.wanted
            .map(|r| (r - self.farthest).max(self.nearest - r).max(0.0))
    }
}

/// Why a request to the arm has no answer.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum ArmError {
    /// NaN or infinity.
    NotFinite {
        /// Name of the number.
        what: &'static str,
    },
    /// Finite, but beyond anything that can be meant (and near overflow).
    TooLarge {
        /// Name of the number.
        what: &'static str,
        /// Value as given.
        value: f64,
        /// The largest taken.
        limit: f64,
    },
    /// Lengths, ranges or settings no arm of this kind can have.
    Impossible {
        /// Name of the number, and the condition it must meet.
        what: &'static str,
        /// Value as given.
        value: f64,
    },
    /// The target's rotation is none.
    NotARotation(NotARotation),
    /// Five joints cannot take this pose: it is off every plane through the base axis.
    OutOfPlane {
        /// Distance of the tool point from the plane, m, signed.
        position: f64,
        /// Angle of the approach out of the plane, rad, signed.
        angle: f64,
        /// Allowed distance, m.
        allowed_position: f64,
        /// Allowed angle, rad.
        allowed_angle: f64,
    },
    /// The wrist would have to be too far from the shoulder, or too near.
    OutOfReach(Reach),
    /// A joint would have to go past its stop.
    Limit {
        /// Joint, from 1.
        joint: usize,
        /// Angle wanted, rad, seed convention.
        value: f64,
        /// Lower stop, rad.
        min: f64,
        /// Upper stop, rad.
        max: f64,
    },
    /// Joint rates are not determined here.
    Singular(Singularity),
    /// A velocity of the gripper that five joints cannot make.
    InfeasibleTwist {
        /// Left over: the component along the one direction the arm lacks, m/s and rad/s mixed.
        defect: f64,
        /// Allowed.
        allowed: f64,
    },
    /// The path could be followed no further.
    Path {
        /// Time on the path, s.
        secs: f64,
        /// Why.
        why: Box<ArmError>,
    },
    /// Jump to another branch between two instants of a path.
    BranchChange {
        /// Joint that jumps most, from 1.
        joint: usize,
        /// Size of the jump, rad.
        jump: f64,
        /// Change that its rates account for, rad.
        expected: f64,
    },
    /// A link or payload is no physical body.
    Inertia(InertiaError),
}

impl ArmError {
    /// Kind of the error as one word, for machines.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            ArmError::NotFinite { .. } => "not-finite",
            ArmError::TooLarge { .. } => "too-large",
            ArmError::NotARotation(_) => "not-a-rotation",
            ArmError::OutOfPlane { .. } => "out-of-plane",
            ArmError::OutOfReach(_) => "out-of-reach",
            ArmError::Limit { .. } => "limit",
            ArmError::Singular(_) => "singular",
            ArmError::InfeasibleTwist { .. } => "infeasible-twist",
            ArmError::BranchChange { .. } => "branch-change",
            ArmError::Inertia(_) => "not-physical",
            ArmError::Path { why, .. } => why.code(),
            ArmError::Impossible { .. } => "impossible",
        }
    }
}

impl fmt::Display for ArmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { what } => write!(f, "{what} is not a finite number"),
            Self::TooLarge { what, value, limit } => {
                write!(f, "{what} is {value:e}, at most {limit:e} is taken")
            }
            Self::Impossible { what, value } => write!(f, "{what}, not {value}"),
            Self::NotARotation(why) => write!(f, "target orientation: {why}"),
            Self::OutOfPlane {
                position,
                angle,
                allowed_position,
                allowed_angle,
            } => write!(
                f,
                "no pose of a 5-joint arm: the tool point is {position:.3e} m and the approach {angle:.3e} rad \
                 off the arm's plane, allowed {allowed_position:.0e} m and {allowed_angle:.0e} rad; \
                 policy keep-position, keep-approach or weighted takes the nearest pose and states the residual"
            ),
            Self::OutOfReach(reach) => {
                let [a, b] = reach.excess();
                let [ra, rb] = reach.wanted;
                let (excess, wanted) = if a <= b { (a, ra) } else { (b, rb) };
                let side = if wanted > reach.farthest {
                    "too far"
                } else {
                    "too near"
                };
                write!(
                    f,
                    "out of reach: {side} by {excess:.6} m (wrist {wanted:.4} m from the shoulder, reach {:.3} to {:.3} m)",
                    reach.nearest, reach.farthest
                )
            }
            Self::Limit {
                joint,
                value,
                min,
                max,
            } => write!(
                f,
                "joint {joint} would be at {:.3} deg, its range is {:.1} to {:.1} deg (seed convention)",
                value.to_degrees(),
                min.to_degrees(),
                max.to_degrees()
            ),
            Self::Singular(which) => write!(f, "singular: {which}"),
            Self::InfeasibleTwist { defect, allowed } => write!(
                f,
                "five joints cannot make this velocity: {defect:.3e} of it is along the direction the arm \
                 lacks, allowed {allowed:.0e}"
            ),
            Self::Path { secs, why } => write!(f, "at {secs:.6} s of the path: {why}"),
            Self::BranchChange {
                joint,
                jump,
                expected,
            } => write!(
                f,
                "joint {joint} would jump by {jump:.3} rad where its rate accounts for {expected:.3} rad: \
                 the path leaves the branch it started on, or its steps are too long"
            ),
            Self::Inertia(why) => write!(f, "{why}"),
        }
    }
}

impl std::error::Error for ArmError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::NotARotation(why) => Some(why),
            Self::Path { why, .. } => Some(why),
            Self::Inertia(why) => Some(why),
            _ => None,
        }
    }
}

impl From<InertiaError> for ArmError {
    fn from(why: InertiaError) -> Self {
        Self::Inertia(why)
    }
}

/// The numbers, when every one is finite and at most `limit` in size.
pub(super) fn bounded<const N: usize>(
    what: &'static str,
    values: [f64; N],
    limit: f64,
) -> Result<[f64; N], ArmError> {
    for value in values {
        if !value.is_finite() {
            return Err(ArmError::NotFinite { what });
        }
        if value.abs() > limit {
            return Err(ArmError::TooLarge { what, value, limit });
        }
    }
    Ok(values)
}
