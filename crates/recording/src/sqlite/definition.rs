//! The table of tables -> where each begins, and what its columns are called. Pure, but for who has the pages.
//!
//! Apart from the rows because columns are found by name: makers add some, and those that are read need not stand
//! first.

use super::table::{Table, TableItem};
use super::{Encoding, Pages, Seen};
use std::io;

/// Most tables and indices that are looked at; rosbag2 makes six.
const MOST: usize = 1000;
/// Most columns of a table that are looked at, and longest name of one.
const MOST_COLUMNS: usize = 100;
const LONGEST_NAME: usize = 255;
/// Longest statement that is read, bytes.
const LONGEST: u64 = 1 << 20;

/// A table.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Definition {
    pub(crate) name: String,
    pub(crate) root: u32,
    /// Names of its columns, in the order of their values.
    pub(crate) columns: Vec<String>,
}

impl Definition {
    /// Index of the values of a column in a row.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        let is_it = |known: &String| known.eq_ignore_ascii_case(name);
        self.columns.iter().position(is_it)
    }
}

/// The tables of a database, and whether all were read.
///
/// # Errors
/// Only when the input itself cannot be read.
pub(crate) fn definitions(
    pages: &mut dyn Pages,
    seen: &mut Seen,
    encoding: Encoding,
) -> io::Result<(Vec<Definition>, bool)> {
    let mut table = Table::of(Some(1), LONGEST);
    let mut found = Vec::new();
    let mut is_whole = true;
    for _ in 0..MOST {
        match table.next(pages, seen)? {
            TableItem::End => return Ok((found, is_whole)),
            TableItem::LostRow { .. } | TableItem::LostPage { .. } => is_whole = false,
            TableItem::Row { row, .. } => {
                let mut values = row;
                let text = |value: Option<super::Value<'_>>| {
                    let text = value.and_then(super::Value::text);
                    text.map(|text| encoding.text(text))
                };
                let kind = text(values.next());
                let (name, _, root) = (text(values.next()), values.next(), values.next());
                let root = root.and_then(super::Value::integer);
                let root = root.and_then(|root| u32::try_from(root).ok());
                let sql = text(values.next());
                match (kind.as_deref(), name, root, sql) {
                    (Some("table"), Some(name), Some(root), Some(sql)) => {
                        if name.len() <= LONGEST_NAME {
                            let columns = columns(&sql);
                            found.push(Definition {
                                name,
                                root,
                                columns,
                            });
                        }
                    }
                    (Some("index" | "view" | "trigger"), ..) => {}
                    _ => is_whole = false,
                }
            }
        }
    }
    Ok((found, false))
}

/// The names of the columns in `CREATE TABLE name(first TYPE ..., "second", ...)`; those of a virtual table are none.
fn columns(sql: &str) -> Vec<String> {
    let Some((_, inner)) = sql.split_once('(') else {
        return Vec::new();
    };
    let mut names = Vec::new();
    for part in parts(inner) {
        let part = part.trim_start();
        let name = match part.chars().next() {
            Some(open @ ('"' | '`' | '\'' | '[')) => {
                let close = if open == '[' { ']' } else { open };
                part.get(1..).and_then(|rest| rest.split(close).next())
            }
            _ => part
                .split(|c: char| !c.is_alphanumeric() && c != '_')
                .next(),
        };
        let name = name.unwrap_or_default();
        const CONSTRAINTS: [&str; 5] = ["CONSTRAINT", "PRIMARY", "UNIQUE", "CHECK", "FOREIGN"];
        if CONSTRAINTS
            .iter()
            .any(|word| name.eq_ignore_ascii_case(word))
        {
            break;
        }
        let is_kept = name.len() <= LONGEST_NAME;
        names.push(if is_kept {
            name.to_owned()
        } else {
            String::new()
        });
        if names.len() >= MOST_COLUMNS {
            break;
        }
    }
    names
}

/// Parts between the commas of the outermost brackets, which are open already.
fn parts(inner: &str) -> Vec<&str> {
    let (mut found, mut from, mut depth) = (Vec::new(), 0, 0_usize);
    let mut quote = None;
    for (at, letter) in inner.char_indices() {
        match (letter, quote) {
            (_, Some(open)) if letter == open => quote = None,
            (_, Some(_)) => {}
            ('"' | '`' | '\'', None) => quote = Some(letter),
            ('(', None) => depth += 1,
            (')', None) if depth > 0 => depth -= 1,
            (',' | ')', None) if depth == 0 => {
                found.extend(inner.get(from..at));
                from = at + 1;
                if letter == ')' {
                    break;
                }
            }
            _ => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::columns;

    #[test]
    fn columns_are_found_whatever_stands_behind_their_names() {
        let sql = "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,\n\
                   \"time stamp\" DECIMAL(10,5) DEFAULT ('a),b'), [data] BLOB, UNIQUE(id, data), FOREIGN KEY(id))";
        assert_eq!(columns(sql), ["id", "topic_id", "time stamp", "data"]);
        assert!(columns("CREATE VIRTUAL TABLE x").is_empty());
        assert!(columns("CREATE TABLE x(").is_empty());
    }
}
