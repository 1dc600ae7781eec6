//! The table of settings -> arguments of a command -> a plan. Pure.
//!
//! A stage of its own because clap derives arguments from the fields of a struct, and a setting is no field here: its name,
//! help, default, words and environment stand in its row ([`ROWS`]), once for every command.

use clap::builder::{
    OsStringValueParser, PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser,
};
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use std::ffi::{OsStr, OsString};
use std::marker::PhantomData;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::settings::{Default, ROWS, Row, Takes, Value, named};
use strapd_attitude::estimate::{EstimationSettings, SensorCalibration};
use strapd_attitude::setting::{
    GYRO_UNIT, MAX_GAP, RATE_HZ, SAMPLE_KIND, SMOOTH, START, Setting, TIME, UNTIL,
};

/// Settings that a command takes.
pub trait Scope: Clone + Send + Sync + std::fmt::Debug + 'static {
    /// Whether this one is among them.
    fn has(setting: Setting) -> bool;
}

/// Settings of every estimation, of a stream too.
#[derive(Clone, Debug)]
pub struct Every;

/// Smoothing, which needs a whole recording.
#[derive(Clone, Debug)]
pub struct Smoothing;

/// Settings of how samples are understood, for a command that estimates no attitude.
#[derive(Clone, Debug)]
pub struct Reading;

impl Scope for Every {
    fn has(setting: Setting) -> bool {
        setting != SMOOTH
    }
}

impl Scope for Smoothing {
    fn has(setting: Setting) -> bool {
        setting == SMOOTH
    }
}

impl Scope for Reading {
    fn has(setting: Setting) -> bool {
        [TIME, RATE_HZ, SAMPLE_KIND, GYRO_UNIT, MAX_GAP, START, UNTIL].contains(&setting)
    }
}

/// Settings as a command was given them, defaults and environment included, in the order of the table.
#[derive(Clone, Debug)]
pub struct Given<S> {
    values: Vec<(&'static Row, OsString)>,
    scope: PhantomData<S>,
}

impl<S: Scope> Given<S> {
    fn rows() -> impl Iterator<Item = &'static Row> {
        ROWS.iter().filter(|row| S::has(row.setting))
    }

    fn value(&self, setting: Setting) -> Option<&OsStr> {
        let mut values = self.values.iter();
        let (_, value) = values.find(|(row, _)| row.setting == setting)?;
        Some(value)
    }

    /// Whether a setting is on, or has this word.
    #[must_use]
    pub fn is(&self, setting: Setting, word: &str) -> bool {
        self.value(setting)
            .is_some_and(|value| value.eq_ignore_ascii_case(word))
    }

    /// Path that a setting names.
    #[must_use]
    pub fn path(&self, setting: Setting) -> Option<&Path> {
        self.value(setting).map(Path::new)
    }

    /// Puts all of them into a plan; the calibration is what its file holds.
    ///
    /// # Errors
    /// [`Row::apply`].
    pub fn put(
        &self,
        plan: &mut EstimationSettings,
        calibration: Option<Arc<SensorCalibration>>,
    ) -> Result<(), Diagnostic> {
        for (row, value) in &self.values {
            let text = value.to_string_lossy();
            let value = match (&row.takes, &calibration) {
                (Takes::Calibration(_), None) => continue,
                (Takes::Calibration(_), Some(known)) => Value::Calibration(known.clone()),
                _ => Value::Text(&text),
            };
            row.apply(plan, &value)?;
        }
        Ok(())
    }
}

