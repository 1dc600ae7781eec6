//! Which samples an interval is integrated from, and by which path -> its turn. Pure.
//!
//! Four paths, chosen interval by interval from the data alone: equal spacings (constant table),
//! arbitrary stamps (general interpolation), a careful one where the window is one-sided, irregular or
//! bridges a gap, and collocation where increments are missing.

use super::collocation;
use super::lagrange::{self, POINTS, Quadrature};
use super::lanes::{Lanes, Triple};
use super::magnus::{self, Moments};
use super::method::{LARGEST_WINDOW, Order, Placement};
use super::track::{Track, secs};
use super::turn::Turn;
use super::uniform::Centred;
use crate::record::Status;

/// How many neighbouring intervals go through the kernels together.
const GROUP: usize = 4;

/// Largest noise gain taken without asking the data: sum of squares of the interpolation's coefficients
/// at mid-interval. Two samples' mean has 0.5, a centred window of 16 equidistant ones 0.87; above 4
/// interpolation would double the noise of a single sample.
const LOUD: f64 = 4.0;

/// One interval, integrated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    /// `[cos(a/2) - 1, x, y, z]`.
    pub(crate) turn: [f64; 4],
    /// Angle turned, rad.
    pub(crate) angle: f64,
    /// Variance to add for what was interpolated across a gap, rad^2.
    pub(crate) gap_variance: f64,
    /// Seconds of white noise that bridging has added to those of the interval.
    pub(crate) gap_noise: f64,
    /// What the careful path did.
    pub(crate) note: Note,
}

/// What is to be counted about a step.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum Note {
    #[default]
    Ordinary,
    /// Fewer samples than the method's window were used.
    Reduced,
    /// The interval holds missing samples.
    Bridged,
    /// The result was not finite and has been replaced by no rotation.
    Refused,
}

impl Step {
    /// A rotation vector where a turn is expected, for the method that sums vectors.
    pub(crate) fn of_vector(phi: Triple<1>) -> Self {
        let turn = Turn { v: phi, ..Turn::NONE };
        Step { angle: phi.norm(), ..Step::new(turn, Note::Ordinary) }
    }

    /// What this step has to say in the output at its end.
    #[inline(always)]
    pub(crate) fn status(&self) -> Status {
        let undersampled = if self.angle > std::f64::consts::PI {
            Status::UNDERSAMPLED
        } else {
            Status::OK
        };
        undersampled.with(match self.note {
            Note::Ordinary | Note::Reduced => Status::OK,
            Note::Bridged => Status::BRIDGED,
            Note::Refused => Status::REJECTED_BEFORE,
        })
    }

    pub(crate) fn new(turn: Turn<1>, note: Note) -> Self {
        let angle = turn.angle();
        if angle.is_finite() && turn.parts().iter().all(|c| c.is_finite()) {
            return Step {
                turn: turn.parts(),
                angle,
                gap_variance: 0.0,
            gap_noise: 0.0,
                note,
            };
        }
        Step {
            turn: [0.0; 4],
            angle: 0.0,
            gap_variance: 0.0,
            gap_noise: 0.0,
            note: Note::Refused,
        }
    }
}

/// A sliding-window method, ready to run.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) window: usize,
    placement: Placement,
    /// Samples needed beyond the end of the interval.
    pub(crate) look_ahead: usize,
    order: Order,
    increments: bool,
    /// By number of interpolation points.
    quadratures: Vec<Quadrature>,
    centred: Option<Centred>,
    /// Largest noise gain taken unasked: [`LOUD`], or that of the method's own window if larger.
    loud: f64,
}

impl Plan {
    pub(crate) fn new(window: usize, order: Order, placement: Placement, increments: bool) -> Self {
        let look_ahead = match (placement, increments) {
            (Placement::Causal, _) => 0,
            (Placement::Centred, true) => (window - 1) / 2,
            (Placement::Centred, false) => window / 2 - 1,
        };
        let centred = if increments {
            (window % 2 == 1 && look_ahead == window / 2).then(|| Centred::for_increments(window))
        } else {
            (window % 2 == 0 && look_ahead + 1 == window / 2).then(|| Centred::for_rates(window))
        };
        let quadratures: Vec<Quadrature> = (0..=LARGEST_WINDOW + 1).map(Quadrature::new).collect();
        let mut plan = Plan {
            window,
            look_ahead,
            placement,
            order,
            increments,
            quadratures,
            centred,
            loud: LOUD,
        };
        // A causal window is louder than a centred one even on perfect stamps: who asks for one gets it.
        let mut track = Track::new(increments);
        for k in 0..window as i64 {
            track.push(k * 1000, (k - 1) * 1000, [0.0; 3], false);
        }
        let k = window - 1 - look_ahead;
        if k > 0 {
            let (_, gain) = plan.interpolate::<1>(&track, k, 0, window);
            plan.loud = LOUD.max(1.5 * gain.0[0]);
        }
        plan
    }

