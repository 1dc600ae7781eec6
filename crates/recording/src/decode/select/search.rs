//! Search for the fields of a schema that hold a body rate, and for what belongs to it. Pure.
//!
//! Breadth first: the shallowest body rate wins, then the better name. The stamp is the one nearest
//! to it, from the inside out, because a nested message's own header is about its own sample.
//!
//! Long because what wins is seen only beside what loses: all searches go over the same sites, by the same measure.

use super::names::{self, Meaning, Px4};
use super::shapes::{end_of, quaternion, stamp_at, stamp_in, structs_on, text_near, vector, with};
use super::{
    End, MatchQuality, PathStep, Pick, Selection, StampFields, batch_of, path_text, px4_stamp,
};
use crate::decode::fields::FieldRole;
use crate::decode::registers::{Slot, StampForm};
use crate::decode::schema::{Field, Kind, Many, Number, Schema, Struct, last_name};
use crate::decode::{Options, Wanted};
use std::collections::{BTreeSet, VecDeque};
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::record::SampleKind;
use strapd_attitude::record::TimeUnit;

/// Deepest nesting that is searched, most structs, and most fields of them.
const MAX_DEPTH: usize = 8;
const MAX_SITES: usize = 4096;
const MAX_FIELDS: usize = 50_000;

/// A struct, and the way to it.
#[derive(Clone)]
struct Site {
    path: Vec<PathStep>,
    structure: usize,
    each: bool,
    depth: usize,
}

/// Fills every role that `--field` left open.
pub(super) fn complete(
    schema: &Schema,
    type_name: &str,
    options: &Options,
    selection: &mut Selection,
) {
    let by_child = options.child_frame.is_some();
    let sites = sites(schema);
    let px4 = names::px4(type_name);
    let given = selection.found == MatchQuality::Given;
    let around = if given {
        selection.picks.first().map(|p| p.path.clone())
    } else if options.wanted == Wanted::Rates {
        find_gyro(schema, &sites, px4, selection)
    } else {
        find_alone(schema, &sites, px4, options.wanted, selection)
    };
    let is_rate = options.wanted == Wanted::Rates;
    if let Some(path) = around.as_ref().filter(|_| is_rate) {
        beside_gyro(schema, path, given, selection);
    }
    if is_rate && !selection.has(Slot::ORIENTATION, 4) {
        find_orientation(schema, &sites, px4, by_child, selection);
    }
    let around = around.or_else(|| {
        let orientation = selection.picks.iter().find(|p| p.slot == Slot::ORIENTATION);
        orientation.map(|p| p.path.clone())
    });
    let chain = around.map_or_else(|| vec![Vec::new()], |path| structs_on(schema, &path));
    if selection.form.stamp == StampForm::None {
        find_stamp(schema, &chain, options.nth_stamp, px4.is_some(), selection);
    }
    selection.frame = chain
        .iter()
        .find_map(|path| text_near(schema, path, "frame_id"));
    if by_child && let Some(batch) = &selection.batch {
        let mut element = batch.path.clone();
        element.push(PathStep::Each);
        selection.child = text_near(schema, &element, "child_frame_id");
    }
}

/// Selects the stamp, of all on the way to the vector the `nth`.
fn find_stamp(
    schema: &Schema,
    chain: &[Vec<PathStep>],
    nth: usize,
    is_px4: bool,
    selection: &mut Selection,
) {
    let mut found: Vec<StampFields> = chain
        .iter()
        .filter_map(|path| {
            let structure = end_of(schema, path)?.structure(schema)?;
            stamp_in(schema, path, structure, 2).map(|(_, stamp)| stamp)
        })
        .collect();
    // The message's own first; but of a batch every sample has its own.
    if selection.batch.is_none() {
        found.reverse();
    }
    selection.stamps = found.iter().filter_map(|s| stamp_text(schema, s)).collect();
    let nth = nth.min(found.len().saturating_sub(1));
    let Some(mut stamp) = found.into_iter().nth(nth) else {
        return;
    };
    if is_px4 || selection.kind.is_some() {
        stamp.form = px4_stamp(stamp.form);
    }
    if let Some((path, _)) = stamp.paths.first() {
        // Of `stamp.sec` only `stamp` is worth saying.
        let whole = path.len() - usize::from(stamp.paths.len() > 1);
        selection.describe(FieldRole::Stamp, schema, path.get(..whole).unwrap_or(path));
    }
    take_stamp(selection, stamp);
}

