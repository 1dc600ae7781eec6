//! The first hundred bytes of a database -> how it lies. Pure.
//!
//! Apart because nothing else of a database can be found without it.

use super::MAGIC;

/// Bytes of it.
pub(crate) const HEADER: usize = 100;

/// Least bytes of a page that may be used, by the format.
const LEAST_USABLE: u32 = 480;

/// Encoding of texts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Encoding {
    Utf8,
    Utf16Little,
    Utf16Big,
}

/// Fields asked of the header.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Header {
    /// Bytes of a page: a power of two, 512 to 65,536.
    pub(crate) page_size: u32,
    /// Bytes of a page that hold cells.
    pub(crate) usable: u32,
    /// Number of pages, where the last writer knew to state it.
    pub(crate) pages: Option<u32>,
    /// The first page of the list of those that are free; 0 for none.
    pub(crate) free: u32,
    pub(crate) encoding: Encoding,
}

impl Header {
    /// Reads it.
    ///
    /// # Errors
    /// Why it cannot be used, in words.
    pub(crate) fn parse(bytes: &[u8]) -> Result<Header, &'static str> {
        let (Some(head), true) = (bytes.first_chunk::<HEADER>(), bytes.starts_with(&MAGIC)) else {
            return Err("the header is cut");
        };
        let byte = |at: usize| head.get(at).copied().unwrap_or(0);
        let word = |at: usize| {
            let bytes = head.get(at..).and_then(<[u8]>::first_chunk);
            bytes.map_or(0, |bytes| u32::from_be_bytes(*bytes))
        };
        let page_size = match u32::from(byte(16)) << 8 | u32::from(byte(17)) {
            1 => 65_536,
            size if size >= 512 && size.is_power_of_two() => size,
            _ => return Err("the size of a page in its header is none"),
        };
        let usable = page_size - u32::from(byte(20));
        if usable < LEAST_USABLE {
            return Err("its header reserves too much of each page");
        }
        let is_said = word(24) == word(92);
        Ok(Header {
            page_size,
            usable,
            pages: Some(word(28)).filter(|pages| is_said && *pages > 0),
            free: word(32),
            encoding: match word(56) {
                2 => Encoding::Utf16Little,
                3 => Encoding::Utf16Big,
                // A database without tables says nothing; what else it may say is damage.
                _ => Encoding::Utf8,
            },
        })
    }
}

impl Encoding {
    /// A text of the database; what is no character is replaced.
    pub(crate) fn text(self, bytes: &[u8]) -> String {
        let unit = match self {
            Encoding::Utf8 => return String::from_utf8_lossy(bytes).into_owned(),
            Encoding::Utf16Little => u16::from_le_bytes,
            Encoding::Utf16Big => u16::from_be_bytes,
        };
        let (pairs, _) = bytes.as_chunks::<2>();
        char::decode_utf16(pairs.iter().map(|pair| unit(*pair)))
            .map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn header(change: impl FnOnce(&mut [u8])) -> Result<Header, &'static str> {
        let mut bytes = vec![0; HEADER];
        bytes[..16].copy_from_slice(&MAGIC);
        bytes[16] = 0x10;
        bytes[31] = 7;
        bytes[59] = 1;
        change(&mut bytes);
        Header::parse(&bytes)
    }

    #[test]
    fn sizes_are_believed_only_where_the_format_allows_them() {
        assert_eq!(header(|_| ()).unwrap().page_size, 4096);
        assert_eq!(header(|_| ()).unwrap().pages, Some(7));
        let largest = header(|b| (b[16], b[17]) = (0, 1)).unwrap();
        assert_eq!(largest.page_size, 65_536);
        for (high, low) in [(0, 0), (1, 0), (0x10, 1), (0x18, 0)] {
            assert!(header(|b| (b[16], b[17]) = (high, low)).is_err());
        }
        assert!(header(|b| (b[16], b[20]) = (2, 33)).is_err());
        assert_eq!(header(|b| (b[16], b[20]) = (2, 32)).unwrap().usable, 480);
        // A writer that does not know of the count leaves an old one behind.
        assert_eq!(header(|b| b[27] = 1).unwrap().pages, None);
    }

    #[test]
    fn texts_of_all_three_encodings_are_read() {
        assert_eq!(Encoding::Utf8.text(b"/imu"), "/imu");
        assert_eq!(Encoding::Utf16Little.text(b"/\0i\0"), "/i");
        assert_eq!(Encoding::Utf16Big.text(b"\0/\0i"), "/i");
        assert_eq!(Encoding::Utf16Big.text(b"\xd8\0"), "\u{fffd}");
    }
}
