//! Numbers at known places of a block -> registers. Pure.

use crate::decode::registers::{Registers, Slot};
use crate::decode::schema::Number;

/// `n` numbers in a row and the slots they go to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Read {
    pub(super) at: usize,
    pub(super) number: Number,
    pub(super) slot: Slot,
    pub(super) n: u8,
}

impl Read {
    /// Reads the numbers; those beyond `bytes` stay unseen (the caller has checked the length).
    #[inline]
    pub(super) fn apply<const BIG: bool>(&self, bytes: &[u8], registers: &mut Registers) {
        if self.number == Number::F64 {
            match self.n {
                4 => return self.doubles::<BIG, 4>(bytes, registers),
                3 => return self.doubles::<BIG, 3>(bytes, registers),
                1 => return self.doubles::<BIG, 1>(bytes, registers),
                _ => {}
            }
        }
        for i in 0..self.n {
            let at = self.at + usize::from(i) * self.number.size() as usize;
            let slot = self.slot.plus(i);
            match self.number {
                Number::F64 => {
                    if let Some(b) = bytes_of::<8>(bytes, at) {
                        let v = if BIG {
                            f64::from_be_bytes(b)
                        } else {
                            f64::from_le_bytes(b)
                        };
                        registers.float(slot, v);
                    }
                }
                Number::F32 => {
                    if let Some(b) = bytes_of::<4>(bytes, at) {
                        let v = if BIG {
                            f32::from_be_bytes(b)
                        } else {
                            f32::from_le_bytes(b)
                        };
                        registers.float(slot, f64::from(v));
                    }
                }
                number => {
                    if let Some(v) = integer::<BIG>(number, bytes, at) {
                        registers.integer(slot, v);
                    }
                }
            }
        }
    }
}

impl Read {
    #[inline]
    fn doubles<const BIG: bool, const N: usize>(&self, bytes: &[u8], registers: &mut Registers) {
        let row = bytes.get(self.at..).and_then(|b| b.get(..8 * N));
        let Some(row) = row else { return };
        let mut values = [0.0; N];
        for (value, bytes) in values.iter_mut().zip(row.as_chunks::<8>().0) {
            *value = if BIG {
                f64::from_be_bytes(*bytes)
            } else {
                f64::from_le_bytes(*bytes)
            };
        }
        registers.floats(self.slot, values);
    }
}

/// An integer; an unsigned one beyond `i64` saturates.
#[inline]
fn integer<const BIG: bool>(number: Number, bytes: &[u8], at: usize) -> Option<i64> {
    macro_rules! read {
        ($type:ty, $size:literal) => {{
            let b = bytes_of::<$size>(bytes, at)?;
            if BIG {
                <$type>::from_be_bytes(b)
            } else {
                <$type>::from_le_bytes(b)
            }
        }};
    }
    Some(match number {
        Number::I8 => i64::from(read!(i8, 1)),
        Number::U8 => i64::from(read!(u8, 1)),
        Number::I16 => i64::from(read!(i16, 2)),
        Number::U16 => i64::from(read!(u16, 2)),
        Number::I32 => i64::from(read!(i32, 4)),
        Number::U32 => i64::from(read!(u32, 4)),
        Number::I64 => read!(i64, 8),
        Number::U64 => i64::try_from(read!(u64, 8)).unwrap_or(i64::MAX),
        _ => return None,
    })
}

#[inline]
pub(super) fn bytes_of<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk::<N>().copied()
}
