//! The settings of an estimation, one row each -> a plan. Pure.
//!
//! A stage of its own because a setting is met as a flag of the command, an argument in Python, a key of a file, a line of
//! the manual and of `docs/settings.md`. All of them are made from its [`Row`], so that a new one is a field of [`EstimationSettings`]
//! and a row of [`ROWS`].
//!
//! ```
//! use strapd_attitude::estimate::settings::{Value, defaults, row};
//!
//! let mut plan = defaults();
//! let max_gap = row("max_gap").expect("there is one");
//! max_gap.apply(&mut plan, &Value::Text("0.2"))?;
//! assert_eq!(plan.max_gap_secs, 0.2);
//! assert_eq!(max_gap.takes.unit(), "s");
//! # Ok::<(), strapd_attitude::diagnostic::Diagnostic>(())
//! ```

mod read;
mod rows;

pub use rows::ROWS;

use super::plan::{Aid, EstimationSettings, Noise};
use super::sensor_calibration::SensorCalibration;
use crate::diagnostic::Diagnostic;
use crate::frames::{Body, Nav, Sensor};
use crate::quaternion::Quaternion;
use crate::setting::{self, Setting};
use std::fmt;
use std::sync::Arc;

/// A setting of an estimation. Its texts name other settings in braces (`{rate_hz}`): see [`named`].
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The setting, by its name.
    pub setting: Setting,
    /// Meaning in one line.
    pub meaning: &'static str,
    /// Effect on the attitude, and what the choice depends on; empty where the meaning says it.
    pub effect: &'static str,
    /// Default.
    pub default: Default,
    /// Environment variable that is read where the setting is not given.
    pub environment: Option<&'static str>,
    /// Placeholder of the value in a usage; empty for a switch.
    pub placeholder: &'static str,
    /// Words that are taken, in any case.
    pub words: &'static [Word],
    /// Values that are taken besides the words.
    pub takes: Takes,
    /// Refuses the setting where a row before it rules it out.
    pub needs: fn(&EstimationSettings) -> Result<(), Diagnostic>,
}

/// Value of a setting that is not given.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Default {
    /// A value that the row takes.
    Value(&'static str),
    /// Absence of a value; the words say what holds then.
    Unset(&'static str),
}

/// A word that a setting takes.
#[derive(Clone, Copy, Debug)]
pub struct Word {
    /// Name.
    pub name: &'static str,
    /// Other spellings that are taken for it.
    pub also: &'static [&'static str],
    /// Meaning in one line.
    pub meaning: &'static str,
    /// Puts it into a plan.
    pub set: fn(&mut EstimationSettings),
}

/// Values that a setting takes besides its words, and how they are put into a plan.
#[derive(Clone, Copy, Debug)]
pub enum Takes {
    /// Nothing but the words.
    Words,
    /// A switch, on or off.
    Switch(fn(&mut EstimationSettings, bool)),
    /// A number.
    Number {
        /// Text before the number, where words precede it.
        before: &'static str,
        /// Unit.
        unit: &'static str,
        /// Least and largest.
        range: (f64, f64),
        /// Puts it into a plan.
        set: fn(&mut EstimationSettings, f64),
    },
    /// A number of samples.
    Count(fn(&mut EstimationSettings, usize)),
    /// Three numbers about the body axes x, y, z, rad/s.
    Rate(fn(&mut EstimationSettings, [f64; 3])),
    /// A factor above 0 of each axis, or one for all.
    Factors(fn(&mut EstimationSettings, [f64; 3])),
    /// A mounting, as a unit quaternion w, x, y, z.
    Mounting(fn(&mut EstimationSettings, Quaternion<Body, Sensor>)),
    /// An attitude: a unit quaternion w, x, y, z, or roll, pitch and yaw in degrees.
    Attitude(fn(&mut EstimationSettings, Quaternion<Nav, Body>)),
    /// A text of its own.
    Text {
        /// Description of the text.
        what: &'static str,
        /// Reads it into a plan.
        set: fn(&mut EstimationSettings, &str) -> Result<(), Diagnostic>,
    },
    /// Figures of noise by their names ([`NOISE_FIGURES`](super::NOISE_FIGURES)).
    Figures(fn(&mut EstimationSettings, Noise)),
    /// A calibration, read from its file by whoever may read files.
    Calibration(fn(&mut EstimationSettings, Arc<SensorCalibration>)),
}

