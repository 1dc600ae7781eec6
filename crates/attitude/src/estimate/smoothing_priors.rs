//! Class of a sensor -> how much wider or narrower the smoother's priors are than its own. Pure.
//!
//! Apart from the estimator because the smoother's priors are those of one set of recordings, and a class says how a
//! sensor differs from the usual one.

use super::noise_presets::NOISE_PRESETS;
use super::plan::Noise;
use crate::aid;
use crate::smooth::{FORCE_BIAS_SIGMA, PriorScale};

/// Ratio of this sensor's errors to those of the default class.
pub(super) fn looseness(filter: &aid::Settings, noise: &Noise) -> PriorScale {
    let usual = aid::Settings::default();
    let sensitivity = Noise::preset(&NOISE_PRESETS[0]).sensitivity;
    PriorScale {
        scale: filter.scale_prior / usual.scale_prior,
        axes: filter.cross_prior / usual.cross_prior,
        force: force(filter.force_bias_prior, usual.force_bias_prior),
        sensitivity: match noise.sensitivity {
            0.0 => 1.0,
            stated => stated / sensitivity,
        },
    }
}

/// Ratio of the accelerometer's bias for a class that has `class` of it, m/s^2, where the usual one has `usual`: the
/// smoother's own is wider than the usual class', and a worse class adds what it has more.
fn force(class: f64, usual: f64) -> f64 {
    if class <= usual {
        return class / usual;
    }
    (FORCE_BIAS_SIGMA.powi(2) + class.powi(2) - usual.powi(2)).sqrt() / FORCE_BIAS_SIGMA
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_class_leaves_the_priors_and_an_uncalibrated_one_widens_all() {
        let usual = aid::Settings::default();
        let of = |class: usize, filter: &aid::Settings| {
            looseness(filter, &Noise::preset(&NOISE_PRESETS[class]))
        };
        assert_eq!(of(0, &usual), PriorScale::default());
        let wide = aid::Settings {
            scale_prior: 0.01,
            cross_prior: 0.0175,
            force_bias_prior: 0.2,
            ..usual
        };
        let wide = of(1, &wide);
        assert!(wide.scale > 2.0 && wide.axes > 5.0, "{wide:?}");
        // 20 mg and the smoother's own.
        assert!(
            (wide.force * FORCE_BIAS_SIGMA - 0.203).abs() < 0.001,
            "{wide:?}"
        );
        assert!((wide.sensitivity - 16.7).abs() < 0.1, "{wide:?}");
        assert!((force(0.0199, 0.02) - force(0.0201, 0.02)).abs() < 0.01);
    }
}
