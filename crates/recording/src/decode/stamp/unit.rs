//! Stamps that are bare numbers -> one unit for all of a stream. Pure.
//!
//! Apart from the decoders because no single message can tell: 1700000000 may be an instant in seconds
//! or 1.7 s after a start in nanoseconds. What can tell is how far samples of a gyro are apart, and where
//! that leaves two units, which of them makes instants of our time. Nothing is guessed beyond that.

use strapd_attitude::record::Nanos;
use strapd_attitude::record::TimeUnit;

/// Most samples that wait until the unit is settled.
pub const MOST_WAITING: usize = 8;

/// Steps of a gyro's samples, ns: 20 us to 2 s.
const STEPS: std::ops::RangeInclusive<i128> = SHORTEST_STEP as i128..=2_000_000_000;
/// The shortest of them, ns.
pub(crate) const SHORTEST_STEP: i64 = 20_000;
/// 2000-01-01 to 2100-01-01, ns since 1970.
pub(crate) const OUR_TIME: std::ops::Range<i128> =
    946_684_800_000_000_000..4_102_444_800_000_000_000;

const UNITS: [(TimeUnit, &str); 4] = [
    (TimeUnit::Nano, "ns"),
    (TimeUnit::Micro, "us"),
    (TimeUnit::Milli, "ms"),
    (TimeUnit::Second, "s"),
];

/// A stamp that is a number and no more, in billionths of its unit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Bare(pub(super) i128);

impl Bare {
    /// A whole number.
    #[must_use]
    pub fn whole(count: i64) -> Bare {
        Bare(i128::from(count) * 1_000_000_000)
    }

    /// The number that counts so many nanoseconds in a unit that has a name.
    pub(crate) fn of(nanos: i64, unit: TimeUnit) -> Bare {
        Bare(i128::from(nanos) * 1_000_000_000 / i128::from(unit.nanos(0.0)))
    }

    /// The instant, were this its unit; half a nanosecond is rounded away from zero.
    #[must_use]
    pub fn in_unit(self, unit: TimeUnit) -> Nanos {
        let nanos = self.nanos(unit);
        Nanos(i64::try_from(nanos).unwrap_or(if nanos < 0 { i64::MIN } else { i64::MAX }))
    }

    /// Returns whether it is an instant at all in this unit.
    pub(crate) fn is_instant_in(self, unit: TimeUnit) -> bool {
        i64::try_from(self.nanos(unit)).is_ok()
    }

    /// Returns whether it is an instant of our time in this unit.
    pub(crate) fn is_of_our_time_in(self, unit: TimeUnit) -> bool {
        OUR_TIME.contains(&self.nanos(unit))
    }

    /// Makes a bare stamp of so many billionths.
    pub(crate) fn billionths(count: i64) -> Bare {
        Bare(i128::from(count))
    }

    /// The number.
    #[must_use]
    pub fn count(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// Instant read by its magnitude alone, if nobody has more than this one.
    #[must_use]
    pub(crate) fn by_magnitude(self) -> Nanos {
        self.in_unit(TimeUnit::of_magnitude(self.count()))
    }

    /// The unit, where one number is enough: an instant of our time in nanoseconds. In any other unit it
    /// would be the year 30,000 or later, in nanoseconds since a start an uptime of 30 years.
    #[must_use]
    pub fn certain_unit(self) -> Option<TimeUnit> {
        OUR_TIME
            .contains(&self.nanos(TimeUnit::Nano))
            .then_some(TimeUnit::Nano)
    }

    fn nanos(self, unit: TimeUnit) -> i128 {
        let divisor = match unit {
            TimeUnit::Nano => 1_000_000_000,
            TimeUnit::Micro => 1_000_000,
            TimeUnit::Milli => 1_000,
            TimeUnit::Second | TimeUnit::ByMagnitude => 1,
        };
        let half = divisor / 2 * self.0.signum();
        self.0.saturating_add(half) / divisor
    }
}

/// Refusal: no unit, or more than one, fits.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Ambiguous {
    /// The first number, and the ordinary step, in billionths.
    first: i128,
    step: Option<i128>,
    fits: Vec<&'static str>,
}

