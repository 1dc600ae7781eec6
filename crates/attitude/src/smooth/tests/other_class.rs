//! A class that the sensor may be of instead: the same attitudes, as unsure as either class makes them.

use super::logs::{Motion, log};
use crate::open_class::share_of_variance;
use crate::smooth::{Estimate, OtherClass, PriorScale, Settings};

/// Variances of the tilt about east in the middle of a recording, with the other class and without, rad^2; the
/// attitudes are the same.
fn tilts(motion: Motion, probability: f64) -> [f64; 2] {
    let log = log(motion).plain();
    let alone = Settings::default();
    let other = Some(OtherClass {
        looseness: PriorScale {
            force: 5.0,
            ..PriorScale::default()
        },
        probability,
    });
    let [both, alone] = [Settings { other, ..alone }, alone].map(|s| log.smoothed(&s).1);
    let attitude = |estimate: &Estimate| estimate.q_nb.wxyz();
    assert!(both.iter().map(attitude).eq(alone.iter().map(attitude)));
    let middle = |estimates: &[Estimate]| estimates[estimates.len() / 2].covariance[(0, 0)];
    [middle(&both), middle(&alone)]
}

#[test]
fn what_lies_still_is_as_unsure_as_either_class_and_what_is_turned_is_not() {
    // 0.04 m/s^2, and five times as much.
    let more = (0.2_f64.powi(2) - 0.04_f64.powi(2)) / 9.81_f64.powi(2);
    for probability in [1.0, 0.5] {
        let [both, alone] = tilts(Motion::Still, probability);
        let share = (both - alone) / more / share_of_variance(probability);
        assert!((0.9..1.0).contains(&share), "{both} {alone} {share}");
    }
    let [both, alone] = tilts(Motion::Hand, 1.0);
    assert!(both > alone && both - alone < 0.01 * more, "{both} {alone}");
}
