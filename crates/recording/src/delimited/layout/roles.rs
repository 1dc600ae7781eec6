//! Names, units and first rows -> which column is what, or why that cannot be told. Pure.

use super::super::column::Column;
use super::super::preamble::{Maker, Preamble};
use super::super::rows::{Scales, Table};
use super::instants::Instants;
use super::{columns, is_number, number};
use crate::columns::Delimiter;
use crate::columns::Unit;
use crate::columns::{Columns, Given, Role};
use crate::columns::{Kind, Meant, Name};
use crate::decode::Wanted;
use std::collections::BTreeMap;
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::frames::BodyAxes;
use strapd_attitude::record::{AccelUnit, SampleKind};
use strapd_attitude::setting::{BODY, COLUMNS};

/// Table before its roles are known.
pub(super) struct Roles<'l> {
    pub(super) names: &'l [Name],
    /// The first rows.
    pub(super) rows: &'l [Vec<String>],
    pub(super) preamble: &'l Preamble,
    pub(super) given: Option<&'l Columns>,
    pub(super) stem: &'l str,
    pub(super) wanted: Wanted,
    /// Whether the samples' time is another than that of the rows.
    pub(super) are_stamps_unread: bool,
}

/// Columns that may be a vector.
pub(super) struct Group {
    pub(super) columns: Vec<usize>,
    /// A column of which there is another of the same meaning.
    twice: Option<[usize; 2]>,
}

/// Columns that are one.
pub(super) struct RoleColumns {
    pub(super) columns: Vec<usize>,
    pub(super) unit: Option<Unit>,
}

/// Roles of a table with the columns that fill them.
struct Fillings {
    gyro: Option<RoleColumns>,
    accel: Option<RoleColumns>,
    mag: Option<RoleColumns>,
    orientation: Option<RoleColumns>,
    matrix: Option<RoleColumns>,
    turn: Option<RoleColumns>,
    push: Option<RoleColumns>,
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

/// Role of a table: its columns, its kind, and what a column of it is by its part.
type Filling<'c> = (Option<&'c RoleColumns>, Kind, fn(usize) -> Column);

/// Columns with what each of them is, and the words that would give them so.
type RolePlacement = (Vec<(usize, Column)>, Vec<String>);

impl Fillings {
    /// Each role with its columns, and what a column of it is by its part.
    fn each(&self) -> [Filling<'_>; 7] {
        [
            (self.gyro.as_ref(), Kind::Gyro, Column::Gyro),
            (self.accel.as_ref(), Kind::Accel, Column::Accel),
            (self.mag.as_ref(), Kind::Mag, Column::Mag),
            (
                self.orientation.as_ref(),
                Kind::Orientation,
                Column::Orientation,
            ),
            (self.matrix.as_ref(), Kind::Matrix, Column::Matrix),
            (self.turn.as_ref(), Kind::Turn, Column::Turn),
            (self.push.as_ref(), Kind::Push, Column::Accel),
        ]
    }

    /// States units and factors of the columns in the table; `period` is the time from row to row in ns.
    fn declare_units(&self, table: &mut Table, period: Option<i64>) {
        let unit = |chosen: &Option<RoleColumns>| chosen.as_ref().and_then(|chosen| chosen.unit);
        let mut scales = Scales::default();
        if let Some(Unit::Rate(unit, scale)) = unit(&self.gyro) {
            table.declared.gyro_unit = Some(unit);
            scales.gyro = scale;
        }
        if let Some(Unit::Force(unit, scale)) = unit(&self.accel) {
            table.declared.accel_unit = Some(unit);
            scales.accel = scale;
        }
        if let (Some(_), Some(period)) = (&self.push, period) {
            table.declared.accel_unit = Some(AccelUnit::MetresPerSecondSquared);
            scales.accel = 1e9 / period as f64;
        }
        if self.turn.is_some() {
            table.declared.sample_kind = Some(SampleKind::Rotation);
            table.declared.gyro_unit = Some(GyroUnit::Rad);
            table.interval = period;
        }
        if let Some(Unit::Field(scale)) = unit(&self.mag) {
            scales.mag = scale;
        }
        table.scales = scales;
    }
}

