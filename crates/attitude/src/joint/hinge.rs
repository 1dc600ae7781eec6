//! Pairs of attitudes -> the axis of a hinge in both bodies and the heading offset between their worlds. Pure.
//!
//! Apart from the joint's angle because it is an estimate and can fail.
//!
//! Let `C_A`, `C_B` take the axes of each body to its world, and `Rz(d)` the world of B to that of A. A hinge has axes
//! `j_A`, `j_B` with `C_A j_A = Rz(d) C_B j_B` at all times. The sum of squared differences is
//! `2 N - 2 j_A^T M(d) j_B` with `M(d) = sum C_A^T Rz(d) C_B`, so the axes are the first singular vectors of `M`, and
//! the largest singular value says how well they fit. `Rz(d) = P + cos(d) Q + sin(d) S` makes three sums of each window
//! enough, however many samples it has. The offset of a window is `atan2(j_A^T S j_B, j_A^T Q j_B)` of its sums,
//! smoothed as a random walk over the windows.

use super::pairs::Pair;
use crate::diagnostic::Diagnostic;
use crate::record::Nanos;
use nalgebra::{Matrix3, SVD, Vector3};
use std::f64::consts::{PI, TAU};
use std::fmt;

/// Length of a window, ns: shorter than a heading takes to drift, as long as errors of an attitude are alike.
const WINDOW: i64 = 2_000_000_000;
/// Windows that are searched for the first offset: 5 minutes, within which headings drift by less than a right angle.
const FIRST_WINDOWS: usize = 150;
/// Fewest windows of a fit.
const FEWEST_WINDOWS: usize = 5;
/// Random walk of the heading offset: 0.2 deg in a second.
const DRIFT: f64 = 0.2 * PI / 180.0;
/// Offsets tried at first, over a full turn.
const TRIED: u32 = 72;
/// Rounds of axes and offsets; the fit moves by less than a tenth of its sigma after them.
const ROUNDS: usize = 60;
/// Change of the offsets, rad, below which the fit is finished.
const FINISHED: f64 = 1e-6;
/// Motion about the axis, rad rms about any axis across it: below, the joint counts as still.
const LEAST_MOTION: f64 = 5.0 * PI / 180.0;
/// Largest misfit of a hinge, rad rms.
const MOST_MISFIT: f64 = 12.0 * PI / 180.0;
/// Least ratio of squared motion to squared misfit. Gait with 6 degrees of play reaches 5.6 and more; a joint that stands
/// still under errors, or a ball joint, at most 1.7 (eight simulated runs each).
const LEAST_RATIO: f64 = 4.0;
/// Least level part of the axis, as its mean square: an axis within 13 degrees of the vertical sees no heading.
const LEAST_LEVEL: f64 = 0.05;

/// Axis of a hinge in both bodies, and the heading offset between their worlds.
#[derive(Clone, PartialEq, Debug)]
pub struct HingeFit {
    /// Unit vector of the axis in axes of the first body, its largest component positive. A positive angle turns the
    /// second body about it by the right hand.
    pub axis_first: Vector3<f64>,
    /// The same axis in axes of the second body.
    pub axis_second: Vector3<f64>,
    /// Root of the mean square of the angle between both axes, rad: play of the joint and errors of the attitudes.
    pub misfit: f64,
    /// Heading offsets at the middle of each window that held samples, rad, and their sigma.
    offsets: Vec<(Nanos, f64, f64)>,
}

/// Reason why a motion shows no hinge.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum NoHinge {
    /// Less than ten seconds in common.
    TooShort,
    /// The joint hardly moves: rms of its motion, rad.
    Still {
        /// Root of the mean square of the rotation about the axis in which it moves most, rad.
        motion: f64,
    },
    /// The joint rotates about more than one axis, or the attitudes are wrong: the misfit of the best axis, rad rms.
    SeveralAxes {
        /// Root of the mean square of the angle between the axis in both bodies, rad.
        misfit: f64,
    },
    /// The axis is vertical nearly all the time, so it shows no heading.
    Vertical,
}

