//! Shapes that a field's type can have: a vector, a quaternion, a stamp, a name. Pure.
//!
//! Apart from the search, which asks by name where to look; here only shapes count.

use super::names::{self, Meaning, is_nanos, is_seconds};
use super::{End, PathStep, StampFields};
use crate::decode::registers::{Slot, StampForm};
use crate::decode::schema::{Field, Kind, Many, Schema, Struct};
use strapd_attitude::record::TimeUnit;

/// Paths to x, y, z of what may be a vector: a struct with these fields, three numbers in an array,
/// or a struct that wraps one of these in a field called `vec`, `value` or the like.
pub(super) fn vector(
    schema: &Schema,
    path: &[PathStep],
    end: End,
    depth: u8,
) -> Option<Vec<Vec<PathStep>>> {
    match (end.kind, end.many) {
        (Kind::Number(_), Many::Array(3) | Many::Sequence) => {
            Some((0..3).map(|n| with(path, PathStep::At(n))).collect())
        }
        (Kind::Struct(index), Many::One) => {
            let structure = schema.get(index)?;
            if let Some(paths) = numbers(structure, path, &["x", "y", "z"]) {
                return Some(paths);
            }
            if depth == 0 {
                return None;
            }
            let inner = structure.fields.iter().position(|f| {
                let wrapper = ["vec", "vector", "value", "values", "data", "xyz"];
                wrapper.contains(&f.name.as_str())
            })?;
            let field = structure.fields.get(inner)?;
            vector(
                schema,
                &with(path, PathStep::Field(inner)),
                End::from(field),
                depth - 1,
            )
        }
        _ => None,
    }
}

/// Paths to w, x, y, z of a struct that has them. An array of four says nothing about its order and
/// is never taken for one.
pub(super) fn quaternion(
    schema: &Schema,
    path: &[PathStep],
    end: End,
) -> Option<Vec<Vec<PathStep>>> {
    numbers(end.structure(schema)?, path, &["w", "x", "y", "z"])
}

fn numbers(structure: &Struct, path: &[PathStep], names: &[&str]) -> Option<Vec<Vec<PathStep>>> {
    names
        .iter()
        .map(|name| {
            let index = structure.position(name)?;
            End::from(structure.fields.get(index)?).number()?;
            Some(with(path, PathStep::Field(index)))
        })
        .collect()
}

/// The stamp that `end` is or, for a header, holds; `depth` is how far structs are looked into.
pub(super) fn stamp_at(
    schema: &Schema,
    path: &[PathStep],
    end: End,
    unit: TimeUnit,
    depth: u8,
) -> Option<StampFields> {
    if let Some(number) = end.number() {
        let (form, slot) = if number.is_float() {
            (StampForm::Float(unit), Slot::STAMP_FLOAT)
        } else {
            (StampForm::Count(unit), Slot::STAMP)
        };
        let paths = vec![(path.to_vec(), slot)];
        return Some(StampFields { form, paths });
    }
    let structure = end.structure(schema)?;
    let integer = |wanted: fn(&str) -> bool| {
        let index = structure.fields.iter().position(|f| wanted(&f.name))?;
        let number = End::from(structure.fields.get(index)?).number()?;
        (!number.is_float()).then(|| with(path, PathStep::Field(index)))
    };
    if let (Some(sec), Some(nanos)) = (integer(is_seconds), integer(is_nanos)) {
        return Some(StampFields {
            form: StampForm::SecNanos,
            paths: vec![(sec, Slot::STAMP), (nanos, Slot::STAMP_NANOS)],
        });
    }
    let depth = depth.checked_sub(1)?;
    stamp_in(schema, path, structure, depth).map(|(_, stamp)| stamp)
}

/// The best stamp among a struct's fields and its header's.
pub(super) fn stamp_in(
    schema: &Schema,
    path: &[PathStep],
    structure: &Struct,
    depth: u8,
) -> Option<(u8, StampFields)> {
    let mut best: Option<(u8, StampFields)> = None;
    for (index, field) in structure.fields.iter().enumerate() {
        let path = with(path, PathStep::Field(index));
        let end = End::from(field);
        let found = match names::meaning(&field.name) {
            Some(Meaning::Stamp { rank, unit }) => {
                stamp_at(schema, &path, end, unit, depth).map(|stamp| (rank, stamp))
            }
            Some(Meaning::Header) => depth
                .checked_sub(1)
                .and_then(|depth| stamp_in(schema, &path, end.structure(schema)?, depth)),
            _ => None,
        };
        if let Some(found) = found
            && best.as_ref().is_none_or(|b| found.0 < b.0)
        {
            best = Some(found);
        }
    }
    best
}

/// A string of this name in the struct at `path`, or in its header.
pub(super) fn text_near(schema: &Schema, path: &[PathStep], name: &str) -> Option<Vec<PathStep>> {
    let structure = end_of(schema, path)?.structure(schema)?;
    let is_text = |f: &Field| f.kind == Kind::Text && f.many == Many::One;
    if let Some(index) = structure.position(name)
        && structure.fields.get(index).is_some_and(is_text)
    {
        return Some(with(path, PathStep::Field(index)));
    }
    let header = structure.position("header")?;
    let inner = End::from(structure.fields.get(header)?).structure(schema)?;
    let index = inner.position(name)?;
    let found = inner.fields.get(index).is_some_and(is_text);
    found.then(|| with(&with(path, PathStep::Field(header)), PathStep::Field(index)))
}

/// Every struct on the way, the innermost first, the message itself last.
pub(super) fn structs_on(schema: &Schema, path: &[PathStep]) -> Vec<Vec<PathStep>> {
    (0..path.len())
        .rev()
        .filter_map(|n| path.get(..n))
        .filter(|prefix| end_of(schema, prefix).is_some_and(|e| e.structure(schema).is_some()))
        .map(<[PathStep]>::to_vec)
        .collect()
}

pub(super) fn end_of(schema: &Schema, path: &[PathStep]) -> Option<End> {
    let mut end = End {
        kind: Kind::Struct(schema.root),
        many: Many::One,
    };
    for step in path {
        match step {
            PathStep::Field(index) => end = End::from(end.structure(schema)?.fields.get(*index)?),
            PathStep::At(_) | PathStep::Each => end.many = Many::One,
        }
    }
    Some(end)
}

pub(super) fn with(path: &[PathStep], step: PathStep) -> Vec<PathStep> {
    let mut longer = Vec::with_capacity(path.len() + 1);
    longer.extend_from_slice(path);
    longer.push(step);
    longer
}
