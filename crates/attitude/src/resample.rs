//! Attitudes of a run -> attitudes at instants of their own, such as the frames of a camera. Pure.
//!
//! A stage of its own because the nearest sample is up to half a step off, by which a body in motion has turned.
//!
//! ```text
//! attitudes, instants -> window of four -> cubic on the rotation group -> attitudes at the instants
//! ```

use crate::frames::{Body, In};
use crate::quaternion::{BodyRate, RotationVector};
use crate::record::{AttitudeCovariance, AttitudeSample, LinearAcceleration, Nanos, Status};
use nalgebra::Vector3;
use std::collections::VecDeque;
use std::sync::Arc;

/// Status of an attitude that does not go on from the one before it: there is no motion to follow.
pub const CUTS: Status =
    Status(Status::HELD.0 | Status::RESET.0 | Status::RESTARTED.0 | Status::LEVELLED.0);

/// Attitudes that are waited for on either side of an instant.
const WINDOW: usize = 4;

/// Instants that have no attitude, and why.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Left {
    /// Number before the first attitude or after the last.
    pub outside: usize,
    /// Number in gaps that the attitude was held over, or at which it began anew.
    pub in_gaps: usize,
}

/// A resampler of one run.
///
/// A cubic on the rotation group goes through both neighbours of an instant, with the rates that the steps beside
/// tell: those of the parabola through three attitudes, at an end or a gap that of the one step there is. For steps of h
/// its error grows with h^3 times the change of the angular acceleration.
///
/// # Example
/// ```
/// use strapd_attitude::quaternion::{BodyRate, Quaternion, RotationVector};
/// use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, Status};
/// use strapd_attitude::resample::Resampler;
///
/// // A turn about z at 1 rad/s, ten attitudes a second.
/// let attitudes: Vec<AttitudeSample> = (0..10)
///     .map(|n| AttitudeSample {
///         stamp: Nanos(n * 100_000_000),
///         q_nb: Quaternion::from_rotation_vector(&RotationVector([0.0, 0.0, 0.1 * n as f64].into())),
///         rate: BodyRate([0.0, 0.0, 1.0].into()),
///         accel: None,
///         linear_acceleration: None,
///         covariance: AttitudeCovariance::default(),
///         status: Status::OK,
///         reset_count: 0,
///         log: Nanos(n * 100_000_000),
///         temperature: None,
///     })
///     .collect();
/// let mut frames = Vec::new();
/// let mut resampler = Resampler::new(vec![Nanos(333_000_000), Nanos(2_000_000_000)]);
/// resampler.push(&attitudes, &mut frames);
/// resampler.finish(&mut frames);
/// assert!((frames[0].q_nb.yaw_pitch_roll().yaw - 0.333).abs() < 1e-12);
/// assert_eq!((frames.len(), resampler.left().outside), (1, 1));
/// ```
#[derive(Clone, Debug)]
pub struct Resampler {
    /// Instants in order of time.
    instants: Arc<[Nanos]>,
    /// Number of them that are done.
    done: usize,
    /// The newest attitudes, oldest first.
    window: VecDeque<AttitudeSample>,
    left: Left,
}

impl Resampler {
    /// Makes one for these instants, in any order; those in order of time are shared, and others copied.
    #[must_use]
    pub fn new(instants: impl Into<Arc<[Nanos]>>) -> Resampler {
        let mut instants = instants.into();
        if !instants.is_sorted() {
            let mut ordered = instants.to_vec();
            ordered.sort_unstable();
            instants = ordered.into();
        }
        Resampler {
            instants,
            done: 0,
            window: VecDeque::with_capacity(WINDOW + 1),
            left: Left::default(),
        }
    }

    /// Takes attitudes in order of time, and appends those at instants that lie between attitudes with one more behind
    /// them. Provisional ones are passed over.
    pub fn push(&mut self, samples: &[AttitudeSample], out: &mut Vec<AttitudeSample>) {
        for sample in samples {
            if sample.status.has(Status::PROVISIONAL) {
                continue;
            }
            // A clock that goes back has no instant between.
            if self
                .window
                .back()
                .is_some_and(|last| sample.stamp <= last.stamp)
            {
                self.fill_last(out);
                self.window.clear();
            }
            self.window.push_back(*sample);
            if self.window.len() > WINDOW {
                self.window.pop_front();
            }
            let newest = self.window.len() - 1;
            if newest == 0 {
                self.pass_before(sample.stamp);
            } else if newest > 1 {
                self.fill(newest - 1, out);
            }
        }
    }

    /// The run has ended: appends the attitudes that still wait.
    pub fn finish(&mut self, out: &mut Vec<AttitudeSample>) {
        self.fill_last(out);
        self.left.outside += self.instants.len() - self.done;
        self.done = self.instants.len();
        self.window.clear();
    }

    /// Instants without an attitude, as far as is known by now.
    #[must_use]
    pub fn left(&self) -> Left {
        self.left
    }

    /// All instants, in order of time.
    #[must_use]
    pub fn instants(&self) -> &[Nanos] {
        &self.instants
    }

