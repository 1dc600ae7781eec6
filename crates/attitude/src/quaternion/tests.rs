#![allow(clippy::unwrap_used, clippy::expect_used)]

use super::*;
use crate::frames::Nav;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

type Q = Quaternion<Nav, Body>;

/// An oracle in twice the precision: numbers as unevaluated sums of two f64, and the plain Taylor
/// series, which share neither formula nor rounding with the code under test.
mod oracle {
    #[derive(Clone, Copy)]
    pub(super) struct Double(f64, f64);

    impl Double {
        pub(super) fn of(a: f64) -> Double {
            Double(a, 0.0)
        }
        fn renormalised(a: f64, b: f64) -> Double {
            let s = a + b;
            Double(s, b - (s - a))
        }
        pub(super) fn add(self, other: Double) -> Double {
            let s = self.0 + other.0;
            let t = s - self.0;
            let e = (self.0 - (s - t)) + (other.0 - t);
            Double::renormalised(s, e + self.1 + other.1)
        }
        pub(super) fn mul(self, other: Double) -> Double {
            let p = self.0 * other.0;
            let e = self.0.mul_add(other.0, -p);
            Double::renormalised(p, e + self.0 * other.1 + self.1 * other.0)
        }
        fn over(self, n: f64) -> Double {
            let q = self.0 / n;
            let rest = (-q).mul_add(n, self.0) + self.1;
            Double::renormalised(q, rest / n)
        }
        /// `self - a`, rounded once.
        pub(super) fn minus(self, a: f64) -> f64 {
            let d = self.add(Double(-a, 0.0));
            d.0 + d.1
        }
    }

    /// `[cos(a/2) - 1, sin(a/2)/a phi]`, good to 1e-28 up to a = 7.
    pub(super) fn exp_minus_one(phi: [f64; 3]) -> [Double; 4] {
        let y = phi
            .map(|c| Double::of(c).mul(Double::of(c)))
            .into_iter()
            .fold(Double::of(0.0), Double::add)
            .mul(Double::of(-0.25));
        let (mut w, mut s) = (Double::of(0.0), Double::of(0.0));
        let (mut even, mut odd) = (Double::of(1.0), Double::of(0.5));
        for k in 0..40 {
            s = s.add(odd);
            let n = 2.0 * f64::from(k);
            even = even.mul(y).over((n + 1.0) * (n + 2.0));
            odd = odd.mul(y).over((n + 2.0) * (n + 3.0));
            w = w.add(even);
        }
        [
            w,
            s.mul(Double::of(phi[0])),
            s.mul(Double::of(phi[1])),
            s.mul(Double::of(phi[2])),
        ]
    }
}

fn axes() -> Vec<Vector3<f64>> {
    let mut axes = vec![Vector3::x(), -Vector3::y(), Vector3::z()];
    for (x, y, z) in [
        (1.0, 2.0, 3.0),
        (-0.3, 0.9, 0.1),
        (1e-9, 1.0, -1e-4),
        (5.0, -4.0, 0.2),
    ] {
        axes.push(Vector3::new(x, y, z).normalize());
    }
    axes
}

/// Angles on a logarithmic ladder, and crowded where formulas change: 0.5 rad and pi.
fn angles(max: f64) -> Vec<f64> {
    let mut angles: Vec<f64> = (-300..=8)
        .map(|k| 10f64.powf(f64::from(k) / 10.0))
        .collect();
    angles.extend((-300..0).step_by(7).map(|k| 10f64.powi(k)));
    angles.extend((0..400).map(|k| 0.45 + 0.1 * f64::from(k) / 400.0));
    angles.extend((1..=16).map(|k| PI - 10f64.powi(-k)));
    angles.extend((1..=16).map(|k| PI + 10f64.powi(-k)));
    angles.push(PI);
    angles.retain(|a| *a <= max);
    angles
}

/// Angle of the rotation between q and exp(phi), the latter in double precision twice over.
fn residual(q: [f64; 4], phi: &Vector3<f64>) -> f64 {
    let [ow, ox, oy, oz] = oracle::exp_minus_one([phi.x, phi.y, phi.z]);
    let one = oracle::Double::of(1.0);
    let [w, x, y, z] = q;
    let d = [ow.add(one).minus(w), ox.minus(x), oy.minus(y), oz.minus(z)];
    let product = Q::assume_unit([w, -x, -y, -z]) * Quaternion::<Body, Body>::assume_unit(d);
    let [_, x, y, z] = product.wxyz();
    2.0 * kernel::length(&Vector3::new(x, y, z))
}

