//! Concatenated `.msg` text (`ros2msg`, `ros1msg`) -> [`Schema`]. Pure.
//!
//! The text is what MCAP and the ROS 1 bag store: the message's own definition, then one section for
//! each type it needs, behind a line of `=` and a line `MSG: pkg/Type`.

use super::{Field, Kind, MAX_NAME, Many, Number, Schema, Struct, ros_name};
use std::collections::BTreeMap;

/// Longest schema text that is read, and most fields it may define. The largest in use (vision,
/// diagnostics) have some hundred fields in 30 kB.
const MAX_TEXT: usize = 1 << 20;
const MAX_FIELDS: usize = 20_000;

/// Dialect of the text: ROS 1 and 2 differ in the names of primitives, and in what an empty message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dialect {
    /// `time` and `duration` are primitive.
    Ros1,
    /// `byte` is unsigned, strings can be wide or bounded.
    Ros2,
}

/// Reads `text`, whose first section is the message `type_name`.
///
/// # Errors
/// A sentence that names the line when the text is not `.msg`.
pub(crate) fn parse(text: &str, type_name: &str, dialect: Dialect) -> Result<Schema, String> {
    if text.len() > MAX_TEXT {
        return Err(format!(
            "the schema text is {} bytes, over the limit of {MAX_TEXT}",
            text.len()
        ));
    }
    let mut sections = vec![Section::new(type_name)?];
    let mut fields = 0;
    for (number, line) in text.lines().enumerate() {
        let at_line = |why: String| format!("schema line {}: {why}", number + 1);
        let line = line.trim();
        if line.len() >= 5 && line.bytes().all(|b| b == b'=') {
            continue;
        }
        if let Some(name) = line.strip_prefix("MSG:") {
            sections.push(Section::new(name.trim()).map_err(at_line)?);
            continue;
        }
        let declaration = declaration(line).map_err(at_line)?;
        if let (Some(d), Some(section)) = (declaration, sections.last_mut()) {
            fields += 1;
            if fields > MAX_FIELDS {
                return Err(format!("the schema defines more than {MAX_FIELDS} fields"));
            }
            section.declarations.push(d);
        }
    }
    Ok(link(&sections, dialect))
}

/// One `MSG:` section.
struct Section<'a> {
    name: String,
    declarations: Vec<Declaration<'a>>,
}

impl Section<'_> {
    fn new(type_name: &str) -> Result<Self, String> {
        let name = ros_name(type_name);
        match name.len() {
            0..=MAX_NAME => Ok(Section {
                name,
                declarations: Vec::new(),
            }),
            n => Err(format!(
                "a type's name of {n} bytes, over the limit of {MAX_NAME}"
            )),
        }
    }
}

/// One line that declares a field.
struct Declaration<'a> {
    type_name: &'a str,
    many: Many,
    name: &'a str,
}

/// The field a line declares; `None` for empty lines, comments and constants.
fn declaration(line: &str) -> Result<Option<Declaration<'_>>, String> {
    // A '#' inside a string default or constant starts no comment, but what it could hide comes
    // after the name, which is all that is wanted.
    let line = line.split('#').next().unwrap_or("").trim();
    if line.is_empty() {
        return Ok(None);
    }
    let (type_name, rest) = line
        .split_once(char::is_whitespace)
        .ok_or_else(|| format!("`{}` has no field name", crate::text::printable(line)))?;
    let rest = rest.trim_start();
    let end = rest
        .find(|c: char| c.is_whitespace() || c == '=')
        .unwrap_or(rest.len());
    let (name, after) = rest.split_at(end);
    // `TYPE NAME=value` is a constant and not on the wire; `TYPE name value` is a default.
    if after.trim_start().starts_with('=') {
        return Ok(None);
    }
    let proper = !name.is_empty()
        && name.len() <= 256
        && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    if !proper {
        return Err(format!("`{}` is not a field", crate::text::printable(line)));
    }
    let (base, many) = match type_name.split_once('[') {
        None => (type_name, Many::One),
        Some((base, bound)) => {
            let bound = bound.strip_suffix(']').ok_or_else(|| {
                format!("`{}` lacks a bracket", crate::text::printable(type_name))
            })?;
            let many = if bound.is_empty() || bound.starts_with("<=") {
                Many::Sequence
            } else {
                let n = bound.parse().map_err(|_| {
                    format!("`{}` is not an array size", crate::text::printable(bound))
                })?;
                Many::Array(n)
            };
            (base, many)
        }
    };
    // `string<=10`: the bound is not on the wire.
    let base = base.split("<=").next().unwrap_or(base);
    Ok(Some(Declaration {
        type_name: base,
        many,
        name,
    }))
}