/// Path of the stamp for the user: `stamp` instead of `stamp.sec`.
fn stamp_text(schema: &Schema, stamp: &StampFields) -> Option<String> {
    let (path, _) = stamp.paths.first()?;
    let whole = path.len() - usize::from(stamp.paths.len() > 1);
    Some(path_text(schema, path.get(..whole).unwrap_or(path)))
}

/// Refuses what a walk cannot do, before any payload.
pub(super) fn check(schema: &Schema, selection: &mut Selection) -> Result<(), String> {
    let batch = selection.batch.clone();
    let mut outside = false;
    let mut wrong = None;
    let mut at = 0;
    let given = selection.given;
    selection.picks.retain(|pick| {
        at += 1;
        let own = batch_of(schema, &pick.path);
        if own == batch {
            return true;
        }
        let is_stamp = [Slot::STAMP, Slot::STAMP_NANOS, Slot::STAMP_FLOAT].contains(&pick.slot);
        if own.is_none() && is_stamp {
            outside = true;
            return true;
        }
        if pick.slot == Slot::GYRO || is_stamp || at <= given {
            wrong = Some(path_text(schema, &pick.path));
        }
        // Anything else outside the batch belongs to no sample of it.
        false
    });
    if let Some(path) = wrong {
        return Err(format!("`{path}` and the samples lie in different arrays"));
    }
    selection.form.stamp_outside = outside && batch.is_some();
    Ok(())
}

fn sites(schema: &Schema) -> Vec<Site> {
    let mut found = Vec::new();
    let mut visited = 0;
    let mut seen = BTreeSet::new();
    let mut queue = VecDeque::from([Site {
        path: Vec::new(),
        structure: schema.root,
        each: false,
        depth: 0,
    }]);
    while let Some(site) = queue.pop_front() {
        let fields = schema.get(site.structure).map_or(&[][..], |s| &s.fields);
        if !seen.insert((site.structure, site.each)) && site.depth > 2 {
            continue;
        }
        visited += fields.len();
        if found.len() >= MAX_SITES || visited > MAX_FIELDS {
            break;
        }
        for (index, field) in fields.iter().enumerate() {
            let Kind::Struct(structure) = field.kind else {
                continue;
            };
            let each = field.many != Many::One;
            if site.depth >= MAX_DEPTH || (each && site.each) {
                continue;
            }
            let mut path = site.path.clone();
            path.push(PathStep::Field(index));
            if each {
                path.push(PathStep::Each);
            }
            queue.push_back(Site {
                path,
                structure,
                each: each || site.each,
                depth: site.depth + 1,
            });
        }
        if queue.len() > MAX_SITES {
            queue.truncate(MAX_SITES);
        }
        found.push(site);
    }
    // Samples in an array come after a sample of the message's own, however deep.
    found.sort_by_key(|site| site.each);
    found
}

/// A body rate that was found.
struct Candidate {
    key: (MatchQuality, bool, usize, u8),
    paths: Vec<Vec<PathStep>>,
    whole: Vec<PathStep>,
    holder: String,
    unit: Option<GyroUnit>,
    delta: bool,
}

/// One axis that has a field of its own: rank, path, unit.
type Axis = (u8, Vec<PathStep>, Option<GyroUnit>);

