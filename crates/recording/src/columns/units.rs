//! Units as makers write them -> what they are. Pure.
//!
//! Apart from the names because the same ones stand in brackets, behind an underscore, in a row of their own and in
//! `--columns`.

use strapd_attitude::condition::GyroUnit;
use strapd_attitude::record::AccelUnit;

/// A unit of one role, and what a number in it must be multiplied by first.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Unit {
    /// Unit of a rate.
    Rate(GyroUnit, f64),
    /// Unit of a specific force.
    Force(AccelUnit, f64),
    /// Unit of a magnetic field: tesla in one of it.
    Field(f64),
    /// Unit of a stamp: nanoseconds in one of it.
    Time(f64),
    /// Unit of a temperature: degrees Celsius in one of it, and where it has its zero.
    Temperature(f64, f64),
}

/// Quantity that is measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Quantity {
    Rate,
    Force,
    Field,
    Time,
    Temperature,
}

/// Units of rates as [`plain`] leaves them.
const RATES: [(&str, GyroUnit, f64); 21] = [
    ("rad/s", GyroUnit::Rad, 1.0),
    ("rads-1", GyroUnit::Rad, 1.0),
    ("rad/sec", GyroUnit::Rad, 1.0),
    ("radians/s", GyroUnit::Rad, 1.0),
    ("radps", GyroUnit::Rad, 1.0),
    ("rads", GyroUnit::Rad, 1.0),
    ("rad", GyroUnit::Rad, 1.0),
    ("deg/s", GyroUnit::Deg, 1.0),
    ("degs-1", GyroUnit::Deg, 1.0),
    ("deg/sec", GyroUnit::Deg, 1.0),
    ("degrees/s", GyroUnit::Deg, 1.0),
    ("degrees/sec", GyroUnit::Deg, 1.0),
    ("degps", GyroUnit::Deg, 1.0),
    ("degs", GyroUnit::Deg, 1.0),
    ("deg", GyroUnit::Deg, 1.0),
    ("dps", GyroUnit::Deg, 1.0),
    ("mdps", GyroUnit::Deg, 1e-3),
    ("mdeg/s", GyroUnit::Deg, 1e-3),
    ("mrad/s", GyroUnit::Mrad, 1.0),
    ("mrads-1", GyroUnit::Mrad, 1.0),
    ("mrad", GyroUnit::Mrad, 1.0),
];

const FORCES: [(&str, AccelUnit, f64); 13] = [
    ("m/s2", AccelUnit::MetresPerSecondSquared, 1.0),
    ("ms-2", AccelUnit::MetresPerSecondSquared, 1.0),
    ("m/s/s", AccelUnit::MetresPerSecondSquared, 1.0),
    ("m/sec2", AccelUnit::MetresPerSecondSquared, 1.0),
    ("ms2", AccelUnit::MetresPerSecondSquared, 1.0),
    ("mps2", AccelUnit::MetresPerSecondSquared, 1.0),
    ("mpss", AccelUnit::MetresPerSecondSquared, 1.0),
    ("m/ss", AccelUnit::MetresPerSecondSquared, 1.0),
    ("mss", AccelUnit::MetresPerSecondSquared, 1.0),
    ("g", AccelUnit::StandardGravity, 1.0),
    ("gs", AccelUnit::StandardGravity, 1.0),
    ("gee", AccelUnit::StandardGravity, 1.0),
    ("mg", AccelUnit::StandardGravity, 1e-3),
];

const FIELDS: [(&str, f64); 12] = [
    ("t", 1.0),
    ("tesla", 1.0),
    ("mt", 1e-3),
    ("ut", 1e-6),
    ("microtesla", 1e-6),
    ("nt", 1e-9),
    ("gauss", 1e-4),
    ("g", 1e-4),
    ("mgauss", 1e-7),
    ("mg", 1e-7),
    ("milligauss", 1e-7),
    ("localflux", 1e-4),
];

/// Nanoseconds of a day.
pub(crate) const DAY: f64 = 8.64e13;

const TIMES: [(&str, f64); 26] = [
    ("ns", 1.0),
    ("nsec", 1.0),
    ("nsecs", 1.0),
    ("nanos", 1.0),
    ("nanosecond", 1.0),
    ("nanoseconds", 1.0),
    ("us", 1e3),
    ("usec", 1e3),
    ("usecs", 1e3),
    ("micros", 1e3),
    ("microsecond", 1e3),
    ("microseconds", 1e3),
    ("ms", 1e6),
    ("msec", 1e6),
    ("msecs", 1e6),
    ("millis", 1e6),
    ("millisecond", 1e6),
    ("milliseconds", 1e6),
    ("s", 1e9),
    ("sec", 1e9),
    ("secs", 1e9),
    ("second", 1e9),
    ("seconds", 1e9),
    // A tick of Xsens.
    ("100us", 1e5),
    ("unixtime", 1e9),
    ("days", DAY),
];

