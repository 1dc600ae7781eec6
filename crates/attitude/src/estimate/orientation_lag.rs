//! Rates and an orientation in the same samples -> how far the rates are behind it. Pure.
//!
//! Apart from the choice of the kind because it is a fit (`docs/theory/clocks.md`, "What a sample means"): rotation
//! between orientations = map times the integral of the rates, shifted by a delay, plus a bias. Rates at their stamps are
//! not late, means over the step before are half a step late, and a filter in the sensor adds its own delay.

use super::lag::OrientationLag;
use super::meaning::Meaning;
use super::sample_kind::{AHEAD, KindChoice, KindReason};
use crate::condition::Clock;
use crate::frames::{Body, Nav};
use crate::quaternion::Quaternion;
use crate::record::{Nanos, RawSample};
use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3, Vector4};

/// Samples that are looked at.
const MOST: usize = 20_000;
/// Orientations that are needed.
const FEWEST: usize = 100;
/// Rounds of the fit; each moves the delay by a step at most.
const ROUNDS: usize = 8;
/// Residuals of more than so many medians are left out.
const OUTLIER: f64 = 4.0;
/// Rotations over more than so many ordinary intervals are left out.
const LONG: f64 = 5.0;
/// Rotations whose errors are taken together: neighbours are not independent.
const BLOCK: usize = 20;
/// Pass over the samples of a file that finds by an orientation in them what a sample means.
#[derive(Debug, Default)]
pub struct LagPass {
    rates: Vec<(Nanos, Vector3<f64>)>,
    orientations: Vec<(Nanos, Quaternion<Nav, Body>)>,
    taken: usize,
}

/// Terms of one rotation between two orientations: the angle by the rates, the rate's change, time, the rotation itself.
#[derive(Clone, Copy, Debug)]
struct Term {
    angle: Vector3<f64>,
    change: Vector3<f64>,
    secs: f64,
    turn: Vector3<f64>,
}

impl LagPass {
    /// Makes one where nothing states the kind of samples understood as `resolved`.
    #[must_use]
    pub fn of(resolved: &Meaning) -> Option<LagPass> {
        resolved.is_kind_open().then(LagPass::default)
    }

    /// Takes the next sample, on its `clock`.
    pub fn take(&mut self, raw: &RawSample, resolved: &Meaning, clock: Clock) {
        if !self.wants_more() || raw.is_beside {
            return;
        }
        self.taken += 1;
        let Some(stamp) = clock.read(raw) else {
            return;
        };
        let rate = raw.gyro.map(|read| resolved.body_rate(read));
        if let Some(rate) = rate.filter(|rate| rate.iter().all(|value| value.is_finite()))
            && self.rates.last().is_none_or(|(last, _)| stamp > *last)
        {
            self.rates.push((stamp, rate));
        }
        let attitude = raw.orientation.and_then(|q| resolved.recorded_attitude(q));
        if let Some(attitude) = attitude
            && self
                .orientations
                .last()
                .is_none_or(|(last, _)| stamp > *last)
        {
            self.orientations.push((stamp, attitude));
        }
    }

    /// Whether more samples would tell more: not where the first carry no orientation.
    #[must_use]
    pub fn wants_more(&self) -> bool {
        self.taken < MOST && (self.taken < AHEAD || !self.orientations.is_empty())
    }

    /// The kind, where the fit is sure of it.
    #[must_use]
    pub fn choice(&self) -> Option<KindChoice> {
        let lag = self.fit()?;
        let (kind, reason) = (lag.kind()?, KindReason::Orientation(lag));
        Some(KindChoice { kind, reason })
    }

    /// The delay; `None` where there are too few orientations, or nothing moves.
    fn fit(&self) -> Option<OrientationLag> {
        let (first, _) = *self.rates.first()?;
        let rates: Vec<(f64, Vector3<f64>)> = self
            .rates
            .iter()
            .map(|(stamp, rate)| (stamp.secs_since(first), *rate))
            .collect();
        let last = rates.last()?.0;
        let within = |secs: f64| secs > 0.0 && secs < last;
        let orientations = self.orientations.iter();
        let all: Vec<(f64, Quaternion<Nav, Body>)> = orientations
            .map(|(stamp, q)| (stamp.secs_since(first), *q))
            .filter(|(secs, _)| within(*secs))
            .collect();
        if all.len() < FEWEST {
            return None;
        }
        let step = median_step(&rates)?;
        // Two or more steps a rotation.
        let lag = (2.0 * step / median_step(&all)?).round().max(1.0) as usize;
        let kept: Vec<_> = all.into_iter().step_by(lag).collect();
        fitted(&Integral::of(&rates), &kept, step)
    }
}

fn median_step<T>(rows: &[(f64, T)]) -> Option<f64> {
    let steps = rows.windows(2).filter_map(|pair| match pair {
        [(before, _), (after, _)] => Some(after - before),
        _ => None,
    });
    median(steps.collect()).filter(|step| *step > 0.0)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Integral of rates that are linear between their stamps.
struct Integral<'r> {
    rates: &'r [(f64, Vector3<f64>)],
    angles: Vec<Vector3<f64>>,
}

