//! Stamps that are bare numbers -> one unit for all of a stream. Pure.
//!
//! Apart from the decoders because no single message can tell: 1700000000 may be an instant in seconds
//! or 1.7 s after a start in nanoseconds. What can tell is how far samples of a gyro are apart, and where
//! that leaves two units, which of them makes instants of our time. Nothing is guessed beyond that.

use super::TimeUnit;
use crate::record::Nanos;

/// Most samples that wait until the unit is settled.
pub const MOST_WAITING: usize = 8;

/// Steps of a gyro's samples, ns: 20 us to 2 s.
const STEPS: std::ops::RangeInclusive<i128> = 20_000..=2_000_000_000;
/// 2000-01-01 to 2100-01-01, ns since 1970.
const OUR_TIME: std::ops::Range<i128> = 946_684_800_000_000_000..4_102_444_800_000_000_000;

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

    /// The instant, were this its unit; half a nanosecond is rounded away from zero.
    #[must_use]
    pub fn in_unit(self, unit: TimeUnit) -> Nanos {
        let nanos = self.nanos(unit);
        Nanos(i64::try_from(nanos).unwrap_or(if nanos < 0 { i64::MIN } else { i64::MAX }))
    }

    /// The number.
    #[must_use]
    pub fn count(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// Its instant read by its magnitude alone, where nobody has more than this one.
    #[must_use]
    pub fn by_magnitude(self) -> Nanos {
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

/// No unit, or more than one, fits.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Ambiguous {
    /// The first number, and the ordinary step, in billionths.
    first: i128,
    step: Option<i128>,
    fits: Vec<&'static str>,
}

impl std::fmt::Display for Ambiguous {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let number = |billionths: i128| billionths as f64 * 1e-9;
        write!(
            f,
            "the unit of a stamp that is a bare number ({}",
            number(self.first)
        )?;
        if let Some(step) = self.step {
            write!(f, ", steps of {}", number(step))?;
        }
        match self.fits.as_slice() {
            [] => write!(
                f,
                ") can not be told: in none are the steps those of a gyro (20 us to 2 s)"
            )?,
            fits => write!(f, ") can not be told: it may be {}", fits.join(" or "))?,
        }
        write!(
            f,
            "; name it stamp_ns, stamp_us, stamp_ms or stamp_s, or send {{\"sec\",\"nsec\"}}"
        )
    }
}

/// The unit of these stamps, the first of a stream: the one under which the median of their steps is that
/// of a gyro; of several, the one whose instants are of our time.
///
/// # Errors
/// Still several, or none.
pub fn unit_of(stamps: impl IntoIterator<Item = Bare>) -> Result<TimeUnit, Ambiguous> {
    let stamps: Vec<i128> = stamps.into_iter().map(|bare| bare.0).collect();
    let first = stamps.first().copied().unwrap_or(0);
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
    let fits = |(unit, _): &(TimeUnit, &str)| {
        step.is_none_or(|step| STEPS.contains(&Bare(step).nanos(*unit)))
    };
    let is_ours = |(unit, _): &(TimeUnit, &str)| OUR_TIME.contains(&Bare(first).nanos(*unit));
    let by_steps: Vec<_> = UNITS.into_iter().filter(fits).collect();
    let mut ours = by_steps.iter().filter(|unit| is_ours(unit));
    match (by_steps.as_slice(), ours.next(), ours.next()) {
        ([(unit, _)], ..) => Ok(*unit),
        (_, Some((unit, _)), None) => Ok(*unit),
        (several, ..) => Err(Ambiguous {
            first,
            step,
            fits: several.iter().map(|(_, name)| *name).collect(),
        }),
    }
}
