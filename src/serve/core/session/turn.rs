//! Bytes that one client sent -> steps short enough for others to have theirs. Pure but for the clock.
//!
//! A step ends after a request, after an answer, or after [`SLICE`] of work, whatever the bytes: a line
//! of twenty can ask for more than a thousand samples do. What is behind is held until the next, and
//! nothing more is read of the client meanwhile.

use super::opening::Opening;
use super::{Scratch, Session};
use crate::serve::core::hub::count;
use crate::serve::protocol::wire;
use bytes::{Buf, Bytes};
use std::time::{Duration, Instant};
use strapd_attitude::record::Nanos;
use strapd_recording::decode::framing::Framed;

/// Longest step, but for the line or run that was begun.
const SLICE: Duration = Duration::from_micros(200);
/// Most lines of samples in one run.
const LONGEST_RUN: usize = 64;

/// Bytes that wait for the next step.
#[derive(Debug)]
pub(super) struct PendingBytes {
    bytes: Bytes,
    received: Nanos,
    /// Whether their end ends the last line.
    whole: bool,
}

/// Progress of a step.
#[derive(Debug, Default)]
pub(super) struct WorkSlice {
    /// Something was asked for in it.
    pub(super) asked: bool,
    /// Something was answered.
    pub(super) answered: bool,
    /// Samples were worked on since the clock was looked at.
    pub(super) worked: bool,
    /// The state was asked for while the answer before was not taken.
    pub(super) polls: bool,
}

impl Session {
    /// The next bytes of the stream, received at `received`. Not all of them may be worked on: see
    /// [`Session::is_held`].
    pub fn bytes(&mut self, bytes: &[u8], received: Nanos, scratch: &mut Scratch) {
        match self.lines_of_link(bytes, received) {
            Some(lines) => self.add(&lines, false, received, scratch),
            None => self.add(bytes, false, received, scratch),
        }
    }

    /// A datagram or message: its end ends its last line.
    pub fn message(&mut self, bytes: &[u8], received: Nanos, scratch: &mut Scratch) {
        match self.lines_of_link(bytes, received) {
            Some(lines) => self.add(&lines, true, received, scratch),
            None => self.add(bytes, true, received, scratch),
        }
    }

    /// The stream has ended: what is unfinished is a line.
    pub fn finish(&mut self, received: Nanos, scratch: &mut Scratch) {
        self.has_ended = true;
        let mut held = Vec::new();
        if let Some(link) = &mut self.link {
            link.finish(&mut held);
        }
        self.add(&held, true, received, scratch);
    }

    /// Whether something it sent waits for the next step, before which nothing more is to be read.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.end.is_none() && (self.held.is_some() || self.step.polls)
    }

    /// Whether the next step may be taken: the client reads what it is answered.
    #[must_use]
    pub fn may_go_on(&self) -> bool {
        let outbox = &self.client.outbox;
        self.end.is_none()
            && !outbox.is_full()
            && (!self.step.polls || !outbox.owes_answer() || self.hub.is_stopping())
    }

    /// Whether something was asked for in the last step; then the next one waits for its [turn].
    ///
    /// [turn]: super::super::hub::Hub
    #[must_use]
    pub fn is_asking(&self) -> bool {
        self.step.asked
    }

    /// The next step with what is held, if it may be taken.
    pub fn go_on(&mut self, scratch: &mut Scratch) {
        if !self.may_go_on() {
            return;
        }
        if std::mem::take(&mut self.step.polls) {
            self.poll();
        }
        if let Some(mut held) = self.held.take() {
            let rest = self.step(&held.bytes, held.whole, held.received, scratch);
            held.bytes.advance(held.bytes.len() - rest);
            self.held = (rest > 0).then_some(held);
        }
    }

    fn add(&mut self, bytes: &[u8], whole: bool, received: Nanos, scratch: &mut Scratch) {
        count(&self.hub.counters.bytes_in, bytes.len());
        if self.is_held() {
            // Who gives more without asking gets it all done, but later.
            let before = self.held.take();
            let (waiting, ended) = before.map_or((Bytes::new(), false), |h| (h.bytes, h.whole));
            let between: &[u8] = if ended { b"\n" } else { b"" };
            self.held = Some(PendingBytes {
                bytes: [&waiting, between, bytes].concat().into(),
                received,
                whole,
            });
            return;
        }
        let rest = self.step(bytes, whole, received, scratch);
        if rest > 0 {
            let rest = bytes.get(bytes.len() - rest..).unwrap_or_default();
            self.held = Some(PendingBytes {
                bytes: Bytes::copy_from_slice(rest),
                received,
                whole,
            });
        }
    }

    /// Works on bytes for no longer than a step. Says how many of them are left.
    fn step(&mut self, bytes: &[u8], whole: bool, received: Nanos, scratch: &mut Scratch) -> usize {
        self.step = WorkSlice::default();
        if !self.begins(bytes) {
            return 0;
        }
        let began = Instant::now();
        let mut framer = std::mem::take(&mut self.framer);
        let before = framer.ended();
        let mut take = |framed: Framed<'_>| {
            match framed {
                Framed::Line(number, line) => self.line((number, line), received, scratch),
                Framed::Packed(number, object) => {
                    self.opening = Opening::Over;
                    self.settle_on_objects();
                    self.packed(number, object, received, scratch);
                }
                Framed::TooLong(number, head) if self.has_spoken() => {
                    self.bad(&wire::too_long(), number, head, received, scratch);
                }
                Framed::Broken(number) if self.has_spoken() => {
                    self.bad(&wire::broken_packed(), number, &[], received, scratch);
                }
                Framed::TooLong(number, head) => self.refuse_opening(number, head),
                Framed::Broken(number) => self.refuse_opening(number, &[]),
            }
            if scratch.run.lines() >= LONGEST_RUN {
                self.flush(received, scratch, usize::MAX);
            }
            let is_long = std::mem::take(&mut self.step.worked) && began.elapsed() >= SLICE;
            !(is_long || self.step.asked || self.step.answered || self.end.is_some())
        };
        let rest = framer.feed(bytes, &mut take).len();
        if whole && rest == 0 {
            framer.finish(&mut take);
        }
        if self.has_ended && rest == 0 && self.end.is_none() {
            self.finish_rows(scratch);
        }
        count(&self.hub.counters.lines, (framer.ended() - before) as usize);
        self.framer = framer;
        self.flush(received, scratch, usize::MAX);
        if self.end.is_some() { 0 } else { rest }
    }

    /// Asks for the state; while the last answer has not left, the question waits, and all behind it.
    pub(super) fn poll(&mut self) {
        // At the end of the daemon one answer does for all.
        self.step.polls = !self.hub.poll(&self.client) && !self.hub.is_stopping();
    }
}