#[test]
fn exp_minus_one_keeps_its_promise_from_1e_300_to_beyond_a_full_turn() {
    for axis in axes() {
        for a in angles(6.5) {
            let phi = axis * a;
            let got = exp_minus_one(&phi);
            let want = oracle::exp_minus_one([phi.x, phi.y, phi.z]);
            for (i, (got, want)) in got.iter().zip(want).enumerate() {
                let error = want.minus(*got).abs();
                // The documented bounds. 1e-290 is where squares and products turn subnormal.
                let bound = if a < 0.5 {
                    3e-16 * got.abs() * if i == 0 { 2.0 } else { 1.0 }
                } else {
                    2e-16 * (1.0 + a)
                };
                assert!(
                    error <= bound.max(1e-290),
                    "{i} at {a:e} about {axis}: {error:e}"
                );
            }
        }
    }
}

#[test]
fn exp_and_log_agree_with_twice_the_precision_at_zero_near_zero_and_up_to_pi() {
    let (mut worst_exp, mut worst_log) = (0.0f64, 0.0f64);
    for axis in axes() {
        for a in angles(PI) {
            let phi = axis * a;
            let q = Q::from_rotation_vector(&RotationVector(phi));
            worst_exp = worst_exp.max(residual(q.wxyz(), &phi) / 1e-15);
            let log = q.rotation_vector().0;
            // 4 ulp of the angle; the oracle's sign is that of w >= 0, as is the log's.
            worst_log = worst_log.max(
                residual(q.same_sign_as(&Q::identity()).wxyz(), &log) / (4.0 * f64::EPSILON * a),
            );
        }
    }
    assert!(worst_exp <= 1.0, "exp at {worst_exp} of its bound");
    assert!(worst_log <= 1.0, "log at {worst_log} of its bound");
}

#[test]
fn log_at_exactly_half_a_turn_keeps_the_axis() {
    for axis in axes() {
        let q = Q::assume_unit([0.0, axis.x, axis.y, axis.z]);
        // Two roundings of numbers below pi.
        assert!((q.rotation_vector().0 - axis * PI).amax() <= 1e-15);
    }
}

#[test]
fn log_of_the_identity_is_zero_and_of_both_signs_the_same() {
    assert_eq!(Q::identity().rotation_vector().0, Vector3::zeros());
    assert_eq!(
        Q::assume_unit([-1.0, 0.0, 0.0, 0.0])
            .rotation_vector()
            .0
            .norm(),
        0.0
    );
    let q = Q::assume_unit([0.5, 0.1, -0.7, 0.5]);
    let minus = Q::assume_unit(q.wxyz().map(|c| -c));
    assert_eq!(q.rotation_vector(), minus.rotation_vector());
}

#[test]
fn exp_of_nan_and_infinity_is_nan_and_never_a_wrong_rotation() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let [w, ..] = exp_minus_one(&Vector3::new(0.1, bad, 0.0));
        assert!(w.is_nan());
    }
    // Finite vectors whose square overflows are still turns.
    assert!(
        (kernel::norm(
            &Q::from_rotation_vector(&RotationVector(Vector3::new(1e200, -1e300, 3.0))).wxyz()
        ) - 1.0)
            .abs()
            < 1e-15
    );
}

#[test]
fn angle_between_is_right_to_the_last_digits_however_small() {
    let base = Q::assume_unit([0.3, -0.5, 0.1, 0.8]).normalised();
    for axis in axes() {
        for a in angles(PI) {
            let other = base.advanced(&RotationVector(axis * a));
            let angle = base.angle_to(&other);
            // The product is rounded at 1e-16 per component, the angle at 4 ulp.
            assert!((angle - a).abs() <= 2e-15, "{a:e}: {angle:e}");
            assert_eq!(
                angle,
                base.angle_to(&Q::assume_unit(other.wxyz().map(|c| -c)))
            );
        }
    }
    // One step of one component: the stored numbers differ by 2^-54, an arc cosine sees nothing.
    let nudged = Q::assume_unit([1.0, 2f64.powi(-54), 0.0, 0.0]);
    assert_eq!(Q::identity().angle_to(&nudged), 2f64.powi(-53));
    // The same far from the identity, where components of size 1 cancel: y changes by one step.
    let [w, x, y, z] = base.wxyz();
    let stepped = Q::assume_unit([w, x, y.next_up(), z]);
    let step = y.next_up() - y;
    // The step's part along q itself is norm, not rotation.
    let want = 2.0 * step * (1.0 - y * y).sqrt();
    assert!((base.angle_to(&stepped) / want - 1.0).abs() < 1e-12);
}

#[test]
fn matrices_of_half_turns_become_quaternions() {
    for (diagonal, want) in [
        ([1.0, -1.0, -1.0], [0.0, 1.0, 0.0, 0.0]),
        ([-1.0, 1.0, -1.0], [0.0, 0.0, 1.0, 0.0]),
        ([-1.0, -1.0, 1.0], [0.0, 0.0, 0.0, 1.0]),
        ([1.0, 1.0, 1.0], [1.0, 0.0, 0.0, 0.0]),
    ] {
        let c = Dcm::<Nav, Body>::assume(Matrix3::from_diagonal(&diagonal.into()));
        assert_eq!(Q::from_dcm(&c).wxyz(), want);
    }
}

