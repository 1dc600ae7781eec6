//! Columns of increments and of steps -> over how long they were taken, and where rows lie in time. Pure.
//!
//! Apart from stamps because a step says only how far a row is from the one before it, and an increment nothing at
//! all of how long it took.

use super::super::clock::Clock;
use super::candidates::place;
use super::instants::Instants;
use super::roles::{RoleColumns, Roles};
use crate::columns::{Kind, Meant, Role, Unit};
use crate::decode::{Bare, bare_of_text, units_of_steps};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::TimeUnit;
use strapd_attitude::setting::COLUMNS;

impl Roles<'_> {
    /// Instants by the steps since the row before; `None` where there is no column of them.
    pub(super) fn stepped(&self) -> Result<Option<Instants>, Diagnostic> {
        let given = self.given_of(Role::Step);
        if given.is_some_and(|given| given.columns.is_empty()) {
            return Ok(None);
        }
        let named = given.and_then(|given| given.columns.first());
        let named = named
            .map(|column| place(self.names, column).map_err(|why| format!("{COLUMNS} dt: {why}")));
        let found: Vec<usize> = match named.transpose()? {
            Some(at) => vec![at],
            None => {
                let each = self.names.iter().enumerate();
                each.filter(|(at, name)| name.meant == Meant::Step && !self.is_empty(*at))
                    .map(|(at, _)| at)
                    .collect()
            }
        };
        let at = match found.as_slice() {
            [] => return Ok(None),
            [at] => *at,
            [first, ..] => {
                return Err(Diagnostic::new(format!(
                    "the step since the row before may be {}: which is meant cannot be told",
                    self.listed(&found)
                ))
                .help(format!("{COLUMNS} dt={}", self.reference(*first))));
            }
        };
        let nanos = match given.and_then(|given| given.unit) {
            Some(Unit::Time(nanos)) => nanos,
            _ => self.unit_of_steps(at)?,
        };
        let unit = Unit::Time(nanos).name().unwrap_or("ns");
        let clock = Clock::Steps {
            nanos: nanos as i64,
            sum: 0,
        };
        Ok(Some(Instants {
            date: None,
            clock,
            column: Some((at, format!("dt={}:{unit}", self.reference(at)))),
            notes: vec![format!(
                "stamps are sums of {}, each the time since the row before",
                self.listed(&[at])
            )],
        }))
    }

    /// Nanoseconds in one of a column of steps: its name's unit, if such steps are those of a gyro; else the one of
    /// ns, us, ms and s in which they are.
    fn unit_of_steps(&self, at: usize) -> Result<f64, Diagnostic> {
        let numbers = self.numbers(at);
        let steps: Vec<Bare> = numbers.iter().filter_map(|n| bare_of_text(n)).collect();
        let told = units_of_steps(steps);
        let listed = self.listed(&[at]);
        let help = |unit: &str| format!("{COLUMNS} dt={}:{unit}", self.reference(at));
        let stated = self.names.get(at).and_then(|name| name.unit.clone());
        match (stated, told) {
            (Some(Err(unit)), _) => Err(Diagnostic::new(format!(
                "the unit `{unit}` of the steps in {listed} is not known"
            ))
            .help(help("ms, or :s, :us, :ns"))),
            (Some(Ok(Unit::Time(nanos))), Some((step, fits))) => {
                let is_it = |unit: &TimeUnit| unit.nanos(0.0) as f64 == nanos;
                match fits.first().filter(|_| !fits.iter().any(is_it)) {
                    None => Ok(nanos),
                    Some(other) => Err(Diagnostic::new(format!(
                        "{listed} says its unit, but steps of {step} are those of a gyro only in {}",
                        other.name()
                    ))
                    .help(help(other.name()))),
                }
            }
            (Some(Ok(Unit::Time(nanos))), None) => Ok(nanos),
            (_, Some((step, fits))) => match fits.as_slice() {
                [unit] => Ok(unit.nanos(0.0) as f64),
                _ => {
                    let names: Vec<&str> = fits.iter().map(|unit| unit.name()).collect();
                    let may_be = match names.is_empty() {
                        true => "in no unit are they those of a gyro (20 us to 2 s)".to_owned(),
                        false => format!("it may be {}", names.join(" or ")),
                    };
                    Err(Diagnostic::new(format!(
                        "the unit of the steps in {listed} ({step}) cannot be told: {may_be}"
                    ))
                    .help(help("ms, or :s, :us, :ns")))
                }
            },
            (_, None) => Err(Diagnostic::new(format!(
                "none of the first rows has a step above zero in {listed}, which says the time since the row before"
            ))
            .help(format!(
                "{COLUMNS} dt=none, with a stamp or a rate in its place; or dt={}:UNIT",
                self.reference(at)
            ))),
        }
    }

    /// Period of the rows, ns: by the rate in the head, else by the median step of the first stamps.
    pub(super) fn period(&self, instants: &Instants) -> Option<i64> {
        if let Some(rate) = &self.preamble.rate {
            return Some((1e9 / rate.hz).round() as i64);
        }
        let (at, _) = instants.column.as_ref()?;
        let mut clock = instants.clock.clone();
        let stamps = self.numbers(*at).into_iter();
        let stamps: Vec<i64> = stamps
            .filter_map(|number| clock.read(&number).ok())
            .map(|stamp| stamp.0)
            .collect();
        let steps = stamps.windows(2).filter_map(|pair| match pair {
            [a, b] => Some(b.saturating_sub(*a)).filter(|step| *step > 0),
            _ => None,
        });
        let mut steps: Vec<i64> = steps.collect();
        steps.sort_unstable();
        steps.get(steps.len() / 2).copied()
    }

    /// Increments of the velocity, which are a specific force over the time they were taken.
    pub(super) fn push(
        &self,
        period: Option<i64>,
        notes: &mut Vec<String>,
    ) -> Result<Option<RoleColumns>, Diagnostic> {
        let Some(found) = self.chosen(Kind::Push, notes)? else {
            return Ok(None);
        };
        let listed = self.listed(&found.columns);
        let Some(period) = period else {
            notes.push(format!(
                "{listed} are not used: over how long they were taken is said nowhere"
            ));
            return Ok(None);
        };
        notes.push(format!(
            "the specific force is {listed} over {} ms",
            period as f64 * 1e-6
        ));
        Ok(Some(found))
    }
}
