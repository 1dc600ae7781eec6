//! Bad input: too little, numbers that are none, an axis that is dead, clocks that jump.

use super::logs::{Motion, errors, log, smoothed};
use crate::frames::{Body, In};
use crate::quaternion::BodyRate;
use crate::record::Nanos;
use crate::smooth::{FieldUnit, Outcome, PriorScale, Sample, Settings, SmoothError, smooth};
use nalgebra::Vector3;

fn sample(i: i64) -> Sample {
    Sample {
        stamp: Nanos(i * 10_000_000),
        rate: BodyRate::ZERO,
        force: Some(In::assume(Vector3::z() * 9.81)),
        field: None,
        is_saturated: false,
    }
}

#[test]
fn too_few_samples_are_refused_and_three_are_smoothed() {
    for few in [vec![], vec![sample(0)], vec![sample(0), sample(0)]] {
        let refused = smooth(&mut few.as_slice(), &Settings::default());
        assert!(matches!(refused, Err(SmoothError::TooFew { .. })));
    }
    for count in 2..30 {
        let samples: Vec<Sample> = (0..count).map(sample).collect();
        let (_, estimates) = smoothed(&samples, &Settings::default());
        for estimate in estimates {
            assert!(
                estimate
                    .q_nb
                    .angle_to(&crate::quaternion::Quaternion::identity())
                    < 1e-6
            );
        }
    }
}

#[test]
fn a_log_without_forces_is_refused_with_the_reason() {
    let samples: Vec<Sample> = (0..1000)
        .map(|i| Sample {
            force: None,
            ..sample(i)
        })
        .collect();
    let refused = smooth(&mut samples.as_slice(), &Settings::default());
    assert_eq!(
        refused.unwrap_err(),
        SmoothError::TooFew {
            samples: 1000,
            forceless: 1000
        }
    );
}

#[test]
fn nothing_but_nan_is_refused_and_some_of_it_is_counted() {
    let nothing: Vec<Sample> = (0..1000)
        .map(|i| Sample {
            rate: BodyRate(Vector3::repeat(f64::NAN)),
            ..sample(i)
        })
        .collect();
    assert!(smooth(&mut nothing.as_slice(), &Settings::default()).is_err());

    let mut hand = log(Motion::Hand);
    hand.samples[0].rate.0.x = f64::INFINITY;
    hand.samples[2000].rate.0.y = f64::NAN;
    hand.samples[2500].force = Some(In::assume(Vector3::new(0.0, f64::NAN, 9.8)));
    hand.samples[2600].force = Some(In::assume(Vector3::repeat(1e30)));
    hand.samples[2700].field = Some(In::assume(Vector3::repeat(f64::NAN)));
    hand.samples[6000].rate.0.z = 1e9;
    let (smoothed, estimates) = hand.smoothed(&Settings::default());
    assert_eq!(smoothed.counts().rejected, 5);
    assert_eq!(smoothed.outcome(), Outcome::Converged);
    let filled: Vec<usize> = (0..6001).filter(|i| estimates[*i].is_filled).collect();
    assert_eq!(filled, [0, 2000, 2500, 2600, 6000]);
    let [tilt, _, tilt_most, heading_most] = errors(&estimates, &hand.truth, false);
    assert!(
        tilt < 0.1 && tilt_most < 0.3 && heading_most < 3.0,
        "{tilt} {tilt_most} {heading_most}"
    );
    for (estimate, sample) in estimates.iter().zip(&hand.samples) {
        assert_eq!(estimate.stamp, sample.stamp);
    }
}

/// Checks that what is stated is finite, and what is wrong is stated.
fn is_sane(samples: &[Sample]) {
    let (smoothed, estimates) = smoothed(samples, &Settings::default());
    for estimate in &estimates {
        let norm: f64 = estimate.q_nb.wxyz().iter().map(|c| c * c).sum();
        assert!((norm - 1.0).abs() < 1e-9, "{estimate:?}");
        assert!(
            (0..3)
                .all(|i| estimate.covariance[(i, i)] > 0.0
                    && estimate.covariance[(i, i)].is_finite())
        );
    }
    let calibration = smoothed.calibration();
    for learned in [calibration.gyro, calibration.force] {
        assert!(
            learned
                .value
                .iter()
                .chain(&learned.sigma)
                .all(|x| x.is_finite())
        );
    }
    if let Some(magnetometer) = calibration.magnetometer {
        assert!(magnetometer.hard_iron.value.iter().all(|x| x.is_finite()));
    }
}

