//! Name of a column -> what it may hold. Pure.
//!
//! Apart from the layout because a name alone tells only what may be: which of several is meant, and whether all axes
//! are there, shows in the whole header.

mod vocabulary;

use super::increments::{increment, step};
use super::temperatures::temperature;
use super::units::{Quantity, Unit};
use crate::text::printable;
use vocabulary::{
    AS_COUNTED, DATES, DERIVED, FUSED, ORIENTATION, STAMP_STRONG, STAMP_WEAK, TIMES_OF_DAY,
    WITHOUT_GRAVITY, kind_of, names_sensor,
};

/// A vector or quaternion that columns may be parts of.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Kind {
    Gyro,
    Accel,
    Mag,
    /// Parts w, x, y, z.
    Orientation,
    /// Element of a rotation matrix, sensor to world, by rows.
    Matrix,
    /// The rotation since the sample before, of which it says all. Parts w, x, y, z.
    Turn,
    /// The specific force integrated over the same interval, m/s.
    Push,
}

impl Kind {
    /// Number of columns it is made of.
    pub(crate) fn parts(self) -> usize {
        match self {
            Kind::Gyro | Kind::Accel | Kind::Mag | Kind::Push => 3,
            Kind::Orientation | Kind::Turn => 4,
            Kind::Matrix => 9,
        }
    }

    /// Name for people and for `--columns`.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Kind::Gyro => "gyro",
            Kind::Accel => "accel",
            Kind::Mag => "mag",
            Kind::Orientation => "orientation",
            Kind::Matrix => "matrix",
            Kind::Turn => "dq",
            Kind::Push => "dv",
        }
    }

    /// Quantity of which its unit is one.
    pub(crate) fn quantity(self) -> Option<Quantity> {
        match self {
            Kind::Gyro => Some(Quantity::Rate),
            Kind::Accel => Some(Quantity::Force),
            Kind::Mag => Some(Quantity::Field),
            Kind::Orientation | Kind::Matrix | Kind::Turn | Kind::Push => None,
        }
    }
}

/// Meaning that a column may have.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Meant {
    /// Part of a vector; those of one vector have the same `of`.
    Part { kind: Kind, part: usize, of: String },
    /// Part of a vector that is not taken by itself: why.
    Aside { kind: Kind, why: &'static str },
    /// A stamp.
    Stamp,
    /// A time of day by its name: a stamp, where there is no other.
    Clock,
    /// A date, which may belong to a time of day.
    Date,
    /// The time since the row before.
    Step,
    /// A running number.
    Counter,
    /// Temperature of the sensor, the closer to the gyro the lower.
    Temperature(u8),
    /// Sensor of the row; where that is not clear, it may be another number as well.
    Sensor { is_clear: bool },
    /// Column of no use.
    Nothing,
}

/// A column's name.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Name {
    /// Text as it is, without the unit's brackets cut off; fit for a terminal.
    pub(crate) text: String,
    /// Meaning it may have.
    pub(crate) meant: Meant,
    /// Unit as written; `Err` of one in brackets that is not known.
    pub(crate) unit: Option<Result<Unit, String>>,
}

/// Words of a name: cut at what is neither letter nor digit, and where capitals begin.
pub(crate) fn words(text: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut word = String::new();
    let mut before = ' ';
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        let next_is_small = chars.peek().is_some_and(|next| next.is_lowercase());
        let begins =
            c.is_uppercase() && (before.is_lowercase() || (before.is_uppercase() && next_is_small));
        if (begins || !c.is_alphanumeric()) && !word.is_empty() {
            words.push(std::mem::take(&mut word));
        }
        if c.is_alphanumeric() {
            word.extend(c.to_lowercase());
        }
        before = c;
    }
    if !word.is_empty() {
        words.push(word);
    }
    words
}

/// A name without the unit in brackets at its end, and that unit.
fn cut_unit(text: &str) -> (&str, Option<&str>) {
    for (open, close) in [('(', ')'), ('[', ']'), ('{', '}')] {
        let Some(inner) = text.strip_suffix(close) else {
            continue;
        };
        // The bracket that the last one closes: units have some of their own.
        let mut depth = 1;
        for (at, c) in inner.char_indices().rev() {
            depth += i32::from(c == close) - i32::from(c == open);
            if depth == 0 {
                let unit = inner.get(at + open.len_utf8()..).unwrap_or_default().trim();
                let name = text.get(..at).unwrap_or_default();
                // An index is none.
                return match unit.bytes().all(|b| b.is_ascii_digit()) && !unit.is_empty() {
                    true => (text, None),
                    false => (name.trim_end(), Some(unit)),
                };
            }
        }
    }
    (text, None)
}

