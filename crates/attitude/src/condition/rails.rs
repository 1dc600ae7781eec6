//! Rates of one topic -> axes that were clipped. Pure.
//!
//! A stage of its own because three judge by it: `check` as recorded, a replay before its first sample, which then
//! treats the samples at that level as it does those at a stated range, and a live stream as it goes. An axis is clipped
//! where it stays at exactly its largest reading while another axis moves, and jumps onto that level and off it; the
//! smooth top of a coarsely quantised swing has jumps of one step. `docs/theory/spikes.md` has the numbers.

use crate::plausible::are_numbers;

/// Samples in a row at the largest reading, while another axis changes.
const RUN: u64 = 4;
/// Jumps onto and off the level, in the smallest steps of the axis.
const STEPS: f64 = 4.0;
/// Jumps that are kept of one side.
const KEPT: usize = 32;
/// Level, rad/s, above which a gyro can be clipped.
const FLOOR: f64 = 1.0;
/// Share of the level that counts as it: what a bias leaves of it is at the range, too.
pub(crate) const AT_RANGE: f64 = 0.999;

/// End of a gyro's range that an axis was clipped at.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Clipped {
    /// Reading, source's unit, with its sign.
    pub level: f64,
    /// Samples at it.
    pub samples: u64,
}

/// One direction of one axis.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Side {
    sign: f64,
    /// Largest reading so far, 0 before the first beyond it, samples at it, the run of them under way, and the longest.
    peak: f64,
    samples: u64,
    run: u64,
    longest: u64,
    /// The newest jumps onto and off that level.
    #[cfg_attr(feature = "serde", serde(with = "jumps"))]
    jumps: [f64; KEPT],
    count: usize,
}

/// Readings of one axis.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Axis {
    sides: [Side; 2],
    last: Option<f64>,
    /// Smallest change so far.
    quantum: Option<f64>,
}

/// Readings of three axes of a gyro, or of a magnetometer, in the unit of the source.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Rails {
    axes: [Axis; 3],
}

impl Default for Rails {
    fn default() -> Rails {
        Rails::new()
    }
}

impl Rails {
    /// Rails without readings.
    #[must_use]
    pub fn new() -> Rails {
        let side = |sign| Side {
            sign,
            peak: 0.0,
            samples: 0,
            run: 0,
            longest: 0,
            jumps: [0.0; KEPT],
            count: 0,
        };
        Rails {
            axes: [Axis {
                sides: [side(1.0), side(-1.0)],
                last: None,
                quantum: None,
            }; 3],
        }
    }

    /// Takes the next readings; those that are not finite are passed over.
    pub fn push(&mut self, gyro: &[f64; 3]) {
        if gyro.iter().any(|rate| !rate.is_finite()) {
            return;
        }
        let mut has_changed = [true; 3];
        for (changed, (axis, rate)) in has_changed.iter_mut().zip(self.axes.iter().zip(gyro)) {
            *changed = axis.last != Some(*rate);
        }
        let [x, y, z] = has_changed;
        let others = [y || z, x || z, x || y];
        for ((axis, rate), other) in self.axes.iter_mut().zip(gyro).zip(others) {
            axis.push(*rate, other);
        }
    }

    /// Takes the next readings, and says whether one of them is at an end of the range, as far as that is known by now;
    /// `rad` in the source's unit is one rad/s.
    #[inline]
    pub(crate) fn push_and_judge(&mut self, gyro: &[f64; 3], rad: &[f64; 3]) -> bool {
        self.push(gyro);
        let mut axes = self.axes.iter().zip(gyro.iter().zip(rad));
        axes.any(|(axis, (rate, rad))| {
            let at = |side: &&Side| rate * side.sign >= AT_RANGE * side.peak;
            let mut near = axis.sides.iter().filter(at);
            near.any(|side| side.is_clipped(axis.quantum, *rad))
        })
    }

    pub(super) fn is_plausible(&self) -> bool {
        self.axes.iter().all(|axis| {
            let of_sides = axis.sides.iter().flat_map(|side| [&side.sign, &side.peak]);
            let jumps = axis.sides.iter().flat_map(|side| &side.jumps);
            are_numbers(of_sides.chain(jumps).chain(&axis.last).chain(&axis.quantum))
        })
    }

    /// Axes that were clipped at any level, of a sensor whose unit is nobody's matter.
    #[must_use]
    pub fn clipped_anywhere(&self) -> [Option<Clipped>; 3] {
        self.clipped(0.0)
    }

    /// Ends of the range of each axis, where `rad` in the source's unit is one rad/s.
    pub(crate) fn clipped(&self, rad: f64) -> [Option<Clipped>; 3] {
        self.axes.map(|axis| axis.clipped(rad))
    }

    /// The least level that an axis was clipped at, with its axis.
    pub(crate) fn range(&self, rad: f64) -> Option<(usize, Clipped)> {
        let clipped = self.clipped(rad);
        let found = clipped.iter().enumerate();
        let found = found.filter_map(|(axis, clipped)| Some((axis, (*clipped)?)));
        found.min_by(|(_, a), (_, b)| a.level.abs().total_cmp(&b.level.abs()))
    }
}