    /// Instants before the first attitude, or between two whose clock went back.
    fn pass_before(&mut self, stamp: Nanos) {
        while self.next().is_some_and(|instant| instant < stamp) {
            self.left.outside += 1;
            self.done += 1;
        }
    }

    /// Fills in up to the newest attitude, or at the only one.
    fn fill_last(&mut self, out: &mut Vec<AttitudeSample>) {
        match self.window.len() {
            0 => {}
            1 => {
                let only = self.window[0];
                while self.next() == Some(only.stamp) {
                    out.push(only);
                    self.done += 1;
                }
            }
            several => self.fill(several - 1, out),
        }
    }

    fn next(&self) -> Option<Nanos> {
        self.instants.get(self.done).copied()
    }

    /// Fills in at the instants up to the attitude `right` of the window.
    fn fill(&mut self, right: usize, out: &mut Vec<AttitudeSample>) {
        let end = self.window[right].stamp;
        while let Some(instant) = self.next().filter(|instant| *instant <= end) {
            self.done += 1;
            let (before, after) = (&self.window[right - 1], &self.window[right]);
            if instant == after.stamp {
                out.push(*after);
            } else if instant <= before.stamp {
                // Only of the first step: later ones have been met as the end of the step before.
                out.push(*before);
            } else if after.status.has(CUTS) {
                self.left.in_gaps += 1;
            } else {
                out.push(self.between(right, instant));
            }
        }
    }

    /// The attitude at an instant between those of the window before and at `right`.
    fn between(&self, right: usize, instant: Nanos) -> AttitudeSample {
        let (before, after) = (&self.window[right - 1], &self.window[right]);
        let span = after.stamp.since(before.stamp) as f64;
        let part = instant.since(before.stamp) as f64 / span;
        let turn = turned(before, after);
        let earlier = right.checked_sub(2).map(|at| &self.window[at]);
        let earlier = earlier.filter(|_| !before.status.has(CUTS));
        let later = self.window.get(right + 1).filter(|s| !s.status.has(CUTS));
        // Turn over this step by the rate at either end; that of the step itself where nothing lies beside it.
        let begins = earlier.map_or(turn, |earlier| rate_at([earlier, before, after]) * span);
        let ends = later.map_or(turn, |later| rate_at([before, after, later]) * span);
        let (two, three) = (part * part, part * part * part);
        // Beside their mean the rates of the ends differ by little: what the group's curvature adds is of third order.
        let bend = (begins - turn) * (part - 2.0 * two + three) + (ends - turn) * (three - two);
        let q_nb = before
            .q_nb
            .advanced(&RotationVector(turn * part + bend))
            .normalised();
        let mix = |a: &Vector3<f64>, b: &Vector3<f64>| a + (b - a) * part;
        let upper = |a: [f64; 6], b: [f64; 6]| -> [f64; 6] {
            std::array::from_fn(|i| a[i] + (b[i] - a[i]) * part)
        };
        let vector = |a: &In<Body>, b: &In<Body>| In::assume(mix(a.as_vector(), b.as_vector()));
        let log = after.log.since(before.log) as f64 * part;
        AttitudeSample {
            stamp: instant,
            q_nb,
            rate: BodyRate(mix(&before.rate.0, &after.rate.0)),
            accel: before.accel.zip(after.accel).map(|(a, b)| vector(&a, &b)),
            linear_acceleration: before
                .linear_acceleration
                .zip(after.linear_acceleration)
                .map(|(a, b)| LinearAcceleration {
                    body: vector(&a.body, &b.body),
                    covariance: upper(a.covariance, b.covariance),
                }),
            covariance: AttitudeCovariance::from_upper(upper(
                before.covariance.upper(),
                after.covariance.upper(),
            )),
            status: after.status,
            reset_count: after.reset_count,
            log: Nanos(before.log.0.saturating_add(log.round() as i64)),
            temperature: before.temperature,
        }
    }
}

/// Rotation vector from one attitude to the next, body axes, rad.
fn turned(before: &AttitudeSample, after: &AttitudeSample) -> Vector3<f64> {
    (before.q_nb.inverse() * after.q_nb).rotation_vector().0
}

