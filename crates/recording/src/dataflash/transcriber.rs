//! Bytes of a log, in any cut -> records, and what was wrong. Pure.
//!
//! Apart from the layouts because it alone decides where a message begins: by its marks, a type that an FMT has named, and
//! marks behind it. There is no checksum; a message whose marks, type and length fit is believed if another follows it.

use super::MAGIC;
use super::layout::{HEAD, Layout, OWN_LENGTH};
use super::sample::Content;
use crate::decode::known_definition;
use crate::records::problem::{ProblemKind, Problems};
use crate::records::transcript::{ReadProgress, Transcribe, Transcript};
use crate::records::walk::Walk;
use std::collections::{BTreeMap, BTreeSet};

/// Longest message, and the marks behind it.
const WINDOW: usize = 255 + 2;
/// The type of an FMT.
const FMT: u8 = MAGIC[2];

/// A log under way.
#[derive(Debug)]
pub(crate) struct Transcriber {
    walk: Walk,
    /// Layouts by type.
    layouts: BTreeMap<u8, Layout>,
    /// Channel and number of messages of a content's instance.
    channels: BTreeMap<(Content, u8), (u16, u32)>,
    schemas: BTreeSet<u16>,
    message: Vec<u8>,
}

impl Default for Transcriber {
    fn default() -> Transcriber {
        Transcriber {
            walk: Walk::default(),
            layouts: BTreeMap::from([(FMT, Layout::own())]),
            channels: BTreeMap::new(),
            schemas: BTreeSet::new(),
            message: Vec::new(),
        }
    }
}

impl Transcribe for Transcriber {
    fn step(&mut self, ahead: &[u8], is_end: bool, to: &mut Transcript) -> ReadProgress {
        if ahead.len() < WINDOW && !is_end {
            return ReadProgress::Need(WINDOW);
        }
        let used = match self.length(ahead) {
            Some(length) if length <= ahead.len() => {
                self.walk.found();
                let message = ahead.get(..length).unwrap_or(ahead);
                self.take(message, to);
                length
            }
            // The end, within a message.
            Some(length) if is_end => {
                self.walk.truncated(length, ahead.len());
                ahead.len()
            }
            _ => {
                // A mark at the end is looked at again with what follows it.
                let most = ahead.len() - usize::from(!is_end);
                self.walk.lose(ahead, most, is_marked)
            }
        };
        self.walk.go_on(used, is_end && used == ahead.len());
        ReadProgress::Used(used)
    }

    fn finish(self: Box<Self>) -> (String, Problems) {
        ("ArduPilot".to_owned(), self.walk.into_problems())
    }

    fn run(&self) -> usize {
        256 << 10
    }
}

/// Whether a message may begin here, or what is left of it.
fn is_marked(bytes: &[u8]) -> bool {
    matches!(bytes, [0xa3, 0x95, ..] | [0xa3])
}

impl Transcriber {
    /// Length of the message that begins here; `None`: none does.
    fn length(&self, ahead: &[u8]) -> Option<usize> {
        let [0xa3, 0x95, kind, ..] = ahead else {
            return None;
        };
        let length = self.layouts.get(kind)?.length;
        let rest = ahead.get(length..).unwrap_or(&[]);
        (rest.is_empty() || is_marked(rest)).then_some(length)
    }

    fn take(&mut self, message: &[u8], to: &mut Transcript) {
        let kind = message.get(2).copied().unwrap_or(0);
        if kind == FMT {
            return self.define(message);
        }
        let Some(layout) = self.layouts.get(&kind) else {
            return;
        };
        let Some((content, named)) = Content::of(&layout.name) else {
            return;
        };
        let instance = layout.number(message, "I").map_or(named, |i| i as u8);
        let written = layout.time(message).and_then(|time| {
            content.write(layout, message, time, &mut self.message)?;
            Some(time)
        });
        let Some(time) = written else {
            return;
        };
        let Some((channel, count)) = self.channel(content, instance, to) else {
            return;
        };
        to.message(channel, count, time, &self.message);
    }

    /// Takes how the messages of a type lie; the first that is said holds.
    fn define(&mut self, message: &[u8]) {
        debug_assert!(message.len() == OWN_LENGTH);
        match Layout::parse(message.get(HEAD..).unwrap_or(&[])) {
            Some((FMT, _)) => {}
            Some((of, layout)) => {
                self.layouts.entry(of).or_insert(layout);
            }
            None => {
                let opcode = FMT;
                self.walk.fault(ProblemKind::BadDefinition { opcode }, None);
            }
        }
    }

    /// Channel of an instance, and the number of its next message.
    fn channel(
        &mut self,
        content: Content,
        instance: u8,
        to: &mut Transcript,
    ) -> Option<(u16, u32)> {
        let next = self.channels.len();
        if !self.channels.contains_key(&(content, instance)) {
            let number = u16::try_from(next).ok()?;
            let (schema, of) = content.schema();
            if self.schemas.insert(schema) {
                let text = known_definition(of).unwrap_or_default();
                to.schema(schema, of, "ros2msg", text.as_bytes());
            }
            to.channel(number, schema, &content.topic(instance), "cdr", &[]);
            self.channels.insert((content, instance), (number, 0));
        }
        let (channel, count) = self.channels.get_mut(&(content, instance))?;
        let now = (*channel, *count);
        *count = count.wrapping_add(1);
        Some(now)
    }
}

#[cfg(test)]
mod tests;
