//! Steps and waiting samples -> outputs. Pure.

use super::world::TurningWorld;
use crate::frames::{Body, In};
use crate::lanes::Triple;
use crate::propagate::accumulate::Accumulator;
use crate::propagate::columns::{Track, secs};
use crate::propagate::covariance::Covariance;
use crate::propagate::difference::Difference;
use crate::propagate::method::Method;
use crate::propagate::report::Report;
use crate::propagate::settings::Settings;
use crate::propagate::turn::Turn;
use crate::propagate::window::{Note, Step};
use crate::quaternion::{BodyRate, Quaternion};
use crate::record::{AttitudeCovariance, AttitudeSample, Nanos, RateSample, Status};
use std::collections::VecDeque;

/// Facts of a sample that its output will need.
#[derive(Clone, Copy, Debug)]
pub(super) struct PendingSample {
    pub(super) stamp: Nanos,
    pub(super) log: Nanos,
    pub(super) accel: Option<In<Body>>,
    pub(super) status: Status,
    /// Whether it advances in time and so ends an interval.
    pub(super) turns: bool,
}

impl PendingSample {
    #[inline(always)]
    pub(super) fn of(sample: &RateSample, status: Status, turns: bool) -> PendingSample {
        PendingSample {
            stamp: sample.stamp,
            log: sample.log,
            accel: sample.accel,
            status,
            turns,
        }
    }
}

/// State of a propagator beside its samples, attitude and covariance: what is saved, as it is. A new field is added
/// here alone, with `serde(default)`.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct State {
    /// Attitude a reset goes to, w, x, y, z.
    pub(super) initial: [f64; 4],
    /// Sum of rotation vectors, rad, for the method that wants it.
    pub(super) sum: Option<[f64; 3]>,
    /// Instant at which the accumulated attitude, q_ib, was q_nb, ns; where the world turns.
    pub(super) world_since: Option<i64>,
    /// Instant of the attitude accumulated, ns.
    pub(super) now: i64,
    /// Bits of the output being made that the propagator adds.
    pub(super) added: Status,
    pub(super) resets: u32,
    pub(super) rates: Rates,
    /// Stamp of the last sample, ns.
    pub(super) last: i64,
}

/// The last rates, rad/s.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "[[f64; 3]; 2]", into = "[[f64; 3]; 2]")
)]
pub(super) struct Rates {
    /// Rate of the last output.
    pub(super) output: [f64; 3],
    /// Rate of the last sample.
    pub(super) sample: [f64; 3],
}

impl From<[[f64; 3]; 2]> for Rates {
    fn from([output, sample]: [[f64; 3]; 2]) -> Rates {
        Rates { output, sample }
    }
}

impl From<Rates> for [[f64; 3]; 2] {
    fn from(rates: Rates) -> [[f64; 3]; 2] {
        [rates.output, rates.sample]
    }
}

/// Attitude, its covariance and what has been counted: of them the outputs are made.
#[derive(Clone, Debug)]
pub(super) struct Output {
    pub(super) state: State,
    pub(super) attitude: Accumulator,
    /// World to which the accumulated attitude is relative, where the world turns.
    world: Option<TurningWorld>,
    pub(super) covariance: Covariance,
    pub(super) difference: Difference,
    pub(super) report: Report,
    pub(super) integrated_nanos: i64,
}

impl Output {
    pub(super) fn new(settings: &Settings, initial: [f64; 4]) -> Self {
        let sum = (settings.method == Method::RotvecSum).then(|| rotation_vector(initial));
        let world = TurningWorld::new(settings.world_rate.as_vector());
        Output {
            state: State {
                initial,
                sum: sum.map(Into::into),
                world_since: world.as_ref().map(|_| 0),
                now: 0,
                added: Status::OK,
                resets: 0,
                rates: Rates::default(),
                last: 0,
            },
            attitude: sum.map_or(Accumulator::new(initial), turned_by),
            world,
            covariance: Covariance::new(settings.noise),
            difference: Difference::default(),
            report: Report::default(),
            integrated_nanos: 0,
        }
    }

    /// A run begins at `stamp` with the attitude as it is: what lies between adds no rotation of the
    /// body relative to the world.
    pub(super) fn begin(&mut self, stamp: i64) {
        if self.world.is_some() && self.state.now != stamp {
            let q_nb = self.q_nb();
            self.attitude = Accumulator::new(q_nb);
            if let Some(sum) = &mut self.state.sum {
                let mut phi = rotation_vector(q_nb);
                // The same attitude on the other side of the sphere: a turn less about its axis.
                let angle = phi.norm();
                if q_nb[0] < 0.0 && angle > 0.0 {
                    phi = phi * ((angle - std::f64::consts::TAU) / angle);
                }
                *sum = phi.into();
            }
        }
        self.state.world_since = self.world.as_ref().map(|_| stamp);
        self.state.now = stamp;
    }

