//! Columns of stamps, counters and rates -> how rows are placed in time. Pure.
//!
//! The unit of a stamp is that of its name; else that in which the steps are those of a gyro; else, and that is said,
//! that which its size suggests. Where name and steps contradict each other, neither is believed.

use super::super::clock::{Clock, Wraps, origin_of, ticks_origin};
use super::super::time_of_day::{Daily, DateOrder, date_and_time, since_midnight};
use super::is_number;
use super::roles::{Roles, place};
use crate::columns::DAY;
use crate::columns::Meant;
use crate::columns::Quantity;
use crate::columns::Role;
use crate::columns::Unit;
use crate::columns::words;
use crate::decode::{Bare, bare_of_text, instant_of_date, unit_of, units_that_fit};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::TimeUnit;
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

/// Steps by which the two kinds of `SampleTimeFine` are told apart: of 10 Hz and more in 0.1 ms, of 200 Hz and less
/// in us.
const FINE_TICKS: f64 = 1e3;
const FINE_MICROS: f64 = 5e3;
/// A counter of packets has 16 bits, a fine time 32.
const COUNTER_WIDTH: i64 = 1 << 16;
const FINE_WIDTH: i64 = 1 << 32;
/// Nanoseconds of a second.
const SECOND: f64 = 1e9;
/// Number of steps that is too small to tell a unit against the one that the name states.
const FEW: usize = 4;

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

    /// A column of stamps, with the unit that the user gives, or else with its own.
    fn stamp(&self, at: usize, given: Option<Unit>) -> Result<Stamp, Diagnostic> {
        let numbers = self.numbers(at);
        let stated = self.names.get(at).and_then(|name| name.unit.clone());
        let text = self.names.get(at).map_or("", |name| name.text.as_str());
        let first = numbers.first().and_then(|n| n.parse().ok()).unwrap_or(0.0);
        let of = |nanos: f64| Stamp {
            at,
            clock: match nanos == DAY {
                true => Clock::of_days(first),
                false => Clock::Counts { nanos, wraps: None },
            },
            unit: Some(Unit::Time(nanos)),
            is_exact: nanos == 1.0 && numbers.iter().all(|n| n.parse::<i64>().is_ok()),
            note: None,
            date: None,
        };
        let is_fine = text.eq_ignore_ascii_case("sampletimefine");
        let wrapping = |nanos: f64| Stamp {
            clock: Clock::Counts {
                nanos,
                wraps: Some(Wraps::at(FINE_WIDTH)),
            },
            ..of(nanos)
        };
        if let Some(Unit::Time(nanos)) = given {
            return Ok(if is_fine { wrapping(nanos) } else { of(nanos) });
        }
        if let Some(odd) = numbers.iter().find(|n| !is_number(n)) {
            if numbers.iter().all(|n| instant_of_date(n).is_some()) {
                return Ok(Stamp {
                    clock: Clock::Dates,
                    unit: None,
                    ..of(1.0)
                });
            }
            if let Some(stamp) = self.daily(at) {
                return Ok(stamp);
            }
            // One that is none among others is counted with its row.
            if numbers.iter().all(|n| !is_number(n)) {
                return Err(
                    Diagnostic::new(format!(
                        "`{}` of column `{text}` is no stamp that is known (numbers, RFC 3339, times of day)",
                        crate::text::snippet(odd.as_bytes())
                    ))
                    .help(format!(
                        "{COLUMNS} stamp=NAME:UNIT names another; {COLUMNS} stamp=none with {TIME} index {RATE_HZ} HZ does without"
                    ))
                );
            }
        }
        let stamps: Vec<Bare> = numbers.iter().filter_map(|n| bare_of_text(n)).collect();
        let ticks = numbers.first().and_then(|n| n.parse().ok());
        let ticks = ticks.and_then(ticks_origin);
        if let (Some(tscale), "t") = (self.preamble.tscale, text) {
            let mut stamp = of(nearly_whole(tscale * 1e9));
            stamp.unit = stamp.unit.filter(|unit| unit.name().is_some());
            return Ok(stamp);
        }
        if is_fine {
            return self.fine(at, &stamps).map(wrapping);
        }
        if stated.is_none()
            && let Some(origin) = ticks
        {
            return Ok(Stamp {
                clock: Clock::Ticks { origin },
                unit: None,
                note: Some(format!(
                    "the stamps in `{text}` are taken for ticks of 100 ns as Windows or .NET counts them: {COLUMNS} stamp={}:ns says otherwise",
                    self.reference(at)
                )),
                ..of(1.0)
            });
        }
        match stated {
            Some(Ok(Unit::Time(nanos))) => {
                self.check_unit(at, nanos, &stamps)?;
                Ok(of(nanos))
            }
            Some(Err(unit)) => Err(Diagnostic::new(format!(
                "the unit `{unit}` of its stamps is not known"
            ))
            .help(format!(
                "{COLUMNS} stamp={}:UNIT, with ns, us, ms, s or days",
                self.reference(at)
            ))),
            _ if is_of_days(first, &stamps) => Ok(Stamp {
                note: Some(format!(
                    "the stamps in `{text}` are taken for days as a spreadsheet or MATLAB counts them: {COLUMNS} stamp={}:s says otherwise",
                    self.reference(at)
                )),
                ..of(DAY)
            }),
            _ => {
                let (nanos, note) = self.unit_by_size(at, text, &stamps)?;
                Ok(Stamp { note, ..of(nanos) })
            }
        }
    }

    /// A column that is a time of day by its name, where it is.
    fn time_of_day(&self) -> Option<Stamp> {
        let each = self.names.iter().enumerate();
        let mut times = each
            .filter(|(_, name)| name.meant == Meant::Clock)
            .filter_map(|(at, _)| self.dates(at).or_else(|| self.daily(at)));
        times.next()
    }

    /// A column of dates by RFC 3339, where it is.
    fn dates(&self, at: usize) -> Option<Stamp> {
        let cells = self.texts(at);
        let is_it = !cells.is_empty() && cells.iter().all(|cell| instant_of_date(cell).is_some());
        is_it.then_some(Stamp {
            at,
            clock: Clock::Dates,
            unit: None,
            is_exact: false,
            note: None,
            date: None,
        })
    }

    /// The cells of a column in the first rows, as they are.
    fn texts(&self, at: usize) -> Vec<&str> {
        let cells = self.rows.iter().filter_map(|row| row.get(at));
        cells
            .map(String::as_str)
            .filter(|cell| !cell.is_empty() && *cell != "-")
            .collect()
    }

    /// A column of times of day, with their dates in the same cells, in another column, or nowhere.
    fn daily(&self, at: usize) -> Option<Stamp> {
        let cells = self.texts(at);
        let stamp = |daily: Daily, date: Option<usize>, note: Option<String>| Stamp {
            at,
            clock: Clock::Daily(daily),
            unit: None,
            is_exact: false,
            note,
            date,
        };
        let unsure = |said: &str| {
            format!(
                "whether the month or the day is first in `{}` does not show: it is taken for the month, and days go on at midnight",
                crate::text::snippet(said.as_bytes())
            )
        };
        let split: Option<Vec<(&str, &str)>> = cells.iter().map(|c| date_and_time(c)).collect();
        if let Some(pairs) = split.filter(|pairs| !pairs.is_empty())
            && let Some((order, is_sure)) = DateOrder::of(pairs.iter().map(|(date, _)| *date))
            && pairs.iter().all(|(_, time)| since_midnight(time).is_some())
        {
            let (first, _) = pairs.first()?;
            return Some(match is_sure {
                true => stamp(Daily::with_date_in_cell(order), None, None),
                false => stamp(
                    Daily::counted(order.midnight(first)),
                    None,
                    Some(unsure(first)),
                ),
            });
        }
        if cells.is_empty() || !cells.iter().all(|cell| since_midnight(cell).is_some()) {
            return None;
        }
        let each = self.names.iter().enumerate();
        let mut dates = each.filter(|(_, name)| name.meant == Meant::Date);
        let dated = dates.find_map(|(at, _)| {
            let cells = self.texts(at);
            let (order, is_sure) = DateOrder::of(cells.iter().copied())?;
            Some((at, order, is_sure, *cells.first()?))
        });
        Some(match dated {
            Some((date, order, true, _)) => stamp(Daily::with_date_beside(order), Some(date), None),
            Some((_, order, false, first)) => stamp(
                Daily::counted(order.midnight(first)),
                None,
                Some(unsure(first)),
            ),
            None => stamp(Daily::counted(None), None, None),
        })
    }

    /// Nanoseconds of a count in a column that states no unit, and what is to be said of the guess.
    fn unit_by_size(
        &self,
        at: usize,
        text: &str,
        stamps: &[Bare],
    ) -> Result<(f64, Option<String>), Diagnostic> {
        let why = match unit_of(stamps.iter().copied()) {
            Ok(unit) => return Ok((unit.nanos(0.0) as f64, None)),
            Err(_) if stamps.is_empty() => return Ok((1.0, None)),
            Err(why) => why,
        };
        let first = stamps.first().map_or(0.0, |bare| bare.count());
        let by_size = TimeUnit::of_magnitude(first);
        let fits = units_that_fit(stamps.iter().copied());
        if fits.is_some_and(|(_, fits)| !fits.contains(&by_size)) {
            return Err(
                Diagnostic::new(format!("`{text}`: {}", why.what())).help(format!(
                    "{COLUMNS} stamp={}:UNIT, with ns, us, ms, s or days",
                    self.reference(at)
                )),
            );
        }
        let note = format!(
            "the unit of the stamps in `{text}` is not stated; by their size they are taken for {}: {COLUMNS} stamp={}:ms says otherwise",
            by_size.name(),
            self.reference(at)
        );
        Ok((by_size.nanos(first) as f64, Some(note)))
    }

    /// A unit that the name states, and the steps deny.
    fn check_unit(&self, at: usize, nanos: f64, stamps: &[Bare]) -> Result<(), Diagnostic> {
        if stamps.len() < FEW {
            return Ok(());
        }
        let Some((step, fits)) = units_that_fit(stamps.iter().copied()) else {
            return Ok(());
        };
        let is_it = |unit: &&TimeUnit| unit.nanos(0.0) as f64 == nanos;
        let stated = TimeUnit::NAMED.iter().map(|(_, unit)| unit).find(is_it);
        let Some(stated) = stated.filter(|unit| !fits.contains(unit)) else {
            return Ok(());
        };
        let Some(other) = fits.first() else {
            return Ok(());
        };
        Err(Diagnostic::new(format!(
            "{} is in {} by its name, but its steps of {step} are those of a gyro only in {}",
            self.listed(&[at]),
            stated.name(),
            other.name()
        ))
        .help(format!(
            "{COLUMNS} stamp={}:{} takes it so, and :{} as its name says",
            self.reference(at),
            other.name(),
            stated.name()
        )))
    }

    /// Xsens counts in 0.1 ms (MT) or in us (DOT), and does not say which.
    fn fine(&self, at: usize, stamps: &[Bare]) -> Result<f64, Diagnostic> {
        const TICK: f64 = 1e5;
        const MICRO: f64 = 1e3;
        let step = units_that_fit(stamps.iter().copied()).map(|(step, _)| step);
        let of_rate = self
            .preamble
            .rate
            .as_ref()
            .zip(step)
            .and_then(|(rate, step)| {
                let is_it = |nanos: &f64| (step * nanos * rate.hz / 1e9 - 1.0).abs() < 0.5;
                [TICK, MICRO].into_iter().find(is_it)
            });
        match (of_rate, step) {
            (Some(nanos), _) => Ok(nanos),
            (None, Some(step)) if step <= FINE_TICKS => Ok(TICK),
            (None, Some(step)) if step >= FINE_MICROS => Ok(MICRO),
            _ => Err(Diagnostic::new(format!(
                "{} counts in 0.1 ms or in us, and which cannot be told",
                self.listed(&[at])
            ))
            .help(format!(
                "{COLUMNS} stamp={}:100us, or :us",
                self.reference(at)
            ))),
        }
    }
}

/// Whether numbers are dates in days: of our time, with steps that are those of a gyro in no other unit.
fn is_of_days(first: f64, stamps: &[Bare]) -> bool {
    let fits = units_that_fit(stamps.iter().copied());
    let is_gyro =
        |(step, fits): (f64, Vec<TimeUnit>)| fits.is_empty() && (2e4..2e9).contains(&(step * DAY));
    origin_of(first).is_some() && fits.is_some_and(is_gyro)
}

/// Rounds what is whole but for its rounding: stamps are exact then.
fn nearly_whole(nanos: f64) -> f64 {
    let whole = nanos.round();
    match (nanos - whole).abs() <= nanos * 1e-12 {
        true => whole,
        false => nanos,
    }
}
