//! Header of a page -> what the page is. Pure.
//!
//! Apart from the pages because nothing of it is believed: where the body is, and how much of it there is, is checked
//! by whoever reads it.

use super::thrift::{Bad, Fields, Kind};

pub(super) const DATA: i64 = 0;
pub(super) const DICTIONARY: i64 = 2;
pub(super) const DATA_2: i64 = 3;

/// Header of a page.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub(super) struct Header {
    pub(super) kind: i64,
    pub(super) unpacked: usize,
    pub(super) packed: usize,
    pub(super) crc: Option<u32>,
    pub(super) rows: u64,
    pub(super) encoding: i64,
    pub(super) levels_encoding: i64,
    /// Bytes of the levels of a page of the second version.
    pub(super) levels: Option<(usize, usize)>,
    pub(super) is_packed: bool,
}

/// A page's header, and its length.
pub(super) fn header(bytes: &[u8]) -> Result<(Header, usize), Bad> {
    let mut fields = Fields::new(bytes);
    let mut head = Header {
        kind: -1,
        levels_encoding: 3,
        is_packed: true,
        ..Header::default()
    };
    let length = |fields: &mut Fields<'_>| usize::try_from(fields.size()?).map_err(|_| Bad::Wrong);
    fields.each(|id, kind, fields| {
        match (id, kind) {
            (1, Kind::Whole) => head.kind = fields.whole()?,
            (2, Kind::Whole) => head.unpacked = length(fields)?,
            (3, Kind::Whole) => head.packed = length(fields)?,
            (4, Kind::Whole) => head.crc = Some(fields.whole()? as u32),
            (5 | 7, Kind::Struct) => fields.each(|id, kind, fields| {
                match (id, kind) {
                    (1, Kind::Whole) => head.rows = fields.size()?,
                    (2, Kind::Whole) => head.encoding = fields.whole()?,
                    (3, Kind::Whole) => head.levels_encoding = fields.whole()?,
                    _ => return Ok(false),
                }
                Ok(true)
            })?,
            (8, Kind::Struct) => {
                let mut levels = (0, 0);
                fields.each(|id, kind, fields| {
                    match (id, kind) {
                        (1, Kind::Whole) => head.rows = fields.size()?,
                        (4, Kind::Whole) => head.encoding = fields.whole()?,
                        (5, Kind::Whole) => levels.1 = length(fields)?,
                        (6, Kind::Whole) => levels.0 = length(fields)?,
                        (7, Kind::False) => head.is_packed = false,
                        _ => return Ok(false),
                    }
                    Ok(true)
                })?;
                head.levels = Some(levels);
            }
            _ => return Ok(false),
        }
        Ok(true)
    })?;
    Ok((head, fields.used()))
}
