//! A format definition's text -> sizes of its fields, and the same fields as a ROS 1 definition. Pure.
//!
//! Apart from the walk because a definition is judged once, and everything about a message's bytes hangs on it:
//! how many there must be, and where its time lies.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

/// Deepest nesting of formats.
const MAX_DEPTH: usize = 8;

/// Most bytes of one message: what its record's length can say.
const MAX_SIZE: usize = u16::MAX as usize;

/// `name:type field;type[n] field;`, as far as it can be told without the other formats.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Format {
    pub(super) name: String,
    fields: Vec<Field>,
}

#[derive(Clone, PartialEq, Eq, Debug)]
struct Field {
    kind: String,
    /// Length, when it is an array.
    many: Option<u16>,
    name: String,
}

/// Layout of the messages of a format, once every format it names is known.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Layout {
    /// Bytes of a message without the padding at its end, which loggers leave out.
    pub(super) least: usize,
    /// Bytes of a message.
    pub(super) size: usize,
    /// Offset of its time: a `uint64_t timestamp`, in us.
    pub(super) timestamp: Option<usize>,
}

/// Formats by name.
pub(super) type Formats = BTreeMap<String, Format>;

impl Format {
    /// Reads a definition; `None` when it is none.
    pub(super) fn parse(text: &str) -> Option<Format> {
        let (name, fields) = text.split_once(':')?;
        let fields = fields
            .split(';')
            .filter(|field| !field.trim().is_empty())
            .map(Field::parse)
            .collect::<Option<Vec<Field>>>()?;
        is_name(name, b"_-/").then(|| Format {
            name: name.to_owned(),
            fields,
        })
    }

    /// Sizes; `None` where a format is missing, nests too deep or is larger than any record. Each field that is
    /// looked at, in every place where it stands, takes one of `steps`.
    pub(super) fn layout(&self, formats: &Formats, steps: &mut usize) -> Option<Layout> {
        let mut at = 0_usize;
        let mut least = 0;
        let mut timestamp = None;
        for field in &self.fields {
            if field.name == "timestamp" && field.kind == "uint64_t" && field.many.is_none() {
                timestamp.get_or_insert(at);
            }
            at = at.checked_add(field.size(formats, MAX_DEPTH, steps)?)?;
            if at > MAX_SIZE {
                return None;
            }
            if !field.is_padding() {
                least = at;
            }
        }
        Some(Layout {
            least,
            size: at,
            timestamp,
        })
    }

    /// The fields as a ROS 1 definition, nested types behind it, without the padding at the end; `None` beyond
    /// `limit` bytes.
    pub(super) fn definition(&self, formats: &Formats, limit: usize) -> Option<String> {
        let last = self.fields.iter().rposition(|field| !field.is_padding());
        let mut text = String::new();
        self.write(last.map_or(0, |n| n + 1), &mut text);
        let mut told: BTreeSet<&str> = BTreeSet::new();
        let mut open: Vec<&Format> = vec![self];
        while let Some(format) = open.pop() {
            for field in &format.fields {
                let Some(inner) = formats.get(&field.kind) else {
                    continue;
                };
                if told.insert(&inner.name) {
                    let _ = write!(text, "{:=<80}\nMSG: {}\n", "", inner.type_name());
                    inner.write(inner.fields.len(), &mut text);
                    open.push(inner);
                }
                if text.len() > limit {
                    return None;
                }
            }
        }
        Some(text)
    }

    /// `ulog/sensor_combined`.
    pub(super) fn type_name(&self) -> String {
        type_name(&self.name)
    }

    /// The first `n` fields, a line each.
    fn write(&self, n: usize, text: &mut String) {
        for field in self.fields.iter().take(n) {
            let kind = match field.kind.as_str() {
                "float" => "float32".to_owned(),
                "double" => "float64".to_owned(),
                // Text of fixed length: bytes.
                "char" => "uint8".to_owned(),
                "bool" => "bool".to_owned(),
                kind if size_of(kind).is_some() => kind.trim_end_matches("_t").to_owned(),
                kind => type_name(kind),
            };
            let many = field.many.map_or_else(String::new, |n| format!("[{n}]"));
            // A field of ROS begins with a letter.
            let name = field.name.trim_start_matches('_');
            let _ = writeln!(text, "{kind}{many} {name}");
        }
    }
}

