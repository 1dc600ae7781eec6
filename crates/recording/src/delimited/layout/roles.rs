//! Names, units and first rows -> which column is what, or why that cannot be told. Pure.

use super::super::column::Column;
use super::super::preamble::Preamble;
use super::super::rows::{Scales, Table};
use super::candidates::place;
use super::instants::Instants;
use super::{columns, is_number, number};
use crate::columns::Delimiter;
use crate::columns::Unit;
use crate::columns::{Columns, Given, Role};
use crate::columns::{Kind, Meant, Name};
use crate::decode::Wanted;
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

    /// Whether a column has nothing in the first rows.
    pub(super) fn is_empty(&self, at: usize) -> bool {
        let cell = |row: &Vec<String>| row.get(at).is_none_or(String::is_empty);
        !self.rows.is_empty() && self.rows.iter().all(cell)
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

    pub(super) fn references(&self, columns: &[usize]) -> String {
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
