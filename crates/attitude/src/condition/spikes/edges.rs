//! First samples of a stream or behind a hole in it, and its last -> those of them that are spikes. Pure.
//!
//! Apart from the rule amid a stream because before the first ones nothing tells what is ordinary, and beside the outermost
//! there is no neighbour to draw a line to. A sensor that was switched on may answer with anything until it has measured,
//! one that is switched off with half of an answer.

use super::super::gate::{Entry, finite_accel};
use super::{ANY, FLOOR, LONGEST_SPAN, LOST, PAST, QUIET, QUIET_FORCE, Run, Spikes, is_long, most};
use nalgebra::Vector3;

/// Samples that are looked at behind one, which wait in any replay, however the stream comes.
pub(super) const AHEAD: usize = PAST;
/// Fewest samples behind a run that tell what is ordinary.
const LEAST_BEHIND: usize = 10;
/// Rates of a run with one neighbour alone, in times of those beside it: who moves begins and ends at rest.
const LARGER: f64 = 2.0;
/// Least distance of such a run, rad/s: half a pulse is a step, and a step may be a motion. Without a force twice as much.
const EDGE: f64 = 5.0;

/// A run that has one neighbour alone.
struct Half<'a> {
    within: &'a [Entry],
    /// Value beside it.
    end: Vector3<f64>,
    /// Largest rate beside it.
    fastest: f64,
    /// Changes of rate and force that are ordinary.
    ordinary: (f64, f64),
    /// The largest step of the force in it, and from it to its neighbour.
    force_step: Option<f64>,
}

impl Spikes {
    /// The spike that begins at `entry`, one of the first samples or of the last, and whether its forces are wrong, too.
    #[cold]
    pub(super) fn at_edge(
        &self,
        entry: &Entry,
        ahead: &[Entry],
        (spacing, coarse): (i64, Option<i64>),
        is_beginning: bool,
    ) -> Option<(Run, bool)> {
        // Stamps of a coarse clock are shared, and what waits behind them depends on how the stream comes.
        if coarse.is_some() || (self.past.count > 0 && entry.stamp <= self.past.last) {
            return None;
        }
        let waiting = ahead.get(..AHEAD.min(self.waits)).unwrap_or(ahead);
        let following = in_steps(entry, waiting, spacing);
        if !is_beginning {
            let is_last = following.len() == ahead.len();
            return is_last
                .then(|| self.at_end(entry, ahead, spacing))
                .flatten();
        }
        let has_neighbour = !self.past.is_hole(entry, spacing, None);
        let all: Vec<Entry> = std::iter::once(entry).chain(following).copied().collect();
        (1..=most(spacing)).find_map(|samples| {
            let behind = following.get(samples - 1..)?;
            if behind.len() < LEAST_BEHIND {
                return None;
            }
            let (past, then) = (self.past.ordinary(), ordinary(behind));
            let ordinary = (past.0.max(then.0), past.1.max(then.1));
            if has_neighbour {
                let run = self.run_of(entry, following, samples, spacing, None)?;
                let weight = self.weight(&run, entry, following, (spacing, ordinary));
                return weight.is_spike().then_some((run, weight.drops_force));
            }
            let half = Half {
                within: all.get(..samples)?,
                end: behind.first()?.value,
                fastest: fastest(behind),
                ordinary,
                force_step: force_step(all.iter().take(samples + 2)),
            };
            Some((self.half(&half, spacing)?, false))
        })
    }

    /// The spike that ends the stream, of which `ahead` is the rest.
    fn at_end(&self, entry: &Entry, ahead: &[Entry], spacing: i64) -> Option<(Run, bool)> {
        let all: Vec<Entry> = std::iter::once(entry).chain(ahead).copied().collect();
        let half = Half {
            within: &all,
            end: self.past.rates[0],
            fastest: self
                .past
                .rates
                .iter()
                .map(Vector3::norm)
                .fold(0.0, f64::max),
            ordinary: self.past.ordinary(),
            force_step: self.past.force_step(entry, ahead, all.len(), all.len()),
        };
        Some((self.half(&half, spacing)?, false))
    }

    /// The run, where it is a spike.
    fn half(&self, half: &Half<'_>, spacing: i64) -> Option<Run> {
        let samples = half.within.len();
        let least =
            |of: &dyn Fn(&Entry) -> f64| half.within.iter().map(of).fold(f64::INFINITY, f64::min);
        let distance = least(&|sample| (sample.value - half.end).norm());
        let slowest = least(&|sample| sample.value.norm());
        let larger = if self.is_increment { LOST } else { LARGER };
        if slowest <= larger * half.fastest || is_long(samples, spacing) {
            return None;
        }
        let (rate, force) = half.ordinary;
        // A motion may have any slope that is ordinary.
        let ratio = distance / (samples as f64 * rate + FLOOR * self.unit);
        let is_spike = match half.force_step {
            Some(step) => {
                let is_quiet = step < 2.0 * force + QUIET_FORCE;
                is_quiet && ratio > QUIET && distance > EDGE * self.unit
            }
            None => samples == 1 && ratio > ANY && distance > 2.0 * EDGE * self.unit,
        };
        is_spike.then_some(Run {
            samples,
            ends: (half.end, half.end),
            distance,
        })
    }
}

/// Part of `ahead` that follows `entry` in one epoch, each later than the one before, without a hole.
fn in_steps<'a>(entry: &Entry, ahead: &'a [Entry], spacing: i64) -> &'a [Entry] {
    let before = std::iter::once(entry).chain(ahead);
    let follows = |(before, next): &(&Entry, &Entry)| {
        let step = next.stamp.since(before.stamp);
        next.epoch == before.epoch && (1..=LONGEST_SPAN * spacing).contains(&step)
    };
    let count = before.zip(ahead).take_while(follows).count();
    ahead.get(..count).unwrap_or(ahead)
}

fn fastest(all: &[Entry]) -> f64 {
    all.iter()
        .map(|sample| sample.value.norm())
        .fold(0.0, f64::max)
}

/// The largest change of the rate, and step of the force, in samples that follow each other.
fn ordinary(all: &[Entry]) -> (f64, f64) {
    let step = |pair: &[Entry]| match pair {
        [some, next] => (next.value - some.value).norm(),
        _ => 0.0,
    };
    let bend = |three: &[Entry]| match three {
        [some, middle, next] => (middle.value - (some.value + next.value) * 0.5).norm(),
        _ => 0.0,
    };
    let changes = all.windows(2).map(step).chain(all.windows(3).map(bend));
    (
        changes.fold(0.0, f64::max),
        force_step(all.iter()).unwrap_or(0.0),
    )
}

/// The largest step of the force; `None` where there are no two.
fn force_step<'a>(all: impl Iterator<Item = &'a Entry>) -> Option<f64> {
    let forces: Vec<_> = all.filter_map(|entry| finite_accel(&entry.accel)).collect();
    let steps = forces.windows(2).map(|pair| match pair {
        [some, next] => (next - some).norm(),
        _ => 0.0,
    });
    steps.reduce(f64::max)
}
