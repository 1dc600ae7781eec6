//! Errors -> the few numbers people read. Pure.
//!
//! Apart from `compare` because quantiles and drift have several definitions in use; ours are here.

use crate::quaternion::RotationVector;
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// Statistics of a set of absolute errors, in rad.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ErrorStats {
    /// Root of the mean square.
    pub rms: f64,
    /// Mean.
    pub mean: f64,
    /// 95 % are below (interpolated between samples).
    pub p95: f64,
    /// Worst.
    pub max: f64,
}

impl ErrorStats {
    /// `None` of nothing. Reorders the errors.
    pub(super) fn of(errors: &mut [f64]) -> Option<ErrorStats> {
        let n = errors.len() as f64;
        Some(ErrorStats {
            rms: (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt(),
            mean: errors.iter().sum::<f64>() / n,
            max: errors.iter().copied().fold(0.0, f64::max),
            p95: quantile(errors, 0.95)?,
        })
    }
}

/// Quantile with linear interpolation, in O(n); `None` of nothing. Reorders the values.
///
/// # Source
/// Hyndman and Fan, "Sample quantiles in statistical packages", 1996, type 7: the default of numpy.
pub(super) fn quantile(values: &mut [f64], p: f64) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    let position = p.clamp(0.0, 1.0) * last as f64;
    let below = (position as usize).min(last);
    let (_, at, above) = values.select_nth_unstable_by(below, f64::total_cmp);
    let next = above.iter().copied().min_by(f64::total_cmp).unwrap_or(*at);
    Some(*at + (next - *at) * (position - below as f64))
}

/// Straight-line growth of the error as a rotation vector in world axes.
///
/// A line through the vector, not through its length: the length of an error that passes through
/// zero (as it does after [`Best`](super::Align::Best)) has no slope worth the name.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Drift {
    /// rad/s about the axes of the reference's world; about z is heading.
    pub rate_n: Vector3<f64>,
}

impl Drift {
    /// Size of the drift, degrees per hour.
    #[must_use]
    pub fn total_deg_per_hour(&self) -> f64 {
        self.rate_n.norm().to_degrees() * 3600.0
    }

    /// Part about the vertical, signed, degrees per hour.
    #[must_use]
    pub fn heading_deg_per_hour(&self) -> f64 {
        self.rate_n.z.to_degrees() * 3600.0
    }
}

/// Least-squares line in one pass, sums taken about running means.
#[derive(Default)]
pub(super) struct DriftFit {
    n: f64,
    mean_t: f64,
    mean_phi: Vector3<f64>,
    s_tt: f64,
    s_t_phi: Vector3<f64>,
    last: Vector3<f64>,
}

impl DriftFit {
    /// The next error, in time order; `error` is the shortest rotation vector.
    pub(super) fn add(&mut self, secs: f64, error: RotationVector) {
        let phi = unwrapped(error.0, &self.last);
        self.last = phi;
        self.n += 1.0;
        let dt = secs - self.mean_t;
        self.mean_t += dt / self.n;
        self.mean_phi += (phi - self.mean_phi) / self.n;
        self.s_tt += dt * (secs - self.mean_t);
        self.s_t_phi += dt * (phi - self.mean_phi);
    }

    /// The line of both, each from wherever it begins.
    pub(super) fn pooled(self, later: DriftFit) -> DriftFit {
        DriftFit {
            s_tt: self.s_tt + later.s_tt,
            s_t_phi: self.s_t_phi + later.s_t_phi,
            ..later
        }
    }

    pub(super) fn finish(self) -> Option<Drift> {
        (self.s_tt > 0.0).then(|| Drift {
            rate_n: self.s_t_phi / self.s_tt,
        })
    }
}

/// The same rotation by the vector nearest to the one before: an error that grows past half a turn
/// goes on growing.
fn unwrapped(phi: Vector3<f64>, last: &Vector3<f64>) -> Vector3<f64> {
    let (angle, so_far) = (phi.norm(), last.norm());
    if angle < 0.5 && so_far < PI {
        return phi;
    }
    // Near a full turn the axis of `phi` is that of the noise: the axis of the last one stays.
    let axis = if angle < 0.5 {
        last / so_far
    } else {
        phi / angle
    };
    let turns = (axis.dot(&(last - phi)) / TAU).round();
    phi + axis * (turns * TAU)
}
