//! Orientations recorded in the samples -> attitudes beside the estimated ones, for who is shown a run. Pure but for
//! showing them.
//!
//! Turned once for all so that the first agrees with what is estimated then: the world of a recording lies as it
//! likes. A drift shows, a constant does not, as in `compare --align`.

use super::delivery::Outlet;
use crate::sink::{Content, Stream};
use std::collections::VecDeque;
use strapd_attitude::condition::Clock;
use strapd_attitude::estimate::{Meaning, Prepared};
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, RawSample, Status};
use strapd_attitude::worlds::{Convention, World};

/// Orientations that may wait for the attitude of their sample: an estimator delays few.
const MOST: usize = 4096;

/// The recorded orientations of a topic.
#[derive(Debug)]
pub(super) struct RecordedTrack {
    stream: Stream,
    resolved: Meaning,
    clock: Clock,
    world: World,
    /// Level by gravity: only the heading is turned.
    is_level: bool,
    turn: Option<Quaternion<Nav, Nav>>,
    waiting: VecDeque<AttitudeSample>,
    ready: Vec<AttitudeSample>,
}

/// The stream of it; of the only topic it needs no other name.
fn recorded(of: &Stream, is_only: bool) -> Stream {
    let named = |name: &str| match is_only {
        true => "recorded".to_owned(),
        false => format!("{name} recorded"),
    };
    Stream {
        content: Content::Truth,
        id: named(&of.id),
        output_topic: format!("{}/recorded", of.output_topic),
        field_topic: None,
        frame_id: format!("{}_recorded", of.frame_id),
        ..of.clone()
    }
}

impl RecordedTrack {
    /// Makes it for what becomes stream `of`.
    pub(super) fn new(
        of: &Stream,
        is_only: bool,
        resolved: &Meaning,
        prepared: &Prepared,
    ) -> RecordedTrack {
        RecordedTrack {
            stream: recorded(of, is_only),
            resolved: resolved.clone(),
            clock: prepared.clock,
            world: prepared.world,
            is_level: prepared.aiding.is_some(),
            turn: None,
            waiting: VecDeque::new(),
            ready: Vec::new(),
        }
    }

    /// Takes the orientation of a sample, if it has one that can be one.
    pub(super) fn take(&mut self, raw: &RawSample) {
        let stamp = match self.clock {
            Clock::Header => raw.header,
            Clock::Log | Clock::Index { .. } => Some(raw.log),
            Clock::Publish => Some(raw.publish),
        };
        let recorded = raw
            .orientation
            .and_then(|wxyz| self.resolved.recorded_attitude(wxyz));
        let (Some(stamp), Some(q_nb)) = (stamp, recorded) else {
            return;
        };
        if self.waiting.len() >= MOST {
            self.waiting.pop_front();
        }
        let to = self.world.convention().unwrap_or(Convention::EnuFlu);
        let nothing = nalgebra::Vector3::repeat(f64::NAN);
        self.waiting.push_back(AttitudeSample {
            stamp,
            q_nb: Convention::EnuFlu.convert(to, q_nb),
            rate: BodyRate(nothing),
            accel: None,
            covariance: AttitudeCovariance::from_sigma(nothing),
            status: Status::OK,
            reset_count: 0,
            log: raw.log,
        });
    }

    /// Shows those up to the last of these estimates of stream `of`, which were shown.
    pub(super) fn show(&mut self, of: usize, estimates: &[AttitudeSample], outlet: &Outlet) {
        self.gather(estimates);
        outlet.recorded(of, &self.stream, &self.ready);
    }

    fn gather(&mut self, estimates: &[AttitudeSample]) {
        self.ready.clear();
        let Some(last) = estimates.last() else {
            return;
        };
        while let Some(next) = self.waiting.front().copied() {
            if next.stamp > last.stamp {
                break;
            }
            self.waiting.pop_front();
            if self.turn.is_none() {
                let own = estimates.iter().find(|own| own.stamp == next.stamp);
                self.turn = own.map(|own| self.turned(own.q_nb, next.q_nb));
            }
            if let Some(turn) = self.turn {
                self.ready.push(AttitudeSample {
                    q_nb: (turn * next.q_nb).normalised(),
                    ..next
                });
            }
        }
    }

    /// Rotation of the recorded world into the estimated one, at an instant of both.
    fn turned(
        &self,
        own: Quaternion<Nav, Body>,
        recorded: Quaternion<Nav, Body>,
    ) -> Quaternion<Nav, Nav> {
        let whole = own * recorded.inverse();
        let [w, _, _, z] = whole.wxyz();
        match self.is_level && w.hypot(z) > 1e-6 {
            true => Quaternion::assume_unit([w, 0.0, 0.0, z]).normalised(),
            false => whole,
        }
    }
}
