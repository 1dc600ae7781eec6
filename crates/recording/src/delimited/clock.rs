//! Cells of a row that tell its time -> its instant. Pure.
//!
//! Apart from the rows because makers agree on nothing here: whole nanoseconds, decimal seconds, ticks that wrap,
//! dates, a running number beside a rate, nothing.

use super::time_of_day::Daily;
use crate::columns::DAY;
use crate::decode::{OUR_TIME, decimal_in_steps, instant_of_date};
use strapd_attitude::record::{Nanos, TimeUnit};

/// Nanoseconds of a second.
const SECOND: i64 = 1_000_000_000;

/// Nanoseconds of a tick of Windows and .NET.
const TICK: i64 = 100;

/// Clock by which the rows of a table are placed in time.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Clock {
    /// A column of whole nanoseconds.
    Nanos,
    /// A column of numbers, so many nanoseconds each.
    Counts { nanos: f64, wraps: Option<Wraps> },
    /// A column of days and their parts since so many days before 1970.
    Days { origin: i64 },
    /// A column of ticks of 100 ns, of which 1970 is this one.
    Ticks { origin: i64 },
    /// A column of dates (RFC 3339).
    Dates,
    /// A column of times of day.
    Daily(Daily),
    /// A column of parts of a second, so many nanoseconds each, beside one of whole seconds.
    Split { nanos: i64 },
    /// A column of running numbers, so far apart.
    Counter { period: f64, wraps: Wraps },
    /// A column of steps since the row before, so many nanoseconds in one; their sum until now.
    Steps { nanos: i64, sum: i64 },
    /// Nothing but the rows themselves, so far apart.
    Rows { period: f64 },
    /// Nothing at all.
    Nothing,
}

/// A counter of finite width: a step back of more than half of it is one on.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Wraps {
    width: i64,
    last: i64,
    turns: i64,
}

impl Wraps {
    pub(super) fn at(width: i64) -> Wraps {
        Wraps {
            width,
            last: 0,
            turns: 0,
        }
    }

    fn unwrapped(&mut self, count: i64) -> i64 {
        if (0..self.width).contains(&count) {
            if self.last.saturating_sub(count) > self.width / 2 {
                self.turns = self.turns.saturating_add(self.width);
            }
            self.last = count;
        }
        count.saturating_add(self.turns)
    }
}

/// Days from the beginning of a spreadsheet's count (1899-12-30), and of MATLAB's (year 0), to 1970.
const ORIGINS: [i64; 2] = [25_569, 719_529];

impl Clock {
    /// Clock of a column of days, by its first number: a date of our time by one of the two counts there are, else days
    /// since some beginning.
    pub(super) fn of_days(first: f64) -> Clock {
        Clock::Days {
            origin: origin_of(first).unwrap_or(0),
        }
    }

    /// The unit of its numbers, where that is one that can be named.
    pub(super) fn unit(&self) -> Option<TimeUnit> {
        let size = match self {
            Clock::Nanos => 1.0,
            Clock::Counts { nanos, .. } => *nanos,
            _ => return None,
        };
        let mut named = TimeUnit::NAMED.iter().map(|(_, unit)| *unit);
        named.find(|unit| unit.nanos(0.0) as f64 == size)
    }

    /// The instant that a cell says; `number` has its point where it belongs.
    pub(super) fn read(&mut self, number: &str) -> Result<Nanos, &'static str> {
        let whole = || number.parse::<i64>().ok();
        match self {
            Clock::Nanos => whole().map(Nanos).ok_or("is no whole number"),
            Clock::Counts { nanos, wraps } => {
                let count = whole().map(|count| match wraps {
                    Some(wraps) => wraps.unwrapped(count),
                    None => count,
                });
                let is_whole = nanos.fract() == 0.0;
                match count {
                    Some(count) if is_whole => Ok(Nanos(count.saturating_mul(*nanos as i64))),
                    Some(count) => Ok(scaled(count as f64, *nanos)),
                    None if is_whole => {
                        decimal_in_steps(number, *nanos as i64).ok_or("is no number")
                    }
                    None => number
                        .parse::<f64>()
                        .ok()
                        .filter(|count| count.is_finite())
                        .map(|count| scaled(count, *nanos))
                        .ok_or("is no number"),
                }
            }
            Clock::Ticks { origin } => whole()
                .map(|count| Nanos(count.saturating_sub(*origin).saturating_mul(TICK)))
                .ok_or("is no whole number"),
            Clock::Days { origin } => days(number, *origin).ok_or("is no number of days"),
            Clock::Dates => instant_of_date(number).ok_or("is no date (RFC 3339)"),
            Clock::Daily(daily) => daily.read(number).ok_or("is no time of day"),
            Clock::Split { nanos } => whole()
                .filter(|part| (0..SECOND / *nanos).contains(part))
                .map(|part| Nanos(part * *nanos))
                .ok_or("is no part of a second"),
            Clock::Counter { period, wraps } => {
                let count = whole().ok_or("is no whole number")?;
                Ok(at(wraps.unwrapped(count), *period))
            }
            Clock::Steps { nanos, sum } => {
                let step = decimal_in_steps(number, *nanos).ok_or("is no number")?;
                if step.0 < 0 {
                    return Err("is a step back");
                }
                *sum = sum.saturating_add(step.0);
                Ok(Nanos(*sum))
            }
            Clock::Rows { .. } | Clock::Nothing => Ok(Nanos(0)),
        }
    }

    /// Midnight of the date, or the whole second, in another column.
    pub(super) fn day(&self, cell: &str) -> Result<Nanos, &'static str> {
        match self {
            Clock::Daily(daily) => daily.day(cell).ok_or("is no date like those above"),
            Clock::Split { .. } => cell
                .trim()
                .parse()
                .map(|second: i64| Nanos(second.saturating_mul(SECOND)))
                .map_err(|_| "is no whole second"),
            _ => Ok(Nanos(0)),
        }
    }

    /// The instant of a row by its stamp and its day, which some clocks need.
    pub(super) fn instant(&self, stamp: Option<Nanos>, day: Option<Nanos>) -> Option<Nanos> {
        match self {
            Clock::Daily(daily) if daily.needs_day() => Some(Nanos(stamp?.0 + day?.0)),
            Clock::Split { .. } => Some(Nanos(stamp?.0.saturating_add(day?.0))),
            _ => stamp,
        }
    }

    /// The sum of steps until now, to go back to.
    pub(super) fn sum(&self) -> Option<i64> {
        match self {
            Clock::Steps { sum, .. } => Some(*sum),
            _ => None,
        }
    }

    /// A row is lost, but not the step that it says: those behind it lie where they did.
    pub(super) fn pass(&mut self, before: i64, number: Option<&str>) {
        if let Clock::Steps { sum, .. } = self {
            *sum = before;
        }
        if let Some(number) = number {
            let _ = self.read(number);
        }
    }

    /// The instant of the row of this number, from 0, where nothing else says it.
    pub(super) fn of_row(&self, row: u64) -> Option<Nanos> {
        match self {
            Clock::Rows { period } => Some(at(i64::try_from(row).unwrap_or(i64::MAX), *period)),
            _ => None,
        }
    }
}

