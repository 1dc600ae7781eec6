//! Smooth steps, waves and harmonics of a gait -> a quantity at any instant, with its derivatives. Pure.

use super::jet::Jet;
use crate::double_double::DoubleDouble;
use crate::rest_to_rest::rest_to_rest;
use std::f64::consts::TAU;

/// Whole nanoseconds since the start, and a part beyond them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instant {
    nanos: u64,
    secs: DoubleDouble,
    beyond: f64,
}

impl Instant {
    /// `beyond` in s.
    pub(super) fn new(nanos: u64, beyond: f64) -> Self {
        Self {
            nanos,
            secs: DoubleDouble::from_nanos(nanos),
            beyond,
        }
    }

    /// Turns made at `hz`, less whole ones.
    fn turns(self, hz: f64) -> f64 {
        (self.secs * hz).fraction() + self.beyond * hz
    }
}

/// Effect of a step.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Change {
    /// The value, by so much.
    Value(f64),
    /// Change of the rate, by so much a second.
    Rate(f64),
}

/// A smooth change: rate and acceleration are continuous.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Step {
    pub(super) at: u64,
    pub(super) over: u64,
    pub(super) change: Change,
}

impl Step {
    /// The value changes by `by` from `at` on, for `over` seconds.
    pub(super) fn of(at: f64, over: f64, by: f64) -> Self {
        Self {
            at: nanos(at),
            over: nanos(over),
            change: Change::Value(by),
        }
    }

    /// The rate of change changes by `by` a second from `at` on, for `over` seconds.
    pub(super) fn of_rate(at: f64, over: f64, by: f64) -> Self {
        Self {
            change: Change::Rate(by),
            ..Self::of(at, over, by)
        }
    }

    fn end(&self) -> u64 {
        self.at + self.over
    }

    /// Value that remains when the step is over, without what a rate goes on to add.
    fn gain(&self) -> f64 {
        match self.change {
            Change::Value(by) => by,
            Change::Rate(_) => 0.0,
        }
    }

    /// `secs` after the beginning of the cycle's nanosecond `at`.
    fn value(&self, nanos: u64, beyond: f64) -> Jet {
        let over = self.over as f64 * 1e-9;
        let since = if nanos >= self.at {
            (nanos - self.at) as f64 * 1e-9 + beyond
        } else {
            beyond - (self.at - nanos) as f64 * 1e-9
        };
        match self.change {
            Change::Value(by) => {
                let [value, rate, bend] = rest_to_rest(since, over);
                Jet { value, rate, bend } * by
            }
            Change::Rate(by) => {
                let [rate, bend, _] = rest_to_rest(since, over);
                let x = (since / over).clamp(0.0, 1.0);
                let within = over * x * x * x * x * (2.5 - x * (3.0 - x));
                let value = within + (since - over).max(0.0);
                Jet { value, rate, bend } * by
            }
        }
    }
}

fn nanos(secs: f64) -> u64 {
    (secs * 1e9).round() as u64
}

/// Steps that come again every `period`.
#[derive(Clone, Debug)]
pub(super) struct Steps {
    start: f64,
    period: u64,
    /// Gain of a period.
    gain: f64,
    steps: Vec<Step>,
}

impl Default for Steps {
    fn default() -> Self {
        Self::constant(0.0)
    }
}

impl Steps {
    /// Never another value.
    pub(super) fn constant(start: f64) -> Self {
        Self::once(start, Vec::new())
    }

    /// Course from `start` on that takes each step once.
    pub(super) fn once(start: f64, steps: Vec<Step>) -> Self {
        Self {
            start,
            period: u64::MAX,
            gain: 0.0,
            steps,
        }
    }

    /// The same steps every `period` seconds; what they change together stays. Those that would not
    /// end within a period are left out, and no step may be of a rate.
    pub(super) fn every(period: f64, start: f64, mut steps: Vec<Step>) -> Self {
        let period = nanos(period);
        steps.retain(|s| s.end() < period && matches!(s.change, Change::Value(_)));
        let gain: f64 = steps.iter().map(Step::gain).sum();
        Self {
            start,
            period,
            // What rounding leaves of a way back to the start would grow forever.
            gain: if gain.abs() < 1e-12 { 0.0 } else { gain },
            steps,
        }
    }

