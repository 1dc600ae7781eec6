//! Rates of one topic -> axes that froze while others moved. Pure.
//!
//! A stage of its own because it is counted along with the samples: an axis that hangs for a while and comes back shows in
//! no mean. Frozen is what repeats one reading far longer than this axis ever does, while another axis moves, and goes on
//! with a leap; whole deg/s repeat themselves, too, where a smooth motion stays within one step, and so does what reads
//! about nothing. `docs/theory/consistency.md` has the numbers.

/// Fewest samples, and by the samples for which the axis usually repeats a reading.
const LEAST: u64 = 25;
const TIMES_USUAL: f64 = 20.0;
/// Samples in which another axis moves that an axis without any change is dead after.
const DEAD: u64 = 100;
/// Rate of another axis, rad/s, at which it surely moves.
const MOVES: f64 = 0.3;
/// Changes of an axis after which its usual run is known.
const KNOWN: u64 = 16;
/// Steps of the axis that a frozen one leaps by when it comes back: a coarse one goes on by one.
const LEAP: f64 = 4.0;
/// One that never came back has hung for so many samples in which another axis moves, and for so many times the longest
/// it had ever stayed within one step.
const HANGS: u64 = 100;
const TIMES_LONGEST: u64 = 4;
/// Readings below so many of the axis's smallest steps are about nothing: a rotation about another axis gives them.
const NOTHING: f64 = 4.0;

/// Reading that an axis hung at.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FrozenAxis {
    /// Reading, source's unit.
    pub reading: f64,
    /// Samples in a row with it.
    pub samples: u64,
}

#[derive(Clone, Copy, Debug)]
struct Axis {
    last: f64,
    samples: u64,
    changes: u64,
    /// Samples in a row that repeat the last reading, and those of them in which another axis moved.
    run: u64,
    moved: u64,
    /// The longest of them that ended with a small step.
    longest: u64,
    quantum: f64,
    found: Option<FrozenAxis>,
}

/// Readings of three axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrozenAxes {
    axes: [Axis; 3],
    /// One rad/s in the unit of the source.
    rad: f64,
}

impl FrozenAxes {
    /// Watch over rates of which `rad` are one rad/s.
    pub(super) fn new(rad: f64) -> FrozenAxes {
        let axis = Axis {
            last: f64::NAN,
            samples: 0,
            changes: 0,
            run: 0,
            moved: 0,
            longest: 0,
            quantum: f64::INFINITY,
            found: None,
        };
        FrozenAxes {
            axes: [axis; 3],
            rad,
        }
    }

    /// Takes the next rates, which are finite.
    pub(super) fn push(&mut self, gyro: &[f64; 3]) {
        let mut moves = [false; 3];
        for (moves, (axis, rate)) in moves.iter_mut().zip(self.axes.iter().zip(gyro)) {
            *moves = axis.last != *rate && rate.abs() > MOVES * self.rad;
        }
        let [x, y, z] = moves;
        let others = [y || z, x || z, x || y];
        for ((axis, rate), other) in self.axes.iter_mut().zip(gyro).zip(others) {
            axis.push(*rate, other);
        }
    }

    /// The only reading of each axis that has but one, while another moved for long.
    pub(super) fn dead(&self) -> [Option<f64>; 3] {
        self.axes
            .map(|axis| (axis.changes == 1 && axis.moved >= DEAD).then_some(axis.last))
    }

    /// The longest that each axis was frozen.
    pub(super) fn found(&self) -> [Option<FrozenAxis>; 3] {
        self.axes.map(|axis| axis.found)
    }
}

impl Axis {
    fn push(&mut self, rate: f64, other_moves: bool) {
        self.samples += 1;
        if rate != self.last {
            let change = (rate - self.last).abs();
            let leaps = change > LEAP * self.quantum;
            if !leaps {
                self.longest = self.longest.max(self.run);
            } else if self.is_frozen() {
                self.note();
            }
            if change > 0.0 {
                self.quantum = self.quantum.min(change);
            }
            (self.last, self.run, self.moved) = (rate, 0, 0);
            self.changes += 1;
            return;
        }
        self.run += 1;
        self.moved += u64::from(other_moves);
        if self.moved >= HANGS && self.run > TIMES_LONGEST * self.longest && self.is_frozen() {
            self.note();
        }
    }

    fn note(&mut self) {
        if self.run >= self.found.map_or(0, |found| found.samples) {
            self.found = Some(FrozenAxis {
                reading: self.last,
                samples: self.run + 1,
            });
        }
    }

    fn is_frozen(&self) -> bool {
        let usual = (self.samples - self.run) as f64 / self.changes.max(1) as f64;
        self.changes >= KNOWN
            && self.moved >= LEAST
            && self.moved as f64 >= TIMES_USUAL * usual
            && self.last.abs() > NOTHING * self.quantum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty seconds of a swing at 100 Hz in steps of `step`, whose x hangs from 10 to 11 s where it does.
    fn swing(step: f64, hangs: bool) -> [Option<FrozenAxis>; 3] {
        let mut frozen = FrozenAxes::new(1.0);
        let read = |rate: f64| (rate / step).round() * step;
        for n in 0..2000 {
            let t = f64::from(n) * 0.01;
            let at = if hangs && (1000..1100).contains(&n) {
                10.0
            } else {
                t
            };
            let rates = [(1.7 * at).sin(), (1.3 * t).cos(), 0.2 * (0.7 * t).sin()];
            frozen.push(&rates.map(read));
        }
        frozen.found()
    }

    #[test]
    fn an_axis_that_hangs_while_others_move_is_frozen_at_its_reading() {
        let [x, y, z] = swing(1e-4, true);
        assert!(
            x.is_some_and(|found| (98..103).contains(&found.samples)),
            "{x:?}"
        );
        assert!(
            x.is_some_and(|found| (found.reading + 0.961).abs() < 1e-3),
            "{x:?}"
        );
        assert_eq!((y, z), (None, None));
    }

    #[test]
    fn a_swing_in_whole_degrees_is_not_frozen_and_neither_is_an_axis_about_which_nothing_turns() {
        for step in [1e-4, 1.0 / 57.3, 5.0 / 57.3] {
            assert_eq!(swing(step, false), [None; 3], "{step}");
        }
        let mut table = FrozenAxes::new(1.0);
        for n in 0..4000 {
            let t = f64::from(n) * 0.01;
            // Moved by hand, then on a turntable that wobbles.
            let x = if n < 1000 { (3.0 * t).sin() } else { 0.0 };
            let z = if n < 1000 { 0.0 } else { 1.0 + 0.01 * t.sin() };
            table.push(&[x, 0.0, z]);
        }
        assert_eq!(table.found(), [None; 3]);
    }

    #[test]
    fn a_smooth_motion_that_stays_within_a_coarse_step_is_not_frozen_and_one_that_never_comes_back_is()
     {
        let watch = |hangs_at: i32| {
            let mut frozen = FrozenAxes::new(1.0);
            for n in 0..6000 {
                let t = f64::from(n) * 0.004;
                // Up and down by the minute, with a crest of a second within one step of 1 deg/s.
                let x = 0.4 * (1.1 * t).sin() + 0.35 * (0.37 * t).cos();
                let at = if n >= hangs_at { 0.5 } else { x };
                let rates = [at, (2.9 * t).cos(), 0.0];
                frozen.push(&rates.map(|rate: f64| (rate * 57.3).round() / 57.3));
            }
            frozen.found()
        };
        assert_eq!(watch(6000), [None; 3]);
        let [x, ..] = watch(4000);
        assert!(x.is_some_and(|found| found.samples > 1900), "{x:?}");
    }
}