impl Integral<'_> {
    fn of(rates: &[(f64, Vector3<f64>)]) -> Integral<'_> {
        let mut angle = Vector3::zeros();
        let mut angles = vec![angle];
        for pair in rates.windows(2) {
            if let [(before, from), (after, to)] = pair {
                angle += (from + to) * (0.5 * (after - before));
                angles.push(angle);
            }
        }
        Integral { rates, angles }
    }

    /// Angle and rate at an instant.
    fn at(&self, secs: f64) -> Option<[Vector3<f64>; 2]> {
        let after = self.rates.partition_point(|(at, _)| *at < secs);
        let i = after
            .saturating_sub(1)
            .min(self.rates.len().checked_sub(2)?);
        let ((t0, w0), (t1, w1)) = (self.rates.get(i)?, self.rates.get(i + 1)?);
        let share = (secs - t0) / (t1 - t0);
        let change = w1 - w0;
        Some([
            self.angles.get(i)? + (w0 * share + change * (0.5 * share * share)) * (t1 - t0),
            w0 + change * share,
        ])
    }
}

/// Least squares of rows on the angle by the rates and time, for three columns at once.
fn regressed(terms: &[&Term], of: impl Fn(&Term) -> Vector3<f64>) -> Option<SMatrix<f64, 4, 3>> {
    let mut normal = Matrix4::zeros();
    let mut right = SMatrix::<f64, 4, 3>::zeros();
    for term in terms {
        let row = known(term);
        normal += row * row.transpose();
        right += row * of(term).transpose();
    }
    let found = normal.lu().solve(&right)?;
    found.iter().all(|value| value.is_finite()).then_some(found)
}

fn known(term: &Term) -> Vector4<f64> {
    Vector4::new(term.angle.x, term.angle.y, term.angle.z, term.secs)
}

fn terms_at(
    rates: &Integral<'_>,
    orientations: &[(f64, Quaternion<Nav, Body>)],
    delay: f64,
) -> Option<Vec<Term>> {
    let pairs = orientations.windows(2).map(|pair| {
        let [(before, from), (after, to)] = pair else {
            return None;
        };
        let [a0, w0] = rates.at(before + delay)?;
        let [a1, w1] = rates.at(after + delay)?;
        Some(Term {
            angle: a1 - a0,
            change: w1 - w0,
            secs: after - before,
            turn: (from.inverse() * *to).rotation_vector().0,
        })
    });
    pairs.collect()
}

/// Fits map, bias and delay.
fn fitted(
    rates: &Integral<'_>,
    orientations: &[(f64, Quaternion<Nav, Body>)],
    step: f64,
) -> Option<OrientationLag> {
    let usual = median_step(orientations)?;
    let (mut delay, mut found) = (0.0, None);
    for _ in 0..ROUNDS {
        let terms = terms_at(rates, orientations, delay)?;
        let kept: Vec<&Term> = terms
            .iter()
            .filter(|term| term.secs < LONG * usual)
            .collect();
        let map = regressed(&kept, |term| term.turn)?;
        let to_body: Matrix3<f64> = map.fixed_rows::<3>(0).transpose();
        let by_delay = regressed(&kept, |term| to_body * term.change)?;
        let errors: Vec<(Vector3<f64>, Vector3<f64>)> = kept
            .iter()
            .map(|term| {
                let left = term.turn - map.transpose() * known(term);
                let slope = to_body * term.change - by_delay.transpose() * known(term);
                (left, slope)
            })
            .collect();
        let usual_error = median(errors.iter().map(|(left, _)| left.norm()).collect())?;
        let told = errors
            .iter()
            .filter(|(left, _)| left.norm() <= OUTLIER * usual_error + 1e-12);
        let told: Vec<_> = told.collect();
        let squares: f64 = told.iter().map(|(_, slope)| slope.norm_squared()).sum();
        let product: f64 = told.iter().map(|(left, slope)| slope.dot(left)).sum();
        if squares.is_nan() || squares <= 0.0 {
            return None;
        }
        let off = product / squares;
        let blocks = told.chunks(BLOCK).map(|block| {
            let errors = block.iter();
            errors
                .map(|(left, slope)| (left - slope * off).dot(slope))
                .sum::<f64>()
        });
        let sigma = blocks.map(|sum| sum * sum).sum::<f64>().sqrt() / squares;
        delay += off.clamp(-step, step);
        found = Some(OrientationLag {
            delay_secs: delay,
            sigma_secs: sigma,
            step_secs: step,
            map_off: (to_body - Matrix3::identity()).amax(),
        });
        if off.abs() < 1e-6 {
            break;
        }
    }
    found.filter(|lag| lag.delay_secs.is_finite() && lag.sigma_secs.is_finite())
}

#[cfg(test)]
mod tests;
