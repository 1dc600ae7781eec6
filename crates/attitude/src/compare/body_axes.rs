//! Two tracks -> do they speak of the same body axes, and of the same direction? Pure.
//!
//! Apart from the errors because it explains them: an orientation that follows the motion faithfully
//! but in other axes, or as its own inverse, looks like a bad estimate until somebody asks. The rotation
//! over one second is the same rotation whatever the world; if its *angle* agrees and the rotation does
//! not, the axes differ. The turn between them is found by least squares (Wahba 1965) with the singular
//! value decomposition of Markley 1988.

use super::Stamped;
use super::matching::Track;
use super::relative::each_second;
use super::statistics::quantile;
use crate::frames::{Body, Dcm};
use crate::quaternion::Quaternion;
use nalgebra::{Matrix3, Vector3};

/// Rotations over 1 s smaller or larger than these say too little about an axis, rad.
const USABLE: std::ops::RangeInclusive<f64> = 0.03..=2.6;
/// Fewest rotations that are judged, and about how many are kept of a long recording.
const FEWEST: usize = 20;
const ENOUGH: usize = 20_000;
/// The second singular value must be this share of the first: motion about one axis leaves the turn
/// about it open.
const EXCITED: f64 = 0.02;
/// Errors over 1 s below this need no explanation, rad (2 degrees).
const SMALL: f64 = 0.035;
/// Other axes explain an error when they leave less than this share of it.
const EXPLAINED: f64 = 0.4;

/// Axes of a recorded orientation relative to those of the estimate.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BodyAxesFit {
    /// Rotations over 1 s that were judged.
    pub pairs: usize,
    /// Median size of those rotations, rad.
    pub median_turn: f64,
    /// Median error of the rotation over 1 s as recorded, rad.
    pub as_recorded: f64,
    /// Median difference of the mere angles: no choice of axes or direction goes below.
    pub angles_only: f64,
    /// C_re: from the estimate's body axes to the recorded ones, that fits best.
    pub turn: Quaternion<Body, Body>,
    /// Median error that is left with it, rad.
    pub turned: f64,
    /// Whether all this is for the recorded quaternion's inverse, which fits better.
    pub inverse: bool,
}

impl BodyAxesFit {
    /// Whether the two agree as they are recorded, or so nearly that nothing is to be explained.
    #[must_use]
    pub fn agrees(&self) -> bool {
        self.as_recorded < SMALL
    }

    /// Whether the recorded orientation is that of other body axes.
    #[must_use]
    pub fn are_others(&self) -> bool {
        !self.agrees() && !self.inverse && self.turned < EXPLAINED * self.as_recorded
    }

    /// Angle between the axes, rad.
    #[must_use]
    pub fn angle(&self) -> f64 {
        2.0 * self.turn.wxyz()[0].abs().min(1.0).acos()
    }
}

/// The best turn of the body axes, of the recorded orientation or of its inverse; `None` when too few
/// rotations are there, or all about one axis.
#[must_use]
pub fn fit_body_axes(estimate: &[Stamped], reference: &[Stamped]) -> Option<BodyAxesFit> {
    let inverse: Vec<Stamped> = reference
        .iter()
        .map(|(stamp, q)| (*stamp, Quaternion::assume_unit(q.inverse().wxyz())))
        .collect();
    let given = fit(&Track::new(estimate), &Track::new(reference))?;
    let inverted = fit(&Track::new(estimate), &Track::new(&inverse))?;
    // An inverse fits by chance only when nothing does.
    if inverted.turned < 0.5 * given.turned {
        return Some(BodyAxesFit {
            as_recorded: given.as_recorded,
            inverse: true,
            ..inverted
        });
    }
    Some(given)
}

/// A rotation over 1 s: of the reference, of the estimate.
type Pair = (Quaternion<Body, Body>, Quaternion<Body, Body>);