const TEMPERATURES: [(&str, f64, f64); 9] = [
    ("c", 1.0, 0.0),
    ("degc", 1.0, 0.0),
    ("celsius", 1.0, 0.0),
    ("degcelsius", 1.0, 0.0),
    ("k", 1.0, -273.15),
    ("kelvin", 1.0, -273.15),
    ("f", 5.0 / 9.0, -160.0 / 9.0),
    ("degf", 5.0 / 9.0, -160.0 / 9.0),
    ("fahrenheit", 5.0 / 9.0, -160.0 / 9.0),
];

/// A unit's text without what writers differ in: case, blanks, brackets, signs of powers and products.
pub(crate) fn plain(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '°' => out.push_str("deg"),
            'µ' | 'μ' => out.push('u'),
            '²' => out.push('2'),
            '⁻' => out.push('-'),
            '¹' => out.push('1'),
            c if c.is_alphanumeric() || c == '/' || c == '-' => out.extend(c.to_lowercase()),
            _ => {}
        }
    }
    out
}

impl Unit {
    /// The unit that a text names, as makers write it.
    pub(crate) fn of(quantity: Quantity, text: &str) -> Option<Unit> {
        // `deg/s*0.0609756`: counts, of which one is so much; without a unit of the SI's.
        if let Some((base, factor)) = text.rsplit_once('*')
            && let Ok(factor) = factor.trim().parse::<f64>()
        {
            let base = match base.trim() {
                "" => Some(Unit::si(quantity)),
                base => Unit::of(quantity, base),
            };
            let is_factor = factor.is_finite() && factor != 0.0;
            return base.filter(|_| is_factor).map(|base| base.times(factor));
        }
        let text = plain(text);
        let named = |name: &&str| **name == *text;
        match quantity {
            Quantity::Rate => {
                let found = RATES.iter().find(|(name, ..)| named(name));
                found.map(|(_, unit, scale)| Unit::Rate(*unit, *scale))
            }
            Quantity::Force => {
                let found = FORCES.iter().find(|(name, ..)| named(name));
                found.map(|(_, unit, scale)| Unit::Force(*unit, *scale))
            }
            Quantity::Field => {
                let found = FIELDS.iter().find(|(name, _)| named(name));
                found.map(|(_, scale)| Unit::Field(*scale))
            }
            Quantity::Time => {
                let found = TIMES.iter().find(|(name, _)| named(name));
                found.map(|(_, nanos)| Unit::Time(*nanos))
            }
            Quantity::Temperature => {
                let found = TEMPERATURES.iter().find(|(name, ..)| named(name));
                found.map(|(_, scale, zero)| Unit::Temperature(*scale, *zero))
            }
        }
    }

    fn si(quantity: Quantity) -> Unit {
        match quantity {
            Quantity::Rate => Unit::Rate(GyroUnit::Rad, 1.0),
            Quantity::Force => Unit::Force(AccelUnit::MetresPerSecondSquared, 1.0),
            Quantity::Field => Unit::Field(1.0),
            Quantity::Time => Unit::Time(1e9),
            Quantity::Temperature => Unit::Temperature(1.0, 0.0),
        }
    }

    fn times(self, factor: f64) -> Unit {
        match self {
            Unit::Rate(unit, scale) => Unit::Rate(unit, scale * factor),
            Unit::Force(unit, scale) => Unit::Force(unit, scale * factor),
            Unit::Field(scale) => Unit::Field(scale * factor),
            Unit::Time(nanos) => Unit::Time(nanos * factor),
            Unit::Temperature(scale, zero) => Unit::Temperature(scale * factor, zero),
        }
    }

    /// The same as `--columns` takes it: by its name, or by a unit and a factor.
    pub(crate) fn stated(self) -> String {
        let (base, factor) = match self {
            Unit::Rate(unit, scale) => (Unit::Rate(unit, 1.0), scale),
            Unit::Force(unit, scale) => (Unit::Force(unit, 1.0), scale),
            Unit::Field(scale) => (Unit::Field(1.0), scale),
            Unit::Time(nanos) => (Unit::Time(1.0), nanos),
            Unit::Temperature(scale, zero) => {
                let mut known = TEMPERATURES.iter();
                let base = known
                    .find(|(_, _, of)| *of == zero)
                    .map_or(1.0, |known| known.1);
                (Unit::Temperature(base, zero), scale / base)
            }
        };
        match self.name() {
            Some(name) => name.to_owned(),
            None => format!("{}*{factor}", base.name().unwrap_or_default()),
        }
    }

