//! OMG IDL text (`ros2idl`, `omgidl`) -> [`Schema`]. Pure.
//!
//! The part of IDL 4.2 that messages are made of: modules, structs, typedefs, enums, sequences,
//! arrays. What lies beyond (unions, maps, optional members) is kept as undefined: a message is read
//! up to there.
//!
//! Long because it is one grammar, whose rules call each other.
//!
//! # Source
//! OMG IDL 4.2 (formal/18-01-05) 7.4; the concatenation as rosbag2 stores it: a line of `=`, a line
//! `IDL: pkg/msg/Type`, the text.

mod tokens;

use super::{Field, Kind, MAX_NAME, Many, Number, Schema, Struct, ros_name};
use std::collections::BTreeMap;
use std::rc::Rc;
use tokens::tokens;

const MAX_TEXT: usize = 1 << 20;
const MAX_DEPTH: usize = 32;
/// Most structs, members, typedefs and enums.
const MAX_DEFINITIONS: usize = 20_000;

/// Reads `text` and makes `type_name` the root.
///
/// # Errors
/// A sentence: not IDL, too large, or without that struct.
pub(crate) fn parse(text: &str, type_name: &str) -> Result<Schema, String> {
    if text.len() > MAX_TEXT {
        return Err(format!(
            "the schema text is {} bytes, over the limit of {MAX_TEXT}",
            text.len()
        ));
    }
    let mut parser = Parser {
        tokens: tokens(text),
        at: 0,
        scope: Rc::from(""),
        names: BTreeMap::new(),
        uses: Vec::new(),
        structs: Vec::new(),
        definitions: 0,
    };
    parser.items(0)?;
    let wanted = ros_name(type_name);
    let schema = parser.link();
    let root = schema
        .structs
        .iter()
        .rposition(|s| ros_name(&s.name) == wanted);
    match root {
        Some(root) => Ok(Schema { root, ..schema }),
        None => Err("the schema text does not define this message".to_owned()),
    }
}

/// A type before names are resolved.
#[derive(Debug, Clone, Copy)]
enum Written {
    Known(Kind),
    /// A name, by its place in [`Parser::uses`].
    Named(usize),
}

#[derive(Debug, Clone, Copy)]
struct Typed {
    written: Written,
    many: Many,
}

/// Meaning of a scoped name.
#[derive(Debug, Clone, Copy)]
enum Meaning {
    Struct(usize),
    Typedef(Typed),
    Enum,
}

type Members = Vec<(String, Typed)>;

