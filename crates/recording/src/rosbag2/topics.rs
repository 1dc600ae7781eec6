//! The tables of topics and of types -> schemas and channels. Pure, but for who has the pages.
//!
//! Apart from the messages because they are read before the first of them, as a whole: there are few.

use super::bag::{Fault, FaultKind};
use crate::decode::known_definition;
use crate::records::transcript::Transcript;
use crate::sqlite::{Definition, Encoding, Pages, Seen, Table, TableItem, Value};
use std::collections::BTreeMap;
use std::io;

/// Most rows of one of these tables that are looked at: as many as channels have numbers.
const MOST: usize = u16::MAX as usize;
/// Longest row of them, bytes: the longest definitions in use take a hundredth of that.
const LONGEST: u64 = 4 << 20;

/// Reader of the small tables.
pub(super) struct Small<'p> {
    pub(super) pages: &'p mut dyn Pages,
    pub(super) seen: &'p mut Seen,
    pub(super) encoding: Encoding,
    pub(super) faults: &'p mut Vec<Fault>,
    /// Bytes that texts may still take.
    pub(super) left: usize,
}

/// A value of a small table; texts that are none are empty.
#[derive(Clone, PartialEq, Debug)]
enum Cell {
    Number(i64),
    Text(String),
}

impl Small<'_> {
    /// Values of these columns of each row, with its number; `""` for columns the table has not.
    fn rows<const N: usize>(
        &mut self,
        mut table: Table,
        places: [Option<usize>; N],
    ) -> io::Result<Vec<(i64, [Cell; N])>> {
        let mut rows = Vec::new();
        while rows.len() < MOST {
            match table.next(self.pages, self.seen)? {
                TableItem::End => return Ok(rows),
                TableItem::LostRow { page, why } => {
                    let kind = FaultKind::Row { why };
                    self.faults.push(Fault::at(page, kind, None));
                }
                TableItem::LostPage { page, why, .. } => {
                    let kind = FaultKind::Page { page, why };
                    self.faults.push(Fault::at(page, kind, None));
                }
                TableItem::Row { rowid, row, .. } => {
                    let mut cells = [const { Cell::Number(0) }; N];
                    for (nth, value) in row.enumerate() {
                        for (cell, _) in cells
                            .iter_mut()
                            .zip(places)
                            .filter(|(_, p)| *p == Some(nth))
                        {
                            *cell = match value {
                                // The number of the row itself.
                                Value::Null => Cell::Number(rowid),
                                Value::Integer(number) => Cell::Number(number),
                                Value::Text(text) => Cell::Text(self.encoding.text(text)),
                                _ => Cell::Text(String::new()),
                            };
                        }
                    }
                    let of = |cell: &Cell| match cell {
                        Cell::Text(text) => text.len(),
                        Cell::Number(_) => 8,
                    };
                    let Some(left) = self.left.checked_sub(cells.iter().map(of).sum()) else {
                        break;
                    };
                    self.left = left;
                    rows.push((rowid, cells));
                }
            }
        }
        self.faults.push(Fault::at(1, FaultKind::TooMany, None));
        Ok(rows)
    }

    fn table(&mut self, of: &Definition) -> Table {
        Table::of(Some(of.root), LONGEST)
    }

    /// The release of ROS that recorded, where it is said.
    pub(super) fn distribution(&mut self, of: &Definition) -> io::Result<String> {
        let table = self.table(of);
        let rows = self.rows(table, [of.column("ros_distro")])?;
        Ok(match rows.into_iter().next() {
            Some((_, [Cell::Text(name)])) => name,
            _ => String::new(),
        })
    }

    /// Language and text of each type that has one.
    pub(super) fn types(
        &mut self,
        of: &Definition,
    ) -> io::Result<BTreeMap<String, (String, String)>> {
        let places = ["topic_type", "encoding", "encoded_message_definition"];
        let table = self.table(of);
        let rows = self.rows(table, places.map(|name| of.column(name)))?;
        let row = |(_, row): (i64, [Cell; 3])| match row {
            [Cell::Text(name), Cell::Text(language), Cell::Text(text)] => {
                Some((name, (language, text)))
            }
            _ => None,
        };
        Ok(rows.into_iter().filter_map(row).collect())
    }

    /// Tells schemas and channels; the numbers of channels by those of their topics.
    pub(super) fn topics(
        &mut self,
        (table, places): (Table, [Option<usize>; 6]),
        types: &BTreeMap<String, (String, String)>,
        to: &mut Transcript,
    ) -> io::Result<BTreeMap<i64, u16>> {
        let rows = self.rows(table, places)?;
        let mut schemas: BTreeMap<String, u16> = BTreeMap::new();
        let mut channels = BTreeMap::new();
        for (rowid, row) in rows {
            let [
                id,
                Cell::Text(topic),
                Cell::Text(kind),
                Cell::Text(format),
                qos,
                hash,
            ] = row
            else {
                let kind = FaultKind::Row {
                    why: "a topic without name, type or format",
                };
                self.faults.push(Fault::at(1, kind, None));
                continue;
            };
            let id = match id {
                Cell::Number(id) => id,
                Cell::Text(_) => rowid,
            };
            let number = u16::try_from(channels.len()).ok();
            let Some(number) = number.filter(|number| *number < u16::MAX) else {
                self.faults.push(Fault::at(1, FaultKind::TooMany, None));
                break;
            };
            let next = schemas.len() as u16 + 1;
            let schema = *schemas.entry(kind.clone()).or_insert_with(|| {
                let known = types.get(&kind);
                let known = known.map(|(language, text)| (language.as_str(), text.clone()));
                let (language, text) = known
                    .filter(|(_, text)| !text.is_empty())
                    .unwrap_or_else(|| ("ros2msg", known_definition(&kind).unwrap_or_default()));
                to.schema(next, &kind, language, text.as_bytes());
                next
            });
            let said = [("offered_qos_profiles", &qos), ("topic_type_hash", &hash)];
            let said = said.into_iter().filter_map(|(name, cell)| match cell {
                Cell::Text(text) if !text.is_empty() => Some((name, text.as_str())),
                _ => None,
            });
            let said: Vec<(&str, &str)> = said.collect();
            to.channel(number, schema, &topic, &format, &said);
            channels.insert(id, number);
        }
        Ok(channels)
    }
}

/// Columns of the table of topics.
pub(super) const TOPIC: [&str; 6] = [
    "id",
    "name",
    "type",
    "serialization_format",
    "offered_qos_profiles",
    "type_description_hash",
];