impl Roles<'_> {
    /// The table.
    ///
    /// # Errors
    /// What cannot be told, with the flag that tells it.
    pub(super) fn table(&self, header: &[u8], delimiter: Delimiter) -> Result<Table, Diagnostic> {
        let mut notes = Vec::new();
        let gyro = self.chosen(Kind::Gyro, &mut notes)?;
        let accel = self.chosen(Kind::Accel, &mut notes)?;
        let turn = match gyro {
            None => self.chosen(Kind::Turn, &mut notes)?,
            Some(_) => None,
        };
        let mag = self.chosen(Kind::Mag, &mut notes)?;
        let orientation = self.chosen(Kind::Orientation, &mut notes)?;
        let matrix = match orientation {
            None => self.chosen(Kind::Matrix, &mut notes)?,
            Some(_) => None,
        };
        let is_beside = self.wanted != Wanted::Rates && (accel.is_some() || mag.is_some());
        let is_nothing = [&gyro, &turn, &orientation, &matrix]
            .iter()
            .all(|chosen| chosen.is_none());
        if is_nothing && !is_beside {
            return Err(
                Diagnostic::new("none of its columns is a rate or an orientation").help(format!(
                    "{COLUMNS} gyro=NAME:NAME:NAME; they are {}",
                    self.listed(&(0..self.names.len().min(16)).collect::<Vec<_>>())
                )),
            );
        }
        let instants = self.instants()?;
        let period = self.period(&instants);
        let push = match accel {
            None => self.push(period, &mut notes)?,
            Some(_) => None,
        };
        let fillings = Fillings {
            gyro,
            accel,
            mag,
            orientation,
            matrix,
            turn,
            push,
        };
        let whose = self.whose(fillings.gyro.as_ref().or(fillings.turn.as_ref()))?;
        let (mut of, mut assumed) = self.placed(&fillings, &instants)?;
        let temperature = self.temperature()?;
        if let Some((at, said, _)) = &temperature {
            if of.iter().any(|(taken, _)| taken == at) {
                return Err(self.two_roles(*at));
            }
            of.push((*at, Column::Temperature));
            assumed.push(said.clone());
        }
        let is_free = |at: &usize| of.iter().all(|(taken, _)| taken != at);
        let date = instants.date.filter(is_free).map(|at| (at, Column::Date));
        of.extend(date);
        let free = |(at, _): &(usize, Column)| of.iter().all(|(taken, _)| taken != at);
        let sensors: Vec<(usize, Column)> = whose.placed().filter(free).collect();
        of.extend(sensors);
        assumed.extend(whose.said);
        let mut table = Table::of_columns(header, columns(self.names, &of), delimiter);
        table.clock = instants.clock;
        table.usual_sensor = whose.usual;
        notes.extend(instants.notes);
        table.has_decimal_comma = self.has_decimal_comma(&of);
        fillings.declare_units(&mut table, period);
        if let Some((_, _, Unit::Temperature(scale, zero))) = temperature {
            table.scales.temperature = [scale, zero];
        }
        if let Some(axes) = &self.preamble.orientation
            && !self.preamble.is_ours
        {
            notes.push(match axes.parse::<BodyAxes>() {
                Ok(_) => format!(
                    "its head says orientation,{axes}: axes are as recorded unless {BODY} {axes} is given"
                ),
                Err(_) => format!(
                    "its head says orientation,{axes}, which no body has: three letters, each axis once; axes are as recorded"
                ),
            });
        }
        table.assumed = assumed.join(",");
        table.notes = notes;
        Ok(table)
    }

    /// Column of each role, and the words that would give them so.
    ///
    /// # Errors
    /// A column that fills two roles.
    fn placed(
        &self,
        fillings: &Fillings,
        instants: &Instants,
    ) -> Result<RolePlacement, Diagnostic> {
        let mut of: Vec<(usize, Column)> = Vec::new();
        let mut assumed = Vec::new();
        for (chosen, kind, column) in fillings.each() {
            let Some(chosen) = chosen else {
                let given = self.given_of(Role::Of(kind));
                if given.is_some_and(|given| given.columns.is_empty()) {
                    assumed.push(format!("{}=none", kind.name()));
                }
                continue;
            };
            let places = chosen.columns.iter().enumerate();
            of.extend(places.map(|(part, at)| (*at, column(part))));
            if kind != Kind::Matrix {
                let mut said: Vec<String> = chosen
                    .columns
                    .iter()
                    .map(|at| self.reference(*at))
                    .collect();
                let given = self.given_of(Role::Of(kind)).and_then(|given| given.unit);
                let named = || chosen.unit.and_then(Unit::said);
                said.extend(given.map(Unit::stated).or_else(named));
                assumed.push(format!("{}={}", kind.name(), said.join(":")));
            }
        }
        if let Some((at, said)) = &instants.column {
            of.push((*at, Column::Stamp));
            assumed.push(said.clone());
        }
        let twice = |(n, (at, _)): (usize, &(usize, Column))| {
            let mut before = of.iter().take(n);
            before.any(|(other, _)| other == at).then_some(*at)
        };
        if let Some(at) = of.iter().enumerate().find_map(twice) {
            return Err(self.two_roles(at));
        }
        Ok((of, assumed))
    }

    fn two_roles(&self, at: usize) -> Diagnostic {
        Diagnostic::new(format!("column {} has two roles", self.listed(&[at])))
            .help(format!("{COLUMNS} gives each its own"))
    }

    /// The column of a temperature, the words that give it, and its unit: of several by name that of the gyro, else the
    /// first, in degrees Celsius where nothing says another.
    ///
    /// # Errors
    /// A column that was named and is not there.
    fn temperature(&self) -> Result<Option<(usize, String, Unit)>, Diagnostic> {
        const NAME: &str = "temperature";
        let celsius = Unit::Temperature(1.0, 0.0);
        let given = self.given_of(Role::Temperature);
        let unit_of = |at: usize| match self.names.get(at).and_then(|name| name.unit.as_ref()) {
            Some(Ok(unit @ Unit::Temperature(..))) => Some(*unit),
            // In brackets, and none of it.
            Some(_) => None,
            None => Some(celsius),
        };
        let found = match given.map(|given| given.columns.as_slice()) {
            Some([]) => None,
            Some([column, ..]) => {
                let at =
                    place(self.names, column).map_err(|why| format!("{COLUMNS} {NAME}: {why}"))?;
                let stated = given.and_then(|given| given.unit);
                Some((at, stated.or(unit_of(at)).unwrap_or(celsius)))
            }
            None => {
                let each = self.names.iter().enumerate();
                let ranked = each.filter_map(|(at, name)| match name.meant {
                    Meant::Temperature(rank) if !self.is_empty(at) => Some((rank, at)),
                    _ => None,
                });
                ranked.min().and_then(|(_, at)| Some((at, unit_of(at)?)))
            }
        };
        Ok(found.map(|(at, unit)| {
            let said = format!("{NAME}={}:{}", self.reference(at), unit.stated());
            (at, said, unit)
        }))
    }

    pub(super) fn given_of(&self, role: Role) -> Option<&Given> {
        self.given.and_then(|given| given.of(role))
    }

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

    /// Whether a column has nothing in the first rows.
    pub(super) fn is_empty(&self, at: usize) -> bool {
        let cell = |row: &Vec<String>| row.get(at).is_none_or(String::is_empty);
        !self.rows.is_empty() && self.rows.iter().all(cell)
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

    /// Columns by name, for people.
    pub(super) fn listed(&self, columns: &[usize]) -> String {
        let names = columns.iter().filter_map(|at| self.names.get(*at));
        let names: Vec<String> = names.map(|name| format!("`{}`", name.text)).collect();
        names.join(", ")
    }

    /// Reference to a column in `--columns`: its name, or its number where the name cannot be written there.
    pub(super) fn reference(&self, at: usize) -> String {
        let name = self.names.get(at).map_or("", |name| name.text.as_str());
        let is_plain = !name.is_empty()
            && number(name).is_none()
            && !name.contains([',', ':', '=', '\'', '\\'])
            && place(self.names, name) == Ok(at);
        match is_plain {
            true => name.to_owned(),
            false => (at + 1).to_string(),
        }
    }

    fn references(&self, columns: &[usize]) -> String {
        let all: Vec<String> = columns.iter().map(|at| self.reference(*at)).collect();
        all.join(":")
    }

    /// Whether most numbers of the first rows have a comma for their point.
    fn has_decimal_comma(&self, of: &[(usize, Column)]) -> bool {
        let cells = self
            .rows
            .iter()
            .flat_map(|row| of.iter().filter_map(|(at, _)| row.get(*at)));
        let numbers = cells.filter(|cell| is_number(cell));
        let (commas, points) = numbers.fold((0, 0), |(commas, points), cell| {
            (
                commas + usize::from(cell.contains(',')),
                points + usize::from(cell.contains('.')),
            )
        });
        commas > points
    }
}
