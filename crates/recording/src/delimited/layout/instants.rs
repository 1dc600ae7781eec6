//! Columns of stamps, counters and rates -> how rows are placed in time. Pure.
//!
//! Apart from the other roles because any of several columns may place a row in time, and none of them need be there.

mod counts;
mod written;

use super::super::clock::{Clock, Wraps};
use super::candidates::place;
use super::roles::Roles;
use crate::columns::Meant;
use crate::columns::Quantity;
use crate::columns::Role;
use crate::columns::Unit;
use crate::columns::words;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::{COLUMNS, RATE_HZ, TIME};

/// Instants of the rows.
pub(super) struct Instants {
    pub(super) clock: Clock,
    /// The column that says it, and what `--columns` calls it.
    pub(super) column: Option<(usize, String)>,
    /// The column of its days.
    pub(super) date: Option<usize>,
    pub(super) notes: Vec<String>,
}

/// One column of stamps.
struct Stamp {
    at: usize,
    clock: Clock,
    unit: Option<Unit>,
    /// Whole nanoseconds.
    is_exact: bool,
    note: Option<String>,
    /// The column of its days.
    date: Option<usize>,
}

impl Stamp {
    fn of_split((seconds, at, nanos): (usize, usize, i64)) -> Stamp {
        Stamp {
            at,
            clock: Clock::Split { nanos },
            unit: None,
            is_exact: true,
            note: None,
            date: Some(seconds),
        }
    }
}

/// A counter of packets has 16 bits.
const COUNTER_WIDTH: i64 = 1 << 16;
/// Nanoseconds of a second.
const SECOND: f64 = 1e9;

