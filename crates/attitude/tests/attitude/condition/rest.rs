//! Rests, bias and level from made-up bodies whose bias is known.

use super::{STEP, T0};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use strapd_attitude::condition::stillness::{
    BiasEstimate, Limits, NoRest, RESTS_KEPT, Rests, Stillness, accel_at_start, estimate_bias,
    level,
};
use strapd_attitude::frames::In;
use strapd_attitude::quaternion::{BodyRate, DeltaAngle};
use strapd_attitude::record::{Join, Measured, Nanos, RateSample, Status};

const BIAS: Vector3<f64> = Vector3::new(0.011, -0.007, 0.003);
const NOISE: f64 = 0.003;

/// Approximately normal: the sum of twelve uniforms less six (variance 1).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random_range(0.0..1.0)).sum::<f64>() - 6.0
}

/// A 200 Hz stream of a body that turns at `rate(t)` with gravity `force(t)` in body axes.
fn body(
    seed: u64,
    secs: f64,
    rate: impl Fn(f64) -> Vector3<f64>,
    force: impl Fn(f64) -> Vector3<f64>,
) -> Vec<RateSample> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..(secs * 200.0) as i64)
        .map(|n| {
            let t = n as f64 * 0.005;
            let stamp = Nanos(T0 + n * STEP);
            let noise = Vector3::from_fn(|_, _| NOISE * normal(&mut rng));
            let shake = Vector3::from_fn(|_, _| 0.03 * normal(&mut rng));
            RateSample {
                stamp,
                start: stamp,
                gyro: Measured::Rate(BodyRate(rate(t) + BIAS + noise)),
                accel: Some(In::assume(force(t) + shake)),
                join: if n == 0 {
                    Join::Start
                } else {
                    Join::Continuous
                },
                status: Status::OK,
                log: stamp,
            }
        })
        .collect()
}

const DOWNWARD: Vector3<f64> = Vector3::new(0.0, 0.0, 9.81);

fn still(_: f64) -> Vector3<f64> {
    Vector3::zeros()
}

fn upright(_: f64) -> Vector3<f64> {
    DOWNWARD
}

fn rests(samples: &[RateSample]) -> Rests {
    let mut stillness = Stillness::new(Limits::default());
    samples.iter().for_each(|s| stillness.push(s));
    stillness.finish()
}

fn bias(samples: &[RateSample]) -> Result<BiasEstimate, NoRest> {
    estimate_bias(&rests(samples), &Limits::default())
}

#[test]
fn the_bias_of_a_still_body_is_found_within_its_sigma() {
    let mut squares = 0.0;
    for seed in 0..100 {
        let found = bias(&body(seed, 10.0, still, upright)).unwrap();
        for axis in 0..3 {
            let sigmas = (found.bias.0[axis] - BIAS[axis]) / found.sigma[axis];
            assert!(sigmas.abs() < 5.0, "seed {seed}: {sigmas}");
            squares += sigmas * sigmas;
        }
        assert_eq!(found.rests, 1);
        // 0.003 rad/s over 2000 samples is 6.7e-5 rad/s.
        assert!(found.sigma.amax() < 1.6e-4);
    }
    // Mean of 300 squared normals would be 1 +- 0.08; taking the larger of two estimates of the
    // variance makes sigma conservative, never optimistic.
    let mean = squares / 300.0;
    assert!((0.4..1.2).contains(&mean), "{mean}");
}

#[test]
fn increments_give_the_same_bias_as_rates() {
    let rates = body(1, 10.0, still, upright);
    let mut stillness = Stillness::new(Limits::default());
    for s in &rates {
        stillness.push(&RateSample {
            start: Nanos(s.stamp.0 - STEP),
            gyro: Measured::Increment(DeltaAngle(s.gyro.as_vector() * 0.005)),
            ..*s
        });
    }
    let found = estimate_bias(&stillness.finish(), &Limits::default()).unwrap();
    let expected = bias(&rates).unwrap();
    assert!((found.bias.0 - expected.bias.0).norm() < 1e-15);
}

#[test]
fn a_body_that_moves_is_refused() {
    // Swinging, shaking, turning fast, turning slowly about a level axis, and a boat that heaves at the turn of its
    // swing.
    let swing = |t: f64| Vector3::new(0.2 * (6.0 * t).sin(), 0.0, 0.0);
    let shake = |t: f64| DOWNWARD + Vector3::new(0.0, 2.0 * (50.0 * t).sin(), 0.0);
    let spin = |_: f64| Vector3::new(0.0, 0.0, 0.5);
    let tilt = |_: f64| Vector3::new(0.04, 0.0, 0.0);
    let tilting = |t: f64| Rotation3::from_axis_angle(&Vector3::x_axis(), -0.04 * t) * DOWNWARD;
    let heave = |t: f64| DOWNWARD * (1.0 + 0.15 * (0.6 * t).sin());
    for (name, samples) in [
        ("heave", body(5, 2.4, still, heave)),
        ("swing", body(1, 10.0, swing, upright)),
        ("shake", body(2, 10.0, still, shake)),
        ("spin", body(3, 10.0, spin, upright)),
        ("tilt", body(4, 10.0, tilt, tilting)),
    ] {
        let error = bias(&samples).unwrap_err();
        assert!(matches!(error, NoRest::Moving { .. }), "{name}: {error}");
        assert!(error.to_string().contains("bias"), "{name}");
        let level = accel_at_start(&rests(&samples), &Limits::default());
        assert!(level.is_err(), "{name}");
    }
}

