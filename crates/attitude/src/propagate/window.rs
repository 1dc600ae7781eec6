//! Samples from which an interval is integrated, and the path -> its turn. Pure.
//!
//! Four paths, chosen interval by interval from the data alone: equal spacings (constant table),
//! arbitrary stamps (general interpolation), a careful one where the window is one-sided, irregular or
//! bridges a gap, and collocation where increments are missing.

mod irregular;
mod step;

pub(crate) use self::step::{Note, Step};

use super::columns::{Track, secs};
use super::difference;
use super::lagrange::{self, POINTS, Quadrature};
use super::magnus::{self, Moments};
use super::method::{LARGEST_WINDOW, Order, Placement};
use super::turn::Turn;
use super::uniform::{Centred, Skewed};
use crate::lanes::{Lanes, Triple};
use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex, PoisonError, Weak};

/// Number of neighbouring intervals that go through the kernels together.
const GROUP: usize = 4;

/// Largest noise gain taken without asking the data: sum of squares of the interpolation's coefficients
/// at mid-interval. Two samples' mean has 0.5, a centred window of 16 equidistant ones 0.87; above 4
/// interpolation would double the noise of a single sample.
const LOUD: f64 = 4.0;

/// A sliding-window method, ready to run.
#[derive(Clone, Debug)]
pub(crate) struct WindowKernel {
    pub(crate) window: usize,
    placement: Placement,
    /// Samples needed beyond the end of the interval.
    pub(crate) look_ahead: usize,
    order: Order,
    increments: bool,
    /// Quadratures by number of interpolation points.
    quadratures: Vec<Quadrature>,
    centred: Option<Centred>,
    /// Tables by place of the interval in its window, where the method uses it on equal spacings.
    skewed: Vec<Option<Skewed>>,
    /// Largest noise gain taken unasked: [`LOUD`], or that of the method's own window if larger.
    loud: f64,
}

/// Key that makes two plans the same.
type Key = (usize, Order, Placement, bool, bool);

/// Plans in use: 40 kB each, which a thousand streams of one method share. No more than there are keys.
static PLANS: LazyLock<Mutex<HashMap<Key, Weak<WindowKernel>>>> = LazyLock::new(Mutex::default);

impl WindowKernel {
    /// The plan of every stream with this window, `provisional` ones with what those need.
    pub(crate) fn shared(
        window: usize,
        order: Order,
        placement: Placement,
        increments: bool,
        provisional: bool,
    ) -> Arc<Self> {
        let key = (window, order, placement, increments, provisional);
        // A map is whole after every statement.
        let mut plans = PLANS.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(plan) = plans.get(&key).and_then(Weak::upgrade) {
            return plan;
        }
        let plan = WindowKernel::new(window, order, placement, increments);
        let plan = Arc::new(match provisional {
            true => plan.with_provisional(),
            false => plan,
        });
        plans.insert(key, Arc::downgrade(&plan));
        plan
    }

    pub(crate) fn new(window: usize, order: Order, placement: Placement, increments: bool) -> Self {
        let look_ahead = match (placement, increments) {
            (Placement::Causal, _) => 0,
            (Placement::Centred, true) => (window - 1) / 2,
            (Placement::Centred, false) => window / 2 - 1,
        };
        let centred = if increments {
            (window % 2 == 1 && look_ahead == window / 2).then(|| Centred::for_increments(window))
        } else {
            (window.is_multiple_of(2) && look_ahead + 1 == window / 2)
                .then(|| Centred::for_rates(window))
        };
        let nominal = window - 1 - look_ahead;
        let table = skewed(window, nominal, increments);
        // A causal window is louder than a centred one even on perfect stamps: who asks for one gets it.
        let loud = LOUD.max(1.5 * table.gain);
        let mut tables = vec![None; window];
        if centred.is_none() {
            tables[nominal] = Some(table);
        }
        WindowKernel {
            window,
            look_ahead,
            placement,
            order,
            increments,
            quadratures: (0..=LARGEST_WINDOW + 1).map(Quadrature::new).collect(),
            centred,
            skewed: tables,
            loud,
        }
    }

    /// Whether [`Step::outer`] says how wrong the turns are.
    pub(crate) fn tells_error(&self) -> bool {
        difference::tells(self.window, self.order, self.increments)
    }