impl Ambiguous {
    /// Description of what is known, without what helps.
    #[must_use]
    pub fn what(&self) -> String {
        let number = |billionths: i128| billionths as f64 * 1e-9;
        let steps = self.step.map(|step| format!(", steps of {}", number(step)));
        let may_be = match self.fits.as_slice() {
            [] => ": in none are the steps those of a gyro (20 us to 2 s)".to_owned(),
            fits => format!(": it may be {}", fits.join(" or ")),
        };
        format!(
            "the unit of a stamp that is a bare number ({}{}) cannot be told{may_be}",
            number(self.first),
            steps.unwrap_or_default()
        )
    }
}

impl std::fmt::Display for Ambiguous {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}; name it stamp_ns, stamp_us, stamp_ms or stamp_s, or send {{\"sec\",\"nsec\"}}",
            self.what()
        )
    }
}

/// The first stamps of a stream.
struct Opening {
    first: i128,
    /// The ordinary step; `None` where they are all the same.
    step: Option<i128>,
    /// The units in which that is a step of a gyro's samples.
    fits: Vec<(TimeUnit, &'static str)>,
}

impl Opening {
    fn of(stamps: impl IntoIterator<Item = Bare>) -> Opening {
        let stamps: Vec<i128> = stamps.into_iter().map(|bare| bare.0).collect();
        // Samples that share a stamp say nothing of its unit.
        let mut steps: Vec<i128> = stamps
            .windows(2)
            .map(|pair| match pair {
                [a, b] => b.saturating_sub(*a).saturating_abs(),
                _ => 0,
            })
            .filter(|step| *step > 0)
            .collect();
        steps.sort_unstable();
        let step = steps.get(steps.len().saturating_sub(1) / 2).copied();
        let first = stamps.first().copied().unwrap_or(0);
        let fits = |(unit, _): &(TimeUnit, &str)| {
            Bare(first).is_instant_in(*unit)
                && step.is_none_or(|step| STEPS.contains(&Bare(step).nanos(*unit)))
        };
        Opening {
            first,
            step,
            fits: UNITS.into_iter().filter(fits).collect(),
        }
    }

    fn fits(&self, unit: TimeUnit) -> bool {
        self.fits.iter().any(|(fits, _)| *fits == unit)
    }

    /// Unit among those that fit whose instants are of our time.
    fn of_our_time(&self) -> Option<TimeUnit> {
        let is_ours = |unit: &TimeUnit| Bare(self.first).is_of_our_time_in(*unit);
        let mut ours = self.fits.iter().map(|(unit, _)| *unit).filter(is_ours);
        ours.next().filter(|_| ours.next().is_none())
    }

    /// The same where this unit is possible, too.
    fn or(mut self, unit: Option<TimeUnit>) -> Opening {
        let name = unit.map(|unit| (unit, unit.name()));
        let other = name.filter(|(unit, _)| !self.fits(*unit));
        self.fits.extend(other);
        self
    }

