//! Headings from outside: a vehicle whose gyro drifts and whose heading something else measures now and then.

use super::planar::Noise;
use crate::aid::{AidedPropagator, OutsideHeading, Settings, Start};
use crate::frames::In;
use crate::propagate::{self, Method};
use crate::quaternion::BodyRate;
use crate::record::{AttitudeSample, Join, Measured, Nanos, RateSample, Status};
use nalgebra::{Rotation3, Vector3};

const STEP_NANOS: i64 = 10_000_000;
/// Heading of the world outside at the start of the run, rad: the sensor's own is 0.
const OFF: f64 = 1.9;

/// Heading of the vehicle in its own world, rad: curves of 40 deg/s.
fn turned(secs: f64) -> f64 {
    1.4 * (0.5 * secs).sin() + 0.02 * secs
}

fn sample(k: i64, bias: Vector3<f64>, random: &mut Noise) -> RateSample {
    let secs = k as f64 * 0.01;
    let rate = 0.7 * (0.5 * secs).cos() + 0.02;
    let rate = Vector3::z() * rate + bias + random.vector() * 1e-3;
    let stamp = Nanos(k * STEP_NANOS);
    RateSample {
        stamp,
        start: stamp,
        gyro: Measured::Rate(BodyRate(rate)),
        accel: Some(In::assume(Vector3::z() * 9.80665 + random.vector() * 0.05)),
        join: if k == 0 {
            Join::Start
        } else {
            Join::Continuous
        },
        status: Status::OK,
        log: stamp,
    }
}

fn aided() -> AidedPropagator {
    let propagation = propagate::Settings {
        method: Method::COMMIT,
        ..propagate::Settings::default()
    };
    AidedPropagator::new(propagation, Settings::default(), Start::Level).unwrap()
}

fn wrapped(angle: f64) -> f64 {
    Rotation3::from_axis_angle(&Vector3::z_axis(), angle)
        .euler_angles()
        .2
}

/// Error (rad) of a measurement made at a time (s); `None` where none is made.
type Source<'a> = &'a dyn Fn(f64) -> Option<f64>;

struct Driven {
    out: Vec<AttitudeSample>,
    aided: AidedPropagator,
}

impl Driven {
    /// Heading that is told less the true one of the world outside, rad.
    fn off(&self, k: usize) -> f64 {
        let yaw = self.out[k].q_nb.yaw_pitch_roll().yaw;
        wrapped(yaw - turned(k as f64 * 0.01) - OFF)
    }

    /// One sigma of the heading, rad.
    fn sigma(&self, k: usize) -> f64 {
        let one = &self.out[k];
        one.covariance.in_navigation_axes(&one.q_nb).m33.sqrt()
    }
}

/// Drives for so many seconds with a gyro of this bias; a measurement of this sigma (rad), made once a second, comes
/// `late` samples after its stamp.
fn drive(secs: i64, bias: Vector3<f64>, sigma: f64, late: i64, source: Source<'_>) -> Driven {
    let mut random = Noise(5);
    let mut aided = aided();
    let mut out = Vec::new();
    for k in 0..100 * secs {
        let made = k - late;
        if made >= 0 && made % 100 == 37 {
            let at = made as f64 * 0.01;
            if let Some(error) = source(at) {
                let heading = turned(at) + OFF + error;
                let stamp = Some(Nanos(made * STEP_NANOS));
                aided.take_heading(stamp, OutsideHeading { heading, sigma });
            }
        }
        aided.push(&[sample(k, bias, &mut random)], &mut out);
    }
    aided.finish(&mut out);
    Driven { out, aided }
}

const BIAS: Vector3<f64> = Vector3::new(0.0, 0.0, 0.006);

/// White errors of one sigma of 3 degrees, from a sum of sines that no multiple of a second repeats.
fn white(at: f64) -> f64 {
    let mut random = Noise(at.to_bits());
    random.vector().x * 3_f64.to_radians()
}

#[test]
fn the_first_turns_the_world_and_the_others_hold_the_heading_and_tell_the_bias() {
    let sigma = 3_f64.to_radians();
    let alone = drive(300, BIAS, sigma, 0, &|_| None);
    let by = drive(300, BIAS, sigma, 40, &|at| Some(white(at)));
    // Alone it is off by the world's heading and 100 degrees of drift.
    let drifted = wrapped(alone.off(29_999) + OFF);
    assert!(drifted.abs() > 1.0, "{drifted}");
    let ks: Vec<usize> = (3_000..30_000).step_by(10).collect();
    let worst = ks.iter().map(|k| by.off(*k).abs()).fold(0.0, f64::max);
    assert!(worst.to_degrees() < 3.0, "{}", worst.to_degrees());
    let inside = ks
        .iter()
        .filter(|k| by.off(**k).abs() < 3.0 * by.sigma(**k))
        .count();
    assert!(
        inside as f64 > 0.99 * ks.len() as f64,
        "{inside} of {}",
        ks.len()
    );
    let sigma_at_end = by.sigma(29_999).to_degrees();
    assert!((0.3..3.0).contains(&sigma_at_end), "{sigma_at_end}");
    let bias = by.aided.filter().calibration().bias.z;
    let sigma = by.aided.filter().calibration_sigma().bias.z;
    assert!(
        (bias - BIAS.z).abs() < 3.0 * sigma && sigma < 2e-3,
        "{bias} {sigma}"
    );
    // One turn, said once. The first came before anything was remembered to compare it with.
    let resets = by
        .out
        .iter()
        .filter(|one| one.status.has(Status::RESET))
        .count();
    let counts = by.aided.outside_headings();
    assert_eq!(
        (resets, counts.turns, counts.doubted, counts.unpaired),
        (1, 1, 0, 1)
    );
    assert_eq!(counts.used, 299);
}