#[test]
fn matrix_and_back_is_right_at_every_angle() {
    for axis in axes() {
        for a in angles(PI) {
            let q = Q::from_rotation_vector(&RotationVector(axis * a));
            // Entries good to 4e-16, divided by a component of at least 1/2 and doubled.
            let error = Q::from_dcm(&q.to_dcm()).angle_to(&q);
            assert!(error <= 1e-15, "{a} about {axis}: {error:e}");
        }
    }
}

#[test]
fn yaw_pitch_roll_put_together_again_gives_the_attitude_also_at_gimbal_lock() {
    let steps = |n: i32| (-n..=n).map(move |k| f64::from(k) / f64::from(n));
    let mut pitches: Vec<f64> = steps(12).map(|k| k * FRAC_PI_2).collect();
    pitches.extend((1..=16).map(|k| FRAC_PI_2 - 10f64.powi(-k)));
    pitches.extend((1..=16).map(|k| 10f64.powi(-k) - FRAC_PI_2));
    for pitch in pitches {
        for yaw in steps(6).map(|k| k * PI) {
            for roll in steps(6).map(|k| k * PI) {
                let q = Q::from_yaw_pitch_roll(&YawPitchRoll { yaw, pitch, roll });
                let angles = q.yaw_pitch_roll();
                let error = Q::from_yaw_pitch_roll(&angles).angle_to(&q);
                assert!(error <= 3e-15, "{yaw} {pitch} {roll}: {error:e}"); // documented
                assert!(angles.yaw.abs() <= PI && angles.roll.abs() <= PI);
                assert!(angles.pitch.abs() <= FRAC_PI_2);
            }
        }
    }
}

#[test]
fn at_gimbal_lock_roll_is_zero_and_yaw_carries_the_turn() {
    let h = FRAC_1_SQRT_2;
    let up = Q::assume_unit([h, 0.0, h, 0.0]);
    let angles = up.yaw_pitch_roll();
    assert_eq!(
        (angles.yaw, angles.pitch, angles.roll),
        (0.0, FRAC_PI_2, 0.0)
    );
    let down = Q::from_yaw_pitch_roll(&YawPitchRoll {
        yaw: 0.7,
        pitch: -FRAC_PI_2,
        roll: 0.4,
    });
    let angles = down.yaw_pitch_roll();
    assert_eq!(angles.roll, 0.0);
    // With the nose down only yaw + roll is left; one rounding of a half turn each way.
    assert!((angles.yaw - 1.1).abs() < 1e-15);
}

#[test]
fn slerp_turns_at_constant_rate_the_short_way() {
    let a = Q::assume_unit([0.3, -0.5, 0.1, 0.8]).normalised();
    let b = a.advanced(&RotationVector(Vector3::new(0.4, -1.1, 0.6)));
    let whole = a.angle_to(&b);
    let b_minus = Q::assume_unit(b.wxyz().map(|c| -c));
    for k in 0..=8 {
        let t = f64::from(k) / 8.0;
        // A few roundings of angles around 1 rad.
        assert!((a.angle_to(&a.slerp(&b, t)) - t * whole).abs() < 2e-15);
        assert!((a.angle_to(&a.slerp(&b_minus, t)) - t * whole).abs() < 2e-15);
    }
}

#[test]
fn numbers_that_are_no_attitude_are_refused() {
    for bad in [
        [0.0; 4],
        [0.07, 0.0, 0.0, 0.0],
        [195.7, 0.0, 0.0, 0.0],
        [f64::NAN, 0.0, 0.0, 1.0],
        [f64::INFINITY, 0.0, 0.0, 0.0],
        [1e200, 1e200, 0.0, 0.0],
    ] {
        assert!(Q::try_from_wxyz(bad).is_err(), "{bad:?}");
    }
    let q = Q::try_from_wxyz([1.1, 0.0, 0.0, -1.1]).unwrap();
    // Two roundings.
    assert!((kernel::norm(&q.wxyz()) - 1.0).abs() < 3e-16 && q.wxyz()[3] < 0.0);
}

#[test]
fn sign_follows_the_sample_before() {
    let q = Q::assume_unit([0.1, 0.7, -0.1, 0.7]).normalised();
    let minus = Q::assume_unit(q.wxyz().map(|c| -c));
    assert_eq!(minus.same_sign_as(&q), q);
    assert_eq!(q.same_sign_as(&q), q);
    assert_eq!(q.same_sign_as(&minus), minus);
}

#[test]
fn length_survives_where_squares_do_not() {
    for scale in [1e-300, 1e-160, 1.0, 1e160, 1e300] {
        let norm = kernel::length(&(Vector3::new(2.0, 3.0, 6.0) * scale));
        assert!((norm / (7.0 * scale) - 1.0).abs() < 1e-15);
    }
    assert_eq!(kernel::length(&Vector3::zeros()), 0.0);
    assert!(kernel::length(&Vector3::new(0.0, f64::NAN, 0.0)).is_nan());
}