    fn ambiguous(&self) -> Ambiguous {
        Ambiguous {
            first: self.first,
            step: self.step,
            fits: self.fits.iter().map(|(_, name)| *name).collect(),
        }
    }
}

/// The unit of these stamps, the first of a stream: the one under which the median of their steps is that
/// of a gyro; of several, the one whose instants are of our time.
///
/// # Errors
/// Still several, or none.
pub fn unit_of(stamps: impl IntoIterator<Item = Bare>) -> Result<TimeUnit, Ambiguous> {
    let opening = Opening::of(stamps);
    match opening.fits.as_slice() {
        [(unit, _)] => Ok(*unit),
        _ => opening.of_our_time().ok_or_else(|| opening.ambiguous()),
    }
}

/// The ordinary step of these stamps, in what they count, and the units in which it is that of a gyro's samples; `None`
/// where they are all the same.
pub(crate) fn units_that_fit(
    stamps: impl IntoIterator<Item = Bare>,
) -> Option<(f64, Vec<TimeUnit>)> {
    let opening = Opening::of(stamps);
    let step = Bare(opening.step?).count();
    Some((step, opening.fits.iter().map(|(unit, _)| *unit).collect()))
}

/// The same of the steps themselves.
pub(crate) fn units_of_steps(
    steps: impl IntoIterator<Item = Bare>,
) -> Option<(f64, Vec<TimeUnit>)> {
    let mut sum = 0_i128;
    let mut until = |step: Bare| {
        sum = sum.saturating_add(step.0);
        Bare(sum)
    };
    let ends: Vec<Bare> = steps.into_iter().map(&mut until).collect();
    units_that_fit(std::iter::once(Bare(0)).chain(ends))
}

/// Result of the first messages of a log.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum UnitEvidence {
    /// The unit of their stamps.
    Unit(TimeUnit),
    /// Nothing: there are no two different stamps.
    Nothing,
}

/// The unit of the stamps of a log: when each of its first messages was recorded, and its stamps. The
/// recorder's clock tells it where stamps are instants of it and go on as fast; else the steps of the first
/// `few` messages do, as in [`unit_of`], and of several units the one in which they go on as fast.
///
/// # Errors
/// Several or none, or what speaks for one does so for different ones.
pub(crate) fn unit_in_log(
    first: &[(Nanos, Vec<Bare>)],
    few: usize,
) -> Result<UnitEvidence, Ambiguous> {
    let opening = Opening::of(first.iter().take(few).flat_map(|(_, bare)| bare).copied());
    if opening.step.is_none() {
        return Ok(UnitEvidence::Nothing);
    }
    let by_clock = first.iter().find_map(|(log, bare)| {
        let bare = bare.first().filter(|bare| bare.0 != 0)?;
        recorded_at(*bare, *log)
    });
    let by_speed = as_fast(first);
    let told = match (opening.fits.as_slice(), by_clock, by_speed) {
        (_, Some(unit), Some(same)) if unit == same => Some(unit),
        // Too slow for a gyro, but so it was recorded: poses may be.
        ([(unit, _)], _, Some(slower)) if slower.nanos(0.0) > unit.nanos(0.0) => None,
        ([(unit, _)], ..) => Some(*unit),
        ([], ..) => by_speed.or(by_clock),
        _ => {
            let recorder = by_speed.or(by_clock).filter(|unit| opening.fits(*unit));
            let ours = opening.of_our_time();
            recorder
                .or(ours)
                .filter(|unit| ours.is_none_or(|ours| ours == *unit))
        }
    };
    let told = told.map(UnitEvidence::Unit);
    told.ok_or_else(|| opening.or(by_speed).ambiguous())
}

/// The unit in which a stamp is about when it was recorded. A recorder of our time knows only stamps of
/// our time: any other number is near some unit of it by chance.
fn recorded_at(bare: Bare, log: Nanos) -> Option<TimeUnit> {
    let is_ours = |nanos: i128| OUR_TIME.contains(&nanos);
    TimeUnit::nearest(bare.count(), log)
        .filter(|unit| !is_ours(i128::from(log.0)) || is_ours(bare.nanos(*unit)))
}

/// The unit in which stamps go on as fast as the recorder's clock.
fn as_fast(first: &[(Nanos, Vec<Bare>)]) -> Option<TimeUnit> {
    let of = |(log, bare): &(Nanos, Vec<Bare>)| Some((*log, *bare.first()?));
    let (from, to) = (first.first().and_then(of)?, first.last().and_then(of)?);
    let (recorded, stamped) = (to.0.since(from.0), to.1.0.saturating_sub(from.1.0));
    TimeUnit::nearest(Bare(stamped).count(), Nanos(recorded))
}
