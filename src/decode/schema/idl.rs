//! OMG IDL text (`ros2idl`, `omgidl`) -> [`Schema`]. Pure.
//!
//! The part of IDL 4.2 that messages are made of: modules, structs, typedefs, enums, sequences,
//! arrays. What lies beyond (unions, maps, optional members) is kept as undefined: a message is read
//! up to there.
//!
//! # Source
//! OMG IDL 4.2 (formal/18-01-05) 7.4; the concatenation as rosbag2 stores it: a line of `=`, a line
//! `IDL: pkg/msg/Type`, the text.

use super::{Field, Kind, Many, Number, Schema, Struct, ros_name};
use std::collections::BTreeMap;

const MAX_TEXT: usize = 1 << 20;
const MAX_DEPTH: usize = 32;

/// Reads `text` and makes `type_name` the root.
///
/// # Errors
/// A sentence: not IDL, too large, or without that struct.
pub(crate) fn parse(text: &str, type_name: &str) -> Result<Schema, String> {
    if text.len() > MAX_TEXT {
        return Err(format!("the schema text is {} bytes, over the limit of {MAX_TEXT}", text.len()));
    }
    let mut parser = Parser {
        tokens: tokens(text),
        at: 0,
        scope: Vec::new(),
        names: BTreeMap::new(),
        structs: Vec::new(),
    };
    parser.items(0)?;
    let wanted = ros_name(type_name);
    let schema = parser.link();
    let root = schema.structs.iter().rposition(|s| ros_name(&s.name) == wanted);
    match root {
        Some(root) => Ok(Schema { root, ..schema }),
        None => Err("the schema text does not define this message".to_owned()),
    }
}

/// Words, numbers, punctuation; comments, preprocessor lines, section marks and the contents of
/// strings are left out.
fn tokens(text: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = text;
    let mut line_start = true;
    while let Some(c) = rest.chars().next() {
        let line = rest.find('\n').unwrap_or(rest.len());
        let skip = if c == '\n' {
            line_start = true;
            1
        } else if c.is_whitespace() {
            c.len_utf8()
        } else if line_start && (c == '#' || c == '=' || rest.starts_with("IDL:")) || rest.starts_with("//") {
            line
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if c == '"' || c == '\'' {
            quoted(rest, c)
        } else if c.is_ascii_alphanumeric() || c == '_' {
            let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
            end.unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            c.len_utf8()
        };
        let token = rest.get(..skip).unwrap_or("");
        let first = token.chars().next().unwrap_or(' ');
        let is_token = first.is_ascii_alphanumeric() || "_{}[]<>();,:@=".contains(first);
        if is_token && !(line_start && (first == '=' || token.starts_with("IDL:"))) {
            tokens.push(token);
        }
        if c != '\n' && !c.is_whitespace() {
            line_start = false;
        }
        rest = rest.get(skip.max(1)..).unwrap_or("");
    }
    tokens
}

/// Bytes of a quoted text at the start of `rest`.
fn quoted(rest: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in rest.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return at + 1,
            _ => {}
        }
    }
    rest.len()
}

/// A type before names are resolved.
#[derive(Debug, Clone)]
enum Written {
    Known(Kind),
    /// The name, and the module it was used in.
    Named(String, String),
}

#[derive(Debug, Clone)]
struct Typed {
    written: Written,
    many: Many,
}

/// What a scoped name stands for.
#[derive(Debug, Clone)]
enum Meaning {
    Struct(usize),
    Typedef(Typed),
    Enum,
}

type Members = Vec<(String, Typed)>;

struct Parser<'a> {
    tokens: Vec<&'a str>,
    at: usize,
    scope: Vec<&'a str>,
    names: BTreeMap<String, Meaning>,
    structs: Vec<(String, Members)>,
}