fn fit(estimate: &Track<'_>, reference: &Track<'_>) -> Option<BodyAxesFit> {
    let mut pairs: Vec<Pair> = Vec::new();
    let mut sum = Matrix3::zeros();
    let (stride, mut seen) = (reference.rows.len() / ENOUGH + 1, 0);
    each_second(estimate, reference, |truth, found| {
        seen += 1;
        let (r, e) = (axis_angle(&truth), axis_angle(&found));
        if seen % stride == 0 && USABLE.contains(&r.norm()) && USABLE.contains(&e.norm()) {
            sum += r * e.transpose();
            pairs.push((truth, found));
        }
    });
    if pairs.len() < FEWEST {
        return None;
    }
    let svd = sum.try_svd(true, true, f64::EPSILON, 1000)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut sizes: [f64; 3] = svd.singular_values.into();
    sizes.sort_by(f64::total_cmp);
    if sizes[1] < EXCITED * sizes[2] {
        return None;
    }
    // The smallest singular value takes the sign: a rotation, never a mirror.
    let smallest = svd.singular_values.imin();
    let mut signs = Vector3::from_element(1.0);
    signs[smallest] = (u.determinant() * v_t.determinant()).signum();
    let c = u * Matrix3::from_diagonal(&signs) * v_t;
    let turn: Quaternion<Body, Body> = Quaternion::from_dcm(&Dcm::assume(c)).normalised();
    let median = |error: &dyn Fn(&Pair) -> f64| {
        let mut errors: Vec<f64> = pairs.iter().map(error).collect();
        quantile(&mut errors, 0.5)
    };
    Some(BodyAxesFit {
        pairs: pairs.len(),
        median_turn: median(&|(truth, _)| axis_angle(truth).norm())?,
        as_recorded: median(&|(truth, found)| truth.angle_to(found))?,
        angles_only: median(&|(truth, found)| {
            (axis_angle(truth).norm() - axis_angle(found).norm()).abs()
        })?,
        turned: median(&|(truth, found)| truth.angle_to(&(turn * *found * turn.inverse())))?,
        turn,
        inverse: false,
    })
}

/// The rotation vector of the shorter way round.
fn axis_angle(q: &Quaternion<Body, Body>) -> Vector3<f64> {
    let shorter = q.same_sign_as(&Quaternion::identity());
    shorter.rotation_vector().0
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::frames::Nav;
    use crate::quaternion::RotationVector;
    use crate::record::Nanos;

    fn track(map: impl Fn(Quaternion<Nav, Body>) -> Quaternion<Nav, Body>) -> Vec<Stamped> {
        (0..400)
            .map(|i| {
                let t = 0.05 * i as f64;
                let phi = Vector3::new((0.9 * t).sin(), 0.7 * (1.7 * t).sin(), (0.4 * t).cos());
                let q_nb = Quaternion::from_rotation_vector(&RotationVector(phi));
                (Nanos(i * 50_000_000), map(q_nb))
            })
            .collect()
    }

    #[test]
    fn the_turn_between_two_bodies_is_found() {
        let c: Quaternion<Body, Body> = Quaternion::assume_unit([0.6, 0.0, 0.8, 0.0]);
        let fit = fit_body_axes(&track(|q| q), &track(|q| q * c.inverse())).unwrap();
        assert!(fit.turned < 1e-12 && fit.angles_only < 1e-12, "{fit:?}");
        assert!(fit.as_recorded > 0.3 && !fit.inverse, "{fit:?}");
        assert!(fit.turn.angle_to(&c) < 1e-12, "{fit:?}");
    }

    #[test]
    fn an_inverse_is_recognised() {
        let conjugate = |q: Quaternion<Nav, Body>| Quaternion::assume_unit(q.inverse().wxyz());
        let fit = fit_body_axes(&track(|q| q), &track(conjugate)).unwrap();
        assert!(fit.inverse && fit.turned < 1e-12, "{fit:?}");
        assert!(fit.as_recorded > 0.3, "{fit:?}");
    }

    #[test]
    fn the_same_axes_need_no_turn_and_one_axis_is_not_judged() {
        let fit = fit_body_axes(&track(|q| q), &track(|q| q)).unwrap();
        assert!(!fit.inverse && fit.as_recorded < 1e-12, "{fit:?}");
        assert!(fit.turn.angle_to(&Quaternion::identity()) < 1e-9);
        let about_z: Vec<Stamped> = (0..400)
            .map(|i| {
                let half = 0.01 * i as f64;
                let q = Quaternion::assume_unit([half.cos(), 0.0, 0.0, half.sin()]);
                (Nanos(i * 50_000_000), q)
            })
            .collect();
        assert!(fit_body_axes(&about_z, &about_z).is_none());
        assert!(fit_body_axes(&about_z[..15], &about_z[..15]).is_none());
    }
}
