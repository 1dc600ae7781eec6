//! The footer of a Parquet file -> its columns, and where their pages are. Pure.
//!
//! Apart from the pages because everything is decided here: which columns there are and what their numbers mean,
//! before a byte of them is read.
//!
//! # Source
//! apache/parquet-format, `src/main/thrift/parquet.thrift`.

use super::thrift::{Bad, Fields, Kind};

/// Columns that are looked at.
const MOST_COLUMNS: usize = 4096;

/// Physical type of a value.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Stored {
    Boolean,
    Int32,
    Int64,
    /// Nanoseconds of a day, and the day.
    Int96,
    Float,
    Double,
    Bytes,
    /// Bytes of this length.
    Fixed(usize),
}

/// Logical meaning of a number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Meaning {
    Plain,
    Unsigned,
    /// A time, counted in this unit.
    Time(&'static str),
    /// Meaning that is none of ours: decimals, half floats, dates.
    Other,
}

/// A leaf of the schema.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Leaf {
    /// Path, with points between.
    pub(super) name: String,
    pub(super) stored: Stored,
    pub(super) meaning: Meaning,
    /// The level at which a value is there.
    pub(super) levels: u32,
    /// Whether it is a list, or in one.
    pub(super) is_repeated: bool,
}

/// Place of the pages of a column, in a group of rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Chunk {
    pub(super) codec: i64,
    pub(super) values: u64,
    pub(super) offset: u64,
    pub(super) length: u64,
    /// Whether it is in another file, or encrypted.
    pub(super) is_elsewhere: bool,
}

/// A group of rows.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Group {
    pub(super) rows: u64,
    pub(super) chunks: Vec<Chunk>,
}

impl Group {
    /// Number of values that its columns state, the most of any: no more rows are there to be lost.
    pub(super) fn stated_by_columns(&self) -> u64 {
        self.chunks
            .iter()
            .map(|chunk| chunk.values)
            .max()
            .unwrap_or(0)
    }
}

/// Contents of a footer.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Footer {
    pub(super) leaves: Vec<Leaf>,
    pub(super) groups: Vec<Group>,
    /// Whether strapd wrote it.
    pub(super) is_own: bool,
    /// Kind of its samples, where strapd wrote them.
    pub(super) sample_kind: Option<String>,
    /// World of its attitudes, where strapd wrote them.
    pub(super) world: Option<String>,
}

/// An element of the schema, as it stands there.
#[derive(Default)]
struct Element {
    name: String,
    stored: Option<i64>,
    length: Option<u64>,
    repetition: i64,
    children: u64,
    converted: Option<i64>,
    logical: Option<Meaning>,
}

impl Footer {
    /// Reads the footer's bytes.
    ///
    /// # Errors
    /// In words, what cannot be.
    pub(super) fn parse(bytes: &[u8]) -> Result<Footer, String> {
        let mut footer = Footer::default();
        let mut elements = Vec::new();
        let read = Fields::new(bytes).each(|id, kind, fields| {
            match (id, kind) {
                (2, Kind::List) => elements = fields.list_of(Kind::Struct, element)?,
                (4, Kind::List) => footer.groups = fields.list_of(Kind::Struct, group)?,
                (5, Kind::List) => {
                    fields.list_of(Kind::Struct, |fields| footer.about(fields))?;
                }
                _ => return Ok(false),
            }
            Ok(true)
        });
        read.map_err(|_| "its footer is damaged".to_owned())?;
        footer.leaves = leaves(&elements)?;
        Ok(footer)
    }

    fn about(&mut self, fields: &mut Fields<'_>) -> Result<(), Bad> {
        let (mut key, mut value) = (&[][..], &[][..]);
        fields.each(|id, kind, fields| {
            match (id, kind) {
                (1, Kind::Binary) => key = fields.binary()?,
                (2, Kind::Binary) => value = fields.binary()?,
                _ => return Ok(false),
            }
            Ok(true)
        })?;
        self.is_own |= key == b"strapd.columns";
        let text = || Some(crate::text::printable(&String::from_utf8_lossy(value)));
        match key {
            b"strapd.sample_kind" => self.sample_kind = text(),
            b"strapd.world" => self.world = text(),
            _ => {}
        }
        Ok(())
    }
}

fn element(fields: &mut Fields<'_>) -> Result<Element, Bad> {
    let mut found = Element::default();
    fields.each(|id, kind, fields| {
        match (id, kind) {
            (1, Kind::Whole) => found.stored = Some(fields.whole()?),
            (2, Kind::Whole) => found.length = Some(fields.size()?),
            (3, Kind::Whole) => found.repetition = fields.whole()?,
            (4, Kind::Binary) => {
                found.name = String::from_utf8_lossy(fields.binary()?).into_owned();
            }
            (5, Kind::Whole) => found.children = fields.size()?,
            (6, Kind::Whole) => found.converted = Some(fields.whole()?),
            (10, Kind::Struct) => found.logical = Some(logical(fields)?),
            _ => return Ok(false),
        }
        Ok(true)
    })?;
    Ok(found)
}

