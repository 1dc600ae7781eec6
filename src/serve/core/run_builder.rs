//! Lines, packed objects and messages of one sensor -> a run of its samples. Pure.
//!
//! Apart from the sessions because what is posted is gathered in the same way.

use super::stream::run::{OrderedBy, SampleRun};
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::{Bare, Line};
use strapd_recording::text::MAX_NEAR;

/// Builder of a run of samples.
#[derive(Debug, Default)]
pub struct RunBuilder {
    head: Option<Line>,
    /// Samples of the run; behind them, while a line is read, those that it brings.
    pub(in crate::serve) samples: Vec<RawSample>,
    /// Stamps that are bare numbers, at their places.
    bare: Vec<Option<Bare>>,
    /// The sender's number of each line, and where its samples end.
    lines: Vec<(Option<u64>, usize)>,
    /// The number of the first line, and its beginning.
    first: (u64, Vec<u8>),
}

impl RunBuilder {
    /// Number of lines in the run.
    #[must_use]
    pub fn lines(&self) -> usize {
        self.lines.len()
    }

    /// Whether a line with this head belongs to the run.
    #[must_use]
    pub fn goes_on_in(&self, head: &Line) -> bool {
        let run = self.head.as_ref();
        run.is_some_and(|run| run.goes_on_in(head))
    }

    /// Adds a line whose samples are there already; it begins a run where there is none. `line`: its number and
    /// its bytes.
    pub fn add(&mut self, mut head: Line, line: (u64, &[u8])) {
        let bare = std::mem::take(&mut head.bare);
        if !bare.is_empty() {
            let first = self.lines.last().map_or(0, |(_, end)| *end);
            self.bare.resize(first, None);
            self.bare.extend(bare);
        }
        self.extend(head.seq);
        if self.head.is_none() {
            self.begin(head, line);
        }
    }

    /// Adds a line that belongs to the run, with stamps of its own.
    pub fn extend(&mut self, seq: Option<u64>) {
        self.lines.push((seq, self.samples.len()));
    }

    /// Begins a run with a line of this head.
    pub fn begin(&mut self, head: Line, (number, line): (u64, &[u8])) {
        self.head = Some(head);
        self.first.0 = number;
        self.first.1.clear();
        self.first.1.extend(line.iter().take(MAX_NEAR));
    }

    /// Makes this the run: messages that were read elsewhere.
    #[cfg(feature = "zenoh")]
    pub fn fill(&mut self, head: Line, lines: &[(Option<u64>, usize)], samples: &[RawSample]) {
        self.begin(head, (0, &[]));
        self.samples.extend_from_slice(samples);
        self.lines.extend_from_slice(lines);
    }

    /// The run, which has the first `until` samples; `None` where none was begun.
    #[must_use]
    pub fn run(&self, client: u64, received: Nanos, until: usize) -> Option<SampleRun<'_>> {
        Some(SampleRun {
            client,
            head: self.head.as_ref()?,
            received,
            placed: OrderedBy::ByStamp,
            lines: &self.lines,
            samples: self.samples.get(..until).unwrap_or(&self.samples),
            bare: &self.bare,
            by_arrival: false,
            first: (self.first.0, &self.first.1),
        })
    }

    /// Ends the run, which had the first `until` samples: those of a line that is still to be added stay.
    pub fn clear(&mut self, until: usize) {
        self.head = None;
        self.samples.drain(..until.min(self.samples.len()));
        self.bare.clear();
        self.lines.clear();
    }
}
