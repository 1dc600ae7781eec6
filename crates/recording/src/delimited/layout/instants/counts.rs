//! A column of stamps -> what it counts, and from when. Pure.
//!
//! Apart from the choice of a column because here one is looked at alone: the unit that its name states, the steps and
//! the size of its numbers.
//!
//! The unit of a stamp is that of its name; else that in which the steps are those of a gyro; else, and that is said,
//! that which its size suggests. Where name and steps contradict each other, neither is believed.

use super::super::super::clock::{Clock, Wraps, origin_of, ticks_origin};
use super::super::is_number;
use super::super::roles::Roles;
use super::{Stamp, nearly_whole};
use crate::columns::{DAY, Unit};
use crate::decode::{Bare, bare_of_text, instant_of_date, unit_of, units_that_fit};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::TimeUnit;
use strapd_attitude::setting::{COLUMNS, RATE_HZ, TIME};

/// Steps by which the two kinds of `SampleTimeFine` are told apart: of 10 Hz and more in 0.1 ms, of 200 Hz and less
/// in us.
const FINE_TICKS: f64 = 1e3;
const FINE_MICROS: f64 = 5e3;
/// A fine time has 32 bits.
const FINE_WIDTH: i64 = 1 << 32;
/// Number of steps that is too small to tell a unit against the one that the name states.
const FEW: usize = 4;

impl Roles<'_> {
    /// A column of stamps, with the unit that the user gives, or else with its own.
    pub(super) fn stamp(&self, at: usize, given: Option<Unit>) -> Result<Stamp, Diagnostic> {
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
