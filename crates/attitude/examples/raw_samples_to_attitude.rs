//! Raw samples -> attitude, as `strapd replay` does it: what must be known first is found in the samples.
//!
//! ```sh
//! cargo run -p strapd-attitude --example raw_samples_to_attitude
//! ```
#![allow(clippy::print_stdout)]

use std::f64::consts::{FRAC_PI_2, TAU};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{
    Bias, EstimationSettings, Estimator, Meaning, Patience, Preparation,
};
use strapd_attitude::propagate::Sequential;
use strapd_attitude::record::{Declared, Nanos, RawSample};

fn main() -> Result<(), Diagnostic> {
    // At rest for ten seconds with a bias of 0.02 rad/s about z, then a turn of 90 degrees in one.
    let gyro = |k: i64| {
        let ripple = 1e-4 * (k % 7 - 3) as f64;
        // It begins and ends without a jerk: 90 degrees in all.
        let t = ((k - 1000) as f64 / 100.0).clamp(0.0, 1.0);
        let turn = FRAC_PI_2 * (1.0 - (TAU * t).cos());
        [ripple, -ripple, 0.02 + turn + ripple]
    };
    let samples: Vec<RawSample> = (0..=1110)
        .map(|k| RawSample {
            header: Some(Nanos(k * 10_000_000)),
            gyro: Some(gyro(k)),
            accel: Some([0.0, 0.0, 9.81]),
            ..RawSample::default()
        })
        .collect();

    // What is asked for, and what the format declares of its numbers (here: nothing).
    let plan = EstimationSettings {
        bias: Bias::Auto,
        ..EstimationSettings::default()
    };
    let meaning = Meaning::new(&plan, &Declared::default());
    let mut preparation = Preparation::new(&plan, &meaning, Patience::WholeLog);
    for sample in &samples {
        preparation.take(sample)?;
    }
    let prepared = preparation.decide()?;
    println!(
        "bias {:?} rad/s, {}",
        prepared.bias.0.as_slice(),
        prepared.bias_origin
    );

    let mut estimator = Estimator::new(&plan, &meaning, &prepared)?;
    let mut last = None;
    for sample in &samples {
        estimator.take(sample);
        last = estimator.attitudes(&Sequential).last().copied().or(last);
    }
    last = estimator.finish(&Sequential).last().copied().or(last);
    let last = last.ok_or("no attitude came")?;
    let turned = last.q_nb.yaw_pitch_roll().yaw.to_degrees();
    let sigma = last.covariance.sigma().map(f64::to_degrees);
    println!(
        "turned by {turned:.2} degrees, sigma about the body axes {:?}",
        sigma.as_slice()
    );
    Ok(())
}
