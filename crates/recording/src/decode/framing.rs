//! Bytes as they come -> lines and packed objects. Pure, sans-I/O.
//!
//! Apart from the sockets because every transport cuts its bytes elsewhere: a line may come in one
//! piece, byte by byte, or with a thousand others. Holds at most one unfinished line, of
//! [`MAX_LINE`] bytes unless more is allowed, or one unfinished packed object, whatever is sent.

use super::MAX_LINE;
use super::packed::{self, HEAD, MARK};
use memchr::memchr;

/// Bytes of an object that show its length.
const SEEN: usize = 4;

/// Frame found in the bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Framed<'a> {
    /// A line with its number, from 1; without line end, not blank.
    Line(u64, &'a [u8]),
    /// A line grew over the limit; the rest of it is skipped. Said once per line, with how it begins.
    TooLong(u64, &'a [u8]),
    /// A packed object with its number, counted with the lines; as long as it says.
    Packed(u64, &'a [u8]),
    /// A packed object that says no length it can have (then the bytes up to the next line end are
    /// skipped), or that the end of the stream cuts short.
    Broken(u64),
}

/// Cuts a stream of bytes into lines and packed objects.
#[derive(Debug)]
pub struct Framer {
    /// Longest line.
    limit: usize,
    /// The beginning of a line, or packed object, whose end has not come.
    partial: Vec<u8>,
    /// Whether the rest of an over-long line, or broken object, is being skipped.
    skipping: bool,
    /// Lines and objects ended so far.
    ended: u64,
}

impl Default for Framer {
    fn default() -> Framer {
        Framer::with_limit(MAX_LINE)
    }
}

impl Framer {
    /// Makes one at the start of a stream.
    #[must_use]
    pub fn new() -> Framer {
        Framer::default()
    }

    /// Makes one at the start of a stream of lines of at most so many bytes, line end not counted.
    #[must_use]
    pub fn with_limit(limit: usize) -> Framer {
        Framer {
            limit,
            partial: Vec::new(),
            skipping: false,
            ended: 0,
        }
    }

    /// Lines and packed objects ended so far, blank, over-long and broken ones included.
    #[must_use]
    pub fn ended(&self) -> u64 {
        self.ended
    }

    /// Takes the next bytes of the stream and hands over what they complete. `take` answers whether
    /// to go on; when it does not, the bytes behind are given back, to be fed again or not.
    pub fn feed<'b>(
        &mut self,
        mut bytes: &'b [u8],
        take: &mut impl FnMut(Framed<'_>) -> bool,
    ) -> &'b [u8] {
        loop {
            let first = self.partial.first().or(bytes.first());
            if first == Some(&MARK) && !self.skipping {
                match self.object(bytes, take) {
                    Some((rest, true)) => bytes = rest,
                    Some((rest, false)) => return rest,
                    None => return &[],
                }
                continue;
            }
            let Some(end) = memchr(b'\n', bytes) else {
                break;
            };
            let (line, rest) = bytes.split_at(end);
            bytes = rest.get(1..).unwrap_or_default();
            let goes_on = if self.partial.is_empty() {
                self.end_line(line, take)
            } else {
                // The line has ended, whether or not there is enough of it.
                let goes_on = self.grow(line, take);
                let whole = std::mem::take(&mut self.partial);
                let goes_on = self.end_line(&whole, take) && goes_on;
                self.partial = whole;
                self.partial.clear();
                goes_on
            };
            if !goes_on {
                return bytes;
            }
        }
        if !bytes.is_empty() {
            let _ = self.grow(bytes, take);
        } else if self.partial.is_empty() {
            // Nothing is held between lines: an idle connection costs no buffer.
            self.partial = Vec::new();
        }
        &[]
    }

    /// The stream, or the datagram, has ended: what is unfinished is a line.
    pub fn finish(&mut self, take: &mut impl FnMut(Framed<'_>) -> bool) {
        let whole = std::mem::take(&mut self.partial);
        if whole.first() == Some(&MARK) {
            self.ended += 1;
            let _ = take(Framed::Broken(self.ended));
        } else if !whole.is_empty() || self.skipping {
            let _ = self.end_line(&whole, take);
        }
    }

    /// Takes what belongs to the packed object that has begun, and hands it over when it is whole. The
    /// rest of the bytes, and whether to go on; `None`: the object is not whole yet.
    fn object<'b>(
        &mut self,
        bytes: &'b [u8],
        take: &mut impl FnMut(Framed<'_>) -> bool,
    ) -> Option<(&'b [u8], bool)> {
        let mut rest = bytes;
        let seen = if self.partial.is_empty() {
            packed::length(bytes)
        } else {
            // Up to the length first: without it nobody knows how much is still to come.
            rest = self.gather(rest, SEEN);
            packed::length(&self.partial)
        };
        let Some(length) = seen else {
            self.gather(rest, SEEN);
            return None;
        };
        if length < HEAD || length > self.limit {
            self.skipping = true;
            // What has shown the length is gone, whatever is in it.
            let seen = SEEN - self.partial.len();
            self.partial = Vec::new();
            let rest = rest.get(seen..).unwrap_or_default();
            return Some((rest, take(Framed::Broken(self.ended + 1))));
        }
        if self.partial.is_empty()
            && let Some((object, rest)) = rest.split_at_checked(length)
        {
            self.ended += 1;
            return Some((rest, take(Framed::Packed(self.ended, object))));
        }
        rest = self.gather(rest, length);
        if self.partial.len() < length {
            return None;
        }
        let whole = std::mem::take(&mut self.partial);
        self.ended += 1;
        let goes_on = take(Framed::Packed(self.ended, &whole));
        self.partial = whole;
        self.partial.clear();
        Some((rest, goes_on))
    }

    /// Adds to what is unfinished until it has so many bytes; gives the rest back.
    fn gather<'b>(&mut self, bytes: &'b [u8], until: usize) -> &'b [u8] {
        let missing = until.saturating_sub(self.partial.len());
        let (more, rest) = bytes.split_at(missing.min(bytes.len()));
        self.partial.extend_from_slice(more);
        rest
    }

    /// Adds to the unfinished line, or gives it up when it grows over the limit. Says whether to go on.
    fn grow(&mut self, more: &[u8], take: &mut impl FnMut(Framed<'_>) -> bool) -> bool {
        if self.skipping {
            return true;
        }
        let room = (self.limit + 1).saturating_sub(self.partial.len());
        self.partial
            .extend_from_slice(more.get(..room.min(more.len())).unwrap_or_default());
        if self.partial.len() <= self.limit {
            return true;
        }
        // One byte more may be the carriage return before the line feed.
        if more.len() <= room && self.partial.last() == Some(&b'\r') {
            return true;
        }
        self.skipping = true;
        let beginning = std::mem::take(&mut self.partial);
        take(Framed::TooLong(self.ended + 1, &beginning))
    }

    fn end_line(&mut self, line: &[u8], take: &mut impl FnMut(Framed<'_>) -> bool) -> bool {
        self.ended += 1;
        if std::mem::take(&mut self.skipping) {
            return true;
        }
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        if line.len() > self.limit {
            return take(Framed::TooLong(self.ended, line));
        }
        if line.iter().all(u8::is_ascii_whitespace) {
            return true;
        }
        take(Framed::Line(self.ended, line))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(PartialEq, Eq, Debug, Clone)]
    enum Seen {
        Line(u64, Vec<u8>),
        TooLong(u64),
        Packed(u64, Vec<u8>),
        Broken(u64),
    }

    impl Seen {
        fn of(framed: Framed<'_>) -> Seen {
            match framed {
                Framed::Line(n, line) => Seen::Line(n, line.to_vec()),
                Framed::TooLong(n, _) => Seen::TooLong(n),
                Framed::Packed(n, object) => Seen::Packed(n, object.to_vec()),
                Framed::Broken(n) => Seen::Broken(n),
            }
        }
    }

    fn collect(framer: &mut Framer, pieces: impl Iterator<Item = Vec<u8>>) -> Vec<Seen> {
        let mut seen = Vec::new();
        let mut take = |framed: Framed<'_>| {
            seen.push(Seen::of(framed));
            true
        };
        for piece in pieces {
            framer.feed(&piece, &mut take);
            assert!(framer.partial.len() <= MAX_LINE + 1);
        }
        framer.finish(&mut take);
        seen
    }

    fn in_pieces(bytes: &[u8], size: usize) -> Vec<Seen> {
        let pieces: Vec<Vec<u8>> = bytes.chunks(size).map(<[u8]>::to_vec).collect();
        collect(&mut Framer::new(), pieces.into_iter())
    }

    #[test]
    fn lines_do_not_depend_on_how_the_bytes_were_cut() {
        let mut bytes = b"one\r\n\n  \r\ntwo\nthree\r\r\n".to_vec();
        bytes.extend(std::iter::repeat_n(b'x', MAX_LINE));
        bytes.extend_from_slice(b"\r\n");
        bytes.extend(std::iter::repeat_n(b'y', MAX_LINE + 1));
        bytes.extend_from_slice(b"\nafter\nunfinished");
        let whole = in_pieces(&bytes, bytes.len());
        assert_eq!(
            whole,
            [
                Seen::Line(1, b"one".to_vec()),
                Seen::Line(4, b"two".to_vec()),
                Seen::Line(5, b"three\r".to_vec()),
                Seen::Line(6, vec![b'x'; MAX_LINE]),
                Seen::TooLong(7),
                Seen::Line(8, b"after".to_vec()),
                Seen::Line(9, b"unfinished".to_vec()),
            ]
        );
        for size in [1, 2, 3, 7, 4096, MAX_LINE, MAX_LINE + 1, MAX_LINE + 2] {
            assert!(in_pieces(&bytes, size) == whole, "pieces of {size}");
        }
    }

    /// An object of this length, full of line ends and marks.
    fn object(length: u16) -> Vec<u8> {
        let [low, high] = length.to_le_bytes();
        let body = [b'\n', MARK].into_iter().cycle();
        [MARK, 1, low, high]
            .into_iter()
            .chain(body)
            .take(usize::from(length).max(4))
            .collect()
    }

    #[test]
    fn packed_objects_do_not_depend_on_how_the_bytes_were_cut() {
        let mut bytes = [object(8), object(48)].concat();
        bytes.extend_from_slice(b"one\n  \xf8 in a line\n");
        bytes.extend(object(u16::MAX));
        bytes.extend_from_slice(b"\n");
        bytes.extend_from_slice(b"\xf8\x01\x07\0skipped \xf8\x01\x08\0\ntwo\n");
        // A length that holds a line end, and is none.
        bytes.extend_from_slice(b"\xf8\n\0\0\xf8\x01\x08\0....\n");
        // The line end at once, and the object after it is whole.
        bytes.extend_from_slice(b"\xf8\x01\0\0\n");
        bytes.extend(object(72));
        bytes.extend_from_slice(b"\xf8\x01\x48");
        let whole = in_pieces(&bytes, bytes.len());
        assert_eq!(
            whole,
            [
                Seen::Packed(1, object(8)),
                Seen::Packed(2, object(48)),
                Seen::Line(3, b"one".to_vec()),
                Seen::Line(4, b"  \xf8 in a line".to_vec()),
                Seen::Packed(5, object(u16::MAX)),
                Seen::Broken(7),
                Seen::Line(8, b"two".to_vec()),
                Seen::Broken(9),
                Seen::Broken(10),
                Seen::Packed(11, object(72)),
                Seen::Broken(12),
            ]
        );
        for size in [1, 2, 3, 4, 5, 7, 47, 48, 49, 4096, 65_534, 65_535, 65_536] {
            assert!(in_pieces(&bytes, size) == whole, "pieces of {size}");
        }
    }

    #[test]
    fn of_packed_objects_no_more_than_one_is_held_and_none_between_them() {
        let mut framer = Framer::new();
        let mut bytes = object(60_000).repeat(20);
        bytes.truncate(bytes.len() - 1);
        let mut seen = 0;
        for piece in bytes.chunks(1000) {
            framer.feed(piece, &mut |_| {
                seen += 1;
                true
            });
            assert!(framer.partial.len() < 60_000);
        }
        assert_eq!(seen, 19);
        framer.feed(&[0], &mut |_| true);
        assert_eq!((framer.partial.capacity(), framer.ended()), (0, 20));
        // One that cannot be is given up without waiting for anything.
        framer.feed(b"\xf8\x01\x07\0", &mut |framed| {
            framed == Framed::Broken(21)
        });
        framer.feed(&[b'x'; 1000], &mut |_| unreachable!("skipped"));
        assert_eq!(framer.partial.capacity(), 0);
    }

    #[test]
    fn a_line_without_end_is_reported_once_and_holds_no_memory() {
        let mut framer = Framer::new();
        let seen = collect(&mut framer, (0..1000).map(|_| vec![b'a'; 10_000]));
        assert_eq!(seen, [Seen::TooLong(1)]);
        assert_eq!(framer.partial.capacity(), 0);
    }

    #[test]
    fn between_lines_nothing_is_held() {
        let mut framer = Framer::new();
        let mut take = |_: Framed<'_>| true;
        framer.feed(b"a half", &mut take);
        framer.feed(b" line\n", &mut take);
        assert_eq!(framer.partial.capacity(), 0);
        assert_eq!(framer.ended(), 1);
    }

    #[test]
    fn who_stops_after_each_and_feeds_what_comes_back_gets_the_same() {
        let mut bytes = b"a\n\nb\r\nc\n".to_vec();
        bytes.extend(object(40));
        bytes.extend(vec![b'x'; MAX_LINE + 2]);
        bytes.extend(b"\nd\n\xf8\x01\x07\0broken\ne\n");
        bytes.extend(object(9));
        bytes.extend(b"f");
        let expected = in_pieces(&bytes, bytes.len());
        for size in [1, 7, 1000, MAX_LINE + 100, bytes.len()] {
            let mut framer = Framer::new();
            let mut seen = Vec::new();
            let mut enough = |framed: Framed<'_>| {
                seen.push(Seen::of(framed));
                false
            };
            for piece in bytes.chunks(size) {
                let mut rest = framer.feed(piece, &mut enough);
                while !rest.is_empty() {
                    rest = framer.feed(rest, &mut enough);
                }
            }
            framer.finish(&mut enough);
            assert_eq!(seen, expected, "in pieces of {size}");
        }
    }
}
