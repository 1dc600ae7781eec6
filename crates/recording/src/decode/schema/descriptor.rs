//! A protobuf `FileDescriptorSet` -> [`Schema`]. Pure.
//!
//! Read with our own wire reader rather than a reflection library: nine field numbers are wanted,
//! recordings exist whose set lacks an imported file (which reflection refuses as a whole), and
//! nothing here can panic.
//!
//! # Source
//! google/protobuf/descriptor.proto: the field numbers.

use super::{Field, Kind, MAX_NAME, Many, Number, Schema, Struct};
use crate::decode::protobuf::wire::{Broken, Reader, Value};
use std::collections::BTreeMap;

/// Longest descriptor set that is read, and most messages and fields in it.
const MAX_BYTES: usize = 4 << 20;
const MAX_MESSAGES: usize = 20_000;
const MAX_FIELDS: usize = 100_000;

/// Deepest nesting of message declarations.
const MAX_DEPTH: usize = 32;

/// Reads the set and makes `type_name` (`package.Message`) the root.
///
/// # Errors
/// A sentence: not a descriptor set, too large, or without that message.
pub(crate) fn parse(bytes: &[u8], type_name: &str) -> Result<Schema, String> {
    if bytes.len() > MAX_BYTES {
        return Err(format!(
            "the descriptor set is {} bytes, over the limit of {MAX_BYTES}",
            bytes.len()
        ));
    }
    let mut found = Messages::default();
    found.set(bytes).map_err(|broken| {
        format!(
            "the schema is no file descriptor set: byte {}: {}",
            broken.offset, broken.what
        )
    })?;
    let schema = found.link();
    let wanted = type_name.trim_start_matches('.');
    let root = schema.structs.iter().position(|s| s.name == wanted);
    match root {
        Some(root) => Ok(Schema { root, ..schema }),
        None => Err("the descriptor set does not define this message".to_owned()),
    }
}

/// Messages as declared, references still by name.
#[derive(Default)]
struct Messages {
    names: Vec<String>,
    fields: Vec<Vec<Declared>>,
    declared: usize,
}

#[derive(Default)]
struct Declared {
    name: String,
    number: u32,
    label: u64,
    kind: u64,
    type_name: String,
}

impl Messages {
    fn set(&mut self, bytes: &[u8]) -> Result<(), Broken> {
        let mut set = Reader::new(bytes, 0);
        while let Some((number, value)) = set.next()? {
            // FileDescriptorSet.file
            if let (1, Value::Bytes(file)) = (number, value) {
                self.file(file, set.offset() - file.len())?;
            }
        }
        Ok(())
    }

    fn file(&mut self, bytes: &[u8], base: usize) -> Result<(), Broken> {
        // The package may stand behind the messages: look for it first.
        let mut package = String::new();
        let mut file = Reader::new(bytes, base);
        while let Some((number, value)) = file.next()? {
            if let (2, Value::Bytes(name)) = (number, value) {
                package = text(name);
            }
        }
        let mut file = Reader::new(bytes, base);
        while let Some((number, value)) = file.next()? {
            // FileDescriptorProto.message_type
            if let (4, Value::Bytes(message)) = (number, value) {
                self.message(message, file.offset() - message.len(), &package, 0)?;
            }
        }
        Ok(())
    }

    fn message(
        &mut self,
        bytes: &[u8],
        base: usize,
        outer: &str,
        depth: usize,
    ) -> Result<(), Broken> {
        let broken = |offset, what| Err(Broken { offset, what });
        if depth > MAX_DEPTH || self.names.len() > MAX_MESSAGES {
            return broken(base, "too many messages");
        }
        let mut name = String::new();
        let mut fields = Vec::new();
        let mut nested = Vec::new();
        let mut message = Reader::new(bytes, base);
        while let Some((number, value)) = message.next()? {
            let Value::Bytes(inner) = value else { continue };
            let at = message.offset() - inner.len();
            match number {
                1 => name = text(inner),
                2 => {
                    self.declared += 1;
                    if self.declared > MAX_FIELDS {
                        return broken(at, "too many fields");
                    }
                    fields.push(declared(inner, at)?);
                }
                3 => nested.push((inner, at)),
                _ => {}
            }
        }
        let full = if outer.is_empty() {
            name
        } else {
            format!("{outer}.{name}")
        };
        if full.len() > MAX_NAME {
            return broken(base, "a message's name is too long");
        }
        for (inner, at) in nested {
            self.message(inner, at, &full, depth + 1)?;
        }
        self.names.push(full);
        self.fields.push(fields);
        Ok(())
    }

    fn link(self) -> Schema {
        let by_name: BTreeMap<&str, usize> = self
            .names
            .iter()
            .enumerate()
            .map(|(i, n)| (n.as_str(), i))
            .collect();
        let structs = self
            .names
            .iter()
            .zip(&self.fields)
            .map(|(name, fields)| Struct {
                name: name.clone(),
                fields: fields.iter().map(|d| field(d, &by_name)).collect(),
            });
        Schema {
            structs: structs.collect(),
            root: 0,
        }
    }
}

fn declared(bytes: &[u8], base: usize) -> Result<Declared, Broken> {
    let mut declared = Declared::default();
    let mut field = Reader::new(bytes, base);
    while let Some((number, value)) = field.next()? {
        match (number, value) {
            (1, Value::Bytes(name)) => declared.name = text(name),
            (3, Value::Varint(n)) => declared.number = u32::try_from(n).unwrap_or(0),
            (4, Value::Varint(label)) => declared.label = label,
            (5, Value::Varint(kind)) => declared.kind = kind,
            (6, Value::Bytes(name)) => declared.type_name = text(name),
            _ => {}
        }
    }
    Ok(declared)
}

fn field(declared: &Declared, by_name: &BTreeMap<&str, usize>) -> Field {
    // FieldDescriptorProto.Type
    let kind = match declared.kind {
        1 => Kind::Number(Number::F64),
        2 => Kind::Number(Number::F32),
        3 | 5 | 8 | 14 => Kind::Number(Number::Varint),
        4 | 13 => Kind::Number(Number::VarintUnsigned),
        6 => Kind::Number(Number::U64),
        7 => Kind::Number(Number::U32),
        15 => Kind::Number(Number::I32),
        16 => Kind::Number(Number::I64),
        17 | 18 => Kind::Number(Number::ZigZag),
        9 | 12 => Kind::Text,
        11 => by_name
            .get(declared.type_name.trim_start_matches('.'))
            .map_or(Kind::Undefined, |index| Kind::Struct(*index)),
        _ => Kind::Undefined,
    };
    Field {
        name: declared.name.clone(),
        kind,
        many: if declared.label == 3 {
            Many::Sequence
        } else {
            Many::One
        },
        number: declared.number,
    }
}

fn text(bytes: &[u8]) -> String {
    let bytes = bytes.get(..256).unwrap_or(bytes);
    String::from_utf8_lossy(bytes).into_owned()
}
