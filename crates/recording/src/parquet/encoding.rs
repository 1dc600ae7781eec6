//! The values of a page -> numbers. Pure.
//!
//! Apart from the pages because this is arithmetic on bits: each encoding is told how many values there have to be,
//! and gives as many or says why not.
//!
//! # Source
//! apache/parquet-format, `Encodings.md`.

use super::footer::Stored;

/// The values of a page or a dictionary.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Values {
    Whole(Vec<i64>),
    Float(Vec<f32>),
    Double(Vec<f64>),
    Text(Vec<Vec<u8>>),
}

/// Bytes of the texts of a page.
const MOST_TEXT: usize = 64 << 20;
/// Values of a block of differences.
const MOST_BLOCK: u64 = 1 << 16;
/// Days from the day that days of INT96 are counted from to 1970.
const JULIAN_1970: i64 = 2_440_588;
const DAY_NANOS: i64 = 86_400_000_000_000;

const SHORT: &str = "its values end too early";

/// Bytes being read.
pub(super) struct Bytes<'b>(pub(super) &'b [u8]);

impl<'b> Bytes<'b> {
    pub(super) fn take(&mut self, count: usize) -> Result<&'b [u8], String> {
        let (now, rest) = self.0.split_at_checked(count).ok_or(SHORT)?;
        self.0 = rest;
        Ok(now)
    }

    pub(super) fn four(&mut self) -> Result<usize, String> {
        let bytes = self.take(4)?.try_into().map_err(|_| SHORT)?;
        Ok(u32::from_le_bytes(bytes) as usize)
    }

    fn varint(&mut self) -> Result<u64, String> {
        let mut value = 0u64;
        for shift in (0..64).step_by(7) {
            let byte = self.take(1)?.first().copied().unwrap_or_default();
            value |= u64::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(value);
            }
        }
        Err("a number of more than 64 bits".to_owned())
    }

    fn zigzag(&mut self) -> Result<i64, String> {
        let coded = self.varint()?;
        Ok((coded >> 1) as i64 ^ -((coded & 1) as i64))
    }
}

impl Stored {
    /// Bytes of a value, where all have as many.
    fn width(self) -> Option<usize> {
        match self {
            Stored::Int32 | Stored::Float => Some(4),
            Stored::Int64 | Stored::Double => Some(8),
            Stored::Int96 => Some(12),
            Stored::Boolean | Stored::Bytes | Stored::Fixed(_) => None,
        }
    }
}

/// Values as they are, or their bytes apart.
pub(super) fn plain(
    stored: Stored,
    is_split: bool,
    bytes: &[u8],
    n: usize,
) -> Result<Values, String> {
    if stored == Stored::Bytes && !is_split {
        let mut rest = Bytes(bytes);
        let each = (0..n).map(|_| {
            let length = rest.four()?;
            rest.take(length).map(<[u8]>::to_vec)
        });
        return each.collect::<Result<_, _>>().map(Values::Text);
    }
    let width = stored.width().ok_or("values of a type that is not read")?;
    let bytes = bytes.get(..n * width).ok_or(SHORT)?;
    let gathered: Vec<u8>;
    let bytes = match is_split {
        true => {
            gathered = (0..n * width)
                .map(|at| {
                    bytes
                        .get(at % width * n + at / width)
                        .copied()
                        .unwrap_or_default()
                })
                .collect();
            &gathered
        }
        false => bytes,
    };
    let four = bytes.as_chunks::<4>().0.iter();
    let eight = bytes.as_chunks::<8>().0.iter();
    Ok(match stored {
        Stored::Int32 => Values::Whole(four.map(|b| i64::from(i32::from_le_bytes(*b))).collect()),
        Stored::Float => Values::Float(four.map(|b| f32::from_le_bytes(*b)).collect()),
        Stored::Int64 => Values::Whole(eight.map(|b| i64::from_le_bytes(*b)).collect()),
        Stored::Double => Values::Double(eight.map(|b| f64::from_le_bytes(*b)).collect()),
        _ => Values::Whole(bytes.as_chunks::<12>().0.iter().map(of_days).collect()),
    })
}

fn of_days(bytes: &[u8; 12]) -> i64 {
    let [a, b, c, d, e, f, g, h, day @ ..] = *bytes;
    let nanos = i64::from_le_bytes([a, b, c, d, e, f, g, h]);
    let days = i64::from(u32::from_le_bytes(day)) - JULIAN_1970;
    days.saturating_mul(DAY_NANOS).saturating_add(nanos)
}

/// Numbers of `width` bits in runs and groups of eight.
pub(super) fn runs(bytes: &[u8], width: u32, n: usize) -> Result<Vec<u32>, String> {
    if width > 32 {
        return Err(format!("numbers of {width} bits"));
    }
    let mut rest = Bytes(bytes);
    let mut all = Vec::with_capacity(n);
    while all.len() < n {
        let head = rest.varint()?;
        let left = n - all.len();
        let count = usize::try_from(head >> 1).unwrap_or(usize::MAX);
        if head & 1 == 0 {
            let value = rest.take(width.div_ceil(8) as usize)?;
            let value = value
                .iter()
                .rev()
                .fold(0u32, |sum, b| sum << 8 | u32::from(*b));
            if count == 0 {
                return Err("a run of nothing".to_owned());
            }
            all.resize(all.len() + count.min(left), value);
        } else {
            let groups = count.min(left.div_ceil(8));
            if groups == 0 {
                return Err("a run of nothing".to_owned());
            }
            let packed = rest.take(groups * width as usize)?;
            let mut bits = Bits::new(packed);
            all.extend((0..left.min(groups * 8)).map(|_| bits.next(width) as u32));
        }
    }
    Ok(all)
}