    /// Turns of intervals `first ..= last`; the run is known up to the track's end.
    pub(crate) fn steps(&self, track: &Track, first: usize, last: usize) -> Vec<Step> {
        let mut steps = Vec::with_capacity(last + 1 - first);
        let mut k = first;
        while k <= last {
            let path = self.path(track, k);
            let mut n = 1;
            while n < GROUP && k + n <= last && path != Path::Careful && self.path(track, k + n) == path
            {
                n += 1;
            }
            if n == GROUP && path != Path::Careful {
                self.group::<GROUP>(track, k, path, &mut steps);
                k += GROUP;
            } else {
                for k in k..k + n {
                    if path == Path::Careful {
                        steps.push(self.careful(track, k));
                    } else {
                        self.group::<1>(track, k, path, &mut steps);
                    }
                }
                k += n;
            }
        }
        steps
    }

    /// The path of interval k. Depends on stamps only.
    #[inline(always)]
    fn path(&self, track: &Track, k: usize) -> Path {
        let end = k + self.look_ahead + 1;
        if end > track.len() || end < self.window + track.first() || track.bridged[k] {
            return Path::Careful;
        }
        let first = end - self.window;
        if self.centred.is_some() && track.is_uniform(first, self.window) {
            Path::Uniform
        } else if track.is_joined(first, self.window) {
            Path::General
        } else {
            Path::Careful
        }
    }

    fn group<const N: usize>(&self, track: &Track, k: usize, path: Path, steps: &mut Vec<Step>) {
        let first = k + self.look_ahead + 1 - self.window;
        let mut loud = [false; N];
        let moments = match (&self.centred, path) {
            (Some(centred), Path::Uniform) => {
                let h = if self.increments {
                    Lanes::splat(1.0)
                } else {
                    Lanes(std::array::from_fn(|i| track.step(k + i)))
                };
                let end = first + self.window + N - 1;
                centred.moments::<N>(
                    &track.x[first..end],
                    &track.y[first..end],
                    &track.z[first..end],
                    h,
                )
            }
            _ => {
                let (moments, gain) = self.interpolate::<N>(track, k, first, self.window);
                loud = gain.0.map(|gain| !(gain <= self.loud));
                moments
            }
        };
        let turn = magnus::turn(&moments, self.order);
        // |v| = sin(a/2): the angle without trigonometry while it is small.
        let angle = small_angle(&turn);
        for i in 0..N {
            let ok = angle.0[i] >= 0.0 && !loud[i];
            if ok {
                steps.push(Step {
                    turn: turn.lane(i).parts(),
                    angle: angle.0[i],
                    gap_variance: 0.0,
            gap_noise: 0.0,
                    note: Note::Ordinary,
                });
            } else if loud[i] {
                steps.push(self.careful(track, k + i));
            } else {
                steps.push(Step::new(turn.lane(i), Note::Ordinary));
            }
        }
    }

    /// Moments of N neighbouring intervals from windows of `window` elements, the first beginning at
    /// `first`, and their noise gain.
    #[inline(always)]
    fn interpolate<const N: usize>(
        &self,
        track: &Track,
        k: usize,
        first: usize,
        window: usize,
    ) -> (Moments<N>, Lanes<N>) {
        let mut x = [Lanes::<N>::ZERO; POINTS];
        let mut values = [Triple::<N>::ZERO; POINTS];
        for i in 0..window {
            values[i] = track.values(first + i);
        }
        let ends: [(i64, i64); N] = std::array::from_fn(|lane| {
            let k = k + lane;
            // Joined increments begin where the one before ended; beside a hole only `start` is right.
            let from = if self.increments { track.start[k] } else { track.stamp[k - 1] };
            (from, track.stamp[k])
        });
        let length: [i64; N] = ends.map(|(a, b)| b.saturating_sub(a));
        let scale = Lanes(length.map(|h| h as f64)).recip();
        let coordinate = |stamps: &[i64]| {
            let stamps = &stamps[..N];
            let twice: [f64; N] = std::array::from_fn(|i| {
                // Whole nanoseconds, exact in f64 up to 104 days, subtracted before anything is rounded.
                let (a, b) = ends[i];
                stamps[i].saturating_sub(a) as f64 + stamps[i].saturating_sub(b) as f64
            });
            Lanes(twice) * scale
        };
        if self.increments {
            x[0] = coordinate(&track.start[first..]);
            for i in 0..window {
                x[i + 1] = coordinate(&track.stamp[first + i..]);
            }
            lagrange::from_increments(
                &x[..=window],
                &values[..window],
                k - first,
                &self.quadratures[window + 1],
            )
        } else {
            for i in 0..window {
                x[i] = coordinate(&track.stamp[first + i..]);
            }
            let inner = k - first;
            let reference = (values[inner - 1] + values[inner]) * 0.5;
            let h = Lanes(length.map(secs));
            lagrange::from_rates(
                &x[..window],
                &mut values[..window],
                reference,
                h,
                &self.quadratures[window],
            )
        }
    }

