//! A time of day, and a date as loggers write it -> nanoseconds. Pure.
//!
//! Apart from the clock because the order of a date's numbers is told by no single one: it shows in all of the first
//! rows, or it does not show, and then days are counted from midnight to midnight.

use crate::decode::days_since_1970;
use strapd_attitude::record::Nanos;

const SECOND: i64 = 1_000_000_000;
const DAY: i64 = 86_400 * SECOND;
/// Time before and after midnight in which a row may come out of order, ns.
const NEAR_MIDNIGHT: i64 = 600 * SECOND;

/// Order of the numbers of a date.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum DateOrder {
    YearMonthDay,
    MonthDayYear,
    DayMonthYear,
}

impl DateOrder {
    /// The order that all of these dates fit, and whether it is sure; `None` where one is no date.
    pub(super) fn of<'c>(dates: impl Iterator<Item = &'c str>) -> Option<(DateOrder, bool)> {
        let mut found = None;
        let mut is_month_first = false;
        let mut is_day_first = false;
        for date in dates {
            let (numbers, separator, middle) = numbers(date)?;
            let [first, second, _] = numbers;
            if first > 31 {
                found = Some((DateOrder::YearMonthDay, true));
                continue;
            }
            if middle == Middle::Name {
                found = Some((DateOrder::DayMonthYear, true));
                continue;
            }
            is_day_first |= first > 12;
            is_month_first |= second > 12;
            // With points the day is first, wherever points are written.
            found = found.or(Some(match separator {
                '.' => (DateOrder::DayMonthYear, true),
                _ => (DateOrder::MonthDayYear, false),
            }));
        }
        match (found?, is_day_first, is_month_first) {
            ((DateOrder::YearMonthDay, _), ..) => Some((DateOrder::YearMonthDay, true)),
            (_, true, true) => None,
            (_, true, false) => Some((DateOrder::DayMonthYear, true)),
            (_, false, true) => Some((DateOrder::MonthDayYear, true)),
            (found, false, false) => Some(found),
        }
    }

    /// Midnight of a date, UTC.
    pub(super) fn midnight(self, date: &str) -> Option<Nanos> {
        let ([a, b, c], ..) = numbers(date)?;
        let (year, month, day) = match self {
            DateOrder::YearMonthDay => (a, b, c),
            DateOrder::MonthDayYear => (c, a, b),
            DateOrder::DayMonthYear => (c, b, a),
        };
        let year = if year < 100 { year + 2000 } else { year };
        let is_date =
            (1970..=2200).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day);
        is_date.then(|| Nanos(days_since_1970(year, month, day) * DAY))
    }
}

/// Form of what stands in the middle of a date.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Middle {
    Number,
    /// Name of a month, `28-Nov-2026`, as MATLAB writes dates.
    Name,
}

/// Number of a month by its English name, or the first three letters of it.
fn month(name: &str) -> Option<i64> {
    const MONTHS: [&str; 12] = [
        "january",
        "february",
        "march",
        "april",
        "may",
        "june",
        "july",
        "august",
        "september",
        "october",
        "november",
        "december",
    ];
    let name = name.to_ascii_lowercase();
    let is_it = |month: &&str| **month == *name || month.get(..3) == Some(&name);
    let numbered = (1..).zip(MONTHS);
    numbered
        .into_iter()
        .find_map(|(n, month)| is_it(&month).then_some(n))
}

/// The three numbers of a date, what stands between them, and whether the one in the middle is written as a name.
fn numbers(date: &str) -> Option<([i64; 3], char, Middle)> {
    let separator = date.chars().find(|c| !c.is_ascii_digit())?;
    if !['-', '/', '.'].contains(&separator) {
        return None;
    }
    let mut out = [0; 3];
    let mut middle = Middle::Number;
    let mut parts = date.split(separator);
    for (place, number) in out.iter_mut().enumerate() {
        let part = parts.next()?;
        if let (1, Some(named)) = (place, month(part)) {
            (*number, middle) = (named, Middle::Name);
            continue;
        }
        let is_plain = (1..=4).contains(&part.len()) && part.bytes().all(|b| b.is_ascii_digit());
        *number = part.parse().ok().filter(|_| is_plain)?;
    }
    parts.next().is_none().then_some((out, separator, middle))
}