fn find_gyro(
    schema: &Schema,
    sites: &[Site],
    px4: Option<Px4>,
    selection: &mut Selection,
) -> Option<Vec<PathStep>> {
    let mut best: Option<Candidate> = None;
    for site in sites {
        let structure = schema.get(site.structure)?;
        for candidate in gyros_in(schema, site, structure, px4) {
            if best.as_ref().is_none_or(|b| candidate.key < b.key) {
                best = Some(candidate);
            }
        }
    }
    let best = best?;
    selection.found = best.key.0;
    selection.unit = best.unit;
    selection.holder = best.holder;
    if best.delta {
        selection.kind = Some(SampleKind::DeltaAngle);
    }
    selection.batch = batch_of(schema, best.paths.first()?);
    selection.describe(FieldRole::Gyro, schema, &best.whole);
    let first = best.paths.first()?.clone();
    selection.take(best.paths, Slot::GYRO);
    Some(first)
}

fn gyros_in(schema: &Schema, site: &Site, structure: &Struct, px4: Option<Px4>) -> Vec<Candidate> {
    let candidate = |found, rank, paths, whole, unit, delta| Candidate {
        key: (found, site.each, site.depth, rank),
        paths,
        whole,
        holder: structure.name.clone(),
        unit,
        delta,
    };
    let own_name = last_name(&structure.name);
    let mut list = Vec::new();
    let mut axes: [Option<Axis>; 3] = [None, None, None];
    for (index, field) in structure.fields.iter().enumerate() {
        let path = with(&site.path, PathStep::Field(index));
        let vector = |depth| vector(schema, &path, End::from(field), depth);
        match names::meaning(&field.name) {
            Some(Meaning::Gyro { rank, unit }) => list.extend(
                vector(2)
                    .map(|v| candidate(MatchQuality::Named, rank, v, path.clone(), unit, false)),
            ),
            Some(Meaning::DeltaAngle) => list.extend(vector(2).map(|v| {
                candidate(
                    MatchQuality::Named,
                    1,
                    v,
                    path.clone(),
                    Some(GyroUnit::Rad),
                    true,
                )
            })),
            Some(Meaning::GyroAxis { axis, rank, unit }) => {
                let better = |old: &Option<Axis>| old.as_ref().is_none_or(|o| rank < o.0);
                if let Some(slot) = axes.get_mut(usize::from(axis))
                    && End::from(field).number().is_some()
                    && better(slot)
                {
                    *slot = Some((rank, path, unit));
                }
            }
            _ => {
                let found = match (field.name.as_str(), own_name, px4) {
                    ("xyz", _, Some(Px4::VehicleAngularVelocity)) => MatchQuality::Named,
                    ("angular", "Twist", _) => MatchQuality::Twist,
                    ("vector", "Vector3Stamped", _) => MatchQuality::Vector,
                    _ => continue,
                };
                list.extend(vector(0).map(|v| candidate(found, 0, v, path.clone(), None, false)));
            }
        }
    }
    if px4 == Some(Px4::SensorGyro) && site.depth == 0 {
        let end = End {
            kind: Kind::Struct(site.structure),
            many: Many::One,
        };
        let own = vector(schema, &site.path, end, 0);
        list.extend(own.map(|v| candidate(MatchQuality::Named, 0, v, Vec::new(), None, false)));
    }
    if let [Some((rank, x, unit)), Some((_, y, _)), Some((_, z, _))] = axes {
        let whole = x.clone();
        list.push(candidate(
            MatchQuality::Named,
            rank,
            vec![x, y, z],
            whole,
            unit,
            false,
        ));
    }
    list
}

/// Struct that names the body rate: of `imu.gyro.vec.x` the struct `imu`, the outermost in which the rest of the path is
/// still a vector.
fn holder_of(schema: &Schema, gyro: &[PathStep]) -> Option<Vec<PathStep>> {
    let named_in = |path: &Vec<PathStep>| {
        let Some(PathStep::Field(next)) = gyro.get(path.len()) else {
            return false;
        };
        let structure = end_of(schema, path).and_then(|e| e.structure(schema));
        let Some(field) = structure.and_then(|s| s.fields.get(*next)) else {
            return false;
        };
        let own_axis =
            gyro.len() == path.len() + 1 && !matches!(field.name.as_str(), "x" | "y" | "z");
        let is_vector = vector(
            schema,
            &with(path, PathStep::Field(*next)),
            End::from(field),
            2,
        )
        .is_some();
        own_axis || is_vector
    };
    structs_on(schema, gyro).into_iter().rfind(named_in)
}