impl Axis {
    fn push(&mut self, rate: f64, other_changed: bool) {
        if let Some(last) = self.last {
            let change = (rate - last).abs();
            if change > 0.0 {
                self.quantum = Some(self.quantum.map_or(change, |least| least.min(change)));
            }
        }
        for side in &mut self.sides {
            side.push(rate, self.last, other_changed);
        }
        self.last = Some(rate);
    }

    fn clipped(&self, rad: f64) -> Option<Clipped> {
        let mut sides = self.sides.iter();
        let side = sides.find(|side| side.is_clipped(self.quantum, rad))?;
        Some(Clipped {
            level: side.peak * side.sign,
            samples: side.samples,
        })
    }
}

impl Side {
    /// Whether the peak is an end of the range, where the least change of the axis is `quantum`.
    fn is_clipped(&self, quantum: Option<f64>, rad: f64) -> bool {
        self.longest >= RUN
            && self.peak > FLOOR * rad
            && quantum.is_some_and(|quantum| self.median_jump() > STEPS * quantum)
    }

    fn push(&mut self, rate: f64, last: Option<f64>, other_changed: bool) {
        let reading = rate * self.sign;
        let last = last.map(|last| last * self.sign);
        if reading > self.peak {
            self.peak = reading;
            (self.samples, self.run, self.longest, self.count) = (1, 1, 1, 0);
            if let Some(last) = last {
                self.add_jump(reading - last);
            }
        } else if reading == self.peak {
            self.samples += 1;
            match last {
                Some(last) if last == reading => self.run += u64::from(other_changed),
                last => {
                    self.run = 1;
                    if let Some(last) = last {
                        self.add_jump(reading - last);
                    }
                }
            }
            self.longest = self.longest.max(self.run);
        } else {
            if last == Some(self.peak) {
                self.add_jump(self.peak - reading);
            }
            self.run = 0;
        }
    }

    fn add_jump(&mut self, jump: f64) {
        if let Some(slot) = self.jumps.get_mut(self.count % KEPT) {
            *slot = jump;
        }
        self.count = self.count.saturating_add(1);
    }

    fn median_jump(&self) -> f64 {
        let mut jumps = self.jumps;
        let Some(jumps) = jumps.get_mut(..self.count.min(KEPT)) else {
            return 0.0;
        };
        jumps.sort_unstable_by(f64::total_cmp);
        let upper = jumps.get(jumps.len() / 2).copied().unwrap_or(0.0);
        match jumps.len() % 2 {
            0 => {
                let lower = jumps.get((jumps.len() / 2).saturating_sub(1)).copied();
                lower.map_or(upper, |lower| (lower + upper) / 2.0)
            }
            _ => upper,
        }
    }
}

/// Jumps in a state file: those there are.
#[cfg(feature = "serde")]
mod jumps {
    use super::KEPT;
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    pub(super) fn serialize<S: Serializer>(jumps: &[f64; KEPT], to: S) -> Result<S::Ok, S::Error> {
        let count = jumps.iter().rposition(|jump| *jump != 0.0);
        let there = jumps.get(..count.map_or(0, |last| last + 1));
        there.unwrap_or_default().serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; KEPT], D::Error> {
        let there = Vec::<f64>::deserialize(from)?;
        let mut jumps = [0.0; KEPT];
        let room = jumps.get_mut(..there.len());
        room.ok_or_else(|| D::Error::custom("more jumps than are kept"))?
            .copy_from_slice(&there);
        Ok(jumps)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A swing of `size` about x at 100 Hz, as `read` reads it, while the other axes move.
    fn swing(size: f64, read: impl Fn(f64) -> f64) -> Rails {
        let mut rails = Rails::new();
        for n in 0..4000 {
            let t = f64::from(n) * 0.01;
            rails.push(&[
                read(size * (2.0 * t).sin()),
                (1.3 * t).cos(),
                0.2 * (0.7 * t).sin(),
            ]);
        }
        rails
    }

    #[test]
    fn an_axis_that_is_cut_off_is_clipped_at_its_level() {
        let rails = swing(3.0, |rate| rate.clamp(-2.0, 2.0));
        let [x, y, z] = rails.clipped(1.0);
        assert_eq!(x.map(|clipped| clipped.level), Some(2.0));
        assert!(x.unwrap().samples > 500);
        assert_eq!((y, z), (None, None));
        assert_eq!(rails.range(1.0).map(|(axis, _)| axis), Some(0));
        // One side alone, and its sign.
        let one_sided = swing(3.0, |rate| rate.max(-2.5)).clipped(1.0)[0];
        assert_eq!(one_sided.map(|clipped| clipped.level), Some(-2.5));
        // Of what is 2 deg/s, nothing is clipped.
        assert_eq!(rails.clipped(57.3)[0], None);
    }

    #[test]
    fn the_top_of_a_smooth_swing_is_no_end_of_the_range_however_coarse() {
        for step in [1.0, 5.0, 1.0 / 16.4, 1e-9] {
            let rails = swing(111.4, |rate| (rate / step).round() * step);
            assert_eq!(rails.clipped(57.3), [None; 3], "{step}");
        }
    }

    #[test]
    fn samples_that_are_repeated_whole_are_no_run() {
        let mut rails = Rails::new();
        for n in 0..4000 {
            let t = f64::from(n / 8) * 0.08;
            rails.push(&[3.0 * (2.0 * t).sin(), (1.3 * t).cos(), 0.1]);
        }
        assert_eq!(rails.clipped(1.0), [None; 3]);
    }
}