/// The axis or part that a word stands for.
fn part_of(word: &str) -> Option<usize> {
    ["x", "y", "z", "w"].iter().position(|axis| *axis == word)
}

/// Takes the part out of a name's words: which it is, and the words without it.
fn cut_part(words: &[String], is_indexed: bool) -> Option<(usize, Vec<String>)> {
    let without = |at: usize, stem: Option<&str>| {
        let mut rest = words.to_vec();
        match stem {
            Some(stem) => rest.splice(at..=at, [stem.to_owned()]).count(),
            None => rest.drain(at..=at).count(),
        };
        rest
    };
    // The last one: of `w_x` it is x.
    if let Some((at, part)) = words
        .iter()
        .enumerate()
        .rev()
        .find_map(|(at, word)| Some((at, part_of(word)?)))
        .filter(|_| words.len() > 1)
    {
        return Some((part, without(at, None)));
    }
    if let (true, Some(last)) = (is_indexed, words.last()) {
        let part = ["0", "1", "2"].iter().position(|index| index == last)?;
        return Some((part, without(words.len() - 1, None)));
    }
    words.iter().enumerate().rev().find_map(|(at, word)| {
        let (end, last) = word.char_indices().next_back()?;
        let stem = word.get(..end)?;
        let part = part_of(last.encode_utf8(&mut [0; 4]))?;
        FUSED
            .contains(&stem)
            .then(|| (part, without(at, Some(stem))))
    })
}

/// A unit written as the last words of a name, and how many these are.
fn unit_at_end(words: &[String], quantity: Quantity) -> Option<(Unit, usize)> {
    (1..=3.min(words.len())).rev().find_map(|n| {
        let last = words.get(words.len() - n..)?.concat();
        Some((Unit::of(quantity, &last)?, n))
    })
}

impl Name {
    /// Reads a cell of a header.
    pub(crate) fn of(cell: &[u8]) -> Name {
        let text = String::from_utf8_lossy(cell);
        let text = text
            .trim_matches(|c: char| c.is_whitespace() || c == '"' || c == '\u{feff}')
            .trim_start_matches(['#', '%', '/'])
            .trim();
        let (base, bracket) = cut_unit(text);
        let mut all = words(base);
        // `Shimmer_B663_Gyro_X_CAL`: the maker and the device stand before every name.
        if all.first().is_some_and(|first| first == "shimmer") && all.len() > 2 {
            all.drain(..2);
        }
        all.retain(|word| word != "cal");
        let (meant, quantity, said) = Name::meant(base, &all);
        let bracket = bracket
            .map(str::trim)
            .filter(|unit| !unit.is_empty() && *unit != "-");
        let unit = match (quantity, bracket) {
            (Some(quantity), Some(unit)) => {
                Some(Unit::of(quantity, unit).ok_or_else(|| printable(unit)))
            }
            _ => said.map(Ok),
        };
        Name {
            text: printable(text),
            meant,
            unit,
        }
    }

