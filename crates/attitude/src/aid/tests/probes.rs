//! Tests of the filter with a body at rest, with bad values, with other axes, through our own propagator.

use super::golden::{Run, angle_at_end, plain, run, sample};
use crate::aid::{AidedPropagator, Settings, Start};
use crate::frames::In;
use crate::propagate;
use crate::quaternion::BodyRate;
use crate::quaternion::Quaternion;
use crate::record::{AttitudeSample, Join, Measured, Nanos, RateSample, SampleKind, Status};
use nalgebra::{Rotation3, Vector3};
use std::f64::consts::{FRAC_PI_2, PI};

const BIAS: Vector3<f64> = Vector3::new(0.01, -0.008, 0.005);

#[test]
fn at_rest_the_bias_is_found_in_five_seconds() {
    let mut run = Run::new(Settings::default());
    for k in 0..=500 {
        let force = Some(Vector3::z() * 9.81);
        run.take(f64::from(k) * 0.01, BIAS, force, None);
    }
    let off = (run.filter.calibration().bias - BIAS).amax();
    // Found 2.3e-7 by another implementation, with a narrower prior.
    assert!(off < 1e-6, "{off}");
    assert!(run.filter.is_at_rest());
    let tilt = run.attitude().angle_to(&Quaternion::identity());
    assert!(tilt < 1e-3, "{tilt}");
}

#[test]
fn the_covariance_stays_one() {
    let (mut pivot, mut asymmetry) = (f64::INFINITY, 0.0_f64);
    for with_field in [false, true] {
        run(Settings::default(), with_field, |_, run| {
            pivot = pivot.min(run.filter.state.covariance.smallest_pivot());
            asymmetry = asymmetry.max(run.filter.state.covariance.asymmetry());
        });
    }
    // Found 6e-4 and 2e-14.
    assert!(pivot > 1e-5, "{pivot}");
    assert!(asymmetry < 1e-12, "{asymmetry}");
}

#[test]
fn a_covariance_with_an_impossible_number_is_noticed() {
    let mut run = run(Settings::default(), false, |_, _| ());
    run.filter.state.covariance.add(7, f64::NAN);
    for k in 2001..2020 {
        let (rate, force, _) = sample(k);
        run.take(k as f64 * 0.01, rate, Some(force), None);
    }
    assert!(run.filter.report().failures > 0);
    assert!(run.attitude().wxyz().iter().all(|c| c.is_finite()));
    assert!(run.filter.state.covariance.smallest_pivot() > 0.0);
}

/// Angle at the end between the golden run and one in which sample 777 was changed, degrees.
fn moved_by(change: impl Fn(&mut Run, f64, Vector3<f64>, Vector3<f64>)) -> f64 {
    let whole = run(plain(), false, |_, _| ());
    let mut changed = Run::new(plain());
    for k in 0..=2000 {
        let (rate, force, _) = sample(k);
        let t = k as f64 * 0.01;
        if k == 777 {
            change(&mut changed, t, rate, force);
        } else {
            changed.take(t, rate, Some(force), None);
        }
    }
    changed.attitude().angle_to(&whole.attitude()).to_degrees()
}

#[test]
fn one_lost_sample_or_force_is_hardly_felt() {
    let lost = moved_by(|_, _, _, _| ());
    // The same by an independent implementation.
    assert!((lost - 0.008_534_554).abs() < 1e-7, "{lost}");
    let without =
        |force: Vector3<f64>| moved_by(|run, t, rate, _| run.take(t, rate, Some(force), None));
    let nan = without(Vector3::repeat(f64::NAN));
    assert!(nan < 1e-3, "{nan}");
    let absent = moved_by(|run, t, rate, _| run.take(t, rate, None, None));
    for bad in [f64::INFINITY, 1e30, -2000.0] {
        // To the bit as if it were missing.
        assert_eq!(
            without(Vector3::new(0.0, bad, 9.8)).to_bits(),
            absent.to_bits()
        );
    }
    assert_eq!(nan.to_bits(), absent.to_bits());
}

#[test]
fn the_field_is_missing_where_it_is_none() {
    let end = |field: Option<Vector3<f64>>| {
        let mut changed = Run::new(plain());
        for k in 0..=2000 {
            let (rate, force, good) = sample(k);
            let field = if (700..800).contains(&k) {
                field
            } else {
                Some(good)
            };
            changed.take(k as f64 * 0.01, rate, Some(force), field);
        }
        changed.attitude()
    };
    let absent = end(None);
    for bad in [
        Vector3::zeros(),
        Vector3::repeat(f64::NAN),
        Vector3::repeat(1e7),
    ] {
        assert_eq!(end(Some(bad)), absent);
    }
    let whole = run(plain(), true, |_, _| ()).attitude();
    assert!(absent.angle_to(&whole) < 2e-3);
}