    /// Also fast for intervals whose look-ahead has not all come yet, as provisional steps need.
    pub(crate) fn with_provisional(mut self) -> Self {
        for place in self.nominal() + 1..self.window {
            self.skewed[place] = Some(skewed(self.window, place, self.increments));
        }
        self
    }

    /// Noise gain of a full window when the interval at `place` of it is a provisional step.
    fn provisional_gain(&self, place: usize) -> Option<f64> {
        let table = self.skewed.get(place).and_then(Option::as_ref)?;
        (place > self.nominal()).then_some(table.gain)
    }

    /// Place of an interval in its window when nothing is in the way.
    fn nominal(&self) -> usize {
        self.window - 1 - self.look_ahead
    }

    /// Turns of intervals `first ..= last`; the run is known up to the track's end.
    pub(crate) fn steps(&self, track: &Track, first: usize, last: usize) -> Vec<Step> {
        let mut steps = Vec::with_capacity(last + 1 - first);
        self.append_steps(track, first, last, &mut steps);
        steps
    }

    /// Appends, otherwise as [`steps`](Self::steps).
    pub(crate) fn append_steps(
        &self,
        track: &Track,
        first: usize,
        last: usize,
        steps: &mut Vec<Step>,
    ) {
        let mut k = first;
        while k <= last {
            let path = self.path(track, k);
            let mut n = 1;
            let slides = matches!(path, Path::Uniform | Path::General);
            while n < GROUP && k + n <= last && slides && self.path(track, k + n) == path {
                n += 1;
            }
            let first = (k + self.look_ahead + 1).wrapping_sub(self.window);
            if n == GROUP {
                self.group::<GROUP>(track, k, first, path, steps);
            } else if slides {
                for i in 0..n {
                    self.group::<1>(track, k + i, first + i, path, steps);
                }
            } else {
                n = self.newest(track, k, last, path, steps);
            }
            k += n;
        }
    }

    /// The path of interval k. Depends on stamps only.
    #[inline(always)]
    fn path(&self, track: &Track, k: usize) -> Path {
        let end = k + self.look_ahead + 1;
        let starting = end < self.window + track.first();
        if starting || track.bridged[k] || (self.increments && track.has_hole(k)) {
            return Path::Careful;
        }
        if end > track.len() {
            let known = track.len() >= self.window + track.first();
            let first = track.len().saturating_sub(self.window);
            let newest = known
                && self.provisional_gain(k - first).is_some()
                && track.is_uniform(first, self.window);
            return if newest { Path::Newest } else { Path::Careful };
        }
        let first = end - self.window;
        if track.is_uniform(first, self.window) {
            Path::Uniform
        } else if track.is_joined(first, self.window) {
            Path::General
        } else {
            Path::Careful
        }
    }

    /// Intervals k to k + N - 1 from sliding windows, the first beginning at `first`.
    fn group<const N: usize>(
        &self,
        track: &Track,
        k: usize,
        first: usize,
        path: Path,
        steps: &mut Vec<Step>,
    ) {
        let table = match path {
            Path::Uniform => self.table(k - first),
            _ => None,
        };
        if let Some(table) = table {
            let moments = self.tabulated::<N>(&table, track, k, first);
            return self.push(track, k, (&moments, [false; N]), steps);
        }
        let (moments, gain) = self.interpolate::<N, 1>(track, k, first, self.window);
        let loud = gain.0.map(|gain| gain > self.loud || gain.is_nan());
        self.push(track, k, (&moments, loud), steps);
    }

    /// Appends the steps of these moments, of intervals k to k + N - 1; those of a window too loud carefully.
    #[inline(never)]
    fn push<const N: usize>(
        &self,
        track: &Track,
        k: usize,
        (moments, loud): (&Moments<N>, [bool; N]),
        steps: &mut Vec<Step>,
    ) {
        let turn = magnus::turn(moments, self.order);
        // |v| = sin(a/2): the angle without trigonometry while it is small.
        let angle = small_angle(&turn, moments.b[0].size());
        let outer = self.outer(moments);
        for i in 0..N {
            let ok = angle.0[i] >= 0.0 && !loud[i];
            if ok {
                steps.push(Step {
                    turn: turn.lane(i).parts(),
                    angle: angle.0[i],
                    gap_variance: 0.0,
                    outer: [outer.x.0[i], outer.y.0[i], outer.z.0[i]],
                    note: Note::Ordinary,
                });
            } else if loud[i] {
                steps.push(self.careful(track, k + i));
            } else {
                let delta = moments.b[0].lane(i).norm();
                let step = Step::new(turn.lane(i), delta, Note::Ordinary);
                steps.push(step.with_outer(outer.lane(i)));
            }
        }
    }

