//! Samples beside a hole, or far apart -> those that would have been between them. Pure.
//!
//! Apart from the stream because these are two curves and figures for their error.

use super::prepared::{BESIDE, Prepared};
use super::sample::Numbers;
use nalgebra::Vector3;

/// Variance that a bridged gap of `secs` leaves of attitude (rad^2) and of velocity ((m/s)^2), each axis.
pub(super) fn doubt(before: &Numbers, after: &Numbers, secs: f64) -> [f64; 2] {
    let jump = (after.rate - before.rate).norm();
    let turn = 0.5 * secs * secs * (jump + 0.2 * (before.rate.norm() + after.rate.norm()));
    let (a, b) = (
        before.force.unwrap_or_default(),
        after.force.unwrap_or_default(),
    );
    let push = 0.2 * secs * ((b - a).norm() + 1.0);
    [turn * turn, push * push]
}

/// Error of the mean of a step, as a share of a sample's deviation from the cubic through its four neighbours, a
/// sixth of a fourth
/// difference. Of the rate: 11/720 of such a difference, which the trapezoid with its next correction leaves (Gregory).
/// Of the force all of it: what is faster than the samples shakes the sensor in its case, too.
const MISSED: [f64; 2] = [0.09, 1.0];

/// Variance that motion faster than the samples leaves of attitude and velocity over the step to sample `i`, each axis,
/// as [`doubt`] has it: by how far samples are off the curve of their neighbours.
pub(super) fn unresolved(window: &[(Numbers, u64)], i: usize, secs: f64) -> [f64; 2] {
    let around = i.checked_sub(2).and_then(|first| window.get(first..i + 3));
    let Some([a, b, c, d, e]) = around else {
        return [0.0; 2];
    };
    let of = |(sample, _): &(Numbers, u64)| [sample.rate, sample.force.unwrap_or_default()];
    let [a, b, c, d, e] = [a, b, c, d, e].map(of);
    std::array::from_fn(|what| {
        let curve = ((b[what] + d[what]) * 4.0 - a[what] - e[what]) / 6.0;
        let missed = MISSED[what] * secs * (c[what] - curve).norm();
        missed * missed / 3.0
    })
}

/// A cubic through the samples at both ends of a gap, with the slopes of a few samples on each side.
pub(super) struct Hermite {
    secs: f64,
    ends: [[Vector3<f64>; 2]; 2],
    slopes: [[Vector3<f64>; 2]; 2],
}

impl Hermite {
    /// Across the gap before sample `i` of the window, whose samples are `interval` apart as a rule.
    pub(super) fn across(window: &[(Numbers, u64)], i: usize, interval: f64) -> Hermite {
        let of = |sample: &Numbers| [sample.rate, sample.force.unwrap_or_default()];
        let (before, after) = (&window[i - 1].0, &window[i].0);
        let secs = after.stamp.secs_since(before.stamp);
        let ends = [of(before), of(after)];
        let chord = [0, 1].map(|what| (ends[1][what] - ends[0][what]) / secs);
        let slope = |from: usize, to: usize| {
            let side = &window[from..to];
            let (Some((first, _)), Some((last, _))) = (side.first(), side.last()) else {
                return chord;
            };
            let span = last.stamp.secs_since(first.stamp);
            if side.len() < 3 || span >= 2.2 * BESIDE as f64 * interval {
                return chord;
            }
            let at = |sample: &Numbers| sample.stamp.secs_since(first.stamp);
            let mean = side.iter().map(|(sample, _)| at(sample)).sum::<f64>() / side.len() as f64;
            let square: f64 = side
                .iter()
                .map(|(sample, _)| (at(sample) - mean).powi(2))
                .sum();
            [0, 1].map(|what| {
                let product: Vector3<f64> = side
                    .iter()
                    .map(|(sample, _)| of(sample)[what] * (at(sample) - mean))
                    .sum();
                product / square
            })
        };
        Hermite {
            secs,
            ends,
            slopes: [
                slope(i.saturating_sub(BESIDE), i),
                slope(i, (i + BESIDE).min(window.len())),
            ],
        }
    }

