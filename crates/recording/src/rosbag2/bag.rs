//! A database -> channels, then messages in the order of their numbers, and what was wrong. Pure, but for who has the
//! pages.
//!
//! Apart from the tables because it alone decides what a lost page costs: leaves below it are looked for among all
//! pages, once, and read in its place.

use super::catalogue::Catalogue;
use super::message::{Messages, Places, SPARE};
use super::topics::{Small, TOPIC};
use crate::records::transcript::Transcript;
use crate::sqlite::{
    Definition, Header, Kind, Page, Pages, Row, Seen, TWICE, Table, TableItem, definitions,
};
use std::collections::BTreeMap;
use std::io;

/// Fault, and its page.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Fault {
    pub(crate) page: u32,
    pub(crate) kind: FaultKind,
    /// Messages lost by it, where that is known.
    pub(crate) messages: Option<u64>,
}

/// Kind of a fault in a recording.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum FaultKind {
    /// Fewer pages are there than the database says that it has.
    Cut { need: u32, have: u32 },
    /// More are there than the last transaction says.
    Uncommitted { pages: u32 },
    /// A page that cannot be read.
    Page { page: u32, why: &'static str },
    /// A row that cannot be read, or is no message.
    Row { why: &'static str },
    /// Missing table.
    NoTable { name: &'static str },
    /// Definitions beyond the limits, or more leaves than are looked for.
    TooMany,
}

impl Fault {
    pub(super) fn at(page: u32, kind: FaultKind, messages: Option<u64>) -> Fault {
        Fault {
            page,
            kind,
            messages,
        }
    }
}

/// A recording under way.
#[derive(Debug)]
pub(crate) struct Bag {
    header: Header,
    seen: Seen,
    table: Table,
    messages: Messages,
    /// Made when the first page is lost.
    catalogue: Option<Catalogue>,
    /// Leaves that no tree reaches were looked for, behind the last that one does.
    is_swept: bool,
    /// A page is lost: leaves that no tree reaches may be anywhere.
    is_damaged: bool,
    /// The last transaction was not ended.
    is_open: bool,
    last: i64,
    /// Release of ROS that recorded it.
    pub(crate) distribution: String,
    pub(crate) faults: Vec<Fault>,
}

impl Bag {
    /// Reads what the tables say, and tells the channels. Messages longer than `longest` bytes are lost, and all
    /// definitions may take `most`.
    ///
    /// # Errors
    /// Only when the input itself cannot be read.
    pub(crate) fn open(
        pages: &mut dyn Pages,
        header: Header,
        (longest, most): (u64, usize),
        to: &mut Transcript,
    ) -> io::Result<Bag> {
        let mut seen = Seen::up_to(pages.count());
        let mut faults = Vec::new();
        let length = length_fault(header.pages, pages.count());
        let is_open = matches!(
            length,
            Some(Fault {
                kind: FaultKind::Uncommitted { .. },
                ..
            })
        );
        faults.extend(length);
        let (tables, is_whole) = definitions(pages, &mut seen, header.encoding)?;
        let named = |name: &str| {
            let is_it = |table: &&Definition| table.name.eq_ignore_ascii_case(name);
            tables.iter().find(is_it)
        };
        let own = named("messages");
        for (name, table) in [("topics", named("topics")), ("messages", own)] {
            if table.is_none() {
                faults.push(Fault::at(1, FaultKind::NoTable { name }, None));
            }
        }
        if !is_whole {
            let why = "not all of the tables in it can be told";
            faults.push(Fault::at(1, FaultKind::Page { page: 1, why }, None));
        }
        let unreached = match named("topics") {
            // Where all tables are known, it is a database of something else.
            _ if is_whole => None,
            Some(_) => None,
            None => Some(Catalogue::of(pages, &seen, &header, is_of_topics)?),
        };
        let mut small = Small {
            pages,
            seen: &mut seen,
            encoding: header.encoding,
            faults: &mut faults,
            left: most,
        };
        let distribution = match named("schema") {
            Some(table) => small.distribution(table)?,
            None => String::new(),
        };
        let types = match named("message_definitions") {
            Some(table) => small.types(table)?,
            None => BTreeMap::new(),
        };
        let of_topics = match (named("topics"), unreached) {
            (Some(table), _) => (
                Table::of(Some(table.root), longest),
                TOPIC.map(|name| table.column(name)),
            ),
            (None, unreached) => {
                let mut table = Table::of(None, longest);
                let mut leaves = unreached.unwrap_or_default();
                table.put_first(leaves.take((i64::MIN, i64::MAX)).into_iter());
                (table, [0, 1, 2, 3, 4, 5].map(Some))
            }
        };
        let topics = small.topics(of_topics, &types, to)?;
        Ok(Bag {
            header,
            seen,
            table: Table::of(own.map(|table| table.root), longest),
            messages: Messages {
                places: own.and_then(Places::of).unwrap_or(Places::USUAL),
                topics,
                longest,
                spare: SPARE,
                unpacked: Vec::new(),
            },
            catalogue: None,
            is_swept: false,
            is_damaged: !is_whole || own.is_some() && !faults.is_empty() && !is_open,
            is_open,
            last: i64::MIN,
            distribution,
            faults,
        })
    }

    /// Tells the next message; whether there may be more.
    ///
    /// # Errors
    /// Only when the input itself cannot be read.
    pub(crate) fn next(&mut self, pages: &mut dyn Pages, to: &mut Transcript) -> io::Result<bool> {
        let rows = match self.table.next(pages, &mut self.seen)? {
            TableItem::Row { page, rowid, row } => {
                self.last = self.last.max(rowid);
                if let Err(why) = self.messages.tell(row, to) {
                    let kind = FaultKind::Row { why };
                    self.faults.push(Fault::at(page, kind, Some(1)));
                }
                return Ok(true);
            }
            TableItem::LostRow { page, why } => {
                let kind = FaultKind::Row { why };
                self.faults.push(Fault::at(page, kind, Some(1)));
                return Ok(true);
            }
            TableItem::End => return self.sweep(pages),
            TableItem::LostPage { page, why, rows } => {
                let lost = match why {
                    // Its rows were told where it was first.
                    TWICE => None,
                    _ => self.rows_of_a_leaf(rows),
                };
                self.faults
                    .push(Fault::at(page, FaultKind::Page { page, why }, lost));
                rows
            }
        };
        self.is_damaged = true;
        self.look_around(pages)?;
        let leaves = self.unreached(rows);
        if !leaves.is_empty() {
            // It was a page above them, and its own rows are none.
            let above = self.faults.iter_mut().rev();
            let mut above = above.filter(|fault| matches!(fault.kind, FaultKind::Page { .. }));
            if let Some(fault) = above.next() {
                fault.messages = None;
            }
        }
        self.table.put_first(leaves.into_iter());
        Ok(true)
    }

    /// The page of the message told last.
    pub(crate) fn page(&self) -> u32 {
        self.table.page()
    }

    /// Number of rows that a leaf has between these numbers, by those of its neighbours.
    fn rows_of_a_leaf(&self, (low, high): (i64, i64)) -> Option<u64> {
        let low = low.max(0);
        let rows = u64::try_from(high.checked_sub(low)?).ok()?;
        // A row takes eight bytes at least.
        (rows <= u64::from(self.header.usable / 8)).then_some(rows)
    }

    /// Leaves with these rows that no tree has reached.
    fn unreached(&mut self, rows: (i64, i64)) -> Vec<u32> {
        let catalogue = self.catalogue.as_mut();
        let mut leaves = catalogue.map_or_else(Vec::new, |known| known.take(rows));
        leaves.retain(|leaf| !self.seen.has(*leaf));
        leaves
    }

    fn look_around(&mut self, pages: &mut dyn Pages) -> io::Result<()> {
        if self.catalogue.is_none() {
            let first = |page: &Page<'_>| self.messages.first_of(page);
            let found = Catalogue::of(pages, &self.seen, &self.header, first)?;
            if found.is_full {
                self.faults.push(Fault::at(1, FaultKind::TooMany, None));
            }
            self.catalogue = Some(found);
        }
        Ok(())
    }

    /// Sweeps, behind the last leaf, those that no tree reaches, where something is wrong.
    fn sweep(&mut self, pages: &mut dyn Pages) -> io::Result<bool> {
        if self.is_swept || !(self.is_damaged || self.is_open) {
            return Ok(false);
        }
        self.is_swept = true;
        self.look_around(pages)?;
        let low = match self.is_damaged {
            true => i64::MIN,
            false => self.last,
        };
        let leaves = self.unreached((low, i64::MAX));
        self.table.put_first(leaves.into_iter());
        Ok(true)
    }
}

/// The number of the first row, of a leaf whose rows look like topics.
fn is_of_topics(page: &Page<'_>) -> Option<i64> {
    if page.kind != Kind::Leaf {
        return None;
    }
    let cell = (0..page.cells).find_map(|nth| page.cell(nth))?;
    let mut row = Row::of(cell.local)?.skip(1);
    let (topic, kind, format) = (
        row.next()?.text()?,
        row.next()?.text()?,
        row.next()?.text()?,
    );
    let is_topic = topic.starts_with(b"/") && kind.contains(&b'/') && format == b"cdr";
    is_topic.then_some(cell.rowid)
}

/// Fault of a file that has more or fewer pages than its header states.
fn length_fault(said: Option<u32>, have: u32) -> Option<Fault> {
    match said {
        Some(need) if need > have => Some(Fault::at(have, FaultKind::Cut { need, have }, None)),
        Some(said) if said < have => {
            let pages = have - said;
            Some(Fault::at(said, FaultKind::Uncommitted { pages }, None))
        }
        _ => None,
    }
}
