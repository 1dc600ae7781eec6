//! A column of dates or of times of day -> how its cells are instants. Pure.
//!
//! Apart from the columns of numbers because what is written as a date has no unit, and its days may stand in another
//! column or nowhere.

use super::super::super::clock::Clock;
use super::super::super::time_of_day::{Daily, DateOrder, date_and_time, since_midnight};
use super::super::roles::Roles;
use super::Stamp;
use crate::columns::Meant;
use crate::decode::instant_of_date;

impl Roles<'_> {
    /// A column that is a time of day by its name, where it is.
    pub(super) fn time_of_day(&self) -> Option<Stamp> {
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
    pub(super) fn daily(&self, at: usize) -> Option<Stamp> {
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
}