impl<'a> Parser<'a> {
    fn peek(&self) -> &'a str {
        self.tokens.get(self.at).copied().unwrap_or("")
    }

    fn next(&mut self) -> &'a str {
        let token = self.peek();
        self.at += 1;
        token
    }

    fn take(&mut self, token: &str) -> bool {
        let taken = self.peek() == token;
        self.at += usize::from(taken);
        taken
    }

    fn expect(&mut self, token: &str) -> Result<(), String> {
        if self.take(token) {
            return Ok(());
        }
        let found = super::super::printable(self.peek());
        Err(format!("the schema is not IDL this program reads: expected `{token}`, found `{found}`"))
    }

    fn name(&mut self) -> Result<&'a str, String> {
        let name = self.next();
        let proper = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && name.len() <= 256;
        if proper {
            Ok(name)
        } else {
            let name = super::super::printable(name);
            Err(format!("the schema is not IDL this program reads: expected a name, found `{name}`"))
        }
    }

    /// `name` as seen from outside the modules it stands in.
    fn full(&self, name: &str) -> String {
        let mut full = self.scope.join("::");
        if !full.is_empty() {
            full.push_str("::");
        }
        full + name
    }

    fn items(&mut self, depth: usize) -> Result<(), String> {
        if depth > MAX_DEPTH {
            return Err(format!("the schema nests modules more than {MAX_DEPTH} deep"));
        }
        while self.at < self.tokens.len() && self.peek() != "}" {
            match self.peek() {
                "@" => {
                    self.annotation();
                }
                ";" => self.at += 1,
                "module" => {
                    self.at += 1;
                    let name = self.name()?;
                    self.expect("{")?;
                    self.scope.push(name);
                    self.items(depth + 1)?;
                    self.scope.pop();
                    self.expect("}")?;
                }
                "struct" => self.structure()?,
                "typedef" => {
                    self.at += 1;
                    let typed = self.typed(0)?;
                    for (name, typed) in self.declarators(&typed)? {
                        let full = self.full(&name);
                        self.names.insert(full, Meaning::Typedef(typed));
                    }
                }
                "enum" => {
                    self.at += 1;
                    let name = self.name()?;
                    let full = self.full(name);
                    self.names.insert(full, Meaning::Enum);
                    self.skip();
                }
                _ => self.skip(),
            }
        }
        Ok(())
    }

    /// Goes over one item whatever it is, to its semicolon outside all brackets.
    fn skip(&mut self) {
        let mut depth = 0_usize;
        while self.at < self.tokens.len() {
            match self.peek() {
                "{" | "(" => depth += 1,
                "}" if depth == 0 => return,
                "}" | ")" => depth = depth.saturating_sub(1),
                ";" if depth == 0 => {
                    self.at += 1;
                    return;
                }
                _ => {}
            }
            self.at += 1;
        }
    }

    /// Goes over `@name(...)`; whether it makes a member optional.
    fn annotation(&mut self) -> bool {
        self.at += 1;
        let mut optional = self.next() == "optional";
        while self.take("::") {
            self.at += 1;
        }
        if self.take("(") {
            let mut depth = 1;
            while depth > 0 && self.at < self.tokens.len() {
                match self.next() {
                    "(" => depth += 1,
                    ")" => depth -= 1,
                    "FALSE" => optional = false,
                    _ => {}
                }
            }
        }
        optional
    }

    fn structure(&mut self) -> Result<(), String> {
        self.at += 1;
        let name = self.name()?;
        let full = self.full(name);
        if self.take(";") {
            return Ok(());
        }
        let mut members = Members::new();
        if self.take(":") {
            // The members of the base come first, as if it were the first member.
            let base = self.typed(0)?;
            members.push(("base".to_owned(), base));
        }
        self.expect("{")?;
        while !self.take("}") {
            let mut optional = false;
            while self.peek() == "@" {
                optional |= self.annotation();
            }
            let mut typed = self.typed(0)?;
            if optional {
                typed.written = Written::Known(Kind::Undefined);
            }
            members.extend(self.declarators(&typed)?);
        }
        let index = self.structs.len();
        self.names.insert(full.clone(), Meaning::Struct(index));
        self.structs.push((full, members));
        Ok(())
    }

    /// `a, b[3], c[2][2];`
    fn declarators(&mut self, typed: &Typed) -> Result<Members, String> {
        let mut list = Vec::new();
        loop {
            let name = self.name()?;
            let mut many = Many::One;
            while self.take("[") {
                let size = self.next();
                self.expect("]")?;
                // A constant's name gives no size here: what follows can not be found.
                many = size.parse().map_or(Many::Array(u32::MAX), |n| product(many, n));
            }
            list.push((name.to_owned(), nested(typed, many)));
            if self.take(";") {
                return Ok(list);
            }
            self.expect(",")?;
        }
    }

    fn typed(&mut self, depth: usize) -> Result<Typed, String> {
        if depth > MAX_DEPTH {
            return Err(format!("the schema nests types more than {MAX_DEPTH} deep"));
        }
        let known = |kind| Written::Known(kind);
        let number = |n| known(Kind::Number(n));
        let written = match self.peek() {
            "boolean" | "octet" | "char" | "uint8" => number(Number::U8),
            "int8" => number(Number::I8),
            "short" | "int16" => number(Number::I16),
            "uint16" => number(Number::U16),
            "int32" => number(Number::I32),
            "uint32" => number(Number::U32),
            "int64" => number(Number::I64),
            "uint64" => number(Number::U64),
            "float" => number(Number::F32),
            "double" => number(Number::F64),
            "wchar" => known(Kind::WideText),
            "unsigned" => {
                self.at += 1;
                match (self.peek(), self.tokens.get(self.at + 1).copied()) {
                    ("short", _) => number(Number::U16),
                    ("long", Some("long")) => {
                        self.at += 1;
                        number(Number::U64)
                    }
                    _ => number(Number::U32),
                }
            }
            "long" => match self.tokens.get(self.at + 1).copied() {
                Some("long") => {
                    self.at += 1;
                    number(Number::I64)
                }
                Some("double") => {
                    self.at += 1;
                    number(Number::F128)
                }
                _ => number(Number::I32),
            },
            text @ ("string" | "wstring") => {
                self.at += 1;
                self.bound()?;
                let kind = if text == "string" { Kind::Text } else { Kind::WideText };
                return Ok(Typed { written: known(kind), many: Many::One });
            }
            "sequence" => {
                self.at += 1;
                self.expect("<")?;
                let element = self.typed(depth + 1)?;
                if self.take(",") {
                    self.at += 1;
                }
                self.expect(">")?;
                return Ok(nested(&element, Many::Sequence));
            }
            "map" | "any" | "fixed" => {
                self.at += 1;
                self.bound()?;
                return Ok(Typed { written: known(Kind::Undefined), many: Many::One });
            }
            _ => return self.scoped(),
        };
        self.at += 1;
        Ok(Typed { written, many: Many::One })
    }

    /// `<...>`, gone over.
    fn bound(&mut self) -> Result<(), String> {
        if self.take("<") {
            let mut depth = 1;
            while depth > 0 {
                match self.next() {
                    "<" => depth += 1,
                    ">" => depth -= 1,
                    "" => return self.expect(">"),
                    _ => {}
                }
            }
        }
        Ok(())
    }

    fn scoped(&mut self) -> Result<Typed, String> {
        self.take("::");
        let mut name = self.name()?.to_owned();
        while self.take("::") {
            name.push_str("::");
            name.push_str(self.name()?);
        }
        Ok(Typed {
            written: Written::Named(name, self.scope.join("::")),
            many: Many::One,
        })
    }

    fn link(&self) -> Schema {
        let structs = self.structs.iter().map(|(name, members)| Struct {
            name: name.clone(),
            fields: members
                .iter()
                .map(|(name, typed)| {
                    let (kind, many) = self.resolve(typed, 0);
                    Field { name: name.clone(), kind, many, number: 0 }
                })
                .collect(),
        });
        let mut structs: Vec<Struct> = structs.collect();
        for structure in &mut structs {
            if structure.fields.is_empty() {
                structure.fields.push(Field {
                    name: "structure_needs_at_least_one_member".to_owned(),
                    kind: Kind::Number(Number::U8),
                    many: Many::One,
                    number: 0,
                });
            }
        }
        Schema { structs, root: 0 }
    }

    fn resolve(&self, typed: &Typed, depth: usize) -> (Kind, Many) {
        let (name, scope) = match &typed.written {
            Written::Known(kind) => return (*kind, typed.many),
            Written::Named(name, scope) => (name, scope),
        };
        // From the innermost module outwards.
        let mut scope = scope.as_str();
        let meaning = loop {
            let full = if scope.is_empty() { name.clone() } else { format!("{scope}::{name}") };
            if let Some(meaning) = self.names.get(&full) {
                break Some(meaning);
            }
            if scope.is_empty() {
                break None;
            }
            scope = scope.rsplit_once("::").map_or("", |(outer, _)| outer);
        };
        match meaning {
            Some(Meaning::Struct(index)) => (Kind::Struct(*index), typed.many),
            Some(Meaning::Enum) => (Kind::Number(Number::U32), typed.many),
            Some(Meaning::Typedef(inner)) if depth < MAX_DEPTH => {
                let inner = nested(inner, typed.many);
                self.resolve(&inner, depth + 1)
            }
            _ => (Kind::Undefined, typed.many),
        }
    }
}