    fn at(&self, t: Instant) -> Jet {
        let cycles = t.nanos / self.period;
        let within = t.nanos % self.period;
        let start = Jet::constant(self.start + self.gain * cycles as f64);
        let steps = self.steps.iter();
        steps.fold(start, |sum, step| sum + step.value(within, t.beyond))
    }

    /// Instants in `from..to` at which a third derivative jumps.
    fn joints(&self, from: u64, to: u64, out: &mut Vec<u64>) {
        if self.steps.is_empty() {
            return;
        }
        for cycle in from / self.period..=to / self.period {
            let start = cycle * self.period;
            let ends = self.steps.iter().flat_map(|s| [s.at, s.end()]);
            out.extend(
                ends.filter_map(|at| at.checked_add(start))
                    .filter(|at| (from..to).contains(at)),
            );
        }
    }
}

/// `amplitude sin(2 pi (hz t + phase))`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Wave {
    pub(super) amplitude: f64,
    pub(super) hz: f64,
    /// Turns.
    pub(super) phase: f64,
}

impl Wave {
    fn at(&self, t: Instant) -> Jet {
        let omega = TAU * self.hz;
        let (s, c) = (TAU * (t.turns(self.hz) + self.phase)).sin_cos();
        Jet {
            value: s,
            rate: omega * c,
            bend: -omega * omega * s,
        } * self.amplitude
    }
}

/// `amplitude sin(2 pi (order strides + phase))`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Harmonic {
    pub(super) order: u32,
    pub(super) amplitude: f64,
    /// Turns.
    pub(super) phase: f64,
}

/// Clock of all that comes and goes in a motion, at an instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beat {
    pub(super) t: Instant,
    /// Envelope of waves and harmonics, of one.
    pub(super) envelope: Jet,
    /// Strides made, less whole ones.
    pub(super) strides: Jet,
}

/// One quantity: steps that stay, and waves and harmonics that come and go with the envelope.
#[derive(Clone, Debug, Default)]
pub(super) struct Course {
    pub(super) steps: Steps,
    pub(super) waves: Vec<Wave>,
    pub(super) harmonics: Vec<Harmonic>,
}

impl Course {
    pub(super) fn at(&self, beat: &Beat) -> Jet {
        let steps = self.steps.at(beat.t);
        if self.waves.is_empty() && self.harmonics.is_empty() {
            return steps;
        }
        let mut sum = Jet::default();
        for wave in &self.waves {
            sum = sum + wave.at(beat.t);
        }
        for h in &self.harmonics {
            let angle = (beat.strides * f64::from(h.order) + Jet::constant(h.phase)) * TAU;
            sum = sum + angle.sin_cos().0 * h.amplitude;
        }
        steps + sum * beat.envelope
    }

    /// The highest frequency in it, Hz, where strides are made at `stride_hz`.
    pub(super) fn highest_hz(&self, stride_hz: f64) -> f64 {
        let waves = self.waves.iter().map(|w| w.hz);
        let harmonics = self
            .harmonics
            .iter()
            .map(|h| f64::from(h.order) * stride_hz);
        waves.chain(harmonics).fold(0.0, f64::max)
    }

    pub(super) fn joints(&self, from: u64, to: u64, out: &mut Vec<u64>) {
        self.steps.joints(from, to, out);
    }
}

/// The beat of a motion.
#[derive(Clone, Debug, Default)]
pub(super) struct Rhythm {
    pub(super) envelope: Steps,
    /// Strides a second.
    pub(super) stride_hz: f64,
    /// Waves that make strides uneven.
    pub(super) unsteady: Vec<Wave>,
}

impl Rhythm {
    pub(super) fn at(&self, t: Instant) -> Beat {
        let even = Jet {
            value: t.turns(self.stride_hz),
            rate: self.stride_hz,
            bend: 0.0,
        };
        Beat {
            t,
            envelope: self.envelope.at(t),
            strides: self.unsteady.iter().fold(even, |sum, w| sum + w.at(t)),
        }
    }

    pub(super) fn joints(&self, from: u64, to: u64, out: &mut Vec<u64>) {
        self.envelope.joints(from, to, out);
    }
}