/// A value that is given.
#[derive(Clone, Debug)]
pub enum Value<'a> {
    /// Any value as text, as a person writes it.
    Text(&'a str),
    /// A switch, on or off.
    Switch(bool),
    /// A number.
    Number(f64),
    /// Several numbers.
    Numbers(&'a [f64]),
    /// Figures of noise by name, about the body axes.
    Figures(&'a [(String, [f64; 3])]),
    /// A calibration.
    Calibration(Arc<SensorCalibration>),
}

impl fmt::Display for Value<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Text(text) => f.write_str(text),
            Value::Switch(on) => on.fmt(f),
            Value::Number(number) => number.fmt(f),
            Value::Numbers(numbers) => {
                let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
                f.write_str(&numbers.join(","))
            }
            Value::Figures(_) => f.write_str("figures"),
            Value::Calibration(_) => f.write_str("a calibration"),
        }
    }
}

/// Plan of a run in which nothing is given: every default of [`ROWS`].
#[must_use]
pub fn defaults() -> EstimationSettings {
    EstimationSettings {
        aid: Aid::Auto,
        ..EstimationSettings::default()
    }
}

/// Row of this name.
#[must_use]
pub fn row(name: &str) -> Option<&'static Row> {
    ROWS.iter().find(|row| row.name() == name)
}

/// Plan in which one setting has the value of this text.
///
/// # Errors
/// [`Row::apply`]; the setting is none of an estimation.
pub fn with(setting: Setting, text: &str) -> Result<EstimationSettings, Diagnostic> {
    let mut plan = defaults();
    let row = row(setting.name()).ok_or_else(|| format!("{setting}: is no setting"))?;
    row.apply(&mut plan, &Value::Text(text))?;
    Ok(plan)
}

/// Text of a row with the settings in braces named as this program names them.
#[must_use]
pub fn named(text: &str) -> String {
    let mut parts = text.split(['{', '}']);
    let mut out = parts.next().unwrap_or_default().to_owned();
    while let Some(name) = parts.next() {
        match setting::ALL.iter().find(|one| one.name() == name) {
            Some(one) => out.push_str(&one.to_string()),
            None => out.push_str(name),
        }
        out.push_str(parts.next().unwrap_or_default());
    }
    out
}

impl Takes {
    /// Unit of the values; empty where they have none.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self {
            Takes::Number { unit, .. } => unit,
            Takes::Count(_) => "samples",
            Takes::Rate(_) => "rad/s",
            _ => "",
        }
    }

    /// Description of the values.
    fn expected(&self) -> Option<String> {
        Some(match self {
            Takes::Words => return None,
            Takes::Switch(_) => "true or false".to_owned(),
            Takes::Number {
                before,
                unit,
                range,
                ..
            } => {
                let (least, most) = range;
                let number = match *before {
                    "" => "a number".to_owned(),
                    before => format!("{before}STEP"),
                };
                match (least.is_finite(), most.is_finite()) {
                    (true, true) => format!("{number} from {least} to {most} in {unit}"),
                    _ => format!("{number} above {least} in {unit}"),
                }
            }
            Takes::Count(_) => "a number of samples".to_owned(),
            Takes::Rate(_) => "3 numbers x,y,z in rad/s".to_owned(),
            Takes::Factors(_) => "a factor above 0, or 3 of them x,y,z".to_owned(),
            Takes::Mounting(_) | Takes::Attitude(_) => {
                "4 numbers q=w,x,y,z, or 3 numbers rpy=roll,pitch,yaw in degrees".to_owned()
            }
            Takes::Text { what, .. } => (*what).to_owned(),
            Takes::Figures(_) => read::figures_expected(),
            Takes::Calibration(_) => "a calibration".to_owned(),
        })
    }
}