    /// Unit as it is said where nobody gave it: by its name, if with the sign changed.
    pub(crate) fn said(self) -> Option<String> {
        let turned = self.times(-1.0);
        let name = |unit: Unit| unit.name();
        name(self)
            .map(str::to_owned)
            .or_else(|| Some(format!("{}*-1", name(turned)?)))
    }

    /// Name in `--columns`; `None` of one that has no name.
    pub(crate) fn name(self) -> Option<&'static str> {
        match self {
            Unit::Rate(unit, scale) => {
                let mut known = RATES.iter();
                known
                    .find(|(_, known, by)| *known == unit && *by == scale)
                    .map(|(name, ..)| *name)
            }
            Unit::Force(unit, scale) => {
                let mut known = FORCES.iter();
                known
                    .find(|(_, known, by)| *known == unit && *by == scale)
                    .map(|(name, ..)| *name)
            }
            Unit::Field(scale) => {
                let mut known = FIELDS.iter();
                known.find(|(_, by)| *by == scale).map(|(name, _)| *name)
            }
            Unit::Time(nanos) => {
                let mut known = TIMES.iter();
                known.find(|(_, by)| *by == nanos).map(|(name, _)| *name)
            }
            Unit::Temperature(scale, zero) => {
                let mut known = TEMPERATURES.iter();
                let found = known.find(|known| (known.1, known.2) == (scale, zero));
                found.map(|(name, ..)| *name)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_known_however_they_are_written() {
        for text in ["rad/s", "rad s^-1", "Rad/s", "rad·s⁻¹", "rad_s-1"] {
            let rad = Some(Unit::Rate(GyroUnit::Rad, 1.0));
            assert_eq!(Unit::of(Quantity::Rate, text), rad, "{text}");
        }
        for text in ["°/s", "deg/s", "dps", "DPS", "deg s^-1"] {
            let deg = Some(Unit::Rate(GyroUnit::Deg, 1.0));
            assert_eq!(Unit::of(Quantity::Rate, text), deg, "{text}");
        }
        for text in ["m/s^2", "m/s²", "m s^-2", "m/(s^2)", "m/(sec^2)", "m/s/s"] {
            let si = Some(Unit::Force(AccelUnit::MetresPerSecondSquared, 1.0));
            assert_eq!(Unit::of(Quantity::Force, text), si, "{text}");
        }
        assert_eq!(Unit::of(Quantity::Field, "µT"), Some(Unit::Field(1e-6)));
        assert_eq!(Unit::of(Quantity::Field, "mG"), Some(Unit::Field(1e-7)));
        assert_eq!(Unit::of(Quantity::Rate, "LSB"), None);
        for (quantity, text, unit, stated) in [
            (
                Quantity::Rate,
                "deg/s*0.0609756",
                Unit::Rate(GyroUnit::Deg, 0.060_975_6),
                "deg/s*0.0609756",
            ),
            (
                Quantity::Rate,
                "*-0.001",
                Unit::Rate(GyroUnit::Rad, -0.001),
                "rad/s*-0.001",
            ),
            (
                Quantity::Force,
                "g*0.5",
                Unit::Force(AccelUnit::StandardGravity, 0.5),
                "g*0.5",
            ),
            (Quantity::Time, "us*4", Unit::Time(4e3), "ns*4000"),
            (
                Quantity::Temperature,
                "C*0.01",
                Unit::Temperature(0.01, 0.0),
                "c*0.01",
            ),
        ] {
            let found = Unit::of(quantity, text);
            assert_eq!(found, Some(unit), "{text}");
            assert_eq!(unit.stated(), stated);
        }
        for text in ["deg/s*0", "deg/s*x", "furlong*2", "deg/s*inf"] {
            assert_eq!(Unit::of(Quantity::Rate, text), None, "{text}");
        }
        assert_eq!(Unit::of(Quantity::Time, "ms"), Some(Unit::Time(1e6)));
    }

    #[test]
    fn every_unit_is_found_again_by_the_name_it_is_given() {
        let quantities = [
            Quantity::Rate,
            Quantity::Force,
            Quantity::Field,
            Quantity::Time,
            Quantity::Temperature,
        ];
        let all = RATES.iter().map(|(name, ..)| *name);
        let all = all.chain(FORCES.iter().map(|(name, ..)| *name));
        let all = all.chain(FIELDS.iter().map(|(name, _)| *name));
        let all = all.chain(TEMPERATURES.iter().map(|(name, ..)| *name));
        for text in all.chain(TIMES.iter().map(|(name, _)| *name)) {
            for quantity in quantities {
                let Some(unit) = Unit::of(quantity, text) else {
                    continue;
                };
                let again = unit.name().and_then(|name| Unit::of(quantity, name));
                assert_eq!(again, Some(unit), "{text}");
            }
        }
    }
}