impl From<&NoHinge> for Diagnostic {
    fn from(why: &NoHinge) -> Diagnostic {
        match *why {
            NoHinge::TooShort => Diagnostic::new("no hinge: less than 10 s in common")
                .help("record the joint for longer while it bends"),
            NoHinge::Still { motion } => Diagnostic::new(format!(
                "no hinge: the joint bends by {:.1} deg rms only",
                motion.to_degrees()
            ))
            .help("bend it by 20 degrees or more, some ten times"),
            NoHinge::SeveralAxes { misfit } => Diagnostic::new(format!(
                "no hinge: the best axis is off by {:.1} deg rms",
                misfit.to_degrees()
            ))
            .help("the joint has several axes, or a sensor moved on its body"),
            NoHinge::Vertical => {
                Diagnostic::new("no hinge: its axis is vertical, which shows no heading")
                    .help("move the limb so that the axis leaves the vertical")
            }
        }
    }
}

impl fmt::Display for NoHinge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for NoHinge {}

/// `sum C_A^T K C_B` over some pairs for the three parts of `Rz(d)`.
#[derive(Clone, Copy, Debug)]
struct Sums {
    constant: Matrix3<f64>,
    cosine: Matrix3<f64>,
    sine: Matrix3<f64>,
}

impl Sums {
    const ZERO: Sums = Sums {
        constant: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        cosine: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        sine: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    fn add(&mut self, pair: &Pair) {
        let (a, b) = (pair.first.to_dcm(), pair.second.to_dcm());
        let (a, b) = (*a.as_matrix(), *b.as_matrix());
        let [ax, ay, az] = [0, 1, 2].map(|row| a.row(row).transpose());
        let [bx, by, bz] = [0, 1, 2].map(|row| b.row(row).into_owned());
        self.constant += az * bz;
        self.cosine += ax * bx + ay * by;
        self.sine += ay * bx - ax * by;
    }

    /// The same sums for worlds that are already turned by `offset`.
    fn offset(&self, offset: f64) -> Sums {
        let (sin, cos) = offset.sin_cos();
        Sums {
            constant: self.constant,
            cosine: cos * self.cosine + sin * self.sine,
            sine: cos * self.sine - sin * self.cosine,
        }
    }

    fn plus(self, other: Sums) -> Sums {
        Sums {
            constant: self.constant + other.constant,
            cosine: self.cosine + other.cosine,
            sine: self.sine + other.sine,
        }
    }

    fn at(&self, offset: f64) -> Matrix3<f64> {
        let (sin, cos) = offset.sin_cos();
        self.constant + cos * self.cosine + sin * self.sine
    }

    /// Largest singular value at an offset: the sum of the cosines between the best axes.
    fn fit(&self, offset: f64) -> f64 {
        singular(&self.at(offset)).map_or(0.0, |(values, ..)| values[0])
    }

    /// The offset of the best fit within `span` of `near`.
    fn best_near(&self, near: f64, span: f64) -> f64 {
        // Golden section: 40 steps leave 1e-8 of the span.
        const GOLDEN: f64 = 0.381_966_011_250_105;
        let (mut low, mut high) = (near - span, near + span);
        for _ in 0..40 {
            let step = GOLDEN * (high - low);
            if self.fit(low + step) > self.fit(high - step) {
                high -= step;
            } else {
                low += step;
            }
        }
        0.5 * (low + high)
    }

    /// The offset of the best fit over a full turn.
    fn best(&self) -> f64 {
        let step = TAU / f64::from(TRIED);
        let tried = (0..TRIED).map(|k| step * f64::from(k));
        let fits = tried.map(|offset| (self.fit(offset), offset));
        let (_, near) = fits.fold(
            (0.0, 0.0),
            |best, tried| if tried.0 > best.0 { tried } else { best },
        );
        self.best_near(near, step)
    }
}

/// Singular values in falling order with the first pair of singular vectors; `None` for what is not finite.
fn singular(m: &Matrix3<f64>) -> Option<([f64; 3], Vector3<f64>, Vector3<f64>)> {
    let svd = SVD::try_new(*m, true, true, f64::EPSILON, 1000)?;
    let (u, v) = (svd.u?, svd.v_t?);
    let mut places = [0, 1, 2];
    let value = |place: &usize| svd.singular_values[*place];
    places.sort_by(|a, b| value(b).total_cmp(&value(a)));
    let first = places[0];
    Some((
        places.map(|place| value(&place)),
        u.column(first).into_owned(),
        v.row(first).transpose(),
    ))
}

/// Sums of one window.
#[derive(Clone, Copy, Debug)]
struct Window {
    middle: Nanos,
    samples: f64,
    sums: Sums,
}

fn windows(pairs: &[Pair]) -> Vec<Window> {
    let mut windows: Vec<Window> = Vec::new();
    let Some(first) = pairs.first() else {
        return windows;
    };
    let mut current = None;
    for pair in pairs {
        let index = pair.stamp.since(first.stamp) / WINDOW;
        if current != Some(index) {
            current = Some(index);
            windows.push(Window {
                middle: Nanos(first.stamp.0.saturating_add(index * WINDOW + WINDOW / 2)),
                samples: 0.0,
                sums: Sums::ZERO,
            });
        }
        if let Some(window) = windows.last_mut() {
            window.samples += 1.0;
            window.sums.add(pair);
        }
    }
    windows
}

impl HingeFit {
    pub(super) fn of(pairs: &[Pair]) -> Result<HingeFit, NoHinge> {
        let windows = windows(pairs);
        if windows.len() < FEWEST_WINDOWS {
            return Err(NoHinge::TooShort);
        }
        let beginning = windows.iter().take(FIRST_WINDOWS).map(|w| w.sums);
        let start = beginning.fold(Sums::ZERO, Sums::plus).best();
        let total: f64 = windows.iter().map(|w| w.samples).sum();
        let mut offsets = vec![(start, 0.0); windows.len()];
        for _ in 0..ROUNDS {
            let sums = turned(&windows, &offsets);
            // What all offsets have in common trades with the axes and would converge slowly.
            let common = sums.best_near(0.0, 0.2);
            let (values, a, b) = singular(&sums.at(common)).ok_or(NoHinge::TooShort)?;
            let residual = (1.0 - values[0] / total).max(1e-12);
            let next = smoothed(&windows, offsets[0].0 + common, (&a, &b), residual);
            let moved = next.iter().zip(&offsets).map(|(n, o)| (n.0 - o.0).abs());
            let moved = moved.fold(0.0, f64::max);
            offsets = next;
            if moved < FINISHED {
                break;
            }
        }
        // Half a turn at most in the first window; whatever follows goes on from it.
        let turns = TAU * (offsets[0].0 / TAU).round();
        for (offset, _) in &mut offsets {
            *offset -= turns;
        }
        HingeFit::judged(&windows, &offsets, total)
    }