impl Field {
    fn parse(text: &str) -> Option<Field> {
        let (kind, name) = text.trim().split_once(' ')?;
        let (kind, many) = match kind.split_once('[') {
            None => (kind, None),
            Some((kind, many)) => (kind, Some(many.strip_suffix(']')?.parse().ok()?)),
        };
        let proper = is_name(name.trim_start_matches('_'), b"_") && is_name(kind, b"_-/");
        proper.then(|| Field {
            kind: kind.to_owned(),
            many,
            name: name.to_owned(),
        })
    }

    fn is_padding(&self) -> bool {
        self.name.starts_with("_padding")
    }

    /// Bytes of it; nested formats down to `depth`.
    fn size(&self, formats: &Formats, depth: usize, steps: &mut usize) -> Option<usize> {
        *steps = steps.checked_sub(1)?;
        let one = match size_of(&self.kind) {
            Some(size) => size,
            None => {
                let depth = depth.checked_sub(1)?;
                let mut sum = 0_usize;
                for field in &formats.get(&self.kind)?.fields {
                    sum = sum.checked_add(field.size(formats, depth, steps)?)?;
                    if sum > MAX_SIZE {
                        return None;
                    }
                }
                sum
            }
        };
        one.checked_mul(usize::from(self.many.unwrap_or(1)))
    }
}

/// Bytes of a basic type.
pub(super) fn size_of(kind: &str) -> Option<usize> {
    Some(match kind {
        "int8_t" | "uint8_t" | "bool" | "char" => 1,
        "int16_t" | "uint16_t" => 2,
        "int32_t" | "uint32_t" | "float" => 4,
        "int64_t" | "uint64_t" | "double" => 8,
        _ => return None,
    })
}

/// Whether it is a name: not empty, at most 255 letters, digits and `others`.
pub(super) fn is_name(name: &str, others: &[u8]) -> bool {
    let proper = |b: u8| b.is_ascii_alphanumeric() || others.contains(&b);
    !name.is_empty() && name.len() <= 255 && name.bytes().all(proper)
}

fn type_name(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    format!("ulog/{}", name.chars().map(plain).collect::<String>())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn known(texts: &[&str]) -> Formats {
        let format = |text: &&str| Format::parse(text).unwrap();
        let named = |format: Format| (format.name.clone(), format);
        texts.iter().map(format).map(named).collect()
    }

    #[test]
    fn sizes_time_and_the_padding_at_the_end_are_told() {
        let formats = known(&[
            "inner:float[3] xyz;bool ok;uint8_t[3] _padding0;",
            "outer:uint32_t id;uint64_t timestamp;inner[2] pair;char[7] name;uint8_t[5] _padding0;",
        ]);
        let outer = formats.get("outer").unwrap();
        let layout = outer.layout(&formats, &mut 100).unwrap();
        assert_eq!((layout.least, layout.size), (51, 56));
        assert_eq!(layout.timestamp, Some(4));
        let text = outer.definition(&formats, 1000).unwrap();
        assert!(
            text.starts_with("uint32 id\nuint64 timestamp\nulog/inner[2] pair\nuint8[7] name\n===")
        );
        // Of a nested type the padding is there.
        let inner = "MSG: ulog/inner\nfloat32[3] xyz\nbool ok\nuint8[3] padding0\n";
        assert!(text.ends_with(inner), "{text}");
    }

    #[test]
    fn what_is_no_format_or_nests_without_end_is_none() {
        for text in [
            "",
            "a",
            ":int8_t x;",
            "a:int8_t;",
            "a:int8_t[x] y;",
            "a:int8_t[70000] y;",
            "a b:int8_t y;",
        ] {
            assert_eq!(Format::parse(text), None, "{text}");
        }
        let circle = known(&[
            "a:b x;",
            "b:a x;",
            "c:int8_t[65535] x;int8_t y;",
            "d:none x;",
        ]);
        for name in ["a", "c", "d"] {
            let layout = circle.get(name).unwrap().layout(&circle, &mut 1000);
            assert_eq!(layout, None, "{name}");
        }
        // A few lines may spell out to millions of fields.
        let wide = |name: &str, of: &str| {
            let fields: String = (0..100).map(|n| format!("{of} x{n};")).collect();
            format!("{name}:{fields}")
        };
        let texts = [
            wide("a", "b"),
            wide("b", "c"),
            wide("c", "d"),
            wide("d", "e"),
            "e:".to_owned(),
        ];
        let deep = known(&texts.iter().map(String::as_str).collect::<Vec<_>>());
        let mut steps = 10_000;
        assert_eq!(deep.get("a").unwrap().layout(&deep, &mut steps), None);
        assert_eq!(steps, 0);
        // The text of a circle ends.
        assert!(circle.get("a").unwrap().definition(&circle, 1000).is_some());
    }
}
