//! The shape of a message, whatever language it was written in. Pure.
//!
//! `.msg` text, IDL text and protobuf descriptors all become this one graph of structs, so that the
//! choice of fields ([`super::select`]) is made once and means the same everywhere.

pub(crate) mod builtin;
pub(crate) mod descriptor;
pub(crate) mod idl;
pub(crate) mod rosmsg;

/// Longest name of a type, with its package and modules: it is kept once for each type and joined to
/// others, so that a longer one would make the work grow faster than the schema.
pub(crate) const MAX_NAME: usize = 1024;

/// Structs by index; they may refer to each other in circles (a hostile schema does), so whoever
/// walks the graph bounds the depth.
#[derive(Debug, Default, Clone)]
pub(crate) struct Schema {
    /// Every struct that was defined.
    pub(crate) structs: Vec<Struct>,
    /// The message itself.
    pub(crate) root: usize,
}

/// One message or nested type.
#[derive(Debug, Default, Clone)]
pub(crate) struct Struct {
    /// Full name, as the schema writes it.
    pub(crate) name: String,
    /// Fields in wire order.
    pub(crate) fields: Vec<Field>,
}

/// One field.
#[derive(Debug, Clone)]
pub(crate) struct Field {
    /// Name.
    pub(crate) name: String,
    /// Kind of it, or of each of its elements.
    pub(crate) kind: Kind,
    /// Multiplicity.
    pub(crate) many: Many,
    /// Protobuf: the field number; elsewhere 0.
    pub(crate) number: u32,
}

/// Kind of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A number (or bool).
    Number(Number),
    /// A string or bytes.
    Text,
    /// A wide string. DDS implementations disagree on its layout: Fast DDS wrote 4 bytes a
    /// character, others 2, some count the terminator (ros2/rmw_cyclonedds#43), so nothing behind
    /// one can be found.
    WideText,
    /// Another struct.
    Struct(usize),
    /// A type the schema names but does not define.
    Undefined,
}

/// Number of values that a field holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Many {
    /// One.
    One,
    /// Always this many.
    Array(u32),
    /// Any number.
    Sequence,
}

/// A number as it lies in memory. The last four exist in protobuf only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Number {
    /// One byte, signed.
    I8,
    /// One byte, unsigned; also bool, byte and char.
    U8,
    /// Two bytes, signed.
    I16,
    /// Two bytes, unsigned.
    U16,
    /// Four bytes, signed.
    I32,
    /// Four bytes, unsigned.
    U32,
    /// Eight bytes, signed.
    I64,
    /// Eight bytes, unsigned.
    U64,
    /// Four bytes, IEEE 754.
    F32,
    /// Eight bytes, IEEE 754.
    F64,
    /// `long double`: 16 bytes that are walked over, never read.
    F128,
    /// Protobuf varint read as two's complement.
    Varint,
    /// Protobuf varint read as unsigned.
    VarintUnsigned,
    /// Protobuf varint with the sign in the lowest bit.
    ZigZag,
}

impl Number {
    /// Bytes of it on a fixed-width wire.
    pub(crate) fn size(self) -> u32 {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::I64 | Number::U64 | Number::F64 => 8,
            Number::F128 => 16,
            Number::Varint | Number::VarintUnsigned | Number::ZigZag => 1,
        }
    }

    /// Whether it is a floating-point number.
    pub(crate) fn is_float(self) -> bool {
        matches!(self, Number::F32 | Number::F64)
    }
}

impl Schema {
    /// A struct by index.
    pub(crate) fn get(&self, index: usize) -> Option<&Struct> {
        self.structs.get(index)
    }

    /// Fields there are once every nested type is written out in its place, at most `limit`; `circle` for one whose
    /// type holds itself. The work is that of reading the schema, whatever it spells out to.
    pub(crate) fn spelled(&self, limit: usize, circle: usize) -> usize {
        let mut known: Vec<Option<usize>> = vec![None; self.structs.len()];
        let mut begun = vec![false; self.structs.len()];
        // Inner types first, without recursion: they may nest as deep as there are types.
        let mut open = vec![self.root];
        while let Some(&at) = open.last() {
            let (Some(structure), Some(None), Some(is_begun)) =
                (self.get(at), known.get(at), begun.get_mut(at))
            else {
                open.pop();
                continue;
            };
            let inner = structure.fields.iter().map(|field| match field.kind {
                Kind::Struct(index) => Some(index),
                _ => None,
            });
            if !std::mem::replace(is_begun, true) {
                let is_new = |index: &usize| begun.get(*index) == Some(&false);
                open.extend(inner.flatten().filter(is_new));
                continue;
            }
            let of = |index| known.get(index).copied().flatten().unwrap_or(circle);
            let sum = inner
                .map(|index| 1 + index.map_or(0, of))
                .fold(0, usize::saturating_add);
            if let Some(slot) = known.get_mut(at) {
                *slot = Some(sum.min(limit));
            }
            open.pop();
        }
        known.get(self.root).copied().flatten().unwrap_or(0)
    }
}

impl Struct {
    /// Index of the field of this name.
    pub(crate) fn position(&self, name: &str) -> Option<usize> {
        self.fields.iter().position(|f| f.name == name)
    }
}

/// The type's own name: `sensor_msgs/msg/Imu`, `px4.vehicle_imu` and `bench.Imu` end in it.
pub(crate) fn last_name(type_name: &str) -> &str {
    type_name
        .rsplit(['/', '.', ':'])
        .next()
        .unwrap_or(type_name)
}

/// `pkg/Type` of `pkg/Type`, `pkg/msg/Type` and `pkg::msg::dds_::Type_`, the three ways ROS spells it.
pub(crate) fn ros_name(type_name: &str) -> String {
    let parts: Vec<&str> = type_name
        .split(['/', ':'])
        .filter(|p| !p.is_empty() && *p != "msg" && *p != "dds_")
        .collect();
    parts.join("/").trim_end_matches('_').to_owned()
}
