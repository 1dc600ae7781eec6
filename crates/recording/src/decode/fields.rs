//! `--field gyro=imu.angular_velocity` -> a role and the paths that fill it. Pure.
//!
//! Apart from the decoders because every encoding takes the same paths.

use strapd_attitude::record::TimeUnit;
use strapd_attitude::setting::{FIELD, GYRO_UNIT};

/// Role of a field.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub enum FieldRole {
    /// Body rate or delta angle: three numbers.
    Gyro,
    /// Specific force: three numbers.
    Accel,
    /// Magnetic field: three numbers.
    Mag,
    /// Orientation: an object with `w`, `x`, `y`, `z`, or four paths in this order.
    Orientation,
    /// The instant of the sample.
    Stamp,
    /// The sample's own integration interval.
    Interval,
    /// Temperature of the sensor, degrees Celsius.
    Temperature,
}

impl FieldRole {
    /// The name used by `--field`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            FieldRole::Gyro => "gyro",
            FieldRole::Accel => "accel",
            FieldRole::Mag => "mag",
            FieldRole::Orientation => "orientation",
            FieldRole::Stamp => "stamp",
            FieldRole::Interval => "dt",
            FieldRole::Temperature => "temperature",
        }
    }

    fn named(name: &str) -> Option<FieldRole> {
        [
            FieldRole::Gyro,
            FieldRole::Accel,
            FieldRole::Mag,
            FieldRole::Orientation,
            FieldRole::Stamp,
            FieldRole::Interval,
            FieldRole::Temperature,
        ]
        .into_iter()
        .find(|role| role.name() == name)
    }

    /// Number of scalars it is made of, when they are given one by one.
    fn scalars(self) -> usize {
        match self {
            FieldRole::Gyro | FieldRole::Accel | FieldRole::Mag => 3,
            FieldRole::Orientation => 4,
            FieldRole::Stamp | FieldRole::Interval | FieldRole::Temperature => 1,
        }
    }
}

/// One step into a message.
#[derive(Clone, PartialEq, Eq, Debug, Hash)]
pub(crate) enum Segment {
    /// The field of this name.
    Name(String),
    /// Element of an array.
    At(u32),
    /// Every element of an array: a batch, one sample each.
    Each,
}

/// One `role=path` of `--field`.
///
/// ```text
/// gyro=imu.angular_velocity      an object x, y, z, or an array of three
/// gyro=wx,wy,wz                  three scalars
/// gyro=samples[].gyro            a batch: one sample per element
/// gyro=data[3],data[4],data[5]   elements of an array
/// stamp=time:us                  with the unit of the number: ns, us, ms, s
/// ```
#[derive(Clone, PartialEq, Eq, Debug, Hash)]
pub struct FieldPath {
    /// Role that it fills.
    pub role: FieldRole,
    /// Text as the user wrote it, for messages.
    pub text: String,
    /// One path, or as many as the role has scalars.
    pub(crate) paths: Vec<Vec<Segment>>,
    /// Unit of a stamp or an interval.
    pub(crate) unit: Option<TimeUnit>,
}

/// A `--field` that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{} {text}: {why}", FIELD)]
pub struct BadFieldPath {
    /// Text as given.
    pub text: String,
    /// Reason why it is refused.
    pub why: String,
}

impl std::str::FromStr for FieldPath {
    type Err = BadFieldPath;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let bad = |why: String| BadFieldPath {
            text: crate::text::printable(text),
            why,
        };
        let (role, right) = text.split_once('=').ok_or_else(|| {
            bad("write it as role=path, for example gyro=imu.angular_velocity".to_owned())
        })?;
        let role = FieldRole::named(role.trim()).ok_or_else(|| {
            bad("the roles are gyro, accel, mag, orientation, stamp, dt, temperature".to_owned())
        })?;
        let (list, unit) = match right.rsplit_once(':') {
            None => (right, None),
            Some(_) if !matches!(role, FieldRole::Stamp | FieldRole::Interval) => {
                return Err(bad(format!(
                    "only stamp and dt take a unit after a colon; see {GYRO_UNIT}"
                )));
            }
            Some((list, unit)) => match TimeUnit::named(unit) {
                Some(unit) => (list, Some(unit)),
                None => return Err(bad("the units are ns, us, ms, s".to_owned())),
            },
        };
        let paths = list
            .split(',')
            .map(|path| path_of(path.trim()))
            .collect::<Option<Vec<_>>>()
            .ok_or_else(|| {
                bad("a path is names between dots; an index goes in brackets: a.b[0].c".to_owned())
            })?;
        if paths.len() != 1 && paths.len() != role.scalars() {
            let why = format!("{} paths; give one, or {}", paths.len(), role.scalars());
            return Err(bad(why));
        }
        Ok(FieldPath {
            role,
            text: list.to_owned(),
            paths,
            unit,
        })
    }
}

/// `a.b[0].c[]` in steps; a slash does what a dot does.
fn path_of(text: &str) -> Option<Vec<Segment>> {
    let mut path = Vec::new();
    for part in text.trim_start_matches('/').split(['.', '/']) {
        let (name, mut brackets) = part.split_at(part.find('[').unwrap_or(part.len()));
        if name.is_empty() {
            return None;
        }
        path.push(Segment::Name(name.to_owned()));
        while !brackets.is_empty() {
            let (index, rest) = brackets.strip_prefix('[')?.split_once(']')?;
            path.push(match index {
                "" => Segment::Each,
                index => Segment::At(index.parse().ok()?),
            });
            brackets = rest;
        }
    }
    (path.len() <= 64).then_some(path)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn paths_split_at_dots_slashes_and_brackets() {
        let field: FieldPath = "gyro=a/b[2].c[]".parse().unwrap();
        let name = |n: &str| Segment::Name(n.to_owned());
        let expected = vec![
            name("a"),
            name("b"),
            Segment::At(2),
            name("c"),
            Segment::Each,
        ];
        assert_eq!((field.role, field.paths), (FieldRole::Gyro, vec![expected]));
        let stamp: FieldPath = "stamp=t:us".parse().unwrap();
        assert_eq!(stamp.unit, Some(TimeUnit::Micro));
    }

    #[test]
    fn a_field_that_can_not_be_read_says_why() {
        for (text, why) in [
            ("gyro", "role=path"),
            ("gryo=a", "the roles are"),
            ("gyro=a,b", "give one, or 3"),
            ("gyro=a..b", "names between dots"),
            ("gyro=a[x]", "names between dots"),
            ("gyro=a[", "names between dots"),
            ("gyro=", "names between dots"),
            ("stamp=t:hours", "the units are"),
            ("gyro=a:ns", "only stamp and dt"),
        ] {
            let error = text.parse::<FieldPath>().unwrap_err().to_string();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
