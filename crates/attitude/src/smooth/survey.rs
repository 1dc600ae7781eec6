//! Samples -> what must be known of them before the first can be used. Pure.
//!
//! A stage of its own because everything after it is a stream: the time between samples, the step their rates count
//! in, and the size of the field are those of the whole log.

use super::gate::Gate;
use super::sample::{Numbers, Samples};
use super::settings::{FieldUnit, Settings};
use crate::condition::truncation::undone;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Rates are told apart to this, rad/s.
const RESOLUTION: f64 = 1e-6;
/// Steps looked for are smaller, rad/s (2 deg/s).
const LARGEST_STEP: f64 = 0.034_906_585;
/// And at least so many resolutions.
const SMALLEST_STEP: usize = 5;
/// Number of samples before and after one that tell whether it only passes through zero.
const AROUND: usize = 8;
/// More different intervals than this are counted in coarser bins.
const MOST_INTERVALS: usize = 1 << 14;
/// A step longer than this is no time of which anything is known, ns.
pub(super) const LONGEST: i64 = 10_000_000_000;
/// A field of unknown unit has this median, uT.
const FIELD: f64 = 50.0;

/// The step that rates count in, and whether they were cut towards zero.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Quantisation {
    /// The step, rad/s.
    pub step: f64,
    /// Width of the bin about zero by the mean width of the six others: 2 where rates were cut, 1 where rounded.
    pub zero_bin: f64,
    /// Number of rates that pass through zero that were looked at.
    pub counted: u64,
    /// Rates were put back in the middle of their step.
    pub is_undone: bool,
}

/// Survey of the log.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Survey {
    /// Samples that came, and that can be used.
    pub samples: u64,
    pub accepted: u64,
    /// Number that had no specific force.
    pub forceless: u64,
    /// Median time between samples, s.
    pub interval: f64,
    /// Time from the first to the last without the long breaks, s.
    pub secs: f64,
    pub quantisation: Option<Quantisation>,
    /// Mean specific force, m/s^2, body axes.
    pub force: Vector3<f64>,
    /// Fields that came.
    pub fields: u64,
    /// uT by the unit of the field.
    pub field_scale: f64,
}

impl Survey {
    /// Reads the samples once, and once more where they may have been cut.
    pub(super) fn of<S: Samples>(samples: &mut S, settings: &Settings) -> Result<Survey, S::Error> {
        let mut first = First::default();
        let mut gate = Gate::default();
        samples.pass(&mut |chunk| {
            for sample in chunk {
                first.samples += 1;
                first.forceless += u64::from(sample.force.is_none());
                gate.offer(sample, &mut |sample, _| first.take(sample));
            }
        })?;
        gate.finish(&mut |sample, _| first.take(sample));
        let quantisation = match first.step().filter(|_| settings.undo_truncation) {
            Some(step) => Some(zero_bin(samples, step)?),
            None => None,
        };
        Ok(Survey {
            samples: first.samples,
            accepted: first.accepted,
            forceless: first.forceless,
            interval: first.intervals.median(),
            secs: first.secs,
            quantisation,
            force: first.force / first.forces.max(1) as f64,
            fields: first.fields.count,
            field_scale: match settings.field_unit {
                FieldUnit::Microtesla => 1.0,
                FieldUnit::Unknown => first.fields.median().map_or(1.0, |size| FIELD / size),
            },
        })
    }

    /// The rate in the middle of what its driver made of it.
    pub(super) fn whole(&self, rate: &Vector3<f64>) -> Vector3<f64> {
        match self.quantisation {
            Some(found) if found.is_undone => rate.map(|rate| undone(rate, found.step)),
            _ => *rate,
        }
    }
}

/// First pass.
#[derive(Default)]
struct First {
    samples: u64,
    accepted: u64,
    forceless: u64,
    secs: f64,
    last: Option<Numbers>,
    intervals: Intervals,
    differences: Differences,
    /// Sum and number of the forces.
    force: Vector3<f64>,
    forces: u64,
    fields: Sizes,
}

impl First {
    fn take(&mut self, sample: &Numbers) {
        self.accepted += 1;
        if let Some(last) = &self.last {
            let nanos = sample.stamp.since(last.stamp);
            if nanos <= LONGEST {
                self.secs += nanos as f64 * 1e-9;
            }
            self.intervals.take(nanos);
            let step = sample.rate - last.rate;
            step.iter().for_each(|d| self.differences.take(d.abs()));
        }
        if let Some(force) = &sample.force {
            self.force += force;
            self.forces += 1;
        }
        if let Some(field) = &sample.field {
            self.fields.take(field.norm());
        }
        self.last = Some(*sample);
    }

    fn step(&self) -> Option<f64> {
        self.differences.step()
    }
}

/// Counts of intervals, in bins that widen when there are too many.
#[derive(Default)]
struct Intervals {
    counts: BTreeMap<i64, u64>,
    shift: u32,
}