/// Rate at the middle one of three attitudes, rad/ns: that of the parabola through them.
fn rate_at([earlier, at, later]: [&AttitudeSample; 3]) -> Vector3<f64> {
    let nanos = |from: &AttitudeSample, to: &AttitudeSample| to.stamp.since(from.stamp) as f64;
    let (before, after) = (nanos(earlier, at), nanos(at, later));
    let share = after / (before + after);
    turned(earlier, at) * (share / before) + turned(at, later) * ((1.0 - share) / after)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::frames::Nav;
    use crate::quaternion::Quaternion;

    /// Attitude of a body that cones and turns, t s after the beginning.
    fn truth(t: f64) -> Quaternion<Nav, Body> {
        let turn =
            |v: [f64; 3]| Quaternion::<Body, Body>::from_rotation_vector(&RotationVector(v.into()));
        let first = Quaternion::<Nav, Body>::from_rotation_vector(&RotationVector(
            [0.0, 0.0, 1.3 * t].into(),
        ));
        first * turn([0.6 * (3.0 * t).sin(), 0.0, 0.0]) * turn([0.0, 0.4 * (2.0 * t).cos(), 0.0])
    }

    fn sample(ns: i64) -> AttitudeSample {
        AttitudeSample {
            stamp: Nanos(ns),
            q_nb: truth(ns as f64 * 1e-9),
            rate: BodyRate(Vector3::new(ns as f64, 0.0, 1.0)),
            accel: None,
            linear_acceleration: None,
            covariance: AttitudeCovariance::from_sigma(Vector3::repeat(0.1)),
            status: Status::OK,
            reset_count: 2,
            log: Nanos(ns + 7),
            temperature: None,
        }
    }

    fn at(samples: &[AttitudeSample], instants: &[i64], cut: usize) -> (Vec<AttitudeSample>, Left) {
        let mut resampler = Resampler::new(instants.iter().copied().map(Nanos).collect::<Vec<_>>());
        let mut out = Vec::new();
        for part in samples.chunks(cut) {
            resampler.push(part, &mut out);
        }
        resampler.finish(&mut out);
        (out, resampler.left())
    }

    const STEP: i64 = 10_000_000;

    #[test]
    fn frames_have_the_attitude_of_their_own_instant_and_not_of_the_nearest_sample() {
        let samples: Vec<_> = (0..200).map(|n| sample(n * STEP)).collect();
        let frames: Vec<i64> = (0..59).map(|n| n * 33_366_700 + 1).collect();
        let (found, left) = at(&samples, &frames, 7);
        assert_eq!((found.len(), left), (59, Left::default()));
        let worst = |h: i64| {
            let samples: Vec<_> = (0..2_000_000_000 / h).map(|n| sample(n * h)).collect();
            let (found, _) = at(&samples, &frames, 1000);
            // Without the ends, where there is no neighbour but one.
            let inner = found.iter().skip(2).take(found.len() - 4);
            inner
                .map(|s| s.q_nb.angle_to(&truth(s.stamp.0 as f64 * 1e-9)))
                .fold(0.0, f64::max)
        };
        let (fine, coarse) = (worst(STEP), worst(2 * STEP));
        // Largest nearest-sample error: half a step of 2 rad/s.
        assert!(fine < 2e-6, "{fine:e} rad");
        // Of third order.
        assert!(
            coarse / fine > 6.0 && coarse / fine < 20.0,
            "{coarse:e} / {fine:e}"
        );
        assert_eq!(found[0].stamp, Nanos(1));
        assert_eq!(found[0].log, Nanos(8));
        assert!((found[0].covariance.xx - 0.01).abs() < 1e-15);
    }

    #[test]
    fn bits_do_not_depend_on_how_a_run_is_cut() {
        let samples: Vec<_> = (0..50).map(|n| sample(n * STEP)).collect();
        let frames: Vec<i64> = (0..150).rev().map(|n| n * 3_333_333).collect();
        let whole = at(&samples, &frames, 1000);
        for cut in [1, 2, 3, 11] {
            assert_eq!(at(&samples, &frames, cut), whole);
        }
    }

    #[test]
    fn instants_outside_and_in_gaps_are_counted_and_get_nothing() {
        let mut samples: Vec<_> = (0..10).map(|n| sample(n * STEP)).collect();
        samples[5].status = Status::HELD;
        let instants = [
            -1, 0, 45_000_000, 50_000_000, 55_000_000, 90_000_000, 90_000_001,
        ];
        let (found, left) = at(&samples, &instants, 3);
        let stamps: Vec<i64> = found.iter().map(|s| s.stamp.0).collect();
        assert_eq!(stamps, [0, 50_000_000, 55_000_000, 90_000_000]);
        assert_eq!((left.outside, left.in_gaps), (2, 1));
        // At a stamp it is the sample itself.
        assert_eq!(found[0], samples[0]);
    }

    #[test]
    fn one_attitude_none_and_a_clock_that_goes_back_are_no_trouble() {
        assert_eq!(at(&[], &[1, 2], 1).1.outside, 2);
        let (found, left) = at(&[sample(5)], &[4, 5, 5, 6], 1);
        assert_eq!((found.len(), left.outside), (2, 2));
        let back = [sample(0), sample(STEP), sample(3), sample(STEP + 5)];
        let (found, left) = at(&back, &[5_000_000, STEP + 2], 1);
        let stamps: Vec<i64> = found.iter().map(|s| s.stamp.0).collect();
        assert_eq!((stamps, left), (vec![5_000_000, STEP + 2], Left::default()));
    }

    #[test]
    fn provisional_attitudes_are_passed_over() {
        let samples: Vec<_> = (0..6)
            .flat_map(|n| {
                let mut early = sample(n * STEP);
                early.status = Status::PROVISIONAL;
                early.q_nb = Quaternion::identity();
                [early, sample(n * STEP)]
            })
            .collect();
        let (found, _) = at(&samples, &[25_000_000], 4);
        assert!(found[0].q_nb.angle_to(&truth(0.025)) < 1e-5);
    }
}