#[test]
fn another_mounting_turns_the_attitude_with_it() {
    // x' = y, y' = -x.
    let mounting = Rotation3::from_axis_angle(&Vector3::z_axis(), -FRAC_PI_2);
    let mut turned = Run::new(Settings::default());
    let mut upright = Run::new(Settings::default());
    let expected = Quaternion::assume_unit([(PI / 4.0).cos(), 0.0, 0.0, (PI / 4.0).sin()]);
    for k in 0..=2000 {
        let (rate, force, field) = sample(k);
        let t = k as f64 * 0.01;
        upright.take(t, rate, Some(force), Some(field));
        turned.take(
            t,
            mounting * rate,
            Some(mounting * force),
            Some(mounting * field),
        );
        let apart = turned.attitude().angle_to(&(upright.attitude() * expected));
        // Rounding of 2000 steps.
        assert!(apart < 1e-7, "sample {k}: {apart}");
    }
}

/// The golden motion as samples of a stream.
fn stream() -> Vec<RateSample> {
    (0..=2000)
        .map(|k: usize| {
            let (rate, force, _) = sample(k);
            let stamp = Nanos(k as i64 * 10_000_000);
            let before = Nanos(stamp.0 - 10_000_000);
            RateSample {
                stamp,
                start: before,
                gyro: Measured::Increment(BodyRate(rate).held_for(0.01)),
                accel: Some(In::assume(force)),
                join: if k == 0 {
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

fn aided(method: propagate::Method) -> AidedPropagator {
    let propagation = propagate::Settings {
        method,
        kind: SampleKind::Average,
        ..propagate::Settings::default()
    };
    AidedPropagator::new(propagation, plain(), Start::Level).unwrap()
}

#[test]
fn through_our_own_propagator_the_golden_case_is_as_good() {
    for method in [propagate::Method::Auto, propagate::Method::COMMIT] {
        let mut aided = aided(method);
        let mut out = Vec::new();
        aided.push(&stream(), &mut out);
        aided.finish(&mut out);
        assert_eq!(out.len(), 2001);
        let whole = run(plain(), false, |_, _| ());
        let apart = out[2000].q_nb.angle_to(&whole.attitude());
        // The golden figures' own propagator is of third order.
        assert!(apart < 1e-3, "{method:?} {apart}");
        let error = angle_at_end(&out[2000].q_nb);
        assert!((error - 0.55).abs() < 0.06, "{method:?} {error}");
    }
}

#[test]
fn how_a_stream_is_cut_changes_no_bit() {
    let mut samples = stream();
    // Whatever ends a run, and a stamp said twice.
    samples[703].join = Join::Hold;
    samples[1402].join = Join::Reset;
    samples[1000].join = Join::Bridge;
    samples[1101].stamp = samples[1100].stamp;
    let run = |method, lengths: &[usize]| {
        let mut aided = aided(method);
        let mut out: Vec<AttitudeSample> = Vec::new();
        let mut rest = samples.as_slice();
        for length in lengths.iter().cycle() {
            let (now, later) = rest.split_at((*length).min(rest.len()));
            aided.push(now, &mut out);
            rest = later;
            if rest.is_empty() {
                break;
            }
        }
        aided.finish(&mut out);
        out
    };
    for method in [propagate::Method::Auto, propagate::Method::COMMIT] {
        let whole = run(method, &[2001]);
        assert_eq!(run(method, &[1]), whole, "{method:?}");
        assert_eq!(run(method, &[7, 250, 1, 33]), whole, "{method:?}");
    }
}

#[test]
fn a_held_gap_is_seen_in_sigma_and_levelled_after() {
    let mut samples: Vec<RateSample> = stream();
    // Nothing for 3 s in motion, and on the other side of it the body lies otherwise.
    samples.retain(|s| !(1000..1300).contains(&(s.stamp.0 / 10_000_000)));
    samples[1000].join = Join::Hold;
    let mut aided = aided(propagate::Method::Auto);
    let mut out = Vec::new();
    aided.push(&samples, &mut out);
    aided.finish(&mut out);
    let sigma = |i: usize| out[i].covariance.sigma().amax();
    assert!(
        sigma(1000) > 20.0 * sigma(999),
        "{} {}",
        sigma(999),
        sigma(1000)
    );
    assert!(aided.filter().report().levelled > 0);
    // Tilt is back at the end; heading was lost, and is said to be.
    let last = out[out.len() - 1];
    let up = last.q_nb.to_dcm().as_matrix().transpose() * Vector3::z();
    let truth = run(plain(), false, |_, _| ()).attitude();
    let expected = truth.to_dcm().as_matrix().transpose() * Vector3::z();
    assert!(
        up.angle(&expected).to_degrees() < 3.0,
        "{}",
        up.angle(&expected).to_degrees()
    );
    assert!(sigma(out.len() - 1) > 0.5);
}

#[test]
fn a_rotated_world_does_not_become_bias() {
    // At rest for a minute on an Earth that turns a thousand times faster.
    let rate = Vector3::new(0.0, 0.02, 0.03);
    let propagation = propagate::Settings {
        world_rate: In::assume(rate),
        ..propagate::Settings::default()
    };
    let mut aided = AidedPropagator::new(propagation, Settings::default(), Start::Level).unwrap();
    let samples: Vec<RateSample> = stream()
        .iter()
        .map(|s| RateSample {
            gyro: Measured::Rate(BodyRate(rate)),
            accel: Some(In::assume(Vector3::z() * 9.81)),
            start: s.stamp,
            ..*s
        })
        .collect();
    let mut out = Vec::new();
    aided.push(&samples, &mut out);
    aided.finish(&mut out);
    let bias = aided.filter().calibration().bias.norm();
    assert!(bias < 1e-4, "{bias}");
    let turned = out[2000].q_nb.angle_to(&Quaternion::identity());
    assert!(turned < 1e-3, "{turned}");
}

#[test]
fn a_clock_that_is_set_back_is_a_gap_of_unknown_length() {
    let mut samples = stream();
    // An hour back, in the middle of it.
    for sample in &mut samples[1000..] {
        sample.stamp.0 -= 3_600_000_000_000;
        sample.start.0 -= 3_600_000_000_000;
    }
    samples[1000].join = Join::Hold;
    let mut aided = aided(propagate::Method::Auto);
    let mut out = Vec::new();
    aided.push(&samples, &mut out);
    aided.finish(&mut out);
    assert_eq!(out.len(), samples.len());
    assert_eq!(aided.filter().report().failures, 0);
    let sigma = aided.filter().calibration_sigma().bias;
    assert!(sigma.iter().all(|s| *s > 0.0 && *s < 8.7e-3), "{sigma}");
}

/// A filter that has had samples at 100 Hz for so long, with what a perfect gyro and accelerometer measure at each
/// time.
fn fed(
    settings: Settings,
    secs: i64,
    measured: impl Fn(f64) -> (Vector3<f64>, Vector3<f64>),
) -> AidedPropagator {
    let mut aided =
        AidedPropagator::new(propagate::Settings::default(), settings, Start::Level).unwrap();
    let mut out = Vec::new();
    for i in 0..100 * secs {
        let (rate, force) = measured(i as f64 * 0.01);
        let sample = RateSample {
            stamp: Nanos(i * 10_000_000),
            start: Nanos(i * 10_000_000),
            gyro: Measured::Rate(BodyRate(rate)),
            accel: Some(In::assume(force)),
            join: if i == 0 {
                Join::Start
            } else {
                Join::Continuous
            },
            status: Status::OK,
            log: Nanos(i * 10_000_000),
        };
        aided.push(&[sample], &mut out);
    }
    aided
}

/// A perfect gyro at rest for 10 s, then turned about the vertical, faster by two hundredths of a rad/s each second.
fn bias_after_a_slow_start(settings: Settings) -> f64 {
    let slow = |t: f64| {
        (
            Vector3::z() * 0.02 * (t - 10.0).max(0.0),
            Vector3::z() * 9.81,
        )
    };
    fed(settings, 13, slow).filter().calibration().bias.norm()
}

#[test]
fn a_motion_that_sets_in_slowly_is_no_bias() {
    let lagging = bias_after_a_slow_start(Settings::default());
    assert!(lagging < 2e-5, "{lagging}");
    let at_once = bias_after_a_slow_start(Settings {
        rest_lag: 0.0,
        rest_by_spell: false,
        ..Settings::default()
    });
    assert!(at_once > 1e-3, "{at_once}");
}

/// Largest sigma of the bias of a body that rested for 10 s and was then turned on its side within one.
fn bias_sigma_on_the_side(settings: Settings) -> f64 {
    let turned = |t: f64| {
        let rate = if t < 10.0 {
            0.0
        } else {
            std::f64::consts::FRAC_PI_2
        };
        let roll = std::f64::consts::FRAC_PI_2 * (t - 10.0).max(0.0);
        let force = Vector3::new(0.0, roll.sin(), roll.cos()) * 9.81;
        (Vector3::x() * rate, force)
    };
    fed(settings, 11, turned)
        .filter()
        .calibration_sigma()
        .bias
        .max()
}

#[test]
fn the_bias_of_one_side_is_not_wholly_that_of_another() {
    let none = Settings {
        bias_by_tilt: 0.0,
        ..Settings::default()
    };
    let some = Settings {
        bias_by_tilt: 1e-3,
        ..Settings::default()
    };
    let [without, with] = [none, some].map(bias_sigma_on_the_side);
    // Ten tenths of a second, in each of which the vertical moves by 0.157: 1e-3 * 0.157 * sqrt(10) beside what was known.
    let more = (with * with - without * without).sqrt();
    assert!((4e-4..6e-4).contains(&more), "{without} {with} {more}");
}

#[test]
fn a_push_stands_out_of_the_innovations() {
    let mut aided = aided(propagate::Method::Auto);
    aided.keep_innovations();
    let mut samples = stream();
    for sample in &mut samples[1500..1510] {
        sample.accel = sample
            .accel
            .map(|force| In::assume(force.as_vector() + Vector3::new(20.0, 20.0, 0.0)));
    }
    aided.push(&samples, &mut Vec::new());
    let kept = aided.innovations();
    assert_eq!(kept.len() as u64, aided.filter().report().updates);
    assert!(aided.innovations().is_empty());
    assert!(kept.is_sorted_by_key(|(stamp, _)| stamp.0));
    // Without a field there is none of heading.
    assert!(kept.iter().all(|(_, i)| i.heading.0.is_nan()));
    let largest = |from: i64, to: i64| {
        kept.iter()
            .filter(|(stamp, _)| (from..to).contains(&(stamp.0 / 10_000_000)))
            .flat_map(|(_, i)| i.gravity.map(|(left, _)| left.to_degrees()))
            .fold(0.0, |most: f64, i| most.max(i.abs()))
    };
    let (before, pushed) = (largest(500, 1500), largest(1500, 1520));
    // Found 12 degrees in the motion itself, and 180 where it is pushed by three times gravity.
    assert!(before < 20.0 && pushed > 5.0 * before, "{before} {pushed}");
}

#[test]
fn a_scale_that_its_class_has_not_is_noticed() {
    let rolling = |scale: f64| {
        move |t: f64| {
            let (roll, rate) = (3.0 * (0.4 * t).sin(), 1.2 * (0.4 * t).cos());
            let force = Vector3::new(0.0, roll.sin(), roll.cos()) * 9.81;
            (Vector3::x() * (rate * scale), force)
        }
    };
    for (scale, is_beyond) in [(1.0, false), (1.002, false), (1.03, true)] {
        let filter = fed(Settings::default(), 90, rolling(scale));
        let found = filter.filter().calibration().scale;
        assert_eq!(
            filter.filter().is_beyond_class(),
            is_beyond,
            "{scale}: {found}"
        );
    }
    // What was learned within the class was weighed by it; from then on it goes on farther (0.009 without).
    let found = fed(Settings::default(), 90, rolling(1.03));
    let scale = found.filter().calibration().scale.x;
    assert!(scale < -0.0125, "{scale}");
    let uncalibrated = Settings {
        scale_prior: 0.02,
        cross_prior: 0.02,
        ..Settings::default()
    };
    assert!(
        !fed(uncalibrated, 90, rolling(1.03))
            .filter()
            .is_beyond_class()
    );
}

/// A vehicle on a level road that pulls away and brakes at 3.8 m/s^2, shaken so that it never rests, whose
/// accelerometer reads 3.5 % short; from `turned_at` on it leans by 25 degrees, which its gyro has missed.
fn driven(turned_at: i32) -> Run {
    let mut run = Run::new(Settings::default());
    for k in 0..=11_500 {
        let t = f64::from(k) * 0.01;
        let ahead = match t % 30.0 {
            18.0..22.0 => 3.8,
            26.0..30.0 => -3.8,
            _ => 0.0,
        };
        let shaken = 0.3 * (170.0 * t).sin();
        let force = Vector3::new(ahead + shaken, 0.2 * (123.0 * t).sin(), 9.806_65 + shaken);
        let leans = if k >= turned_at {
            25_f64.to_radians()
        } else {
            0.0
        };
        let force = Rotation3::from_axis_angle(&Vector3::x_axis(), -leans) * force;
        let rate = Vector3::new(0.05 * (9.0 * t).sin(), 0.04 * (7.0 * t).cos(), 0.03);
        run.take(t, rate, Some(force * 0.965), None);
    }
    run
}

#[test]
fn a_vehicle_that_brakes_is_not_levelled_by_an_accelerometer_that_reads_short() {
    let run = driven(i32::MAX);
    assert_eq!(run.filter.report().levelled, 0);
    assert!(run.filter.report().restarts > 0, "it travels");
    let up = run.attitude().to_dcm().as_matrix().transpose() * Vector3::z();
    let tilt = up.angle(&Vector3::z()).to_degrees();
    assert!(tilt < 3.0, "{tilt}");
    // A tilt that is wrong is still found.
    let run = driven(6000);
    assert!(run.filter.report().levelled > 0);
    let up = run.attitude().to_dcm().as_matrix().transpose() * Vector3::z();
    let leans = up.angle(&Vector3::z()).to_degrees();
    assert!((leans - 25.0).abs() < 4.0, "{leans}");
}
