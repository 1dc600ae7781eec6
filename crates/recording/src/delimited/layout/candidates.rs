//! Names of columns -> those that may be a vector, and the one that a user means. Pure.
//!
//! Apart from the roles because the header is found by it too, before anything else is known of the table.

use super::super::preamble::Maker;
use super::number;
use crate::columns::{Kind, Meant, Name};
use std::collections::BTreeMap;

/// Columns that may be a vector.
pub(super) struct Group {
    pub(super) columns: Vec<usize>,
    /// A column of which there is another of the same meaning.
    pub(super) twice: Option<[usize; 2]>,
}

/// Index of a column that the user names, or gives by its number from 1.
pub(super) fn place(names: &[Name], column: &str) -> Result<usize, String> {
    let all = |is: &dyn Fn(&str) -> bool| -> Vec<usize> {
        let each = names.iter().enumerate();
        each.filter(|(_, name)| is(&name.text))
            .map(|(at, _)| at)
            .collect()
    };
    let mut found = all(&|name| name == column);
    if found.is_empty() {
        found = all(&|name| name.eq_ignore_ascii_case(column));
    }
    match (found.as_slice(), number(column)) {
        ([one], _) => Ok(*one),
        ([], Some(n)) if n <= names.len() => Ok(n - 1),
        ([], Some(n)) => Err(format!("there is no column {n} of {}", names.len())),
        ([], None) => {
            let column = crate::text::printable(column);
            Err(format!("there is no column `{column}`"))
        }
        ([first, second, ..], _) => Err(format!(
            "`{}` is there more than once, as columns {} and {}: give its number",
            crate::text::printable(column),
            first + 1,
            second + 1
        )),
    }
}

/// Every vector of this kind of which all parts are there.
pub(super) fn candidates(names: &[Name], kind: Kind) -> Vec<Group> {
    let mut groups: BTreeMap<&str, Vec<Vec<usize>>> = BTreeMap::new();
    for (at, name) in names.iter().enumerate() {
        if let Meant::Part {
            kind: of_kind,
            part,
            of,
        } = &name.meant
            && *of_kind == kind
        {
            let parts = groups
                .entry(of)
                .or_insert_with(|| vec![Vec::new(); kind.parts()]);
            if let Some(part) = parts.get_mut(*part) {
                part.push(at);
            }
        }
    }
    let group = |parts: Vec<Vec<usize>>| {
        let columns: Option<Vec<usize>> = parts.iter().map(|part| part.first().copied()).collect();
        let twice = parts.iter().find_map(|part| match part.as_slice() {
            [first, second, ..] => Some([*first, *second]),
            _ => None,
        });
        Some(Group {
            columns: columns?,
            twice,
        })
    };
    groups.into_values().filter_map(group).collect()
}

/// Sensor Logger and its like: bare axes beside a stamp are what a file of that name holds. MATLAB's phone logs have
/// the second name, and no other word in it: what is called so and more is another thing.
pub(super) fn bare_axes(names: &[Name], stem: &str, kind: Kind) -> Option<Vec<usize>> {
    let (stems, whole): (&[&str], &str) = match kind {
        Kind::Gyro => (&["gyroscope"], "angularvelocity"),
        Kind::Accel => (&["totalacceleration", "accelerometer"], "acceleration"),
        Kind::Mag => (&["magnetometer"], "magneticfield"),
        Kind::Orientation | Kind::Matrix | Kind::Turn | Kind::Push => return None,
    };
    let stem = stem.to_lowercase();
    let is_whole = stem
        .strip_prefix(whole)
        .is_some_and(|rest| !rest.contains(char::is_alphabetic));
    let is_it = is_whole || stems.iter().any(|of_kind| stem.starts_with(of_kind));
    if !is_it {
        return None;
    }
    names.iter().find(|name| name.meant == Meant::Stamp)?;
    let axis = |axis: &str| place(names, axis).ok();
    ["x", "y", "z"].into_iter().map(axis).collect()
}

/// The rates of a `.gcsv`, which only its first line tells: elsewhere `rx` is an angle as well.
pub(super) fn axes_of_maker(names: &[Name], maker: Maker, kind: Kind) -> Option<Vec<usize>> {
    let is_it = maker == Maker::Gyroflow && kind == Kind::Gyro;
    let axis = |axis: &str| place(names, axis).ok();
    is_it.then(|| ["rx", "ry", "rz"].into_iter().map(axis).collect())?
}
