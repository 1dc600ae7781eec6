//! A smoothed recording -> whether its sensor is of the class that was assumed, and what is assumed if not. Pure.
//!
//! Apart from the smoothing because it is a rule of evidence, with bounds that were chosen on recordings.

use crate::smooth::{Estimated, FORCE_SCALE, PriorScale, Smoothed};

/// A sensor is none of its class if a constant is found so many sigmas off: of what a log finds where the class is
/// right, which is the less the less it sees (the prior's variance less what the log leaves of it).
const BEYOND: f64 = 3.5;
/// Least of that, beside the prior's sigma: what a log hardly sees is not looked at.
const LEAST_SEEN: f64 = 0.1;
/// And is smoothed again with priors that are so many times as wide: those of one that nobody has calibrated
/// (`uncalibrated` beside what is expected where nobody says anything). Of acceleration it feels what its class does: with
/// more the 14 recordings of BROAD are worse, and simulated bodies no better.
pub(super) const LOOSER: PriorScale = PriorScale {
    scale: 2.5,
    axes: 6.0,
    force: 9.8,
    sensitivity: 1.0,
};
/// Factor by which the sigmas of a calibration file are widened.
pub(super) const LOOSER_KNOWN: f64 = 2.5;

pub(super) fn is_beyond(smoothed: &Smoothed, looseness: PriorScale) -> bool {
    let calibration = smoothed.calibration();
    let force = own_scales(calibration.force, FORCE_SCALE * looseness.scale);
    is_off(&calibration.gyro) || is_off(&calibration.force_bias) || is_off(&force)
}

/// Whether something beside gravity holds the attitudes: a rest, a bias about an upright axis that was held, or a north.
/// Without any, priors that are too narrow make motion of what is wrong with the sensor.
pub(super) fn is_held(smoothed: &Smoothed) -> bool {
    smoothed.counts().standstills > 0
        || smoothed.held().is_some()
        || smoothed.sections().iter().any(|section| section.has_north)
}

/// Removes what the scales of all axes share, which is known of no accelerometer: each is then known to `own`.
fn own_scales(mut force: Estimated<9>, own: f64) -> Estimated<9> {
    const SCALES: [usize; 3] = [0, 4, 8];
    if SCALES.iter().all(|i| force.prior[*i] > own) {
        let common = SCALES.iter().map(|i| force.value[*i]).sum::<f64>() / 3.0;
        for i in SCALES {
            force.value[i] -= common;
            (force.sigma[i], force.prior[i]) = (0.0, own);
        }
    }
    force
}

fn is_off<const N: usize>(learned: &Estimated<N>) -> bool {
    let sigmas = learned.sigma.iter().zip(&learned.prior);
    let mut all = learned.value.iter().zip(sigmas);
    all.any(|(value, (sigma, prior))| {
        let seen = (prior * prior - sigma * sigma).max(0.0).sqrt();
        value.abs() > BEYOND * seen.max(LEAST_SEEN * prior)
    })
}
