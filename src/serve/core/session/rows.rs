//! Lines that are no objects -> rows of a table, once it is known which. Pure but for the log.
//!
//! Apart from the lines of objects because a row means nothing by itself: what its cells are is said once, by a header
//! or by `columns`, and until then rows are held, and lines before them skipped and counted ([`TableStream`]).

use super::{End, Scratch, Session, Side};
use crate::serve::core::hub::count;
use crate::serve::guard::fault::Fault;
use crate::serve::guard::log_throttle;
use crate::serve::guard::losses::Lost;
use crate::serve::protocol::wire;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::Nanos;
use strapd_recording::decode::Class;
use strapd_recording::lines::{HeldRow, TableStream};

/// Rows of a conversation, as far as there are any.
#[derive(Debug)]
pub(super) enum Rows {
    /// Refusal of rows: a line is an object, or bad.
    Never,
    /// Rows that may come.
    Open {
        /// Whether objects are refused until the header has come: the conversation began with text.
        is_strict: bool,
    },
    /// Table, or lines of which one may be its header.
    Table {
        /// Lines so far.
        stream: Box<TableStream>,
        /// The same as of [`Rows::Open`].
        is_strict: bool,
    },
}

impl Rows {
    /// Rows of a conversation that takes them or not.
    pub(super) fn taken(are_taken: bool) -> Rows {
        match are_taken {
            true => Rows::Open { is_strict: false },
            false => Rows::Never,
        }
    }
}

impl Session {
    /// Whether a line is read as a row, or as one before the header.
    pub(super) fn is_row(&self, line: &[u8]) -> bool {
        let first = line.iter().find(|b| !b.is_ascii_whitespace());
        let is_object = matches!(first, Some(b'{' | b'['));
        self.authorised && !is_object && !matches!(self.rows, Rows::Never)
    }

    /// Whether an object may not be read yet: the conversation began with text, of which no table has come.
    pub(super) fn is_strict(&self) -> bool {
        match &self.rows {
            Rows::Never | Rows::Open { .. } => false,
            Rows::Table { stream, is_strict } => *is_strict && !stream.has_header(),
        }
    }

    /// Samples have come as objects: what came before the first was no table.
    pub(super) fn settle_on_objects(&mut self) {
        match &self.rows {
            Rows::Open { .. } => self.rows = Rows::Never,
            Rows::Table { stream, .. } if !stream.has_header() => {
                let (skipped, shown) = (stream.skipped(), stream.shown());
                self.note_skipped(skipped, &shown);
                self.rows = Rows::Never;
            }
            Rows::Never | Rows::Table { .. } => {}
        }
    }

    fn note_skipped(&self, skipped: u64, shown: &str) {
        count(&self.hub.counters.skipped_lines, skipped as usize);
        if skipped > 0 {
            let name = &self.client.peer.name;
            let lines = if skipped == 1 { "line" } else { "lines" };
            log_throttle::info(
                &format!("{name} skipped"),
                &format!("{name}: {skipped} {lines} before the first sample skipped: `{shown}`"),
            );
        }
    }

    /// Takes a row, or a line that comes before the header.
    pub(super) fn row(&mut self, said: (u64, &[u8]), received: Nanos, scratch: &mut Scratch) {
        let (number, line) = said;
        let (mut stream, is_strict) = match std::mem::replace(&mut self.rows, Rows::Never) {
            Rows::Never => return,
            Rows::Open { is_strict } => {
                let stream = TableStream::new(&self.reading.options, self.reading.is_midway);
                (Box::new(stream), is_strict)
            }
            Rows::Table { stream, is_strict } => (stream, is_strict),
        };
        if stream.table().is_some() {
            self.decode_row(&mut stream, said, received, scratch);
        } else {
            self.step.worked = true;
            match stream.push(number, received, line) {
                Ok(None) => {}
                Ok(Some(opened)) => self.open_table(&mut stream, opened, scratch),
                Err(why) => return self.refuse_table(&stream, &why, number),
            }
        }
        self.rows = Rows::Table { stream, is_strict };
    }

