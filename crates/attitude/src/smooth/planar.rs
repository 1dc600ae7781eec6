//! Attitudes -> the axis of the body that stays vertical, and what is known of the gyro's bias along it. Pure.
//!
//! A stage of its own because the equations believe too much there. While an axis of the body stays upright gravity
//! says
//! nothing of the bias along it; equations that are linear about attitudes off by degrees, and a motion that is taken
//! to
//! come back, say all the same that they know it to hundredths of a degree a second. So it is held at what rests, the
//! real-time filter at a rest, or the leaning of the body tell, and what that is not known to is added to sigma.

use super::factors::Node;
use super::realtime::Realtime;
use super::rests::Run;
use super::segments::Segment;
use super::solver::Marginal;
use super::start::matrix;
use crate::median::median;
use crate::quaternion::kernel::{conjugate, normalised, product, turned_in_navigation};
use nalgebra::{Matrix3, Vector3};

/// An axis is upright where the mean square of the inclination's sine from it is below this.
const UPRIGHT: f64 = 0.06;
/// Sigma by which the first node's bias along it is held, and by which it is known where the equations are asked for
/// it, rad/s.
const HELD: f64 = 1e-6;
const FREE: f64 = 0.1;
/// Rests tell a bias to no less than this share of what it is in the sensor's class.
const LEAST: f64 = 0.01;
/// Sigma of the bias in motion of a gyro that is noisy at rest, rad/s: that of a file's rest without the smoother.
/// Against its own orientation the Husky's is 0.1 deg/s off that of its rest.
const NOISY: f64 = 0.15_f64.to_radians();
/// Error of a bias that only the leaning tells, times the sine of the inclination, rad/s.
const BY_LEANING: f64 = 0.1_f64.to_radians();
/// The real-time filter has seen a rest if it knows the bias to this, rad/s.
const RESTED: f64 = 0.1_f64.to_radians();
/// A bias so many sigmas from what its class has is of a wider one.
const BEYOND_CLASS: f64 = 3.0;

/// The axis of the body that is nearest to the vertical over a recording.
#[derive(Clone, Copy, Debug)]
pub(super) struct Main {
    axis: Vector3<f64>,
    /// Mean square of the sine of the inclination from it.
    rho: f64,
}

/// Prior of the first node's bias along an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Along {
    axis: Vector3<f64>,
    rate: f64,
    sigma: f64,
}

impl Along {
    /// Replaces what weights and centre state of this axis.
    pub(super) fn put_in(
        &self,
        weights: &Matrix3<f64>,
        centre: &Vector3<f64>,
    ) -> (Matrix3<f64>, Vector3<f64>) {
        let along = self.axis * self.axis.transpose();
        let across = Matrix3::identity() - along;
        (
            across * weights * across + along / (self.sigma * self.sigma),
            across * centre + self.axis * self.rate,
        )
    }
}

/// A bias of the gyro along an axis of the body that was held, since motion does not tell it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct HeldBias {
    /// The axis, body, unit: nearly vertical over the whole recording.
    pub axis: Vector3<f64>,
    /// The bias along it where the recording begins, rad/s.
    pub rate: f64,
    /// One standard deviation of that.
    pub sigma: f64,
    /// Whether a rest has told it.
    pub is_by_rest: bool,
}

impl Main {
    /// Main axis by attitudes at the nodes; `None` where no axis stays upright.
    pub(super) fn of(segments: &[Segment], nodes: &[[f64; 4]]) -> Option<Main> {
        let (mut sum, mut mean, mut secs) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for (k, segment) in segments.iter().enumerate().filter(|(_, s)| !s.is_break) {
            // By both ends: of their mean a body that swings twice as fast as the nodes come leans nowhere.
            for up in [vertical(&nodes[k]), vertical(&nodes[k + 1])] {
                sum += up * up.transpose() * (0.5 * segment.secs);
                mean += up * segment.secs;
            }
            secs += segment.secs;
        }
        if secs <= 0.0 || !sum.iter().all(|x| x.is_finite()) {
            return None;
        }
        let eigen = (sum / secs).symmetric_eigen();
        let largest = eigen.eigenvalues.imax();
        let rho = 1.0 - eigen.eigenvalues[largest];
        let axis: Vector3<f64> = eigen.eigenvectors.column(largest).into();
        (rho < UPRIGHT).then(|| Main {
            axis: if axis.dot(&mean) < 0.0 { -axis } else { axis },
            rho: rho.max(1e-6),
        })
    }

    /// Anything: the equations are asked for it.
    pub(super) fn free(&self) -> Along {
        Along {
            axis: self.axis,
            rate: 0.0,
            sigma: FREE,
        }
    }

    /// One standard deviation along it of three.
    fn sigma(&self, axes: &Vector3<f64>) -> f64 {
        self.axis.component_mul(axes).norm()
    }

    /// The bias along it that was seen to be `rate` with a variance of `seen`, where it was nothing with that of
    /// `prior`.
    fn held(&self, rate: f64, seen: f64, prior: f64, is_by_rest: bool) -> HeldBias {
        let share = prior / (prior + seen);
        HeldBias {
            axis: self.axis,
            rate: rate * share,
            sigma: (prior * (1.0 - share)).sqrt(),
            is_by_rest,
        }
    }

