//! Several tables of one recording -> their rows in the order of their stamps. I/O.
//!
//! Apart from the lines because phones write a file for each of their sensors: one has the rates, the others what
//! belongs to them by its stamp.

use super::{Lines, Next};
use crate::decode::Undecodable;
use crate::delimited::Table;
use crate::error::Result;
use crate::text::printable;
use std::io::Read;
use strapd_attitude::record::{Declared, Nanos};

/// A file beside the one with the rates, and what is next in it.
#[derive(Debug)]
pub(super) struct SidecarFile<R> {
    lines: Box<Lines<R>>,
    /// Name of the file in errors.
    file: String,
    /// Line that is next, with its number.
    next: (Next, u64),
}

impl<R: Read> Lines<R> {
    /// The same with the forces or fields of another table of the recording; the clock of both is one.
    ///
    /// # Errors
    /// As [`Lines::next`].
    pub fn with(mut self, other: Lines<R>) -> Result<Lines<R>> {
        let file = other.name.file_name().unwrap_or_default();
        let mut beside = SidecarFile {
            file: printable(&file.to_string_lossy()),
            lines: Box::new(other),
            next: ((None, Vec::new()), 0),
        };
        beside.advance()?;
        self.beside.push(beside);
        Ok(self)
    }

    pub(super) fn next_of_all(&mut self) -> Result<Next> {
        let own = match self.next.take() {
            Some(own) => own,
            None => {
                let mut samples = Vec::new();
                (self.next_own(&mut samples)?, samples)
            }
        };
        let is_over = |beside: &SidecarFile<R>| beside.next.0.0.is_none();
        let others = self.beside.iter_mut().filter(|beside| !is_over(beside));
        let earliest = others.min_by_key(|beside| instant(&beside.next.0));
        // What comes behind the last rate corrects nothing.
        match earliest.filter(|beside| own.0.is_some() && instant(&beside.next.0) <= instant(&own))
        {
            Some(beside) => {
                self.next = Some(own);
                beside.advance()
            }
            None => Ok(own),
        }
    }
}

impl<R: Read> SidecarFile<R> {
    pub(super) fn declared(&self) -> Declared {
        self.lines.declared()
    }

    pub(super) fn notes(&self) -> Vec<String> {
        let table = self.lines.table();
        let has = |is: fn(&Table) -> bool| table.is_some_and(is);
        let what = match (has(Table::has_force), has(Table::has_field)) {
            (true, true) => "specific forces and magnetic fields are",
            (true, false) => "the specific force is",
            _ => "the magnetic field is",
        };
        let notes = table.map(Table::notes).unwrap_or_default().iter();
        let own = notes.map(|note| format!("{}: {note}", self.file));
        let mut all = vec![format!("{what} from {}, beside it", self.file)];
        all.extend(own);
        all
    }

    /// Takes the line that was next; looks at what comes then.
    fn advance(&mut self) -> Result<Next> {
        let mut samples = Vec::new();
        let line = self.lines.next_own(&mut samples)?;
        let next = ((line, samples), self.lines.number());
        let ((line, samples), number) = std::mem::replace(&mut self.next, next);
        let located = |why| Undecodable::Beside {
            file: self.file.clone(),
            line: number,
            why: Box::new(why),
        };
        Ok((line.map(|line| line.map_err(located)), samples))
    }
}

/// Instant at which a line was measured; what states none does not wait.
fn instant((_, samples): &Next) -> Option<Nanos> {
    samples.first()?.header
}
