//! Rests -> bias and level, or a refusal that says what helps. Pure.
//!
//! A stage of its own because finding rests is about windows, and this is about what many rests
//! say together.

use super::{Limits, Rest, Rests};
use crate::diagnostic::Diagnostic;
use crate::frames::{Body, In, Nav};
use crate::quaternion::{BodyRate, Quaternion};
use crate::setting::{BIAS, GYRO_UNIT, INIT, START, UNTIL};
use nalgebra::Vector3;

/// A gyro bias from rests.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BiasEstimate {
    /// Reading of the gyro at rest.
    pub bias: BodyRate,
    /// One standard deviation, rad/s.
    pub sigma: Vector3<f64>,
    /// Number of rests used.
    pub rests: u64,
    /// Seconds of rest used.
    pub secs: f64,
}

/// Why no bias or no level can be given.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum NoRest {
    /// The body never stood still for a second.
    Moving {
        /// Smallest gyro deviation of any half second, rad/s.
        stillest: Option<f64>,
        /// Limit of stillness, rad/s.
        limit: f64,
    },
    /// The rests contradict each other: at least one of them was a slow turn.
    Disagree {
        /// Largest scatter of their mean rates, rad/s.
        scatter: f64,
    },
    /// Rest that is not at the start, where the attitude is wanted.
    NotAtStart {
        /// Beginning of the first rest, s after the first sample.
        first_rest_secs: f64,
    },
    /// Rest at the start without an acceleration in it.
    NoAccel,
}

impl From<&NoRest> for Diagnostic {
    fn from(error: &NoRest) -> Diagnostic {
        match error {
            NoRest::Moving { stillest, limit } => {
                let quietest = stillest.map(|stillest| {
                    format!(
                        ": the quietest half second has a gyro deviation of {stillest:.4} rad/s, still is below {limit:.4}"
                    )
                });
                Diagnostic::new(format!(
                    "the body never stands still for a second{}",
                    quietest.unwrap_or_default()
                ))
                .help(format!(
                    "{BIAS} x,y,z (rad/s) from a recording at rest, or {BIAS} none; if the rates look too large, {GYRO_UNIT} deg"
                ))
            }
            NoRest::Disagree { scatter } => Diagnostic::new(format!(
                "the rests contradict each other by {scatter:.4} rad/s: some are slow turns, not rests"
            ))
            .help(format!(
                "{BIAS} x,y,z (rad/s), or {START}/{UNTIL} around one true rest"
            )),
            NoRest::NotAtStart { first_rest_secs } => Diagnostic::new(format!(
                "the body moves at the start; it first rests {first_rest_secs:.1} s later"
            ))
            .help(format!(
                "{START} {first_rest_secs:.1} begins there; {INIT} identity starts unlevelled"
            )),
            NoRest::NoAccel => Diagnostic::new("there is no acceleration to level from")
                .help(format!("{INIT} identity, or {INIT} rpy=r,p,y")),
        }
    }
}

impl std::fmt::Display for NoRest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for NoRest {}

/// Rests whose mean rates scatter by more than this are not all rests, rad/s (0.6 deg/s; the bias of
/// a MEMS gyro wanders by less than a tenth of it within an hour at constant temperature).
const MAX_SCATTER: f64 = 0.01;

/// The gyro's bias: mean of the rests' rates, weighted with their inverse variances (and their length).
///
/// The sigma is the larger of the weighted mean's own and of the rests' scatter about it, and
/// never below the bias instability: more rests do not make the next hour's bias any surer.
///
/// # Errors
/// [`NoRest::Moving`] without a rest, [`NoRest::Disagree`] when rests contradict each other.
pub fn estimate_bias(rests: &Rests, limits: &Limits) -> Result<BiasEstimate, NoRest> {
    if rests.kept.is_empty() {
        return Err(NoRest::Moving {
            stillest: rests.stillest,
            limit: limits.max_gyro_deviation,
        });
    }
    let mut bias = Vector3::zeros();
    let mut sigma = Vector3::zeros();
    for axis in 0..3 {
        let mut weights = 0.0;
        let mut sum = 0.0;
        for rest in &rests.kept {
            let weight = rest.secs() / (rest.sigma[axis] * rest.sigma[axis]);
            weights += weight;
            sum += weight * rest.mean_rate.0[axis];
        }
        let mean = sum / weights;
        let mut own = 0.0;
        let mut scatter = 0.0;
        for rest in &rests.kept {
            let s2 = rest.sigma[axis] * rest.sigma[axis];
            let share = rest.secs() / s2 / weights;
            own += share * share * s2;
            scatter += share * (rest.mean_rate.0[axis] - mean).powi(2);
        }
        let scatter = f64::sqrt(scatter);
        if scatter > MAX_SCATTER {
            return Err(NoRest::Disagree { scatter });
        }
        bias[axis] = mean;
        sigma[axis] = f64::sqrt(own).max(scatter).max(limits.bias_instability);
    }
    Ok(BiasEstimate {
        bias: BodyRate(bias),
        sigma,
        rests: rests.count,
        secs: rests.kept.iter().map(Rest::secs).sum(),
    })
}

/// The mean specific force at the start of the stream, from the rest it begins with.
///
/// # Errors
/// [`NoRest::Moving`] without a rest, [`NoRest::NotAtStart`] when the body moves in the first window
/// (the attitude is wanted at the first sample, and must not have changed since),
/// [`NoRest::NoAccel`] without an accelerometer.
pub fn accel_at_start(rests: &Rests, limits: &Limits) -> Result<In<Body>, NoRest> {
    rest_at_start(rests, limits)?
        .mean_accel
        .ok_or(NoRest::NoAccel)
}

/// The rest the stream begins with: the only one whose attitude is known before anything is
/// integrated.
///
/// # Errors
/// [`NoRest::Moving`] without a rest, [`NoRest::NotAtStart`] when the body moves in the first window.
pub(crate) fn rest_at_start<'r>(rests: &'r Rests, limits: &Limits) -> Result<&'r Rest, NoRest> {
    let (Some(rest), Some(first)) = (rests.kept.first(), rests.first) else {
        return Err(NoRest::Moving {
            stillest: rests.stillest,
            limit: limits.max_gyro_deviation,
        });
    };
    let first_rest_secs = rest.start.secs_since(first);
    if first_rest_secs > 0.1 {
        return Err(NoRest::NotAtStart { first_rest_secs });
    }
    Ok(rest)
}

/// Level attitude q_nb from the specific force at rest; yaw 0. `None` when it has no direction.
///
/// # Convention
/// World z up (ENU, NWU), body forward-left-up: at rest and level the specific force is +g on z.
/// Yaw-pitch-roll (z, y, x): the body's x axis projects onto the world's x axis.
#[must_use]
pub fn level(accel_b: &In<Body>) -> Option<Quaternion<Nav, Body>> {
    let accel_b = accel_b.as_vector();
    let norm = accel_b.norm();
    if !(norm.is_finite() && norm > 0.0) {
        return None;
    }
    let up = accel_b / norm;
    let roll = up.y.atan2(up.z);
    let pitch = (-up.x).atan2(up.y.hypot(up.z));
    let (sr, cr) = (0.5 * roll).sin_cos();
    let (sp, cp) = (0.5 * pitch).sin_cos();
    Some(Quaternion::assume_unit([
        cp * cr,
        cp * sr,
        sp * cr,
        -sp * sr,
    ]))
}