    fn judged(windows: &[Window], offsets: &[(f64, f64)], total: f64) -> Result<HingeFit, NoHinge> {
        let sums = turned(windows, offsets);
        let (values, a, b) = singular(&sums.at(0.0)).ok_or(NoHinge::TooShort)?;
        // 1 - cos of the angle between the axes, in the mean: half its square.
        let squared = |value: f64| (2.0 * (1.0 - value / total)).max(0.0);
        let (misfit, motion) = (squared(values[0]), squared(values[1]));
        if motion.sqrt() < LEAST_MOTION {
            return Err(NoHinge::Still {
                motion: motion.sqrt(),
            });
        }
        if misfit.sqrt() > MOST_MISFIT || motion < LEAST_RATIO * misfit {
            return Err(NoHinge::SeveralAxes {
                misfit: misfit.sqrt(),
            });
        }
        let level = a.dot(&(sums.cosine * b)).hypot(a.dot(&(sums.sine * b)));
        if level < LEAST_LEVEL * total {
            return Err(NoHinge::Vertical);
        }
        // Variance of the offset that all windows share: the axes are free to follow it.
        let step = 1e-2;
        let bend = 2.0 * sums.fit(0.0) - sums.fit(step) - sums.fit(-step);
        let curvature = (bend / (step * step * total)).max(1e-9);
        let common = 0.5 * misfit / (windows.len() as f64 * curvature);
        let sign = a[a.iamax()].signum();
        Ok(HingeFit {
            axis_first: sign * a,
            axis_second: sign * b,
            misfit: misfit.sqrt(),
            offsets: windows
                .iter()
                .zip(offsets)
                .map(|(w, (offset, variance))| (w.middle, *offset, (variance + common).sqrt()))
                .collect(),
        })
    }

