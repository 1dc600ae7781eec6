//! Bytes of a log, in any cut -> records, and what was wrong. Pure.
//!
//! A stage of its own because it alone decides where records begin. A record whose body has not the marks of its type
//! is stepped over only if three that have them follow; else its length is not believed, and the next place is
//! looked for from which three do.

use super::format::{Format, Formats, Layout};
use super::record::{HEAD, LONGEST, RecordVerdict, head, id, look, pair};
use super::{HEADER, MAGIC};
use crate::records::op;
use crate::records::problem::{ProblemKind, Problems};
use crate::records::transcript::{ReadProgress, Transcribe, Transcript};
use std::collections::BTreeMap;

/// Most formats.
const MAX_FORMATS: usize = 65_535;
/// Most bytes of definitions that are made of a log's formats.
const MAX_DEFINITIONS: usize = 32 << 20;
/// Most fields looked at to know the sizes of a log's messages. A log of PX4 takes some ten thousand.
const MAX_STEPS: usize = 4_000_000;
/// Records with their marks that must follow each other before one is believed.
const CHAIN: usize = 3;
/// Messages that nothing has defined which may stand between them.
const BETWEEN: usize = 8;
/// Bytes that are looked at in search of a record, at once.
const WINDOW: usize = (CHAIN + BETWEEN) * LONGEST;
/// Most bytes of a name in what a log says about itself.
const MAX_SAID: usize = 100;

/// A log under way.
#[derive(Debug, Default)]
pub(crate) struct Transcriber {
    /// Offset of the next record in the file.
    at: u64,
    formats: Formats,
    /// Bytes of schemas told so far, and the number of the last.
    told: usize,
    last_schema: u16,
    /// Number of the schema made of a format.
    schemas: BTreeMap<String, u16>,
    steps: usize,
    kinds: BTreeMap<u16, Kind>,
    /// Offsets of data that a later write appended, behind a record that may be cut.
    appended: Vec<u64>,
    /// Records without their marks whose place was lost: from here on nothing was found yet.
    lost: Option<u64>,
    time: u64,
    /// Facts that the log states about its system: `sys_name`, `ver_hw`, `ver_sw`.
    said: BTreeMap<&'static str, String>,
    problems: Problems,
}

/// The messages of an id.
#[derive(Clone, Copy, Debug)]
struct Kind {
    layout: Layout,
    count: u32,
}

impl Transcribe for Transcriber {
    fn step(&mut self, ahead: &[u8], is_end: bool, to: &mut Transcript) -> ReadProgress {
        let used = match self.next(ahead, is_end, to) {
            Ok(used) => used,
            Err(need) => return ReadProgress::Need(need),
        };
        self.at = self.at.saturating_add(used as u64);
        ReadProgress::Used(used)
    }

    fn finish(self: Box<Self>) -> (String, Problems) {
        (self.system(), self.problems)
    }
}

impl Transcriber {
    fn next(&mut self, ahead: &[u8], is_end: bool, to: &mut Transcript) -> Result<usize, usize> {
        if self.at == 0 {
            return self.begin(ahead, is_end);
        }
        // A record that an appended part interrupts ends there.
        let part = self.appended.iter().find(|start| **start > self.at);
        let part = part.and_then(|start| usize::try_from(start - self.at).ok());
        let (ahead, is_end, is_part) = match part.filter(|part| *part <= ahead.len()) {
            Some(part) => (ahead.get(..part).unwrap_or(ahead), true, true),
            None => (ahead, is_end, false),
        };
        if let Some(from) = self.lost {
            return self.search(from, ahead, is_end);
        }
        let Some((length, kind)) = head(ahead) else {
            if !is_end {
                return Err(HEAD);
            }
            self.fault_cut(HEAD, ahead.len());
            return Ok(ahead.len());
        };
        let total = HEAD + length;
        let Some(body) = ahead.get(HEAD..total) else {
            if !is_end {
                return Err(total);
            }
            // A damaged length, or the end: is there a record within?
            if ahead.len() > HEAD && self.find(ahead.get(1..).unwrap_or(&[]), true).is_some() {
                self.lost = Some(self.at);
                return self.search(self.at, ahead, true);
            }
            self.fault_cut(total, ahead.len());
            return Ok(ahead.len());
        };
        let found = self.look(kind, body);
        if found != RecordVerdict::Whole {
            // Is what follows a record?
            let rest = ahead.get(total..).unwrap_or(&[]);
            if !is_end && rest.len() < WINDOW {
                return Err(total + WINDOW);
            }
            let is_last = rest.is_empty() && (is_end || is_part);
            if !is_last && self.chain(rest, is_end) < CHAIN {
                self.lost = Some(self.at);
                return self.search(self.at, ahead, is_end);
            }
        }
        match found {
            RecordVerdict::Whole => self.take(kind, body, to),
            // Counted by who looks up its channel.
            RecordVerdict::Unknown(id) => {
                to.message(id, 0, self.time, body.get(2..).unwrap_or(&[]))
            }
            // The format may grow; but a flipped bit makes the same of a message.
            RecordVerdict::Strange | RecordVerdict::Wrong => {
                let length = length as u64;
                self.fault(ProblemKind::WrongRecord { kind, length });
                self.problems.skip(length);
            }
        }
        Ok(total)
    }