/// Selects what stands in the same struct as the body rate.
fn beside_gyro(schema: &Schema, gyro: &[PathStep], given: bool, selection: &mut Selection) {
    let Some(site) = holder_of(schema, gyro) else {
        return;
    };
    let Some(structure) = end_of(schema, &site).and_then(|e| e.structure(schema)) else {
        return;
    };
    let named = gyro.get(site.len()).copied();
    let mut accel_axes: [Option<Vec<PathStep>>; 3] = [None, None, None];
    let mut mag_axes: [Option<Vec<PathStep>>; 3] = [None, None, None];
    let mut velocity = None;
    for (index, field) in structure.fields.iter().enumerate() {
        let step = PathStep::Field(index);
        let path = with(&site, step);
        let number = End::from(field).number().is_some();
        if Some(step) == named {
            take_mark(structure, field, &site, Slot::GYRO_MARK, selection);
        }
        match names::meaning(&field.name) {
            Some(Meaning::Accel { .. }) if !selection.has(Slot::ACCEL, 3) => {
                if let Some(paths) = vector(schema, &path, End::from(field), 2) {
                    selection.take(paths, Slot::ACCEL);
                    selection.describe(FieldRole::Accel, schema, &path);
                    take_mark(structure, field, &site, Slot::ACCEL_MARK, selection);
                }
            }
            Some(Meaning::Mag) if !selection.has(Slot::MAG, 3) => {
                if let Some(paths) = vector(schema, &path, End::from(field), 2) {
                    selection.take(paths, Slot::MAG);
                    selection.describe(FieldRole::Mag, schema, &path);
                }
            }
            Some(Meaning::MagAxis { axis }) if number => {
                if let Some(slot) = mag_axes.get_mut(usize::from(axis)) {
                    slot.get_or_insert(path);
                }
            }
            Some(Meaning::Temperature) if number && !selection.has(Slot::TEMPERATURE, 1) => {
                selection.take(vec![path], Slot::TEMPERATURE);
            }
            Some(Meaning::DeltaVelocity) => velocity = vector(schema, &path, End::from(field), 2),
            Some(Meaning::AccelAxis { axis }) if number => {
                if let Some(slot) = accel_axes.get_mut(usize::from(axis)) {
                    slot.get_or_insert(path);
                }
            }
            Some(Meaning::Orientation { .. }) if !selection.has(Slot::ORIENTATION, 4) => {
                if let Some(paths) = quaternion(schema, &path, End::from(field)) {
                    selection.take(paths, Slot::ORIENTATION);
                    selection.describe(FieldRole::Orientation, schema, &path);
                    take_mark(structure, field, &site, Slot::ORIENTATION_MARK, selection);
                }
            }
            Some(Meaning::GyroInterval(unit)) if number && !given => {
                if !selection.has(Slot::INTERVAL, 1) {
                    selection.interval = path_text(schema, &path);
                    selection.take(vec![path], Slot::INTERVAL);
                    selection.form.interval = names::interval_unit(unit, is_float(field));
                }
                selection.kind.get_or_insert(SampleKind::Average);
            }
            Some(Meaning::Interval(unit))
                if number
                    && selection.kind == Some(SampleKind::DeltaAngle)
                    && !selection.has(Slot::INTERVAL, 1) =>
            {
                selection.interval = path_text(schema, &path);
                selection.take(vec![path], Slot::INTERVAL);
                selection.form.interval = unit;
            }
            _ => {}
        }
    }
    if let ([Some(x), Some(y), Some(z)], false) = (accel_axes, selection.has(Slot::ACCEL, 3)) {
        selection.take(vec![x, y, z], Slot::ACCEL);
    }
    if let ([Some(x), Some(y), Some(z)], false) = (mag_axes, selection.has(Slot::MAG, 3)) {
        selection.take(vec![x, y, z], Slot::MAG);
    }
    take_delta_velocity(structure, &site, velocity, selection);
}

