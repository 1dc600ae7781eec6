//! Steps and waiting samples -> outputs. Pure.

use super::world::TurningWorld;
use crate::propagate::accumulate::Accumulator;
use crate::propagate::columns::{Track, secs};
use crate::propagate::covariance::Covariance;
use crate::propagate::difference::Difference;
use crate::propagate::lanes::Triple;
use crate::propagate::method::Method;
use crate::propagate::report::Report;
use crate::propagate::settings::Settings;
use crate::propagate::turn::Turn;
use crate::propagate::window::{Note, Step};
use crate::quaternion::{BodyRate, Quaternion};
use crate::record::{AttitudeSample, RateSample, Status};
use nalgebra::Vector3;
use std::collections::VecDeque;

/// A sample taken in and not yet output.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    pub(super) sample: RateSample,
    /// Whether it advances in time and so ends an interval.
    pub(super) turns: bool,
}

/// State of which the outputs are made.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) attitude: Accumulator,
    /// Sum of rotation vectors, for the method that wants it.
    pub(super) sum: Option<Triple<1>>,
    /// World to which the accumulated attitude is relative, where the world turns: then it is q_ib.
    pub(super) world: Option<TurningWorld>,
    /// Instant of the attitude accumulated, ns.
    pub(super) now: i64,
    pub(super) covariance: Covariance,
    pub(super) difference: Difference,
    /// Bits of the output being made that the propagator adds.
    pub(super) added: Status,
    pub(super) report: Report,
    pub(super) reset_count: u32,
    pub(super) rate: Vector3<f64>,
    pub(super) integrated_nanos: i64,
}

impl State {
    pub(super) fn new(settings: &Settings, initial: [f64; 4]) -> Self {
        let sum = (settings.method == Method::RotvecSum).then(|| rotation_vector(initial));
        State {
            attitude: sum.map_or(Accumulator::new(initial), turned_by),
            sum,
            world: TurningWorld::new(settings.world_rate.as_vector()),
            now: 0,
            covariance: Covariance::new(settings.noise),
            difference: Difference::default(),
            added: Status::OK,
            report: Report::default(),
            reset_count: 0,
            rate: Vector3::zeros(),
            integrated_nanos: 0,
        }
    }

    /// A run begins at `stamp` with the attitude as it is: what lies between adds no rotation of the
    /// body relative to the world.
    pub(super) fn begin(&mut self, stamp: i64) {
        if self.world.is_some() && self.now != stamp {
            let q_nb = self.q_nb();
            self.attitude = Accumulator::new(q_nb);
            if let Some(sum) = &mut self.sum {
                *sum = rotation_vector(q_nb);
                // The same attitude on the other side of the sphere: a turn less about its axis.
                let angle = sum.norm();
                if q_nb[0] < 0.0 && angle > 0.0 {
                    *sum = *sum * ((angle - std::f64::consts::TAU) / angle);
                }
            }
        }
        if let Some(world) = &mut self.world {
            world.count_from(stamp);
        }
        self.now = stamp;
    }

    /// The attitude relative to the world, which may have turned.
    #[inline(always)]
    fn q_nb(&mut self) -> [f64; 4] {
        let accumulated = self.attitude.attitude();
        match &self.world {
            None => accumulated,
            Some(world) => world.attitude(self.now, &accumulated),
        }
    }

    /// Goes on from an attitude that was saved, at its instant.
    pub(super) fn resume(&mut self, last: &AttitudeSample) {
        self.reset(last.q_nb.wxyz());
        self.covariance.resume(last.covariance);
        self.now = last.stamp.0;
        self.reset_count = last.reset_count;
    }

    pub(super) fn reset(&mut self, initial: [f64; 4]) {
        self.attitude.restart(initial);
        self.covariance.restart();
        self.difference.restart();
        if let Some(sum) = &mut self.sum {
            *sum = rotation_vector(initial);
            self.attitude = turned_by(*sum);
        }
    }

    /// Turns on over interval k.
    #[inline(always)]
    pub(super) fn step(&mut self, step: &Step, track: &Track, k: usize) {
        let mut turn = step.turn;
        match &mut self.sum {
            None => self.attitude.turn(turn),
            Some(sum) => {
                let [_, x, y, z] = turn;
                let phi = Triple::new(x, y, z);
                *sum = *sum + phi;
                self.attitude = turned_by(*sum);
                turn = Turn::exp(phi).parts();
            }
        }
        self.now = track.stamp[k];
        self.difference.add(&self.attitude, step.outer);
        let spacing = track.spacing(k);
        self.covariance.advance(turn, secs(spacing));
        self.integrated_nanos = self.integrated_nanos.saturating_add(spacing);
        self.report.angle_turned += step.angle;
        self.report.largest_step = self.report.largest_step.max(step.angle);
        self.added = self.added.with(step.status());
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
        queue: &mut VecDeque<Waiting>,
        track: &Track,
        k: usize,
        out: &mut Vec<AttitudeSample>,
    ) {
        if let Some(Waiting { sample, .. }) = queue.pop_front() {
            self.output_at(&sample, Some(track.rate(k)), out);
        }
        self.flush_stalled(queue, out);
    }

    /// Outputs samples that turned nothing, up to the next that will.
    #[inline(always)]
    pub(super) fn flush_stalled(
        &mut self,
        queue: &mut VecDeque<Waiting>,
        out: &mut Vec<AttitudeSample>,
    ) {
        while let Some(&Waiting {
            sample,
            turns: false,
        }) = queue.front()
        {
            queue.pop_front();
            self.output_at(&sample, None, out);
        }
    }

    #[inline(always)]
    pub(super) fn output_at(
        &mut self,
        sample: &RateSample,
        rate: Option<Triple<1>>,
        out: &mut Vec<AttitudeSample>,
    ) {
        if let Some(rate) = rate {
            self.rate = Vector3::new(rate.x.0[0], rate.y.0[0], rate.z.0[0]);
        }
        let q_nb = self.q_nb();
        out.push(AttitudeSample {
            stamp: sample.stamp,
            q_nb: Quaternion::assume_unit(q_nb),
            rate: BodyRate(self.rate),
            accel: sample.accel,
            covariance: self.covariance.attitude(),
            status: sample.status.with(self.added),
            reset_count: self.reset_count,
            log: sample.log,
        });
        self.added = Status::OK;
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