/// A time of day, `1:59:50.02` or `01:59:50 PM`, since midnight; a leap second is the one after.
pub(super) fn since_midnight(text: &str) -> Option<Nanos> {
    let text = text.trim();
    let halved = |ends: [&str; 2]| ends.iter().find_map(|end| text.strip_suffix(end));
    let (clock, half) = match (halved(["AM", "am"]), halved(["PM", "pm"])) {
        (Some(clock), _) => (clock, Some(0)),
        (_, Some(clock)) => (clock, Some(12)),
        (None, None) => (text, None),
    };
    let mut parts = clock.trim_end().split(':');
    let (hour, minute, second) = (parts.next()?, parts.next()?, parts.next()?);
    let (second, fraction) = match (second.split_once(['.', ',']), parts.next()) {
        (Some((second, fraction)), None) => (second, fraction),
        (None, None) => (second, ""),
        // Milliseconds behind a colon; two digits would be a camera's frames.
        (None, Some(millis)) if millis.len() == 3 => (second, millis),
        (_, Some(_)) => return None,
    };
    let number = |text: &str| -> Option<i64> {
        let is_plain = (1..=2).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
        text.parse().ok().filter(|_| is_plain)
    };
    let (hour, minute, second) = (number(hour)?, number(minute)?, number(second)?);
    let hour = match half {
        None if hour <= 23 => hour,
        Some(half) if (1..=12).contains(&hour) => hour % 12 + half,
        _ => return None,
    };
    if parts.next().is_some() || minute > 59 || second > 60 {
        return None;
    }
    let mut nanos = 0;
    let mut scale = SECOND;
    for digit in fraction.bytes() {
        scale /= 10;
        nanos += i64::from(digit.checked_sub(b'0').filter(|digit| *digit <= 9)?) * scale;
    }
    Some(Nanos((hour * 3600 + minute * 60 + second) * SECOND + nanos))
}

/// The date and the time of a cell that holds both.
pub(super) fn date_and_time(cell: &str) -> Option<(&str, &str)> {
    let cell = cell.trim();
    // Behind a digit: `Oct` has a t, too.
    let mut before = ' ';
    let (at, _) = cell.char_indices().find(|(_, c)| {
        let ends_date = before.is_ascii_digit() && ['T', 't', ' ', ',', ';'].contains(c);
        before = *c;
        ends_date
    })?;
    Some((cell.get(..at)?, cell.get(at + 1..)?.trim_start()))
}

/// Origin of the days.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Days {
    /// Counted from this one, ns; the cell may begin with a date, which is passed over.
    Counted(i64),
    /// The date before the time, in the same cell.
    InCell(DateOrder),
    /// The date of another column.
    Beside(DateOrder),
}

/// Clock of a table whose rows say the time of day.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Daily {
    days: Days,
    /// Time of day of the row before, and midnights since the first, ns.
    last: i64,
    passed: i64,
}

impl Daily {
    /// Days are counted from `first`, the day of the first row; without any from the second of 1970, so that midnight is
    /// no stamp of zero.
    pub(super) fn counted(first: Option<Nanos>) -> Daily {
        Daily::of(Days::Counted(first.map_or(DAY, |day| day.0)))
    }

    pub(super) fn with_date_in_cell(order: DateOrder) -> Daily {
        Daily::of(Days::InCell(order))
    }

    pub(super) fn with_date_beside(order: DateOrder) -> Daily {
        Daily::of(Days::Beside(order))
    }

    fn of(days: Days) -> Daily {
        Daily {
            days,
            last: 0,
            passed: 0,
        }
    }

    /// The instant that a cell says; where the date stands in another column, the time since midnight.
    pub(super) fn read(&mut self, cell: &str) -> Option<Nanos> {
        match self.days {
            Days::Beside(_) => since_midnight(cell),
            Days::InCell(order) => {
                let (date, time) = date_and_time(cell)?;
                let (day, time) = (order.midnight(date)?, since_midnight(time)?);
                Some(Nanos(day.0 + time.0))
            }
            Days::Counted(first) => {
                let time = date_and_time(cell)
                    .and_then(|(_, time)| since_midnight(time))
                    .or_else(|| since_midnight(cell))?;
                Some(Nanos(
                    (first + time.0).saturating_add(self.midnights(time.0)),
                ))
            }
        }
    }

