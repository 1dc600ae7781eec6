//! Intervals a fixed window would serve badly: at the ends of a run, beside and across gaps, among irregular
//! stamps. As many samples as the data support. Pure.

use super::{Note, Plan, Step};
use crate::propagate::collocation;
use crate::propagate::magnus::{self, Moments};
use crate::propagate::method::{LARGEST_WINDOW, Placement};
use crate::propagate::track::Track;

/// Moments, and what is known about them.
#[derive(Clone, Copy, Debug)]
struct Settled {
    moments: Moments<1>,
    gain: f64,
    used: usize,
    /// How far the delta angle moved with the last enlargement of the window, rad.
    change: f64,
}

/// What is integrated over.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Target {
    /// The interval of rates, or of the increment itself.
    Interval,
    /// The interval, but samples are missing in it.
    Bridge,
    /// The stretch before an increment that no increment covers.
    Hole,
}

impl Plan {
    /// One interval, with the window chosen by the data.
    pub(super) fn careful(&self, track: &Track, k: usize) -> Step {
        let hole = self.increments && track.has_hole(k);
        let bridged = hole || track.bridged[k];
        if !bridged {
            let own = self.settle(track, k, self.window, Target::Interval);
            let note = if own.used < self.window {
                Note::Reduced
            } else {
                Note::Ordinary
            };
            let turn = magnus::turn(&own.moments, self.order);
            let mut moments = own.moments;
            if own.used <= if self.increments { 1 } else { 2 } && k > track.first() {
                // No window is narrower. Two rates miss a twelfth of the second difference, one increment
                // the coning of the first; the first difference stands for both, while there is no other.
                let change = (track.rate(k) - track.rate(k - 1)) * track.step(k);
                moments.outer = change * (1.0 / 12.0);
            }
            let outer = self.outer(&moments);
            return Step::new(turn, own.moments.b[0].norm(), note).with_outer(outer);
        }
        let missing = self.missing(track, k);
        let cap = self.window.min(bridge_window(missing));
        let mut noise = bridge_noise(missing);
        let (turn, delta, change) = if hole {
            let gap = self.settle(track, k, cap, Target::Hole);
            let own = self.settle(track, k, self.window, Target::Interval);
            let delta = (gap.moments.b[0] + own.moments.b[0]).norm();
            let own = magnus::turn(&own.moments, self.order);
            let turn = magnus::turn(&gap.moments, self.order).then(own);
            (turn, delta, gap.change)
        } else if self.increments {
            // Its increment covers the whole interval: marked, but nothing is missing.
            let own = self.settle(track, k, self.window, Target::Interval);
            let turn = magnus::turn(&own.moments, self.order);
            (turn, own.moments.b[0].norm(), 0.0)
        } else {
            let own = self.settle(track, k, cap, Target::Bridge);
            let turn = magnus::turn(&own.moments, self.order);
            if own.used > QUIET_BRIDGE {
                // The mid-interval gain bounds that of the rate over the gap, of `missing + 1` spacings.
                noise = noise.max(own.gain * (missing + 1.0));
            }
            (turn, own.moments.b[0].norm(), own.change)
        };
        let mut step = Step::new(turn, delta, Note::Bridged);
        if step.note == Note::Bridged && (hole || !self.increments) {
            let spread = 0.5 * change.min(std::f64::consts::PI);
            step.gap_variance = if spread.is_finite() {
                spread * spread
            } else {
                0.0
            };
            step.gap_noise = track.step(k) * noise;
        }
        step
    }

    /// How many samples are missing in interval k, by the median spacing around it; 0.5 or more.
    fn missing(&self, track: &Track, k: usize) -> f64 {
        let reach = k.saturating_sub(8).max(1)..(k + 1 + self.look_ahead).min(track.len());
        let spacing =
            |i: usize| track.stamp[i].saturating_sub(track.start[i].max(track.stamp[i - 1]));
        let mut around: Vec<i64> = reach
            .filter(|&i| (i != k || self.increments) && !track.bridged[i])
            .map(spacing)
            .filter(|&spacing| spacing > 0)
            .collect();
        around.sort_unstable();
        let Some(&median) = around.get(around.len() / 2) else {
            return 1.0;
        };
        let empty = if self.increments {
            track.start[k].saturating_sub(track.stamp[k - 1])
        } else {
            track.spacing(k).saturating_sub(median)
        };
        (empty as f64 / median as f64).max(0.5)
    }