impl<S: Scope> Args for Given<S> {
    fn augment_args(command: Command) -> Command {
        command.args(Self::rows().map(argument))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<S: Scope> FromArgMatches for Given<S> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let value = |row: &'static Row| match row.takes {
            Takes::Switch(_) => matches.get_flag(row.name()).then(|| "true".into()),
            _ => matches.get_one::<OsString>(row.name()).cloned(),
        };
        Ok(Given {
            values: Self::rows()
                .filter_map(|row| Some((row, value(row)?)))
                .collect(),
            scope: PhantomData,
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Argument of a row.
fn argument(row: &'static Row) -> Arg {
    let mut help = named(row.meaning);
    let mut argument = Arg::new(row.name())
        .long(row.setting.key())
        .help_heading("Estimation");
    if let Takes::Switch(_) = row.takes {
        argument = argument.action(ArgAction::SetTrue);
    } else {
        match row.default {
            Default::Value(value) => argument = argument.default_value(value),
            Default::Unset(then) => help.push_str(&format!(" [default: {then}]")),
        }
        argument = argument
            .value_parser(OfRow(row))
            .value_name(row.placeholder)
            .ignore_case(true)
            .hide_possible_values(!matches!(row.takes, Takes::Words))
            .allow_negative_numbers(matches!(row.takes, Takes::Number { .. }))
            .allow_hyphen_values(matches!(row.takes, Takes::Rate(_) | Takes::Attitude(_)));
    }
    if let Some(variable) = row.environment {
        argument = argument.env(variable);
    }
    if !row.effect.is_empty() {
        argument = argument.long_help(format!("{help}\n\n{}", named(row.effect)));
    }
    argument.help(help)
}

/// Parser of the words of a setting, for a flag of another command that takes them alone.
pub(super) fn words(setting: Setting) -> PossibleValuesParser {
    let rows = ROWS.iter().filter(|row| row.setting == setting);
    PossibleValuesParser::new(rows.flat_map(possible))
}

fn possible(row: &'static Row) -> impl Iterator<Item = PossibleValue> {
    let words = row.words.iter();
    let words = words.map(|word| {
        let value = PossibleValue::new(word.name).aliases(word.also);
        value.help(named(word.meaning))
    });
    // How what is no word begins, for the completion of shells.
    let others: &'static [&'static str] = match row.takes {
        Takes::Attitude(_) => &["q=", "rpy="],
        _ => &[],
    };
    words.chain(others.iter().map(PossibleValue::new))
}

/// Whether a parser takes a value.
fn checked(
    parser: impl TypedValueParser,
    (command, argument, value): (&Command, Option<&Arg>, &OsStr),
) -> Result<(), clap::Error> {
    parser.parse_ref(command, argument, value).map(drop)
}

/// Parser of a row's values, which refuses what is no word of it, or no number.
#[derive(Clone, Debug)]
struct OfRow(&'static Row);

impl TypedValueParser for OfRow {
    type Value = OsString;

    fn parse_ref(
        &self,
        command: &Command,
        argument: Option<&Arg>,
        value: &OsStr,
    ) -> Result<OsString, clap::Error> {
        let OfRow(row) = self;
        let all = (command, argument, value);
        match row.takes {
            Takes::Words => checked(PossibleValuesParser::new(possible(row)), all),
            Takes::Number { before: "", .. } => checked(|text: &str| text.parse::<f64>(), all),
            Takes::Count(_) => checked(|text: &str| text.parse::<usize>(), all),
            Takes::Calibration(_) => checked(OsStringValueParser::new(), all),
            _ => checked(StringValueParser::new(), all),
        }?;
        Ok(value.to_owned())
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let OfRow(row) = self;
        let has_words = !row.words.is_empty();
        has_words.then(|| Box::new(possible(row)) as Box<dyn Iterator<Item = PossibleValue>>)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use clap::error::ErrorKind;
    use strapd_attitude::estimate::settings::{Word, defaults};
    use strapd_attitude::setting::DELIMITER;

    /// A setting that is nowhere but in this row, under a name that no estimation has.
    static TOY: Row = Row {
        setting: DELIMITER,
        meaning: "Colour of the body, beside {time}",
        effect: "A red one is faster.",
        default: Default::Value("red"),
        environment: Some("STRAPD_TOY"),
        placeholder: "COLOUR",
        words: &[
            Word {
                name: "red",
                also: &["rouge"],
                meaning: "As fire engines are",
                set: |plan| plan.max_gap_secs = 1.0,
            },
            Word {
                name: "blue",
                also: &[],
                meaning: "Slow",
                set: |plan| plan.max_gap_secs = 2.0,
            },
        ],
        takes: Takes::Words,
        needs: |_| Ok(()),
    };

    #[test]
    fn a_row_is_an_argument_with_help_words_default_and_effect_on_the_plan() {
        let command = || Command::new("toy").arg(argument(&TOY));
        let help = command().render_long_help().to_string();
        for part in [
            "--delimiter <COLOUR>",
            "Colour of the body, beside time",
            "A red one is faster.",
            "- red:  As fire engines are",
            "[default: red]",
            "[env: STRAPD_TOY=]",
        ] {
            assert!(help.contains(part), "{part}: {help}");
        }
        let given = |argv: &[&str]| {
            let matches = command().try_get_matches_from(argv)?;
            let value = matches.get_one::<OsString>(TOY.name()).cloned().unwrap();
            let mut plan = defaults();
            let text = value.to_str().unwrap();
            TOY.apply(&mut plan, &Value::Text(text)).unwrap();
            Ok::<f64, clap::Error>(plan.max_gap_secs)
        };
        assert_eq!(given(&["toy"]).unwrap(), 1.0);
        assert_eq!(given(&["toy", "--delimiter", "BLUE"]).unwrap(), 2.0);
        assert_eq!(given(&["toy", "--delimiter", "Rouge"]).unwrap(), 1.0);
        let refused = given(&["toy", "--delimiter", "green"]).unwrap_err();
        assert_eq!(refused.kind(), ErrorKind::InvalidValue);
        assert!(refused.to_string().contains("[possible values: red, blue]"));
    }

    #[test]
    fn every_row_is_an_argument_that_takes_its_default() {
        for row in &ROWS {
            let command = Command::new("one").arg(argument(row));
            let matches = command.try_get_matches_from(["one"]).unwrap();
            match row.default {
                Default::Value(value) => {
                    assert_eq!(matches.get_one::<OsString>(row.name()).unwrap(), value)
                }
                Default::Unset(_) => assert!(
                    matches!(row.takes, Takes::Switch(_))
                        || matches.get_one::<OsString>(row.name()).is_none()
                ),
            }
        }
    }
}