    /// Rate and force at the share `u` of the gap.
    pub(super) fn at(&self, u: f64) -> (Vector3<f64>, Vector3<f64>) {
        let value = |what: usize| {
            cubic(
                u,
                self.secs,
                [self.ends[0][what], self.ends[1][what]],
                [self.slopes[0][what], self.slopes[1][what]],
            )
        };
        (value(0), value(1))
    }
}

/// The cubic with these values and slopes at the ends of `secs`.
fn cubic(u: f64, secs: f64, ends: [Vector3<f64>; 2], slopes: [Vector3<f64>; 2]) -> Vector3<f64> {
    let v = 1.0 - u;
    ends[0] * ((1.0 + 2.0 * u) * v * v)
        + slopes[0] * (u * v * v * secs)
        + ends[1] * (u * u * (3.0 - 2.0 * u))
        + slopes[1] * (u * u * (u - 1.0) * secs)
}

/// Puts samples between instantaneous ones (Catmull and Rom 1974), then takes the mean rate of each step.
pub(super) struct Catmull {
    parts: usize,
    /// The last but one with its slopes, and the last.
    held: Option<(Prepared, [Vector3<f64>; 2])>,
    last: Option<Prepared>,
    /// The last rate that was given on.
    rate: Vector3<f64>,
}

impl Catmull {
    pub(super) fn new(parts: usize) -> Catmull {
        Catmull {
            parts,
            held: None,
            last: None,
            rate: Vector3::zeros(),
        }
    }

    pub(super) fn take(&mut self, next: Prepared, out: &mut Vec<Prepared>) {
        self.advance(Some(next), out);
    }

    pub(super) fn finish(&mut self, out: &mut Vec<Prepared>) {
        self.advance(None, out);
    }

    /// Gives on what lies between the last but one and the last, now that what follows them is known.
    fn advance(&mut self, next: Option<Prepared>, out: &mut Vec<Prepared>) {
        let Some(last) = std::mem::replace(&mut self.last, next) else {
            return;
        };
        let held = self.held.take().filter(|_| !last.is_after_break);
        let after = next.filter(|next| !next.is_after_break);
        let rise = |a: &Prepared, b: &Prepared, secs: f64| {
            [(b.rate - a.rate) / secs, (b.force - a.force) / secs]
        };
        let slopes = match (&held, &after) {
            (Some((a, _)), Some(c)) => rise(a, c, last.secs + c.secs),
            (Some((a, _)), None) => rise(a, &last, last.secs),
            (None, Some(c)) => rise(&last, c, c.secs),
            (None, None) => [Vector3::zeros(); 2],
        };
        match &held {
            Some((a, its)) => self.between((a, its), (&last, &slopes), out),
            None => {
                self.rate = last.rate;
                out.push(last);
            }
        }
        self.held = Some((last, slopes));
    }

    fn between(
        &mut self,
        (a, from): (&Prepared, &[Vector3<f64>; 2]),
        (b, to): (&Prepared, &[Vector3<f64>; 2]),
        out: &mut Vec<Prepared>,
    ) {
        let parts = self.parts as f64;
        for j in 1..=self.parts {
            let u = j as f64 / parts;
            let is_end = j == self.parts;
            let (rate, force) = if is_end {
                (b.rate, b.force)
            } else {
                (
                    cubic(u, b.secs, [a.rate, b.rate], [from[0], to[0]]),
                    cubic(u, b.secs, [a.force, b.force], [from[1], to[1]]),
                )
            };
            let mut point = Prepared {
                rate: 0.5 * (rate + self.rate),
                force,
                secs: b.secs / parts,
                ..*b
            };
            if !is_end {
                point.stamp = b.stamp - (b.secs * 1e9 * (1.0 - u)).round() as i64;
                point.field = Vector3::repeat(f64::NAN);
                point.is_input = false;
                point.doubt = [0.0; 2];
                point.clipped = Vector3::zeros();
                point.is_bridged = false;
            }
            self.rate = rate;
            out.push(point);
        }
    }
}
