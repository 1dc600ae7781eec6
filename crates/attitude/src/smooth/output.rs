//! Nodes and constants -> the attitude at every sample. Pure.
//!
//! A stage of its own because it is one more pass, and the only one whose result is as long as the log.

use super::factors::{Node, difference};
use super::pass::by_segment;
use super::prepared::Prepared;
use super::result::Sizes;
use super::sample::{Sample, Samples};
use super::segments::Segment;
use super::smoothed::Smoothed;
use super::sweep::Sensor;
use crate::frames::{Body, Nav};
use crate::quaternion::Quaternion;
use crate::quaternion::kernel::{normalised, turned, turned_in_navigation};
use crate::record::Nanos;
use nalgebra::{Matrix3, Vector3};
use std::cell::RefCell;
use std::collections::VecDeque;

/// Sigmas of every attitude: of the axes of a case, rad, and of its stamp, s.
const AXES: f64 = 0.2_f64.to_radians();
const TIMING: f64 = 0.0025;

/// The attitude at a sample.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Estimate {
    /// Stamp of the sample.
    pub stamp: Nanos,
    /// Body to earth: east (with a field: magnetic), north, up.
    pub q_nb: Quaternion<Nav, Body>,
    /// Covariance of the error `q_true = exp(error) q_nb`, rad^2, earth axes.
    pub covariance: Matrix3<f64>,
    /// The rate without what is known of the sensor's errors, rad/s, body axes.
    pub rate: Vector3<f64>,
    /// Index of the section it belongs to.
    pub section: usize,
    /// The sample could not be used: it has the attitude of the next instant that has one.
    pub is_filled: bool,
}

/// Inputs that wait for their attitude.
struct PendingInputs {
    stamps: VecDeque<Nanos>,
    /// Place in the input of the first of them.
    first: u64,
}

impl PendingInputs {
    fn pop(&mut self) -> Option<Nanos> {
        self.first += 1;
        self.stamps.pop_front()
    }
}

impl Smoothed {
    /// Gives the attitude at every sample that came, in order, in chunks. How large forces and fields were, for each
    /// segment between two nodes that has some.
    ///
    /// # Errors
    /// Those of `samples`, which are to be the ones that were smoothed.
    pub fn attitudes<S: Samples>(
        &self,
        samples: &mut S,
        mut take: impl FnMut(&[Estimate]),
    ) -> Result<Vec<Sizes>, S::Error> {
        let waiting = RefCell::new(PendingInputs {
            stamps: VecDeque::new(),
            first: 0,
        });
        let mut watched = Watched {
            samples,
            waiting: &waiting,
        };
        let sensor = Sensor::of(&self.constants, self.survey.force);
        let mut out = Vec::new();
        let mut swept: Vec<[f64; 4]> = Vec::new();
        let mut last = None;
        let mut section = 0;
        let mut all_sizes = Vec::new();
        by_segment(
            &mut watched,
            (&self.survey, &self.settings),
            &self.segments,
            |k, held| {
                let (from, to) = (k.unwrap_or(0), k.map_or(0, |k| k + 1));
                let (a, b) = (&self.nodes[from], &self.nodes[to]);
                let is_break = k.is_some_and(|k| self.segments[k].is_break);
                section += usize::from(is_break);
                all_sizes.extend(k.and_then(|k| self.sizes(&self.segments[k], held, &sensor)));
                swept.clear();
                let residual = if k.is_none() || is_break {
                    swept.resize(held.len(), b.q);
                    Vector3::zeros()
                } else {
                    self.walk(held, a, b, &sensor, &mut swept)
                };
                let whole: f64 = held.iter().map(|sample| sample.secs).sum();
                let mut secs = 0.0;
                let mut queue = waiting.borrow_mut();
                for (sample, q) in held.iter().zip(&swept) {
                    secs += sample.secs;
                    let share = if whole > 0.0 {
                        (secs / whole).min(1.0)
                    } else {
                        1.0
                    };
                    let share_of_node = if is_break || k.is_none() { 1.0 } else { share };
                    let estimate =
                        self.estimate(sample, q, residual * share, (a, b, share_of_node), &sensor);
                    let estimate = Estimate {
                        section,
                        ..estimate
                    };
                    let covariance =
                        self.covariance_at((from, to), share_of_node, &estimate.rate, section);
                    let estimate = Estimate {
                        covariance,
                        ..estimate
                    };
                    give(sample, &estimate, &mut queue, &mut out);
                    last = Some(estimate);
                }
                if out.len() >= 4096 {
                    take(&out);
                    out.clear();
                }
            },
        )?;
        let mut queue = waiting.borrow_mut();
        while let Some(stamp) = queue.pop() {
            out.extend(last.map(|last| Estimate {
                stamp,
                is_filled: true,
                ..last
            }));
        }
        take(&out);
        Ok(all_sizes)
    }