#[test]
fn a_measurement_is_compared_where_it_was_made_however_late_it_comes() {
    let sigma = 1_f64.to_radians();
    // Up to 2 seconds of curves of 40 deg/s: at its arrival each would be off by tens of degrees.
    for late in [1, 40, 200] {
        let by = drive(120, Vector3::zeros(), sigma, late, &|_| Some(0.0));
        let worst = (1_000..12_000).map(|k| by.off(k).abs()).fold(0.0, f64::max);
        assert!(worst.to_degrees() < 0.5, "{late}: {}", worst.to_degrees());
    }
    // Beyond what is remembered it is of no use, and counted.
    let by = drive(60, Vector3::zeros(), sigma, 400, &|_| Some(0.0));
    let counts = by.aided.outside_headings();
    assert_eq!((counts.used, counts.turns), (0, 0));
    assert!(counts.unpaired > 50, "{counts:?}");
}

#[test]
fn an_outlier_is_counted_and_a_source_that_was_right_for_ten_seconds_is_believed() {
    let sigma = 2_f64.to_radians();
    let spiky = drive(120, BIAS, sigma, 10, &|at| {
        Some(if (at as i64) % 9 == 5 { 1.0 } else { 0.0 })
    });
    let worst = (3_000..12_000)
        .map(|k| spiky.off(k).abs())
        .fold(0.0, f64::max);
    assert!(worst.to_degrees() < 1.0, "{}", worst.to_degrees());
    let counts = spiky.aided.outside_headings();
    assert_eq!((counts.turns, counts.doubted), (1, 13), "{counts:?}");
    // From 60 s on it says 60 degrees more.
    let other = drive(120, BIAS, sigma, 10, &|at| {
        Some(if at > 60.0 { 1.05 } else { 0.0 })
    });
    assert!(other.off(6_900).abs() < 0.05, "{}", other.off(6_900));
    assert!(
        (other.off(7_200) - 1.05).abs() < 0.05,
        "{}",
        other.off(7_200)
    );
    let counts = other.aided.outside_headings();
    assert_eq!((counts.turns, counts.doubted), (2, 10), "{counts:?}");
    // Who says something else every time is never believed.
    let wild = drive(120, BIAS, sigma, 10, &|at| {
        Some(if at > 60.0 {
            1.0 + 0.7 * (at as i64 % 5) as f64
        } else {
            0.0
        })
    });
    assert_eq!(wild.aided.outside_headings().turns, 1);
}

#[test]
fn a_reset_of_the_heading_lets_the_next_measurement_tell_it_again() {
    let mut random = Noise(5);
    let (mut aided, mut out) = (aided(), Vec::new());
    for k in 0..3_000 {
        if k == 1_500 {
            aided.turn_heading(-1.0);
        }
        if k % 100 == 37 {
            let heading = turned(k as f64 * 0.01) + OFF;
            aided.take_heading(
                None,
                OutsideHeading {
                    heading,
                    sigma: 0.02,
                },
            );
        }
        aided.push(&[sample(k, BIAS, &mut random)], &mut out);
    }
    let yaw = |k: usize| out[k].q_nb.yaw_pitch_roll().yaw;
    assert!((yaw(1_500) + 1.0).abs() < 1e-9);
    assert!(wrapped(yaw(1_538) - turned(15.38) - OFF).abs() < 0.02);
    assert_eq!(aided.outside_headings().turns, 2);
}

#[test]
fn one_that_goes_on_from_what_was_kept_gives_the_same_bits_and_nonsense_is_none() {
    let mut random = Noise(7);
    let (mut whole, mut out) = (aided(), Vec::new());
    let mut second = None;
    for k in 0..2_000 {
        let heading = OutsideHeading {
            heading: turned(k as f64 * 0.01),
            sigma: 0.05,
        };
        let stamp = Some(Nanos((k - 30) * STEP_NANOS));
        let next = sample(k, BIAS, &mut random);
        if k == 1_010 {
            let (propagation, memory) = whole.memory().unwrap();
            let mut other = aided();
            assert!(other.recall((&propagation, &memory)));
            second = Some((other, out.clone()));
        }
        for (one, all) in [(&mut whole, &mut out)]
            .into_iter()
            .chain(second.as_mut().map(|(a, b)| (a, b)))
        {
            if k % 50 == 31 {
                one.take_heading(stamp, heading);
            }
            one.push(std::slice::from_ref(&next), all);
        }
    }
    let (_, again) = second.unwrap();
    assert_eq!(out, again);
    let before = whole.outside_headings();
    for (heading, sigma) in [
        (f64::NAN, 0.1),
        (1.0, 0.0),
        (1.0, f64::NAN),
        (1.0, -1.0),
        (1e9, 0.1),
        (f64::INFINITY, 0.1),
    ] {
        whole.take_heading(None, OutsideHeading { heading, sigma });
    }
    assert_eq!(whole.outside_headings().unpaired, before.unpaired + 6);
}
