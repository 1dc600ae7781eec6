//! Candidates of one kind -> its columns and their unit, or why these cannot be told. Pure.
//!
//! Apart from the roles because each kind is chosen by itself: what makes a table of all of them, and whether a column
//! has two roles, comes after.

use super::super::preamble::Maker;
use super::candidates::{Group, axes_of_maker, bare_axes, candidates, place};
use super::roles::{RoleColumns, Roles};
use crate::columns::{Kind, Meant, Name, Role, Unit};
use crate::decode::Wanted;
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::AccelUnit;
use strapd_attitude::setting::COLUMNS;

impl Roles<'_> {
    /// The columns of a kind, where there are any.
    pub(super) fn chosen(
        &self,
        kind: Kind,
        notes: &mut Vec<String>,
    ) -> Result<Option<RoleColumns>, Diagnostic> {
        if let Some(given) = self.given_of(Role::Of(kind)) {
            if given.columns.is_empty() {
                return Ok(None);
            }
            let places = given.columns.iter().map(|column| place(self.names, column));
            let places: Result<Vec<usize>, String> = places.collect();
            let columns = places.map_err(|why| format!("{COLUMNS} {}: {why}", kind.name()))?;
            let unit = match given.unit {
                Some(unit) => Some(unit),
                None => self.unit(kind, &columns, notes)?.flatten(),
            };
            return Ok(Some(RoleColumns { columns, unit }));
        }
        let mut groups = candidates(self.names, kind);
        if kind == Kind::Accel && self.is_physics_toolbox() {
            // Beside the force stands what is left of it without gravity.
            groups.retain(|group| {
                let first = group.columns.first().and_then(|at| self.names.get(*at));
                first.is_some_and(|name| name.text.to_lowercase().starts_with("gf"))
            });
        }
        if groups.is_empty() && (kind == Kind::Gyro || self.wanted != Wanted::Rates) {
            groups.extend(bare_axes(self.names, self.stem, kind).map(|columns| Group {
                columns,
                twice: None,
            }));
        }
        if groups.is_empty() {
            let columns = axes_of_maker(self.names, self.preamble.maker, kind);
            groups.extend(columns.map(|columns| Group {
                columns,
                twice: None,
            }));
        }
        if groups.len() > 1 {
            groups.retain(|group| group.columns.iter().all(|at| !self.is_empty(*at)));
        }
        self.keep_mended(kind, &mut groups);
        let [group] = groups.as_slice() else {
            if groups.is_empty() {
                self.say_aside(kind, notes);
                return Ok(None);
            }
            return Err(self.several(kind, &groups));
        };
        if let Some([first, second]) = group.twice {
            return Err(Diagnostic::new(format!(
                "{} is there twice, as columns {} and {}: which of them is meant cannot be told",
                self.listed(&[first]),
                first + 1,
                second + 1
            ))
            .help(format!(
                "{COLUMNS} {}={} takes the first, by its number; {}=none neither",
                kind.name(),
                self.references(&group.columns),
                kind.name()
            )));
        }
        let columns = group.columns.clone();
        let Some(unit) = self.unit(kind, &columns, notes)? else {
            return Ok(None);
        };
        Ok(Some(RoleColumns { columns, unit }))
    }

    /// The unit of these columns, by their names, or by what the maker's documents say; `None` where a role that can be
    /// done without has an unknown one.
    fn unit(
        &self,
        kind: Kind,
        columns: &[usize],
        notes: &mut Vec<String>,
    ) -> Result<Option<Option<Unit>>, Diagnostic> {
        let names: Vec<&Name> = columns
            .iter()
            .filter_map(|at| self.names.get(*at))
            .collect();
        let Some(first) = names.first() else {
            return Ok(Some(None));
        };
        if let Some(other) = names.iter().find(|name| name.unit != first.unit) {
            return Err(Diagnostic::new(format!(
                "its {} has several units: `{}` and `{}`",
                kind.name(),
                first.text,
                other.text
            ))
            .help(format!(
                "{COLUMNS} {}={}:UNIT, where all of them are of one",
                kind.name(),
                self.references(columns)
            )));
        }
        Ok(match (&first.unit, kind) {
            (Some(Ok(unit)), _) => Some(Some(self.upward(kind, columns, *unit))),
            (Some(Err(unit)), Kind::Gyro) => {
                return Err(Diagnostic::new(format!(
                    "the unit `{unit}` of its rates is not known"
                ))
                .help(format!(
                    "{COLUMNS} gyro={}:deg/s (or rad/s, mrad/s, mdps)",
                    self.references(columns)
                )));
            }
            (Some(Err(unit)), Kind::Accel) => {
                notes.push(format!(
                    "{} are not used: their unit `{unit}` is not known ({COLUMNS} accel={}:g)",
                    self.listed(columns),
                    self.references(columns)
                ));
                None
            }
            _ => Some(self.unit_of_maker(kind, first)),
        })
    }

    /// Unit that the maker's documents give to a column that states none.
    fn unit_of_maker(&self, kind: Kind, name: &Name) -> Option<Unit> {
        let head = self.preamble;
        let si = Unit::Force(AccelUnit::MetresPerSecondSquared, 1.0);
        let gravities = |scale: f64| Unit::Force(AccelUnit::StandardGravity, scale);
        let rad = Unit::Rate(GyroUnit::Rad, 1.0);
        let is_named = |stem: &str| name.text.to_lowercase().starts_with(stem);
        match (head.maker, kind) {
            (Maker::Gyroflow, Kind::Gyro) => {
                head.gscale.map(|scale| Unit::Rate(GyroUnit::Rad, scale))
            }
            (Maker::Gyroflow, Kind::Accel) => head.ascale.map(gravities),
            (Maker::Gyroflow, Kind::Mag) => head.mscale.map(|scale| Unit::Field(scale * 1e-4)),
            (Maker::Xsens, Kind::Gyro) if is_named("gyr_") => Some(rad),
            (Maker::Dot, Kind::Gyro) if is_named("gyr_") => Some(Unit::Rate(GyroUnit::Deg, 1.0)),
            (Maker::Xsens | Maker::Dot, Kind::Accel) if is_named("acc_") => Some(si),
            (_, Kind::Gyro) if self.is_physics_toolbox() || name.text.len() == 1 => Some(rad),
            (_, Kind::Accel) if self.is_physics_toolbox() => Some(gravities(1.0)),
            (_, Kind::Mag) if self.is_physics_toolbox() => Some(Unit::Field(1e-6)),
            _ => None,
        }
    }

    /// Physics Toolbox has the force in g beside what is left of it without gravity.
    fn is_physics_toolbox(&self) -> bool {
        self.names
            .iter()
            .any(|name| name.text.eq_ignore_ascii_case("gfx"))
    }

    fn say_aside(&self, kind: Kind, notes: &mut Vec<String>) {
        let each = self.names.iter().enumerate();
        let aside: Vec<(usize, &str)> = each
            .filter_map(|(at, name)| match name.meant {
                Meant::Aside { kind: of, why } if of == kind => Some((at, why)),
                _ => None,
            })
            .collect();
        if let Some((_, why)) = aside.first() {
            let columns: Vec<usize> = aside.iter().map(|(at, _)| *at).take(3).collect();
            notes.push(format!(
                "{} is not used, since it {why}: {COLUMNS} {}={} uses it",
                self.listed(&columns),
                kind.name(),
                self.references(&columns)
            ));
        }
    }

    fn several(&self, kind: Kind, groups: &[Group]) -> Diagnostic {
        let each: Vec<String> = groups.iter().map(|g| self.listed(&g.columns)).collect();
        let flags: Vec<String> = groups
            .iter()
            .map(|g| format!("{COLUMNS} {}={}", kind.name(), self.references(&g.columns)))
            .collect();
        let none = match kind {
            Kind::Gyro => String::new(),
            _ => format!(", or {COLUMNS} {}=none", kind.name()),
        };
        Diagnostic::new(format!(
            "its {} may be {}: which is meant cannot be told",
            kind.name(),
            each.join(" or ")
        ))
        .help(format!("{}{none}", flags.join(", or ")))
    }
}
