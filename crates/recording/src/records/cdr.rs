//! Values -> CDR as ROS 2 has it: version 1, little-endian, items aligned to their size, counted from behind the four
//! bytes of the encapsulation. Pure.

/// Message that is written.
#[derive(Debug)]
pub struct Cdr {
    bytes: Vec<u8>,
}

impl Default for Cdr {
    fn default() -> Self {
        Cdr::within(Vec::new())
    }
}

impl Cdr {
    /// Begins a message in the memory of another, whose bytes are dropped.
    #[must_use]
    pub fn within(mut bytes: Vec<u8>) -> Cdr {
        bytes.clear();
        bytes.extend([0, 1, 0, 0]);
        Cdr { bytes }
    }

    fn align(&mut self, to: usize) {
        let length = (self.bytes.len() - 4).next_multiple_of(to) + 4;
        self.bytes.resize(length, 0);
    }

    /// Writes a number.
    pub fn u32(&mut self, v: u32) {
        self.align(4);
        self.bytes.extend_from_slice(&v.to_le_bytes());
    }

    /// Writes a text; its length counts the closing NUL.
    pub fn string(&mut self, v: &str) {
        self.u32(v.len() as u32 + 1);
        self.bytes.extend_from_slice(v.as_bytes());
        self.bytes.push(0);
    }

    /// Writes `count` zeros of `size` bytes each; returns the place of the first.
    fn zeros(&mut self, count: usize, size: usize) -> usize {
        self.align(size);
        let at = self.bytes.len();
        self.bytes.resize(at + size * count, 0);
        at
    }

    /// Leaves room for seconds and nanoseconds; returns the place of it.
    pub fn stamp(&mut self) -> usize {
        self.zeros(2, 4)
    }

    /// Leaves room for `count` f64, which are zeros; returns the place of the first.
    pub fn numbers(&mut self, count: usize) -> usize {
        self.zeros(count, 8)
    }

    /// The bytes.
    #[must_use]
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

/// Begins a message in place of what is in `out`: a header with a stamp in ns, then `count` zeros; returns the place of
/// the first.
pub(crate) fn stamped(out: &mut Vec<u8>, (time, frame): (u64, &str), count: usize) -> usize {
    let mut cdr = Cdr::within(std::mem::take(out));
    let stamp = cdr.stamp();
    cdr.string(frame);
    let numbers = cdr.numbers(count);
    *out = cdr.into_bytes();
    let secs = i32::try_from(time / 1_000_000_000).unwrap_or(i32::MAX);
    let nanos = (time % 1_000_000_000) as u32;
    if let Some(place) = out.get_mut(stamp..stamp + 8) {
        place[..4].copy_from_slice(&secs.to_le_bytes());
        place[4..].copy_from_slice(&nanos.to_le_bytes());
    }
    numbers
}

/// Writes `v` as f64 from number `at` on.
pub fn put<const N: usize>(numbers: &mut [u8], at: usize, v: [f64; N]) {
    let places = numbers.get_mut(8 * at..).unwrap_or_default();
    for (place, value) in places.chunks_exact_mut(8).zip(v) {
        place.copy_from_slice(&value.to_le_bytes());
    }
}
