//! An FMT -> how the messages of a type lie. Pure.
//!
//! Apart from the walk because it is judged once, and the length of every message hangs on it.

/// Bytes of an FMT with its head.
pub(super) const OWN_LENGTH: usize = 89;
/// Bytes before each message's values: marks and type.
pub(super) const HEAD: usize = 3;

/// Form in which a value is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
    /// Text, an array, or a half: none that is read.
    Other,
}

/// A column: its name, place, form, and the factor of its numbers.
#[derive(Clone, PartialEq, Debug)]
struct Column {
    name: String,
    at: usize,
    kind: Kind,
    factor: f64,
}

/// Layout of the messages of a type.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Layout {
    pub(super) name: String,
    /// Bytes of a message with its head.
    pub(super) length: usize,
    columns: Vec<Column>,
}

/// Size, form and factor of a letter; `None`: no letter of the format.
fn letter(letter: u8) -> Option<(usize, Kind, f64)> {
    Some(match letter {
        b'b' => (1, Kind::I8, 1.0),
        b'B' | b'M' => (1, Kind::U8, 1.0),
        b'h' => (2, Kind::I16, 1.0),
        b'H' => (2, Kind::U16, 1.0),
        b'c' => (2, Kind::I16, 0.01),
        b'C' => (2, Kind::U16, 0.01),
        b'g' => (2, Kind::Other, 1.0),
        b'i' => (4, Kind::I32, 1.0),
        b'I' => (4, Kind::U32, 1.0),
        b'e' => (4, Kind::I32, 0.01),
        b'E' => (4, Kind::U32, 0.01),
        b'L' => (4, Kind::I32, 1e-7),
        b'f' => (4, Kind::F32, 1.0),
        b'n' => (4, Kind::Other, 1.0),
        b'd' => (8, Kind::F64, 1.0),
        b'q' => (8, Kind::I64, 1.0),
        b'Q' => (8, Kind::U64, 1.0),
        b'N' => (16, Kind::Other, 1.0),
        b'a' | b'Z' => (64, Kind::Other, 1.0),
        _ => return None,
    })
}

/// A text with zeros behind it.
fn text(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().position(|byte| *byte == 0);
    bytes.get(..end.unwrap_or(bytes.len())).unwrap_or(bytes)
}

impl Layout {
    /// The layout of FMT itself, which is known.
    pub(super) fn own() -> Layout {
        Layout {
            name: "FMT".to_owned(),
            length: OWN_LENGTH,
            columns: Vec::new(),
        }
    }

    /// Reads the values of an FMT: the type it is of, and its layout; `None` where its letters and its length do not agree.
    pub(super) fn parse(values: &[u8]) -> Option<(u8, Layout)> {
        let (of, rest) = values.split_first()?;
        let (length, rest) = rest.split_first()?;
        let (name, rest) = rest.split_at_checked(4)?;
        let (letters, names) = rest.split_at_checked(16)?;
        let length = usize::from(*length);
        let mut names = text(names).split(|byte| *byte == b',');
        let (mut at, mut columns) = (HEAD, Vec::new());
        for byte in text(letters) {
            let (size, kind, factor) = letter(*byte)?;
            let name = names.next().unwrap_or_default();
            columns.push(Column {
                name: String::from_utf8_lossy(name).into_owned(),
                at,
                kind,
                factor,
            });
            at += size;
        }
        let layout = Layout {
            name: String::from_utf8_lossy(text(name)).into_owned(),
            length,
            columns,
        };
        (at == length).then_some((*of, layout))
    }

    /// The number in a column of a whole message, by the column's name.
    pub(super) fn number(&self, message: &[u8], name: &str) -> Option<f64> {
        let column = self.columns.iter().find(|column| column.name == name)?;
        let rest = message.get(column.at..)?;
        let number = match column.kind {
            Kind::I8 => f64::from(rest.first()?.cast_signed()),
            Kind::U8 => f64::from(*rest.first()?),
            Kind::I16 => f64::from(i16::from_le_bytes(*rest.first_chunk()?)),
            Kind::U16 => f64::from(u16::from_le_bytes(*rest.first_chunk()?)),
            Kind::I32 => f64::from(i32::from_le_bytes(*rest.first_chunk()?)),
            Kind::U32 => f64::from(u32::from_le_bytes(*rest.first_chunk()?)),
            Kind::I64 => i64::from_le_bytes(*rest.first_chunk()?) as f64,
            Kind::U64 => u64::from_le_bytes(*rest.first_chunk()?) as f64,
            Kind::F32 => f64::from(f32::from_le_bytes(*rest.first_chunk()?)),
            Kind::F64 => f64::from_le_bytes(*rest.first_chunk()?),
            Kind::Other => return None,
        };
        Some(number * column.factor)
    }

    /// The time of a message, ns since the controller was switched on: `TimeUS`, in old logs `TimeMS`.
    pub(super) fn time(&self, message: &[u8]) -> Option<u64> {
        let of = |name: &str, kind: Kind| {
            let column = self.columns.iter().find(|c| c.name == name)?;
            (column.kind == kind).then(|| message.get(column.at..))?
        };
        if let Some(rest) = of("TimeUS", Kind::U64) {
            return u64::from_le_bytes(*rest.first_chunk()?).checked_mul(1_000);
        }
        let rest = of("TimeMS", Kind::U32)?;
        Some(u64::from(u32::from_le_bytes(*rest.first_chunk()?)) * 1_000_000)
    }

    /// Three numbers by the names of their columns.
    pub(super) fn vector(&self, message: &[u8], names: [&str; 3]) -> Option<[f64; 3]> {
        let [x, y, z] = names.map(|name| self.number(message, name));
        Some([x?, y?, z?])
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn fmt(of: u8, length: u8, letters: &str, names: &str) -> Vec<u8> {
        let mut values = vec![of, length];
        for (text, room) in [("TEST", 4), (letters, 16), (names, 64)] {
            let mut bytes = text.as_bytes().to_vec();
            bytes.resize(room, 0);
            values.extend(bytes);
        }
        values
    }

    #[test]
    fn numbers_are_read_as_their_letters_say() {
        let values = fmt(7, 3 + 8 + 2 + 4 + 4 + 1, "QcfnB", "TimeUS,Roll,Gyr,Name,I");
        let (of, layout) = Layout::parse(&values).unwrap();
        assert_eq!((of, layout.name.as_str()), (7, "TEST"));
        let mut message = vec![0xa3, 0x95, 7];
        message.extend(1_234_567_u64.to_le_bytes());
        message.extend((-4_250_i16).to_le_bytes());
        message.extend(0.125_f32.to_le_bytes());
        message.extend(b"abcd\x02");
        assert_eq!(layout.length, message.len());
        assert_eq!(layout.time(&message), Some(1_234_567_000));
        assert!((layout.number(&message, "Roll").unwrap() + 42.5).abs() < 1e-12);
        assert_eq!(layout.number(&message, "Gyr"), Some(0.125));
        assert_eq!(layout.number(&message, "I"), Some(2.0));
        assert_eq!(layout.number(&message, "Name"), None);
        assert_eq!(layout.number(&message[..12], "Roll"), None);
    }

    #[test]
    fn a_layout_that_contradicts_itself_is_none() {
        assert!(Layout::parse(&fmt(7, 12, "Q", "TimeUS")).is_none());
        assert!(Layout::parse(&fmt(7, 4, "?", "What")).is_none());
        assert!(Layout::parse(&fmt(7, 11, "Q", "TimeUS")[..20]).is_none());
        // Columns without names have none.
        assert!(Layout::parse(&fmt(7, 12, "QB", "")).is_some());
    }
}
