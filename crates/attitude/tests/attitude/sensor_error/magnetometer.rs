//! The magnetometer: iron, noise, steps.

use nalgebra::{Matrix3, Vector3};
use strapd_attitude::noise::sensor_error::{ImuError, MagnetometerModel};

fn model(text: &str, seed: u64) -> MagnetometerModel {
    MagnetometerModel::new(&ImuError::parse(text).unwrap(), seed).unwrap()
}

const FIELD: Vector3<f64> = Vector3::new(0.0, 24e-6, -41.6e-6);

#[test]
fn without_errors_the_field_itself_is_read() {
    assert_eq!(model("none", 7).measure(&FIELD), FIELD);
}

#[test]
fn iron_is_a_constant_and_a_symmetric_matrix_of_the_stated_spread() {
    let (mut hard, mut soft, mut skew) = (0.0, 0.0, 0.0_f64);
    let n = 2000;
    for seed in 0..n {
        let mut m = model("mag-hard-iron=5,mag-soft-iron=3", seed);
        let offset = m.measure(&Vector3::zeros());
        assert_eq!(offset, m.hard_iron());
        let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| m.measure(&e) - offset);
        let iron = Matrix3::from_columns(&columns) - Matrix3::identity();
        skew = skew.max((iron - iron.transpose()).amax());
        hard += offset.norm_squared() / 3.0;
        soft += iron[(0, 2)].powi(2);
    }
    let spread = |sum: f64| (sum / f64::from(n as u32)).sqrt();
    // Five standard errors of a deviation from 6000 and from 2000 draws.
    assert!((spread(hard) / 5e-6 - 1.0).abs() < 5.0 / f64::sqrt(12_000.0));
    assert!((spread(soft) / 0.03 - 1.0).abs() < 5.0 / f64::sqrt(4000.0));
    // Roundings of 1 and of the offset taken off again.
    assert!(skew < 1e-15, "{skew:e}");
}

#[test]
fn noise_is_that_of_a_sample_and_steps_are_whole() {
    let mut m = model("mag-noise=0.5", 1);
    let n = 20_000;
    let squares: f64 = (0..n)
        .map(|_| (m.measure(&FIELD) - FIELD).norm_squared() / 3.0)
        .sum();
    let sigma = (squares / f64::from(n)).sqrt();
    assert!((sigma / 0.5e-6 - 1.0).abs() < 0.02, "{sigma}");
    let read = model("mag-lsb=0.3", 1).measure(&FIELD) / 0.3e-6;
    assert!((read - read.map(f64::round)).amax() < 1e-12, "{read}");
    assert!((read * 0.3e-6 - FIELD).amax() <= 0.150001e-6);
}