    /// Midnights from the first row to one of this time of day, ns.
    fn midnights(&mut self, time: i64) -> i64 {
        // Out of order, and of the day before.
        if self.passed > 0 && time - self.last > DAY - NEAR_MIDNIGHT {
            return self.passed - DAY;
        }
        if self.last - time > DAY / 2 {
            self.passed = self.passed.saturating_add(DAY);
        }
        self.last = time;
        self.passed
    }

    /// Midnight of the date in another column, where that is needed.
    pub(super) fn day(&self, cell: &str) -> Option<Nanos> {
        match self.days {
            Days::Beside(order) => order.midnight(cell),
            Days::Counted(_) | Days::InCell(_) => None,
        }
    }

    /// Whether an instant needs the date of another column.
    pub(super) fn needs_day(&self) -> bool {
        matches!(self.days, Days::Beside(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_day_are_read_as_loggers_write_them() {
        for (text, millis) in [
            ("01:59:50.02", Some(7_190_020)),
            ("1:59:50,5", Some(7_190_500)),
            ("00:00:00", Some(0)),
            ("12:00:00 AM", Some(0)),
            ("01:00:00PM", Some(46_800_000)),
            ("23:59:60", Some(86_400_000)),
            ("24:00:00", None),
            ("13:00:00 PM", None),
            ("12:60:00", None),
            ("12:00", None),
            ("12:00:00:00", None),
            ("12:00:00:025", Some(43_200_025)),
            ("12:00:00.1:025", None),
            ("12:00:00:025:1", None),
            ("12:00:0x", None),
            ("12:00:00.-5", None),
        ] {
            let read = since_midnight(text).map(|nanos| nanos.0 / 1_000_000);
            assert_eq!(read, millis, "{text}");
        }
    }

    #[test]
    fn the_order_of_a_date_shows_or_is_said_not_to() {
        let of = |dates: &[&str]| DateOrder::of(dates.iter().copied());
        assert_eq!(of(&["03/30/2025"]), Some((DateOrder::MonthDayYear, true)));
        assert_eq!(
            of(&["03/04/2025", "13/04/2025"]),
            Some((DateOrder::DayMonthYear, true))
        );
        assert_eq!(of(&["2025/03/04"]), Some((DateOrder::YearMonthDay, true)));
        assert_eq!(of(&["3.4.25"]), Some((DateOrder::DayMonthYear, true)));
        assert_eq!(of(&["03/04/2025"]), Some((DateOrder::MonthDayYear, false)));
        assert_eq!(
            of(&["13/14/2025"]).map(|(order, _)| order.midnight("13/14/2025")),
            None
        );
        assert_eq!(of(&["1.5"]), None);
        // As MATLAB writes dates: the name of the month tells the order.
        for date in ["03-Apr-2026", "3-april-26", "03/Apr/2026", "03.APR.2026"] {
            assert_eq!(of(&[date]), Some((DateOrder::DayMonthYear, true)), "{date}");
            let day = DateOrder::DayMonthYear.midnight(date);
            assert_eq!(day, Some(Nanos(1_775_174_400 * SECOND)), "{date}");
        }
        assert_eq!(of(&["2026-Apr-03"]), Some((DateOrder::YearMonthDay, true)));
        for none in ["03-Avr-2026", "Apr-03-2026", "03-Ap-2026", "03-Apr"] {
            assert_eq!(of(&[none]), None, "{none}");
        }
        assert_eq!(
            date_and_time("03-Oct-2026 10:00:00.123"),
            Some(("03-Oct-2026", "10:00:00.123"))
        );
        assert_eq!(
            date_and_time("03-Oct-2026T10:00:00"),
            Some(("03-Oct-2026", "10:00:00"))
        );
        assert_eq!(of(&["-0.25"]), None);
        // `date -u -d 2025-03-30 +%s`.
        let day = Some(Nanos(1_743_292_800 * SECOND));
        assert_eq!(DateOrder::MonthDayYear.midnight("03/30/2025"), day);
        assert_eq!(DateOrder::DayMonthYear.midnight("30.3.25"), day);
    }

    #[test]
    fn at_midnight_the_day_goes_on_and_a_row_out_of_order_stays_behind() {
        let mut daily = Daily::counted(None);
        let times = ["23:59:59.9", "00:00:00.1", "23:59:59.95", "00:00:00.2"];
        let read: Vec<i64> = times
            .iter()
            .filter_map(|text| daily.read(text))
            .map(|nanos| (nanos.0 - 2 * DAY) / 1_000_000)
            .collect();
        assert_eq!(read, [-100, 100, -50, 200]);
    }
}
