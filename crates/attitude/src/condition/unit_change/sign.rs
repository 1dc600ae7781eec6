//! Specific forces -> whether gravity points the other way all at once. Pure.
//!
//! A stage of its own because it needs no rest: a body turns by half a turn in no single sample, and no acceleration takes
//! gravity's place and length for long on either side of one.

use super::super::gate::Entry;
use super::UnitChange;
use crate::record::Nanos;
use nalgebra::Vector3;

/// Samples, and time, for which a force stays where it is before and behind the change.
const LEAST: u32 = 10;
const LEAST_NANOS: i64 = 100_000_000;
/// Share of its length by which a force is off the mean of those before it where it stays.
const STAYS: f64 = 0.5;
/// Share of a force in the mean of those before it.
const SHARE: f64 = 0.2;
/// Longest step, ns, and angle, rad, that the body turns in it.
const STEP_NANOS: i64 = 250_000_000;
const TURN: f64 = 0.5;

/// Force that stays where it is.
#[derive(Clone, Copy, Debug)]
struct Held {
    mean: Vector3<f64>,
    from: Nanos,
    samples: u32,
}

impl Held {
    fn new(at: Nanos, force: &Vector3<f64>) -> Held {
        Held {
            mean: *force,
            from: at,
            samples: 1,
        }
    }

    fn is_at(&self, force: &Vector3<f64>) -> bool {
        (force - self.mean).norm_squared() < STAYS * STAYS * self.mean.norm_squared()
    }

    fn take(&mut self, force: &Vector3<f64>) {
        self.mean += (force - self.mean) * SHARE;
        self.samples += 1;
    }

    fn is_long(&self, at: Nanos) -> bool {
        self.samples >= LEAST && at.since(self.from) >= LEAST_NANOS
    }
}

/// Watch over the direction of the force.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ForceSign {
    last: Option<Nanos>,
    held: Option<Held>,
    /// Stamp at which it turned round from where it had long been.
    turned: Option<Nanos>,
}

impl ForceSign {
    /// Takes the force of the next sample.
    pub(super) fn take(
        &mut self,
        entry: &Entry,
        is_rate: bool,
        force: &Vector3<f64>,
    ) -> Option<UnitChange> {
        let at = entry.stamp;
        let step = self
            .last
            .replace(at)
            .map_or(i64::MAX, |last| at.since(last));
        let secs = if is_rate { step as f64 * 1e-9 } else { 1.0 };
        let turn = entry.value.norm_squared() * (secs * secs);
        let is_whole = (1..=STEP_NANOS).contains(&step) && turn < TURN * TURN;
        let Some(held) = self.held.as_mut().filter(|_| is_whole) else {
            *self = ForceSign {
                last: Some(at),
                held: Some(Held::new(at, force)),
                turned: None,
            };
            return None;
        };
        if held.is_at(force) {
            held.take(force);
            let is_long = held.is_long(at);
            return self.turned.take_if(|_| is_long).map(|at| UnitChange {
                at,
                factor: -1.0,
                is_first_right: None,
            });
        }
        self.turned = (held.is_long(at) && held.is_at(&-force)).then_some(at);
        self.held = Some(Held::new(at, force));
        None
    }
}