impl Row {
    /// Name of the setting: that of a field, `max_gap`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        self.setting.name()
    }

    /// Values that the setting takes, in words.
    #[must_use]
    pub fn expected(&self) -> String {
        let words = self.words.iter().map(|word| word.name.to_owned());
        let mut all: Vec<String> = words.chain(self.takes.expected()).collect();
        match all.pop() {
            Some(last) if all.is_empty() => last,
            Some(last) => format!("{}, or {last}", all.join(", ")),
            None => String::new(),
        }
    }

    /// Puts a value into a plan. Rows are applied in the order of [`ROWS`].
    ///
    /// # Errors
    /// Diagnostic that names the setting: the value is none of it, or a setting before it rules it out. What only the plan as
    /// a whole can tell, [`EstimationSettings::check`] refuses.
    pub fn apply(
        &self,
        plan: &mut EstimationSettings,
        value: &Value<'_>,
    ) -> Result<(), Diagnostic> {
        (self.needs)(plan)?;
        let text = value.to_string();
        if let Some(word) = self.word(&text) {
            (word.set)(plan);
            return Ok(());
        }
        let wrong = || self.wrong(&text);
        match self.takes {
            Takes::Words => return Err(wrong()),
            Takes::Switch(set) => match value {
                Value::Switch(on) => set(plan, *on),
                _ => set(plan, text.parse().map_err(|_| wrong())?),
            },
            Takes::Number { before, set, .. } => match value {
                Value::Number(number) => set(plan, *number),
                _ => set(plan, read::number(before, &text).ok_or_else(wrong)?),
            },
            Takes::Count(set) => set(plan, text.parse().map_err(|_| wrong())?),
            Takes::Rate(set) => set(plan, read::numbers(&text).ok_or_else(wrong)?),
            Takes::Factors(set) => set(plan, read::factors(&text).ok_or_else(wrong)?),
            Takes::Mounting(set) => match read::roll_pitch_yaw(&text) {
                Some(q_bs) => set(plan, q_bs),
                None => set(plan, self.quaternion(&text)?),
            },
            Takes::Attitude(set) => match read::roll_pitch_yaw(&text) {
                Some(q_nb) => set(plan, q_nb),
                None => set(plan, self.quaternion(&text)?),
            },
            Takes::Text { set, .. } => set(plan, &text).map_err(|why| why.at(self.setting))?,
            Takes::Figures(set) => match value {
                Value::Figures(figures) => set(plan, read::figures(self.setting, figures)?),
                _ => set(plan, read::list_of_figures(self.setting, &text)?),
            },
            Takes::Calibration(set) => match value {
                Value::Calibration(known) => set(plan, known.clone()),
                _ => return Err(wrong()),
            },
        }
        Ok(())
    }

    fn word(&self, text: &str) -> Option<&Word> {
        let is_meant = |word: &&Word| {
            let mut spellings = std::iter::once(&word.name).chain(word.also);
            spellings.any(|spelling| spelling.eq_ignore_ascii_case(text))
        };
        self.words.iter().find(is_meant)
    }

    fn quaternion<To, From>(&self, text: &str) -> Result<Quaternion<To, From>, Diagnostic> {
        let q = read::numbers(text.strip_prefix("q=").unwrap_or(text));
        read::unit(self.setting, q.ok_or_else(|| self.wrong(text))?)
    }

    fn wrong(&self, text: &str) -> Diagnostic {
        let shown = crate::frames::quoted(text, 40);
        match self.takes {
            Takes::Words => Diagnostic::new(format!("{}: there is no \"{shown}\"", self.setting))
                .help(self.expected()),
            _ => format!("{} {shown}: expected {}", self.setting, self.expected()).into(),
        }
    }
}
