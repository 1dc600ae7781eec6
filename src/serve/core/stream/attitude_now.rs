//! Uncertainty of the last attitude, and what it comes from -> `STATUS`. Pure.

use serde_json::{Value, json};
use strapd_attitude::aid::Filter;
use strapd_attitude::record::AttitudeSample;

/// Fields of what corrects an attitude now and how well it is known; null before there is one, and of a gyro alone,
/// whose world has no vertical.
pub(in crate::serve) fn attitude_now(
    filter: Option<&Filter>,
    last: Option<&AttitudeSample>,
) -> Value {
    let (Some(filter), Some(last)) = (filter, last) else {
        return Value::Null;
    };
    let is_aided = filter.is_started() && !filter.is_force_implausible();
    let by = match filter.has_field() {
        true => "gravity+mag",
        false => "gravity",
    };
    // About the axes of a world whose z is vertical.
    let p = last.covariance.in_navigation_axes(&last.q_nb);
    let (middle, half, between) = (0.5 * (p.m11 + p.m22), 0.5 * (p.m11 - p.m22), p.m12);
    let spread = half.hypot(between);
    let degrees = |variance: f64| variance.max(0.0).sqrt().to_degrees();
    json!({
        "aided": is_aided.then_some(by),
        "rest": filter.is_at_rest(),
        "sigma_deg": {
            "tilt": degrees(middle + spread),
            "tilt_least": degrees(middle - spread),
            // The horizontal axis about which it is tilted the most, from the world's x towards its y.
            "tilt_about": (0.5 * between.atan2(half)).to_degrees(),
            "heading": degrees(p.m33),
        },
        "field": filter.field().filter(|_| is_aided).map(|field| json!({
            "norm": field.norm, "dip_deg": field.dip.to_degrees(),
            "deviation_deg": field.deviation.to_degrees(),
        })),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use nalgebra::Vector3;
    use strapd_attitude::aid::{self, AidedPropagator, Start};
    use strapd_attitude::frames::In;
    use strapd_attitude::propagate;
    use strapd_attitude::quaternion::{BodyRate, Quaternion, RotationVector};
    use strapd_attitude::record::{AttitudeCovariance, Join, Measured, Nanos, RateSample, Status};

    #[test]
    fn an_ellipse_that_is_known_comes_back_whatever_the_body_faces() {
        let filter = {
            let (propagation, settings) =
                (propagate::Settings::default(), aid::Settings::default());
            let mut aided = AidedPropagator::new(propagation, settings, Start::Level).unwrap();
            let first = RateSample {
                stamp: Nanos(0),
                start: Nanos(0),
                gyro: Measured::Rate(BodyRate::ZERO),
                accel: Some(In::assume(Vector3::z() * 9.81)),
                join: Join::Start,
                status: Status::OK,
                log: Nanos(0),
            };
            aided.push(&[first], &mut Vec::new());
            aided.filter().clone()
        };
        // 3 degrees about an axis 30 degrees from x, 1 across it, 5 about the vertical.
        let (sin, cos) = 30_f64.to_radians().sin_cos();
        let (along, across) = (Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0));
        let squared = |v: Vector3<f64>, deg: f64| v * v.transpose() * deg.to_radians().powi(2);
        let earth = squared(along, 3.0) + squared(across, 1.0) + squared(Vector3::z(), 5.0);
        for turn in [[0.0, 0.0, 0.0], [0.3, -1.2, 2.0], [3.0, 0.1, -0.4]] {
            let q_nb = Quaternion::from_rotation_vector(&RotationVector(turn.into()));
            let r = *q_nb.to_dcm().as_matrix();
            let p = r.transpose() * earth * r;
            let upper = [p.m11, p.m12, p.m13, p.m22, p.m23, p.m33];
            let last = AttitudeSample {
                stamp: Nanos(0),
                q_nb,
                rate: BodyRate::ZERO,
                accel: None,
                linear_acceleration: None,
                covariance: AttitudeCovariance::from_upper(upper),
                status: Status::OK,
                reset_count: 0,
                log: Nanos(0),
                temperature: None,
            };
            let now = attitude_now(Some(&filter), Some(&last));
            assert_eq!(now["aided"], "gravity");
            for (name, deg) in [
                ("tilt", 3.0),
                ("tilt_least", 1.0),
                ("tilt_about", 30.0),
                ("heading", 5.0),
            ] {
                let found = now["sigma_deg"][name].as_f64().unwrap();
                assert!((found - deg).abs() < 1e-9, "{name} {found}");
            }
        }
        assert!(attitude_now(Some(&filter), None).is_null());
    }
}