    /// Appends interval k, and with it the next where that can be integrated beside it: the newest intervals of a run, of
    /// which not all look-ahead is there, have one window. How many they are.
    fn newest(
        &self,
        track: &Track,
        k: usize,
        last: usize,
        path: Path,
        steps: &mut Vec<Step>,
    ) -> usize {
        let is_pair = k < last && self.is_newest(track, k) && self.is_newest(track, k + 1);
        let first = track.len().saturating_sub(self.window);
        if path == Path::Newest {
            let tables = || self.table(k - first).zip(self.table(k + 1 - first));
            if is_pair && let Some((left, right)) = tables() {
                let left = self.tabulated::<1>(&left, track, k, first);
                let right = self.tabulated::<1>(&right, track, k + 1, first);
                self.push(track, k, (&left.beside(&right), [false; 2]), steps);
                return 2;
            }
            self.group::<1>(track, k, first, Path::Uniform, steps);
        } else if is_pair && !self.increments {
            let (moments, gain) = self.interpolate::<2, 0>(track, k, first, self.window);
            let is_quiet = |lane: usize| {
                let table = self.provisional_gain(k + lane - first);
                gain.0[lane] <= self.loud.max(1.5 * table.unwrap_or(0.0))
            };
            if !is_quiet(0) || !is_quiet(1) {
                steps.push(self.careful(track, k));
                return 1;
            }
            let (turn, outer) = (magnus::turn(&moments, self.order), self.outer(&moments));
            steps.extend([0, 1].map(|i| {
                let delta = moments.b[0].lane(i).norm();
                let step = Step::new(turn.lane(i), delta, Note::Ordinary);
                step.with_outer(outer.lane(i))
            }));
            return 2;
        } else {
            steps.push(self.careful(track, k));
        }
        1
    }

    /// Whether interval k is integrated, provisionally, from the newest window of its run.
    fn is_newest(&self, track: &Track, k: usize) -> bool {
        let first = track.len().saturating_sub(self.window);
        let is_whole = track.len() >= self.window + track.first();
        is_whole
            && self.look_ahead > 0
            && k + self.look_ahead >= track.len()
            && !track.bridged[k]
            && track.is_joined(first, self.window)
            && self.provisional_gain(k - first).is_some()
    }

    /// Change of the turn by the outermost samples, rad, in the axes at its end: to first order
    /// in the change and in half the turn.
    #[inline(always)]
    fn outer<const N: usize>(&self, moments: &Moments<N>) -> Triple<N> {
        let changed = if self.increments {
            // Only the coning changes, by b_0 x b_1 / 6; b_1 is four times the angle half-way.
            moments.outer.cross(moments.b[0])
        } else {
            moments.outer
        };
        changed + changed.cross(moments.b[0]) * 0.5
    }