    /// One interval at an end of the run, beside or across a gap, or among irregular stamps.
    fn careful(&self, track: &Track, k: usize) -> Step {
        let hole = self.increments && track.has_hole(k);
        let bridged = hole || track.bridged[k];
        let missing = if bridged { self.missing(track, k, hole) } else { 0.0 };
        let cap = if bridged {
            self.window.min(bridge_window(missing) - usize::from(self.increments))
        } else {
            self.window
        };
        let own = self.settle(track, k, cap, false);
        let mut turn = magnus::turn(&own.moments, self.order);
        let mut change = own.change;
        if hole {
            let gap = self.settle(track, k, cap, true);
            change = gap.change;
            turn = magnus::turn(&gap.moments, self.order).then(turn);
        }
        let note = match (bridged, own.used < self.window) {
            (true, _) => Note::Bridged,
            (false, true) => Note::Reduced,
            (false, false) => Note::Ordinary,
        };
        let mut step = Step::new(turn, note);
        if step.note == Note::Bridged {
            let spread = 0.5 * change.min(std::f64::consts::PI);
            step.gap_variance = if spread.is_finite() { spread * spread } else { 0.0 };
            step.gap_noise = track.step(k) * bridge_noise(missing);
        }
        step
    }

    /// How many samples are missing in interval k, by the median spacing around it; 0.5 or more.
    fn missing(&self, track: &Track, k: usize, hole: bool) -> f64 {
        let mut around: Vec<i64> = (k.saturating_sub(8).max(1)..(k + 1 + self.look_ahead).min(track.len()))
            .filter(|&i| i != k && !track.bridged[i])
            .map(|i| track.stamp[i].saturating_sub(track.start[i].max(track.stamp[i - 1])))
            .filter(|&spacing| spacing > 0)
            .collect();
        if self.increments {
            let own = track.stamp[k].saturating_sub(track.start[k]);
            if hole && own > 0 {
                around.push(own);
            }
        }
        around.sort_unstable();
        let Some(&median) = around.get(around.len() / 2) else {
            return 1.0;
        };
        let empty = if hole {
            track.start[k].saturating_sub(track.stamp[k - 1]) as f64
        } else {
            track.spacing(k).saturating_sub(median) as f64
        };
        (empty / median as f64).max(0.5)
    }

    /// Moments of interval k (or of the hole before its increment) from a window of up to `cap` samples:
    /// all of them if that is quiet, otherwise as many as the data support.
    ///
    /// Starting from the smallest window, each larger one corrects the result. On smooth data the
    /// corrections shrink; where they are noise, they grow about fourfold with each pair of samples.
    /// The last window whose correction still shrank is taken.
    fn settle(&self, track: &Track, k: usize, cap: usize, hole: bool) -> Settled {
        let smallest = if self.increments { 1 } else { 2 };
        let mut best: Option<Settled> = None;
        let (mut before, mut last) = (f64::INFINITY, f64::INFINITY);
        let joined = !hole && (!self.increments || !self.beside_hole(track, k));
        let cap = if joined { cap } else { cap.min(collocation::UNKNOWNS) };
        let cap = self.place(track, k, cap.max(smallest), hole).1;
        let full = self.over(track, k, cap, hole);
        let mut sizes: Vec<usize> = (smallest..cap).step_by(2).collect();
        sizes.push(cap);
        if full.gain <= self.loud && !track.bridged[k] && !hole {
            return full;
        }
        for size in sizes {
            let mut this = if size == cap { full } else { self.over(track, k, size, hole) };
            if let Some(best) = &best {
                let change: f64 = (0..2)
                    .map(|j| (this.moments.b[j] - best.moments.b[j]).norm())
                    .sum();
                this.change = (this.moments.b[0] - best.moments.b[0]).norm();
                let shrank = change <= 0.5 * last.max(0.25 * before);
                if !(shrank && change.is_finite()) {
                    // What this size would have changed is what is not known.
                    let unknown = this.change;
                    let best = Settled { change: best.change.max(unknown), ..*best };
                    return best;
                }
                (before, last) = (last, change);
            }
            best = Some(this);
        }
        best.unwrap_or(full)
    }

