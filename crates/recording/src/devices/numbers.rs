//! Bytes at a place -> a number in either order of bytes. Pure.
//!
//! Apart from the protocols so that none of them indexes into outside data: a number that does not fit is `None`.

/// Bytes at a place.
pub(super) fn array<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

/// Three numbers, `size` bytes apart.
pub(super) fn three(
    at: usize,
    size: usize,
    number: impl Fn(usize) -> Option<f64>,
) -> Option<[f64; 3]> {
    Some([number(at)?, number(at + size)?, number(at + 2 * size)?])
}

/// Three f32, the least significant byte first.
pub(super) fn f32_le(bytes: &[u8], at: usize) -> Option<[f64; 3]> {
    three(at, 4, |at| {
        Some(f64::from(f32::from_le_bytes(array(bytes, at)?)))
    })
}

/// Three f32, the most significant byte first.
pub(super) fn f32_be(bytes: &[u8], at: usize) -> Option<[f64; 3]> {
    three(at, 4, |at| {
        Some(f64::from(f32::from_be_bytes(array(bytes, at)?)))
    })
}

/// Four f32 in an order of bytes.
pub(super) fn four(bytes: &[u8], at: usize, number: impl Fn([u8; 4]) -> f32) -> Option<[f64; 4]> {
    let one = |at| array(bytes, at).map(|four| f64::from(number(four)));
    let [b, c, d] = three(at + 4, 4, one)?;
    Some([one(at)?, b, c, d])
}

/// Three i16, the least significant byte first.
pub(super) fn i16_le(bytes: &[u8], at: usize) -> Option<[f64; 3]> {
    three(at, 2, |at| {
        Some(f64::from(i16::from_le_bytes(array(bytes, at)?)))
    })
}

/// Standard gravity, m/s^2, of which makers' g are.
pub(super) const G: f64 = 9.806_65;

/// Vector in another unit.
pub(super) fn scaled(vector: [f64; 3], unit: f64) -> [f64; 3] {
    vector.map(|value| value * unit)
}
