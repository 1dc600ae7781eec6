//! Orientations of a reference -> attitudes beside the estimated ones, for who is shown a run. Pure but for showing
//! them.
//!
//! They lie in the samples, on a topic of their own or in another file. Their world lies as it likes, so each part
//! between two resets of their source is aligned once, where it begins: a drift shows, a constant does not, as in
//! `compare --align`.

use super::attitude_track::{Entry, Track, cut};
use super::delivery::Outlet;
use crate::sink::{Content, Stream};
use std::collections::VecDeque;
use std::sync::Arc;
use strapd_attitude::condition::Clock;
use strapd_attitude::estimate::{Meaning, Prepared};
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, RawSample, Status};
use strapd_attitude::worlds::{Convention, World};

/// Orientations that may wait for the attitude of their sample: an estimator delays few.
const MOST: usize = 4096;
/// Longest step between two attitudes over which one is interpolated, to align a reference, s.
const LONGEST_STEP: f64 = 0.5;

/// Place of the orientations.
#[derive(Debug)]
enum Place {
    /// The samples.
    Samples,
    /// Another topic.
    Topic,
    /// Another file, read as far as this entry.
    File(Arc<Track>, usize),
}

/// The recorded orientations of a topic.
#[derive(Debug)]
pub(super) struct RecordedTrack {
    stream: Stream,
    resolved: Meaning,
    clock: Clock,
    world: World,
    /// Level by gravity: only the heading is turned.
    is_level: bool,
    place: Place,
    turn: Option<Quaternion<Nav, Nav>>,
    /// Count of its resets that the source stated last, and of those that were seen.
    stated: Option<u8>,
    resets: u32,
    /// Resets before what was shown last.
    shown: u32,
    last_estimate: Option<AttitudeSample>,
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
            place: Place::Samples,
            turn: None,
            stated: None,
            resets: 0,
            shown: 0,
            last_estimate: None,
            waiting: VecDeque::new(),
            ready: Vec::new(),
        }
    }

    /// The reference comes from a topic of its own, whose orientations are in `recorded`'s convention.
    pub(super) fn take_reference_from(&mut self, recorded: &Meaning) {
        self.place = Place::Topic;
        self.resolved.recorded = recorded.recorded;
    }

    /// The reference is this track.
    pub(super) fn take_reference_track(&mut self, track: Arc<Track>) {
        self.place = Place::File(track, 0);
    }

    /// Takes the orientation of a sample, unless the reference is elsewhere.
    pub(super) fn take(&mut self, raw: &RawSample) {
        if matches!(self.place, Place::Samples) {
            self.take_orientation(raw);
        }
    }

    /// Takes a message of the reference's own topic.
    pub(super) fn take_reference(&mut self, raw: &RawSample) {
        if matches!(self.place, Place::Topic) {
            self.take_orientation(raw);
        }
    }

    fn take_orientation(&mut self, raw: &RawSample) {
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
        if cut(&mut self.stated, raw, stamp).is_some() {
            self.resets += 1;
        }
        self.put((stamp, raw.log), q_nb);
    }

    /// Takes what the file has up to `last`.
    fn read_on(&mut self, last: Nanos) {
        let Place::File(track, next) = &mut self.place else {
            return;
        };
        let (track, mut at) = (track.clone(), *next);
        while let Some((stamp, wxyz)) = track.entries.get(at).filter(|e: &&Entry| e.0 <= last) {
            at += 1;
            if let Ok(q_nb) = Quaternion::try_from_wxyz(*wxyz) {
                self.resets = track.cuts.partition_point(|cut| cut <= stamp) as u32;
                self.put((*stamp, *stamp), q_nb);
            }
        }
        self.place = Place::File(track, at);
    }

    fn put(&mut self, (stamp, log): (Nanos, Nanos), q_nb: Quaternion<Nav, Body>) {
        if self.waiting.len() >= MOST && !matches!(self.place, Place::File(..)) {
            self.waiting.pop_front();
        }
        let to = self.world.convention().unwrap_or(Convention::EnuFlu);
        let nothing = nalgebra::Vector3::repeat(f64::NAN);
        self.waiting.push_back(AttitudeSample {
            stamp,
            q_nb: Convention::EnuFlu.convert(to, q_nb),
            rate: BodyRate(nothing),
            accel: None,
            linear_acceleration: None,
            covariance: AttitudeCovariance::from_sigma(nothing),
            status: Status::OK,
            reset_count: self.resets,
            log,
            temperature: None,
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
        self.read_on(last.stamp);
        while let Some(next) = self.waiting.front().copied() {
            if next.stamp > last.stamp {
                break;
            }
            self.waiting.pop_front();
            if next.reset_count != self.shown {
                self.turn = None;
                self.shown = next.reset_count;
            }
            if self.turn.is_none() {
                let own = self.estimate_at(estimates, next.stamp);
                self.turn = own.map(|own| self.turned(own, next.q_nb));
            }
            if let Some(turn) = self.turn {
                self.ready.push(AttitudeSample {
                    q_nb: (turn * next.q_nb).normalised(),
                    ..next
                });
            }
        }
        self.last_estimate = Some(*last);
    }

    /// Estimate at an instant, between its neighbours.
    fn estimate_at(
        &self,
        estimates: &[AttitudeSample],
        stamp: Nanos,
    ) -> Option<Quaternion<Nav, Body>> {
        let n = estimates.partition_point(|own| own.stamp < stamp);
        let after = estimates.get(n)?;
        if after.stamp == stamp {
            return Some(after.q_nb);
        }
        let before = match n.checked_sub(1) {
            Some(n) => estimates.get(n),
            None => self.last_estimate.as_ref(),
        }?;
        let step = after.stamp.secs_since(before.stamp);
        let is_whole = before.reset_count == after.reset_count && before.stamp < stamp;
        (is_whole && step <= LONGEST_STEP).then(|| {
            let part = stamp.secs_since(before.stamp) / step;
            before.q_nb.slerp(&after.q_nb, part)
        })
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