    /// Returns the heading offset at an instant and its sigma, rad: the angle about the vertical that takes the world of
    /// the second body to that of the first. Constant before the middle of the first window and after that of the last.
    #[must_use]
    pub fn heading_offset_at(&self, stamp: Nanos) -> (f64, f64) {
        let after = self
            .offsets
            .partition_point(|(middle, ..)| *middle <= stamp);
        let before = after
            .checked_sub(1)
            .and_then(|place| self.offsets.get(place));
        match (before, self.offsets.get(after)) {
            (Some((t0, d0, s0)), Some((t1, d1, s1))) => {
                let t = stamp.since(*t0) as f64 / t1.since(*t0).max(1) as f64;
                (d0 + t * (d1 - d0), s0.max(*s1))
            }
            (Some((_, d, s)), None) | (None, Some((_, d, s))) => (*d, *s),
            (None, None) => (0.0, f64::INFINITY),
        }
    }

    /// Heading offsets at the first and the last window, rad.
    #[must_use]
    pub fn heading_offsets(&self) -> (f64, f64) {
        let offset = |at: Option<&(Nanos, f64, f64)>| at.map_or(0.0, |(_, offset, _)| *offset);
        (offset(self.offsets.first()), offset(self.offsets.last()))
    }

    /// Root of the mean square of the offsets' sigma, rad.
    #[must_use]
    pub fn heading_sigma(&self) -> f64 {
        let squares: f64 = self.offsets.iter().map(|(_, _, sigma)| sigma * sigma).sum();
        (squares / self.offsets.len().max(1) as f64).sqrt()
    }
}

/// Sums of all windows, each turned by its own offset.
fn turned(windows: &[Window], offsets: &[(f64, f64)]) -> Sums {
    let each = windows.iter().zip(offsets);
    each.fold(Sums::ZERO, |sum, (window, (offset, _))| {
        sum.plus(window.sums.offset(*offset))
    })
}

/// Offsets and variances of all windows for given axes: measured window by window, smoothed forward and back.
fn smoothed(
    windows: &[Window],
    start: f64,
    (a, b): (&Vector3<f64>, &Vector3<f64>),
    residual: f64,
) -> Vec<(f64, f64)> {
    let (mut offset, mut variance) = (start, PI * PI);
    let mut before: Option<Nanos> = None;
    // Filtered offset and variance, and the variance before the measurement.
    let mut filtered: Vec<(f64, f64, f64)> = Vec::with_capacity(windows.len());
    for window in windows {
        if let Some(before) = before.replace(window.middle) {
            variance += DRIFT * DRIFT * window.middle.secs_since(before);
        }
        let predicted = variance;
        let cosine = a.dot(&(window.sums.cosine * b));
        let sine = a.dot(&(window.sums.sine * b));
        let strength = sine.hypot(cosine);
        if strength > f64::MIN_POSITIVE {
            let ahead = sine.atan2(cosine) - offset;
            let ahead = ahead - TAU * (ahead / TAU).round();
            let gain = variance / (variance + residual * window.samples / strength);
            offset += gain * ahead;
            variance *= 1.0 - gain;
        }
        filtered.push((offset, variance, predicted));
    }
    let mut smoothed: Vec<(f64, f64)> = Vec::with_capacity(windows.len());
    let mut later: Option<(f64, f64, f64)> = None;
    for (offset, variance, predicted) in filtered.into_iter().rev() {
        let (offset, wider) = later.map_or((offset, variance), |(next, next_variance, from)| {
            let gain = variance / from;
            let back = offset + gain * (next - offset);
            (back, variance + gain * gain * (next_variance - from))
        });
        smoothed.push((offset, wider));
        later = Some((offset, wider, predicted));
    }
    smoothed.reverse();
    smoothed
}