/// Bits, the lowest first.
struct Bits<'b> {
    bytes: std::slice::Iter<'b, u8>,
    held: u128,
    have: u32,
}

impl<'b> Bits<'b> {
    fn new(bytes: &'b [u8]) -> Bits<'b> {
        Bits {
            bytes: bytes.iter(),
            held: 0,
            have: 0,
        }
    }

    /// The next number of at most 64 bits; what is not there is zero.
    fn next(&mut self, width: u32) -> u64 {
        while self.have < width {
            let byte = self.bytes.next().copied().unwrap_or_default();
            self.held |= u128::from(byte) << self.have;
            self.have += 8;
        }
        let value = self.held & ((1u128 << width) - 1);
        self.held >>= width;
        self.have -= width;
        value as u64
    }
}

/// Whole numbers by their differences; of those that have 32 bits the sums wrap there.
pub(super) fn differences(
    bytes: &mut Bytes<'_>,
    stored: Stored,
    n: usize,
) -> Result<Vec<i64>, String> {
    let wrap = |value: i64| match stored {
        Stored::Int32 => i64::from(value as i32),
        _ => value,
    };
    let wrong = "blocks of differences that cannot be";
    let (block, parts) = (bytes.varint()?, bytes.varint()?);
    let (total, mut value) = (bytes.varint()?, bytes.zigzag()?);
    if block == 0
        || block > MOST_BLOCK
        || parts == 0
        || parts > block
        || !block.is_multiple_of(parts)
    {
        return Err(wrong.to_owned());
    }
    let each = (block / parts) as usize;
    if !each.is_multiple_of(8) || total < n as u64 {
        return Err(wrong.to_owned());
    }
    let mut all = Vec::with_capacity(n);
    if n > 0 {
        all.push(wrap(value));
    }
    while all.len() < n {
        let least = bytes.zigzag()?;
        let widths = bytes.take(parts as usize)?;
        for width in widths {
            if all.len() == n {
                break;
            }
            if *width > 64 {
                return Err(wrong.to_owned());
            }
            let packed = bytes.take(each / 8 * usize::from(*width))?;
            let mut bits = Bits::new(packed);
            for _ in 0..each.min(n - all.len()) {
                let step = bits.next(u32::from(*width)) as i64;
                value = wrap(value.wrapping_add(least).wrapping_add(step));
                all.push(value);
            }
        }
    }
    Ok(all)
}

/// Texts: their lengths by differences, then they; where `is_after` is, each begins like the one before.
pub(super) fn texts(bytes: &[u8], is_after: bool, n: usize) -> Result<Values, String> {
    let mut rest = Bytes(bytes);
    let alike = match is_after {
        true => differences(&mut rest, Stored::Int32, n)?,
        false => vec![0; n],
    };
    let lengths = differences(&mut rest, Stored::Int32, n)?;
    let (mut all, mut sum): (Vec<Vec<u8>>, usize) = (Vec::with_capacity(n), 0);
    for (alike, length) in alike.into_iter().zip(lengths) {
        let wrong = |_| "a text of no length".to_owned();
        let (alike, length) = (
            usize::try_from(alike).map_err(wrong)?,
            usize::try_from(length).map_err(wrong)?,
        );
        let before = all.last().map_or(&[][..], Vec::as_slice);
        let mut text = before.get(..alike).ok_or(SHORT)?.to_vec();
        text.extend_from_slice(rest.take(length)?);
        sum += text.len();
        if sum > MOST_TEXT {
            return Err(format!("texts of more than {MOST_TEXT} bytes"));
        }
        all.push(text);
    }
    Ok(Values::Text(all))
}

impl Values {
    /// Bytes of memory that they take.
    pub(super) fn size(&self) -> u64 {
        (match self {
            Values::Whole(all) => all.len() * 8,
            Values::Float(all) => all.len() * 4,
            Values::Double(all) => all.len() * 8,
            Values::Text(all) => all.iter().map(|text| text.len() + 48).sum(),
        }) as u64
    }

    /// Values at the indices.
    pub(super) fn at(&self, places: &[u32]) -> Result<Values, String> {
        fn picked<T: Clone>(all: &[T], places: &[u32]) -> Result<Vec<T>, String> {
            let each = places.iter().map(|place| all.get(*place as usize).cloned());
            let found: Option<Vec<T>> = each.collect();
            found.ok_or_else(|| "a value that is not in its dictionary".to_owned())
        }
        Ok(match self {
            Values::Whole(all) => Values::Whole(picked(all, places)?),
            Values::Float(all) => Values::Float(picked(all, places)?),
            Values::Double(all) => Values::Double(picked(all, places)?),
            Values::Text(all) => {
                let length = |place: &u32| all.get(*place as usize).map_or(0, Vec::len);
                if places.iter().map(length).sum::<usize>() > MOST_TEXT {
                    return Err(format!("texts of more than {MOST_TEXT} bytes"));
                }
                Values::Text(picked(all, places)?)
            }
        })
    }
}
