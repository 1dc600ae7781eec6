//! Fields with exact truth: every map, and irons of a board, on motions that show them and motions that do not.
#![allow(clippy::unwrap_used)]

use super::*;
use nalgebra::{Matrix3, Rotation3};

const HZ: f64 = 100.0;
/// East, north, up, in microtesla: 66 degrees below the horizon.
const FIELD: Vector3<f64> = Vector3::new(0.0, 20.0, -45.0);

/// Attitude of a body at a time, s.
type Motion = fn(f64) -> Rotation3<f64>;

/// Swings of 50, 40 and 120 degrees about three axes.
fn hand(t: f64) -> Rotation3<f64> {
    let size = [50.0_f64, 40.0, 120.0].map(f64::to_radians);
    let [r, p, y] =
        [(1.7, 0), (1.1, 1), (0.6, 2)].map(|(k, i): (f64, usize)| size[i] * (k * t).sin());
    Rotation3::from_euler_angles(r, p, y)
}

/// Every way round.
fn tumble(t: f64) -> Rotation3<f64> {
    Rotation3::from_euler_angles(
        0.9 * t + 0.4 * (1.3 * t).sin(),
        1.2 * (0.7 * t).sin() + 0.3 * t,
        1.3 * t + 0.5 * t.sin(),
    )
}

/// Turns of a vehicle that leans by a few degrees.
fn vehicle(t: f64) -> Rotation3<f64> {
    Rotation3::from_euler_angles(
        0.06 * (0.9 * t).sin(),
        0.04 * (1.3 * t).sin(),
        2.0 * (0.35 * t).sin(),
    )
}

/// Turns about the vertical alone.
fn table(t: f64) -> Rotation3<f64> {
    Rotation3::from_euler_angles(0.0, 0.0, 0.8 * t)
}

/// Uniform, of mean 0 and deviation 1, from a 64-bit linear congruence.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let product = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = product.wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 / 2_f64.powi(53) - 0.5) * 12_f64.sqrt()
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

/// A stream whose magnetometer reads `matrix field + iron`.
fn watched(
    motion: Motion,
    secs: usize,
    (matrix, iron): (&Matrix3<f64>, &Vector3<f64>),
    noise: f64,
) -> FieldConsistency {
    let mut random = Noise(3);
    let mut consistency = FieldConsistency::default();
    for n in 0..secs * HZ as usize {
        let t = n as f64 / HZ;
        let c = motion(t);
        let turned = motion(t - 1.0 / HZ).inverse() * c;
        let angle = turned.scaled_axis() + random.vector() * (0.1_f64.to_radians() / HZ);
        // A magnetometer of half the rate.
        let field = c.inverse() * FIELD;
        consistency.push(&FieldReading {
            stamp: Nanos((t * 1e9).round() as i64),
            gyro: Measured::Increment(DeltaAngle(angle)),
            field: (n % 2 == 0).then(|| matrix * field + iron + random.vector() * noise),
            force: Some(c.inverse() * Vector3::z() * 9.81),
        });
    }
    consistency
}

fn every_map() -> Vec<Matrix3<f64>> {
    super::super::bank::BANK
        .iter()
        .take(48)
        .map(|h| h.map)
        .collect()
}

#[test]
fn every_map_is_found_but_for_the_mirror_that_no_turning_shows() {
    let iron = Vector3::new(30.0, -25.0, 30.0);
    let mut table = Vec::new();
    for (name, motion) in [
        ("hand", hand as Motion),
        ("tumble", tumble),
        ("vehicle", vehicle),
    ] {
        let [mut right, mut wrong, mut silent] = [0; 3];
        for map in every_map() {
            let recorded = watched(motion, 60, (&map, &iron), 0.3);
            // The map that cures is the inverse of the fault, or its opposite.
            match recorded.disagreement() {
                None => silent += 1,
                Some(found) => {
                    let cured = found.map.matrix() * map;
                    let is = |m: Matrix3<f64>| (cured - m).abs().max() < 1e-9;
                    let sign = if is(Matrix3::identity()) { 1.0 } else { -1.0 };
                    let is_right = is(Matrix3::identity() * sign);
                    let dip = found.elevation.unwrap().to_degrees();
                    assert!((dip + 66.0 * sign).abs() < 3.0, "{name}: {dip}");
                    if is_right { right += 1 } else { wrong += 1 }
                }
            }
        }
        table.push((name, right, wrong, silent));
    }
    // Of the identity, and of its mirror, the turning says nothing.
    let expected = [("hand", 46, 0, 2), ("tumble", 46, 0, 2)];
    assert_eq!(table[..2], expected, "{table:?}");
    assert_eq!(table[2].2, 0, "{table:?}");
}

#[test]
fn rotation_about_one_axis_decides_no_map_and_no_iron() {
    for map in every_map() {
        let seen = watched(table, 60, (&map, &Vector3::zeros()), 0.3);
        assert_eq!(seen.disagreement(), None, "{map}");
        assert!(seen.iron().is_none_or(|iron| !iron.is_observed()), "{map}");
    }
    let board = Matrix3::identity() + board() * 0.12;
    let seen = watched(table, 120, (&board, &Vector3::new(30.0, -18.0, 12.0)), 0.3);
    assert!(
        seen.iron().is_none_or(|iron| !iron.is_observed()),
        "{:?}",
        seen.iron()
    );
}

/// Soft iron whose largest entry is 1, not symmetric: a magnetometer is mounted askew, too.
fn board() -> Matrix3<f64> {
    Matrix3::new(1.0, 0.42, -0.25, 0.35, -0.6, 0.33, -0.2, 0.4, -0.2)
}

#[test]
fn iron_of_a_board_comes_back_within_its_sigma() {
    let iron = Vector3::new(30.0, -18.0, 12.0);
    for (share, motion, noise) in [
        (0.0, tumble as Motion, 0.3),
        (0.03, tumble, 0.3),
        (0.12, tumble, 0.3),
        (0.12, tumble, 1.5),
        (0.12, hand, 0.3),
        (0.3, tumble, 0.3),
        (0.3, hand, 0.3),
    ] {
        let read = Matrix3::identity() + board() * share;
        let seen = watched(motion, 120, (&read, &iron), noise);
        let found = seen.iron().unwrap();
        let what = format!("{share} {noise}: {found:?}");
        let back = found.matrix * read;
        let off = back / (back.trace() / 3.0) - Matrix3::identity();
        assert!(
            off.abs().max() < 5.0 * found.matrix_sigma.max().max(5e-4),
            "{off} {what}"
        );
        assert!(
            (found.offset - iron).abs().max() < 5.0 * found.offset_sigma.max().max(0.05),
            "{what}"
        );
        assert!(found.is_observed(), "{what}");
        assert_eq!(found.has_soft_iron(), share > 0.05, "{what}");
    }
}

#[test]
fn a_long_recording_keeps_bounded_memory_and_its_answer() {
    let read = Matrix3::identity() + board() * 0.12;
    let seen = watched(tumble, 1200, (&read, &Vector3::zeros()), 0.3);
    assert!(seen.kept.len() <= KEPT && seen.stride > 0);
    assert!(seen.iron().unwrap().has_soft_iron());
}