    /// The conversation has ended: rows that wait for others are read as they are.
    pub(super) fn finish_rows(&mut self, scratch: &mut Scratch) {
        let Rows::Table { stream, is_strict } = std::mem::replace(&mut self.rows, Rows::Never)
        else {
            return;
        };
        let mut stream = stream;
        match stream.finish() {
            Ok(Some(opened)) => self.open_table(&mut stream, opened, scratch),
            Ok(None) if stream.table().is_none() => {
                let why = Diagnostic::new("no header of a table came, and no object");
                return self.refuse_table(&stream, &why, 0);
            }
            Ok(None) => {}
            Err(why) => return self.refuse_table(&stream, &why, 0),
        }
        self.rows = Rows::Table { stream, is_strict };
    }

    /// The columns are known: reports them, and reads the rows so far.
    fn open_table(
        &mut self,
        stream: &mut TableStream,
        (rows, skipped): (Vec<HeldRow>, u64),
        scratch: &mut Scratch,
    ) {
        self.note_skipped(skipped, &stream.shown());
        let name = self.client.peer.name.clone();
        for note in stream.notes() {
            log_throttle::info(&format!("{name} {note}"), &format!("{name}: {note}"));
        }
        if let Some(doubt) = stream
            .doubt_of_unit()
            .filter(|_| !self.hub.states_gyro_unit())
        {
            log_throttle::warn(&format!("{name} unit"), &format!("{name}: {doubt}"));
        }
        for row in rows {
            if self.end.is_some() {
                return;
            }
            self.decode_row(stream, (row.number, &row.line), row.received, scratch);
        }
    }

    fn decode_row(
        &mut self,
        stream: &mut TableStream,
        said: (u64, &[u8]),
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        let (number, line) = said;
        let before = scratch.run.samples.len();
        let head = match stream.decode(line, received, &mut scratch.run.samples) {
            Ok(head) => head,
            Err(why) => {
                return self.bad(&wire::undecodable(&why), number, line, received, scratch);
            }
        };
        let new = scratch.run.samples.get(before..).unwrap_or_default();
        // The header once more, a comment, a row that was left out.
        if new.is_empty() {
            return;
        }
        let is_attitude = head.class == Class::Att;
        let has_rate = new.iter().any(|raw| raw.gyro.is_some());
        let is_sample = head.class == Class::Rate && !is_attitude
            || wire::are_beside(new)
            || (is_attitude && has_rate && self.side.is_source());
        if is_sample {
            return self.gather(head, before, said, received, scratch);
        }
        scratch.run.samples.truncate(before);
        let fault = Fault::new(
            "no_rate",
            "the row holds no body rate: columns such as gyro_x, gyro_y, gyro_z, or ?columns=gyro=NAME:NAME:NAME",
        );
        self.bad(&fault, number, line, received, scratch);
    }

    /// Refuses lines that are neither objects nor rows: nothing behind them is read.
    fn refuse_table(&mut self, stream: &TableStream, why: &Diagnostic, number: u64) {
        let lines = stream.skipped().max(1);
        count(&self.hub.counters.skipped_lines, lines as usize);
        let mut message = format!(
            "neither objects nor rows of a table: {}; the first of {lines} lines were `{}`",
            why.what(),
            stream.shown()
        );
        if let Some(help) = why.helping() {
            message.push_str(&format!("; {help} (in an address ?columns=...)"));
        }
        let fault = Fault::new("no_table", message);
        self.say(&fault, number, &[]);
        let naming = match &self.side {
            Side::Source(naming) => naming.id.as_ref(),
            Side::Client { .. } | Side::ListenOnly { .. } => self.reading.id.as_ref(),
        };
        self.hub.losses.add(&Lost {
            source: naming.unwrap_or(&self.client.peer.name),
            fault: &fault,
            first: (0, &[]),
            count: lines,
            is_whole: !self.has_sent(),
        });
        self.end = Some(End::NoTable);
    }
}