/// The vector of a message without a body rate: a specific force, or a magnetic field. The shallowest counts.
fn find_alone(
    schema: &Schema,
    sites: &[Site],
    px4: Option<Px4>,
    wanted: Wanted,
    selection: &mut Selection,
) -> Option<Vec<PathStep>> {
    let (role, slot, _) = wanted.numbers();
    let mark = match wanted {
        Wanted::Forces => Slot::ACCEL_MARK,
        _ => Slot::MAG_MARK,
    };
    let is_root = matches!(
        (px4, wanted),
        (Some(Px4::SensorAccel), Wanted::Forces) | (Some(Px4::SensorMag), Wanted::Fields)
    );
    for site in sites {
        let structure = schema.get(site.structure)?;
        let mut axes: [Option<Vec<PathStep>>; 3] = [None, None, None];
        let mut found = None;
        let is_vector = last_name(&structure.name) == "Vector3Stamped";
        for (index, field) in structure.fields.iter().enumerate() {
            let path = with(&site.path, PathStep::Field(index));
            let axis = match (names::meaning(&field.name), wanted) {
                (Some(Meaning::Accel { .. }), Wanted::Forces)
                | (Some(Meaning::Mag), Wanted::Fields) => {
                    let paths = vector(schema, &path, End::from(field), 2);
                    found = found.or(paths.map(|paths| (paths, path, Some(field))));
                    continue;
                }
                (Some(Meaning::Temperature), Wanted::Temperatures) => {
                    let is_number = End::from(field).number().is_some();
                    let alone = is_number.then(|| (vec![path.clone()], path, None));
                    found = found.or(alone);
                    continue;
                }
                (_, Wanted::Temperatures) => continue,
                _ if is_vector && field.name == "vector" => {
                    let paths = vector(schema, &path, End::from(field), 0);
                    found = found.or(paths.map(|paths| (paths, path, None)));
                    continue;
                }
                (Some(Meaning::AccelAxis { axis }), Wanted::Forces)
                | (Some(Meaning::MagAxis { axis }), Wanted::Fields) => axis,
                _ if is_root && site.depth == 0 => {
                    let Some(axis) = ["x", "y", "z"].iter().position(|axis| field.name == *axis)
                    else {
                        continue;
                    };
                    axis as u8
                }
                _ => continue,
            };
            if let (Some(place), Some(_)) =
                (axes.get_mut(usize::from(axis)), End::from(field).number())
            {
                place.get_or_insert(path);
            }
        }
        if let [Some(x), Some(y), Some(z)] = axes {
            found = found.or(Some((vec![x.clone(), y, z], x, None)));
        }
        let Some((paths, whole, marked)) = found else {
            continue;
        };
        selection.found = MatchQuality::Named;
        selection.holder = structure.name.clone();
        selection.batch = paths.first().and_then(|path| batch_of(schema, path));
        selection.describe(role, schema, &whole);
        if let Some(field) = marked {
            take_mark(structure, field, &site.path, mark, selection);
        }
        let first = paths.first().cloned();
        selection.take(paths, slot);
        return first;
    }
    None
}

fn is_float(field: &Field) -> bool {
    End::from(field).number().is_some_and(Number::is_float)
}

/// A delta velocity is a specific force only with its interval.
fn take_delta_velocity(
    structure: &Struct,
    site: &[PathStep],
    velocity: Option<Vec<Vec<PathStep>>>,
    selection: &mut Selection,
) {
    let interval = structure
        .fields
        .iter()
        .enumerate()
        .find_map(|(index, field)| match names::meaning(&field.name) {
            Some(Meaning::AccelInterval(unit)) => {
                let unit = names::interval_unit(unit, is_float(field));
                Some((with(site, PathStep::Field(index)), unit))
            }
            _ => None,
        });
    if let (Some(velocity), Some((path, unit)), false) =
        (velocity, interval, selection.has(Slot::ACCEL, 3))
    {
        selection.take(velocity, Slot::ACCEL);
        selection.take(vec![path], Slot::ACCEL_INTERVAL);
        selection.form.accel_interval = unit;
    }
}