impl Intervals {
    fn take(&mut self, nanos: i64) {
        *self.counts.entry(nanos >> self.shift).or_default() += 1;
        while self.counts.len() > MOST_INTERVALS {
            self.shift += 1;
            let mut wider = BTreeMap::new();
            for (bin, count) in &self.counts {
                *wider.entry(bin >> 1).or_default() += count;
            }
            self.counts = wider;
        }
    }

    /// s; 0 without any.
    fn median(&self) -> f64 {
        let total: u64 = self.counts.values().sum();
        let at = |rank: u64| {
            let mut seen = 0;
            let bin = self.counts.iter().find(|(_, count)| {
                seen += **count;
                seen > rank
            });
            let half = if self.shift > 0 { 0.5 } else { 0.0 };
            bin.map_or(0.0, |(bin, _)| {
                (*bin as f64 + half) * (1_u64 << self.shift.min(62)) as f64
            })
        };
        0.5 * (at(total.saturating_sub(1) / 2) + at(total / 2)) * 1e-9
    }
}

/// Counts of the differences of consecutive rates, and their sums, by size.
#[derive(Default)]
struct Differences {
    bins: Vec<(u64, f64)>,
    count: u64,
}

impl Differences {
    fn take(&mut self, difference: f64) {
        if difference > 0.0 && difference < LARGEST_STEP {
            let bin = (difference / RESOLUTION).round() as usize;
            if self.bins.len() <= bin {
                self.bins.resize(bin + 1, (0, 0.0));
            }
            if let Some((count, sum)) = self.bins.get_mut(bin) {
                *count += 1;
                *sum += difference;
            }
            self.count += 1;
        }
    }

    /// The step they are multiples of, where they are of any: the smallest frequent one, refined twice.
    fn step(&self) -> Option<f64> {
        if self.count < 1000 {
            return None;
        }
        let often = (self.count as f64 * 0.002).max(20.0);
        let first = (SMALLEST_STEP..self.bins.len()).find(|i| self.bins[*i].0 as f64 >= often)?;
        let mut step = first as f64 * RESOLUTION;
        for _ in 0..2 {
            let (mut near, mut on, mut product, mut square) = (0, 0, 0.0, 0.0);
            for (count, sum) in self.bins.iter().filter(|(count, _)| *count > 0) {
                let x = sum / *count as f64;
                if x >= 8.5 * step {
                    break;
                }
                near += count;
                let z = (x / step).round();
                if z > 0.0 && (x / step - z).abs() < 0.1 {
                    on += count;
                    product += sum * z;
                    square += *count as f64 * z * z;
                }
            }
            if near < 500 || on * 10 < near * 7 {
                return None;
            }
            step = product / square;
        }
        Some(step)
    }
}

/// Counts of sizes to a hundredth of an octave.
#[derive(Default)]
struct Sizes {
    counts: BTreeMap<i32, u64>,
    count: u64,
}

impl Sizes {
    fn take(&mut self, size: f64) {
        if size > 0.0 && size.is_finite() {
            *self
                .counts
                .entry((size.log2() * 100.0).floor() as i32)
                .or_default() += 1;
            self.count += 1;
        }
    }

    fn median(&self) -> Option<f64> {
        let mut seen = 0;
        let bin = self.counts.iter().find(|(_, count)| {
            seen += **count;
            2 * seen > self.count
        });
        bin.map(|(bin, _)| ((f64::from(*bin) + 0.5) / 100.0).exp2())
    }
}

/// Width of the bin about zero.
fn zero_bin<S: Samples>(samples: &mut S, step: f64) -> Result<Quantisation, S::Error> {
    let mut window: Vec<Vector3<f64>> = Vec::new();
    let (mut zero, mut others) = (0_u64, 0_u64);
    let mut looked = 0;
    let mut look = |window: &[Vector3<f64>], i: usize| {
        let (before, now) = (window[i.saturating_sub(AROUND)], window[i]);
        let after = window[(i + AROUND).min(window.len() - 1)];
        for axis in 0..3 {
            let r = now[axis] / step;
            let passes = (after[axis] - before[axis]).abs() > 8.0 * step;
            if passes && r.abs() < 4.5 && (r - r.round()).abs() < 0.05 {
                zero += u64::from(r.round() == 0.0);
                others += u64::from(r.round().abs() >= 2.0);
            }
        }
    };
    let mut gate = Gate::default();
    let mut take = |window: &mut Vec<Vector3<f64>>, sample: &Numbers| {
        window.push(sample.rate);
        while looked + AROUND < window.len() {
            look(window, looked);
            looked += 1;
        }
        if window.len() > 4096 {
            let old = looked - AROUND;
            window.drain(..old);
            looked -= old;
        }
    };
    samples.pass(&mut |chunk| {
        for sample in chunk {
            gate.offer(sample, &mut |sample, _| take(&mut window, sample));
        }
    })?;
    gate.finish(&mut |sample, _| take(&mut window, sample));
    for i in looked..window.len() {
        look(&window, i);
    }
    let ratio = if others > 0 {
        6.0 * zero as f64 / others as f64
    } else {
        0.0
    };
    Ok(Quantisation {
        step,
        zero_bin: ratio,
        counted: zero + others,
        is_undone: ratio > 1.5 && zero + others > 100,
    })
}