fn logical(fields: &mut Fields<'_>) -> Result<Meaning, Bad> {
    let mut meaning = Meaning::Plain;
    fields.each(|id, kind, fields| {
        match (id, kind) {
            // TIME, TIMESTAMP.
            (7 | 8, Kind::Struct) => {
                let mut unit = Meaning::Other;
                fields.each(|id, kind, fields| {
                    if (id, kind) != (2, Kind::Struct) {
                        return Ok(false);
                    }
                    fields.each(|id, _, _| {
                        unit = match id {
                            1 => Meaning::Time("ms"),
                            2 => Meaning::Time("us"),
                            3 => Meaning::Time("ns"),
                            _ => Meaning::Other,
                        };
                        Ok(false)
                    })?;
                    Ok(true)
                })?;
                meaning = unit;
            }
            (10, Kind::Struct) => {
                fields.each(|id, kind, _| {
                    if (id, kind) == (2, Kind::False) {
                        meaning = Meaning::Unsigned;
                    }
                    Ok(false)
                })?;
            }
            // STRING.
            (1, _) => return Ok(false),
            _ => {
                meaning = Meaning::Other;
                return Ok(false);
            }
        }
        Ok(true)
    })?;
    Ok(meaning)
}

impl Element {
    fn stored(&self) -> Option<Stored> {
        Some(match self.stored? {
            0 => Stored::Boolean,
            1 => Stored::Int32,
            2 => Stored::Int64,
            3 => Stored::Int96,
            4 => Stored::Float,
            5 => Stored::Double,
            6 => Stored::Bytes,
            7 => Stored::Fixed(usize::try_from(self.length?).ok()?),
            _ => return None,
        })
    }

    fn meaning(&self, stored: Stored) -> Meaning {
        if stored == Stored::Int96 {
            return Meaning::Time("ns");
        }
        self.logical.unwrap_or(match self.converted {
            None | Some(0 | 15..=18) => Meaning::Plain,
            Some(7 | 9) => Meaning::Time("ms"),
            Some(8 | 10) => Meaning::Time("us"),
            Some(11..=14) => Meaning::Unsigned,
            Some(_) => Meaning::Other,
        })
    }
}

/// The leaves of the tree, in its order, which is that of the columns.
fn leaves(elements: &[Element]) -> Result<Vec<Leaf>, String> {
    let wrong = || "its footer's list of columns is damaged".to_owned();
    let (root, rest) = elements.split_first().ok_or_else(wrong)?;
    if rest.len() > MOST_COLUMNS {
        return Err(format!("it has more than {MOST_COLUMNS} columns"));
    }
    // Groups that are open: children to come, the name before theirs, their level, and whether they are lists.
    let mut open = vec![(root.children, String::new(), 0u32, false)];
    let mut leaves = Vec::new();
    for element in rest {
        while open.last().is_some_and(|(left, ..)| *left == 0) {
            open.pop();
        }
        let (left, before, level, is_list) = open.last_mut().ok_or_else(wrong)?;
        *left -= 1;
        let name = match before.is_empty() {
            true => element.name.clone(),
            false => format!("{before}.{}", element.name),
        };
        let level = *level + u32::from(element.repetition != 0);
        let is_repeated = *is_list || element.repetition == 2;
        match element.children {
            0 => {
                let stored = element.stored().ok_or_else(wrong)?;
                leaves.push(Leaf {
                    name,
                    stored,
                    meaning: element.meaning(stored),
                    levels: level,
                    is_repeated,
                });
            }
            _ if open.len() > 32 || name.len() > 4096 => return Err(wrong()),
            children => open.push((children, name, level, is_repeated)),
        }
    }
    Ok(leaves)
}

fn group(fields: &mut Fields<'_>) -> Result<Group, Bad> {
    let mut found = Group {
        rows: 0,
        chunks: Vec::new(),
    };
    fields.each(|id, kind, fields| {
        match (id, kind) {
            (1, Kind::List) => found.chunks = fields.list_of(Kind::Struct, chunk)?,
            (3, Kind::Whole) => found.rows = fields.size()?,
            _ => return Ok(false),
        }
        Ok(true)
    })?;
    Ok(found)
}

fn chunk(fields: &mut Fields<'_>) -> Result<Chunk, Bad> {
    let mut found = Chunk {
        codec: -1,
        values: 0,
        offset: 0,
        length: 0,
        is_elsewhere: false,
    };
    let (mut pages, mut dictionary) = (0, None);
    fields.each(|id, kind, fields| {
        match (id, kind) {
            (1, Kind::Binary) => found.is_elsewhere |= !fields.binary()?.is_empty(),
            (3, Kind::Struct) => fields.each(|id, kind, fields| {
                match (id, kind) {
                    (4, Kind::Whole) => found.codec = fields.whole()?,
                    (5, Kind::Whole) => found.values = fields.size()?,
                    (7, Kind::Whole) => found.length = fields.size()?,
                    (9, Kind::Whole) => pages = fields.size()?,
                    (11, Kind::Whole) => dictionary = Some(fields.size()?),
                    _ => return Ok(false),
                }
                Ok(true)
            })?,
            (8, _) => {
                found.is_elsewhere = true;
                return Ok(false);
            }
            _ => return Ok(false),
        }
        Ok(true)
    })?;
    found.offset = match dictionary {
        // Some writers put a zero where there is none.
        Some(first) if first > 0 && first < pages => first,
        _ => pages,
    };
    Ok(found)
}
