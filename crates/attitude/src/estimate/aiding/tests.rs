//! Classes of sensors, lists and shaken first samples -> settings of the filter and the first tilt.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::estimate::{Estimator, Patience, Preparation};
use crate::propagate::Sequential;
use crate::record::Declared;

fn told(name: &str) -> Settings {
    let class = NOISE_PRESETS.iter().find(|class| class.name == name);
    let mut settings = Settings::default();
    of_class(&mut settings, &Noise::preset(class.unwrap()));
    settings
}

/// Tilt of the first attitude of a body that turns about y and is shaken by `shaken` m/s^2, degrees off the truth.
fn first_tilt_error(rate: f64, shaken: f64) -> f64 {
    let samples: Vec<RawSample> = (0..300)
        .map(|k| {
            let t = f64::from(k) * 0.01;
            let (sin, cos) = (rate * t).sin_cos();
            // Eleven shakes a second, the first sample at the crest of one.
            let shake = shaken * (2.0 * std::f64::consts::PI * 11.0 * t).cos();
            let force = Vector3::new(-STANDARD_GRAVITY * sin, shake, STANDARD_GRAVITY * cos);
            RawSample {
                header: Some(Nanos(i64::from(k) * 10_000_000)),
                gyro: Some([0.0, rate, 0.0]),
                accel: Some(force.into()),
                ..RawSample::default()
            }
        })
        .collect();
    let plan = EstimationSettings {
        aid: Aid::Gravity,
        ..EstimationSettings::default()
    };
    let meaning = Meaning::new(&plan, &Declared::default());
    let mut preparation = Preparation::new(&plan, &meaning, Patience::WholeLog);
    for sample in &samples {
        preparation.take(sample).unwrap();
    }
    let prepared = preparation.decide().unwrap();
    let mut estimator = Estimator::new(&plan, &meaning, &prepared).unwrap();
    for sample in &samples {
        estimator.take(sample);
    }
    let out = estimator.finish(&Sequential);
    let up = out[0].q_nb.to_dcm().as_matrix().transpose() * Vector3::z();
    up.angle(&Vector3::z()).to_degrees()
}

#[test]
fn a_shaken_first_sample_does_not_level_a_file() {
    assert!(first_tilt_error(0.0, 0.0) < 1e-6);
    // By the first sample alone: 45 degrees.
    let shaken = first_tilt_error(0.0, 9.8);
    assert!(shaken < 5.0, "{shaken}");
    // Half a second at 90 deg/s is turned back: the mean of the readings would be 22 degrees off.
    let turning = first_tilt_error(1.57, 0.0);
    assert!(turning < 1.0, "{turning}");
}

#[test]
fn a_better_class_has_less_of_everything_that_sigma_is_made_of() {
    let classes = ["uncalibrated", "industrial", "tactical", "navigation"].map(told);
    for pair in classes.windows(2) {
        let [worse, better] = pair else { continue };
        for (name, number) in [
            ("white noise", (|s| s.gyro_noise) as fn(&Settings) -> f64),
            ("bias", |s| s.bias_prior),
            ("walk", |s| s.bias_walk),
            ("by tilt", |s| s.bias_by_tilt),
            ("rate", |s| s.rate_noise),
            ("force walk", |s| s.force_bias_walk),
            ("case", |s| s.case),
            ("delay", |s| s.delay),
        ] {
            let (worse, better) = (number(worse), number(better));
            // Industrial and tactical have the same white noise.
            assert!(
                better <= worse && better > 0.0,
                "{name}: {better} of {worse}"
            );
        }
    }
    let industrial = &classes[1];
    // 0.15 deg/sqrt(h), 0.05 to 0.1 deg between the axes, by the data sheet.
    assert!((industrial.gyro_noise - 4.36e-5).abs() < 1e-7);
    assert!((industrial.case - 1.5e-3).abs() < 1e-12);
}

#[test]
fn a_list_says_what_it_says_and_leaves_the_rest() {
    let silent = Noise {
        turn_on_bias: [0.0; 3],
        bias_instability: [0.0; 3],
        arw: [1e-3; 3],
        scale: 0.0,
        misalignment: 0.0,
        tilt: 0.0,
        delay: 0.0,
        ..EstimationSettings::default().noise
    };
    let mut settings = Settings::default();
    of_class(&mut settings, &silent);
    let expected = Settings {
        gyro_noise: 1e-3,
        ..Settings::default()
    };
    assert_eq!(settings, expected);
}