/// Turns names into indices; types that only ROS itself defines are filled in.
fn link(sections: &[Section<'_>], dialect: Dialect) -> Schema {
    let mut linker = Linker {
        schema: Schema::default(),
        by_name: BTreeMap::new(),
    };
    for section in sections {
        let index = linker.schema.structs.len();
        linker.schema.structs.push(Struct {
            name: section.name.clone(),
            fields: Vec::new(),
        });
        linker.by_name.entry(section.name.clone()).or_insert(index);
    }
    for (index, section) in sections.iter().enumerate() {
        let package = section.name.split('/').next().unwrap_or("");
        let mut fields: Vec<Field> = section
            .declarations
            .iter()
            .map(|d| Field {
                name: d.name.to_owned(),
                kind: linker.kind(d.type_name, package, dialect),
                many: d.many,
                number: 0,
            })
            .collect();
        if fields.is_empty() && dialect == Dialect::Ros2 {
            // rosidl gives an empty struct one byte, since C and IDL know no empty struct.
            fields.push(Field {
                name: "structure_needs_at_least_one_member".to_owned(),
                kind: Kind::Number(Number::U8),
                many: Many::One,
                number: 0,
            });
        }
        if let Some(entry) = linker.schema.structs.get_mut(index) {
            entry.fields = fields;
        }
    }
    linker.schema
}

struct Linker {
    schema: Schema,
    by_name: BTreeMap<String, usize>,
}

impl Linker {
    fn kind(&mut self, name: &str, package: &str, dialect: Dialect) -> Kind {
        let number = match name {
            "bool" | "uint8" | "char" => Number::U8,
            "byte" if dialect == Dialect::Ros2 => Number::U8,
            "int8" | "byte" => Number::I8,
            "int16" => Number::I16,
            "uint16" => Number::U16,
            "int32" => Number::I32,
            "uint32" => Number::U32,
            "int64" => Number::I64,
            "uint64" => Number::U64,
            "float32" => Number::F32,
            "float64" => Number::F64,
            "string" => return Kind::Text,
            "wstring" => return Kind::WideText,
            "time" if dialect == Dialect::Ros1 => return self.pair("time", Number::U32, "nsec"),
            "duration" if dialect == Dialect::Ros1 => {
                return self.pair("duration", Number::I32, "nsec");
            }
            _ => return self.named(name, package),
        };
        Kind::Number(number)
    }

    fn named(&mut self, name: &str, package: &str) -> Kind {
        let full = ros_name(name);
        let candidates = if full.contains('/') {
            vec![full.clone()]
        } else if full == "Header" {
            vec!["std_msgs/Header".to_owned(), format!("{package}/Header")]
        } else {
            vec![format!("{package}/{full}"), full.clone()]
        };
        if let Some(&index) = candidates.iter().find_map(|c| self.by_name.get(c)) {
            return Kind::Struct(index);
        }
        match full.as_str() {
            "builtin_interfaces/Time" => self.pair(&full, Number::I32, "nanosec"),
            "builtin_interfaces/Duration" => self.pair(&full, Number::I32, "nanosec"),
            _ => Kind::Undefined,
        }
    }

    /// A struct of seconds and nanoseconds, made once.
    fn pair(&mut self, name: &str, seconds: Number, nanos: &str) -> Kind {
        if let Some(&index) = self.by_name.get(name) {
            return Kind::Struct(index);
        }
        let field = |name: &str, number| Field {
            name: name.to_owned(),
            kind: Kind::Number(number),
            many: Many::One,
            number: 0,
        };
        let below = if nanos == "nsec" {
            seconds
        } else {
            Number::U32
        };
        let index = self.schema.structs.len();
        self.schema.structs.push(Struct {
            name: name.to_owned(),
            fields: vec![field("sec", seconds), field(nanos, below)],
        });
        self.by_name.insert(name.to_owned(), index);
        Kind::Struct(index)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn constants_defaults_bounds_and_comments_are_told_apart() {
        let text = "# head\nint32 A=5\nstring S = \"a # b\"\nint32 a 5 # five\nfloat64[<=4] b [1, 2]\n\
                    string<=10[] c\nuint8[3] d\nfoo/msg/Bar e\nBaz f\nwstring g\n\
                    ====================\nMSG: foo/Bar\nBaz z\n=====\nMSG: my/Baz\nbyte q\n";
        let schema = parse(text, "my/msg/Type", Dialect::Ros2).unwrap();
        let root = schema.get(schema.root).unwrap();
        let shape: Vec<_> = root
            .fields
            .iter()
            .map(|f| (f.name.as_str(), f.kind, f.many))
            .collect();
        assert_eq!(
            shape,
            [
                ("a", Kind::Number(Number::I32), Many::One),
                ("b", Kind::Number(Number::F64), Many::Sequence),
                ("c", Kind::Text, Many::Sequence),
                ("d", Kind::Number(Number::U8), Many::Array(3)),
                ("e", Kind::Struct(1), Many::One),
                ("f", Kind::Struct(2), Many::One),
                ("g", Kind::WideText, Many::One),
            ]
        );
        // `Baz` inside foo/Bar is foo/Baz, which nobody defined.
        assert_eq!(schema.get(1).unwrap().fields[0].kind, Kind::Undefined);
    }

    #[test]
    fn an_empty_message_is_one_byte_in_ros_2_and_none_in_ros_1() {
        let fields = |dialect| {
            parse("\n# nothing\n", "std_msgs/Empty", dialect)
                .unwrap()
                .structs[0]
                .fields
                .len()
        };
        assert_eq!((fields(Dialect::Ros2), fields(Dialect::Ros1)), (1, 0));
    }

    #[test]
    fn nonsense_is_refused_with_its_line() {
        for (text, line) in [
            ("float64", "line 1"),
            ("int32 a\nint32[x] b", "line 2"),
            ("int32 a-b", "line 1"),
            ("int32[3 a", "line 1"),
        ] {
            let why = parse(text, "a/B", Dialect::Ros2).unwrap_err();
            assert!(why.contains(line), "{text}: {why}");
        }
        assert!(
            parse(&"int8 a\n".repeat(30_000), "a/B", Dialect::Ros2)
                .unwrap_err()
                .contains("20000")
        );
    }
}
