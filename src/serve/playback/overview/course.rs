//! One stream of a recording -> its curves over the whole of it, and how far it is from its reference. Pure.

use super::buckets::{Bucket, Buckets, ERROR, SERIES};
use crate::sink::Stream;
use serde_json::{Map, Value, json};
use std::collections::VecDeque;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{AttitudeSample, Nanos, Status};
use strapd_replay::summary::series::Elapsed;

/// Attitudes that wait for the reference beyond them: it comes with them, or not at all.
const MOST_WAITING: usize = 1 << 16;
/// Longest step of the reference over which it is interpolated, as on the page.
const LONGEST_STEP: f64 = 0.5;

/// Course of one stream.
#[derive(Debug)]
pub(super) struct Course {
    id: String,
    world: String,
    body: String,
    buckets: Buckets,
    axis: Elapsed,
    start: Option<Nanos>,
    /// Roll, pitch and yaw of the last sample, without jumps, deg.
    angles: [f64; 3],
    resets: u32,
    /// Whether some attitude carries the acceleration without gravity.
    has_acceleration: bool,
    errors: Errors,
}

/// Errors against the reference.
#[derive(Debug, Default)]
struct Errors {
    waiting: VecDeque<(i64, Nanos, Quaternion<Nav, Body>)>,
    before: Option<AttitudeSample>,
    compared: u64,
    squares: f64,
    worst: f64,
}

/// `angle` by as many whole rotations that it is nearest to `before`, deg.
fn unwrapped(before: f64, angle: f64) -> f64 {
    angle + 360.0 * ((before - angle) / 360.0).round()
}

impl Course {
    /// Course of `stream` in at most `most` stretches.
    pub(super) fn new(stream: &Stream, most: usize) -> Course {
        Course {
            id: stream.id.clone(),
            world: stream.world_axes.clone(),
            body: stream.body_axes.clone(),
            buckets: Buckets::new(most),
            axis: Elapsed::default(),
            start: None,
            angles: [0.0; 3],
            resets: 0,
            has_acceleration: false,
            errors: Errors::default(),
        }
    }

    /// Takes its next attitudes; those of an estimate wait for their reference.
    pub(super) fn take(&mut self, samples: &[AttitudeSample], is_estimate: bool) {
        for sample in samples {
            self.take_one(sample, is_estimate);
        }
    }

    fn take_one(&mut self, sample: &AttitudeSample, is_estimate: bool) {
        let is_first = self.start.is_none();
        self.start.get_or_insert(sample.stamp);
        let cuts = self.axis.cuts;
        let at = self.axis.advance(sample.stamp);
        let is_cut = !is_first
            && (self.axis.cuts > cuts
                || sample.reset_count != self.resets
                || sample.status.has(Status::HELD.with(Status::RESET)));
        self.resets = sample.reset_count;
        let angles = sample.q_nb.yaw_pitch_roll();
        let angles = [angles.roll, angles.pitch, angles.yaw].map(f64::to_degrees);
        for (last, angle) in self.angles.iter_mut().zip(angles) {
            *last = if is_first {
                angle
            } else {
                unwrapped(*last, angle)
            };
        }
        let [x, y, z]: [f64; 3] = sample.rate.into();
        let [x, y, z] = [x, y, z].map(f64::to_degrees);
        let [roll, pitch, yaw] = self.angles;
        let acceleration = sample.linear_acceleration;
        self.has_acceleration |= acceleration.is_some();
        let [east, north, up]: [f64; 3] = acceleration.map_or([f64::NAN; 3], |of| {
            (*of.in_world(&sample.q_nb).as_vector()).into()
        });
        let values = [x, y, z, roll, pitch, yaw, f64::NAN, east, north, up].map(|v| v as f32);
        self.buckets.push(at, sample.q_nb.wxyz(), values, is_cut);
        if is_estimate {
            let waiting = &mut self.errors.waiting;
            if waiting.len() >= MOST_WAITING {
                waiting.pop_front();
            }
            waiting.push_back((at, sample.stamp, sample.q_nb));
        }
    }

    /// Compares with the next attitudes of the reference, in the same world.
    pub(super) fn compare(&mut self, reference: &[AttitudeSample]) {
        let Errors {
            waiting,
            before,
            compared,
            squares,
            worst,
        } = &mut self.errors;
        for next in reference {
            while let Some((at, stamp, own)) = waiting.front().copied()
                && stamp <= next.stamp
            {
                waiting.pop_front();
                let Some(truth) = between(before.as_ref(), next, stamp) else {
                    continue;
                };
                let degrees = truth.angle_to(&own).to_degrees();
                *compared += 1;
                *squares += degrees * degrees;
                *worst = worst.max(degrees);
                self.buckets.put_error(at, degrees);
            }
            *before = Some(*next);
        }
    }

    /// First stamp.
    pub(super) fn start(&self) -> Option<Nanos> {
        self.start
    }