    /// The table of equally spaced windows in which the interval ends at `place`; `None` where there is none.
    fn table(&self, place: usize) -> Option<Table<'_>> {
        match &self.centred {
            Some(centred) if place == self.nominal() => Some(Table::Centred(centred)),
            _ => self.skewed.get(place)?.as_ref().map(Table::Skewed),
        }
    }

    /// Moments of N neighbouring intervals from equally spaced windows, the first beginning at `first`.
    #[inline(always)]
    fn tabulated<const N: usize>(
        &self,
        table: &Table<'_>,
        track: &Track,
        k: usize,
        first: usize,
    ) -> Moments<N> {
        let h = if self.increments {
            Lanes::splat(1.0)
        } else {
            Lanes(std::array::from_fn(|i| track.step(k + i)))
        };
        let end = first + self.window + N - 1;
        let xyz = [
            &track.x[first..end],
            &track.y[first..end],
            &track.z[first..end],
        ];
        match table {
            Table::Centred(centred) => centred.moments(xyz, h),
            Table::Skewed(skewed) => skewed.moments(xyz, h),
        }
    }

    /// Moments of N neighbouring intervals from windows of `window` elements, the first beginning at
    /// `first` and each by STEP behind the one before, and their noise gain.
    fn interpolate<const N: usize, const STEP: usize>(
        &self,
        track: &Track,
        k: usize,
        first: usize,
        window: usize,
    ) -> (Moments<N>, Lanes<N>) {
        // Arrays no longer than need be: to clear them is a good part of a short window's cost.
        match window + usize::from(self.increments) {
            0..=8 => self.interpolate_in::<N, STEP, 8>(track, k, first, window),
            9..=16 => self.interpolate_in::<N, STEP, 16>(track, k, first, window),
            _ => self.interpolate_in::<N, STEP, POINTS>(track, k, first, window),
        }
    }

    /// Same as [`interpolate`](Self::interpolate), through at most P points.
    #[inline(always)]
    fn interpolate_in<const N: usize, const STEP: usize, const P: usize>(
        &self,
        track: &Track,
        k: usize,
        first: usize,
        window: usize,
    ) -> (Moments<N>, Lanes<N>) {
        let mut x = [Lanes::<N>::ZERO; P];
        let mut values = [Triple::<N>::ZERO; P];
        for (i, value) in values[..window].iter_mut().enumerate() {
            *value = track.values::<N, STEP>(first + i);
        }
        let ends: [(i64, i64); N] = std::array::from_fn(|lane| {
            let k = k + lane;
            // Joined increments begin where the one before ended; beside a hole only `start` is right.
            let from = if self.increments {
                track.start[k]
            } else {
                track.stamp[k - 1]
            };
            (from, track.stamp[k])
        });
        let length: [i64; N] = ends.map(|(a, b)| b.saturating_sub(a));
        let scale = Lanes(length.map(|h| h as f64)).recip();
        let coordinate = |stamps: &[i64]| {
            let stamps = &stamps[..1 + STEP * (N - 1)];
            let twice: [f64; N] = std::array::from_fn(|i| {
                // Whole nanoseconds, exact in f64 up to 104 days, subtracted before anything is rounded.
                let (a, b) = ends[i];
                let stamp = stamps[STEP * i];
                stamp.saturating_sub(a) as f64 + stamp.saturating_sub(b) as f64
            });
            Lanes(twice) * scale
        };
        let place: [usize; N] = std::array::from_fn(|lane| k + lane - (first + STEP * lane));
        let inner = place.map(|place| lagrange::inner(window, place, self.increments));
        if self.increments {
            x[0] = coordinate(&track.start[first..]);
            for i in 0..window {
                x[i + 1] = coordinate(&track.stamp[first + i..]);
            }
            let (x, values) = (&x[..=window], &values[..window]);
            let quadrature = &self.quadratures[window + 1];
            lagrange::from_increments::<N, P>(x, values, place[0], &inner, quadrature)
        } else {
            for i in 0..window {
                x[i] = coordinate(&track.stamp[first + i..]);
            }
            let reference = Triple::of_lanes(|lane| {
                let [before, at] = [place[lane] - 1, place[lane]];
                (values[before].lane(lane) + values[at].lane(lane)) * 0.5
            });
            let h = Lanes(length.map(secs));
            let (x, values) = (&x[..window], &mut values[..window]);
            let quadrature = &self.quadratures[window];
            lagrange::from_rates::<N, P>(x, values, reference, h, &inner, quadrature)
        }
    }
}

/// Table of the moments of one equally spaced window.
enum Table<'t> {
    Centred(&'t Centred),
    Skewed(&'t Skewed),
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Path {
    Uniform,
    General,
    /// Equal spacings, but not all look-ahead is there: the newest window, if the method takes it.
    Newest,
    Careful,
}

fn skewed(window: usize, place: usize, increments: bool) -> Skewed {
    if increments {
        Skewed::for_increments(window, place)
    } else {
        Skewed::for_rates(window, place)
    }
}

/// The angle of each turn below half a radian, to 1e-10 of it; -1 where it is larger, or not a number.
/// `delta` is a size not below that of the delta angle.
#[inline(always)]
fn small_angle<const N: usize>(turn: &Turn<N>, delta: Lanes<N>) -> Lanes<N> {
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
        let once = delta.0[i] <= std::f64::consts::PI;
        if once && s2.0[i] <= 0.0625 && turn.c.0[i] > -0.5 {
            angle.0[i]
        } else {
            -1.0
        }
    }))
}
