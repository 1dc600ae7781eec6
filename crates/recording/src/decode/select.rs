//! A message's shape -> the fields that are taken from it. Pure.
//!
//! Apart from the decoders so that `.msg`, IDL and protobuf schemas give the same choice: the
//! shallowest body rate, the stamp nearest to it, what stands beside it.

pub(crate) mod names;
pub(crate) mod search;
mod shapes;

use super::Wanted;
use super::fields::{FieldPath, FieldRole, Segment};
use super::registers::{Form, Slot, StampForm};
use super::schema::{Field, Kind, Many, Schema, Struct};
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::record::SampleKind;
use strapd_attitude::record::TimeUnit;

/// One step from a struct towards a number.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub(crate) enum PathStep {
    /// The field of this index.
    Field(usize),
    /// Element of an array.
    At(u32),
    /// Every element, one sample each.
    Each,
}

/// A number to read, and where it goes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Pick {
    pub(crate) path: Vec<PathStep>,
    pub(crate) slot: Slot,
}

/// Everything that is taken from a message.
#[derive(Clone, Debug, Default)]
pub(crate) struct Selection {
    pub(crate) picks: Vec<Pick>,
    /// Number of the picks, the first ones, that the user gave.
    pub(crate) given: usize,
    pub(crate) form: Form,
    /// The array whose elements are samples.
    pub(crate) batch: Option<Batch>,
    /// The string that names the frame.
    pub(crate) frame: Option<Vec<PathStep>>,
    /// The string `child_frame_id` inside the batch.
    pub(crate) child: Option<Vec<PathStep>>,
    pub(crate) kind: Option<SampleKind>,
    pub(crate) unit: Option<GyroUnit>,
    /// Type of the struct that holds the body rate.
    pub(crate) holder: String,
    /// Way in which the body rate was found; higher is weaker.
    pub(crate) found: MatchQuality,
    /// Path of the interval.
    pub(crate) interval: String,
    /// Paths of stamps, the one to be taken first.
    pub(crate) stamps: Vec<String>,
    /// Description in words, for the user.
    pub(crate) description: Vec<String>,
}

/// An array of structs on the way to the samples.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Batch {
    /// The way to the array.
    pub(crate) path: Vec<PathStep>,
    /// [`PathStep::Each`]: one sample per element; [`PathStep::At`]: only this element.
    pub(crate) element: PathStep,
}

/// Certainty that the three numbers are an IMU's body rate.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub(crate) enum MatchQuality {
    /// Absence of a body rate.
    #[default]
    Nothing,
    /// The user said so.
    Given,
    /// A field whose name means a body rate.
    Named,
    /// The angular part of a twist.
    Twist,
    /// The vector of a `Vector3Stamped`: the topic's name has to say what it is.
    Vector,
}

impl Selection {
    /// Whether all of `n` slots from `slot` are taken.
    pub(crate) fn has(&self, slot: Slot, n: u8) -> bool {
        (0..n).all(|i| self.picks.iter().any(|p| p.slot == slot.plus(i)))
    }

    pub(crate) fn take(&mut self, paths: Vec<Vec<PathStep>>, slot: Slot) {
        for (n, path) in (0_u8..).zip(paths) {
            self.picks.push(Pick {
                path,
                slot: slot.plus(n),
            });
        }
    }

    /// Says which field was taken, for [`super::Stated::description`].
    pub(crate) fn describe(&mut self, role: FieldRole, schema: &Schema, path: &[PathStep]) {
        self.description
            .push(format!("{} {}", role.name(), path_text(schema, path)));
    }
}

/// Chooses the fields: those given by `--field` first, the rest by name.
///
/// # Errors
/// A sentence with the fields there are, when a given path leads nowhere.
pub(crate) fn select(
    schema: &Schema,
    type_name: &str,
    options: &super::Options,
) -> Result<Selection, String> {
    let mut selection = Selection::default();
    // The gyro first: what else is taken depends on whether it comes in batches.
    let mut given: Vec<&FieldPath> = options.fields.iter().collect();
    given.sort_by_key(|field| field.role);
    for field in given {
        take_given(schema, field, options.wanted, &mut selection)?;
    }
    selection.given = selection.picks.len();
    search::complete(schema, type_name, options, &mut selection);
    selection.form.ignore_covariance_flag = options.ignore_covariance_flag;
    search::check(schema, &mut selection)?;
    Ok(selection)
}

