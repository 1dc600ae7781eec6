//! Bytes -> protobuf keys and values. Pure.
//!
//! Our own reader, thirty lines of it, because it must be total and must stop at the fields that are
//! wanted; a message library builds every field of every message first.
//!
//! # Source
//! Protocol Buffers, "Encoding" (protobuf.dev/programming-guides/encoding).

/// Deepest nesting of (deprecated) groups that is skipped.
const MAX_GROUPS: usize = 64;

/// A value as the wire has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Value<'a> {
    Varint(u64),
    Fixed64([u8; 8]),
    Fixed32([u8; 4]),
    Bytes(&'a [u8]),
    /// A group, already skipped.
    Group,
}

/// Fault: its position, from the start of what is read, and its description.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Broken {
    pub(crate) offset: usize,
    pub(crate) what: &'static str,
}

/// Reads one message's fields in order.
#[derive(Debug, Clone)]
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    pos: usize,
    /// Offset of `bytes` in the payload, for messages.
    base: usize,
}

impl<'a> Reader<'a> {
    /// Makes one over `bytes`, which begin at `base` of the payload.
    pub(crate) fn new(bytes: &'a [u8], base: usize) -> Self {
        Reader {
            bytes,
            pos: 0,
            base,
        }
    }

    /// Offset of the next byte in the payload.
    pub(crate) fn offset(&self) -> usize {
        self.base + self.pos
    }

    /// The next field; `None` at the end.
    pub(crate) fn next(&mut self) -> Result<Option<(u32, Value<'a>)>, Broken> {
        if self.pos >= self.bytes.len() {
            return Ok(None);
        }
        let (number, wire) = self.key()?;
        let value = self.value(number, wire)?;
        Ok(Some((number, value)))
    }

    fn key(&mut self) -> Result<(u32, u8), Broken> {
        let key = self.varint()?;
        match u32::try_from(key >> 3) {
            Ok(number) if number != 0 => Ok((number, (key & 7) as u8)),
            _ => Err(self.broken("no such field number")),
        }
    }

    fn value(&mut self, number: u32, wire: u8) -> Result<Value<'a>, Broken> {
        Ok(match wire {
            0 => Value::Varint(self.varint()?),
            1 => Value::Fixed64(self.fixed()?),
            2 => {
                let len = self.varint()?;
                let rest = self.bytes.get(self.pos..).unwrap_or(&[]);
                let bytes = usize::try_from(len).ok().and_then(|len| rest.get(..len));
                let bytes = bytes.ok_or_else(|| self.broken("a length goes beyond the end"))?;
                self.pos += bytes.len();
                Value::Bytes(bytes)
            }
            3 => {
                self.skip_group(number)?;
                Value::Group
            }
            5 => Value::Fixed32(self.fixed()?),
            _ => return Err(self.broken("no such wire type")),
        })
    }

    fn skip_group(&mut self, number: u32) -> Result<(), Broken> {
        let mut open = vec![number];
        while let Some(&group) = open.last() {
            let (number, wire) = self.key()?;
            match wire {
                3 if open.len() >= MAX_GROUPS => return Err(self.broken("groups nest too deep")),
                3 => open.push(number),
                4 if number == group => {
                    open.pop();
                }
                4 => return Err(self.broken("a group ends that did not begin")),
                _ => {
                    self.value(number, wire)?;
                }
            }
        }
        Ok(())
    }

    pub(crate) fn varint(&mut self) -> Result<u64, Broken> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let Some(&byte) = self.bytes.get(self.pos) else {
                return Err(self.broken("ends inside a number"));
            };
            self.pos += 1;
            // The tenth byte has room for one bit; protobuf drops the others.
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(self.broken("a number of more than ten bytes"))
    }

    /// Whether all is read.
    pub(crate) fn is_done(&self) -> bool {
        self.pos >= self.bytes.len()
    }

    pub(crate) fn fixed<const N: usize>(&mut self) -> Result<[u8; N], Broken> {
        let rest = self.bytes.get(self.pos..).unwrap_or(&[]);
        let value = rest.first_chunk::<N>().copied();
        let value = value.ok_or_else(|| self.broken("ends inside a number"))?;
        self.pos += N;
        Ok(value)
    }

    fn broken(&self, what: &'static str) -> Broken {
        Broken {
            offset: self.offset(),
            what,
        }
    }
}