    /// Curves between two stamps; without stamps all of them.
    pub(super) fn json(
        &self,
        (from, to): (Option<Nanos>, Option<Nanos>),
        points: usize,
    ) -> Option<Value> {
        let start = self.start?;
        let place = |stamp: Nanos| stamp.since(start);
        let times = from.map_or(i64::MIN, place)..to.map_or(i64::MAX, place);
        let part = self.buckets.between(times, points);
        let mut all = Map::new();
        let mut put = |name: &str, value: Value| all.insert(name.to_owned(), value);
        let (sec, nsec) = start.to_sec_nanosec();
        put("id", json!(self.id));
        put("world", json!(self.world));
        put("body", json!(self.body));
        put("start", json!({"sec": sec, "nsec": nsec}));
        put(
            "length_s",
            json!(self.buckets.end().unwrap_or(0) as f64 * 1e-9),
        );
        put("samples", json!(self.buckets.samples));
        let of = |what: &dyn Fn(&Bucket) -> Value| part.iter().map(what).collect::<Value>();
        put("time", of(&|b| json!(b.at as f64 * 1e-9)));
        put("seq", of(&|b| json!(b.seq)));
        put("count", of(&|b| json!(b.count)));
        put("cut", of(&|b| json!(u8::from(b.is_cut))));
        put("q", of(&|b| json!(b.q)));
        let known = if self.has_acceleration {
            SERIES
        } else {
            ERROR + 1
        };
        for (name, series) in [("first", 0), ("low", 1), ("high", 2)] {
            put(
                name,
                of(&|b| {
                    let values = [&b.first, &b.low, &b.high];
                    json!(values.get(series).and_then(|all| all.get(..known)))
                }),
            );
        }
        let found = self.errors.compared;
        put("compared", json!(found));
        if found > 0 {
            put("worst_deg", json!(self.errors.worst));
            put(
                "rms_deg",
                json!((self.errors.squares / found as f64).sqrt()),
            );
        }
        Some(Value::Object(all))
    }
}

/// Attitude of the reference at `stamp`, between two of it; `None` before the first, across a reset and a hole.
fn between(
    before: Option<&AttitudeSample>,
    next: &AttitudeSample,
    stamp: Nanos,
) -> Option<Quaternion<Nav, Body>> {
    if next.stamp == stamp {
        return Some(next.q_nb);
    }
    let before = before.filter(|b| b.reset_count == next.reset_count && b.stamp <= stamp)?;
    let step = next.stamp.secs_since(before.stamp);
    (step <= LONGEST_STEP).then(|| {
        let part = stamp.secs_since(before.stamp) / step;
        before.q_nb.slerp(&next.q_nb, part)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use strapd_attitude::quaternion::BodyRate;
    use strapd_attitude::record::AttitudeCovariance;

    fn heading(ms: i64, degrees: f64, resets: u32) -> AttitudeSample {
        let half = degrees.to_radians() / 2.0;
        AttitudeSample {
            stamp: Nanos(1_700_000_000_000_000_000 + ms * 1_000_000),
            q_nb: Quaternion::assume_unit([half.cos(), 0.0, 0.0, half.sin()]),
            rate: BodyRate(nalgebra::Vector3::zeros()),
            accel: None,
            linear_acceleration: None,
            covariance: AttitudeCovariance::from_sigma(nalgebra::Vector3::zeros()),
            status: Status::OK,
            reset_count: resets,
            log: Nanos(0),
            temperature: None,
        }
    }

    #[test]
    fn yaw_goes_on_beyond_half_a_rotation() {
        let mut course = Course::new(&Stream::new("/imu", "imu"), 100);
        let turning: Vec<_> = (0..50)
            .map(|k| heading(10 * k, 20.0 * k as f64, 0))
            .collect();
        course.take(&turning, false);
        let json = course.json((None, None), 100).unwrap_or_default();
        let yaw = &json["high"][49][5];
        assert!((yaw.as_f64().unwrap_or(0.0) - 980.0).abs() < 1e-3, "{yaw}");
    }

    #[test]
    fn errors_are_of_the_whole_and_not_across_a_reset_of_the_reference() {
        let mut course = Course::new(&Stream::new("/imu", "imu"), 100);
        let own: Vec<_> = (0..100).map(|k| heading(10 * k, 0.0, 0)).collect();
        course.take(&own, true);
        // Between two of its samples the reference is interpolated; where it was reset it is not.
        let of = |k: i64| {
            heading(
                10 * k + 5,
                if k < 50 { 3.0 } else { 123.0 },
                u32::from(k >= 50),
            )
        };
        course.compare(&(0..50).map(of).collect::<Vec<_>>());
        let before = course.errors.compared;
        assert_eq!(before, 49);
        assert!((course.errors.worst - 3.0).abs() < 1e-9);
        course.compare(&(50..52).map(of).collect::<Vec<_>>());
        assert_eq!(course.errors.compared, 50);
        let json = course.json((None, None), 100).unwrap_or_default();
        assert_eq!(json["worst_deg"].as_f64().map(f64::round), Some(123.0));
        assert_eq!(json["low"][50][6], Value::Null);
    }
}
