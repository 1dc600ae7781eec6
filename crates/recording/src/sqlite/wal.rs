//! The file `-wal` beside a database -> the pages in it that are committed. Pure.
//!
//! Apart because a recorder that was killed leaves its last messages there: SQLite writes pages to that file first, and
//! later into the database. A frame counts where its checksum continues that of all before it, and one that ends a
//! transaction follows.

/// Bytes of the head of the file, and of each frame.
pub(crate) const HEAD: usize = 32;
pub(crate) const FRAME: usize = 24;

/// A file under way.
#[derive(Clone, Debug)]
pub(crate) struct Wal {
    pub(crate) page_size: u32,
    is_big: bool,
    salts: [u8; 8],
    sums: (u32, u32),
}

/// A frame that continues those before it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Frame {
    pub(crate) page: u32,
    /// Pages of the whole database, where the frame ends a transaction.
    pub(crate) commits: Option<u32>,
}

/// Why a frame is none.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum NoFrame {
    /// Frame of an earlier use of the file: what follows is, too.
    Old,
    /// Frame that belongs here, and is not what was written.
    Damaged,
}

fn word(bytes: &[u8], at: usize) -> u32 {
    let bytes = bytes.get(at..).and_then(<[u8]>::first_chunk);
    bytes.map_or(0, |bytes| u32::from_be_bytes(*bytes))
}

impl Wal {
    /// Reads the head.
    ///
    /// # Errors
    /// Why it cannot be used, in words.
    pub(crate) fn parse(bytes: &[u8]) -> Result<Wal, &'static str> {
        let head = bytes.get(..HEAD).ok_or("its header is cut")?;
        let is_big = match word(head, 0) {
            0x377f_0682 => false,
            0x377f_0683 => true,
            _ => return Err("its header is none"),
        };
        let mut wal = Wal {
            page_size: word(head, 8),
            is_big,
            salts: [0; 8],
            sums: (0, 0),
        };
        wal.add(head.get(..24).unwrap_or(&[]));
        if wal.sums != (word(head, 24), word(head, 28)) {
            return Err("the checksum of its header is wrong");
        }
        if let Some(salts) = head.get(16..).and_then(<[u8]>::first_chunk) {
            wal.salts = *salts;
        }
        Ok(wal)
    }

    /// The next frame: its head and the page in it.
    ///
    /// # Errors
    /// It is none, and none follow.
    pub(crate) fn frame(&mut self, head: &[u8], page: &[u8]) -> Result<Frame, NoFrame> {
        if head.get(8..16) != Some(&self.salts) {
            return Err(NoFrame::Old);
        }
        self.add(head.get(..8).unwrap_or(&[]));
        self.add(page);
        if self.sums != (word(head, 16), word(head, 20)) || word(head, 0) == 0 {
            return Err(NoFrame::Damaged);
        }
        let pages = word(head, 4);
        Ok(Frame {
            page: word(head, 0),
            commits: (pages > 0).then_some(pages),
        })
    }

    /// Continues the checksum; lengths are multiples of eight.
    fn add(&mut self, bytes: &[u8]) {
        let (mut first, mut second) = self.sums;
        let number = |bytes: [u8; 4]| match self.is_big {
            true => u32::from_be_bytes(bytes),
            false => u32::from_le_bytes(bytes),
        };
        for [a, b, c, d, e, f, g, h] in bytes.as_chunks::<8>().0 {
            first = first
                .wrapping_add(number([*a, *b, *c, *d]))
                .wrapping_add(second);
            second = second
                .wrapping_add(number([*e, *f, *g, *h]))
                .wrapping_add(first);
        }
        self.sums = (first, second);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_head_counts_only_with_its_checksum_and_a_frame_only_with_the_salts_of_the_head() {
        let mut head = vec![0x37, 0x7f, 0x06, 0x82, 0, 0x2d, 0xe2, 0x18, 0, 0, 0x10, 0];
        head.resize(HEAD, 7);
        assert!(Wal::parse(&head).is_err());
        let mut sums = Wal {
            page_size: 0,
            is_big: false,
            salts: [0; 8],
            sums: (0, 0),
        };
        sums.add(&head[..24]);
        head[24..28].copy_from_slice(&sums.sums.0.to_be_bytes());
        head[28..].copy_from_slice(&sums.sums.1.to_be_bytes());
        let mut wal = Wal::parse(&head).unwrap();
        assert_eq!(wal.page_size, 4096);
        let frame = [0; FRAME];
        assert_eq!(wal.frame(&frame, &[0; 512]), Err(NoFrame::Old));
        let frame = [7; FRAME];
        assert_eq!(wal.frame(&frame, &[0; 512]), Err(NoFrame::Damaged));
        assert!(Wal::parse(&head[..31]).is_err());
    }
}
