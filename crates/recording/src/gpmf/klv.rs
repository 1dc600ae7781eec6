//! Bytes -> keys with their values, one in the other. Pure.
//!
//! Apart from what keys mean because their framing is the same at every level.

/// Bytes before a value: key, kind, size of a structure, how many.
pub(crate) const HEAD: usize = 8;

/// A key and its value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item<'a> {
    pub(super) key: [u8; 4],
    /// Kind of its numbers; 0 for items in it.
    pub(super) kind: u8,
    /// Bytes of one structure.
    pub(super) size: usize,
    pub(super) data: &'a [u8],
}

/// Bytes of the item that begins so, with what fills it up to a multiple of four.
pub(crate) fn length(head: &[u8; HEAD]) -> usize {
    let [_, _, _, _, _, size, high, low] = *head;
    let data = usize::from(size) * usize::from(u16::from_be_bytes([high, low]));
    HEAD + data.next_multiple_of(4)
}

/// Offset in `data` at which the next device may begin.
pub(crate) fn next_device(data: &[u8]) -> Option<usize> {
    memchr::memmem::find(data, &super::MAGIC)
}

/// Items one after the other; what cannot be one ends them, and stays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Items<'a>(pub(super) &'a [u8]);

impl<'a> Iterator for Items<'a> {
    type Item = Item<'a>;

    fn next(&mut self) -> Option<Item<'a>> {
        let head = self.0.first_chunk::<HEAD>()?;
        let [a, b, c, d, kind, size, high, low] = *head;
        let key = [a, b, c, d];
        if !key.iter().all(u8::is_ascii_graphic)
            && !key.iter().all(|b| b.is_ascii_alphanumeric() || *b == b' ')
        {
            return None;
        }
        let used = usize::from(size) * usize::from(u16::from_be_bytes([high, low]));
        let data = self.0.get(HEAD..HEAD + used)?;
        // Who writes the last of a stream may leave out what fills it up.
        let end = length(head).min(self.0.len());
        self.0 = self.0.get(end..)?;
        Some(Item {
            key,
            kind,
            size: usize::from(size),
            data,
        })
    }
}

impl<'a> Item<'a> {
    /// The items in it.
    pub(super) fn inner(&self) -> Items<'a> {
        Items(if self.kind == 0 { self.data } else { &[] })
    }

    /// Text.
    pub(super) fn text(&self) -> String {
        let text: String = self.data.iter().map(|b| char::from(*b)).collect();
        text.trim_end_matches('\0').to_owned()
    }

    /// Bytes of one of its numbers; `None` where it has none.
    fn width(&self) -> Option<usize> {
        Some(match self.kind {
            b'b' | b'B' => 1,
            b's' | b'S' => 2,
            b'l' | b'L' | b'f' | b'q' => 4,
            b'd' | b'j' | b'J' | b'Q' => 8,
            _ => return None,
        })
    }

    /// Count of the numbers in a structure of it.
    pub(super) fn columns(&self) -> usize {
        self.width().map_or(0, |width| self.size / width)
    }

    /// Numbers, one after the other.
    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> + use<'a> {
        let (kind, width) = (self.kind, self.width().unwrap_or(1));
        let data = if self.width().is_some() {
            self.data
        } else {
            &[]
        };
        data.chunks_exact(width)
            .map(move |bytes| number(kind, bytes))
    }

    /// Only number, if it is a whole one that is not negative.
    pub(super) fn count(&self) -> Option<u64> {
        match (self.kind, self.data) {
            (b'L', data) => data
                .first_chunk()
                .map(|b| u64::from(u32::from_be_bytes(*b))),
            (b'J', data) => data.first_chunk().map(|b| u64::from_be_bytes(*b)),
            _ => None,
        }
    }
}

fn number(kind: u8, bytes: &[u8]) -> f64 {
    let first = bytes.first().copied().unwrap_or(0);
    let two = bytes.first_chunk().copied().unwrap_or_default();
    let four = bytes.first_chunk().copied().unwrap_or_default();
    let eight = bytes.first_chunk().copied().unwrap_or_default();
    match kind {
        b'b' => f64::from(first.cast_signed()),
        b'B' => f64::from(first),
        b's' => f64::from(i16::from_be_bytes(two)),
        b'S' => f64::from(u16::from_be_bytes(two)),
        b'l' => f64::from(i32::from_be_bytes(four)),
        b'L' => f64::from(u32::from_be_bytes(four)),
        b'f' => f64::from(f32::from_be_bytes(four)),
        b'q' => f64::from(i32::from_be_bytes(four)) / 65_536.0,
        b'd' => f64::from_be_bytes(eight),
        b'j' => i64::from_be_bytes(eight) as f64,
        b'J' => u64::from_be_bytes(eight) as f64,
        _ => i64::from_be_bytes(eight) as f64 / 4_294_967_296.0,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn items_and_numbers_of_every_kind_are_read_and_what_is_cut_ends_them() {
        for (kind, bytes, value) in [
            (b'b', &[0xff][..], -1.0),
            (b'B', &[0xff], 255.0),
            (b's', &[0xff, 0xfe], -2.0),
            (b'S', &[1, 0], 256.0),
            (b'l', &[0xff, 0xff, 0xff, 0xfd], -3.0),
            (b'L', &[0, 1, 0, 0], 65_536.0),
            (b'f', &1.5_f32.to_be_bytes(), 1.5),
            (b'q', &[0, 1, 0x80, 0], 1.5),
            (b'd', &2.5_f64.to_be_bytes(), 2.5),
            (b'j', &(-4_i64).to_be_bytes(), -4.0),
            (b'J', &4_u64.to_be_bytes(), 4.0),
            (b'Q', &[0, 0, 0, 2, 0x80, 0, 0, 0], 2.5),
        ] {
            let mut data = b"ABCD".to_vec();
            data.extend([kind, bytes.len() as u8, 0, 1]);
            data.extend(bytes);
            let item = Items(&data).next().unwrap();
            assert_eq!(item.numbers().collect::<Vec<_>>(), [value]);
            assert_eq!(item.columns(), 1);
            assert!(Items(&data[..data.len() - 1]).next().is_none());
        }
        assert!(Items(b"A\0CDs\x02\0\0").next().is_none());
    }
}