#[test]
fn a_dead_axis_and_dead_sensors_give_finite_attitudes() {
    let without = |vector: In<Body>, axis: usize| {
        let mut numbers = *vector.as_vector();
        numbers[axis] = 0.0;
        In::assume(numbers)
    };
    for axis in 0..3 {
        for dead in 0..3 {
            let mut hand = log(Motion::Hand);
            for sample in &mut hand.samples {
                match dead {
                    0 => sample.rate.0[axis] = 0.0,
                    1 => sample.force = sample.force.map(|force| without(force, axis)),
                    _ => sample.field = sample.field.map(|field| without(field, axis)),
                }
            }
            is_sane(&hand.samples);
        }
    }
    let zeros: Vec<Sample> = (0..3000)
        .map(|i| Sample {
            force: Some(In::assume(Vector3::zeros())),
            field: Some(In::assume(Vector3::zeros())),
            ..sample(i)
        })
        .collect();
    is_sane(&zeros);
}

#[test]
fn clocks_that_jump_leave_breaks() {
    const DAY: i64 = 86_400_000_000_000;
    let hand = log(Motion::Hand);
    let mut jumped = hand.clone();
    for sample in &mut jumped.samples[3000..] {
        sample.stamp.0 += 400 * DAY;
    }
    let (smoothed, estimates) = jumped.smoothed(&Settings::default());
    assert_eq!(
        (smoothed.counts().breaks, smoothed.counts().rejected),
        (1, 0)
    );
    let [tilt, _, tilt_most, _] = errors(&estimates, &jumped.truth, false);
    assert!(tilt < 0.2 && tilt_most < 0.5, "{tilt} {tilt_most}");

    // One stamp alone is out of its time.
    let mut leapt = hand.clone();
    leapt.samples[3000].stamp.0 += 400 * DAY;
    leapt.samples[4000].stamp.0 -= 400 * DAY;
    let (smoothed, _) = leapt.smoothed(&Settings::default());
    assert_eq!(
        (smoothed.counts().breaks, smoothed.counts().rejected),
        (0, 2)
    );
    let mut first = hand.clone();
    first.samples[0].stamp.0 += 400 * DAY;
    assert_eq!(first.smoothed(&Settings::default()).0.counts().rejected, 1);

    // A log of breaks only.
    let apart: Vec<Sample> = (0..100)
        .map(|i| Sample {
            stamp: Nanos(i * i * 1_000_000_000),
            ..sample(i)
        })
        .collect();
    is_sane(&apart);
}

#[test]
fn minutes_at_rest_drift_by_nothing() {
    let samples: Vec<Sample> = (0..60_000)
        .map(|i| {
            // Noise of a sort: incommensurate waves.
            let t = i as f64;
            let noise = Vector3::new((1.1 * t).sin(), (2.3 * t).sin(), (3.7 * t).cos());
            Sample {
                rate: BodyRate(Vector3::new(0.02, -0.01, 0.03) + noise * 1e-3),
                force: Some(In::assume(Vector3::z() * 9.81 + noise * 0.02)),
                ..sample(i)
            }
        })
        .collect();
    let (smoothed, estimates) = smoothed(&samples, &Settings::default());
    assert_eq!(smoothed.outcome(), Outcome::Converged);
    let largest = estimates
        .iter()
        .map(|e| e.q_nb.angle_to(&estimates[0].q_nb))
        .fold(0.0, f64::max);
    assert!(largest.to_degrees() < 0.05, "{}", largest.to_degrees());
    assert!(
        !smoothed.calibration().gyro.is_observed(0)
            && !smoothed.calibration().force_bias.is_observed(0)
    );
    // Beside what is known of the bias at one node by itself.
    assert!(
        smoothed
            .biases()
            .all(|bias| (bias.value.x - 0.02).abs() < 3.0 * bias.sigma.x)
    );
}