/// `many` of what `inner` already is: arrays of arrays lie flat, anything else has no place in a
/// [`Field`] and becomes undefined.
fn nested(inner: &Typed, many: Many) -> Typed {
    let (written, many) = match (inner.many, many) {
        (one, Many::One) => (inner.written.clone(), one),
        (Many::One, many) => (inner.written.clone(), many),
        (Many::Array(n), many @ Many::Array(_)) => (inner.written.clone(), product(many, n)),
        _ => (Written::Known(Kind::Undefined), Many::One),
    };
    Typed { written, many }
}

fn product(many: Many, n: u32) -> Many {
    match many {
        Many::Array(m) => Many::Array(m.saturating_mul(n)),
        _ => Many::Array(n),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const IMU_LIKE: &str = r#"
================================================================================
IDL: my_msgs/msg/Reading
// generated
#include "geometry_msgs/msg/Vector3.idl"
module my_msgs {
  module msg {
    typedef double double__9[9];
    module Reading_Constants { const long A = 5; };
    enum Mode { OFF, ON };
    @verbatim (language="comment", text="a \" quoted; } text" "and more")
    struct Reading {
      @unit ("rad/s") geometry_msgs::msg::Vector3 angular_velocity;
      double__9 covariance;
      sequence<octet, 16> data;
      unsigned long long stamp_ns; /* ns; */
      Mode mode;
      long double wide; float grid[2][3];
      wstring label;
      @optional long maybe;
    };
  };
};
================================================================================
IDL: geometry_msgs/msg/Vector3
module geometry_msgs { module msg { struct Vector3 { double x, y; double z; }; }; };
"#;

    #[test]
    fn modules_typedefs_enums_and_annotations_are_read() {
        let schema = parse(IMU_LIKE, "my_msgs/msg/Reading").unwrap();
        let root = schema.get(schema.root).unwrap();
        let shape: Vec<_> = root.fields.iter().map(|f| (f.name.as_str(), f.kind, f.many)).collect();
        assert_eq!(
            shape,
            [
                ("angular_velocity", Kind::Struct(1), Many::One),
                ("covariance", Kind::Number(Number::F64), Many::Array(9)),
                ("data", Kind::Number(Number::U8), Many::Sequence),
                ("stamp_ns", Kind::Number(Number::U64), Many::One),
                ("mode", Kind::Number(Number::U32), Many::One),
                ("wide", Kind::Number(Number::F128), Many::One),
                ("grid", Kind::Number(Number::F32), Many::Array(6)),
                ("label", Kind::WideText, Many::One),
                ("maybe", Kind::Undefined, Many::One),
            ]
        );
        let vector: Vec<_> = schema.get(1).unwrap().fields.iter().map(|f| f.name.as_str()).collect();
        assert_eq!(vector, ["x", "y", "z"]);
    }

    #[test]
    fn what_is_not_idl_ends_with_a_sentence() {
        for text in ["", "struct", "struct A {", "struct A { long", "struct A { long x", "module m { struct A { 5 } }", "typedef sequence<", "@", "\"", "/*", "struct A { string<", "}"] {
            assert!(parse(text, "a/A").is_err(), "{text}");
        }
        let circular = "typedef A B; typedef B A; struct C { A x; sequence<sequence<long>> y; };";
        let schema = parse(circular, "C").unwrap();
        assert!(schema.structs[0].fields.iter().all(|f| f.kind == Kind::Undefined));
        let deep = format!("struct A {{ {}long x; }};", "sequence<".repeat(100_000));
        assert!(parse(&deep, "A").is_err());
    }
}
