//! First bytes of a link of which nobody said what it is -> its protocol. Pure: time comes with the bytes.
//!
//! Apart from the recognition of captures because bytes come one by one: what was looked at is not looked at again, and
//! lines of text are one of the answers.

use super::PROTOCOLS;
use super::Protocol;
use super::recognise::Trial;
use strapd_attitude::record::Nanos;

/// Bytes that are held until the protocol is known.
const MOST: usize = 64 << 10;
/// Bytes that are kept of more: longer than some frames of each protocol.
const KEPT: usize = 16 << 10;
/// Time in which a device shows what it is, and frames come, ns.
pub(super) const PATIENCE: i64 = 2_000_000_000;
/// Lines of numbers by which lines are known, where they are no objects: more than frames, which may be lines, too.
const LINES: usize = 5;
/// Numbers of such a line. A device that starts prints text, and few of them.
const NUMBERS: usize = 3;

/// Outcome of a search.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Found {
    Lines,
    Protocol(&'static Protocol),
}

/// Search under way.
#[derive(Debug)]
pub(super) struct Auto {
    held: Vec<u8>,
    trials: Vec<Trial>,
    text: Text,
    /// Time of the first bytes.
    began: Option<Nanos>,
    /// Bytes so far.
    bytes: u64,
    has_complained: bool,
}

impl Default for Auto {
    fn default() -> Auto {
        Auto {
            held: Vec::new(),
            trials: vec![Trial::default(); PROTOCOLS.len()],
            text: Text::default(),
            began: None,
            bytes: 0,
            has_complained: false,
        }
    }
}

impl Auto {
    /// Takes the next bytes. What was held is given on with what was found.
    pub(super) fn push(&mut self, bytes: &[u8], now: Nanos) -> Option<(Found, Vec<u8>)> {
        let began = *self.began.get_or_insert(now);
        self.bytes += bytes.len() as u64;
        self.held.extend_from_slice(bytes);
        let is_late = now.since(began) >= PATIENCE;
        self.text.go_on(&self.held);
        let found = self.protocol().or_else(|| self.lines(is_late));
        if found.is_none() && self.held.len() > MOST {
            let forgotten = self.held.len() - KEPT;
            self.held.drain(..forgotten);
            for trial in &mut self.trials {
                trial.forget(forgotten);
            }
            self.text.forget(forgotten);
        }
        found.map(|found| (found, std::mem::take(&mut self.held)))
    }

    fn protocol(&mut self) -> Option<Found> {
        let held = &self.held;
        let trials = self.trials.iter_mut().zip(PROTOCOLS);
        let known = trials.filter_map(|(trial, protocol)| {
            let at = trial.go_on(protocol, held)?;
            Some((at, protocol))
        });
        let first = known.min_by_key(|(at, _)| *at);
        first.map(|(_, protocol)| Found::Protocol(protocol))
    }

    /// Whether what is held is lines: one object, some lines of numbers, or after a while one.
    fn lines(&self, is_late: bool) -> Option<Found> {
        let least = if is_late { 1 } else { LINES };
        (self.text.has_object || self.text.lines >= least).then_some(Found::Lines)
    }

    /// Gives back the bytes that are held, where nothing more comes and they may be lines of text.
    pub(super) fn rest(&mut self) -> Vec<u8> {
        let mut held = std::mem::take(&mut self.held);
        if self.text.lines == 0 && !held.iter().all(is_text) {
            held.clear();
        }
        held
    }

    /// Number of bytes of which nothing is known, once there was time enough.
    pub(super) fn unknown(&mut self, now: Nanos) -> Option<u64> {
        let is_late = now.since(self.began?) >= PATIENCE;
        let first = is_late && !std::mem::replace(&mut self.has_complained, is_late);
        first.then_some(self.bytes)
    }
}

/// Lines of samples among bytes.
#[derive(Debug, Default)]
struct Text {
    /// Beginning of the line that has no end yet, and place up to which its end was looked for.
    begin: usize,
    looked: usize,
    lines: usize,
    /// Whether one of them is an object of JSON.
    has_object: bool,
}

impl Text {
    fn go_on(&mut self, bytes: &[u8]) {
        while let Some(length) = bytes
            .get(self.looked..)
            .and_then(|rest| rest.iter().position(|byte| *byte == b'\n'))
        {
            let end = self.looked + length;
            let line = bytes.get(self.begin..end).unwrap_or(&[]).trim_ascii();
            if !line.is_empty() && line.iter().all(is_text) {
                self.lines += usize::from(numbers(line) >= NUMBERS);
                self.has_object |= line.starts_with(b"{") && line.ends_with(b"}");
            }
            (self.begin, self.looked) = (end + 1, end + 1);
        }
        self.looked = bytes.len();
    }

    /// Forgets so many bytes at the beginning.
    fn forget(&mut self, bytes: usize) {
        self.begin = self.begin.saturating_sub(bytes);
        self.looked = self.looked.saturating_sub(bytes);
    }
}

/// Number of cells of a line that are numbers.
fn numbers(line: &[u8]) -> usize {
    let cells = line.split(|byte| matches!(byte, b',' | b';' | b'\t' | b' '));
    let is_number = |cell: &&[u8]| {
        let text = std::str::from_utf8(cell.trim_ascii());
        text.is_ok_and(|text| text.parse::<f64>().is_ok_and(f64::is_finite))
    };
    cells.filter(is_number).count()
}

fn is_text(byte: &u8) -> bool {
    matches!(byte, b'\t' | b'\r' | b'\n' | b' '..0x7f)
}
