//! Intervals a fixed window would serve badly: at the ends of a run, beside and across gaps, among irregular
//! stamps. As many samples as the data support. Pure.

use super::{Note, Step, WindowKernel};
use crate::lanes::Lanes;
use crate::propagate::bridge::{self, NEIGHBOURS, Observation};
use crate::propagate::collocation;
use crate::propagate::columns::{Track, secs};
use crate::propagate::magnus::{self, MOMENTS, Moments};
use crate::propagate::method::{LARGEST_WINDOW, Placement};

/// Moments, and what is known about them.
#[derive(Clone, Copy, Debug)]
struct Settled {
    moments: Moments<1>,
    gain: f64,
    used: usize,
}

impl WindowKernel {
    /// One interval, with the window chosen by the data.
    pub(super) fn careful(&self, track: &Track, k: usize) -> Step {
        let hole = self.increments && track.has_hole(k);
        let bridged = hole || track.bridged[k];
        if !bridged {
            let own = self.settle(track, k);
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
        if self.increments && !hole {
            // Its increment covers the whole interval: marked, but nothing is missing.
            let own = self.settle(track, k);
            let turn = magnus::turn(&own.moments, self.order);
            return Step::new(turn, own.moments.b[0].norm(), Note::Bridged);
        }
        let (gap, variance) = self.bridge(track, k);
        let mut turn = magnus::turn(&gap, self.order);
        let mut delta = gap.b[0];
        if hole {
            let own = self.settle(track, k).moments;
            turn = turn.then(magnus::turn(&own, self.order));
            delta = delta + own.b[0];
        }
        let mut step = Step::new(turn, delta.norm(), Note::Bridged);
        if step.note == Note::Bridged {
            // Half a turn is as wrong as an attitude can be.
            let most = std::f64::consts::PI * std::f64::consts::PI;
            step.gap_variance = if variance < most { variance } else { most };
        }
        step
    }

    /// The rate over the samples missing in interval k, and the variance of what was turned there about each
    /// axis, rad^2.
    ///
    /// From what the samples around are like; by a polynomial where that is so smooth and free of noise that
    /// two orders differ by far less than a random motion would leave open.
    fn bridge(&self, track: &Track, k: usize) -> (Moments<1>, f64) {
        let (from, to) = self.gap(track, k);
        let (missing, step) = self.missing(track, k);
        let mut around = [Observation::NONE; NEIGHBOURS];
        let (first, count) = self.neighbours(track, k);
        for (sample, i) in around.iter_mut().zip(first..first + count) {
            *sample = self.observation(track, i, (from, to), step);
        }
        let quadrature = &self.quadratures[MOMENTS];
        let span = to.saturating_sub(from);
        let length = span as f64 / step;
        let h = secs(span);
        let Some(bridge) = bridge::across(&around[..count], length, missing, quadrature) else {
            let straight = self.over_gap(track, k, 2);
            return (straight, straight.b[0].size().0[0].powi(2));
        };
        let variance = bridge.variance * h * h;
        // Where there is noise, orders may agree by luck.
        let part = if bridge.noiseless { 1.0 } else { SMOOTH };
        if let Some((size, open)) = self.by_polynomial(track, k, step)
            && open < 3.0 * variance * part * part
        {
            return (self.over_gap(track, k, size), open);
        }
        (quadrature.of_rate(&bridge.values, Lanes([h])), variance)
    }

    /// Element i beside a gap, in ordinary steps.
    fn observation(
        &self,
        track: &Track,
        i: usize,
        (from, to): (i64, i64),
        step: f64,
    ) -> Observation {
        let begin = if self.increments {
            track.start[i]
        } else {
            track.stamp[i]
        };
        let length = track.stamp[i].saturating_sub(begin) as f64 / step;
        let twice = track.stamp[i].saturating_sub(to) as f64 + begin.saturating_sub(from) as f64;
        Observation {
            at: 0.5 * twice / step,
            spread: 0.5 * length * 0.6f64.sqrt(),
            rate: track.rate(i),
        }
    }

    /// Beginning and end of the stretch of interval k of which no sample tells, nanoseconds.
    fn gap(&self, track: &Track, k: usize) -> (i64, i64) {
        let to = if self.increments {
            track.start[k]
        } else {
            track.stamp[k]
        };
        (track.stamp[k - 1], to)
    }

    /// First element and number of those around the gap in interval k that are looked at: as many after it
    /// as before it, if the method waits for them.
    fn neighbours(&self, track: &Track, k: usize) -> (usize, usize) {
        let before = k - track.first();
        let after = (self.known(track, k) - k).min(self.look_ahead + 1);
        let after = after.min((NEIGHBOURS / 2).max(NEIGHBOURS.saturating_sub(before)));
        let before = before.min(NEIGHBOURS - after);
        (k - before, before + after)
    }

    /// Number of samples through which a polynomial over the gap in interval k is best laid, and the square of what it
    /// leaves open, rad^2: where one more order changes less and less, and less than the noise of its samples.
    fn by_polynomial(&self, track: &Track, k: usize, step: f64) -> Option<(usize, f64)> {
        let cap = if self.increments {
            collocation::UNKNOWNS
        } else {
            self.window.max(10)
        };
        let gap = self.gap(track, k);
        let (_, cap) = self.place(track, k, cap, true);
        let mut last = self.over_gap(track, k, 2);
        // The changes of the two orders before.
        let (mut before, mut earlier) = (f64::INFINITY, 0.0);
        // By size: what the next order would change, rad, and how much louder than a sample it is.
        let mut orders = [(f64::INFINITY, 0.0); LARGEST_WINDOW + 1];
        let mut noise = f64::INFINITY;
        let mut narrower = 2;
        for size in (4..cap).step_by(2).chain((cap > 2).then_some(cap)) {
            let this = self.over_gap(track, k, size);
            let change = (this.b[0] - last.b[0]).norm() + (this.b[1] - last.b[1]).norm();
            let (first, _) = self.place(track, k, size, true);
            let mut at = [0.0; LARGEST_WINDOW];
            for (at, i) in at.iter_mut().zip(first..first + size) {
                *at = self.observation(track, i, gap, step).at;
            }
            let gain = gain(&at[..size]);
            // All of a change may be noise, and none is more than the least.
            noise = noise.min(change * change / gain);
            // A small change may be luck: what the next order does change is known better.
            orders[narrower].0 = orders[narrower].0.max(change);
            let usual = f64::max(before, 0.25 * earlier);
            if change < 0.5 * usual && before.is_finite() {
                // The next change is to this one as this is to the one before.
                orders[size] = (change * (change / usual), gain);
            }
            if before.is_finite() {
                earlier = before;
            }
            (last, before, narrower) = (this, change, size);
        }
        let open = |noises: f64| {
            move |&(change, gain): &(f64, f64)| change * change + noises * noise * gain
        };
        let sizes = orders.iter().map(open(1.0)).enumerate();
        let (size, _) = sizes
            .filter(|(_, open)| open.is_finite())
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        // The least of several changes is less than noise makes one.
        Some((size, open(4.0)(&orders[size])))
    }

    /// Number of samples missing in interval k, 0.5 or more, and the ordinary step, ns: the median around.
    fn missing(&self, track: &Track, k: usize) -> (f64, f64) {
        let (first, count) = self.neighbours(track, k);
        let mut around = [0; NEIGHBOURS];
        let mut found = 0;
        for i in first.max(1)..first + count {
            let spacing = track.stamp[i].saturating_sub(track.start[i].max(track.stamp[i - 1]));
            if (i != k || self.increments) && !track.bridged[i] && spacing > 0 {
                around[found] = spacing;
                found += 1;
            }
        }
        let around = &mut around[..found];
        around.sort_unstable();
        let (from, to) = self.gap(track, k);
        let empty = to.saturating_sub(from);
        let Some(&step) = around.get(found / 2) else {
            // One of two steps.
            return (1.0, (0.5 * empty as f64).max(1.0));
        };
        let empty = if self.increments {
            empty
        } else {
            empty.saturating_sub(step)
        };
        ((empty as f64 / step as f64).max(0.5), step as f64)
    }

    /// Moments from the method's window: all of it if that is quiet, otherwise as many as
    /// the data support.
    ///
    /// Starting from the smallest window, each larger one corrects the result. On smooth data the
    /// corrections shrink; where they are noise they grow, about fourfold with each pair of samples, and
    /// without bound among irregular stamps. The last window whose correction still shrank is taken; the
    /// first correction is held against what the rate varies by around the interval.
    fn settle(&self, track: &Track, k: usize) -> Settled {
        let smallest = if self.increments { 1 } else { 2 };
        let mut cap = self.window.max(smallest);
        if self.increments && self.beside_hole(track, k) {
            cap = cap.min(collocation::UNKNOWNS);
        }
        let (first, cap) = self.place(track, k, cap, false);
        let full = self.over(track, k, cap);
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
        if full.gain <= loud {
            return full;
        }
        let variation = self.variation(track, k, smallest + 2);
        // The first moment itself, which one increment does not know: at the edge of three equal spacings up
        // to 1.25 times what rates vary by, among jittered ones 2. Its noise moves no delta angle.
        let unknown = if smallest == 1 { 4.0 } else { 2.0 };
        let (mut before, mut last) = (0.0, unknown * variation);
        let mut best: Option<Settled> = None;
        for size in (smallest..cap).step_by(2).chain([cap]) {
            let this = if size == cap {
                full
            } else {
                self.over(track, k, size)
            };
            if let Some(best) = best {
                let moved = |j: usize| (this.moments.b[j] - best.moments.b[j]).norm();
                let change = moved(0) + moved(1);
                let shrank = change <= shrinking * f64::max(last, 0.25 * before);
                if !shrank {
                    return best;
                }
                (before, last) = (last, change);
            }
            best = Some(this);
        }
        best.unwrap_or(full)
    }

    /// The largest difference of rates over `size` samples around interval k, times its length, rad.
    fn variation(&self, track: &Track, k: usize, size: usize) -> f64 {
        let (first, size) = self.place(track, k, size, false);
        let reference = track.rate(k);
        let largest = (first..first + size)
            .map(|i| (track.rate(i) - reference).norm())
            .fold(0.0, f64::max);
        largest * track.step(k)
    }

    /// Whether increments are missing within reach of interval k.
    fn beside_hole(&self, track: &Track, k: usize) -> bool {
        let (first, size) = self.place(track, k, self.window, false);
        (first + 1..first + size).any(|i| track.has_hole(i))
    }

    /// First element and length of a window of up to `size` elements around interval k, or around the gap in
    /// it, as central as the run allows. It never reaches beyond what this method may wait for, so that
    /// nothing depends on how much happens to be known already.
    fn place(&self, track: &Track, k: usize, size: usize, gap: bool) -> (usize, usize) {
        let (lo, hi) = (track.first(), track.len());
        let size = size.min(self.known(track, k) - lo);
        let ahead = if self.increments && !gap {
            size.saturating_sub(1) / 2
        } else {
            (size / 2).saturating_sub(1)
        };
        let end = (k + 1 + ahead.min(self.look_ahead)).min(hi).max(lo + size);
        (end - size, size)
    }

    /// End of what may be looked at for interval k.
    fn known(&self, track: &Track, k: usize) -> usize {
        // A method that never waits must not look ahead at the start of a run either.
        let waits = self.placement == Placement::Centred && self.look_ahead > 0;
        if waits { track.len() } else { k + 1 }
    }

    /// Interval k from `size` samples around it.
    fn over(&self, track: &Track, k: usize, size: usize) -> Settled {
        let (first, size) = self.place(track, k, size, false);
        let settled = |moments, gain| Settled {
            moments,
            gain,
            used: size,
        };
        let table = self.skewed.get(k - first).and_then(Option::as_ref);
        if table.is_some()
            && size == self.window
            && track.is_uniform(first, size)
            && let Some(table) = self.table(k - first)
        {
            // The method's own window on perfect stamps, one-sided because it was asked to be.
            return settled(self.tabulated::<1>(&table, track, k, first), 0.0);
        }
        if track.is_joined(first, size) {
            let (moments, gain) = self.interpolate::<1, 1>(track, k, first, size);
            return settled(moments, gain.0[0]);
        }
        let range = (track.start[k], track.stamp[k]);
        let quadrature = &self.quadratures[size];
        let mut moments = collocation::moments(track, first, size, range, quadrature);
        moments.b[0] = track.value(k);
        settled(moments, f64::INFINITY)
    }

    /// The gap in interval k from `size` samples around it.
    fn over_gap(&self, track: &Track, k: usize, size: usize) -> Moments<1> {
        let (first, size) = self.place(track, k, size, true);
        if self.increments {
            let quadrature = &self.quadratures[size];
            collocation::moments(track, first, size, self.gap(track, k), quadrature)
        } else {
            self.interpolate::<1, 1>(track, k, first, size).0
        }
    }
}

/// Sum of the squares of Lagrange's coefficients at 0 of the polynomial through these instants.
fn gain(at: &[f64]) -> f64 {
    let coefficient = |i: usize| -> f64 {
        let others = at.iter().enumerate().filter(|&(j, _)| j != i);
        others.map(|(_, x)| x / (x - at[i])).product()
    };
    (0..at.len()).map(|i| coefficient(i).powi(2)).sum()
}

/// Limit below which a polynomial bridges among noise: what it leaves open, as a share of what a random motion would.
const SMOOTH: f64 = 0.06;