#[test]
fn a_slow_turn_among_rests_is_found_out() {
    // Still, then 40 s of 0.03 rad/s about the vertical (which no IMU can tell from a bias), then still.
    let turn = |t: f64| Vector3::new(0.0, 0.0, if (20.0..60.0).contains(&t) { 0.03 } else { 0.0 });
    let error = bias(&body(5, 80.0, turn, upright)).unwrap_err();
    assert!(matches!(error, NoRest::Disagree { .. }), "{error}");
}

#[test]
fn a_rest_ends_where_the_body_moves_and_begins_again_behind_it() {
    let bump = |t: f64| Vector3::new(0.0, if (5.0..6.0).contains(&t) { 1.0 } else { 0.0 }, 0.0);
    let samples = body(6, 12.0, bump, upright);
    let rests = rests(&samples);
    let times: Vec<(f64, f64)> = rests
        .kept
        .iter()
        .map(|r| {
            let first = samples[0].stamp;
            (r.start.secs_since(first), r.end.secs_since(first))
        })
        .collect();
    assert_eq!(times.len(), 2);
    // To within one window of half a second.
    assert!((4.5..5.0).contains(&times[0].1), "{times:?}");
    assert!((6.0..6.5).contains(&times[1].0), "{times:?}");
}

#[test]
fn a_gap_of_unknown_length_ends_a_rest() {
    let mut samples = body(7, 10.0, still, upright);
    samples[1000].join = Join::Hold;
    assert_eq!(rests(&samples).count, 2);
}

#[test]
fn a_level_wanted_at_the_start_is_refused_when_the_rest_comes_later() {
    let early = |t: f64| Vector3::new(if t < 0.4 { 1.0 } else { 0.0 }, 0.0, 0.0);
    let samples = body(8, 5.0, early, upright);
    let error = accel_at_start(&rests(&samples), &Limits::default()).unwrap_err();
    assert!(matches!(error, NoRest::NotAtStart { .. }));
    assert!(error.to_string().contains("start 0."), "{error}");
    let mut blind = body(9, 5.0, still, upright);
    blind.iter_mut().for_each(|s| s.accel = None);
    let error = accel_at_start(&rests(&blind), &Limits::default());
    assert_eq!(error, Err(NoRest::NoAccel));
    assert!(bias(&blind).is_ok(), "a bias needs no accelerometer");
}

#[test]
fn level_turns_the_felt_force_upright_and_keeps_yaw_zero() {
    // Two witnesses by hand: on its left side, and nose up, a quarter turn each.
    let h = std::f64::consts::FRAC_1_SQRT_2;
    let q = level(&In::assume(Vector3::new(0.0, 9.81, 0.0)))
        .unwrap()
        .wxyz();
    assert!((Vector3::new(q[1], q[2], q[3]) - Vector3::new(h, 0.0, 0.0)).norm() < 1e-15);
    let q = level(&In::assume(Vector3::new(9.81, 0.0, 0.0)))
        .unwrap()
        .wxyz();
    assert!((Vector3::new(q[1], q[2], q[3]) - Vector3::new(0.0, -h, 0.0)).norm() < 1e-15);
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    for _ in 0..1000 {
        let force = Vector3::from_fn(|_, _| rng.random_range(-12.0..12.0));
        let [w, x, y, z] = level(&In::assume(force)).unwrap().wxyz();
        let q = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
        assert!((q.norm() - 1.0).abs() < 1e-15);
        let up = q * force;
        // Rounding of a dozen operations on numbers of about 10.
        assert!(
            (up - Vector3::new(0.0, 0.0, force.norm())).norm() < 2e-14,
            "{force}"
        );
        assert!(q.euler_angles().2.abs() < 1e-9);
    }
    assert!(level(&In::assume(Vector3::zeros())).is_none());
    assert!(level(&In::assume(Vector3::new(f64::NAN, 0.0, 1.0))).is_none());
}

#[test]
fn the_list_of_rests_is_bounded_and_all_are_counted() {
    let shaken =
        |t: f64| Vector3::new(if t % 3.0 < 1.0 { (40.0 * t).sin() } else { 0.0 }, 0.0, 0.0);
    let rests = rests(&body(11, 3300.0, shaken, upright));
    assert_eq!(rests.kept.len(), RESTS_KEPT);
    assert!((1095..=1100).contains(&rests.count), "{}", rests.count);
}

#[test]
fn a_rest_in_which_a_motion_sets_in_tells_the_vertical_less_well_and_says_how_well() {
    let leaning =
        |lean: f64| move |t: f64| DOWNWARD + Vector3::x() * (9.81 * lean * (t - 2.25).max(0.0));
    let tilt = |lean: f64| {
        let found = rests(&body(5, 2.75, still, leaning(lean)));
        let rest = found.kept[0];
        let up = rest.mean_accel.unwrap();
        (up.as_vector().angle(&DOWNWARD), rest.tilt_sigma)
    };
    // 0.03 m/s^2 of white noise over 550 samples: 1.3e-4 rad by axis.
    let (off, sigma) = tilt(0.0);
    assert!(
        (3e-5..3e-4).contains(&sigma) && off < 4.0 * sigma,
        "{off} {sigma}"
    );
    // The mean of the last of six windows is off by 0.8 degrees, that of all by a sixth of it.
    let (off, sigma) = tilt(0.06);
    assert!(
        off > 2e-3 && off < 2.0 * sigma && sigma < 2.0 * off,
        "{off} {sigma}"
    );
}
