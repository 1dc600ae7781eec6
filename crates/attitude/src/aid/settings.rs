//! Settings of the filter about sensors and motions. Pure.

use super::prior::Prior;

/// Settings of the [`Filter`](super::Filter), SI. The defaults are one set for every sensor and motion it was
/// judged on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Settings {
    /// White noise density of the gyro, rad/s/sqrt(Hz).
    pub gyro_noise: f64,
    /// Random walk of its bias, rad/s/sqrt(s).
    pub bias_walk: f64,
    /// Multiplies the random walk that corrections of one sign show beyond it; 0: the bias is never taken to drift.
    pub bias_drift: f64,
    /// Sensitivity of the bias to the specific force, per 1 g along
    /// an axis, rad/s: proof masses have weight.
    pub bias_by_tilt: f64,
    /// Noise in proportion to the rate: what three scales and three angles do not describe.
    pub rate_noise: f64,
    /// Prior sigma of the gyro's bias, rad/s. Of a sensor just switched on; smaller is better for a vehicle that
    /// is never at rest.
    pub bias_prior: f64,
    /// Largest sigma of the bias by which a steady turn about the vertical is told from it, rad/s: that of the sensor's
    /// class where the prior is wider.
    pub bias_class: f64,
    /// Whether a rate along the vertical alone, of a body that has done nothing else, is taken for a turn and not for a
    /// bias: of recordings, whose later rests were looked at. Of one real sensor in some its bias points so.
    pub rest_by_direction: bool,
    /// Prior sigma of the gyro's scale factors.
    pub scale_prior: f64,
    /// Prior sigma of the angles between its axes, rad.
    pub cross_prior: f64,
    /// Prior sigma of the accelerometer's bias, m/s^2.
    pub force_bias_prior: f64,
    /// Random walk of the bias, m/s^2/sqrt(s).
    pub force_bias_walk: f64,
    /// Prior sigma of the accelerometer's lead, s.
    pub lead_prior: f64,
    /// The same as a share of the time between samples, added in squares.
    pub lead_share: f64,
    /// Sigma of the tilt at the start, and after levelling, rad.
    pub tilt_start: f64,
    /// Sigma of the heading at the start, with a magnetometer, rad.
    pub heading_start: f64,
    /// The motion: `a = -2 damping frequency v - frequency^2 p + white`, rad/s.
    pub motion_frequency: f64,
    /// Damping of the motion.
    pub motion_damping: f64,
    /// Wander of the velocity reference, m/s/sqrt(s).
    pub velocity_walk: f64,
    /// Limit of velocity (m/s) and of position (m); beyond, the body really travels.
    pub reference_limit: f64,
    /// Smallest mean acceleration that can mean a wrong tilt, m/s^2.
    pub level_force: f64,
    /// Sigma of tilt after a long gap that asks for levelling, rad.
    pub level_sigma: f64,
    /// Floor of the power density of accelerations, m^2/s^3.
    pub force_floor: f64,
    /// Sigma of the force's error at the start.
    pub force_start: f64,
    /// Time over which it is averaged, s.
    pub force_secs: f64,
    /// Share of the last residual that it is never below.
    pub force_instant: f64,
    /// Share of the vertical residual.
    pub force_vertical: f64,
    /// Largest square of a residual, as a multiple of that of the acceleration in it.
    pub force_carried: f64,
    /// Discount of residuals that resemble the ones before them; 0: none, 1: as for a
    /// process of first order.
    pub colour: f64,
    /// Share, of the variance that a residual has by what the filter does not know yet, that is not taken for noise.
    pub force_explained: f64,
    /// Whether a tilt is looked for by gravity alone, not by the vertical acceleration with it: a body that moves along a
    /// slant, as a runner does at each step, accelerates up and aside at once and is not tilted.
    pub tilt_by_gravity: bool,
    /// Power density of what turns with the body, as a multiple of that of the residuals, up to which it is chance;
    /// infinite: all is.
    pub force_turning: f64,
    /// Time between corrections, s.
    pub update_secs: f64,
    /// Time for which all must be quiet to be at rest, s.
    pub rest_secs: f64,
    /// Time for which the body must rest on before what was measured counts, s: a motion that sets in slowly
    /// is quiet at first, and what the gyro reads of it is no bias.
    pub rest_lag: f64,
    /// Largest deviation of the rate at rest, rad/s.
    pub rest_gyro: f64,
    /// Largest deviation of the force at rest, m/s^2.
    pub rest_force: f64,
    /// Largest mean rate about an axis at rest, rad/s: beside the known bias and three of its sigmas where
    /// [`rest_beside_bias`](Settings::rest_beside_bias).
    pub rest_rate: f64,
    /// Whether the mean rate at rest is judged beside the bias known by then.
    pub rest_beside_bias: bool,
    /// Whether all that was measured since the body became quiet tells the bias, with the noise it shows: else only
    /// what is measured from then on that rest is certain, with [`rest_noise`](Settings::rest_noise).
    pub rest_by_spell: bool,
    /// Least white noise of the rate at rest, rad/s/sqrt(Hz). Not below Earth's rate.
    pub rest_noise: f64,
    /// Mean square of the sine of the inclination from the body's main vertical at which half is believed of what
    /// gravity says of heading and of the gyro's bias along it; 0: all is, whatever the inclination.
    pub lean_believed: f64,
    /// Local gravity, m/s^2.
    pub gravity: f64,
    /// A magnetometer tells the heading: until its first field that is not known, instead of that of the start.
    pub has_field: bool,
    /// White noise of the field's heading, rad sqrt(s).
    pub field_noise: f64,
    /// Disturbance of the field's heading: sigma, rad.
    pub field_sigma: f64,
    /// Correlation time of the field's disturbance, s.
    pub field_secs: f64,
    /// Weight of a deviation of the field's norm or dip.
    pub field_gate: f64,
    /// Beyond so many sigmas a heading counts less.
    pub field_robust: f64,
    /// Largest deviation of the norm, as a share, and of the dip, rad, of the same field.
    pub field_same: f64,
    /// Time over which the field's norm and dip are averaged, s.
    pub field_mean_secs: f64,
    /// Time after which another field is accepted, s.
    pub field_new_secs: f64,
    /// Prior sigma of hard iron, as a share of the first field: for a magnetometer nobody has calibrated. 0: none is
    /// looked for.
    pub hard_iron: f64,
    /// Jumps of the rate beyond this add uncertainty, rad/s^2.
    pub jerk: f64,
    /// Steps longer than so many ordinary ones are gaps.
    pub gap_factor: f64,
    /// Length of a gap beyond which nothing is known, s.
    pub gap_secs: f64,
    /// Delay of the sensor's own filters that nobody has taken out, s.
    pub delay: f64,
    /// Misalignment of the axes of the sensor and of its case, rad.
    pub case: f64,
    /// Knowledge of this very sensor, instead of the priors above.
    pub prior: Prior,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            gyro_noise: 1e-4,
            bias_walk: 1.5e-4,
            bias_drift: 4.0,
            bias_by_tilt: 2e-4,
            rate_noise: 7e-5,
            bias_prior: 0.02,
            bias_class: f64::INFINITY,
            rest_by_direction: false,
            scale_prior: 4e-3,
            cross_prior: 2e-3,
            force_bias_prior: 0.02,
            force_bias_walk: 1.7e-4,
            lead_prior: 5e-4,
            lead_share: 0.1,
            tilt_start: 0.3,
            heading_start: 1.0,
            motion_frequency: 0.75,
            motion_damping: 1.5,
            velocity_walk: 5e-3,
            reference_limit: 8.0,
            level_force: 2.5,
            level_sigma: 0.6,
            force_floor: 1e-4,
            force_start: 1e-2,
            force_secs: 9.0,
            force_instant: 0.8,
            force_vertical: 0.1,
            force_carried: 30.0,
            colour: 1.1,
            force_explained: 0.02,
            tilt_by_gravity: true,
            force_turning: 2.0,
            update_secs: 0.1,
            rest_secs: 1.5,
            rest_lag: 0.5,
            rest_gyro: 0.0349,
            rest_force: 0.5,
            rest_rate: 0.002,
            rest_beside_bias: true,
            rest_by_spell: true,
            rest_noise: 1e-4,
            lean_believed: 0.05,
            gravity: 9.81,
            has_field: false,
            field_noise: 0.03,
            field_sigma: 0.1,
            field_secs: 8.0,
            field_gate: 0.4,
            field_robust: 1.5,
            field_same: 0.1,
            field_mean_secs: 10.0,
            field_new_secs: 20.0,
            hard_iron: 0.0,
            jerk: 1000.0,
            gap_factor: 1.5,
            gap_secs: 0.2,
            delay: 2e-3,
            case: 3.5e-3,
            prior: Prior::default(),
        }
    }
}