fn take_given(
    schema: &Schema,
    field: &FieldPath,
    wanted: Wanted,
    selection: &mut Selection,
) -> Result<(), String> {
    let nowhere = |path: &str| {
        let list = search::available(schema, field.role);
        let list = if list.is_empty() {
            "none that fits".to_owned()
        } else {
            let list: Vec<String> = list
                .iter()
                .map(|path| crate::text::printable(path))
                .collect();
            list.join(", ")
        };
        format!(
            "no {} at `{path}`; fields that fit: {list}",
            field.role.name()
        )
    };
    let mut ends = Vec::new();
    for path in &field.paths {
        ends.push(resolve(schema, path).ok_or_else(|| nowhere(&field.text))?);
    }
    let slot = match field.role {
        FieldRole::Gyro => Slot::GYRO,
        FieldRole::Accel => Slot::ACCEL,
        FieldRole::Mag => Slot::MAG,
        FieldRole::Orientation => Slot::ORIENTATION,
        FieldRole::Stamp => return take_stamp(schema, field, &ends, selection, &nowhere),
        FieldRole::Interval => Slot::INTERVAL,
        FieldRole::Temperature => Slot::TEMPERATURE,
    };
    let first = ends.first().ok_or_else(|| nowhere(&field.text))?.clone();
    let paths = if let [(path, end)] = ends.as_slice() {
        match field.role {
            FieldRole::Orientation => shapes::quaternion(schema, path, *end),
            FieldRole::Interval | FieldRole::Temperature => {
                (end.number().is_some()).then(|| vec![path.clone()])
            }
            _ => shapes::vector(schema, path, *end, 2),
        }
    } else {
        let all = ends.iter().all(|(_, end)| end.number().is_some());
        all.then(|| ends.into_iter().map(|(path, _)| path).collect())
    };
    selection.take(paths.ok_or_else(|| nowhere(&field.text))?, slot);
    if field.role == wanted.numbers().0 {
        selection.found = MatchQuality::Given;
    }
    if matches!(field.role, FieldRole::Gyro | FieldRole::Orientation) && selection.batch.is_none() {
        selection.batch = batch_of(schema, &first.0);
    }
    if field.role == FieldRole::Interval {
        selection.form.interval = field.unit.unwrap_or_default();
        selection.interval = path_text(schema, &first.0);
    }
    selection.describe(field.role, schema, &first.0);
    Ok(())
}

fn take_stamp(
    schema: &Schema,
    field: &FieldPath,
    ends: &[(Vec<PathStep>, End)],
    selection: &mut Selection,
    nowhere: &dyn Fn(&str) -> String,
) -> Result<(), String> {
    let (path, end) = ends.first().ok_or_else(|| nowhere(&field.text))?;
    let unit = field.unit.unwrap_or_default();
    let stamp =
        shapes::stamp_at(schema, path, *end, unit, 2).ok_or_else(|| nowhere(&field.text))?;
    selection.describe(field.role, schema, path);
    search::take_stamp(selection, stamp);
    Ok(())
}

/// End of a path: a field, or an element of one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct End {
    pub(crate) kind: Kind,
    pub(crate) many: Many,
}

impl End {
    /// The number it is, when it is one.
    pub(crate) fn number(self) -> Option<super::schema::Number> {
        match (self.kind, self.many) {
            (Kind::Number(n), Many::One) => Some(n),
            _ => None,
        }
    }

    /// The struct it is, when it is one.
    pub(crate) fn structure(self, schema: &Schema) -> Option<&Struct> {
        match (self.kind, self.many) {
            (Kind::Struct(index), Many::One) => schema.get(index),
            _ => None,
        }
    }
}

impl From<&Field> for End {
    fn from(field: &Field) -> End {
        End {
            kind: field.kind,
            many: field.many,
        }
    }
}

fn resolve(schema: &Schema, path: &[Segment]) -> Option<(Vec<PathStep>, End)> {
    let mut end = End {
        kind: Kind::Struct(schema.root),
        many: Many::One,
    };
    let mut steps = Vec::new();
    let mut eaches = 0;
    for segment in path {
        match segment {
            Segment::Name(name) => {
                let index = end.structure(schema)?.position(name)?;
                steps.push(PathStep::Field(index));
                end = End::from(end.structure(schema)?.fields.get(index)?);
            }
            Segment::At(n) => {
                match end.many {
                    Many::Array(len) if *n < len => {}
                    Many::Sequence => {}
                    _ => return None,
                }
                steps.push(PathStep::At(*n));
                end.many = Many::One;
            }
            Segment::Each => {
                eaches += 1;
                if end.many == Many::One || eaches > 1 {
                    return None;
                }
                steps.push(PathStep::Each);
                end.many = Many::One;
            }
        }
    }
    Some((steps, end))
}

/// The array of structs that a path goes through.
pub(crate) fn batch_of(schema: &Schema, path: &[PathStep]) -> Option<Batch> {
    let mut at = schema.root;
    let mut steps = path.iter().enumerate().peekable();
    while let Some((_, step)) = steps.next() {
        let PathStep::Field(index) = step else {
            continue;
        };
        let Kind::Struct(next) = schema.get(at)?.fields.get(*index)?.kind else {
            return None;
        };
        at = next;
        if let Some((n, element @ (PathStep::Each | PathStep::At(_)))) = steps.peek() {
            return Some(Batch {
                path: path.get(..*n)?.to_vec(),
                element: **element,
            });
        }
    }
    None
}

/// A path in the notation of `--field`.
pub(crate) fn path_text(schema: &Schema, path: &[PathStep]) -> String {
    let mut text = String::new();
    let mut at = Some(schema.root);
    for step in path {
        match step {
            PathStep::Field(index) => {
                let field = at
                    .and_then(|s| schema.get(s))
                    .and_then(|s| s.fields.get(*index));
                if !text.is_empty() {
                    text.push('.');
                }
                text.push_str(field.map_or("?", |f| f.name.as_str()));
                at = match field.map(|f| f.kind) {
                    Some(Kind::Struct(index)) => Some(index),
                    _ => None,
                };
            }
            PathStep::At(n) => text.push_str(&format!("[{n}]")),
            PathStep::Each => text.push_str("[]"),
        }
    }
    text
}

/// A stamp that was found.
pub(crate) struct StampFields {
    pub(crate) form: StampForm,
    pub(crate) paths: Vec<(Vec<PathStep>, Slot)>,
}

/// The unit a stamp of a PX4 message has, whatever its name says.
pub(crate) fn px4_stamp(form: StampForm) -> StampForm {
    match form {
        StampForm::Count(_) => StampForm::Count(TimeUnit::Micro),
        other => other,
    }
}