struct Parser<'a> {
    tokens: Vec<&'a str>,
    at: usize,
    /// The modules around, joined by `::`.
    scope: Rc<str>,
    names: BTreeMap<String, Meaning>,
    /// Names that are used as types, each with the modules it was used in.
    uses: Vec<(String, Rc<str>)>,
    structs: Vec<(String, Members)>,
    definitions: usize,
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
        let found = crate::text::printable(self.peek());
        Err(format!(
            "the schema is not IDL this program reads: expected `{token}`, found `{found}`"
        ))
    }

    fn name(&mut self) -> Result<&'a str, String> {
        let name = self.next();
        let proper =
            name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && name.len() <= 256;
        if proper {
            Ok(name)
        } else {
            let name = crate::text::printable(name);
            Err(format!(
                "the schema is not IDL this program reads: expected a name, found `{name}`"
            ))
        }
    }

    /// `name`, which is defined here, as seen from outside the modules it stands in.
    fn full(&mut self, name: &str) -> Result<String, String> {
        self.definitions += 1;
        if self.definitions > MAX_DEFINITIONS {
            return Err(format!(
                "the schema defines more than {MAX_DEFINITIONS} types and members"
            ));
        }
        joined(&self.scope, name)
    }

    fn items(&mut self, depth: usize) -> Result<(), String> {
        if depth > MAX_DEPTH {
            return Err(format!(
                "the schema nests modules more than {MAX_DEPTH} deep"
            ));
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
                    let inner = joined(&self.scope, name)?;
                    let outer = std::mem::replace(&mut self.scope, inner.into());
                    self.items(depth + 1)?;
                    self.scope = outer;
                    self.expect("}")?;
                }
                "struct" => self.structure()?,
                "typedef" => {
                    self.at += 1;
                    let typed = self.typed(0)?;
                    for (name, typed) in self.declarators(typed)? {
                        let full = joined(&self.scope, &name)?;
                        self.names.insert(full, Meaning::Typedef(typed));
                    }
                }
                "enum" => {
                    self.at += 1;
                    let name = self.name()?;
                    let full = self.full(name)?;
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
        let full = self.full(name)?;
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
            members.extend(self.declarators(typed)?);
        }
        let index = self.structs.len();
        self.names.insert(full.clone(), Meaning::Struct(index));
        self.structs.push((full, members));
        Ok(())
    }

    /// `a, b[3], c[2][2];`
    fn declarators(&mut self, typed: Typed) -> Result<Members, String> {
        let mut list = Vec::new();
        loop {
            let name = self.name()?;
            self.full(name)?;
            let mut many = Many::One;
            while self.take("[") {
                let size = self.next();
                self.expect("]")?;
                // A constant's name gives no size here: what follows cannot be found.
                many = size
                    .parse()
                    .map_or(Many::Array(u32::MAX), |n| product(many, n));
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
        let one = |kind| Typed {
            written: Written::Known(kind),
            many: Many::One,
        };
        if let Some(number) = self.number() {
            return Ok(one(Kind::Number(number)));
        }
        match self.peek() {
            "wchar" => {
                self.at += 1;
                Ok(one(Kind::WideText))
            }
            text @ ("string" | "wstring") => {
                self.at += 1;
                self.bound()?;
                let kind = if text == "string" {
                    Kind::Text
                } else {
                    Kind::WideText
                };
                Ok(one(kind))
            }
            "sequence" => {
                self.at += 1;
                self.expect("<")?;
                let element = self.typed(depth + 1)?;
                if self.take(",") {
                    self.at += 1;
                }
                self.expect(">")?;
                Ok(nested(element, Many::Sequence))
            }
            "map" | "any" | "fixed" => {
                self.at += 1;
                self.bound()?;
                Ok(one(Kind::Undefined))
            }
            _ => self.scoped(),
        }
    }

    /// Takes the words of a number's type, where such stand here.
    fn number(&mut self) -> Option<Number> {
        let next = |n| self.tokens.get(self.at + n).copied();
        let (number, words) = match self.peek() {
            "boolean" | "octet" | "char" | "uint8" => (Number::U8, 1),
            "int8" => (Number::I8, 1),
            "short" | "int16" => (Number::I16, 1),
            "uint16" => (Number::U16, 1),
            "int32" => (Number::I32, 1),
            "uint32" => (Number::U32, 1),
            "int64" => (Number::I64, 1),
            "uint64" => (Number::U64, 1),
            "float" => (Number::F32, 1),
            "double" => (Number::F64, 1),
            "unsigned" => match (next(1), next(2)) {
                (Some("short"), _) => (Number::U16, 2),
                (Some("long"), Some("long")) => (Number::U64, 3),
                _ => (Number::U32, 2),
            },
            "long" => match next(1) {
                Some("long") => (Number::I64, 2),
                Some("double") => (Number::F128, 2),
                _ => (Number::I32, 1),
            },
            _ => return None,
        };
        self.at += words;
        Some(number)
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
            name = joined(&name, self.name()?)?;
        }
        self.uses.push((name, Rc::clone(&self.scope)));
        Ok(Typed {
            written: Written::Named(self.uses.len() - 1),
            many: Many::One,
        })
    }

    fn link(&self) -> Schema {
        let mut known = vec![None; self.uses.len()];
        let structs = self.structs.iter().map(|(name, members)| Struct {
            name: name.clone(),
            fields: members
                .iter()
                .map(|(name, typed)| {
                    let (kind, many) = self.resolve(*typed, &mut known, 0);
                    Field {
                        name: name.clone(),
                        kind,
                        many,
                        number: 0,
                    }
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

    /// Resolves a type; `known` has what each use of a name was found to stand for.
    fn resolve(
        &self,
        typed: Typed,
        known: &mut [Option<(Kind, Many)>],
        depth: usize,
    ) -> (Kind, Many) {
        let of_name = match typed.written {
            Written::Known(kind) => return (kind, typed.many),
            Written::Named(at) => match known.get(at) {
                Some(Some(found)) => *found,
                _ => self.resolve_name(at, known, depth),
            },
        };
        let (kind, many) = of_name;
        let written = Written::Known(kind);
        match nested(Typed { written, many }, typed.many) {
            Typed {
                written: Written::Known(kind),
                many,
            } => (kind, many),
            other => (Kind::Undefined, other.many),
        }
    }

    fn resolve_name(
        &self,
        at: usize,
        known: &mut [Option<(Kind, Many)>],
        depth: usize,
    ) -> (Kind, Many) {
        let undefined = (Kind::Undefined, Many::One);
        let (Some(slot), Some((name, scope))) = (known.get_mut(at), self.uses.get(at)) else {
            return undefined;
        };
        // A typedef that comes back to itself finds this.
        *slot = Some(undefined);
        let found = match self.meaning(name, scope) {
            Some(Meaning::Struct(index)) => (Kind::Struct(index), Many::One),
            Some(Meaning::Enum) => (Kind::Number(Number::U32), Many::One),
            Some(Meaning::Typedef(inner)) if depth < MAX_DEPTH => {
                self.resolve(inner, known, depth + 1)
            }
            _ => undefined,
        };
        if let Some(slot) = known.get_mut(at) {
            *slot = Some(found);
        }
        found
    }

    /// Meaning of `name` in `scope`: from the innermost module outwards.
    fn meaning(&self, name: &str, mut scope: &str) -> Option<Meaning> {
        loop {
            let full = match scope {
                "" => name.to_owned(),
                _ => format!("{scope}::{name}"),
            };
            if let Some(meaning) = self.names.get(&full) {
                return Some(*meaning);
            }
            if scope.is_empty() {
                return None;
            }
            scope = scope.rsplit_once("::").map_or("", |(outer, _)| outer);
        }
    }
}

/// `outer::name`, of bounded length: it is kept for everything that is defined or used there.
fn joined(outer: &str, name: &str) -> Result<String, String> {
    let full = match outer {
        "" => name.to_owned(),
        _ => format!("{outer}::{name}"),
    };
    match full.len() {
        0..=MAX_NAME => Ok(full),
        n => Err(format!(
            "the schema has a name of {n} bytes, over the limit of {MAX_NAME}"
        )),
    }
}

/// `many` of what `inner` already is: arrays of arrays lie flat, anything else has no place in a
/// [`Field`] and becomes undefined.
fn nested(inner: Typed, many: Many) -> Typed {
    let (written, many) = match (inner.many, many) {
        (one, Many::One) => (inner.written, one),
        (Many::One, many) => (inner.written, many),
        (Many::Array(n), many @ Many::Array(_)) => (inner.written, product(many, n)),
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
mod tests;
