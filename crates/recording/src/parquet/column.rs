//! The pages of a column in a group of rows -> its cells, one after the other. I/O: seeks and reads.
//!
//! Apart from the rows because columns are read side by side, each at a page of its own: a page that cannot be read
//! costs its rows, and no more than those.

use super::encoding::{Bytes, Values, differences, plain, runs, texts};
use super::footer::{Chunk, Leaf, Meaning, Stored};
use super::header::{DATA, DATA_2, DICTIONARY, Header, header};
use super::thrift::Bad;
use super::unpack::{MOST_PAGE, unpacked};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::sync::Arc;

/// Values of a page.
const MOST_VALUES: u64 = 4 << 20;
/// Bytes of a page's header: those that are tried first, and the most.
const HEADERS: [u64; 2] = [4 << 10, 4 << 20];

/// A column in a group of rows.
#[derive(Debug)]
pub(super) struct Column {
    leaf: Leaf,
    codec: i64,
    /// Offset of its next page, and end of its last one.
    next: u64,
    end: u64,
    /// Rows of which no page was read.
    left: u64,
    dictionary: Option<Values>,
    /// Bytes of it.
    dictionary_size: u64,
    page: Page,
}

/// The page that is read from.
#[derive(Debug, Default)]
struct Page {
    rows: u64,
    row: u64,
    /// Presence of a value in each row, where not all have one.
    is_there: Option<Vec<bool>>,
    values: Option<Values>,
    value: usize,
    /// Bytes of it.
    size: u64,
    lost: Option<Arc<str>>,
}

impl Column {
    pub(super) fn new(leaf: &Leaf, chunk: &Chunk, rows: u64) -> Column {
        Column {
            leaf: leaf.clone(),
            codec: chunk.codec,
            next: chunk.offset,
            end: chunk.offset.saturating_add(chunk.length),
            left: rows,
            dictionary: None,
            dictionary_size: 0,
            page: Page::default(),
        }
    }

    /// Whether the next row is on a page that is not read yet.
    pub(super) fn is_over(&self) -> bool {
        self.page.row >= self.page.rows && self.left > 0
    }

    /// Bytes of memory that it holds.
    pub(super) fn held(&self) -> u64 {
        let of_page = match self.page.row < self.page.rows {
            true => self.page.size,
            false => 0,
        };
        self.dictionary_size + of_page
    }

    /// Writes the cell of the next row, its numbers as `put` has them; what it says is why the row is lost.
    ///
    /// # Errors
    /// It cannot be written.
    #[inline]
    pub(super) fn write(
        &mut self,
        out: &mut Vec<u8>,
        put: fn(f64, &mut Vec<u8>),
    ) -> io::Result<Option<Arc<str>>> {
        if self.page.row >= self.page.rows {
            return Ok(Some("the column has fewer values than rows".into()));
        }
        let row = self.page.row as usize;
        self.page.row += 1;
        if self.page.lost.is_some() {
            return Ok(self.page.lost.clone());
        }
        if let Some(is_there) = &self.page.is_there
            && !is_there.get(row).copied().unwrap_or_default()
        {
            return Ok(None);
        }
        let n = self.page.value;
        self.page.value += 1;
        match &self.page.values {
            Some(Values::Whole(all)) => match (all.get(n), self.leaf.meaning, self.leaf.stored) {
                (Some(v), Meaning::Unsigned, Stored::Int32) => write!(out, "{}", *v as u32)?,
                (Some(v), Meaning::Unsigned, _) => write!(out, "{}", *v as u64)?,
                (Some(v), _, _) => write!(out, "{v}")?,
                (None, ..) => {}
            },
            Some(Values::Float(all)) => {
                all.get(n).into_iter().for_each(|v| put(f64::from(*v), out))
            }
            Some(Values::Double(all)) => all.get(n).into_iter().for_each(|v| put(*v, out)),
            Some(Values::Text(all)) => quoted(out, all.get(n).map_or(&[][..], Vec::as_slice)),
            None => {}
        }
        Ok(None)
    }

