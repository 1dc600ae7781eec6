//! Attitudes of two bodies that a joint links -> the rotation of one relative to the other, and the joint's angle. Pure.
//!
//! A stage of its own because it asks for two sensors. Without a magnetometer each sensor has a heading of its own that
//! drifts, so their relative rotation about the vertical means nothing. A hinge closes that gap: its axis stands still
//! in both bodies, and only one heading offset makes it point the same way in both worlds ([`HingeFit`]).
//!
//! ```text
//! attitudes A, B -> pairs at the instants of A -> heading offset over time, hinge axes -> q_ab -> angle, sigma
//! ```

mod hinge;
mod pairs;
#[cfg(test)]
mod tests;

pub use hinge::{HingeFit, NoHinge};
pub use pairs::Segment;

use crate::diagnostic::Diagnostic;
use crate::frames::{Body, Nav};
use crate::quaternion::{Quaternion, RotationVector};
use crate::record::Nanos;
use nalgebra::{Matrix3, Vector3};
use pairs::{Pair, pairs};
use std::f64::consts::TAU;
use std::fmt;
use std::str::FromStr;

/// Source of the heading of one body relative to the other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RelativeHeading {
    /// The hinge where the motion shows one, else as recorded.
    Auto,
    /// The hinge.
    Hinge,
    /// Headings as recorded: both sensors know north, or share a reference.
    Recorded,
    /// Equal headings at the first common instant: a calibration pose, correct as long as neither sensor drifts.
    Start,
}

impl RelativeHeading {
    /// Every choice.
    pub const ALL: [RelativeHeading; 4] = [
        RelativeHeading::Auto,
        RelativeHeading::Hinge,
        RelativeHeading::Recorded,
        RelativeHeading::Start,
    ];

    /// Name of the choice.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            RelativeHeading::Auto => "auto",
            RelativeHeading::Hinge => "hinge",
            RelativeHeading::Recorded => "recorded",
            RelativeHeading::Start => "start",
        }
    }
}

impl FromStr for RelativeHeading {
    type Err = Diagnostic;

    /// # Errors
    /// [`Diagnostic`] for anything but the names of [`RelativeHeading::ALL`].
    fn from_str(text: &str) -> Result<RelativeHeading, Diagnostic> {
        let named = RelativeHeading::ALL.into_iter().find(|h| h.name() == text);
        named.ok_or_else(|| {
            let names = RelativeHeading::ALL.map(RelativeHeading::name).join(", ");
            Diagnostic::new("no such source of the heading").help(names)
        })
    }
}

impl fmt::Display for RelativeHeading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Rotation of the second body relative to the first at one instant. Angles in rad.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct JointAttitude {
    /// Stamp, of the first body's attitude.
    pub stamp: Nanos,
    /// Axes of the second body to axes of the first.
    pub q_ab: Quaternion<Body, Body>,
    /// Angle from the first instant on: about the hinge axis, signed and continuous over a full turn; without a hinge
    /// the angle of the rotation, 0..=pi.
    pub angle: f64,
    /// Angle of what is left beside the rotation about the hinge axis; 0 without a hinge.
    pub off_axis: f64,
    /// Standard deviation of `angle` by the covariances of both attitudes and of the heading offset; `None` where one
    /// of the two states no covariance.
    pub sigma: Option<f64>,
    /// Angle about the vertical that was added to the heading of the second body.
    pub heading_offset: f64,
}

/// Relative attitude of two bodies over their common time.
#[derive(Clone, PartialEq, Debug)]
pub struct Joint {
    /// Relative attitudes in order of time.
    pub rows: Vec<JointAttitude>,
    /// Source of the heading that was used: never [`RelativeHeading::Auto`].
    pub heading: RelativeHeading,
    /// The hinge, or the reason why the motion shows none.
    pub hinge: Result<HingeFit, NoHinge>,
    /// Instants of the first body without an attitude of the second: outside its time, or in a gap of it.
    pub unmatched: usize,
    /// Rows of either body that are no attitude.
    pub bad: usize,
}