    /// The header: magic, version, the start's time.
    fn begin(&mut self, ahead: &[u8], is_end: bool) -> Result<usize, usize> {
        if ahead.len() < HEADER && !is_end {
            return Err(HEADER);
        }
        debug_assert!(ahead.starts_with(&MAGIC), "who opens looks at the magic");
        let time = ahead.get(8..HEADER).and_then(<[u8]>::first_chunk);
        self.time = time.map_or(0, |bytes| nanos(u64::from_le_bytes(*bytes)));
        self.steps = MAX_STEPS;
        if ahead.len() < HEADER {
            self.fault_cut(HEADER, ahead.len());
        }
        Ok(ahead.len().min(HEADER))
    }

    fn look(&self, kind: u8, body: &[u8]) -> RecordVerdict {
        look(kind, body, |id| self.kinds.get(&id).map(|kind| kind.layout))
    }

    /// Records with their marks at the beginning of `data`, up to as many as are believed; the end counts for
    /// all that could still follow, if something stands before it.
    fn chain(&self, data: &[u8], is_end: bool) -> usize {
        let (mut at, mut whole, mut between) = (0, 0, 0);
        while whole < CHAIN {
            let rest = data.get(at..).unwrap_or(&[]);
            let record = head(rest).map(|(length, kind)| (kind, HEAD + length));
            let body = record.and_then(|(_, total)| rest.get(HEAD..total));
            let (Some((kind, total)), Some(body)) = (record, body) else {
                // The last may be cut.
                let is_enough = is_end && (whole >= 2 || (whole == 1 && rest.is_empty()));
                return if is_enough { CHAIN } else { whole };
            };
            match self.look(kind, body) {
                RecordVerdict::Whole => whole += 1,
                RecordVerdict::Unknown(_) if between < BETWEEN => between += 1,
                _ => return 0,
            }
            at += total;
        }
        whole
    }

    /// The first place in `data` from which records follow each other.
    fn find(&self, data: &[u8], is_end: bool) -> Option<usize> {
        // What follows must be there as well, or the answer would depend on how much is.
        let places = if is_end {
            data.len()
        } else {
            (data.len() + 1).saturating_sub(WINDOW)
        };
        (0..places).find(|at| {
            let rest = data.get(*at..).unwrap_or(&[]);
            self.chain(rest, is_end) >= CHAIN
        })
    }

    /// Looks for the next record, behind `from` where the last was lost.
    fn search(&mut self, from: u64, ahead: &[u8], is_end: bool) -> Result<usize, usize> {
        // The record itself is none.
        let own = usize::from(from == self.at);
        if !is_end && ahead.len() < own + WINDOW {
            return Err(own + 2 * WINDOW);
        }
        let data = ahead.get(own..).unwrap_or(&[]);
        let found = self.find(data, is_end);
        if found.is_none() && !is_end {
            self.lost = Some(from);
            return Ok(own + (data.len() + 1).saturating_sub(WINDOW));
        }
        self.lost = None;
        let used = found.map_or(ahead.len(), |at| own + at);
        let skipped = (self.at - from) + used as u64;
        self.problems
            .add(from, ProblemKind::Garbage { skipped }, None);
        Ok(used)
    }

    fn fault(&mut self, kind: ProblemKind) {
        self.problems.add(self.at, kind, None);
    }

    fn fault_cut(&mut self, need: usize, have: usize) {
        if have > 0 {
            let (need, have) = (need as u64, have as u64);
            self.fault(ProblemKind::Truncated { need, have });
        }
    }

    /// Takes in a record that has its marks.
    fn take(&mut self, kind: u8, body: &[u8], to: &mut Transcript) {
        match kind {
            b'D' => self.message(body, to),
            b'F' => self.format(body),
            b'A' => self.subscription(body, to),
            b'O' => {
                // One of 0 ms dropped nothing that could be measured.
                let millis = id(body).unwrap_or(0);
                if id(body) != Some(0) {
                    self.fault(ProblemKind::Dropout { millis });
                }
            }
            b'B' => self.flags(body),
            b'I' => self.information(body),
            _ => {}
        }
    }