    /// Sizes of forces and fields of a segment; `None` of one in motion without a field.
    fn sizes(&self, segment: &Segment, held: &[Prepared], sensor: &Sensor) -> Option<Sizes> {
        let mean = |sizes: &mut dyn Iterator<Item = [f64; 2]>| {
            let (mut sum, mut count) = ([0.0; 2], 0.0);
            for [measured, calibrated] in sizes {
                sum = [sum[0] + measured, sum[1] + calibrated];
                count += 1.0;
            }
            (count > 0.0).then(|| sum.map(|sum| sum / count))
        };
        let forces = held.iter().filter(|_| segment.is_still).map(|sample| {
            let calibrated: Vector3<f64> = sensor.force * (sample.force - sensor.force_bias);
            [sample.force.norm(), calibrated.norm()]
        });
        let has_field = |sample: &&Prepared| {
            self.calibration.magnetometer.is_some() && sample.field.iter().all(|m| m.is_finite())
        };
        let fields = held.iter().filter(has_field).map(|sample| {
            let calibrated: Vector3<f64> = sensor.field * (sample.field - sensor.iron);
            [sample.field.norm(), calibrated.norm()]
        });
        let sizes = Sizes {
            stamp: Nanos(segment.stamp),
            force: mean(&mut { forces }),
            field: mean(&mut { fields }),
        };
        (sizes.force.is_some() || sizes.field.is_some()).then_some(sizes)
    }

    /// Attitudes of a segment's samples from its node on, and by what they miss the next one.
    fn walk(
        &self,
        held: &[Prepared],
        a: &Node,
        b: &Node,
        sensor: &Sensor,
        swept: &mut Vec<[f64; 4]>,
    ) -> Vector3<f64> {
        let mut q = a.q;
        for sample in held {
            let w = sensor.rate(sample, &a.bias);
            q = turned(&q, &(w * sample.secs));
            swept.push(q);
        }
        difference(&b.q, &normalised(&q))
    }

    fn estimate(
        &self,
        sample: &Prepared,
        q: &[f64; 4],
        residual: Vector3<f64>,
        (a, b, share): (&Node, &Node, f64),
        sensor: &Sensor,
    ) -> Estimate {
        let bias = a.bias + (b.bias - a.bias) * share;
        let rate = sensor.rate(sample, &bias);
        let mut q = turned_in_navigation(&residual, q);
        if self.settings.sensor_delay != 0.0 {
            q = turned(&q, &(rate * self.settings.sensor_delay));
        }
        Estimate {
            stamp: Nanos(sample.stamp),
            q_nb: Quaternion::assume_unit(normalised(&q)),
            covariance: Matrix3::zeros(),
            rate,
            section: 0,
            is_filled: !sample.is_input,
        }
    }
}

/// The samples that wait up to this one, and it.
fn give(
    sample: &Prepared,
    estimate: &Estimate,
    queue: &mut PendingInputs,
    out: &mut Vec<Estimate>,
) {
    let is_before = |queue: &PendingInputs| {
        queue.first < sample.input
            && (sample.is_input
                || queue
                    .stamps
                    .front()
                    .is_some_and(|stamp| stamp.0 <= sample.stamp))
    };
    while is_before(queue) {
        let Some(stamp) = queue.pop() else { return };
        out.push(Estimate {
            stamp,
            is_filled: true,
            ..*estimate
        });
    }
    if sample.is_input && queue.first == sample.input {
        queue.pop();
        out.push(*estimate);
    }
}

/// Samples whose stamps are kept until their attitude comes.
struct Watched<'a, S> {
    samples: &'a mut S,
    waiting: &'a RefCell<PendingInputs>,
}

impl<S: Samples> Samples for Watched<'_, S> {
    type Error = S::Error;

    fn pass(&mut self, take: &mut dyn FnMut(&[Sample])) -> Result<(), S::Error> {
        self.samples.pass(&mut |chunk| {
            self.waiting
                .borrow_mut()
                .stamps
                .extend(chunk.iter().map(|sample| sample.stamp));
            take(chunk);
        })
    }
}

/// Variance of each axis beside what the equations say, rad^2.
pub(super) fn floor(rate: &Vector3<f64>) -> f64 {
    AXES * AXES + rate.norm_squared() * TIMING * TIMING
}