/// Computes the attitude of the second body relative to the first at the instants of the first.
///
/// The second is interpolated between its neighbours on the great arc, as in [`compare`](crate::compare::compare).
/// Rows may come in any order. With nothing in common, `rows` is empty. Linear in the rows beside the sorting.
///
/// # Errors
/// [`NoHinge`]: a hinge is asked for and the motion shows none.
///
/// # Accuracy
/// Hinge with 2 degrees of play and 0.5 of error of tilt, two minutes of gait, headings that drift apart by 3.4 deg/min:
/// at most 1.3 deg rms of the angle and of the heading offset in five simulated runs; 4 and 1 degrees: 2.6 (`tests.rs`).
///
/// # Source
/// Heading offset by a joint's axis: Laidig, Schauer, Seel, "Exploiting kinematic constraints to compensate magnetic
/// disturbances when calculating joint angles of approximate hinge joints", ICORR 2017. There the axes come from the
/// rates (Seel, Raisch, Schauer 2014); here axes and offset are fitted together to the attitudes.
pub fn joint(
    first: Segment<'_>,
    second: Segment<'_>,
    heading: RelativeHeading,
) -> Result<Joint, NoHinge> {
    let matched = pairs(first, second);
    let hinge = HingeFit::of(&matched.pairs);
    let used = match (heading, &hinge) {
        (RelativeHeading::Hinge, Err(why)) => return Err(*why),
        (RelativeHeading::Auto, Err(_)) => RelativeHeading::Recorded,
        (RelativeHeading::Auto, Ok(_)) => RelativeHeading::Hinge,
        (asked, _) => asked,
    };
    let rows = match (used, &hinge) {
        (RelativeHeading::Hinge, Ok(hinge)) => about_hinge(&matched.pairs, hinge),
        (RelativeHeading::Start, _) => {
            let start = matched.pairs.first().map_or(0.0, Pair::heading_difference);
            about_any_axis(&matched.pairs, -start)
        }
        _ => about_any_axis(&matched.pairs, 0.0),
    };
    Ok(Joint {
        rows,
        heading: used,
        hinge,
        unmatched: matched.unmatched,
        bad: matched.bad,
    })
}

fn about_hinge(pairs: &[Pair], hinge: &HingeFit) -> Vec<JointAttitude> {
    let axis = hinge.axis_first;
    let (mut start, mut before) = (None, 0.0);
    let relative = pairs.iter().map(|pair| {
        let (offset, offset_sigma) = hinge.heading_offset_at(pair.stamp);
        let q_ab = pair.relative(offset);
        let since_start = q_ab * start.get_or_insert(q_ab).inverse();
        let [w, x, y, z] = since_start.wxyz();
        let about = Vector3::new(x, y, z).dot(&axis);
        let twist = 2.0 * about.atan2(w);
        // Continuous: the same angle a whole number of turns away that is nearest to the one before.
        let angle = twist + TAU * ((before - twist) / TAU).round();
        before = angle;
        JointAttitude {
            stamp: pair.stamp,
            q_ab,
            angle,
            off_axis: 2.0 * w.hypot(about).min(1.0).acos(),
            sigma: pair.covariances.map(|of| {
                let up = pair.vertical_in_first();
                let level = Matrix3::identity() - up * up.transpose();
                let p = level * of.in_first(&q_ab) * level;
                let heading = axis.dot(&up) * offset_sigma;
                (axis.dot(&(p * axis)) + heading * heading).max(0.0).sqrt()
            }),
            heading_offset: offset,
        }
    });
    relative.collect()
}

fn about_any_axis(pairs: &[Pair], offset: f64) -> Vec<JointAttitude> {
    let mut start = None;
    let relative = pairs.iter().map(|pair| {
        let q_ab = pair.relative(offset);
        let since_start = q_ab * start.get_or_insert(q_ab).inverse();
        let RotationVector(phi) = since_start.rotation_vector();
        let axis = phi.try_normalize(f64::MIN_POSITIVE);
        JointAttitude {
            stamp: pair.stamp,
            q_ab,
            angle: phi.norm(),
            off_axis: 0.0,
            sigma: pair.covariances.map(|of| {
                let p = of.in_first(&q_ab);
                // At the start there is no axis: the largest of the three.
                let variance = axis.map_or_else(|| p.diagonal().max(), |a| a.dot(&(p * a)));
                variance.max(0.0).sqrt()
            }),
            heading_offset: offset,
        }
    });
    relative.collect()
}

/// Rotation about the vertical of the navigation axes.
fn about_vertical(angle: f64) -> Quaternion<Nav, Nav> {
    let half = 0.5 * angle;
    Quaternion::assume_unit([half.cos(), 0.0, 0.0, half.sin()])
}
