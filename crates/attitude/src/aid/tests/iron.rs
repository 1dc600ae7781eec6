//! Hard iron, where it is looked for.

use super::golden::{Run, sample, truth};
use crate::aid::{Prior, Settings};
use nalgebra::{Matrix3, Vector3};

/// Hard iron in a field of 44.
const IRON: Vector3<f64> = Vector3::new(2.0, -1.5, 1.0);

/// Two minutes of the golden motion with hard iron, and the root mean square of the heading's error in the second
/// of them, degrees.
fn two_minutes(settings: Settings, iron: Vector3<f64>) -> (Run, f64) {
    let mut run = Run::new(Settings {
        has_field: true,
        ..settings
    });
    let (mut sum, mut count) = (0.0, 0);
    for k in 0..=12_000 {
        let (rate, force, field) = sample(k);
        run.take(k as f64 * 0.01, rate, Some(force), Some(field + iron));
        if k > 6000 {
            let off = run.attitude().to_dcm().as_matrix() * truth(k).transpose();
            let heading = (off[(1, 0)] - off[(0, 1)]).atan2(off[(0, 0)] + off[(1, 1)]);
            sum += heading.to_degrees().powi(2);
            count += 1;
        }
    }
    (run, (sum / f64::from(count)).sqrt())
}

#[test]
fn hard_iron_is_found_while_the_body_turns_every_way() {
    let looking = Settings {
        hard_iron: 0.1,
        ..Settings::default()
    };
    let (run, with) = two_minutes(looking, IRON);
    let (_, without) = two_minutes(Settings::default(), IRON);
    assert!(2.0 * with < without, "{with} {without}");
    let known = run.filter.calibration().hard_iron;
    let sigma = run.filter.calibration_sigma().hard_iron;
    for axis in 0..3 {
        let off = (known[axis] - IRON[axis]).abs();
        assert!(off < 3.0 * sigma[axis], "{known} {sigma}");
        // A tenth of the field before.
        assert!(sigma[axis] < 2.2, "{sigma}");
    }
    assert!(run.filter.state.covariance.smallest_pivot() > 1e-6);
    assert!(run.filter.state.covariance.asymmetry() < 1e-12);
}

#[test]
fn hard_iron_that_is_known_is_where_it_begins() {
    let known = Settings {
        hard_iron: 0.1,
        prior: Prior {
            hard_iron: Some(Matrix3::identity() * 1e-4),
            ..Prior::default()
        },
        ..Settings::default()
    };
    let (run, _) = two_minutes(known, Vector3::zeros());
    let (found, sigma) = (
        run.filter.calibration().hard_iron,
        run.filter.calibration_sigma().hard_iron,
    );
    assert!(found.amax() < 0.03, "{found}");
    assert!(sigma.amax() <= 0.01, "{sigma}");
}