    /// The attitude relative to the world, which may have turned.
    #[inline(always)]
    fn q_nb(&mut self) -> [f64; 4] {
        let accumulated = self.attitude.attitude();
        match (&self.world, self.state.world_since) {
            (Some(world), Some(since)) => {
                world.attitude(self.state.now.saturating_sub(since), &accumulated)
            }
            _ => accumulated,
        }
    }

    /// Goes on from an attitude that was saved, at its instant.
    pub(super) fn resume(&mut self, last: &AttitudeSample) {
        self.reset(last.q_nb.wxyz());
        self.covariance.resume(last.covariance);
        self.state.now = last.stamp.0;
        self.state.resets = last.reset_count;
    }

    pub(super) fn reset(&mut self, initial: [f64; 4]) {
        self.attitude.restart(initial);
        self.covariance.restart();
        self.difference.restart();
        if let Some(sum) = &mut self.state.sum {
            let phi = rotation_vector(initial);
            *sum = phi.into();
            self.attitude = turned_by(phi);
        }
    }

    /// Turns on over interval k.
    #[inline(always)]
    pub(super) fn step(&mut self, step: &Step, track: &Track, k: usize) {
        let mut turn = step.turn;
        match &mut self.state.sum {
            None => self.attitude.turn(turn),
            Some(sum) => {
                let [_, x, y, z] = turn;
                let phi = Triple::new(x, y, z);
                let whole = Triple::from(*sum) + phi;
                *sum = whole.into();
                self.attitude = turned_by(whole);
                turn = Turn::exp(phi).parts();
            }
        }
        self.state.now = track.stamp[k];
        self.difference.add(&self.attitude, step.outer);
        let spacing = track.spacing(k);
        self.covariance.advance(turn, secs(spacing));
        self.integrated_nanos = self.integrated_nanos.saturating_add(spacing);
        self.report.angle_turned += step.angle;
        self.report.largest_step = self.report.largest_step.max(step.angle);
        self.state.added = self.state.added.with(step.status());
        if step.angle > std::f64::consts::PI {
            self.report.undersampled += 1;
        }
        match step.note {
            Note::Ordinary => {}
            Note::Reduced => self.report.reduced += 1,
            Note::Bridged => {
                self.report.bridged += 1;
                self.covariance.bridge(step.gap_variance);
            }
            Note::Refused => self.report.refused += 1,
        }
    }

    /// Outputs the sample that ends interval k, and those after it that turned nothing.
    #[inline(always)]
    pub(super) fn emit(
        &mut self,
        queue: &mut VecDeque<PendingSample>,
        track: &Track,
        k: usize,
        out: &mut Vec<AttitudeSample>,
    ) {
        if let Some(sample) = queue.pop_front() {
            self.output_at(&sample, Some(track.rate(k)), out);
        }
        self.flush_stalled(queue, out);
    }

    /// Outputs samples that turned nothing, up to the next that will.
    #[inline(always)]
    pub(super) fn flush_stalled(
        &mut self,
        queue: &mut VecDeque<PendingSample>,
        out: &mut Vec<AttitudeSample>,
    ) {
        while queue.front().is_some_and(|sample| !sample.turns)
            && let Some(sample) = queue.pop_front()
        {
            self.output_at(&sample, None, out);
        }
    }

    #[inline(always)]
    pub(super) fn output_at(
        &mut self,
        sample: &PendingSample,
        rate: Option<Triple<1>>,
        out: &mut Vec<AttitudeSample>,
    ) {
        let covariance = self.covariance.attitude();
        self.output_known(sample, rate, covariance, out);
    }

    /// Outputs a sample whose attitude is known so well.
    #[inline(always)]
    pub(super) fn output_known(
        &mut self,
        sample: &PendingSample,
        rate: Option<Triple<1>>,
        covariance: AttitudeCovariance,
        out: &mut Vec<AttitudeSample>,
    ) {
        if let Some(rate) = rate {
            self.state.rates.output = rate.into();
        }
        let q_nb = self.q_nb();
        out.push(AttitudeSample {
            stamp: sample.stamp,
            q_nb: Quaternion::assume_unit(q_nb),
            rate: BodyRate(self.state.rates.output.into()),
            accel: sample.accel,
            linear_acceleration: None,
            covariance,
            status: sample.status.with(self.state.added),
            reset_count: self.state.resets,
            log: sample.log,
            temperature: None,
        });
        self.state.added = Status::OK;
        self.report.samples += 1;
    }
}

/// The attitude a rotation vector leads to from none.
fn turned_by(phi: Triple<1>) -> Accumulator {
    let [c, x, y, z] = Turn::exp(phi).parts();
    Accumulator::new([1.0 + c, x, y, z])
}

/// log of a unit quaternion: the rotation vector of at most half a turn. Not by
/// [`Quaternion::rotation_vector`], which divides where this multiplies: the sums of one method begin with these bits.
fn rotation_vector([w, x, y, z]: [f64; 4]) -> Triple<1> {
    let sign = if w < 0.0 { -1.0 } else { 1.0 };
    let v = Triple::new(x * sign, y * sign, z * sign);
    let s = v.norm();
    let half = s.atan2(w * sign);
    v * if s > 0.0 { 2.0 * half / s } else { 2.0 }
}