    /// Whether increments are missing within reach of interval k.
    fn beside_hole(&self, track: &Track, k: usize) -> bool {
        let (first, size) = self.place(track, k, self.window, false);
        (first + 1..first + size).any(|i| track.has_hole(i))
    }

    /// First element and length of a window of up to `size` elements around interval k, as central as
    /// the run allows. It never reaches beyond what this method may wait for, so that nothing depends
    /// on how much happens to be known already.
    fn place(&self, track: &Track, k: usize, size: usize, hole: bool) -> (usize, usize) {
        let (lo, hi) = (track.first(), track.len());
        let known = match self.placement {
            Placement::Centred => hi,
            Placement::Causal => k + 1,
        };
        let size = size.min(known - lo);
        let ahead = if self.increments && !hole {
            (size - 1) / 2
        } else {
            (size / 2).saturating_sub(1)
        };
        let end = (k + 1 + ahead.min(self.look_ahead)).min(hi).max(lo + size);
        (end - size, size)
    }

    /// From `size` samples around interval k.
    fn over(&self, track: &Track, k: usize, size: usize, hole: bool) -> Settled {
        let (first, size) = self.place(track, k, size, hole);
        let joined = !hole && track.is_joined(first, size);
        let (moments, gain) = if joined {
            let (moments, gain) = self.interpolate::<1>(track, k, first, size);
            (moments, gain.0[0])
        } else {
            let quadrature = &self.quadratures[size];
            let target = if hole {
                (track.stamp[k - 1], track.start[k])
            } else {
                (track.start[k], track.stamp[k])
            };
            let mut moments = collocation::moments(track, first, size, target, quadrature);
            if !hole {
                moments.b[0] = track.value(k);
            }
            (moments, f64::INFINITY)
        };
        Settled {
            moments,
            gain,
            used: size,
            change: 0.0,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Path {
    Uniform,
    General,
    Careful,
}

#[derive(Clone, Copy, Debug)]
struct Settled {
    moments: Moments<1>,
    gain: f64,
    used: usize,
    /// How far the delta angle moved with the last enlargement of the window, rad.
    change: f64,
}

/// The window for a gap of `missing` samples (attitude.md 6.4): high order wins across short gaps and
/// loses across long ones.
fn bridge_window(missing: f64) -> usize {
    match missing {
        m if m < 2.5 => 8,
        m if m < 4.5 => 6,
        m if m < 8.5 => 4,
        _ => 2,
    }
}

/// Variance of the bridge over that of white noise integrated as long (attitude.md 6.4, squared and
/// rounded up); for two samples it is half the number missing.
fn bridge_noise(missing: f64) -> f64 {
    match missing {
        m if m < 2.5 => 4.0,
        m if m < 4.5 => 20.0,
        m if m < 8.5 => 34.0,
        m => 0.5 * m,
    }
}

/// The angle of each turn below half a radian; -1 where it is larger, or not a number.
#[inline(always)]
fn small_angle<const N: usize>(turn: &Turn<N>) -> Lanes<N> {
    let s2 = turn.v.norm_squared();
    let s = s2.sqrt();
    let terms = [
        1.0 / 6.0,
        3.0 / 40.0,
        15.0 / 336.0,
        105.0 / 3456.0,
        945.0 / 42240.0,
        10395.0 / 599_040.0,
    ];
    let mut sum = Lanes::splat(0.0);
    for t in terms.into_iter().rev() {
        sum = s2 * (Lanes::splat(t) + sum);
    }
    let angle = (s + s * sum) * 2.0;
    Lanes(std::array::from_fn(|i| {
        // Also false for a half angle beyond a quarter turn, where the cosine has lost more than it may.
        if s2.0[i] <= 0.0625 && turn.c.0[i] > -0.5 { angle.0[i] } else { -1.0 }
    }))
}
