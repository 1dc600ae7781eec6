//! `--columns gyro=gx:gy:gz,stamp=t:ms` -> which columns fill which role. Pure.

use super::names::Kind;
use super::units::{Quantity, Unit};
use std::str::FromStr;

/// Role of a column, or of several.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Role {
    Of(Kind),
    Stamp,
    Step,
    Counter,
    Sensor,
    Temperature,
}

const ROLES: [(&str, Role); 11] = [
    ("gyro", Role::Of(Kind::Gyro)),
    ("accel", Role::Of(Kind::Accel)),
    ("mag", Role::Of(Kind::Mag)),
    ("orientation", Role::Of(Kind::Orientation)),
    ("dq", Role::Of(Kind::Turn)),
    ("dv", Role::Of(Kind::Push)),
    ("stamp", Role::Stamp),
    ("dt", Role::Step),
    ("counter", Role::Counter),
    ("sensor", Role::Sensor),
    ("temperature", Role::Temperature),
];

impl Role {
    fn parts(self) -> usize {
        match self {
            Role::Of(kind) => kind.parts(),
            Role::Stamp | Role::Step | Role::Counter | Role::Sensor | Role::Temperature => 1,
        }
    }

    fn quantity(self) -> Option<Quantity> {
        match self {
            Role::Of(kind) => kind.quantity(),
            Role::Stamp | Role::Step => Some(Quantity::Time),
            Role::Temperature => Some(Quantity::Temperature),
            Role::Counter | Role::Sensor => None,
        }
    }
}

/// Statement of the user about a role: columns by name, or by number from 1; none of no columns.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Given {
    pub(crate) role: Role,
    pub(crate) columns: Vec<String>,
    pub(crate) unit: Option<Unit>,
}

/// The roles that the user gives to columns.
///
/// ```text
/// gyro=gx:gy:gz                 three columns by their names
/// gyro=gx:gy:gz:deg/s           and their unit
/// gyro=2:3:4:deg/s*0.0609756    counts, of which one is so many of the unit
/// stamp=1:us                    one by its number, from 1, and its unit
/// orientation=qw:qx:qy:qz       w first
/// dq=dq_W:dq_X:dq_Y:dq_Z        the rotation since the sample before, w first
/// dv=VelInc_X:VelInc_Y:VelInc_Z the velocity that belongs to it, m/s
/// dt=step:ms                    the time since the row before, where there is no stamp
/// counter=PacketCounter         a running number, beside a rate in the file's head
/// temperature=temp:C            the sensor's temperature, and its unit (C, K, F)
/// sensor=device                 the sensor of each row, where a table holds several
/// accel=none                    not to be used
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Columns {
    given: Vec<Given>,
}

impl Columns {
    /// Statement about this role.
    pub(crate) fn of(&self, role: Role) -> Option<&Given> {
        self.given.iter().find(|given| given.role == role)
    }

    pub(crate) fn all(&self) -> &[Given] {
        &self.given
    }
}

impl FromStr for Columns {
    type Err = String;

    fn from_str(text: &str) -> Result<Columns, String> {
        let mut given: Vec<Given> = Vec::new();
        for part in text.split(',') {
            let (name, right) = part.split_once('=').ok_or_else(|| {
                format!("`{part}` is no ROLE=NAME; for example gyro=gx:gy:gz,stamp=t:ms")
            })?;
            let role = ROLES.iter().find(|(known, _)| *known == name.trim());
            let (name, role) = role.copied().ok_or_else(|| {
                let known = ROLES.map(|(known, _)| known).join(", ");
                format!("`{name}` is no role; they are {known}")
            })?;
            if given.iter().any(|before| before.role == role) {
                return Err(format!("{name} is given twice"));
            }
            let mut columns: Vec<String> = Vec::new();
            if right.trim() != "none" {
                columns.extend(right.split(':').map(|column| column.trim().to_owned()));
            }
            let parts = role.parts();
            let mut unit = None;
            if columns.len() == parts + 1
                && let (Some(quantity), Some(text)) = (role.quantity(), columns.pop())
            {
                unit = Some(Unit::of(quantity, &text).ok_or_else(|| {
                    format!("{name}: the unit `{text}` is not known (deg/s, rad/s, m/s^2, g, uT, ns, us, ms, s, ...)")
                })?);
            }
            if !columns.is_empty() && columns.len() != parts {
                return Err(format!(
                    "{name} is made of {parts} columns with : between them, and may be followed by a unit; here are {}",
                    columns.len()
                ));
            }
            if columns.iter().any(String::is_empty) {
                return Err(format!(
                    "{name}: a column without a name; its number, from 1, will do"
                ));
            }
            given.push(Given {
                role,
                columns,
                unit,
            });
        }
        Ok(Columns { given })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_can_not_be_meant_are_refused_with_words() {
        for (text, words) in [
            ("gyro", "no ROLE=NAME"),
            ("gyros=a:b:c", "no role"),
            ("gyro=a:b", "made of 3 columns"),
            ("gyro=a:b:c:furlong", "unit `furlong`"),
            ("gyro=a:b:c,gyro=a:b:c", "given twice"),
            ("gyro=a::c", "without a name"),
            ("stamp=t:ms:s", "made of 1"),
            ("orientation=w:x:y", "made of 4"),
            ("", "no ROLE=NAME"),
        ] {
            let read = text.parse::<Columns>();
            let is_refused = read.as_ref().is_err_and(|why| why.contains(words));
            assert!(is_refused, "{text}: {read:?}");
        }
        assert!(
            "gyro=a:b:c:deg/s*0.06,stamp=1:us,accel=none"
                .parse::<Columns>()
                .is_ok()
        );
    }
}
