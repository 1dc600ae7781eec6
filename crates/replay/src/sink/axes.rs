//! The attitude of a stream -> the same attitude in the axes of who reads it. Pure.
//!
//! Apart from the forms because several of them ask for the same: a vertical that is known, a body whose axes go with it,
//! and the three angles that people read. World and body change together (`strapd_attitude::worlds`).

use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::AttitudeSample;
use strapd_attitude::worlds::{Convention, World};

/// Convention of a world by its name. Of `start` and `level`, which name no direction on the ground, x counts as north:
/// z is up, and the body FLU.
pub(super) fn convention(world: &str) -> Convention {
    let named = world.parse::<World>().ok().and_then(World::convention);
    named.unwrap_or(Convention::NwuFlu)
}

/// Returns `[w, x, y, z]` of an attitude, FLU body to a world with x north, y west, z up; `None` of one that is no number.
pub(super) fn north_west_up(from: Convention, sample: &AttitudeSample) -> Option<[f64; 4]> {
    finite(from.convert(Convention::NwuFlu, sample.q_nb))
}

/// Returns `[w, x, y, z]` of an attitude, FRD body to NED; `None` of one that is no number.
pub(super) fn north_east_down(from: Convention, sample: &AttitudeSample) -> Option<[f64; 4]> {
    finite(from.convert(Convention::NedFrd, sample.q_nb))
}

fn finite<N, B>(q: Quaternion<N, B>) -> Option<[f64; 4]> {
    Some(q.wxyz()).filter(|q| q.iter().all(|c| c.is_finite()))
}

/// Returns `[x, y, z, w]` in Unity's axes (x right, y up, z forward, left-handed) of an attitude of [`north_west_up`].
///
/// A mirror changes the sign of every rotation: the axis (a, b, c) in FLU is (-b, c, a) there, and the angle negative.
pub(super) fn unity([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [y, -z, -x, w]
}

/// Roll, pitch, yaw in rad of the rotation Rz(yaw) Ry(pitch) Rx(roll), `q = [w, x, y, z]`.
///
/// # Accuracy
/// A few 1e-16 rad everywhere, gimbal lock included: pitch comes from an arctangent of sums, not
/// from an arcsine (which loses half the digits near 90 degrees). At pitch exactly +-90 degrees only
/// the sum (or difference) of roll and yaw is defined, and they share it.
///
/// # Source
/// Bernardes and Viollet, PLoS ONE 17 (2022), the half-angle form, derived here for ZYX: with half
/// angles, `w - y = (cos - sin)(pitch/2) cos((yaw + roll)/2)` and so on for `x + z`, `w + y`, `z - x`.
pub fn roll_pitch_yaw([w, x, y, z]: [f64; 4]) -> [f64; 3] {
    let half_sum = (x + z).atan2(w - y);
    let half_difference = (z - x).atan2(w + y);
    let pitch =
        2.0 * (w + y).hypot(z - x).atan2((w - y).hypot(x + z)) - std::f64::consts::FRAC_PI_2;
    [
        half_turn(half_sum - half_difference),
        pitch,
        half_turn(half_sum + half_difference),
    ]
}

/// Into (-pi, pi]; the argument lies in [-2 pi, 2 pi].
pub(super) fn half_turn(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if angle > PI {
        angle - TAU
    } else if angle <= -PI {
        angle + TAU
    } else {
        angle
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
pub(super) mod tests {
    use super::*;
    use crate::sink::tests::sample;
    use strapd_attitude::record::Nanos;

    /// An attitude that tells axes, signs and order apart: 30 degrees about x, then 50 about the body's y.
    pub(in crate::sink) fn telling() -> AttitudeSample {
        let [(sx, cx), (sy, cy)] = [15f64, 25.0].map(|half| half.to_radians().sin_cos());
        AttitudeSample {
            q_nb: Quaternion::assume_unit([cx * cy, sx * cy, cx * sy, sx * sy]),
            ..sample(Nanos(1_700_000_000_000_000_000))
        }
    }

    /// Rotates a vector by `[w, x, y, z]`, by the matrix written out.
    pub(in crate::sink) fn rotate([w, x, y, z]: [f64; 4], [a, b, c]: [f64; 3]) -> [f64; 3] {
        [
            (1.0 - 2.0 * (y * y + z * z)) * a
                + 2.0 * (x * y - w * z) * b
                + 2.0 * (x * z + w * y) * c,
            2.0 * (x * y + w * z) * a
                + (1.0 - 2.0 * (x * x + z * z)) * b
                + 2.0 * (y * z - w * x) * c,
            2.0 * (x * z - w * y) * a
                + 2.0 * (y * z + w * x) * b
                + (1.0 - 2.0 * (x * x + y * y)) * c,
        ]
    }

    pub(in crate::sink) fn close(one: &[f64], other: &[f64], within: f64) -> bool {
        one.len() == other.len() && one.iter().zip(other).all(|(a, b)| (a - b).abs() < within)
    }

    #[test]
    fn the_same_body_points_the_same_way_in_every_world() {
        let sample = telling();
        let up = north_west_up(convention("start"), &sample).unwrap();
        assert_eq!(up, sample.q_nb.wxyz());
        // The nose: FLU and FRD agree on it, the worlds on north, and neither on the rest.
        let [north, west, above] = rotate(up, [1.0, 0.0, 0.0]);
        let down = north_east_down(convention("level"), &sample).unwrap();
        assert!(close(
            &rotate(down, [1.0, 0.0, 0.0]),
            &[north, -west, -above],
            1e-14
        ));
        let enu = AttitudeSample {
            q_nb: Convention::NwuFlu.convert(Convention::EnuFlu, sample.q_nb),
            ..sample
        };
        let [east, second, third] = rotate(enu.q_nb.wxyz(), [1.0, 0.0, 0.0]);
        assert!(close(&[east, second, third], &[-west, north, above], 1e-14));
        let again = north_west_up(convention("enu"), &enu).unwrap();
        assert!(close(&again.map(|c| c * again[0].signum()), &up, 1e-14));
        let [roll, pitch, yaw] = roll_pitch_yaw(down);
        let [of_roll, of_pitch, of_yaw] = roll_pitch_yaw(up);
        assert!(close(
            &[roll, pitch, yaw],
            &[of_roll, -of_pitch, -of_yaw],
            1e-14
        ));
    }

    #[test]
    fn unity_sees_what_we_see_in_its_own_hands() {
        let up = telling().q_nb.wxyz();
        let [x, y, z, w] = unity(up);
        // A vector of FLU, or of north, west, up, as right, up, forward.
        let seen = |[a, b, c]: [f64; 3]| [-b, c, a];
        for v in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            // Unity multiplies quaternions by the same formula; its hands are in the axes alone.
            assert!(close(
                &rotate([w, x, y, z], seen(v)),
                &seen(rotate(up, v)),
                1e-14
            ));
        }
    }
}
