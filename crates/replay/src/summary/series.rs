//! Series of a run to draw: curves over time, marks, errors against a reference. Pure.
//!
//! Filled by the pipeline while it runs, drawn by the page; bounded whatever the length of the run.

use super::trace::Traces;
use strapd_attitude::compare::{Comparison, Consistency};
use strapd_attitude::record::Nanos;

/// Series of one topic to draw.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Stretches each series was given.
    pub stretches: usize,
    /// Rate about x, y, z (deg/s, body axes, bias removed), roll, pitch, yaw (deg), sigma of tilt and of heading (deg).
    pub series: Traces<8>,
    /// Innovations, deg: of gravity along x and y with three sigma, of heading with three sigma. Empty where nothing
    /// corrects.
    pub innovations: Traces<5>,
    /// One per [`Mark`]: where, with its length in ns.
    pub marks: Vec<Traces<1>>,
    /// Stamps to the axis of time.
    pub elapsed: Elapsed,
    /// Errors against the reference; `None` if none was sought.
    pub errors: Option<Errors>,
}

/// A kind of thing that is marked on the axis of time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Mark {
    /// A gap that was bridged.
    Bridged,
    /// A gap or clock jump over which the attitude was held.
    Held,
    /// One at which it was reset.
    Reset,
    /// A sample with NaN or infinity.
    NotFinite,
    /// A sample lost for another reason.
    Lost,
    /// A sample at the gyro's range, or a step of more than half a turn.
    Saturated,
    /// A sample put back in order, or given a stamp of its own.
    Moved,
}

impl Mark {
    /// Every kind, in the order of [`Drawn::marks`].
    pub const ALL: [Mark; 7] = [
        Mark::Bridged,
        Mark::Held,
        Mark::Reset,
        Mark::NotFinite,
        Mark::Lost,
        Mark::Saturated,
        Mark::Moved,
    ];

    /// Name for machines.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Mark::Bridged => "gap_bridged",
            Mark::Held => "gap_held",
            Mark::Reset => "reset",
            Mark::NotFinite => "not_finite",
            Mark::Lost => "lost",
            Mark::Saturated => "too_fast",
            Mark::Moved => "stamp_moved",
        }
    }

    /// Name in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Mark::Bridged => "gap bridged",
            Mark::Held => "gap held",
            Mark::Reset => "reset",
            Mark::NotFinite => "NaN, infinite",
            Mark::Lost => "lost otherwise",
            Mark::Saturated => "too fast",
            Mark::Moved => "stamp moved",
        }
    }
}

/// Errors against a reference.
#[derive(Clone, Debug)]
pub struct Errors {
    /// Every how many samples one was kept.
    pub stride: u64,
    /// Reference attitudes that could be used.
    pub usable: usize,
    /// Number of those that are no rotation.
    pub unusable: u64,
    /// Resets of the reference by its source, ns on the axis of time.
    pub resets: Vec<i64>,
    /// Whether the run's own sigma holds, with tilt, three sigma of it, heading (signed), three sigma of it over
    /// time, deg.
    pub bounds: Option<(Consistency, Traces<4>)>,
    /// One per meaning of a sample that found a reference.
    pub traces: Vec<ErrorTrace>,
}

/// Errors over time for one meaning of a sample.
#[derive(Clone, Debug)]
pub struct ErrorTrace {
    /// Name.
    pub kind: &'static str,
    /// Meaning in words.
    pub meaning: &'static str,
    /// Whether it is the one the run took.
    pub is_used: bool,
    /// The numbers.
    pub comparison: Comparison,
    /// Total, heading (signed), inclination, deg.
    pub trace: Traces<3>,
}

/// Longest step of the axis that is shown as it is, ns, while ten times what came before is shorter.
const LONGEST: i64 = 3_600_000_000_000;
/// Pieces of the axis that are kept, and cuts that are told one by one.
const KEPT: usize = 1000;

/// Stamps -> ns from the first, on an axis that never goes back. Where a clock jumps (back, or so
/// far ahead that nothing else could be seen) the axis is cut.
#[derive(Clone, Debug, Default)]
pub struct Elapsed {
    pieces: Vec<(Nanos, i64)>,
    first: Option<Nanos>,
    last: Option<Nanos>,
    x: i64,
    /// Number of times it was cut.
    pub cuts: u64,
    /// The first cuts: where on the axis, and by how many ns the clock jumped.
    pub kept: Vec<(i64, i64)>,
}

impl Elapsed {
    /// The next stamp's place.
    pub fn advance(&mut self, stamp: Nanos) -> i64 {
        let Some(last) = self.last.replace(stamp) else {
            self.first = Some(stamp);
            self.pieces.push((stamp, 0));
            return 0;
        };
        let step = stamp.since(last);
        if (0..=LONGEST.max(self.x.saturating_mul(10))).contains(&step) {
            self.x = self.x.saturating_add(step);
            return self.x;
        }
        self.cuts += 1;
        if self.kept.len() < KEPT {
            self.kept.push((self.x, step));
        }
        self.x = self.x.saturating_add(self.x / 50 + 1);
        if self.pieces.len() < KEPT {
            self.pieces.push((stamp, self.x));
        }
        self.x
    }

    /// Place of a stamp, as far as that is certain: on the last piece that begins before it.
    #[must_use]
    pub fn at(&self, stamp: Nanos) -> i64 {
        let begun = |(from, _): &&(Nanos, i64)| *from <= stamp;
        match self.pieces.iter().rev().find(begun) {
            Some((from, x)) => x.saturating_add(stamp.since(*from)).min(self.x),
            None => 0,
        }
    }

    /// End of the axis, ns.
    #[must_use]
    pub fn x(&self) -> i64 {
        self.x
    }

    /// First and last stamp.
    #[cfg(test)]
    fn ends(&self) -> Option<(Nanos, Nanos)> {
        self.first.zip(self.last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_is_cut_where_the_clock_jumps_and_only_there() {
        let sec = |s: i64| Nanos(s * 1_000_000_000);
        let mut axis = Elapsed::default();
        let places: Vec<i64> = [0, 1, 1_700_000_000, 1_700_000_009, 1_700_000_004]
            .map(|s| axis.advance(sec(s)))
            .to_vec();
        assert!(
            places.is_sorted() && places[1] == 1_000_000_000,
            "{places:?}"
        );
        assert!(axis.x() < 11_000_000_000, "{places:?}");
        assert_eq!(axis.cuts, 2);
        assert_eq!(axis.kept[1].1, -5_000_000_000);
        assert_eq!(axis.at(sec(1)), places[1]);
        assert_eq!(axis.ends(), Some((sec(0), sec(1_700_000_004))));
    }
}
