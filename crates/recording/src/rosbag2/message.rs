//! A row of the table of messages -> the message. Pure.
//!
//! Apart from the walk because a leaf that no tree reaches is known for one of messages by its rows.

use crate::records::transcript::Transcript;
use crate::sqlite::{Definition, Kind, Page, Row, Value};
use std::collections::BTreeMap;
use std::io::Read;

/// The first bytes of what is packed with zstd. A CDR message begins with 0.
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
/// Bytes that one packed may stand for, and what may come to that: an image of one colour packs well.
const UNPACKED: (u64, u64) = (1000, 1 << 20);
/// Bytes that all messages together may unpack to beyond their share: of half a megabyte, ten thousand would be
/// unpacked.
pub(super) const SPARE: u64 = 256 << 20;

/// Indices of the columns in a row.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Places {
    pub(super) topic: usize,
    pub(super) time: usize,
    pub(super) data: usize,
}

impl Places {
    /// Table as rosbag2 makes it.
    pub(super) const USUAL: Places = Places {
        topic: 1,
        time: 2,
        data: 3,
    };

    /// Places in a table that names them; none where it has not all.
    pub(super) fn of(table: &Definition) -> Option<Places> {
        Some(Places {
            topic: table.column("topic_id")?,
            time: table.column("timestamp")?,
            data: table.column("data")?,
        })
    }
}

/// Reader of messages.
#[derive(Debug)]
pub(super) struct Messages {
    pub(super) places: Places,
    /// Number of the channel by that of its topic.
    pub(super) topics: BTreeMap<i64, u16>,
    /// Longest message that is unpacked.
    pub(super) longest: u64,
    /// Bytes that messages may still be unpacked to beyond what theirs stand for.
    pub(super) spare: u64,
    pub(super) unpacked: Vec<u8>,
}

impl Messages {
    /// Tells the message of a row.
    ///
    /// # Errors
    /// Why it is none, in words.
    pub(super) fn tell(&mut self, row: Row<'_>, to: &mut Transcript) -> Result<(), &'static str> {
        let (mut topic, mut time, mut data) = (None, None, None);
        for (nth, value) in row.enumerate() {
            match nth {
                _ if nth == self.places.topic => topic = value.integer(),
                _ if nth == self.places.time => time = value.integer(),
                _ if nth == self.places.data => data = value.blob(),
                _ => {}
            }
        }
        let topic = topic.ok_or("it has no topic")?;
        let channel = self.topics.get(&topic);
        let channel = *channel.ok_or("its topic is not in the table of topics")?;
        let time = time.ok_or("it has no time")?;
        let time = u64::try_from(time).map_err(|_| "its time is before 1970")?;
        let data = data.ok_or("it has no data, or not all of them")?;
        if !data.starts_with(&ZSTD) {
            to.message(channel, 0, time, data);
            return Ok(());
        }
        let (times, more) = UNPACKED;
        let own = (data.len() as u64).saturating_mul(times);
        let most = own.saturating_add(more.min(self.spare)).min(self.longest);
        self.unpacked.clear();
        let decoder = zstd::stream::read::Decoder::with_buffer(data);
        let read = decoder.and_then(|decoder| {
            let mut decoder = decoder.take(most + 1);
            decoder.read_to_end(&mut self.unpacked)
        });
        let beyond = (self.unpacked.len() as u64).saturating_sub(own);
        self.spare = self.spare.saturating_sub(beyond);
        read.map_err(|_| "it does not unpack")?;
        if self.unpacked.len() as u64 > most {
            return Err("it unpacks to more than the limit");
        }
        to.message(channel, 0, time, &self.unpacked);
        Ok(())
    }

    /// The number of the first row, of a leaf whose rows look like messages.
    pub(super) fn first_of(&self, page: &Page<'_>) -> Option<i64> {
        if page.kind != Kind::Leaf {
            return None;
        }
        let cell = (0..page.cells).find_map(|nth| page.cell(nth))?;
        let mut row = Row::of(cell.local)?;
        for nth in 0..self.places.data {
            let is_right = match row.next()? {
                Value::Integer(topic) if nth == self.places.topic => {
                    self.topics.contains_key(&topic)
                }
                Value::Integer(_) => true,
                // The number of the row itself.
                Value::Null => nth == 0,
                _ => false,
            };
            if !is_right {
                return None;
            }
        }
        let is_right = match row.next() {
            Some(value) => value.blob().is_some() && row.is_exact(),
            // It goes on in other pages.
            None => cell.overflow > 0,
        };
        is_right.then_some(cell.rowid)
    }
}