impl Roles<'_> {
    /// Finds the rule by which rows are placed in time.
    pub(super) fn instants(&self) -> Result<Instants, Diagnostic> {
        let given = self.given_of(Role::Stamp);
        let is_refused = given.is_some_and(|given| given.columns.is_empty());
        if let Some(given) = given.filter(|given| !given.columns.is_empty()) {
            let column = given.columns.first().map_or("", String::as_str);
            let at = place(self.names, column).map_err(|why| format!("{COLUMNS} stamp: {why}"))?;
            let split = self.split_second().filter(|(seconds, parts, _)| {
                given.unit.is_none() && [*seconds, *parts].contains(&at)
            });
            return Ok(match split {
                Some(split) => self.of_stamp(Stamp::of_split(split)),
                None => self.of_stamp(self.stamp(at, given.unit)?),
            });
        }
        let is_asked = [Role::Stamp, Role::Counter, Role::Step]
            .iter()
            .any(|role| self.given_of(*role).is_some());
        if let Some(split) = self.split_second().filter(|_| !is_asked) {
            return Ok(self.of_stamp(Stamp::of_split(split)));
        }
        if let Some(at) = self.stamp_beside().filter(|_| !is_asked) {
            return Ok(self.of_stamp(self.stamp(at, Some(Unit::Time(SECOND)))?));
        }
        let each = self.names.iter().enumerate();
        let is_stamp =
            |at: usize, meant: &Meant| *meant == Meant::Stamp && !is_refused && !self.is_empty(at);
        let columns: Vec<usize> = each
            .filter(|(at, name)| is_stamp(*at, &name.meant))
            .map(|(at, _)| at)
            .collect();
        let is_counted = self.given_of(Role::Counter).is_some();
        let says = |role| {
            self.given_of(role)
                .is_some_and(|given| !given.columns.is_empty())
        };
        if says(Role::Step)
            && let Some(stepped) = self.stepped()?
        {
            return Ok(stepped);
        }
        match columns.as_slice() {
            _ if is_counted => self.counted(),
            [] => match (self.stepped()?, self.time_of_day()) {
                (Some(stepped), _) => Ok(stepped),
                (None, Some(stamp)) => Ok(self.of_stamp(stamp)),
                (None, None) => match self.called_as_unit().filter(|_| !is_refused) {
                    Some((at, unit)) => Ok(self.of_stamp(self.stamp(at, Some(unit))?)),
                    None => self.counted(),
                },
            },
            [one] => Ok(self.of_stamp(self.stamp(*one, None)?)),
            several => {
                let stamps = several.iter().filter_map(|at| self.stamp(*at, None).ok());
                let mut exact = stamps.filter(|stamp| stamp.is_exact);
                match (exact.next(), exact.next()) {
                    (Some(one), None) => Ok(self.of_stamp(one)),
                    _ => Err(Diagnostic::new(format!(
                        "its stamp may be {}: which is meant cannot be told",
                        self.listed(several)
                    ))
                    .help(format!(
                        "{COLUMNS} stamp={}",
                        several
                            .first()
                            .map_or_else(String::new, |at| self.reference(*at))
                    ))),
                }
            }
        }
    }

    /// Columns of whole seconds and of the parts of a second, so many nanoseconds each: named alike but for the unit, as
    /// ROS and `timeval` write a time.
    fn split_second(&self) -> Option<(usize, usize, i64)> {
        const SECONDS: &[&str] = &["s", "sec", "secs", "second", "seconds"];
        const PARTS: &[(i64, &[&str])] = &[
            (
                1,
                &[
                    "ns",
                    "nsec",
                    "nsecs",
                    "nanosec",
                    "nanosecs",
                    "nanosecond",
                    "nanoseconds",
                ],
            ),
            (1_000, &["us", "usec", "usecs", "microsec", "microseconds"]),
        ];
        let named: Vec<Vec<String>> = self.names.iter().map(|name| words(&name.text)).collect();
        let whole = |at: usize| -> Option<Vec<i64>> {
            let cells = self.rows.iter().filter_map(|row| row.get(at));
            cells.map(|cell| cell.trim().parse().ok()).collect()
        };
        named.iter().enumerate().find_map(|(parts_at, name)| {
            let (unit, stem) = name.split_last()?;
            let (nanos, _) = PARTS.iter().find(|(_, all)| all.contains(&unit.as_str()))?;
            let seconds_at = named.iter().position(|other| {
                let split = other.split_last();
                split.is_some_and(|(unit, of)| of == stem && SECONDS.contains(&unit.as_str()))
            })?;
            let (parts, seconds) = (whole(parts_at)?, whole(seconds_at)?);
            let are_parts = parts
                .iter()
                .all(|part| (0..1_000_000_000 / nanos).contains(part));
            (are_parts && seconds.len() == parts.len() && !parts.is_empty())
                .then_some((seconds_at, parts_at, *nanos))
        })
    }

    /// A column called `ms`, `us` or `ns` and no more, in a table that has no other time, whose numbers rise: what a
    /// board prints of its clock.
    fn called_as_unit(&self) -> Option<(usize, Unit)> {
        let mut each = self.names.iter().enumerate();
        let (at, name) = each.find(|(_, name)| {
            ["ms", "us", "ns"].contains(&name.text.trim().to_lowercase().as_str())
        })?;
        let cells = self.rows.iter().filter_map(|row| row.get(at));
        let numbers: Option<Vec<f64>> = cells.map(|cell| cell.parse().ok()).collect();
        let numbers = numbers?;
        let rises = numbers.windows(2).all(|pair| pair.first() <= pair.last());
        let has_moved = numbers.len() < 2 || numbers.first() < numbers.last();
        let unit = Unit::of(Quantity::Time, name.text.trim())?;
        (rises && has_moved).then_some((at, unit))
    }

    fn of_stamp(&self, stamp: Stamp) -> Instants {
        let mut said = format!("stamp={}", self.reference(stamp.at));
        let given = self.given_of(Role::Stamp).and_then(|given| given.unit);
        let named = stamp.unit.and_then(Unit::name).map(str::to_owned);
        if let Some(unit) = given.map(Unit::stated).or(named) {
            said.push_str(&format!(":{unit}"));
        }
        Instants {
            clock: stamp.clock,
            column: Some((stamp.at, said)),
            date: stamp.date,
            notes: stamp.note.into_iter().collect(),
        }
    }

    /// Instants by a running number, or none, and the rate of the file's head.
    fn counted(&self) -> Result<Instants, Diagnostic> {
        let given = self.given_of(Role::Counter);
        let column = match given.and_then(|given| given.columns.first()) {
            Some(column) => {
                Some(place(self.names, column).map_err(|why| format!("{COLUMNS} counter: {why}"))?)
            }
            None if given.is_some() => None,
            None => {
                let mut each = self.names.iter().enumerate();
                let found = each.find(|(_, name)| name.meant == Meant::Counter);
                found.map(|(at, _)| at).filter(|at| !self.is_empty(*at))
            }
        };
        let Some(rate) = &self.preamble.rate else {
            return Ok(Instants {
                clock: Clock::Nothing,
                column: None,
                date: None,
                notes: match self.are_stamps_unread {
                    true => Vec::new(),
                    false => vec![format!(
                        "no column says when it was measured, and its head no rate: {TIME} index {RATE_HZ} HZ, or {COLUMNS} stamp=NAME:UNIT"
                    )],
                },
            });
        };
        let period = nearly_whole(1e9 / rate.hz);
        let (clock, by) = match column {
            Some(at) => {
                let wraps = Wraps::at(COUNTER_WIDTH);
                (Clock::Counter { period, wraps }, self.listed(&[at]))
            }
            None => (Clock::Rows { period }, "the number of a row".to_owned()),
        };
        Ok(Instants {
            clock,
            column: column.map(|at| (at, format!("counter={}", self.reference(at)))),
            date: None,
            notes: vec![format!(
                "stamps are {by} at {} Hz, as its head says: `{}`",
                rate.hz, rate.said
            )],
        })
    }

    /// The numbers of a column in the first rows.
    pub(super) fn numbers(&self, at: usize) -> Vec<String> {
        let cells = self.rows.iter().filter_map(|row| row.get(at));
        let cells = cells.filter(|cell| !cell.is_empty() && *cell != "-");
        cells.map(|cell| cell.replace(',', ".")).collect()
    }
}

/// Rounds what is whole but for its rounding: stamps are exact then.
fn nearly_whole(nanos: f64) -> f64 {
    let whole = nanos.round();
    match (nanos - whole).abs() <= nanos * 1e-12 {
        true => whole,
        false => nanos,
    }
}
