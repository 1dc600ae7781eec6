//! Captured bytes of a device, in any cut -> records, and what was wrong. Pure.
//!
//! Apart from the live reader because a capture says where it is damaged, and has channels. A capture may begin within a
//! frame, or with the text of a device that starts: what stands before the first frame is no loss.

use super::frame::{Cut, LONGEST};
use super::recognise::recognised;
use super::sample::{Sample, Taken, name};
use super::{Device, Protocol};
use crate::decode::known_definition;
use crate::records::imu;
use crate::records::problem::{ProblemKind, Problems};
use crate::records::transcript::{HEAD, ReadProgress, Transcribe, Transcript};
use crate::records::walk::Walk;
use std::collections::{BTreeMap, BTreeSet};
use strapd_attitude::record::SampleKind;
use strapd_attitude::setting::SAMPLE_KIND;

/// Channel: device on the link, content.
type Key = (Option<u8>, Content);

/// Content of a channel.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Content {
    /// Rates, of a kind that the protocol says, or not.
    Rates(Option<&'static str>),
    Field,
    /// Orientations that come in messages of their own.
    Orientation,
}

/// A capture under way.
#[derive(Debug, Default)]
pub(crate) struct Transcriber {
    walk: Walk,
    opened: Option<(&'static Protocol, Box<dyn Device>)>,
    has_begun: bool,
    channels: BTreeMap<Key, (u16, u32)>,
    schemas: BTreeSet<u16>,
    clipped: u64,
    message: Vec<u8>,
}

impl Transcribe for Transcriber {
    fn step(&mut self, ahead: &[u8], is_end: bool, to: &mut Transcript) -> ReadProgress {
        if self.opened.is_none() && ahead.len() < HEAD && !is_end {
            return ReadProgress::Need(HEAD);
        }
        let found = |protocol: &'static Protocol| Some((protocol, protocol.device()?));
        let opened = self
            .opened
            .take()
            .or_else(|| recognised(ahead).and_then(found));
        let Some((protocol, mut device)) = opened else {
            let used = self.walk.lose(ahead, ahead.len(), |_| false);
            self.walk.go_on(used, is_end && used == ahead.len());
            return ReadProgress::Used(used);
        };
        let progress = match (protocol.cut)(ahead) {
            Cut::Frame { total, .. } => {
                self.walk.found();
                self.has_begun = true;
                let mut taken = Taken::default();
                device.take(ahead.get(..total).unwrap_or(ahead), &mut taken);
                self.tell(protocol, &taken, to);
                ReadProgress::Used(total.max(1))
            }
            Cut::Need(need) if !is_end => ReadProgress::Need(need.min(LONGEST)),
            Cut::Need(need) if self.has_begun && !has_frame(protocol, ahead) => {
                self.walk.truncated(need, ahead.len());
                ReadProgress::Used(ahead.len())
            }
            Cut::Need(_) | Cut::No => ReadProgress::Used(self.lose(protocol, ahead)),
        };
        if let ReadProgress::Used(used) = progress {
            self.walk.go_on(used, is_end && used == ahead.len());
        }
        self.opened = Some((protocol, device));
        progress
    }

    fn finish(mut self: Box<Self>) -> (String, Problems) {
        if self.clipped > 0 {
            let count = self.clipped;
            self.walk.fault(ProblemKind::Clipped { count }, None);
        }
        let title = self
            .opened
            .as_ref()
            .map_or("", |(protocol, _)| protocol.title);
        (title.to_owned(), self.walk.into_problems())
    }

    fn run(&self) -> usize {
        256 << 10
    }
}

/// Whether a frame begins in these bytes behind the first.
fn has_frame(protocol: &Protocol, ahead: &[u8]) -> bool {
    let mut rests = (1..ahead.len()).filter_map(|at| ahead.get(at..));
    rests.any(|rest| matches!((protocol.cut)(rest), Cut::Frame { .. }))
}

impl Transcriber {
    /// Number of bytes to leave out here.
    fn lose(&mut self, protocol: &Protocol, ahead: &[u8]) -> usize {
        let begins = |rest: &[u8]| (protocol.cut)(rest) != Cut::No;
        if self.has_begun {
            return self.walk.lose(ahead, ahead.len(), begins);
        }
        let mut behind = 1..ahead.len();
        let next = behind.find(|at| ahead.get(*at..).is_some_and(begins));
        next.unwrap_or(ahead.len()).max(1)
    }

    fn tell(&mut self, protocol: &Protocol, taken: &Taken, to: &mut Transcript) {
        if taken.missing > 0 {
            let count = taken.missing;
            self.walk
                .fault(ProblemKind::FramesMissing { count }, Some(count));
        }
        self.clipped += taken.clipped;
        for sample in &taken.samples {
            let mut message = std::mem::take(&mut self.message);
            if let Some(rate) = sample.rate {
                sample.imu(rate, &mut message);
                let content = Content::Rates(sample.kind.map(SampleKind::name));
                self.put(protocol, sample, content, &message, to);
            }
            if let Some(field) = sample.field {
                sample.magnetic(field, &mut message);
                self.put(protocol, sample, Content::Field, &message, to);
            }
            if let (None, Some(orientation)) = (sample.rate, sample.orientation) {
                sample.attitude(orientation, &mut message);
                self.put(protocol, sample, Content::Orientation, &message, to);
            }
            self.message = message;
        }
    }

    fn put(
        &mut self,
        protocol: &Protocol,
        sample: &Sample,
        content: Content,
        message: &[u8],
        to: &mut Transcript,
    ) {
        let key = (sample.unit, content);
        if !self.channels.contains_key(&key) {
            self.channel(protocol, key, to);
        }
        if let Some((channel, count)) = self.channels.get_mut(&key) {
            // A capture has no clock but the device's.
            to.message(*channel, *count, sample.time.unwrap_or(0), message);
            *count = count.wrapping_add(1);
        }
    }

    /// Defines the channel of a device's content.
    fn channel(&mut self, protocol: &Protocol, key: Key, to: &mut Transcript) {
        let number = self.channels.len() as u16;
        let (unit, content) = key;
        let (schema, of) = match content {
            Content::Rates(_) => (1, imu::TYPE),
            Content::Field => (2, imu::FIELD_TYPE),
            Content::Orientation => (3, imu::ATTITUDE_TYPE),
        };
        if self.schemas.insert(schema) {
            let text = known_definition(of).unwrap_or_default();
            to.schema(schema, of, "ros2msg", text.as_bytes());
        }
        let of = name(protocol.name, unit);
        let (topic, kind) = match content {
            Content::Rates(kind) => (of, kind),
            Content::Field => (format!("{of}/mag"), None),
            Content::Orientation => (format!("{of}/orientation"), None),
        };
        let kind = kind.map(|kind| (SAMPLE_KIND.name(), kind));
        to.channel(number, schema, &topic, "cdr", kind.as_slice());
        self.channels.insert(key, (number, 0));
    }
}
