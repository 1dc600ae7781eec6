//! A class that the sensor may be of instead: what it adds where nothing tells it, and where motion does.

use super::golden::{Run, sample};
use crate::aid::{OtherClass, Settings};
use crate::open_class::share_of_variance;
use nalgebra::{Matrix3, Vector3};

const OTHER: OtherClass = OtherClass {
    scale_prior: 0.01,
    cross_prior: 0.0175,
    force_bias_prior: 0.2,
};

/// Variances of tilt, rad^2, of a run in a level attitude.
fn tilt(run: &Run) -> [f64; 2] {
    let covariance = run
        .filter
        .attitude_covariance(&Matrix3::identity(), &Vector3::zeros());
    let upper = covariance.upper();
    [upper[0], upper[3]]
}

fn at_rest(other: Option<OtherClass>) -> Run {
    let mut run = Run::new(Settings::default());
    if let Some(other) = other {
        run.filter.may_be_of(other);
    }
    for k in 0..3000 {
        let force = Vector3::z() * 9.81;
        run.take(f64::from(k) * 0.01, Vector3::zeros(), Some(force), None);
    }
    run
}

#[test]
fn at_rest_the_tilt_is_as_unsure_as_the_accelerometer_of_either_class() {
    let alone = tilt(&at_rest(None));
    let run = at_rest(Some(OTHER));
    let (both, probability) = (tilt(&run), run.filter.other_class_probability());
    // Half a minute of rest tells next to nothing of either.
    assert!((0.4..0.6).contains(&probability), "{probability}");
    let own = Settings::default().force_bias_prior;
    let more = share_of_variance(probability) * (0.04 - own * own) / (9.81 * 9.81);
    for (both, alone) in both.into_iter().zip(alone) {
        let share = (both - alone) / more;
        assert!((share - 1.0).abs() < 0.05, "{both} {alone} {more}");
    }
}

#[test]
fn a_body_that_turns_every_way_tells_the_class_on_the_way() {
    let mut run = Run::new(Settings::default());
    run.filter.may_be_of(OTHER);
    let before = run.filter.other_class_probability();
    for k in 0..=12_000 {
        let (rate, force, _) = sample(k);
        run.take(k as f64 * 0.01, rate, Some(force), None);
    }
    let after = run.filter.other_class_probability();
    assert!(before == 0.5 && after < 0.2, "{before} {after}");
}

#[test]
fn a_gyro_far_off_its_class_is_told_to_be_of_the_other_though_its_prior_was_widened() {
    let mut run = Run::new(Settings::default());
    run.filter.may_be_of(OTHER);
    let (mut told, mut widened) = (0.0, 0);
    for k in 0..=60_000 {
        let (rate, force, _) = sample(k);
        let off = rate.component_mul(&Vector3::new(1.03, 0.98, 1.02));
        run.take(k as f64 * 0.01, off, Some(force), None);
        if run.filter.is_beyond_class() && k % 100 == 0 {
            let probability = run.filter.other_class_probability();
            widened += 1;
            // Where nothing can be said, what was said before stays: what it adds does not fall by a fifth.
            let share = share_of_variance(probability);
            assert!(share > 0.7 && share > told - 0.2, "{k} {probability}");
            told = share;
        }
    }
    assert!(
        widened > 400 && told > 0.999 && run.filter.other_class_probability() > 0.999,
        "{widened} {told}"
    );
}