/// The first element of `<field>_covariance`: -1 marks the field as absent (Imu.msg).
fn take_mark(
    structure: &Struct,
    field: &Field,
    site: &[PathStep],
    slot: Slot,
    selection: &mut Selection,
) {
    let Some(index) = structure.position(&format!("{}_covariance", field.name)) else {
        return;
    };
    let is_array = structure
        .fields
        .get(index)
        .is_some_and(|f| matches!((f.kind, f.many), (Kind::Number(_), Many::Array(1..))));
    if is_array {
        let path = with(&with(site, PathStep::Field(index)), PathStep::At(0));
        selection.take(vec![path], slot);
    }
}

fn find_orientation(
    schema: &Schema,
    sites: &[Site],
    px4: Option<Px4>,
    by_child: bool,
    selection: &mut Selection,
) {
    let alone = selection.found == MatchQuality::Nothing;
    for site in sites {
        // Beside samples of a message's own, an array of orientations belongs to something else.
        if site.each && !alone {
            continue;
        }
        let Some(structure) = schema.get(site.structure) else {
            continue;
        };
        for (index, field) in structure.fields.iter().enumerate() {
            if !matches!(
                names::meaning(&field.name),
                Some(Meaning::Orientation { .. })
            ) {
                continue;
            }
            let mut path = with(&site.path, PathStep::Field(index));
            let paths = if px4 == Some(Px4::VehicleAttitude) && field.many == Many::Array(4) {
                Some((0..4).map(|n| with(&path, PathStep::At(n))).collect())
            } else {
                quaternion(schema, &path, End::from(field))
            };
            let Some(mut paths) = paths else { continue };
            if site.each && !by_child {
                let steps = paths.iter_mut().flatten().chain(&mut path);
                for step in steps.filter(|s| **s == PathStep::Each) {
                    *step = PathStep::At(0);
                }
            }
            if alone {
                selection.batch = paths.first().and_then(|p| batch_of(schema, p));
            }
            selection.take(paths, Slot::ORIENTATION);
            selection.describe(FieldRole::Orientation, schema, &path);
            take_mark(
                structure,
                field,
                &site.path,
                Slot::ORIENTATION_MARK,
                selection,
            );
            let is_counter = |field: &Field| {
                names::meaning(&field.name) == Some(Meaning::OrientationResets)
                    && End::from(field).number().is_some()
            };
            let counter = structure.fields.iter().position(is_counter);
            if let Some(index) = counter.filter(|_| !site.each) {
                selection.take(vec![with(&site.path, PathStep::Field(index))], Slot::RESETS);
            }
            return;
        }
    }
}

pub(super) fn take_stamp(selection: &mut Selection, stamp: StampFields) {
    selection.form.stamp = stamp.form;
    for (path, slot) in stamp.paths {
        selection.picks.push(Pick { path, slot });
    }
}

/// Paths that could fill a role, for the message about one that cannot. At most 40.
pub(super) fn available(schema: &Schema, role: FieldRole) -> Vec<String> {
    let mut list = Vec::new();
    for site in sites(schema) {
        let Some(structure) = schema.get(site.structure) else {
            continue;
        };
        for (index, field) in structure.fields.iter().enumerate() {
            let path = with(&site.path, PathStep::Field(index));
            let end = End::from(field);
            let fits = match role {
                FieldRole::Gyro | FieldRole::Accel | FieldRole::Mag => {
                    vector(schema, &path, end, 0).is_some()
                }
                FieldRole::Orientation => quaternion(schema, &path, end).is_some(),
                FieldRole::Stamp => {
                    stamp_at(schema, &path, end, TimeUnit::ByMagnitude, 2).is_some()
                        && (end.number().is_none() || names::meaning(&field.name).is_some())
                }
                FieldRole::Interval | FieldRole::Temperature => end.number().is_some(),
            };
            if fits {
                list.push(path_text(schema, &path));
            }
            if list.len() >= 40 {
                return list;
            }
        }
    }
    list
}
