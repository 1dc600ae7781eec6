//! Series of any length -> few points that keep every extreme. Pure.
//!
//! Apart from the plots because it runs once per sample: of each stretch of time the first, the smallest,
//! the largest and the last value are kept (M4: Jugel et al., VLDB 2014), so a line through them is
//! the line through all samples at the resolution of a stretch, and a spike of one sample stands out
//! among ten million. Stretches double when there are too many: memory does not grow with the log.

/// First, smallest, largest and last value of one series in one stretch, each with its time.
#[derive(Clone, Copy, Debug)]
struct Extremes {
    first: (i64, f64),
    min: (i64, f64),
    max: (i64, f64),
    last: (i64, f64),
}

impl Extremes {
    fn of(at: (i64, f64)) -> Extremes {
        Extremes {
            first: at,
            min: at,
            max: at,
            last: at,
        }
    }

    fn add(&mut self, later: &Extremes) {
        if later.min.1 < self.min.1 {
            self.min = later.min;
        }
        if later.max.1 > self.max.1 {
            self.max = later.max;
        }
        self.last = later.last;
    }

    /// Points in order of time, each once.
    fn points(&self) -> impl Iterator<Item = (i64, f64)> {
        let mut all = [self.first, self.min, self.max, self.last];
        all.sort_by_key(|(at, _)| *at);
        let mut before = None;
        all.into_iter()
            .filter(move |point| before.replace(*point) != Some(*point))
    }
}

#[derive(Clone, Copy, Debug)]
struct Stretch<const N: usize> {
    index: i64,
    /// Whether the line is interrupted before it.
    begins: bool,
    /// `None` = no finite value.
    series: [Option<Extremes>; N],
}

impl<const N: usize> Stretch<N> {
    fn add(&mut self, later: &Stretch<N>) {
        for (mine, theirs) in self.series.iter_mut().zip(&later.series) {
            match (mine, theirs) {
                (Some(mine), Some(theirs)) => mine.add(theirs),
                (mine @ None, theirs) => *mine = *theirs,
                (Some(_), None) => {}
            }
        }
    }
}

/// `N` series over one time, decimated as they come.
#[derive(Clone, Debug)]
pub struct Traces<const N: usize> {
    stretches: Vec<Stretch<N>>,
    most: usize,
    /// ns.
    width: i64,
    interrupted: bool,
    /// Values taken, finite or not.
    pub samples: u64,
}

impl<const N: usize> Traces<N> {
    /// Makes them for at most `most` stretches (at least 2), as short as they can be.
    #[must_use]
    pub fn new(most: usize) -> Traces<N> {
        Traces {
            stretches: Vec::new(),
            most: most.max(2),
            width: 1,
            interrupted: false,
            samples: 0,
        }
    }

    /// Takes the values at `at` ns, not before the last. A value that is not finite is left out.
    pub fn push(&mut self, at: i64, values: [f64; N]) {
        self.samples += 1;
        let series = values.map(|v| v.is_finite().then(|| Extremes::of((at, v))));
        let next = Stretch {
            index: at.div_euclid(self.width),
            begins: std::mem::take(&mut self.interrupted),
            series,
        };
        match self.stretches.last_mut() {
            Some(last) if last.index >= next.index => last.add(&next),
            _ => {
                self.stretches.push(next);
                while self.span() > self.most as i64 {
                    self.double();
                }
            }
        }
    }

    /// Interrupts: what comes next is not joined to what came before.
    pub fn interrupt(&mut self) {
        self.interrupted = true;
    }

    /// The same with at most `most` stretches.
    #[must_use]
    pub fn reduced(&self, most: usize) -> Traces<N> {
        let mut fewer = self.clone();
        fewer.most = most.max(2);
        while fewer.span() > fewer.most as i64 {
            fewer.double();
        }
        fewer
    }

    /// One series as `[x, y]`, x in units of `nanos`; NaN where the line is interrupted.
    #[must_use]
    pub fn points(&self, series: usize, nanos: f64) -> Vec<[f64; 2]> {
        let mut points: Vec<[f64; 2]> = Vec::new();
        for stretch in &self.stretches {
            let Some(extremes) = stretch.series.get(series).copied().flatten() else {
                continue;
            };
            if stretch.begins && !points.is_empty() {
                points.push([f64::NAN; 2]);
            }
            let scaled = |(at, v): (i64, f64)| [at as f64 / nanos, v];
            points.extend(extremes.points().map(scaled));
        }
        points
    }

    /// First and last time, ns.
    #[cfg(test)]
    fn ends(&self) -> Option<(i64, i64)> {
        let times = |s: &Stretch<N>| {
            let found = || s.series.iter().flatten();
            let first = found().map(|e| e.first.0).min();
            first.zip(found().map(|e| e.last.0).max())
        };
        let first = self.stretches.iter().find_map(times)?.0;
        let last = self.stretches.iter().rev().find_map(times)?.1;
        Some((first, last))
    }

    fn span(&self) -> i64 {
        match (self.stretches.first(), self.stretches.last()) {
            (Some(first), Some(last)) => last.index.saturating_sub(first.index).saturating_add(1),
            _ => 0,
        }
    }

    fn double(&mut self) {
        self.width = self.width.saturating_mul(2);
        self.stretches
            .iter_mut()
            .for_each(|s| s.index = s.index.div_euclid(2));
        self.stretches.dedup_by(|later, kept| {
            let same = later.index == kept.index;
            if same {
                kept.add(later);
            }
            same
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_of_one_sample_in_ten_million_is_kept_with_its_time() {
        let mut traces = Traces::<2>::new(1000);
        for k in 0..10_000_000_i64 {
            let spike = if k == 6_543_210 { -77.0 } else { 0.0 };
            traces.push(k * 1_000_000, [(k as f64 * 1e-5).sin() + spike, 1.0]);
        }
        let points = traces.points(0, 1e6);
        assert!(points.len() <= 4000, "{}", points.len());
        let lowest = points.iter().min_by(|a, b| a[1].total_cmp(&b[1]));
        assert!(
            lowest.is_some_and(|p| p[0] == 6_543_210.0 && p[1] < -75.0),
            "{lowest:?}"
        );
        assert!(points.is_sorted_by(|a, b| a[0] <= b[0]));
        let fewer = traces.reduced(50).points(0, 1e6);
        assert!(fewer.len() <= 200 && fewer.iter().any(|p| p[1] < -75.0));
        assert_eq!(traces.ends(), Some((0, 9_999_999_000_000)));
    }

    #[test]
    fn a_short_series_stays_what_it_is() {
        let mut traces = Traces::<1>::new(100);
        let values = [3.0, 1.0, f64::NAN, 2.0, 5.0];
        for (k, v) in values.iter().enumerate() {
            if k == 4 {
                traces.interrupt();
            }
            traces.push(k as i64 * 10_000_000, [*v]);
        }
        let points = traces.points(0, 1e7);
        let joined: Vec<_> = points.split(|p| p[0].is_nan()).map(<[_]>::to_vec).collect();
        assert_eq!(
            joined,
            [vec![[0.0, 3.0], [1.0, 1.0], [3.0, 2.0]], vec![[4.0, 5.0]]]
        );
    }

    #[test]
    fn far_apart_or_equal_times_end_and_keep_all_extremes() {
        let mut traces = Traces::<1>::new(10);
        for at in [0, 0, 0, i64::MAX / 2, i64::MAX] {
            traces.push(at, [at as f64]);
        }
        assert_eq!(traces.ends(), Some((0, i64::MAX)));
        assert!(Traces::<1>::new(0).points(0, 1.0).is_empty());
    }
}