    /// Moments from a window of up to `cap` samples: all of them if that is quiet, otherwise as many as
    /// the data support.
    ///
    /// Starting from the smallest window, each larger one corrects the result. On smooth data the
    /// corrections shrink; where they are noise they grow, about fourfold with each pair of samples, and
    /// without bound among irregular stamps. The last window whose correction still shrank is taken; the
    /// first correction is held against what the rate varies by around the interval.
    fn settle(&self, track: &Track, k: usize, cap: usize, target: Target) -> Settled {
        let smallest = if self.increments && target == Target::Interval {
            1
        } else {
            2
        };
        let mut cap = cap.max(smallest);
        if target == Target::Hole || (self.increments && self.beside_hole(track, k)) {
            cap = cap.min(collocation::UNKNOWNS);
        }
        let (first, cap) = self.place(track, k, cap, target);
        let full = self.over(track, k, cap, target);
        // A provisional step is one-sided by its nature, and gone with the next samples.
        let provisional = if cap == self.window {
            self.provisional_gain(k - first)
        } else {
            None
        };
        let (loud, shrinking) = match provisional {
            Some(gain) => (self.loud.max(1.5 * gain), 0.9),
            None => (self.loud, 0.5),
        };
        if full.gain <= loud && target == Target::Interval {
            return full;
        }
        // A bridge of two samples still wants to know what four would have said.
        let probe = smallest + 2;
        let probe = (target != Target::Interval && probe > cap).then_some(probe);
        let sizes = (smallest..cap).step_by(2).chain([cap]).chain(probe);
        let variation = self.variation(track, k, smallest + 2, target);
        // The first moment itself, which one increment does not know: at the edge of three equal spacings up
        // to 1.25 times what rates vary by, among jittered ones 2. Its noise moves no delta angle.
        let unknown = if smallest == 1 { 4.0 } else { 2.0 };
        let (mut before, mut last) = (0.0, unknown * variation);
        let mut best: Option<Settled> = None;
        for size in sizes {
            let mut this = if size == cap {
                full
            } else {
                self.over(track, k, size, target)
            };
            if let Some(best) = best {
                let moved = |j: usize| (this.moments.b[j] - best.moments.b[j]).norm();
                let (change, turned) = (moved(0) + moved(1), moved(0));
                let shrank = change <= shrinking * f64::max(last, 0.25 * before);
                if !shrank || size > cap {
                    // What this size would have changed is what is not known.
                    // Two samples leave open all the rate is seen to vary by.
                    let least = if best.used == smallest {
                        variation
                    } else {
                        best.change
                    };
                    let change = turned.max(least);
                    return Settled { change, ..best };
                }
                this.change = turned;
                (before, last) = (last, change);
            }
            best = Some(this);
        }
        best.unwrap_or(full)
    }

    /// The largest difference of rates over `size` samples around interval k, times its length, rad.
    fn variation(&self, track: &Track, k: usize, size: usize, target: Target) -> f64 {
        let (first, size) = self.place(track, k, size, target);
        let reference = track.rate(k);
        let largest = (first..first + size)
            .map(|i| (track.rate(i) - reference).norm())
            .fold(0.0, f64::max);
        largest * track.step(k)
    }

    /// Whether increments are missing within reach of interval k.
    fn beside_hole(&self, track: &Track, k: usize) -> bool {
        let (first, size) = self.place(track, k, self.window, Target::Interval);
        (first + 1..first + size).any(|i| track.has_hole(i))
    }

    /// First element and length of a window of up to `size` elements around interval k, as central as
    /// the run allows. It never reaches beyond what this method may wait for, so that nothing depends
    /// on how much happens to be known already.
    fn place(&self, track: &Track, k: usize, size: usize, target: Target) -> (usize, usize) {
        let (lo, hi) = (track.first(), track.len());
        // A method that never waits must not look ahead at the start of a run either.
        let waits = self.placement == Placement::Centred && self.look_ahead > 0;
        let known = if waits { hi } else { k + 1 };
        let size = size.min(known - lo);
        let ahead = if self.increments && target != Target::Hole {
            size.saturating_sub(1) / 2
        } else {
            (size / 2).saturating_sub(1)
        };
        let end = (k + 1 + ahead.min(self.look_ahead)).min(hi).max(lo + size);
        (end - size, size)
    }

    /// From `size` samples around interval k.
    fn over(&self, track: &Track, k: usize, size: usize, target: Target) -> Settled {
        let (first, size) = self.place(track, k, size, target);
        let settled = |moments, gain| Settled {
            moments,
            gain,
            used: size,
            change: 0.0,
        };
        let table = self.skewed.get(k - first).and_then(Option::as_ref);
        if table.is_some()
            && (size, target) == (self.window, Target::Interval)
            && track.is_uniform(first, size)
            && let Some(moments) = self.tabulated::<1>(track, k, first)
        {
            // The method's own window on perfect stamps, one-sided because it was asked to be.
            return settled(moments, 0.0);
        }
        if target != Target::Hole && track.is_joined(first, size) {
            let (moments, gain) = self.interpolate::<1>(track, k, first, size);
            return settled(moments, gain.0[0]);
        }
        let quadrature = &self.quadratures[size];
        let range = match target {
            Target::Hole => (track.stamp[k - 1], track.start[k]),
            _ => (track.start[k], track.stamp[k]),
        };
        let mut moments = collocation::moments(track, first, size, range, quadrature);
        if target != Target::Hole {
            moments.b[0] = track.value(k);
        }
        settled(moments, f64::INFINITY)
    }
}

/// Largest window [`bridge_noise`] has a figure for.
const QUIET_BRIDGE: usize = 8;

/// The largest window for a gap of `missing` samples (attitude.md 6.4): high order wins across short gaps
/// and loses across long ones. Across one or two missing samples a full window of 16 is hardly louder
/// than one of 8 (2.6 against 1.6 for one), so there the data alone decide, see `settle`.
fn bridge_window(missing: f64) -> usize {
    match missing {
        m if m < 2.5 => LARGEST_WINDOW,
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