    fn message(&mut self, body: &[u8], to: &mut Transcript) {
        let (Some(id), Some(data)) = (id(body), body.get(2..)) else {
            return;
        };
        let Some(kind) = self.kinds.get_mut(&id) else {
            return;
        };
        let data = data.get(..kind.layout.least).unwrap_or(data);
        let time = kind.layout.timestamp.and_then(|at| data.get(at..));
        if let Some(bytes) = time.and_then(<[u8]>::first_chunk) {
            self.time = nanos(u64::from_le_bytes(*bytes));
        }
        to.message(id, kind.count, self.time, data);
        kind.count = kind.count.wrapping_add(1);
    }

    fn format(&mut self, body: &[u8]) {
        let text = std::str::from_utf8(body).ok().and_then(Format::parse);
        let Some(format) = text else {
            return self.fault(ProblemKind::BadDefinition { opcode: op::SCHEMA });
        };
        if self.formats.get(&format.name) == Some(&format) {
            return;
        }
        if self.formats.len() >= MAX_FORMATS {
            return self.fault(ProblemKind::TooManyDefinitions);
        }
        self.schemas.remove(&format.name);
        self.formats.insert(format.name.clone(), format);
    }

    fn subscription(&mut self, body: &[u8], to: &mut Transcript) {
        let name = body
            .get(3..)
            .and_then(|name| std::str::from_utf8(name).ok());
        let (Some((instance, rest)), Some(name)) = (body.split_first(), name) else {
            return;
        };
        let id = id(rest).unwrap_or(0);
        let format = self.formats.get(name);
        let layout = format.and_then(|format| format.layout(&self.formats, &mut self.steps));
        let (Some(format), Some(layout)) = (format, layout) else {
            let kind = if self.steps == 0 {
                ProblemKind::TooManyDefinitions
            } else {
                ProblemKind::BadDefinition {
                    opcode: op::CHANNEL,
                }
            };
            self.kinds.remove(&id);
            return self.fault(kind);
        };
        let schema = match self.schemas.get(name) {
            Some(known) => Some(*known),
            None => {
                let left = MAX_DEFINITIONS.saturating_sub(self.told);
                let text = (left > 0).then(|| format.definition(&self.formats, left));
                let number = self.last_schema.checked_add(1);
                let told = text.flatten().zip(number).map(|(text, number)| {
                    to.schema(number, &format.type_name(), "ros1msg", text.as_bytes());
                    self.told = self.told.saturating_add(text.len().max(1));
                    self.last_schema = number;
                    self.schemas.insert(name.to_owned(), number);
                    number
                });
                if told.is_none() {
                    // What is beyond the limit once is not tried again.
                    self.told = MAX_DEFINITIONS;
                }
                told
            }
        };
        let Some(schema) = schema else {
            self.kinds.remove(&id);
            return self.fault(ProblemKind::TooManyDefinitions);
        };
        // The first of several sensors of a kind has the plain name.
        let topic = match instance {
            0 => name.to_owned(),
            n => format!("{name}/{n}"),
        };
        to.channel(id, schema, &topic, "ros1", &[]);
        self.kinds.insert(id, Kind { layout, count: 0 });
    }

    fn flags(&mut self, body: &[u8]) {
        let word = |n: usize| body.get(8 * n..).and_then(<[u8]>::first_chunk);
        let word = |n: usize| word(n).map_or(0, |bytes| u64::from_le_bytes(*bytes));
        let needed = word(1);
        if needed & !1 != 0 {
            self.fault(ProblemKind::UnknownFeature { bits: needed & !1 });
        }
        if needed & 1 != 0 && self.appended.is_empty() {
            self.appended = (2..5).map(word).filter(|start| *start > 0).collect();
            self.appended.sort_unstable();
        }
    }

    fn information(&mut self, body: &[u8]) {
        let Some((key, value)) = pair(body) else {
            return;
        };
        let names = ["sys_name", "ver_hw", "ver_sw"];
        let name = key.split_once(' ').map_or(key, |(_, name)| name);
        if let Some(name) = names.into_iter().find(|known| *known == name) {
            let value = value.get(..MAX_SAID).unwrap_or(value);
            let value = String::from_utf8_lossy(value).into_owned();
            self.said.entry(name).or_insert(value);
        }
    }

    /// `PX4 on AUAV_X21, fd483321a5cf`.
    fn system(&self) -> String {
        let said = |name: &str| self.said.get(name).map_or("", String::as_str);
        let (system, hardware) = (said("sys_name"), said("ver_hw"));
        let version: String = said("ver_sw").chars().take(12).collect();
        let hardware = match hardware {
            "" => String::new(),
            name => format!(" on {name}"),
        };
        let version = match version.as_str() {
            "" => String::new(),
            version => format!(", {version}"),
        };
        format!("{system}{hardware}{version}")
    }
}

/// Microseconds as nanoseconds.
fn nanos(micros: u64) -> u64 {
    micros.saturating_mul(1000)
}

#[cfg(test)]
mod tests;