fn at(count: i64, period: f64) -> Nanos {
    match period.fract() == 0.0 {
        true => Nanos(count.saturating_mul(period as i64)),
        false => scaled(count as f64, period),
    }
}

fn scaled(count: f64, nanos: f64) -> Nanos {
    Nanos((count * nanos).round() as i64)
}

/// Tick that 1970 is where this one is of our time: of Windows' FILETIME (since 1601) and of .NET (since year 1). As
/// nanoseconds the same numbers are of 1974 and 1990.
pub(super) fn ticks_origin(count: i64) -> Option<i64> {
    let is_of_our_time = |origin: &i64| {
        let nanos = count.checked_sub(*origin)?.checked_mul(TICK)?;
        Some(OUR_TIME.contains(&i128::from(nanos)))
    };
    [116_444_736_000_000_000, 621_355_968_000_000_000]
        .into_iter()
        .find(|origin| is_of_our_time(origin) == Some(true))
}

/// Days before 1970 at which a count begins by which this is a date of our time.
pub(super) fn origin_of(days: f64) -> Option<i64> {
    let (from, to) = (OUR_TIME.start as f64, OUR_TIME.end as f64);
    let is_of_our_time = |origin: &i64| (from..to).contains(&((days - *origin as f64) * DAY));
    ORIGINS.into_iter().find(is_of_our_time)
}

/// Instant of a decimal number of days.
fn days(number: &str, origin: i64) -> Option<Nanos> {
    let number = number.trim();
    // As numpy.savetxt writes them.
    if number.contains(['e', 'E']) {
        let days: f64 = number.parse().ok().filter(|days: &f64| days.is_finite())?;
        return Some(scaled(days - origin as f64, DAY));
    }
    let (whole, part) = number.split_once('.').unwrap_or((number, ""));
    let whole: i64 = whole.parse().ok()?;
    let part = match part {
        "" => Nanos(0),
        part => decimal_in_steps(&format!("0.{part}"), DAY as i64)?,
    };
    let midnight = whole.checked_sub(origin)?.checked_mul(DAY as i64)?;
    let part = if number.starts_with('-') {
        -part.0
    } else {
        part.0
    };
    Some(Nanos(midnight.checked_add(part)?))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn counters_go_on_where_they_wrap_and_back_where_they_go_back() {
        let mut clock = Clock::Counter {
            period: 2e7,
            wraps: Wraps::at(65_536),
        };
        let mut read = |text: &str| clock.read(text).unwrap().0 / 20_000_000;
        assert_eq!(
            ["65534", "65535", "0", "2"].map(&mut read),
            [65_534, 65_535, 65_536, 65_538]
        );
        assert_eq!(read("1"), 65_537, "a row out of order");
        assert!(clock.read("1.5").is_err() && clock.read("").is_err());
    }

    #[test]
    fn ticks_of_windows_and_of_dot_net_are_of_our_time_and_nanoseconds_are_none() {
        // 2023-11-14T22:13:20Z.
        for count in [133_444_736_000_000_000, 638_355_968_000_000_000] {
            let origin = ticks_origin(count).unwrap();
            let read = Clock::Ticks { origin }.read(&(count + 1).to_string());
            assert_eq!(read, Ok(Nanos(1_700_000_000_000_000_100)));
        }
        for count in [
            0,
            1_700_000_000_000_000_000,
            900_000_000_000_000_000,
            i64::MIN,
        ] {
            assert_eq!(ticks_origin(count), None);
        }
    }

    #[test]
    fn decimal_stamps_are_exact_to_the_nanosecond_in_every_unit() {
        let read =
            |nanos: f64, text: &str| Clock::Counts { nanos, wraps: None }.read(text).map(|n| n.0);
        assert_eq!(
            read(1e9, "1700000000.123456789"),
            Ok(1_700_000_000_123_456_789)
        );
        assert_eq!(read(1e9, "1.50E-1"), Ok(150_000_000));
        assert_eq!(
            read(1e6, "1700000000123.456789"),
            Ok(1_700_000_000_123_456_789)
        );
        assert_eq!(read(1e5, "12"), Ok(1_200_000));
        assert_eq!(read(976_562.5, "3"), Ok(2_929_688));
        assert!(read(1e9, "x").is_err() && read(0.5, "inf").is_err());
    }
}