    /// Meaning of a name's words, the quantity of its unit, and the unit that the words state.
    fn meant(base: &str, all: &[String]) -> (Meant, Option<Quantity>, Option<Unit>) {
        let is_word = |known: &[&str], word: &String| known.contains(&word.as_str());
        let joined = all.concat();
        if ["counter", "packetcounter", "samplecounter"].contains(&joined.as_str()) {
            return (Meant::Counter, None, None);
        }
        if TIMES_OF_DAY.contains(&joined.as_str()) {
            return (Meant::Clock, None, None);
        }
        if DATES.contains(&joined.as_str()) {
            return (Meant::Date, None, None);
        }
        if let Some(is_clear) = names_sensor(&joined) {
            return (Meant::Sensor { is_clear }, None, None);
        }
        if let Some((rank, unit)) = temperature(all) {
            return (Meant::Temperature(rank), Some(Quantity::Temperature), unit);
        }
        if let [mat, row, column] = all
            && mat == "mat"
            && let (Ok(row @ 1..=3), Ok(column @ 1..=3)) =
                (row.parse::<usize>(), column.parse::<usize>())
        {
            let part = (row - 1) * 3 + column - 1;
            let of = mat.clone();
            return (
                Meant::Part {
                    kind: Kind::Matrix,
                    part,
                    of,
                },
                None,
                None,
            );
        }
        if let Some(found) = Name::stamp(all) {
            return found;
        }
        if let Some(unit) = step(all) {
            return (Meant::Step, Some(Quantity::Time), unit);
        }
        if let Some((kind, part, of)) = increment(all) {
            return (Meant::Part { kind, part, of }, None, None);
        }
        if let Some(meant) = Name::orientation(all) {
            return (meant, None, None);
        }
        let indexed = base.ends_with(']');
        let Some((part, mut rest)) = cut_part(all, indexed) else {
            return (Meant::Nothing, None, None);
        };
        let is_fused = !base.contains(|c: char| !c.is_alphanumeric()) || rest.len() == all.len();
        // Units behind the axis, or behind the sensor: `acc_x_m_s2`, `gyro_dps_x`.
        let (mut said, mut quantity) = (None, None);
        for of in [Quantity::Rate, Quantity::Force, Quantity::Field] {
            let mut short = rest.clone();
            let found = unit_at_end(&short, of).filter(|(_, n)| *n < short.len());
            if let Some((_, n)) = found {
                short.truncate(short.len() - n);
            }
            let Some(kind) = kind_of(&short, is_fused) else {
                continue;
            };
            if kind.quantity() == Some(of) {
                quantity = Some(of);
                if found.is_some() {
                    said = found.map(|(unit, _)| unit);
                    rest = short;
                }
                break;
            }
        }
        let Some(kind) = kind_of(&rest, is_fused).filter(|_| part < 3) else {
            return (Meant::Nothing, None, None);
        };
        let has = |known: &[&str]| rest.iter().any(|word| is_word(known, word));
        let meant = if has(DERIVED) {
            Meant::Nothing
        } else if kind == Kind::Accel && has(WITHOUT_GRAVITY) {
            Meant::Aside {
                kind,
                why: "is without gravity by its name",
            }
        } else if has(AS_COUNTED) {
            Meant::Aside {
                kind,
                why: "is not calibrated by its name",
            }
        } else {
            let of = rest.join(" ");
            Meant::Part { kind, part, of }
        };
        (meant, quantity.or(kind.quantity()), said)
    }

    fn stamp(all: &[String]) -> Option<(Meant, Option<Quantity>, Option<Unit>)> {
        let time = |word: &String| Unit::of(Quantity::Time, word);
        let is = |known: &[&str], word: &String| known.contains(&word.as_str());
        // `s` and the like are words of a stamp beside a strong one, `t` is no unit.
        let fits =
            |word: &String| is(STAMP_STRONG, word) || is(STAMP_WEAK, word) || time(word).is_some();
        let is_stamp = all.iter().all(fits)
            && all.iter().any(|word| is(STAMP_STRONG, word))
            && !all.is_empty();
        is_stamp.then(|| {
            let unit = all.iter().rev().find_map(time);
            (Meant::Stamp, Some(Quantity::Time), unit)
        })
    }

    fn orientation(all: &[String]) -> Option<Meant> {
        let part = |word: &str| match part_of(word)? {
            3 => Some(0),
            axis => Some(axis + 1),
        };
        let known = |word: &String| ORIENTATION.contains(&word.as_str());
        let of_part = |part: usize, rest: Vec<&str>| Meant::Part {
            kind: Kind::Orientation,
            part,
            of: rest.join(" "),
        };
        let derived = |word: &String| DERIVED.contains(&word.as_str());
        if all.iter().any(derived) {
            return None;
        }
        // Xsens: `Quat_q0`. A bare `q0` is w to some and x to others.
        if let [quat, q] = all
            && quat == "quat"
            && let Some(n) = ["q0", "q1", "q2", "q3"].iter().position(|name| name == q)
        {
            return Some(of_part(n, vec![quat]));
        }
        let rest = |at: usize| -> Vec<&str> {
            let others = all.iter().enumerate().filter(|(n, _)| *n != at);
            others.map(|(_, word)| word.as_str()).collect()
        };
        if all.iter().any(known) {
            let found = all.iter().enumerate().rev();
            let mut found = found.filter_map(|(at, word)| Some((at, part(word)?)));
            if let Some((at, part)) = found.next() {
                return Some(of_part(part, rest(at)));
            }
        }
        let last = all.last()?;
        let stem = last
            .strip_prefix("quat")
            .or_else(|| last.strip_prefix('q'))?;
        let mut others = rest(all.len() - 1);
        others.push("q");
        Some(of_part(part(stem)?, others))
    }
}

#[cfg(test)]
mod tests;
