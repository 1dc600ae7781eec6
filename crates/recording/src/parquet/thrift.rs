//! Bytes of Thrift's compact protocol -> fields, one after the other. Pure.
//!
//! What the footer and the headers of pages are written in. No length is believed beyond the bytes that are there.
//!
//! # Source
//! Apache Thrift, `doc/specs/thrift-compact-protocol.md`.

/// Structures within structures that are stepped over.
const MOST_DEEP: u32 = 32;

/// Why bytes are none of this protocol.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Bad {
    /// Early end: more may help.
    Short,
    /// Values that cannot be.
    Wrong,
}

/// Kind of a field.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    True,
    False,
    Byte,
    Whole,
    Double,
    Binary,
    List,
    Map,
    Struct,
    Uuid,
}

impl Kind {
    fn of(code: u8) -> Result<Kind, Bad> {
        Ok(match code {
            1 => Kind::True,
            2 => Kind::False,
            3 => Kind::Byte,
            4..=6 => Kind::Whole,
            7 => Kind::Double,
            8 => Kind::Binary,
            9 | 10 => Kind::List,
            11 => Kind::Map,
            12 => Kind::Struct,
            13 => Kind::Uuid,
            _ => return Err(Bad::Wrong),
        })
    }
}

/// Bytes being read.
#[derive(Clone, Debug)]
pub(super) struct Fields<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl<'b> Fields<'b> {
    pub(super) fn new(bytes: &'b [u8]) -> Fields<'b> {
        Fields { bytes, at: 0 }
    }

    /// Bytes read so far.
    pub(super) fn used(&self) -> usize {
        self.at
    }

    /// Reads a structure: `take` gets the number and the kind of each of its fields, and says whether it read it;
    /// what it did not is stepped over.
    pub(super) fn each(
        &mut self,
        mut take: impl FnMut(i64, Kind, &mut Self) -> Result<bool, Bad>,
    ) -> Result<(), Bad> {
        let mut last = 0;
        while let Some((id, kind)) = self.field(last)? {
            last = id;
            let before = self.at;
            if !take(id, kind, self)? {
                self.at = before;
                self.skip(kind, 0)?;
            }
        }
        Ok(())
    }

    fn field(&mut self, last: i64) -> Result<Option<(i64, Kind)>, Bad> {
        let head = self.byte()?;
        if head == 0 {
            return Ok(None);
        }
        let id = match head >> 4 {
            0 => self.whole()?,
            step => last + i64::from(step),
        };
        Ok(Some((id, Kind::of(head & 15)?)))
    }

    fn byte(&mut self) -> Result<u8, Bad> {
        let byte = *self.bytes.get(self.at).ok_or(Bad::Short)?;
        self.at += 1;
        Ok(byte)
    }

    fn varint(&mut self) -> Result<u64, Bad> {
        let mut value = 0u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(value);
            }
        }
        Err(Bad::Wrong)
    }

    /// A whole number of 16 to 64 bits.
    pub(super) fn whole(&mut self) -> Result<i64, Bad> {
        let coded = self.varint()?;
        Ok((coded >> 1) as i64 ^ -((coded & 1) as i64))
    }

    /// A whole number that counts or measures something.
    pub(super) fn size(&mut self) -> Result<u64, Bad> {
        u64::try_from(self.whole()?).map_err(|_| Bad::Wrong)
    }

    /// Text or bytes.
    pub(super) fn binary(&mut self) -> Result<&'b [u8], Bad> {
        let length = usize::try_from(self.varint()?).map_err(|_| Bad::Wrong)?;
        let end = self.at.checked_add(length).ok_or(Bad::Wrong)?;
        let bytes = self.bytes.get(self.at..end).ok_or(Bad::Short)?;
        self.at = end;
        Ok(bytes)
    }

    /// Number of elements of a list, and their kind. Each takes a byte at least.
    pub(super) fn list(&mut self) -> Result<(usize, Kind), Bad> {
        let head = self.byte()?;
        let count = match head >> 4 {
            15 => usize::try_from(self.varint()?).map_err(|_| Bad::Wrong)?,
            count => usize::from(count),
        };
        if count > self.bytes.len().saturating_sub(self.at) {
            return Err(Bad::Short);
        }
        match (count, head & 15) {
            (0, _) => Ok((0, Kind::Byte)),
            (_, code) => Ok((count, Kind::of(code)?)),
        }
    }

    /// A list of structures, or of anything else: `take` reads one.
    pub(super) fn list_of<T>(
        &mut self,
        wanted: Kind,
        mut take: impl FnMut(&mut Self) -> Result<T, Bad>,
    ) -> Result<Vec<T>, Bad> {
        let (count, kind) = self.list()?;
        if count > 0 && kind != wanted {
            return Err(Bad::Wrong);
        }
        // Not reserved: what is claimed may not come.
        let mut all = Vec::new();
        for _ in 0..count {
            all.push(take(self)?);
        }
        Ok(all)
    }

    fn skip(&mut self, kind: Kind, depth: u32) -> Result<(), Bad> {
        if depth > MOST_DEEP {
            return Err(Bad::Wrong);
        }
        let pass = |fields: &mut Self, count: usize| {
            let end = fields.at + count;
            (end <= fields.bytes.len())
                .then_some(())
                .ok_or(Bad::Short)?;
            fields.at = end;
            Ok(())
        };
        match kind {
            Kind::True | Kind::False => Ok(()),
            Kind::Byte => pass(self, 1),
            Kind::Whole => self.varint().map(|_| ()),
            Kind::Double => pass(self, 8),
            Kind::Uuid => pass(self, 16),
            Kind::Binary => self.binary().map(|_| ()),
            Kind::List => {
                let (count, of) = self.list()?;
                (0..count).try_for_each(|_| self.skip_element(of, depth))
            }
            Kind::Map => {
                let count = self.varint()?;
                if count == 0 {
                    return Ok(());
                }
                let kinds = self.byte()?;
                let (key, value) = (Kind::of(kinds >> 4)?, Kind::of(kinds & 15)?);
                for _ in 0..count {
                    self.skip_element(key, depth)?;
                    self.skip_element(value, depth)?;
                }
                Ok(())
            }
            Kind::Struct => {
                let mut last = 0;
                while let Some((id, kind)) = self.field(last)? {
                    last = id;
                    self.skip(kind, depth + 1)?;
                }
                Ok(())
            }
        }
    }

    /// Skips an element; of lists and maps a truth value takes a byte.
    fn skip_element(&mut self, kind: Kind, depth: u32) -> Result<(), Bad> {
        match kind {
            Kind::True | Kind::False => self.byte().map(|_| ()),
            kind => self.skip(kind, depth + 1),
        }
    }
}