#[test]
fn a_field_of_unknown_unit_gives_the_same_attitudes() {
    let hand = log(Motion::Hand);
    let mut gauss = hand.clone();
    gauss.samples.iter_mut().for_each(|sample| {
        sample.field = sample
            .field
            .map(|field| In::assume(field.as_vector() * 0.01))
    });
    let settings = Settings {
        field_unit: FieldUnit::Unknown,
        ..Settings::default()
    };
    let (smoothed, ours) = gauss.smoothed(&settings);
    let scale = smoothed.calibration().magnetometer.unwrap().scale;
    // The field is of 48.5 uT and hard iron, and is taken for 50.
    assert!((scale / 100.0 - 1.0).abs() < 0.1, "{scale}");
    let (_, theirs) = hand.smoothed(&Settings::default());
    let apart = ours
        .iter()
        .zip(&theirs)
        .map(|(a, b)| a.q_nb.angle_to(&b.q_nb))
        .fold(0.0, f64::max);
    // Sigmas of the field are of 3 % other sizes, and hard iron is hardly observed: that is degrees of heading.
    assert!(apart.to_degrees() < 0.3, "{}", apart.to_degrees());
}

#[test]
fn settings_that_can_not_be_are_refused() {
    let samples: Vec<Sample> = (0..100).map(sample).collect();
    for settings in [
        Settings {
            node_spacing: Some(f64::NAN),
            ..Settings::default()
        },
        Settings {
            looseness: PriorScale {
                axes: 0.0,
                ..PriorScale::default()
            },
            ..Settings::default()
        },
        Settings {
            sensor_delay: 10.0,
            ..Settings::default()
        },
        Settings {
            iterations: 0,
            ..Settings::default()
        },
    ] {
        let refused = smooth(&mut samples.as_slice(), &settings);
        assert!(matches!(refused, Err(SmoothError::Setting { .. })));
    }
}

#[test]
fn an_accelerometer_may_be_slower_than_the_gyro() {
    let mut hand = log(Motion::Hand).plain();
    for (i, sample) in hand.samples.iter_mut().enumerate() {
        if i % 4 != 1 {
            sample.force = None;
        }
    }
    let (smoothed, estimates) = hand.smoothed(&Settings::default());
    assert_eq!(smoothed.outcome(), Outcome::Converged);
    // All before the first force; those after the last are within a quarter of a second of it.
    assert_eq!(
        (smoothed.counts().forceless, smoothed.counts().rejected),
        (4501, 1)
    );
    let [tilt, heading, ..] = errors(&estimates, &hand.truth, true);
    assert!(tilt < 0.1 && heading < 0.3, "{tilt} {heading}");

    // Half a second without any is a break.
    hand.samples[3000..3050]
        .iter_mut()
        .for_each(|sample| sample.force = None);
    let (smoothed, _) = hand.smoothed(&Settings::default());
    assert_eq!(smoothed.counts().breaks, 1);
}

#[test]
fn calibrated_a_field_is_as_large_at_every_attitude_and_a_force_at_rest_is_gravity() {
    let log = log(Motion::Hand);
    let mut samples = log.samples.as_slice();
    let smoothed = smooth(&mut samples, &Settings::default()).unwrap();
    let sizes = smoothed.attitudes(&mut samples, |_| {}).unwrap();
    let spread = |values: Vec<f64>| {
        let of = |pick: fn(f64, f64) -> f64| values.iter().copied().reduce(pick).unwrap();
        of(f64::max) - of(f64::min)
    };
    let fields = |i: usize| sizes.iter().filter_map(move |found| Some(found.field?[i]));
    // Hard iron of 2.3 uT, of which a minute shows most.
    let spreads = [0, 1].map(|i| spread(fields(i).collect()));
    assert!(
        spreads[0] > 3.0 && spreads[1] < 0.4 * spreads[0],
        "{spreads:?}"
    );
    assert_eq!(fields(0).count(), sizes.len());
    // At rest for ten seconds at both ends, and calm at first; a bias of 0.04 m/s^2 about the vertical.
    let forces: Vec<[f64; 2]> = sizes.iter().filter_map(|found| found.force).collect();
    assert!(
        forces.len() >= 38 && forces.len() < sizes.len(),
        "{}",
        forces.len()
    );
    for [measured, calibrated] in forces {
        assert!((measured - 9.81).abs() > 0.01, "{measured}");
        assert!((calibrated - 9.81).abs() < 0.01, "{calibrated}");
    }
    let plain = log.plain();
    let smoothed = smooth(&mut plain.samples.as_slice(), &Settings::default()).unwrap();
    let sizes = smoothed.attitudes(&mut plain.samples.as_slice(), |_| {});
    assert!(sizes.unwrap().iter().all(|found| found.field.is_none()));
}
