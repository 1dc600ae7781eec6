//! A slice -> little-endian fields. Pure.
//!
//! A stage of its own so that no other file of the reader indexes into outside data:
//! every read here either fits or is `None`.

/// A read position in a byte slice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    pub(crate) fn new(data: &'a [u8]) -> Self {
        Bytes(data)
    }

    pub(crate) fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(head)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*head)
    }

    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|[b]| b)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// Bytes with a `u32` length before them.
    pub(crate) fn blob(&mut self) -> Option<&'a [u8]> {
        let n = usize::try_from(self.u32()?).ok()?;
        self.take(n)
    }

    /// Bytes with a `u64` length before them.
    pub(crate) fn long_blob(&mut self) -> Option<&'a [u8]> {
        let n = usize::try_from(self.u64()?).ok()?;
        self.take(n)
    }

    /// UTF-8 with a `u32` length before it.
    pub(crate) fn text(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.blob()?).ok()
    }

    /// The entries of a map or array: a `u32` length in bytes, then entries up to exactly there.
    pub(crate) fn entries<T>(
        &mut self,
        mut entry: impl FnMut(&mut Bytes<'a>) -> Option<T>,
    ) -> Option<Vec<T>> {
        let mut inner = Bytes(self.blob()?);
        let mut out = Vec::new();
        while !inner.0.is_empty() {
            out.push(entry(&mut inner)?);
        }
        Some(out)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn rest(self) -> &'a [u8] {
        self.0
    }
}

/// The nine bytes before every record: opcode and length of the body.
pub const HEAD: usize = 9;

/// Opcode and body length of the record at `at`, or `None` where fewer than nine bytes are left.
#[inline]
pub(crate) fn head_at(data: &[u8], at: usize) -> Option<(u8, u64)> {
    let head = data.get(at..)?.first_chunk::<HEAD>()?;
    let [opcode, length @ ..] = *head;
    Some((opcode, u64::from_le_bytes(length)))
}