    /// Takes the next page, which may take so much memory; where there is none to be had, the rows that are left are
    /// lost.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn turn(&mut self, source: &mut (impl Read + Seek), room: u64) -> io::Result<()> {
        self.page = Page::default();
        self.page = match self.read(source, room)? {
            Ok(Some(page)) => page,
            Ok(None) => return Ok(()),
            Err(why) => self.lost(self.left, &why),
        };
        self.left = self.left.saturating_sub(self.page.rows);
        Ok(())
    }

    fn lost(&self, rows: u64, why: &str) -> Page {
        let name = crate::text::printable(&self.leaf.name);
        Page {
            rows,
            lost: Some(format!("column {name}, before byte {}: {why}", self.next).into()),
            ..Page::default()
        }
    }

    /// A page; `None` where it is none of rows. `Err` where the next one cannot be found.
    fn read(
        &mut self,
        source: &mut (impl Read + Seek),
        most: u64,
    ) -> io::Result<Result<Option<Page>, String>> {
        let room = self.end.saturating_sub(self.next);
        if room == 0 {
            return Ok(Err("its pages end too early".to_owned()));
        }
        let mut found = Err(Bad::Short);
        for most in HEADERS {
            let bytes = read_at(source, self.next, room.min(most))?;
            found = header(&bytes);
            if found != Err(Bad::Short) || room <= most {
                break;
            }
        }
        let Ok((head, length)) = found else {
            return Ok(Err("a page's header is damaged".to_owned()));
        };
        let (body, packed) = (self.next + length as u64, head.packed as u64);
        if packed > room.saturating_sub(length as u64) || head.packed > MOST_PAGE {
            return Ok(Err("a page that is longer than its column".to_owned()));
        }
        self.next = body + packed;
        if head.kind != DICTIONARY && head.kind != DATA && head.kind != DATA_2 {
            return Ok(Ok(None));
        }
        if head.kind != DICTIONARY && head.rows > self.left {
            return Ok(Err("a page of more rows than there are".to_owned()));
        }
        let bytes = read_at(source, body, packed)?;
        if bytes.len() < head.packed {
            return Ok(Err("the file is cut".to_owned()));
        }
        let is_wrong = head.crc.is_some_and(|crc| crc != crc32fast::hash(&bytes));
        let read = match is_wrong {
            true => Err("a page's checksum is wrong".to_owned()),
            false => self.unpack(&head, &bytes, most),
        };
        Ok(Ok(match (read, head.kind) {
            (Ok(page), _) => page,
            // Pages that need it say so.
            (Err(_), DICTIONARY) => None,
            (Err(why), _) => Some(self.lost(head.rows, &why)),
        }))
    }

    /// Refuses a page that would take more memory than its column may.
    fn check_size(&self, head: &Header, room: u64) -> Result<(), String> {
        if head.rows > MOST_VALUES {
            return Err(format!(
                "a page of {} values, over the limit of {MOST_VALUES}",
                head.rows
            ));
        }
        if head.unpacked > MOST_PAGE {
            return Err(format!(
                "a page of {} bytes, over the limit of {MOST_PAGE}",
                head.unpacked
            ));
        }
        // Texts take more than their bytes.
        let each = match self.leaf.stored {
            Stored::Bytes => 64,
            _ => 16,
        };
        if head.rows * each + head.unpacked as u64 > room {
            return Err("more is to be held in memory at once than any table needs".to_owned());
        }
        Ok(())
    }

    fn unpack(&mut self, head: &Header, bytes: &[u8], room: u64) -> Result<Option<Page>, String> {
        self.check_size(head, room)?;
        let n = usize::try_from(head.rows).unwrap_or(usize::MAX);
        let mut rest = Bytes(bytes);
        let levels_2 = match head.levels {
            Some((repeats, levels)) => {
                rest.take(repeats)?;
                Some(rest.take(levels)?)
            }
            None => None,
        };
        let before = bytes.len() - rest.0.len();
        let length = head.unpacked.saturating_sub(before);
        let whole = match head.is_packed {
            true => unpacked(self.codec, rest.0, length)?,
            false => rest.0.to_vec(),
        };
        let stored = self.leaf.stored;
        if head.kind == DICTIONARY {
            let dictionary = plain(stored, false, &whole, n)?;
            self.dictionary_size = dictionary.size();
            self.dictionary = Some(dictionary);
            return Ok(None);
        }
        let mut rest = Bytes(&whole);
        let is_there = match self.leaf.levels {
            0 => None,
            most => {
                let bytes = match levels_2 {
                    Some(bytes) => bytes,
                    None if head.levels_encoding != 3 => {
                        return Err("levels in an encoding that is not read".to_owned());
                    }
                    None => {
                        let length = rest.four()?;
                        rest.take(length)?
                    }
                };
                let levels = runs(bytes, 32 - most.leading_zeros(), n)?;
                Some(
                    levels
                        .into_iter()
                        .map(|level| level == most)
                        .collect::<Vec<bool>>(),
                )
            }
        };
        let count = is_there
            .as_ref()
            .map_or(n, |all| all.iter().filter(|is| **is).count());
        let values = self.values(head.encoding, &mut rest, count)?;
        Ok(Some(Page {
            rows: head.rows,
            is_there,
            size: values.size() + head.rows,
            values: Some(values),
            ..Page::default()
        }))
    }

    fn values(&self, encoding: i64, rest: &mut Bytes<'_>, n: usize) -> Result<Values, String> {
        let stored = self.leaf.stored;
        Ok(match (encoding, stored) {
            (0, _) => plain(stored, false, rest.0, n)?,
            (9, _) => plain(stored, true, rest.0, n)?,
            (2 | 8, _) if n == 0 => Values::Whole(Vec::new()),
            (2 | 8, _) => {
                let dictionary = self
                    .dictionary
                    .as_ref()
                    .ok_or("its dictionary is damaged")?;
                let width = rest.take(1)?.first().copied().unwrap_or_default();
                dictionary.at(&runs(rest.0, u32::from(width), n)?)?
            }
            (5, Stored::Int32 | Stored::Int64) => Values::Whole(differences(rest, stored, n)?),
            (6 | 7, Stored::Bytes) => texts(rest.0, encoding == 7, n)?,
            (other, _) => return Err(format!("an encoding that is not read, {other}")),
        })
    }
}

/// A text as a cell: in quotes, without what ends a line.
fn quoted(out: &mut Vec<u8>, text: &[u8]) {
    out.push(b'"');
    for byte in text {
        match byte {
            b'"' => out.extend_from_slice(b"\"\""),
            0..b' ' => out.push(b' '),
            byte => out.push(*byte),
        }
    }
    out.push(b'"');
}

/// Reads at most so many bytes from there on.
pub(super) fn read_at(source: &mut (impl Read + Seek), at: u64, count: u64) -> io::Result<Vec<u8>> {
    source.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    loop {
        let left = count.saturating_sub(bytes.len() as u64);
        match Read::take(&mut *source, left).read_to_end(&mut bytes) {
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            read => return read.map(|_| bytes),
        }
    }
}
