//! The files of a database -> its pages. I/O.
//!
//! Apart from the tables, which know no files: a page lies in the database itself, or, committed and not yet there, in
//! the file `-wal` beside it.

use super::super::input::LogFile;
use crate::sqlite::wal::{self, NoFrame, Wal};
use crate::sqlite::{HEADER, Header, Pages};
use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

/// Bytes read at most at a time, where pages follow each other.
const WINDOW: usize = 256 << 10;

/// Fault of a frame whose number no transaction gave out.
const BEYOND: &str =
    "a page in it lies beyond the size that its transaction commits; it is left out";

/// Pages in two files.
#[derive(Debug)]
pub(super) struct FilePages {
    file: Arc<LogFile>,
    beside: Option<Arc<LogFile>>,
    /// Offsets in the file beside at which a page's bytes begin.
    committed: BTreeMap<u32, u64>,
    page_size: u32,
    usable: usize,
    /// Pages in the database itself.
    own: u32,
    count: u32,
    /// Bytes read ahead, and their offset.
    window: Vec<u8>,
    window_at: u64,
    /// Bytes to read where the next page is not in the window.
    ahead: usize,
}

/// Fault of the file beside.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct WalFault {
    pub(super) offset: u64,
    pub(super) why: &'static str,
}

impl FilePages {
    /// The pages, and the header as it is committed.
    ///
    /// # Errors
    /// The input cannot be read; else why it is no database, in words.
    pub(super) fn open(
        file: Arc<LogFile>,
        beside: Option<Arc<LogFile>>,
        faults: &mut Vec<WalFault>,
    ) -> io::Result<Result<(FilePages, Header), &'static str>> {
        let mut head = vec![0; HEADER];
        let have = file.read_at(&mut head, 0)?;
        head.truncate(have);
        let header = match Header::parse(&head) {
            Ok(header) => header,
            Err(why) => return Ok(Err(why)),
        };
        let own = file.len / u64::from(header.page_size);
        // More than the format can number are none.
        let own = u32::try_from(own).unwrap_or(u32::MAX - 1);
        let mut pages = FilePages {
            page_size: header.page_size,
            usable: header.usable as usize,
            own,
            count: own,
            file,
            beside: None,
            committed: BTreeMap::new(),
            window: Vec::new(),
            window_at: 0,
            ahead: 0,
        };
        let Some(beside) = beside.filter(|beside| beside.len > 0) else {
            return Ok(Ok((pages, header)));
        };
        let size = pages.committed_in(&beside, faults)?;
        pages.beside = Some(beside);
        let Some(size) = size else {
            return Ok(Ok((pages, header)));
        };
        let last = pages.committed.last_key_value();
        pages.count = last.map_or(0, |(last, _)| *last).max(pages.count);
        let mut first = Vec::new();
        pages.page(1, &mut first)?;
        let header = Header::parse(&first).unwrap_or(header);
        let header = Header {
            pages: Some(size),
            page_size: pages.page_size,
            usable: pages.usable as u32,
            ..header
        };
        Ok(Ok((pages, header)))
    }

    /// Finds the committed pages of the file beside; how many the database has with them.
    fn committed_in(
        &mut self,
        beside: &LogFile,
        faults: &mut Vec<WalFault>,
    ) -> io::Result<Option<u32>> {
        let mut head = vec![0; wal::HEAD];
        let have = beside.read_at(&mut head, 0)?;
        head.truncate(have);
        let mut fault = |offset, why| faults.push(WalFault { offset, why });
        let mut wal = match Wal::parse(&head) {
            Ok(wal) if wal.page_size == self.page_size => wal,
            Ok(_) => {
                fault(0, "its pages have another size");
                return Ok(None);
            }
            Err(why) => {
                fault(0, why);
                return Ok(None);
            }
        };
        let size = wal::FRAME + self.page_size as usize;
        let mut frame = vec![0; size];
        let mut at = wal::HEAD as u64;
        let mut pending = BTreeMap::new();
        let mut pages = None;
        loop {
            let have = beside.read_at(&mut frame, at)?;
            let (head, page) = frame.split_at(wal::FRAME);
            if have < size {
                if have > 0 {
                    fault(at, "it is cut inside a page");
                }
                break;
            }
            match wal.frame(head, page) {
                Err(NoFrame::Old) => break,
                Err(NoFrame::Damaged) => {
                    fault(
                        at,
                        "the checksum of a page is wrong; it and what follows are left out",
                    );
                    break;
                }
                Ok(found) => {
                    pending.insert(found.page, at + wal::FRAME as u64);
                    if let Some(size) = found.commits {
                        pages = Some(size);
                        let mut beyond = pending.split_off(&size.saturating_add(1));
                        if let Some((_, at)) = beyond.pop_first() {
                            fault(at, BEYOND);
                        }
                        self.committed.append(&mut pending);
                        // What an earlier transaction had there was given back.
                        self.committed.split_off(&size.saturating_add(1));
                    }
                }
            }
            at += size as u64;
        }
        if !pending.is_empty() {
            fault(at, "its last pages are not committed, and left out");
        }
        Ok(pages)
    }

    /// Offset of a page in the file.
    pub(super) fn offset(&self, page: u32) -> u64 {
        u64::from(page.saturating_sub(1)) * u64::from(self.page_size)
    }

    fn read_page(&mut self, at: u64, into: &mut Vec<u8>) -> io::Result<bool> {
        let size = self.page_size as usize;
        let within = |at: u64, window_at: u64, window: &[u8]| {
            let from = usize::try_from(at.checked_sub(window_at)?).ok()?;
            let end = from.checked_add(size)?;
            (end <= window.len()).then_some(from)
        };
        let from = match within(at, self.window_at, &self.window) {
            Some(from) => from,
            None => {
                // More is read ahead the longer pages follow each other.
                let end = self.window_at + self.window.len() as u64;
                let is_next = at >= end && at - end <= self.ahead as u64;
                self.ahead = match is_next {
                    true => (2 * self.ahead).clamp(size, WINDOW.max(size)),
                    false => size,
                };
                self.window.resize(self.ahead, 0);
                let have = self.file.read_at(&mut self.window, at)?;
                self.window.truncate(have);
                self.window_at = at;
                match within(at, at, &self.window) {
                    Some(from) => from,
                    None => return Ok(false),
                }
            }
        };
        let page = self.window.get(from..from + self.usable);
        into.extend_from_slice(page.unwrap_or(&[]));
        Ok(true)
    }
}

impl Pages for FilePages {
    fn count(&self) -> u32 {
        self.count
    }

    fn following(&self, number: u32) -> Option<u32> {
        let next = number.checked_add(1)?;
        if next <= self.own {
            return Some(next);
        }
        let mut committed = self.committed.range(next..);
        committed.next().map(|(number, _)| *number)
    }

    fn page(&mut self, number: u32, into: &mut Vec<u8>) -> io::Result<bool> {
        into.clear();
        match (self.committed.get(&number), &self.beside) {
            (Some(at), Some(beside)) => {
                into.resize(self.usable, 0);
                Ok(beside.read_at(into, *at)? == self.usable)
            }
            _ if number > self.own => Ok(false),
            _ => self.read_page(self.offset(number), into),
        }
    }
}