    /// Bias by rests; `None` without any. `known`: sigmas of the bias beforehand, `class`: that of the sensor's class.
    pub(super) fn by_rests(
        &self,
        rests: &[Run],
        known: &Vector3<f64>,
        class: f64,
    ) -> Option<HeldBias> {
        let mut rates: Vec<f64> = rests.iter().map(|run| self.axis.dot(&run.rate)).collect();
        if rates.is_empty() {
            return None;
        }
        let rate = median(&mut rates);
        let square: f64 = rates.iter().map(|other| (other - rate).powi(2)).sum();
        let count = rates.len().max(2) as f64;
        let least = match rests.iter().any(|run| run.is_noisy) {
            true => NOISY,
            false => LEAST * class,
        };
        let seen = (square / count / count).max(least.powi(2));
        Some(self.held(rate, seen, self.sigma(known).powi(2), true))
    }

    /// Bias by a solution in which it was free, if there is one, and the filter. `known`: sigmas of the bias
    /// beforehand, about nothing.
    pub(super) fn by_motion(
        &self,
        segments: &[Segment],
        solved: Option<(&[Node], &[Marginal])>,
        filter: Option<&Realtime>,
        known: &Vector3<f64>,
    ) -> HeldBias {
        let class = self.sigma(known);
        let by_leaning = match solved {
            Some(solved) => {
                self.anew(segments, solved.0)
                    .by_leaning(segments, solved, class * class)
            }
            None => self.held(0.0, f64::INFINITY, class * class, false),
        };
        let by_filter = filter.map(|filter| HeldBias {
            rate: self.axis.dot(&filter.bias),
            sigma: self.sigma(&filter.bias_sigma),
            is_by_rest: true,
            ..by_leaning
        });
        let is_known = |held: &HeldBias| {
            held.sigma < by_leaning.sigma.min(RESTED) && held.rate.abs() < BEYOND_CLASS * class
        };
        by_filter.filter(is_known).unwrap_or(by_leaning)
    }

    /// Main axis by attitudes that are solved: those of the start lean by what is wrong with them.
    fn anew(&self, segments: &[Segment], nodes: &[Node]) -> Main {
        let attitudes: Vec<[f64; 4]> = nodes.iter().map(|node| node.q).collect();
        Main::of(segments, &attitudes).unwrap_or(*self)
    }

    fn by_leaning(
        &self,
        segments: &[Segment],
        (nodes, marginals): (&[Node], &[Marginal]),
        mut prior: f64,
    ) -> HeldBias {
        let (mut sum, mut secs) = (0.0, 0.0);
        for (segment, pair) in segments.iter().zip(nodes.windows(2)) {
            sum += 0.5 * self.axis.dot(&(pair[0].bias + pair[1].bias)) * segment.secs;
            secs += segment.secs;
        }
        let own = marginals.get(marginals.len() / 2).map_or(FREE * FREE, |m| {
            self.axis
                .component_mul(&self.axis)
                .dot(&Vector3::from(m.bias))
        });
        let seen = own + BY_LEANING * BY_LEANING / self.rho;
        let rate = if secs > 0.0 { sum / secs } else { 0.0 };
        // Where the leaning shows it better than the class does.
        if seen < prior && rate * rate > BEYOND_CLASS.powi(2) * (prior + seen) {
            prior = rate * rate - seen;
        }
        self.held(rate, seen, prior, false)
    }
}

impl HeldBias {
    /// A bias with this along the axis.
    pub(super) fn put_in(&self, bias: &Vector3<f64>) -> Vector3<f64> {
        bias + self.axis * (self.rate - self.axis.dot(bias))
    }

    /// Value at which the first node's bias is held.
    pub(super) fn along(&self) -> Along {
        Along {
            axis: self.axis,
            rate: self.rate,
            sigma: HELD,
        }
    }

    /// Start from which a solution goes on with this bias: the tilt that it had, and the heading that the gyro gives
    /// then.
    pub(super) fn begun(
        &self,
        segments: &[Segment],
        nodes: &[Node],
    ) -> Vec<([f64; 4], Vector3<f64>)> {
        let mut heading = 0.0;
        let mut begun = Vec::with_capacity(nodes.len());
        for (k, node) in nodes.iter().enumerate() {
            let off = self.rate - self.axis.dot(&node.bias);
            let turn = Vector3::z() * heading;
            let q = normalised(&turned_in_navigation(&turn, &node.q));
            begun.push((q, self.put_in(&node.bias)));
            if let (Some(segment), Some(next)) = (segments.get(k), nodes.get(k + 1))
                && !segment.is_break
            {
                let up = 0.5 * (vertical(&node.q) + vertical(&next.q));
                heading -= off * self.axis.dot(&up) * segment.secs;
            }
        }
        begun
    }

    /// Adds to what is left of the nodes what is not known of it.
    pub(super) fn widen(&self, segments: &[Segment], marginals: &mut [Marginal]) {
        let mut secs = 0.0;
        for (k, marginal) in marginals.iter_mut().enumerate() {
            if let Some(before) = k.checked_sub(1).and_then(|k| segments.get(k)) {
                secs = if before.is_break {
                    0.0
                } else {
                    secs + before.secs
                };
            }
            marginal.turn[(2, 2)] += (self.sigma * secs).powi(2);
            for (variance, axis) in marginal.bias.iter_mut().zip(&self.axis) {
                *variance += (self.sigma * axis).powi(2);
            }
        }
    }
}

/// The tilts of some attitudes with the headings of others.
pub(super) fn headed(tilts: &[[f64; 4]], headings: &[[f64; 4]]) -> Vec<[f64; 4]> {
    let pairs = tilts.iter().zip(headings);
    pairs
        .map(|(tilt, heading)| {
            let [w, _, _, z] = product(heading, &conjugate(tilt));
            let turn = Vector3::z() * (2.0 * z.atan2(w));
            normalised(&turned_in_navigation(&turn, tilt))
        })
        .collect()
}

/// The vertical in body axes.
fn vertical(q: &[f64; 4]) -> Vector3<f64> {
    matrix(q).row(2).transpose()
}
